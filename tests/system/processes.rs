//! The two real programs over loopback, with commands and faults by MAVLink; killed and restarted.

use crate::ground;
use crate::programs;

use std::net::UdpSocket;

use ground::Ground;
use mavlink::dialects::common::{
    COMMAND_LONG_DATA, MISSION_ITEM_INT_DATA, MavCmd, MavMessage, MavMissionResult, MavResult,
};
use programs::{Program, TIMEOUT, autopilot, autopilot_with, free_port, listening_autopilot};

/// Simulation time per wall time; the ground station still sees every tenth of a second.
const SPEED: &str = "20";
/// MAV_CMD_USER_1: SERVO, STUCK, left elevator, angle, 30 deg, no ramp, at once.
const JAM_LEFT_ELEVATOR: [f32; 7] = [102.0, 2.0, 3.0, 1.0, 30.0, 0.0, 0.0];
/// Roll angle beyond which the aircraft counts as lost, deg.
const LOST_DEG: f64 = 90.0;

/// Climb commanded, left elevator jammed three seconds later, and the flight until 60 s after it.
fn climb_and_jam(ftc: &str) -> Ground {
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &["--ftc", ftc]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link, "--speed", SPEED]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    let climb = [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(
        ground.command(MavCmd::MAV_CMD_DO_CHANGE_ALTITUDE, climb),
        MavResult::MAV_RESULT_ACCEPTED
    );
    let start_s = ground.time_s;
    ground.listen_until("3 s of climb", |ground| ground.time_s > start_s + 3.0);
    assert_eq!(
        ground.command(MavCmd::MAV_CMD_USER_1, JAM_LEFT_ELEVATOR),
        MavResult::MAV_RESULT_ACCEPTED
    );
    let jam_s = ground.time_s;
    ground.listen_until("a minute, or the loss", |ground| {
        ground.time_s > jam_s + 60.0 || ground.roll_max_deg > LOST_DEG
    });
    ground
}

#[test]
fn with_the_compensator_the_jammed_elevator_is_survived() {
    let ground = climb_and_jam("armed");
    assert!(ground.roll_max_deg < 30.0, "largest roll {} deg", ground.roll_max_deg);
    assert!((ground.altitude_m - 6_000.0).abs() < 40.0, "altitude {} m", ground.altitude_m);
    assert!(ground.has_text("ompensator active"), "{:?}", ground.texts);
    assert!(ground.has_text("Injected"), "{:?}", ground.texts);
}

#[test]
fn without_the_compensator_the_jammed_elevator_loses_the_aircraft() {
    let ground = climb_and_jam("off");
    assert!(ground.roll_max_deg > LOST_DEG, "largest roll {} deg", ground.roll_max_deg);
}

#[test]
fn every_copy_of_a_command_is_acknowledged_once() {
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &[]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.1);
    for _ in 0..3 {
        ground.command(MavCmd::MAV_CMD_USER_1, JAM_LEFT_ELEVATOR);
    }
    let heartbeats = ground.heartbeats;
    ground.listen_until("two heartbeats more", |ground| ground.heartbeats >= heartbeats + 2);
    let accepted = (MavCmd::MAV_CMD_USER_1, MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(ground.acknowledgements, [accepted, accepted, accepted]);
    let count = ground.texts.iter().filter(|text| text.contains("Injected")).count();
    assert_eq!(count, 1, "the repeated command changes nothing: {:?}", ground.texts);
}

#[test]
fn a_killed_plant_is_reported_and_its_successor_is_a_new_flight() {
    let mut ground = Ground::new();
    let (autopilot, link) = autopilot(ground.address(), &[]);
    let plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    plant.signal(9);
    let heartbeats = ground.heartbeats;
    ground.listen_until("the report", |ground| {
        ground.texts.iter().any(|text| text.to_lowercase().contains("lost"))
    });
    // One heartbeat a second of wall time: two seconds at the most, one more for one in transit.
    assert!(ground.heartbeats <= heartbeats + 3, "{} heartbeats", ground.heartbeats - heartbeats);
    autopilot.wait_for("plant");
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("time from the start again", |ground| ground.time_s < 0.4);
    ground.listen_until("the new flight", |ground| ground.time_s > 0.5);
}

