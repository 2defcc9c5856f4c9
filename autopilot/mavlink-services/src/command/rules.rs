//! The table of commands, and the rule of each: its parameters, finite and in range, become commands to the aircraft, the
//! plant or the script, or the reason of a refusal.

use ::mavlink::dialects::common::MavResult;
use icd::fault::PlantAction;
use icd::pace::Pace;

use crate::aircraft::Phase;
use crate::codec::{CommandError, CommandMessage};
use crate::command::{Decision, check_not_over};
use crate::{Caller, Shared, convert, failure, modes, telemetry};
use flight_management::command::{ScriptCommand, VehicleCommand};
use flight_management::vehicle::{Airspeed, Mode, Place, Reference, Reposition, VehicleRefusal};

/// The decision about a command, or why it is refused.
type Ruling = Result<Decision, CommandError>;
type Rule = fn(&CommandMessage, &mut Caller) -> Ruling;

/// Number of each command (MAV_CMD), its name and its rule.
const RULES: [(u16, &str, Rule); 36] = [
    (17, "NAV_LOITER_UNLIM", loiter),
    (20, "NAV_RETURN_TO_LAUNCH", return_home),
    (21, "NAV_LAND", land),
    (22, "NAV_TAKEOFF", take_off),
    (31, "NAV_LOITER_TO_ALT", loiter_to_altitude),
    (34, "DO_ORBIT", orbit),
    (176, "DO_SET_MODE", set_mode),
    (178, "DO_CHANGE_SPEED", change_speed),
    (179, "DO_SET_HOME", set_home),
    (185, "DO_FLIGHTTERMINATION", terminate),
    (186, "DO_CHANGE_ALTITUDE", change_altitude),
    (189, "DO_LAND_START", land),
    (191, "DO_GO_AROUND", go_around),
    (192, "DO_REPOSITION", reposition),
    (193, "DO_PAUSE_CONTINUE", pause_or_continue),
    (207, "DO_FENCE_ENABLE", enable_fence),
    (224, "DO_SET_MISSION_CURRENT", set_mission_item),
    (241, "PREFLIGHT_CALIBRATION", calibrate),
    (246, "PREFLIGHT_REBOOT_SHUTDOWN", restart),
    (262, "DO_SET_STANDARD_MODE", set_standard_mode),
    (300, "MISSION_START", start_mission),
    (400, "COMPONENT_ARM_DISARM", arm_or_disarm),
    (401, "RUN_PREARM_CHECKS", prearm_checks),
    (410, "GET_HOME_POSITION", |_, caller| show(caller, 242.0, 0.0)),
    (failure::INJECT_FAILURE, "INJECT_FAILURE", fault),
    (510, "GET_MESSAGE_INTERVAL", interval),
    (511, "SET_MESSAGE_INTERVAL", set_interval),
    (512, "REQUEST_MESSAGE", request),
    (519, "REQUEST_PROTOCOL_VERSION", |command, caller| show_if_1(command, caller, 300.0)),
    (520, "REQUEST_AUTOPILOT_CAPABILITIES", |command, caller| show_if_1(command, caller, 148.0)),
    (failure::USER_1, "USER_1", fault),
    (USER_2, "USER_2", pace),
    (USER_3, "USER_3", script),
    (43_000, "GUIDED_CHANGE_SPEED", guided_speed),
    (43_001, "GUIDED_CHANGE_ALTITUDE", guided_altitude),
    (43_002, "GUIDED_CHANGE_HEADING", guided_heading),
];

/// Outcome of a command.
pub(super) fn decide(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    match RULES.iter().find(|(id, ..)| *id == command.id) {
        Some((.., rule)) => rule(command, caller),
        None => Err(CommandError::without_text(MavResult::MAV_RESULT_UNSUPPORTED)),
    }
}

/// Number and name of each command that is understood.
pub fn known() -> impl Iterator<Item = (u16, &'static str)> {
    RULES.iter().map(|(id, name, _)| (*id, *name))
}

