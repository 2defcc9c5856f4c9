//! Scripts of faults and events: a short readable text of the events of a flight and their times.
//!
//! ```text
//!  text ─> words ─> parser ─> Script ─┐
//!                                     v
//!        time, sensors ────────────> Run ─> actions (fault requests, references, modes, texts)
//! ```
//!
//! A script is separate from the laws and the vehicle: its lines are executed like commands of a ground
//! station. It sees simulation time and sensor values only, so a script that is started at the same tick does the same
//! each time, to the bit. `docs/scripts.md` describes the language.

use core::f64::consts::PI;
use core::fmt;
use std::sync::Arc;

use flight_control::NavigationState;
use icd::fault::{NO_ANSWER, Refusal, Target, TargetClass};
use icd::units::{DEG, STANDARD_GRAVITY_M_S2};
use icd::{EffectorList, FaultRequest, SimTime};
use serde::{Deserialize, Serialize};

use crate::TextError;
use crate::vehicle::{Mode, Reference, VehicleRefusal};

mod parser;

/// Longest text, bytes.
pub const TEXT_MAX: usize = 16 * 1024;
/// Lines with an action that a script may have.
pub const LINES_MAX: usize = 256;
/// Sequences that a script may have, the first one included.
pub const SEQUENCES_MAX: usize = 16;

/// A valid script. Serialized, it is its name, its text and the effectors that it can
/// name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Text", into = "Text")]
pub struct Script {
    name: String,
    text: String,
    /// The effectors of its aircraft.
    effectors: EffectorList,
    id: u32,
    sequences: Vec<Sequence>,
}

/// Lines that run one after the other, in parallel with the other sequences.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Its name and the line of the text that names it, from 1; the first sequence may have none.
    pub name: Option<(u16, String)>,
    /// Its lines, in order.
    pub lines: Vec<Line>,
}

/// One line: an action and its trigger.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Number of the line in the text, from 1.
    pub number: u16,
    /// The line in plain form: one space between words, small letters, no comment.
    pub text: String,
    pub trigger: Trigger,
    pub action: Action,
}

/// The trigger of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trigger {
    /// None: the line acts together with the line before.
    AtOnce,
    /// This many microseconds after the start of the script; at once if they have passed.
    At(u64),
    /// This many microseconds after the line before.
    After(u64),
    /// A quantity crosses a value while the line is the next one.
    When(Condition),
}

/// The action of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Injects or clears a fault; goes to the plant like the request of a ground station.
    Fault(FaultRequest),
    Refer(Reference),
    Mode(Mode),
    /// Arms, or disarms.
    Arm(bool),
    /// Begins the landing.
    Land,
    /// Sends the text after `say` to the ground stations.
    Say,
    /// Ends the script with all its sequences.
    End,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Text {
    name: String,
    text: String,
    effectors: EffectorList,
}

impl Script {
    /// Reads a script for an aircraft with these effectors; messages call it `name`.
    pub fn parse(name: &str, text: &str, effectors: &EffectorList) -> Result<Self, TextError> {
        // Some editors put a byte order mark before the text.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let sequences = parser::sequences(text, effectors).map_err(|error| error.in_file(name))?;
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(name.as_bytes());
        // Keeps name and text apart: `a` and `bc` are not `ab` and `c`.
        hasher.update(&[0]);
        hasher.update(text.as_bytes());
        let id = hasher.finalize();
        let (name, text) = (name.to_owned(), text.to_owned());
        Ok(Self { name, text, effectors: *effectors, id, sequences })
    }

    /// The error for a text of more than [`TEXT_MAX`] bytes, of which `length` were read.
    pub fn too_long(name: &str, length: u64) -> TextError {
        parser::too_long(length).in_file(name)
    }

    /// Its name in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// The effectors of its aircraft.
    pub fn effectors(&self) -> &EffectorList {
        &self.effectors
    }

    /// Number that events use for it: a checksum of name and text.
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Its sequences; the first one has no name unless the text begins with one.
    pub fn sequences(&self) -> &[Sequence] {
        &self.sequences
    }

