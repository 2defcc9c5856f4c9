//! `failure`: inject and clear faults of effectors, with the names of PX4's command of the same name and some more.
//! It builds the same [`FaultCommand`] as the commands of the MAVLink protocol.

use std::fmt::Write as _;

use icd::fault::{
    AirframePart, CATALOGUE, Failure, KindInfo, NumberInfo, PlantAction, Quantity, SIZE_OPTION,
    SensorKind, SizedKind, TargetClass,
};
use icd::{Effector, EffectorList, FaultRequest};

use crate::Shared;
use crate::failure::command;
use crate::failure::command::{FaultCommand, Instances, Unit};
use crate::shell::commands::{Answer, Output, number, usage};
use crate::wall_time::WallTime;

pub(super) const FORMS: &[&str] = &["COMPONENT TYPE [OPTION VALUE]...", "list", "clear"];
/// The rest of the help, for an aircraft with these effectors.
pub(super) fn details(effectors: &EffectorList) -> String {
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

pub(super) fn run(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    match arguments {
        ["list"] => Ok(Output::text(super::faults(shared))),
        ["clear"] => clear(shared),
        [component, failure, options @ ..] => {
            let command = parse(component, failure, options, shared.effectors())?;
            let requests = command::requests(&command, &shared.parameters, &shared.model)
                .map_err(|refused| refused.reason.unwrap_or_default())?;
            let commands = requests.into_iter().map(|request| PlantAction::Fault(request).into());
            Ok(Output { text: String::new(), commands: commands.collect() })
        }
        _ => Err(usage("failure")),
    }
}

fn clear(shared: &Shared) -> Answer {
    if shared.parameters.failure.enabled {
        Ok(Output::command(PlantAction::Fault(FaultRequest::ClearAll), ""))
    } else {
        Err("Fault refused: fault injection is off (SYS_FAILURE_EN 0)".into())
    }
}

fn parse(
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
