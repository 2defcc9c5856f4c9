//! Allowed dependencies: section "Dependencies" of ARCHITECTURE.md.

use std::collections::BTreeSet;
use std::env;
use std::process::Command;

use crate::sources::{Source, files, root};

/// Runs `cargo tree` and gives its lines. It fetches what only other systems need, if nothing has before.
fn tree(arguments: &[&str]) -> Vec<String> {
    let cargo = env::var("CARGO").unwrap_or("cargo".to_owned());
    let output = Command::new(cargo)
        .current_dir(root())
        .args(["tree", "--locked", "--prefix", "none"])
        .args(arguments)
        .output()
        .expect("cargo runs this test, so it can be started");
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo tree {arguments:?}: {printed}");
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

fn names(lines: &[String]) -> BTreeSet<String> {
    lines.iter().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

/// Everything that a package is built from, except itself.
fn closure(package: &str) -> BTreeSet<String> {
    let mut names = names(&tree(&["-p", package, "-e", "normal,build"]));
    assert!(names.remove(package), "cargo tree does not know {package}");
    names
}

/// The dependencies in the package's own manifest.
fn direct(package: &str) -> BTreeSet<String> {
    let mut names = names(&tree(&["-p", package, "-e", "normal,build", "--depth", "1"]));
    assert!(names.remove(package), "cargo tree does not know {package}");
    names
}

fn assert_without(package: &str, used: &BTreeSet<String>, forbidden: &[&str]) {
    let found: Vec<_> = forbidden.iter().filter(|name| used.contains(**name)).collect();
    assert!(found.is_empty(), "{package} must not depend on {found:?}");
}

fn assert_only(package: &str, allowed: &[&str]) {
    let direct = direct(package);
    let more: Vec<_> = direct.iter().filter(|name| !allowed.contains(&name.as_str())).collect();
    assert!(more.is_empty(), "{package} depends on {more:?}; allowed is {allowed:?}");
}

/// Crates that wait, send, log, or use the system's entropy: not allowed in the pure crates.
const IMPURE: [&str; 9] =
    ["tokio", "mio", "socket2", "nix", "mavlink", "tracing", "rand", "rand_chacha", "getrandom"];

/// The lab but for its engine and its judges: what writes, draws and asks questions.
const LAB: [&str; 6] =
    ["lab-report", "lab-logs", "lab-paper", "lab-studies", "lab-campaign", "lab-fmu"];

#[test]
fn icd_needs_nothing_but_numbers_and_bytes() {
    assert_only("two-step-icd", &["nalgebra", "libm", "serde", "crc32fast", "arrayvec"]);
    assert_without("two-step-icd", &closure("two-step-icd"), &IMPURE);
}

#[test]
fn flight_control_needs_nothing_but_icd_and_numbers() {
    assert_only(
        "two-step-flight-control",
        &["two-step-icd", "nalgebra", "libm", "serde", "arrayvec"],
    );
    assert_without("two-step-flight-control", &closure("two-step-flight-control"), &IMPURE);
}

#[test]
fn flight_management_knows_no_system_and_no_protocol() {
    let package = "flight-management";
    let own = ["two-step-icd", "two-step-flight-control"];
    let others = ["nalgebra", "libm", "arrayvec", "serde", "toml", "crc32fast", "thiserror"];
    assert_only(package, &[&own[..], &others[..]].concat());
    assert_without(package, &closure(package), &IMPURE);
}

#[test]
fn the_mavlink_services_know_no_system() {
    let used = closure("mavlink-services");
    let forbidden = ["tokio", "mio", "socket2", "nix", "host-io", "recorder", "getrandom"];
    assert_without("mavlink-services", &used, &forbidden);
}

#[test]
fn the_recorder_knows_no_system_and_no_protocol() {
    let used = closure("recorder");
    let forbidden = ["tokio", "mio", "socket2", "nix", "host-io", "mavlink", "mavlink-services"];
    assert_without("recorder", &used, &forbidden);
}

#[test]
fn host_io_knows_no_aircraft() {
    let forbidden = [
        "two-step-icd",
        "two-step-flight-control",
        "autopilot",
        "plant-sim",
        "plant-dynamics",
        "lab-engine",
        "sitl",
        "mavlink",
        "tokio",
    ];
    assert_without("host-io", &closure("host-io"), &forbidden);
}

#[test]
fn the_log_format_knows_no_aircraft() {
    assert_only("two-step-ulog", &["thiserror"]);
}

#[test]
fn autopilot_does_not_know_the_plant() {
    let forbidden = ["plant-sim", "plant-dynamics", "lab-engine", "sitl"];
    assert_without("autopilot", &closure("autopilot"), &forbidden);
}

#[test]
fn plant_does_not_know_the_flight_software() {
    let forbidden = ["autopilot", "two-step-flight-control", "mavlink", "lab-engine", "sitl"];
    assert_without("plant-sim", &closure("plant-sim"), &forbidden);
}

#[test]
fn what_computes_in_the_plant_reads_no_files_and_no_options() {
    let own = ["two-step-icd", "host-io"];
    let others = ["nalgebra", "libm", "rand_chacha", "serde", "serde_json", "arrayvec"];
    assert_only("plant-dynamics", &[&own[..], &others[..], &["thiserror"]].concat());
    let readers = ["plant-sim", "aircraft", "scenarios", "toml", "clap"];
    assert_without("plant-dynamics", &closure("plant-dynamics"), &readers);
}

#[test]
fn the_engine_writes_and_draws_nothing_and_knows_no_system() {
    let judges = ["lab-judges", "sitl", "resvg", "maud", "rayon", "parquet"];
    assert_without("lab-engine", &closure("lab-engine"), &[&judges[..], &LAB].concat());
    let system = ["tokio", "mio", "socket2", "nix", "rustix", "serde_json", "postcard"];
    assert_without("lab-engine", &direct("lab-engine"), &system);
}

#[test]
fn the_judges_draw_nothing_and_know_no_system() {
    let used = closure("lab-judges");
    assert_without("lab-judges", &used, &[&["sitl", "resvg", "maud"][..], &LAB].concat());
    let system = ["tokio", "mio", "socket2", "nix", "rustix", "parquet", "clap", "rayon"];
    assert_without("lab-judges", &direct("lab-judges"), &system);
}

#[test]
fn tables_and_report_know_no_aircraft_and_they_alone_know_parquet_and_pictures() {
    assert_only("lab-tables", &["host-io", "parquet", "toml"]);
    let drawing =
        ["libm", "resvg", "ttf-parser", "epaint_default_fonts", "maud", "rayon", "indicatif"];
    assert_only("lab-report", &[&["host-io"][..], &drawing].concat());
    for package in LAB.into_iter().filter(|package| *package != "lab-report").chain(["sitl"]) {
        assert_without(package, &direct(package), &["parquet", "resvg", "indicatif"]);
    }
}

#[test]
fn the_lab_knows_neither_the_launcher_nor_the_system() {
    // The autopilot that it flies depends on tokio and sockets; it must not use them itself.
    for package in LAB {
        assert_without(package, &closure(package), &["sitl", "crossterm"]);
        let forbidden = ["tokio", "mio", "socket2", "nix", "rustix"];
        assert_without(package, &direct(package), &forbidden);
    }
}

#[test]
fn the_interface_of_c_is_outside_what_flies() {
    // It is the one crate with unsafe code that is no test, so nothing that flies may depend on it.
    assert_only("two-step-fmu", &["host-io", "lab-fmu"]);
    for package in LAB.into_iter().chain(["sitl", "autopilot", "plant-sim", "lab-engine"]) {
        assert_without(package, &closure(package), &["two-step-fmu"]);
    }
    let manifests =
        files("", &["toml"]).into_iter().filter(|file| file.path.ends_with("Cargo.toml"));
    let own_lints = |file: &Source| file.text.contains("unsafe_code = \"deny\"");
    let exceptions: Vec<String> = manifests.filter(own_lints).map(|file| file.path).collect();
    assert_eq!(exceptions, ["fmu/Cargo.toml", "python/Cargo.toml", "tests/Cargo.toml"]);
}

#[test]
fn only_the_mavlink_services_name_mavlink_as_a_dependency() {
    assert!(direct("mavlink-services").contains("mavlink"), "the rule looks for the wrong name");
    let others = [
        "two-step-icd",
        "host-io",
        "two-step-flight-control",
        "flight-management",
        "recorder",
        "autopilot",
    ];
    let lab = ["plant-sim", "lab-engine", "lab-judges", "sitl"].into_iter().chain(LAB);
    for package in others.into_iter().chain(lab) {
        assert_without(package, &direct(package), &["mavlink", "mavlink-core"]);
    }
}

#[test]
fn the_mavlink_crate_brings_no_own_sockets() {
    // It is used as a codec only: its connections know a single peer and swallow errors.
    let lines = tree(&["--workspace", "-e", "normal,build,dev", "-f", "{p} [{f}]"]);
    let features: Vec<_> = lines.iter().filter(|line| line.starts_with("mavlink v")).collect();
    assert!(!features.is_empty(), "mavlink is not in the tree");
    for line in features {
        for feature in ["transport", "tokio"] {
            assert!(!line.contains(feature), "feature {feature} is on: {line}");
        }
    }
}

#[test]
fn no_crate_turns_on_std_in_nalgebra() {
    // It would change result bits for every crate in the build.
    let lines = tree(&["--workspace", "-e", "normal,build,dev", "-f", "{p} [{f}]"]);
    let nalgebra: Vec<_> = lines.iter().filter(|line| line.starts_with("nalgebra v")).collect();
    assert!(!nalgebra.is_empty(), "nalgebra is not in the tree");
    for line in nalgebra {
        let (_, features) = line.split_once('[').unwrap_or_default();
        let features: Vec<&str> = features.split([']', ',']).collect();
        assert!(!features.contains(&"std"), "std is on: {line}");
        assert!(features.contains(&"libm-force"), "libm-force is off: {line}");
    }
}

/// `cargo deny check` knows more and runs each night; what `cargo tree` tells is checked with each change.
#[test]
fn every_dependency_has_a_licence_that_deny_toml_accepts_and_comes_from_the_registry() {
    let deny = std::fs::read_to_string(root().join("deny.toml")).expect("deny.toml");
    let (_, list) = deny.split_once("\nallow = [").expect("a list of licences");
    let (list, rest) = list.split_once(']').expect("an end of the list");
    let accepted: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    assert!(accepted.contains(&"MIT"), "{accepted:?}");
    let whole = ["--workspace", "--all-features", "--target", "all", "--no-dedupe"];
    let lines = tree(&[&whole[..], &["--format", "{p}|{l}"]].concat());
    let lines: BTreeSet<_> = lines.into_iter().filter(|line| !line.is_empty()).collect();
    assert!(lines.len() > 200, "{} packages", lines.len());
    for line in &lines {
        let (package, licence) = line.rsplit_once('|').expect("package and licence");
        let name = package.split(' ').next().unwrap_or_default();
        let place = package.split('(').nth(1).filter(|place| !place.starts_with("proc-macro"));
        let own = root().display().to_string();
        assert!(
            place.is_none_or(|place| place.starts_with(&own)),
            "{package}: not of the registry"
        );
        let exception = rest.contains(&format!("crate = \"{name}\", allow = [\"{licence}\"]"));
        let one = |either: &str| {
            either
                .split(" OR ")
                .flat_map(|each| each.split('/'))
                .any(|each| accepted.contains(&each.trim()))
        };
        let all = licence.split(" AND ").all(|each| one(each.trim_matches(['(', ')'])));
        assert!(place.is_some() || all || exception, "{package}: licence {licence:?}");
    }
    let features = tree(&[&whole[..4], &["--edges", "normal,build,dev,features"]].concat());
    let std = features.iter().find(|line| line.starts_with("nalgebra feature \"std\""));
    assert_eq!(std, None, "`std` changes nalgebra's bits");
}
