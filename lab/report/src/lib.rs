//! How results are written: one table for every command that has more than one number to show, one chart kit, pages that
//! open without a network, and the progress of long work.

pub mod chart;
pub mod page;
pub mod runner;
pub mod table;

pub use table::{Cell, CellKind, Column, ParquetReader, ParquetWriter, Table};
