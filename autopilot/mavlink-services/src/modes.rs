//! Flight modes in PX4's encoding, main mode in the third byte, sub mode in the fourth, and the messages that list
//! them for ground stations; the transmitter switch that selects modes.

use ::mavlink::dialects::common::{
    AVAILABLE_MODES_DATA, AVAILABLE_MODES_MONITOR_DATA, CURRENT_MODE_DATA, MavModeProperty,
    MavStandardMode,
};

use crate::aircraft::Aircraft;
use crate::codec::{CommandError, Encoded, Message, SetMode};
use crate::peers::From;
use crate::streams::{Latest, Streams};
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::parameters::{MODE_SLOTS, SwitchChannel, SwitchMode};
use flight_management::vehicle::Mode;

const MAIN_MANUAL: u8 = 1;
const MAIN_ALTCTL: u8 = 2;
const MAIN_POSCTL: u8 = 3;
const MAIN_AUTO: u8 = 4;
const MAIN_ACRO: u8 = 5;
const MAIN_OFFBOARD: u8 = 6;
const MAIN_STABILIZED: u8 = 7;
const SUB_TAKEOFF: u8 = 2;
const SUB_LOITER: u8 = 3;
const SUB_MISSION: u8 = 4;
const SUB_RTL: u8 = 5;

/// Main and sub mode.
const fn main_and_sub(mode: Mode) -> (u8, u8) {
    match mode {
        Mode::Position => (MAIN_POSCTL, 0),
        Mode::Hold => (MAIN_AUTO, SUB_LOITER),
        Mode::Mission => (MAIN_AUTO, SUB_MISSION),
        Mode::Return => (MAIN_AUTO, SUB_RTL),
        Mode::Offboard => (MAIN_OFFBOARD, 0),
        Mode::Altitude => (MAIN_ALTCTL, 0),
        Mode::Takeoff => (MAIN_AUTO, SUB_TAKEOFF),
    }
}

/// PX4's modes that this vehicle does not have: main mode, sub mode, name, and what to use instead. Numbers and names are
/// PX4's (`px4_custom_mode.h`).
const NOT_FLOWN: [(u8, u8, &str, &str); 13] = [
    (MAIN_MANUAL, 0, "Manual", USE_POSITION),
    (MAIN_POSCTL, 1, "Orbit", USE_HOLD),
    (MAIN_POSCTL, 2, "Position Slow", USE_POSITION),
    (MAIN_AUTO, 1, "Ready", USE_HOLD),
    (MAIN_AUTO, 6, "Land", USE_RETURN),
    (MAIN_AUTO, 7, "Return to Groundstation", USE_RETURN),
    (MAIN_AUTO, 8, "Follow Me", USE_HOLD),
    (MAIN_AUTO, 9, "Precision Land", USE_RETURN),
    (MAIN_AUTO, 10, "VTOL Takeoff", USE_HOLD),
    (MAIN_ACRO, 0, "Acro", USE_POSITION),
    (MAIN_STABILIZED, 0, "Stabilized", USE_POSITION),
    (8, 0, "Rattitude", USE_POSITION),
    (9, 0, "Simple", USE_POSITION),
];
const USE_POSITION: &str = "use Position";
const USE_HOLD: &str = "use Hold";
const USE_RETURN: &str = "use Return";

pub const fn custom_mode(mode: Mode) -> u32 {
    let (main, sub) = main_and_sub(mode);
    u32::from_le_bytes([0, 0, main, sub])
}

/// A sub mode counts where PX4 has sub modes; elsewhere stations leave arbitrary values in it.
const fn counted(main: u8, sub: u8) -> (u8, u8) {
    if matches!(main, MAIN_AUTO | MAIN_POSCTL) { (main, sub) } else { (main, 0) }
}

/// The mode with this main and sub mode.
pub fn mode_of(main: u8, sub: u8) -> Option<Mode> {
    Mode::ALL.into_iter().find(|mode| main_and_sub(*mode) == counted(main, sub))
}

