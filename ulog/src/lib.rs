//! ULog, the flight-log format of PX4, version 1: <https://docs.px4.io/main/en/dev_log/ulog_file_format.html>.
//!
//! The crate is independent of aircraft. PlotJuggler, pyulog and Flight Review read the files of [`writer`];
//! [`reader`] reads them too, even if they are truncated.
//!
//! Start with [`writer::Definitions`], which begins a file, and [`reader::Log`]:
//!
//! ```
//! use ulog::format::Format;
//! use ulog::reader::Log;
//! use ulog::writer::{Definitions, Row};
//!
//! let format = Format::parse("truth:uint64_t timestamp;double altitude_m;").ok_or("no format")?;
//! let mut file = Definitions::begin(Vec::new(), 0)?;
//! file.format(&format)?;
//! let mut data = file.data();
//! let truth = data.subscribe(&format)?;
//! let mut row = Row::default();
//! row.begin(2_000).f64(5_000.0);
//! data.row(truth, &row)?;
//!
//! let log = Log::from_bytes(data.finish()?)?;
//! assert_eq!(log.column("truth", "altitude_m"), Some(vec![5_000.0]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod format;
pub mod reader;
pub mod writer;
