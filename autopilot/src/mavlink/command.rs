//! COMMAND_LONG and COMMAND_INT: exactly one COMMAND_ACK for each copy received.
//!
//! A command is answered at once, or, where the aircraft has to say something, when it has.

use ::mavlink::dialects::common::{MavResult, MavSeverity};
use arrayvec::ArrayVec;
use icd::Effector;

use super::aircraft::Phase;
use super::codec::{Command, Encoded};
use super::context::{Context, From};
use super::convert;
use super::failure;
use super::modes;
use super::peers::Peers;
use super::pending::{Part, Pending};
use super::refused::Refused;
use super::telemetry;
use crate::clock::WallTime;
use crate::event::{Outcome, Wish};
use crate::vehicle::Reference;

const DO_SET_MODE: u16 = 176;
const DO_CHANGE_SPEED: u16 = 178;
const DO_CHANGE_ALTITUDE: u16 = 186;
const PREFLIGHT_REBOOT_SHUTDOWN: u16 = 246;
const COMPONENT_ARM_DISARM: u16 = 400;
const GET_HOME_POSITION: u16 = 410;
const REQUEST_MESSAGE: u16 = 512;
const GUIDED_CHANGE_ALTITUDE: u16 = 43_001;

/// MAV_FRAME of altitudes above mean sea level (the ellipsoid here).
const FRAMES_SEA_LEVEL: [u8; 2] = [0, 5];
/// MAV_FRAME of altitudes above home, which is at altitude zero.
const FRAMES_ABOVE_HOME: [u8; 2] = [3, 6];

/// What a command comes to.
enum Decision {
    /// Accepted, nothing more to do.
    Accept,
    /// Accepted, and this message is the answer.
    Show(Encoded),
    /// Up to the aircraft.
    Ask(Vec<Asked>),
}

struct Asked {
    wish: Wish,
    effector: Option<Effector>,
}

impl Decision {
    fn ask(wish: Wish) -> Self {
        Self::Ask(vec![Asked { wish, effector: None }])
    }
}

/// Answers commands.
#[derive(Debug, Default)]
pub struct CommandService {
    pending: Pending,
}

impl CommandService {
    /// Takes one copy of a command.
    pub fn handle(
        &mut self,
        from: From,
        command: &Command,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let result = match self.pending.join(from, command) {
            Some(joined) => joined.map(|()| None),
            None => decide(command, now, ctx)
                .and_then(|decision| self.begin(from, command, decision, now, ctx, out)),
        };
        let result = match result {
            Ok(None) => return,
            Ok(Some(result)) => result,
            Err(Refused { result, reason }) => {
                if let Some(reason) = reason {
                    ctx.texts.refuse(now, reason);
                }
                result
            }
        };
        out.answer(from.peer, Encoded::command_ack(command.id, result, from.sender));
    }

    /// `None`: the acknowledgement comes later.
    fn begin(
        &mut self,
        from: From,
        command: &Command,
        decision: Decision,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) -> Result<Option<MavResult>, Refused> {
        let asked = match decision {
            Decision::Accept => return Ok(Some(MavResult::MAV_RESULT_ACCEPTED)),
            Decision::Show(message) => {
                out.answer(from.peer, message);
                return Ok(Some(MavResult::MAV_RESULT_ACCEPTED));
            }
            Decision::Ask(asked) => asked,
        };
        if !self.pending.has_room() || ctx.intents.room() < asked.len() {
            return Err(Refused::for_now("Too many commands are waiting"));
        }
        let mut parts = ArrayVec::new();
        for Asked { wish, effector } in asked {
            if let Some(number) = ctx.intents.push(wish) {
                parts.push(Part { number, effector });
            }
        }
        self.pending.open(from, command, parts, now);
        Ok(None)
    }

    /// Takes the outcome of an intent.
    pub fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        self.pending.resolve(number, outcome, now, ctx, out);
    }

    /// Answers what nobody else did.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        self.pending.poll(now, ctx.texts, out);
    }

    /// When the next answer is overdue.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.pending.next_deadline()
    }
}

fn decide(command: &Command, now: WallTime, ctx: &mut Context) -> Result<Decision, Refused> {
    match command.id {
        failure::USER_1 if command.frame.is_some() => {
            // Its values would be scaled integers in a COMMAND_INT.
            Err(Refused::silent(MavResult::MAV_RESULT_COMMAND_LONG_ONLY))
        }
        failure::INJECT_FAILURE | failure::USER_1 => {
            let requests = failure::requests(command, ctx.parameters, ctx.belief)?;
            let asked = requests.into_iter().map(|request| {
                let effector = Some(request.effector());
                Asked { wish: Wish::Fault(request), effector }
            });
            Ok(Decision::Ask(asked.collect()))
        }
        DO_SET_MODE => set_mode(command, ctx),
        DO_CHANGE_SPEED => change_speed(command, ctx),
        DO_CHANGE_ALTITUDE => {
            let [altitude, frame, ..] = command.params;
            change_altitude(altitude, byte("frame", frame)?, ctx)
        }
        GUIDED_CHANGE_ALTITUDE => {
            let [_, _, rate, _, _, _, altitude] = command.params;
            if rate.is_infinite() || rate < 0.0 {
                return Err(Refused::denied("Altitude refused: the rate p3 is no rate"));
            }
            let decision = change_altitude(altitude, command.frame.unwrap_or(0), ctx)?;
            if rate > 0.0 {
                let text = "The rate is not used: ALT_ERR_MAX sets the climb rate";
                ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
            }
            Ok(decision)
        }
        PREFLIGHT_REBOOT_SHUTDOWN => match byte("p1", command.params[0])? {
            0 => Ok(Decision::Accept),
            1 => Ok(Decision::ask(Wish::Restart)),
            _ => Err(Refused::denied("Refused: only p1 = 1, start the flight anew")),
        },
        COMPONENT_ARM_DISARM => arm_disarm(command, ctx),
        GET_HOME_POSITION => show(telemetry::home_position(ctx.aircraft)),
        REQUEST_MESSAGE => request_message(command.params[0], ctx),
        _ => Err(Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED)),
    }
}

