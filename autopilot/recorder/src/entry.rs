//! Entries that the control thread sends to the thread that writes the log.

use core::fmt;

use flight_control::StepLog;
use icd::fault::{FaultEntry, PlantReport};
use icd::record::{self, TruthRow};
use icd::{Actuators, Sensors, SimTime};

use super::{ControlHeader, Moment, Recorded};
use flight_management::event::Event;
use flight_management::parameters::Parameters;
use flight_management::vehicle::Mode;

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
            PlantReport::FaultReply { .. }
            | PlantReport::Started { .. }
            | PlantReport::GroundContact { .. }
            | PlantReport::Paced { .. } => None,
        }
    }
}

/// Decodes the data that the plant sent for the recorder: the truth of the tick and a piece of the plant's header.
pub fn open(envelope: &[u8]) -> (Option<TruthRow>, Option<Entry>) {
    match record::open(envelope) {
        None => (None, None),
        Some((truth, piece)) => {
            let piece = piece.map(|record::Piece { index, count, bytes }| Entry::Piece {
                index,
                count,
                bytes: bytes.into(),
            });
            (Some(truth), piece)
        }
    }
}
