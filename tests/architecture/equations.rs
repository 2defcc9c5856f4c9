//! docs/paper.md is complete and correct: each equation has one row, each row refers to existing items.

use std::collections::BTreeMap;

use crate::sources::{CRATES, Source, assert_none, read, root, shipped};

/// Equations of the paper.
const EQUATIONS: u32 = 34;
const MARK: &str = "Implements Eq. (";
const NOWHERE: &str = "not implemented";

/// One row of the index.
struct Row {
    number: u32,
    content: String,
    place: String,
    test: String,
    departure: String,
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for line in read("docs/paper.md").lines() {
        let cells: Vec<&str> = line.trim().trim_matches('|').split('|').map(str::trim).collect();
        let Some(number) = cells[0].strip_prefix('(').and_then(|n| n.strip_suffix(')')) else {
            continue;
        };
        let number = number.parse().unwrap_or_else(|_| panic!("not a number: {line}"));
        let [_, content, place, test, departure] = cells[..] else {
            panic!("not five cells: {line}")
        };
        let [content, place, test, departure] =
            [content, place, test, departure].map(str::to_owned);
        rows.push(Row { number, content, place, test, departure });
    }
    rows
}

/// The paths in backquotes.
fn quoted(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).filter(|path| path.contains("::")).collect()
}

/// File and name of a path such as `plant_dynamics::faults::Effects::rate`.
fn locate(path: &str) -> Option<(String, String)> {
    let mut segments: Vec<&str> = path.split("::").collect();
    let name = segments.pop()?.to_owned();
    let package = segments.first()?;
    let folder = match CRATES.iter().find(|(name, _)| name == package) {
        Some((_, folder)) => (*folder).to_owned(),
        None if *package == "system_tests" => "tests/system".to_owned(),
        None => return None,
    };
    let is_type = |segment: &&str| segment.starts_with(char::is_uppercase);
    let modules: Vec<&str> = segments[1..].iter().copied().filter(|s| !is_type(s)).collect();
    // A test module is in its own file or at the end of the file that it tests.
    for depth in [modules.len(), modules.len().checked_sub(1)?] {
        if depth < modules.len() && modules.last() != Some(&"tests") {
            break;
        }
        let stem = modules[..depth].join("/");
        let candidates = match depth {
            0 => [format!("{folder}/lib.rs"), format!("{folder}/main.rs")],
            _ => [format!("{folder}/{stem}.rs"), format!("{folder}/{stem}/mod.rs")],
        };
        if let Some(file) = candidates.into_iter().find(|file| root().join(file).exists()) {
            return Some((file, name));
        }
    }
    None
}

/// Every mark in the code: equation -> "file::name" of its item.
fn marks() -> BTreeMap<u32, Vec<(String, String)>> {
    let mut marks: BTreeMap<u32, Vec<(String, String)>> = BTreeMap::new();
    for source in shipped() {
        let lines: Vec<&str> = source.text.lines().map(str::trim).collect();
        for (index, line) in lines.iter().enumerate() {
            for (at, _) in line.match_indices(MARK) {
                let digits: String =
                    line[at + MARK.len()..].chars().take_while(char::is_ascii_digit).collect();
                let number = digits.parse().unwrap_or_else(|_| panic!("{}: {line}", source.path));
                let item = (source.path.clone(), item_below(&source, &lines, index));
                marks.entry(number).or_default().push(item);
            }
        }
    }
    marks
}

/// Name of the function or type whose doc comment line `index` belongs to.
fn item_below(source: &Source, lines: &[&str], index: usize) -> String {
    let line = lines[index];
    assert!(line.starts_with("///"), "{}:{}: only a doc comment counts", source.path, index + 1);
    let declaration = lines[index..]
        .iter()
        .find(|line| !line.starts_with("///") && !line.starts_with("#["))
        .unwrap_or_else(|| panic!("{}: nothing below {line}", source.path));
    let words: Vec<&str> = declaration
        .split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|w| !w.is_empty())
        .collect();
    let keyword = words.iter().position(|word| ["fn", "struct", "enum", "const"].contains(word));
    let name = keyword.and_then(|at| words.get(at + 1));
    (*name.unwrap_or_else(|| panic!("{}: no name in {declaration}", source.path))).to_owned()
}

