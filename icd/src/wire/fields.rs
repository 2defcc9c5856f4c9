//! The parts of packets besides numbers: the aircraft, requests, reports and faults, each with both ways side by side.
//!
//! Absent times are written as the largest number, absent durations and repetitions as zero, which is never a valid one. A
//! target is one byte: the index of an effector, or from 128 on a sensor.

use super::cursor::{Field, Reader, Writer, coded};
use super::{Aircraft, WireError};
use crate::effector::{Effector, PerEffector};
use crate::effector_list::Name;
use crate::fault::{
    FaultEntry, FaultKind, FaultReply, FaultRequest, FaultState, Onset, PlantAction, PlantReport,
    PlantRequest, Quantity, Refusal, Repeat, Target, Timing,
};
use crate::pace::Pace;
use crate::time::SimTime;

const AT_ONCE: u64 = u64::MAX;

coded! { PlantAction, "request":
    0 => Restart;
    1 => Fault(request);
    2 => ListFaults;
    3 => Pace(pace);
}

coded! { FaultRequest, "fault request":
    1 => Clear { target };
    2 => Inject { target, kind, timing };
    3 => ClearAll;
}

coded! { PlantReport, "report":
    0 => GroundContact { at };
    1 => Fault(entry);
    2 => FaultReply { request, reply };
    3 => Paced { request: "pace request", pace, at };
    4 => Started { positions };
}

coded! { FaultReply, "fault reply":
    0 => Applied { at };
    1 => Unchanged { at };
    2 => Scheduled { at };
    3 => Cleared { at };
    4 => Refused(refusal);
}

coded! { Refusal, "refusal":
    1 => OutOfRange { what, value: "refused value", min: "smallest value", max: "largest value" };
    2 => NotForThisEffector;
    3 => OnsetInThePast { onset, now };
    4 => ScheduleFull { capacity };
    5 => FlightOver;
    6 => NoSuchEffector { count };
    7 => NoSuchSensor;
    8 => NoSuchPart;
}

/// Numbers of which every value is valid.
macro_rules! plain {
    ($($type:ty: $way:ident;)+) => {
        $(impl Field for $type {
            fn write(&self, w: &mut Writer<'_>) {
                w.$way(*self);
            }

            fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
                r.$way()
            }
        })+
    };
}

plain! { u8: u8; u32: u32; SimTime: time; }

/// A flag, and a number in any case.
impl Field for Option<u32> {
    fn write(&self, w: &mut Writer<'_>) {
        w.u8(self.is_some().into());
        w.u32(self.unwrap_or(0));
    }

    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError> {
        let is_given = r.flag(name)?;
        let number = r.u32()?;
        Ok(is_given.then_some(number))
    }
}

impl Field for f64 {
    fn write(&self, w: &mut Writer<'_>) {
        w.f64(*self);
    }

    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError> {
        r.f64s(|_| name).map(|[value]| value)
    }
}

impl Field for Aircraft {
    fn write(&self, w: &mut Writer<'_>) {
        #[expect(clippy::cast_possible_truncation, reason = "at most NAME_MAX")]
        w.u8(self.name.len() as u8);
        w.bytes(self.name.as_bytes());
        w.u8(self.effectors);
        w.u32(self.identity);
    }

    fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
        let length = r.u8()?;
        let wrong = WireError::Code { field: "length of the aircraft's name", value: length };
        let name = core::str::from_utf8(r.bytes(length.into())?).ok();
        let name = name.and_then(|name| Name::from(name).ok()).ok_or(wrong)?;
        let effectors = r.u8()?;
        if !(1..=Effector::MAX).contains(&usize::from(effectors)) {
            return Err(WireError::Code { field: "number of effectors", value: effectors });
        }
        Ok(Self { name, effectors, identity: r.u32()? })
    }
}

/// One value for each effector of the aircraft.
impl Field for PerEffector<f64> {
    fn write(&self, w: &mut Writer<'_>) {
        for v in self.first(w.effectors) {
            w.f64(*v);
        }
    }

    fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
        let (values, _) = r.bytes(8 * r.effectors)?.as_chunks::<8>();
        let values = Self::from_values(values.iter().map(|bytes| f64::from_le_bytes(*bytes)));
        r.all_finite(values.as_array(), |index| VALUES[index])?;
        Ok(values)
    }
}

/// The effectors' values in errors.
const VALUES: [&str; Effector::MAX] = [
    "value of effector 1",
    "value of effector 2",
    "value of effector 3",
    "value of effector 4",
    "value of effector 5",
    "value of effector 6",
    "value of effector 7",
    "value of effector 8",
    "value of effector 9",
    "value of effector 10",
    "value of effector 11",
    "value of effector 12",
    "value of effector 13",
    "value of effector 14",
    "value of effector 15",
    "value of effector 16",
];

