//! The table as a whole: each row can be requested, and is documented.

use std::collections::BTreeSet;

use ::mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, AVAILABLE_MODES_DATA, DEBUG_FLOAT_ARRAY_DATA, MavMessage,
    MavProtocolCapability as Capability, MavResult, NAMED_VALUE_FLOAT_DATA,
};
use ::mavlink::{MavlinkVersion, Message as _};

use icd::Body;
use icd::tvc_jet;

use super::group_size;
use crate::modes;
use crate::telemetry::registry::{Rate, Row, TABLE};
use crate::tests::world::{Got, World, ack};
use flight_management::parameters::Parameters;

const DOCUMENT: &str = include_str!("../../../../../docs/mavlink.md");
const REQUEST_MESSAGE: u16 = 512;

fn request(world: &mut World, id: u32, param2: f32) -> u8 {
    world.got.clear();
    world.send_command(REQUEST_MESSAGE, [id as f32, param2, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let [ack] = world.take_acks()[..] else { panic!("not one acknowledgement") };
    ack.result
}

#[test]
fn no_message_is_in_the_table_twice() {
    let ids: BTreeSet<u32> = TABLE.iter().map(|row| row.id).collect();
    assert_eq!(ids.len(), TABLE.len());
}

#[test]
fn in_flight_every_message_of_the_table_can_be_requested_and_decoded() {
    let mut world = World::flying();
    world.run_ms(100);
    for row in &TABLE {
        let result = request(&mut world, row.id, 0.0);
        assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED as u8, "{}", row.name);
        let answers: Vec<&Got> = world.got.iter().filter(|got| got.id == row.id).collect();
        let expected = match row.name {
            "AVAILABLE_MODES" => usize::from(modes::COUNT),
            _ => group_size(row.id),
        };
        assert_eq!(answers.len(), expected, "{}", row.name);
        for answer in answers {
            let parsed = MavMessage::parse(MavlinkVersion::V2, row.id, &answer.payload).unwrap();
            assert_eq!(parsed.message_name(), row.name);
        }
    }
}

#[test]
fn without_a_flight_a_request_is_answered_or_rejected_for_now_and_never_unsupported() {
    let mut world = World::waiting();
    world.settle();
    let always = [0, 1, 245, 147, 2, 436, 437, 435, 148, 300];
    for row in &TABLE {
        let result = request(&mut world, row.id, 0.0);
        let expected = if always.contains(&row.id) || row.name.starts_with("COMPONENT_") {
            MavResult::MAV_RESULT_ACCEPTED
        } else {
            MavResult::MAV_RESULT_TEMPORARILY_REJECTED
        };
        assert_eq!(result, expected as u8, "{}", row.name);
    }
}

#[test]
fn messages_that_do_not_exist_are_unsupported_and_no_number_breaks_a_request() {
    let mut world = World::flying();
    // HIL_STATE_QUATERNION would be the truth, which the autopilot does not know.
    for id in [115, 65, 12_345] {
        assert_eq!(request(&mut world, id, 0.0), MavResult::MAV_RESULT_UNSUPPORTED as u8, "{id}");
    }
    for id in [f32::NAN, f32::INFINITY, -1.0, 0.5, 3.0e9] {
        world.send_command(REQUEST_MESSAGE, [id, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let acks = world.take_acks();
        assert_eq!(acks, [ack(REQUEST_MESSAGE, MavResult::MAV_RESULT_DENIED)], "{id}");
    }
}

#[test]
fn modes_are_listed_one_by_one_and_the_list_has_an_end() {
    let mut world = World::waiting();
    world.settle();
    for index in 1..=modes::COUNT {
        let result = request(&mut world, 435, f32::from(index));
        assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED as u8);
        let sent: Vec<AVAILABLE_MODES_DATA> = world.got.iter().filter_map(Got::read).collect();
        let [mode] = &sent[..] else { panic!("{} messages for one mode", sent.len()) };
        assert_eq!((mode.mode_index, mode.number_modes), (index, modes::COUNT));
    }
    let beyond = request(&mut world, 435, f32::from(modes::COUNT) + 1.0);
    assert_eq!(beyond, MavResult::MAV_RESULT_DENIED as u8);
}

#[test]
fn the_version_claims_what_exists_and_nothing_else() {
    let mut world = World::waiting();
    world.settle();
    request(&mut world, 148, 0.0);
    let version = world.got.iter().find_map(Got::read::<AUTOPILOT_VERSION_DATA>).unwrap();
    let claims = version.capabilities;
    for capability in [
        Capability::MAV_PROTOCOL_CAPABILITY_MISSION_INT,
        Capability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT,
        Capability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE,
        Capability::MAV_PROTOCOL_CAPABILITY_MISSION_FENCE,
        Capability::MAV_PROTOCOL_CAPABILITY_MISSION_RALLY,
        Capability::MAV_PROTOCOL_CAPABILITY_FTP,
        Capability::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION,
        Capability::MAV_PROTOCOL_CAPABILITY_MAVLINK2,
    ] {
        assert!(claims.contains(capability), "{capability:?}");
    }
    assert!(!claims.contains(Capability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST));
    assert_eq!(version.flight_sw_version.to_be_bytes(), [1, 17, 0, 0], "a development version");
    let own = version.middleware_sw_version.to_be_bytes();
    assert_eq!(format!("{}.{}.{}", own[0], own[1], own[2]), env!("CARGO_PKG_VERSION"));
}

fn rate_text(row: &Row) -> String {
    let streams = Parameters::default().streams;
    let parameter = match row.rate {
        // It has its own clock.
        Rate::Answer if row.name == "HEARTBEAT" => return "1 Hz".into(),
        Rate::OnRequest | Rate::Answer => return "on request".into(),
        Rate::EveryMs(ms) if ms > 1_000 => return format!("every {} s", f64::from(ms) / 1_000.0),
        Rate::EveryMs(_) => None,
        Rate::Attitude => Some("STR_ATT_HZ"),
        Rate::Position => Some("STR_POS_HZ"),
        Rate::Actuators => Some("STR_ACT_HZ"),
        Rate::Compensator => Some("STR_FTC_HZ"),
    };
    let hz = 1.0 / row.default_interval(&streams).unwrap().as_secs_f64();
    parameter.map_or(format!("{hz} Hz"), |parameter| format!("{hz} Hz (`{parameter}`)"))
}

#[test]
fn the_documented_table_is_this_table() {
    let section = DOCUMENT.split("\n## ").find(|section| section.starts_with("Telemetry"));
    let rows: Vec<Vec<&str>> = section
        .unwrap()
        .lines()
        .filter(|line| line.starts_with("| "))
        .skip(1)
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    let documented: Vec<String> = rows
        .iter()
        .map(|row| {
            let [name, id, rate, content] = row[..] else { panic!("not four cells: {row:?}") };
            assert!(!content.is_empty(), "{name} has no description");
            format!("{name} {id} {rate}")
        })
        .collect();
    let mut expected: Vec<String> =
        TABLE.iter().map(|row| format!("{} {} {}", row.name, row.id, rate_text(row))).collect();
    // It is made for each peer, so it has no row.
    expected.push("MESSAGE_INTERVAL 244 on request".into());
    assert_eq!(documented, expected);
}

fn first_cells(heading: &str) -> Vec<String> {
    let section =
        DOCUMENT.split("\n## ").find(|section| section.starts_with("What the controller"));
    let table = section.unwrap().split(heading).nth(1).unwrap();
    let rows = table.lines().skip(1).take_while(|line| line.starts_with("| "));
    rows.map(|line| line.split('|').nth(1).unwrap().trim().to_owned()).collect()
}

#[test]
fn the_documented_values_are_those_that_are_sent_and_in_this_order() {
    let mut world = World::flying();
    request(&mut world, 251, 0.0);
    let values = world.got.iter().filter_map(Got::read::<NAMED_VALUE_FLOAT_DATA>);
    let sent: Vec<String> = values.map(|value| value.name.to_str().unwrap().to_owned()).collect();
    let cells = first_cells("| name | unit | meaning | signal |\n").join(", ");
    let documented: Vec<&str> = cells.split(", ").map(|name| name.trim_matches('`')).collect();
    assert_eq!(sent, documented);
}

#[test]
fn the_array_why_has_its_documented_places() {
    let mut world = World::flying();
    // Something rolls the aircraft: 4 rad/s^2 for a quarter of a second.
    for tick in 0..125 {
        world.sensors.gyro.value = Body::new(4.0 * 0.002 * f64::from(tick), 0.0, 0.0);
        world.step();
    }
    world.got.clear();
    let log = world.autopilot.snapshot().unwrap().log;
    world.ground.handle_snapshot(&world.autopilot.snapshot().copied().unwrap(), world.now);
    assert_eq!(request(&mut world, 350, 1.0), MavResult::MAV_RESULT_ACCEPTED as u8);
    let mut arrays = world.got.iter().filter_map(Got::read::<DEBUG_FLOAT_ARRAY_DATA>);
    let array = arrays.next_back().unwrap();
    assert_eq!((array.name.to_str().unwrap(), array.array_id), ("WHY", 1));
    let data = array.data;
    let near = |index: usize, value: f64| {
        assert!((f64::from(data[index]) - value).abs() <= 1.0e-6 * value.abs(), "{index}: {value}");
    };
    for (index, effector) in tvc_jet::ALL.into_iter().enumerate() {
        near(index, log.commands[effector]);
        near(index + 8, log.modelled[effector]);
    }
    assert!(log.compensator_active && log.health.aileron_saturated, "{log:?}");
    // The yaw of the ailerons takes the nozzle too.
    assert_eq!(data[16..24], [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    for (axis, z2) in [log.z2.x, log.z2.y, log.z2.z].into_iter().enumerate() {
        near(24 + axis, z2);
    }
    near(27, log.levels.x);
    near(30, log.level);
    assert_eq!((data[31], data[32]), (1.0, 1.0));
    near(33, log.compensation.aileron_rad);
    near(36, log.applied_compensation.aileron_rad);
    assert_eq!(data[39], 0.0, "the ailerons are at their limit");
    near(41, log.authority.yaw_pct);
    for (index, effector) in tvc_jet::ALL.into_iter().enumerate() {
        near(index + 42, log.increments[effector]);
    }
    near(50, log.authority.negative_pct[0]);
    near(53, log.authority.positive_pct[0]);
    assert_eq!(data[50].min(data[53]), data[39], "roll, in the direction that has less");
    assert_eq!(data[56..], [0.0; 2], "no effector is named so soon");
    assert_eq!(first_cells("| index | unit | content |\n").last().unwrap(), "56, 57");
}

#[test]
fn named_values_keep_to_the_ten_characters_of_their_field() {
    let mut world = World::flying();
    request(&mut world, 251, 0.0);
    let values = world.got.iter().filter_map(Got::read::<NAMED_VALUE_FLOAT_DATA>);
    let mut count = 0;
    for value in values {
        assert!(value.name.to_str().unwrap().len() <= 10, "{value:?}");
        count += 1;
    }
    assert_eq!(count, 21);
}
