//! Propulsion of an airframe file: the possible thrust at a flight condition, and the moment of the rotating parts.
//!
//! The engine's control accepts a thrust in newton and sets its lever for it. The possible thrust is between the two
//! ends of the lever at this Mach number and altitude; the lag belongs to the effector.

use host_io::problem::{Problem, problem};
use serde::{Deserialize, Serialize};

use super::lookup::{SumText, Sums};
use super::{TableText, read_all};
use crate::range::{check_range, check_vector};

/// Inputs of a term of the thrust: lever from 0 to 1, Mach number, altitude.
pub const THRUST_INPUTS: [&str; 3] = ["throttle", "mach", "altitude_m"];

/// The same with a second lever.
const END_INPUTS: [&str; 4] = ["throttle", "mach", "altitude_m", "other_throttle"];

/// The table `[propulsion]` of an airframe file: limits of the thrust besides the travel of the engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Propulsion {
    /// Thrust as a sum over tables.
    Tables(ThrustTables),
    /// A propeller on an electric motor.
    Propeller(Propeller),
}

/// Thrust in newton as a sum of terms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThrustTables {
    /// The terms, N; see [`THRUST_INPUTS`].
    pub thrust_n: Vec<String>,
    #[serde(default)]
    pub table: Vec<TableText>,
}

/// A fixed-pitch propeller on a direct-current motor.
///
/// R. W. Beard, T. W. McLain, "Small Unmanned Aircraft: Theory and Practice", Princeton 2012, with the propulsion of the authors'
/// later course material: thrust ρ n² D⁴ C_T(J) and torque ρ n² D⁵ C_Q(J), advance ratio J = V / (n D), n in turns/s; the
/// motor's torque K ((V_in - K Ω) / R - i_0) balances that of the propeller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Propeller {
    /// Diameter D, m.
    pub diameter_m: f64,
    /// C_T: coefficients of J⁰, J, J².
    pub c_thrust: [f64; 3],
    /// C_Q: coefficients of J⁰, J, J².
    pub c_torque: [f64; 3],
    /// K, torque over current and voltage over speed, V s/rad.
    pub motor_constant_v_s: f64,
    /// R, resistance of the winding, ohm.
    pub resistance_ohm: f64,
    /// i_0, current without load, A.
    pub no_load_current_a: f64,
    /// Largest voltage, V.
    pub voltage_max_v: f64,
}

/// The propulsion, prepared for the equations of motion.
#[derive(Debug, Clone)]
pub enum Engine {
    Tables {
        /// Over [`THRUST_INPUTS`].
        thrust: Sums,
        /// At both ends of the lever, in one pass: over `END_INPUTS`.
        ends: Sums,
    },
    Propeller(Propeller),
}

impl Propulsion {
    /// Checks the numbers, reads the tables and resolves every name.
    pub fn build(&self) -> Result<Engine, Problem> {
        match self {
            Self::Tables(thrust) => thrust.build(),
            Self::Propeller(propeller) => {
                propeller.check()?;
                Ok(Engine::Propeller(*propeller))
            }
        }
    }
}

impl ThrustTables {
    fn build(&self) -> Result<Engine, Problem> {
        let tables = read_all("propulsion", &self.table)?;
        let sums = |terms: &[&[String]], inputs: &[&str]| {
            let sums = terms.iter().map(|terms| SumText { key: "thrust_n", terms });
            let sums: Vec<SumText<'_>> = sums.collect();
            let inputs: Vec<String> = inputs.iter().map(|name| (*name).to_owned()).collect();
            Sums::new(&tables, &sums, &inputs).map_err(|problem| problem!("[propulsion] {problem}"))
        };
        let thrust = sums(&[&self.thrust_n], &THRUST_INPUTS)?;
        let other: Vec<String> = self.thrust_n.iter().map(|term| at_other_lever(term)).collect();
        Ok(Engine::Tables { thrust, ends: sums(&[&self.thrust_n, &other], &END_INPUTS)? })
    }
}

/// The term with the second lever in place of the first.
fn at_other_lever(term: &str) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let words = term.split_inclusive(|c| !is_name(c));
    let renamed = words.map(|word| match word.strip_prefix("throttle") {
        Some(rest) if !rest.starts_with(is_name) => format!("other_throttle{rest}"),
        _ => word.to_owned(),
    });
    renamed.collect()
}

