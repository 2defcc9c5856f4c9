//! Lines, chunks, peers.

use super::*;

#[test]
fn an_empty_line_is_answered_with_the_prompt_in_both_forms() {
    let mut world = World::flying();
    assert_eq!(run_line(&mut world, ""), PROMPT);
    type_at(&mut world, address(14_550), STATION, "\r\n", MAVSDK);
    world.run_ms(50);
    assert_eq!(take(&mut world, address(14_550), STATION), format!("\n{PROMPT}"));
}

#[test]
fn the_first_message_of_a_console_brings_a_prompt_also_when_nothing_was_typed() {
    let mut world = World::flying();
    // MAVProxy's module nsh polls like this from its start on.
    for _ in 0..5 {
        world.send(&typed(b"", QGC, SerialControlDev::SERIAL_CONTROL_DEV_SHELL));
        world.run_ms(50);
    }
    assert_eq!(take(&mut world, address(14_550), STATION), PROMPT, "once");
}

#[test]
fn a_typed_line_is_echoed_behind_the_prompt_before_its_answer() {
    let mut world = World::flying();
    let type_line = |world: &mut World, line: &str| {
        type_at(world, address(14_550), STATION, line, QGC);
        world.run_ms(200);
        take(world, address(14_550), STATION)
    };
    let first = type_line(&mut world, "mode hold\n");
    assert_eq!(first, "two-step> mode hold\nMode Hold\ntwo-step> ");
    let lines = type_line(&mut world, "list\nreference altitude 5100\n\n");
    let expected = "list\nNo faults\ntwo-step> reference altitude 5100\nReference altitude: 5100 m\n\
                    two-step> \ntwo-step> ";
    assert_eq!(lines, expected, "each line stands behind the prompt of the one before it");
}

#[test]
fn a_line_may_come_in_pieces_and_several_lines_in_one_message() {
    let mut world = World::flying();
    for (piece, prompt) in [("he", PROMPT), ("l", ""), ("p st", ""), ("ep\r", "")] {
        type_at(&mut world, address(14_550), STATION, piece, QGC);
        world.run_ms(50);
        assert_eq!(take(&mut world, address(14_550), STATION), prompt, "the line is not whole");
    }
    type_at(&mut world, address(14_550), STATION, "\n", QGC);
    world.run_ms(50);
    let whole = take(&mut world, address(14_550), STATION);
    assert!(whole.starts_with("help step\nrun for so many"), "{whole}");
    let three = run_line(&mut world, "mode\n\nnonsense");
    let parts: Vec<&str> = three.split(PROMPT).collect();
    let [mode, empty, nonsense, rest] = parts[..] else { panic!("not three prompts: {three}") };
    assert!(mode.contains("* Position"));
    assert_eq!((empty, rest), ("\n", ""));
    let error = "nonsense\nERROR: there is no command \"nonsense\"";
    assert!(nonsense.starts_with(error), "{nonsense}");
}

#[test]
fn a_line_longer_than_a_message_is_put_together() {
    let mut world = World::flying();
    let line = format!("help{}step", " ".repeat(150));
    assert!(output(&mut world, &line).starts_with("run for so many"));
}

#[test]
fn garbage_and_lines_that_are_too_long_are_reported_and_later_lines_are_kept() {
    let mut world = World::flying();
    let long = output(&mut world, &"x".repeat(1_000));
    assert_eq!(long, "ERROR: the line has 1000 bytes, at most 240 are allowed: nothing was done\n");
    let garbage =
        typed(&[0xFF, 0x80, 0x01, b'\n'], QGC, SerialControlDev::SERIAL_CONTROL_DEV_SHELL);
    world.send(&garbage);
    let text = run_line(&mut world, "help step");
    assert!(text.starts_with("ERROR: the line has bytes that are no text"), "{text}");
    assert!(text.contains("run for so many"), "{text}");
}

#[test]
fn a_count_beyond_the_message_is_the_whole_message() {
    let mut world = World::flying();
    let mut payload = vec![0; 81];
    payload[6..9].copy_from_slice(&[10, QGC, 255]);
    payload[9..14].copy_from_slice(b"help\n");
    payload[79..81].copy_from_slice(&[1, 1]);
    world.send_bytes(address(14_550), &frame(126, 220, &payload));
    world.run_ms(100);
    let text = take(&mut world, address(14_550), STATION);
    assert!(text.contains("status") && text.ends_with(PROMPT), "{text}");
}

