//! The flight as lines of text: what is known, a width and a height in, lines out; and lines that can be copied: where to connect and
//! how to break something.

use std::collections::VecDeque;

use autopilot::io::status::{FaultStatus, FlightStatus, Listening, PlantState};
use host_io::console;
use icd::fault::FaultState;
use icd::{Effector, EffectorKind};
use plant_sim::Airframe;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

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
#[derive(Debug, Clone, Default)]
pub(super) struct ScreenState {
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

impl ScreenState {
    pub(super) fn new(pace: PaceState) -> Self {
        Self { pace, ..Self::default() }
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
        // All of it or nothing: a heading without its command helps nobody.
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
        // A screen with fewer rows than the keys need shows the first of them.
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
fn flow(tone: Tone, name: &str, values: &[String], width: usize) -> Vec<Line> {
    fields(name, values, width).into_iter().map(|text| line(tone, text)).collect()
}

/// The same, with the values in their column.
fn row(tone: Tone, name: &str, values: &[String], width: usize) -> Vec<Line> {
    flow(tone, &format!("{name:<VALUES$}"), values, width)
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
    // A value near zero would flicker between 0 and -0.
    let is_shown_as_zero = value.abs() < 0.5 * 0.1_f64.powi(i32::try_from(digits).unwrap_or(0));
    if is_shown_as_zero { 0.0 } else { value }
}

/// The compensator's state in words, and how serious it is.
pub(super) fn compensator_text(flight: &FlightStatus) -> (Tone, String) {
    match (flight.compensator_off, flight.compensator_active) {
        // First: one that was switched off still moves surfaces until it has faded.
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
    let adds = flight.adds.iter().map(|(kind, deg)| {
        format!("{} {:5.1}", kind.key().replace('_', " "), without_sign(*deg, 1))
    });
    let mut adds: Vec<String> = adds.collect();
    if adds.is_empty() {
        adds.push("nothing".to_owned());
    }
    lines.extend(row(Tone::Plain, "  adds, deg", &adds, width));
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
    // The report leaves some out as well, and says how many.
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
    let parts = parts(stations, advice);
    let mut lines = Vec::new();
    if !parts.is_empty() {
        lines.push(line(Tone::Plain, String::new()));
    }
    for part in &parts {
        lines.extend(flow(Tone::Heading, "", std::slice::from_ref(&part.heading), width));
        for command in &part.commands {
            lines.extend(command.lines(width).into_iter().map(|t| line(Tone::Plain, t)));
        }
    }
    lines
}

fn keys_line(width: usize) -> Vec<Line> {
    let keys: Vec<String> = keys::HELP.iter().map(|key| (*key).to_owned()).collect();
    flow(Tone::Heading, "", &keys, width)
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

const INDENT: &str = "  ";
/// Where a command of a shell goes on in the next line.
const GOES_ON: &str = " \\";

/// What to break of this aircraft: an elevator, or else its first surface.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Advice {
    name: String,
    /// MAVLink number of its servo.
    servo: u8,
    /// Where it sticks, deg, within its travel.
    angle_deg: f64,
    is_elevator: bool,
}

/// What `gcs-scripts/break_elevator.py` breaks without options.
const OF_THE_SCRIPT: (u8, f64) = (3, 30.0);

impl Advice {
    /// For an aircraft; `None` for one without surfaces.
    pub(crate) fn of(airframe: &Airframe) -> Option<Self> {
        let list = &airframe.effectors;
        let is_surface = |e: &Effector| list.kind(*e).is_some_and(EffectorKind::is_surface);
        let elevator = list.of_kind(EffectorKind::Elevator).next();
        let effector = elevator.or_else(|| list.all().find(is_surface))?;
        let servo = list.instance(effector);
        // The script's own angle; where the surface cannot go so far, the end of its travel.
        // Whole degrees, and never beyond the travel: 25 deg in radians and back may fall short by a bit.
        let max_deg = airframe.servos[effector].max.to_degrees();
        let angle_deg = (max_deg.min(OF_THE_SCRIPT.1) + 1.0e-9).floor();
        let name = list.name(effector).to_owned();
        Some(Self { name, servo, angle_deg, is_elevator: elevator.is_some() })
    }

    fn part(&self, option: &str) -> Part {
        let Self { name, servo, angle_deg, is_elevator } = self;
        let (number, angle) = OF_THE_SCRIPT;
        let angle =
            if *angle_deg == angle { String::new() } else { format!(" --angle {angle_deg}") };
        let servo_option =
            if *servo == number { String::new() } else { format!(" --servo {servo}") };
        let script = format!("python3 gcs-scripts/break_elevator.py{option}{servo_option}{angle}");
        // The script breaks elevators only.
        let script = is_elevator.then_some(Command::Shell(script));
        let consoles = [
            format!("fail {name} stuck at {angle_deg} deg"),
            // Unit servo, type stuck, its number, kind "stuck at", angle (docs/commands.md).
            format!("long USER_1 102 2 {servo} 1 {angle_deg} 0 0"),
        ];
        Part {
            heading: format!("Break the {name} (shell, MAVLink console, MAVProxy):"),
            commands: script.into_iter().chain(consoles.map(Command::Console)).collect(),
        }
    }
}

/// A heading and the commands that belong to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) heading: String,
    pub(super) commands: Vec<Command>,
}

/// A line to be copied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Command {
    Shell(String),
    /// For a console of a ground station.
    Console(String),
}

impl Command {
    /// In one line where that fits; a shell takes it also in several.
    pub(super) fn lines(&self, width: usize) -> Vec<String> {
        match self {
            Self::Console(text) => vec![cut(&format!("{INDENT}{text}"), width)],
            Self::Shell(text) => shell_lines(text, width),
        }
    }

