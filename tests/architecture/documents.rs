//! The documents refer to files and names that exist.

use std::fs;
use std::path::{Path, PathBuf};

use crate::sources::{assert_none, contains_word, read, root, shipped};

/// Documents whose paths and names are checked.
const DOCUMENTS: [&str; 7] = [
    "ARCHITECTURE.md",
    "docs/parameter-set.md",
    "docs/sources.md",
    "docs/equations.md",
    "docs/symbols.md",
    "docs/decisions.md",
    "docs/claims.md",
];

#[test]
fn every_name_in_the_symbol_dictionary_exists_in_the_code() {
    let sources = shipped();
    let mut names = 0;
    let mut offences = Vec::new();
    for line in read("docs/symbols.md").lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [_, code, _, _] = cells[..] else { panic!("not four cells: {line}") };
        for name in code.split('`').skip(1).step_by(2) {
            names += 1;
            let known = |part: &str| sources.iter().any(|source| contains_word(&source.text, part));
            if !name.split(['.', ':']).filter(|part| !part.is_empty()).all(known) {
                offences.push(name.to_owned());
            }
        }
    }
    assert!(names > 50, "only {names} names found: the dictionary has another form");
    assert_none("docs/symbols.md names what no source has", &offences);
}

#[test]
fn every_file_that_a_document_names_exists() {
    let mut offences = Vec::new();
    for document in DOCUMENTS {
        for word in read(document).split('`').skip(1).step_by(2) {
            let path = word.split("::").next().unwrap_or_default();
            let ending = path.rsplit_once('.').map(|(_, ending)| ending);
            let is_file = matches!(ending, Some("rs" | "toml" | "md" | "py")) && path.contains('/');
            let is_folder = path.ends_with('/') && path.len() > 1 && !path.contains([' ', ':']);
            if (is_file || is_folder) && !path.contains('*') && !root().join(path).exists() {
                offences.push(format!("{document}: {path}"));
            }
        }
    }
    assert_none("no such file", &offences);
}

#[test]
fn every_room_of_the_workspace_is_in_the_images() {
    let manifest = read("Cargo.toml");
    let (_, members) = manifest.split_once("members = [").expect("a list of members");
    let (members, _) = members.split_once(']').expect("its end");
    let sent = read(".dockerignore");
    let is_missing = |room: &&str| !sent.lines().any(|line| line == format!("!{room}"));
    let rooms = members.split('"').skip(1).step_by(2).filter_map(|path| path.split('/').next());
    let missing: Vec<String> = rooms.filter(is_missing).map(str::to_owned).collect();
    assert_none(".dockerignore: every room of the workspace", &missing);
}

#[test]
fn every_decision_has_the_form_and_its_line_in_the_contents() {
    const LABELS: [&str; 5] = ["Status", "Context", "Decision", "Consequence", "Rejected"];
    let page = read("docs/decisions.md");
    let (head, records) = page.split_once("\n## 1. ").expect("the page has a first record");
    let mut offences = Vec::new();
    for (number, record) in (1..).zip(format!("1. {records}").split("\n## ")) {
        let title = record.lines().next().unwrap_or_default();
        let labels: Vec<_> =
            record.split("* **").skip(1).filter_map(|part| part.split_once(":**")).collect();
        let places: Vec<_> =
            labels.iter().map(|(label, _)| LABELS.iter().position(|l| l == label)).collect();
        let in_order = places.iter().all(Option::is_some) && places.is_sorted_by(|a, b| a < b);
        let whole = [1, 2].iter().all(|needed| places.contains(&Some(*needed)));
        if !(title.starts_with(&format!("{number}. ")) && in_order && whole) {
            offences.push(format!("form: {title}"));
        }
        if !head.contains(&format!("* [{title}](#{number}-")) {
            offences.push(format!("contents: {title}"));
        }
    }
    assert_none(
        "docs/decisions.md: number, context, decision, consequence, rejected, and a line in the contents",
        &offences,
    );
}

/// Every page of the documents, from the root of the workspace.
fn pages() -> Vec<PathBuf> {
    let mut pages = Vec::new();
    let mut folders = vec![PathBuf::new(), "docs".into(), "gcs-scripts".into()];
    while let Some(folder) = folders.pop() {
        for entry in
            fs::read_dir(root().join(&folder)).expect("folder").map(|entry| entry.expect("entry"))
        {
            let path = folder.join(entry.file_name());
            if path.extension().is_some_and(|ending| ending == "md") {
                pages.push(path);
            } else if entry.path().is_dir() && !folder.as_os_str().is_empty() {
                folders.push(path);
            }
        }
    }
    pages
}

/// Anchor of a heading in links, as code hosts make it: small letters, no punctuation, blanks to dashes.
fn anchors(page: &str) -> Vec<String> {
    let titles = page.lines().filter(|line| line.starts_with('#'));
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    titles
        .map(|title| title.trim_start_matches('#').trim().to_lowercase())
        .map(|title| title.chars().filter(kept).collect::<String>().replace(' ', "-"))
        .collect()
}

#[test]
fn every_link_between_documents_leads_somewhere() {
    let mut links = 0;
    let mut offences = Vec::new();
    for page in pages() {
        let text = read(page.to_str().expect("names are UTF-8"));
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.contains("://") || link.contains(char::is_whitespace) {
                continue;
            }
            links += 1;
            let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
            let folder = page.parent().unwrap_or(Path::new(""));
            let target = if path.is_empty() { page.clone() } else { folder.join(path) };
            let there = root().join(&target);
            let known = || {
                anchors(&fs::read_to_string(&there).unwrap_or_default()).iter().any(|a| a == anchor)
            };
            if !there.exists() || !(anchor.is_empty() || known()) {
                offences.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(links > 200, "only {links} links found: the pages have another form");
    assert_none("no such page or heading", &offences);
}
