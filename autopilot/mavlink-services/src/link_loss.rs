//! Silence of the controlling ground station: what it leads to is a parameter (`NAV_DLL_ACT`), after how long another
//! (`COM_DL_LOSS_T`, wall time: a paused simulation loses nobody).
//!
//! The link is lost when the station that has commanded is silent, even while others send heartbeats (see
//! [`super::control`]). It is back when that station sends again, or when an accepted command gives control to another
//! station that sends. Both the loss and its end are intents, so that they act on the flight at a tick of their own.

use core::time::Duration;

use ::mavlink::dialects::common::{MavSeverity, MavType};

use crate::aircraft::Phase;
use crate::codec::Message;
use crate::control::Silence;
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::command::VehicleCommand;
use flight_management::event::EventKind;
use flight_management::parameters::Parameters;

/// Reports the loss and the return of the link.
#[derive(Debug, Default)]
pub struct LinkLoss {
    /// The vehicle has received the loss of the link.
    loss_reported: bool,
}

impl Service for LinkLoss {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        if *message == Message::Heartbeat(MavType::MAV_TYPE_GCS as u8) {
            shared.control.receive_heartbeat(from.sender, now);
            self.poll(now, shared);
        }
    }

    /// An event may have given control to another station. The vehicle of a new flight knows nothing of a lost link.
    fn handle_event(&mut self, event: &EventKind, now: WallTime, shared: &mut Shared) {
        if let EventKind::FlightBegan { .. } = event {
            self.loss_reported = false;
        }
        self.poll(now, shared);
    }

    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        if shared.aircraft.phase() != Phase::Flying {
            return;
        }
        match shared.control.check_silence(now, loss_timeout(&shared.parameters)) {
            Silence::NoStation => {}
            Silence::Lost if !self.loss_reported => {
                let command = VehicleCommand::LinkLost(shared.parameters.link.loss_action);
                // Without room now there is room at the next poll.
                self.loss_reported = shared.intents.push(command).is_some();
            }
            Silence::Lost => {}
            Silence::Connected => self.report_link_back(shared),
            Silence::TakenOver(left, holder) => {
                let text = format!("Ground station {left} is silent: {holder} takes over");
                shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text);
                self.report_link_back(shared);
            }
        }
    }

    /// Once the loss is reported, the next heartbeat or event decides.
    fn next_deadline(&self, shared: &Shared) -> Option<WallTime> {
        let is_watching = !self.loss_reported && shared.aircraft.phase() == Phase::Flying;
        let timeout = loss_timeout(&shared.parameters);
        is_watching.then(|| shared.control.next_silence(timeout)).flatten()
    }
}

impl LinkLoss {
    fn report_link_back(&mut self, shared: &mut Shared) {
        if self.loss_reported && shared.intents.push(VehicleCommand::LinkBack).is_some() {
            self.loss_reported = false;
        }
    }
}

fn loss_timeout(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.loss_s).unwrap_or(Duration::MAX)
}