#[test]
fn messages_for_other_devices_answers_and_other_systems_are_ignored() {
    let mut world = World::flying();
    for device in [
        SerialControlDev::SERIAL_CONTROL_DEV_GPS1,
        SerialControlDev::SERIAL_CONTROL_DEV_TELEM1,
        SerialControlDev::SERIAL_CONTROL_SERIAL0,
    ] {
        world.send(&typed(b"help\n", QGC, device));
    }
    let shell = SerialControlDev::SERIAL_CONTROL_DEV_SHELL;
    world.send(&typed(b"help\n", QGC | 1, shell));
    let MavMessage::SERIAL_CONTROL(mut data) = typed(b"help\n", QGC, shell) else { unreachable!() };
    data.target_system = 7;
    world.send(&MavMessage::SERIAL_CONTROL(data));
    world.run_ms(200);
    assert_eq!(take(&mut world, address(14_550), STATION), "");
}

#[test]
fn consoles_do_not_mix_neither_on_two_links_nor_behind_one() {
    let mut world = World::flying();
    let (one, other) = (address(14_550), address(9_000));
    let second = Identity { system: 255, component: 191 };
    type_at(&mut world, one, STATION, "help st", QGC);
    type_at(&mut world, other, STATION, "help pa", QGC);
    type_at(&mut world, one, second, "help ru", QGC);
    type_at(&mut world, one, STATION, "ep\n", QGC);
    type_at(&mut world, one, second, "n\n", QGC);
    type_at(&mut world, other, STATION, "use\n", QGC);
    world.run_ms(100);
    let first: Vec<String> = world
        .got
        .iter()
        .filter(|got| got.to == one)
        .filter_map(Got::read::<SERIAL_CONTROL_DATA>)
        .map(|data| format!("{} {}", data.target_component, data.count))
        .collect();
    assert!(first.iter().any(|text| text.starts_with("190 ")), "{first:?}");
    assert!(first.iter().any(|text| text.starts_with("191 ")), "{first:?}");
    assert!(take(&mut world, other, STATION).contains("let simulation time stand still"));
}

#[test]
fn a_long_output_waits_for_a_slow_peer_and_nothing_of_it_is_lost() {
    let mut world = World::flying();
    let quick = output(&mut world, "param show");
    assert!(quick.lines().count() > 70, "{} lines", quick.lines().count());
    world.stuck.push(address(14_550));
    type_at(&mut world, address(14_550), STATION, &"param show\n".repeat(10), QGC);
    // For 2 s no message can be sent, then a few now and then.
    world.run_ms(2_000);
    assert_eq!(take(&mut world, address(14_550), STATION), "");
    let mut text = String::new();
    for _ in 0..450 {
        world.stuck.clear();
        world.run_ms(2);
        world.stuck.push(address(14_550));
        world.run_ms(20);
        text.push_str(&take(&mut world, address(14_550), STATION));
    }
    assert_eq!(text, format!("param show\n{quick}{PROMPT}").repeat(10));
}

#[test]
fn too_many_lines_at_once_are_refused_with_a_text() {
    let mut world = World::flying();
    world.stuck.push(address(14_550));
    type_at(&mut world, address(14_550), STATION, &"param show\n".repeat(60), QGC);
    world.run_ms(100);
    world.stuck.clear();
    world.run_ms(20_000);
    let text = take(&mut world, address(14_550), STATION);
    let shown = text.matches(PROMPT).count();
    let line = text.lines().find(|line| line.contains("lines were not taken")).unwrap();
    let refused: usize = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    // The first prompt stands before the first line.
    assert_eq!(shown - 1 + refused, 60, "{line}");
}

#[test]
fn without_the_flag_respond_a_line_is_run_and_nothing_is_sent() {
    let mut world = World::flying();
    type_at(&mut world, address(14_550), STATION, "mode hold\n", 0);
    world.run_ms(100);
    assert_eq!(take(&mut world, address(14_550), STATION), "");
    assert!(output(&mut world, "mode").contains("* Hold"));
}

#[test]
fn a_console_that_is_closed_gets_nothing_more() {
    let mut world = World::flying();
    type_at(&mut world, address(14_550), STATION, "param show\nhel", QGC);
    world.send(&typed(b"", 0, SerialControlDev::SERIAL_CONTROL_DEV_SHELL));
    take(&mut world, address(14_550), STATION);
    world.run_ms(500);
    assert_eq!(take(&mut world, address(14_550), STATION), "");
    assert!(
        run_line(&mut world, "help step").starts_with("run for"),
        "a new session, an empty line"
    );
}
