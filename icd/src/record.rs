//! Data of the plant for the flight recorder: the truth of a tick, and pieces of the run header.
//!
//! While the autopilot's process records, sensor packets carry this data in an envelope at their end. Only the recorder
//! opens it; the control laws and the vehicle never receive it ([`crate::wire::SensorPacket`] does not contain it).
//!
//! ```text
//! offset  size  field
//!  0      2     N: values of the truth
//!  2      8*N   truth, f64, in the order of truth_fields
//!  ..     2     piece of the run header: index, from 0
//!  ..     2     pieces in all; 0: none in this envelope
//!  ..     ..    bytes of the piece
//! ```

use core::ops::Deref;

use arrayvec::{ArrayString, ArrayVec};

use crate::effector_list::{Effector, EffectorList};
use crate::signals;
use crate::wire::ENVELOPE_MAX;

signals! {
    /// First values of the truth; the values of the effectors follow, then those of [`TruthEnd`]. [`truth_fields`] has all names.
    /// Angles, axes and signs as in [`crate::frames`].
    TruthHead {
        /// Body rates relative to inertial space, rad/s.
        p_rad_s,
        /// Pitch rate, rad/s.
        q_rad_s,
        /// Yaw rate, rad/s.
        r_rad_s,
        /// Roll angle, rad, in (-π, π].
        roll_rad,
        /// Pitch angle, rad.
        pitch_rad,
        /// Yaw angle, rad, from north to the right.
        yaw_rad,
        /// True airspeed, m/s, gusts included.
        airspeed_m_s,
        /// Angle of attack, rad, gusts included.
        alpha_rad,
        /// Sideslip, rad, gusts included, positive with the airflow from the right.
        beta_rad,
        /// Altitude above the ellipsoid or the plane, m.
        altitude_m,
        /// Geodetic latitude, rad.
        latitude_rad,
        /// Longitude, rad.
        longitude_rad,
        /// Velocity over the ground, m/s.
        velocity_north_m_s,
        /// To the east.
        velocity_east_m_s,
        /// Downwards.
        velocity_down_m_s,
        /// Position from the start point at altitude zero, m, in the NED axes of that point.
        position_north_m,
        /// To the east.
        position_east_m,
        /// Downwards.
        position_down_m,
        /// Rates of change of the body rates, rad/s².
        p_dot_rad_s2,
        /// About the y axis.
        q_dot_rad_s2,
        /// About the z axis.
        r_dot_rad_s2,
        /// Specific force: all forces but gravity, per mass, m/s², body axes.
        force_x_m_s2,
        /// Along the y axis.
        force_y_m_s2,
        /// Along the z axis.
        force_z_m_s2,
        /// Normal load factor: minus the z component of the specific force, in g.
        load_factor_g,
        /// Velocity of the air over the ground, gusts included, m/s, where it blows to.
        wind_north_m_s,
        /// To the east.
        wind_east_m_s,
        /// Downwards.
        wind_down_m_s,
        /// Density of the air, kg/m³.
        density_kg_m3,
    }
}

/// Values of each effector in the truth: its effective deflection with faults, its true position, and the code of its
/// active fault (`FaultKind::code`), 0 for none. The truth has the first value of all effectors, then the next.
pub const TRUTH_PER_EFFECTOR: [&str; 3] = ["effect", "position", "fault"];

signals! {
    /// Last values of the truth.
    TruthEnd {
        /// Quaternion of the attitude, body to NED, w first: free of the singularity of the angles at ±90 deg pitch.
        q_w,
        /// i.
        q_x,
        /// j.
        q_y,
        /// k.
        q_z,
        /// 1 when the plant has stopped on the ground.
        on_ground,
        /// 1 when the plant has stopped because a number of its state is no longer possible.
        broken,
    }
}

/// Most values of the truth of one tick.
pub const TRUTH_MAX: usize =
    TruthHead::NAMES.len() + TRUTH_PER_EFFECTOR.len() * Effector::MAX + TruthEnd::NAMES.len();

/// The truth of one tick, in the order of [`truth_fields`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthRow {
    values: [f64; TRUTH_MAX],
    count: usize,
}

/// Appends as many values as fit.
impl FromIterator<f64> for TruthRow {
    fn from_iter<I: IntoIterator<Item = f64>>(all: I) -> Self {
        let mut row = Self { values: [0.0; TRUTH_MAX], count: 0 };
        for (place, value) in row.values.iter_mut().zip(all) {
            *place = value;
            row.count += 1;
        }
        row
    }
}

