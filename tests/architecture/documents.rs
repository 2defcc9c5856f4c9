//! The documents speak of what exists.

use crate::sources::{assert_none, contains_word, read, root, shipped};

/// Documents whose paths and names are checked.
const DOCUMENTS: [&str; 5] = [
    "ARCHITECTURE.md",
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
