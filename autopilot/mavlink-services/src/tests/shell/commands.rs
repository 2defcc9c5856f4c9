//! Output and effect of each command.

use super::*;
use flight_management::command::Command;
use flight_management::command::Configuration;
use flight_management::command::VehicleCommand;
use flight_management::parameters::{COMPATIBILITY, table};
use flight_management::vehicle::{Mode, Reference};
use icd::fault::PlantAction;
use icd::fault::{FaultReply, Onset, Refusal, Repeat, Side};
use icd::pace::Pace;
use icd::tvc_jet;
use icd::{FaultKind, FaultRequest, SimTime};

fn commands(world: &mut World, line: &str) -> (Vec<Command>, String) {
    world.take_commands();
    let text = output(world, line);
    (world.take_commands(), text)
}

#[test]
fn help_lists_every_command_and_explains_each() {
    let mut world = World::flying();
    let list = output(&mut world, "help");
    let names: Vec<&str> = list.lines().map(|line| line.split(' ').next().unwrap()).collect();
    for name in [
        "status",
        "list",
        "fail",
        "clear",
        "failure",
        "script",
        "param",
        "reference",
        "mode",
        "pause",
    ] {
        assert!(names.contains(&name), "{name}");
    }
    for name in names {
        let help = output(&mut world, &format!("help {name}"));
        assert!(help.lines().count() >= 2 && help.contains(&format!("  {name}")), "{help}");
        let document = include_str!("../../../../../docs/shell.md");
        assert!(document.contains(&format!("`{name}")), "{name} is not in docs/shell.md");
    }
    assert_eq!(output(&mut world, "help me"), "ERROR: there is no command \"me\"\n");
}

#[test]
fn status_shows_the_flight_the_compensator_and_each_effector() {
    let mut world = World::flying();
    let text = output(&mut world, "status");
    for words in [
        "Aircraft: in the air",
        "Control: nobody",
        "mode Position",
        "altitude 5000.0 m",
        "Compensator: armed",
        "roll ",
        "yaw ",
        "left aileron",
        "nozzle yaw",
        "kN",
        "No faults",
    ] {
        assert!(text.contains(words), "{words} is missing in:\n{text}");
    }
    for zero in ["-0 ", "-0.0 ", "-0.00 ", "-0.0000 "] {
        assert!(!text.contains(&format!(" {zero}")), "a zero has no sign:\n{text}");
    }
    assert!(output(&mut world, "status now").starts_with("ERROR: usage: status"));
    let mut world = World::waiting();
    world.settle();
    assert!(run_line(&mut world, "status").starts_with("Aircraft: none is connected"));
}

#[test]
fn parameters_are_shown_found_by_pattern_and_explained() {
    let mut world = World::flying();
    let all = output(&mut world, "param show");
    let faults = icd::fault::Target::all(&tvc_jet::effectors()).count();
    assert_eq!(all.lines().count(), table().len() + COMPATIBILITY.len() + faults);
    assert!(output(&mut world, "param get FLT_SERVO1").contains("  2 stuck"));
    assert!(output(&mut world, "param set FLT_SERVO1 2").contains("see help failure"));
    let some = output(&mut world, "param show act_lvl*");
    assert_eq!(some.lines().count(), 3, "{some}");
    assert!(output(&mut world, "param show NOPE*").starts_with("ERROR: no parameter has a name"));
    let one = output(&mut world, "param get FTC_MODE");
    assert!(one.starts_with("FTC_MODE 1\n") && one.contains("0 to 2"), "{one}");
    assert_eq!(output(&mut world, "param get NOPE"), "ERROR: there is no parameter NOPE\n");
    assert!(output(&mut world, "param").starts_with("ERROR: usage: param show"));
}

#[test]
fn a_parameter_that_is_set_is_broadcast_and_reaches_the_laws() {
    let mut world = World::flying();
    let (commands, text) = commands(&mut world, "param set act_lvl_p 0.5");
    assert_eq!(text, "ACT_LVL_P 1.05 -> 0.5\n");
    let [Command::Configuration(Configuration::Gains(gains))] = &commands[..] else {
        panic!("{commands:?}")
    };
    assert_eq!(gains.activation.level_roll, 0.5);
    let values = values(&world);
    let [value] = &values[..] else { panic!("sent once: {values:?}") };
    assert_eq!((value.param_id.to_str().unwrap(), value.param_value), ("ACT_LVL_P", 0.5));
    assert_eq!(world.ground.parameters().gains.activation.level_roll, 0.5);
}

