//! The fields of packets, little-endian: the aircraft, requests, reports and faults, each with both ways side by side.
//!
//! Absent times are written as the largest number, absent durations and repetitions as zero, which is never a valid one. A
//! target is one byte: the index of an effector, or from 128 on a sensor.

use super::{Aircraft, PacketBytes, WireError};
use crate::effector_list::{Effector, Name, PerEffector};
use crate::fault::{
    FaultEntry, FaultKind, FaultReply, FaultRequest, FaultState, Onset, PlantAction, PlantReport,
    PlantRequest, Quantity, Refusal, Repeat, Target, Timing,
};
use crate::pace::Pace;
use crate::time::SimTime;

/// A part of a packet: the same bytes both ways.
pub(super) trait Field: Sized {
    fn write(&self, w: &mut Writer<'_>);
    /// `name` is for the error about a value that is not finite.
    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError>;
}

/// Enums with a code byte followed by the fields of the variant: one table for both ways.
macro_rules! coded {
    (@name $part:ident) => { stringify!($part) };
    (@name $part:ident $name:literal) => { $name };
    ($type:ident, $field:literal: $(
        $code:literal => $variant:ident $(($inner:ident))? $({ $($part:ident $(: $name:literal)?),+ })?;
    )+) => {
        impl Field for $type {
            fn write(&self, w: &mut Writer<'_>) {
                match self {
                    $(Self::$variant $(($inner))? $({ $($part),+ })? => {
                        w.u8($code);
                        $($inner.write(w);)?
                        $($($part.write(w);)+)?
                    })+
                }
            }

            fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
                match r.u8()? {
                    $($code => {
                        $(let $inner = Field::read(r, stringify!($inner))?;)?
                        $($(let $part = Field::read(r, coded!(@name $part $($name)?))?;)+)?
                        Ok(Self::$variant $(($inner))? $({ $($part),+ })?)
                    })+
                    value => Err(WireError::Code { field: $field, value }),
                }
            }
        }
    };
}
/// Appends fields to a packet; the packet types are smaller than the buffer, which a test checks.
pub(super) struct Writer<'a> {
    pub out: &'a mut PacketBytes,
    /// Number of effectors of the aircraft.
    pub effectors: usize,
}

impl Writer<'_> {
    #[inline]
    pub fn bytes(&mut self, bytes: &[u8]) {
        // Cannot fail: the largest packet fits, see `the_largest_packets_fit`.
        let _fits = self.out.try_extend_from_slice(bytes);
        debug_assert!(_fits.is_ok());
    }
    /// Ends the packet with its checksum.
    #[inline]
    pub fn finish(self) {
        let crc = crc32fast::hash(self.out);
        let _fits = self.out.try_extend_from_slice(&crc.to_le_bytes());
    }
}

/// Takes fields from the front of a slice.
pub(super) struct Reader<'a> {
    pub left: &'a [u8],
    pub total: usize,
    /// Flight and number of the packet, for errors.
    pub session: u64,
    pub sequence: u64,
    /// Number of effectors of the aircraft.
    pub effectors: usize,
}

