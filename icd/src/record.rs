//! What the plant tells the recorder of a flight: the truth of a tick, and pieces of the run header.
//!
//! It travels in an envelope at the end of sensor packets, when the autopilot's process records. The recorder
//! opens it; the control laws and the vehicle never get it ([`crate::wire::SensorPacket`] does not have it).
//!
//! ```text
//! offset  size  field
//!  0      8*N   truth, f64, in the order of TRUTH_FIELDS
//!  8*N    2     piece of the run header: index, from 0
//!  ..     2     pieces in all; 0: none in this envelope
//!  ..     ..    bytes of the piece
//! ```

use crate::wire::ENVELOPE_MAX;
use arrayvec::ArrayVec;

/// Names of the truth's values: axis or effector and unit. All angles rad, in NED and body axes.
pub const TRUTH_FIELDS: [&str; 59] = [
    "p_rad_s",
    "q_rad_s",
    "r_rad_s",
    "roll_rad",
    "pitch_rad",
    "yaw_rad",
    "airspeed_m_s",
    "alpha_rad",
    "beta_rad",
    "altitude_m",
    "latitude_rad",
    "longitude_rad",
    "velocity_north_m_s",
    "velocity_east_m_s",
    "velocity_down_m_s",
    "position_north_m",
    "position_east_m",
    "position_down_m",
    "p_dot_rad_s2",
    "q_dot_rad_s2",
    "r_dot_rad_s2",
    "force_x_m_s2",
    "force_y_m_s2",
    "force_z_m_s2",
    "load_factor_g",
    "wind_north_m_s",
    "wind_east_m_s",
    "wind_down_m_s",
    "density_kg_m3",
    // What acts of each effector after the faults.
    "effect_left_aileron_rad",
    "effect_right_aileron_rad",
    "effect_left_elevator_rad",
    "effect_right_elevator_rad",
    "effect_rudder_rad",
    "effect_nozzle_pitch_rad",
    "effect_nozzle_yaw_rad",
    "effect_engine_n",
    // Where each effector really is.
    "position_left_aileron_rad",
    "position_right_aileron_rad",
    "position_left_elevator_rad",
    "position_right_elevator_rad",
    "position_rudder_rad",
    "position_nozzle_pitch_rad",
    "position_nozzle_yaw_rad",
    "position_engine_n",
    // Code of the fault that acts (FaultKind::code); 0 for none.
    "fault_left_aileron",
    "fault_right_aileron",
    "fault_left_elevator",
    "fault_right_elevator",
    "fault_rudder",
    "fault_nozzle_pitch",
    "fault_nozzle_yaw",
    "fault_engine",
    // Quaternion of the attitude, body to NED, w first: without the loss of the angles at +-90 deg of pitch.
    "q_w",
    "q_x",
    "q_y",
    "q_z",
    // 1 when the plant has stopped: on the ground, or broken.
    "on_ground",
    "broken",
];

/// The truth of one tick, in the order of [`TRUTH_FIELDS`].
pub type TruthRow = [f64; TRUTH_FIELDS.len()];

/// A piece of the run header: JSON text, cut where it happens to fall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece<'a> {
    /// Its number, from 0.
    pub index: u16,
    /// Pieces in all.
    pub count: u16,
    /// The bytes.
    pub bytes: &'a [u8],
}

const TRUTH_BYTES: usize = 8 * TRUTH_FIELDS.len();

/// Longest piece of the run header, bytes.
pub const PIECE_MAX: usize = ENVELOPE_MAX - TRUTH_BYTES - 4;

/// An encoded envelope.
pub type EnvelopeBytes = ArrayVec<u8, ENVELOPE_MAX>;

/// Fills an envelope. Of a piece longer than [`PIECE_MAX`] only the beginning is written.
pub fn seal(truth: &TruthRow, piece: Option<Piece<'_>>, out: &mut EnvelopeBytes) {
    out.clear();
    let mut put = |bytes: &[u8]| {
        // Everything fits, by the lengths above.
        let _fits = out.try_extend_from_slice(bytes);
    };
    for value in truth {
        put(&value.to_le_bytes());
    }
    let Piece { index, count, bytes } = piece.unwrap_or(Piece { index: 0, count: 0, bytes: &[] });
    put(&index.to_le_bytes());
    put(&count.to_le_bytes());
    put(&bytes[..bytes.len().min(PIECE_MAX)]);
}

/// Opens an envelope; `None` if it is empty or no envelope of this version.
#[must_use]
pub fn open(envelope: &[u8]) -> Option<(TruthRow, Option<Piece<'_>>)> {
    let (truth, rest) = envelope.split_at_checked(TRUTH_BYTES)?;
    let mut row = [0.0; TRUTH_FIELDS.len()];
    for (value, bytes) in row.iter_mut().zip(truth.as_chunks::<8>().0) {
        *value = f64::from_le_bytes(*bytes);
    }
    let (index, rest) = rest.split_first_chunk::<2>()?;
    let (count, bytes) = rest.split_first_chunk::<2>()?;
    let (index, count) = (u16::from_le_bytes(*index), u16::from_le_bytes(*count));
    Some((row, (index < count).then_some(Piece { index, count, bytes })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sealed_comes_out_again() {
        let mut truth = [0.5; TRUTH_FIELDS.len()];
        truth[3] = -1.0 / 3.0;
        let bytes = [7; PIECE_MAX];
        let piece = Piece { index: 2, count: 3, bytes: &bytes };
        let mut envelope = EnvelopeBytes::new();
        seal(&truth, Some(piece), &mut envelope);
        assert_eq!(envelope.len(), ENVELOPE_MAX);
        assert_eq!(open(&envelope), Some((truth, Some(piece))));
        seal(&truth, None, &mut envelope);
        assert_eq!(open(&envelope), Some((truth, None)));
        assert_eq!(open(&[]), None);
        assert_eq!(open(&envelope[..100]), None);
    }
}