/// Reason for refusing a mode that the vehicle does not have, and what to use instead.
fn not_flown(main: u8, sub: u8) -> CommandError {
    let is_it = |(a, b, _, _): &&(u8, u8, &str, &str)| (*a, *b) == counted(main, sub);
    let reason = match NOT_FLOWN.iter().find(is_it) {
        Some((_, _, name, instead)) => format!("{name} is not flown here: {instead}"),
        None => {
            let listed = Mode::ALL.map(|mode| {
                let (main, sub) = main_and_sub(mode);
                format!("{mode} {main}/{sub}")
            });
            format!("Mode {main}/{sub} refused: there are {}", listed.join(", "))
        }
    };
    CommandError::denied(reason)
}

/// The requested mode, if the ground-station side allows entering it now.
pub fn requested(
    has_custom_flag: bool,
    main: u8,
    sub: u8,
    streams: Streams,
) -> Result<Mode, CommandError> {
    if !has_custom_flag {
        return Err(CommandError::denied("Mode refused: only custom modes (base mode bit 0)"));
    }
    let mode = mode_of(main, sub).ok_or_else(|| not_flown(main, sub))?;
    enterable(mode, streams)
}

/// The requested standard mode (MAV_STANDARD_MODE).
///
/// # Errors
/// The protocol requires FAILED for a standard mode that the vehicle does not have.
pub fn requested_standard(standard_mode: u8, streams: Streams) -> Result<Mode, CommandError> {
    let has_it = |mode: &Mode| standard(*mode).is_some_and(|own| own as u8 == standard_mode);
    let Some(mode) = Mode::ALL.into_iter().find(has_it) else {
        return Err(CommandError::failed(format!(
            "Standard mode {standard_mode} refused: there are 3 Position, 4 Altitude, 5 Return, 6 Mission"
        )));
    };
    enterable(mode, streams)
}

/// Whether the ground-station side allows entering a mode now.
pub fn enterable(mode: Mode, streams: Streams) -> Result<Mode, CommandError> {
    match mode {
        Mode::Offboard if !streams.setpoints => Err(CommandError::temporary(
            "Offboard refused: no setpoint a moment ago (COM_OF_LOSS_T)",
        )),
        Mode::Altitude if !streams.sticks => {
            Err(CommandError::temporary("Altitude refused: no sticks, use Position"))
        }
        _ => Ok(mode),
    }
}

/// The standard mode with the same meaning; `None` where there is none. Position is the definition's Cruise: for a
/// fixed wing, its "Position hold" would mean hovering. PX4's Hold has none either: MAV_STANDARD_MODE_ORBIT is a
/// mode that a pilot steers.
const fn standard(mode: Mode) -> Option<MavStandardMode> {
    match mode {
        Mode::Hold | Mode::Offboard | Mode::Takeoff => None,
        Mode::Position => Some(MavStandardMode::MAV_STANDARD_MODE_CRUISE),
        Mode::Mission => Some(MavStandardMode::MAV_STANDARD_MODE_MISSION),
        Mode::Return => Some(MavStandardMode::MAV_STANDARD_MODE_SAFE_RECOVERY),
        Mode::Altitude => Some(MavStandardMode::MAV_STANDARD_MODE_ALTITUDE_HOLD),
    }
}

/// The standard mode as sent: only the one whose number and name mean the same to every station. Until
/// December 2024 MAV_STANDARD_MODE had 5 as Return home, 6 as Safe recovery and 7 as Mission; since then 5 is
/// Safe recovery and 6 is Mission. A station that reads the other enumeration would show Mission as "Safe
/// Recovery"; and every station that knows the name Cruise shows Position by it.
const fn sent_standard(mode: Mode) -> MavStandardMode {
    match mode {
        Mode::Altitude => MavStandardMode::MAV_STANDARD_MODE_ALTITUDE_HOLD,
        _ => MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD,
    }
}

