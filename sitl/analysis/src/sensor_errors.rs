//! The errors of each sensor in a flight, over time: `sitl study sensors`.
//!
//! Two aircraft fly the same steady flight, one with exact sensors and one with those of the grade. An error is the difference of a
//! sample from the exact one of the time at which it was measured, so a delay is no error.

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use icd::units::DEG;
use icd::{Actuators, Sensors};
use plant_sim::io::whole;
use plant_sim::{GradeName, Plant, SensorSettings};

use crate::builder::SetupOptions;
use crate::chart::panel::{Curve, Panel};
use crate::chart::{Figure, Ink, Pattern, sheet, write_figure};
use crate::configuration::AircraftArgs;
use crate::settings::Target;

/// Longest flight, s.
const SECONDS_MAX: f64 = 3_600.0;
/// Time between two rows, s.
const ROW_EVERY_S: f64 = 0.1;

/// Options of `sitl study sensors`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct SensorErrorsArgs {
    /// Grade of the sensors
    #[arg(long, value_name = "ideal|tactical|consumer", value_parser = grade)]
    pub grade: GradeName,
    /// Duration of the flight, s
    #[arg(long, value_name = "S", default_value_t = 120.0, allow_hyphen_values = true, value_parser = crate::configuration::up_to(SECONDS_MAX, "s"))]
    pub seconds: f64,
    /// Seed of the random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
    /// Aircraft and settings.
    #[command(flatten)]
    pub aircraft: AircraftArgs,
    /// Folder for sensors.csv and the picture
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Parser of the grade of the sensors.
pub(crate) fn grade(text: &str) -> Result<GradeName, String> {
    let found = GradeName::ALL.into_iter().find(|grade| grade.key() == text);
    found.ok_or_else(|| "expected ideal, tactical or consumer".to_owned())
}

/// One panel: title, unit, size of the unit in SI units, and its curves: name and place in [`Sensors::NAMES`].
type Row = (&'static str, &'static str, f64, &'static [(&'static str, usize)]);

const ROWS: [Row; 8] = [
    (
        "gyro",
        "deg/s",
        DEG,
        &[("x, north, angle of attack", 0), ("y, east, sideslip", 1), ("z, down", 2)],
    ),
    ("accelerometer", "m/s²", 1.0, &[("x", 3), ("y", 4), ("z", 5)]),
    ("GNSS, position", "m", 1.0, &[("north", 13), ("east", 14), ("down", 15)]),
    ("GNSS, velocity", "m/s", 1.0, &[("north", 10), ("east", 11), ("down", 12)]),
    ("barometer, altitude", "m", 1.0, &[("altitude", 18)]),
    ("pitot tube, airspeed", "m/s", 1.0, &[("airspeed", 19)]),
    ("vanes", "deg", DEG, &[("angle of attack", 20), ("sideslip", 21)]),
    ("magnetometer", "nT", 1.0, &[("x", 27), ("y", 28), ("z", 29)]),
];

/// Colours of the axes.
const COLOURS: [&str; 3] = ["#0050aa", "#d95f02", "#3a8f5c"];

/// Errors of every value at one time, in the order of [`Sensors::NAMES`], SI units.
pub type Errors = (f64, [f64; Sensors::COUNT]);

/// Sensor whose stamp a value has, by its place in [`Sensors::NAMES`].
fn sensor_of(place: usize) -> usize {
    match place {
        0..3 => 0,
        3..6 => 1,
        6..10 => 2,
        10..18 | 23 | 24 => 3,
        18 | 25 => 4,
        19 | 26 => 5,
        20 | 21 => 6,
        22 => 7,
        _ => 8,
    }
}

/// Flies and compares.
pub fn fly(args: &SensorErrorsArgs) -> Result<Vec<Errors>, Box<dyn Error>> {
    let SensorErrorsArgs { grade, seconds, seed, aircraft, .. } = args;
    aircraft.check_read(&[Target::Airframe, Target::Scenario])?;
    aircraft.check_beside([
        ("plant.seed", "--seed"),
        ("plant.sensors.grade", "--grade"),
        ("plant.duration_s", "--seconds"),
    ])?;
    let mut options = SetupOptions { aircraft: aircraft.clone(), ..SetupOptions::default() };
    let _ = options.set("plant.sensors.grade", grade.key());
    let mut setup = options.setup("nominal")?.plant;
    let period = setup.period;
    setup.seed = *seed;
    let mut real = Plant::new(&setup)?;
    setup.sensors = SensorSettings::of_grade(GradeName::Ideal);
    let mut exact = Plant::new(&setup)?;
    let actuators = Actuators { commands: exact.trim().positions() };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited")]
    let ticks = (seconds / period.as_seconds()) as usize;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a constant")]
    let every = (ROW_EVERY_S / period.as_seconds()) as usize;
    // Every exact sample so far, to compare a delayed one with.
    let mut past: Vec<[f64; Sensors::COUNT]> = Vec::with_capacity(ticks);
    let mut rows = Vec::with_capacity(ticks / every + 1);
    for tick in 0..ticks {
        past.push(exact.sense().to_array());
        let sensed = real.sense();
        if tick.is_multiple_of(every) {
            let (values, stamps) = (sensed.to_array(), sensed.stamps());
            let error = |place: usize| {
                let micros = stamps[sensor_of(place)].time.as_micros();
                let then = usize::try_from(micros / u64::from(period.as_micros())).unwrap_or(tick);
                values[place] - past.get(then).map_or(f64::NAN, |exact| exact[place])
            };
            rows.push((exact.time().as_seconds(), std::array::from_fn(error)));
        }
        exact.advance(&actuators);
        real.advance(&actuators);
    }
    Ok(rows)
}