#[test]
fn a_refused_parameter_keeps_its_value_and_the_reason_is_printed() {
    let mut world = World::flying();
    for (line, reason) in [
        ("param set ACT_LVL_P 1000", "ACT_LVL_P"),
        ("param set ACT_LVL_P x", "\"x\" is no number"),
        ("param set ACT_LVL_P nan", "\"nan\" is no number"),
        ("param set SYS_AUTOSTART 5", "SYS_AUTOSTART"),
        ("param set NOPE 5", "there is no parameter NOPE"),
    ] {
        let text = output(&mut world, line);
        assert!(text.starts_with("ERROR: ") && text.contains(reason), "{line}: {text}");
    }
    assert_eq!(*world.ground.parameters(), flight_management::parameters::Parameters::default());
    assert!(values(&world).is_empty());
}

#[test]
fn references_are_commanded_and_the_aircraft_reports_what_is_wrong() {
    let mut world = World::flying();
    let (commands, text) = commands(&mut world, "reference altitude 5200m");
    assert_eq!(commands, [Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(5_200.0)))]);
    assert_eq!(text, "Reference altitude: 5200 m\n");
    assert_eq!(output(&mut world, "reference airspeed 270"), "Reference airspeed: 270 m/s\n");
    assert_eq!(output(&mut world, "reference course 90deg"), "Reference course: 90 deg\n");
    assert!(output(&mut world, "status").contains("altitude 5200.0 m, true airspeed 270.0 m/s"));
    for (line, reason) in [
        ("reference altitude 99999", "ERROR: altitude"),
        ("reference airspeed x", "ERROR: airspeed \"x\" is no number in m/s"),
        ("reference roll 70", "ERROR: roll 70.0 deg is outside"),
        ("reference course 400", "ERROR: course 400 deg is outside"),
        ("reference yaw 4", "ERROR: usage: reference"),
        ("reference", "ERROR: usage: reference"),
    ] {
        let text = output(&mut world, line);
        assert!(text.starts_with(reason), "{line}: {text}");
    }
}

#[test]
fn a_change_of_mode_takes_the_checks_of_the_command_and_gives_control() {
    let mut world = World::flying();
    assert!(output(&mut world, "mode").contains("* Position\n  Hold\n"));
    let (commands, text) = commands(&mut world, "mode hold");
    assert_eq!(
        (commands, text),
        (vec![Command::Vehicle(VehicleCommand::Mode(Mode::Hold))], "Mode Hold\n".to_owned())
    );
    assert!(output(&mut world, "status").contains("Control: system 255"));
    let offboard = output(&mut world, "mode offboard");
    assert!(offboard.starts_with("ERROR: Offboard refused: no setpoint"), "{offboard}");
    assert_eq!(output(&mut world, "mode mission"), "ERROR: there is no plan: upload one first\n");
    for gone in ["nope", "reference"] {
        let output = output(&mut world, &format!("mode {gone}"));
        assert!(
            output.starts_with(&format!("ERROR: there is no mode \"{gone}\": there are Position"))
        );
    }
    let mut world = World::waiting();
    world.settle();
    assert_eq!(
        run_line(&mut world, "mode hold"),
        format!("ERROR: no aircraft is connected\n{PROMPT}")
    );
}

#[test]
fn time_is_paused_stepped_and_sped_up() {
    let mut world = World::flying();
    for (line, pace, text) in [
        ("pause", Pace::Pause, "Simulation paused\n"),
        ("step", Pace::Step(1), "Simulation steps: 1\n"),
        ("step 50", Pace::Step(50), "Simulation steps: 50\n"),
        ("speed 2x", Pace::Speed(2.0), "Simulation speed: x2\n"),
        ("run", Pace::Run, "Simulation runs\n"),
    ] {
        assert_eq!(
            commands(&mut world, line),
            (vec![Command::Plant(PlantAction::Pace(pace))], text.to_owned())
        );
    }
    for line in ["step -1", "step 0", "step 999999999", "speed 0", "speed", "pause now"] {
        let text = output(&mut world, line);
        assert!(text.starts_with("ERROR: "), "{line}: {text}");
    }
    let text = output(&mut world, "speed 0");
    assert!(text.contains("0.0 x real time is outside 0.01 to 1000.0 x real time"), "{text}");
}