    pub fn lines(&self) -> impl Iterator<Item = &Line> {
        self.sequences.iter().flat_map(|sequence| &sequence.lines)
    }

    /// The line with this number in the text, if it has an action.
    pub fn line(&self, number: u16) -> Option<&Line> {
        self.lines().find(|line| line.number == number)
    }

    /// Whether it injects or clears a fault.
    pub fn has_faults(&self) -> bool {
        self.lines().any(|line| matches!(line.action, Action::Fault(_)))
    }

    /// Whether it changes references or the mode.
    pub fn steers(&self) -> bool {
        self.lines()
            .any(|line| !matches!(line.action, Action::Fault(_) | Action::Say | Action::End))
    }
}

/// The script in plain form, each line at its place in the text.
impl fmt::Display for Script {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut next = 1;
        let mut put = |f: &mut fmt::Formatter<'_>, number: u16, text: &str| {
            while next < number {
                writeln!(f)?;
                next += 1;
            }
            next += 1;
            writeln!(f, "{text}")
        };
        for sequence in &self.sequences {
            if let Some((number, name)) = &sequence.name {
                put(f, *number, &format!("sequence {name}"))?;
            }
            for line in &sequence.lines {
                put(f, line.number, &line.text)?;
            }
        }
        Ok(())
    }
}

impl TryFrom<Text> for Script {
    type Error = TextError;
    fn try_from(Text { name, text, effectors }: Text) -> Result<Self, TextError> {
        Self::parse(&name, &text, &effectors)
    }
}

impl From<Script> for Text {
    fn from(script: Script) -> Self {
        Self { name: script.name, text: script.text, effectors: script.effectors }
    }
}

impl Line {
    /// The text after `say`.
    pub fn words(&self) -> Option<&str> {
        matches!(self.action, Action::Say).then(|| parser::said_text(&self.text)).flatten()
    }
}

/// An event of a script, which [`Script::id`] identifies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScriptEvent {
    Began,
    /// It should have begun with the flight and has not.
    NotBegun(NotBegun),
    /// This line of its text was executed.
    Line(u16),
    /// This line was executed, and its command was refused.
    LineRefused {
        line: u16,
        why: LineRefusal,
    },
    /// Its last line is done.
    Done,
    /// It was stopped before its end: by a command, by another script, by the end of the flight.
    Stopped,
}

/// Why the script of a scenario does not begin with the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotBegun {
    /// The autopilot joined a flight in progress.
    JoinedInFlight,
    /// It injects faults, and fault injection is off.
    FaultInjectionOff,
}

/// Why the command of a line was not executed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineRefusal {
    Vehicle(VehicleRefusal),
    Plant {
        /// Target; `None` for all.
        target: Option<Target>,
        refusal: Refusal,
    },
    /// The plant has gone away before it answered.
    NoAnswer,
}

impl LineRefusal {
    /// In words, with the units of its target.
    pub fn described(&self, effectors: &EffectorList) -> String {
        match self {
            Self::Vehicle(refusal) => refusal.to_string(),
            Self::Plant { target, refusal } => {
                refusal.described(TargetClass::of_request(*target, effectors)).to_string()
            }
            Self::NoAnswer => NO_ANSWER.to_owned(),
        }
    }
}

/// A quantity of the flight, as the sensors report it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Roll angle, rad, positive right wing down.
    Roll,
    /// Pitch angle, rad, positive nose up.
    Pitch,
    /// Heading, rad from north.
    Heading,
    /// Altitude above the ellipsoid, m.
    Altitude,
    /// Climb rate, m/s, positive up.
    ClimbRate,
    /// True airspeed, m/s.
    Airspeed,
    /// Angle of attack, rad.
    Alpha,
    /// Sideslip, rad, positive with the wind from the right.
    Beta,
    /// Body rate p, rad/s.
    RollRate,
    /// Body rate q, rad/s.
    PitchRate,
    /// Body rate r, rad/s.
    YawRate,
    /// Normal load factor, g: 1 in level flight.
    LoadFactor,
    /// Simulation time since the start of the flight, s.
    Time,
}

