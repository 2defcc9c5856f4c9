//! Ground-station scripts with the real client library, against the real programs.
//!
//! They need a Python that has gcs-scripts/requirements.txt; its path is in TWO_STEP_PYTHON. Without it
//! these tests say so and pass.
#![expect(
    clippy::disallowed_methods,
    reason = "the other side of real programs: sockets, waiting, and the wall clock as bound"
)]

mod programs;

use std::process::Command;

use programs::{Program, free_port};

/// Runs a script against `sitl` at this speed and returns its exit code and output.
fn fly(script: &str, ftc: &str) -> Option<(Option<i32>, String)> {
    let Some(python) = std::env::var_os("TWO_STEP_PYTHON") else {
        eprintln!("skipped: TWO_STEP_PYTHON does not name a Python with pymavlink");
        return None;
    };
    let link = format!("127.0.0.1:{}", free_port());
    let gcs = format!("127.0.0.1:{}", free_port());
    let sitl = Program::start(
        "sitl",
        &["--plant-link", &link, "--gcs", &gcs, "--speed", "10", "--ftc", ftc],
    );
    sitl.wait_for("altitude");
    let path = format!("{}/../gcs-scripts/{script}", env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(python)
        .args([path, "--connect".to_owned(), format!("udpin:{gcs}")])
        .output()
        .expect("TWO_STEP_PYTHON runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    Some((output.status.code(), said))
}

#[test]
fn fly_case1_survives_with_the_compensator() {
    if let Some((code, said)) = fly("fly_case1.py", "armed") {
        assert_eq!(code, Some(0), "{said}");
    }
}

#[test]
fn fly_case2_survives_with_the_compensator() {
    if let Some((code, said)) = fly("fly_case2.py", "armed") {
        assert_eq!(code, Some(0), "{said}");
    }
}

#[test]
fn both_cases_are_lost_without_the_compensator() {
    for script in ["fly_case1.py", "fly_case2.py"] {
        if let Some((code, said)) = fly(script, "off") {
            assert_eq!(code, Some(1), "{said}");
        }
    }
}
