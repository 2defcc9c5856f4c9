//! The two real programs over a bad network: a relay between them loses, doubles, delays and reorders
//! packets, and the flight is the same to the bit.

use crate::programs;

use std::fs;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use programs::{Program, autopilot_with};

/// Simulation time flown, s.
const FLOWN_S: &str = "4";
/// The relay disturbs one packet in this many; a prime, so that both directions are hit.
const EVERY: u64 = 37;
/// Delay of a late packet: longer than the plant waits before it repeats its request.
const LATE: Duration = Duration::from_millis(45);

/// Disturbance of a packet.
#[derive(Clone, Copy)]
enum Ill {
    Nothing,
    Lose,
    Double,
    /// Arrives after its repetition, and after later packets.
    Delay,
}

/// A relay in front of `autopilot`; its address, and the number of disturbed packets.
fn relay(autopilot: SocketAddr, ill: Ill, end: &Arc<AtomicBool>) -> (SocketAddr, Arc<AtomicU64>) {
    let front = UdpSocket::bind("127.0.0.1:0").expect("a port for the plant");
    let back = UdpSocket::bind("127.0.0.1:0").expect("a port for the autopilot");
    back.connect(autopilot).expect("the autopilot is on loopback");
    let address = front.local_addr().expect("it has one");
    for socket in [&front, &back] {
        socket.set_read_timeout(Some(Duration::from_millis(100))).expect("a timeout");
    }
    let harmed = Arc::new(AtomicU64::new(0));
    let (front, back) = (Arc::new(front), Arc::new(back));
    let plant = Arc::new(std::sync::Mutex::new(None));
    for to_autopilot in [true, false] {
        let (front, back, plant) = (Arc::clone(&front), Arc::clone(&back), Arc::clone(&plant));
        let (end, harmed) = (Arc::clone(end), Arc::clone(&harmed));
        thread::spawn(move || {
            let mut count = 0_u64;
            let mut buffer = [0; 2048];
            while !end.load(Ordering::Relaxed) {
                let received = if to_autopilot {
                    front.recv_from(&mut buffer).map(|(bytes, from)| {
                        *plant.lock().expect("no panic while held") = Some(from);
                        bytes
                    })
                } else {
                    back.recv(&mut buffer)
                };
                let Ok(bytes) = received else { continue };
                count += 1;
                let packet = buffer[..bytes].to_vec();
                let (front, back, plant) =
                    (Arc::clone(&front), Arc::clone(&back), Arc::clone(&plant));
                // A packet that cannot be sent is one more lost packet.
                let pass = move || {
                    let to = *plant.lock().expect("no panic while held");
                    let _ = match to {
                        _ if to_autopilot => back.send(&packet),
                        Some(to) => front.send_to(&packet, to),
                        None => Ok(0),
                    };
                };
                if !count.is_multiple_of(EVERY) {
                    pass();
                    continue;
                }
                harmed.fetch_add(1, Ordering::Relaxed);
                match ill {
                    Ill::Nothing => pass(),
                    Ill::Lose => {}
                    Ill::Double => {
                        pass();
                        pass();
                    }
                    Ill::Delay => {
                        thread::spawn(move || {
                            thread::sleep(LATE);
                            pass();
                        });
                    }
                }
            }
        });
    }
    (address, harmed)
}

/// Both logs of a flight over such a network, and the number of disturbed packets.
fn fly(ill: Ill, folder: &Path) -> (Vec<u8>, Vec<u8>, u64) {
    let (truth, steps) = (folder.join("truth.log"), folder.join("steps.log"));
    let (truth_name, step_name) = (truth.display().to_string(), steps.display().to_string());
    let (mut autopilot, link) = autopilot_with(&["--no-gcs", "--step-log", &step_name]);
    let end = Arc::new(AtomicBool::new(false));
    let (address, harmed) = relay(link.parse().expect("an address"), ill, &end);
    let to = address.to_string();
    let plant = ["--autopilot", &to, "--speed", "max", "--until-s", FLOWN_S];
    let mut plant =
        Program::start("plant-sim", &[&plant[..], &["--truth-log", &truth_name]].concat());
    assert_eq!(plant.end(), Some(0), "{}", plant.printed());
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    end.store(true, Ordering::Relaxed);
    let read = |path| fs::read(path).expect("a log");
    (read(truth), read(steps), harmed.load(Ordering::Relaxed))
}

#[test]
fn a_network_that_loses_doubles_and_delays_does_not_change_the_flight() {
    let folder = tempfile::tempdir().expect("a folder for logs");
    let (truth, steps, _) = fly(Ill::Nothing, folder.path());
    assert!(truth.len() > 100_000 && steps.len() > 100_000, "the logs are there");
    for ill in [Ill::Lose, Ill::Double, Ill::Delay] {
        let (other_truth, other_steps, harmed) = fly(ill, folder.path());
        assert!(harmed > 50, "{harmed} packets harmed");
        assert!(truth == other_truth, "the aircraft flew differently");
        assert!(steps == other_steps, "the laws saw something else");
    }
}
