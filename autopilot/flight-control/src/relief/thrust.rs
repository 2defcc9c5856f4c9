//! The thrust on which the nozzle lives: more while yaw is missing more and more, and never less than what it holds with.

use icd::PerEffector;

use super::gains::ReliefGains;
use super::{ReliefInput, fraction};
use crate::Visitor;
use crate::navigation::NavigationState;

/// Nozzle angle at which the boost counts what thrust gives, rad.
const BOOST_ANGLE_RAD: f64 = 0.2;

/// Lag on the thrust floor, s: half of that of the engine.
const FLOOR_LAG_S: f64 = 0.5;

/// Boost and floor.
#[derive(Debug, Clone, Default)]
pub struct Thrust {
    /// |s̄| after the lag of the boost, rad/s².
    shortage_before: f64,
    /// The floor after its lag, N.
    floor_n: f64,
}

impl Thrust {
    /// One period of `h` s: thrust to add and smallest thrust, N. `positions` are the commands of this step, rad, `missing` is the
    /// pitch acceleration that they do not give, rad/s², `yaw` is s̄, rad/s², and σ.
    pub fn step(
        &mut self,
        positions: &PerEffector<f64>,
        missing: f64,
        yaw: [f64; 2],
        input: &ReliefInput<'_>,
        gains: &ReliefGains,
        h: f64,
    ) -> (f64, f64) {
        let [shortage, relief] = yaw;
        let boost_n = self.boost(shortage.abs(), input, gains, h);
        (boost_n, self.floor(positions, missing, relief, input, gains, h))
    }

    /// Shows the continuous states.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        visit(&mut self.shortage_before);
        visit(&mut self.floor_n);
    }

    /// Thrust that gives the growth of the yaw shortage over the last seconds, N; none far above the airspeed reference.
    fn boost(
        &mut self,
        shortage: f64,
        input: &ReliefInput<'_>,
        gains: &ReliefGains,
        h: f64,
    ) -> f64 {
        let ReliefInput { state, at, fade, model, .. } = *input;
        self.shortage_before += (shortage - self.shortage_before) * fraction(h, gains.boost_s);
        let growth = (shortage - self.shortage_before).max(0.0);
        let [_, Some(nozzle)] = model.nozzle_effectors() else { return 0.0 };
        let effect = model.effect(at, nozzle).z;
        if effect <= 0.0 {
            return 0.0;
        }
        let over_m_s = state.airspeed_m_s - input.airspeed_reference_m_s - gains.boost_over_m_s;
        let room = (1.0 - over_m_s / gains.boost_over_m_s).clamp(0.0, 1.0);
        fade * room * gains.boost * state.thrust_n * growth / (BOOST_ANGLE_RAD * effect)
    }

    /// Smallest thrust, N: with which the nozzle holds its present pitching moment inside its travel, and, while yaw is
    /// missing, as much as the floor may be. That is a part of the drag, so that the aircraft can still slow down.
    fn floor(
        &mut self,
        positions: &PerEffector<f64>,
        missing: f64,
        relief: f64,
        input: &ReliefInput<'_>,
        gains: &ReliefGains,
        h: f64,
    ) -> f64 {
        let ReliefInput { state, at, fade, model, .. } = *input;
        let [Some(nozzle), _] = model.nozzle_effectors() else { return 0.0 };
        let effect = model.effect(at, nozzle).y;
        if effect <= 0.0 {
            return self.floor_n;
        }
        let angle = positions[nozzle] + missing / effect;
        let servo = &model.aircraft().effectors.servos[nozzle];
        let travel = if angle < 0.0 { -servo.min } else { servo.max };
        let pitch_n = state.thrust_n * angle.abs() / (gains.floor_use * travel);
        let yaw_n = relief * model.thrust_range_n()[1];
        // The model has no drag; thrust and the measured force along the path leave it.
        let drag_n = state.thrust_n - model.aircraft().mass.mass_kg * along_path(state);
        let wanted_n = pitch_n.max(yaw_n).min(gains.floor_drag * drag_n).max(0.0);
        self.floor_n += (fade * wanted_n - self.floor_n) * fraction(h, FLOOR_LAG_S);
        self.floor_n
    }
}

/// Specific force along the path through the air, m/s²: thrust minus drag, over the mass.
fn along_path(state: &NavigationState) -> f64 {
    let (sin_alpha, cos_alpha) = libm::sincos(state.alpha);
    let (sin_beta, cos_beta) = libm::sincos(state.beta);
    let force = state.specific_force.0;
    force.x * cos_alpha * cos_beta + force.y * sin_beta + force.z * sin_alpha * cos_beta
}
