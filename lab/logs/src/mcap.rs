//! A flight log as an MCAP file for Foxglove and other viewers: the aircraft in three dimensions, its track, events, and every
//! signal of the log.
//!
//! ```text
//! log ─> Flight ─> channels: rows by time, and a message from each ─┐
//! geometry.toml ─────────^            in the order of time ─> file <┘
//! ```
//!
//! The times are those of the simulation, from zero. A message of a signal is in a message type of its own, whose fields have
//! the names of the log.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::PathBuf;

use aircraft::GEOMETRIES;
use clap::Args;
use host_io::file;
use host_io::print_line;
use host_io::problem::{At as _, Problem, problem};
use lab_engine::configuration::Named;
use lab_engine::geometry::AircraftGeometry;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use ulog::reader::Log;

mod channels;
mod foxglove;
mod protobuf;
mod scene;

use channels::{Channel, channels};

use crate::plot::events;
use crate::plot::flight::Flight;
use crate::replay;

/// By this beginning of a file the program knows its own: magic, and the header's record with the library.
pub const MARK: &[u8] = b"\x89MCAP0\r\n\x01\x10\0\0\0\0\0\0\0\0\0\0\0\x08\0\0\0Two-Step";
const LIBRARY: &str = "Two-Step";
const ENCODING: &str = "protobuf";

/// Options of `sitl log mcap`.
#[derive(Debug, Args)]
pub struct McapArgs {
    /// The flight log (.ulg)
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// The MCAP file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Geometry of the aircraft [default: of the aircraft with the log's name that comes with the program]
    #[arg(long, value_name = "FILE")]
    geometry: Option<PathBuf>,
}

/// Writes the flight of a log.
pub fn run(args: &McapArgs) -> Result<(), Problem> {
    let name = args.log.display();
    let log = replay::open_log(&args.log).at(&name)?;
    let damages: Vec<_> = log.damages().iter().map(|damage| format!("damaged: {damage}")).collect();
    let cut = log.is_cut().then(|| "the log was cut off; its readable part is written".to_owned());
    let flight = Flight::new(log).at(&name)?;
    let geometry = match &args.geometry {
        Some(path) => Named::read(path)?,
        None => shipped_geometry(&flight).at(&name)?,
    };
    let geometry = AircraftGeometry::from_toml(&geometry.name, &geometry.text, &flight.effectors)?;
    let (bytes, flight) = of_flight(flight, &geometry).at(&name)?;
    file::write(&args.out, &bytes, MARK).at(format_args!("--out {}", args.out.display()))?;
    print_line!("wrote {}", args.out.display());
    for remark in damages.into_iter().chain(cut).chain(flight.not_drawn()) {
        print_line!("note: {remark}");
    }
    Ok(())
}

/// The geometry of the aircraft that the log names.
fn shipped_geometry(flight: &Flight) -> Result<Named, Problem> {
    let Some(plant) = &flight.plant else {
        return Err(problem!(
            "it has no readable plant_header, which names the aircraft; name its geometry with --geometry FILE"
        ));
    };
    let name = plant.setup.airframe.name.as_str();
    let shipped = GEOMETRIES.iter().find(|(known, _)| *known == name);
    let Some((known, text)) = shipped else {
        return Err(problem!(
            "its aircraft is {name:?}; geometries come with the program for {}, so name one with --geometry FILE",
            file::names(GEOMETRIES)
        ));
    };
    Ok(Named::shipped(known, text))
}

/// The MCAP file of a log.
pub fn file(log: Log, geometry: &AircraftGeometry) -> Result<Vec<u8>, Problem> {
    Ok(of_flight(Flight::new(log)?, geometry)?.0)
}

fn of_flight(
    mut flight: Flight,
    geometry: &AircraftGeometry,
) -> Result<(Vec<u8>, Flight), Problem> {
    if !flight.has("truth") {
        return Err(problem!(
            "it has no truth, from which the aircraft and its surfaces are shown"
        ));
    }
    events::find(&mut flight);
    let bytes = written(&channels(&flight, geometry)?)?;
    Ok((bytes, flight))
}

/// The file: all messages in the order of time, those of one time in the order of the channels.
fn written(channels: &[Channel<'_>]) -> Result<Vec<u8>, Problem> {
    // Compression would be another dependency, in C, for files that are made again from the log.
    let options = WriteOptions::new().library(LIBRARY).compression(None).disable_seeking(true);
    let mut writer = options.create(NoSeek::new(Cursor::new(Vec::new())))?;
    let mut order = Vec::new();
    for (index, channel) in channels.iter().enumerate() {
        let schema = writer.add_schema(&channel.schema_name, ENCODING, &channel.schema)?;
        let id = writer.add_channel(schema, &channel.topic, ENCODING, &BTreeMap::new())?;
        order.extend(channel.rows.iter().map(|(us, row)| (*us, index, id, *row)));
    }
    order.sort_unstable();
    for (sequence, (us, index, channel_id, row)) in (0..).zip(order) {
        let time = us.saturating_mul(1_000);
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &(channels[index].message)(us, row))?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner().into_inner())
}

#[cfg(test)]
mod tests;
