//! The commands: one table, one file each.

use std::fmt::Write as _;

use icd::EffectorList;
use icd::fault::Target;

use crate::context::Context;
use crate::param::ParamService;
use crate::peers::Peers;
use crate::wall_time::WallTime;
use flight_management::command::Command;

mod failure;
mod list;
mod mode;
mod pace;
mod param;
mod reference;
mod script;
mod status;

/// What a command may look at and use.
pub(super) struct Asking<'a, 'b> {
    pub(super) now: WallTime,
    pub(super) ctx: &'a mut Context<'b>,
    pub(super) param: &'a mut ParamService,
    pub(super) out: &'a mut Peers,
}

/// What a command comes to: a text, or the reason why nothing is done.
pub(super) type Answer = Result<Order, String>;

/// What is up to the aircraft, and what is said.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Printed when every command is fulfilled; at once if there is none. Lines with their ends.
    pub(super) said: String,
    /// With what it breaks or mends.
    pub(super) commands: Vec<(Command, Option<Target>)>,
}

impl Order {
    /// Only words.
    fn say(said: impl Into<String>) -> Self {
        Self { said: said.into(), commands: Vec::new() }
    }

    /// One command, and what is said when it is fulfilled.
    fn ask(command: impl Into<Command>, said: impl Into<String>) -> Self {
        Self { said: said.into(), commands: vec![(command.into(), None)] }
    }
}

/// One row of the table.
struct ShellCommand {
    name: &'static str,
    /// One line for each form, without the name.
    forms: &'static [&'static str],
    /// What it does, in one line.
    about: &'static str,
    /// The rest of its help.
    details: fn(&EffectorList) -> String,
    run: fn(&[&str], &mut Asking) -> Answer,
}

/// The commands, in the order of their list.
static TABLE: [ShellCommand; 12] = [
    ShellCommand {
        name: "help",
        forms: &["", "COMMAND"],
        about: "this list, or how a command is used",
        details: no_details,
        run: help,
    },
    ShellCommand {
        name: "status",
        forms: &[""],
        about: "the flight, and what the controller thinks",
        details: no_details,
        run: status::run,
    },
    ShellCommand {
        name: "list",
        forms: &[""],
        about: "the faults that act, rest or are scheduled",
        details: no_details,
        run: list::run,
    },
    ShellCommand {
        name: "failure",
        forms: failure::FORMS,
        about: "break and mend effectors",
        details: failure::details,
        run: failure::run,
    },
    ShellCommand {
        name: "script",
        forms: &["list", "run NAME|NUMBER", "stop", "status"],
        about: "run a script of faults and events",
        details: |_| script::DETAILS.to_owned(),
        run: script::run,
    },
    ShellCommand {
        name: "param",
        forms: &["show [PATTERN]", "get NAME", "set NAME VALUE"],
        about: "read and set parameters",
        details: |_| {
            "A * in PATTERN stands for any letters. What is set is saved and told to every ground station.\n"
                .to_owned()
        },
        run: param::run,
    },
    ShellCommand {
        name: "reference",
        forms: &["altitude METRES", "airspeed M/S", "roll DEGREES", "course DEGREES"],
        about: "change a reference",
        details: |_| {
            "Roll needs the mode Position or Offboard, course the mode Position.\n".to_owned()
        },
        run: reference::run,
    },
    ShellCommand {
        name: "mode",
        forms: &["", "NAME"],
        about: "list the modes, or change the mode",
        details: no_details,
        run: mode::run,
    },
    ShellCommand {
        name: "pause",
        forms: &[""],
        about: "let simulation time stand still",
        details: no_details,
        run: pace::pause,
    },
    ShellCommand {
        name: "run",
        forms: &[""],
        about: "let simulation time run",
        details: no_details,
        run: pace::run,
    },
    ShellCommand {
        name: "step",
        forms: &["[PERIODS]"],
        about: "run for so many control periods, one without a number, and stand still",
        details: no_details,
        run: pace::step,
    },
    ShellCommand {
        name: "speed",
        forms: &["FACTOR"],
        about: "run so many times as fast as wall time",
        details: no_details,
        run: pace::speed,
    },
];

/// The help says it all in one line.
fn no_details(_: &EffectorList) -> String {
    String::new()
}

/// Runs one line.
pub(super) fn run(line: &str, asking: &mut Asking) -> Answer {
    let words: Vec<&str> = line.split_whitespace().collect();
    let Some((name, arguments)) = words.split_first() else { return Ok(Order::default()) };
    match find(name) {
        Some(command) => (command.run)(arguments, asking),
        None => Err(format!("there is no command \"{name}\", help lists the commands")),
    }
}

fn find(name: &str) -> Option<&'static ShellCommand> {
    TABLE.iter().find(|command| command.name == name)
}

fn help(arguments: &[&str], asking: &mut Asking) -> Answer {
    let mut said = String::new();
    match arguments {
        [] => {
            for ShellCommand { name, about, .. } in &TABLE {
                let _ = writeln!(said, "{name:<10} {about}");
            }
        }
        [name] => {
            let command = find(name).ok_or_else(|| format!("there is no command \"{name}\""))?;
            let _ = writeln!(said, "{}", command.about);
            for form in command.forms {
                let _ = writeln!(said, "  {}", format!("{} {form}", command.name).trim_end());
            }
            said += &(command.details)(asking.ctx.effectors());
        }
        _ => return Err(usage("help")),
    }
    Ok(Order::say(said))
}

/// How a command is used, as the reason why it was not run.
fn usage(name: &str) -> String {
    let forms = find(name).map_or(&[][..], |command| command.forms);
    let forms: Vec<String> =
        forms.iter().map(|form| format!("{name} {form}").trim_end().to_owned()).collect();
    format!("usage: {}", forms.join(" | "))
}

/// A finite number with or without its unit.
fn number(what: &str, word: &str, unit: &str) -> Result<f64, String> {
    let digits = word.strip_suffix(unit).unwrap_or(word);
    let value: Option<f64> = digits.parse().ok();
    value
        .filter(|value| value.is_finite())
        .ok_or_else(|| format!("{what} \"{word}\" is no number in {unit}"))
}
