//! How results are written: one table for every command that has more than one number to show.

pub mod table;

pub use table::{Cell, CellKind, Column, ParquetReader, ParquetWriter, Table};
