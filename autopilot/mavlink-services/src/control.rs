//! Which ground station has control: the one whose command was last accepted, or else the first that sent a
//! message; and the loss of its link.
//!
//! A holder whose command was accepted keeps control when it falls silent, even while others send: its silence is
//! the lost link. A holder that was merely the first to send passes control on to another station that sends.
//!
//! A station is a system: its components, such as a map and a joystick, share control. A program that commands
//! without heartbeats can have control too, but its silence means nothing, since it never sent one. The link
//! is then lost when all stations that have sent heartbeats are silent.
//!
//! A parameter sets the reaction to a loss (`NAV_DLL_ACT`), another the delay (`COM_DL_LOSS_T`, wall time: a paused
//! simulation loses no link). The loss ends when the holder sends again, or when an accepted command gives control to another
//! station that sends. Both the loss and its end are intents, so that they act on the flight at a definite tick.

use core::time::Duration;

use ::mavlink::dialects::common::{MavSeverity, MavType};
use arrayvec::ArrayVec;

use crate::aircraft::Phase;
use crate::codec::{Identity, Message};
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::command::VehicleCommand;
use flight_management::event::EventKind;
use flight_management::parameters::Parameters;

/// Ground stations whose heartbeats are followed; the one silent for the longest makes room, except
/// the holder.
const STATIONS_MAX: usize = 16;

#[derive(Debug, Clone, Copy)]
struct Station {
    system: u8,
    last_seen: WallTime,
}

/// Result of checking for silent ground stations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Silence {
    /// No station has ever sent a heartbeat: no link can be lost.
    NoStation,
    /// The station that counts is sending heartbeats.
    Connected,
    /// The first of these systems fell silent and the second has taken over.
    TakenOver(u8, u8),
    /// The station that steered is silent, or all stations are where none steered.
    Lost,
}

#[derive(Debug, Clone, Copy)]
struct Holder {
    system: u8,
    /// It got control by an accepted command, not only by the first heartbeat.
    has_steered: bool,
}

/// Which system has control, and when each station sent its last heartbeat.
#[derive(Debug, Default)]
pub struct Control {
    stations: ArrayVec<Station, STATIONS_MAX>,
    holder: Option<Holder>,
}

impl Control {
    /// The system that has control.
    pub fn holder(&self) -> Option<u8> {
        self.holder.map(|holder| holder.system)
    }

    /// A command or a reference of `sender` was accepted.
    pub fn take(&mut self, sender: Identity) {
        self.holder = Some(Holder { system: sender.system, has_steered: true });
    }

    /// Records a heartbeat of a ground station.
    pub fn receive_heartbeat(&mut self, sender: Identity, now: WallTime) {
        let system = sender.system;
        if self.holder.is_none() {
            self.holder = Some(Holder { system, has_steered: false });
        }
        if let Some(station) = self.stations.iter_mut().find(|station| station.system == system) {
            station.last_seen = now;
            return;
        }
        if self.stations.is_full() {
            let holder = self.holder();
            let others = self.stations.iter().enumerate();
            let others = others.filter(|(_, station)| Some(station.system) != holder);
            if let Some((place, _)) = others.min_by_key(|(_, station)| station.last_seen) {
                self.stations.swap_remove(place);
            }
        }
        self.stations.push(Station { system, last_seen: now });
    }

    /// Checks which stations have been silent for `timeout`, and passes control on where none has commanded.
    pub fn check_silence(&mut self, now: WallTime, timeout: Duration) -> Silence {
        let Some(latest) = self.latest() else { return Silence::NoStation };
        let is_silent = |station: Station| now.since(station.last_seen) >= timeout;
        let has_steered = self.holder.is_some_and(|holder| holder.has_steered);
        match self.holding().filter(|station| is_silent(*station)) {
            Some(_) if has_steered || is_silent(latest) => Silence::Lost,
            Some(silent) => {
                self.holder = Some(Holder { system: latest.system, has_steered: false });
                Silence::TakenOver(silent.system, latest.system)
            }
            None if is_silent(latest) => Silence::Lost,
            None => Silence::Connected,
        }
    }

    /// When the holder, or the last of all stations if it never sent a heartbeat, will have been silent for
    /// `timeout`.
    pub fn next_silence(&self, timeout: Duration) -> Option<WallTime> {
        self.holding().or(self.latest()).map(|station| station.last_seen + timeout)
    }

    /// The holder, if it has ever sent a heartbeat.
    fn holding(&self) -> Option<Station> {
        self.stations.iter().find(|station| Some(station.system) == self.holder()).copied()
    }

