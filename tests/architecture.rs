//! The rules of ARCHITECTURE.md, checked against the manifests and the sources.
//!
//! A rule that hurts is changed here and in ARCHITECTURE.md together, with a record in docs/decisions/.

#[path = "architecture/circles.rs"]
mod circles;
#[path = "architecture/dependencies.rs"]
mod dependencies;
#[path = "architecture/documents.rs"]
mod documents;
#[path = "architecture/equations.rs"]
mod equations;
#[path = "architecture/fault_tables.rs"]
mod fault_tables;
#[path = "architecture/no_std.rs"]
mod no_std;
#[path = "architecture/source_rules.rs"]
mod source_rules;
#[path = "architecture/sources.rs"]
mod sources;
