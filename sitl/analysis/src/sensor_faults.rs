//! Every fault of every sensor in closed loop, on estimated states: `sitl study sensor-faults`.
//!
//! The aircraft flies turns, climbs and changes of speed in light turbulence with the paper's controller. A sensor fails for a
//! while and is repaired. What is judged is what an operator sees: is the aircraft kept, how wrong does the state become, does the
//! compensator take the fault for one of an effector, and does the estimator say which sensor it is.

use core::ops::ControlFlow;
use std::fmt::Write as _;

use flight_control::CompensatorMode;
use flight_control::estimator_status::SourceHealth;
use icd::SimTime;
use icd::fault::{
    CATALOGUE, FaultKind, KindInfo, NUMBERS_MAX, Onset, Quantity, TargetClass, Timing,
};
use icd::sensors::SensorKind;
use lab_judges::Judge as _;
use lab_judges::estimate::EstimateJudge;
use plant_sim::io::whole;
use plant_sim::{GradeName, ScheduledFault};

use crate::closed_loop::{FlightSetup, watch};
use crate::estimator::{Case, flights};
use crate::false_alarms::flights::entry;
use crate::problem::Problem;
use crate::runner;
use crate::study::{Sides, StudyOptions};

/// Length of a flight, s.
const FLIGHT_S: f64 = 120.0;
/// The sensor fails at this time, s.
pub const ONSET_S: f64 = 40.0;
/// And is repaired so long after it, s.
pub const DURATION_S: f64 = 40.0;
/// Turbulence of all flights, m/s rms: light.
const TURBULENCE_M_S: f64 = 1.5;

/// Options of `sitl study sensor-faults`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Options {
    /// Aircraft, laws, settings, folder.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Grade of the sensors: tactical or consumer
    #[arg(long, value_name = "tactical|consumer", value_parser = grade, default_value = "tactical")]
    pub grade: GradeName,
    /// This sensor alone, such as pitot; may be repeated
    #[arg(long = "sensor", value_name = "NAME", value_parser = sensor)]
    pub sensors: Vec<SensorKind>,
    /// Flights without each sensor for 600 s
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 4, value_parser = whole(1, 10_000_u64))]
    pub flights: u64,
    /// Seed of the random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
}

impl Options {
    /// Aircraft and laws; the compensator is armed.
    pub fn sides(&self) -> Result<Sides, Problem> {
        flights::sides(&self.study, CompensatorMode::Armed, &["plant.duration", "plant.fault"])
    }
}

fn grade(text: &str) -> Result<GradeName, String> {
    let found = GradeName::ALL.into_iter().find(|grade| grade.key() == text);
    // Ideal sensors have an attitude unit, and nothing is estimated.
    let found = found.filter(|grade| *grade != GradeName::Ideal);
    found.ok_or_else(|| "expected tactical or consumer".to_owned())
}

fn sensor(text: &str) -> Result<SensorKind, String> {
    let found = SensorKind::by_key(text).filter(|sensor| SENSORS.contains(sensor));
    found.ok_or_else(|| format!("expected one of {}", SENSORS.map(SensorKind::key).join(", ")))
}

/// The sensors that an aircraft without an attitude unit has.
pub const SENSORS: [SensorKind; 8] = [
    SensorKind::Gyro,
    SensorKind::Accelerometer,
    SensorKind::Gnss,
    SensorKind::Barometer,
    SensorKind::Pitot,
    SensorKind::Vanes,
    SensorKind::EngineMonitor,
    SensorKind::Magnetometer,
];

/// Size of a bias of a sensor, in its operator's unit: large for a sensor in service. The drift reaches it in ten seconds, the noise has it as
/// its root mean square.
const fn size(sensor: SensorKind) -> f64 {
    match sensor {
        SensorKind::Gyro => 1.0,
        SensorKind::Accelerometer => 1.0,
        SensorKind::Attitude | SensorKind::Vanes => 5.0,
        SensorKind::Gnss => 50.0,
        SensorKind::Barometer | SensorKind::Pitot => 2_000.0,
        SensorKind::EngineMonitor => 5.0,
        SensorKind::Magnetometer => 10_000.0,
    }
}

