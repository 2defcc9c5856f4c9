//! Healthy flights in turbulence: half of the time straight and level, half in turns, climbs and speed changes. And flights
//! with faults in the same air: how long the detectors take to notice them.

use std::borrow::Cow;
use std::fmt::{self, Write as _};

use autopilot::config;
use flight_control::StepLog;
use icd::fault::{FaultKind, Side, Timing, Travel};
use icd::units::DEG;
use icd::{Effector, SimTime, tvc_jet};
use nalgebra::Vector3;
use plant_sim::{Airframe, GradeName, ScheduledFault};

use super::Options;
use super::detectors::{Detectors, KINDS, PerDetector, SCALES};
use crate::closed_loop::{FlightSetup, fly};
pub use crate::linearize::Condition;
use crate::metrics::quantile;
use crate::problem::Problem;
use crate::runner;
use crate::study::{Scale, Sides, draws};

/// Length of a flight, s.
pub const FLIGHT_S: f64 = 600.0;
/// The turbulence builds up for this long before anything is counted, s.
pub const SETTLED_S: f64 = 10.0;
/// A manoeuvre, and the straight and level flight after it, last this long each, s.
const PART_S: f64 = 30.0;
/// An alarm that goes on counts again after this time, s: as a detector that is reset would.
const AGAIN_S: f64 = 5.0;

/// Slow and low (Mach 0.60), the design point (0.82), fast and high (0.88), and twice 300 m/s: with 1.8 times the dynamic pressure of
/// the design point (0.90), and the most the Mach number changes the aircraft (0.94).
pub const CONDITIONS: [Condition; 5] = [
    Condition { altitude_m: 2_000.0, airspeed_m_s: 200.0 },
    Condition { altitude_m: 5_000.0, airspeed_m_s: 264.0 },
    Condition { altitude_m: 8_000.0, airspeed_m_s: 270.0 },
    Condition { altitude_m: 2_000.0, airspeed_m_s: 300.0 },
    Condition { altitude_m: 5_000.0, airspeed_m_s: 300.0 },
];

/// These, or else those of the jet of the paper at the scale of another aircraft.
pub fn conditions(own: &[Condition], scale: &Scale) -> Vec<Condition> {
    let scaled = |condition: &Condition| Condition {
        altitude_m: condition.altitude_m * scale.altitude,
        airspeed_m_s: condition.airspeed_m_s * scale.airspeed,
    };
    if own.is_empty() { CONDITIONS.iter().map(scaled).collect() } else { own.to_vec() }
}

impl Condition {
    /// Parser of `AIRSPEED@ALTITUDE`, m/s and m.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let problem = "expected AIRSPEED@ALTITUDE, such as 264@5000: 10 to 400 m/s, 20 to 15000 m";
        let numbers = text.split_once('@').and_then(|(airspeed, altitude)| {
            Some((airspeed.parse::<f64>().ok()?, altitude.parse::<f64>().ok()?))
        });
        let possible = numbers.filter(|(airspeed, altitude)| {
            (10.0..=400.0).contains(airspeed) && (20.0..=15_000.0).contains(altitude)
        });
        let (airspeed_m_s, altitude_m) = possible.ok_or(problem)?;
        Ok(Self { altitude_m, airspeed_m_s })
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.airspeed_m_s, self.altitude_m)
    }
}

/// The air and the sensors of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    pub grade: GradeName,
    /// Turbulence, m/s rms.
    pub turbulence_m_s: f64,
    /// White noise of the gyros of ideal sensors, deg/s rms of each control sample.
    pub gyro_noise_deg_s: f64,
}

/// What one flight, or many, came to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Watched {
    /// Time that counts, s.
    pub seconds: f64,
    /// Part of it in manoeuvres, s.
    pub manoeuvring_s: f64,
    /// Alarms of each detector.
    pub alarms: Box<PerDetector<u32>>,
    /// Alarms as the detector of the flight control gives them, which stays awake until it is released.
    pub flown: u32,
    /// Sum of the squares of z2 over its level, roll, pitch and yaw.
    pub squares: Vector3<f64>,
    /// Largest |z2| over its level, roll, pitch and yaw.
    pub largest: Vector3<f64>,
    pub ticks: f64,
    /// Flights in which the aircraft was lost.
    pub lost: u32,
}