#[test]
fn a_failure_is_printed_when_the_plant_has_answered() {
    let mut world = World::flying();
    let (commands, text) = commands(&mut world, "failure servo stuck -i 5 -v 3deg");
    let [Command::Plant(PlantAction::Fault(FaultRequest::Inject { target, kind, .. }))] =
        commands[..]
    else {
        panic!("{commands:?}")
    };
    assert_eq!(target, tvc_jet::RUDDER.into());
    let FaultKind::StuckAt { angle_rad, .. } = kind else { panic!("{kind:?}") };
    assert!((angle_rad.to_degrees() - 3.0).abs() < 1.0e-6, "{angle_rad} rad");
    assert!(text.starts_with("rudder: acts since"), "{text}");
    let list = output(&mut world, "list");
    assert!(list.contains("servo 5 (rudder) stuck at 3.0 deg"), "{list}");
    assert_eq!(output(&mut world, "failure list"), list);
    assert!(
        output(&mut world, "failure servo wrong -m 3 -v 40% -t 99s")
            .contains("right aileron: acts at")
    );
    assert!(output(&mut world, "failure servo ok -i 5").starts_with("rudder: healthy since"));
    assert!(output(&mut world, "failure clear").starts_with("healthy since"));
}

#[test]
fn faults_are_injected_and_cleared_in_the_words_of_scripts() {
    let mut world = World::flying();
    // Words are complete: no parameter adds to them.
    for (parameter, value) in [("FLT_RAMP_S", "5"), ("FLT_DUR_S", "9")] {
        output(&mut world, &format!("param set {parameter} {value}"));
    }
    let line = "fail Left elevator  stuck at -12.5 deg, ramp 2 s, for 10 s, every 20 s, 3 times";
    let (commands, text) = commands(&mut world, line);
    let [Command::Plant(PlantAction::Fault(FaultRequest::Inject { target, kind, timing }))] =
        commands[..]
    else {
        panic!("{commands:?} {text}")
    };
    assert_eq!(target, tvc_jet::LEFT_ELEVATOR.into());
    assert_eq!(timing.onset, Onset::AtOnce);
    assert_eq!((timing.ramp_s, timing.duration_s), (2.0, Some(10.0)));
    assert_eq!(timing.repeat, Some(Repeat { every_s: 20.0, times: Some(3) }));
    let FaultKind::StuckAt { angle_rad, .. } = kind else { panic!("{kind:?}") };
    assert!((angle_rad.to_degrees() + 12.5).abs() < 1.0e-9, "{angle_rad} rad");
    assert!(text.starts_with("left elevator: acts since"), "{text}");
    let text = output(&mut world, "clear left elevator");
    assert!(text.starts_with("left elevator: healthy since") && text.lines().count() == 1);
    for line in ["clear left elevator", "clear all"] {
        assert_eq!(output(&mut world, line), "no active fault\n", "{line}");
    }
    for line in ["fail servo 5 50 % left", "fail gnss off, for 10 s", "fail fin torn off by 20 %"] {
        assert!(output(&mut world, line).contains(": acts since"), "{line}");
    }
    assert!(output(&mut world, "clear all").starts_with("healthy since"));
}

