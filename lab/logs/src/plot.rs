//! The standard figures of any flight, from its log into one page that opens without a network.

use host_io::print_line;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use host_io::file;
use ulog::reader::Log;

mod errors;
pub(crate) mod events;
pub(crate) mod flight;
mod page;
mod panels;

use flight::Flight;

use crate::replay;
use lab_report::page::GENERATOR;

/// Options of `sitl log plot`.
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// The flight log (.ulg)
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// The page [default: the log's name with .html]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Draws the flight of a log.
///
/// # Errors
/// a log that cannot be read, or a page that cannot be written.
pub fn run(args: &PlotArgs) -> Result<(), Box<dyn Error>> {
    let name = args.log.display();
    let log = replay::open_log(&args.log).map_err(|error| format!("{name}: {error}"))?;
    let title = args.log.file_name().map_or_else(String::new, |n| n.display().to_string());
    let out = args.out.clone().unwrap_or_else(|| args.log.with_extension("html"));
    if is_same_file(&args.log, &out) {
        return Err(
            format!("--out {}: this is the log, which stays as it is", out.display()).into()
        );
    }
    let page = page(&title, log, None).map_err(|error| format!("{name}: {error}"))?;
    file::write(&out, page.html.as_bytes(), GENERATOR.as_bytes())
        .map_err(|problem| format!("--out {}: {problem}", out.display()))?;
    print_line!("wrote {}", out.display());
    for remark in page.not_drawn {
        print_line!("note: {remark}");
    }
    Ok(())
}

/// Both paths lead to one file that is there, also over links.
fn is_same_file(a: &Path, b: &Path) -> bool {
    fs::canonicalize(a).is_ok_and(|a| fs::canonicalize(b).is_ok_and(|b| a == b))
}

/// A page of figures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The page.
    pub html: String,
    /// What the log has and the page does not, and why; it is on the page, too.
    pub not_drawn: Vec<String>,
}

/// The page of a log; `title` is the name of its file, `own_law` that of the law of the program where it flew: a log does not have it.
///
/// # Errors
/// [`NothingToDraw`] if the log has no row with a time.
pub fn page(title: &str, log: Log, own_law: Option<&str>) -> Result<Page, NothingToDraw> {
    let mut flight = Flight::new(log)?;
    events::find(&mut flight);
    Ok(Page { html: page::page(title, &flight, own_law), not_drawn: flight.not_drawn() })
}

/// The page of the bytes of a file, whatever they are. It ends, and needs memory as the bytes are long.
pub fn of_bytes(bytes: Vec<u8>) -> Result<Page, Box<dyn Error>> {
    Ok(page("log", Log::from_bytes(bytes)?, None)?)
}

/// A log without a tick.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is nothing to draw: the log has no row of sensors, control or truth")]
pub struct NothingToDraw;

#[cfg(test)]
mod tests;
