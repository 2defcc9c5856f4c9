//! Where the healthy aircraft holds its altitude: a sweep over airspeed, altitude, bank and climb.

use core::ops::ControlFlow;
use std::fmt::Write as _;

use flight_control::{AltitudeLimit, CompensatorMode};
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Body, EffectorKind, SimTime};
use lab_judges::Judge as _;
use lab_judges::altitude::AltitudeJudge;
use plant_sim::aerodynamics::{AirForces, AirState, Coefficients};
use plant_sim::atmosphere::{Atmosphere, LocalDensity};
use plant_sim::{Airframe, Plant, SetupError};

use crate::chart::drawing::Drawing;
use crate::chart::{Figure, write_figure};
use crate::closed_loop::{FlightSetup, watch};
use crate::false_alarms::flights::entry;
use crate::problem::Problem;
use crate::runner;
use crate::study::{Scale, Sides, StudyOptions};

/// What the sweep sets itself: beginnings of keys.
const OWN: [&str; 4] =
    ["plant.start.altitude", "plant.start.airspeed", "plant.duration", "autopilot.reference"];

/// Airspeeds of the sweep with the jet of the paper, m/s; altitudes and climbs likewise.
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
/// Length of a level flight, s.
const LEVEL_S: f64 = 100.0;
/// Length of a climb, s.
const CLIMB_S: f64 = 300.0;
/// An error up to this counts as held, m.
pub const HELD_WITHIN_M: f64 = 10.0;
/// What of the travel and of the thrust must be left where the altitude has to be held.
const RESERVE: f64 = 0.1;

/// One flight of the sweep.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
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
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Flown {
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
    pub fn has_reserve(&self) -> bool {
        self.trim.is_some_and(|trim| trim.elevator_left >= RESERVE && trim.thrust_left >= RESERVE)
    }

    /// The altitude is held.
    pub fn is_held(&self) -> bool {
        self.error_m <= HELD_WITHIN_M
    }
}

/// Every flight of the sweep, at the scale of an aircraft: level and banked, then climbs and descents.
pub fn cases(scale: &Scale) -> Vec<Case> {
    let airspeeds = AIRSPEEDS_M_S.map(|airspeed_m_s| airspeed_m_s * scale.airspeed);
    let levels = BANKS_DEG.into_iter().flat_map(|bank_deg| ALTITUDES_M.map(|m| (m, m, bank_deg)));
    let climbs = CLIMBS_M.map(|[from_m, to_m]| (from_m, to_m, 0.0));
    let all = levels.chain(climbs).flat_map(|(from_m, to_m, bank_deg)| {
        let [from_m, to_m] = [from_m, to_m].map(|altitude_m| altitude_m * scale.altitude);
        airspeeds.map(|airspeed_m_s| Case { airspeed_m_s, from_m, to_m, bank_deg })
    });
    all.collect()
}

pub fn fly(sides: &Sides, case: &Case) -> Result<Flown, Problem> {
    let nothing = Flown { case: *case, error_m: f64::INFINITY, ..Flown::default() };
    let Some(setup) = setup(sides, case)? else { return Ok(nothing) };
    let level = case.from_m == case.to_m;
    let mut judge = AltitudeJudge::of(&setup);
    let upwards = if case.to_m >= case.from_m { 1.0 } else { -1.0 };
    let trim = level_trim(&setup.plant.airframe, case);
    let mut flown = Flown { trim, error_m: 0.0, ..nothing };
    let end = watch(&setup, |tick| {
        judge.look(tick);
        let error_m = tick.log.state.altitude_m - case.to_m;
        let beyond = if level { error_m.abs() } else { upwards * error_m };
        flown.overshoot_m = flown.overshoot_m.max(beyond);
        flown.limit = tick.log.altitude_limit;
        flown.thrust_saturated = tick.log.health.thrust_saturated;
        ControlFlow::Continue(())
    })?;
    flown.error_m = judge.error_m.filter(|_| !end.on_ground).unwrap_or(case.to_m);
    flown.airspeed_error_m_s = judge.airspeed_error_m_s.unwrap_or(0.0);
    flown.alpha_max_rad = judge.alpha_max_rad.unwrap_or(0.0);
    Ok(flown)
}

/// In steady flight at the start of the case; where the engine cannot hold the airspeed, at a lower one; `None` if there is none either.
fn setup(sides: &Sides, case: &Case) -> Result<Option<FlightSetup>, Problem> {
    let Case { airspeed_m_s, from_m, to_m, bank_deg } = *case;
    let mut setup = sides.nominal().clone();
    let seconds = if from_m == to_m { LEVEL_S } else { CLIMB_S };
    setup.duration = SimTime::from_seconds(seconds).unwrap_or(SimTime::ZERO);
    let references =
        entry(0.0, 0.0, from_m, airspeed_m_s) + &entry(BEGIN_S, bank_deg, to_m, airspeed_m_s);
    setup.references = autopilot::config::references("the study", &references)?;
    let start = &mut setup.plant.start;
    (start.altitude_m, start.airspeed_m_s) = (from_m, airspeed_m_s);
    let is_steady =
        |setup: &FlightSetup| !matches!(Plant::new(&setup.plant), Err(SetupError::Trim(_)));
    if is_steady(&setup) {
        return Ok(Some(setup));
    }
    setup.plant.start.airspeed_m_s -= 20.0 * sides.scale().airspeed;
    Ok(is_steady(&setup).then_some(setup))
}

