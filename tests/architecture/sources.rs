//! The sources for the rules: the list of files, and which of their lines are code.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Folders of the crates that ship, from the root of the workspace.
pub const CRATES: [(&str, &str); 23] = [
    ("icd", "icd/src"),
    ("host_io", "host-io/src"),
    ("ulog", "ulog/src"),
    ("flight_control", "autopilot/flight-control/src"),
    ("flight_management", "autopilot/flight-management/src"),
    ("mavlink_services", "autopilot/mavlink-services/src"),
    ("recorder", "autopilot/recorder/src"),
    ("autopilot", "autopilot/src"),
    ("plant_dynamics", "plant-sim/dynamics/src"),
    ("plant_sim", "plant-sim/src"),
    ("aircraft", "aircraft"),
    ("scenarios", "scenarios"),
    ("studies", "studies"),
    ("lab_engine", "lab/engine/src"),
    ("lab_fmu", "lab/fmu/src"),
    ("lab_judges", "lab/judges/src"),
    ("lab_report", "lab/report/src"),
    ("lab_tables", "lab/tables/src"),
    ("lab_logs", "lab/logs/src"),
    ("lab_paper", "lab/paper/src"),
    ("lab_studies", "lab/studies/src"),
    ("lab_campaign", "lab/campaign/src"),
    ("sitl", "sitl/src"),
];

/// One source file.
pub struct Source {
    /// From the root of the workspace, with `/`.
    pub path: String,
    pub text: String,
}

/// Root of the workspace.
///
/// Read when the test runs, so that the rules can be tried on a copy of the tree.
pub fn root() -> PathBuf {
    let manifest = env::var("CARGO_MANIFEST_DIR").unwrap_or(env!("CARGO_MANIFEST_DIR").to_owned());
    Path::new(&manifest).parent().expect("the package lies inside the workspace").to_path_buf()
}

/// A text file of the repository; the test fails if it does not exist.
pub fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The Rust files of the crates that ship.
pub fn shipped() -> Vec<Source> {
    let mut sources = Vec::new();
    for (_, folder) in CRATES {
        sources.extend(files(folder, &["rs"]));
    }
    assert!(
        sources.len() > 50,
        "only {} sources found: the rules would look at nothing",
        sources.len()
    );
    sources
}

/// All files under `folder` with one of these endings, sorted by path.
pub fn files(folder: &str, endings: &[&str]) -> Vec<Source> {
    let mut found = Vec::new();
    collect(&root().join(folder), endings, &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

fn collect(folder: &Path, endings: &[&str], found: &mut Vec<Source>) {
    for entry in
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
    {
        let path = entry.expect("an entry of a folder that is being read").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            if name != "target" && name != "out" && !name.starts_with('.') && name != "__pycache__"
            {
                collect(&path, endings, found);
            }
        } else if path.extension().is_some_and(|ending| endings.iter().any(|e| ending == *e)) {
            let relative = path.strip_prefix(root()).expect("the walk starts at the root");
            let relative = relative.to_string_lossy().replace('\\', "/");
            let text =
                fs::read_to_string(&path).unwrap_or_else(|error| panic!("{relative}: {error}"));
            found.push(Source { path: relative, text });
        }
    }
}

impl Source {
    /// Files that only tests compile.
    pub fn is_test(&self) -> bool {
        self.path.ends_with("/tests.rs")
            || self.path.ends_with("/testing.rs")
            || self.path.contains("/src/") && self.path.contains("/tests/")
    }

    /// Lines before the file's own test module; none for a file that only tests compile.
    pub fn lines(&self) -> Vec<(usize, &str)> {
        let lines: Vec<&str> = self.text.lines().collect();
        let tests = lines.windows(2).position(|pair| {
            pair[0].trim() == "#[cfg(test)]" && pair[1].trim_start().starts_with("mod tests")
        });
        let end = if self.is_test() { 0 } else { tests.unwrap_or(lines.len()) };
        lines[..end].iter().enumerate().map(|(index, line)| (index + 1, *line)).collect()
    }

    /// The same without comments.
    pub fn code(&self) -> Vec<(usize, &str)> {
        let without_comment = |(number, line)| {
            let line: &str = line;
            let end =
                line.find("//").filter(|at| !line[..*at].ends_with(':')).unwrap_or(line.len());
            (number, &line[..end])
        };
        self.lines()
            .into_iter()
            .map(without_comment)
            .filter(|(_, code)| !code.trim().is_empty())
            .collect()
    }

    /// Where code contains one of the words as a whole path segment, as `path:line: text`.
    pub fn uses(&self, words: &[&str]) -> Vec<String> {
        let mut found = Vec::new();
        for (number, code) in self.code() {
            for word in words {
                if contains_word(code, word) {
                    found.push(format!("{}:{number}: {}", self.path, code.trim()));
                }
            }
        }
        found
    }
}

/// Whether `word` occurs in `code` without an identifier character directly before or after it.
pub fn contains_word(code: &str, word: &str) -> bool {
    let identifier = |c: char| c.is_alphanumeric() || c == '_';
    let starts_open = word.starts_with(identifier);
    let ends_open = word.ends_with(identifier);
    code.match_indices(word).any(|(at, _)| {
        let before = code[..at].chars().next_back().is_some_and(identifier);
        let after = code[at + word.len()..].chars().next().is_some_and(identifier);
        !(starts_open && before || ends_open && after)
    })
}

/// Fails with the list unless it is empty.
pub fn assert_none(rule: &str, offences: &[String]) {
    assert!(offences.is_empty(), "{rule}:\n  {}", offences.join("\n  "));
}