/// p2 of COMPONENT_ARM_DISARM that forces it: a forced disarm in the air ends the flight.
const FORCE: f32 = 21_196.0;

/// DO_SET_MODE: p1 base mode, p2 main mode, p3 sub mode.
fn set_mode(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    check_not_over(caller.shared)?;
    let [base, main, sub, ..] = command.params;
    let has_custom_flag = byte("base mode p1", base)? & 1 != 0;
    let main = byte("main mode p2", main)?;
    // A main mode without sub modes needs no sub mode.
    let sub = if sub.is_nan() { 0 } else { byte("sub mode p3", sub)? };
    let mode = modes::requested(has_custom_flag, main, sub, caller.shared.streams)?;
    Ok(Decision::pass_on(VehicleCommand::Mode(mode)))
}

/// DO_SET_STANDARD_MODE: p1 MAV_STANDARD_MODE.
fn set_standard_mode(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let standard_mode = byte("standard mode p1", command.params[0])?;
    let mode = modes::requested_standard(standard_mode, caller.shared.streams)?;
    Ok(Decision::pass_on(VehicleCommand::Mode(mode)))
}

fn return_home(_: &CommandMessage, _: &mut Caller) -> Ruling {
    Ok(Decision::pass_on(VehicleCommand::Mode(Mode::Return)))
}

/// COMPONENT_ARM_DISARM: p1 1 arms, 0 disarms, p2 21196 also in the air.
fn arm_or_disarm(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [arm, force, ..] = command.params;
    let aircraft = &caller.shared.aircraft;
    let has_to_fly = aircraft.phase() == Phase::Flying && !aircraft.is_terminated();
    if flag("p1", arm)? {
        return match caller.shared.not_ready() {
            None if aircraft.is_armed() => Ok(Decision::default()),
            None => Ok(Decision::pass_on(VehicleCommand::Arm(true))),
            Some(reason) => Err(CommandError::temporary(format!("PreArm: {reason}"))),
        };
    }
    match aircraft.phase() {
        Phase::OnGround | Phase::NoFlight => Ok(Decision::default()),
        Phase::Flying if has_to_fly && aircraft.is_on_wheels() => {
            Ok(Decision::pass_on(VehicleCommand::Arm(false)))
        }
        Phase::Flying | Phase::Lost if force == FORCE => {
            Ok(Decision::pass_on(VehicleCommand::Terminate)
                .with_note("Disarmed by force in the air: the flight is terminated".to_owned()))
        }
        Phase::Flying | Phase::Lost => Err(CommandError::temporary(
            "Disarming refused: the aircraft is in the air (p2 = 21196 terminates the flight)",
        )),
    }
}

/// RUN_PREARM_CHECKS. An armed aircraft must answer "temporarily rejected".
/// QGroundControl sends it at each connect, so the text is not a warning.
fn prearm_checks(_: &CommandMessage, caller: &mut Caller) -> Ruling {
    match caller.shared.not_ready() {
        None if !caller.shared.aircraft.is_armed() => {
            Ok(Decision::default().with_note("PreArm: ready".to_owned()))
        }
        None => {
            let text = "No check: the aircraft is armed";
            caller.shared.texts.inform(caller.now, text);
            Err(CommandError::without_text(MavResult::MAV_RESULT_TEMPORARILY_REJECTED))
        }
        Some(reason) => Ok(Decision::default().with_note(format!("PreArm: {reason}"))),
    }
}

/// PREFLIGHT_CALIBRATION: all zero stops a calibration, as QGroundControl does when its radio page opens. No
/// calibration ever runs, so stopping succeeds; starting one is refused, since nothing can be calibrated.
fn calibrate(command: &CommandMessage, _: &mut Caller) -> Ruling {
    if command.params.iter().all(|param| *param == 0.0) {
        return Ok(Decision::default());
    }
    Err(CommandError::unsupported("Calibration refused: the sensors need none"))
}

