//! Effectors by their place, values for each of them, their kinds, and the commands to them; and the list of an aircraft's effectors:
//! names, kinds, sides, pairs, MAVLink numbers.
//!
//! The plant reads its list from the airframe file, the controller reads its own from the model file.

use core::fmt;
use core::ops::{Index, IndexMut};

use arrayvec::{ArrayString, ArrayVec};
use serde::{Deserialize, Serialize};

use crate::named;
use crate::units::SMALL_THRUST_N;

/// An effector: its index in the aircraft's list, which is the order of packets, logs and MAVLink outputs.
///
/// The list has its name, kind and side. The table at the top of this crate has the signs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Effector(u8);

/// An index beyond the capacity of every list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoSuchEffector(u8);

impl fmt::Display for NoSuchEffector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        // Below 16.
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
        // At most 16.
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
        // Below 16.
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
                // Below 16.
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
        /// Surface at the trailing edge of a wing without tail, for pitch and roll.
        Elevon = "elevon",
        /// Surface of a V-tail, for pitch and yaw.
        Ruddervator = "ruddervator",
        /// Steered wheel with an actuator of its own.
        Wheel = "wheel",
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

    /// Kinds that have the role of this one on an aircraft without it.
    const fn stands_in(self) -> &'static [Self] {
        match self {
            Self::Aileron => &[Self::Elevon],
            Self::Elevator => &[Self::Elevon, Self::Ruddervator],
            Self::Rudder => &[Self::Ruddervator, Self::Elevon],
            _ => &[],
        }
    }

    /// Whether it is an aerodynamic surface.
    pub const fn is_surface(self) -> bool {
        self.is_angle() && !self.is_nozzle() && !matches!(self, Self::Wheel)
    }
}

/// One command for each effector: rad, and newton for the engine.
///
/// The plant holds the commands for the whole control period.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Actuators {
    /// Commanded deflection, rad; commanded thrust, N.
    pub commands: PerEffector<f64>,
    /// Wheel brakes, 0 to 1.
    pub brakes: f64,
}

impl Actuators {
    /// With the brakes open.
    pub const fn new(commands: PerEffector<f64>) -> Self {
        Self { commands, brakes: 0.0 }
    }
}

/// Longest name, bytes.
pub const NAME_MAX: usize = 32;

/// Name of an effector or of an aircraft.
pub type Name = ArrayString<NAME_MAX>;

/// The side of the aircraft on which an effector is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LateralSide {
    /// Left.
    Left,
    /// Right.
    Right,
    /// In the plane of symmetry.
    #[default]
    Centre,
}

/// Gains of an effector for the four axes of a main command, which a pilot's sticks give as well.
///
/// The command of the effector is the sum of each axis times its gain. The signs are those of the laws: a positive
/// aileron command δa rolls left, a positive elevator command δe pitches down, a positive rudder command δr yaws left.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AxisGains {
    /// Gain of the aileron command δa.
    pub roll: f64,
    /// Gain of the elevator command δe.
    pub pitch: f64,
    /// Gain of the rudder command δr.
    pub yaw: f64,
    /// Gain of the thrust command.
    pub thrust: f64,
}

impl AxisGains {
    /// Each gain with its key.
    pub const fn named(&self) -> [(&'static str, f64); 4] {
        let Self { roll, pitch, yaw, thrust } = *self;
        [("gains.roll", roll), ("gains.pitch", pitch), ("gains.yaw", yaw), ("gains.thrust", thrust)]
    }

    /// Command of the effector for aileron, elevator, rudder (rad) and thrust (N).
    pub fn of(&self, [aileron, elevator, rudder, thrust]: [f64; 4]) -> f64 {
        let parts = [aileron, elevator, rudder, thrust];
        let followed = self.named().into_iter().zip(parts).filter(|((_, gain), _)| *gain != 0.0);
        // The first term keeps its bits, including the sign of a zero; without any term the sum is plus zero.
        followed.map(|((_, gain), part)| gain * part).reduce(|a, b| a + b).unwrap_or(0.0)
    }
}

/// An effector as in a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectorEntry {
    /// Name in texts: lower-case letters and digits, words separated by single spaces, as in `left aileron`.
    pub name: Name,
    /// Kind of effector.
    pub kind: EffectorKind,
    /// Side of the aircraft.
    #[serde(default)]
    pub side: LateralSide,
    /// Name of the mirrored effector on the other side; `None` for an effector without one.
    pub partner: Option<Name>,
    /// MAVLink number, from 1: of an engine among the motors, else among the servos.
    pub instance: u8,
}

/// An effector of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Member {
    entry: EffectorEntry,
    /// The name with underscores instead of spaces.
    key: Name,
    /// Index of the partner, or its own.
    mirrored: Effector,
}

