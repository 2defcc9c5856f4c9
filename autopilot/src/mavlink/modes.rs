//! Flight modes in PX4's encoding, main mode in the third byte, sub mode in the fourth, and what ground
//! stations are told about the modes there are.

use ::mavlink::dialects::common::{
    AVAILABLE_MODES_DATA, AVAILABLE_MODES_MONITOR_DATA, CURRENT_MODE_DATA, MavModeProperty,
    MavStandardMode,
};

use super::aircraft::Aircraft;
use super::codec::Encoded;
use super::refused::Refused;
use crate::vehicle::Mode;

pub(super) const MAIN_MANUAL: u8 = 1;
pub(super) const MAIN_ALTCTL: u8 = 2;
pub(super) const MAIN_POSCTL: u8 = 3;
pub(super) const MAIN_AUTO: u8 = 4;
pub(super) const MAIN_ACRO: u8 = 5;
pub(super) const MAIN_OFFBOARD: u8 = 6;
pub(super) const MAIN_STABILIZED: u8 = 7;
pub(super) const SUB_LOITER: u8 = 3;
pub(super) const SUB_MISSION: u8 = 4;
pub(super) const SUB_RTL: u8 = 5;
/// First of PX4's external modes: the own mode Reference.
const SUB_EXTERNAL1: u8 = 11;

/// Main and sub mode.
const fn main_and_sub(mode: Mode) -> (u8, u8) {
    match mode {
        Mode::Reference => (MAIN_AUTO, SUB_EXTERNAL1),
        Mode::Hold => (MAIN_AUTO, SUB_LOITER),
        Mode::Mission => (MAIN_AUTO, SUB_MISSION),
        Mode::Return => (MAIN_AUTO, SUB_RTL),
        Mode::Offboard => (MAIN_OFFBOARD, 0),
        Mode::Altitude => (MAIN_ALTCTL, 0),
    }
}

/// custom_mode of HEARTBEAT.
#[must_use]
pub const fn custom_mode(mode: Mode) -> u32 {
    let (main, sub) = main_and_sub(mode);
    u32::from_le_bytes([0, 0, main, sub])
}

/// The mode with this main and sub mode. The sub mode counts only in PX4's main mode AUTO.
#[must_use]
pub fn mode_of(main: u8, sub: u8) -> Option<Mode> {
    Mode::ALL.into_iter().find(|mode| {
        let (own_main, own_sub) = main_and_sub(*mode);
        own_main == main && (main != MAIN_AUTO || own_sub == sub)
    })
}

/// What streams of a ground station are heard just now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    /// Usable offboard setpoints.
    pub setpoints: bool,
    /// A pilot's sticks.
    pub sticks: bool,
}

/// The mode that is asked for, if it can be entered now as far as the ground-station side knows.
///
/// # Errors
/// Why not.
pub fn requested(
    has_custom_flag: bool,
    main: u8,
    sub: u8,
    streams: Streams,
) -> Result<Mode, Refused> {
    if !has_custom_flag {
        return Err(Refused::denied("Mode refused: only custom modes (base mode bit 0)"));
    }
    let Some(mode) = mode_of(main, sub) else {
        return Err(Refused::denied(format!(
            "Mode {main}/{sub} refused: there are Hold (4/3), Mission (4/4), Return (4/5), \
             FTC Reference (4/11), Offboard (6/0) and Altitude (2/0)"
        )));
    };
    enterable(mode, streams)
}

/// The standard mode (MAV_STANDARD_MODE) that is asked for.
///
/// # Errors
/// The protocol wants FAILED for a standard mode that the vehicle does not have.
pub fn requested_standard(standard_mode: u8, streams: Streams) -> Result<Mode, Refused> {
    let has_it = |mode: &Mode| standard(*mode).is_some_and(|own| own as u8 == standard_mode);
    let Some(mode) = Mode::ALL.into_iter().find(has_it) else {
        return Err(Refused::failed(format!(
            "Standard mode {standard_mode} refused: there are 4 Altitude, 5 Return and 6 Mission"
        )));
    };
    enterable(mode, streams)
}

/// Whether a mode can be entered now as far as the ground-station side knows.
///
/// # Errors
/// Why not.
pub fn enterable(mode: Mode, streams: Streams) -> Result<Mode, Refused> {
    match mode {
        Mode::Offboard if !streams.setpoints => {
            Err(Refused::for_now("Offboard refused: no setpoint a moment ago (COM_OF_LOSS_T)"))
        }
        Mode::Altitude if !streams.sticks => {
            Err(Refused::for_now("Altitude refused: no sticks a moment ago (COM_RC_LOSS_T)"))
        }
        _ => Ok(mode),
    }
}

