//! `sitl campaign compare` of damaged tables and of those that other programs have written.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::studies::long_or;
use lab_campaign::plan::Plan;
use lab_campaign::spec::SpecFile;
use lab_campaign::store::RunStore;
use lab_campaign::{compare, fly, table};

const SPEC: &str = r#"
name = "small"
duration_s = 2.0
scenario = "nominal"
samples = 2

[[vary]]
key = "plant.wind.turbulence_m_s"
uniform = [0.0, 3.0]

[[law]]
name = "PID alone"
set = { FTC_MODE = 0 }

[[law]]
name = "paper"
set = { FTC_MODE = 1 }
"#;

/// A folder with a table, and its bytes.
fn small(folder: &Path) -> (PathBuf, Vec<u8>) {
    let file = SpecFile::parse("small.toml", SPEC.to_owned(), PathBuf::new()).expect("above");
    let plan = Plan::new(file).expect("a plan");
    let out = folder.join("one");
    let store = RunStore::open(&plan, &out).expect("a new folder");
    let _ = fly::fly(&plan, &store, None).expect("it can be written");
    table::write(&plan, &store, &mut |_| {}).expect("it can be written");
    let bytes = fs::read(out.join(table::RUNS)).expect("a table");
    (out, bytes)
}

/// Bytes from one that is changed to the next; all of them take minutes.
const EVERY: u32 = 11;

/// Bytes of a table, each changed: a text or an error that names the file, never a panic.
#[test]
fn a_changed_byte_of_a_table_is_an_error_that_names_it_or_a_difference() {
    let folder = tempfile::tempdir().expect("a folder");
    let (one, whole) = small(folder.path());
    let other = folder.path().join("other");
    fs::create_dir(&other).expect("a folder");
    let path = other.join(table::RUNS);
    let (mut refused, mut different) = (0, 0);
    let every = long_or(EVERY, 20 * EVERY) as usize;
    for (at, byte) in whole.iter().enumerate().step_by(every) {
        let mut bytes = whole.clone();
        bytes[at] = byte ^ [0xff, 0x01, 0x80][at % 3];
        fs::write(&path, &bytes).expect("a file");
        match compare::folders(&one, &other) {
            Ok(text) => different += u32::from(text.matches("2 of 2 runs").count() < 2),
            Err(error) => {
                let error = error.to_string();
                assert!(error.contains("other"), "byte {at}: {error}");
                refused += 1;
            }
        }
    }
    // As many as every eleventh byte gave.
    let fewer = u32::try_from(every).expect("above") / EVERY;
    assert!(
        fewer * refused > 100 && fewer * different > 10,
        "{refused} refused, {different} different"
    );
    for length in (0..whole.len()).step_by(1_001) {
        fs::write(&path, &whole[..length]).expect("a file");
        let error = compare::folders(&one, &other).expect_err("half a table").to_string();
        assert!(error.contains("runs.parquet"), "{length} bytes: {error}");
    }
}

/// Needs a Python with tests/clients/requirements.txt, named by TWO_STEP_PYTHON; prints a note and passes without.
#[test]
fn a_table_that_pyarrow_or_polars_has_written_is_read_or_its_compression_is_named() {
    let Some(python) = std::env::var_os("TWO_STEP_PYTHON") else {
        eprintln!("skipped: TWO_STEP_PYTHON does not name a Python with pandas and polars");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (one, _) = small(folder.path());
    let write = "import sys, os, pandas, polars\n\
        table = sys.argv[1] + '/runs.parquet'\n\
        for kind in ['snappy', 'gzip', 'zstd', 'brotli', None]:\n    \
            os.mkdir(f'{sys.argv[2]}/{kind}')\n    \
            pandas.read_parquet(table).to_parquet(f'{sys.argv[2]}/{kind}/runs.parquet', compression=kind)\n\
        os.mkdir(sys.argv[2] + '/polars')\n\
        polars.read_parquet(table).write_parquet(sys.argv[2] + '/polars/runs.parquet', compression='snappy')\n";
    let done = Command::new(python).arg("-c").arg(write).args([&one, folder.path()]).output();
    let done = done.expect("TWO_STEP_PYTHON runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    for name in ["snappy", "gzip", "None", "polars"] {
        let text = compare::folders(&one, &folder.path().join(name)).expect(name);
        assert_eq!(
            text.matches("2 of 2 runs are the same to the bit").count(),
            2,
            "{name}: {text}"
        );
    }
    for name in ["zstd", "brotli"] {
        let error = compare::folders(&one, &folder.path().join(name)).expect_err(name).to_string();
        let expected = format!("compressed with {}", name.to_uppercase());
        assert!(error.contains(&expected) && error.contains("SNAPPY and GZIP"), "{error}");
    }
}