impl Reader<'_> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let (head, tail) = self.left.split_first_chunk::<N>().ok_or(self.length())?;
        self.left = tail;
        Ok(*head)
    }
    #[inline]
    pub fn flag(&mut self, field: &'static str) -> Result<bool, WireError> {
        match self.u8()? {
            0 => Ok(false),
            1 => Ok(true),
            value => Err(WireError::Code { field, value }),
        }
    }
    /// The next bytes.
    #[inline]
    pub fn bytes(&mut self, count: usize) -> Result<&[u8], WireError> {
        let (head, tail) = self.left.split_at_checked(count).ok_or(self.length())?;
        self.left = tail;
        Ok(head)
    }
    /// Several finite values; `name` is for the error about the first that is not finite.
    #[inline]
    pub fn f64s<const N: usize>(
        &mut self,
        name: impl Fn(usize) -> &'static str,
    ) -> Result<[f64; N], WireError> {
        let mut values = [0.0; N];
        self.finite_f64s(&mut values, name)?;
        Ok(values)
    }
    /// As [`Reader::f64s`], into a slice, with one check of the length.
    #[inline]
    pub fn finite_f64s(
        &mut self,
        values: &mut [f64],
        name: impl Fn(usize) -> &'static str,
    ) -> Result<(), WireError> {
        let (chunks, _) = self.bytes(8 * values.len())?.as_chunks::<8>();
        for (value, chunk) in values.iter_mut().zip(chunks) {
            *value = f64::from_le_bytes(*chunk);
        }
        self.all_finite(values, name)
    }
    /// The first value that is not finite is an error, with its name.
    #[inline]
    pub fn all_finite(
        &self,
        values: &[f64],
        name: impl Fn(usize) -> &'static str,
    ) -> Result<(), WireError> {
        // `&` and not `&&`: one branch for all of them.
        if values.iter().fold(true, |finite, value| finite & value.is_finite()) {
            return Ok(());
        }
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(self.value(name(index), values[index])),
            None => Ok(()),
        }
    }
    /// Longer than any packet.
    pub fn length(&self) -> WireError {
        WireError::Length(self.total)
    }
    /// A value that is not finite, or not valid.
    pub fn value(&self, field: &'static str, value: f64) -> WireError {
        WireError::Value { field, value, session: self.session, sequence: self.sequence }
    }
}

/// Numbers of which every value is valid.
macro_rules! numbers {
    ($($type:ident)+) => {
        impl Writer<'_> {
            $(#[inline]
            pub fn $type(&mut self, v: $type) {
                self.bytes(&v.to_le_bytes());
            })+
        }

        impl Reader<'_> {
            $(#[inline]
            pub fn $type(&mut self) -> Result<$type, WireError> {
                self.take().map($type::from_le_bytes)
            })+
        }
    };
}

numbers! { u8 u16 u32 u64 f64 }

/// Fields that are such a number, by the functions that make one of the other.
macro_rules! plain {
    ($($type:ident: $number:ident, $to:expr, $from:expr;)+) => {
        $(impl Field for $type {
            fn write(&self, w: &mut Writer<'_>) {
                w.$number($to(*self));
            }

            fn read(r: &mut Reader<'_>, _: &'static str) -> Result<Self, WireError> {
                r.$number().map($from)
            }
        })+
    };
}

plain! {
    u8: u8, Self::from, Self::from;
    u32: u32, Self::from, Self::from;
    SimTime: u64, Self::as_micros, Self::from_micros;
}

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

/// A flag, and a number in any case.
impl Field for Option<u32> {
    fn write(&self, w: &mut Writer<'_>) {
        w.u8(self.is_some().into());
        // Zero where none is given, so that the fields behind it keep their places.
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

/// It also gives the number of effectors of what follows.
impl Field for Aircraft {
    fn write(&self, w: &mut Writer<'_>) {
        // At most NAME_MAX.
        w.u8(self.name.len() as u8);
        w.bytes(self.name.as_bytes());
        w.u8(self.effectors);
        w.u32(self.identity);
        w.effectors = self.effectors.into();
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
        r.effectors = effectors.into();
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
const VALUES: [&str; Effector::MAX] = {
    macro_rules! values {
        ($($number:literal)+) => { [$(concat!("value of effector ", $number)),+] };
    }
    values!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
};

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
        let value = r.f64()?;
        let pace = match code {
            0 => Self::Pause,
            1 => Self::Run,
            // Saturates, and what it changes is refused.
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
        self.state.time().write(w);
        let next = match self.state {
            FaultState::Resting { next, .. } => next,
            _ => SimTime::ZERO,
        };
        next.write(w);
    }

    fn read(r: &mut Reader<'_>, name: &'static str) -> Result<Self, WireError> {
        let id = r.u32()?;
        let target = Field::read(r, name)?;
        let kind = Field::read(r, name)?;
        let timing = Field::read(r, name)?;
        let code = r.u8()?;
        let (at, next) = (Field::read(r, name)?, Field::read(r, name)?);
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