#[test]
fn a_killed_autopilot_is_reported_and_its_successor_flies_on_from_there() {
    let mut ground = Ground::new();
    let port = format!("127.0.0.1:{}", free_port());
    let gcs = ground.address().to_string();
    let arguments = ["--plant-link", port.as_str(), "--gcs", gcs.as_str()];
    let autopilot = Program::start("autopilot", &arguments);
    let plant = Program::start("plant-sim", &["--autopilot", &port]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 2.0);
    autopilot.signal(9);
    plant.wait_for("does not answer");
    let stopped_s = ground.time_s;
    let _autopilot = Program::start("autopilot", &arguments);
    ground.listen_until("the flight to go on", |ground| ground.time_s > stopped_s + 1.0);
    assert!(ground.time_s < stopped_s + 5.0, "the plant waited: {} s", ground.time_s - stopped_s);
    assert!(ground.roll_max_deg < 5.0 && (ground.altitude_m - 5_000.0).abs() < 5.0);
}

#[test]
fn a_port_in_use_names_process_and_port() {
    let ground = Ground::new();
    let (_first, link) = autopilot(ground.address(), &[]);
    let mut second = Program::start("autopilot", &["--plant-link", &link, "--no-gcs"]);
    assert_ne!(second.end(), Some(0));
    let printed = second.printed();
    assert!(printed.contains("autopilot") && printed.contains(&link), "{printed}");
}

#[test]
fn a_port_for_ground_stations_in_use_names_process_link_option_and_port() {
    let servers = ["--gcs", "none", "--gcs-udp-server", "127.0.0.1:0", "--gcs-tcp", "127.0.0.1:0"];
    let (_first, listening) = listening_autopilot(&servers);
    for (option, key) in [("--gcs-udp-server", "udp_server"), ("--gcs-tcp", "tcp_server")] {
        let port = listening["ground_stations"][key].as_str().expect("an address");
        let arguments = ["--plant-link", "127.0.0.1:0", "--gcs", "none", option, port];
        let mut second = Program::start("autopilot", &arguments);
        assert_ne!(second.end(), Some(0));
        let printed = second.printed();
        assert!(
            [option, port, "autopilot: cannot open"].iter().all(|part| printed.contains(part)),
            "{printed}"
        );
        let mut sitl = Program::start("sitl", &arguments);
        assert_ne!(sitl.end(), Some(0));
        let printed = sitl.printed();
        assert!(
            [option, port, "autopilot ended"].iter().all(|part| printed.contains(part)),
            "{printed}"
        );
    }
}

#[test]
fn a_further_vehicle_has_a_system_id_of_its_own_and_the_status_says_that_it_was_terminated() {
    let station = UdpSocket::bind("127.0.0.1:0").expect("loopback has free ports");
    station.set_read_timeout(Some(TIMEOUT)).expect("a timeout");
    let mut ground = Ground::new();
    let second = station.local_addr().expect("it has one").to_string();
    let options = ["--instance", "7", "--gcs", &second];
    let (vehicle, link) = autopilot(ground.address(), &options);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    let mut frame = [0; 512];
    station.recv(&mut frame).expect("the vehicle sends");
    assert_eq!(frame[5], 8, "system id");
    ground.listen_until("the flight", |ground| ground.time_s > 0.5);
    vehicle.wait_for("\"plant\":\"flying\"");
    // DO_FLIGHTTERMINATION to system 8 component 1.
    ground.send(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        target_system: 8,
        target_component: 1,
        command: MavCmd::MAV_CMD_DO_FLIGHTTERMINATION,
        param1: 1.0,
        ..Default::default()
    }));
    vehicle.wait_for("\"plant\":\"terminated\"");
}

#[test]
fn no_control_character_of_a_name_or_a_file_gets_out() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let hostile = "x\u{1b}[2J\u{7}\u{9b}\u{202e}\r\u{7f}";
    let script = folder.path().join(format!("{hostile}.txt"));
    std::fs::write(&script, format!("say {hostile} said\n")).expect("the folder is there");
    let script = script.to_str().expect("a path in UTF-8");
    let mut ground = Ground::new();
    let gcs = ground.address().to_string();
    let link = format!("127.0.0.1:{}", free_port());
    let flight =
        Program::start("sitl", &["--plant-link", &link, "--gcs", &gcs, "--script", script]);
    ground.listen_until("the script's text", |ground| ground.has_text(" said"));
    let printable = |text: &str| text.chars().all(|c| c == ' ' || c.is_ascii_graphic());
    assert!(ground.texts.iter().all(|text| printable(text)), "{:?}", ground.texts);
    let is_shown = |text: &str| text.chars().all(|c| c == '\n' || host_io::console::is_shown(c));
    assert!(is_shown(&flight.printed()), "{:?}", flight.printed());
    let missing = format!("{script}.missing");
    for arguments in [
        vec!["autopilot", "--script", &missing],
        vec!["plant-sim", "--scenario", &missing],
        vec!["fly", &missing],
        vec!["plot", &missing],
        vec![hostile],
        vec!["fly", "--law", hostile],
    ] {
        let mut refused = Program::start("sitl", &arguments);
        assert_ne!(refused.end(), Some(0));
        let printed = refused.printed();
        assert!(!printed.is_empty() && is_shown(&printed), "{printed:?}");
    }
}

