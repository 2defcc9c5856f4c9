//! The things that move: by their place in the list of the aircraft ([`crate::EffectorList`]).

use core::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// An effector: its place in the aircraft's list, which is the order of packets, logs and MAVLink outputs.
///
/// What it is (name, kind, side) stands in the list. Signs are in the table at the top of this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Effector(u8);

/// A place beyond the room that every list has.
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

    /// The first of every list.
    pub const FIRST: Self = Self(0);

    /// The effector at this place, counted from 0; `None` from [`Effector::MAX`] on.
    #[must_use]
    pub const fn from_index(index: usize) -> Option<Self> {
        #[expect(clippy::cast_possible_truncation, reason = "below 16")]
        if index < Self::MAX { Some(Self(index as u8)) } else { None }
    }

    /// Place in the list, from 0.
    #[inline]
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// Place in the list, from 0, for packets and logs.
    #[must_use]
    pub const fn code(self) -> u8 {
        self.0
    }

    /// The first `count` places, at most [`Effector::MAX`].
    #[inline]
    pub fn first(
        count: usize,
    ) -> impl DoubleEndedIterator<Item = Self> + ExactSizeIterator + Clone {
        #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
        (0..count.min(Self::MAX) as u8).map(Self)
    }
}

/// One value for each effector, indexed by [`Effector`]. There is room for [`Effector::MAX`]; what is beyond the
/// effectors of the aircraft is zero, and is neither sent nor shown.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PerEffector<T>([T; Effector::MAX]);

impl<T> PerEffector<T> {
    /// From values in the order of the places.
    pub const fn new(values: [T; Effector::MAX]) -> Self {
        Self(values)
    }

    /// One value for each place.
    #[inline]
    pub fn from_fn(mut value: impl FnMut(Effector) -> T) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "below 16")]
        Self(core::array::from_fn(|index| value(Effector(index as u8))))
    }

    /// One value for each of the first `count` places or a few more, default for the rest: by eights, so that the compiler
    /// can compute them side by side.
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

    /// Each place with its value.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = (Effector, &T)> {
        Effector::first(Effector::MAX).zip(self.0.iter())
    }

    /// The values in the order of the places.
    #[inline]
    pub const fn as_array(&self) -> &[T; Effector::MAX] {
        &self.0
    }

    /// The values of the first `count` effectors, at most all.
    #[inline]
    #[must_use]
    pub fn first(&self, count: usize) -> &[T] {
        &self.0[..count.min(Effector::MAX)]
    }
}

impl<T: Copy + Default> PerEffector<T> {
    /// The first of these values in their order, as many as there is room for; default for the rest.
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
        // The mask changes nothing and saves the check of the bound.
        &self.0[effector.index() % Effector::MAX]
    }
}

impl<T> IndexMut<Effector> for PerEffector<T> {
    #[inline]
    fn index_mut(&mut self, effector: Effector) -> &mut T {
        &mut self.0[effector.index() % Effector::MAX]
    }
}
