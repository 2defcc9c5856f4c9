//! Where the healthy aircraft holds its altitude: a sweep over airspeed, altitude, bank and climb.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use autopilot::config;
use flight_control::{AircraftModel, AltitudeLimit, Demand, FlightControl, Gains, Navigator};
use icd::{ControlPeriod, EffectorKind};
use plant_sim::setup::default_step_us;
use plant_sim::{Airframe, Plant, PlantSetup, Scenario, SetupError, scenario};

use crate::runner;
use trim::{LevelTrim, level_trim};

mod picture;
mod trim;

/// Airspeeds of the sweep, m/s.
pub const AIRSPEEDS_M_S: [f64; 5] = [180.0, 215.0, 250.0, 285.0, 320.0];
/// Altitudes, m.
pub const ALTITUDES_M: [f64; 5] = [600.0, 3_000.0, 6_000.0, 9_000.0, 12_000.0];
/// Banks, deg.
pub const BANKS_DEG: [f64; 4] = [0.0, 30.0, 45.0, 60.0];
/// The climbs and descents, m: from and to.
pub const CLIMBS_M: [[f64; 2]; 6] = [
    [600.0, 5_600.0],
    [3_000.0, 8_000.0],
    [7_000.0, 12_000.0],
    [5_600.0, 600.0],
    [8_000.0, 3_000.0],
    [12_000.0, 7_000.0],
];
/// The bank or the climb begins, s.
const BEGIN_S: f64 = 1.0;
/// Length of a level flight, s; the last [`JUDGED_S`] are judged.
const LEVEL_S: f64 = 100.0;
/// Length of a climb, s.
const CLIMB_S: f64 = 300.0;
/// The altitude error is judged over the last seconds of a flight.
const JUDGED_S: f64 = 20.0;
/// An error up to this counts as held, m.
pub const HELD_WITHIN_M: f64 = 10.0;
/// What of the travel and of the thrust must be left where the altitude has to be held.
const RESERVE: f64 = 0.1;

/// One flight of the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Airspeed reference, m/s.
    pub airspeed_m_s: f64,
    /// Altitude at the start, m.
    pub from_m: f64,
    /// Altitude reference, m.
    pub to_m: f64,
    /// Roll reference, deg.
    pub bank_deg: f64,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flown {
    /// The flight.
    pub case: Case,
    /// Steady flight at its end, if there is one.
    pub trim: Option<LevelTrim>,
    /// Largest altitude error of the last seconds, m.
    pub error_m: f64,
    /// Airspeed at the end minus its reference, m/s.
    pub airspeed_error_m_s: f64,
    /// Largest angle of attack, rad.
    pub alpha_max_rad: f64,
    /// Farthest beyond the reference in a climb; in level flight the largest error, m.
    pub overshoot_m: f64,
    /// What the controller names at the end.
    pub limit: Option<AltitudeLimit>,
    /// The thrust is at its limit at the end.
    pub thrust_saturated: bool,
}

impl Flown {
    /// A trim with a tenth of elevator and thrust left: the altitude has to be held.
    #[must_use]
    pub fn has_reserve(&self) -> bool {
        self.trim.is_some_and(|trim| trim.elevator_left >= RESERVE && trim.thrust_left >= RESERVE)
    }

    /// The altitude is held.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.error_m <= HELD_WITHIN_M
    }
}

/// Every flight of the sweep: level and banked, then climbs and descents.
#[must_use]
pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for bank_deg in BANKS_DEG {
        for from_m in ALTITUDES_M {
            let case = |airspeed_m_s| Case { airspeed_m_s, from_m, to_m: from_m, bank_deg };
            cases.extend(AIRSPEEDS_M_S.map(case));
        }
    }
    for [from_m, to_m] in CLIMBS_M {
        let case = |airspeed_m_s| Case { airspeed_m_s, from_m, to_m, bank_deg: 0.0 };
        cases.extend(AIRSPEEDS_M_S.map(case));
    }
    cases
}

/// The shipped aircraft without a fault, and the shipped controller.
#[derive(Debug, Clone)]
pub struct Sides {
    /// The aircraft at the design point.
    pub plant: PlantSetup,
    /// The controller's model.
    pub model: AircraftModel,
    /// Gains.
    pub gains: Gains,
}

impl Sides {
    /// As shipped.
    ///
    /// # Errors
    /// What is wrong with the shipped files.
    pub fn shipped() -> Result<Self, Box<dyn Error>> {
        let airframe = Airframe::paper();
        let nominal = Scenario::from_toml("nominal.toml", scenario::NOMINAL, &airframe.effectors)?;
        let period = ControlPeriod::DEFAULT;
        let plant = nominal.plant.setup(airframe, 0, period, default_step_us(period));
        let model = config::aircraft_model("tvc_jet.toml", config::DEFAULT_MODEL)?;
        Ok(Self { plant, model, gains: Gains::REFERENCE })
    }

