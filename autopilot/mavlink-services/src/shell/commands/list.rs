//! `list`: the faults that act, rest or are scheduled.

use std::fmt::Write as _;

use super::{Answer, Asking, Order, usage};
use crate::fault_list;

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    if arguments.is_empty() { Ok(Order::say(text(asking))) } else { Err(usage("list")) }
}

/// One line for each fault.
pub(super) fn text(asking: &Asking) -> String {
    let mut said = String::new();
    for line in fault_list::lines(asking.ctx.aircraft.faults(), asking.ctx.effectors()) {
        let _ = writeln!(said, "{line}");
    }
    if said.is_empty() {
        said.push_str("No faults\n");
    }
    said
}