/// Every kind of fault of a sensor, with its size.
pub fn kinds(sensor: SensorKind) -> Vec<FaultKind> {
    let class = TargetClass::Sensor(sensor);
    let si = sensor.unit().to_si(size(sensor));
    let value = |quantity: Quantity| match quantity {
        Quantity::Rate => 0.1 * si,
        Quantity::Delay => 0.5,
        Quantity::Period => 2.0,
        Quantity::Present => 0.5,
        _ => si,
    };
    let of_sensors = CATALOGUE.iter().filter(|info| info.targets.allow(class));
    let kind = |info: &KindInfo| {
        let mut values = [0.0; NUMBERS_MAX];
        for (place, number) in values.iter_mut().zip(info.numbers) {
            *place = value(number.quantity);
        }
        info.with(0, values)
    };
    of_sensors.filter_map(kind).collect()
}

/// What a flight came to.
#[derive(Debug, Clone, Copy, Default)]
pub struct Flown {
    /// When the aircraft was lost, s.
    pub lost_at_s: Option<f64>,
    /// Largest errors of the state from the onset on: attitude, deg; airspeed, m/s; altitude, m.
    pub errors: [f64; 3],
    /// The same in the last ten seconds, thirty after the repair.
    pub errors_after: [f64; 3],
    /// Part of the time with the compensator active, from the onset on.
    pub active: f64,
    /// What the estimator reported of the sensor while it failed, if it did not just use it.
    pub reported: SourceHealth,
    ticks: f64,
}

/// Flies with a fault of a sensor, or without any.
pub fn fly(
    sides: &Sides,
    grade: GradeName,
    fault: Option<(SensorKind, FaultKind)>,
    seed: u64,
) -> Result<Flown, Problem> {
    let length_s = (FLIGHT_S, Some(DURATION_S));
    let setup = setup(sides, grade, TURBULENCE_M_S, fault, length_s, seed)?;
    let mut flown = Flown::default();
    let _ = watch(&setup, |tick| {
        let truth = tick.plant.truth();
        let (now_s, state) = (truth.time.as_seconds(), &tick.log.state);
        if tick.plant.dynamics().airframe().limits.are_exceeded(&truth.into()) {
            flown.lost_at_s = Some(now_s);
            return ControlFlow::Break(());
        }
        if now_s < ONSET_S {
            return ControlFlow::Continue(());
        }
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let errors = [
            turned.angle().to_degrees(),
            (truth.airspeed_m_s - state.airspeed_m_s).abs(),
            (truth.altitude_m - state.altitude_m).abs(),
        ];
        let after = now_s > FLIGHT_S - 10.0;
        for (place, error) in errors.into_iter().enumerate() {
            flown.errors[place] = flown.errors[place].max(error);
            if after {
                flown.errors_after[place] = flown.errors_after[place].max(error);
            }
        }
        flown.ticks += 1.0;
        flown.active += f64::from(u8::from(tick.log.compensator_active));
        if let (Some((sensor, _)), Some(status)) = (fault, &state.estimate)
            && now_s < ONSET_S + DURATION_S
        {
            let health = status.sources[sensor as usize];
            if health.is_gone() || flown.reported == SourceHealth::Unused {
                flown.reported = health;
            }
        }
        ControlFlow::Continue(())
    })?;
    flown.active /= flown.ticks.max(1.0);
    Ok(flown)
}

