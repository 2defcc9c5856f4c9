//! Claims 3 and 4: of both cases together.
//!
//! Each limit is the one of the claim's row in docs/paper.md.

use super::cases::{Flown, Runs};
use super::claim::Limit::{AtLeast, AtMost, Exactly};
use super::claim::{Claim, ClaimResult};
use super::claims::{AT_LIMIT_AFTER_S, AT_LIMIT_DEG, Axis, error_over_jump};
use icd::units::DEG;
use lab_judges::metrics::{fraction, max, max_abs, mean, min};
use lab_judges::trace::{Trace, column};

const INACTIVE: Claim = Claim { id: "3", text: "without a fault the compensator is inactive" };
const NOISE: Claim = Claim { id: "4", text: "the outcomes survive noise and air" };

/// Without a fault the compensator never wakes, and arming it changes nothing, to the bit.
pub fn claim_3(flown: &Flown) -> Vec<ClaimResult> {
    let (armed, off) = (&flown.no_fault, &flown.no_fault_off);
    let case = flown.case.number;
    let demand = max_abs(armed.samples().iter().flat_map(|s| {
        let applied = &s.applied;
        [
            s.row.ucf_aileron_rad,
            s.row.ucf_nozzle_pitch_rad,
            s.row.ucf_nozzle_yaw_rad,
            applied.aileron_rad,
            applied.nozzle_pitch_rad,
            applied.nozzle_yaw_rad,
        ]
    }));
    let (active, differing) = (active_ticks(armed), differing_ticks(armed, off));
    INACTIVE.check_all([
        (&format!("case {case}: ticks with the compensator active"), active, "ticks", Exactly(0.0)),
        (&format!("case {case}: largest compensation"), demand / DEG, "deg", Exactly(0.0)),
        (
            &format!("case {case}: ticks at which armed and off differ in a bit"),
            differing,
            "ticks",
            Exactly(0.0),
        ),
    ])
}

fn active_ticks(run: &Trace) -> f64 {
    column(run.samples(), |row| row.compensator_active).sum()
}

/// Ticks that are not the same to the bit; those that only one flight has count too.
fn differing_ticks(a: &Trace, b: &Trace) -> f64 {
    let (a, b) = (a.samples(), b.samples());
    // Flights without ticks prove nothing, and NaN satisfies no limit.
    if a.is_empty() || b.is_empty() {
        return f64::NAN;
    }
    let different = a.iter().zip(b).filter(|(a, b)| !a.is_identical(b)).count();
    let unpaired = a.len().abs_diff(b.len());
    u32::try_from(different + unpaired).map_or(f64::INFINITY, f64::from)
}

/// What claim 4 measures in the three runs of one case under one seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Noisy {
    name: String,
    pub(super) no_fault_lost: bool,
    pub(super) pid_only_lost: bool,
    pub(super) compensated_lost: bool,
    pub(super) wrong_signs: bool,
    pub(super) false_alarm: bool,
    /// Part of the run without fault with the compensator active.
    pub(super) healthy_active: f64,
    /// Largest |z2| of the run without fault, over its level.
    pub(super) healthy_level: f64,
    /// Worst axis, rms of z2 - F over the jump.
    error_over_jump: f64,
    /// Case 2: mean roll of the last 10 s, rad.
    settled_rad: Option<f64>,
    /// Case 2: share of the time for which the lateral nozzle is at its limit.
    at_limit: Option<f64>,
}