#[test]
fn every_equation_of_the_paper_has_exactly_one_row() {
    let found: Vec<u32> = rows().iter().map(|row| row.number).collect();
    let expected: Vec<u32> = (1..=EQUATIONS).collect();
    assert_eq!(found, expected, "rows of docs/paper.md, in order");
}

#[test]
fn every_row_has_content_place_and_test_or_a_reason() {
    let mut offences = Vec::new();
    for row in rows() {
        let implemented = !row.place.starts_with(NOWHERE);
        let complete = if implemented {
            quoted(&row.place).len() == 1 && !quoted(&row.test).is_empty()
        } else {
            row.departure.len() > 10
        };
        if row.content.len() < 10 || !complete {
            offences.push(format!("({}): {} | {}", row.number, row.place, row.test));
        }
    }
    assert_none("a row is not complete", &offences);
}

#[test]
fn every_implemented_equation_is_marked_once_at_the_place_of_its_row() {
    let marks = marks();
    let mut offences = Vec::new();
    for row in rows() {
        let marked = marks.get(&row.number).cloned().unwrap_or_default();
        let expected: Vec<_> = if row.place.starts_with(NOWHERE) {
            Vec::new()
        } else {
            quoted(&row.place).into_iter().filter_map(locate).collect()
        };
        if marked != expected {
            offences.push(format!("({}): index {expected:?}, code {marked:?}", row.number));
        }
    }
    assert_none("code and docs/paper.md disagree", &offences);
    let unknown: Vec<String> =
        marks.keys().filter(|n| !(1..=EQUATIONS).contains(*n)).map(|n| format!("({n})")).collect();
    assert_none("the paper has no such equation", &unknown);
}

#[test]
fn every_function_and_test_that_the_index_names_exists() {
    let mut offences = Vec::new();
    for row in rows() {
        for path in
            quoted(&row.place).into_iter().chain(quoted(&row.test)).chain(quoted(&row.departure))
        {
            if !exists(path) {
                offences.push(format!("({}): {path}", row.number));
            }
        }
    }
    assert_none("docs/paper.md names what is not there", &offences);
}

fn exists(path: &str) -> bool {
    let Some((file, name)) = locate(path) else { return false };
    let text = read(&file);
    let owner = path.split("::").find(|segment| segment.starts_with(char::is_uppercase));
    let declared = ["fn", "struct", "const", "enum"].iter().any(|keyword| {
        ["(", "<", " ", ":", ";"]
            .iter()
            .any(|after| text.contains(&format!("{keyword} {name}{after}")))
    });
    // Tests that a macro generates are in a list of `name: "argument"`.
    let listed = file.starts_with("tests/") && text.contains(&format!("{name}: \""));
    let owned = owner.is_none_or(|owner| owner == name || text.contains(&format!("impl {owner} ")));
    (declared || listed) && owned
}

#[test]
fn code_refers_only_to_equations_that_the_paper_has() {
    let mut offences = Vec::new();
    for source in shipped() {
        for (number, line) in source.text.lines().enumerate() {
            for (at, mark) in line.match_indices("Eq. (") {
                let digits: String =
                    line[at + mark.len()..].chars().take_while(char::is_ascii_digit).collect();
                if !digits.parse().is_ok_and(|n: u32| (1..=EQUATIONS).contains(&n)) {
                    offences.push(format!("{}:{}: {}", source.path, number + 1, line.trim()));
                }
            }
        }
    }
    assert_none("not an equation of the paper", &offences);
}