#[test]
fn either_process_may_start_first() {
    let port = format!("127.0.0.1:{}", free_port());
    let mut ground = Ground::new();
    let gcs = ground.address().to_string();
    let _plant = Program::start("plant-sim", &["--autopilot", &port]);
    std::thread::sleep(std::time::Duration::from_millis(300));
    let _autopilot = Program::start("autopilot", &["--plant-link", &port, "--gcs", &gcs]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
}

#[test]
fn a_wrong_configuration_stops_the_start_and_names_file_key_value_and_range() {
    let folder = tempfile::tempdir().expect("a folder for a file");
    let path = folder.path().join("mine.toml");
    let text = aircraft::DEFAULT_AIRFRAME.replace("mass_kg = 9295", "mass_kg = -9295");
    assert_ne!(text, aircraft::DEFAULT_AIRFRAME);
    std::fs::write(&path, text).expect("a writable folder");
    let mut plant =
        Program::start("plant-sim", &["--airframe", path.to_str().expect("plain path")]);
    assert_ne!(plant.end(), Some(0));
    let printed = plant.printed();
    for part in ["mine.toml", "mass_kg", "-9295", "outside"] {
        assert!(printed.contains(part), "{part} is missing: {printed}");
    }
}

/// `sitl` with both programs in flight, and its ground station.
fn sitl_in_flight() -> (Program, Ground) {
    let link = format!("127.0.0.1:{}", free_port());
    let ground = Ground::new();
    let gcs = ground.address().to_string();
    let sitl = Program::start("sitl", &["--plant-link", link.as_str(), "--gcs", gcs.as_str()]);
    sitl.wait_for("altitude");
    (sitl, ground)
}

#[test]
fn sitl_ends_both_on_terminate_and_informs_the_ground_stations() {
    let (mut sitl, mut ground) = sitl_in_flight();
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.1);
    sitl.signal(15);
    ground
        .listen_until("the end", |ground| ground.texts.contains(&"The simulation ends".to_owned()));
    assert_eq!(sitl.end(), Some(0), "{}", sitl.printed());
}

#[test]
fn a_killed_plant_is_reported_to_the_ground_stations_before_sitl_ends() {
    let (mut sitl, mut ground) = sitl_in_flight();
    let children = std::process::Command::new("pgrep")
        .args(["-P", &sitl.id().to_string(), "-f", "plant-sim"])
        .output();
    let children = String::from_utf8(children.expect("pgrep runs").stdout).expect("numbers");
    let plant = children.lines().next().expect("sitl has a plant");
    let killed = std::process::Command::new("kill").args(["-9", plant]).status();
    assert!(killed.expect("kill runs").success());
    ground.listen_until("the end", |ground| ground.has_text("The simulation ends"));
    let expected = [
        "Plant link lost: simulation time stands still",
        "The simulation ends: the plant does not answer",
    ];
    let last = &ground.texts[ground.texts.len() - 2..];
    assert_eq!(last, expected, "{:?}", ground.texts);
    assert_ne!(sitl.end(), Some(0));
    assert!(sitl.printed().contains("plant-sim ended"), "{}", sitl.printed());
}

