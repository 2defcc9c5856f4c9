//! Claims 1a to 1e (climb, left elevator jammed at +30 degrees) and 2a to 2e (turn with 15 degrees of roll, rudder jammed
//! at +7 degrees).
//!
//! Each limit is the one of the claim's row in docs/paper.md.

use icd::tvc_jet;
use icd::units::{DEG, STANDARD_GRAVITY_M_S2};

use super::cases::Runs;
use super::claim::Limit::{Above, AtLeast, AtMost, Below, Exactly};
use super::claim::{Claim, ClaimResult};
use lab_judges::metrics::{
    drop_below_running_max, max, max_abs, mean, min, peak_to_peak, rms, turned,
};
use lab_judges::row::Row;
use lab_judges::trace::{Sample, Trace, column};

const fn claim(id: &'static str, text: &'static str) -> Claim {
    Claim { id, text }
}

const SMOOTH_CLIMB: Claim = claim("1a", "no fault: climb is smooth");
const ONLY_THE_ELEVATOR: Claim = claim("1a", "no fault: in the first 3 s only the elevator moves");
const DIVERGES: Claim = claim("1b", "PID only: diverges within a short period");
const RATES: Claim = claim("1c", "compensated: rates almost those without fault");
const ALTITUDE: Claim = claim("1c", "compensated: altitude almost that without fault");
const ESTIMATES_1: Claim =
    claim("1d", "estimates are nearly zero, jump at the fault, then equal it");
const SIGNS_1: Claim = claim(
    "1e",
    "the left elevator gives +roll, -pitch, +yaw; the aileron answers with -roll and -yaw",
);
const LATERAL_NOZZLE: Claim =
    claim("1e", "aileron yaw cancels the fault's yaw, so the lateral nozzle stays idle");
const NOZZLE_PITCH: Claim = claim("1e", "the nozzle pitches the nose up");
const CIRCLE: Claim = claim("2a", "no fault: altitude-holding circular flight, excellent tracking");
const UNSTABLE: Claim = claim("2b", "PID only: unstable within a short period");
const STABLE: Claim = claim("2c", "compensated: stable, roll settles around 10 deg, altitude held");
const ESTIMATES_2: Claim = claim("2d", "estimates nearly zero, jump, then equal the fault");
const SIGNS_2: Claim = claim(
    "2e",
    "rudder +7 deg gives +roll and -yaw; the compensating aileron is positive; the lateral \
     nozzle is at its limit, the vertical one idle",
);

/// Altitude reference of case 1, m.
pub const REFERENCE_M: f64 = 6_000.0;
/// Roll reference of case 2, deg.
pub const REFERENCE_DEG: f64 = 15.0;
/// Altitude that case 2 holds, m.
const HELD_M: f64 = 5_000.0;
/// The climb of case 1 has settled from this time on, s.
const CLIMBED_S: f64 = 60.0;
/// The end of a run of case 2, over which means are taken, s.
const SETTLED_S: f64 = 10.0;
/// When the balances of moments of case 1 are struck, s.
const BALANCE_S: f64 = 10.0;
/// What is left of a moment that another one cancels.
const BALANCE: f64 = 0.05;
/// The lateral nozzle of case 2 is at its limit of 15 deg from here on, deg.
pub const AT_LIMIT_DEG: f64 = 14.5;
/// When it has got there, s after the fault.
pub const AT_LIMIT_AFTER_S: f64 = 0.6;
/// "Nearly zero": fraction of the activation level.
const QUIET: f64 = 0.1;
/// "Sudden": the estimate reaches 90 % of the fault within this time, s.
const RISE_S: f64 = 0.2;
/// The jump is the largest |F| in this time after the fault, s.
pub const JUMP_S: f64 = 0.3;

/// All claims of the case.
pub fn of_case(runs: &Runs) -> Vec<ClaimResult> {
    match runs.case.number {
        1 => [claim_1a(runs), claim_1b(runs), claim_1c(runs), claim_1d(runs), claim_1e(runs)],
        _ => [claim_2a(runs), claim_2b(runs), claim_2c(runs), claim_2d(runs), claim_2e(runs)],
    }
    .concat()
}

/// The claims about how well the aircraft flies, without and with the fault: those that any controller can meet.
///
/// That the nozzle stays still in the climb is left out: it does so by design, or moves by design.
pub fn of_performance(runs: &Runs) -> Vec<ClaimResult> {
    match runs.case.number {
        1 => [smooth_climb(runs), claim_1c(runs)].concat(),
        _ => [claim_2a(runs), claim_2c(runs)].concat(),
    }
}

