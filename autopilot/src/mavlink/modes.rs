//! Flight modes in PX4's encoding: main mode in the third byte, sub mode in the fourth.

#![expect(deprecated, reason = "ground stations still send PING and SET_MODE")]

use ::mavlink::dialects::common::{MavModeFlag, SET_MODE_DATA};

use super::aircraft::Phase;
use super::context::Context;
use super::refused::Refused;
use crate::clock::WallTime;
use crate::event::Wish;
use crate::vehicle::{Mode, VehicleRefusal};

const MAIN_ALTCTL: u8 = 2;
const MAIN_AUTO: u8 = 4;
const MAIN_OFFBOARD: u8 = 6;
const SUB_LOITER: u8 = 3;
const SUB_MISSION: u8 = 4;
const SUB_RTL: u8 = 5;
/// First of PX4's external modes: the own mode Reference.
const SUB_EXTERNAL1: u8 = 11;

/// custom_mode of HEARTBEAT.
#[must_use]
pub const fn custom_mode(mode: Mode) -> u32 {
    let (main, sub) = match mode {
        Mode::Reference => (MAIN_AUTO, SUB_EXTERNAL1),
        Mode::Hold => (MAIN_AUTO, SUB_LOITER),
        Mode::Mission => (MAIN_AUTO, SUB_MISSION),
        Mode::Return => (MAIN_AUTO, SUB_RTL),
        Mode::Offboard => (MAIN_OFFBOARD, 0),
        Mode::Altitude => (MAIN_ALTCTL, 0),
    };
    u32::from_le_bytes([0, 0, main, sub])
}

/// The mode that is asked for, if it can be entered now.
///
/// # Errors
/// Why not.
pub fn requested(
    has_custom_flag: bool,
    main: u8,
    sub: u8,
    setpoint_is_fresh: bool,
) -> Result<Mode, Refused> {
    if !has_custom_flag {
        return Err(Refused::denied("Mode refused: only custom modes (base mode bit 0)"));
    }
    match (main, sub) {
        (MAIN_AUTO, SUB_EXTERNAL1) => Ok(Mode::Reference),
        (MAIN_AUTO, SUB_LOITER) => Ok(Mode::Hold),
        (MAIN_OFFBOARD, _) if setpoint_is_fresh => Ok(Mode::Offboard),
        (MAIN_OFFBOARD, _) => {
            Err(Refused::for_now("Offboard refused: no setpoint within the last 0.5 s"))
        }
        _ => Err(Refused::denied(format!(
            "Mode {main}/{sub} refused: there are Hold (4/3) and Offboard (6/0)"
        ))),
    }
}

fn can_fly(phase: Phase) -> Result<(), Refused> {
    let refusal = match phase {
        Phase::Flying => return Ok(()),
        Phase::NoFlight | Phase::Lost => VehicleRefusal::NoFlight,
        Phase::OnGround => VehicleRefusal::FlightOver,
    };
    Err(Refused::for_now(format!("Mode refused: {refusal}")))
}

/// SET_MODE. It has no acknowledgement: the next heartbeat tells, a text tells why not.
pub fn handle(data: &SET_MODE_DATA, now: WallTime, ctx: &mut Context) {
    let [_, _, main, sub] = data.custom_mode.to_le_bytes();
    let has_custom_flag = data.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED);
    let pushed = requested(has_custom_flag, main, sub, ctx.setpoint_is_fresh).and_then(|mode| {
        // The vehicle checks again, but nobody waits for its word.
        can_fly(ctx.aircraft.phase())?;
        let number = ctx.intents.push(Wish::Mode(mode));
        number.ok_or_else(|| Refused::for_now("Mode refused: too many requests are waiting"))
    });
    if let Err(Refused { reason: Some(reason), .. }) = pushed {
        ctx.texts.refuse(now, reason);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_encoding_is_that_of_px4() {
        assert_eq!(custom_mode(Mode::Hold), 50_593_792);
        assert_eq!(custom_mode(Mode::Offboard), 393_216);
    }

    #[test]
    fn offboard_needs_a_fresh_setpoint_and_unknown_modes_are_denied_with_the_reason() {
        assert_eq!(requested(true, 6, 0, true), Ok(Mode::Offboard));
        assert!(requested(true, 6, 0, false).is_err());
        for (main, sub) in [(4, 5), (1, 0), (255, 255)] {
            assert!(requested(true, main, sub, true).unwrap_err().reason.is_some());
        }
        assert!(requested(false, 4, 3, true).is_err());
    }
}
