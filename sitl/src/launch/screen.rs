//! What the operator sees: lines, and below them one that follows the flight.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use autopilot::io::gcs_link::Listening;
use autopilot::io::status::{FlightStatus, PlantState, StatusLine};

use super::pace::Passing;

/// Time between two lines where the output is no terminal.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Back to the start of the line, and clear it.
const CLEAR: &str = "\r\x1b[2K";

/// The operator's screen, or the file that stands for it.
pub(super) struct Screen {
    terminal: bool,
    live: String,
    shown: Option<(Instant, Change)>,
    passing: Passing,
    /// Wall time and simulation time when the speed was measured last.
    measured: Option<(Instant, f64)>,
    /// Simulation time per wall time, once it has been measured.
    achieved: Option<f64>,
}

/// What makes a plain line worth printing before its time.
#[derive(Clone, Copy, PartialEq)]
struct Change {
    compensator_active: bool,
    plant: Option<PlantState>,
    passing: Passing,
}

impl Screen {
    pub(super) fn new(passing: Passing) -> Self {
        let terminal = io::stdout().is_terminal();
        Self { terminal, live: String::new(), shown: None, passing, measured: None, achieved: None }
    }

    /// A line that stays.
    pub(super) fn say(&mut self, line: &str) -> io::Result<()> {
        let mut out = io::stdout().lock();
        if self.live.is_empty() {
            writeln!(out, "{line}")?;
        } else {
            write!(out, "{CLEAR}{line}\n{}", self.live)?;
        }
        out.flush()
    }

    /// Where to connect and how to break something.
    pub(super) fn introduce(&mut self, ground_stations: &Listening) -> io::Result<()> {
        let words = introduction(ground_stations);
        if words.is_empty() { Ok(()) } else { self.say(&words) }
    }

    /// The flight now.
    pub(super) fn status(&mut self, status: &StatusLine, now: Instant) -> io::Result<()> {
        let flight = match status {
            StatusLine::Flight(flight) => flight,
            StatusLine::Listening { .. } | StatusLine::FlightLog { .. } | StatusLine::NoPlant => {
                return Ok(());
            }
        };
        self.follow_pace(flight.t_s, now);
        let line = line(flight, self.passing, self.achieved);
        let change = Change {
            compensator_active: flight.compensator_active,
            plant: Some(flight.plant),
            passing: self.passing,
        };
        if self.terminal {
            self.live.clone_from(&line);
            let mut out = io::stdout().lock();
            write!(out, "{CLEAR}{line}")?;
            return out.flush();
        }
        let due = self.shown.is_none_or(|(when, last)| last != change || now - when >= PLAIN_EVERY);
        if due {
            self.shown = Some((now, change));
            self.say(&line)?;
        }
        Ok(())
    }

    /// Simulation time passes like this from here on.
    pub(super) fn pass(&mut self, passing: Passing) {
        if self.passing != passing {
            self.passing = passing;
            self.measured = None;
            self.achieved = None;
        }
    }

    /// How simulation time passes.
    pub(super) fn passing(&self) -> Passing {
        self.passing
    }

    /// Simulation time per wall time over the last second or so, once it is known.
    pub(super) fn achieved(&self) -> Option<f64> {
        self.achieved
    }

    /// Measures simulation time per wall time about once a second.
    fn follow_pace(&mut self, t_s: f64, now: Instant) {
        let (then, then_s) = *self.measured.get_or_insert((now, t_s));
        let wall_s = (now - then).as_secs_f64();
        if t_s < then_s {
            self.measured = Some((now, t_s));
        } else if wall_s >= 1.0 {
            self.achieved = Some((t_s - then_s) / wall_s);
            self.measured = Some((now, t_s));
        }
    }

    /// Leaves the live line where it is.
    pub(super) fn end(&mut self) {
        if !self.live.is_empty() {
            self.live.clear();
            // Nobody can be told that nobody listens.
            let _ = writeln!(io::stdout());
        }
    }
}

