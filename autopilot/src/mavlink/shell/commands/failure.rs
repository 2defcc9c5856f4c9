//! `failure`: break and mend effectors, in the words of PX4's command of the same name and some more. It gives the
//! same order as the commands of the MAVLink protocol.

use flight_control::Belief;
use icd::fault::Onset;
use icd::{FaultRequest, SimTime};

use super::{Answer, Asking, Order, list, number, usage};
use crate::event::Wish;
use crate::mavlink::failure::order::{self, FailureType, FaultOrder, Instances, Unit, Value};

pub(super) const FORMS: &[&str] = &["COMPONENT TYPE [OPTION VALUE]...", "list", "clear"];
pub(super) const DETAILS: &str = "\
Components: servo (1 left aileron, 2 right aileron, 3 left elevator, 4 right elevator, 5 rudder, 6 nozzle pitch,
7 nozzle yaw), motor (1 the engine).
Types: ok off stuck garbage wrong slow delayed intermittent drift; hardover bias limit oscillate loss float flameout.
  -i N     instance; without -i and -m all of them
  -m MASK  instances as bits, bit 0 the first
  -v SIZE  5deg 40% 3deg/s 200ms 20kN here + -; without it by the parameters FLT_*
  -f HZ    frequency of garbage and oscillate
  -p TIME  period of intermittent
  -t TIME  onset, simulation time; without it at once
  -r TIME  ramp
  -d TIME  duration
  -e TIME  from one onset to the next
  -n N     how often in all
list shows the faults, clear mends everything and forgets what is scheduled.
";

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    match arguments {
        ["list"] => Ok(Order::say(list::text(asking))),
        ["clear"] => clear(asking),
        [component, failure_type, options @ ..] => {
            let order = order_of(component, failure_type, options, asking.ctx.belief)?;
            let requests = order::requests(&order, asking.ctx.parameters, asking.ctx.belief)
                .map_err(|refused| refused.reason.unwrap_or_default())?;
            let wishes =
                requests.into_iter().map(|request| (Wish::Fault(request), request.effector()));
            Ok(Order { said: String::new(), wishes: wishes.collect() })
        }
        _ => Err(usage("failure")),
    }
}

fn clear(asking: &Asking) -> Answer {
    if asking.ctx.parameters.failure.enabled {
        Ok(Order::ask(Wish::Fault(FaultRequest::ClearAll), ""))
    } else {
        Err("Fault refused: fault injection is off (SYS_FAILURE_EN 0)".into())
    }
}

fn order_of(
    component: &str,
    failure_type: &str,
    options: &[&str],
    belief: &Belief,
) -> Result<FaultOrder, String> {
    let unit = Unit::parse(component).ok_or_else(|| {
        let names: Vec<&str> = Unit::names().collect();
        format!("there is no component {component}: there are {}", names.join(" "))
    })?;
    let failure_type = FailureType::parse(failure_type).ok_or_else(|| {
        let names: Vec<&str> = FailureType::names().collect();
        format!("there is no type {failure_type}: there are {}", names.join(" "))
    })?;
    let mut order = FaultOrder::new(unit, failure_type, Instances::All);
    for pair in options.chunks(2) {
        let [name, word] = *pair else {
            return Err(format!("option {} has no value", pair.join(" ")));
        };
        match name {
            "-i" | "-m" if order.instances != Instances::All => {
                return Err("the instances are named twice".into());
            }
            "-i" => order.instances = Instances::One(count(name, word)?),
            "-m" => order.instances = Instances::Mask(count(name, word)?),
            "-v" => order.value = Some(value(failure_type, unit, word, belief)?),
            "-f" => order.frequency_hz = Some(number(name, word, "Hz")?),
            "-p" => order.period_s = Some(number(name, word, "s")?),
            "-t" => order.onset = onset(number(name, word, "s")?)?,
            "-r" => order.ramp_s = Some(number(name, word, "s")?),
            "-d" => order.duration_s = Some(number(name, word, "s")?),
            "-e" => order.every_s = Some(number(name, word, "s")?),
            "-n" => order.times = Some(count(name, word)?),
            _ => return Err(format!("there is no option {name}, see help failure")),
        }
    }
    // As with PX4 and the commands, instance 0 is all of them.
    if order.instances == Instances::One(0) {
        order.instances = Instances::All;
    }
    Ok(order)
}

fn onset(seconds: f64) -> Result<Onset, String> {
    let at = SimTime::from_seconds(seconds);
    at.map(Onset::At).ok_or_else(|| format!("-t {seconds} s is no simulation time"))
}

/// A size with its unit. Thrusts of the engine become percent of its largest.
fn value(
    failure_type: FailureType,
    unit: Unit,
    word: &str,
    belief: &Belief,
) -> Result<Value, String> {
    use FailureType as T;
    let per_second = word.strip_suffix("kN/s").map(|digits| (digits, "%/s"));
    let thrust = per_second.or_else(|| word.strip_suffix("kN").map(|digits| (digits, "%")));
    let parsed = match thrust {
        None => Value::parse(failure_type, word),
        Some((digits, suffix)) => {
            let has_thrust = matches!(
                failure_type,
                T::Garbage | T::Oscillate | T::Bias | T::Limit | T::Slow | T::Drift
            );
            if unit != Unit::MOTOR || !has_thrust {
                return Err(format!("{} of {unit} takes no thrust {word}", failure_type.name()));
            }
            let newton = 1.0e3 * number("-v", digits, "kN")?;
            let percent = 100.0 * newton / belief.effectors.thrust_range_n()[1];
            Value::parse(failure_type, &format!("{percent}{suffix}"))
        }
    };
    parsed.map_err(|error| error.to_string())
}

fn count(name: &str, word: &str) -> Result<u32, String> {
    word.parse().map_err(|_| format!("{name} \"{word}\" is no whole number"))
}
