//! The errors of each sensor in a flight, over time: `sitl study sensors`.
//!
//! Two aircraft fly the same steady flight, one with exact sensors and one with those of the grade. An error is the difference of a
//! sample from the exact one of the time at which it was measured, so a delay is no error.

use host_io::print_line;
use std::error::Error;
use std::ops::Range;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use icd::sensors::SensorKind;
use icd::units::DEG;
use icd::{Actuators, Sensors};
use lab_tables::{Cell, CellKind, Column, Table, columns};
use plant_sim::io::whole;
use plant_sim::{GradeName, Plant, grade_file};

use lab_engine::builder::SetupOptions;
use lab_engine::configuration::AircraftArgs;
use lab_engine::settings::Target;
use lab_report::chart::panel::{Curve, Panel};
use lab_report::chart::{Figure, Ink, Pattern, sheet, write_figure};

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
    #[arg(long, value_name = "S", default_value_t = 120.0, allow_hyphen_values = true, value_parser = lab_engine::configuration::up_to(SECONDS_MAX, "s"))]
    pub seconds: f64,
    /// Seed of the random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
    /// Aircraft and settings.
    #[command(flatten)]
    pub aircraft: AircraftArgs,
    /// Folder for the table and the picture
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Parser of the grade of the sensors.
pub(crate) fn grade(text: &str) -> Result<GradeName, String> {
    let found = GradeName::ALL.into_iter().find(|grade| grade.key() == text);
    found.ok_or_else(|| "expected ideal, tactical or consumer".to_owned())
}

