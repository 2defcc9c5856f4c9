//! The flight as lines of text: what is known, a width and a height in, lines out.

use std::collections::VecDeque;

use autopilot::io::status::{FaultStatus, FlightStatus, Listening, PlantState};
use icd::fault::FaultState;

use super::text::{self, Advice, cut, fields};
use crate::launch::keys::{self, PaceState};

/// Messages of the two processes that are remembered.
const MESSAGES_MAX: usize = 100;
/// Rows that one message takes, with a blank line and the heading before it.
const MESSAGES_ROWS: usize = 3;
/// Faults on the screen; of more only their number is shown.
const FAULTS_MAX: usize = 3;
/// Place of the values behind their names.
const VALUES: usize = 12;

/// How a line is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Heading,
    /// It is as it should be.
    Good,
    /// Something is wrong, and is coped with.
    Warning,
    /// The flight is over or in danger.
    Alarm,
}

/// A line of the screen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) text: String,
    pub(super) tone: Tone,
}

/// What is known of the flight.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) flight: Option<FlightStatus>,
    pub(super) pace: PaceState,
    /// Simulation time per wall time, once it has been measured.
    pub(super) achieved: Option<f64>,
    /// Where ground stations can be, once it is known.
    pub(super) stations: Option<Listening>,
    pub(super) advice: Option<Advice>,
    /// There is a keyboard.
    pub(super) keys: bool,
    messages: VecDeque<String>,
}

impl State {
    pub(super) fn new(pace: PaceState) -> Self {
        let messages = VecDeque::with_capacity(MESSAGES_MAX);
        Self {
            flight: None,
            pace,
            achieved: None,
            stations: None,
            advice: None,
            keys: false,
            messages,
        }
    }

    /// Remembers a message; of too many the oldest is forgotten.
    pub(super) fn message(&mut self, message: &str) {
        for line in message.lines() {
            if self.messages.len() == MESSAGES_MAX {
                self.messages.pop_front();
            }
            self.messages.push_back(line.to_owned());
        }
    }

    /// The messages that are remembered, oldest first.
    pub(super) fn messages(&self) -> impl Iterator<Item = &str> {
        self.messages.iter().map(String::as_str)
    }

    /// The screen: at most `height` lines, none wider than `width`. What is most needed in flight comes first; where
    /// the height does not suffice, messages give way, then the lines about connecting.
    pub(super) fn lines(&self, width: usize, height: usize) -> Vec<Line> {
        let mut lines = self.title(width);
        if let Some(flight) = &self.flight {
            lines.extend(values(flight, width));
            lines.extend(compensator(flight, width));
            lines.extend(faults(flight, width));
        }
        let keys = if self.keys { keys_line(width) } else { Vec::new() };
        let help = self
            .stations
            .as_ref()
            .map_or_else(Vec::new, |stations| help(stations, self.advice.as_ref(), width));
        if height >= lines.len() + help.len() + keys.len() {
            lines.extend(help);
        }
        let room = height.saturating_sub(lines.len() + keys.len());
        if room >= MESSAGES_ROWS {
            lines.push(line(Tone::Plain, String::new()));
            lines.push(line(Tone::Heading, cut("Messages", width)));
            let newest = self.messages.len().saturating_sub(room - 2);
            for message in self.messages.iter().skip(newest) {
                let text = cut(&format!("  {message}"), width);
                lines.push(line(tone_of(message), text));
            }
        }
        let until_keys = height.saturating_sub(keys.len());
        lines.truncate(until_keys);
        lines.resize_with(until_keys, || line(Tone::Plain, String::new()));
        lines.extend(keys);
        lines.truncate(height);
        lines
    }

    fn title(&self, width: usize) -> Vec<Line> {
        let Some(flight) = &self.flight else {
            return row(Tone::Heading, "Two-Step", &["waiting for the aircraft".to_owned()], width);
        };
        let t_s = flight.t_s;
        // Single steps are to be seen.
        let time = if self.pace.paused { format!("{t_s:.3} s") } else { format!("{t_s:.1} s") };
        let (tone, state) = match flight.plant {
            PlantState::Flying => (Tone::Heading, "flying"),
            PlantState::Terminated => (Tone::Alarm, "FLIGHT TERMINATED"),
            PlantState::OnGround => (Tone::Alarm, "ON THE GROUND"),
            PlantState::Lost => (Tone::Alarm, "PLANT LOST"),
        };
        let speed = self.pace.text(self.achieved);
        row(tone, "Two-Step", &[state.to_owned(), flight.mode.clone(), time, speed], width)
    }
}

fn line(tone: Tone, text: String) -> Line {
    Line { text, tone }
}

/// Flows fields behind a name over as many lines as they need.
fn row(tone: Tone, name: &str, values: &[String], width: usize) -> Vec<Line> {
    fields(&format!("{name:<VALUES$}"), values, width).into_iter().map(|t| line(tone, t)).collect()
}

