//! What the claims of both cases measure in the same way: survival, and the estimate z2 against the truth F.

use super::cases::Runs;
use super::claim::{Claim, ClaimResult, Limit};
use super::trace::{Trace, column};
use crate::metrics::{max_abs, rms};
use crate::table::Row;

/// "Nearly zero": fraction of the activation level. Also in claim 2d.
const QUIET: f64 = 0.1;
/// "Sudden": the estimate reaches 90 % of the fault within this time, s.
const RISE_S: f64 = 0.2;
/// The jump is the largest |F| in this time after the fault, s.
pub const JUMP_S: f64 = 0.3;

/// One axis of the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// p, F1.
    Roll,
    /// q, F2.
    Pitch,
    /// r, F3.
    Yaw,
}

impl Axis {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Roll, Self::Pitch, Self::Yaw];

    /// Name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
        }
    }

    /// z2: the estimate, rad/s².
    #[must_use]
    pub const fn estimate(self, row: &Row) -> f64 {
        match self {
            Self::Roll => row.z2_p_rad_s2,
            Self::Pitch => row.z2_q_rad_s2,
            Self::Yaw => row.z2_r_rad_s2,
        }
    }

    /// F: the truth, rad/s².
    #[must_use]
    pub const fn fault(self, row: &Row) -> f64 {
        match self {
            Self::Roll => row.fault_p_rad_s2,
            Self::Pitch => row.fault_q_rad_s2,
            Self::Yaw => row.fault_r_rad_s2,
        }
    }

    /// z2 - F, rad/s².
    #[must_use]
    pub fn error(self, row: &Row) -> f64 {
        self.estimate(row) - self.fault(row)
    }
}

/// The jump: largest |F| of an axis just after the fault, rad/s².
#[must_use]
pub fn jump(run: &Trace, fault_s: f64, axis: Axis) -> f64 {
    max_abs(column(run.window(fault_s, fault_s + JUMP_S), |row| axis.fault(row)))
}

/// rms of z2 - F from one second after the fault on, as a fraction of the jump.
#[must_use]
pub fn error_over_jump(run: &Trace, fault_s: f64, axis: Axis) -> f64 {
    rms(column(run.from(fault_s + 1.0), |row| axis.error(row))) / jump(run, fault_s, axis)
}

/// Time from the fault until the estimate first has 90 % of F, s; NaN if it never does.
///
/// F counts from half of the jump on: before the fault acts, 90 % of nothing is reached at once.
#[must_use]
pub fn rise_time(run: &Trace, fault_s: f64, axis: Axis) -> f64 {
    let half = 0.5 * jump(run, fault_s, axis);
    let found = run.from(fault_s).iter().find(|sample| {
        let (fault, estimate) = (axis.fault(&sample.row), axis.estimate(&sample.row));
        fault.abs() >= half && estimate * fault.signum() >= 0.9 * fault.abs()
    });
    found.map_or(f64::NAN, |sample| sample.row.t_s - fault_s)
}

/// The aircraft is not lost.
#[must_use]
pub fn not_lost(claim: Claim, run: &Trace) -> ClaimResult {
    let lost = f64::from(u8::from(run.lost_at().is_some()));
    claim.check("aircraft lost", lost, "runs", Limit::Exactly(0.0))
}

/// Before the fault the estimates are nearly zero, each axis.
#[must_use]
pub fn quiet_before(claim: Claim, runs: &Runs) -> Vec<ClaimResult> {
    let gains = &runs.case.setup.parameters.gains.activation;
    let before = runs.compensated.before(runs.case.fault_s);
    let axes = [
        (Axis::Roll, gains.level_roll),
        (Axis::Pitch, gains.level_pitch),
        (Axis::Yaw, gains.level_yaw),
    ];
    let quiet = |(axis, level): (Axis, f64)| {
        claim.check(
            format!("largest z2 in {} before the fault, over its level", axis.name()),
            max_abs(column(before, |row| axis.estimate(row))) / level,
            "-",
            Limit::AtMost(QUIET),
        )
    };
    axes.map(quiet).to_vec()
}

/// The estimate jumps with the fault.
#[must_use]
pub fn rises(claim: Claim, run: &Trace, fault_s: f64, axis: Axis) -> ClaimResult {
    let measure = format!("time until z2 in {} has 90 % of F", axis.name());
    claim.check(measure, rise_time(run, fault_s, axis), "s", Limit::AtMost(RISE_S))
}

/// The estimate then equals the fault.
#[must_use]
pub fn equals(claim: Claim, run: &Trace, fault_s: f64, axis: Axis, percent: f64) -> ClaimResult {
    claim.check(
        format!("rms of z2 - F in {} from 1 s after the fault on, over the jump", axis.name()),
        100.0 * error_over_jump(run, fault_s, axis),
        "%",
        Limit::AtMost(percent),
    )
}

/// The fault accelerates each axis to the side that the paper says.
#[must_use]
pub fn fault_signs(claim: Claim, run: &Trace, t_s: f64, signs: &[(Axis, f64)]) -> Vec<ClaimResult> {
    let one = |(axis, sign): &(Axis, f64)| {
        let value = run.at(t_s).map_or(f64::NAN, |sample| axis.fault(&sample.row));
        let limit = if *sign > 0.0 { Limit::Above(0.0) } else { Limit::Below(0.0) };
        claim.check(format!("F in {} just after the fault", axis.name()), value, "rad/s2", limit)
    };
    signs.iter().map(one).collect()
}
