//! The eight things that move: seven deflections and the engine.

use core::fmt;
use core::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// An effector, in the order of the packets, logs and MAVLink instances.
///
/// Signs are in the table at the top of this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Effector {
    /// Left aileron, trailing edge down positive.
    LeftAileron,
    /// Right aileron, trailing edge down positive.
    RightAileron,
    /// Left elevator, trailing edge down positive.
    LeftElevator,
    /// Right elevator, trailing edge down positive.
    RightElevator,
    /// Rudder, trailing edge left positive.
    Rudder,
    /// Nozzle pitch angle δz, positive pitches the nose up.
    NozzlePitch,
    /// Nozzle yaw angle δy, positive yaws the nose right.
    NozzleYaw,
    /// Engine, thrust in newton.
    Engine,
}

impl Effector {
    /// How many there are.
    pub const COUNT: usize = 8;

    /// All of them, in order.
    pub const ALL: [Self; Self::COUNT] = [
        Self::LeftAileron,
        Self::RightAileron,
        Self::LeftElevator,
        Self::RightElevator,
        Self::Rudder,
        Self::NozzlePitch,
        Self::NozzleYaw,
        Self::Engine,
    ];

    /// The five aerodynamic surfaces, in the order of the paper's `u`.
    pub const SURFACES: [Self; 5] = [
        Self::LeftAileron,
        Self::RightAileron,
        Self::LeftElevator,
        Self::RightElevator,
        Self::Rudder,
    ];

    /// Name for configuration keys and log columns.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::LeftAileron => "left_aileron",
            Self::RightAileron => "right_aileron",
            Self::LeftElevator => "left_elevator",
            Self::RightElevator => "right_elevator",
            Self::Rudder => "rudder",
            Self::NozzlePitch => "nozzle_pitch",
            Self::NozzleYaw => "nozzle_yaw",
            Self::Engine => "engine",
        }
    }

    /// Name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LeftAileron => "left aileron",
            Self::RightAileron => "right aileron",
            Self::LeftElevator => "left elevator",
            Self::RightElevator => "right elevator",
            Self::Rudder => "rudder",
            Self::NozzlePitch => "nozzle pitch",
            Self::NozzleYaw => "nozzle yaw",
            Self::Engine => "engine",
        }
    }

    /// Whether the value is an angle in rad; only the engine's is not (newton).
    #[must_use]
    pub const fn is_angle(self) -> bool {
        !matches!(self, Self::Engine)
    }

    /// The effector at `index` of [`Effector::ALL`].
    #[must_use]
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// Position in [`Effector::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The one on the other side of the plane of symmetry; itself for those in it.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        match self {
            Self::LeftAileron => Self::RightAileron,
            Self::RightAileron => Self::LeftAileron,
            Self::LeftElevator => Self::RightElevator,
            Self::RightElevator => Self::LeftElevator,
            other => other,
        }
    }
}

impl fmt::Display for Effector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One value for each effector, indexed by [`Effector`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PerEffector<T>([T; Effector::COUNT]);

impl<T> PerEffector<T> {
    /// From values in the order of [`Effector::ALL`].
    pub const fn new(values: [T; Effector::COUNT]) -> Self {
        Self(values)
    }

    /// One value for each effector.
    #[inline]
    pub fn from_fn(value: impl FnMut(Effector) -> T) -> Self {
        Self(Effector::ALL.map(value))
    }

    /// Each effector with its value.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = (Effector, &T)> {
        Effector::ALL.into_iter().zip(self.0.iter())
    }

    /// The values in the order of [`Effector::ALL`].
    pub const fn as_array(&self) -> &[T; Effector::COUNT] {
        &self.0
    }
}

impl<T> Index<Effector> for PerEffector<T> {
    type Output = T;
    #[inline]
    fn index(&self, effector: Effector) -> &T {
        &self.0[effector as usize]
    }
}

impl<T> IndexMut<Effector> for PerEffector<T> {
    #[inline]
    fn index_mut(&mut self, effector: Effector) -> &mut T {
        &mut self.0[effector as usize]
    }
}