/// Fills the places after the last effector.
const UNUSED: Member = Member {
    entry: EffectorEntry {
        name: Name::new_const(),
        kind: EffectorKind::Flap,
        side: LateralSide::Centre,
        partner: None,
        instance: 0,
    },
    key: Name::new_const(),
    mirrored: Effector::FIRST,
};

/// The effectors of one aircraft in order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Entries", into = "Entries")]
pub struct EffectorList {
    members: [Member; Effector::MAX],
    count: usize,
}

/// The entries of the list.
type Entries = ArrayVec<EffectorEntry, { Effector::MAX }>;

/// An empty list.
impl Default for EffectorList {
    fn default() -> Self {
        Self { members: [UNUSED; Effector::MAX], count: 0 }
    }
}

impl TryFrom<Entries> for EffectorList {
    type Error = EffectorListError;

    fn try_from(entries: Entries) -> Result<Self, Self::Error> {
        Self::new(entries)
    }
}

impl From<EffectorList> for Entries {
    fn from(list: EffectorList) -> Self {
        list.members().iter().map(|member| member.entry).collect()
    }
}

/// Builds and queries a list.
impl EffectorList {
    /// From entries in order.
    pub fn new(
        entries: impl IntoIterator<Item = EffectorEntry>,
    ) -> Result<Self, EffectorListError> {
        let whole = |problem| EffectorListError { effector: Name::new(), problem };
        let mut all = Entries::new();
        for entry in entries {
            all.try_push(entry).map_err(|_| whole(ListProblem::TooMany))?;
        }
        if all.is_empty() {
            return Err(whole(ListProblem::Empty));
        }
        let mut list = Self::default();
        for (place, entry) in (0..).zip(&all) {
            let wrong = |problem| EffectorListError { effector: entry.name, problem };
            let key = key(&entry.name).ok_or(wrong(ListProblem::BadName))?;
            let before = &all[..place];
            if before.iter().any(|other| other.name == entry.name) {
                return Err(wrong(ListProblem::DuplicateName));
            }
            let EffectorEntry { kind, instance, .. } = *entry;
            if !(1..=Effector::MAX).contains(&usize::from(instance)) {
                return Err(wrong(ListProblem::BadInstance(instance)));
            }
            // MAVLink counts servos and motors apart.
            let mut unit = before.iter().filter(|other| other.kind.is_angle() == kind.is_angle());
            if unit.any(|other| other.instance == instance) {
                return Err(wrong(ListProblem::DuplicateInstance(instance)));
            }
            let is_single = kind.is_nozzle() || kind == EffectorKind::Engine;
            if is_single && before.iter().any(|other| other.kind == kind) {
                return Err(wrong(ListProblem::OnlyOne(kind)));
            }
            // Among all entries, since the partner may come later in the file.
            let mirrored = partner(entry, &all).map_err(wrong)?.unwrap_or(place);
            let mirrored = Effector::from_index(mirrored).ok_or(wrong(ListProblem::TooMany))?;
            list.members[place] = Member { entry: *entry, key, mirrored };
            list.count += 1;
        }
        Ok(list)
    }

    /// Number of effectors.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// All effectors, in order.
    pub fn all(
        &self,
    ) -> impl DoubleEndedIterator<Item = Effector> + ExactSizeIterator + Clone + use<> {
        Effector::first(self.count)
    }

    /// Whether the aircraft has this effector.
    pub fn contains(&self, effector: Effector) -> bool {
        effector.index() < self.count
    }

    fn get(&self, effector: Effector) -> Option<&Member> {
        self.members().get(effector.index())
    }

    fn members(&self) -> &[Member] {
        &self.members[..self.count]
    }

    /// The entry of an effector as in the file; `None` if the aircraft does not have it.
    pub fn entry(&self, effector: Effector) -> Option<&EffectorEntry> {
        self.get(effector).map(|member| &member.entry)
    }

    /// Name in texts, as in `left aileron`.
    pub fn name(&self, effector: Effector) -> &str {
        self.get(effector)
            .map_or("an effector that this aircraft lacks", |member| &member.entry.name)
    }

    /// Name for configuration keys and log columns, as in `left_aileron`.
    pub fn key(&self, effector: Effector) -> &str {
        self.get(effector).map_or("no_effector", |member| &member.key)
    }

    /// Kind of an effector; `None` if the aircraft does not have it.
    pub fn kind(&self, effector: Effector) -> Option<EffectorKind> {
        self.get(effector).map(|member| member.entry.kind)
    }

    /// Whether the value is an angle in rad; for an engine it is a thrust in newton.
    pub fn is_angle(&self, effector: Effector) -> bool {
        self.kind(effector).is_none_or(EffectorKind::is_angle)
    }