/// Without fault the climb is smooth, and at first only the elevator moves.
pub fn claim_1a(runs: &Runs) -> Vec<ClaimResult> {
    let first = runs.no_fault.window(0.0, runs.case.fault_s);
    let moved =
        |of: fn(&Row) -> [f64; 2]| max_abs(first.iter().flat_map(|sample| of(&sample.row))) / DEG;
    let elevator = moved(|row| [row.left_elevator_rad, row.right_elevator_rad]);
    let aileron = moved(|row| [row.left_aileron_rad, row.right_aileron_rad]);
    let nozzle = moved(|row| [row.nozzle_pitch_rad, row.nozzle_yaw_rad]);
    let only_the_elevator = ONLY_THE_ELEVATOR.check_all([
        ("largest elevator", elevator, "deg", AtLeast(1.0)),
        ("largest aileron", aileron, "deg", AtMost(0.05)),
        ("largest rudder", moved(|row| [row.rudder_rad, 0.0]), "deg", AtMost(0.05)),
        ("largest nozzle angle", nozzle, "deg", AtMost(0.05)),
    ]);
    [smooth_climb(runs), only_the_elevator].concat()
}

fn smooth_climb(runs: &Runs) -> Vec<ClaimResult> {
    let climb = runs.no_fault;
    let altitude = |samples| column(samples, |row| row.altitude_m);
    let overshoot = max(altitude(climb.samples())) - REFERENCE_M;
    let settled = max_abs(altitude(climb.from(CLIMBED_S)).map(|h| h - REFERENCE_M));
    let drop = drop_below_running_max(altitude(climb.window(0.0, CLIMBED_S)));
    let nz = max_abs(column(climb.samples(), |row| row.nz_g - 1.0));
    SMOOTH_CLIMB.check_all([
        ("altitude overshoot", overshoot, "m", AtMost(20.0)),
        ("distance from 6000 m from 60 s on", settled, "m", AtMost(20.0)),
        ("drop below the running maximum of altitude in the first 60 s", drop, "m", AtMost(20.0)),
        ("change of the load factor", nz, "g", AtMost(1.0)),
    ])
}

/// With the PID alone the aircraft is lost.
pub fn claim_1b(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.pid_only, runs.case.fault_s);
    let p = max_abs(column(run.window(fault_s + 0.5, fault_s + 4.0), |row| row.p_rad_s)) / DEG;
    let r = max_abs(column(run.window(fault_s, fault_s + 10.0), |row| row.r_rad_s)) / DEG;
    let later = fault_s + 10.0;
    let (below, sink) = match (run.at(later), runs.no_fault.at(later)) {
        (Some(pid), Some(healthy)) => {
            (healthy.row.altitude_m - pid.row.altitude_m, -pid.climb_rate_m_s)
        }
        // A flight that was over before then satisfies no limit.
        _ => (f64::NAN, f64::NAN),
    };
    DIVERGES.check_all([
        ("time from the fault to the loss", lost_after_s(runs), "s", AtMost(6.0)),
        ("largest roll rate 0.5 to 4 s after the fault", p, "deg/s", AtLeast(25.0)),
        ("largest yaw rate within 10 s of the fault", r, "deg/s", AtLeast(3.0)),
        ("altitude below the no-fault run 10 s after the fault", below, "m", AtLeast(300.0)),
        ("sink rate 10 s after the fault", sink, "m/s", Above(30.0)),
    ])
}

/// From the fault to the loss of the flight with the PID only; NaN if it is not lost.
fn lost_after_s(runs: &Runs) -> f64 {
    runs.pid_only.lost_at().map_or(f64::NAN, |t| t - runs.case.fault_s)
}