/// Position needs no pilot: without sticks it keeps its references.
fn properties(mode: Mode) -> MavModeProperty {
    match mode {
        Mode::Altitude => MavModeProperty::empty(),
        Mode::Offboard => {
            MavModeProperty::MAV_MODE_PROPERTY_AUTO_MODE
                | MavModeProperty::MAV_MODE_PROPERTY_ADVANCED
        }
        _ => MavModeProperty::MAV_MODE_PROPERTY_AUTO_MODE,
    }
}

/// Modes in the list that AVAILABLE_MODES enumerates.
pub const COUNT: u8 = Mode::ALL.len() as u8;

/// AVAILABLE_MODES of the mode with this index, from 1; `None` if there is no such mode.
pub fn available_modes(index: u8) -> Option<Encoded> {
    let mode = *Mode::ALL.get(usize::from(index.checked_sub(1)?))?;
    let standard_mode = sent_standard(mode);
    // By the definition a standard mode has no name.
    let is_own = standard_mode == MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD;
    let name = if is_own { mode.key() } else { "" };
    Some(Encoded::new(&AVAILABLE_MODES_DATA {
        number_modes: COUNT,
        mode_index: index,
        standard_mode,
        custom_mode: custom_mode(mode),
        properties: properties(mode),
        mode_name: name.into(),
    }))
}

/// CURRENT_MODE. The requested mode and the active mode are always the same here.
pub fn current_mode(aircraft: &Aircraft) -> Encoded {
    let mode = aircraft.mode();
    Encoded::new(&CURRENT_MODE_DATA {
        standard_mode: sent_standard(mode),
        custom_mode: custom_mode(mode),
        intended_custom_mode: 0,
    })
}

/// AVAILABLE_MODES_MONITOR: the set of modes never changes.
pub fn monitor(_: &Aircraft) -> Encoded {
    Encoded::new(&AVAILABLE_MODES_MONITOR_DATA { seq: 0 })
}

/// Lower end of the lowest slot, us.
const LOWEST_US: u16 = 1000;
/// Width of all slots, us.
const TRAVEL_US: u16 = 1000;
/// Channels with these values carry no position.
const NOT_GIVEN: [u16; 2] = [0, u16::MAX];

/// Follows the switches that select flight modes: RC_MAP_FLTMODE names the channel of RC_CHANNELS_OVERRIDE,
/// COM_FLTMODE1 to COM_FLTMODE6 the modes of its six slots, each a sixth of 1000 us to 2000 us.
///
/// A change of the slot requests the mode as a SET_MODE of the same station does, so a refusal has the same texts
/// and success gives control. The first position received requests nothing: connecting changes no mode.
#[derive(Debug, Default)]
pub struct ModeSwitch {
    /// Channel and slot of each system.
    positions: Latest<(usize, usize)>,
}

impl Service for ModeSwitch {
    /// Derives the SET_MODE of a slot that has changed.
    fn handle(&mut self, from: From, message: &Message, _: WallTime, shared: &mut Shared) {
        let Message::RcOverride(channels) = message else { return };
        let parameters = &shared.parameters.mode_switch;
        let channel = match parameters.channel {
            SwitchChannel::None => return,
            SwitchChannel::Five => 4,
            SwitchChannel::Six => 5,
            SwitchChannel::Seven => 6,
            SwitchChannel::Eight => 7,
        };
        let pulse_us = channels[channel];
        if NOT_GIVEN.contains(&pulse_us) {
            return;
        }
        let slot = slot(pulse_us);
        let before = self.positions.replace(from.sender.system, (channel, slot));
        // Another channel is another switch, whose first position selects nothing.
        if before.is_some_and(|(old, before)| old == channel && before != slot) {
            shared.derived = slot_mode(parameters.slots[slot]).map(Message::SetMode);
        }
    }
}

fn slot(pulse_us: u16) -> usize {
    let travelled = usize::from(pulse_us.saturating_sub(LOWEST_US));
    // The end of the travel belongs to the highest slot.
    (travelled * MODE_SLOTS / usize::from(TRAVEL_US)).min(MODE_SLOTS - 1)
}

