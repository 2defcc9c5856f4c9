//! Which ground station has control: the one whose command was last accepted, or else the first that was
//! heard. When it falls silent and another one is heard, that one takes over.
//!
//! A station is a system: its components, a map and a joystick, share control. A program that commands
//! without heartbeats has control too, but its silence means nothing, since it was never heard.

use core::time::Duration;

use arrayvec::ArrayVec;

use super::codec::Identity;
use crate::clock::WallTime;

/// Ground stations whose heartbeats are followed; the one that was silent for the longest makes room.
const STATIONS_MAX: usize = 16;

#[derive(Debug, Clone, Copy)]
struct Station {
    system: u8,
    heard: WallTime,
}

/// What a look at the silence of ground stations came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Silence {
    /// None was ever heard: nobody can be lost.
    NobodyYet,
    /// A station is heard.
    Heard,
    /// The first of these systems fell silent and the second has taken over.
    TakenOver(u8, u8),
    /// All stations are silent.
    All,
}

/// Who has control, and who was heard when.
#[derive(Debug, Default)]
pub struct Control {
    stations: ArrayVec<Station, STATIONS_MAX>,
    holder: Option<u8>,
}

impl Control {
    /// The system that has control.
    #[must_use]
    pub fn holder(&self) -> Option<u8> {
        self.holder
    }

    /// A command or a reference of `sender` was accepted.
    pub fn take(&mut self, sender: Identity) {
        self.holder = Some(sender.system);
    }

    /// A heartbeat of a ground station.
    pub fn hear(&mut self, sender: Identity, now: WallTime) {
        let system = sender.system;
        if self.holder.is_none() {
            self.holder = Some(system);
        }
        if let Some(station) = self.stations.iter_mut().find(|station| station.system == system) {
            station.heard = now;
            return;
        }
        if self.stations.is_full() {
            let oldest = self.stations.iter().enumerate().min_by_key(|(_, station)| station.heard);
            if let Some((place, _)) = oldest {
                self.stations.swap_remove(place);
            }
        }
        self.stations.push(Station { system, heard: now });
    }

    /// Looks who is silent for `patience`, and gives control on.
    pub fn look(&mut self, now: WallTime, patience: Duration) -> Silence {
        let Some(latest) = self.latest() else { return Silence::NobodyYet };
        if now.since(latest.heard) >= patience {
            return Silence::All;
        }
        let silent = self
            .holder
            .and_then(|holder| self.stations.iter().find(|station| station.system == holder))
            .filter(|station| now.since(station.heard) >= patience);
        match silent {
            Some(station) => {
                let left = station.system;
                self.holder = Some(latest.system);
                Silence::TakenOver(left, latest.system)
            }
            None => Silence::Heard,
        }
    }

    /// When the holder, or the last of all stations, will have been silent for `patience`.
    #[must_use]
    pub fn next_silence(&self, patience: Duration) -> Option<WallTime> {
        let holder =
            self.stations.iter().find(|station| Some(station.system) == self.holder).copied();
        holder.or(self.latest()).map(|station| station.heard + patience)
    }

    fn latest(&self) -> Option<Station> {
        self.stations.iter().max_by_key(|station| station.heard).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_secs(10);

    fn seconds(s: u64) -> WallTime {
        WallTime::from_micros(s * 1_000_000)
    }

    fn station(system: u8) -> Identity {
        Identity { system, component: 190 }
    }

    #[test]
    fn nobody_is_lost_before_anybody_was_heard() {
        let mut control = Control::default();
        assert_eq!(control.look(seconds(1_000), PATIENCE), Silence::NobodyYet);
        control.take(station(9));
        assert_eq!(control.look(seconds(2_000), PATIENCE), Silence::NobodyYet, "no heartbeats");
        assert_eq!(control.next_silence(PATIENCE), None);
    }

    #[test]
    fn the_first_station_has_control_until_another_commands() {
        let mut control = Control::default();
        control.hear(station(255), seconds(0));
        control.hear(station(245), seconds(0));
        assert_eq!(control.holder(), Some(255));
        control.take(station(245));
        assert_eq!(control.holder(), Some(245));
    }

    #[test]
    fn control_passes_on_when_its_holder_falls_silent_and_somebody_else_is_heard() {
        let mut control = Control::default();
        control.hear(station(255), seconds(0));
        control.hear(station(245), seconds(5));
        assert_eq!(control.look(seconds(9), PATIENCE), Silence::Heard);
        assert_eq!(control.next_silence(PATIENCE), Some(seconds(10)));
        assert_eq!(control.look(seconds(10), PATIENCE), Silence::TakenOver(255, 245));
        assert_eq!(control.look(seconds(11), PATIENCE), Silence::Heard, "told once");
        assert_eq!(control.look(seconds(15), PATIENCE), Silence::All);
    }

    #[test]
    fn the_table_of_stations_is_bounded_and_keeps_who_was_heard_last() {
        let mut control = Control::default();
        for system in 1..=200 {
            control.hear(station(system), seconds(u64::from(system)));
        }
        assert_eq!(control.stations.len(), STATIONS_MAX);
        assert_eq!(control.latest().map(|station| station.system), Some(200));
    }
}
