//! Claims 1a to 1e: climb, left elevator jammed at +30 degrees.
//!
//! Each limit is the one of the claim's row in docs/claims.md.

use super::cases::Runs;
use super::claim::{Claim, ClaimResult, Limit};
use super::estimates::{self, Axis};
use super::trace::{Sample, column};
use crate::metrics::{DEG, drop_below_running_max, max, max_abs, mean, min};
use crate::table::Row;
use icd::tvc_jet;

const SMOOTH_CLIMB: Claim = Claim { id: "1a", text: "no fault: climb is smooth" };
const ONLY_THE_ELEVATOR: Claim =
    Claim { id: "1a", text: "no fault: in the first 3 s only the elevator moves" };
const DIVERGES: Claim = Claim { id: "1b", text: "PID only: diverges within a short period" };
const RATES: Claim = Claim { id: "1c", text: "compensated: rates almost those without fault" };
const ALTITUDE: Claim = Claim { id: "1c", text: "compensated: altitude almost that without fault" };
const ESTIMATES: Claim =
    Claim { id: "1d", text: "estimates are nearly zero, jump at the fault, then equal it" };
const SIGNS: Claim = Claim {
    id: "1e",
    text: "the left elevator gives +roll, -pitch, +yaw; the aileron answers with -roll and -yaw",
};
const LATERAL_NOZZLE: Claim = Claim {
    id: "1e",
    text: "aileron yaw cancels the fault's yaw, so the lateral nozzle stays idle",
};
const NOZZLE_PITCH: Claim = Claim { id: "1e", text: "the nozzle pitches the nose up" };

/// Altitude reference of the climb, m.
pub const REFERENCE_M: f64 = 6_000.0;
/// "Smooth": overshoot, settled error and drop in the climb, m.
const SMOOTH_M: f64 = 20.0;
/// The climb has settled from this time on, s.
const SETTLED_S: f64 = 60.0;
/// "Smooth": largest change of the load factor, g.
const SMOOTH_G: f64 = 1.0;
/// An elevator that moves, deg.
const MOVES_DEG: f64 = 1.0;
/// An effector that does not, deg.
const IDLE_DEG: f64 = 0.05;
/// "Within a short period", s after the fault.
const LOST_WITHIN_S: f64 = 6.0;
/// "Diverges": roll rate between half a second and four seconds after the fault, deg/s.
const DIVERGING_P_DEG_S: f64 = 25.0;
/// "Diverges": yaw rate within ten seconds, deg/s.
const DIVERGING_R_DEG_S: f64 = 3.0;
/// "Diverges": altitude below the run without fault ten seconds after the fault, m.
const DIVERGING_M: f64 = 300.0;
/// "Diverges": sink rate then, m/s.
const DIVERGING_SINK_M_S: f64 = 30.0;
/// "Almost those without fault", deg/s, from three seconds after the fault on.
const SAME_RATE_DEG_S: f64 = 1.0;
/// Largest roll angle on the way, deg.
const ROLL_MAX_DEG: f64 = 30.0;
/// "Almost that without fault", m.
const SAME_ALTITUDE_M: f64 = 40.0;
/// At the end, m from the reference.
const END_ALTITUDE_M: f64 = 20.0;
/// "Equal": rms of the estimation error, percent of the jump.
const EQUAL_PERCENT: f64 = 2.0;
/// The aileron that answers, deg.
const ANSWER_DEG: f64 = 10.0;
/// The aileron keeps a margin of 5 % of its 25 deg of travel, deg.
const AILERON_MAX_DEG: f64 = 23.75;
/// "Cancels": what is left of one, at [`BALANCE_S`].
const BALANCE: f64 = 0.05;
/// When the balances are struck, s.
const BALANCE_S: f64 = 10.0;
/// "Idle" lateral nozzle, deg.
const LATERAL_MAX_DEG: f64 = 1.5;
/// "Pitches the nose up", deg.
const NOSE_UP_DEG: f64 = 1.0;
/// The demand stays inside the nozzle's travel, deg.
const NOZZLE_TRAVEL_DEG: f64 = 15.0;

/// All claims of case 1.
#[must_use]
pub fn claims(runs: &Runs) -> Vec<ClaimResult> {
    [claim_1a(runs), claim_1b(runs), claim_1c(runs), claim_1d(runs), claim_1e(runs)].concat()
}

/// Without fault the climb is smooth, and at first only the elevator moves.
#[must_use]
pub fn claim_1a(runs: &Runs) -> Vec<ClaimResult> {
    [smooth_climb(runs), only_the_elevator(runs)].concat()
}

