//! Faults as bytes, both ways side by side.
//!
//! Absent times are written as the largest number, absent durations and repetitions as zero, which no real
//! one can be. A target is one byte: the place of an effector, or from 128 on a sensor.

use super::cursor::{Reader, Writer};
use super::decode::Context;
use super::{SimTime, WireError};
use crate::fault::{
    FaultEntry, FaultKind, FaultReply, FaultRequest, FaultState, Onset, Quantity, Refusal, Repeat,
    Target, Timing,
};

const AT_ONCE: u64 = u64::MAX;

pub(super) fn write_request(w: &mut Writer<'_>, request: &FaultRequest) {
    match request {
        FaultRequest::Clear { target } => {
            w.u8(1);
            w.u8((*target).into());
        }
        FaultRequest::Inject { target, kind, timing } => {
            w.u8(2);
            w.u8((*target).into());
            write_kind(w, kind);
            write_timing(w, timing);
        }
        FaultRequest::ClearAll => w.u8(3),
    }
}

pub(super) fn read_request(
    r: &mut Reader<'_>,
    context: Context,
) -> Result<FaultRequest, WireError> {
    match r.u8()? {
        1 => Ok(FaultRequest::Clear { target: read_target(r)? }),
        2 => Ok(FaultRequest::Inject {
            target: read_target(r)?,
            kind: read_kind(r, context)?,
            timing: read_timing(r, context)?,
        }),
        3 => Ok(FaultRequest::ClearAll),
        value => Err(WireError::Code { field: "fault request", value }),
    }
}

pub(super) fn write_entry(w: &mut Writer<'_>, entry: &FaultEntry) {
    w.u32(entry.id);
    w.u8(entry.target.into());
    write_kind(w, &entry.kind);
    write_timing(w, &entry.timing);
    let (code, at, next) = match entry.state {
        FaultState::Scheduled { at } => (1, at, SimTime::ZERO),
        FaultState::Active { since } => (2, since, SimTime::ZERO),
        FaultState::Resting { since, next } => (3, since, next),
        FaultState::Ended { at } => (4, at, SimTime::ZERO),
        FaultState::Cancelled { at } => (5, at, SimTime::ZERO),
    };
    w.u8(code);
    w.u64(at.as_micros());
    w.u64(next.as_micros());
}

pub(super) fn read_entry(r: &mut Reader<'_>, context: Context) -> Result<FaultEntry, WireError> {
    let id = r.u32()?;
    let target = read_target(r)?;
    let kind = read_kind(r, context)?;
    let timing = read_timing(r, context)?;
    let code = r.u8()?;
    let at = SimTime::from_micros(r.u64()?);
    let next = SimTime::from_micros(r.u64()?);
    let state = match code {
        1 => FaultState::Scheduled { at },
        2 => FaultState::Active { since: at },
        3 => FaultState::Resting { since: at, next },
        4 => FaultState::Ended { at },
        5 => FaultState::Cancelled { at },
        value => return Err(WireError::Code { field: "fault state", value }),
    };
    Ok(FaultEntry { id, target, kind, timing, state })
}

pub(super) fn write_reply(w: &mut Writer<'_>, reply: &FaultReply) {
    let (code, at) = match reply {
        FaultReply::Applied { at } => (0, at),
        FaultReply::Unchanged { at } => (1, at),
        FaultReply::Scheduled { at } => (2, at),
        FaultReply::Cleared { at } => (3, at),
        FaultReply::Refused(refusal) => {
            w.u8(4);
            return write_refusal(w, refusal);
        }
    };
    w.u8(code);
    w.u64(at.as_micros());
}

pub(super) fn read_reply(r: &mut Reader<'_>, context: Context) -> Result<FaultReply, WireError> {
    let code = r.u8()?;
    if code == 4 {
        return Ok(FaultReply::Refused(read_refusal(r, context)?));
    }
    let at = SimTime::from_micros(r.u64()?);
    match code {
        0 => Ok(FaultReply::Applied { at }),
        1 => Ok(FaultReply::Unchanged { at }),
        2 => Ok(FaultReply::Scheduled { at }),
        3 => Ok(FaultReply::Cleared { at }),
        value => Err(WireError::Code { field: "fault reply", value }),
    }
}

