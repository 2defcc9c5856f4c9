//! Baseline for an honest comparison: the same PID with the nozzle ganged to it, and no observer.
//!
//! The paper gives the nozzle to the compensator alone, so part of the compensator's benefit is the
//! nozzle's. This static law shows how much: δz = -(δe - δe_trim), δy = 4 β - 0.4 r.

use super::pid::{Pid, PidGains};
use super::{Law, LawInput, MainCommand, Visitor};

/// δy per sideslip.
const NOZZLE_YAW_PER_SIDESLIP: f64 = 4.0;
/// δy per yaw rate, s.
const NOZZLE_YAW_PER_YAW_RATE_S: f64 = -0.4;

/// The PID with the nozzle ganged to it.
#[derive(Debug, Clone)]
pub struct PidGangedNozzle(Pid);

impl PidGangedNozzle {
    /// With empty integrators.
    pub fn new(gains: &PidGains) -> Self {
        Self(Pid::new(gains))
    }

    /// Takes new gains; the integrators stay.
    pub fn set_gains(&mut self, gains: &PidGains) {
        self.0.set_gains(gains);
    }
}

impl Law for PidGangedNozzle {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let (state, aircraft) = (input.state, input.model.aircraft());
        let mut command = self.0.step(input);
        // The elevator counts as far as it can go.
        let [min, max] = aircraft.effectors.command_range(|gains| gains.pitch);
        let elevator = command.elevator_rad.max(min).min(max);
        command.nozzle_pitch_rad = -(elevator - aircraft.trim.elevator_rad);
        command.nozzle_yaw_rad =
            NOZZLE_YAW_PER_SIDESLIP * state.beta + NOZZLE_YAW_PER_YAW_RATE_S * state.rates.z;
        command
    }

    fn start_from(&mut self, input: &LawInput<'_>, command: &MainCommand) {
        self.0.start_from(input, command);
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        self.0.states(visit);
    }
}
