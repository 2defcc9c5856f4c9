use super::world::*;
use ::mavlink::dialects::common::{
    MavMessage, MavParamType, PARAM_ERROR_DATA, PARAM_REQUEST_LIST_DATA, PARAM_REQUEST_READ_DATA,
    PARAM_SET_DATA, PARAM_VALUE_DATA,
};
use flight_management::command::Command;
use flight_management::command::Configuration;
use flight_management::parameters::COMPATIBILITY;
use flight_management::parameters::{Kind, Parameters, table};
use flight_management::vehicle::LinkLossAction;
use icd::tvc_jet;

pub fn set_int(name: &str, value: i32) -> MavMessage {
    let value = f32::from_le_bytes(value.to_le_bytes());
    set(name, value, MavParamType::MAV_PARAM_TYPE_INT32)
}

pub fn set_real(name: &str, value: f32) -> MavMessage {
    set(name, value, MavParamType::MAV_PARAM_TYPE_REAL32)
}

fn set(name: &str, param_value: f32, param_type: MavParamType) -> MavMessage {
    let (target_system, target_component) = (1, 1);
    let param_id = name.into();
    MavMessage::PARAM_SET(PARAM_SET_DATA {
        param_value,
        target_system,
        target_component,
        param_id,
        param_type,
    })
}

fn request_list() -> MavMessage {
    MavMessage::PARAM_REQUEST_LIST(PARAM_REQUEST_LIST_DATA {
        target_system: 1,
        target_component: 0,
    })
}

fn read(name: &str, param_index: i16) -> MavMessage {
    MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
        param_index,
        target_system: 1,
        target_component: 1,
        param_id: name.into(),
    })
}

fn total() -> usize {
    table().len() + COMPATIBILITY.len() + icd::fault::Target::all(&tvc_jet::effectors()).count()
}

fn only_value(world: &mut World) -> PARAM_VALUE_DATA {
    let values = world.values(address(14_550));
    world.got.clear();
    assert_eq!(values.len(), 1, "{values:?}");
    values.into_iter().next().unwrap()
}

fn errors(world: &World) -> Vec<PARAM_ERROR_DATA> {
    world.got.iter().filter_map(Got::read).collect()
}

#[test]
fn the_list_is_complete_paced_and_for_the_requesting_peer_only() {
    let mut world = World::flying();
    world.send(&request_list());
    world.run_ms(1_000);
    let values = world.values(address(14_550));
    assert_eq!(values.len(), total());
    for (index, value) in values.iter().enumerate() {
        assert_eq!(usize::from(value.param_index), index);
        assert_eq!(usize::from(value.param_count), total());
    }
    assert!(world.values(address(14_540)).is_empty());
    let times: Vec<u64> =
        world.got.iter().filter(|got| got.id == 22).map(|got| got.at.as_micros()).collect();
    for (index, time) in times.iter().enumerate() {
        let within = times[..index].iter().filter(|earlier| time - **earlier < 100_000).count();
        assert!(within <= 50, "{within} parameters within 0.1 s");
    }
}

#[test]
fn a_repeated_request_starts_the_list_again_and_each_peer_has_one_list() {
    let mut world = World::flying();
    world.send(&request_list());
    world.run_ms(40);
    let so_far = world.values(address(14_550)).len();
    assert!((5..total()).contains(&so_far));
    for _ in 0..10 {
        world.send(&request_list());
    }
    world.run_ms(1_000);
    // Each restart may find one burst due.
    let sent = world.values(address(14_550)).len();
    assert!(sent >= so_far + total() && sent <= so_far + total() + 5 * 10, "{sent}");
    assert_eq!(usize::from(world.values(address(14_550)).last().unwrap().param_index), total() - 1);
}

#[test]
fn a_parameter_is_read_by_index_and_by_name_also_by_one_of_sixteen_characters() {
    let mut world = World::flying();
    world.send(&read("", 0));
    assert_eq!(only_value(&mut world).param_id.to_str().unwrap(), table()[0].name);
    world.send(&read("FW_AIRSPD_MAX", -1));
    assert_eq!(only_value(&mut world).param_value, 280.0);
    world.send(&read("SYS_HAS_NUM_ASPD", -1));
    assert_eq!(only_value(&mut world).param_id.to_str().unwrap(), "SYS_HAS_NUM_ASPD");
}

