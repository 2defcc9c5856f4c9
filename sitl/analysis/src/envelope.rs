//! Where the healthy aircraft holds its altitude: a sweep over airspeed, altitude, bank and climb.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use flight_control::{AircraftModel, AltitudeLimit, Demand, FlightControl, Gains, Navigator};
use icd::{Body, EffectorKind};
use plant_sim::aerodynamics::{AirForces, AirState, Coefficients};
use plant_sim::atmosphere::{self, LocalDensity};
use plant_sim::{Airframe, Plant, PlantSetup, SetupError};

use crate::builder::SetupOptions;
use crate::closed_loop::FlightSetup;

use crate::chart::Figure;
use crate::chart::drawing::Drawing;
use crate::false_alarms::write;
use crate::runner;

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
        let FlightSetup { plant, model, parameters, .. } =
            SetupOptions::default().setup("nominal")?;
        Ok(Self { plant, model, gains: parameters.gains })
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
    write(&out.join("envelope.csv"), csv(&flown).as_bytes())?;
    for (name, bytes) in figure(&flown).files()? {
        write(&out.join(name), &bytes)?;
    }
    print_text!("{}", summary(&flown));
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

/// g, m/s².
const GRAVITY_M_S2: f64 = 9.806_65;
/// Halvings of the interval of the angle of attack: to a thousandth of a millidegree.
const HALVINGS: u32 = 40;

/// A steady turn without climb and sideslip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelTrim {
    /// Both elevators, rad.
    pub elevator_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
    /// What is left of the travel of the elevators, 0 to 1; negative if there is too little.
    pub elevator_left: f64,
    /// What is left of the thrust, likewise.
    pub thrust_left: f64,
}

/// The steady turn at the end of a case, by the plant's aerodynamics; `None` if the wing cannot lift it.
fn level_trim(airframe: &Airframe, case: &Case) -> Option<LevelTrim> {
    let density = LocalDensity::around(case.to_m).at(case.to_m);
    let v = case.airspeed_m_s;
    let q_s = 0.5 * density * v * v * airframe.aero.geometry().area_m2;
    let load_factor = 1.0 / case.bank_deg.to_radians().cos();
    let pitch_rate = GRAVITY_M_S2 * (load_factor - 1.0 / load_factor) / v;
    let weight = load_factor * airframe.mass.mass_kg * GRAVITY_M_S2;
    let forces = AirForces::new(airframe).ok()?;
    let mach = v / atmosphere::speed_of_sound(case.to_m);
    let at = |alpha_rad: f64, elevator_rad: f64| -> Coefficients {
        let rates = Body::new(0.0, pitch_rate, 0.0);
        let air = AirState { airspeed_m_s: v, alpha_rad, beta_rad: 0.0, rates };
        let positions = airframe.follow([0.0, elevator_rad, 0.0, 0.0]);
        forces.coefficients(&air, mach, &positions)
    };
    // Linear in the deflection, so that one difference has it.
    let per_elevator = (at(0.0, 0.1).pitch - at(0.0, -0.1).pitch) / 0.2;
    let balanced = |alpha_rad: f64| {
        let elevator_rad = -at(alpha_rad, 0.0).pitch / per_elevator;
        let c = at(alpha_rad, elevator_rad);
        let thrust_n = q_s * c.drag / alpha_rad.cos();
        (elevator_rad, thrust_n, q_s * c.lift + thrust_n * alpha_rad.sin() - weight)
    };
    let (mut low, mut high) = (-0.1, airframe.limits.alpha_rad);
    if balanced(high).2 < 0.0 {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if balanced(middle).2 < 0.0 { low = middle } else { high = middle }
    }
    let (elevator_rad, thrust_n, _) = balanced(high);
    let (thrust_max_n, travel_rad) = limits(airframe);
    Some(LevelTrim {
        elevator_rad,
        thrust_n,
        elevator_left: 1.0 - elevator_rad.abs() / travel_rad,
        thrust_left: 1.0 - thrust_n / thrust_max_n,
    })
}

/// Width and height of a field.
const FIELD: (f64, f64) = (112.0, 40.0);
/// Left of the first field: the altitudes.
const LEFT: f64 = 150.0;
/// Above the first field of a block: its title and the airspeeds.
const TOP: f64 = 60.0;
/// Around blocks and fields.
const ROOM: f64 = 20.0;

/// What is seen.
const TITLE: [&str; 3] = [
    "Healthy aircraft: largest altitude error of the last 20 s of each flight, m",
    "Green: within 10 m. Red: not, although a tenth of elevator and thrust is left.",
    "Grey: no such trim. Below the number: what the controller names.",
];

/// Draws it.
fn figure(flown: &[Flown]) -> Figure {
    let mut drawing = Drawing::default();
    let mut y = 26.0;
    for title in TITLE {
        drawing.text((ROOM, y), "start", r#" font-size="15""#, title);
        y += 20.0;
    }
    let banks = BANKS_DEG.iter().map(|bank| {
        let rows = ALTITUDES_M.iter().map(|altitude| format!("{altitude:.0} m")).collect();
        (format!("bank {bank:.0} deg"), rows)
    });
    let climbs = CLIMBS_M.iter().map(|[from, to]| format!("{from:.0} to {to:.0} m")).collect();
    let blocks = banks.chain([("climbs and descents".to_owned(), climbs)]);
    let mut lines = flown.chunks(AIRSPEEDS_M_S.len());
    for (title, rows) in blocks {
        let rows: Vec<String> = rows;
        drawing.text((ROOM, y + 14.0), "start", r#" font-size="16""#, &title);
        let mut x = LEFT;
        for airspeed in AIRSPEEDS_M_S {
            let label = format!("{airspeed:.0} m/s");
            drawing.text((x + 0.5 * FIELD.0, y + 40.0), "middle", "", &label);
            x += FIELD.0;
        }
        y += TOP;
        for label in rows {
            drawing.text((LEFT - 10.0, y + 25.0), "end", "", &label);
            let mut x = LEFT;
            for flown in lines.next().unwrap_or_default() {
                field(&mut drawing, (x, y), flown);
                x += FIELD.0;
            }
            y += FIELD.1;
        }
        y += ROOM;
    }
    let width = LEFT + AIRSPEEDS_M_S.len() as f64 * FIELD.0 + ROOM;
    let caption = TITLE.join(" ");
    Figure { name: "envelope", caption, svg: drawing.finish((width, y)) }
}

fn field(drawing: &mut Drawing, (x, y): (f64, f64), flown: &Flown) {
    let style = match (flown.is_held(), flown.has_reserve()) {
        (true, _) => r##"fill="#bfe3c0""##,
        (false, true) => r##"fill="#f0a8a0""##,
        (false, false) => r##"fill="#d8d8d8""##,
    };
    let decimals = if flown.error_m < 10.0 { 1 } else { 0 };
    let (middle, limit) = (x + 0.5 * FIELD.0 - 2.0, name(flown));
    drawing.rectangle((x, y), (x + FIELD.0 - 4.0, y + FIELD.1 - 4.0), style, "");
    let error = format!("{:.decimals$}", flown.error_m);
    drawing.text((middle, y + 17.0), "middle", "", &error);
    drawing.text((middle, y + 32.0), "middle", r#" font-size="11""#, limit);
}
