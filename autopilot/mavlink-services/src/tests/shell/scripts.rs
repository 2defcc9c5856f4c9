//! `script`: the files, the running one, and the list of faults where the autopilot joined the flight.

use super::super::scripts::{CHAIN, upload};
use super::*;
use flight_management::command::Command;
use flight_management::command::ScriptCommand;
use flight_management::script::Script;
use icd::fault::{FaultEntry, FaultState, PlantReport, Timing};
use icd::tvc_jet;
use icd::{Attitude, ControlPeriod, EulerAngles, FaultKind, SimTime};
use std::sync::Arc;

fn names_of_started(world: &mut World) -> Vec<String> {
    let commands = world.take_commands();
    let names = commands.into_iter().filter_map(|command| match command {
        Command::Script(ScriptCommand::Run(script)) => Some(script.name().to_owned()),
        _ => None,
    });
    names.collect()
}

#[test]
fn scripts_are_listed_with_their_numbers_and_the_one_that_runs_is_marked() {
    let mut world = World::flying();
    assert_eq!(output(&mut world, "script list"), "No scripts\n");
    upload(&mut world, "/scripts/b.txt", "at 1 min: say late");
    upload(&mut world, "/scripts/a.txt", CHAIN);
    let size = CHAIN.len();
    let list = format!("   1 a.txt ({size} bytes, uploaded last)\n   2 b.txt (18 bytes)\n");
    assert_eq!(output(&mut world, "script list"), list);
    assert_eq!(output(&mut world, "script run 2"), "Script began: b.txt\n");
    assert_eq!(output(&mut world, "script list"), list.replace("   2", "*  2"));
}

#[test]
fn a_script_is_started_by_its_name_or_its_number_and_a_name_goes_first() {
    let mut world = World::flying();
    for name in ["1", "c.txt", "b.txt"] {
        upload(&mut world, &format!("/scripts/{name}"), "at 1 min: say late");
    }
    world.take_commands();
    for (which, name) in
        [("c.txt", "c.txt"), ("3", "c.txt"), ("2", "b.txt"), ("0", "b.txt"), ("1", "1")]
    {
        let text = output(&mut world, &format!("script run {which}"));
        assert_eq!(text, format!("Script began: {name}\n"), "{which}");
        assert_eq!(names_of_started(&mut world), [name], "{which}");
    }
    upload(&mut world, "/scripts/2", "say two");
    assert_eq!(output(&mut world, "script run 2"), "Script began: 2\n");
}

#[test]
fn status_shows_the_next_line_of_each_sequence() {
    let mut world = World::flying();
    assert_eq!(output(&mut world, "script status"), "No script runs\n");
    assert!(!output(&mut world, "status").contains("Script"));
    let text = "# A comment\nsay one\nat 1 s: fail rudder stuck\nwhen roll passes 10 deg: say two\n\
                sequence beside\nsay three\n";
    upload(&mut world, "/scripts/a", text);
    output(&mut world, "script run a");
    let of_main = "Script runs: a\n  main: line 3 is next: at 1 s: fail rudder stuck\n";
    let beside = "  beside: every line is done\n";
    assert_eq!(output(&mut world, "script status"), format!("{of_main}{beside}"));
    assert!(output(&mut world, "status").contains("\nScript: a runs\n"));
    world.run_ms(1_000);
    let text = output(&mut world, "script status");
    assert!(text.contains("main: line 4 is next: when roll passes 10 deg: say two"), "{text}");
    assert!(output(&mut world, "list").contains("(rudder) stuck"));
    let bank = EulerAngles { phi: 11.0_f64.to_radians(), theta: 0.0, psi: 0.0 };
    world.sensors.attitude.value = Attitude::from_euler(bank);
    world.run_ms(20);
    assert!(world.has_text("Script done: a"), "{:?}", world.texts());
    assert_eq!(output(&mut world, "script status"), "No script runs\n");
}

#[test]
fn the_script_that_runs_is_known_however_many_others_were_refused() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/a", "at 2 s: say done");
    upload(&mut world, "/scripts/b", "say b");
    assert_eq!(output(&mut world, "script run a"), "Script began: a\n");
    for _ in 0..8 {
        // The autopilot takes no request.
        let parameters = *world.ground.parameters();
        world.ground.shared.scripts.start_by_name("b", &parameters).unwrap();
    }
    world.run_ms(2_000);
    assert!(
        world.has_text("Script: done") && world.has_text("Script done: a"),
        "{:?}",
        world.texts()
    );
}

