//! Claims 2a to 2e: turn with 15 degrees of roll, rudder jammed at +7 degrees.
//!
//! Each limit is the one of the claim's row in docs/claims.md.

use super::cases::Runs;
use super::claim::{Claim, ClaimResult, Limit};
use super::estimates::{self, Axis};
use super::trace::{Sample, Trace, column};
use crate::metrics::{DEG, max, max_abs, mean, min, peak_to_peak, rms, turned};

const CIRCLE: Claim =
    Claim { id: "2a", text: "no fault: altitude-holding circular flight, excellent tracking" };
const UNSTABLE: Claim = Claim { id: "2b", text: "PID only: unstable within a short period" };
const STABLE: Claim =
    Claim { id: "2c", text: "compensated: stable, roll settles around 10 deg, altitude held" };
const ESTIMATES: Claim =
    Claim { id: "2d", text: "estimates nearly zero, jump, then equal the fault" };
const SIGNS: Claim = Claim {
    id: "2e",
    text: "rudder +7 deg gives +roll and -yaw; the compensating aileron is positive; the lateral \
           nozzle is at its limit, the vertical one idle",
};

/// Roll reference, deg.
pub const REFERENCE_DEG: f64 = 15.0;
/// Altitude that is held, m.
const ALTITUDE_M: f64 = 5_000.0;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;
/// The end of a run, over which means are taken, s.
const SETTLED_S: f64 = 10.0;
/// "Excellent tracking": overshoot, deg.
const OVERSHOOT_DEG: f64 = 1.0;
/// "Excellent tracking": mean error at the end, deg.
const MEAN_ERROR_DEG: f64 = 0.5;
/// "Excellent tracking": 90 % of the reference is reached in this time, s.
const RISE_S: f64 = 3.0;
/// "Altitude-holding", m.
const HELD_M: f64 = 15.0;
/// "Circular": turn rate against g tan(phi) / V, percent.
const CIRCULAR_PERCENT: f64 = 15.0;
/// "Within a short period", s after the fault.
const LOST_WITHIN_S: f64 = 5.0;
/// "Around 10 degrees", deg.
const SETTLED_DEG: (f64, f64) = (9.0, 11.0);
/// "Settles": peak to peak at the end, deg.
const SETTLED_SPAN_DEG: f64 = 0.5;
/// "Equal": rms of the estimation error, percent of the jump.
const EQUAL_PERCENT: f64 = 3.0;
/// The rudder has no pitch moment, so that axis is measured as it is, rad/s².
const EQUAL_PITCH: f64 = 0.01;
/// "At its limit" of 15 deg, deg.
pub const AT_LIMIT_DEG: f64 = 14.5;
/// When the lateral nozzle has got there, s after the fault.
pub const AT_LIMIT_AFTER_S: f64 = 0.6;
/// "Unable to fully counteract": the demand over the last five seconds, deg.
const DEMAND_DEG: f64 = 16.0;
/// "Idle" vertical nozzle, deg.
const IDLE_DEG: f64 = 1.0;

/// All claims of case 2.
#[must_use]
pub fn claims(runs: &Runs) -> Vec<ClaimResult> {
    [claim_2a(runs), claim_2b(runs), claim_2c(runs), claim_2d(runs), claim_2e(runs)].concat()
}

/// Without fault the aircraft flies a circle.
#[must_use]
pub fn claim_2a(runs: &Runs) -> Vec<ClaimResult> {
    let run = runs.no_fault;
    let phi = |samples| column(samples, |row| row.phi_rad);
    let overshoot = max(phi(run.samples())) / DEG - REFERENCE_DEG;
    let settled = mean(phi(run.last(SETTLED_S))) / DEG;
    let rise = run
        .samples()
        .iter()
        .find(|s| s.row.phi_rad >= 0.9 * REFERENCE_DEG * DEG)
        .map_or(f64::NAN, |s| s.row.t_s);
    vec![
        CIRCLE.check("roll overshoot", overshoot, "deg", Limit::AtMost(OVERSHOOT_DEG)),
        CIRCLE.check(
            "mean roll of the last 10 s, distance from 15 deg",
            (settled - REFERENCE_DEG).abs(),
            "deg",
            Limit::AtMost(MEAN_ERROR_DEG),
        ),
        CIRCLE.check("time to 90 % of 15 deg", rise, "s", Limit::AtMost(RISE_S)),
        altitude_held(CIRCLE, run),
        CIRCLE.check(
            "mean turn rate of the last 10 s, apart from g tan(phi) / V",
            100.0 * turn_rate_error(run.last(SETTLED_S)),
            "%",
            Limit::AtMost(CIRCULAR_PERCENT),
        ),
    ]
}

