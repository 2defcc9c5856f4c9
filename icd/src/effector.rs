//! Effectors by their place, values for each of them, their kinds, and the commands to them.

use core::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

use crate::named;

/// An effector: its index in the aircraft's list, which is the order of packets, logs and MAVLink outputs.
///
/// The list has its name, kind and side. The table at the top of this crate has the signs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Effector(u8);

/// An index beyond the capacity of every list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoSuchEffector(u8);

impl core::fmt::Display for NoSuchEffector {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "effector {} is outside 0 to {}", self.0, Effector::MAX - 1)
    }
}

impl core::error::Error for NoSuchEffector {}

impl TryFrom<u8> for Effector {
    type Error = NoSuchEffector;

    fn try_from(place: u8) -> Result<Self, NoSuchEffector> {
        Self::from_index(place.into()).ok_or(NoSuchEffector(place))
    }
}

impl From<Effector> for u8 {
    fn from(effector: Effector) -> Self {
        effector.0
    }
}

impl Effector {
    /// Most effectors that an aircraft can have.
    pub const MAX: usize = 16;

    /// The first effector of every list.
    pub const FIRST: Self = Self(0);

    /// The effector with this index, from 0; `None` from [`Effector::MAX`] on.
    pub const fn from_index(index: usize) -> Option<Self> {
        #[expect(clippy::cast_possible_truncation, reason = "below 16")]
        if index < Self::MAX { Some(Self(index as u8)) } else { None }
    }

    /// Index in the list, from 0.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// Index in the list, from 0, for packets and logs.
    pub const fn code(self) -> u8 {
        self.0
    }

    /// The first `count` effectors, at most [`Effector::MAX`].
    #[inline]
    pub fn first(
        count: usize,
    ) -> impl DoubleEndedIterator<Item = Self> + ExactSizeIterator + Clone {
        #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
        (0..count.min(Self::MAX) as u8).map(Self)
    }
}

/// One value for each effector, indexed by [`Effector`]. It has a fixed capacity of [`Effector::MAX`]; values beyond
/// the aircraft's effectors are zero, and nothing sends or displays them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PerEffector<T>([T; Effector::MAX]);

impl<T> PerEffector<T> {
    /// From values in the order of the list.
    pub const fn new(values: [T; Effector::MAX]) -> Self {
        Self(values)
    }

    /// Computes one value for each effector.
    #[inline]
    pub fn from_fn(mut value: impl FnMut(Effector) -> T) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "below 16")]
        Self(core::array::from_fn(|index| value(Effector(index as u8))))
    }

    /// Computes one value for each of the first `count` effectors, rounded up to a multiple of eight so that the compiler can
    /// vectorise; the rest are default.
    #[inline]
    pub fn first_from_fn(count: usize, mut value: impl FnMut(Effector) -> T) -> Self
    where
        T: Copy + Default,
    {
        let mut all = Self::default();
        for (block, values) in all.0.as_chunks_mut::<8>().0.iter_mut().enumerate() {
            if 8 * block < count {
                #[expect(clippy::cast_possible_truncation, reason = "below 16")]
                let place = |index| Effector((8 * block + index) as u8);
                *values = core::array::from_fn(|index| value(place(index)));
            }
        }
        all
    }

    /// Each effector with its value.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = (Effector, &T)> {
        Effector::first(Effector::MAX).zip(self.0.iter())
    }

    /// The same, to change the values.
    #[inline]
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Effector, &mut T)> {
        Effector::first(Effector::MAX).zip(self.0.iter_mut())
    }

    /// The values in the order of the list.
    #[inline]
    pub const fn as_array(&self) -> &[T; Effector::MAX] {
        &self.0
    }

    /// The values of the first `count` effectors, at most all.
    #[inline]
    pub fn first(&self, count: usize) -> &[T] {
        &self.0[..count.min(Effector::MAX)]
    }
}

impl<T: Copy + Default> PerEffector<T> {
    /// From these values in the order of the list; surplus values are ignored, missing ones are default.
    pub fn from_values(values: impl IntoIterator<Item = T>) -> Self {
        let mut all = Self::default();
        for (place, value) in all.0.iter_mut().zip(values) {
            *place = value;
        }
        all
    }
}

impl<T> Index<Effector> for PerEffector<T> {
    type Output = T;
    #[inline]
    fn index(&self, effector: Effector) -> &T {
        // The mask does not change the index; it removes the bounds check.
        &self.0[effector.index() % Effector::MAX]
    }
}

impl<T> IndexMut<Effector> for PerEffector<T> {
    #[inline]
    fn index_mut(&mut self, effector: Effector) -> &mut T {
        &mut self.0[effector.index() % Effector::MAX]
    }
}

named! {
    /// Kind of an effector. A law finds the effector of a role by kind and side.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
    EffectorKind {
        /// Surface at the wing's trailing edge, for roll.
        Aileron = "aileron",
        /// Surface at the tail, for pitch; left and right ones can also roll.
        Elevator = "elevator",
        /// Surface of the fin.
        Rudder = "rudder",
        /// High-lift surface at the wing's edge.
        Flap = "flap",
        /// Surface on the wing that reduces lift.
        Spoiler = "spoiler",
        /// Surface ahead of the wing, for pitch.
        Canard = "canard",
        /// Angle of the jet in pitch.
        NozzlePitch = "nozzle_pitch",
        /// Angle of the jet in yaw.
        NozzleYaw = "nozzle_yaw",
        /// Thrust, newton.
        Engine = "engine",
    }
}

impl EffectorKind {
    /// Whether the value is an angle, rad; the engine's is a thrust, N.
    pub const fn is_angle(self) -> bool {
        !matches!(self, Self::Engine)
    }

    /// Whether it is a nozzle angle.
    pub const fn is_nozzle(self) -> bool {
        matches!(self, Self::NozzlePitch | Self::NozzleYaw)
    }

    /// Whether it is an aerodynamic surface.
    pub const fn is_surface(self) -> bool {
        self.is_angle() && !self.is_nozzle()
    }
}

/// One command for each effector: rad, and newton for the engine.
///
/// The plant holds the commands for the whole control period.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Actuators {
    /// Commanded deflection, rad; commanded thrust, N.
    pub commands: PerEffector<f64>,
}
