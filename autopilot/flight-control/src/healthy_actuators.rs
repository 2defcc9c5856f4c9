//! Where the effectors would be if they were healthy: the observer's input.
//!
//! With commands instead of modelled positions every manoeuvre would look like a fault, because the
//! servos lag; with measured positions a fault would vanish from the estimate.

use arrayvec::ArrayVec;
use icd::{ControlPeriod, Effector, EffectorKind, PerEffector};

use crate::Visitor;
use crate::aircraft_model::AircraftModel;

/// Lag and rate limit of one servo over one control period.
#[derive(Debug, Clone, Copy)]
struct ModelledServo {
    effector: Effector,
    /// 1 - exp(-h/τ): fraction of the way covered in one period.
    fraction: f64,
    /// Largest way in one period, rad.
    way_max: f64,
    /// Ends of the travel, rad.
    ends: [f64; 2],
}

/// Model of the healthy servos; the engine is measured, and where it is not, its last command stands in.
#[derive(Debug, Clone)]
pub struct HealthyActuators {
    servos: ArrayVec<ModelledServo, { Effector::MAX }>,
    engine: Option<Effector>,
    positions: PerEffector<f64>,
    start: PerEffector<f64>,
}

impl HealthyActuators {
    /// At the trim of the design point.
    pub fn new(aircraft: &AircraftModel, period: ControlPeriod) -> Self {
        let h = period.as_seconds();
        let list = &aircraft.effectors.list;
        let moving = list.all().filter(|effector| list.is_angle(*effector)).map(|effector| {
            let servo = &aircraft.effectors.servos[effector];
            ModelledServo {
                effector,
                // Exact for a first-order lag, whatever the period.
                fraction: 1.0 - libm::exp(-h / servo.lag_s),
                way_max: servo.rate_limit * h,
                ends: [servo.min, servo.max],
            }
        });
        let servos = moving.collect();
        let engine = list.only(EffectorKind::Engine);
        let start = aircraft.trim_positions();
        Self { servos, engine, positions: start, start }
    }

    /// At the positions of the flight's start instead, rad: an aircraft that is trimmed for another flight
    /// condition than the design point would look faulty until the modelled servos have caught up. A position
    /// that is not finite is left as it is, one beyond the travel counts as the end of the travel.
    pub fn start_at(&mut self, positions: &PerEffector<f64>) {
        for &ModelledServo { effector, ends: [min, max], .. } in &self.servos {
            let position = positions[effector];
            if position.is_finite() {
                self.start[effector] = position.max(min).min(max);
            }
        }
        self.positions = self.start;
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        self.positions = self.start;
    }

    /// Positions now, rad; the engine's entry is the thrust of [`Self::take_thrust`], N.
    pub fn positions(&self) -> &PerEffector<f64> {
        &self.positions
    }

    /// Shows the positions that the model integrates.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        for servo in &self.servos {
            visit(&mut self.positions[servo.effector]);
        }
    }

    /// Takes over the measured thrust, N; without one the last command stands in. The thrust that counts, where there is an engine.
    pub fn take_thrust(&mut self, measured_n: Option<f64>) -> Option<f64> {
        let thrust_n = &mut self.positions[self.engine?];
        *thrust_n = measured_n.unwrap_or(*thrust_n);
        Some(*thrust_n)
    }

    /// Moves the servos for one period towards `commands`, which are inside the travel.
    pub fn advance(&mut self, commands: &PerEffector<f64>) {
        for &ModelledServo { effector, fraction, way_max, .. } in &self.servos {
            let way = (commands[effector] - self.positions[effector]) * fraction;
            // Comparisons instead of max and min: one instruction each. Unlike clamp they never panic.
            let above = if way < -way_max { -way_max } else { way };
            self.positions[effector] += if above > way_max { way_max } else { above };
        }
        if let Some(engine) = self.engine {
            // Until the next measurement replaces it.
            self.positions[engine] = commands[engine];
        }
    }

    /// Stands where another model of the same servos stands.
    pub fn copy_positions(&mut self, other: &Self) {
        self.positions = other.positions;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::tvc_jet;

    #[test]
    fn a_small_step_is_63_percent_done_after_one_time_constant() {
        let mut model = HealthyActuators::new(&testing::aircraft_model(), ControlPeriod::DEFAULT);
        let start = model.positions()[tvc_jet::RUDDER];
        let mut commands = PerEffector::default();
        commands[tvc_jet::RUDDER] = start + 0.01;
        for _ in 0..25 {
            model.advance(&commands);
        }
        let done = (model.positions()[tvc_jet::RUDDER] - start) / 0.01;
        assert!((done - (1.0 - libm::exp(-1.0))).abs() < 1.0e-12, "{done}");
    }

    #[test]
    fn a_large_step_moves_at_the_rate_limit() {
        let aircraft = testing::aircraft_model();
        let mut model = HealthyActuators::new(&aircraft, ControlPeriod::DEFAULT);
        let mut commands = PerEffector::default();
        commands[tvc_jet::RUDDER] = 0.5;
        model.advance(&commands);
        let expected = aircraft.effectors.servos[tvc_jet::RUDDER].rate_limit * 0.002;
        assert!((model.positions()[tvc_jet::RUDDER] - expected).abs() < 1.0e-15);
    }

    #[test]
    fn a_start_off_the_design_point_is_kept_inside_the_travel_and_survives_a_reset() {
        let aircraft = testing::aircraft_model();
        let mut model = HealthyActuators::new(&aircraft, ControlPeriod::DEFAULT);
        let mut start = PerEffector::from_fn(|_| 0.02);
        start[tvc_jet::LEFT_ELEVATOR] = -9.0;
        start[tvc_jet::RUDDER] = f64::NAN;
        start[tvc_jet::ENGINE] = 1.0;
        model.start_at(&start);
        let expected = *model.positions();
        assert_eq!(expected[tvc_jet::RIGHT_ELEVATOR], 0.02);
        assert_eq!(
            expected[tvc_jet::LEFT_ELEVATOR],
            aircraft.effectors.servos[tvc_jet::LEFT_ELEVATOR].min
        );
        assert_eq!(expected[tvc_jet::RUDDER], 0.0, "not a number: as before");
        assert_eq!(expected[tvc_jet::ENGINE], aircraft.trim.thrust_n, "the engine is measured");
        model.advance(&PerEffector::default());
        model.reset();
        assert_eq!(*model.positions(), expected);
    }
}