/// A flight so long, s, with a fault that lasts so long, s, or to the end; or without any fault.
fn setup(
    sides: &Sides,
    grade: GradeName,
    turbulence_m_s: f64,
    fault: Option<(SensorKind, FaultKind)>,
    (flight_s, duration_s): (f64, Option<f64>),
    seed: u64,
) -> Result<FlightSetup, Problem> {
    let case = Case { name: grade.key(), grade, vanes: true };
    let mut setup = flights::setup(sides, &case, turbulence_m_s, seed)?;
    setup.duration = SimTime::from_seconds(flight_s).unwrap_or(SimTime::ZERO);
    let onset = SimTime::from_seconds(ONSET_S).unwrap_or(SimTime::ZERO);
    let timing = Timing { duration_s, ..Timing::from_onset(Onset::At(onset)) };
    let scheduled =
        fault.map(|(sensor, kind)| ScheduledFault { target: sensor.into(), kind, timing });
    setup.plant.faults = scheduled.into_iter().collect();
    Ok(setup)
}

/// Length of a flight with a loss for good, s.
const LOSS_FLIGHT_S: f64 = ONSET_S + 600.0;
/// The estimate is judged so long after such a loss, s.
const LOSS_SETTLED_S: f64 = 10.0;

/// What a flight came to whose sensor failed for good, from ten seconds after the loss on.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lost {
    /// When the aircraft was lost, s.
    pub lost_at_s: Option<f64>,
    /// Mean squares: error of the airspeed, and what the estimator says of it, m²/s².
    pub airspeed: [f64; 2],
    /// Largest errors: airspeed, m/s; deviation from the altitude reference, m; attitude, deg.
    pub largest: [f64; 3],
    /// Normalised square of the error of the wind, its mean; three for a consistent estimator.
    pub wind_nees: f64,
    /// What the estimator reported of the sensor.
    pub reported: SourceHealth,
    altitude_m: f64,
    /// Seconds that were judged.
    seconds: f64,
}

/// Flies straight, or in turns, with a fault of a sensor that stays.
pub fn fly_without(
    sides: &Sides,
    grade: GradeName,
    turbulence_m_s: f64,
    turns: bool,
    fault: Option<(SensorKind, FaultKind)>,
    seed: u64,
) -> Result<Lost, Problem> {
    let mut setup = setup(sides, grade, turbulence_m_s, fault, (LOSS_FLIGHT_S, None), seed)?;
    let start = &setup.plant.start;
    let (altitude_m, airspeed_m_s) = (start.altitude_m, start.airspeed_m_s);
    let mut programme = entry(0.0, 0.0, altitude_m, airspeed_m_s);
    for part in 0..if turns { 10_u32 } else { 0 } {
        let (at_s, side) = (ONSET_S + 60.0 * f64::from(part), [1.0, -1.0][part as usize % 2]);
        programme += &entry(at_s, 30.0 * side, altitude_m, airspeed_m_s);
        programme += &entry(at_s + 30.0, 0.0, altitude_m, airspeed_m_s);
    }
    setup.references = autopilot::config::references("the study", &programme)?;
    let from_s = ONSET_S + LOSS_SETTLED_S;
    let (mut lost, mut estimate) = (Lost::default(), EstimateJudge::from(from_s));
    let _ = watch(&setup, |tick| {
        let truth = tick.plant.truth();
        if tick.plant.dynamics().airframe().limits.are_exceeded(&truth.into()) {
            lost.lost_at_s = Some(truth.time.as_seconds());
            return ControlFlow::Break(());
        }
        let before = estimate.seconds();
        estimate.look(tick);
        if estimate.seconds() > before {
            lost.altitude_m = lost.altitude_m.max((truth.altitude_m - altitude_m).abs());
            if let (Some((sensor, _)), Some(status)) = (fault, &tick.log.state.estimate) {
                lost.reported = status.sources[sensor as usize];
            }
        }
        ControlFlow::Continue(())
    })?;
    let [airspeed_m_s, attitude_rad] = estimate.largest;
    lost.largest = [airspeed_m_s, lost.altitude_m, attitude_rad.to_degrees()];
    (lost.airspeed, lost.wind_nees) = (estimate.airspeed(), estimate.wind_nees());
    lost.seconds = estimate.seconds();
    Ok(lost)
}

/// One row: the sensor with its fault, or no fault, and what became of it.
pub type Row = (Option<(SensorKind, FaultKind)>, Flown);