#[test]
fn words_that_are_no_fault_for_now_are_refused_with_what_is_expected() {
    let mut world = World::flying();
    for (line, reason) in [
        ("fail", "end of the line found, expected an effector: left aileron, "),
        ("fail flap stuck", "shell, line 1, column 6: `flap` found, expected an effector: "),
        ("fail rudder wobbles", "`wobbles` found, expected a kind of fault: stuck"),
        ("fail rudder flame-out", "only for the engine"),
        ("fail rudder stuck at 3 kN", "`kN` found, expected the unit deg"),
        ("fail rudder stuck, for ever", "`ever` found, expected a number (duration)"),
        ("fail left elevator stuck at 70 deg", "left elevator: angle 70 deg is outside -30 to 30"),
        ("fail at 3 s: rudder stuck", "fail acts at once; for triggers there are scripts, for an"),
        ("clear", "expected `all` or an effector: "),
        ("clear flap", "`flap` found, expected `all` or an effector: "),
        ("clear rudder stuck", "`stuck` found, expected the end of the line"),
        ("clear after 3 s: rudder", "clear acts at once; for triggers there are scripts"),
    ] {
        let (commands, text) = commands(&mut world, line);
        assert!(text.starts_with("ERROR: ") && text.contains(reason), "{line}: {text}");
        assert_eq!(commands, [], "{line}");
    }
    world.plant = PlantManner::Answers(FaultReply::Refused(Refusal::FlightOver));
    let text = output(&mut world, "fail rudder stuck");
    assert!(text.starts_with("ERROR: rudder: "), "{text}");
}

#[test]
fn no_words_inject_or_clear_a_fault_while_fault_injection_is_off() {
    let mut world = World::flying();
    output(&mut world, "param set SYS_FAILURE_EN 0");
    for line in ["fail rudder stuck", "clear rudder", "clear all", "failure clear"] {
        let (commands, text) = commands(&mut world, line);
        assert_eq!(text, "ERROR: Fault refused: fault injection is off (SYS_FAILURE_EN 0)\n");
        assert_eq!(commands, [], "{line}");
    }
}

#[test]
fn clearing_a_healthy_effector_prints_nothing_to_mend() {
    let mut world = World::flying();
    assert_eq!(output(&mut world, "failure clear"), "no active fault\n");
    assert_eq!(output(&mut world, "failure servo ok"), "no active fault\n");
    output(&mut world, "failure servo stuck -i 5");
    let text = output(&mut world, "failure servo ok");
    assert!(text.starts_with("rudder: healthy since") && text.lines().count() == 1, "{text}");
    output(&mut world, "failure servo stuck -i 5 -t 99s");
    let text = output(&mut world, "failure servo ok");
    assert!(text.starts_with("rudder: healthy since") && text.lines().count() == 1, "{text}");
}

#[test]
fn every_type_takes_its_size_and_every_option_its_place() {
    let mut world = World::flying();
    let degrees = 1.0_f64.to_radians();
    for (line, expected) in [
        ("servo off -i 5", FaultKind::Float),
        ("servo stuck -i 5 -v here", FaultKind::StuckHere),
        ("servo loss -i 5 -v 40%", FaultKind::PartialLoss { remaining: 0.4 }),
        ("servo slow -i 5 -v 3deg/s", FaultKind::Slow { rate: 3.0 * degrees }),
        ("servo delayed -i 5 -v 200ms", FaultKind::Delayed { delay_s: 0.2 }),
        (
            "servo intermittent -i 5 -v 30% -p 2s",
            FaultKind::Intermittent { period_s: 2.0, present: 0.3 },
        ),
        (
            "servo garbage -i 5 -v 2deg -f 4Hz",
            FaultKind::Oscillating { amplitude: 2.0 * degrees, frequency_hz: 4.0 },
        ),
        ("servo drift -i 5 -v -1deg/s", FaultKind::Drifting { rate: -degrees }),
        ("servo wrong -i 5 -v 4deg", FaultKind::Biased { bias: 4.0 * degrees }),
        ("servo wrong -i 5 -v -", FaultKind::HardOver { side: Side::Negative }),
        ("servo limit -i 5 -v 6deg", FaultKind::LimitedTravel { limit: 6.0 * degrees }),
        ("motor limit -v 20kN", FaultKind::LimitedTravel { limit: 20_000.0 }),
        ("motor slow -v 2kN/s", FaultKind::Slow { rate: 2_000.0 }),
        ("motor flameout", FaultKind::FlameOut),
    ] {
        let (commands, text) = commands(&mut world, &format!("failure {line}"));
        let [Command::Plant(PlantAction::Fault(FaultRequest::Inject { kind, .. }))] = commands[..]
        else {
            panic!("{line}: {commands:?} {text}")
        };
        let close = kind.values().into_iter().zip(expected.values());
        assert_eq!(kind.code(), expected.code(), "{line}: {kind:?}");
        for (got, expected) in close {
            assert!((got - expected).abs() <= 1.0e-9 * expected.abs(), "{line}: {kind:?}");
        }
    }
    let line = "failure servo bias -m 5 -v 1deg -t 99.5s -r 1s -d 5s -e 10s -n 3";
    let (commands, text) = commands(&mut world, line);
    let named: Vec<_> = commands
        .iter()
        .map(|command| {
            let Command::Plant(PlantAction::Fault(FaultRequest::Inject { target, timing, .. })) =
                command
            else {
                panic!("{command:?}")
            };
            assert_eq!(timing.onset, Onset::At(SimTime::from_seconds(99.5).unwrap()));
            assert_eq!((timing.ramp_s, timing.duration_s), (1.0, Some(5.0)));
            assert_eq!(timing.repeat, Some(Repeat { every_s: 10.0, times: Some(3) }));
            target.effector().unwrap()
        })
        .collect();
    assert_eq!(named, [tvc_jet::LEFT_AILERON, tvc_jet::LEFT_ELEVATOR]);
    assert_eq!(text.lines().count(), 2, "{text}");
}

