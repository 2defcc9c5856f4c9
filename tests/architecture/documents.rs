//! The documents refer to files and names that exist.

use std::fs;
use std::path::{Path, PathBuf};

use crate::sources::{assert_none, contains_word, read, root, shipped};

/// Documents whose paths and names are checked, beside the records of [`DECISIONS`].
const DOCUMENTS: [&str; 6] = [
    "ARCHITECTURE.md",
    "docs/paper.md",
    "docs/sources.md",
    "docs/paper.md",
    "docs/symbols.md",
    "docs/paper.md",
];

/// The folder of the decisions: a file for each, and a page with their table.
const DECISIONS: &str = "docs/decisions";

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
    let decisions = pages().into_iter().filter(|page| page.starts_with(DECISIONS));
    for document in DOCUMENTS.map(PathBuf::from).into_iter().chain(decisions) {
        let document = document.to_str().expect("names are UTF-8");
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
fn every_decision_has_the_form_and_its_row_in_the_table() {
    const LABELS: [&str; 4] = ["Context", "Decision", "Rejected", "Consequences"];
    const NEEDED: [&str; 3] = ["Context", "Decision", "Consequences"];
    let table = read(&format!("{DECISIONS}/README.md"));
    let (mut records, mut offences) = (0, Vec::new());
    for page in pages().iter().filter(|page| page.starts_with(DECISIONS)) {
        let name = page.file_name().and_then(|name| name.to_str()).expect("names are UTF-8");
        if name == "README.md" {
            continue;
        }
        records += 1;
        let record = read(page.to_str().expect("names are UTF-8"));
        let number: Option<u32> = name.get(..3).and_then(|digits| digits.parse().ok());
        let title = number.map(|number| format!("# {number}. ")).unwrap_or_default();
        let labels: Vec<&str> = record
            .lines()
            .filter_map(|line| line.strip_prefix("**")?.split_once(".** "))
            .map(|(label, _)| label)
            .collect();
        let places: Vec<_> =
            labels.iter().map(|label| LABELS.iter().position(|known| known == label)).collect();
        let in_order = places.iter().all(Option::is_some) && places.is_sorted_by(|a, b| a < b);
        let whole = NEEDED.iter().all(|needed| labels.contains(needed));
        if !(number.is_some() && record.starts_with(&title) && in_order && whole) {
            offences.push(format!("form: {name}"));
        }
        let row = format!("\n| [{}]({name}) | ", number.unwrap_or_default());
        if !table.contains(&row) {
            offences.push(format!("table: {name}"));
        }
    }
    assert!(records > 30, "only {records} records found: the folder has another form");
    assert_none(
        "docs/decisions: number, context, decision, rejected, consequences, and a row in the table",
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