/// With the compensator the flight is almost the one without fault.
pub fn claim_1c(runs: &Runs) -> Vec<ClaimResult> {
    let (run, healthy) = (runs.compensated, runs.no_fault);
    let later = runs.case.fault_s + 3.0;
    let apart = |signal: fn(&Row) -> f64, from_s: f64| {
        let pairs = column(run.from(from_s), signal).zip(column(healthy.from(from_s), signal));
        max_abs(pairs.map(|(a, b)| a - b))
    };
    let rate = |name: &str, signal: fn(&Row) -> f64| {
        let measure = format!("{name} apart from the no-fault run, from 3 s after the fault on");
        RATES.check(measure, apart(signal, later) / DEG, "deg/s", AtMost(1.0))
    };
    let phi = max_abs(column(run.samples(), |row| row.phi_rad)) / DEG;
    let altitude = apart(|row| row.altitude_m, 0.0);
    let end = run.samples().last().map_or(f64::NAN, |s| (s.row.altitude_m - REFERENCE_M).abs());
    vec![
        not_lost(RATES, run),
        rate("roll rate", |row| row.p_rad_s),
        rate("pitch rate", |row| row.q_rad_s),
        rate("yaw rate", |row| row.r_rad_s),
        RATES.check("largest roll angle", phi, "deg", AtMost(30.0)),
        ALTITUDE.check("altitude apart from the no-fault run", altitude, "m", AtMost(40.0)),
        ALTITUDE.check("distance from 6000 m at the end", end, "m", AtMost(20.0)),
    ]
}

/// The estimates find the fault.
pub fn claim_1d(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let mut results = quiet_before(ESTIMATES_1, runs);
    results.push(rises(ESTIMATES_1, run, fault_s, Axis::Roll));
    results.extend(Axis::ALL.map(|axis| equals(ESTIMATES_1, run, fault_s, axis, 2.0)));
    results
}

/// The signs are those that the paper states, and each redundant effector does its part.
pub fn claim_1e(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let signs = [(Axis::Roll, 1.0), (Axis::Pitch, -1.0), (Axis::Yaw, 1.0)];
    let at = |t: f64, signal: fn(&Row) -> f64| {
        run.at(t).map_or(f64::NAN, |sample| signal(&sample.row)) / DEG
    };
    let aileron = at(fault_s + 0.5, |row| row.ucf_aileron_rad);
    let answer = at(fault_s + 0.3, |row| row.right_aileron_rad);
    // A margin of 5 % of the 25 deg of travel.
    let mean_aileron = mean(column(run.last(10.0), |row| row.right_aileron_rad)) / DEG;
    let effectors = SIGNS_1.check_all([
        ("compensating aileron 0.5 s after the fault", aileron, "deg", Above(0.0)),
        ("right aileron 0.3 s after the fault", answer, "deg", AtLeast(10.0)),
        ("mean right aileron of the last 10 s", mean_aileron, "deg", AtMost(23.75)),
    ]);
    [fault_signs(SIGNS_1, run, fault_s + 0.5, &signs), effectors, nozzle(runs)].concat()
}

fn nozzle(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let model = &runs.case.setup.model;
    // Yaw coefficients per rad: left elevator, and the aileron pair per rad of aileron.
    let c_yaw = &model.effectors.c_yaw;
    let pair = c_yaw[tvc_jet::RIGHT_AILERON] - c_yaw[tvc_jet::LEFT_AILERON];
    let left = run.at(BALANCE_S).map_or(f64::NAN, |Sample { row, .. }| {
        // F counts from the healthy position, so the jam counts from the command.
        let jam = runs.case.jam_rad - row.cmd_left_elevator_rad;
        let fault = c_yaw[tvc_jet::LEFT_ELEVATOR] * jam;
        let aileron = pair * (row.right_aileron_rad - row.main_aileron_rad);
        (1.0 + aileron / fault).abs()
    });
    let largest = max_abs(column(run.samples(), |row| row.nozzle_yaw_rad)) / DEG;
    let measure = "yaw moment of fault and aileron together, over that of the fault, at 10 s";
    let lateral = LATERAL_NOZZLE.check_all([
        (measure, left, "-", AtMost(BALANCE)),
        ("largest lateral nozzle angle", largest, "deg", AtMost(1.5)),
    ]);
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
    let measure = "pitch moment of fault and nozzle together, over that of the fault, at 10 s";
    let pitch = NOZZLE_PITCH.check_all([
        ("smallest nozzle pitch from 0.5 s after the fault on", smallest, "deg", AtLeast(1.0)),
        // The demand stays inside the nozzle's travel.
        ("largest demanded nozzle pitch from 1 s after the fault on", demand, "deg", AtMost(15.0)),
        (measure, left, "-", AtMost(BALANCE)),
    ]);
    [lateral, pitch].concat()
}

