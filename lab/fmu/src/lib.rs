//! `sitl aircraft fmu`: plant and autopilot as co-simulation FMUs of FMI 3.0.
//!
//! ```text
//! SetupOptions ─> SideSetup ─> Description, setup.json, library ─> FILE.fmu
//!                                               importer ─> crate two-step-fmu (the C interface) ─> FmuInstance
//! ```
//!
//! Which variables there are depends on the aircraft, so this crate writes the model description, and the same [`FmuInstance`] answers
//! for it in the library.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use host_io::problem::{At as _, Problem, problem};
use host_io::{file, print_line};
use lab_engine::{FlightSetup, SetupOptions};
use scenarios::SCENARIOS;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

pub mod autopilot;
pub mod description;
pub mod instance;
pub mod plant;
pub mod setup;
pub mod variables;

pub use instance::FmuInstance;
pub use setup::SideSetup;
pub use variables::FmuValue;

use crate::autopilot::AutopilotSetup;
use description::Description;

/// First file of an FMU.
const DESCRIPTION_FILE: &str = "modelDescription.xml";
/// Largest library, bytes.
const LIBRARY_MAX: u64 = 1_000_000_000;

/// Options of `sitl aircraft fmu`.
#[derive(Debug, Clone, clap::Args)]
pub struct FmuArgs {
    /// Aircraft, settings, laws, steps.
    #[command(flatten)]
    pub options: SetupOptions,
    #[arg(
        long, value_name = "NAME|FILE", default_value = "nominal",
        help = format!("What is flown: {}, or a file", file::names(SCENARIOS))
    )]
    scenario: String,
    /// The autopilot instead of the plant
    #[arg(long)]
    autopilot: bool,
    /// The library of crate two-step-fmu [default: beside this program, or in ../lib]
    #[arg(long, value_name = "FILE")]
    library: Option<PathBuf>,
    /// The FMU
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Writes the FMU; `program` is this one.
pub fn run(args: &FmuArgs, program: &Path) -> Result<(), Problem> {
    let flight = args.options.setup(&args.scenario)?;
    let path = args.library.clone().unwrap_or_else(|| library_of(program));
    let library = file::read(&path, LIBRARY_MAX).map_err(|error| {
        problem!(
            "{}: {error}; `cargo build --release -p sitl -p two-step-fmu` makes the library, and --library FILE names it",
            path.display()
        )
    })?;
    let archive = archive(&flight, args.autopilot, &library)?;
    file::write(&args.out, &archive, DESCRIPTION_FILE.as_bytes()).at(args.out.display())?;
    print_line!("wrote {}", args.out.display());
    Ok(())
}

/// The library as built, beside the program, or as a wheel installs it.
fn library_of(program: &Path) -> PathBuf {
    let name = format!("{DLL_PREFIX}two_step_fmu{DLL_SUFFIX}");
    let installed = program.with_file_name("../lib").join(&name);
    if installed.is_file() { installed } else { program.with_file_name(name) }
}

/// The bytes of an FMU; the same setup and library give the same ones.
fn archive(flight: &FlightSetup, is_autopilot: bool, library: &[u8]) -> Result<Vec<u8>, Problem> {
    let airframe = flight.plant.airframe.name;
    let (kind, side) = match is_autopilot {
        true => ("autopilot", SideSetup::Autopilot(Box::new(AutopilotSetup::of(flight)?))),
        false => ("plant", SideSetup::Plant(Box::new(flight.plant.clone()))),
    };
    let setup = side.to_json()?;
    let instance = FmuInstance::new(side)?;
    // A name in C.
    let is_letter = |c: char| c.is_ascii_alphanumeric();
    let identifier = format!("two_step_{airframe}_{kind}").replace(|c| !is_letter(c), "_");
    let description = Description {
        model_name: &format!("{airframe} {kind}"),
        identifier: &identifier,
        token: &setup::token_of(&setup),
        about: match is_autopilot {
            true => "Two-Step autopilot: commands of a step from the sensors at its beginning",
            false => "Two-Step plant: aircraft, air, Earth, sensors and faults",
        },
        duration_s: flight.duration.as_seconds(),
    };
    let xml = description.xml(&instance);
    let binary = format!("binaries/{PLATFORM}/{identifier}{DLL_SUFFIX}");
    let resource = format!("resources/{}", setup::SETUP_FILE);
    // Without the time of writing, so that the bytes depend on nothing else.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let files = [
        (DESCRIPTION_FILE, xml.as_bytes(), options),
        (&*binary, library, options.unix_permissions(0o755)),
        (&*resource, setup.as_bytes(), options),
    ];
    for (name, content, options) in files {
        archive.start_file(name, options)?;
        archive.write_all(content)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// Name of this platform in an FMU.
const PLATFORM: &str = match (cfg!(target_arch = "aarch64"), cfg!(target_os = "macos")) {
    (false, false) => "x86_64-linux",
    (false, true) => "x86_64-darwin",
    (true, false) => "aarch64-linux",
    (true, true) => "aarch64-darwin",
};

#[cfg(test)]
mod tests;
