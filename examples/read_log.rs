//! Reads a flight log with the crate `two-step-ulog`: what it holds, and the largest estimated fault acceleration.
//!
//! `cargo run --release -- fly case1 --ulog --out out`, then `cargo run --release --example read_log -- out/flight.ulg`. Every reader
//! of ULog takes these logs, also pyulog, PlotJuggler and Flight Review.

use std::error::Error;
use std::path::Path;

use ulog::reader::Log;

pub fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("usage: read_log FILE.ulg")?;
    print!("{}", summary(Path::new(&path))?);
    Ok(())
}

pub fn summary(path: &Path) -> Result<String, Box<dyn Error>> {
    let log = Log::open(path)?;
    let mut text = String::new();
    for topic in log.topics() {
        text += &format!(
            "{:24} {:6} rows of {} fields\n",
            topic.name(),
            topic.len(),
            topic.fields().len()
        );
    }
    let times_us = log.times_us("control").ok_or("no topic `control`")?;
    for axis in ["z2_roll_rad_s2", "z2_pitch_rad_s2", "z2_yaw_rad_s2"] {
        let values = log.column("control", axis).ok_or(axis)?;
        let largest =
            values.iter().zip(&times_us).max_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs()));
        let (value, time_us) = largest.ok_or("an empty log")?;
        text += &format!("{axis:16} {value:8.3} at {:.3} s\n", *time_us as f64 * 1.0e-6);
    }
    for message in log.texts() {
        text += &format!("{:9.3} s  {}\n", message.timestamp_us as f64 * 1.0e-6, message.text);
    }
    Ok(text)
}