/// The first half of claim 1a: without fault the climb is smooth.
#[must_use]
pub fn smooth_climb(runs: &Runs) -> Vec<ClaimResult> {
    let climb = runs.no_fault;
    let altitude = |samples| column(samples, |row| row.altitude_m);
    let settled = altitude(climb.from(SETTLED_S)).map(|h| h - REFERENCE_M);
    let drop = drop_below_running_max(altitude(climb.window(0.0, SETTLED_S)));
    let nz = max_abs(column(climb.samples(), |row| row.nz_g - 1.0));
    let smooth = Limit::AtMost(SMOOTH_M);
    vec![
        SMOOTH_CLIMB.check(
            "altitude overshoot",
            max(altitude(climb.samples())) - REFERENCE_M,
            "m",
            smooth,
        ),
        SMOOTH_CLIMB.check("distance from 6000 m from 60 s on", max_abs(settled), "m", smooth),
        SMOOTH_CLIMB.check(
            "drop below the running maximum of altitude in the first 60 s",
            drop,
            "m",
            smooth,
        ),
        SMOOTH_CLIMB.check("change of the load factor", nz, "g", Limit::AtMost(SMOOTH_G)),
    ]
}

fn only_the_elevator(runs: &Runs) -> Vec<ClaimResult> {
    let first = runs.no_fault.window(0.0, runs.case.fault_s);
    let moved =
        |of: fn(&Row) -> [f64; 2]| max_abs(first.iter().flat_map(|sample| of(&sample.row))) / DEG;
    let elevator = moved(|row| [row.left_elevator_rad, row.right_elevator_rad]);
    let aileron = moved(|row| [row.left_aileron_rad, row.right_aileron_rad]);
    let rudder = moved(|row| [row.rudder_rad, 0.0]);
    let nozzle = moved(|row| [row.nozzle_pitch_rad, row.nozzle_yaw_rad]);
    let idle = Limit::AtMost(IDLE_DEG);
    vec![
        ONLY_THE_ELEVATOR.check("largest elevator", elevator, "deg", Limit::AtLeast(MOVES_DEG)),
        ONLY_THE_ELEVATOR.check("largest aileron", aileron, "deg", idle),
        ONLY_THE_ELEVATOR.check("largest rudder", rudder, "deg", idle),
        ONLY_THE_ELEVATOR.check("largest nozzle angle", nozzle, "deg", idle),
    ]
}

/// With the PID alone the aircraft is lost.
#[must_use]
pub fn claim_1b(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.pid_only, runs.case.fault_s);
    let lost_after = run.lost_at().map_or(f64::NAN, |t| t - fault_s);
    let p = max_abs(column(run.window(fault_s + 0.5, fault_s + 4.0), |row| row.p_rad_s)) / DEG;
    let r = max_abs(column(run.window(fault_s, fault_s + 10.0), |row| row.r_rad_s)) / DEG;
    let later = fault_s + 10.0;
    let (below, sink) = match (run.at(later), runs.no_fault.at(later)) {
        (Some(pid), Some(healthy)) => {
            (healthy.row.altitude_m - pid.row.altitude_m, -pid.climb_rate_m_s)
        }
        _ => (f64::NAN, f64::NAN),
    };
    vec![
        DIVERGES.check(
            "time from the fault to the loss",
            lost_after,
            "s",
            Limit::AtMost(LOST_WITHIN_S),
        ),
        DIVERGES.check(
            "largest roll rate 0.5 to 4 s after the fault",
            p,
            "deg/s",
            Limit::AtLeast(DIVERGING_P_DEG_S),
        ),
        DIVERGES.check(
            "largest yaw rate within 10 s of the fault",
            r,
            "deg/s",
            Limit::AtLeast(DIVERGING_R_DEG_S),
        ),
        DIVERGES.check(
            "altitude below the no-fault run 10 s after the fault",
            below,
            "m",
            Limit::AtLeast(DIVERGING_M),
        ),
        DIVERGES.check(
            "sink rate 10 s after the fault",
            sink,
            "m/s",
            Limit::Above(DIVERGING_SINK_M_S),
        ),
    ]
}

/// With the compensator the flight is almost the one without fault.
#[must_use]
pub fn claim_1c(runs: &Runs) -> Vec<ClaimResult> {
    let (run, healthy) = (runs.compensated, runs.no_fault);
    let later = runs.case.fault_s + 3.0;
    let apart = |signal: fn(&Row) -> f64, from_s: f64| {
        let pairs = column(run.from(from_s), signal).zip(column(healthy.from(from_s), signal));
        max_abs(pairs.map(|(a, b)| a - b))
    };
    let phi = max_abs(column(run.samples(), |row| row.phi_rad)) / DEG;
    let end = run.samples().last().map_or(f64::NAN, |s| (s.row.altitude_m - REFERENCE_M).abs());
    let rate = |name: &str, value: f64| {
        RATES.check(
            format!("{name} apart from the no-fault run, from 3 s after the fault on"),
            value / DEG,
            "deg/s",
            Limit::AtMost(SAME_RATE_DEG_S),
        )
    };
    vec![
        estimates::not_lost(RATES, run),
        rate("roll rate", apart(|row| row.p_rad_s, later)),
        rate("pitch rate", apart(|row| row.q_rad_s, later)),
        rate("yaw rate", apart(|row| row.r_rad_s, later)),
        RATES.check("largest roll angle", phi, "deg", Limit::AtMost(ROLL_MAX_DEG)),
        ALTITUDE.check(
            "altitude apart from the no-fault run",
            apart(|row| row.altitude_m, 0.0),
            "m",
            Limit::AtMost(SAME_ALTITUDE_M),
        ),
        ALTITUDE.check("distance from 6000 m at the end", end, "m", Limit::AtMost(END_ALTITUDE_M)),
    ]
}

