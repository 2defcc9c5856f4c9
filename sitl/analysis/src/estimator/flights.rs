//! One flight on estimated states, judged once a second.

use core::ops::ControlFlow;

use flight_control::estimator::covariance::{ATTITUDE, FORCE_BIAS, GYRO_BIAS, VELOCITY, WIND};
use flight_control::{CompensatorMode, Estimator, NavigationState};
use icd::SimTime;
use nalgebra::{Matrix3, Vector3};
use plant_sim::range::check_range;
use plant_sim::{Plant, Start};

use super::Case;
use crate::closed_loop::{FlightSetup, watch};
use crate::false_alarms::flights::entry;
use crate::problem::{At as _, Problem};
use crate::study::{Sides, StudyOptions, draws};

/// Groups of three states, with the unit in which their error is shown, and its size in SI units.
pub const GROUPS: [(&str, &str, f64); 6] = [
    ("attitude", "deg", core::f64::consts::PI / 180.0),
    ("velocity", "m/s", 1.0),
    ("position", "m", 1.0),
    ("gyro bias", "deg/h", core::f64::consts::PI / 180.0 / 3_600.0),
    ("accelerometer bias", "mg", 9.806_65e-3),
    ("wind", "m/s", 1.0),
];
/// Length of a flight without `plant.duration_s`, s.
const FLIGHT_S: f64 = 180.0;
/// The estimate is judged from this time on, s.
pub const SETTLED_S: f64 = 20.0;
/// Largest steady wind, m/s, and as a part of the airspeed.
const WIND_MAX_M_S: f64 = 20.0;
const WIND_MAX_PART: f64 = 0.4;
/// Largest change of the altitude, m, and as a part of it.
const CLIMB_MAX_M: f64 = 300.0;
const CLIMB_MAX_PART: f64 = 0.3;

/// Numbers of each group.
pub type PerGroup<T> = [T; GROUPS.len()];

/// What a flight came to.
#[derive(Debug, Clone, Default)]
pub struct Flown {
    /// NEES of each group, once a second from its start.
    pub nees: Vec<PerGroup<f64>>,
    /// Squared errors, SI units.
    pub squares: Vec<PerGroup<f64>>,
    /// Sums of three variances by the filter, SI units.
    pub variances: Vec<PerGroup<f64>>,
    /// Squared errors of airspeed, m/s, angle of attack and sideslip, rad.
    pub flow: Vec<[f64; 3]>,
    /// The aircraft came to the ground or beyond its limits.
    pub lost: bool,
    /// The estimator aligned itself again.
    pub realigned: u32,
}

/// Turns, climbs and changes of speed about a start, drawn by the seed, with straight flight between them.
fn programme(start: &Start, duration_s: f64, seed: u64) -> String {
    let Start { altitude_m, airspeed_m_s, .. } = *start;
    let mut between = draws(seed, *b"--------two-step sitl--4");
    let climb_m = CLIMB_MAX_M.min(CLIMB_MAX_PART * altitude_m);
    let mut text = entry(0.0, 0.0, altitude_m, airspeed_m_s);
    let mut at_s = 5.0;
    while at_s < duration_s {
        let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let roll_deg = side * between(10.0, 40.0);
        let altitude = altitude_m + between(-climb_m, climb_m);
        let airspeed = airspeed_m_s * (1.0 + between(-0.06, 0.06));
        text += &entry(at_s, roll_deg, altitude, airspeed);
        text += &entry(at_s + 15.0, 0.0, altitude, airspeed);
        at_s += 30.0;
    }
    text
}

/// What every flight sets itself: beginnings of keys.
const OWN: [&str; 6] = [
    "plant.seed",
    "plant.wind.speed",
    "plant.wind.towards",
    "plant.wind.turbulence",
    "plant.sensors.grade",
    "autopilot.reference",
];

/// Aircraft and laws of flights of 180 s; `more` are beginnings of keys that a study sets besides.
pub fn sides(
    options: &StudyOptions,
    mode: CompensatorMode,
    more: &[&str],
) -> Result<Sides, Problem> {
    let sides = options.sides(mode, &[&OWN, more].concat())?.lasting(FLIGHT_S);
    let duration_s = sides.nominal().duration.as_seconds();
    let range = (SETTLED_S + 1.0, SimTime::MAX_SECONDS);
    check_range("plant", "duration_s", duration_s, range.0, range.1).at("the study")?;
    Ok(sides)
}

/// The setup of a flight.
pub fn setup(
    sides: &Sides,
    case: &Case,
    turbulence_m_s: f64,
    seed: u64,
) -> Result<FlightSetup, Problem> {
    let mut setup = case.equip(sides);
    let plant = &mut setup.plant;
    let mut between = draws(seed, *b"--------two-step sitl--5");
    let wind_max = WIND_MAX_M_S.min(WIND_MAX_PART * setup.model.trim.airspeed_m_s);
    plant.wind.speed_m_s = between(0.0, wind_max);
    plant.wind.towards_rad = between(0.0, core::f64::consts::TAU);
    plant.wind.turbulence_m_s = turbulence_m_s;
    plant.seed = seed;
    let programme = programme(&plant.start, setup.duration.as_seconds(), seed);
    setup.references = autopilot::config::references("the study", &programme)?;
    Ok(setup)
}

pub fn fly(sides: &Sides, case: &Case, turbulence_m_s: f64, seed: u64) -> Result<Flown, Problem> {
    let setup = setup(sides, case, turbulence_m_s, seed)?;
    let mut flown = Flown::default();
    let end = watch(&setup, |tick| {
        if let Some(estimator) = tick.estimator
            && tick.exchange.time.as_micros().is_multiple_of(1_000_000)
        {
            flown.judge(estimator, &tick.log.state, tick.plant);
        }
        ControlFlow::Continue(())
    })?;
    flown.lost = end.on_ground;
    Ok(flown)
}

impl Flown {
    fn judge(&mut self, estimator: &Estimator, state: &NavigationState, plant: &Plant) {
        let truth = plant.truth();
        let (estimate, covariance) = (estimator.estimate(), estimator.covariance());
        let [gyro, force] = plant.inertial_biases();
        // The covariance is in start axes, which differ from the local ones by less than half a degree in these flights.
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let errors: PerGroup<(Vector3<f64>, Matrix3<f64>)> = [
            (turned.scaled_axis(), covariance.block(ATTITUDE)),
            (truth.velocity.0 - state.velocity.0, covariance.block(VELOCITY)),
            (truth.position.0 - state.position.0, estimator.position_covariance()),
            (gyro.0 - estimate.gyro_bias, covariance.block(GYRO_BIAS)),
            (force.0 - estimate.force_bias, covariance.block(FORCE_BIAS)),
            (truth.wind.0 - estimate.wind, covariance.block(WIND)),
        ];
        let nees = |(error, block): &(Vector3<f64>, Matrix3<f64>)| {
            let inverse = block.try_inverse().unwrap_or_else(Matrix3::zeros);
            error.dot(&(inverse * error))
        };
        self.nees.push(core::array::from_fn(|group| nees(&errors[group])));
        self.squares.push(core::array::from_fn(|group| errors[group].0.norm_squared()));
        self.variances.push(core::array::from_fn(|group| errors[group].1.trace()));
        let square = |difference: f64| difference * difference;
        self.flow.push([
            square(truth.airspeed_m_s - state.airspeed_m_s),
            square(truth.alpha_rad - state.alpha),
            square(truth.beta_rad - state.beta),
        ]);
        self.realigned = state.estimate.map_or(0, |status| status.realigned);
    }
}
