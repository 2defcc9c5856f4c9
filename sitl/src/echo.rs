//! A bare echo of link packets between two processes: what the machine can do without any flight.

use std::error::Error;
use std::io::{self, Write};
use std::net::SocketAddr;
use std::time::Duration;

use host_io::process::pin_this_thread;
use host_io::{LinkSocket, Stop, Wait, clock, console};
use icd::lockstep::{FlightSide, PlantSide};
use icd::tvc_jet;
use icd::wire::{PACKET_MAX, Phase, Reports};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use plant_sim::io::{CORE_MAX, whole};

/// Longest wait for a packet.
const RECEIVE_TIMEOUT: Duration = Duration::from_millis(20);
/// Round trips between two looks at the clock.
const ROUND_TRIPS_PER_LOOK: u64 = 64;
/// Round trips before the measurement begins: caches, branch predictors, clock frequency.
const WARM_UP: u64 = 500;

/// Options of the echo.
#[derive(Debug, Clone, clap::Args)]
pub struct EchoArgs {
    /// Ask the echo at this address and print its round trips per second; without it, be the echo
    #[arg(long, value_name = "IP:PORT")]
    to: Option<SocketAddr>,
    /// How long to measure, ms
    #[arg(long, allow_negative_numbers = true, value_name = "MS", default_value_t = 100, value_parser = whole(1_u64, 60_000))]
    for_ms: u64,
    /// Run on this core only
    #[arg(long, allow_negative_numbers = true, value_name = "CORE", value_parser = whole(0, CORE_MAX))]
    cpu: Option<usize>,
    /// How to wait: block, yield or spin
    #[arg(long, value_name = "HOW", default_value = "block")]
    wait: Wait,
}

/// Echoes until the standard input ends, or measures an echo.
pub fn run(args: &EchoArgs) -> Result<(), Box<dyn Error>> {
    args.cpu.map_or(Ok(()), pin_this_thread)?;
    match args.to {
        None => serve(args.wait),
        Some(to) => measure(args, to),
    }
}

fn serve(wait: Wait) -> Result<(), Box<dyn Error>> {
    let anywhere = SocketAddr::from((std::net::Ipv4Addr::LOCALHOST, 0));
    let mut socket = LinkSocket::listen("echo", "echo link", anywhere, wait, RECEIVE_TIMEOUT)?;
    writeln!(console::out(), "{}", socket.local_address()?)?;
    let stop = Stop::new();
    stop.with_parent()?;
    let (_, answer) = packets();
    let mut buffer = [0; PACKET_MAX + 1];
    while !stop.is_requested() {
        if let Some((_, from)) = socket.receive_from(&mut buffer)? {
            // What does not leave is requested again.
            let _ = socket.send_to(&answer, from);
        }
    }
    Ok(())
}

fn measure(args: &EchoArgs, to: SocketAddr) -> Result<(), Box<dyn Error>> {
    let mut socket = LinkSocket::connect("echo", "echo link", to, args.wait, RECEIVE_TIMEOUT)?;
    let (question, _) = packets();
    let mut buffer = [0; PACKET_MAX + 1];
    let mut round_trips = |count: u64| -> io::Result<()> {
        for _ in 0..count {
            // What does not leave is a lost round trip, and the next one follows.
            let _ = socket.send(&question);
            // A lost packet costs the whole timeout, so the rate shows it without a count of
            // losses.
            socket.receive(&mut buffer)?;
        }
        Ok(())
    };
    round_trips(WARM_UP)?;
    let began = clock::now();
    let mut count: u64 = 0;
    let elapsed = loop {
        round_trips(ROUND_TRIPS_PER_LOOK)?;
        count += ROUND_TRIPS_PER_LOOK;
        let elapsed = clock::now() - began;
        if elapsed >= Duration::from_millis(args.for_ms) {
            break elapsed;
        }
    };
    // Far below 2^53.
    let rate = count as f64 / elapsed.as_secs_f64();
    writeln!(console::out(), "{rate:.0}")?;
    Ok(())
}

/// A question and an answer as the link sends them: a tick without reports or requests.
fn packets() -> (Vec<u8>, Vec<u8>) {
    let mut values = [0.0; Sensors::COUNT];
    // The attitude, behind three rates and three forces, has to be of length one.
    values[6] = 1.0;
    let sensors = Sensors::at(SimTime::ZERO, &values);
    let mut plant = PlantSide::new(1, tvc_jet::aircraft());
    let mut flight = FlightSide::new(tvc_jet::aircraft());
    let period = ControlPeriod::DEFAULT;
    let question =
        plant.begin_exchange(SimTime::ZERO, Phase::Flying, period, &sensors, Reports::new(), &[]);
    let anywhere = SocketAddr::from((std::net::Ipv4Addr::LOCALHOST, 0));
    flight.handle(question, anywhere, false);
    let answer = flight.answer(&Actuators::default(), None, false).unwrap_or_default();
    (question.to_vec(), answer.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::wire::{Packet, decode};

    #[test]
    fn the_echo_sends_packets_of_the_link() {
        let (question, answer) = packets();
        assert!(matches!(decode(&question), Ok(Packet::Sensors(_))));
        assert!(matches!(decode(&answer), Ok(Packet::Actuators(_))));
    }
}
