//! What a log is made of: the control side at the start of the flight, the entries that the control thread sends to the thread
//! that writes the log, and among them the inputs of the flight from outside the loop, in order: what a replay needs besides the
//! headers.

use core::fmt;

use flight_control::StepLog;
use icd::fault::{CATALOGUE, FaultEntry, PlantAction, PlantReport, PlantRequest};
use icd::pace::Pace;
use icd::record::{self, TruthRow};
use icd::wire::{self, Phase};
use icd::{Actuators, EffectorList, FaultRequest, Sensors, SimTime};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::hash::hex;
use flight_management::autopilot::Settings;
use flight_management::command::{Command, Configuration, Intent, ScriptCommand, VehicleCommand};
use flight_management::event::Event;
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Mode, Reference};

/// Version of the rules that a flight follows. It is raised whenever a program of the same version would fly the
/// same inputs differently, so that a replay refuses an older log instead of comparing it.
pub const FLIGHT_RULES: u32 = 4;

/// The control side of a flight at its first packet; JSON in the info message `control_header`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlHeader {
    /// Version of this program.
    pub version: String,
    /// Version of the plant link's packets.
    pub wire_version: u16,
    /// [`FLIGHT_RULES`] of this program.
    pub flight_rules: u32,
    /// Short form of the flight's session: the beginning of its hash.
    pub session: String,
    /// Control period, us.
    pub period_us: u32,
    /// Interval of rows away from events, control steps ([`super::LogRate`]).
    pub row_every: u32,
    /// The first packet was not the flight's first: such a log cannot be replayed.
    pub joined_in_flight: bool,
    /// The control side as it was at the first packet, without a law that the program brings.
    #[serde(flatten)]
    pub settings: Settings,
    /// SHA-256 of the parameters ([`parameter_hash`]).
    pub parameter_hash: String,
}

impl ControlHeader {
    /// For a flight of this program that begins with `settings`. [`super::Encoder`] fills in the parameter hash and the interval of
    /// rows.
    pub fn new(
        settings: Settings,
        session: String,
        period_us: u32,
        joined_in_flight: bool,
    ) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            wire_version: wire::VERSION,
            flight_rules: FLIGHT_RULES,
            session,
            period_us,
            row_every: 1,
            joined_in_flight,
            // A log cannot hold code.
            settings: Settings { own_law: None, ..settings },
            parameter_hash: String::new(),
        }
    }
}

/// SHA-256 over a line `NAME=VALUE` for each parameter, 64 hexadecimal digits. The values are written so that they
/// can be read back bit for bit.
pub fn parameter_hash<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> String {
    let mut sha = Sha256::new();
    for (name, value) in values {
        sha.update(format!("{name}={value}\n"));
    }
    hex(&sha.finalize())
}

/// One entry. A control step is plain data, so that a tick allocates nothing.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "nearly all of them are control steps")]
pub enum Entry {
    /// A flight begins: a new log.
    Begin(Box<Begin>),
    Step(Step),
    /// An input, or a request sent to the plant.
    Recorded {
        time: SimTime,
        moment: Moment,
        /// The input or request.
        what: Recorded,
    },
    /// The plant reports a fault.
    Fault {
        /// Simulation time of the exchange.
        time: SimTime,
        entry: FaultEntry,
    },
    /// An event of the autopilot.
    Event(Event),
    /// A text that ground stations get.
    Text {
        /// Simulation time of its arrival.
        time: SimTime,
        /// Importance, number of syslog.
        severity: u8,
        text: String,
    },
    /// The truth on the ground, after the last control step.
    Ground {
        time: SimTime,
        /// As the plant reports it.
        row: TruthRow,
    },
    /// A piece of the plant's header.
    Piece {
        /// Its number, from 0.
        index: u16,
        count: u16,
        bytes: Box<[u8]>,
    },
    /// A ground station has changed parameters: all of them.
    Parameters(Box<Parameters>),
    /// The flight is over.
    End(End),
}