/// Without fault the aircraft flies a circle.
pub fn claim_2a(runs: &Runs) -> Vec<ClaimResult> {
    let run = runs.no_fault;
    let phi = |samples| column(samples, |row| row.phi_rad);
    let overshoot = max(phi(run.samples())) / DEG - REFERENCE_DEG;
    let settled = (mean(phi(run.last(SETTLED_S))) / DEG - REFERENCE_DEG).abs();
    let is_there = |s: &&Sample| s.row.phi_rad >= 0.9 * REFERENCE_DEG * DEG;
    let rise = run.samples().iter().find(is_there).map_or(f64::NAN, |s| s.row.t_s);
    let turn = 100.0 * turn_rate_error(run.last(SETTLED_S));
    let tracking = CIRCLE.check_all([
        ("roll overshoot", overshoot, "deg", AtMost(1.0)),
        ("mean roll of the last 10 s, distance from 15 deg", settled, "deg", AtMost(0.5)),
        ("time to 90 % of 15 deg", rise, "s", AtMost(3.0)),
    ]);
    let measure = "mean turn rate of the last 10 s, apart from g tan(phi) / V";
    let circular = CIRCLE.check_all([(measure, turn, "%", AtMost(15.0))]);
    [tracking, vec![altitude_held(CIRCLE, run)], circular].concat()
}

fn altitude_held(claim: Claim, run: &Trace) -> ClaimResult {
    let error = max_abs(column(run.samples(), |row| row.altitude_m - HELD_M));
    claim.check("distance from 5000 m", error, "m", AtMost(15.0))
}

/// Mean turn rate against that of a coordinated turn, as a fraction of the latter.
fn turn_rate_error(samples: &[Sample]) -> f64 {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return f64::NAN;
    };
    let rate = turned(column(samples, |row| row.psi_rad)) / (last.row.t_s - first.row.t_s);
    let phi = mean(column(samples, |row| row.phi_rad));
    let airspeed = mean(column(samples, |row| row.airspeed_m_s));
    let coordinated = STANDARD_GRAVITY_M_S2 * libm::tan(phi) / airspeed;
    (rate / coordinated - 1.0).abs()
}

/// With the PID alone the aircraft is lost.
pub fn claim_2b(runs: &Runs) -> Vec<ClaimResult> {
    let measure = "time from the fault to the loss";
    UNSTABLE.check_all([(measure, lost_after_s(runs), "s", AtMost(5.0))])
}

/// With the compensator the roll angle settles below its reference.
pub fn claim_2c(runs: &Runs) -> Vec<ClaimResult> {
    let run = runs.compensated;
    let end = column(run.last(SETTLED_S), |row| row.phi_rad / DEG);
    let (settled, span) = (mean(end.clone()), peak_to_peak(end));
    let roll = STABLE.check_all([
        ("mean roll of the last 10 s", settled, "deg", AtLeast(9.0)),
        ("mean roll of the last 10 s", settled, "deg", AtMost(11.0)),
        ("roll peak to peak over the last 10 s", span, "deg", AtMost(0.5)),
    ]);
    [vec![not_lost(STABLE, run)], roll, vec![altitude_held(STABLE, run)]].concat()
}

/// The estimates find the fault.
pub fn claim_2d(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let mut results = quiet_before(ESTIMATES_2, runs);
    for axis in [Axis::Roll, Axis::Yaw] {
        results.push(rises(ESTIMATES_2, run, fault_s, axis));
        results.push(equals(ESTIMATES_2, run, fault_s, axis, 3.0));
    }
    // The rudder has no pitch moment, so that axis is measured as it is.
    let pitch = rms(column(run.from(fault_s + 1.0), |row| Axis::Pitch.error(row)));
    let measure = "rms of z2 - F in pitch from 1 s after the fault on";
    results.push(ESTIMATES_2.check(measure, pitch, "rad/s2", AtMost(0.01)));
    results
}