/// Flies without a fault and with each fault of each sensor.
pub fn study(options: &Options, sides: &Sides) -> Result<Vec<Row>, Problem> {
    let named = &options.sensors;
    let faults = SENSORS
        .into_iter()
        .filter(|sensor| named.is_empty() || named.contains(sensor))
        .flat_map(|sensor| kinds(sensor).into_iter().map(move |kind| (sensor, kind)));
    let faults: Vec<Option<(SensorKind, FaultKind)>> =
        std::iter::once(None).chain(faults.map(Some)).collect();
    runner::try_map("sensor faults", &faults, |fault| {
        Ok((*fault, fly(sides, options.grade, *fault, options.seed)?))
    })
}

/// Turbulence of the flights with a loss for good, m/s rms.
const LOSS_TURBULENCE_M_S: [f64; 3] = [0.0, 1.5, 3.0];

/// A sensor that is off, or none; turbulence, m/s; turns; and the flights.
pub type LossRow = (Option<SensorKind>, f64, bool, Vec<Lost>);

/// Flies each sensor's loss for 600 s, straight, and that of the pitot tube in turns too.
pub fn losses(
    options: &Options,
    sides: &Sides,
    sensors: &[Option<SensorKind>],
) -> Result<Vec<LossRow>, Problem> {
    let turns = |sensor: Option<SensorKind>| match sensor {
        Some(SensorKind::Pitot) => &[false, true][..],
        _ => &[false],
    };
    let rows: Vec<_> = sensors
        .iter()
        .flat_map(|sensor| turns(*sensor).iter().map(move |turns| (*sensor, *turns)))
        .flat_map(|(sensor, turns)| LOSS_TURBULENCE_M_S.map(|rms| (sensor, rms, turns)))
        .collect();
    let each = (options.seed, options.flights);
    let flown = runner::map_groups("losses", &rows, each, |(sensor, rms, turns), seed| {
        let off = |sensor| kinds(sensor).into_iter().find(|kind| kind.info().key == "off");
        let fault = sensor.and_then(|sensor| Some((sensor, off(sensor)?)));
        fly_without(sides, options.grade, *rms, *turns, fault, seed)
    })?;
    let of_row = rows.into_iter().zip(flown);
    Ok(of_row.map(|((sensor, rms, turns), flown)| (sensor, rms, turns, flown)).collect())
}

fn loss_table(options: &Options, rows: &[LossRow]) -> String {
    let mut text = format!(
        "\n{} sensors. The sensor is off from {ONSET_S} s to the end at {LOSS_FLIGHT_S} s; {} flights for each row, seeds from {} on. Judged from \
         {LOSS_SETTLED_S} s after the loss on; a consistent estimate of the wind has a mean NEES of 3.\n\n\
         | sensor off | turbulence, m/s | flight | lost | airspeed error, rms | by the estimator, rms | largest | altitude, largest | attitude, largest | wind, NEES |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
        options.grade.key(),
        options.flights,
        options.seed,
    );
    for (sensor, rms, turns, flights) in rows {
        // A flight that was lost before has no number, and a row of such flights none at all.
        let judged: Vec<&Lost> = flights.iter().filter(|flown| flown.seconds > 0.0).collect();
        let number = |value: f64, decimals: usize, unit: &str| match judged.is_empty() {
            true => "-".to_owned(),
            false => format!("{value:.decimals$}{unit}"),
        };
        let mean = |of: &dyn Fn(&Lost) -> f64| {
            judged.iter().map(|flown| of(flown)).sum::<f64>() / judged.len().max(1) as f64
        };
        let largest =
            |place: usize| judged.iter().map(|flown| flown.largest[place]).fold(0.0, f64::max);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {rms} | {} | {} | {} | {} | {} | {} | {} | {} |",
            sensor.map_or("-", |sensor| sensor.name()),
            if *turns { "turns" } else { "straight" },
            flights.iter().filter(|flown| flown.lost_at_s.is_some()).count(),
            number(mean(&|flown| flown.airspeed[0]).sqrt(), 2, " m/s"),
            number(mean(&|flown| flown.airspeed[1]).sqrt(), 2, " m/s"),
            number(largest(0), 1, " m/s"),
            number(largest(1), 1, " m"),
            number(largest(2), 2, " deg"),
            number(mean(&|flown| flown.wind_nees), 2, ""),
        );
    }
    text
}

