//! Healthy flights in turbulence: half of the time straight and level, half in turns, climbs and speed changes.

use std::fmt::Write as _;

use autopilot::parameters::Parameters;
use flight_control::CompensatorMode;
use icd::{ControlPeriod, SimTime};
use nalgebra::Vector3;
use plant_sim::setup::default_step_us;
use plant_sim::{Airframe, Scenario, scenario};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::detectors::{Detectors, KINDS, PerDetector, SCALES};
use super::{Options, StudyError};
use crate::closed_loop::{FlightSetup, fly};

/// Length of a flight, s.
pub const FLIGHT_S: f64 = 600.0;
/// The turbulence builds up for this long before anything is counted, s.
pub const SETTLED_S: f64 = 10.0;
/// A manoeuvre, and the straight and level flight after it, last this long each, s.
const PART_S: f64 = 30.0;
/// An alarm that goes on counts again after this time, s: as a detector that is reset would.
const AGAIN_S: f64 = 5.0;

/// A flight condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Altitude, m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
}

/// The three flight conditions: slow and low (Mach 0.60), the design point (0.82), fast and high (0.88).
pub const CONDITIONS: [Condition; 3] = [
    Condition { altitude_m: 2_000.0, airspeed_m_s: 200.0 },
    Condition { altitude_m: 5_000.0, airspeed_m_s: 264.0 },
    Condition { altitude_m: 8_000.0, airspeed_m_s: 270.0 },
];

/// What one flight, or many, came to.
#[derive(Debug, Clone, PartialEq)]
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
    /// Ticks that count.
    pub ticks: f64,
    /// Flights in which the aircraft was lost.
    pub lost: u32,
}

impl Default for Watched {
    fn default() -> Self {
        Self {
            seconds: 0.0,
            manoeuvring_s: 0.0,
            alarms: Box::new([[0; SCALES]; KINDS]),
            flown: 0,
            squares: Vector3::zeros(),
            largest: Vector3::zeros(),
            ticks: 0.0,
            lost: 0,
        }
    }
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
    #[must_use]
    pub fn rms(&self) -> Vector3<f64> {
        (self.squares / self.ticks).map(f64::sqrt)
    }
}

/// The aircraft at a condition, in the turbulence and with the noise of the study, the compensator off.
///
/// It is off so that no false alarm changes the flight on which the next detector is judged. Until the first alarm the
/// flight is that with the compensator armed, to the bit (claim 3).
///
/// # Errors
/// [`StudyError`] if a shipped file is not what it should be.
pub fn setup(
    options: &Options,
    airframe: &Airframe,
    condition: &Condition,
    seed: u64,
    references: &str,
    duration_s: f64,
) -> Result<FlightSetup, StudyError> {
    let mut plant =
        Scenario::from_toml("nominal.toml", scenario::NOMINAL, &airframe.effectors)?.plant;
    plant.start.altitude_m = Some(condition.altitude_m);
    plant.start.airspeed_m_s = Some(condition.airspeed_m_s);
    plant.wind.turbulence_m_s = options.turbulence_m_s;
    plant.sensors.gyro_noise_rad_s = options.gyro_noise_deg_s.to_radians();
    plant.seed = seed;
    let period = ControlPeriod::DEFAULT;
    let mut parameters = Parameters::default();
    parameters.gains.selection.compensator = CompensatorMode::Off;
    Ok(FlightSetup {
        plant: plant.setup(airframe.clone(), 0, period, default_step_us(period)),
        model: autopilot::config::aircraft_model("tvc_jet.toml", autopilot::config::DEFAULT_MODEL)?,
        parameters,
        references: autopilot::config::references("the study", references)?,
        script: None,
        duration: SimTime::from_seconds(duration_s).unwrap_or(SimTime::ZERO),
    })
}

/// References of one flight: manoeuvres drawn by `seed`, each followed by straight and level flight as long.
#[must_use]
pub fn programme(condition: &Condition, seed: u64) -> String {
    let Condition { altitude_m, airspeed_m_s } = *condition;
    let mut key = *b"........--------two-step sitl--2";
    key[..8].copy_from_slice(&seed.to_le_bytes());
    let mut generator = ChaCha8Rng::from_seed(key);
    let mut between = |low: f64, high: f64| {
        let unit = f64::from(generator.next_u32()) / (f64::from(u32::MAX) + 1.0);
        low + (high - low) * unit
    };
    let mut text = entry(0.0, 0.0, altitude_m, airspeed_m_s);
    let (mut altitude, mut airspeed) = (altitude_m, airspeed_m_s);
    let mut at_s = PART_S;
    while at_s < FLIGHT_S {
        let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let roll_deg = side * between(10.0, 30.0);
        let climb = altitude_m + between(-400.0, 400.0);
        let speed = airspeed_m_s + between(-15.0, 15.0);
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

fn entry(at_s: f64, roll_deg: f64, altitude_m: f64, airspeed_m_s: f64) -> String {
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

/// Flies one healthy flight and runs all detectors on it.
///
/// # Errors
/// [`StudyError`] if it cannot be flown.
pub fn watch(setup: &FlightSetup) -> Result<Watched, StudyError> {
    let gains = &setup.parameters.gains.activation;
    let levels = Vector3::new(gains.level_roll, gains.level_pitch, gains.level_yaw);
    let mut detectors = Detectors::new(gains, setup.plant.period);
    let mut watched = Watched::default();
    // When each detector may count again.
    let mut again_s: Box<PerDetector<f64>> = Box::new([[SETTLED_S; SCALES]; KINDS]);
    let (mut active, mut lost) = (false, false);
    let h = setup.plant.period.as_seconds();
    fly(setup, &mut |record| {
        let (t_s, z2) = (record.truth.time.as_seconds(), &record.log.z2);
        lost |= setup.plant.airframe.limits.are_exceeded(&(&record.truth).into());
        detectors.step(z2, |kind, index| {
            if t_s >= again_s[kind][index] {
                watched.alarms[kind][index] += 1;
                again_s[kind][index] = t_s + AGAIN_S;
            }
        });
        if t_s < SETTLED_S {
            return;
        }
        let level = z2.abs().component_div(&levels);
        watched.squares += level.component_mul(&level);
        watched.largest = watched.largest.sup(&level);
        watched.ticks += 1.0;
        watched.seconds += h;
        watched.manoeuvring_s += if manoeuvres(t_s) { h } else { 0.0 };
        watched.flown += u32::from(record.log.compensator_active && !active);
        active = record.log.compensator_active;
    })?;
    watched.lost = u32::from(lost);
    Ok(watched)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_programme_is_manoeuvres_and_every_one_can_be_flown() {
        for (seed, condition) in (0..30).zip(CONDITIONS.iter().cycle()) {
            let text = programme(condition, seed);
            let schedule = autopilot::config::references("the study", &text).unwrap();
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
        let of = |seed| programme(&CONDITIONS[0], seed);
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }
}
