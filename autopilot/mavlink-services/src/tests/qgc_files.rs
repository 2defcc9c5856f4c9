//! The files for QGroundControl: their form by its own rules, and the commands that they send.

use super::mission::client::{self, ACCEPTED, Client, QGC};
use super::world::*;
use ::mavlink::dialects::common::{MISSION_ITEM_INT_DATA, MavCmd, MavFrame, MavResult};
use flight_management::command::Command;
use icd::FaultRequest;
use icd::fault::{PlantAction, Target};
use icd::tvc_jet;
use serde_json::Value;

const MAVLINK_ACTIONS: &str =
    include_str!("../../../../gcs-scripts/qgroundcontrol/MavlinkActions.json");
const CUSTOM_ACTIONS: &str =
    include_str!("../../../../gcs-scripts/qgroundcontrol/CustomActions.json");
const PLAN: &str = include_str!("../../../../gcs-scripts/qgroundcontrol/demo.plan");

/// Label, command and parameters of each action of a file, checked as QGroundControl checks them.
fn actions(text: &str, file_type: &str, required: &[&str]) -> Vec<(String, u16, [f32; 7])> {
    let file: Value = serde_json::from_str(text).unwrap();
    assert_eq!((&file["version"], &file["fileType"]), (&1.into(), &file_type.into()));
    let actions = file["actions"].as_array().unwrap().iter().map(|action| {
        let action = action.as_object().unwrap();
        for key in required {
            assert!(action.contains_key(*key), "{action:?} has no {key}");
        }
        for (key, value) in action {
            match key.as_str() {
                "label" | "description" => assert!(!value.as_str().unwrap().is_empty(), "{key}"),
                "mavCmd" | "compId" => assert!(value.is_u64(), "{key}"),
                _ => assert!(value.is_number(), "{key}: QGroundControl takes numbers only"),
            }
            let is_param = (1..=7).any(|number| *key == format!("param{number}"));
            assert!(is_param || ["label", "description", "mavCmd", "compId"].contains(&&key[..]));
        }
        assert_eq!(action.get("compId").and_then(Value::as_u64), Some(1));
        // Parameters not given are sent as zero.
        let param = |index: usize| {
            action.get(&format!("param{}", index + 1)).and_then(Value::as_f64).unwrap_or(0.0) as f32
        };
        let command = action["mavCmd"].as_u64().unwrap().try_into().unwrap();
        (action["label"].as_str().unwrap().to_owned(), command, core::array::from_fn(param))
    });
    actions.collect()
}

#[test]
fn every_action_is_accepted_and_both_files_have_the_same() {
    let newer = actions(MAVLINK_ACTIONS, "MavlinkActions", &["label", "description", "mavCmd"]);
    assert_eq!(newer, actions(CUSTOM_ACTIONS, "CustomActions", &["label", "mavCmd"]));
    // A station shows them three at a time, without a request: the most used come first, and they are few.
    assert!(newer.len() <= 6, "{} actions", newer.len());
    let first: Vec<&str> = newer.iter().take(3).map(|(label, ..)| label.as_str()).collect();
    assert_eq!(first, ["Left elevator at 30 deg", "Rudder at 7 deg", "Everything OK"]);
    for (label, command, params) in &newer {
        let mut world = World::flying();
        world.send_command(*command, *params);
        world.run_ms(10);
        let accepted = ack(*command, MavResult::MAV_RESULT_ACCEPTED);
        assert_eq!(world.take_acks(), [accepted], "{label}: {:?}", world.texts());
        let same = newer.iter().filter(|other| other.0 == *label || other.1 == *command);
        let same = same.filter(|other| other.0 == *label || other.2 == *params).count();
        assert_eq!(same, 1, "{label} is there twice");
    }
}

#[test]
fn everything_ok_mends_every_effector() {
    let newer = actions(MAVLINK_ACTIONS, "MavlinkActions", &["label", "description", "mavCmd"]);
    let (_, command, params) = newer.iter().find(|(label, ..)| label == "Everything OK").unwrap();
    let mut world = World::flying();
    world.send_command(*command, *params);
    world.run_ms(10);
    let mended: Vec<Target> = world
        .take_commands()
        .iter()
        .filter_map(|command| match command {
            Command::Plant(PlantAction::Fault(FaultRequest::Clear { target })) => Some(*target),
            _ => None,
        })
        .collect();
    assert_eq!(mended, Target::all(&tvc_jet::effectors()).collect::<Vec<_>>());
}

#[test]
fn everything_is_only_mended_and_only_by_the_own_command() {
    let unsupported = MavResult::MAV_RESULT_UNSUPPORTED;
    let denied = MavResult::MAV_RESULT_DENIED;
    for (command, params, result) in [
        (420, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], unsupported),
        (31010, [-1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], denied),
        (31010, [-1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0], denied),
    ] {
        let mut world = World::flying();
        world.send_command(command, params);
        world.run_ms(10);
        assert_eq!(world.take_acks(), [ack(command, result)], "{:?}", world.texts());
        assert!(world.take_commands().is_empty());
    }
}

