//! Whether a steady flight at the last references exists, and what the controller says it lacks.

use flight_control::AltitudeLimit;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{AxisGains, Body};
use lab_engine::FlightSetup;
use lab_engine::flight::Tick;
use plant_sim::Airframe;
use plant_sim::aerodynamics::{AirForces, AirState, Coefficients};
use plant_sim::atmosphere::{Atmosphere, LocalDensity};

use crate::Judge;

/// Numbers of the judge. `steady_reserve` is 1 where a tenth of elevator and thrust is left; `altitude_limit` 1 engine, 2 elevator,
/// 3 wing, 0 none.
pub const COLUMNS: [(&str, &str); 5] = [
    ("steady_elevator", "rad"),
    ("steady_thrust", "N"),
    ("steady_reserve", "1"),
    ("altitude_limit", "1"),
    ("thrust_saturated", "1"),
];

/// What of the travel and of the thrust must be left where the altitude has to be held.
const RESERVE: f64 = 0.1;
/// Halvings of the interval of the angle of attack: to a thousandth of a millidegree.
const HALVINGS: u32 = 40;

/// Looks at the last tick.
#[derive(Debug, Clone)]
pub struct LevelJudge {
    airframe: Airframe,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    altitude_m: f64,
    airspeed_m_s: f64,
    roll_rad: f64,
    limit: Option<AltitudeLimit>,
    thrust_saturated: bool,
}

/// A steady turn without climb and sideslip.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SteadyTurn {
    /// Both elevators, rad.
    elevator_rad: f64,
    thrust_n: f64,
    has_reserve: bool,
}

impl LevelJudge {
    pub fn of(setup: &FlightSetup) -> Self {
        Self { airframe: setup.plant.airframe.clone(), last: None }
    }
}

impl Judge for LevelJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let demand = &tick.snapshot.demand;
        self.last = Some(Last {
            altitude_m: demand.altitude_m,
            airspeed_m_s: demand.airspeed_m_s,
            roll_rad: demand.roll_rad,
            limit: tick.log.altitude_limit,
            thrust_saturated: tick.log.health.thrust_saturated,
        });
    }

    fn values(&self) -> Vec<Option<f64>> {
        let turn = self.last.and_then(|last| steady_turn(&self.airframe, &last));
        let flag = |flag: bool| f64::from(u8::from(flag));
        let limit = |last: Last| f64::from(last.limit.map_or(0, AltitudeLimit::code));
        vec![
            turn.map(|turn| turn.elevator_rad),
            turn.map(|turn| turn.thrust_n),
            self.last.map(|_| flag(turn.is_some_and(|turn| turn.has_reserve))),
            self.last.map(limit),
            self.last.map(|last| flag(last.thrust_saturated)),
        ]
    }
}

/// By the plant's aerodynamics; `None` if the wing cannot lift it.
fn steady_turn(airframe: &Airframe, at: &Last) -> Option<SteadyTurn> {
    let density = LocalDensity::of(&Atmosphere::STANDARD, at.altitude_m).at(at.altitude_m);
    let v = at.airspeed_m_s;
    let q_s = 0.5 * density * v * v * airframe.aero.geometry().area_m2;
    let load_factor = 1.0 / at.roll_rad.cos();
    // q = ψ̇ sin φ with ψ̇ = g tan φ / V, in terms of n = 1 / cos φ.
    let pitch_rate = STANDARD_GRAVITY_M_S2 * (load_factor - 1.0 / load_factor) / v;
    let weight = load_factor * airframe.mass.mass_kg * STANDARD_GRAVITY_M_S2;
    let forces = AirForces::new(airframe).ok()?;
    let mach = v / Atmosphere::STANDARD.speed_of_sound(at.altitude_m);
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
    // The upper end, with which the wing carries the weight for sure.
    let (elevator_rad, thrust_n, _) = balanced(high);
    // The largest command that an effector follows to its end.
    let largest = |gain: fn(&AxisGains) -> f64| {
        let follows = airframe.effectors.all().filter(|e| gain(&airframe.gains[*e]) != 0.0);
        follows.map(|e| airframe.servos[e].max / gain(&airframe.gains[e]).abs()).fold(0.0, f64::max)
    };
    let used = [
        elevator_rad.abs() / largest(|gains| gains.pitch),
        thrust_n / largest(|gains| gains.thrust),
    ];
    let has_reserve = used.iter().all(|used| *used <= 1.0 - RESERVE);
    Some(SteadyTurn { elevator_rad, thrust_n, has_reserve })
}