impl Watched {
    /// This and another one together.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        self.seconds += other.seconds;
        self.manoeuvring_s += other.manoeuvring_s;
        for (ours, theirs) in
            self.alarms.as_flattened_mut().iter_mut().zip(other.alarms.as_flattened())
        {
            *ours += theirs;
        }
        self.flown += other.flown;
        self.squares += other.squares;
        self.largest = self.largest.sup(&other.largest);
        self.ticks += other.ticks;
        self.lost += other.lost;
        self
    }

    /// rms of z2 over its level, roll, pitch and yaw.
    pub fn rms(&self) -> Vector3<f64> {
        (self.squares / self.ticks).map(f64::sqrt)
    }
}

/// The aircraft at a condition, in the turbulence and with the noise of the study, the compensator off.
///
/// It is off so that no false alarm changes the flight on which the next detector is judged. Until the first alarm the
/// flight is that with the compensator armed, to the bit (claim 3).
pub fn setup(
    air: &Air,
    sides: &Sides,
    condition: &Condition,
    seed: u64,
    references: &str,
    duration_s: f64,
) -> Result<FlightSetup, Problem> {
    let mut setup = sides.with_sensors(air.grade);
    let plant = &mut setup.plant;
    plant.start.altitude_m = condition.altitude_m;
    plant.start.airspeed_m_s = condition.airspeed_m_s;
    plant.wind.turbulence_m_s = air.turbulence_m_s;
    if air.grade == GradeName::Ideal {
        plant.sensors.gyro_noise_rad_s = air.gyro_noise_deg_s.to_radians();
    }
    plant.seed = seed;
    setup.references = config::references("the study", references)?;
    setup.duration = SimTime::from_seconds(duration_s).unwrap_or(SimTime::ZERO);
    Ok(setup)
}

/// Flights at each of so many conditions until the time that counts is so many hours.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "the command line allows 10,000 hours, and has few conditions"
)]
pub fn flights_for(hours: f64, conditions: usize) -> u64 {
    (hours * 3_600.0 / (FLIGHT_S - SETTLED_S) / conditions as f64).ceil().max(1.0) as u64
}

/// References of one flight: manoeuvres drawn by `seed`, each followed by straight and level flight as long; or none of them.
pub fn programme(condition: &Condition, scale: &Scale, seed: u64, is_straight: bool) -> String {
    let Condition { altitude_m, airspeed_m_s } = *condition;
    let mut between = draws(seed, *b"--------two-step sitl--2");
    let mut text = entry(0.0, 0.0, altitude_m, airspeed_m_s);
    let (mut altitude, mut airspeed) = (altitude_m, airspeed_m_s);
    let mut at_s = PART_S;
    while at_s < FLIGHT_S && !is_straight {
        let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let roll_deg = side * between(10.0, 30.0);
        let climb = altitude_m + scale.altitude * between(-400.0, 400.0);
        let speed = airspeed_m_s + scale.airspeed * between(-15.0, 15.0);
        // A turn, a climb or descent, a change of speed, or a climbing turn.
        let kind = between(0.0, 4.0);
        let turns = !(1.0..3.0).contains(&kind);
        if (1.0..2.0).contains(&kind) || kind >= 3.0 {
            altitude = climb;
        } else if (2.0..3.0).contains(&kind) {
            airspeed = speed;
        }
        text += &entry(at_s, if turns { roll_deg } else { 0.0 }, altitude, airspeed);
        text += &entry(at_s + PART_S, 0.0, altitude, airspeed);
        at_s += 2.0 * PART_S;
    }
    text
}

/// References from a time on, as a table of a scenario.
pub fn entry(at_s: f64, roll_deg: f64, altitude_m: f64, airspeed_m_s: f64) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "[[autopilot.reference]]\nat_s = {at_s:?}\nroll_deg = {roll_deg:?}\naltitude_m = {altitude_m:?}\n\
         airspeed_m_s = {airspeed_m_s:?}"
    );
    text
}

/// Whether a time of a flight belongs to a manoeuvre.
fn manoeuvres(t_s: f64) -> bool {
    t_s.rem_euclid(2.0 * PART_S) >= PART_S
}

/// z2 in units of the levels that fly, roll, pitch and yaw.
fn over_level(log: &StepLog) -> Vector3<f64> {
    log.levels.zip_map(&log.z2, f64::copysign)
}

