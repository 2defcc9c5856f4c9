//! Simulation time that pauses, steps and runs slowly, in the two real programs: neither side sees a loss, and the
//! flight stays the same to the bit.

use crate::ground;
use crate::programs;

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use ground::Ground;
use mavlink::dialects::common::{HEARTBEAT_DATA, MavCmd, MavMessage, MavResult};
use nix::pty::openpty;
use nix::sys::termios::{LocalFlags, tcgetattr};
use programs::{Program, TIMEOUT, autopilot, autopilot_with, free_port, program};

/// Longer than the second after which a plant is lost and the ten seconds after which a ground station is.
const LONG_PAUSE_S: u32 = 12;
/// MAV_CMD_USER_1: SERVO, STUCK, left elevator, angle, 30 deg, no ramp, at once.
const JAM_LEFT_ELEVATOR: [f32; 7] = [102.0, 2.0, 3.0, 1.0, 30.0, 0.0, 0.0];
/// First parameter of MAV_CMD_USER_2.
const PAUSE: f32 = 0.0;
const RUN: f32 = 1.0;
const STEP: f32 = 2.0;
const SPEED: f32 = 3.0;
/// The control period, s.
const PERIOD_S: f64 = 0.002;
/// What the numbers of MAVLink messages, milliseconds, can be off by when they are read as seconds.
const ROUNDING_S: f64 = 1.0e-9;

fn plant(link: &str, options: &[&str]) -> Program {
    let mut all = vec!["--autopilot", link, "--with-parent", "--status"];
    all.extend(options);
    Program::start_as_parent("plant-sim", &all)
}

/// Receives, and sends heartbeats as a ground station, for this many seconds of wall time.
fn be_there(ground: &mut Ground, seconds: u32) {
    for _ in 0..seconds {
        ground.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::DEFAULT));
        ground.listen_for(Duration::from_secs(1));
    }
}

#[test]
fn a_long_pause_looks_like_no_loss_and_the_aircraft_can_be_broken_in_it() {
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &[]);
    let mut plant = plant(&link, &[]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    plant.send_line("pause");
    ground.listen_until("the pause", |ground| ground.has_text("Simulation paused"));
    ground.listen_for(Duration::from_millis(300));
    let (stands_s, heartbeats) = (ground.time_s, ground.heartbeats);
    be_there(&mut ground, LONG_PAUSE_S);
    let heartbeats = ground.heartbeats - heartbeats;
    assert!(heartbeats >= LONG_PAUSE_S - 1, "{heartbeats} heartbeats in {LONG_PAUSE_S} s");
    assert_eq!(
        ground.command(MavCmd::MAV_CMD_USER_1, JAM_LEFT_ELEVATOR),
        MavResult::MAV_RESULT_ACCEPTED
    );
    ground.listen_until("the fault", |ground| ground.has_text("Injected"));
    assert_eq!(ground.time_s, stands_s, "time stood still");
    plant.send_line("run");
    ground.listen_until("the flight to go on", |ground| ground.time_s > stands_s + 1.0);
    let loss = |text: &&String| text.contains("lost") || text.contains("back");
    assert_eq!(ground.texts.iter().find(loss), None, "{:?}", ground.texts);
    assert!(!plant.printed().contains("does not answer"), "{}", plant.printed());
}

#[test]
fn a_step_is_one_period_and_a_hundred_are_a_hundred() {
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &[]);
    let mut plant = plant(&link, &["--start-paused"]);
    ground.listen_until("an aircraft", |ground| ground.roll_max_deg.is_finite());
    ground.listen_for(Duration::from_millis(500));
    assert_eq!(ground.time_s, 0.0, "it stands from the start");
    let mut expected_s = 0.0;
    for (line, periods) in [("step", 1.0), ("step 1", 1.0), ("step 100", 100.0)] {
        plant.send_line(line);
        expected_s += periods * PERIOD_S;
        ground.listen_until(line, |ground| ground.time_s > expected_s - ROUNDING_S);
        ground.listen_for(Duration::from_millis(300));
        assert!((ground.time_s - expected_s).abs() < ROUNDING_S, "{line}: {} s", ground.time_s);
    }
    plant.send_line("somersault");
    plant.send_line("step");
    plant.wait_for("none of pause, run, step");
    ground.listen_until("a step after that", |ground| ground.time_s > expected_s + ROUNDING_S);
}

