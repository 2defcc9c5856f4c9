//! What a flight log holds and how it is encoded: header, inputs in order, rows, run hash. Without I/O.
//!
//! One log is one flight, in the format ULog (crate `ulog`); `docs/logs.md` lists the topics. `autopilot::io::recorder`
//! writes it on a thread of its own. What the plant tells the recorder (the truth) is opened here and nowhere else:
//! laws and vehicle never get it.
//!
//! Start with [`Entry`], which is what a recorder takes, and [`Encoder`], which makes the bytes of a log of entries.
//! [`RunHash`] says whether two flights were the same:
//!
//! ```
//! use recorder::RunHash;
//!
//! let (one, other) = (RunHash::default(), RunHash::default());
//! assert_eq!(one.hex(), other.hex());
//! ```

mod encoder;
mod entry;
mod hash;
mod header;
mod recorded;
mod selection;
pub mod topics;
pub mod words;

pub use encoder::Encoder;
pub use entry::{Begin, End, Entry, Step, open};
pub use hash::RunHash;
pub use header::{ControlHeader, FLIGHT_RULES, parameter_hash};
pub use recorded::{Moment, Recorded};
pub use selection::{LogRate, Selection};
pub use topics::{command_names, control_names, control_values};