/// DO_FLIGHTTERMINATION: p1 above 0.5 terminates; the protocol requires FAILED for anything less.
fn terminate(command: &CommandMessage, _: &mut Caller) -> Ruling {
    let [terminate, ..] = command.params;
    if !terminate.is_finite() {
        return Err(CommandError::denied("Termination refused: p1 is not finite"));
    }
    if terminate > 0.5 {
        return Ok(Decision::pass_on(VehicleCommand::Terminate));
    }
    Err(CommandError::failed("Not terminated: p1 is not above 0.5"))
}

/// NAV_TAKEOFF: p7 altitude above the ellipsoid, m; NaN is that of MIS_TAKEOFF_ALT.
fn take_off(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    check_not_over(caller.shared)?;
    let aircraft = &caller.shared.aircraft;
    let reason = match caller.shared.not_ready() {
        None if aircraft.is_on_wheels() => {
            let altitude_m = convert::decimal(command.params[6]);
            let altitude_m = Some(altitude_m).filter(|altitude_m| !altitude_m.is_nan());
            return Ok(Decision::pass_on(VehicleCommand::TakeOff(altitude_m)));
        }
        None => "the aircraft is in the air already".to_owned(),
        Some(reason) => reason,
    };
    Err(CommandError::temporary(format!("Takeoff refused: {reason}")))
}

/// NAV_LAND, DO_LAND_START: the landing of the plan, wherever the aircraft is.
fn land(_: &CommandMessage, _: &mut Caller) -> Ruling {
    Ok(Decision::pass_on(VehicleCommand::Land))
}

/// DO_FENCE_ENABLE: p1 0 off, 1 on.
fn enable_fence(command: &CommandMessage, _: &mut Caller) -> Ruling {
    Ok(Decision::pass_on(VehicleCommand::EnableFence(flag("p1", command.params[0])?)))
}

/// DO_GO_AROUND: p1 altitude above home, 0 that of the landing item.
fn go_around(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let altitude_m = number("altitude p1", command.params[0])?.filter(|altitude| *altitude > 0.0);
    if let Some(altitude_m) = altitude_m {
        within(Reference::Altitude(altitude_m), caller.shared)?;
    }
    Ok(Decision::pass_on(VehicleCommand::GoAround(altitude_m)))
}

const CHANGE_MODE: u8 = 1;

