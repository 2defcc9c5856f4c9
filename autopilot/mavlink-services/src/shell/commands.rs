//! The commands: one table; the longer ones have their own file.

use std::fmt::Write as _;

use icd::EffectorList;
use icd::fault::PlantAction;
use icd::pace::Pace;

use crate::codec::CommandError;
use crate::scripts::Scripts;
use crate::wall_time::WallTime;
use crate::{Shared, fault_list, modes};
use flight_management::command::{Command, ScriptCommand, VehicleCommand};
use flight_management::script::Script;
use flight_management::vehicle::{Mode, Reference};

mod failure;
mod param;
mod status;

/// Output of a command, or why it does nothing.
pub(super) type Answer = Result<Output, String>;

/// Output of a command, and the commands that it sends to the aircraft.
#[derive(Debug, Default)]
pub(super) struct Output {
    /// Printed when the aircraft has executed every command; at once if there is none. Lines with their ends.
    pub(super) text: String,
    pub(super) commands: Vec<Command>,
}

impl Output {
    /// A text without commands.
    fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), commands: Vec::new() }
    }

    /// One command, and the text to print once it is executed.
    fn command(command: impl Into<Command>, text: impl Into<String>) -> Self {
        Self { text: text.into(), commands: vec![command.into()] }
    }
}

/// One row of the table.
struct ShellCommand {
    name: &'static str,
    /// One line for each form, without the name.
    forms: &'static [&'static str],
    /// Purpose, in one line.
    about: &'static str,
    /// The rest of its help.
    details: fn(&EffectorList) -> String,
    run: fn(&[&str], WallTime, &mut Shared) -> Answer,
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
        run: list,
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
        details: |_| SCRIPT_DETAILS.to_owned(),
        run: script,
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
        run: reference,
    },
    ShellCommand {
        name: "mode",
        forms: &["", "NAME"],
        about: "list the modes, or change the mode",
        details: no_details,
        run: mode,
    },
    ShellCommand {
        name: "pause",
        forms: &[""],
        about: "let simulation time stand still",
        details: no_details,
        run: pause,
    },
    ShellCommand {
        name: "run",
        forms: &[""],
        about: "let simulation time run",
        details: no_details,
        run: run_simulation,
    },
    ShellCommand {
        name: "step",
        forms: &["[PERIODS]"],
        about: "run for so many control periods, one without a number, and stand still",
        details: no_details,
        run: step,
    },
    ShellCommand {
        name: "speed",
        forms: &["FACTOR"],
        about: "run so many times as fast as wall time",
        details: no_details,
        run: speed,
    },
];

// One line of help is enough.
fn no_details(_: &EffectorList) -> String {
    String::new()
}

pub(super) fn run(line: &str, now: WallTime, shared: &mut Shared) -> Answer {
    let words: Vec<&str> = line.split_whitespace().collect();
    let Some((name, arguments)) = words.split_first() else { return Ok(Output::default()) };
    match find(name) {
        Some(command) => (command.run)(arguments, now, shared),
        None => Err(format!("there is no command \"{name}\", help lists the commands")),
    }
}

fn find(name: &str) -> Option<&'static ShellCommand> {
    TABLE.iter().find(|command| command.name == name)
}

fn help(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    let mut text = String::new();
    match arguments {
        [] => {
            for ShellCommand { name, about, .. } in &TABLE {
                let _ = writeln!(text, "{name:<10} {about}");
            }
        }
        [name] => {
            let command = find(name).ok_or_else(|| format!("there is no command \"{name}\""))?;
            let _ = writeln!(text, "{}", command.about);
            for form in command.forms {
                let _ = writeln!(text, "  {}", format!("{} {form}", command.name).trim_end());
            }
            text += &(command.details)(shared.effectors());
        }
        _ => return Err(usage("help")),
    }
    Ok(Output::text(text))
}

/// The usage of a command, as the reason why it did not run.
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

fn list(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    if arguments.is_empty() { Ok(Output::text(faults(shared))) } else { Err(usage("list")) }
}

/// One line for each fault.
fn faults(shared: &Shared) -> String {
    let mut text = String::new();
    for line in fault_list::lines(shared.aircraft.faults(), shared.effectors()) {
        let _ = writeln!(text, "{line}");
    }
    if text.is_empty() {
        text.push_str("No faults\n");
    }
    text
}

fn mode(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    match arguments {
        [] => Ok(Output::text(modes_text(shared.aircraft.mode()))),
        [name] => {
            let mode = Mode::ALL.into_iter().find(|mode| mode.name().eq_ignore_ascii_case(name));
            let mode = mode.ok_or_else(|| {
                let names = Mode::ALL.map(Mode::name).join(", ");
                format!("there is no mode \"{name}\": there are {names}")
            })?;
            let mode = modes::enterable(mode, shared.streams)
                .map_err(|refused| refused.reason.unwrap_or_default())?;
            Ok(Output::command(VehicleCommand::Mode(mode), format!("Mode {mode}\n")))
        }
        _ => Err(usage("mode")),
    }
}

