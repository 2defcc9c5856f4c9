//! Consoles over SERIAL_CONTROL, in the forms that QGroundControl and MAVSDK send.

use ::mavlink::dialects::common::{
    MavMessage, PARAM_VALUE_DATA, SERIAL_CONTROL_DATA, SerialControlDev, SerialControlFlag,
};

use super::world::*;
use crate::codec::Identity;
use crate::peers::Address;

mod commands;
mod scripts;
mod transport;

const PROMPT: &str = "two-step> ";
/// EXCLUSIVE, RESPOND and MULTI, as QGroundControl has them.
const QGC: u8 = 22;
/// RESPOND, as MAVSDK has it.
const MAVSDK: u8 = 2;

fn typed(bytes: &[u8], flags: u8, device: SerialControlDev) -> MavMessage {
    let mut data = [0; 70];
    data[..bytes.len()].copy_from_slice(bytes);
    MavMessage::SERIAL_CONTROL(SERIAL_CONTROL_DATA {
        baudrate: 0,
        timeout: 0,
        device,
        flags: SerialControlFlag::from_bits_retain(flags),
        count: u8::try_from(bytes.len()).unwrap(),
        data,
        target_system: 1,
        target_component: 1,
    })
}

fn type_at(world: &mut World, from: Address, sender: Identity, text: &str, flags: u8) {
    for chunk in text.as_bytes().chunks(70) {
        let message = typed(chunk, flags, SerialControlDev::SERIAL_CONTROL_DEV_SHELL);
        let bytes = world.encode(sender, &message);
        world.send_bytes(from, &bytes);
    }
}

/// Output that the console of `sender` at `to` has received since the last call.
fn take(world: &mut World, to: Address, sender: Identity) -> String {
    let mut text = Vec::new();
    for got in world.got.iter().filter(|got| got.to == to) {
        let Some(data) = got.read::<SERIAL_CONTROL_DATA>() else { continue };
        if (data.target_system, data.target_component) != (sender.system, sender.component) {
            continue;
        }
        assert_eq!(data.device, SerialControlDev::SERIAL_CONTROL_DEV_SHELL);
        assert_eq!(data.flags, SerialControlFlag::SERIAL_CONTROL_FLAG_REPLY);
        let count = usize::from(data.count);
        assert!(data.data[count..].iter().all(|byte| *byte == 0));
        text.extend_from_slice(&data.data[..count]);
    }
    world.got.retain(|got| got.id != 126 || got.to != to);
    String::from_utf8(text).unwrap()
}

/// Types a line at the station at 14550 and returns its output within 200 ms, without the prompt of a new session
/// and without the echo. Input that is not a line (too long) has an empty echo.
fn run_line(world: &mut World, line: &str) -> String {
    type_at(world, address(14_550), STATION, &format!("{line}\n"), QGC);
    world.run_ms(300);
    let text = take(world, address(14_550), STATION);
    let (first, _) = line.split_once('\n').unwrap_or((line, ""));
    let text = text.strip_prefix(PROMPT).unwrap_or(&text);
    let answer = text.strip_prefix(first).unwrap_or(text).strip_prefix('\n');
    answer.unwrap_or_else(|| panic!("no echo: {text:?}")).to_owned()
}

/// The same without the prompt, which must be there.
fn output(world: &mut World, line: &str) -> String {
    let text = run_line(world, line);
    let output = text.strip_suffix(PROMPT).unwrap_or_else(|| panic!("no prompt: {text:?}"));
    assert!(!output.contains(PROMPT), "one prompt for one line: {text:?}");
    output.to_owned()
}

fn values(world: &World) -> Vec<PARAM_VALUE_DATA> {
    world.values(address(14_550))
}

#[test]
fn no_control_character_that_is_typed_comes_back() {
    let mut world = World::flying();
    for line in ["x\u{1b}[2J\u{7}\u{202e}", "help \u{9b}2J\u{7f}x", "param show \u{1b}]0;x\u{7}"] {
        let text = output(&mut world, line);
        assert!(text.starts_with("ERROR"), "{text:?}");
        let is_printable = |c: char| c == '\n' || c == ' ' || c.is_ascii_graphic();
        assert!(text.chars().all(is_printable), "{text:?}");
    }
}
