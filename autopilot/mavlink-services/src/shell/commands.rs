//! The commands of the shell: one table, and a function for each.

use std::fmt::Write as _;

use flight_control::CompensatorMode;
use icd::fault::{
    AirframePart, CATALOGUE, Failure, KindInfo, NumberInfo, PlantAction, Quantity, SIZE_OPTION,
    SensorKind, SizedKind, TargetClass,
};
use icd::pace::Pace;
use icd::{Effector, EffectorList, FaultRequest};

use crate::aircraft::{Aircraft, Phase};
use crate::codec::CommandError;
use crate::failure::{FaultCommand, Instances, Unit};
use crate::param::{Row, rows};
use crate::scripts::Scripts;
use crate::wall_time::WallTime;
use crate::{Shared, fault_list, modes};
use flight_management::command::{Command, ScriptCommand, VehicleCommand};
use flight_management::event::{Axis, Snapshot};
use flight_management::event_text::verdict_text;
use flight_management::parameters::{FAULT_CHOICES, Kind, is_fault, table};
use flight_management::script::{Action, Script};
use flight_management::vehicle::{Mode, Reference};

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

const fn command(
    name: &'static str,
    forms: &'static [&'static str],
    about: &'static str,
    run: fn(&[&str], WallTime, &mut Shared) -> Answer,
) -> ShellCommand {
    // One line of help is enough for most.
    ShellCommand { name, forms, about, details: |_| String::new(), run }
}

/// The commands, in the order of their list.
static TABLE: [ShellCommand; 14] = [
    command("help", &["", "COMMAND"], "this list, or how a command is used", help),
    command("status", &[""], "the flight, and what the controller thinks", status),
    command("list", &[""], "the faults that act, rest or are scheduled", |_, _, shared| {
        Ok(Output::text(faults(shared)))
    }),
    ShellCommand {
        details: |_| FAIL_DETAILS.to_owned(),
        ..command(
            "fail",
            FAIL_FORMS,
            "break an effector, a sensor or a part",
            |words, _, shared| fault_in_words("fail", words, shared),
        )
    },
    command("clear", &["TARGET", "all"], "mend a target, or everything", |words, _, shared| {
        fault_in_words("clear", words, shared)
    }),
    ShellCommand {
        details: failure_details,
        ..command("failure", FAILURE_FORMS, "the same in the words of PX4", failure)
    },
    ShellCommand {
        details: |_| SCRIPT_DETAILS.to_owned(),
        ..command("script", SCRIPT_FORMS, "run a script of faults and events", script)
    },
    ShellCommand {
        details: |_| PARAM_DETAILS.to_owned(),
        ..command("param", PARAM_FORMS, "read and set parameters", param)
    },
    ShellCommand {
        details: |_| REFERENCE_DETAILS.to_owned(),
        ..command("reference", REFERENCE_FORMS, "change a reference", reference)
    },
    command("mode", &["", "NAME"], "list the modes, or change the mode", mode),
    command("pause", &[""], "let simulation time stand still", |_, _, _| {
        Ok(Output::command(PlantAction::Pace(Pace::Pause), "Simulation paused\n"))
    }),
    command("run", &[""], "let simulation time run", |_, _, _| {
        Ok(Output::command(PlantAction::Pace(Pace::Run), "Simulation runs\n"))
    }),
    command(
        "step",
        &["[PERIODS]"],
        "run for so many control periods, one without a number, and stand still",
        step,
    ),
    command("speed", &["FACTOR"], "run so many times as fast as wall time", speed),
];

const FAIL_FORMS: &[&str] =
    &["TARGET KIND [, ramp TIME] [, for TIME] [, every TIME [, NUMBER times]]"];
const FAIL_DETAILS: &str = "\
The words are those of scripts; a wrong one is answered with those that fit.
  fail left elevator stuck at 30 deg, ramp 2 s
  fail rudder 50 % left, for 3 s, every 8 s, 10 times
  fail gnss off