/// A parameter that stands for a small whole number.
fn byte(what: &str, value: f32) -> Result<u8, Refused> {
    if value.fract() == 0.0 && (0.0..=255.0).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(value as u8);
    }
    Err(Refused::denied(format!("Refused: {what} {value} is no whole number of 0 to 255")))
}

fn set_mode(command: &Command, ctx: &Context) -> Result<Decision, Refused> {
    let [base, main, sub, ..] = command.params;
    let has_custom_flag = byte("base mode", base)? & 1 != 0;
    let (main, sub) = (byte("main mode", main)?, byte("sub mode", sub)?);
    let mode = modes::requested(has_custom_flag, main, sub, ctx.setpoint_is_fresh)?;
    Ok(Decision::ask(Wish::Mode(mode)))
}

fn change_speed(command: &Command, ctx: &Context) -> Result<Decision, Refused> {
    let [kind, speed, throttle, relative, ..] = command.params;
    if byte("type of speed", kind)? != 0 {
        return Err(Refused::denied("Speed refused: only airspeed (p1 = 0)"));
    }
    // MAVProxy sends 0 for "no throttle given", QGroundControl -1, MAVSDK NaN.
    if throttle > 0.0 || throttle.is_infinite() {
        return Err(Refused::denied("Speed refused: there is no throttle reference (p3)"));
    }
    if !relative.is_nan() && relative != 0.0 {
        return Err(Refused::denied("Speed refused: only an absolute speed (p4 = 0)"));
    }
    if speed.is_nan() || speed == -1.0 {
        return Ok(Decision::Accept);
    }
    refer(Reference::Airspeed(convert::decimal(speed)), ctx)
}

fn change_altitude(altitude: f32, frame: u8, ctx: &Context) -> Result<Decision, Refused> {
    if !FRAMES_SEA_LEVEL.contains(&frame) && !FRAMES_ABOVE_HOME.contains(&frame) {
        return Err(Refused::denied(format!(
            "Altitude refused: frame {frame} is not 0, 3, 5 or 6"
        )));
    }
    refer(Reference::Altitude(convert::decimal(altitude)), ctx)
}

/// A reference within the limits. The vehicle checks again; here the text comes at once.
fn refer(reference: Reference, ctx: &Context) -> Result<Decision, Refused> {
    let checked = ctx.parameters.limits.check(reference);
    checked.map_err(|refusal| Refused::denied(format!("Refused: {refusal}")))?;
    Ok(Decision::ask(Wish::Refer(reference)))
}

fn arm_disarm(command: &Command, ctx: &Context) -> Result<Decision, Refused> {
    let arm = match byte("p1", command.params[0])? {
        0 => false,
        1 => true,
        other => return Err(Refused::denied(format!("Refused: p1 = {other} is not 0 or 1"))),
    };
    match (arm, ctx.aircraft.phase()) {
        (true, Phase::Flying) | (false, Phase::OnGround | Phase::NoFlight) => Ok(Decision::Accept),
        (true, Phase::OnGround) => {
            Err(Refused::for_now("PreArm: the flight is over, restart it (command 246, p1 = 1)"))
        }
        (true, Phase::NoFlight | Phase::Lost) => {
            Err(Refused::for_now("PreArm: no aircraft is connected"))
        }
        (false, Phase::Flying | Phase::Lost) => {
            Err(Refused::for_now("Disarming refused: the aircraft is in the air"))
        }
    }
}

fn request_message(id: f32, ctx: &Context) -> Result<Decision, Refused> {
    if !id.is_finite() || id.fract() != 0.0 {
        return Err(Refused::denied(format!("Refused: message {id} is no whole number")));
    }
    if id == telemetry::AUTOPILOT_VERSION_ID {
        Ok(Decision::Show(telemetry::autopilot_version()))
    } else if id == telemetry::HOME_POSITION_ID {
        show(telemetry::home_position(ctx.aircraft))
    } else {
        Err(Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED))
    }
}

fn show(message: Option<Encoded>) -> Result<Decision, Refused> {
    message.map(Decision::Show).ok_or(Refused::silent(MavResult::MAV_RESULT_TEMPORARILY_REJECTED))
}
