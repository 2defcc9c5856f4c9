//! The parameters: every tunable of the autopilot, with name, unit, range and meaning from one table; the groups of them; and
//! their text for reading and editing, which has the values that differ from their defaults, as TOML. Their ranges and
//! defaults are in the table.

use core::fmt::{Display, Write as _};

use flight_control::compensator::neso::Lemma1Warning;
use flight_control::gains::GainError;
use flight_control::{AllocationMode, Gains, MainLaw};
use serde::{Deserialize, Serialize};

use crate::TextError;
use crate::own_law::OwnRole;
use crate::vehicle::LinkLossAction;
pub use crate::vehicle::{NavigationParameters, ReferenceLimits};

mod compatibility;
mod document;
mod failure;
mod table;

pub use compatibility::{
    COMPATIBILITY, COMPATIBILITY_GROUP, CompatibilityParameter, compatibility,
};
pub use document::document;
pub use failure::{
    FAULT_CHOICES, FailureParameters, FaultParameter, ParameterName, fault_of, fault_parameters,
    is_fault,
};
pub use table::{changes, nearest, table};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Gains of the laws.
    pub gains: Gains,
    /// References that are accepted.
    pub limits: ReferenceLimits,
    pub failure: FailureParameters,
    pub navigation: NavigationParameters,
    /// Silence of ground stations.
    pub link: LinkParameters,
    /// The switch that selects flight modes.
    pub mode_switch: ModeSwitchParameters,
    /// Rates of the streams.
    pub streams: StreamParameters,
    /// What a law that the program brings is for. Not a parameter; without it `CTL_LAW` 9 and `FTC_ALLOC` 9 are refused.
    pub brings_law: Option<OwnRole>,
}

impl Default for Parameters {
    /// The reference gains, and the defaults of the table.
    fn default() -> Self {
        let mut parameters = Self {
            gains: Gains::REFERENCE,
            limits: ReferenceLimits::default(),
            failure: FailureParameters::NONE,
            navigation: NavigationParameters::default(),
            link: LinkParameters::default(),
            mode_switch: ModeSwitchParameters::default(),
            streams: StreamParameters::default(),
            brings_law: None,
        };
        for row in table() {
            if let Some(default) = row.default {
                row.set(&mut parameters, default);
            }
        }
        parameters
    }
}

/// Wire type of a parameter in MAVLink.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// MAV_PARAM_TYPE_INT32.
    Int,
    /// MAV_PARAM_TYPE_REAL32.
    Real,
}

/// One value of a parameter that is a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    pub value: i32,
    pub label: &'static str,
}

/// One row of the parameter table.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name, at most 16 characters.
    pub name: &'static str,
    pub group: &'static str,
    pub kind: Kind,
    /// Unit; `-` for none.
    pub unit: &'static str,
    pub min: f64,
    pub max: f64,
    pub meaning: &'static str,
    /// Meaning of each value; empty for a number.
    pub choices: &'static [Choice],
    /// A change takes effect at the next start of the program, not at once.
    pub at_restart: bool,
    access: Access,
    /// `None` for what the gains of reference have.
    default: Option<f64>,
}

/// How a value is read and set.
#[derive(Debug, Clone, Copy)]
enum Access {
    Gain(fn(&Gains) -> f64, fn(&mut Gains, f64)),
    Own(fn(&Parameters) -> f64, fn(&mut Parameters, f64)),
    /// Place of a setting of a kind of fault.
    Fault(usize),
}

