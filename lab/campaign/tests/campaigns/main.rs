//! Campaigns and studies from their files to their tables and pages.

mod campaign;
mod compare;
mod joint;
mod parts;
mod report;
mod studies;
mod tune;