#[test]
fn reading_what_is_not_there_gives_an_error() {
    let mut world = World::flying();
    world.send(&read("NO_SUCH_THING", -1));
    world.send(&read("", 30_000));
    assert_eq!(errors(&world).len(), 2);
    assert!(world.values(address(14_550)).is_empty());
}

#[test]
fn integers_travel_byte_wise_and_reals_as_they_are() {
    let mut world = World::flying();
    world.send(&set_int("FTC_MODE", 2));
    let echo = only_value(&mut world);
    assert_eq!(echo.param_value.to_bits(), 2);
    assert_eq!(echo.param_type, MavParamType::MAV_PARAM_TYPE_INT32);
    world.send(&set_real("FTC_MODE", 0.0));
    assert_eq!(only_value(&mut world).param_value.to_bits(), 0, "a real zero is rounded");
    world.send(&set_real("FTC_MODE", 1.0));
    assert_eq!(only_value(&mut world).param_value.to_bits(), 1);
    world.send(&set("FTC_MODE", f32::from_bits(0xFFFF_FF02), MavParamType::MAV_PARAM_TYPE_UINT8));
    assert_eq!(only_value(&mut world).param_value.to_bits(), 2, "one byte counts");
}

#[test]
fn a_change_is_broadcast_and_reaches_the_laws() {
    let mut world = World::flying();
    world.send(&set_real("OBS_W0", 40.0));
    assert_eq!(world.values(address(14_540)).len(), 1);
    let commands = world.take_commands();
    let [Command::Configuration(Configuration::Gains(gains))] = &commands[..] else {
        panic!("{commands:?}")
    };
    assert_eq!(gains.neso.bandwidth, 40.0);
    world.send(&set_real("REF_ALT_MAX", 9_000.0));
    let commands = world.take_commands();
    let [Command::Configuration(Configuration::Limits(limits))] = &commands[..] else {
        panic!("{commands:?}")
    };
    assert_eq!(limits.altitude_max_m, 9_000.0);
    world.send(&set_real("FLT_LOE_PCT", 30.0));
    assert!(world.take_commands().is_empty(), "the control side does not need it");
}

#[test]
fn a_refused_write_echoes_the_old_value_with_the_reason() {
    for (message, words) in [
        (set_real("OBS_W0", -5.0), "OBS_W0 = -5 is outside 1 to 500 rad/s"),
        (set_real("OBS_W0", f32::NAN), "OBS_W0 = NaN is outside"),
        (set_real("OBS_W0", f32::INFINITY), "OBS_W0 = inf is outside"),
        (
            set_real("FW_AIRSPD_MIN", 400.0),
            "FW_AIRSPD_MIN = 400 m/s is above FW_AIRSPD_MAX = 280 m/s",
        ),
        (set_int("FTC_MODE", 7), "FTC_MODE = 7 is outside 0 to 2"),
        (set_int("SYS_AUTOSTART", 1), "read-only"),
        (set("OBS_W0", 1.0, MavParamType::MAV_PARAM_TYPE_REAL64), "type 10 is not supported"),
    ] {
        let mut world = World::flying();
        let before = *world.ground.parameters();
        world.send(&message);
        assert_eq!(*world.ground.parameters(), before);
        assert!(world.has_text(words), "{words}: {:?}", world.texts());
        assert_eq!(errors(&world).len(), 1);
        assert!(world.take_commands().is_empty());
        let echo = only_value(&mut world);
        let name = echo.param_id.to_str().unwrap().to_owned();
        if let Some(row) = table().iter().find(|row| row.name == name) {
            let old = row.value(&before);
            let sent = match row.kind {
                Kind::Int => f64::from(echo.param_value.to_bits()),
                Kind::Real => f64::from(echo.param_value),
            };
            // f32 on the wire.
            assert!((sent - old).abs() <= 1.0e-6 * old.abs(), "{name}: {sent} instead of {old}");
        }
    }
}

#[test]
fn a_slider_of_the_tuning_page_moves_a_gain_of_the_law_or_says_once_that_it_cannot() {
    let mut world = World::flying();
    world.send(&set_real("FW_RR_P", 0.5));
    assert_eq!(world.ground.parameters().gains.pid.roll.k_p, 0.5);
    let values: Vec<PARAM_VALUE_DATA> = world.got.iter().filter_map(Got::read).collect();
    for name in ["ROL_KP", "FW_RR_P"] {
        let is_it = |value: &&PARAM_VALUE_DATA| value.param_id.to_str().unwrap() == name;
        assert_eq!(values.iter().find(is_it).map(|value| value.param_value), Some(0.5), "{name}");
    }
    world.got.clear();
    for step in 0..6_u8 {
        world.send(&set_real("FW_RR_FF", f32::from(step)));
    }
    assert_eq!(world.texts().len(), 1, "{:?}", world.texts());
    assert_eq!(errors(&world).len(), 6, "each is answered");
}

