//! A fault in the words of a script, where there is no script: from Python, and as an input of an FMU.

use autopilot::script::{Action, Script, Trigger};
use icd::{EffectorList, FaultRequest};

use crate::problem::{Problem, problem};

/// One line of a script that injects or clears a fault, with its trigger; `fail` may be left out.
pub fn line(text: &str, list: &EffectorList) -> Result<(Trigger, FaultRequest), Problem> {
    let (trigger, action) =
        text.rsplit_once(':').map_or(("", text), |(trigger, action)| (trigger, action));
    let (colon, action) = (if trigger.is_empty() { "" } else { ": " }, action.trim());
    let starts =
        |word: &str| action.get(..word.len()).is_some_and(|a| a.eq_ignore_ascii_case(word));
    let fail = if starts("fail ") || starts("clear ") { "" } else { "fail " };
    let parsed = Script::parse("fault", &format!("{trigger}{colon}{fail}{action}"), list);
    // Its place is that in the longer line.
    let script = parsed.map_err(|error| {
        let error = error.to_string();
        let what = error.split_once(": ").map_or(error.as_str(), |(_, what)| what);
        problem!("{text:?}: {what}")
    })?;
    let mut lines = script.lines();
    match (lines.next(), lines.next()) {
        (Some(line), None) if let Action::Fault(request) = line.action => {
            if matches!(line.trigger, Trigger::When(_)) {
                return Err(problem!("{text:?} waits for a quantity; a script can do that"));
            }
            Ok((line.trigger, request))
        }
        _ => Err(problem!("{text:?} is not one fault")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;

    #[test]
    fn a_line_is_one_fault_or_one_repair() {
        let list = tvc_jet::effectors();
        let read = |text: &str| line(text, &list).map_err(|problem| problem.to_string());
        let (trigger, request) = read("at 3 s: Fail left elevator stuck at 30 deg").unwrap();
        assert_eq!(trigger, Trigger::At(3_000_000));
        assert_eq!(read("after 3 s: left elevator stuck at 30 deg").unwrap().1, request);
        assert_eq!(read("clear all"), Ok((Trigger::AtOnce, FaultRequest::ClearAll)));
        let refused = |text, why: &str| {
            let error = read(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        };
        refused("fail rudder stuck\nfail engine stuck", "not one fault");
        refused("when roll passes 10 deg: rudder stuck", "waits for a quantity");
        refused("roll 10 deg", "`roll` found, expected an effector");
        refused("", "expected an effector");
        refused("é", "belongs to no word");
    }
}