#[test]
fn a_ground_station_pauses_steps_slows_and_runs() {
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &[]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    let command = |ground: &mut Ground, what: f32, value: f32| {
        let result = ground.command(MavCmd::MAV_CMD_USER_2, [what, value, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED, "{what} {value}");
    };
    command(&mut ground, PAUSE, 0.0);
    ground.listen_for(Duration::from_millis(300));
    let stands_s = ground.time_s;
    command(&mut ground, STEP, 5.0);
    ground.listen_for(Duration::from_millis(300));
    let stepped_s = ground.time_s - stands_s;
    assert!((stepped_s - 5.0 * PERIOD_S).abs() < ROUNDING_S, "{stepped_s} s");
    command(&mut ground, SPEED, 0.5);
    ground.listen_for(Duration::from_millis(300));
    assert_eq!(ground.time_s, stands_s + stepped_s, "a speed is not a run");
    command(&mut ground, RUN, 0.0);
    ground.listen_until("the flight to go on", |ground| ground.time_s > stands_s + 0.3);
    for text in
        ["Simulation paused", "Simulation steps: 5", "Simulation speed: x0.5", "Simulation runs"]
    {
        assert!(ground.has_text(text), "{text}: {:?}", ground.texts);
    }
}

#[test]
fn slow_motion_is_slow() {
    let mut ground = Ground::new();
    let (_autopilot, link) = autopilot(ground.address(), &[]);
    let mut plant = plant(&link, &["--start-paused"]);
    plant.send_line("speed 0.1");
    plant.send_line("run");
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.0);
    let (start_s, start) = (ground.time_s, Instant::now());
    ground.listen_until("a fifth of a second", |ground| ground.time_s > start_s + 0.2);
    let factor = (ground.time_s - start_s) / start.elapsed().as_secs_f64();
    // Two seconds at a tenth; both ends may be read a tenth of a second of wall time late.
    assert!(factor < 0.12, "x{factor}");
}

/// Truth log and step log of four noisy seconds of case 2, while `conduct` controls the pace of the plant.
fn logs(options: &[&str], conduct: impl Fn(&mut Program)) -> [Vec<u8>; 2] {
    let folder = tempfile::tempdir().expect("a folder for logs");
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (truth, steps) = (file("truth"), file("steps"));
    let control = ["--no-gcs", "--scenario", "case2", "--step-log", &steps];
    let (mut autopilot, link) = autopilot_with(&control);
    let mut all = vec!["--scenario", "case2", "--until-s", "4", "--truth-log", &truth];
    all.extend(["--gyro-noise-deg-s", "0.1", "--turbulence-m-s", "1.5"]);
    all.extend(options);
    let mut plant = plant(&link, &all);
    conduct(&mut plant);
    assert_eq!(plant.end(), Some(0), "{}", plant.printed());
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    [truth, steps].map(|path| std::fs::read(path).expect("a log was written"))
}

#[test]
fn pauses_steps_and_speeds_write_the_same_bytes() {
    let undisturbed = logs(&["--speed", "max"], |_| {});
    assert!(undisturbed.iter().all(|log| log.len() > 100_000), "2000 ticks were written");
    let disturbed = logs(&["--speed", "4", "--start-paused"], |plant| {
        plant.wait_for("\"paused\":true");
        for line in ["step", "step 7", "speed 0.02", "step 3", "speed 2", "run"] {
            plant.send_line(line);
            sleep(Duration::from_millis(200));
        }
        plant.send_line("pause");
        plant.wait_for("\"paused\":true");
        sleep(Duration::from_millis(1_500));
        for line in ["step 100", "speed 0.5", "run", "pause", "speed 20", "run"] {
            plant.send_line(line);
            sleep(Duration::from_millis(100));
        }
    });
    assert!(disturbed == undisturbed, "the pace changed the flight");
}

/// Output of a terminal, until `part` appears.
fn read_until(screen: &mut File, part: &str, shown: &mut String) {
    let (until, from) = (Instant::now() + TIMEOUT, shown.len());
    while !shown[from..].contains(part) {
        assert!(Instant::now() < until, "waited for {part:?}; so far:\n{shown}");
        let mut bytes = [0; 4096];
        let count = screen.read(&mut bytes).expect("the other end is open");
        shown.push_str(&String::from_utf8_lossy(&bytes[..count]));
    }
}

#[test]
fn on_a_terminal_keys_pause_step_and_end_and_the_terminal_is_as_before() {
    let terminal = openpty(None, None).expect("the system has terminals");
    let input = || Stdio::from(terminal.slave.try_clone().expect("a copy of a descriptor"));
    let by_line = || {
        let flags = tcgetattr(&terminal.slave).expect("a terminal").local_flags;
        flags & (LocalFlags::ICANON | LocalFlags::ECHO)
    };
    let before = by_line();
    assert!(!before.is_empty(), "a new terminal reads lines");
    let link = format!("127.0.0.1:{}", free_port());
    let mut sitl = Command::new(program("sitl"))
        .args([
            "--plant-link",
            &link,
            "--no-gcs",
            "--parameter-file",
            "none",
            "--signing-key",
            "none",
        ])
        .stdin(input())
        .stdout(input())
        .stderr(Stdio::null())
        .spawn()
        .expect("a built program starts");
    let mut screen = File::from(terminal.master.try_clone().expect("a copy of a descriptor"));
    let mut shown = String::new();
    read_until(&mut screen, "space pause", &mut shown);
    read_until(&mut screen, "x1.0", &mut shown);
    assert!(by_line().is_empty(), "keys come one by one, without echo");
    let mut press = |keys: &[u8], part: &str| {
        screen.write_all(keys).expect("sitl reads its terminal");
        read_until(&mut screen, part, &mut shown);
    };
    press(b" ", "PAUSED");
    // During a pause the speed is not shown: nothing is drawn again.
    press(b"- ", "x0.50");
    press(b" ", "PAUSED");
    screen.write_all(b"q").expect("sitl reads its terminal");
    let status = sitl.wait().expect("a child can be waited for");
    assert!(status.success(), "{status}; {shown}");
    assert_eq!(by_line(), before);
}