#[test]
fn slow_and_fast_flights_through_two_processes_write_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder for logs");
    let fly = |speed: &str| {
        let file = |name: &str| folder.path().join(format!("{name}-{speed}")).display().to_string();
        let (truth, steps) = (file("truth"), file("steps"));
        let options = ["--no-gcs", "--scenario", "case2", "--step-log", &steps];
        let (autopilot, link) = autopilot_with(&options);
        let mut plant = Program::start(
            "plant-sim",
            &[
                "--autopilot",
                &link,
                "--scenario",
                "case2",
                "--speed",
                speed,
                "--until-s",
                "4",
                "--gyro-noise-deg-s",
                "0.1",
                "--turbulence-m-s",
                "1.5",
                "--truth-log",
                &truth,
            ],
        );
        assert_eq!(plant.end(), Some(0), "{}", plant.printed());
        autopilot.signal(15);
        let mut autopilot = autopilot;
        assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
        [truth, steps].map(|path| std::fs::read(path).expect("a log was written"))
    };
    let slow = fly("4");
    assert!(slow[0].len() > 100_000 && slow[1].len() > 100_000, "2000 ticks were written");
    for speed in ["40", "max"] {
        assert!(fly(speed) == slow, "speed {speed} flies another flight");
    }
}

/// Airframe and model of a shipped aircraft.
fn files(aircraft: &str) -> [String; 2] {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    ["airframe", "model"].map(|file| format!("{root}/aircraft/{aircraft}/{file}.toml"))
}

#[test]
fn an_aircraft_of_eleven_kilograms_flies_a_mission_with_a_circle_of_100_m() {
    fly_mission_with_a_circle("aerosonde", 100.0, [210.0, 220.0, 205.0], SPEED);
}

#[test]
fn the_f16_flies_a_mission_with_a_circle_of_6_km() {
    fly_mission_with_a_circle("f16", 6_000.0, [4_100.0, 4_200.0, 4_050.0], "100");
}

/// Flies a leg of six radii, one turn of the circle, and back past the start; two programs and MAVLink.
fn fly_mission_with_a_circle(aircraft: &str, radius_m: f64, altitudes_m: [f32; 3], speed: &str) {
    let [airframe, model] = files(aircraft);
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &["--model", &model]);
    let options = ["--autopilot", &link, "--airframe", &airframe, "--speed", speed];
    let _plant = Program::start("plant-sim", &options);
    ground.listen_until("a place", |ground| ground.place_e7 != [0; 2]);
    let [lat, lon] = ground.place_e7;
    // Metres per unit of 1e-7 deg, to the north and to the east.
    let north_m = 6.371e6 * 1.0e-7_f64.to_radians();
    let east_m = north_m * (1.0e-7 * f64::from(lat)).to_radians().cos();
    // A short way.
    let item = |command, [north, east]: [f64; 2], z, turns, circle_m| MISSION_ITEM_INT_DATA {
        x: lat + (north * radius_m / north_m) as i32,
        y: lon + (east * radius_m / east_m) as i32,
        z,
        command,
        param1: turns,
        param3: circle_m,
        ..Default::default()
    };
    let [there, on_circle, back] = altitudes_m;
    let plan = [
        item(MavCmd::MAV_CMD_NAV_WAYPOINT, [6.0, 0.0], there, 0.0, 0.0),
        item(MavCmd::MAV_CMD_NAV_LOITER_TURNS, [6.0, 3.0], on_circle, 1.0, radius_m as f32),
        item(MavCmd::MAV_CMD_NAV_WAYPOINT, [0.0, 3.0], back, 0.0, 0.0),
    ];
    assert_eq!(ground.upload_items(&plan), MavMissionResult::MAV_MISSION_ACCEPTED);
    assert_eq!(
        ground.command(MavCmd::MAV_CMD_MISSION_START, [0.0; 7]),
        MavResult::MAV_RESULT_ACCEPTED
    );
    // Quadrants of the circle in which the aircraft was on it.
    let mut seen = std::collections::BTreeSet::new();
    ground.listen_until("the end of the plan", |ground| {
        let [at_lat, at_lon] = ground.place_e7;
        let north = f64::from(at_lat - lat) * north_m - 6.0 * radius_m;
        let east = f64::from(at_lon - lon) * east_m - 3.0 * radius_m;
        if (north.hypot(east) - radius_m).abs() < 0.1 * radius_m {
            seen.insert((north > 0.0, east > 0.0));
        }
        ground.has_text("Mission complete")
    });
    assert_eq!(seen.len(), 4, "quadrants of the circle: {seen:?}");
    let off_m = ground.altitude_m - f64::from(back);
    assert!(off_m.abs() < 0.05 * radius_m.min(1_000.0), "{off_m} m off the altitude");
    assert!(ground.roll_max_deg < 46.0, "largest roll {} deg", ground.roll_max_deg);
    assert!(!ground.has_text("ompensator active"), "{:?}", ground.texts);
}