impl Engine {
    /// Thrust with the lever at `throttle` (0 to 1), N. `airspeed_m_s` and `density` (kg/m³) are those of the air, `mach`
    /// and `altitude_m` its Mach number and altitude.
    pub fn thrust_at(&self, throttle: f64, at: &EngineAir) -> f64 {
        match self {
            Self::Tables { thrust, .. } => {
                let mut sum = [0.0];
                thrust.add_to(&mut sum, &[throttle, at.mach, at.altitude_m]);
                sum[0]
            }
            Self::Propeller(propeller) => {
                let speed = propeller.speed_at_throttle(throttle, at);
                propeller.thrust(speed, at)
            }
        }
    }

    /// Roll moment of the rotating parts on the airframe at this thrust, N m.
    #[inline]
    pub fn roll_n_m(&self, thrust_n: f64, at: &EngineAir) -> f64 {
        match self {
            Self::Tables { .. } => 0.0,
            Self::Propeller(propeller) => {
                -propeller.torque(propeller.speed_at_thrust(thrust_n, at), at)
            }
        }
    }

    /// Thrust with the lever at 0 and at 1, N.
    pub fn ends(&self, at: &EngineAir) -> [f64; 2] {
        match self {
            Self::Tables { ends, .. } => {
                let mut sums = [0.0; 2];
                ends.add_to(&mut sums, &[0.0, at.mach, at.altitude_m, 1.0]);
                sums
            }
            Self::Propeller(_) => [self.thrust_at(0.0, at), self.thrust_at(1.0, at)],
        }
    }
}

/// The air at the engine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EngineAir {
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Density, kg/m³.
    pub density: f64,
    pub mach: f64,
    /// Altitude, m.
    pub altitude_m: f64,
}

impl Propeller {
    fn check(&self) -> Result<(), Problem> {
        let section = "propulsion";
        check_range(section, "diameter_m", self.diameter_m, 0.01, 10.0)?;
        check_range(section, "motor_constant_v_s", self.motor_constant_v_s, 1.0e-5, 100.0)?;
        check_range(section, "resistance_ohm", self.resistance_ohm, 1.0e-5, 1_000.0)?;
        check_range(section, "no_load_current_a", self.no_load_current_a, 0.0, 1_000.0)?;
        check_range(section, "voltage_max_v", self.voltage_max_v, 0.1, 10_000.0)?;
        for (key, c) in [("c_thrust", self.c_thrust), ("c_torque", self.c_torque)] {
            // At rest a propeller pulls and has to be driven: otherwise the quadratics below have no root.
            check_range(section, key, c[0], 1.0e-6, 10.0)?;
            check_vector(section, key, c, 10.0)?;
        }
        Ok(())
    }

    /// ρ D² times the coefficients of Ω², Ω and 1, from the coefficients `c` of J⁰, J and J².
    fn polynomial(&self, c: &[f64; 3], at: &EngineAir) -> [f64; 3] {
        let per_turn = self.diameter_m / core::f64::consts::TAU;
        let scale = at.density * self.diameter_m * self.diameter_m;
        let v = at.airspeed_m_s;
        [scale * c[0] * per_turn * per_turn, scale * c[1] * per_turn * v, scale * c[2] * v * v]
    }

    /// Thrust at the speed Ω (rad/s), N.
    fn thrust(&self, speed: f64, at: &EngineAir) -> f64 {
        let [a, b, c] = self.polynomial(&self.c_thrust, at);
        (a * speed + b) * speed + c
    }

    /// Torque that turns the propeller at the speed Ω (rad/s), N m.
    fn torque(&self, speed: f64, at: &EngineAir) -> f64 {
        let [a, b, c] = self.polynomial(&self.c_torque, at);
        self.diameter_m * ((a * speed + b) * speed + c)
    }

    /// Ω at which propeller and motor balance, rad/s.
    fn speed_at_throttle(&self, throttle: f64, at: &EngineAir) -> f64 {
        let [a, b, c] = self.polynomial(&self.c_torque, at).map(|x| x * self.diameter_m);
        let (k, r) = (self.motor_constant_v_s, self.resistance_ohm);
        let voltage = throttle * self.voltage_max_v;
        larger_root(a, b + k * k / r, c - k * (voltage / r - self.no_load_current_a))
    }

    /// Ω that gives this thrust, rad/s; of two speeds the larger, as a windmilling propeller brakes most at some speed.
    fn speed_at_thrust(&self, thrust_n: f64, at: &EngineAir) -> f64 {
        let [a, b, c] = self.polynomial(&self.c_thrust, at);
        larger_root(a, b, c - thrust_n)
    }
}

/// The larger root of a x² + b x + c, for positive a; zero where it would be negative or there is none.
fn larger_root(a: f64, b: f64, c: f64) -> f64 {
    let square = (b * b - 4.0 * a * c).max(0.0);
    ((square.sqrt() - b) / (2.0 * a)).max(0.0)
}

#[cfg(test)]
mod tests;
