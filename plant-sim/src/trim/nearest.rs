//! If there is no steady level flight: the flight that comes closest to it, and what prevents a steady one.

use core::fmt;

use icd::units::DEG_PER_RAD;

use super::{Problem, TOLERANCE, Unknowns};

/// Steps of the search.
const STEPS_MAX: u32 = 200;

/// Largest turn rate in the search, rad/s: a trim balances a Coriolis force.
const TURN_RATE_MAX_RAD_S: f64 = 0.1;

/// Accelerations that should be zero: u', v', w' in m/s² and p', q', r' in rad/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residuals(pub [f64; 6]);

/// The flight inside the limits that is closest to a steady one.
#[derive(Debug, Clone, PartialEq)]
pub struct Nearest {
    /// Quantities whose limits would have to be wider.
    pub limits: Vec<AtLimit>,
    pub residuals: Residuals,
}

/// A quantity at the end of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtLimit {
    pub quantity: &'static str,
    /// Its limit, in `unit`.
    pub limit: f64,
    /// deg, N or deg/s.
    pub unit: &'static str,
}

impl fmt::Display for Residuals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = ["u'", "v'", "w'", "p'", "q'", "r'"];
        let units = ["m/s2", "m/s2", "m/s2", "rad/s2", "rad/s2", "rad/s2"];
        for (i, ((value, name), unit)) in self.0.iter().zip(names).zip(units).enumerate() {
            write!(f, "{}{name} = {value:.3e} {unit}", if i == 0 { "" } else { ", " })?;
        }
        Ok(())
    }
}

impl fmt::Display for Nearest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for AtLimit { quantity, limit, unit } in &self.limits {
            write!(f, "the {quantity} is at its limit of {limit} {unit}, ")?;
        }
        write!(f, "and {} are left", self.residuals)
    }
}

/// Names and units of the unknowns, and the number of units in one SI unit.
const QUANTITIES: [(&str, &str, f64); 6] = [
    ("angle of attack", "deg", DEG_PER_RAD),
    ("elevator command", "deg", DEG_PER_RAD),
    ("thrust", "N", 1.0),
    ("aileron command", "deg", DEG_PER_RAD),
    ("rudder command", "deg", DEG_PER_RAD),
    ("turn rate", "deg/s", DEG_PER_RAD),
];

impl Problem<'_> {
    /// Least squares of the residuals with every unknown inside its range (Levenberg and Marquardt, projected).
    pub(super) fn nearest(&self) -> (Unknowns, Nearest) {
        let [low, high] = self.ranges();
        let inside = |x: Unknowns| x.zip_zip_map(&low, &high, |x, low, high| x.max(low).min(high));
        let mut x = inside(Unknowns::new(0.05, 0.0, 0.5 * (low[2] + high[2]), 0.0, 0.0, 0.0));
        let mut residual = self.residual(&x);
        let mut damping = 1.0e-3;
        for _ in 0..STEPS_MAX {
            if residual.amax() < TOLERANCE {
                break;
            }
            let mut jacobian = self.jacobian(&x);
            let gradient = jacobian.tr_mul(&residual);
            for (i, mut column) in jacobian.column_iter_mut().enumerate() {
                // The unknown is at an end of its range, and the residual would decrease beyond it.
                let is_held =
                    (x[i] <= low[i] && gradient[i] > 0.0) || (x[i] >= high[i] && gradient[i] < 0.0);
                if is_held {
                    column.fill(0.0);
                }
            }
            let mut normal = jacobian.tr_mul(&jacobian);
            for i in 0..6 {
                normal[(i, i)] += damping * normal[(i, i)].max(1.0e-12);
            }
            let Some(step) = normal.lu().solve(&jacobian.tr_mul(&residual)) else { break };
            let next = inside(x - step);
            let then = self.residual(&next);
            if then.norm() < residual.norm() {
                (x, residual, damping) = (next, then, (damping / 3.0).max(1.0e-12));
            } else {
                damping *= 4.0;
            }
        }
        let is_end = |i: &usize| x[*i] <= low[*i] || x[*i] >= high[*i];
        // A control that the aircraft lacks limits nothing.
        let limits = (0..6).filter(is_end).filter(|i| low[*i] < high[*i]).map(|i| {
            let (quantity, unit, per_si) = QUANTITIES[i];
            // An angle of a file was converted through radians.
            let limit = libm::round(x[i] * per_si * 1.0e9) / 1.0e9;
            AtLimit { quantity, limit, unit }
        });
        let limits = limits.collect();
        (x, Nearest { limits, residuals: Residuals(residual.into()) })
    }

    /// Smallest and largest of each unknown.
    fn ranges(&self) -> [Unknowns; 2] {
        let (airframe, pressure_pa) = (self.dynamics.airframe(), self.pressure_pa());
        let command = |command: usize| {
            let ends = airframe.effectors.all().filter_map(|effector| {
                let gains = &airframe.gains[effector];
                let gain = [gains.roll, gains.pitch, gains.yaw][command];
                let [low, high] = airframe.servos[effector].travel_at(pressure_pa);
                let ends = [low / gain, high / gain];
                (gain != 0.0).then_some([ends[0].min(ends[1]), ends[0].max(ends[1])])
            });
            // The trim has to be inside the travel of each effector that it uses.
            ends.reduce(|a, b| [a[0].max(b[0]), a[1].min(b[1])]).unwrap_or([0.0; 2])
        };
        let alpha = airframe.limits.alpha_rad;
        let [aileron, elevator, rudder] = [0, 1, 2].map(command);
        let turn = [-TURN_RATE_MAX_RAD_S, TURN_RATE_MAX_RAD_S];
        let all = [[-alpha, alpha], elevator, self.thrust_range_n(), aileron, rudder, turn];
        [0, 1].map(|end| Unknowns::from(all.map(|range| range[end])))
    }
}
