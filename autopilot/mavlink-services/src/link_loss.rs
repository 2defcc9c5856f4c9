//! Silence of the controlling ground station: what it leads to is a parameter (`NAV_DLL_ACT`), after how long another
//! (`COM_DL_LOSS_T`, wall time: a paused simulation loses nobody).
//!
//! The link is lost when the station that has steered is silent, also when others are heard (see
//! [`super::control`]). It is back when that station is heard again, or when an accepted order gives control
//! to another one that is heard. Both the loss and its end are intents, so that they act on the flight at a
//! tick of its own.

use core::time::Duration;
use flight_management::command::VehicleCommand;

use ::mavlink::dialects::common::{MavSeverity, MavType};

use super::aircraft::{Aircraft, Phase};
use super::context::{Context, From};
use super::control::{Control, Silence};
use crate::wall_time::WallTime;
use flight_management::command::Command;
use flight_management::parameters::Parameters;

/// Listens to the heartbeats of ground stations.
#[derive(Debug, Default)]
pub struct LinkLoss {
    /// The vehicle has received the loss of the link.
    loss_reported: bool,
}

impl LinkLoss {
    /// Takes a heartbeat: who sent it and its MAV_TYPE.
    pub fn hear(&mut self, from: From, mav_type: u8, now: WallTime, ctx: &mut Context) {
        if mav_type == MavType::MAV_TYPE_GCS as u8 {
            ctx.control.hear(from.sender, now);
            self.poll(now, ctx);
        }
    }

    /// A flight began: its vehicle knows nothing of a lost link.
    pub fn begin_flight(&mut self) {
        self.loss_reported = false;
    }

    /// Does what is due.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context) {
        if ctx.aircraft.phase() != Phase::Flying {
            return;
        }
        match ctx.control.look(now, loss_timeout(ctx.parameters)) {
            Silence::NobodyYet => {}
            Silence::Lost if !self.loss_reported => {
                let command =
                    Command::Vehicle(VehicleCommand::LinkLost(ctx.parameters.link.loss_action));
                // Without room now there is room at the next poll.
                self.loss_reported = ctx.intents.push(command).is_some();
            }
            Silence::Lost => {}
            Silence::Heard => self.report_link_back(ctx),
            Silence::TakenOver(left, holder) => {
                let text = format!("Ground station {left} is silent: {holder} takes over");
                ctx.texts.say(MavSeverity::MAV_SEVERITY_WARNING, text);
                self.report_link_back(ctx);
            }
        }
    }

    fn report_link_back(&mut self, ctx: &mut Context) {
        if self.loss_reported && ctx.intents.push(VehicleCommand::LinkBack).is_some() {
            self.loss_reported = false;
        }
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(
        &self,
        control: &Control,
        parameters: &Parameters,
        aircraft: &Aircraft,
    ) -> Option<WallTime> {
        if self.loss_reported || aircraft.phase() != Phase::Flying {
            // The next heartbeat or event decides.
            return None;
        }
        control.next_silence(loss_timeout(parameters))
    }
}

fn loss_timeout(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.loss_s).unwrap_or(Duration::MAX)
}