/// The signs are those that the paper states; the lateral nozzle does all it can.
pub fn claim_2e(runs: &Runs) -> Vec<ClaimResult> {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let signs = [(Axis::Roll, 1.0), (Axis::Yaw, -1.0)];
    let aileron = run.samples().last().map_or(f64::NAN, |s| s.row.ucf_aileron_rad) / DEG;
    let at_limit =
        min(column(run.from(fault_s + AT_LIMIT_AFTER_S), |row| row.nozzle_yaw_rad)) / DEG;
    let demand = min(column(run.last(5.0), |row| row.ucf_nozzle_yaw_rad)) / DEG;
    let vertical = max_abs(column(run.samples(), |row| row.nozzle_pitch_rad)) / DEG;
    let lateral = "smallest lateral nozzle angle from 0.6 s after the fault on";
    let effectors = SIGNS_2.check_all([
        ("compensating aileron at the end", aileron, "deg", Above(0.0)),
        (lateral, at_limit, "deg", AtLeast(AT_LIMIT_DEG)),
        // More than the nozzle can do.
        ("smallest demanded lateral nozzle angle over the last 5 s", demand, "deg", AtLeast(16.0)),
        ("largest vertical nozzle angle", vertical, "deg", AtMost(1.0)),
    ]);
    [fault_signs(SIGNS_2, run, fault_s + 0.3, &signs), effectors].concat()
}

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
    pub const ALL: [Self; 3] = [Self::Roll, Self::Pitch, Self::Yaw];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
        }
    }

    /// z2: the estimate, rad/s².
    pub const fn estimate(self, row: &Row) -> f64 {
        match self {
            Self::Roll => row.z2_p_rad_s2,
            Self::Pitch => row.z2_q_rad_s2,
            Self::Yaw => row.z2_r_rad_s2,
        }
    }

    /// F: the truth, rad/s².
    pub const fn fault(self, row: &Row) -> f64 {
        match self {
            Self::Roll => row.fault_p_rad_s2,
            Self::Pitch => row.fault_q_rad_s2,
            Self::Yaw => row.fault_r_rad_s2,
        }
    }

    /// z2 - F, rad/s².
    pub fn error(self, row: &Row) -> f64 {
        self.estimate(row) - self.fault(row)
    }
}

/// The jump: largest |F| of an axis just after the fault, rad/s².
fn jump(run: &Trace, fault_s: f64, axis: Axis) -> f64 {
    max_abs(column(run.window(fault_s, fault_s + JUMP_S), |row| axis.fault(row)))
}

/// rms of z2 - F from one second after the fault on, as a fraction of the jump.
pub fn error_over_jump(run: &Trace, fault_s: f64, axis: Axis) -> f64 {
    rms(column(run.from(fault_s + 1.0), |row| axis.error(row))) / jump(run, fault_s, axis)
}

/// Time from the fault until the estimate first has 90 % of F, s; NaN if it never does.
///
/// F counts from half of the jump on: before the fault acts, 90 % of nothing is reached at once.
fn rise_time(run: &Trace, fault_s: f64, axis: Axis) -> f64 {
    let half = 0.5 * jump(run, fault_s, axis);
    let found = run.from(fault_s).iter().find(|sample| {
        let (fault, estimate) = (axis.fault(&sample.row), axis.estimate(&sample.row));
        fault.abs() >= half && estimate * fault.signum() >= 0.9 * fault.abs()
    });
    found.map_or(f64::NAN, |sample| sample.row.t_s - fault_s)
}

/// The aircraft is not lost.
fn not_lost(claim: Claim, run: &Trace) -> ClaimResult {
    let lost = f64::from(u8::from(run.lost_at().is_some()));
    claim.check("aircraft lost", lost, "runs", Exactly(0.0))
}

/// Before the fault the estimates are nearly zero, each axis.
fn quiet_before(claim: Claim, runs: &Runs) -> Vec<ClaimResult> {
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
            AtMost(QUIET),
        )
    };
    axes.map(quiet).to_vec()
}

/// The estimate jumps with the fault.
fn rises(claim: Claim, run: &Trace, fault_s: f64, axis: Axis) -> ClaimResult {
    let measure = format!("time until z2 in {} has 90 % of F", axis.name());
    claim.check(measure, rise_time(run, fault_s, axis), "s", AtMost(RISE_S))
}

/// The estimate then equals the fault.
fn equals(claim: Claim, run: &Trace, fault_s: f64, axis: Axis, percent: f64) -> ClaimResult {
    claim.check(
        format!("rms of z2 - F in {} from 1 s after the fault on, over the jump", axis.name()),
        100.0 * error_over_jump(run, fault_s, axis),
        "%",
        AtMost(percent),
    )
}

/// The fault accelerates each axis to the side that the paper states.
fn fault_signs(claim: Claim, run: &Trace, t_s: f64, signs: &[(Axis, f64)]) -> Vec<ClaimResult> {
    let one = |(axis, sign): &(Axis, f64)| {
        let value = run.at(t_s).map_or(f64::NAN, |sample| axis.fault(&sample.row));
        let limit = if *sign > 0.0 { Above(0.0) } else { Below(0.0) };
        claim.check(format!("F in {} just after the fault", axis.name()), value, "rad/s2", limit)
    };
    signs.iter().map(one).collect()
}
