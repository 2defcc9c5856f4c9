//! Steady level turns of the plant: what an altitude that is held would need.

use icd::Body;
use plant_sim::Airframe;
use plant_sim::aerodynamics::{AirForces, AirState, Coefficients};
use plant_sim::atmosphere::{self, LocalDensity};

use super::{Case, limits};

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
pub(super) fn level_trim(airframe: &Airframe, case: &Case) -> Option<LevelTrim> {
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
