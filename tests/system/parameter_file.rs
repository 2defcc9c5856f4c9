//! A value set by a ground station persists over a restart, however the autopilot ended.

use crate::ground;
use crate::programs;

use std::fs;

use ground::Ground;
use mavlink::dialects::common::{
    MavCmd, MavMessage, MavMissionResult, MavParamType, MavResult, PARAM_SET_DATA,
};
use programs::{Program, autopilot};

fn set(ground: &mut Ground, name: &str, param_value: f32) {
    ground.send(&MavMessage::PARAM_SET(PARAM_SET_DATA {
        param_value,
        target_system: 1,
        target_component: 1,
        param_id: name.into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    }));
}

fn save(ground: &mut Ground) -> MavResult {
    ground.command(MavCmd::MAV_CMD_PREFLIGHT_STORAGE, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}

#[test]
fn parameters_survive_a_kill_and_an_ordinary_end() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("deeper/parameters.toml");
    let option = ["--parameter-file", path.to_str().expect("a readable path")];

    let mut ground = Ground::new();
    let (mut first, _) = autopilot(ground.address(), &option);
    ground.listen_until("the vehicle", |ground| ground.heartbeats > 0);
    set(&mut ground, "OBS_W0", 41.0);
    assert_eq!(save(&mut ground), MavResult::MAV_RESULT_ACCEPTED);
    first.signal(9);
    first.end();
    let text = fs::read_to_string(&path).expect("acknowledged, so it is on the disk");
    assert!(text.contains("OBS_W0 = 41"), "{text}");

    let mut ground = Ground::new();
    let (mut second, _) = autopilot(ground.address(), &option);
    ground.listen_until("the vehicle", |ground| ground.heartbeats > 0);
    set(&mut ground, "NAV_LOITER_RAD", 8_000.0);
    // An answer to a later message: the value has arrived, and half a second has not passed.
    ground.command(MavCmd::MAV_CMD_REQUEST_MESSAGE, [148.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    second.signal(15);
    assert_eq!(second.end(), Some(0));
    assert!(second.printed().contains("1 saved value from"), "{}", second.printed());

    let mut ground = Ground::new();
    let (third, _) = autopilot(ground.address(), &[option[0], option[1], "--param", "OBS_W0=60"]);
    ground.listen_until("the vehicle", |ground| ground.heartbeats > 0);
    assert_eq!(save(&mut ground), MavResult::MAV_RESULT_ACCEPTED);
    assert!(third.printed().contains("NAV_LOITER_RAD = 8000, OBS_W0 = 41"), "{}", third.printed());
    let text = fs::read_to_string(&path).expect("it is still there");
    assert!(text.contains("OBS_W0 = 41"), "the command line is not saved: {text}");
}

#[test]
fn an_uploaded_plan_is_offered_again_after_a_kill() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("parameters.toml");
    let option = ["--parameter-file", path.to_str().expect("a readable path")];
    let plan = folder.path().join("parameters.plan.toml");

    let mut ground = Ground::new();
    let (mut first, _) = autopilot(ground.address(), &option);
    ground.listen_until("the vehicle", |ground| ground.heartbeats > 0);
    assert_eq!(ground.plan_items(), 0);
    let waypoints =
        [(351_704_000, -1_179_000_000, 5_500.0), (349_000_000, -1_179_000_000, 5_000.0)];
    assert_eq!(ground.upload(&waypoints), MavMissionResult::MAV_MISSION_ACCEPTED);
    ground.listen_until("the file", |_| plan.exists());
    first.signal(9);
    first.end();

    let mut ground = Ground::new();
    let (mut second, _) = autopilot(ground.address(), &option);
    ground.listen_until("the plan", |ground| ground.has_text("Mission of the last run: 2 items"));
    assert_eq!(ground.plan_items(), 2);
    second.signal(15);
    assert_eq!(second.end(), Some(0));
    assert!(second.printed().contains("plan: 2 saved items from"), "{}", second.printed());

    let damaged = fs::read_to_string(&plan).expect("it is there").replace("count = 2", "count = 3");
    fs::write(&plan, &damaged).expect("the folder is there");
    for program in ["autopilot", "sitl"] {
        let mut program = Program::start(program, &[option[0], option[1], "--no-gcs"]);
        program.wait_for("count = 3, but there are 2 items");
        assert_eq!(program.end(), Some(1));
        assert_eq!(fs::read_to_string(&plan).expect("still there"), damaged);
    }
}

#[test]
fn a_damaged_file_stops_the_start_and_stays_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("parameters.toml");
    let damaged = "OBS_W0 = 40\nREF_ROLL_MAX = 500\n";
    fs::write(&path, damaged).expect("the folder is there");
    let file = path.to_str().expect("a readable path");
    for program in ["autopilot", "sitl"] {
        let mut program = Program::start(program, &["--parameter-file", file, "--no-gcs"]);
        program.wait_for("REF_ROLL_MAX = 500 is outside 1 to 80 deg");
        assert!(program.printed().contains(file), "{}", program.printed());
        assert_eq!(program.end(), Some(1));
        assert_eq!(fs::read_to_string(&path).expect("still there"), damaged);
    }
}