/// Why a parameter was not set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    #[error("there is no parameter {name}")]
    Unknown { name: String },
    #[error("{name} is read-only: it is there for ground stations and has no effect here")]
    ReadOnly { name: &'static str },
    /// A fault parameter of an effector.
    #[error(
        "{name} breaks an effector: a ground station sets it, only in flight, and nothing keeps it"
    )]
    OnlyInFlight { name: String },
    /// Not finite or outside the range.
    #[error("{name} = {value} is outside {min} to {max}{}", after(unit))]
    OutOfRange {
        name: &'static str,
        value: f64,
        min: f64,
        max: f64,
        /// Unit of the numbers.
        unit: &'static str,
    },
    /// Inside the range, but not one of the values of a choice.
    #[error("{name} = {value} is none of {}", values(choices))]
    NotAChoice { name: &'static str, value: f64, choices: &'static [Choice] },
    /// A fraction where whole numbers are allowed.
    #[error("{name} = {value} is no whole number from {min} to {max} {unit}")]
    NotWhole {
        name: &'static str,
        value: f64,
        min: f64,
        max: f64,
        /// Unit of the numbers.
        unit: &'static str,
    },
    /// A lower limit above its upper limit.
    #[error("{lower} = {low} {unit} is above {upper} = {high} {unit}")]
    Order { lower: &'static str, low: f64, upper: &'static str, high: f64, unit: &'static str },
    /// The program has no such law.
    #[error(
        "{0} = 9 is the law that a program brings, and this one brings none; docs/own-law.md says how"
    )]
    NoOwnLaw(&'static str),
    /// The set as a whole cannot be flown.
    #[error("{0}")]
    Gains(#[from] GainError),
}

/// The numbers of choices, for display.
fn values(choices: &[Choice]) -> String {
    let values: Vec<String> = choices.iter().map(|choice| choice.value.to_string()).collect();
    values.join(", ")
}

/// A unit after a range, if there is one.
fn after(unit: &str) -> String {
    if unit == "-" { String::new() } else { format!(" {unit}") }
}

impl Parameter {
    /// What most rows have in common.
    const NUMBER: Self = Self {
        name: "",
        group: "",
        kind: Kind::Real,
        unit: "-",
        min: 0.0,
        max: 0.0,
        meaning: "",
        choices: &[],
        at_restart: false,
        access: Access::Fault(0),
        default: None,
    };

    pub fn value(&self, parameters: &Parameters) -> f64 {
        match self.access {
            Access::Gain(get, _) => get(&parameters.gains),
            Access::Own(get, _) => get(parameters),
            Access::Fault(place) => parameters.failure.settings[place],
        }
    }

    /// Sets a value that is one of the allowed.
    fn set(&self, parameters: &mut Parameters, value: f64) {
        match self.access {
            Access::Gain(_, set) => set(&mut parameters.gains, value),
            Access::Own(_, set) => set(parameters, value),
            Access::Fault(place) => parameters.failure.settings[place] = value,
        }
    }

    pub fn default_value(&self) -> f64 {
        self.value(&Parameters::default())
    }
}

impl Parameters {
    /// Sets one parameter and checks the whole set.
    pub fn set(&mut self, name: &str, value: f64) -> Result<Option<Lemma1Warning>, ParameterError> {
        self.set_all([(name, value)])
    }

    /// Sets several parameters and checks the whole set, so that their order does not matter.
    pub fn set_all<'a>(
        &mut self,
        settings: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<Option<Lemma1Warning>, ParameterError> {
        // On a copy, so that a set that is refused changes nothing.
        let mut changed = *self;
        for (name, value) in settings {
            changed.assign(name, value)?;
        }
        check_limits(&changed)?;
        let warning = changed.gains.validate()?;
        *self = changed;
        Ok(warning)
    }

    /// Checks that the selected law exists. Saved parameters may name a law that only another program provides,
    /// so this is checked before a flight.
    pub fn check_law(&self) -> Result<(), ParameterError> {
        let selection = &self.gains.selection;
        let role = self.brings_law;
        if selection.main == MainLaw::Own && !role.is_some_and(OwnRole::is_main) {
            return Err(ParameterError::NoOwnLaw("CTL_LAW"));
        }
        if selection.allocation == AllocationMode::Own && !role.is_some_and(OwnRole::compensates) {
            return Err(ParameterError::NoOwnLaw("FTC_ALLOC"));
        }
        Ok(())
    }

    /// Checks every value and the whole set, where they do not come from [`Parameters::set_all`].
    pub fn check(&self) -> Result<(), ParameterError> {
        /// Angles are stored in another unit, so a value at its limit is read back with this relative error at most.
        const ROUNDING: f64 = 1.0e-9;
        for row in table() {
            let Parameter { name, unit, min, max, .. } = *row;
            let value = row.value(self);
            let room = ROUNDING * min.abs().max(max.abs());
            if !(min - room..=max + room).contains(&value) {
                return Err(ParameterError::OutOfRange { name, value, min, max, unit });
            }
        }
        check_limits(self)?;
        self.gains.validate()?;
        self.check_law()
    }

    /// The values that differ from `defaults`, for display: `OBS_W0 = 40, FTC_MODE = 0`.
    pub fn differences(&self, defaults: &Self) -> Vec<String> {
        // By bits, as `to_text` decides which values to write.
        let bits = |row: &Parameter, of: &Self| row.value(of).to_bits();
        let changed = table().iter().filter(|row| bits(row, self) != bits(row, defaults));
        // Whole numbers have no decimals.
        changed.map(|row| format!("{} = {}", row.name, row.value(self))).collect()
    }

    /// Sets one parameter that is inside its range; does not check the whole set.
    fn assign(&mut self, name: &str, value: f64) -> Result<(), ParameterError> {
        let name = compatibility(name).and_then(|row| row.meant()).map_or(name, |row| row.name);
        let Some(row) = table().iter().find(|row| row.name == name) else {
            return Err(match (compatibility(name), is_fault(name)) {
                (Some(row), _) => ParameterError::ReadOnly { name: row.name },
                (None, true) => ParameterError::OnlyInFlight { name: name.to_owned() },
                (None, false) => ParameterError::Unknown { name: name.to_owned() },
            });
        };
        let Parameter { name, unit, min, max, .. } = *row;
        if !(min..=max).contains(&value) {
            return Err(ParameterError::OutOfRange { name, value, min, max, unit });
        }
        let is_it = |choice: &Choice| f64::from(choice.value) == value;
        if !row.choices.is_empty() && !row.choices.iter().any(is_it) {
            return Err(ParameterError::NotAChoice { name, value, choices: row.choices });
        }
        if row.kind == Kind::Int && libm::fmod(value, 1.0) != 0.0 {
            return Err(ParameterError::NotWhole { name, value, min, max, unit });
        }
        row.set(self, value);
        Ok(())
    }
}

/// The lower ends of the ranges are not above the upper ones, and no value would be flown as another one because of a limit.
fn check_limits(parameters: &Parameters) -> Result<(), ParameterError> {
    let Parameters { limits, navigation, .. } = parameters;
    for (lower, low, upper, high, unit) in [
        ("REF_ALT_MIN", limits.altitude_min_m, "REF_ALT_MAX", limits.altitude_max_m, "m"),
        ("FW_AIRSPD_MIN", limits.airspeed_min_m_s, "FW_AIRSPD_MAX", limits.airspeed_max_m_s, "m/s"),
    ] {
        if low > high {
            return Err(ParameterError::Order { lower, low, upper, high, unit });
        }
    }
    let (low_m, high_m) = (limits.altitude_min_m, limits.altitude_max_m);
    for (name, value, min, max, unit) in [
        ("RTL_RETURN_ALT", navigation.return_altitude_m, low_m, high_m, "m"),
        ("NAV_BANK_MAX", navigation.bank_max_deg, 1.0, limits.roll_max_deg, "deg"),
    ] {
        if !(min..=max).contains(&value) {
            return Err(ParameterError::OutOfRange { name, value, min, max, unit });
        }
    }
    Ok(())
}

/// Reaction to the silence of ground stations, and its delay.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct LinkParameters {
    /// Reaction when the controlling ground station falls silent.
    pub loss_action: LinkLossAction,
    /// Delay of the reaction, wall time, s.
    pub loss_s: f64,
    /// Silence of an offboard stream after which Offboard ends, wall time, s.
    pub offboard_loss_s: f64,
    /// Silence of a pilot's sticks after which Altitude ends, wall time, s.
    pub sticks_loss_s: f64,
    /// The mode after the loss of the sticks.
    pub sticks_loss_action: SticksLossAction,
    /// MAVLink system id of the vehicle, 1 to 250; the value at the start of the program counts.
    pub system_id: u8,
}