    fn latest(&self) -> Option<Station> {
        self.stations.iter().max_by_key(|station| station.last_seen).copied()
    }
}

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

    /// An event may have given control to another station. The vehicle of a new flight has no record of a lost link.
    fn handle_event(&mut self, event: &EventKind, now: WallTime, shared: &mut Shared) {
        if let EventKind::FlightBegan { .. } = event {
            self.loss_reported = false;
        }
        self.poll(now, shared);
    }

    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        // Without a flight nothing can react, but the heartbeats are followed all the same.
        if shared.aircraft.phase() != Phase::Flying {
            return;
        }
        match shared.control.check_silence(now, loss_timeout(&shared.parameters)) {
            Silence::NoStation => {}
            Silence::Lost if !self.loss_reported => {
                let command = VehicleCommand::LinkLost(shared.parameters.link.loss_action);
                // If the queue is full now, the next poll tries again.
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

#[cfg(test)]
mod tests {
    use super::*;

    const TIMEOUT: Duration = Duration::from_secs(10);

    fn seconds(s: u64) -> WallTime {
        WallTime::from_micros(s * 1_000_000)
    }

    fn station(system: u8) -> Identity {
        Identity { system, component: 190 }
    }

    #[test]
    fn no_station_is_lost_before_the_first_message() {
        let mut control = Control::default();
        assert_eq!(control.check_silence(seconds(1_000), TIMEOUT), Silence::NoStation);
        control.take(station(9));
        assert_eq!(
            control.check_silence(seconds(2_000), TIMEOUT),
            Silence::NoStation,
            "no heartbeats"
        );
        assert_eq!(control.next_silence(TIMEOUT), None);
    }

    #[test]
    fn the_first_station_has_control_until_another_commands() {
        let mut control = Control::default();
        control.receive_heartbeat(station(255), seconds(0));
        control.receive_heartbeat(station(245), seconds(0));
        assert_eq!(control.holder(), Some(255));
        control.take(station(245));
        assert_eq!(control.holder(), Some(245));
    }

    #[test]
    fn control_passes_to_an_active_station_when_a_holder_that_never_steered_is_silent() {
        let mut control = Control::default();
        control.receive_heartbeat(station(255), seconds(0));
        control.receive_heartbeat(station(245), seconds(5));
        assert_eq!(control.check_silence(seconds(9), TIMEOUT), Silence::Connected);
        assert_eq!(control.next_silence(TIMEOUT), Some(seconds(10)));
        assert_eq!(control.check_silence(seconds(10), TIMEOUT), Silence::TakenOver(255, 245));
        assert_eq!(
            control.check_silence(seconds(11), TIMEOUT),
            Silence::Connected,
            "reported once"
        );
        assert_eq!(control.check_silence(seconds(15), TIMEOUT), Silence::Lost);
    }

    #[test]
    fn a_holder_that_has_steered_is_lost_although_others_are_active() {
        let mut control = Control::default();
        control.receive_heartbeat(station(255), seconds(0));
        control.take(station(255));
        control.receive_heartbeat(station(245), seconds(9));
        assert_eq!(control.check_silence(seconds(9), TIMEOUT), Silence::Connected);
        assert_eq!(control.next_silence(TIMEOUT), Some(seconds(10)));
        for second in 10..200 {
            // More stations than the table has room for.
            control.receive_heartbeat(
                Identity { system: second, component: 1 },
                seconds(u64::from(second)),
            );
            assert_eq!(control.check_silence(seconds(u64::from(second)), TIMEOUT), Silence::Lost);
        }
        assert_eq!(control.holder(), Some(255));
        control.take(station(199));
        assert_eq!(
            control.check_silence(seconds(200), TIMEOUT),
            Silence::Connected,
            "the new holder"
        );
    }

    #[test]
    fn while_a_program_without_heartbeats_has_control_the_last_station_stands_in() {
        let mut control = Control::default();
        control.receive_heartbeat(station(255), seconds(0));
        control.take(station(9));
        assert_eq!(control.check_silence(seconds(9), TIMEOUT), Silence::Connected);
        control.receive_heartbeat(station(245), seconds(9));
        assert_eq!(control.check_silence(seconds(18), TIMEOUT), Silence::Connected);
        assert_eq!(control.check_silence(seconds(19), TIMEOUT), Silence::Lost);
        assert_eq!(control.holder(), Some(9));
    }

    #[test]
    fn the_table_of_stations_is_bounded_and_keeps_the_latest() {
        let mut control = Control::default();
        for system in 1..=200 {
            control.receive_heartbeat(station(system), seconds(u64::from(system)));
        }
        assert_eq!(control.stations.len(), STATIONS_MAX);
        assert_eq!(control.latest().map(|station| station.system), Some(200));
    }
}
