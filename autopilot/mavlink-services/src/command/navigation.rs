//! Circle somewhere, pause, home, and the plan.

use crate::codec::{CommandError, CommandMessage};
use crate::command::fields::{
    Location, byte, flag, ground_speed, location, location_or_here, number, place, signed_radius,
    word,
};
use crate::command::{Caller, Decision};
use crate::{Shared, telemetry};
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Place, Reposition};

const CHANGE_MODE: u8 = 1;

/// DO_REPOSITION: p1 speed, p2 flags, p3 radius, p4 direction, p5 to p7 location. Parameters not given leave their value
/// unchanged; a command without any means "circle here".
pub fn reposition(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let [speed, flags, radius, direction, ..] = command.params;
    let flags = if flags.is_nan() { 0 } else { byte("flags p2", flags)? };
    let change_mode = flags & CHANGE_MODE != 0;
    if !change_mode && caller.shared.aircraft.mode() != Mode::Hold {
        return Err(CommandError::denied(
            "Reposition refused: it needs Hold, or bit 0 of p2 to change to it",
        ));
    }
    let (radius_m, turns_right) = signed_radius("radius p3", radius)?;
    // Some ground stations send a yaw angle here: only the exact numbers are a direction. MAVSDK turns left by a negative radius.
    let clockwise = match (number("direction p4", direction)?, turns_right) {
        (_, Some(false)) | (Some(1.0), _) => Some(false),
        (Some(0.0), _) | (None, Some(true)) => Some(true),
        _ => None,
    };
    let centre = location(command, caller.shared)?;
    let airspeed_m_s = kept_or_ground_speed(speed, caller.shared)?;
    Ok(circle_at(centre, (radius_m, clockwise), airspeed_m_s, change_mode, caller.shared))
}

/// A speed over the ground; negative values and NaN leave it unchanged.
fn kept_or_ground_speed(speed: f32, shared: &Shared) -> Result<Option<f64>, CommandError> {
    let speed = number("speed", speed)?.filter(|speed| *speed >= 0.0);
    speed.map(|speed| ground_speed(speed, shared)).transpose()
}

/// DO_ORBIT: p1 radius, positive clockwise, p2 speed, p3 nose direction (always along the circle),
/// p4 angle to fly, p5 to p7 centre.
pub fn orbit(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let [radius, speed, _, arc, ..] = command.params;
    let turn = signed_radius("radius p1", radius)?;
    if number("p4", arc)?.is_some_and(|arc| arc != 0.0) {
        return Err(CommandError::denied("Orbit refused: only without an end (p4 = 0)"));
    }
    let centre = location(command, caller.shared)?;
    let airspeed_m_s = kept_or_ground_speed(speed, caller.shared)?;
    Ok(circle_at(centre, turn, airspeed_m_s, true, caller.shared))
}

/// NAV_LOITER_UNLIM: p3 radius, positive clockwise, p5 to p7 centre, zeros for "here".
pub fn loiter(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let [_, _, radius, ..] = command.params;
    circle(command, radius, caller.shared)
}

/// NAV_LOITER_TO_ALT: p2 radius, positive clockwise, p5 to p7 centre, zeros for "here". The aircraft stays.
pub fn loiter_to_altitude(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [_, radius, ..] = command.params;
    circle(command, radius, caller.shared)
}

fn circle(
    command: &CommandMessage,
    radius: f32,
    shared: &Shared,
) -> Result<Decision, CommandError> {
    let turn = signed_radius("radius", radius)?;
    Ok(circle_at(location_or_here(command, shared)?, turn, None, true, shared))
}

/// Forwards the command; reports a circle that is too small for the airspeed. Wind widens it further.
fn circle_at(
    Location { place, altitude_m }: Location,
    (radius_m, clockwise): (Option<f64>, Option<bool>),
    airspeed_m_s: Option<f64>,
    change_mode: bool,
    shared: &Shared,
) -> Decision {
    let target = Reposition { place, altitude_m, radius_m, clockwise, airspeed_m_s, change_mode };
    let widened = |radius_m| shared.aircraft.widened(radius_m, airspeed_m_s, &shared.parameters);
    let note = radius_m.and_then(widened);
    Decision::pass_on(VehicleCommand::Reposition(target)).with_note(note)
}