    /// Unit at the end of a column name.
    pub fn unit(&self, effector: Effector) -> &'static str {
        if self.is_angle(effector) { "rad" } else { "n" }
    }

    /// Unit for people of an effector whose largest value is `largest`, rad or N, and what a value is multiplied by for it: a thrust
    /// below 1 kN is shown in N.
    pub fn shown_unit(&self, effector: Effector, largest: f64) -> (f64, &'static str) {
        match self.is_angle(effector) {
            true => (180.0 / core::f64::consts::PI, "deg"),
            false if largest < SMALL_THRUST_N => (1.0, "N"),
            false => (1.0e-3, "kN"),
        }
    }

    /// The partner on the other side; the effector itself if it has none.
    pub fn mirrored(&self, effector: Effector) -> Effector {
        self.get(effector).map_or(effector, |member| member.mirrored)
    }

    /// MAVLink number: of an engine among the motors, else among the servos. 0 if the aircraft does not have it.
    pub fn instance(&self, effector: Effector) -> u8 {
        self.get(effector).map_or(0, |member| member.entry.instance)
    }

    /// The effectors of a kind, in order.
    pub fn of_kind(&self, kind: EffectorKind) -> impl Iterator<Item = Effector> + '_ {
        self.all().filter(move |effector| self.kind(*effector) == Some(kind))
    }

    /// The first effector of a kind on a side.
    pub fn find(&self, kind: EffectorKind, side: LateralSide) -> Option<Effector> {
        let is_there = |effector: &Effector| self.entry(*effector).is_some_and(|e| e.side == side);
        self.of_kind(kind).find(is_there)
    }

    /// The effector of a kind that an aircraft has at most once.
    pub fn only(&self, kind: EffectorKind) -> Option<Effector> {
        self.of_kind(kind).next()
    }

    /// The effector with this key or name; without one, the effector of this role: `left_elevator`, `rudder`, `engine`, so that
    /// scenarios and studies of one aircraft fly another whose effectors have other names.
    pub fn by_key(&self, key: &str) -> Option<Effector> {
        let named = |effector: &Effector| self.key(*effector) == key || self.name(*effector) == key;
        self.all().find(named).or_else(|| self.by_role(key))
    }

    /// The only effector of a kind on a side; where the aircraft has none of this kind, that of a kind that stands in, for one in the
    /// centre the left one.
    fn by_role(&self, key: &str) -> Option<Effector> {
        let (side, kind) = role(key)?;
        let is_there = |kind: &EffectorKind| self.of_kind(*kind).next().is_some();
        let stands_in = kind.stands_in().iter().copied();
        let found = core::iter::once(kind).chain(stands_in).find(is_there)?;
        let side = match side {
            LateralSide::Centre if found != kind => LateralSide::Left,
            side => side,
        };
        let kind = found;
        let on_side = |effector: &Effector| self.entry(*effector).is_some_and(|e| e.side == side);
        let mut all = self.of_kind(kind).filter(on_side);
        // Of two effectors the word would not say which.
        all.next().filter(|_| all.next().is_none())
    }

    /// Whether a word is the role of an effector that this aircraft does not have.
    pub fn lacks(&self, key: &str) -> bool {
        role(key).is_some() && self.by_key(key).is_none()
    }

    /// The servos (angles) or motors (engines) in the order of their MAVLink numbers.
    pub fn by_unit(&self, is_angle: bool) -> ArrayVec<Effector, { Effector::MAX }> {
        let mut unit: ArrayVec<_, { Effector::MAX }> =
            self.all().filter(|effector| self.is_angle(*effector) == is_angle).collect();
        unit.sort_unstable_by_key(|effector| self.instance(*effector));
        unit
    }

    /// The pairs, left effector first, in the order of the first of the two.
    pub fn pairs(&self) -> impl Iterator<Item = [Effector; 2]> + '_ {
        self.all().filter_map(|effector| {
            let other = self.mirrored(effector);
            let is_left = self.entry(effector)?.side == LateralSide::Left;
            // Each pair once.
            (effector < other).then_some(if is_left {
                [effector, other]
            } else {
                [other, effector]
            })
        })
    }

    /// The effectors without a partner, in order.
    pub fn singles(&self) -> impl Iterator<Item = Effector> + '_ {
        self.all().filter(|effector| self.mirrored(*effector) == *effector)
    }

    /// CRC-32 of number, order, names and kinds of the effectors: it differs between different lists.
    pub fn identity(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        for member in self.members() {
            hasher.update(member.entry.name.as_bytes());
            // The zero ends the name: without it two lists could give the same bytes.
            hasher.update(&[0]);
            hasher.update(member.entry.kind.key().as_bytes());
            hasher.update(&[0, member.entry.instance]);
        }
        hasher.finalize()
    }
}

