//! Content and encoding of a flight log: header, inputs in order, rows, run hash. Without I/O.
//!
//! One log is one flight, in the format ULog (crate `ulog`); `docs/logs.md` lists the topics. `autopilot::io::recorder`
//! writes it on its own thread. The data that the plant sends for the recorder (the truth) are decoded here and nowhere else:
//! laws and vehicle never receive them.
//!
//! Start with [`Encoder`], which turns [`Entry`]s into the bytes of a log. [`RunHash`] shows whether two flights were the same:
//!
//! ```
//! use flight_management::{autopilot::Settings, configuration, parameters::Parameters};
//! use icd::SimTime;
//! use recorder::{Begin, ControlHeader, Encoder, End, LogRate, RunHash};
//!
//! let model = configuration::model("tvc_jet.toml", aircraft::DEFAULT_MODEL)?;
//! let Parameters { gains, limits, navigation, .. } = model.defaults;
//! let settings = Settings {
//!     model: model.aircraft,
//!     gains,
//!     limits,
//!     navigation,
//!     references: Default::default(),
//!     script: None,
//!     own_law: None,
//!     fault_injection: false,
//! };
//! let header = ControlHeader::new(settings, "0000002a".to_owned(), 2_000, false);
//! let begin = Begin { time: SimTime::ZERO, header };
//! let log = Encoder::begin(Vec::new(), begin, &model.defaults, LogRate::Full)?;
//!
//! let log = ulog::reader::Log::from_bytes(log.end(End::Stopped)?)?;
//! // The run hash of a flight without a control step.
//! assert_eq!(log.info_text("run_hash"), Some(RunHash::default().hex().as_str()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod encoder;
mod entry;
mod hash;
pub mod topics;

pub use encoder::{Encoder, LogRate, Selection};
pub use entry::{
    Begin, ControlHeader, End, Entry, FLIGHT_RULES, Moment, Recorded, Step, command_text, open,
    parameter_hash,
};
pub use hash::RunHash;
pub use topics::{command_names, control_names, control_values};