fn modes_text(now: Mode) -> String {
    let mut text = String::new();
    for mode in Mode::ALL {
        let mark = if mode == now { '*' } else { ' ' };
        let _ = writeln!(text, "{mark} {mode}");
    }
    text
}

fn pause(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    match arguments {
        [] => Ok(Output::command(PlantAction::Pace(Pace::Pause), "Simulation paused\n")),
        _ => Err(usage("pause")),
    }
}

fn run_simulation(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    match arguments {
        [] => Ok(Output::command(PlantAction::Pace(Pace::Run), "Simulation runs\n")),
        _ => Err(usage("run")),
    }
}

fn step(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    let periods = match arguments {
        [] => 1,
        [periods] => periods
            .parse()
            .map_err(|_| format!("\"{periods}\" is no whole number of control periods"))?,
        _ => return Err(usage("step")),
    };
    // The aircraft refuses too many.
    Ok(Output::command(
        PlantAction::Pace(Pace::Step(periods)),
        format!("Simulation steps: {periods}\n"),
    ))
}

fn speed(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    let [factor] = arguments else { return Err(usage("speed")) };
    let factor = number("speed", factor, "x")?;
    Ok(Output::command(
        PlantAction::Pace(Pace::Speed(factor)),
        format!("Simulation speed: x{factor}\n"),
    ))
}

fn reference(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    let [name, value] = arguments else { return Err(usage("reference")) };
    let (reference, text) = match *name {
        "altitude" => {
            let metres = number(name, value, "m")?;
            (Reference::Altitude(metres), format!("{metres} m"))
        }
        "airspeed" => {
            let speed = number(name, value, "m/s")?;
            (Reference::Airspeed(speed), format!("{speed} m/s"))
        }
        "roll" => {
            let degrees = number(name, value, "deg")?;
            (Reference::Roll(degrees.to_radians()), format!("{degrees} deg"))
        }
        "course" => {
            let degrees = number(name, value, "deg")?;
            if !(0.0..=360.0).contains(&degrees) {
                return Err(format!("course {degrees} deg is outside 0 to 360 deg"));
            }
            (Reference::Course((degrees % 360.0).to_radians()), format!("{degrees} deg"))
        }
        _ => return Err(usage("reference")),
    };
    Ok(Output::command(VehicleCommand::Refer(reference), format!("Reference {name}: {text}\n")))
}

const SCRIPT_DETAILS: &str = "\
Files come by MAVLink FTP into the folder /scripts. A name goes before a number; number 0 is the file that was uploaded
last, and without a file the scenario's script. Starting one ends the one that runs.
";

fn script(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    match arguments {
        ["list"] => Ok(Output::text(scripts_text(&shared.scripts))),
        ["run", which] => start_script(which, shared),
        ["stop"] => Ok(Output::command(ScriptCommand::Stop, "Script stopped\n")),
        ["status"] => Ok(Output::text(script_status(&shared.scripts))),
        _ => Err(usage("script")),
    }
}

fn start_script(which: &str, shared: &mut Shared) -> Answer {
    let shared = &mut *shared;
    let is_file = shared.scripts.content(which).is_some();
    let script = match which.parse() {
        Ok(number) if !is_file => shared.scripts.start(number, &shared.parameters),
        _ => shared.scripts.start_by_name(which, &shared.parameters),
    };
    let script = script.map_err(|CommandError { reason, .. }| reason.unwrap_or_default())?;
    let text = format!("Script began: {}\n", script.name());
    Ok(Output::command(ScriptCommand::Run(script), text))
}

/// One line for each file, then the scenario's script. The running one is marked.
fn scripts_text(scripts: &Scripts) -> String {
    let running = scripts.running().map(Script::name);
    let mark = |name: &str| if running == Some(name) { '*' } else { ' ' };
    let mut text = String::new();
    for ((name, size), number) in scripts.files().zip(1..) {
        let latest = if scripts.latest() == Some(name) { ", uploaded last" } else { "" };
        let _ = writeln!(text, "{} {number:>2} {name} ({size} bytes{latest})", mark(name));
    }
    if let Some(script) = scripts.of_scenario() {
        let name = script.name();
        let _ = writeln!(text, "{}  - {name} (begins with the flight)", mark(name));
    }
    if text.is_empty() {
        text.push_str("No scripts\n");
    }
    text
}

/// The running script, and for each of its sequences the next line.
fn script_status(scripts: &Scripts) -> String {
    let Some(script) = scripts.running() else { return "No script runs\n".into() };
    let mut text = format!("Script runs: {}\n", script.name());
    for (sequence, next) in scripts.next_lines() {
        let name = sequence.name.as_ref().map_or("main", |(_, name)| name);
        let _ = match next {
            Some(line) => writeln!(text, "  {name}: line {} is next: {}", line.number, line.text),
            None => writeln!(text, "  {name}: every line is done"),
        };
    }
    text
}
