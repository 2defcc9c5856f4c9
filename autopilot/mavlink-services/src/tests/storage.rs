//! Saved parameters: the content of the file, and PREFLIGHT_STORAGE.

use super::params::{set_int, set_real};
use super::world::*;
use crate::param::{PREFLIGHT_STORAGE, Saved};
use ::mavlink::dialects::common::{MavResult, PARAM_VALUE_DATA};
use flight_management::command::Command;
use flight_management::command::Configuration;
use flight_management::parameters::{Parameters, from_text};

fn keeping() -> World {
    let mut world = World::flying();
    world.ground.keep_parameters(Parameters::default());
    world
}

/// Content of the file, if it were written again.
fn saved(world: &mut World) -> Option<Parameters> {
    let save = world.ground.pop_save()?;
    Some(from_text("file", &save.text, &Parameters::default()).unwrap())
}

fn storage(world: &mut World, action: f32) {
    world.send_command(PREFLIGHT_STORAGE, [action, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

/// The result of the disk: done, or failed.
fn finish(world: &mut World, number: u64, result: Result<(), &str>) {
    let result = result.map_err(str::to_owned);
    world.ground.handle_saved(&Saved { number, result });
    world.settle();
}

#[test]
fn a_changed_parameter_is_saved_and_a_repeated_value_is_not() {
    let mut world = keeping();
    assert_eq!(saved(&mut world), None);
    world.send(&set_real("OBS_W0", 40.0));
    world.send(&set_int("NAV_DLL_ACT", 1));
    let expected = *world.ground.parameters();
    assert_eq!(saved(&mut world), Some(expected), "one text has both");
    world.send(&set_real("OBS_W0", 40.0));
    world.send(&set_real("OBS_W0", -1.0));
    assert_eq!(saved(&mut world), None);
}

#[test]
fn without_a_parameter_file_nothing_is_saved() {
    let mut world = World::flying();
    world.send(&set_real("OBS_W0", 40.0));
    assert_eq!(saved(&mut world), None);
    storage(&mut world, 1.0);
    let unsupported = ack(PREFLIGHT_STORAGE, MavResult::MAV_RESULT_UNSUPPORTED);
    assert_eq!(world.take_acks(), [unsupported]);
    assert!(world.has_text("there is no parameter file"));
}

#[test]
fn parameters_set_on_the_command_line_are_not_saved() {
    let mut world = World::flying();
    world.send(&set_real("FW_AIRSPD_MAX", 400.0));
    // From here on as after a start with --param FW_AIRSPD_MAX=400.
    world.ground.keep_parameters(Parameters::default());
    world.send(&set_real("OBS_W0", 40.0));
    let file = saved(&mut world).unwrap();
    assert_eq!(file.limits.airspeed_max_m_s, 280.0);
    assert_eq!(file.gains.neso.bandwidth, 40.0);
    // Flies with the command line's limit; the file without it could not be used.
    world.send(&set_real("FW_AIRSPD_MIN", 350.0));
    assert_eq!(world.ground.parameters().limits.airspeed_min_m_s, 350.0);
    assert!(world.has_text("FW_AIRSPD_MIN set, but not saved"), "{:?}", world.texts());
    assert_eq!(saved(&mut world), None);
    // A client has set it, so it is saved after all.
    world.send(&set_real("FW_AIRSPD_MAX", 400.0));
    assert_eq!(saved(&mut world).unwrap().limits.airspeed_max_m_s, 400.0);
}

#[test]
fn save_now_is_acknowledged_when_it_is_on_the_disk_once_for_each_request() {
    let mut world = keeping();
    world.send(&set_real("OBS_W0", 40.0));
    let first = world.ground.pop_save().unwrap();
    storage(&mut world, 1.0);
    storage(&mut world, 1.0);
    assert_eq!(world.take_acks(), [], "not yet");
    let second = world.ground.pop_save().unwrap();
    assert!(second.at_once && second.number > first.number);
    finish(&mut world, first.number, Ok(()));
    assert_eq!(world.take_acks(), [], "an earlier text does not count");
    finish(&mut world, second.number, Ok(()));
    let accepted = ack(PREFLIGHT_STORAGE, MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(world.take_acks(), [accepted, accepted]);
}

#[test]
fn a_full_disk_and_its_end_are_reported_once_each() {
    let mut world = keeping();
    storage(&mut world, 1.0);
    let number = world.ground.pop_save().unwrap().number;
    finish(&mut world, number, Err("no space left"));
    let failed = ack(PREFLIGHT_STORAGE, MavResult::MAV_RESULT_FAILED);
    assert_eq!(world.take_acks(), [failed]);
    finish(&mut world, number + 1, Err("no space left"));
    world.run_ms(2_000);
    let warnings =
        world.texts().iter().filter(|text| text.contains("not saved: no space left")).count();
    assert_eq!(warnings, 1, "{:?}", world.texts());
    finish(&mut world, number + 2, Ok(()));
    world.run_ms(2_000);
    assert!(world.has_text("saved again"), "{:?}", world.texts());
}

#[test]
fn defaults_come_back_for_everybody_and_in_the_file() {
    let mut world = keeping();
    world.send(&set_real("OBS_W0", 40.0));
    world.send(&set_real("NAV_LOITER_RAD", 8_000.0));
    world.take_commands();
    world.got.clear();
    storage(&mut world, 2.0);
    assert_eq!(*world.ground.parameters(), Parameters::default());
    let commands = world.take_commands();
    assert!(
        matches!(
            &commands[..],
            [
                Command::Configuration(Configuration::Gains(_)),
                Command::Configuration(Configuration::Navigation(_))
            ]
        ),
        "{commands:?}"
    );
    let sent = world.got.iter().filter(|got| got.read::<PARAM_VALUE_DATA>().is_some()).count();
    assert_eq!(sent, 4, "two changes, two peers");
    let save = world.ground.pop_save().unwrap();
    assert_eq!(from_text("file", &save.text, &Parameters::default()), Ok(Parameters::default()));
    assert_eq!(world.take_acks(), []);
    finish(&mut world, save.number, Ok(()));
    let accepted = ack(PREFLIGHT_STORAGE, MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(world.take_acks(), [accepted]);
}

#[test]
fn reading_the_file_again_and_unknown_actions_are_refused_with_the_reason() {
    for action in [0.0, 3.0, 5.0, -1.0, f32::NAN] {
        let mut world = keeping();
        storage(&mut world, action);
        let unsupported = ack(PREFLIGHT_STORAGE, MavResult::MAV_RESULT_UNSUPPORTED);
        assert_eq!(world.take_acks(), [unsupported], "{action}");
        assert!(world.has_text("the file is read at start"), "{:?}", world.texts());
    }
}