/// Values and what they are to be.
fn values(flight: &FlightStatus, width: usize) -> Vec<Line> {
    let references = &flight.references;
    let rows = [
        ("altitude", flight.altitude_m, references.altitude_m, 0, "m"),
        ("true speed", flight.airspeed_m_s, references.airspeed_m_s, 1, "m/s"),
        ("roll", flight.roll_deg, references.roll_deg, 1, "deg"),
    ];
    let rows = rows.map(|(name, value, reference, digits, unit)| {
        let (value, reference) = (without_sign(value, digits), without_sign(reference, digits));
        let now = format!("{value:8.digits$} {unit:<4}");
        let wanted = format!("reference {reference:8.digits$} {unit}");
        row(Tone::Plain, name, &[now, wanted], width)
    });
    rows.into_iter().flatten().collect()
}

/// What is shown as zero has no sign.
fn without_sign(value: f64, digits: usize) -> f64 {
    let is_shown_as_zero = value.abs() < 0.5 * 0.1_f64.powi(i32::try_from(digits).unwrap_or(0));
    if is_shown_as_zero { 0.0 } else { value }
}

/// The compensator's state in words, and how serious it is.
pub(super) fn compensator_text(flight: &FlightStatus) -> (Tone, String) {
    match (flight.compensator_off, flight.compensator_active) {
        _ if flight.fade > 0.0 => (Tone::Warning, format!("ACTIVE {:.0} %", 100.0 * flight.fade)),
        (true, false) => (Tone::Plain, "off".to_owned()),
        (true, true) => (Tone::Warning, "fault seen, off".to_owned()),
        (false, false) => (Tone::Good, "asleep".to_owned()),
        (false, true) => (Tone::Warning, "fault seen".to_owned()),
    }
}

fn compensator(flight: &FlightStatus, width: usize) -> Vec<Line> {
    let (tone, words) = compensator_text(flight);
    let level = format!("estimate {:.2} of its level", flight.level);
    let mut lines = row(tone, "compensator", &[format!("{words:<16}"), level], width);
    let uses = &flight.compensation;
    let mut uses = vec![
        format!("ailerons {:5.1} deg", without_sign(uses.aileron_deg, 1)),
        format!("nozzle {:5.1} deg pitch", without_sign(uses.nozzle_pitch_deg, 1)),
        format!("{:5.1} deg yaw", without_sign(uses.nozzle_yaw_deg, 1)),
    ];
    if !flight.has_nozzle {
        uses.truncate(1);
    }
    lines.extend(row(Tone::Plain, "  adds", &uses, width));
    let least = flight.authority_pct.iter().copied().fold(f64::INFINITY, f64::min);
    let tone = if least < AUTHORITY_LOW_PCT { Tone::Warning } else { Tone::Plain };
    let left = ["roll", "pitch", "yaw"].into_iter().zip(flight.authority_pct);
    let left: Vec<String> = left.map(|(axis, left)| format!("{axis} {left:3.0} %")).collect();
    lines.extend(row(tone, "authority", &left, width));
    lines
}

/// Less than this left on an axis is shown as a warning, percent.
const AUTHORITY_LOW_PCT: f64 = 10.0;

/// A fault and where it stands.
pub(super) fn fault_text(fault: &FaultStatus) -> String {
    let FaultStatus { what, state } = fault;
    let at_s = state.next_onset().unwrap_or_else(|| state.time()).as_seconds();
    match state {
        FaultState::Scheduled { .. } => format!("{what}, from {at_s:.1} s on"),
        FaultState::Resting { .. } => format!("{what}, again at {at_s:.1} s"),
        _ => format!("{what}, since {at_s:.1} s"),
    }
}

fn faults(flight: &FlightStatus, width: usize) -> Vec<Line> {
    if flight.faults.is_empty() {
        return row(Tone::Good, "faults", &["none".to_owned()], width);
    }
    let mut words: Vec<String> = flight.faults.iter().take(FAULTS_MAX).map(fault_text).collect();
    let more = flight.faults.len() - words.len() + flight.more_faults;
    if more > 0
        && let Some(last) = words.last_mut()
    {
        last.push_str(&format!(" (and {more} more)"));
    }
    let name = |n: usize| if n == 0 { "faults" } else { "" };
    let rows = words.iter().enumerate();
    rows.flat_map(|(n, fault)| row(Tone::Warning, name(n), std::slice::from_ref(fault), width))
        .collect()
}

/// Where to connect and how to break something: each command is a line of its own.
fn help(stations: &Listening, advice: Option<&Advice>, width: usize) -> Vec<Line> {
    let parts = text::parts(stations, advice);
    let mut lines = Vec::new();
    if !parts.is_empty() {
        lines.push(line(Tone::Plain, String::new()));
    }
    for part in &parts {
        lines.extend(
            fields("", std::slice::from_ref(&part.heading), width)
                .into_iter()
                .map(|t| line(Tone::Heading, t)),
        );
        for command in &part.commands {
            lines.extend(command.lines(width).into_iter().map(|t| line(Tone::Plain, t)));
        }
    }
    lines
}

fn keys_line(width: usize) -> Vec<Line> {
    let keys: Vec<String> = keys::HELP.iter().map(|key| (*key).to_owned()).collect();
    fields("", &keys, width).into_iter().map(|text| line(Tone::Heading, text)).collect()
}

fn tone_of(message: &str) -> Tone {
    if message.contains("ERROR") {
        Tone::Alarm
    } else if message.contains("WARN") {
        Tone::Warning
    } else {
        Tone::Plain
    }
}

#[cfg(test)]
pub(super) mod tests;
