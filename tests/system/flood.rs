//! A flight during a flood of messages without effect is the same as without it, bit for bit, and a
//! well-behaved client gets every answer.

mod clients;
use crate::ground;
mod messages;
use crate::programs;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clients::{Flooder, Station};
use ground::Ground;
use mavlink::dialects::common::{MavCmd, MavResult};
use programs::{Program, TIMEOUT, listening_autopilot};

/// Simulation time of the flight, s.
const FLIGHT_S: &str = "20";
/// Simulation time per wall time during the flood: ten seconds of it.
const SPEED: &str = "2";
/// Ground stations that flood by UDP.
const UDP_FLOODERS: usize = 12;
/// Ground stations that flood by TCP and read what the autopilot sends.
const TCP_FLOODERS: usize = 6;
/// Ground stations that flood by TCP and read nothing.
const SLOW_FLOODERS: usize = 2;
/// Each of them sends one message per this time.
const ROUND: Duration = Duration::from_millis(10);
/// Messages of all of them together, 1/s, at least.
const RATE_MIN: f64 = 1_000.0;

/// Flies and returns the logs of both programs. `beside` runs until the plant has ended.
fn fly(
    folder: &Path,
    name: &str,
    options: &[&str],
    speed: &str,
    beside: impl FnOnce(&serde_json::Value, &mut Program),
) -> [Vec<u8>; 2] {
    let file = |what: &str| folder.join(format!("{name}-{what}")).display().to_string();
    let (truth, steps) = (file("truth"), file("steps"));
    let mut all = vec!["--scenario", "case2", "--step-log", &steps];
    all.extend(options);
    let (mut autopilot, listening) = listening_autopilot(&all);
    let link = listening["plant_link"].as_str().expect("an address");
    let mut arguments = vec!["--autopilot", link, "--scenario", "case2", "--speed", speed];
    arguments.extend(["--until-s", FLIGHT_S, "--truth-log", &truth]);
    arguments.extend(["--gyro-noise-deg-s", "0.1", "--turbulence-m-s", "1.5"]);
    let mut plant = Program::start("plant-sim", &arguments);
    beside(&listening, &mut plant);
    assert_eq!(plant.end(), Some(0), "{}", plant.printed());
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    [truth, steps].map(|path| std::fs::read(path).expect("a log was written"))
}

fn address(listening: &serde_json::Value, key: &str) -> SocketAddr {
    let text = listening["ground_stations"][key].as_str().expect("an address");
    text.parse().expect("an address")
}

/// Result of the flood.
struct Flood {
    messages: u64,
    seconds: f64,
    answers: u64,
}

/// Each client sends one message per round until it is stopped.
fn flood(udp: SocketAddr, tcp: SocketAddr, stop: &AtomicBool) -> Flood {
    let flooders = (0..UDP_FLOODERS).map(|_| Flooder::udp(udp));
    let flooders = flooders.chain((0..TCP_FLOODERS).map(|_| Flooder::tcp(tcp, true)));
    let flooders = flooders.chain((0..SLOW_FLOODERS).map(|_| Flooder::tcp(tcp, false)));
    let mut flooders: Vec<Flooder> = flooders.collect();
    let mut source = messages::Source::new(2_026);
    let (start, mut messages) = (Instant::now(), 0);
    for round in 1.. {
        for flooder in &mut flooders {
            flooder.send(&source.next());
            flooder.read();
            messages += 1;
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
        thread::sleep((ROUND * round).saturating_sub(start.elapsed()));
    }
    let answers = flooders.iter().map(Flooder::answers).sum();
    Flood { messages, seconds: start.elapsed().as_secs_f64(), answers }
}

/// A ground station by TCP that sends each command twice and counts the acknowledgements of each.
fn behave(tcp: SocketAddr, stop: &AtomicBool) -> BTreeMap<u16, u32> {
    let mut station = Station::connect(tcp);
    let mut number = 0;
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..2 {
            station.send(&messages::unknown_command(number));
        }
        number += 1;
        station.read_for(Duration::from_millis(50));
    }
    let until = Instant::now() + TIMEOUT;
    while station.acknowledged.values().sum::<u32>() < 2 * u32::from(number) {
        assert!(Instant::now() < until, "acknowledgements are missing: {:?}", station.acknowledged);
        station.read_for(Duration::from_millis(50));
    }
    // One too many would come about now.
    station.read_for(Duration::from_millis(300));
    assert_eq!(station.acknowledged.len(), usize::from(number));
    station.acknowledged
}

/// Ends the flood even if the test fails.
struct StopsAll<'a>(&'a AtomicBool);

impl Drop for StopsAll<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn a_flight_beside_a_flood_is_the_flight_alone_and_other_clients_are_answered() {
    let folder = tempfile::tempdir().expect("a folder for logs");
    let alone = fly(folder.path(), "alone", &["--no-gcs"], "max", |_, _| {});
    assert!(alone.iter().all(|log| log.len() > 1_000_000), "10000 ticks were written");

    let mut ground = Ground::new();
    let gcs = ground.address().to_string();
    let any = "127.0.0.1:0";
    let options = ["--gcs", &gcs, "--gcs-udp-server", any, "--gcs-tcp", any];
    let beside = fly(folder.path(), "beside", &options, SPEED, |listening, plant| {
        let (udp, tcp) = (address(listening, "udp_server"), address(listening, "tcp_server"));
        let stop = AtomicBool::new(false);
        let (flood, behaved, sent) = thread::scope(|scope| {
            let flooding = scope.spawn(|| flood(udp, tcp, &stop));
            let behaving = scope.spawn(|| behave(tcp, &stop));
            let stop_all = StopsAll(&stop);
            let mut sent = 0;
            let until = Instant::now() + TIMEOUT;
            while !plant.has_ended() {
                assert!(Instant::now() < until, "the flight does not end: {}", plant.printed());
                let version = [148.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                let result = ground.command(MavCmd::MAV_CMD_REQUEST_MESSAGE, version);
                assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED);
                sent += 1;
                thread::sleep(ROUND);
            }
            drop(stop_all);
            let flood = flooding.join().expect("the flood ends by itself");
            (flood, behaving.join().expect("all was answered"), sent)
        });
        let rate = flood.messages as f64 / flood.seconds;
        println!(
            "{} messages of the flood, {rate:.0} a second, {} frames sent to them; {sent} and {} questions answered",
            flood.messages,
            flood.answers,
            2 * behaved.len()
        );
        assert!(rate >= RATE_MIN, "a flood of {rate:.0} messages a second is too thin");
        assert!(flood.answers > flood.messages / 4, "{} answers to the flood", flood.answers);
        assert!(behaved.values().all(|count| *count == 2), "one for each copy: {behaved:?}");
        assert!(behaved.len() > 50 && sent > 50, "{} and {sent} questions", behaved.len());
        assert_eq!(ground.acknowledgements.len(), sent);
    });
    assert!(beside == alone, "the flood has changed the flight");
}
