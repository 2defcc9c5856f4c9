//! Input from ground stations: frames, any message with any payload, file transfer, the shell.

use autopilot::mavlink::codec::{self, Skipped};

use super::choices::Choices;
use super::mavlink_world::{World, frame, station};

/// Messages that the autopilot reads; see `autopilot/mavlink-services/src/codec`.
const KNOWN: [u32; 36] = [
    0, 4, 11, 20, 21, 23, 37, 39, 40, 41, 43, 44, 45, 47, 51, 66, 69, 70, 73, 75, 76, 82, 84, 86,
    109, 110, 111, 117, 119, 121, 122, 126, 256, 148, 246, 300,
];
/// Conversations in one input: an error of state shows early, and an input stays short.
const MESSAGES_MAX: usize = 48;

fn send(world: &mut World, choices: &mut Choices, bytes: &[u8]) {
    match choices.below(4) {
        0 => world.stream(bytes),
        from => world.datagram(station(14_549 + u16::try_from(from).unwrap()), bytes),
    }
    for _ in 0..choices.below(8) {
        world.step();
    }
}

/// Any bytes, with good frames among them.
#[test]
fn mavlink_frames() {
    bolero::check!().for_each(|input: &[u8]| {
        let mut choices = Choices::new(input);
        let mut bytes = Vec::new();
        while !choices.is_empty() && bytes.len() < 4_096 {
            let count = choices.below(64);
            match choices.below(3) {
                0 => bytes.extend_from_slice(choices.bytes(count)),
                1 => bytes.extend(frame(*choices.one_of(&KNOWN), choices.bytes(count))),
                _ => {
                    let mut good = frame(*choices.one_of(&KNOWN), choices.bytes(count));
                    choices.damage(&mut good);
                    bytes.extend(good);
                }
            }
        }
        let (mut rest, mut skipped) = (&bytes[..], Skipped::default());
        while let Some(frame) = codec::next_frame(&mut rest, &mut skipped) {
            // The autopilot ignores many of them.
            let _ = codec::decode(&frame);
        }
        assert!(rest.is_empty(), "a datagram is read to its end");
        let mut world = World::flying();
        for piece in bytes.chunks(97) {
            world.stream(piece);
        }
        world.datagram(station(14_550), &bytes);
        world.step();
    });
}

/// Any message with any payload, addressed to the autopilot at the usual offset of the target.
#[test]
fn mavlink_messages() {
    bolero::check!().for_each(|input: &[u8]| {
        let (mut choices, mut world) = (Choices::new(input), World::flying());
        for _ in 0..MESSAGES_MAX {
            if choices.is_empty() {
                break;
            }
            let count = choices.below(64);
            let id = *choices.one_of(&KNOWN);
            let mut payload = choices.bytes(count).to_vec();
            let target = [0, 1, 4, 5, 30, 31, 36, 37][choices.below(8)];
            for place in payload.iter_mut().skip(target).take(2) {
                *place = 1;
            }
            send(&mut world, &mut choices, &frame(id, &payload));
        }
    });
}

/// FILE_TRANSFER_PROTOCOL: sessions, names, places and sizes of any kind.
#[test]
fn mavlink_ftp() {
    const NAMES: [&[u8]; 7] = [
        b"/",
        b"/scripts/a.txt",
        b"/scripts/../x",
        b"/general.json",
        b"@PARAM/param.pck",
        b"mftp:///general.json",
        b"/\xFF\0\n",
    ];
    bolero::check!().for_each(|input: &[u8]| {
        let (mut choices, mut world) = (Choices::new(input), World::flying());
        for sequence in 0..MESSAGES_MAX {
            if choices.is_empty() {
                break;
            }
            let mut payload = vec![0, 1, 1];
            payload.extend(u16::try_from(sequence).unwrap().to_le_bytes());
            payload.extend([choices.byte() % 4, choices.byte() % 18, choices.byte(), 0, 0, 0]);
            let offset = if choices.byte() < 200 { u32::from(choices.byte()) } else { u32::MAX };
            payload.extend(offset.to_le_bytes());
            let name = *choices.one_of(&NAMES);
            if choices.byte() < 160 {
                // The size of a request is the length of its name.
                payload[7] = u8::try_from(name.len()).unwrap();
                payload.extend_from_slice(name);
            } else {
                payload.extend_from_slice(choices.bytes(239));
            }
            send(&mut world, &mut choices, &frame(110, &payload));
        }
    });
}

/// Lines for the shell by SERIAL_CONTROL.
#[test]
fn mavlink_shell() {
    const WORDS: [&str; 36] = [
        "help",
        "status",
        "fail",
        "clear",
        "rudder",
        "all",
        "failure",
        "servo",
        "motor",
        "stuck",
        "ok",
        "off",
        "-i",
        "-v",
        "3",
        "30deg",
        "-1",
        "1e99",
        "nan",
        "param",
        "set",
        "show",
        "FW_*",
        "script",
        "run",
        "stop",
        "mode",
        "hold",
        "pace",
        "pause",
        "list",
        "commander",
        "\u{1b}[A",
        "\t",
        "\"",
        ";",
    ];
    bolero::check!().for_each(|input: &[u8]| {
        let (mut choices, mut world) = (Choices::new(input), World::flying());
        for _ in 0..MESSAGES_MAX {
            if choices.is_empty() {
                break;
            }
            let mut line = String::new();
            for _ in 0..choices.below(7) {
                line.push_str(WORDS[choices.below(WORDS.len())]);
                line.push(if choices.byte() < 200 { ' ' } else { '\n' });
            }
            line.push('\n');
            let text = &line.as_bytes()[..line.len().min(70)];
            // Baud rate, timeout, device SHELL, flags RESPOND and EXCLUSIVE, length.
            let mut payload = vec![0, 0, 0, 0, 0, 0, 10, 6, u8::try_from(text.len()).unwrap()];
            payload.extend_from_slice(text);
            send(&mut world, &mut choices, &frame(126, &payload));
        }
    });
}