/// Flies one healthy flight and runs all detectors on it.
pub fn watch(setup: &FlightSetup, is_straight: bool) -> Result<Watched, Problem> {
    let mut detectors = Detectors::new(setup.plant.period);
    let mut watched = Watched::default();
    // When each detector may count again.
    let mut again_s: Box<PerDetector<f64>> = Box::new([[SETTLED_S; SCALES]; KINDS]);
    let (mut active, mut lost) = (false, false);
    let h = setup.plant.period.as_seconds();
    fly(setup, &mut |record| {
        let (t_s, level) = (record.truth.time.as_seconds(), over_level(&record.log));
        lost |= setup.plant.airframe.limits.are_exceeded(&(&record.truth).into());
        detectors.step(&level, |kind, index| {
            if t_s >= again_s[kind][index] {
                watched.alarms[kind][index] += 1;
                again_s[kind][index] = t_s + AGAIN_S;
            }
        });
        if t_s < SETTLED_S {
            return;
        }
        watched.squares += level.component_mul(&level);
        watched.largest = watched.largest.sup(&level.abs());
        watched.ticks += 1.0;
        watched.seconds += h;
        watched.manoeuvring_s += if manoeuvres(t_s) && !is_straight { h } else { 0.0 };
        watched.flown += u32::from(record.log.compensator_active && !active);
        active = record.log.compensator_active;
    })?;
    watched.lost = u32::from(lost);
    Ok(watched)
}

/// The fault begins at this time, s: the turbulence has built up.
const FAULT_S: f64 = 20.0;
/// What is not noticed within this time counts as not noticed, s.
pub const WAITED_S: f64 = 5.0;
/// Flights for each fault, each in air of its own.
pub const SEEDS: u64 = 5;
/// A turn to the right, which the faults of the second half of the list meet.
const ROLL_DEG: f64 = 15.0;

/// A fault and the flight in which it comes.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    pub name: Cow<'static, str>,
    pub effector: Effector,
    pub kind: FaultKind,
    /// Altitude reference from the start on, over the altitude of the start, m.
    pub climb_m: f64,
    /// Roll reference from the start on, deg.
    pub roll_deg: f64,
}

fn stuck(name: &'static str, effector: Effector, deg: f64) -> Fault {
    let angle_rad = deg * DEG;
    let kind = FaultKind::StuckAt { angle_rad, travel: Travel::Jump };
    Fault { name: Cow::Borrowed(name), effector, kind, climb_m: 0.0, roll_deg: 0.0 }
}

/// Faults of an aircraft: of the jet those below, of another one each surface and nozzle jammed at half and a quarter of its travel.
pub fn faults(airframe: &Airframe) -> Vec<Fault> {
    let list = &airframe.effectors;
    if airframe.name == Airframe::paper().name {
        return of_the_jet().into();
    }
    let of = |effector: Effector| {
        let servo = &airframe.servos[effector];
        [0.5 * servo.max, 0.25 * servo.min].map(|angle_rad| {
            let name = format!("{} at {:+.1} deg", list.name(effector), angle_rad / DEG);
            Fault { name: name.into(), ..stuck("", effector, angle_rad / DEG) }
        })
    };
    list.all().filter(|effector| list.is_angle(*effector)).flat_map(of).collect()
}

/// The paper's two faults first, then smaller and other ones.
fn of_the_jet() -> [Fault; 14] {
    [
        Fault {
            climb_m: 1_000.0,
            ..stuck("case 1: left elevator at +30 deg, in a climb", tvc_jet::LEFT_ELEVATOR, 30.0)
        },
        Fault {
            roll_deg: ROLL_DEG,
            ..stuck("case 2: rudder at +7 deg, in a turn", tvc_jet::RUDDER, 7.0)
        },
        stuck("left elevator at -30 deg", tvc_jet::LEFT_ELEVATOR, -30.0),
        stuck("left elevator at +15 deg", tvc_jet::LEFT_ELEVATOR, 15.0),
        stuck("left elevator at +8 deg", tvc_jet::LEFT_ELEVATOR, 8.0),
        stuck("right elevator at -8 deg", tvc_jet::RIGHT_ELEVATOR, -8.0),
        stuck("rudder at +20 deg", tvc_jet::RUDDER, 20.0),
        stuck("rudder at +3 deg", tvc_jet::RUDDER, 3.0),
        stuck("rudder at -3 deg", tvc_jet::RUDDER, -3.0),
        stuck("right aileron at +25 deg", tvc_jet::RIGHT_AILERON, 25.0),
        stuck("right aileron at +12 deg", tvc_jet::RIGHT_AILERON, 12.0),
        stuck("nozzle in pitch at +15 deg", tvc_jet::NOZZLE_PITCH, 15.0),
        Fault {
            kind: FaultKind::HardOver { side: Side::Negative },
            ..stuck("rudder hard over, by its rate", tvc_jet::RUDDER, 0.0)
        },
        Fault {
            kind: FaultKind::Oscillating { amplitude: 8.0 * DEG, frequency_hz: 1.0 },
            ..stuck("right elevator oscillates, 8 deg at 1 Hz", tvc_jet::RIGHT_ELEVATOR, 0.0)
        },
    ]
}