/// Flies everything, writes and prints the tables.
pub fn run(options: &Options) -> Result<(), Problem> {
    let sides = options.sides()?;
    let folder = sides.begin(&options.study.out)?;
    let mut text = table(options, &study(options, &sides)?);
    let sensors: Vec<_> = match options.sensors.is_empty() {
        true => std::iter::once(None).chain(SENSORS.map(Some)).collect(),
        false => options.sensors.iter().copied().map(Some).collect(),
    };
    text += &loss_table(options, &losses(options, &sides, &sensors)?);
    folder.write_markdown("sensor-faults.md", &text)?;
    print_line!("{text}\nwrote {}", folder.path().display());
    Ok(())
}

fn table(options: &Options, rows: &[Row]) -> String {
    let mut text = format!(
        "{} sensors, turbulence {TURBULENCE_M_S} m/s rms, seed {}. The sensor fails at {ONSET_S} s for {DURATION_S} s; flights of {FLIGHT_S} s with turns, climbs \
         and changes of speed. Errors of the state: the largest from the onset on; in brackets those of the last ten seconds, thirty after the repair.\n\n\
         | sensor | fault | aircraft | attitude, deg | airspeed, m/s | altitude, m | compensator active | reported |\n\
         |---|---|---|---|---|---|---|---|\n",
        options.grade.key(),
        options.seed,
    );
    for (fault, flown) in rows {
        let (sensor, kind) = match fault {
            Some((sensor, kind)) => {
                let class = TargetClass::Sensor(*sensor);
                (sensor.name(), kind.described(class).to_string())
            }
            None => ("-", "none".to_owned()),
        };
        let lost = flown.lost_at_s.map_or("kept".to_owned(), |at_s| format!("lost at {at_s:.1} s"));
        let both = |place: usize| {
            let (during, after) = (flown.errors[place], flown.errors_after[place]);
            match flown.lost_at_s {
                // Lost before the onset: there is no number.
                Some(_) if flown.ticks == 0.0 => "-".to_owned(),
                Some(_) => format!("{during:.1}"),
                None => format!("{during:.1} ({after:.1})"),
            }
        };
        let reported = if flown.reported.is_gone() { flown.reported.name() } else { "-" };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {sensor} | {kind} | {lost} | {} | {} | {} | {:.0} % | {reported} |",
            both(0),
            both(1),
            both(2),
            100.0 * flown.active,
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_flights_that_were_lost_at_once_have_no_numbers_and_such_flights_do_not_dilute_the_others()
     {
        let options = Options {
            study: StudyOptions::default(),
            grade: GradeName::Tactical,
            sensors: Vec::new(),
            flights: 4,
            seed: 1,
        };
        let lost = Lost { lost_at_s: Some(41.0), ..Lost::default() };
        let kept = Lost { airspeed: [4.0, 9.0], wind_nees: 3.0, seconds: 590.0, ..Lost::default() };
        let rows = [
            (Some(SensorKind::Pitot), 3.0, false, vec![lost; 4]),
            (Some(SensorKind::Pitot), 3.0, true, vec![lost, kept]),
        ];
        let text = loss_table(&options, &rows);
        let lines: Vec<&str> = text.lines().rev().take(2).collect();
        assert!(lines[1].ends_with("| 4 | - | - | - | - | - | - |"), "{text}");
        assert!(lines[0].contains("| 1 | 2.00 m/s | 3.00 m/s |"), "{text}");
        assert!(lines[0].ends_with("| 3.00 |"), "{text}");
        let early = Flown { lost_at_s: Some(20.0), ..Flown::default() };
        let text = table(&options, &[(None, early)]);
        assert!(text.contains("| lost at 20.0 s | - | - | - |"), "{text}");
    }
}
