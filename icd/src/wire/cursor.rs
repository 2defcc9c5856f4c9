//! Little-endian fields in and out of a packet, and the trait of every part of a packet.

use super::{PacketBytes, WireError};
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
pub(super) use coded;

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
    #[inline]
    pub fn u8(&mut self, v: u8) {
        self.bytes(&[v]);
    }
    #[inline]
    pub fn u16(&mut self, v: u16) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn u32(&mut self, v: u32) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn u64(&mut self, v: u64) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn f64(&mut self, v: f64) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn time(&mut self, v: SimTime) {
        self.u64(v.as_micros());
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
    pub fn u8(&mut self) -> Result<u8, WireError> {
        self.take::<1>().map(|[b]| b)
    }
    #[inline]
    pub fn u16(&mut self) -> Result<u16, WireError> {
        self.take().map(u16::from_le_bytes)
    }
    #[inline]
    pub fn u32(&mut self) -> Result<u32, WireError> {
        self.take().map(u32::from_le_bytes)
    }
    #[inline]
    pub fn u64(&mut self) -> Result<u64, WireError> {
        self.take().map(u64::from_le_bytes)
    }
    #[inline]
    pub fn time(&mut self) -> Result<SimTime, WireError> {
        self.u64().map(SimTime::from_micros)
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
        WireError::Length { bytes: self.total }
    }
    /// A value that is not finite, or not valid.
    pub fn value(&self, field: &'static str, value: f64) -> WireError {
        WireError::Value { field, value, session: self.session, sequence: self.sequence }
    }
}
