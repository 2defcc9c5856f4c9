//! `list`: the faults that act, rest or are scheduled.

use std::fmt::Write as _;

use icd::fault::FaultEntry;

use super::{Answer, Asking, Order, usage};
use crate::mavlink::failure;

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    if arguments.is_empty() { Ok(Order::say(text(asking))) } else { Err(usage("list")) }
}

/// One line for each fault.
pub(super) fn text(asking: &Asking) -> String {
    let mut said = String::new();
    for FaultEntry { id, effector, kind, timing, state } in asking.faults.iter() {
        let (unit, instance) = failure::unit_and_instance(*effector);
        let kind = kind.described(effector.is_angle());
        let _ = writeln!(
            said,
            "Fault {id}: {unit} {instance} ({}) {kind}{timing}, {state}",
            effector.name()
        );
    }
    if said.is_empty() {
        said.push_str("No faults\n");
    }
    said
}