/// The standard mode that means the same; `None` for an own mode. PX4's Hold is none of them either:
/// MAV_STANDARD_MODE_ORBIT is a mode that a pilot steers.
const fn standard(mode: Mode) -> Option<MavStandardMode> {
    match mode {
        Mode::Reference | Mode::Hold | Mode::Offboard => None,
        Mode::Mission => Some(MavStandardMode::MAV_STANDARD_MODE_MISSION),
        Mode::Return => Some(MavStandardMode::MAV_STANDARD_MODE_SAFE_RECOVERY),
        Mode::Altitude => Some(MavStandardMode::MAV_STANDARD_MODE_ALTITUDE_HOLD),
    }
}

/// Name that ground stations show.
const fn shown_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Reference => "FTC Reference",
        _ => mode.name(),
    }
}

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
#[expect(clippy::cast_possible_truncation, reason = "a handful of modes")]
pub const COUNT: u8 = Mode::ALL.len() as u8;

/// AVAILABLE_MODES of the mode with this index, from 1; `None` if there is no such mode.
#[must_use]
pub fn available_modes(index: u8) -> Option<Encoded> {
    let mode = *Mode::ALL.get(usize::from(index.checked_sub(1)?))?;
    // The definition leaves the name out where a standard mode says it.
    let name = if standard(mode).is_some() { "" } else { shown_name(mode) };
    Some(Encoded::new(&AVAILABLE_MODES_DATA {
        number_modes: COUNT,
        mode_index: index,
        standard_mode: standard(mode).unwrap_or_default(),
        custom_mode: custom_mode(mode),
        properties: properties(mode),
        mode_name: name.into(),
    }))
}

/// CURRENT_MODE. The mode that the operator wanted is not told apart from the mode that is flown.
#[must_use]
pub fn current_mode(aircraft: &Aircraft) -> Encoded {
    let mode = aircraft.mode();
    Encoded::new(&CURRENT_MODE_DATA {
        standard_mode: standard(mode).unwrap_or_default(),
        custom_mode: custom_mode(mode),
        intended_custom_mode: 0,
    })
}

/// AVAILABLE_MODES_MONITOR: the set of modes never changes.
#[must_use]
pub fn monitor() -> Encoded {
    Encoded::new(&AVAILABLE_MODES_MONITOR_DATA { seq: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::mavlink::dialects::common::MavResult;

    const ALL_HEARD: Streams = Streams { setpoints: true, sticks: true };
    const NOTHING_HEARD: Streams = Streams { setpoints: false, sticks: false };

    #[test]
    fn the_encoding_is_that_of_px4() {
        for (mode, expected) in [
            (Mode::Reference, 184_811_520),
            (Mode::Hold, 50_593_792),
            (Mode::Mission, 67_371_008),
            (Mode::Return, 84_148_224),
            (Mode::Offboard, 393_216),
            (Mode::Altitude, 131_072),
        ] {
            assert_eq!(custom_mode(mode), expected, "{mode}");
        }
    }

    #[test]
    fn every_mode_is_found_by_its_own_encoding() {
        for mode in Mode::ALL {
            let [_, _, main, sub] = custom_mode(mode).to_le_bytes();
            assert_eq!(requested(true, main, sub, ALL_HEARD), Ok(mode));
        }
    }

    #[test]
    fn unknown_modes_and_modes_without_the_custom_flag_are_denied_with_the_reason() {
        for (main, sub) in [(0, 0), (1, 0), (3, 0), (4, 2), (4, 6), (4, 12), (7, 0), (255, 255)] {
            let refused = requested(true, main, sub, ALL_HEARD).unwrap_err();
            assert_eq!(refused.result, MavResult::MAV_RESULT_DENIED, "{main}/{sub}");
            assert!(refused.reason.is_some());
        }
        assert!(requested(false, 4, 3, ALL_HEARD).is_err());
    }

    #[test]
    fn modes_that_follow_a_stream_wait_for_it_and_the_others_do_not() {
        for mode in Mode::ALL {
            let [_, _, main, sub] = custom_mode(mode).to_le_bytes();
            let result =
                requested(true, main, sub, NOTHING_HEARD).map_err(|refused| refused.result);
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
        for (number, mode) in [(4, Mode::Altitude), (5, Mode::Return), (6, Mode::Mission)] {
            assert_eq!(requested_standard(number, ALL_HEARD), Ok(mode));
        }
        for number in [0, 1, 2, 3, 7, 8, 255] {
            let refused = requested_standard(number, ALL_HEARD).unwrap_err();
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
}