/// Reaction of the aircraft when a pilot's sticks fall silent, with PX4's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SticksLossAction {
    /// Circles at its position.
    #[default]
    Hold,
    Return,
}

/// Slots of a mode switch, as in PX4.
pub const MODE_SLOTS: usize = 6;

/// A switch of a pilot's transmitter that selects flight modes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ModeSwitchParameters {
    pub channel: SwitchChannel,
    /// The mode of each slot, from 1000 us to 2000 us.
    pub slots: [SwitchMode; MODE_SLOTS],
}

/// A channel that a mode switch can have: 1 to 4 are the sticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SwitchChannel {
    /// There is no switch.
    #[default]
    None,
    /// Channel 5.
    Five,
    /// Channel 6.
    Six,
    /// Channel 7.
    Seven,
    /// Channel 8.
    Eight,
}

/// Selection of a slot of the mode switch, with PX4's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SwitchMode {
    /// None: the mode stays.
    #[default]
    Unassigned,
    Manual,
    Altitude,
    Position,
    Mission,
    Hold,
    Return,
    Acro,
    Offboard,
    Stabilized,
}

/// Default rates of the streams, Hz of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StreamParameters {
    pub attitude_hz: f64,
    pub position_hz: f64,
    /// Commands of the effectors.
    pub actuators_hz: f64,
    /// Signals of the compensator.
    pub compensator_hz: f64,
}