impl Deref for TruthRow {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

/// Name of an effector's column.
pub type FieldName = ArrayString<48>;

/// Name of an effector's column, with its unit: `position_left_aileron_rad`, or without a prefix
/// `left_aileron_rad`; a column without a deflection or thrust has no unit, `fault_left_aileron`.
pub fn effector_field(before: &str, effectors: &EffectorList, effector: Effector) -> FieldName {
    let mut name = FieldName::new();
    let unit = if before == TRUTH_PER_EFFECTOR[2] { "" } else { effectors.unit(effector) };
    let parts = [before, effectors.key(effector), unit];
    for (place, part) in parts.into_iter().filter(|part| !part.is_empty()).enumerate() {
        // Cannot fail: the longest effector name with the longest prefix and suffix fits.
        let _fits = if place > 0 { name.try_push('_') } else { Ok(()) };
        let _fits = name.try_push_str(part);
    }
    name
}

/// Names of all values of the truth: axis or effector and unit.
pub fn truth_fields(effectors: &EffectorList) -> impl Iterator<Item = FieldName> + '_ {
    let fixed = |name: &str| FieldName::from(name).unwrap_or_default();
    let of_effectors = TRUTH_PER_EFFECTOR.into_iter().flat_map(move |before| {
        effectors.all().map(move |effector| effector_field(before, effectors, effector))
    });
    let (head, end) = (TruthHead::NAMES.into_iter(), TruthEnd::NAMES.into_iter());
    head.map(fixed).chain(of_effectors).chain(end.map(fixed))
}

/// A piece of the run header: JSON text, split at arbitrary bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece<'a> {
    /// Its index, from 0.
    pub index: u16,
    /// Number of pieces.
    pub count: u16,
    /// The bytes.
    pub bytes: &'a [u8],
}

/// Longest piece of the run header in an envelope whose truth has this many values, bytes.
pub const fn piece_max(truth: usize) -> usize {
    ENVELOPE_MAX - 8 * truth - 6
}

/// Even the largest aircraft leaves room for a piece.
const _: () = assert!(piece_max(TRUTH_MAX) > 40);

/// An encoded envelope.
pub type EnvelopeBytes = ArrayVec<u8, ENVELOPE_MAX>;

/// Encodes an envelope. It truncates a piece longer than [`piece_max`].
pub fn seal(truth: &TruthRow, piece: Option<Piece<'_>>, out: &mut EnvelopeBytes) {
    out.clear();
    let mut put = |bytes: &[u8]| {
        // The constants above guarantee that everything fits.
        let _fits = out.try_extend_from_slice(bytes);
    };
    // At most TRUTH_MAX.
    put(&(truth.len() as u16).to_le_bytes());
    for value in truth.iter() {
        put(&value.to_le_bytes());
    }
    let Piece { index, count, bytes } = piece.unwrap_or(Piece { index: 0, count: 0, bytes: &[] });
    put(&index.to_le_bytes());
    put(&count.to_le_bytes());
    put(&bytes[..bytes.len().min(piece_max(truth.len()))]);
}

/// Decodes an envelope; `None` if it is empty or not an envelope of this version.
pub fn open(envelope: &[u8]) -> Option<(TruthRow, Option<Piece<'_>>)> {
    let (count, rest) = envelope.split_first_chunk::<2>()?;
    let count = usize::from(u16::from_le_bytes(*count));
    let (truth, rest) = rest.split_at_checked(8 * count).filter(|_| count <= TRUTH_MAX)?;
    let row = truth.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (index, rest) = rest.split_first_chunk::<2>()?;
    let (count, bytes) = rest.split_first_chunk::<2>()?;
    let (index, count) = (u16::from_le_bytes(*index), u16::from_le_bytes(*count));
    Some((row, (index < count).then_some(Piece { index, count, bytes })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envelope_reads_back() {
        let values = |count: u32| (0..count).map(|n| -1.0 / f64::from(n + 1));
        let truth: TruthRow = values(83).collect();
        let bytes = [7; piece_max(83)];
        let piece = Piece { index: 2, count: 3, bytes: &bytes };
        let mut envelope = EnvelopeBytes::new();
        seal(&truth, Some(piece), &mut envelope);
        assert_eq!(envelope.len(), ENVELOPE_MAX);
        assert_eq!(open(&envelope), Some((truth, Some(piece))));
        let truth: TruthRow = values(59).collect();
        seal(&truth, None, &mut envelope);
        assert_eq!(open(&envelope), Some((truth, None)));
        assert_eq!(open(&[]), None);
        assert_eq!(open(&envelope[..100]), None);
    }

    #[test]
    fn the_columns_of_the_jet_are_named_by_its_effectors() {
        let list = crate::tvc_jet::effectors();
        let names: std::vec::Vec<FieldName> = truth_fields(&list).collect();
        assert_eq!(names.len(), 59);
        assert_eq!(&names[29], "effect_left_aileron_rad");
        assert_eq!(&names[36], "effect_engine_n");
        assert_eq!(&names[41], "position_rudder_rad");
        assert_eq!(&names[52], "fault_engine");
        assert_eq!(&names[58], "broken");
        assert_eq!(&effector_field("", &list, crate::tvc_jet::RUDDER), "rudder_rad");
    }
}