/// DO_REPOSITION: p1 speed, p2 flags, p3 radius, p4 direction, p5 to p7 location. Parameters not given leave their value
/// unchanged; a command without any means "circle here".
fn reposition(command: &CommandMessage, caller: &mut Caller) -> Ruling {
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
fn orbit(command: &CommandMessage, caller: &mut Caller) -> Ruling {
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
fn loiter(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    circle(command, command.params[2], caller.shared)
}

/// NAV_LOITER_TO_ALT: p2 radius, positive clockwise, p5 to p7 centre, zeros for "here". The aircraft stays.
fn loiter_to_altitude(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    circle(command, command.params[1], caller.shared)
}

fn circle(command: &CommandMessage, radius: f32, shared: &Shared) -> Ruling {
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
fn pause_or_continue(command: &CommandMessage, _: &mut Caller) -> Ruling {
    let here = Reposition { change_mode: true, ..Reposition::default() };
    Ok(Decision::pass_on(match flag("p1", command.params[0])? {
        false => VehicleCommand::Reposition(here),
        true => VehicleCommand::Continue,
    }))
}

/// DO_SET_HOME: p1 1 for below the aircraft, 0 for p5 and p6. Home is on the ground, whatever the value of p7.
fn set_home(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [here, _, _, _, _, _, altitude] = command.params;
    if flag("p1", here)? {
        let Some(state) = caller.shared.aircraft.snapshot() else {
            return Err(CommandError::temporary("Home refused: no position yet"));
        };
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
fn start_mission(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [first, end, ..] = command.params;
    // There is at least one item, or `plan` refuses.
    let last = plan(caller.shared)?.0 - 1;
    let first = word("first item p1", first)?;
    let end = word("last item p2", end)?.filter(|end| *end != 0);
    if end.is_some_and(|end| end != last) {
        return Err(CommandError::denied("Mission refused: a plan is flown to its end (p2 = 0)"));
    }
    let mut decision = Decision::pass_on(VehicleCommand::Mode(Mode::Mission));
    if let Some(first) = first {
        if first > last {
            let text = format!("Mission refused: no item {first}, the plan has 0 to {last}");
            return Err(CommandError::denied(text));
        }
        // Before the mode, which begins with the current item.
        decision.intents.insert(0, VehicleCommand::PlanItem(first).into());
    }
    Ok(decision)
}

/// DO_SET_MISSION_CURRENT: p1 item, -1 for the current one, p2 1 to reset the counts of its jumps.
fn set_mission_item(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [item, reset, ..] = command.params;
    let resets = !reset.is_nan() && flag("p2", reset)?;
    if number("item p1", item)? == Some(CURRENT) && !resets {
        // By the definition the current item is published even if nothing changes.
        let state = caller.shared.aircraft.snapshot();
        return Ok(Decision::answer(state.map(telemetry::mission_current).into_iter().collect()));
    }
    // The protocol requires FAILED for an item that does not exist, and without a plan.
    let (items, present) = plan(caller.shared)
        .map_err(|refused| CommandError::failed(refused.reason.unwrap_or_default()))?;
    let item = match number("item p1", item)? {
        Some(CURRENT) => Some(present),
        _ => word("item p1", item)?,
    };
    match item {
        Some(item) if item < items => Ok(Decision::pass_on(VehicleCommand::PlanItem(item))),
        _ => Err(CommandError::failed(format!(
            "Mission refused: no such item, the plan has 0 to {}",
            items - 1
        ))),
    }
}

/// Number of items and present item of the plan, if there is one. The upload knows it before the next state shows it: by the
/// state alone the service would deny commands to a plan acknowledged a moment ago. The state counts only for a plan
/// that no ground station has uploaded.
fn plan(shared: &Shared) -> Result<(u16, u16), CommandError> {
    let shown = shared.aircraft.snapshot().map(|state| state.navigation);
    let (shown, item) = shown.map_or((0, 0), |shown| (shown.items, shown.item));
    match (shared.plan_items, shown) {
        (0, 0) => Err(CommandError::temporary("Mission refused: there is no plan")),
        (0, items) => Ok((items, item)),
        // An earlier state may show an item that the new plan does not have.
        (items, _) => Ok((items, item.min(items - 1))),
    }
}

const AIRSPEED: u8 = 0;
const GROUND_SPEED: u8 = 1;
const COURSE: u8 = 0;
const HEADING: u8 = 1;
const HEADING_DEFAULT: u8 = 2;
/// "No change" and "back to the default" in DO_CHANGE_SPEED.
const NO_CHANGE: f32 = -1.0;
const DEFAULT: f32 = -2.0;

/// DO_CHANGE_ALTITUDE: p1 altitude, p2 frame.
fn change_altitude(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [altitude, frame, ..] = command.params;
    refer_altitude(altitude, byte("frame p2", frame)?, caller.shared)
}

/// GUIDED_CHANGE_ALTITUDE: p3 rate, p7 altitude in the frame of the COMMAND_INT.
fn guided_altitude(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [_, _, rate, _, _, _, altitude] = command.params;
    let has_rate = unused_rate("the rate p3", rate)?;
    let decision = refer_altitude(altitude, command.frame.unwrap_or(0), caller.shared)?;
    let note = "The rate is not used: ALT_ERR_MAX sets the climb rate";
    Ok(decision.with_note(has_rate.then(|| note.to_owned())))
}

fn refer_altitude(altitude: f32, frame: u8, shared: &Shared) -> Ruling {
    // Altitude is the only content of this command, so it must be given.
    let altitude_m = above_ellipsoid(convert::decimal(altitude), frame, shared)?;
    Ok(Decision::pass_on(VehicleCommand::Refer(Reference::Altitude(altitude_m))))
}

/// DO_CHANGE_SPEED: p1 type, p2 speed, p3 throttle, p4 relative (once, now reserved).
fn change_speed(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [kind, speed, throttle, relative, ..] = command.params;
    let is_ground_speed = is_ground_speed(kind)?;
    // MAVProxy sends 0 for "no throttle given", QGroundControl -1, MAVSDK NaN.
    if throttle > 0.0 || throttle.is_infinite() {
        return Err(CommandError::denied("Speed refused: there is no throttle reference (p3)"));
    }
    if !relative.is_nan() && relative != 0.0 {
        return Err(CommandError::denied("Speed refused: only an absolute speed (p4 = 0)"));
    }
    if speed == DEFAULT {
        return Err(CommandError::denied("Speed refused: there is no default speed (p2 = -2)"));
    }
    if speed.is_nan() || speed == NO_CHANGE {
        return Ok(Decision::default());
    }
    refer_airspeed(speed, is_ground_speed, None, caller.shared)
}

/// GUIDED_CHANGE_SPEED: p1 type, p2 speed, p3 rate.
fn guided_speed(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [kind, speed, rate, ..] = command.params;
    let is_ground_speed = is_ground_speed(kind)?;
    let has_rate = unused_rate("the rate p3", rate)?;
    let note = "The rate is not used: the engine sets the acceleration";
    refer_airspeed(speed, is_ground_speed, has_rate.then_some(note), caller.shared)
}

fn is_ground_speed(kind: f32) -> Result<bool, CommandError> {
    match byte("type of speed p1", kind)? {
        AIRSPEED => Ok(false),
        GROUND_SPEED => Ok(true),
        other => Err(CommandError::denied(format!(
            "Speed refused: type p1 = {other} is not 0 airspeed or 1 ground speed"
        ))),
    }
}

fn refer_airspeed(speed: f32, is_ground: bool, note: Option<&str>, shared: &Shared) -> Ruling {
    let speed_m_s = convert::decimal(speed);
    let airspeed_m_s = if is_ground {
        ground_speed(speed_m_s, shared)?
    } else {
        // True airspeed of a calibrated one, at the altitude reference.
        let airspeed = Airspeed::Calibrated(speed_m_s);
        shared.parameters.limits.check_airspeed(airspeed).map_err(denied)?;
        airspeed.true_m_s(shared.aircraft.altitude_reference_m())
    };
    let ground_note = "A ground speed is flown as true airspeed: wind is not corrected";
    let reference = Reference::Airspeed(airspeed_m_s);
    Ok(refer(reference, is_ground.then_some(ground_note).into_iter().chain(note)))
}

fn refer<'a>(reference: Reference, notes: impl Iterator<Item = &'a str>) -> Decision {
    let notes: Vec<&str> = notes.collect();
    let note = (!notes.is_empty()).then(|| notes.join(". "));
    Decision::pass_on(VehicleCommand::Refer(reference)).with_note(note)
}

/// GUIDED_CHANGE_HEADING: p1 type, p2 heading, p3 rate.
fn guided_heading(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [kind, heading, rate, ..] = command.params;
    let mut notes = Vec::new();
    match byte("type of heading p1", kind)? {
        COURSE | HEADING_DEFAULT => {}
        HEADING => notes.push("A heading is flown as course over the ground"),
        other => {
            let text = format!(
                "Heading refused: type p1 = {other} is not 0 course, 1 heading or 2 default"
            );
            return Err(CommandError::denied(text));
        }
    }
    if unused_rate("the rate p3", rate)? {
        notes.push("The rate is not used: the bank angle has its own limit");
    }
    let Some(degrees) = number("heading p2", heading)? else {
        return Err(CommandError::denied("Heading refused: no heading (p2)"));
    };
    if !(0.0..=360.0).contains(&degrees) {
        return Err(CommandError::denied(format!(
            "Heading refused: {degrees} deg is outside 0 to 360 deg"
        )));
    }
    let course = Reference::Course(convert::radians(degrees % 360.0));
    within(course, caller.shared)?;
    Ok(refer(course, notes.into_iter()))
}

/// REQUEST_MESSAGE: p1 message, p2 as the message defines it.
fn request(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    show(caller, command.params[0], command.params[1])
}

/// REQUEST_AUTOPILOT_CAPABILITIES and REQUEST_PROTOCOL_VERSION: p1 must be 1.
fn show_if_1(command: &CommandMessage, caller: &Caller, id: f32) -> Ruling {
    if command.params[0] == 1.0 {
        return show(caller, id, 0.0);
    }
    Err(CommandError::denied("Refused: nothing was asked for (p1 must be 1)"))
}

fn show(caller: &Caller, id: f32, index: f32) -> Ruling {
    telemetry::request(caller.shared, caller.from.peer, caller.now, id, index).map(Decision::answer)
}

/// SET_MESSAGE_INTERVAL: p1 message, p2 interval in microseconds, -1 never, 0 as by default.
fn set_interval(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [id, interval_us, ..] = command.params;
    caller.shared.rates.set_interval(caller.from.peer, id, interval_us)?;
    Ok(Decision::default())
}

/// GET_MESSAGE_INTERVAL: p1 message.
fn interval(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let message = caller.shared.rates.interval(caller.from.peer, command.params[0])?;
    Ok(Decision::answer(vec![message]))
}

/// p1 of USER_2 for a step.
const STEP: u8 = 2;

/// INJECT_FAILURE and USER_1.
fn fault(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    if command.id == failure::USER_1 && command.frame.is_some() {
        // In a COMMAND_INT the values would be scaled integers.
        return Err(CommandError::without_text(MavResult::MAV_RESULT_COMMAND_LONG_ONLY));
    }
    let Shared { parameters, model, .. } = &*caller.shared;
    let fault = failure::parse(command, &model.effectors.list)?;
    let requests = failure::requests(&fault, parameters, model)?;
    let intents = requests.into_iter().map(|request| PlantAction::Fault(request).into()).collect();
    Ok(Decision { intents, ..Decision::default() })
}

/// PREFLIGHT_REBOOT_SHUTDOWN: p1 1 restarts the flight.
fn restart(command: &CommandMessage, _: &mut Caller) -> Ruling {
    match byte("p1", command.params[0])? {
        0 => Ok(Decision::default()),
        1 => Ok(Decision::pass_on(PlantAction::Restart)),
        _ => Err(CommandError::denied("Refused: only p1 = 1, start the flight anew")),
    }
}

/// MAV_CMD_USER_2.
const USER_2: u16 = 31_011;

/// A step with a number from its sender (p3), by which a repeated copy is recognized.
pub(super) fn is_numbered_step(command: &CommandMessage) -> bool {
    let [action, _, number, ..] = command.params;
    command.id == USER_2 && action == f32::from(STEP) && !number.is_nan() && number != 0.0
}

/// USER_2: p1 0 pause, 1 run, 2 step by p2 control periods (1 without p2), 3 p2 times as fast as wall
/// time, which does not end a pause. p3 may number a step: a step with the number of the one before it is not
/// executed again.
fn pace(command: &CommandMessage, _: &mut Caller) -> Ruling {
    let [action, value, ..] = command.params;
    let value = number("p2", value)?;
    let pace = match byte("p1", action)? {
        0 => Pace::Pause,
        1 => Pace::Run,
        STEP => Pace::Step(periods(value)?),
        3 => Pace::Speed(value.unwrap_or(0.0)),
        other => {
            return Err(CommandError::denied(format!(
                "Pace refused: p1 = {other} is not 0 pause, 1 run, 2 step or 3 speed"
            )));
        }
    };
    if !pace.is_valid() {
        let (slowest, fastest) = Pace::SPEED;
        return Err(CommandError::denied(format!(
            "Pace refused: p2 is outside {slowest} to {fastest} times wall time"
        )));
    }
    Ok(Decision::pass_on(PlantAction::Pace(pace)))
}

/// Number of whole periods; one if not given.
fn periods(value: Option<f64>) -> Result<u32, CommandError> {
    let (periods, most) = (value.filter(|periods| *periods != 0.0).unwrap_or(1.0), Pace::STEPS_MAX);
    convert::whole_number(periods).filter(|number| (1..=most).contains(number)).ok_or_else(|| {
        CommandError::denied(format!(
            "Pace refused: p2 = {periods} is no whole number of 1 to {most} periods"
        ))
    })
}

/// MAV_CMD_USER_3.
const USER_3: u16 = 31_012;

/// USER_3: p1 1 starts the script with the number p2 in the sorted list of files (0: the latest upload,
/// or the scenario's), p1 0 stops the running one.
fn script(command: &CommandMessage, caller: &mut Caller) -> Ruling {
    let [start, number, ..] = command.params;
    if !flag("p1", start)? {
        return Ok(Decision::pass_on(ScriptCommand::Stop));
    }
    let number = word("p2", number)?.unwrap_or(0);
    let script = caller.shared.scripts.start(number, &caller.shared.parameters)?;
    Ok(Decision::pass_on(ScriptCommand::Run(script)))
}

/// MAV_FRAME_GLOBAL, the frame of a COMMAND_LONG.
const FRAME_GLOBAL: u8 = 0;
/// "Not given" in x and y of a COMMAND_INT.
const NOT_GIVEN: i32 = i32::MAX;

/// A parameter that encodes a small whole number.
fn byte(what: &str, value: f32) -> Result<u8, CommandError> {
    convert::whole_number(value.into()).ok_or_else(|| {
        CommandError::denied(format!("Refused: {what} {value} is no whole number of 0 to 255"))
    })
}

/// A parameter that encodes a whole number of up to 16 bits; NaN is "not given".
fn word(what: &str, value: f32) -> Result<Option<u16>, CommandError> {
    if value.is_nan() {
        return Ok(None);
    }
    convert::whole_number(value.into()).map(Some).ok_or_else(|| {
        CommandError::denied(format!("Refused: {what} {value} is no whole number of 0 to 65535"))
    })
}

/// A parameter that is 0 or 1.
fn flag(what: &str, value: f32) -> Result<bool, CommandError> {
    match value {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(CommandError::denied(format!("Refused: {what} = {value} is not 0 or 1"))),
    }
}

/// A number, with NaN for "not given".
fn number(what: &str, value: f32) -> Result<Option<f64>, CommandError> {
    if value.is_infinite() {
        return Err(CommandError::denied(format!("Refused: {what} is not finite")));
    }
    Ok((!value.is_nan()).then(|| convert::decimal(value)))
}

/// A rate of change, which the aircraft does not follow: whether the command gives one.
fn unused_rate(what: &str, value: f32) -> Result<bool, CommandError> {
    if value.is_infinite() || value < 0.0 {
        return Err(CommandError::denied(format!("Refused: {what} {value} is no rate")));
    }
    Ok(value > 0.0)
}

/// Target point of a command; NaN, or the largest integer in a COMMAND_INT, leaves a value unchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Location {
    /// Both coordinates or neither.
    pub place: Option<Place>,
    /// Altitude above the ellipsoid, m, within the limits.
    pub altitude_m: Option<f64>,
}

/// The location in parameters 5 to 7.
fn location(command: &CommandMessage, shared: &Shared) -> Result<Location, CommandError> {
    let place = place(command)?;
    let frame = command.frame.unwrap_or(FRAME_GLOBAL);
    let altitude_m = number("altitude p7", command.params[6])?
        .map(|altitude| above_ellipsoid(altitude, frame, shared))
        .transpose()?;
    Ok(Location { place, altitude_m })
}

/// As [`location`], with latitude and longitude zero for "here"; an altitude of zero then stays as it is.
fn location_or_here(command: &CommandMessage, shared: &Shared) -> Result<Location, CommandError> {
    let [p1, p2, p3, p4, x, y, z] = command.params;
    if command.xy.map_or([x, y] != [0.0; 2], |xy| xy != [0; 2]) {
        return location(command, shared);
    }
    let z = if z == 0.0 { f32::NAN } else { z };
    let params = [p1, p2, p3, p4, f32::NAN, f32::NAN, z];
    let xy = command.xy.map(|_| [NOT_GIVEN; 2]);
    location(&CommandMessage { params, xy, ..*command }, shared)
}

/// The place in parameters 5 and 6.
fn place(command: &CommandMessage) -> Result<Option<Place>, CommandError> {
    check_frame(command.frame.unwrap_or(FRAME_GLOBAL))?;
    let (latitude, longitude) = match command.xy {
        Some(xy) => xy.map(|e7| (e7 != NOT_GIVEN).then(|| convert::degrees_of_e7(e7))).into(),
        None => {
            let [.., x, y, _] = command.params;
            (number("latitude p5", x)?, number("longitude p6", y)?)
        }
    };
    match (latitude, longitude) {
        (None, None) => Ok(None),
        (Some(latitude), Some(longitude)) => match convert::place(latitude, longitude) {
            Some(place) => Ok(Some(place)),
            None => Err(CommandError::denied(format!(
                "Refused: {latitude:.7} {longitude:.7} deg is no place on the Earth"
            ))),
        },
        _ => Err(CommandError::denied("Refused: latitude and longitude only together")),
    }
}

fn check_frame(frame: u8) -> Result<(), CommandError> {
    if convert::FRAMES_WITH_ALTITUDE.contains(&frame) {
        return Ok(());
    }
    Err(CommandError {
        result: MavResult::MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME,
        reason: Some(format!("Refused: frame {frame} is not 0, 3, 5 or 6")),
    })
}

/// An altitude of some frame as altitude above the ellipsoid, m, within the limits.
fn above_ellipsoid(altitude_m: f64, frame: u8, shared: &Shared) -> Result<f64, CommandError> {
    check_frame(frame)?;
    within(Reference::Altitude(altitude_m), shared).map(|()| altitude_m)
}

/// A speed over the ground, m/s, which is flown as true airspeed, within the limits.
fn ground_speed(speed_m_s: f64, shared: &Shared) -> Result<f64, CommandError> {
    within(Reference::Airspeed(speed_m_s), shared).map(|()| speed_m_s)
}

/// The vehicle checks again; a check here gives the text at once.
fn within(reference: Reference, shared: &Shared) -> Result<(), CommandError> {
    let altitude_m = shared.aircraft.altitude_reference_m();
    shared.parameters.limits.check(reference, altitude_m).map_err(denied)
}

fn denied(refusal: VehicleRefusal) -> CommandError {
    CommandError::denied(format!("Refused: {refusal}"))
}

/// Radius of a circle, m, and whether the direction is clockwise; 0 and NaN leave both unchanged.
fn signed_radius(what: &str, value: f32) -> Result<(Option<f64>, Option<bool>), CommandError> {
    let radius = number(what, value)?.filter(|radius| *radius != 0.0);
    Ok((radius.map(f64::abs), radius.map(|radius| radius > 0.0)))
}