/// One panel: title, unit, size of the unit in SI units, the first of its signals, and the names of its curves.
type Row = (&'static str, &'static str, f64, &'static str, &'static [&'static str]);

const ROWS: [Row; 8] = [
    ("gyro", "deg/s", DEG, "body_rate_p_rad_s", &AXES),
    ("accelerometer", "m/s²", 1.0, "specific_force_x_m_s2", &["x", "y", "z"]),
    ("GNSS, position", "m", 1.0, "position_north_m", &["north", "east", "down"]),
    ("GNSS, velocity", "m/s", 1.0, "velocity_north_m_s", &["north", "east", "down"]),
    ("barometer, altitude", "m", 1.0, "altitude_m", &["altitude"]),
    ("pitot tube, airspeed", "m/s", 1.0, "airspeed_m_s", &["airspeed"]),
    ("vanes", "deg", DEG, "angle_of_attack_rad", &["angle of attack", "sideslip"]),
    ("magnetometer", "nT", 1.0, "magnetic_field_x_nt", &["x", "y", "z"]),
];

/// The axes of all panels, in their legend.
const AXES: [&str; 3] = ["x, north, angle of attack", "y, east, sideslip", "z, down"];

/// Colours of the axes.
const COLOURS: [&str; 3] = ["#0050aa", "#d95f02", "#3a8f5c"];

/// Errors over time of the sensors that the aircraft has.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorErrors {
    /// Names of the values, as in [`Sensors::NAMES`].
    signals: Vec<&'static str>,
    /// Time, s, and errors of these values, SI units.
    rows: Vec<(f64, Vec<f64>)>,
}

impl SensorErrors {
    /// Columns of so many signals from the first one on; none of a sensor that the aircraft lacks.
    fn columns(&self, first: &str, count: usize) -> Option<Range<usize>> {
        let first = self.signals.iter().position(|signal| *signal == first)?;
        Some(first..first + count)
    }

    /// Root mean square of a column.
    fn rms(&self, column: usize) -> f64 {
        let squares = self.rows.iter().map(|(_, errors)| errors[column].powi(2));
        (squares.sum::<f64>() / self.rows.len().max(1) as f64).sqrt()
    }
}

/// Flies and compares.
pub fn fly(args: &SensorErrorsArgs) -> Result<SensorErrors, Box<dyn Error>> {
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
    let fitted = setup.sensors.of(&setup.airframe, false);
    let sensors = SensorKind::ALL.into_iter().filter(|sensor| fitted[*sensor as usize]);
    let places = sensors.flat_map(|sensor| sensor.places().map(move |place| (sensor, place)));
    let places: Vec<_> = places.collect();
    let mut real = Plant::new(&setup)?;
    // The same aircraft in the same air: only the sensors differ.
    setup.sensors = grade_file::of_grade(GradeName::Ideal);
    let mut exact = Plant::new(&setup)?;
    let actuators = Actuators::new(exact.trim().positions());
    // Limited.
    let ticks = (seconds / period.as_seconds()) as usize;
    // A constant.
    let every = (ROW_EVERY_S / period.as_seconds()) as usize;
    // Every exact sample so far, to compare a delayed one with.
    let mut past: Vec<[f64; Sensors::COUNT]> = Vec::with_capacity(ticks);
    let mut rows = Vec::with_capacity(ticks / every + 1);
    for tick in 0..ticks {
        past.push(exact.sense().to_array());
        let sensed = real.sense();
        if tick.is_multiple_of(every) {
            let (values, stamps) = (sensed.to_array(), sensed.stamps());
            let error = |&(sensor, place): &(SensorKind, usize)| {
                let micros = stamps[sensor as usize].time.as_micros();
                let then = usize::try_from(micros / u64::from(period.as_micros())).unwrap_or(tick);
                values[place] - past.get(then).map_or(f64::NAN, |exact| exact[place])
            };
            rows.push((exact.time().as_seconds(), places.iter().map(error).collect()));
        }
        exact.advance(&actuators);
        real.advance(&actuators);
    }
    let signals = places.iter().map(|(_, place)| Sensors::NAMES[*place]).collect();
    Ok(SensorErrors { signals, rows })
}

/// Flies, draws and writes.
pub fn run(args: &SensorErrorsArgs) -> Result<(), Box<dyn Error>> {
    let folder = OutFolder::create(&args.out)?;
    let errors = fly(args)?;
    let error = |signal| Column::new(format!("error_{signal}"), CellKind::Number);
    let mut columns = columns![time_s: Number];
    columns.extend(errors.signals.iter().map(error));
    let mut table = Table::new("sensors", columns);
    let cells = |(time_s, errors): &(f64, Vec<f64>)| {
        [time_s].into_iter().chain(errors).map(|value| Cell::from(*value)).collect()
    };
    table.rows.extend(errors.rows.iter().map(cells));
    table.write(folder.path())?;
    write_figure(&folder, &figure(args, &errors))?;
    for (title, unit, si, first, names) in ROWS {
        let Some(columns) = errors.columns(first, names.len()) else { continue };
        for (name, column) in names.iter().zip(columns) {
            let rms = errors.rms(column) / si;
            print_line!("{title:<20} {name:<26} {rms:>10.4} {unit} rms");
        }
    }
    print_line!("wrote {}", args.out.display());
    Ok(())
}

fn figure(args: &SensorErrorsArgs, errors: &SensorErrors) -> Figure {
    let ink = |place: usize| Ink::new(COLOURS[place % COLOURS.len()], Pattern::Solid).wide(1.1);
    let legend: Vec<(&str, Ink)> =
        AXES.iter().enumerate().map(|(place, name)| (*name, ink(place))).collect();
    let panel = |(title, unit, si, first, names): &Row| {
        let columns = errors.columns(first, names.len())?;
        let curve = |(axis, column): (usize, usize)| {
            let points = errors.rows.iter().map(|(time_s, errors)| (*time_s, errors[column] / si));
            Curve::unnamed(points.collect(), ink(axis))
        };
        let curves: Vec<Curve> = columns.enumerate().map(curve).collect();
        let values = curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.1));
        let y = lab_report::chart::axis::range(values, 1.0e-9);
        let (title, height) = ((*title).to_owned(), 170.0);
        let x = (0.0, args.seconds);
        Some(Panel { title, y_label: unit, x, y, height, curves, ..Panel::default() })
    };
    let panels: Vec<Panel<'_>> = ROWS.iter().filter_map(panel).collect();
    let (grade, seed) = (args.grade.key(), args.seed);
    let title = format!("Errors of {grade} sensors in steady flight, seed {seed}");
    let caption = "Errors of each sensor, compared with the exact value of the time of measurement";
    Figure { name: "sensors", caption: caption.to_owned(), svg: sheet(&title, &legend, 2, &panels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ideal_sensors_have_no_error_and_consumer_ones_larger_ones_than_tactical_ones() {
        let flown = |grade| {
            let (out, aircraft) = (PathBuf::new(), AircraftArgs::default());
            let args = SensorErrorsArgs { grade, seconds: 20.0, seed: 1, aircraft, out };
            fly(&args).expect("the shipped aircraft")
        };
        let ideal = flown(GradeName::Ideal);
        // But for those of ground and tank.
        let radar = SensorKind::RadarAltimeter.places().start;
        assert_eq!(ideal.signals, Sensors::NAMES[..radar]);
        assert!(ideal.rows.iter().all(|(_, errors)| errors.iter().all(|error| *error == 0.0)));
        let (tactical, consumer) = (flown(GradeName::Tactical), flown(GradeName::Consumer));
        for (title, _, _, first, names) in ROWS {
            let size = |errors: &SensorErrors| {
                let columns = errors.columns(first, names.len()).expect("a fitted sensor");
                columns.map(|column| errors.rms(column)).sum::<f64>()
            };
            let (small, large) = (size(&tactical), size(&consumer));
            assert!(0.0 < small && small < large, "{title}: {small} and {large}");
        }
        // No aircraft with these sensors has an attitude.
        assert!(tactical.columns("attitude_w", 1).is_none());
    }
}
