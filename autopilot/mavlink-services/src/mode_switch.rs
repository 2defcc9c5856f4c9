//! The switch of a pilot's transmitter that selects flight modes: RC_MAP_FLTMODE names its channel of
//! RC_CHANNELS_OVERRIDE, COM_FLTMODE1 to COM_FLTMODE6 the modes of its six slots, each a sixth of 1000 us to 2000 us.
//!
//! A change of the slot requests the mode as a SET_MODE of the same station does, so it is refused with the same texts
//! and gives control. The first position that comes requests nothing: connecting changes no mode.

use crate::codec::{Message, SetMode};
use crate::modes;
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::parameters::{MODE_SLOTS, SwitchChannel, SwitchMode};

/// Systems whose switches are followed; the one that was silent for the longest makes room.
const SYSTEMS_MAX: usize = 4;
/// Lower end of the lowest slot, us.
const LOWEST_US: u16 = 1000;
/// Width of all slots, us.
const TRAVEL_US: u16 = 1000;
/// Channels with these values carry no position.
const NOT_GIVEN: [u16; 2] = [0, u16::MAX];

/// The latest position of the switch of a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Position {
    system: u8,
    channel: usize,
    slot: usize,
}

/// Follows the switches.
#[derive(Debug, Default)]
pub struct ModeSwitch(Vec<Position>);

impl Service for ModeSwitch {
    /// Derives the SET_MODE of a slot that has changed.
    fn handle(&mut self, from: From, message: &Message, _: WallTime, shared: &mut Shared) {
        let Message::RcOverride(channels) = message else { return };
        let parameters = &shared.parameters.mode_switch;
        let Some(channel) = index(parameters.channel) else { return };
        let pulse_us = channels[channel];
        if NOT_GIVEN.contains(&pulse_us) {
            return;
        }
        let system = from.sender.system;
        let now = Position { system, channel, slot: slot(pulse_us) };
        let before = self.0.iter().position(|position| position.system == system);
        let before = before.map(|place| self.0.remove(place));
        if self.0.len() >= SYSTEMS_MAX {
            self.0.remove(0);
        }
        self.0.push(now);
        let is_same_channel = |before: &Position| before.channel == channel;
        if before.filter(is_same_channel).is_some_and(|before| before.slot != now.slot) {
            let mode = main_and_sub(parameters.slots[now.slot]);
            shared.derived =
                mode.map(|(main, sub)| Message::SetMode(SetMode { is_custom: true, main, sub }));
        }
    }
}

/// Place among the channels, from 0.
fn index(channel: SwitchChannel) -> Option<usize> {
    match channel {
        SwitchChannel::None => None,
        SwitchChannel::Five => Some(4),
        SwitchChannel::Six => Some(5),
        SwitchChannel::Seven => Some(6),
        SwitchChannel::Eight => Some(7),
    }
}

fn slot(pulse_us: u16) -> usize {
    let travelled = usize::from(pulse_us.saturating_sub(LOWEST_US));
    (travelled * MODE_SLOTS / usize::from(TRAVEL_US)).min(MODE_SLOTS - 1)
}

/// PX4's main and sub mode; the handler of SET_MODE decides whether it can be flown here.
fn main_and_sub(mode: SwitchMode) -> Option<(u8, u8)> {
    Some(match mode {
        SwitchMode::Unassigned => return None,
        SwitchMode::Manual => (modes::MAIN_MANUAL, 0),
        SwitchMode::Altitude => (modes::MAIN_ALTCTL, 0),
        SwitchMode::Position => (modes::MAIN_POSCTL, 0),
        SwitchMode::Mission => (modes::MAIN_AUTO, modes::SUB_MISSION),
        SwitchMode::Hold => (modes::MAIN_AUTO, modes::SUB_LOITER),
        SwitchMode::Return => (modes::MAIN_AUTO, modes::SUB_RTL),
        SwitchMode::Acro => (modes::MAIN_ACRO, 0),
        SwitchMode::Offboard => (modes::MAIN_OFFBOARD, 0),
        SwitchMode::Stabilized => (modes::MAIN_STABILIZED, 0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sixth_of_the_travel_is_a_slot() {
        for (pulse_us, expected) in [
            (1, 0),
            (1000, 0),
            (1166, 0),
            (1167, 1),
            (1334, 2),
            (1500, 3),
            (1667, 4),
            (1834, 5),
            (2000, 5),
            (65_534, 5),
        ] {
            assert_eq!(slot(pulse_us), expected, "{pulse_us} us");
        }
    }
}