#[test]
fn a_script_is_stopped_once_and_a_second_stop_is_refused() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/a", "at 1 min: say late");
    assert_eq!(output(&mut world, "script stop"), "ERROR: no script runs\n");
    output(&mut world, "script run 1");
    assert_eq!(output(&mut world, "script stop"), "Script stopped\n");
    assert!(world.has_text("Script stopped: a"));
    assert_eq!(output(&mut world, "script status"), "No script runs\n");
    assert_eq!(output(&mut world, "script stop"), "ERROR: no script runs\n");
}

#[test]
fn a_script_that_cannot_start_is_an_error_with_its_place_and_sends_no_command() {
    let mut world = World::flying();
    assert_eq!(output(&mut world, "script run 0"), "ERROR: Script refused: none is here\n");
    upload(&mut world, "/scripts/bad", "say one\nfail elevator stuck\n");
    upload(&mut world, "/scripts/chain", CHAIN);
    upload(&mut world, "/scripts/words", "say only words");
    world.send(&super::super::params::set_int("SYS_FAILURE_EN", 0));
    world.settle();
    world.take_commands();
    for (line, reason) in [
        ("script run bad", "Script refused: bad, line 2, column 6: `elevator` found"),
        ("script run 1", "Script refused: bad, line 2, column 6"),
        ("script run 4", "Script refused: no number 4, 3 are here"),
        ("script run 99999", "Script refused: 99999: no such file"),
        ("script run nope", "Script refused: nope: no such file"),
        ("script run chain", "fault injection is off (SYS_FAILURE_EN 0)"),
        ("script", "usage: script list | script run NAME|NUMBER"),
        ("script run", "usage: script list"),
        ("script run a b", "usage: script list"),
        ("script start a", "usage: script list"),
    ] {
        let text = output(&mut world, line);
        assert!(text.starts_with("ERROR: ") && text.contains(reason), "{line}: {text}");
        assert_eq!(world.take_commands(), [], "{line}");
    }
    assert_eq!(output(&mut world, "script run words"), "Script began: words\n");
}

#[test]
fn starting_a_script_gives_control_only_if_the_script_steers() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/faults", CHAIN);
    upload(&mut world, "/scripts/climb", "altitude 5100 m");
    output(&mut world, "script run faults");
    assert!(output(&mut world, "status").contains("Control: nobody"));
    output(&mut world, "script run climb");
    let status = output(&mut world, "status");
    assert!(status.contains("Control: system 255") && status.contains("altitude 5100.0 m"));
}

#[test]
fn without_an_aircraft_a_script_does_not_begin_and_the_reason_is_reported() {
    let mut world = World::waiting();
    world.settle();
    upload(&mut world, "/scripts/a", "say a");
    assert_eq!(output(&mut world, "script run a"), "ERROR: no aircraft is connected\n");
    assert_eq!(output(&mut world, "script status"), "No script runs\n");
}

#[test]
fn the_scenarios_script_is_listed_without_a_number() {
    let mut world = World::waiting();
    let script =
        Arc::new(Script::parse("script of s.toml", "say hello", &tvc_jet::effectors()).unwrap());
    world.ground = world.ground.with_script(Some(script));
    world.autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    world.run_ms(200);
    let list = output(&mut world, "script list");
    assert_eq!(list, "   - script of s.toml (begins with the flight)\n");
    assert_eq!(output(&mut world, "script run 0"), "Script began: script of s.toml\n");
}

#[test]
fn the_list_is_whole_right_after_joining_a_flight() {
    let mut world = World::flying();
    let entry = |id, effector: icd::Effector, state| {
        let (kind, timing) = (FaultKind::StuckHere, Timing::at(SimTime::from_micros(1_000_000)));
        PlantReport::Fault(FaultEntry { id, target: effector.into(), kind, timing, state })
    };
    let at = SimTime::from_micros;
    world.listed = vec![
        entry(3, tvc_jet::RUDDER, FaultState::Active { since: at(1_000_000) }),
        entry(7, tvc_jet::LEFT_AILERON, FaultState::Scheduled { at: at(99_000_000) }),
    ];
    world.autopilot.begin_flight(ControlPeriod::DEFAULT, world.sim, true);
    world.run_ms(20);
    let list = output(&mut world, "failure list");
    assert_eq!(
        list,
        "Fault 3: servo 5 (rudder) stuck, since 1.000000 s\n\
         Fault 7: servo 1 (left aileron) stuck, from 99.000000 s on\n"
    );
    assert_eq!(output(&mut world, "list"), list);
    assert!(output(&mut world, "status").ends_with(&list));
}