/// The name with underscores; `None` for an invalid name.
fn key(name: &Name) -> Option<Name> {
    let mut words = name.split(' ');
    let is_word = |word: &str| {
        !word.is_empty() && word.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit())
    };
    if !words.all(is_word) || !name.starts_with(|first: char| first.is_ascii_lowercase()) {
        return None;
    }
    let mut key = Name::new();
    for letter in name.chars() {
        key.push(if letter == ' ' { '_' } else { letter });
    }
    Some(key)
}

/// Side and kind of a role: `left_elevator`, `rudder`, `nozzle yaw`.
fn role(key: &str) -> Option<(LateralSide, EffectorKind)> {
    use LateralSide::{Centre, Left, Right};
    let sides = [("left", Left), ("right", Right)];
    let sided = sides.into_iter().find_map(|(word, side)| {
        let rest = key.strip_prefix(word)?;
        Some((side, rest.strip_prefix(['_', ' '])?))
    });
    let (side, word) = sided.unwrap_or((Centre, key));
    let is_it = |kind: &EffectorKind| kind.key().split('_').eq(word.split(['_', ' ']));
    Some((side, EffectorKind::ALL.into_iter().find(is_it)?))
}

/// Index of the partner.
fn partner(entry: &EffectorEntry, all: &[EffectorEntry]) -> Result<Option<usize>, ListProblem> {
    let Some(partner) = entry.partner else { return Ok(None) };
    let place = all.iter().position(|other| other.name == partner);
    let place = place.ok_or(ListProblem::UnknownPartner(partner))?;
    let other = &all[place];
    if other.partner != Some(entry.name) {
        return Err(ListProblem::NotMutual(partner));
    }
    let sides = [entry.side, other.side];
    let are_opposite = sides == [LateralSide::Left, LateralSide::Right]
        || sides == [LateralSide::Right, LateralSide::Left];
    if other.kind != entry.kind || !are_opposite {
        return Err(ListProblem::NotMirrored(partner));
    }
    Ok(Some(place))
}

/// Error in a list of effectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectorListError {
    /// Name of the effector; empty for the list as a whole.
    pub effector: Name,
    /// Kind of the error.
    pub problem: ListProblem,
}

/// The kinds of [`EffectorListError`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ListProblem {
    /// The list is empty.
    Empty,
    /// The list has more than [`Effector::MAX`] effectors.
    TooMany,
    /// The name has characters other than lower-case letters, digits and single spaces between them.
    BadName,
    /// Two effectors have the same name.
    DuplicateName,
    /// Two servos or two motors have this MAVLink number.
    DuplicateInstance(u8),
    /// This MAVLink number is outside its range.
    BadInstance(u8),
    /// There is no effector with this partner's name.
    UnknownPartner(Name),
    /// The partner of this name does not name the effector as its own partner.
    NotMutual(Name),
    /// Effector and partner of this name are not left and right of the same kind.
    NotMirrored(Name),
    /// A second engine, or a second nozzle for the same axis: an aircraft has at most one of each such kind.
    OnlyOne(EffectorKind),
}

impl fmt::Display for EffectorListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.effector.is_empty() {
            write!(f, "effector `{}`: ", self.effector)?;
        }
        match self.problem {
            ListProblem::Empty => f.write_str("there is no [[effector]], expected 1 to 16"),
            ListProblem::TooMany => f.write_str("there are more than 16 effectors, expected 1 to 16"),
            ListProblem::BadName => f.write_str(
                "name is not made of small letters and digits, words apart by single spaces, as in `left aileron`",
            ),
            ListProblem::DuplicateName => f.write_str("name stands there twice, expected each once"),
            ListProblem::DuplicateInstance(instance) => {
                write!(f, "instance = {instance} stands there twice, expected each once")
            }
            ListProblem::BadInstance(instance) => {
                write!(f, "instance = {instance} is outside 1 to {}", Effector::MAX)
            }
            ListProblem::UnknownPartner(partner) => {
                write!(f, "partner = `{partner}`: this file has no effector of that name")
            }
            ListProblem::NotMutual(partner) => {
                write!(f, "partner = `{partner}` does not name this one as its partner")
            }
            ListProblem::NotMirrored(partner) => write!(
                f,
                "partner = `{partner}` is not of the same kind on the other side, expected one left and one right"
            ),
            ListProblem::OnlyOne(kind) => {
                write!(f, "kind = {} stands there twice, expected at most one", kind.key())
            }
        }
    }
}

impl core::error::Error for EffectorListError {}

#[cfg(test)]
mod tests;