/// DO_PAUSE_CONTINUE: p1 0 circles here, 1 continues a paused plan.
pub fn pause_or_continue(
    command: &CommandMessage,
    _: &mut Caller,
) -> Result<Decision, CommandError> {
    if !flag("p1", command.params[0])? {
        return Ok(Decision::pass_on(VehicleCommand::Reposition(Reposition {
            change_mode: true,
            ..Reposition::default()
        })));
    }
    Ok(Decision::pass_on(VehicleCommand::Continue))
}

/// DO_SET_HOME: p1 1 for below the aircraft, 0 for p5 and p6. Home is on the ground, whatever the value of p7.
pub fn set_home(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let [here, _, _, _, _, _, altitude] = command.params;
    if flag("p1", here)? {
        let state = caller.shared.aircraft.snapshot();
        let state =
            state.ok_or_else(|| CommandError::temporary("Home refused: no position yet"))?;
        return Ok(Decision::pass_on(VehicleCommand::Home(Place::of(state.motion()))));
    }
    let altitude = number("altitude p7", altitude)?;
    let place = place(command)?
        .ok_or_else(|| CommandError::denied("Home refused: no latitude and longitude (p5, p6)"))?;
    let note = altitude
        .filter(|altitude| *altitude != 0.0)
        .map(|altitude| format!("Home is on the ground at altitude 0 m: {altitude} m is not used"));
    Ok(Decision::pass_on(VehicleCommand::Home(place)).with_note(note))
}

/// "The current item" in DO_SET_MISSION_CURRENT.
const CURRENT: f64 = -1.0;

/// MISSION_START: p1 first item (NaN: the current one), p2 last item (0 or NaN: the last of the plan).
pub fn start_mission(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [first, last, ..] = command.params;
    let plan = plan(caller)?;
    let first = word("first item p1", first)?;
    let end = word("last item p2", last)?.filter(|last| *last != 0);
    if end.is_some_and(|last| last != plan.items - 1) {
        return Err(CommandError::denied("Mission refused: a plan is flown to its end (p2 = 0)"));
    }
    let begin = VehicleCommand::Mode(Mode::Mission);
    match first {
        Some(first) if first >= plan.items => Err(CommandError::denied(format!(
            "Mission refused: no item {first}, the plan has 0 to {}",
            plan.items - 1
        ))),
        Some(first) => {
            let intents = vec![VehicleCommand::PlanItem(first).into(), begin.into()];
            Ok(Decision { intents, ..Decision::default() })
        }
        None => Ok(Decision::pass_on(begin)),
    }
}

/// DO_SET_MISSION_CURRENT: p1 item, -1 for the current one, p2 1 to reset the counts of its jumps.
pub fn set_mission_item(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [item, reset, ..] = command.params;
    let resets = !reset.is_nan() && flag("p2", reset)?;
    if number("item p1", item)? == Some(CURRENT) && !resets {
        // By the definition the current item is published even if nothing changes.
        let state = caller.shared.aircraft.snapshot();
        return Ok(Decision::answer(state.map(telemetry::mission_current).into_iter().collect()));
    }
    // The protocol requires FAILED for an item that does not exist, and without a plan.
    let plan =
        plan(caller).map_err(|refused| CommandError::failed(refused.reason.unwrap_or_default()))?;
    let item = match number("item p1", item)? {
        Some(CURRENT) => Some(plan.item),
        _ => word("item p1", item)?,
    };
    match item {
        Some(item) if item < plan.items => Ok(Decision::pass_on(VehicleCommand::PlanItem(item))),
        _ => Err(CommandError::failed(format!(
            "Mission refused: no such item, the plan has 0 to {}",
            plan.items - 1
        ))),
    }
}

/// A plan that the aircraft has accepted.
struct Loaded {
    items: u16,
    item: u16,
}

/// The known properties of the plan, if there is one. The upload knows it before the next state shows it: by the
/// state alone the service would deny commands to a plan acknowledged a moment ago. The state counts only for a plan
/// that no ground station has uploaded.
fn plan(caller: &Caller) -> Result<Loaded, CommandError> {
    let (shown, item) = caller.shared.aircraft.snapshot().map_or((0, 0), |state| {
        let navigation = state.navigation;
        (navigation.items, navigation.item)
    });
    match (caller.shared.plan_items, shown) {
        (0, 0) => Err(CommandError::temporary("Mission refused: there is no plan")),
        (0, items) => Ok(Loaded { items, item }),
        // An earlier state may show an item that the new plan does not have.
        (items, _) => Ok(Loaded { items, item: item.min(items - 1) }),
    }
}