    fn text(&self) -> &str {
        match self {
            Self::Shell(text) => text,
            Self::Console(text) => text,
        }
    }
}

fn shell_lines(text: &str, width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = INDENT.to_owned();
    let mut words = text.split(' ').peekable();
    while let Some(word) = words.next() {
        let reserve = if words.peek().is_some() { GOES_ON.len() } else { 0 };
        let is_first = line.len() == INDENT.len();
        if !is_first && columns(&line) + 1 + columns(word) + reserve > width {
            line.push_str(GOES_ON);
            lines.push(std::mem::replace(&mut line, format!("{INDENT}{word}")));
        } else {
            line.push_str(if is_first { "" } else { " " });
            line.push_str(word);
        }
    }
    lines.push(line);
    lines.iter().map(|line| cut(line, width)).collect()
}

/// How to reach the aircraft and how to break it; empty if there can be no ground station.
pub(super) fn parts(stations: &Listening, advice: Option<&Advice>) -> Vec<Part> {
    let Listening { clients, udp_server, tcp_server } = stations;
    // Of two addresses that are called the first is the one of ground stations, the second that of programs.
    let station = match (clients.first(), tcp_server, udp_server) {
        (Some(first), _, _) => format!("udpin:{first}"),
        (None, Some(port), _) => format!("tcp:{port}"),
        (None, None, Some(port)) => format!("udpout:{port}"),
        (None, None, None) => return Vec::new(),
    };
    let program =
        clients.get(1).map_or_else(|| station.clone(), |second| format!("udpin:{second}"));
    let is_default = program == DEFAULT_CONNECT;
    let option = if is_default { String::new() } else { format!(" --connect {program}") };
    let qgc = if clients.iter().any(|at| at.port() == QGROUNDCONTROL_PORT) {
        "Connect: QGroundControl does so by itself. MAVProxy:"
    } else {
        "Connect with MAVProxy:"
    };
    let connect = Part {
        heading: qgc.to_owned(),
        commands: vec![Command::Shell(format!("mavproxy.py --master={station}"))],
    };
    [connect].into_iter().chain(advice.map(|advice| advice.part(&option))).collect()
}

const QGROUNDCONTROL_PORT: u16 = 14_550;
/// Where `gcs-scripts/break_elevator.py` listens without options.
const DEFAULT_CONNECT: &str = "udpin:127.0.0.1:14540";

/// The same as plain lines, with the other addresses.
pub(super) fn plain_lines(stations: &Listening, advice: Option<&Advice>) -> Vec<String> {
    let Listening { clients, udp_server, tcp_server } = stations;
    let called: Vec<String> = clients.iter().map(|station| format!("udp {station}")).collect();
    let udp = udp_server.map(|port| format!("udp {port}"));
    let awaited: Vec<String> =
        udp.into_iter().chain(tcp_server.map(|port| format!("tcp {port}"))).collect();
    let mut lines = Vec::new();
    if !called.is_empty() {
        lines.push(format!("ground stations  called at {}", called.join(", ")));
    }
    if !awaited.is_empty() {
        lines.push(format!("ground stations  may connect to {}", awaited.join(", ")));
    }
    for part in parts(stations, advice) {
        lines.push(part.heading);
        lines.extend(part.commands.iter().map(|command| format!("{INDENT}{}", command.text())));
    }
    if !lines.is_empty() {
        lines.push("End: Ctrl-C".to_owned());
    }
    lines
}

const GAP: &str = "   ";

/// The columns that a text takes on a terminal.
pub(super) fn columns(text: &str) -> usize {
    text.width()
}

/// The text in at most `width` columns, with a sign where it was cut. What would move the cursor is left out.
pub(super) fn cut(text: &str, width: usize) -> String {
    let shown: String = text.chars().filter(|c| console::is_shown(*c)).collect();
    if columns(&shown) <= width {
        return shown;
    }
    // One column is kept for the sign.
    let (mut short, mut used) = (String::new(), 1);
    for c in shown.chars() {
        used += c.width().unwrap_or(0);
        if used > width {
            break;
        }
        short.push(c);
    }
    if width > 0 {
        short.push('~');
    }
    short
}

/// Fields behind a name. Those that do not fit go on in lines below, indented as deep as the name is long; where the
/// screen is too narrow for that, by two columns.
pub(super) fn fields(name: &str, fields: &[String], width: usize) -> Vec<String> {
    let widest = fields.iter().map(|field| columns(field.trim_end())).max().unwrap_or(0);
    let is_narrow = columns(name) + widest > width;
    let (mut lines, mut line, mut is_empty) = (Vec::new(), name.to_owned(), true);
    let indent = if is_narrow { "  ".to_owned() } else { " ".repeat(columns(name)) };
    if is_narrow && !name.trim().is_empty() {
        lines.push(cut(name.trim_end(), width));
        line.clone_from(&indent);
    }
    for field in fields {
        let gap = if is_empty { "" } else { GAP };
        if !is_empty && columns(&line) + gap.len() + columns(field.trim_end()) > width {
            lines.push(cut(line.trim_end(), width));
            line.clone_from(&indent);
        } else {
            line.push_str(gap);
        }
        line.push_str(field);
        is_empty = false;
    }
    lines.push(cut(line.trim_end(), width));
    lines
}

#[cfg(test)]
pub(super) mod tests;

#[cfg(test)]
mod text_tests {
    use super::*;
    use plant_sim::ReadAirframe as _;
    use std::net::SocketAddr;

