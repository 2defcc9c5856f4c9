//! Rules for every command: one final acknowledgement for each copy, and only finite values
//! reach the aircraft.

use super::world::*;
use crate::codec::OWN;
use crate::command;
use crate::param;
use ::mavlink::dialects::common::MavResult;
use flight_management::command::Command;
use proptest::prelude::*;

const NAN: f32 = f32::NAN;

/// Parameters with which a command has an effect.
const PLAUSIBLE: [(u16, [f32; 7]); 37] = [
    (17, [0.0, 0.0, 9_000.0, NAN, 34.95, -117.85, 6_000.0]),
    (20, [0.0; 7]),
    (21, [0.0; 7]),
    (22, [NAN; 7]),
    (31, [0.0, 9_000.0, 0.0, 0.0, 34.95, -117.85, 6_000.0]),
    (34, [9_000.0, 250.0, 0.0, 0.0, 34.95, -117.85, 6_000.0]),
    (176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]),
    (178, [0.0, 250.0, -1.0, 0.0, 0.0, 0.0, 0.0]),
    (179, [0.0, 0.0, 0.0, 0.0, 34.95, -117.85, 0.0]),
    (185, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (189, [0.0; 7]),
    (191, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (192, [-1.0, 1.0, 9_000.0, 1.0, 34.95, -117.85, 6_000.0]),
    (193, [0.0; 7]),
    (207, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (224, [0.0; 7]),
    (241, [0.0; 7]),
    (245, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (246, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (262, [5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (300, [0.0; 7]),
    (400, [0.0, 21_196.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (401, [0.0; 7]),
    (410, [0.0; 7]),
    (420, [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
    (510, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (511, [30.0, 50_000.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (512, [148.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (519, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (520, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (31_010, [102.0, 2.0, 3.0, 1.0, 20.0, 0.0, 5.0]),
    (31_011, [3.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (31_012, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    (43_000, [0.0, 250.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
    (43_001, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 6_000.0]),
    (43_002, [0.0, 90.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
];

/// Every number of a command that reaches the laws or the plant.
fn is_finite(command: &Command) -> bool {
    let text = format!("{command:?}");
    !text.contains("NaN") && !text.contains("inf")
}

fn as_command_int(command: u16, params: [f32; 7]) -> Vec<u8> {
    let [p1, p2, p3, p4, _, _, z] = params;
    command_int(command, 0, [p1, p2, p3, p4], [349_500_000, -1_178_500_000], z)
}

/// Number and name of each, those of the command service and the one of the parameter service.
fn understood() -> Vec<(u16, &'static str)> {
    let mut all: Vec<_> = command::known().collect();
    all.push((param::PREFLIGHT_STORAGE, "PREFLIGHT_STORAGE"));
    all.sort_unstable();
    all
}

#[test]
fn the_list_of_this_test_is_that_of_the_commands() {
    let ids: Vec<u16> = understood().into_iter().map(|(id, _)| id).collect();
    assert_eq!(ids, PLAUSIBLE.map(|(command, _)| command));
}

#[test]
fn the_documented_commands_are_those_that_are_understood() {
    let document = include_str!("../../../../docs/commands.md");
    let table = document.split_once("## Commands").unwrap().1;
    let table = table.split_once("\n## ").unwrap().0;
    for (id, name) in understood() {
        assert!(table.contains(&format!("| {name} | {id} |")), "{name} {id}");
    }
    let rows = table.lines().filter(|line| line.starts_with("| ")).count();
    assert_eq!(rows, understood().len() + 1, "one row each, and the head");
}

#[test]
fn every_command_gets_one_final_acknowledgement_in_both_forms_and_for_each_copy() {
    for (command, params) in PLAUSIBLE {
        for datagram in [command_long(command, params, OWN), as_command_int(command, params)] {
            let mut world = World::flying();
            for _ in 0..3 {
                // Not settled in between: two copies join the first while it is open.
                world.ground.handle_datagram(address(14_550), &datagram, world.now);
            }
            world.settle();
            let at_once = world.take_acks();
            assert_eq!(at_once.len(), 3, "{command}: {at_once:?}");
            assert_eq!(at_once, [at_once[0]; 3], "{command}: the same for each copy");
            assert_eq!(at_once[0].command, command);
            world.run_ms(4_000);
            assert_eq!(world.take_all_acks(), [], "{command}: nothing behind the final one");
        }
    }
}

#[test]
fn a_copy_that_comes_after_the_answer_is_answered_again_and_requests_the_same() {
    // The plant reports a repeated fault as unchanged; a step is always executed.
    for (command, params) in PLAUSIBLE {
        let mut world = World::flying();
        let mut answers = Vec::new();
        for _ in 0..3 {
            world.send_command(command, params);
            world.run_ms(500);
            answers.extend(world.take_acks());
        }
        assert_eq!(answers.len(), 3, "{command}: {answers:?}");
        let text: Vec<String> =
            world.take_commands().iter().map(|command| format!("{command:?}")).collect();
        assert!(text.windows(2).all(|pair| pair[0] == pair[1]), "{command}: {text:?}");
    }
}

#[test]
fn a_command_to_all_components_is_answered_and_one_to_another_is_not() {
    for (command, params) in PLAUSIBLE {
        let mut world = World::flying();
        for (system, component, answers) in [(1, 0, 1), (0, 0, 1), (1, 2, 0), (7, 1, 0)] {
            let target = crate::codec::Identity { system, component };
            world.send_bytes(address(14_550), &command_long(command, params, target));
            assert_eq!(world.take_acks().len(), answers, "{command} to {system}/{component}");
        }
    }
}

#[test]
fn a_value_that_is_not_finite_in_any_parameter_of_any_command_never_reaches_the_vehicle() {
    for (command, params) in PLAUSIBLE {
        for place in 0..7 {
            for bad in [NAN, f32::INFINITY, f32::NEG_INFINITY, -NAN, 3.0e38] {
                let mut world = World::flying();
                let mut params = params;
                params[place] = bad;
                world.send_command(command, params);
                world.send_bytes(address(14_550), &as_command_int(command, params));
                world.run_ms(4);
                assert_eq!(world.take_acks().len(), 2, "{command} p{} = {bad}", place + 1);
                for taken in world.take_commands() {
                    assert!(is_finite(&taken), "{command} p{} = {bad}: {taken:?}", place + 1);
                }
            }
        }
    }
}

#[test]
fn a_slow_command_is_reported_in_progress_and_then_answered_once_for_each_copy() {
    let progress = |command| ack(command, MavResult::MAV_RESULT_IN_PROGRESS);
    for (command, params) in PLAUSIBLE {
        if ![420, 31_010, 31_011].contains(&command) {
            continue;
        }
        let mut world = World::flying();
        world.plant = PlantManner::Silent;
        world.send_command(command, params);
        assert_eq!(world.take_all_acks(), [], "{command}: not at once");
        world.run_ms(600);
        assert_eq!(world.take_all_acks(), [progress(command)]);
        world.send_command(command, params);
        world.run_ms(1_000);
        let so_far = world.take_all_acks();
        assert!((1..=3).contains(&so_far.len()), "{so_far:?}");
        assert!(so_far.iter().all(|ack| *ack == progress(command)), "{so_far:?}");
        world.run_ms(2_000);
        let mut finals = world.take_all_acks();
        finals.retain(|ack| *ack != progress(command));
        assert_eq!(finals, [ack(command, MavResult::MAV_RESULT_TEMPORARILY_REJECTED); 2]);
        world.run_ms(4_000);
        assert_eq!(world.take_all_acks(), []);
    }
}

#[test]
fn a_command_in_progress_reports_unknown_progress() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    world.run_ms(600);
    let progress = world.got.iter().find(|got| got.id == 77).expect("an acknowledgement");
    assert_eq!(progress.payload[2..4], [5, 255], "result and progress");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn any_parameters_of_any_command_get_one_final_acknowledgement_and_finite_commands(
        known in 0..PLAUSIBLE.len(),
        any_command in any::<u16>(),
        is_known in any::<bool>(),
        is_int in any::<bool>(),
        frame in prop_oneof![any::<u8>(), 0_u8..7],
        params in any::<[f32; 7]>(),
        plausible in any::<[bool; 7]>(),
        xy in any::<[i32; 2]>(),
    ) {
        let mut world = World::waiting();
        world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
        world.step();
        world.got.clear();
        let (command, sound) = PLAUSIBLE[known];
        let command = if is_known { command } else { any_command };
        let params: [f32; 7] =
            core::array::from_fn(|i| if plausible[i] { sound[i] } else { params[i] });
        if is_int {
            let [p1, p2, p3, p4, _, _, z] = params;
            world.send_command_at(command, frame, [p1, p2, p3, p4], xy, z);
        } else {
            world.send_command(command, params);
        }
        world.step();
        let acks = world.take_all_acks();
        prop_assert_eq!(acks.len(), 1);
        prop_assert_eq!(acks[0].command, command);
        for command in world.take_commands() {
            prop_assert!(is_finite(&command), "{:?}", command);
        }
    }
}