fn write_refusal(w: &mut Writer<'_>, refusal: &Refusal) {
    match *refusal {
        Refusal::OutOfRange { what, value, min, max } => {
            w.u8(1);
            w.u8(what as u8);
            w.f64(value);
            w.f64(min);
            w.f64(max);
        }
        Refusal::NotForThisEffector => w.u8(2),
        Refusal::OnsetInThePast { onset, now } => {
            w.u8(3);
            w.u64(onset.as_micros());
            w.u64(now.as_micros());
        }
        Refusal::ScheduleFull { capacity } => {
            w.u8(4);
            w.u32(capacity);
        }
        Refusal::FlightOver => w.u8(5),
        Refusal::NoSuchEffector { count } => {
            w.u8(6);
            w.u8(count);
        }
        Refusal::NoSensorFaults => w.u8(7),
    }
}

fn read_refusal(r: &mut Reader<'_>, context: Context) -> Result<Refusal, WireError> {
    match r.u8()? {
        1 => {
            let code = r.u8()?;
            let what = Quantity::from_code(code)
                .ok_or(WireError::Code { field: "quantity", value: code })?;
            Ok(Refusal::OutOfRange {
                what,
                value: context.finite("refused value", r.f64()?)?,
                min: context.finite("smallest value", r.f64()?)?,
                max: context.finite("largest value", r.f64()?)?,
            })
        }
        2 => Ok(Refusal::NotForThisEffector),
        3 => Ok(Refusal::OnsetInThePast {
            onset: SimTime::from_micros(r.u64()?),
            now: SimTime::from_micros(r.u64()?),
        }),
        4 => Ok(Refusal::ScheduleFull { capacity: r.u32()? }),
        5 => Ok(Refusal::FlightOver),
        6 => Ok(Refusal::NoSuchEffector { count: r.u8()? }),
        7 => Ok(Refusal::NoSensorFaults),
        value => Err(WireError::Code { field: "refusal", value }),
    }
}

fn write_kind(w: &mut Writer<'_>, kind: &FaultKind) {
    w.u8(kind.code());
    for value in kind.values() {
        w.f64(value);
    }
}

fn read_kind(r: &mut Reader<'_>, context: Context) -> Result<FaultKind, WireError> {
    let code = r.u8()?;
    let values = context.all_finite(r.f64s::<2>()?, |_| "fault value")?;
    FaultKind::from_code(code, values).ok_or(WireError::Code { field: "fault kind", value: code })
}

fn write_timing(w: &mut Writer<'_>, timing: &Timing) {
    w.u64(match timing.onset {
        Onset::AtOnce => AT_ONCE,
        Onset::At(at) => at.as_micros(),
    });
    w.f64(timing.ramp_s);
    w.f64(timing.duration_s.unwrap_or(0.0));
    w.f64(timing.repeat.map_or(0.0, |repeat| repeat.every_s));
    w.u32(timing.repeat.and_then(|repeat| repeat.times).unwrap_or(0));
}

fn read_timing(r: &mut Reader<'_>, context: Context) -> Result<Timing, WireError> {
    let onset = match r.u64()? {
        AT_ONCE => Onset::AtOnce,
        micros => Onset::At(SimTime::from_micros(micros)),
    };
    let [ramp_s, duration_s, every_s] =
        context.all_finite(r.f64s::<3>()?, |index| ["ramp", "duration", "repetition"][index])?;
    let times = r.u32()?;
    let given = |value: f64| Some(value).filter(|value| *value != 0.0);
    let repeat = |every_s| Repeat { every_s, times: Some(times).filter(|times| *times != 0) };
    Ok(Timing { onset, ramp_s, duration_s: given(duration_s), repeat: given(every_s).map(repeat) })
}

fn read_target(r: &mut Reader<'_>) -> Result<Target, WireError> {
    let value = r.u8()?;
    Target::try_from(value).map_err(|_| WireError::Code { field: "target", value })
}