fn altitude_held(claim: Claim, run: &Trace) -> ClaimResult {
    let error = max_abs(column(run.samples(), |row| row.altitude_m - ALTITUDE_M));
    claim.check("distance from 5000 m", error, "m", Limit::AtMost(HELD_M))
}

/// Mean turn rate against that of a coordinated turn, as a fraction of the latter.
fn turn_rate_error(samples: &[Sample]) -> f64 {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return f64::NAN;
    };
    let rate = turned(column(samples, |row| row.psi_rad)) / (last.row.t_s - first.row.t_s);
    let phi = mean(column(samples, |row| row.phi_rad));
    let airspeed = mean(column(samples, |row| row.airspeed_m_s));
    let coordinated = GRAVITY * libm::tan(phi) / airspeed;
    (rate / coordinated - 1.0).abs()
}

/// With the PID alone the aircraft is lost.
#[must_use]
pub fn claim_2b(runs: &Runs) -> Vec<ClaimResult> {
    let lost_after = runs.pid_only.lost_at().map_or(f64::NAN, |t| t - runs.case.fault_s);
    let limit = Limit::AtMost(LOST_WITHIN_S);
    vec![UNSTABLE.check("time from the fault to the loss", lost_after, "s", limit)]
}

/// With the compensator the roll angle settles below its reference.
#[must_use]
pub fn claim_2c(runs: &Runs) -> Vec<ClaimResult> {
    let run = runs.compensated;
    let end = column(run.last(SETTLED_S), |row| row.phi_rad / DEG);
    let (low, high) = SETTLED_DEG;
    let settled = mean(end.clone());
    vec![
        estimates::not_lost(STABLE, run),
        STABLE.check("mean roll of the last 10 s", settled, "deg", Limit::AtLeast(low)),
        STABLE.check("mean roll of the last 10 s", settled, "deg", Limit::AtMost(high)),
        STABLE.check(
            "roll peak to peak over the last 10 s",
            peak_to_peak(end),
            "deg",
            Limit::AtMost(SETTLED_SPAN_DEG),
        ),
        altitude_held(STABLE, run),
    ]
}

/// The estimates find the fault.
#[must_use]
pub fn claim_2d(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let mut results = estimates::quiet_before(ESTIMATES, runs);
    for axis in [Axis::Roll, Axis::Yaw] {
        results.push(estimates::rises(ESTIMATES, run, fault_s, axis));
        results.push(estimates::equals(ESTIMATES, run, fault_s, axis, EQUAL_PERCENT));
    }
    let pitch = rms(column(run.from(fault_s + 1.0), |row| Axis::Pitch.error(row)));
    results.push(ESTIMATES.check(
        "rms of z2 - F in pitch from 1 s after the fault on",
        pitch,
        "rad/s2",
        Limit::AtMost(EQUAL_PITCH),
    ));
    results
}

/// The signs are those that the paper states; the lateral nozzle does all it can.
#[must_use]
pub fn claim_2e(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let signs = [(Axis::Roll, 1.0), (Axis::Yaw, -1.0)];
    let mut results = estimates::fault_signs(SIGNS, run, fault_s + 0.3, &signs);
    let aileron = run.samples().last().map_or(f64::NAN, |s| s.row.ucf_aileron_rad) / DEG;
    let at_limit =
        min(column(run.from(fault_s + AT_LIMIT_AFTER_S), |row| row.nozzle_yaw_rad)) / DEG;
    let demand = min(column(run.last(5.0), |row| row.ucf_nozzle_yaw_rad)) / DEG;
    let vertical = max_abs(column(run.samples(), |row| row.nozzle_pitch_rad)) / DEG;
    results.extend([
        SIGNS.check("compensating aileron at the end", aileron, "deg", Limit::Above(0.0)),
        SIGNS.check(
            "smallest lateral nozzle angle from 0.6 s after the fault on",
            at_limit,
            "deg",
            Limit::AtLeast(AT_LIMIT_DEG),
        ),
        SIGNS.check(
            "smallest demanded lateral nozzle angle over the last 5 s",
            demand,
            "deg",
            Limit::AtLeast(DEMAND_DEG),
        ),
        SIGNS.check("largest vertical nozzle angle", vertical, "deg", Limit::AtMost(IDLE_DEG)),
    ]);
    results
}