#[test]
fn failures_that_cannot_be_are_refused_with_the_reason() {
    let mut world = World::flying();
    for (line, reason) in [
        ("failure", "usage: failure"),
        ("failure gps float", "this sensor has no such fault"),
        ("failure gps wrong -v 5deg", "no value \"5deg\""),
        ("failure optical_flow off", "OPTICAL_FLOW (5)"),
        // A zero that is written is a number, and one that a parameter has means that there is none.
        ("failure servo off -i 4 -d 0s", "duration 0 s is outside"),
        ("failure servo off -i 4 -d 1s -e 0s", "0 s is outside"),
        ("failure servo off -i 4 -d 5s -e 20s -n 1", "repetitions 1 times is outside 2 to 1000"),
        ("failure servo melted", "there is no type melted: there are ok off stuck"),
        ("failure wing off", "there is no component wing: there are gyro accel"),
        ("failure gyro slow", "this sensor has no such fault"),
        ("failure servo ok -i 5 -v 3deg", "ok"),
        ("failure servo limit -v 20kN", "20kN"),
        ("failure servo stuck -i 5 -m 1", "twice"),
        ("failure servo hardover -v 5", "takes +, -, 1 or -1, not \"5\""),
        ("failure servo hardover -v -0", "takes +, -, 1 or -1, not \"-0\""),
        ("failure servo stuck -i 9", "instance 9"),
        ("failure servo stuck -i x", "-i \"x\""),
        ("failure servo stuck -i", "option -i has no value"),
        ("failure servo stuck -z 1", "no option -z"),
        ("failure servo stuck -i 5 -v 99deg", "99"),
        ("failure servo stuck -i 5 -v soft", "soft"),
    ] {
        let (commands, text) = commands(&mut world, line);
        assert!(text.starts_with("ERROR: ") && text.contains(reason), "{line}: {text}");
        assert_eq!(commands, [], "{line}");
    }
    world.plant = PlantManner::Answers(FaultReply::Refused(Refusal::FlightOver));
    let text = output(&mut world, "failure servo stuck -i 5");
    assert!(text.starts_with("ERROR: rudder: "), "{text}");
}

#[test]
fn a_silent_plant_is_reported_after_three_seconds_and_lines_wait_meanwhile() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    let text = run_line(&mut world, "failure servo stuck -i 5\nhelp step");
    assert_eq!(text, "", "neither an answer nor a prompt before the outcome");
    world.run_ms(2_600);
    assert_eq!(take(&mut world, address(14_550), STATION), "");
    world.run_ms(300);
    let text = take(&mut world, address(14_550), STATION);
    let expected =
        format!("ERROR: rudder: the aircraft does not answer\n{PROMPT}help step\nrun for");
    assert!(text.starts_with(&expected), "{text}");
}