/// Seconds that QGroundControl adds up for a plane: each leg by the speed that was set before it, at first its setting of
/// 15 m/s, and delays (MissionController.cc, `_recalcMissionFlightStatus`). A return would be counted by its metres up to
/// 4.4, and with a descent of 1 m/s in 5.0.
fn time_shown_s(items: &[Value]) -> f64 {
    const EARTH_M: f64 = 6_371_000.0;
    let (mut speed, mut sum) = (15.0, 0.0);
    let mut last: Option<[f64; 2]> = None;
    for item in items {
        let param = |index: usize| item["params"][index].as_f64().unwrap_or(f64::NAN);
        match item["command"].as_u64().unwrap() {
            178 => speed = param(1),
            93 => sum += param(0),
            20 => panic!("a return is not counted by its time"),
            _ => {
                let here = [param(4), param(5)].map(f64::to_radians);
                if let Some([latitude, longitude]) = last {
                    let north: f64 = here[0] - latitude;
                    let east = (here[1] - longitude) * latitude.cos();
                    sum += EARTH_M * north.hypot(east) / speed;
                }
                last = Some(here);
            }
        }
    }
    sum
}

#[test]
fn the_time_that_qgroundcontrol_shows_for_the_plan_is_the_one_at_calibrated_airspeed() {
    let file: Value = serde_json::from_str(PLAN).unwrap();
    let shown_min = time_shown_s(file["mission"]["items"].as_array().unwrap()) / 60.0;
    // The plan flies for 19 minutes, 2 of them before its first point, which are not counted; it is counted with the calibrated
    // airspeed as a speed over the ground, which is a fifth less.
    assert!((20.0..22.0).contains(&shown_min), "{shown_min} min");
}

fn plan_item(seq: u16, item: &Value) -> MISSION_ITEM_INT_DATA {
    assert_eq!((&item["type"], &item["autoContinue"]), (&"SimpleItem".into(), &true.into()));
    assert_eq!(item["doJumpId"].as_u64(), Some(u64::from(seq) + 1));
    let command = match item["command"].as_u64().unwrap() {
        16 => MavCmd::MAV_CMD_NAV_WAYPOINT,
        17 => MavCmd::MAV_CMD_NAV_LOITER_UNLIM,
        93 => MavCmd::MAV_CMD_NAV_DELAY,
        178 => MavCmd::MAV_CMD_DO_CHANGE_SPEED,
        other => panic!("command {other}"),
    };
    let frame = match item["frame"].as_u64().unwrap() {
        0 => MavFrame::MAV_FRAME_GLOBAL,
        2 => MavFrame::MAV_FRAME_MISSION,
        other => panic!("frame {other}"),
    };
    let params = item["params"].as_array().unwrap();
    assert_eq!(params.len(), 7);
    // QGroundControl writes NaN as null.
    let number = |index: usize| params[index].as_f64().unwrap_or(f64::NAN);
    let param = |index: usize| number(index) as f32;
    let [x, y] = if frame == MavFrame::MAV_FRAME_GLOBAL {
        assert_eq!(item["AltitudeMode"], 2, "absolute");
        assert_eq!(item["Altitude"].as_f64(), Some(number(6)));
        [number(4), number(5)].map(|degrees| (degrees * 1.0e7).round() as i32)
    } else {
        [0, 0]
    };
    let first = client::item(seq, command, core::array::from_fn(param));
    MISSION_ITEM_INT_DATA { frame, x, y, z: param(6), ..first }
}

#[test]
fn every_item_of_the_plan_is_taken_and_none_is_flown_in_another_way() {
    let file: Value = serde_json::from_str(PLAN).unwrap();
    assert_eq!((&file["fileType"], &file["version"]), (&"Plan".into(), &1.into()));
    for (key, list) in
        [("geoFence", "circles"), ("geoFence", "polygons"), ("rallyPoints", "points")]
    {
        assert_eq!(file[key]["version"], 2);
        assert_eq!(file[key][list].as_array().map(Vec::len), Some(0), "{key}");
    }
    let mission = &file["mission"];
    assert_eq!((&mission["version"], &mission["firmwareType"]), (&2.into(), &12.into()));
    assert_eq!((&mission["vehicleType"], &mission["hoverSpeed"]), (&1.into(), &5.into()));
    let items = (0..).zip(mission["items"].as_array().unwrap());
    let items: Vec<_> = items.map(|(seq, item)| plan_item(seq, item)).collect();
    let mut client = Client::new(QGC);
    let (result, _) = client.upload(&items).unwrap();
    assert_eq!(result, ACCEPTED, "{:?}", client.world.texts());
    assert_eq!(
        client.world.texts(),
        ["Mission loaded: 10 items"],
        "nothing is flown in another way"
    );
    client.world.got.clear();
    client.world.send_command(300, [0.0; 7]);
    client.world.run_ms(10);
    let accepted = ack(300, MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(client.world.take_acks(), [accepted]);
}