/// Direction of a crossing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossing {
    /// Either way, from one side to the other.
    Passes,
    /// From at or below it to above it.
    RisesAbove,
    /// From at or above it to below it.
    FallsBelow,
}

/// A quantity that crosses a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    pub quantity: Quantity,
    pub crossing: Crossing,
    /// The value in the quantity's unit.
    pub value: f64,
}

/// One quantity in the language: its words, its unit with the factor to SI, its range in that unit, and its value in SI.
struct QuantityRow {
    words: &'static str,
    quantity: Quantity,
    unit: (&'static str, f64),
    range: (f64, f64),
    value: fn(&NavigationState) -> f64,
}

const fn row(
    words: &'static str,
    quantity: Quantity,
    unit: (&'static str, f64),
    range: (f64, f64),
    value: fn(&NavigationState) -> f64,
) -> QuantityRow {
    QuantityRow { words, quantity, unit, range, value }
}

/// All quantities. Of names with the same beginning, the longer one is first.
const QUANTITIES: [QuantityRow; 13] = [
    row("roll rate", Quantity::RollRate, ("deg/s", DEG), (-720.0, 720.0), |state| state.rates.x),
    row("pitch rate", Quantity::PitchRate, ("deg/s", DEG), (-720.0, 720.0), |state| state.rates.y),
    row("yaw rate", Quantity::YawRate, ("deg/s", DEG), (-720.0, 720.0), |state| state.rates.z),
    row("roll", Quantity::Roll, ("deg", DEG), (-180.0, 180.0), |state| state.attitude.phi),
    row("pitch", Quantity::Pitch, ("deg", DEG), (-90.0, 90.0), |state| state.attitude.theta),
    row("heading", Quantity::Heading, ("deg", DEG), (0.0, 360.0), |state| state.attitude.psi),
    row("altitude", Quantity::Altitude, ("m", 1.0), (0.0, 30_000.0), |state| state.altitude_m),
    row("climb rate", Quantity::ClimbRate, ("m/s", 1.0), (-1_000.0, 1_000.0), |state| {
        state.climb_rate_m_s()
    }),
    row("airspeed", Quantity::Airspeed, ("m/s", 1.0), (0.0, 1_000.0), |state| state.airspeed_m_s),
    row("alpha", Quantity::Alpha, ("deg", DEG), (-180.0, 180.0), |state| state.alpha),
    row("beta", Quantity::Beta, ("deg", DEG), (-180.0, 180.0), |state| state.beta),
    row("load factor", Quantity::LoadFactor, ("g", 1.0), (-50.0, 50.0), |state| {
        -state.specific_force.0.z / STANDARD_GRAVITY_M_S2
    }),
    row("time", Quantity::Time, ("s", 1.0), (0.0, SimTime::MAX_SECONDS), |state| {
        state.time.as_seconds()
    }),
];

impl Quantity {
    pub fn value(self, state: &NavigationState) -> f64 {
        let row = QUANTITIES.iter().find(|row| row.quantity == self);
        row.map_or(0.0, |row| (row.value)(state))
    }

    /// Angles that wrap around.
    const fn is_circular(self) -> bool {
        matches!(self, Self::Roll | Self::Heading | Self::Alpha | Self::Beta)
    }
}

impl Condition {
    /// How far the quantity exceeds the value now; for an angle the shorter way round.
    pub fn excess(&self, state: &NavigationState) -> f64 {
        let difference = self.quantity.value(state) - self.value;
        if self.quantity.is_circular() { libm::remainder(difference, 2.0 * PI) } else { difference }
    }

    /// The excess to compare with at the next tick. A quantity exactly at the value has not passed it yet.
    pub fn remembered(&self, before: f64, now: f64) -> f64 {
        if self.crossing == Crossing::Passes && now == 0.0 { before } else { now }
    }

    /// Whether the value was crossed between two ticks, by the earlier and the present [`Condition::excess`]. An angle
    /// that wraps around, opposite to the value, has not crossed it.
    pub fn is_crossed(&self, before: f64, now: f64) -> bool {
        if self.quantity.is_circular() && (now - before).abs() > PI {
            return false;
        }
        let rises = before <= 0.0 && now > 0.0;
        let falls = before >= 0.0 && now < 0.0;
        match self.crossing {
            // From exactly at the value there is no other side yet.
            Crossing::Passes => rises && before < 0.0 || falls && before > 0.0,
            Crossing::RisesAbove => rises,
            Crossing::FallsBelow => falls,
        }
    }
}

/// A running script. It begins with the first tick at which it is stepped.
#[derive(Debug, Clone)]
pub struct Run {
    script: Arc<Script>,
    began: Option<SimTime>,
    /// One for each sequence.
    places: Vec<ScriptPlace>,
}

/// State of a sequence.
#[derive(Debug, Clone, Copy, Default)]
struct ScriptPlace {
    /// Index of the next line.
    next: usize,
    /// When the line before was executed, or the script began.
    since: SimTime,
    /// The excess of the line's condition at the latest tick.
    excess: Option<f64>,
    /// It was triggered, and waits for room in the queue to the plant.
    due: bool,
}

/// A line to execute now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Due {
    /// Its number in the text.
    pub line: u16,
    pub action: Action,
}

impl Run {
    pub fn new(script: Arc<Script>) -> Self {
        let places = vec![ScriptPlace::default(); script.sequences().len()];
        Self { script, began: None, places }
    }

