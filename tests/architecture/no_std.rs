//! The pure crates need neither `std` nor `alloc`.
//!
//! `#![no_std]` alone does not prove it: a dependency may link `std`. The crate under `no_std_proof/`
//! is a final artefact with its own panic handler and without a global allocator, so the compiler refuses to
//! build it as soon as anything below it links `std` (two panic handlers) or `alloc` (no allocator).

use std::path::Path;
use std::process::{Command, Output};
use std::{env, fs};

use crate::sources::{read, root};

/// Builds the proof with `more` lines before its library; a copy, so that the tree stays unchanged and
/// the versions are those of the workspace's lock file.
fn build(name: &str, more: &str) -> Output {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(folder.join("src")).expect("the folder of this test can be written");
    let manifest = read("tests/no_std_proof/Cargo.toml");
    let manifest = manifest.replace("../..", &root().to_string_lossy());
    fs::write(folder.join("Cargo.toml"), manifest).expect("the folder of this test can be written");
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock"))
        .expect("the folder of this test can be written");
    let library = read("tests/no_std_proof/src/lib.rs");
    let library = library.replace("#![no_std]", &format!("#![no_std]\n{more}"));
    fs::write(folder.join("src/lib.rs"), library).expect("the folder of this test can be written");
    Command::new(env::var("CARGO").unwrap_or("cargo".to_owned()))
        .args(["check", "--offline", "--manifest-path"])
        .arg(folder.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(Path::new(env!("CARGO_TARGET_TMPDIR")).join("no_std_target"))
        .env_remove("RUSTFLAGS")
        .output()
        .expect("cargo runs this test, so it can be started")
}

#[test]
fn icd_and_flight_control_need_neither_std_nor_alloc() {
    let pure = build("no_std_proof", "");
    let printed = String::from_utf8_lossy(&pure.stderr);
    assert!(pure.status.success(), "{printed}");
    // The same build has to fail for each of the two, or its success would prove nothing.
    for (name, linked, expected) in [
        ("with_alloc", "extern crate alloc;", "no global memory allocator found"),
        ("with_std", "extern crate std;", "panic_impl"),
    ] {
        let output = build(name, linked);
        let printed = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "`{linked}` went unnoticed");
        assert!(printed.contains(expected), "`{linked}` failed for another reason: {printed}");
    }
}
