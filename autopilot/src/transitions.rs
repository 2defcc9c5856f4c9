//! From signals of every step to events worth telling: compensator and saturation.

use flight_control::gains::ActivationGains;
use flight_control::{Health, StepLog};
use icd::ControlPeriod;

use crate::event::{Axis, EventKind, Limit};

/// A demand must be beyond its limit this long before it is told, us.
const SATURATED_AFTER_US: u64 = 200_000;
/// And inside for this long before that is told, us; longer, so that a demand that brushes its limit
/// does not fill the operator's screen.
const INSIDE_AFTER_US: u64 = 2_000_000;

/// Remembers what was told.
#[derive(Debug, Clone, Default)]
pub struct Transitions {
    compensator_active: bool,
    limits: [LimitState; Limit::ALL.len()],
}

#[derive(Debug, Clone, Copy, Default)]
struct LimitState {
    told: bool,
    since_us: u64,
}

impl Transitions {
    /// Looks at one step and passes what changed to `tell`.
    pub fn step(
        &mut self,
        log: &StepLog,
        levels: &ActivationGains,
        period: ControlPeriod,
        mut tell: impl FnMut(EventKind),
    ) {
        if log.compensator_active != self.compensator_active {
            self.compensator_active = log.compensator_active;
            tell(if log.compensator_active {
                EventKind::CompensatorActive { axis: loudest_axis(log, levels) }
            } else {
                EventKind::CompensatorReleased
            });
        }
        for (limit, state) in Limit::ALL.into_iter().zip(&mut self.limits) {
            if is_saturated(&log.health, limit) == state.told {
                state.since_us = 0;
                continue;
            }
            state.since_us += u64::from(period.as_micros());
            let patience = if state.told { INSIDE_AFTER_US } else { SATURATED_AFTER_US };
            if state.since_us >= patience {
                state.told = !state.told;
                state.since_us = 0;
                tell(if state.told {
                    EventKind::Saturated(limit)
                } else {
                    EventKind::SaturationEnded(limit)
                });
            }
        }
    }
}

fn is_saturated(health: &Health, limit: Limit) -> bool {
    match limit {
        Limit::Aileron => health.aileron_saturated,
        Limit::Elevator => health.elevator_saturated,
        Limit::Rudder => health.rudder_saturated,
        Limit::NozzlePitch => health.nozzle_pitch_saturated,
        Limit::NozzleYaw => health.nozzle_yaw_saturated,
        Limit::Thrust => health.thrust_saturated,
    }
}

fn loudest_axis(log: &StepLog, levels: &ActivationGains) -> Axis {
    let roll = log.z2.x.abs() / levels.level_roll;
    let pitch = log.z2.y.abs() / levels.level_pitch;
    let yaw = log.z2.z.abs() / levels.level_yaw;
    if roll >= pitch && roll >= yaw {
        Axis::Roll
    } else if pitch >= yaw {
        Axis::Pitch
    } else {
        Axis::Yaw
    }
}
