//! What the operator sees: lines, and below them one that follows the flight.

use std::io::{self, IsTerminal, Write};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use autopilot::io::status::{FlightStatus, PlantState, StatusLine};

/// Time between two lines where the output is no terminal.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Back to the start of the line, and clear it.
const CLEAR: &str = "\r\x1b[2K";

/// The operator's screen, or the file that stands for it.
pub(super) struct Screen {
    terminal: bool,
    live: String,
    shown: Option<(Instant, Change)>,
    pace: Option<(Instant, f64)>,
    speed: f64,
}

/// What makes a plain line worth printing before its time.
#[derive(Clone, Copy, PartialEq)]
struct Change {
    compensator_active: bool,
    plant: Option<PlantState>,
}

impl Screen {
    pub(super) fn new() -> Self {
        let terminal = io::stdout().is_terminal();
        Self { terminal, live: String::new(), shown: None, pace: None, speed: 1.0 }
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
    pub(super) fn introduce(&mut self, ground_stations: &[SocketAddr]) -> io::Result<()> {
        let Some(last) = ground_stations.last() else { return Ok(()) };
        let all: Vec<String> =
            ground_stations.iter().map(|station| format!("udp {station}")).collect();
        self.say(&format!(
            "ground stations  {}
break something  python3 -c \"from pymavlink import mavutil as u; c = u.mavlink_connection('udpin:{last}'); \
c.wait_heartbeat(); c.mav.command_long_send(1, 1, 31010, 0, 102, 2, 3, 1, 30, 0, 0)\"
                 (servo 3, the left elevator, jams at 30 deg; 1 2 ailerons, 4 right elevator, 5 rudder, 6 7 nozzle)
end              Ctrl-C",
            all.join(", ")
        ))
    }

    /// The flight now.
    pub(super) fn status(&mut self, status: &StatusLine, now: Instant) -> io::Result<()> {
        let flight = match status {
            StatusLine::Flight(flight) => flight,
            StatusLine::Listening { .. } | StatusLine::NoPlant => return Ok(()),
        };
        self.follow_pace(flight.t_s, now);
        let line = line(flight, self.speed);
        let change =
            Change { compensator_active: flight.compensator_active, plant: Some(flight.plant) };
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

    /// Simulation time per wall time over the last second or so.
    fn follow_pace(&mut self, t_s: f64, now: Instant) {
        let (then, then_s) = *self.pace.get_or_insert((now, t_s));
        let wall_s = (now - then).as_secs_f64();
        if t_s < then_s {
            self.pace = Some((now, t_s));
        } else if wall_s >= 1.0 {
            self.speed = (t_s - then_s) / wall_s;
            self.pace = Some((now, t_s));
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

fn line(flight: &FlightStatus, speed: f64) -> String {
    let FlightStatus { plant, t_s, altitude_m, airspeed_m_s, roll_deg, mode, .. } = flight;
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
        "t {t_s:9.1} s   altitude {altitude_m:6.0} m   speed {airspeed_m_s:6.1} m/s   roll {roll_deg:6.1} deg   \
         compensator {compensator}   {mode}   x{speed:.1}{plant}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(line(&flight, 1.0), expected);
        flight.compensator_active = true;
        assert!(line(&flight, 1.0).contains("compensator fault seen, off"));
        flight.fade = 0.5;
        assert!(line(&flight, 1.0).contains("compensator ACTIVE 50 %"));
    }
}