    fn at(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    #[test]
    fn the_introduction_names_every_address_and_a_way_that_works() {
        let mut listening = Listening {
            clients: vec![at(14_550), at(14_540)],
            udp_server: Some(at(18_570)),
            tcp_server: Some(at(5_760)),
        };
        let advice = Advice::of(&Airframe::paper());
        let words = |listening: &Listening| plain_lines(listening, advice.as_ref()).join("\n");
        let all = words(&listening);
        assert!(all.contains("called at udp 127.0.0.1:14550, udp 127.0.0.1:14540"), "{all}");
        assert!(all.contains("connect to udp 127.0.0.1:18570, tcp 127.0.0.1:5760"), "{all}");
        assert!(all.contains("--master=udpin:127.0.0.1:14550\n"), "{all}");
        assert!(all.contains("break_elevator.py\n"), "the default needs no option: {all}");
        listening.clients = vec![at(9_000)];
        let all = words(&listening);
        assert!(all.contains("break_elevator.py --connect udpin:127.0.0.1:9000\n"), "{all}");
        assert!(!all.contains("by itself"), "nobody calls QGroundControl: {all}");
        listening.clients.clear();
        assert!(words(&listening).contains("--connect tcp:127.0.0.1:5760"));
        listening.tcp_server = None;
        assert!(words(&listening).contains("--connect udpout:127.0.0.1:18570"));
        assert!(plain_lines(&Listening::default(), None).is_empty());
    }

    #[test]
    fn what_is_advised_can_be_broken_on_every_aircraft() {
        let of = |name: &str| {
            let shipped = aircraft::AIRFRAMES;
            let (_, text) = shipped.iter().find(|(known, _)| *known == name).unwrap();
            Advice::of(&Airframe::from_toml(name, text).unwrap()).unwrap().part("")
        };
        let lines =
            |name| of(name).commands.iter().map(|c| c.text().to_owned()).collect::<Vec<_>>();
        let jet = [
            "python3 gcs-scripts/break_elevator.py",
            "fail left elevator stuck at 30 deg",
            "long USER_1 102 2 3 1 30 0 0",
        ];
        assert_eq!(lines("tvc_jet"), jet);
        assert_eq!(lines("f16")[0], "python3 gcs-scripts/break_elevator.py --angle 25");
        assert!(of("aerosonde").heading.contains("elevator"));
        let text = aircraft::AEROSONDE_AIRFRAME.replace("instance = 3", "instance = 7");
        let other =
            Advice::of(&Airframe::from_toml("other.toml", &text).unwrap()).unwrap().part("");
        let other: Vec<&str> = other.commands.iter().map(Command::text).collect();
        assert_eq!(
            other,
            [
                "python3 gcs-scripts/break_elevator.py --servo 7 --angle 25",
                "fail left elevator stuck at 25 deg",
                "long USER_1 102 2 7 1 25 0 0",
            ]
        );
        // A flying wing has no elevator.
        let text = aircraft::AEROSONDE_AIRFRAME;
        let text = text.replace("kind = \"elevator\"", "kind = \"rudder\"");
        let wing = Advice::of(&Airframe::from_toml("wing.toml", &text).unwrap()).unwrap().part("");
        assert!(wing.heading.starts_with("Break the left aileron"), "{}", wing.heading);
        assert!(wing.commands.iter().all(|command| !command.text().contains("break_elevator")));
    }

    #[test]
    fn a_shell_takes_a_command_in_several_lines() {
        let command = Command::Shell("mavproxy.py --master=udpin:127.0.0.1:14550".to_owned());
        assert_eq!(command.lines(44), ["  mavproxy.py --master=udpin:127.0.0.1:14550"]);
        let lines = ["  mavproxy.py \\", "  --master=udpin:127.0.0.1:14550"];
        assert_eq!(command.lines(43), lines);
    }

    #[test]
    fn a_text_that_is_too_long_is_cut_and_marked() {
        assert_eq!(cut("altitude", 8), "altitude");
        assert_eq!(cut("altitude", 7), "altitu~");
        assert_eq!(cut("altitude", 1), "~");
        assert_eq!(cut("altitude", 0), "");
        assert_eq!(cut("a\x1b[2Jb\r\n", 10), "a[2Jb", "nothing moves the cursor");
        assert_eq!(
            cut("\u{98db}\u{884c}\u{6a5f}", 5),
            "\u{98db}\u{884c}~",
            "wide letters take two columns"
        );
    }

    #[test]
    fn fields_go_on_below_their_first() {
        let values = ["roll 10".to_owned(), "pitch 20".to_owned()];
        assert_eq!(fields("left  ", &values, 24), ["left  roll 10   pitch 20"]);
        assert_eq!(fields("left  ", &values, 23), ["left  roll 10", "      pitch 20"]);
        assert_eq!(fields("left  ", &values, 12), ["left", "  roll 10", "  pitch 20"]);
        assert_eq!(fields("left  ", &values, 8), ["left", "  roll ~", "  pitch~"]);
    }
}