/// Delays of the detectors for one fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Delays {
    pub fault: Fault,
    /// Median over the flights, s; infinite where it is not noticed.
    pub median_s: Box<PerDetector<f64>>,
    /// Longest, s.
    pub longest_s: Box<PerDetector<f64>>,
}

/// Flies every fault in the air of the study, at the design point.
pub fn measure_delays(
    options: &Options,
    grade: GradeName,
    sides: &Sides,
) -> Result<Vec<Delays>, Problem> {
    let faults = faults(sides.airframe());
    let one = |fault: &Fault, seed| noticed(&options.air(grade), sides, fault, seed);
    let flights = runner::map_groups("faults", &faults, (options.seed, SEEDS), one)?;
    Ok(faults.into_iter().zip(&flights).map(|(fault, flown)| Delays::of(fault, flown)).collect())
}

impl Delays {
    fn of(fault: Fault, flights: &[Box<PerDetector<f64>>]) -> Self {
        let mut median_s = Box::new([[0.0; SCALES]; KINDS]);
        let mut longest_s = Box::new([[0.0; SCALES]; KINDS]);
        for kind in 0..KINDS {
            for index in 0..SCALES {
                let all: Vec<f64> = flights.iter().map(|flight| flight[kind][index]).collect();
                longest_s[kind][index] = all.iter().copied().fold(0.0, f64::max);
                median_s[kind][index] = quantile(all, 0.5);
            }
        }
        Self { fault, median_s, longest_s }
    }
}

/// Time from the fault until each detector wakes, s. A false alarm before does not count.
fn noticed(
    air: &Air,
    sides: &Sides,
    fault: &Fault,
    seed: u64,
) -> Result<Box<PerDetector<f64>>, Problem> {
    let start = &sides.airframe().design_point;
    let design = Condition { altitude_m: start.altitude_m, airspeed_m_s: start.airspeed_m_s };
    let Condition { altitude_m, airspeed_m_s } = design;
    let references = entry(0.0, 0.0, altitude_m, airspeed_m_s)
        + &entry(17.0, fault.roll_deg, altitude_m + fault.climb_m, airspeed_m_s);
    let duration_s = FAULT_S + WAITED_S;
    let mut setup = setup(air, sides, &design, seed, &references, duration_s)?;
    let onset = SimTime::from_seconds(FAULT_S).unwrap_or(SimTime::ZERO);
    let (effector, kind, timing) = (fault.effector, fault.kind, Timing::at(onset));
    setup.plant.faults = vec![ScheduledFault { target: effector.into(), kind, timing }];
    let mut detectors = Detectors::new(setup.plant.period);
    let mut delays: Box<PerDetector<f64>> = Box::new([[f64::INFINITY; SCALES]; KINDS]);
    fly(&setup, &mut |record| {
        let after_s = record.truth.time.as_seconds() - FAULT_S;
        detectors.step(&over_level(&record.log), |kind, index| {
            if after_s >= 0.0 && delays[kind][index].is_infinite() {
                delays[kind][index] = after_s;
            }
        });
    })?;
    Ok(delays)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Scale = Scale { airspeed: 1.0, altitude: 1.0 };

    #[test]
    fn half_of_a_programme_is_manoeuvres_and_every_one_can_be_flown() {
        for (seed, condition) in (0..30).zip(CONDITIONS.iter().cycle()) {
            let text = programme(condition, &ONE, seed, false);
            let schedule = config::references("the study", &text).unwrap();
            let entries: Vec<_> = (0..).map_while(|index| schedule.entry(index)).collect();
            // One at the start, two for each of ten manoeuvres.
            assert_eq!(entries.len(), 21, "{text}");
            let level = |k: usize| entries[k].roll_rad == Some(0.0);
            assert!((0..21).step_by(2).all(level), "{text}");
            let changes = (1..21).step_by(2).filter(|k| {
                let (before, now) = (entries[k - 1], entries[*k]);
                !level(*k)
                    || before.altitude_m != now.altitude_m
                    || before.airspeed_m_s != now.airspeed_m_s
            });
            assert_eq!(changes.count(), 10, "every manoeuvre asks for something: {text}");
        }
    }

    #[test]
    fn programmes_repeat_with_their_seed_and_differ_without() {
        let of = |seed| programme(&CONDITIONS[0], &ONE, seed, false);
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }
}