/// The beginning of a flight.
#[derive(Debug, Clone)]
pub struct Begin {
    /// Simulation time of the first packet.
    pub time: SimTime,
    /// The control side; the recorder fills in the parameter hash and the interval of rows.
    pub header: ControlHeader,
}

#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub time: SimTime,
    pub sensors: Sensors,
    pub actuators: Actuators,
    /// Signals of the step.
    pub log: StepLog,
    pub mode: Mode,
    /// References: altitude, m, roll, rad, airspeed, m/s.
    pub references: [f64; 3],
    /// The flight was terminated.
    pub terminated: bool,
    /// The truth, if the plant sent it.
    pub truth: Option<TruthRow>,
}

/// Why a log ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Restart,
    /// A request to end the process.
    Stopped,
    /// The plant had fallen silent, and then another plant connected or the process ended.
    PlantLost,
    /// The log has reached its limit.
    Full,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Restart => "restart",
            Self::Stopped => "stopped",
            Self::PlantLost => "plant lost",
            Self::Full => "log full",
        })
    }
}

impl Entry {
    /// The entry of a report of the plant; `None` for reports that are not logged.
    pub fn of_report(time: SimTime, report: &PlantReport) -> Option<Self> {
        match report {
            PlantReport::Fault(entry) => Some(Self::Fault { time, entry: *entry }),
            _ => None,
        }
    }
}

/// Decodes the data that the plant sent for the recorder: the truth of the tick and a piece of the plant's header.
pub fn open(envelope: &[u8]) -> (Option<TruthRow>, Option<Entry>) {
    let Some((truth, piece)) = record::open(envelope) else { return (None, None) };
    let entry = |record::Piece { index, count, bytes }| {
        let bytes = bytes.into();
        Entry::Piece { index, count, bytes }
    };
    (Some(truth), piece.map(entry))
}

/// One entry of the topic `recorded`, as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Recorded {
    /// An operator's command, taken before the step of its exchange.
    Intent(Intent),
    /// A request sent to the plant with the answer of its exchange.
    Request(PlantRequest),
    /// The plant had been silent for too long.
    PlantLost,
    /// The plant continues the same flight.
    PlantBack,
}

/// The kind of exchange that an entry belongs to, besides the number of control steps flown before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// In the exchange of a control step.
    Step,
    /// In an exchange while the simulation is paused.
    Holding,
    /// In an exchange on the ground.
    OnGround,
    Between,
}

impl Moment {
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The one with this number.
    pub fn from_code(code: u8) -> Option<Self> {
        [Self::Step, Self::Holding, Self::OnGround, Self::Between]
            .into_iter()
            .find(|moment| moment.code() == code)
    }
}

impl From<Phase> for Moment {
    fn from(phase: Phase) -> Self {
        match phase {
            Phase::Flying => Self::Step,
            Phase::Holding => Self::Holding,
            Phase::OnGround => Self::OnGround,
        }
    }
}

/// Whether it belongs to a stream (setpoints, sticks), which would fill the log.
pub(crate) const fn is_stream(command: &Command) -> bool {
    use VehicleCommand::{Setpoint, Sticks};
    matches!(command, Command::Vehicle(Setpoint(_) | Sticks(_)))
}

/// The codes of faults with their names: `1 stuck_here, 2 stuck_at jump, ...`.
pub(crate) fn fault_kinds() -> String {
    let all = CATALOGUE.iter().flat_map(|kind| {
        let alternatives = kind.choice.map_or(&[][..], |choice| choice.alternatives);
        (kind.code..kind.code + kind.alternatives()).enumerate().map(move |(place, code)| {
            let alternative = alternatives.get(place).map_or("", |one| one.key);
            format!("{code} {} {alternative}", kind.key).trim_end().to_owned()
        })
    });
    all.collect::<Vec<_>>().join(", ")
}

