//! The build's fingerprint: a hash of the sources and files that decide what a run becomes, and of the versions of all dependencies.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Beside the workspace's `Cargo.toml`. What draws, serves ground stations or writes logs decides nothing.
const SOURCES: [&str; 15] = [
    "Cargo.lock",
    "icd/data",
    "icd/src",
    "autopilot/flight-control/src",
    "autopilot/flight-management/src",
    "aircraft",
    "scenarios",
    "plant-sim/dynamics/src",
    "plant-sim/src",
    "plant-sim/sensors",
    "lab/engine/src",
    "lab/judges/src",
    "lab/studies/src",
    "lab/campaign/src",
    "autopilot/src/run",
];

fn main() {
    let root = Path::new(&env::var("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("../..");
    let mut hash = Fnv::new();
    for source in SOURCES {
        let path = root.join(source);
        println!("cargo::rerun-if-changed={}", path.display());
        let mut files = Vec::new();
        list(path, &mut files);
        // The order of a folder is that of its file system.
        files.sort();
        for file in files {
            let name = file.strip_prefix(&root).expect("below it").to_string_lossy().into_owned();
            let content = fs::read(&file).expect("it was listed");
            // With its length, so that a byte cannot move from one to the next.
            hash.add(format!("{name} {}\n", content.len()).as_bytes());
            hash.add(&content);
        }
    }
    println!("cargo::rustc-env=TWO_STEP_SOURCES={:016x}", hash.folded());
}

/// The files at a path, apart from what only tests read.
fn list(path: PathBuf, files: &mut Vec<PathBuf>) {
    if path.file_stem().is_some_and(|name| name == "tests") {
        return;
    }
    match fs::read_dir(&path) {
        Ok(entries) => entries.for_each(|entry| list(entry.expect("a folder").path(), files)),
        Err(_) if path.is_file() => files.push(path),
        // A crate built alone names the others by version in its Cargo.toml.
        Err(_) => {}
    }
}

/// FNV-1a with 128 bits: enough to tell two builds apart, without a dependency of the build.
struct Fnv(u128);

impl Fnv {
    const fn new() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(*byte))
                .wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }

    fn folded(&self) -> u128 {
        (self.0 >> 64) ^ (self.0 & u128::from(u64::MAX))
    }
}