/// PX4's main and sub mode of a slot; the handler of SET_MODE decides whether the vehicle has it.
fn slot_mode(mode: SwitchMode) -> Option<SetMode> {
    let (main, sub) = match mode {
        SwitchMode::Unassigned => return None,
        SwitchMode::Manual => (MAIN_MANUAL, 0),
        SwitchMode::Altitude => (MAIN_ALTCTL, 0),
        SwitchMode::Position => (MAIN_POSCTL, 0),
        SwitchMode::Mission => (MAIN_AUTO, SUB_MISSION),
        SwitchMode::Hold => (MAIN_AUTO, SUB_LOITER),
        SwitchMode::Return => (MAIN_AUTO, SUB_RTL),
        SwitchMode::Acro => (MAIN_ACRO, 0),
        SwitchMode::Offboard => (MAIN_OFFBOARD, 0),
        SwitchMode::Stabilized => (MAIN_STABILIZED, 0),
    };
    Some(SetMode { is_custom: true, main, sub })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::mavlink::dialects::common::MavResult;

    const ALL_STREAMS: Streams = Streams { setpoints: true, sticks: true };
    const NO_STREAM: Streams = Streams { setpoints: false, sticks: false };

    #[test]
    fn the_encoding_is_that_of_px4() {
        for (mode, expected) in [
            (Mode::Position, 196_608),
            (Mode::Hold, 50_593_792),
            (Mode::Mission, 67_371_008),
            (Mode::Return, 84_148_224),
            (Mode::Offboard, 393_216),
            (Mode::Altitude, 131_072),
            (Mode::Takeoff, 33_816_576),
        ] {
            assert_eq!(custom_mode(mode), expected, "{mode}");
        }
    }

    #[test]
    fn every_mode_is_found_by_its_own_encoding() {
        for mode in Mode::ALL {
            let [_, _, main, sub] = custom_mode(mode).to_le_bytes();
            assert_eq!(requested(true, main, sub, ALL_STREAMS), Ok(mode));
        }
    }

    #[test]
    fn unknown_modes_and_modes_without_the_custom_flag_are_denied_with_the_reason() {
        for (main, sub) in
            [(0, 0), (1, 0), (3, 1), (4, 1), (4, 6), (4, 11), (4, 12), (7, 0), (255, 255)]
        {
            let refused = requested(true, main, sub, ALL_STREAMS).unwrap_err();
            assert_eq!(refused.result, MavResult::MAV_RESULT_DENIED, "{main}/{sub}");
            assert!(refused.reason.is_some());
        }
        assert!(requested(false, 4, 3, ALL_STREAMS).is_err());
    }

    #[test]
    fn modes_that_follow_a_stream_wait_for_it_and_the_others_do_not() {
        for mode in Mode::ALL {
            let [_, _, main, sub] = custom_mode(mode).to_le_bytes();
            let result = requested(true, main, sub, NO_STREAM).map_err(|refused| refused.result);
            let needs_stream = matches!(mode, Mode::Offboard | Mode::Altitude);
            let expected = if needs_stream {
                Err(MavResult::MAV_RESULT_TEMPORARILY_REJECTED)
            } else {
                Ok(mode)
            };
            assert_eq!(result, expected, "{mode}");
        }
    }

    #[test]
    fn a_standard_mode_is_found_by_its_number_and_any_other_has_failed() {
        for (number, mode) in
            [(3, Mode::Position), (4, Mode::Altitude), (5, Mode::Return), (6, Mode::Mission)]
        {
            assert_eq!(requested_standard(number, ALL_STREAMS), Ok(mode));
        }
        for number in [0, 1, 2, 7, 8, 255] {
            let refused = requested_standard(number, ALL_STREAMS).unwrap_err();
            assert_eq!(refused.result, MavResult::MAV_RESULT_FAILED, "{number}");
        }
    }

    #[test]
    fn the_modes_are_numbered_from_one_without_a_gap() {
        assert_eq!(available_modes(0), None);
        assert!((1..=COUNT).all(|index| available_modes(index).is_some()));
        assert_eq!(available_modes(COUNT + 1), None);
        assert_eq!(available_modes(255), None);
    }

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
