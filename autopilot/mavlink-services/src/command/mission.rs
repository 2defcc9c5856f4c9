//! Begin the plan, go on with another of its items.

use super::fields::{flag, number, word};
use super::{Asking, Decision};
use crate::codec::CommandMessage;
use crate::refused::Refused;
use crate::telemetry;
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Mode;

/// "The current item" in DO_SET_MISSION_CURRENT.
const CURRENT: f64 = -1.0;

/// MISSION_START: p1 first item (NaN: where it was), p2 last item (0 or NaN: the last one).
pub fn start(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [first, last, ..] = command.params;
    let plan = plan(asking)?;
    let first = word("first item p1", first)?;
    let end = word("last item p2", last)?.filter(|last| *last != 0);
    if end.is_some_and(|last| last != plan.items - 1) {
        return Err(Refused::denied("Mission refused: a plan is flown to its end (p2 = 0)"));
    }
    let begin = Command::Vehicle(VehicleCommand::Mode(Mode::Mission));
    match first {
        Some(first) if first >= plan.items => Err(Refused::denied(format!(
            "Mission refused: no item {first}, the plan has 0 to {}",
            plan.items - 1
        ))),
        Some(first) => {
            Ok(Decision::ask_all([Command::Vehicle(VehicleCommand::PlanItem(first)), begin]))
        }
        None => Ok(Decision::ask(begin)),
    }
}

/// DO_SET_MISSION_CURRENT: p1 item, -1 for the current one, p2 1 to begin anew the counts of its jumps.
pub fn set_current(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [item, reset, ..] = command.params;
    let resets = !reset.is_nan() && flag("p2", reset)?;
    if number("item p1", item)? == Some(CURRENT) && !resets {
        // The definition wants the current item told also when nothing changes.
        let state = asking.ctx.aircraft.snapshot();
        return Ok(Decision::show(state.map(telemetry::mission_current).into_iter().collect()));
    }
    // The protocol wants FAILED for an item that is not there, and for a plan that is not there.
    let plan =
        plan(asking).map_err(|refused| Refused::failed(refused.reason.unwrap_or_default()))?;
    let item = match number("item p1", item)? {
        Some(CURRENT) => Some(plan.item),
        _ => word("item p1", item)?,
    };
    match item {
        Some(item) if item < plan.items => Ok(Decision::ask(VehicleCommand::PlanItem(item))),
        _ => Err(Refused::failed(format!(
            "Mission refused: no such item, the plan has 0 to {}",
            plan.items - 1
        ))),
    }
}

/// A plan that the aircraft has taken.
struct Loaded {
    /// Items.
    items: u16,
    /// Current item.
    item: u16,
}

/// What is known about the plan, if there is one. The upload knows it before the next state shows it: by the
/// state alone a plan that was acknowledged a moment ago would be denied. The state counts only for a plan
/// that no ground station has uploaded.
fn plan(asking: &Asking) -> Result<Loaded, Refused> {
    let (shown, item) = asking.ctx.aircraft.snapshot().map_or((0, 0), |state| {
        let navigation = state.navigation;
        (navigation.items, navigation.item)
    });
    match (asking.ctx.plan_items, shown) {
        (0, 0) => Err(Refused::for_now("Mission refused: there is no plan")),
        (0, items) => Ok(Loaded { items, item }),
        // A state from before may show an item that the new plan does not have.
        (items, _) => Ok(Loaded { items, item: item.min(items - 1) }),
    }
}