/// Header of the file, above the values.
const HEADER: &str = "\
# Parameters of the autopilot that differ from their defaults.
# Written anew, comments and all, whenever a ground station sets one.
";

/// Characters of a line that a message repeats.
const LINE_MAX: usize = 60;

/// Error of saved parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SavedProblem {
    /// No parameters in TOML, or something other than a number.
    #[error("{0}")]
    Text(String),
    /// An invalid name or value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// Why a file of saved parameters cannot be used.
pub fn saved_error(file: &str, problem: impl Display) -> TextError {
    let advice = "mend the file, or start with --parameter-file none";
    TextError::at(file, format!("{problem}; {advice}"))
}

/// The text for `parameters`, where `defaults` are those of the aircraft. [`from_text`] gives the same parameters to
/// the bit.
pub fn to_text(parameters: &Parameters, defaults: &Parameters) -> String {
    let mut text = HEADER.to_owned();
    for row in table() {
        // Display gives the shortest decimal number that is read back to the same bits.
        let (value, default) = (row.value(parameters), row.value(defaults));
        if value.to_bits() != default.to_bits() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{} = {value} # default {default}{}", row.name, after(row.unit));
        }
    }
    text
}

/// The parameters in `text`, which comes from `file`; the others have the values of `defaults`.
pub fn from_text(file: &str, text: &str, defaults: &Parameters) -> Result<Parameters, TextError> {
    let mut parameters = *defaults;
    // The warning, if any, was reported when the value was set.
    set_from_text(&mut parameters, text).map_err(|problem| saved_error(file, problem))?;
    Ok(parameters)
}

/// Sets the parameters in `text`; the others stay.
pub fn set_from_text(
    parameters: &mut Parameters,
    text: &str,
) -> Result<Option<Lemma1Warning>, SavedProblem> {
    let one_line = |error: toml::de::Error| {
        let at = error.span().map_or(0, |span| span.start.min(text.len()));
        let before = text.bytes().take(at).filter(|byte| *byte == b'\n').count();
        let line = text.lines().nth(before).unwrap_or_default().chars().take(LINE_MAX);
        let (line, why) = (line.collect::<String>(), error.message().replace('\n', " "));
        SavedProblem::Text(format!("line {} ({line}): {why}", before + 1))
    };
    set_from_table(parameters, &text.parse().map_err(one_line)?)
}

/// Sets the parameters in a table; the others stay.
pub fn set_from_table(
    parameters: &mut Parameters,
    table: &toml::Table,
) -> Result<Option<Lemma1Warning>, SavedProblem> {
    let settings = table.iter().map(|(name, value)| Ok((name.as_str(), number(name, value)?)));
    let settings: Vec<(&str, f64)> = settings.collect::<Result<_, SavedProblem>>()?;
    Ok(parameters.set_all(settings)?)
}

/// Whether a text contains numbers under names of parameters and nothing else. Whether they are valid together depends
/// on the defaults of an aircraft.
pub fn has_only_parameters(text: &str) -> bool {
    let is_one = |(name, value): (&String, &toml::Value)| {
        number(name, value).is_ok() && table().iter().any(|row| row.name == name)
    };
    text.parse::<toml::Table>().is_ok_and(|table| table.iter().all(is_one))
}

fn number(name: &str, value: &toml::Value) -> Result<f64, SavedProblem> {
    match value {
        toml::Value::Float(value) => Ok(*value),
        // A value beyond 32 bits is out of every range too.
        toml::Value::Integer(value) => Ok(i32::try_from(*value).map_or(f64::INFINITY, f64::from)),
        _ => Err(SavedProblem::Text(format!("{name} = {value} is not a number"))),
    }
}

#[cfg(test)]
mod tests;