/// Flies the sweep and writes `envelope.csv`, `envelope.svg` and `envelope.png`; prints what is not held.
pub fn run(options: &StudyOptions) -> Result<(), Problem> {
    let sides = options.sides(CompensatorMode::Armed, &OWN)?;
    let folder = sides.begin(&options.out)?;
    let flown = runner::try_map("held altitude", &cases(&sides.scale()), |case| fly(&sides, case))?;
    folder.write("envelope.csv", csv(&flown).as_bytes())?;
    write_figure(&folder, &figure(sides.airframe().name.as_ref(), &flown))?;
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
        let error_m =
            if f.error_m.is_finite() { format!("{:.2}", f.error_m) } else { String::new() };
        let _ = writeln!(
            text,
            "{airspeed_m_s},{from_m},{to_m},{bank_deg},{elevator:.2},{thrust:.0},{},{error_m},{:.2},{:.1},{:.2},{}",
            u8::from(f.has_reserve()),
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
        _ if flown.error_m.is_infinite() => "no steady start",
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
    let begun = flown.iter().filter(|f| f.error_m.is_finite());
    if begun.clone().count() < flown.len() {
        let none = flown.len() - begun.clone().count();
        let _ = writeln!(text, "{none} of {} have no steady flight to start from", flown.len());
    }
    for f in begun.filter(|f| !f.is_held()) {
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
    let density = LocalDensity::of(&Atmosphere::STANDARD, case.to_m).at(case.to_m);
    let v = case.airspeed_m_s;
    let q_s = 0.5 * density * v * v * airframe.aero.geometry().area_m2;
    let load_factor = 1.0 / case.bank_deg.to_radians().cos();
    let pitch_rate = STANDARD_GRAVITY_M_S2 * (load_factor - 1.0 / load_factor) / v;
    let weight = load_factor * airframe.mass.mass_kg * STANDARD_GRAVITY_M_S2;
    let forces = AirForces::new(airframe).ok()?;
    let mach = v / Atmosphere::STANDARD.speed_of_sound(case.to_m);
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

const TITLE: [&str; 3] = [
    ": largest altitude error of the last 20 s of each healthy flight, m",
    "Green: within 10 m. Red: not, although a tenth of elevator and thrust is left.",
    "Grey: no such trim. Below the number: what the controller names.",
];

fn figure(aircraft: &str, flown: &[Flown]) -> Figure {
    let mut drawing = Drawing::default();
    let mut y = 26.0;
    let [what, reserve, none] = TITLE;
    let title = [format!("{aircraft}{what}"), reserve.to_owned(), none.to_owned()];
    for title in &title {
        drawing.text((ROOM, y), "start", r#" font-size="15""#, title);
        y += 20.0;
    }
    let banks = BANKS_DEG.map(|bank| (format!("bank {bank:.0} deg"), ALTITUDES_M.len()));
    let blocks = banks.into_iter().chain([("climbs and descents".to_owned(), CLIMBS_M.len())]);
    let mut lines = flown.chunks(AIRSPEEDS_M_S.len());
    for (title, rows) in blocks {
        drawing.text((ROOM, y + 14.0), "start", r#" font-size="16""#, &title);
        let places = (0..).map(|column| LEFT + f64::from(column) * FIELD.0);
        for (flown, x) in flown.iter().zip(places).take(AIRSPEEDS_M_S.len()) {
            let label = format!("{:.0} m/s", flown.case.airspeed_m_s);
            drawing.text((x + 0.5 * FIELD.0, y + 40.0), "middle", "", &label);
        }
        y += TOP;
        for line in lines.by_ref().take(rows) {
            let Case { from_m, to_m, .. } = line[0].case;
            let label = match from_m == to_m {
                true => format!("{from_m:.0} m"),
                false => format!("{from_m:.0} to {to_m:.0} m"),
            };
            drawing.text((LEFT - 10.0, y + 25.0), "end", "", &label);
            let mut x = LEFT;
            for flown in line {
                field(&mut drawing, (x, y), flown);
                x += FIELD.0;
            }
            y += FIELD.1;
        }
        y += ROOM;
    }
    let width = LEFT + AIRSPEEDS_M_S.len() as f64 * FIELD.0 + ROOM;
    let caption = title.join(" ");
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
    let error = if flown.error_m.is_finite() {
        format!("{:.decimals$}", flown.error_m)
    } else {
        "-".to_owned()
    };
    drawing.text((middle, y + 17.0), "middle", "", &error);
    drawing.text((middle, y + 32.0), "middle", r#" font-size="11""#, limit);
}