    pub fn script(&self) -> &Arc<Script> {
        &self.script
    }

    /// The first line that is due at this tick and not executed yet; call it until there is none or enough
    /// were executed. The sequences follow in the order of the text. While `can_ask` is false, a line with a request to the
    /// plant waits, and its sequence with it.
    pub fn next(&mut self, state: &NavigationState, can_ask: bool) -> Option<Due> {
        self.look(state);
        for (sequence, place) in self.script.sequences().iter().zip(&mut self.places) {
            let Some(line) = sequence.lines.get(place.next) else { continue };
            if !place.due || matches!(line.action, Action::Fault(_)) && !can_ask {
                continue;
            }
            *place =
                ScriptPlace { next: place.next + 1, since: state.time, excess: None, due: false };
            let due = Due { line: line.number, action: line.action };
            // An end ends the sequences beside this one too.
            if due.action == Action::End {
                for (sequence, place) in self.script.sequences().iter().zip(&mut self.places) {
                    place.next = sequence.lines.len();
                }
            }
            return Some(due);
        }
        None
    }

    /// Evaluates the triggers of the next lines. A trigger at a tick is kept even if
    /// the line is executed later; a second evaluation at the same tick changes nothing.
    pub fn look(&mut self, state: &NavigationState) {
        let time = state.time;
        let began = *self.began.get_or_insert_with(|| {
            for place in &mut self.places {
                place.since = time;
            }
            time
        });
        for (sequence, place) in self.script.sequences().iter().zip(&mut self.places) {
            let Some(line) = sequence.lines.get(place.next) else { continue };
            place.due |= match line.trigger {
                Trigger::AtOnce => true,
                Trigger::At(micros) => time.micros_since(began) >= micros,
                Trigger::After(micros) => time.micros_since(place.since) >= micros,
                Trigger::When(condition) => {
                    let now = condition.excess(state);
                    // The first tick only tells on which side of the value the flight is.
                    let before = place.excess.unwrap_or(now);
                    place.excess = Some(condition.remembered(before, now));
                    condition.is_crossed(before, now)
                }
            };
        }
    }

    /// All lines are done.
    pub fn is_over(&self) -> bool {
        let mut sequences = self.script.sequences().iter().zip(&self.places);
        sequences.all(|(sequence, place)| place.next >= sequence.lines.len())
    }
}

#[cfg(test)]
mod tests;