/// A flag, and the request if there is one.
impl Field for Option<PlantRequest> {
    fn write(&self, w: &mut Writer<'_>) {
        w.u8(self.is_some().into());
        if let Some(PlantRequest { number, action }) = self {
            w.u32(*number);
            action.write(w);
        }
    }

    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError> {
        if !r.flag(name)? {
            return Ok(None);
        }
        Ok(Some(PlantRequest { number: r.u32()?, action: Field::read(r, name)? }))
    }
}

/// A valid pace: a fraction of a period, or a speed beyond the limits, is refused like NaN.
impl Field for Pace {
    fn write(&self, w: &mut Writer<'_>) {
        let (code, value) = match *self {
            Self::Pause => (0, 0.0),
            Self::Run => (1, 0.0),
            Self::Step(periods) => (2, f64::from(periods)),
            Self::Speed(speed) => (3, speed),
        };
        w.u8(code);
        w.f64(value);
    }

    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError> {
        let code = r.u8()?;
        let value = f64::from_bits(r.u64()?);
        let pace = match code {
            0 => Self::Pause,
            1 => Self::Run,
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "saturates, and what it changes is refused"
            )]
            2 if f64::from(value as u32) == value => Self::Step(value as u32),
            2 => return Err(r.value(name, value)),
            3 => Self::Speed(value),
            value => return Err(WireError::Code { field: name, value }),
        };
        if pace.is_valid() { Ok(pace) } else { Err(r.value(name, value)) }
    }
}

impl Field for FaultEntry {
    fn write(&self, w: &mut Writer<'_>) {
        w.u32(self.id);
        self.target.write(w);
        self.kind.write(w);
        self.timing.write(w);
        w.u8(self.state.code());
        w.time(self.state.time());
        w.time(match self.state {
            FaultState::Resting { next, .. } => next,
            _ => SimTime::ZERO,
        });
    }

    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError> {
        let id = r.u32()?;
        let target = Field::read(r, name)?;
        let kind = Field::read(r, name)?;
        let timing = Field::read(r, name)?;
        let code = r.u8()?;
        let at = r.time()?;
        let next = r.time()?;
        let state = FaultState::from_code(code, at, next)
            .ok_or(WireError::Code { field: "fault state", value: code })?;
        Ok(Self { id, target, kind, timing, state })
    }
}

impl Field for Quantity {
    fn write(&self, w: &mut Writer<'_>) {
        w.u8(*self as u8);
    }

    fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
        let value = r.u8()?;
        Self::from_code(value).ok_or(WireError::Code { field: "quantity", value })
    }
}

impl Field for FaultKind {
    fn write(&self, w: &mut Writer<'_>) {
        w.u8(self.code());
        for value in self.values() {
            w.f64(value);
        }
    }

    fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
        let value = r.u8()?;
        let values = r.f64s(|_| "fault value")?;
        Self::from_code(value, values).ok_or(WireError::Code { field: "fault kind", value })
    }
}

impl Field for Timing {
    fn write(&self, w: &mut Writer<'_>) {
        w.u64(match self.onset {
            Onset::AtOnce => AT_ONCE,
            Onset::At(at) => at.as_micros(),
        });
        w.f64(self.ramp_s);
        w.f64(self.duration_s.unwrap_or(0.0));
        w.f64(self.repeat.map_or(0.0, |repeat| repeat.every_s));
        w.u32(self.repeat.and_then(|repeat| repeat.times).unwrap_or(0));
    }

    fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
        let onset = match r.u64()? {
            AT_ONCE => Onset::AtOnce,
            micros => Onset::At(SimTime::from_micros(micros)),
        };
        let [ramp_s, duration_s, every_s] =
            r.f64s(|index| ["ramp", "duration", "repetition"][index])?;
        let times = r.u32()?;
        let given = |value: f64| Some(value).filter(|value| *value != 0.0);
        let repeat = |every_s| Repeat { every_s, times: Some(times).filter(|times| *times != 0) };
        let (duration_s, repeat) = (given(duration_s), given(every_s).map(repeat));
        Ok(Self { onset, ramp_s, duration_s, repeat })
    }
}

impl Field for Target {
    fn write(&self, w: &mut Writer<'_>) {
        w.u8((*self).into());
    }

    fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
        let value = r.u8()?;
        Self::try_from(value).map_err(|_| WireError::Code { field: "target", value })
    }
}