/// The estimates find the fault.
#[must_use]
pub fn claim_1d(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let mut results = estimates::quiet_before(ESTIMATES, runs);
    results.push(estimates::rises(ESTIMATES, run, fault_s, Axis::Roll));
    results.extend(
        Axis::ALL.map(|axis| estimates::equals(ESTIMATES, run, fault_s, axis, EQUAL_PERCENT)),
    );
    results
}

/// The signs are those that the paper states, and each redundant effector does its part.
#[must_use]
pub fn claim_1e(runs: &Runs) -> Vec<ClaimResult> {
    [signs(runs), lateral_nozzle(runs), nozzle_pitch(runs)].concat()
}

fn signs(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let mut results = estimates::fault_signs(
        SIGNS,
        run,
        fault_s + 0.5,
        &[(Axis::Roll, 1.0), (Axis::Pitch, -1.0), (Axis::Yaw, 1.0)],
    );
    let at = |t: f64, signal: fn(&Row) -> f64| {
        run.at(t).map_or(f64::NAN, |sample| signal(&sample.row)) / DEG
    };
    let mean_aileron = mean(column(run.last(10.0), |row| row.right_aileron_rad)) / DEG;
    results.extend([
        SIGNS.check(
            "compensating aileron 0.5 s after the fault",
            at(fault_s + 0.5, |row| row.ucf_aileron_rad),
            "deg",
            Limit::Above(0.0),
        ),
        SIGNS.check(
            "right aileron 0.3 s after the fault",
            at(fault_s + 0.3, |row| row.right_aileron_rad),
            "deg",
            Limit::AtLeast(ANSWER_DEG),
        ),
        SIGNS.check(
            "mean right aileron of the last 10 s",
            mean_aileron,
            "deg",
            Limit::AtMost(AILERON_MAX_DEG),
        ),
    ]);
    results
}

fn lateral_nozzle(runs: &Runs) -> Vec<ClaimResult> {
    let run = runs.compensated;
    let c_yaw = &runs.case.setup.model.effectors.c_yaw;
    // Yaw coefficients per rad: left elevator, and the aileron pair per rad of aileron.
    let elevator = c_yaw[tvc_jet::LEFT_ELEVATOR];
    let pair = c_yaw[tvc_jet::RIGHT_AILERON] - c_yaw[tvc_jet::LEFT_AILERON];
    let left = run.at(BALANCE_S).map_or(f64::NAN, |Sample { row, .. }| {
        let fault = elevator * (runs.case.jam_rad - row.cmd_left_elevator_rad);
        let aileron = pair * (row.right_aileron_rad - row.main_aileron_rad);
        (1.0 + aileron / fault).abs()
    });
    let largest = max_abs(column(run.samples(), |row| row.nozzle_yaw_rad)) / DEG;
    vec![
        LATERAL_NOZZLE.check(
            "yaw moment of fault and aileron together, over that of the fault, at 10 s",
            left,
            "-",
            Limit::AtMost(BALANCE),
        ),
        LATERAL_NOZZLE.check(
            "largest lateral nozzle angle",
            largest,
            "deg",
            Limit::AtMost(LATERAL_MAX_DEG),
        ),
    ]
}

fn nozzle_pitch(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let model = &runs.case.setup.model;
    let left = run.at(BALANCE_S).map_or(f64::NAN, |Sample { row, density_kg_m3, .. }| {
        let q = 0.5 * density_kg_m3 * row.airspeed_m_s * row.airspeed_m_s;
        let arm = q * model.geometry.wing_area_m2 * model.geometry.chord_m;
        let jam = runs.case.jam_rad - row.cmd_left_elevator_rad;
        let fault = arm * model.effectors.c_pitch[tvc_jet::LEFT_ELEVATOR] * jam;
        let nozzle = row.thrust_n * model.nozzle_arm_m() * libm::sin(row.nozzle_pitch_rad);
        (1.0 + nozzle / fault).abs()
    });
    let smallest = min(column(run.from(fault_s + 0.5), |row| row.nozzle_pitch_rad)) / DEG;
    let demand = max(column(run.from(fault_s + 1.0), |row| row.ucf_nozzle_pitch_rad)) / DEG;
    vec![
        NOZZLE_PITCH.check(
            "smallest nozzle pitch from 0.5 s after the fault on",
            smallest,
            "deg",
            Limit::AtLeast(NOSE_UP_DEG),
        ),
        NOZZLE_PITCH.check(
            "largest demanded nozzle pitch from 1 s after the fault on",
            demand,
            "deg",
            Limit::AtMost(NOZZLE_TRAVEL_DEG),
        ),
        NOZZLE_PITCH.check(
            "pitch moment of fault and nozzle together, over that of the fault, at 10 s",
            left,
            "-",
            Limit::AtMost(BALANCE),
        ),
    ]
}
