//! The modes that QGroundControl offers for a fixed wing by itself, by version, and how its versions read the
//! list of AVAILABLE_MODES.
//!
//! Modes: `src/FirmwarePlugin/PX4/PX4FirmwarePlugin.cc`, up to 4.4 `rgModes2Name` (rows with `canBeSet` and
//! `FW`), from 5.0 on `availableFlightModes` (rows that can be set) and `updateAvailableFlightModes` (rows whose
//! `fixedWing` becomes false are left out); numbers: `src/FirmwarePlugin/PX4/px4_custom_mode.h`. Names of
//! standard modes: `StandardModes::gotMessage` in `src/Vehicle/StandardModes.cc`, with the MAV_STANDARD_MODE of
//! the MAVLink library that the version is built with.

#![expect(deprecated, reason = "QGroundControl changes modes by SET_MODE")]

use super::world::*;
use crate::codec::{self, Encoded, OWN, Skipped};
use crate::modes;
use ::mavlink::dialects::common::{
    AVAILABLE_MODES_DATA, HEARTBEAT_DATA, MavMessage, MavModeFlag, MavResult, MavSeverity,
    SET_MODE_DATA, STATUSTEXT_DATA,
};
use ::mavlink::{MavlinkVersion, MessageData};
use flight_management::vehicle::Mode;

/// Name, main mode, sub mode.
type Row = (&'static str, u8, u8);

/// 4.3.0, 4.4.0 and 4.4.4, and 5.0.0 and 5.0.1 have the same nine; in 5.x they are replaced by AVAILABLE_MODES.
const OFFERED: [Row; 9] = [
    ("Manual", 1, 0),
    ("Stabilized", 7, 0),
    ("Acro", 5, 0),
    ("Rattitude", 8, 0),
    ("Altitude", 2, 0),
    ("Position", 3, 0),
    ("Hold", 4, 3),
    ("Mission", 4, 4),
    ("Return", 4, 5),
];
const VERSIONS: [(&str, &[Row]); 3] = [("4.3", &OFFERED), ("4.4", &OFFERED), ("5.0", &OFFERED)];

/// Effect of selecting the mode in a flight without joystick and plan: the mode, or the text.
fn expected(name: &str) -> Result<Mode, String> {
    match name {
        "Position" => Ok(Mode::Position),
        "Hold" => Ok(Mode::Hold),
        "Return" => Ok(Mode::Return),
        "Mission" => Err("Refused: there is no plan: upload one first".into()),
        "Altitude" => Err("Altitude refused: no sticks, use Position".into()),
        other => Err(format!("{other} is not flown here: use Position")),
    }
}

/// The latest custom mode and the texts worse than information.
fn seen(world: &World) -> (Option<u32>, Vec<String>) {
    let beats = world.got.iter().filter_map(Got::read::<HEARTBEAT_DATA>);
    let custom_mode = beats.map(|beat| beat.custom_mode).reduce(|_, latest| latest);
    let is_shown =
        |text: &STATUSTEXT_DATA| text.severity as u8 <= MavSeverity::MAV_SEVERITY_WARNING as u8;
    let mine = world.got.iter().filter(|got| got.to == address(14_550));
    let texts = mine.filter_map(Got::read::<STATUSTEXT_DATA>).filter(is_shown);
    let mut shown: Vec<String> = Vec::new();
    for text in texts {
        let part = text.text.to_str().unwrap().to_owned();
        match shown.last_mut() {
            Some(last) if text.chunk_seq > 0 => last.push_str(&part),
            _ => shown.push(part),
        }
    }
    (custom_mode, shown)
}

/// A flight in another mode than any that is requested.
fn elsewhere() -> World {
    let mut world = World::flying();
    world.send(&super::offboard::setpoint(0.0));
    world.send_command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.got.clear();
    world
}

#[test]
fn every_mode_that_is_offered_is_flown_or_refused_with_a_text_that_is_shown() {
    for (version, offered) in VERSIONS {
        for (name, main, sub) in offered.iter().copied() {
            let custom_mode = u32::from_le_bytes([0, 0, main, sub]);
            let base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
            let by_message =
                MavMessage::SET_MODE(SET_MODE_DATA { custom_mode, target_system: 1, base_mode });
            let by_command = [1.0, f32::from(main), f32::from(sub), 0.0, 0.0, 0.0, 0.0];
            for uses_command in [false, true] {
                let mut world = elsewhere();
                if uses_command {
                    world.send_command(176, by_command);
                } else {
                    world.send(&by_message);
                }
                let result = world.take_acks().first().map(|ack| ack.result);
                assert_eq!(result.is_some(), uses_command, "{version} {name}");
                let accepted = result.map(|result| result == MavResult::MAV_RESULT_ACCEPTED as u8);
                world.run_ms(4);
                let (now, texts) = seen(&world);
                match expected(name) {
                    Ok(mode) => {
                        assert_eq!(now, Some(custom_mode), "{version} {name}: {texts:?}");
                        assert_eq!(world.autopilot.snapshot().unwrap().mode, mode);
                        assert_ne!(accepted, Some(false), "{version} {name}");
                    }
                    Err(text) => {
                        assert_eq!(texts, [text], "{version} {name}");
                        assert_eq!(now, None, "{version} {name}: no change of mode");
                        assert_ne!(accepted, Some(true), "{version} {name}");
                    }
                }
            }
        }
    }
}

/// Standard modes by their names in QGroundControl, from 1.
const UNTIL_DECEMBER_2024: [&str; 9] = [
    "Position",
    "Orbit",
    "Cruise",
    "Altitude",
    "Return",
    "Safe Recovery",
    "Mission",
    "Land",
    "Takeoff",
];
const SINCE: [&str; 8] =
    ["Position", "Orbit", "Cruise", "Altitude", "Safe Recovery", "Mission", "Land", "Takeoff"];

fn shown(message: &Encoded, standard: &[&str]) -> (u32, String) {
    let (bytes, mut skipped) = (message.frame(OWN, 0), Skipped::default());
    let frame = codec::next_frame(&mut &bytes[..], &mut skipped).unwrap();
    let data = AVAILABLE_MODES_DATA::deser(MavlinkVersion::V2, frame.payload).unwrap();
    let number = usize::from(data.standard_mode as u8);
    let by_standard = number.checked_sub(1).and_then(|index| standard.get(index));
    let own = data.mode_name.to_str().unwrap();
    (data.custom_mode, by_standard.map_or(own.to_owned(), |name| (*name).to_owned()))
}

#[test]
fn the_listed_modes_have_their_names_under_both_enumerations_of_standard_modes() {
    for standard in [&UNTIL_DECEMBER_2024[..], &SINCE[..]] {
        let listed: Vec<(u32, String)> = (1..=modes::COUNT)
            .map(|index| shown(&modes::available_modes(index).unwrap(), standard))
            .collect();
        let expected = [
            (196_608, "Position"),
            (50_593_792, "Hold"),
            (67_371_008, "Mission"),
            (84_148_224, "Return"),
            (393_216, "Offboard"),
            (131_072, "Altitude"),
            (33_816_576, "Takeoff"),
        ]
        .map(|(custom_mode, name)| (custom_mode, name.to_owned()));
        assert_eq!(listed, expected);
    }
}

#[test]
fn a_flight_begins_in_a_mode_of_the_fixed_list() {
    let mut world = World::flying();
    world.run_ms(1_100);
    let (custom_mode, _) = seen(&world);
    let [_, _, main, sub] = custom_mode.unwrap().to_le_bytes();
    assert_eq!(OFFERED.iter().find(|row| (row.1, row.2) == (main, sub)).unwrap().0, "Position");
}
