//! No module imports one that imports it, directly or indirectly. Parent and child of one module may.

use std::collections::{BTreeMap, BTreeSet};

use crate::sources::{CRATES, Source, assert_none, files};

/// A module by its names from the root of its crate.
type Path = Vec<String>;

/// The modules of a crate, each with the modules that it names.
fn imports(folder: &str) -> BTreeMap<Path, BTreeSet<Path>> {
    let sources: Vec<_> =
        files(folder, &["rs"]).into_iter().filter(|source| !source.is_test()).collect();
    let module = |source: &Source| -> Path {
        let inside = &source.path[folder.len() + 1..source.path.len() - ".rs".len()];
        let mut path: Path = inside.split('/').map(str::to_owned).collect();
        if path.last().is_some_and(|name| ["lib", "main", "mod"].contains(&name.as_str())) {
            path.pop();
        }
        path
    };
    let modules: BTreeSet<Path> = sources.iter().map(module).collect();
    let mut graph: BTreeMap<Path, BTreeSet<Path>> = BTreeMap::new();
    for source in &sources {
        let from = module(source);
        let code: Vec<&str> = source.code().into_iter().map(|(_, code)| code).collect();
        let uses = graph.entry(from.clone()).or_default();
        for path in paths(&code.join("\n")) {
            if let Some(to) = resolve(&path, &from, &modules).filter(|to| *to != from) {
                uses.insert(to);
            }
        }
    }
    graph
}

/// Every path in a text, with lists in braces expanded.
fn paths(code: &str) -> Vec<Path> {
    let mut found = Vec::new();
    let mut open: Vec<Path> = vec![Vec::new()];
    let mut path: Path = Vec::new();
    let mut word = String::new();
    let mut rest = code.chars().peekable();
    while let Some(c) = rest.next() {
        if c.is_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        if !word.is_empty() {
            path.push(core::mem::take(&mut word));
        }
        match c {
            ':' if rest.peek() == Some(&':') => {
                rest.next();
                if rest.peek() == Some(&'{') {
                    rest.next();
                    open.push(path.clone());
                }
            }
            _ => {
                let prefix = open.last().map_or(0, Vec::len);
                if path.len() > prefix.max(1) {
                    found.push(core::mem::take(&mut path));
                }
                if c == '}' && open.len() > 1 {
                    open.pop();
                }
                let separates = matches!(c, ',' | '\n' | ' ') && open.len() > 1;
                path =
                    if separates { open.last().cloned().unwrap_or_default() } else { Path::new() };
            }
        }
    }
    found
}

/// The innermost module that a path written in `from` refers to.
fn resolve(path: &[String], from: &Path, modules: &BTreeSet<Path>) -> Option<Path> {
    let ups = path.iter().take_while(|name| *name == "super").count();
    let mut whole = match path.first()?.as_str() {
        "crate" => path[1..].to_vec(),
        "self" => [from, &path[1..]].concat(),
        "super" => [&from[..from.len().checked_sub(ups)?], &path[ups..]].concat(),
        child if modules.contains(&[from, &[child.to_owned()][..]].concat()) => {
            [from, path].concat()
        }
        _ => return None,
    };
    while !modules.contains(&whole) {
        whole.pop()?;
    }
    Some(whole)
}

/// Groups of more than one module in which each can reach every other one.
fn circles(graph: &BTreeMap<Path, BTreeSet<Path>>) -> BTreeSet<BTreeSet<Path>> {
    let reach = |start: &Path| {
        let mut reached = BTreeSet::new();
        let mut open = vec![start.clone()];
        while let Some(module) = open.pop() {
            for next in graph.get(&module).into_iter().flatten() {
                let is_kin = next.starts_with(&module) || module.starts_with(next);
                if !is_kin && reached.insert(next.clone()) {
                    open.push(next.clone());
                }
            }
        }
        reached
    };
    let reached: BTreeMap<&Path, BTreeSet<Path>> =
        graph.keys().map(|module| (module, reach(module))).collect();
    let group = |module: &Path| -> BTreeSet<Path> {
        let both =
            |other: &&Path| reached[module].contains(*other) && reached[*other].contains(module);
        graph.keys().filter(both).cloned().collect()
    };
    graph.keys().map(group).filter(|group| group.len() > 1).collect()
}

#[test]
fn no_modules_import_each_other() {
    let (mut found, mut imported) = (Vec::new(), 0);
    for (name, folder) in CRATES {
        let graph = imports(folder);
        imported += graph.values().map(BTreeSet::len).sum::<usize>();
        for circle in circles(&graph) {
            let modules: Vec<String> = circle.iter().map(|module| module.join("::")).collect();
            found.push(format!("{name}: {}", modules.join(", ")));
        }
    }
    assert!(imported > 500, "only {imported} imports found: the test reads them wrongly");
    assert_none("modules import each other", &found);
}

#[test]
fn a_circle_is_found_over_lists_and_parents() {
    let path = |text: &str| -> Path { text.split("::").map(str::to_owned).collect() };
    assert_eq!(
        paths("use crate::a::{b::C, d};\nlet x = super::e::f(1);"),
        [path("crate::a::b::C"), path("crate::a::d"), path("super::e::f")]
    );
    let modules: BTreeSet<Path> = ["a", "a::b", "c"].map(path).into();
    assert_eq!(resolve(&path("super::super::c::X"), &path("a::b"), &modules), Some(path("c")));
    assert_eq!(resolve(&path("b::X"), &path("a"), &modules), Some(path("a::b")));
    let edge = |from, to| (path(from), BTreeSet::from([path(to)]));
    let graph = BTreeMap::from([edge("a", "a::b"), edge("a::b", "c"), edge("c", "a::b")]);
    assert_eq!(circles(&graph).into_iter().next(), Some(BTreeSet::from([path("a::b"), path("c")])));
}
