//! `script`: which scripts are here, start one, stop it, and where the one that runs stands.

use flight_management::command::ScriptCommand;
use std::fmt::Write as _;

use super::{Answer, Asking, Order, usage};
use crate::refused::Refused;
use crate::scripts::Scripts;
use flight_management::script::Script;

pub(super) const DETAILS: &str = "\
Files come by MAVLink FTP into the folder /scripts. A name goes before a number; number 0 is the file that was uploaded
last, and without a file the scenario's script. Starting one ends the one that runs.
";

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    match arguments {
        ["list"] => Ok(Order::say(list(asking.ctx.scripts))),
        ["run", which] => start(which, asking),
        ["stop"] => Ok(Order::ask(ScriptCommand::Stop, "Script stopped\n")),
        ["status"] => Ok(Order::say(status(asking.ctx.scripts))),
        _ => Err(usage("script")),
    }
}

fn start(which: &str, asking: &mut Asking) -> Answer {
    let ctx = &mut *asking.ctx;
    let is_file = ctx.scripts.content(which).is_some();
    let script = match which.parse() {
        Ok(number) if !is_file => ctx.scripts.start(number, ctx.parameters),
        _ => ctx.scripts.start_by_name(which, ctx.parameters),
    };
    let script = script.map_err(|Refused { reason, .. }| reason.unwrap_or_default())?;
    let said = format!("Script began: {}\n", script.name());
    Ok(Order::ask(ScriptCommand::Run(script), said))
}

/// One line for each file, then the scenario's script. The one that runs is marked.
fn list(scripts: &Scripts) -> String {
    let running = scripts.running().map(Script::name);
    let mark = |name: &str| if running == Some(name) { '*' } else { ' ' };
    let mut said = String::new();
    for ((name, size), number) in scripts.files().zip(1..) {
        let latest = if scripts.latest() == Some(name) { ", uploaded last" } else { "" };
        let _ = writeln!(said, "{} {number:>2} {name} ({size} bytes{latest})", mark(name));
    }
    if let Some(script) = scripts.of_scenario() {
        let name = script.name();
        let _ = writeln!(said, "{}  - {name} (begins with the flight)", mark(name));
    }
    if said.is_empty() {
        said.push_str("No scripts\n");
    }
    said
}

/// The script that runs, and for each of its sequences the line that is next.
fn status(scripts: &Scripts) -> String {
    let Some(script) = scripts.running() else { return "No script runs\n".into() };
    let mut said = format!("Script runs: {}\n", script.name());
    for (sequence, next) in scripts.next_lines() {
        let name = sequence.name.as_ref().map_or("main", |(_, name)| name);
        let _ = match next {
            Some(line) => writeln!(said, "  {name}: line {} is next: {}", line.number, line.text),
            None => writeln!(said, "  {name}: every line is done"),
        };
    }
    said
}