    /// Flies one case.
    ///
    /// # Errors
    /// [`SetupError`] if there is no steady flight to start from.
    pub fn fly(&self, case: &Case) -> Result<Flown, SetupError> {
        let mut plant = self.start(case)?;
        let mut flight = FlightControl::new(self.plant.period, &self.model, &self.gains);
        flight.start_at(&plant.trim().positions());
        let mut navigator = Navigator::default();
        let level = case.from_m == case.to_m;
        let end_s = if level { LEVEL_S } else { CLIMB_S };
        let upwards = if case.to_m >= case.from_m { 1.0 } else { -1.0 };
        let mut flown = Flown {
            case: *case,
            trim: level_trim(&self.plant.airframe, case),
            error_m: 0.0,
            airspeed_error_m_s: 0.0,
            alpha_max_rad: 0.0,
            overshoot_m: 0.0,
            limit: None,
            thrust_saturated: false,
        };
        while plant.time().as_seconds() < end_s && !plant.on_ground() {
            let time_s = plant.time().as_seconds();
            let begun = time_s >= BEGIN_S;
            let demand = Demand {
                altitude_m: if begun { case.to_m } else { case.from_m },
                roll_rad: if begun { case.bank_deg.to_radians() } else { 0.0 },
                airspeed_m_s: case.airspeed_m_s,
            };
            let state = navigator.step(plant.time(), &plant.sense());
            let log = flight.step(&state, &demand);
            let error_m = state.altitude_m - case.to_m;
            let beyond = if level { error_m.abs() } else { upwards * error_m };
            flown.overshoot_m = flown.overshoot_m.max(beyond);
            flown.alpha_max_rad = flown.alpha_max_rad.max(state.alpha);
            if time_s >= end_s - JUDGED_S {
                flown.error_m = flown.error_m.max(error_m.abs());
            }
            flown.airspeed_error_m_s = state.airspeed_m_s - case.airspeed_m_s;
            flown.limit = log.altitude_limit;
            flown.thrust_saturated = log.health.thrust_saturated;
            plant.advance(&log.actuators());
        }
        if plant.on_ground() {
            flown.error_m = case.to_m;
        }
        Ok(flown)
    }

    /// In steady flight at the start of the case; where the engine cannot hold the airspeed, at a lower one.
    fn start(&self, case: &Case) -> Result<Plant, SetupError> {
        let mut setup = self.plant.clone();
        setup.start.altitude_m = case.from_m;
        setup.start.airspeed_m_s = case.airspeed_m_s;
        match Plant::new(&setup) {
            Err(SetupError::Trim(_)) => {
                setup.start.airspeed_m_s -= 20.0;
                Plant::new(&setup)
            }
            plant => plant,
        }
    }
}

/// Flies the sweep and writes `envelope.csv`, `envelope.svg` and `envelope.png`; prints what is not held.
///
/// # Errors
/// What is wrong with the shipped files, or with the folder.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let sides = Sides::shipped()?;
    let flown = runner::map("held altitude", &cases(), |case| sides.fly(case));
    let flown = flown.into_iter().collect::<Result<Vec<_>, _>>()?;
    fs::create_dir_all(out)?;
    fs::write(out.join("envelope.csv"), csv(&flown))?;
    for (name, bytes) in picture::figure(&flown).files()? {
        fs::write(out.join(name), bytes)?;
    }
    print!("{}", summary(&flown));
    Ok(())
}

fn csv(flown: &[Flown]) -> String {
    let mut text = String::from(
        "airspeed_m_s,from_m,to_m,bank_deg,trim_elevator_deg,trim_thrust_n,reserve,error_m,airspeed_error_m_s,\
         overshoot_m,alpha_max_deg,limit\n",
    );
    for f in flown {
        let Case { airspeed_m_s, from_m, to_m, bank_deg } = f.case;
        let (elevator, thrust) = f
            .trim
            .map_or((f64::NAN, f64::NAN), |trim| (trim.elevator_rad.to_degrees(), trim.thrust_n));
        let _ = writeln!(
            text,
            "{airspeed_m_s},{from_m},{to_m},{bank_deg},{elevator:.2},{thrust:.0},{},{:.2},{:.2},{:.1},{:.2},{}",
            u8::from(f.has_reserve()),
            f.error_m,
            f.airspeed_error_m_s,
            f.overshoot_m,
            f.alpha_max_rad.to_degrees(),
            name(f),
        );
    }
    text
}

/// What is at its limit, in a word.
fn name(flown: &Flown) -> &'static str {
    match flown.limit {
        Some(limit) => limit.name(),
        None if flown.thrust_saturated => "engine (airspeed)",
        None => "",
    }
}

fn summary(flown: &[Flown]) -> String {
    let due = flown.iter().filter(|f| f.has_reserve());
    let worst = due.clone().map(|f| f.error_m).fold(0.0, f64::max);
    let held = due.clone().filter(|f| f.is_held()).count();
    let mut text = format!(
        "{held} of {} flights with a reserve are within {HELD_WITHIN_M} m; worst {worst:.2} m\n",
        due.count()
    );
    for f in flown.iter().filter(|f| !f.is_held()) {
        let Case { airspeed_m_s, from_m, to_m, bank_deg } = f.case;
        let reserve = if f.has_reserve() { "with" } else { "without" };
        let _ = writeln!(
            text,
            "{airspeed_m_s:.0} m/s, {from_m:.0} to {to_m:.0} m, {bank_deg:.0} deg, {reserve} a reserve: {:.0} m off; {}",
            f.error_m,
            if f.limit.is_some() { name(f) } else { "nothing is named" },
        );
    }
    text
}

/// The engine's largest thrust and the travel of the elevator command of an airframe: N, rad.
fn limits(airframe: &Airframe) -> (f64, f64) {
    let largest =
        |kind| airframe.effectors.of_kind(kind).map(|e| airframe.servos[e].max).fold(0.0, f64::max);
    (largest(EffectorKind::Engine), largest(EffectorKind::Elevator))
}
