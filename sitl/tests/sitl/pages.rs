//! The commands on the pages: each is one that the program takes, and the flights among them fly.

use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::error::ErrorKind;
use sitl::cli::Cli;

const SITL: &str = env!("CARGO_BIN_EXE_sitl");

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// A command of a page, in words; the first one is the program.
struct PageCommand {
    page: String,
    words: Vec<String>,
    /// In a block of commands, not inside a sentence, which may leave out what the sentence says.
    stands_alone: bool,
}

fn pages() -> Vec<PathBuf> {
    let mut pages = Vec::new();
    for folder in ["", "docs", "examples", "gcs-scripts", "gcs-scripts/qgroundcontrol"] {
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// The words of a line that starts this program, by itself or with Cargo.
fn words(line: &str) -> Option<Vec<String>> {
    let words = shlex::split(line)?;
    let starts_program = words.first().is_some_and(|word| word == "sitl");
    let by_cargo = words.first().is_some_and(|word| word == "cargo")
        && words.get(1).is_some_and(|word| word == "run")
        && !words.iter().any(|word| word == "--example");
    let options = if starts_program {
        1
    } else if by_cargo {
        words.iter().position(|word| word == "--").map_or(words.len(), |at| at + 1)
    } else {
        return None;
    };
    let options =
        words[options..].iter().take_while(|word| !["&", ">"].contains(&word.as_str())).cloned();
    Some(std::iter::once("sitl".to_owned()).chain(options).collect())
}

fn commands() -> Vec<PageCommand> {
    let mut found = Vec::new();
    for path in pages() {
        let page = path.strip_prefix(root()).unwrap().display().to_string();
        let mut add = |line: &str, stands_alone| {
            let command = |words| PageCommand { page: page.clone(), words, stands_alone };
            found.extend(words(line).map(command));
        };
        blocks(&path).iter().for_each(|line| add(line, true));
        for line in fs::read_to_string(&path).unwrap().lines() {
            line.split('`').skip(1).step_by(2).for_each(|quoted| add(quoted, false));
        }
    }
    found
}

#[test]
fn the_program_takes_every_command_of_every_page() {
    let commands = commands();
    assert!(commands.len() > 80, "only {} commands found", commands.len());
    let mut refused = Vec::new();
    for command in &commands {
        let Err(error) = Cli::read(command.words.iter().map(OsString::from)) else { continue };
        let is_short = !command.stands_alone
            && matches!(
                error.kind(),
                ErrorKind::MissingRequiredArgument
                    | ErrorKind::DisplayHelp
                    | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
            );
        // What the sentence says in other words, and what only a shell can fill in.
        let is_open = command.words.iter().any(|word| word == "..." || word.contains('$'));
        if !is_short && !is_open {
            refused.push(format!("{}: {}\n{error}", command.page, command.words.join(" ")));
        }
    }
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// What stands for Cargo on the pages: the program that is built already.
const CARGO: &str = r#"#!/bin/sh
while [ "$1" != -- ]; do shift; done
shift
exec sitl "$@"
"#;

/// Runs those commands of the page's blocks that pass, in their order, in an empty folder. A flight may lose its aircraft: what
/// a page says of that is tested where it is measured.
fn run_page(page: &Path, is_run: fn(&[String]) -> bool) -> Result<usize, String> {
    let folder = tempfile::tempdir().unwrap();
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).unwrap();
    std::os::unix::fs::symlink(SITL, bin.join("sitl")).unwrap();
    fs::write(bin.join("cargo"), CARGO).unwrap();
    fs::set_permissions(bin.join("cargo"), fs::Permissions::from_mode(0o755)).unwrap();
    std::os::unix::fs::symlink(root().join("plant-sim"), folder.path().join("plant-sim")).unwrap();
    // The reader's own aircraft, which begins as a copy.
    fs::copy(root().join("aircraft/f16/airframe.toml"), folder.path().join("my.toml")).unwrap();
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
    let mut runs = 0;
    for line in blocks(page) {
        let is_command = words(&line).is_some_and(|words| is_run(&words));
        if !is_command && !line.starts_with('(') {
            continue;
        }
        let mut shell = Command::new("sh");
        let ended =
            shell.args(["-c", &line]).current_dir(folder.path()).env("PATH", &path).output();
        let ended = ended.unwrap();
        runs += usize::from(is_command);
        let is_lost = String::from_utf8_lossy(&ended.stdout).contains(": lost");
        if !ended.status.success() && !is_lost {
            return Err(format!("{line}\n{}", String::from_utf8_lossy(&ended.stderr)));
        }
    }
    Ok(runs)
}

/// The lines of a page's blocks of shell commands, continued lines joined.
fn blocks(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).unwrap().replace("\\\n", " ");
    let mut block = None;
    let mut lines = Vec::new();
    for line in text.lines() {
        if let Some(language) = line.strip_prefix("```") {
            block = block.xor(Some(language.to_owned()));
        } else if block.as_deref() == Some("sh") {
            lines.push(line.to_owned());
        }
    }
    lines
}

fn run_pages(is_run: fn(&[String]) -> bool) {
    let mut runs = 0;
    let mut failed = Vec::new();
    for page in pages() {
        match run_page(&page, is_run) {
            Ok(more) => runs += more,
            Err(error) => failed.push(format!("{}: {error}", page.display())),
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert!(runs > 10, "only {runs} commands pass the filter");
}

/// One flight, or what one needs before it.
fn is_quick(words: &[String]) -> bool {
    let commands: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
    let is_single = !words.iter().any(|word| word.contains(".."));
    matches!(commands[..], ["fly", ..] | ["aircraft", "linearize" | "new" | "design" | "draw", ..])
        && is_single
}

#[test]
fn the_flights_of_the_pages_fly() {
    run_pages(is_quick);
}

/// Those that end by themselves, but for what needs reference data, shards of other hosts or a processor for itself.
fn ends(words: &[String]) -> bool {
    let commands: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
    let is_here = !words.iter().any(|word| {
        ["DIR", "LOG", "rudder.toml"].contains(&word.as_str()) || word.starts_with('$')
    });
    match commands[..] {
        ["study", "bench" | "compare-checkcases", ..] => false,
        ["fly" | "study" | "campaign" | "aircraft", ..] => is_here,
        _ => false,
    }
}

#[test]
#[ignore = "hours of flights: the nightly workflow runs it"]
fn every_command_of_the_pages_runs() {
    run_pages(ends);
}
