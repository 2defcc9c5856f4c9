//! `failure`: break and mend effectors, in the words of PX4's command of the same name.

use icd::FaultRequest;

use super::{Answer, Asking, Order, list, number, usage};
use crate::event::Wish;
use crate::mavlink::codec::Command;
use crate::mavlink::failure::{self, Requests};

pub(super) const FORMS: &[&str] =
    &["servo|motor TYPE [-i INSTANCE | -m MASK] [-v VALUE] [-t SECONDS]", "list", "clear"];
pub(super) const DETAILS: &str = "\
TYPE is ok, off, stuck or wrong. VALUE is 5deg for stuck, 40% for wrong. Without -i and -m all instances are meant.
-t is the onset in seconds of simulation time, without it at once. list shows the faults, clear mends everything.
Servos are 1 left aileron, 2 right aileron, 3 left elevator, 4 right elevator, 5 rudder, 6 nozzle pitch, 7 nozzle yaw; motor 1
is the engine.
";

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    match arguments {
        ["list"] => Ok(Order::say(list::text(asking))),
        ["clear"] => {
            if !asking.ctx.parameters.failure.enabled {
                return Err("fault injection is off (SYS_FAILURE_EN 0)".into());
            }
            Ok(Order::ask(Wish::Fault(FaultRequest::ClearAll), ""))
        }
        [component, failure_type, options @ ..] => {
            let options = Options::parse(options)?;
            let requests = requests(component, failure_type, &options, asking)?;
            let wishes =
                requests.into_iter().map(|request| (Wish::Fault(request), request.effector()));
            Ok(Order { said: String::new(), wishes: wishes.collect() })
        }
        _ => Err(usage("failure")),
    }
}

/// What stands behind the type.
#[derive(Debug, Default)]
struct Options<'a> {
    instance: Option<u32>,
    mask: Option<u32>,
    value: Option<&'a str>,
    onset_s: Option<f64>,
}

impl<'a> Options<'a> {
    fn parse(words: &[&'a str]) -> Result<Self, String> {
        let mut options = Self::default();
        for pair in words.chunks(2) {
            let [name, word] = *pair else {
                return Err(format!("option {} has no value", pair.join(" ")));
            };
            match name {
                "-i" => options.instance = Some(count(name, word)?),
                "-m" => options.mask = Some(count(name, word)?),
                "-v" => options.value = Some(word),
                "-t" => options.onset_s = Some(number(name, word, "s")?),
                _ => return Err(format!("there is no option {name}, see help failure")),
            }
        }
        Ok(options)
    }
}

fn count(name: &str, word: &str) -> Result<u32, String> {
    word.parse().map_err(|_| format!("{name} \"{word}\" is no whole number"))
}

/// The requests that a MAV_CMD_USER_1 with the same meaning would make, with the same checks.
fn requests(
    component: &str,
    failure_type: &str,
    options: &Options,
    asking: &Asking,
) -> Result<Requests, String> {
    let unit = match component {
        "servo" => 102.0,
        "motor" => 101.0,
        _ => return Err(format!("no failures of {component}: there are servo and motor")),
    };
    let failure_type = match failure_type {
        "ok" => 0.0,
        "off" => 1.0,
        "stuck" => 2.0,
        "wrong" => 4.0,
        _ => return Err(format!("no failures of type {failure_type}")),
    };
    let (kind, value) = match options.value {
        None => (0.0, f32::NAN),
        Some(word) if word.ends_with('%') => (2.0, narrow(number("-v", word, "%")?)),
        Some(word) => (1.0, narrow(number("-v", word, "deg")?)),
    };
    let mut all = Requests::new();
    let instances: Vec<u32> = match (options.instance, options.mask) {
        (Some(_), Some(_)) => return Err("-i and -m exclude each other".into()),
        (instance, None) => vec![instance.unwrap_or(0)],
        (None, Some(mask)) => (1..=32).filter(|bit| mask & (1 << (bit - 1)) != 0).collect(),
    };
    for instance in instances {
        let params = [
            unit,
            failure_type,
            narrow(f64::from(instance)),
            kind,
            value,
            f32::NAN,
            options.onset_s.map_or(f32::NAN, narrow),
        ];
        let command = Command { id: failure::USER_1, params, frame: None, xy: None };
        let requests = failure::requests(&command, asking.ctx.parameters, asking.ctx.belief)
            .map_err(|refused| refused.reason.unwrap_or_default())?;
        for request in requests {
            all.try_push(request).map_err(|_| "too many instances".to_owned())?;
        }
    }
    Ok(all)
}

fn narrow(value: f64) -> f32 {
    crate::mavlink::convert::float(value)
}