/// Flies, draws and writes.
pub fn run(args: &SensorErrorsArgs) -> Result<(), Box<dyn Error>> {
    let folder = OutFolder::create(&args.out)?;
    let rows = fly(args)?;
    let header = format!("time_s,{}", Sensors::NAMES.map(|name| format!("error_{name}")).join(","));
    let mut csv = format!("{header}\n");
    for (time_s, errors) in &rows {
        let _ = write!(csv, "{time_s:.3}");
        for error in errors {
            let _ = write!(csv, ",{error:.6e}");
        }
        csv.push('\n');
    }
    folder.write_marked("sensors.csv", b"time_s,error_", csv.as_bytes())?;
    write_figure::<Box<dyn Error>>(&folder, &figure(args, &rows))?;
    for (title, unit, si, curves) in ROWS {
        for (name, place) in curves {
            let squares = rows.iter().map(|(_, errors)| (errors[*place] / si).powi(2));
            let rms = (squares.sum::<f64>() / rows.len().max(1) as f64).sqrt();
            print_line!("{title:<20} {name:<26} {rms:>10.4} {unit} rms");
        }
    }
    print_line!("wrote {}", args.out.display());
    Ok(())
}

fn figure(args: &SensorErrorsArgs, rows: &[Errors]) -> Figure {
    let ink = |place: usize| Ink::new(COLOURS[place % COLOURS.len()], Pattern::Solid).wide(1.1);
    let legend: Vec<(&str, Ink)> =
        ROWS[0].3.iter().enumerate().map(|(place, (name, _))| (*name, ink(place))).collect();
    let panel = |(title, unit, si, curves): &Row| {
        let curves: Vec<Curve> = curves
            .iter()
            .enumerate()
            .map(|(axis, (_, place))| {
                let points = rows.iter().map(|(time_s, errors)| (*time_s, errors[*place] / si));
                Curve::unnamed(points.collect(), ink(axis))
            })
            .collect();
        let values = curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.1));
        let y = crate::chart::axis::range(values, 1.0e-9);
        let (title, height) = ((*title).to_owned(), 170.0);
        let x = (0.0, args.seconds);
        Panel { title, y_label: unit, x, y, height, curves, ..Panel::default() }
    };
    let panels: Vec<Panel<'_>> = ROWS.iter().map(panel).collect();
    let (grade, seed) = (args.grade.key(), args.seed);
    let title = format!("Errors of {grade} sensors in steady flight, seed {seed}");
    let caption = "Errors of each sensor, compared with the exact value of the time of measurement";
    Figure { name: "sensors", caption: caption.to_owned(), svg: sheet(&title, &legend, 2, &panels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms(rows: &[Errors], place: usize) -> f64 {
        (rows.iter().map(|(_, errors)| errors[place].powi(2)).sum::<f64>() / rows.len() as f64)
            .sqrt()
    }

    #[test]
    fn ideal_sensors_have_no_error_and_consumer_ones_larger_ones_than_tactical_ones() {
        let flown = |grade| {
            let (out, aircraft) = (PathBuf::new(), AircraftArgs::default());
            let args = SensorErrorsArgs { grade, seconds: 20.0, seed: 1, aircraft, out };
            fly(&args).expect("the shipped aircraft")
        };
        let ideal = flown(GradeName::Ideal);
        assert!(ideal.iter().all(|(_, errors)| errors.iter().all(|error| *error == 0.0)));
        let (tactical, consumer) = (flown(GradeName::Tactical), flown(GradeName::Consumer));
        for (title, _, _, curves) in ROWS {
            let size =
                |rows: &[Errors]| curves.iter().map(|(_, place)| rms(rows, *place)).sum::<f64>();
            let (small, large) = (size(&tactical), size(&consumer));
            assert!(0.0 < small && small < large, "{title}: {small} and {large}");
        }
    }
}
