//! How results are shown: one chart kit, pages that open without a network, and the progress of long work.

pub mod chart;
pub mod page;
pub mod runner;