fn line(flight: &FlightStatus, passing: Passing, achieved: Option<f64>) -> String {
    let FlightStatus { plant, t_s, altitude_m, airspeed_m_s, roll_deg, mode, .. } = flight;
    let speed = passing.words(achieved);
    // Single steps are to be seen.
    let time = if passing.paused { format!("{t_s:11.3}") } else { format!("{t_s:9.1}") };
    let compensator = match (flight.compensator_active, flight.fade) {
        (false, fade) if fade <= 0.0 => "asleep".to_owned(),
        (true, fade) if fade <= 0.0 => "fault seen, off".to_owned(),
        (_, fade) => format!("ACTIVE {:.0} %", 100.0 * fade),
    };
    let plant = match plant {
        PlantState::Flying => "",
        PlantState::OnGround => "   ON THE GROUND",
        PlantState::Lost => "   PLANT LOST",
    };
    format!(
        "t {time} s   altitude {altitude_m:6.0} m   speed {airspeed_m_s:6.1} m/s   roll {roll_deg:6.1} deg   \
         compensator {compensator}   {mode}   {speed}{plant}"
    )
}

/// Empty if there can be no ground station.
fn introduction(ground_stations: &Listening) -> String {
    let Listening { clients, udp_server, tcp_server } = ground_stations;
    let called = clients.iter().map(|station| format!("udp {station}"));
    let called: Vec<String> = called.collect();
    let udp = udp_server.map(|port| format!("udp {port}"));
    let tcp = tcp_server.map(|port| format!("tcp {port}"));
    let awaited: Vec<String> = udp.into_iter().chain(tcp).collect();
    let mut lines = Vec::new();
    if !called.is_empty() {
        lines.push(format!("ground stations  called at {}", called.join(", ")));
    }
    if !awaited.is_empty() {
        lines.push(format!("ground stations  may connect to {}", awaited.join(", ")));
    }
    // Whoever calls has to speak first.
    let (connect, greeting) = match (clients.last(), udp_server, tcp_server) {
        (Some(last), _, _) => (format!("udpin:{last}"), ""),
        (None, _, Some(port)) => (format!("tcp:{port}"), ""),
        (None, Some(port), None) => {
            (format!("udpout:{port}"), "c.mav.heartbeat_send(6, 8, 0, 0, 0); ")
        }
        (None, None, None) => return String::new(),
    };
    lines.push(format!(
        "break something  python3 -c \"from pymavlink import mavutil as u; c = u.mavlink_connection('{connect}'); \
{greeting}c.wait_heartbeat(); c.mav.command_long_send(1, 1, 31010, 0, 102, 2, 3, 1, 30, 0, 0)\"
                 (servo 3, the left elevator, jams at 30 deg; 1 2 ailerons, 4 right elevator, 5 rudder, 6 7 nozzle)
end              Ctrl-C"
    ));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::SocketAddr;

    #[test]
    fn the_introduction_names_every_way_to_connect_and_one_that_works() {
        let at = |port| SocketAddr::from(([127, 0, 0, 1], port));
        let mut listening = Listening {
            clients: vec![at(14_550), at(14_540)],
            udp_server: Some(at(18_570)),
            tcp_server: Some(at(5_760)),
        };
        let words = introduction(&listening);
        assert!(words.contains("called at udp 127.0.0.1:14550, udp 127.0.0.1:14540"), "{words}");
        assert!(words.contains("connect to udp 127.0.0.1:18570, tcp 127.0.0.1:5760"), "{words}");
        assert!(words.contains("'udpin:127.0.0.1:14540'"), "{words}");
        listening.clients.clear();
        assert!(introduction(&listening).contains("'tcp:127.0.0.1:5760'"));
        listening.tcp_server = None;
        let words = introduction(&listening);
        assert!(words.contains("'udpout:127.0.0.1:18570'") && words.contains("heartbeat_send"));
        assert_eq!(introduction(&Listening::default()), "");
    }

    #[test]
    fn the_line_tells_a_switched_off_compensator_from_a_sleeping_one() {
        let mut flight = FlightStatus {
            plant: PlantState::Flying,
            t_s: 12.34,
            altitude_m: 5_000.4,
            airspeed_m_s: 264.0,
            roll_deg: -0.25,
            compensator_active: false,
            fade: 0.0,
            mode: "Hold".to_owned(),
        };
        let expected = "t      12.3 s   altitude   5000 m   speed  264.0 m/s   roll   -0.2 deg   \
                        compensator asleep   Hold   x1.0";
        let running = Passing { paused: false, speed: Some(1.0) };
        assert_eq!(line(&flight, running, None), expected);
        flight.compensator_active = true;
        assert!(line(&flight, running, None).contains("compensator fault seen, off"));
        flight.fade = 0.5;
        assert!(line(&flight, running, None).contains("compensator ACTIVE 50 %"));
        let paused = line(&flight, Passing { paused: true, speed: None }, None);
        assert!(paused.starts_with("t      12.340 s ") && paused.ends_with("PAUSED"), "{paused}");
    }
}