";
const SCRIPT_FORMS: &[&str] = &["list", "run NAME|NUMBER", "stop", "status"];
const PARAM_FORMS: &[&str] = &["show [PATTERN]", "get NAME", "set NAME VALUE"];
const PARAM_DETAILS: &str = "A * in PATTERN stands for any letters. What is set is saved and told to every ground station.\n";
const REFERENCE_FORMS: &[&str] =
    &["altitude METRES", "airspeed M/S", "roll DEGREES", "course DEGREES"];
const REFERENCE_DETAILS: &str =
    "Roll needs the mode Position or Offboard, course the mode Position.\n";

pub(super) fn run(line: &str, now: WallTime, shared: &mut Shared) -> Answer {
    let words: Vec<&str> = line.split_whitespace().collect();
    let Some((name, arguments)) = words.split_first() else { return Ok(Output::default()) };
    match find(name) {
        // A command with this one form has no arguments.
        Some(command) if command.forms == [""] && !arguments.is_empty() => Err(usage(name)),
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
                // Writing to a string cannot fail.
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
    let value: Option<f64> = word.strip_suffix(unit).unwrap_or(word).parse().ok();
    let value = value.filter(|value| value.is_finite());
    value.ok_or_else(|| format!("{what} \"{word}\" is no number in {unit}"))
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
        [] => {
            let mark = |mode| if mode == shared.aircraft.mode() { '*' } else { ' ' };
            Ok(Output::text(Mode::ALL.map(|mode| format!("{} {mode}\n", mark(mode))).concat()))
        }
        [name] => {
            let mode = Mode::ALL.into_iter().find(|mode| mode.key().eq_ignore_ascii_case(name));
            let mode = mode.ok_or_else(|| {
                let names = Mode::ALL.map(Mode::key).join(", ");
                format!("there is no mode \"{name}\": there are {names}")
            })?;
            let mode = modes::enterable(mode, shared.streams)
                .map_err(|refused| refused.reason.unwrap_or_default())?;
            Ok(Output::command(VehicleCommand::Mode(mode), format!("Mode {mode}\n")))
        }
        _ => Err(usage("mode")),
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
    let text = format!("Simulation steps: {periods}\n");
    Ok(Output::command(PlantAction::Pace(Pace::Step(periods)), text))
}

fn speed(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    let [factor] = arguments else { return Err(usage("speed")) };
    let factor = number("speed", factor, "x")?;
    let text = format!("Simulation speed: x{factor}\n");
    Ok(Output::command(PlantAction::Pace(Pace::Speed(factor)), text))
}

fn reference(arguments: &[&str], _: WallTime, _: &mut Shared) -> Answer {
    let [name, value] = arguments else { return Err(usage("reference")) };
    let unit = match *name {
        "altitude" => "m",
        "airspeed" => "m/s",
        "roll" | "course" => "deg",
        _ => return Err(usage("reference")),
    };
    let number = number(name, value, unit)?;
    let reference = match *name {
        "altitude" => Reference::Altitude(number),
        "airspeed" => Reference::Airspeed(number),
        "roll" => Reference::Roll(number.to_radians()),
        _ if !(0.0..=360.0).contains(&number) => {
            return Err(format!("course {number} deg is outside 0 to 360 deg"));
        }
        _ => Reference::Course((number % 360.0).to_radians()),
    };
    let text = format!("Reference {name}: {number} {unit}\n");
    Ok(Output::command(VehicleCommand::Refer(reference), text))
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
    let is_file = shared.scripts.content(which).is_some();
    let script = match which.parse() {
        // A file may have a number for its name.
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
        let latest = if scripts.latest().is_some_and(|latest| latest == name) {
            ", uploaded last"
        } else {
            ""
        };
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

/// Injects a fault or clears one, in the words of scripts.
fn fault_in_words(verb: &str, words: &[&str], shared: &Shared) -> Answer {
    if words.iter().any(|word| word.contains(':')) {
        return Err(format!(
            "{verb} acts at once; for triggers there are scripts, for an onset there is failure -t TIME"
        ));
    }
    let line = format!("{verb} {}", words.join(" "));
    let script = Script::parse("shell", &line, shared.effectors()).map_err(|e| e.to_string())?;
    let Some(Action::Fault(request)) = script.lines().next().map(|line| line.action) else {
        return Err(usage(verb));
    };
    fault_request(request, shared)
}

/// Sends one request as it is, without the parameters `FLT_*`.
fn fault_request(request: FaultRequest, shared: &Shared) -> Answer {
    let request = crate::failure::checked(request, &shared.parameters, &shared.model)
        .map_err(|refused| refused.reason.unwrap_or_default())?;
    Ok(Output::command(PlantAction::Fault(request), ""))
}

const FAILURE_FORMS: &[&str] = &["COMPONENT TYPE [OPTION VALUE]...", "list", "clear"];
/// The rest of the help, for an aircraft with these effectors.
fn failure_details(effectors: &EffectorList) -> String {
    let unit = |name: &str, is_angle| {
        let one = |effector: &Effector| {
            format!("{} {}", effectors.instance(*effector), effectors.name(*effector))
        };
        let all: Vec<String> = effectors.by_unit(is_angle).iter().map(one).collect();
        format!("{name} ({})", all.join(", "))
    };
    let names = |of_kind: bool| {
        let all = Failure::all().filter(|failure| matches!(failure, Failure::Kind(_)) == of_kind);
        all.map(Failure::name).collect::<Vec<_>>().join(" ")
    };
    let sensors = SensorKind::ALL.map(|sensor| sensor.failure_unit().1).join(", ");
    let parts = AirframePart::ALL.map(AirframePart::key).join(", ");
    let (servos, motors, types, kinds) =
        (unit("servo", true), unit("motor", false), names(false), names(true));
    let mut text = format!(
        "Components: {servos}, {motors}, sensors ({sensors}),\n\
         parts of the airframe ({parts}).\nTypes: {types}; {kinds}.\n\
         \x20 -i N     instance; without -i and -m all of them\n\
         \x20 -m MASK  instances as bits, bit 0 the first\n\
         \x20 -v SIZE  5deg 40% 3deg/s 200ms 20kN here + -, of a sensor in its unit: 50m 200Pa;\n\
         \x20          without it by the parameters FLT_*\n"
    );
    for (option, kind, number) in options() {
        let (unit, what) =
            (number.quantity.measure().unit(TargetClass::Angle).name, number.quantity.name());
        let value = if unit == "s" { "TIME".to_owned() } else { unit.to_uppercase() };
        let name = kind.mavlink.failure_type.key();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {option} {value:<5} {what} of {name}");
    }
    text + TIMES_DETAILS
}

/// Options for times.
const TIMES: [(&str, Quantity); 5] = [
    ("-t", Quantity::Onset),
    ("-r", Quantity::Ramp),
    ("-d", Quantity::Duration),
    ("-e", Quantity::Every),
    ("-n", Quantity::Times),
];

const TIMES_DETAILS: &str = "\
\x20 -t TIME  onset, simulation time; without it at once
  -r TIME  ramp
  -d TIME  duration
  -e TIME  from one onset to the next
  -n N     how often in all
list shows the faults, clear mends everything and forgets what is scheduled.
";

/// Options for numbers besides the size of a fault.
fn options() -> impl Iterator<Item = (&'static str, &'static KindInfo, &'static NumberInfo)> {
    let numbers = |kind: &'static KindInfo| kind.numbers.iter().map(move |number| (kind, number));
    let all = CATALOGUE.iter().flat_map(numbers);
    all.filter(|(_, number)| number.option != SIZE_OPTION)
        .map(|(kind, number)| (number.option, kind, number))
}

/// Inject and clear faults of effectors, with the names of PX4's command of the same name and some more, as the same
/// [`FaultCommand`] as the commands of the MAVLink protocol.
fn failure(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    match arguments {
        ["list"] => Ok(Output::text(faults(shared))),
        ["clear"] => fault_request(FaultRequest::ClearAll, shared),
        [component, failure, options @ ..] => {
            let command = parse_fault(component, failure, options, shared.effectors())?;
            let requests = crate::failure::requests(&command, &shared.parameters, &shared.model)
                .map_err(|refused| refused.reason.unwrap_or_default())?;
            let commands = requests.into_iter().map(|request| PlantAction::Fault(request).into());
            Ok(Output { text: String::new(), commands: commands.collect() })
        }
        _ => Err(usage("failure")),
    }
}

fn parse_fault(
    component: &str,
    failure: &str,
    words: &[&str],
    effectors: &EffectorList,
) -> Result<FaultCommand, String> {
    let unit = Unit::parse(component).ok_or_else(|| {
        let names: Vec<&str> = Unit::names().collect();
        format!("there is no component {component}: there are {}", names.join(" "))
    })?;
    let failure = Failure::parse(failure).ok_or_else(|| {
        let names: Vec<&str> = Failure::all().map(Failure::name).collect();
        format!("there is no type {failure}: there are {}", names.join(" "))
    })?;
    let mut command = FaultCommand::new(unit, failure, Instances::All);
    for pair in words.chunks(2) {
        let [name, word] = *pair else {
            return Err(format!("option {} has no value", pair.join(" ")));
        };
        match name {
            "-i" | "-m" if command.instances != Instances::All => {
                return Err("the instances are named twice".into());
            }
            "-i" => command.instances = Instances::One(count(name, word)?),
            "-m" => command.instances = Instances::Mask(count(name, word)?),
            SIZE_OPTION => {
                let value = SizedKind::read(failure, word, unit.class(effectors));
                command.value = Some(value.map_err(|error| error.to_string())?);
            }
            _ => {
                let of_kinds = options().map(|(option, _, number)| (option, number.quantity));
                let quantity = TIMES.into_iter().chain(of_kinds).find(|(known, _)| *known == name);
                let (_, quantity) = quantity
                    .ok_or_else(|| format!("there is no option {name}, see help failure"))?;
                let unit = quantity.measure().unit(TargetClass::Angle);
                command.numbers.set(quantity, number(name, word, unit.name)?);
            }
        }
    }
    // As with PX4 and the MAVLink commands, instance 0 means all of them.
    if command.instances == Instances::One(0) {
        command.instances = Instances::All;
    }
    Ok(command)
}

fn count(name: &str, word: &str) -> Result<u32, String> {
    word.parse().map_err(|_| format!("{name} \"{word}\" is no whole number"))
}

/// The parameters of the parameter protocol, set in the same way as by PARAM_SET.
fn param(arguments: &[&str], now: WallTime, shared: &mut Shared) -> Answer {
    match arguments {
        ["show"] => show_parameters("*", shared),
        ["show", pattern] => show_parameters(pattern, shared),
        ["get", name] => get_parameter(name, shared),
        ["set", name, value] => set_parameter(name, value, now, shared),
        _ => Err(usage("param")),
    }
}

fn show_parameters(pattern: &str, shared: &Shared) -> Answer {
    let pattern = pattern.to_ascii_uppercase();
    let mut text = String::new();
    for row in rows(shared).filter(|row| matches(&pattern, &row.name)) {
        let line = format!("{:<16} {:>12} {}", row.name, value_text(&row), unit(&row));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    if text.is_empty() {
        return Err(format!("no parameter has a name like {pattern}"));
    }
    Ok(Output::text(text))
}

fn get_parameter(name: &str, shared: &Shared) -> Answer {
    let row = find_parameter(name, shared)?;
    let line = format!("{} {} {}", row.name, value_text(&row), unit(&row));
    let mut text = format!("{}\n", line.trim_end());
    if let Some(about) = table().iter().find(|about| *about.name == *row.name) {
        let _ = writeln!(text, "{} ({} to {})", about.meaning, about.min, about.max);
        for choice in about.choices {
            let _ = writeln!(text, "  {} {}", choice.value, choice.label);
        }
    } else if is_fault(&row.name) {
        text.push_str("What acts on an effector; here the command failure breaks and mends it\n");
        for choice in &FAULT_CHOICES {
            let _ = writeln!(text, "  {} {}", choice.value, choice.label);
        }
    } else {
        text.push_str("For ground stations that expect it; it cannot be changed\n");
    }
    Ok(Output::text(text))
}

fn set_parameter(name: &str, value: &str, now: WallTime, shared: &mut Shared) -> Answer {
    let row = find_parameter(name, shared)?;
    if is_fault(&row.name) {
        return Err(format!("{} is not set here: see help failure", row.name));
    }
    let number: Option<f64> = value.parse().ok().filter(|number: &f64| number.is_finite());
    let number = number.ok_or_else(|| format!("\"{value}\" is no number"))?;
    crate::param::write(&row, number, now, shared)?;
    let new = find_parameter(&row.name, shared)?;
    Ok(Output::text(format!("{} {} -> {}\n", row.name, value_text(&row), value_text(&new))))
}

fn find_parameter(name: &str, shared: &Shared) -> Result<Row, String> {
    let found = rows(shared).find(|row| row.name.eq_ignore_ascii_case(name));
    found.ok_or_else(|| format!("there is no parameter {name}"))
}

fn value_text(row: &Row) -> String {
    match row.kind {
        Kind::Int => format!("{:.0}", row.value),
        Kind::Real => row.value.to_string(),
    }
}

fn unit(row: &Row) -> &'static str {
    let about = table().iter().find(|about| *about.name == *row.name);
    about.map_or("", |about| about.unit).trim_matches('-')
}

/// Whether a name fits a pattern, where `*` stands for any letters.
fn matches(pattern: &str, name: &str) -> bool {
    let Some((head, tail)) = pattern.split_once('*') else { return pattern == name };
    let Some(mut rest) = name.strip_prefix(head) else { return false };
    let mut parts: Vec<&str> = tail.split('*').collect();
    let last = parts.pop().unwrap_or_default();
    for part in parts {
        // The first match is the best: it leaves the most for the rest.
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// The flight, the references, the compensator, the effectors.
fn status(_: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    let mut text = String::new();
    let _ = writeln!(text, "Aircraft: {}", phase(&shared.aircraft));
    let holder =
        shared.control.holder().map_or("nobody".into(), |system| format!("system {system}"));
    let _ = writeln!(text, "Control: {holder}");
    if let Some(state) = shared.aircraft.snapshot() {
        flight(&mut text, state, &shared.aircraft);
        compensator(&mut text, state, shared.parameters.gains.selection.compensator);
        let verdict = state.log.isolation.verdict.as_ref();
        let verdict = verdict.map(|verdict| verdict_text(verdict, shared.effectors()));
        let verdict = verdict.unwrap_or_else(|| "no effector is named".into());
        let _ = writeln!(text, "Isolation: {verdict}");
        effectors(&mut text, state, shared.effectors());
    }
    if let Some(script) = shared.scripts.running() {
        let _ = writeln!(text, "Script: {} runs", script.name());
    }
    text.push_str(&faults(shared));
    Ok(Output::text(text))
}

fn phase(aircraft: &Aircraft) -> &'static str {
    match (aircraft.phase(), aircraft.is_terminated()) {
        (Phase::NoFlight, _) => "none is connected",
        (Phase::Flying, false) => "in the air",
        (Phase::Flying, true) => "in the air, flight terminated",
        (Phase::OnGround, _) => "on the ground, the flight is over",
        (Phase::Lost, _) => "lost, no packet for a second",
    }
}

fn flight(text: &mut String, state: &Snapshot, aircraft: &Aircraft) {
    let (motion, demand) = (state.motion(), &state.demand);
    let euler = motion.attitude;
    let velocity = motion.velocity.0;
    let course = libm::atan2(velocity.y, velocity.x).to_degrees().rem_euclid(360.0);
    let _ = writeln!(text, "Time: {}, mode {}", state.time, aircraft.mode());
    let alive = state.motion().alive(&state.sensors);
    let dead = SensorKind::ALL.into_iter().zip(alive).filter(|(_, alive)| !alive);
    let dead: Vec<&str> = dead.map(|(sensor, _)| sensor.name()).collect();
    if !dead.is_empty() {
        let _ = writeln!(text, "Without valid samples: {}", dead.join(", "));
    }
    let _ = writeln!(
        text,
        "Position: {} deg, {} deg, altitude {} m",
        fixed(5, motion.latitude_rad.to_degrees()),
        fixed(5, motion.longitude_rad.to_degrees()),
        fixed(1, motion.altitude_m)
    );
    let _ = writeln!(
        text,
        "Motion: true airspeed {} m/s, climb {} m/s, course {} deg",
        fixed(1, motion.airspeed_m_s),
        fixed(1, motion.climb_rate_m_s()),
        fixed(1, course)
    );
    let _ = writeln!(
        text,
        "Attitude: roll {} deg, pitch {} deg, yaw {} deg",
        fixed(1, euler.phi.to_degrees()),
        fixed(1, euler.theta.to_degrees()),
        fixed(1, euler.psi.to_degrees().rem_euclid(360.0))
    );
    let _ = writeln!(
        text,
        "References: altitude {} m, true airspeed {} m/s, roll {} deg",
        fixed(1, demand.altitude_m),
        fixed(1, demand.airspeed_m_s),
        fixed(1, demand.roll_rad.to_degrees())
    );
}

fn compensator(text: &mut String, state: &Snapshot, mode: CompensatorMode) {
    let log = &state.log;
    let mode = match mode {
        CompensatorMode::Off => "off",
        CompensatorMode::Armed => "armed",
        CompensatorMode::AlwaysOn => "always on",
    };
    let seen = if log.compensator_active { "a fault is seen" } else { "no fault is seen" };
    let _ = writeln!(text, "Compensator: {mode}, {seen}, fade {}", fixed(2, log.fade));
    let _ = writeln!(text, "axis   estimate rad/s^2   level  authority");
    for (axis, z2, level) in [
        (Axis::Roll, log.z2.x, log.levels.x),
        (Axis::Pitch, log.z2.y, log.levels.y),
        (Axis::Yaw, log.z2.z, log.levels.z),
    ] {
        let left = axis.authority_pct(&log.authority);
        let (z2, level, left) = (fixed(4, z2), fixed(2, level), fixed(0, left));
        let _ = writeln!(text, "{:<6} {z2:>16} {level:>7} {left:>8} %", axis.key());
    }
}

fn effectors(text: &mut String, state: &Snapshot, list: &EffectorList) {
    let log = &state.log;
    let _ = writeln!(text, "effector         command   modelled");
    for effector in list.all() {
        let largest = log.commands[effector].abs().max(log.modelled[effector].abs());
        let (scale, unit) = list.shown_unit(effector, largest);
        let commanded = fixed(2, log.commands[effector] * scale);
        let modelled = fixed(2, log.modelled[effector] * scale);
        let limit = if log.limited.contains(effector) { "  at its limit" } else { "" };
        let _ = writeln!(
            text,
            "{:<14} {commanded:>9}  {modelled:>9} {unit}{limit}",
            list.name(effector)
        );
    }
}

/// With this many decimal places; zero has no sign.
fn fixed(digits: usize, value: f64) -> String {
    let text = format!("{value:.digits$}");
    let is_zero = |digits: &&str| digits.bytes().all(|byte| matches!(byte, b'0' | b'.'));
    match text.strip_prefix('-').filter(is_zero) {
        Some(zero) => zero.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::{fixed, matches};

    #[test]
    fn a_star_stands_for_any_letters() {
        for (pattern, name) in [
            ("*", "FTC_MODE"),
            ("FTC*", "FTC_MODE"),
            ("*MODE", "FTC_MODE"),
            ("F*_M*E", "FTC_MODE"),
            ("FTC_MODE", "FTC_MODE"),
            ("FTC_MODE*", "FTC_MODE"),
            ("**", "FTC_MODE"),
        ] {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [
            ("FTC", "FTC_MODE"),
            ("MODE*", "FTC_MODE"),
            ("*FTC", "FTC_MODE"),
            ("FTC_MODE*E", "FTC_MODE"),
            ("", "FTC_MODE"),
        ] {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn a_zero_has_no_sign_and_everything_else_keeps_it() {
        for (digits, value, text) in [
            (2, -0.004, "0.00"),
            (0, -0.0, "0"),
            (2, -0.006, "-0.01"),
            (1, -10.0, "-10.0"),
            (1, 3.0, "3.0"),
            (1, f64::NAN, "NaN"),
        ] {
            assert_eq!(fixed(digits, value), text, "{value}");
        }
    }
}