impl Noisy {
    /// Of the runs of one case; `name` stands for them in the list of failures.
    pub fn new(name: String, runs: &Runs) -> Self {
        let (run, fault_s) = (runs.compensated, runs.case.fault_s);
        let is_turn = runs.case.number == 2;
        // The rudder has no pitch moment, so in case 2 there is no jump to compare with.
        let axes: &[Axis] = if is_turn { &[Axis::Roll, Axis::Yaw] } else { &Axis::ALL };
        let gains = &runs.case.setup.parameters.gains.activation;
        let level = |row: &lab_judges::row::Row| {
            (row.z2_p_rad_s2.abs() / gains.level_roll)
                .max(row.z2_q_rad_s2.abs() / gains.level_pitch)
                .max(row.z2_r_rad_s2.abs() / gains.level_yaw)
        };
        Self {
            name,
            no_fault_lost: runs.no_fault.lost_at().is_some(),
            pid_only_lost: runs.pid_only.lost_at().is_some(),
            compensated_lost: run.lost_at().is_some(),
            wrong_signs: !signs_hold(runs),
            false_alarm: active_ticks(runs.no_fault) > 0.0
                || run.before(fault_s).iter().any(|s| s.row.compensator_active > 0.0),
            healthy_active: fraction(
                column(runs.no_fault.samples(), |row| row.compensator_active),
                |active| active > 0.0,
            ),
            healthy_level: max(column(runs.no_fault.samples(), level)),
            error_over_jump: max(axes.iter().map(|axis| error_over_jump(run, fault_s, *axis))),
            settled_rad: is_turn.then(|| mean(column(run.last(10.0), |row| row.phi_rad))),
            at_limit: is_turn.then(|| {
                let angle = column(run.from(fault_s + AT_LIMIT_AFTER_S), |row| row.nozzle_yaw_rad);
                fraction(angle, |angle| angle >= AT_LIMIT_DEG * DEG)
            }),
        }
    }
}

/// The signs of claims 1e and 2e: those of the fault just after it, and the compensating aileron positive.
fn signs_hold(runs: &Runs) -> bool {
    let (run, fault_s) = (runs.compensated, runs.case.fault_s);
    let (after_s, signs) = match runs.case.number {
        1 => (0.5, [1.0, -1.0, 1.0]),
        _ => (0.3, [1.0, 0.0, -1.0]),
    };
    let aileron = match runs.case.number {
        1 => run.at(fault_s + after_s),
        _ => run.samples().last(),
    };
    let faults = run.at(fault_s + after_s).is_some_and(|sample| {
        let sides = Axis::ALL.into_iter().zip(signs);
        sides.into_iter().all(|(axis, sign)| sign == 0.0 || axis.fault(&sample.row) * sign > 0.0)
    });
    faults && aileron.is_some_and(|sample| sample.row.ucf_aileron_rad > 0.0)
}

/// The outcomes survive gyro noise and turbulence.
pub fn claim_4(flights: &[Noisy]) -> Vec<ClaimResult> {
    let which = |offends: fn(&Noisy) -> bool| -> Vec<String> {
        flights.iter().filter(|f| offends(f)).map(|f| f.name.clone()).collect()
    };
    let settled = || flights.iter().filter_map(|f| f.settled_rad).map(|phi| phi / DEG);
    let runs = vec![
        NOISE.check_none("lost without fault", which(|f| f.no_fault_lost)),
        NOISE.check_none("not lost with PID only", which(|f| !f.pid_only_lost)),
        NOISE.check_none("lost with the compensator", which(|f| f.compensated_lost)),
        NOISE.check_none("with a sign other than in 1e and 2e", which(|f| f.wrong_signs)),
        NOISE.check_none("activated without a fault", which(|f| f.false_alarm)),
    ];
    let healthy = max(flights.iter().map(|f| f.healthy_level));
    let error = 100.0 * max(flights.iter().map(|f| f.error_over_jump));
    let at_limit = 100.0 * min(flights.iter().filter_map(|f| f.at_limit));
    let error_measure = "largest rms of z2 - F from 1 s after the fault on, over the jump";
    let limit_measure = "case 2: smallest share of the time with the lateral nozzle at its limit";
    let values = NOISE.check_all([
        ("largest healthy z2, over its level", healthy, "-", AtMost(0.9)),
        ("case 2: smallest mean roll of the last 10 s", min(settled()), "deg", AtLeast(7.5)),
        ("case 2: largest mean roll of the last 10 s", max(settled()), "deg", AtMost(12.5)),
        (error_measure, error, "%", AtMost(22.0)),
        (limit_measure, at_limit, "%", AtLeast(95.0)),
    ]);
    [runs, values].concat()
}
