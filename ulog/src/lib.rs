//! ULog, the flight-log format of PX4, version 1: <https://docs.px4.io/main/en/dev_log/ulog_file_format.html>.
//!
//! Knows bytes and nothing about aircraft. PlotJuggler, pyulog and Flight Review read what [`writer`] writes;
//! [`reader`] reads the same back, also where a file was cut off.

pub mod format;
pub mod reader;
pub mod writer;