#[test]
fn an_unknown_parameter_is_an_error() {
    let mut world = World::flying();
    world.send(&set_real("NO_SUCH_THING", 1.0));
    assert_eq!(errors(&world).len(), 1);
    assert!(world.take_commands().is_empty());
}

#[test]
fn sending_every_value_back_as_it_was_read_changes_no_bit() {
    let mut world = World::flying();
    world.send(&request_list());
    world.run_ms(1_000);
    let values = world.values(address(14_550));
    for value in values {
        let name = value.param_id.to_str().unwrap().to_owned();
        world.send(&set(&name, value.param_value, value.param_type));
    }
    assert_eq!(*world.ground.parameters(), Parameters::default());
    assert!(world.take_commands().is_empty());
    assert!(errors(&world).is_empty());
}

#[test]
fn a_default_that_was_changed_and_changed_back_is_exact_again() {
    let mut world = World::flying();
    for row in table().iter().filter(|row| row.kind == Kind::Real) {
        let before = row.value(world.ground.parameters());
        let other = 0.5 * (before + row.max);
        let other = crate::convert::float(other);
        world.send(&set_real(row.name, other));
        world.send(&set_real(row.name, crate::convert::float(before)));
        let after = row.value(world.ground.parameters());
        assert_eq!(after.to_bits(), before.to_bits(), "{}: {after} instead of {before}", row.name);
    }
}

#[test]
fn a_set_outside_lemma_1_is_accepted_with_a_warning_that_has_the_numbers() {
    let mut world = World::flying();
    world.send(&set_real("OBS_KB", 1.5));
    assert!(world.has_text("beta1^2 5625 <= 10000"), "{:?}", world.texts());
    assert_eq!(only_value(&mut world).param_value, 1.5);
}

#[test]
fn lists_of_several_peers_run_side_by_side_and_each_is_whole() {
    let mut world = World::flying();
    world.send(&request_list());
    world.run_ms(20);
    let bytes = world.encode(STATION, &request_list());
    world.send_bytes(address(14_540), &bytes);
    world.run_ms(1_000);
    for port in [14_550, 14_540] {
        let values = world.values(address(port));
        let indices: Vec<usize> = values.iter().map(|value| value.param_index.into()).collect();
        assert_eq!(indices, (0..total()).collect::<Vec<_>>(), "to {port}");
    }
}

#[test]
fn every_index_can_be_read_on_its_own() {
    let mut world = World::flying();
    for index in 0..total() {
        world.send(&read("", i16::try_from(index).unwrap()));
        assert_eq!(usize::from(only_value(&mut world).param_index), index);
    }
}

#[test]
fn a_change_of_the_guidance_reaches_the_vehicle() {
    let mut world = World::flying();
    world.send(&set_real("NAV_LOITER_RAD", 8_000.0));
    let commands = world.take_commands();
    let [Command::Configuration(Configuration::Navigation(navigation))] = &commands[..] else {
        panic!("{commands:?}")
    };
    assert_eq!(navigation.loiter_radius_m, 8_000.0);
    world.send(&set_int("NAV_DLL_ACT", 2));
    assert!(world.take_commands().is_empty(), "link loss is our own business");
    assert_eq!(world.ground.parameters().link.loss_action, LinkLossAction::Return);
}

#[test]
fn a_list_with_holes_is_filled_by_index() {
    let mut world = World::flying();
    for lost in 0..total() {
        world.got.clear();
        world.send(&request_list());
        world.run_ms(1_000);
        let mut have: Vec<usize> = world
            .values(address(14_550))
            .iter()
            .map(|value| value.param_index.into())
            .filter(|index| *index != lost)
            .collect();
        world.got.clear();
        world.send(&read("", i16::try_from(lost).unwrap()));
        have.push(only_value(&mut world).param_index.into());
        have.sort_unstable();
        assert_eq!(have, (0..total()).collect::<Vec<_>>(), "{lost} lost");
    }
}