/// Text of an operator's command to an aircraft with these effectors; `None` for streams.
pub fn command_text(command: &Command, effectors: &EffectorList) -> Option<String> {
    match command {
        Command::Vehicle(command) => vehicle_text(command),
        Command::Plant(action) => Some(plant_text(action, effectors)),
        Command::Configuration(configuration) => {
            let text = match configuration {
                Configuration::Gains(_) => "gains",
                Configuration::Limits(_) => "limits of references",
                Configuration::Navigation(_) => "parameters of the guidance",
                Configuration::FaultInjection(true) => "fault injection allowed",
                Configuration::FaultInjection(false) => "fault injection refused",
            };
            Some(text.to_owned())
        }
        Command::Script(ScriptCommand::Run(script)) => Some(format!("script {}", script.name())),
        Command::Script(ScriptCommand::Stop) => Some("stop the script".to_owned()),
    }
}

fn vehicle_text(command: &VehicleCommand) -> Option<String> {
    use VehicleCommand as V;
    Some(match command {
        V::Setpoint(_) | V::Sticks(_) => return None,
        V::Mode(mode) => format!("mode {mode}"),
        V::Refer(Reference::Altitude(m)) => format!("altitude {m:.1} m"),
        V::Refer(Reference::Airspeed(m_s)) => format!("airspeed {m_s:.1} m/s"),
        V::Refer(Reference::Roll(rad)) => format!("roll {:.1} deg", rad.to_degrees()),
        V::Refer(Reference::Course(rad)) => format!("course {:.1} deg", rad.to_degrees()),
        V::Reposition(_) => "reposition".to_owned(),
        V::Plan(plan) => format!("plan of {} items", plan.items.len()),
        V::PlanItem(item) => format!("item {item} of the plan"),
        V::Continue => "go on with the plan".to_owned(),
        V::Fence(fence) => format!("fence of {} areas", fence.areas().len()),
        V::Rally(points) => format!("{} rally points", points.len()),
        V::EnableFence(true) => "fence on".to_owned(),
        V::EnableFence(false) => "fence off".to_owned(),
        V::Land => "land".to_owned(),
        V::GoAround(_) => "go around".to_owned(),
        V::Arm(true) => "arm".to_owned(),
        V::Arm(false) => "disarm".to_owned(),
        V::TakeOff(_) => "take off".to_owned(),
        V::Home(_) => "home".to_owned(),
        V::Terminate => "terminate the flight".to_owned(),
        V::LinkLost(_) => "the ground station is silent".to_owned(),
        V::LinkBack => "the ground station is back".to_owned(),
    })
}

fn plant_text(action: &PlantAction, effectors: &EffectorList) -> String {
    match action {
        PlantAction::Fault(FaultRequest::Inject { target, kind, timing }) => {
            let kind = kind.described(target.class(effectors));
            format!("fault: {} {kind}{timing}", target.name(effectors))
        }
        PlantAction::Fault(FaultRequest::Clear { target }) => {
            format!("mend {}", target.name(effectors))
        }
        PlantAction::Fault(FaultRequest::ClearAll) => "mend everything".to_owned(),
        PlantAction::Restart => "new flight".to_owned(),
        PlantAction::ListFaults => "the autopilot asks for the faults".to_owned(),
        PlantAction::Pace(Pace::Pause) => "pause".to_owned(),
        PlantAction::Pace(Pace::Run) => "run".to_owned(),
        PlantAction::Pace(Pace::Step(periods)) => format!("step {periods} periods"),
        PlantAction::Pace(Pace::Speed(speed)) => format!("speed x{speed}"),
    }
}

#[cfg(test)]
mod header_tests {
    use super::*;

    #[test]
    fn the_parameter_hash_is_that_of_lines_of_name_and_value() {
        let lines = "A=1\nB=0.1\n";
        assert_eq!(parameter_hash([("A", 1.0), ("B", 0.1)]), hex(&Sha256::digest(lines)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_moment_comes_back_from_its_number() {
        for code in 0..4 {
            assert_eq!(Moment::from_code(code).map(Moment::code), Some(code));
        }
        assert_eq!(Moment::from_code(4), None);
    }
}
