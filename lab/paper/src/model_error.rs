//! Claim 5: the outcomes under model error, and how they thin out as it grows.
//!
//! The aircraft is changed, the controller is not: model, gains and trim stay nominal. The aircraft starts in
//! its own steady flight.

use plant_sim::Airframe;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::cases::{Case, Run};
use super::claim::{Claim, ClaimResult, Limit};
use host_io::problem::{At as _, Problem, problem};
use icd::units::DEG;
use lab_judges::closed_loop;
use lab_judges::metrics::{max, min, wilson_95};
use lab_report::runner;

const MODEL_ERROR: Claim = Claim { id: "5", text: "and model error, controller unchanged" };

/// Factors on one derivative at a time.
const FACTORS: [f64; 2] = [0.9, 1.1];
/// Joint draws of the claim.
pub const CLAIM_DRAWS: u64 = 100;
/// Half width of the joint draws of the claim.
pub const CLAIM_WIDTH: f64 = 0.05;
/// Half widths of the survival curve.
const WIDTHS: [f64; 5] = [CLAIM_WIDTH, 0.10, 0.15, 0.20, 0.30];
/// Draws of each point of the survival curve: enough for an interval of ±7 %.
const CURVE_DRAWS: u64 = 200;
/// Settled roll of case 2, deg.
const SETTLED_DEG: (f64, f64) = (7.0, 13.0);
/// The end of a run, over which the roll angle is averaged, s.
const SETTLED_S: f64 = 10.0;

#[derive(Debug, Clone)]
struct ChangedAircraft {
    name: String,
    airframe: Airframe,
    kind: ChangeKind,
}

/// Where a changed aircraft belongs.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ChangeKind {
    Single,
    /// All of them; the flag says whether the draw counts for the claim.
    Joint {
        half_width: f64,
        of_claim: bool,
    },
}

/// One run with one aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ChangeVerdict {
    lost: bool,
    activated: bool,
    /// Mean roll at the end, rad.
    settled_rad: f64,
}

/// All runs of one case with one aircraft.
#[derive(Debug, Clone)]
struct Judged {
    name: String,
    kind: ChangeKind,
    case: u32,
    /// Not flown for the draws that only the curve needs.
    no_fault: Option<ChangeVerdict>,
    pid_only: ChangeVerdict,
    compensated: ChangeVerdict,
}

/// Survivors among the joint draws of one half width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurvivalPoint {
    /// 1 or 2.
    pub case: u32,
    /// Half width of the uniform factors on every derivative, as a fraction.
    pub half_width: f64,
    pub draws: u32,
    /// Aircraft that survived with the compensator.
    pub compensated: u32,
    /// Aircraft that survived with the PID alone.
    pub pid_only: u32,
}

impl SurvivalPoint {
    /// Share that survived with the compensator, with its 95 % interval.
    pub fn compensated_share(&self) -> (f64, (f64, f64)) {
        share(self.compensated, self.draws)
    }

    /// Share that survived with the PID alone, with its 95 % interval.
    pub fn pid_only_share(&self) -> (f64, (f64, f64)) {
        share(self.pid_only, self.draws)
    }
}

fn share(hits: u32, of: u32) -> (f64, (f64, f64)) {
    (f64::from(hits) / f64::from(of), wilson_95(hits, of))
}

/// What the campaign found.
#[derive(Debug, Clone)]
pub struct ModelError {
    /// Claim 5.
    pub claims: Vec<ClaimResult>,
    /// The survival curve, case by case, width by width.
    pub survival: Vec<SurvivalPoint>,
}

/// How much of the campaign is flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Every how many of the changes of a single derivative.
    single_stride: usize,
    /// Half widths of the joint draws.
    widths: &'static [f64],
    /// Joint draws of each half width.
    draws: u64,
}

impl Extent {
    /// What the claim asks for, and the survival curve.
    pub const FULL: Self = Self { single_stride: 1, widths: &WIDTHS, draws: CURVE_DRAWS };
    /// A few aircraft of each kind, for a quick look.
    pub const SAMPLE: Self = Self { single_stride: 5, widths: &[CLAIM_WIDTH], draws: 6 };
}

/// Flies the campaign on all cores.
pub fn campaign(cases: &[Case; 2], seed: u64, extent: &Extent) -> Result<ModelError, Problem> {
    let mut jobs = Vec::new();
    for case in cases {
        let changed = aircraft(&case.setup.plant.airframe, seed, extent)?;
        jobs.extend(changed.into_iter().map(|changed| (case, changed)));
    }
    let judged = runner::map("claim 5, model error", &jobs, |(case, changed)| judge(case, changed));
    let judged: Vec<Judged> = judged.into_iter().collect::<Result<_, _>>()?;
    Ok(ModelError { claims: claim_5(&judged), survival: survival(&judged) })
}

/// The aircraft of the claim and of the curve.
fn aircraft(
    nominal: &Airframe,
    seed: u64,
    extent: &Extent,
) -> Result<Vec<ChangedAircraft>, Problem> {
    let mut all = Vec::new();
    let singles = DERIVATIVES.into_iter().flat_map(|name| FACTORS.map(|factor| (name, factor)));
    for (name, factor) in singles.step_by(extent.single_stride) {
        let airframe = single(nominal, name, factor)?;
        all.push(ChangedAircraft {
            name: format!("{name} at {factor}"),
            airframe,
            kind: ChangeKind::Single,
        });
    }
    for half_width in extent.widths {
        for draw in 0..extent.draws {
            let airframe = joint(nominal, *half_width, seed, draw)?;
            // They are the first draws of the curve, so they are flown once for both.
            let of_claim = *half_width == CLAIM_WIDTH && draw < CLAIM_DRAWS;
            let name = format!("draw {draw} at {:.0} %", 100.0 * half_width);
            let kind = ChangeKind::Joint { half_width: *half_width, of_claim };
            all.push(ChangedAircraft { name, airframe, kind });
        }
    }
    Ok(all)
}

fn judge(case: &Case, changed: &ChangedAircraft) -> Result<Judged, Problem> {
    let case = case.with_airframe(changed.airframe.clone());
    let fly =
        |run: Run| verdict(&case, run).at(format_args!("case {}, {}", case.number, changed.name));
    let of_claim =
        matches!(changed.kind, ChangeKind::Single | ChangeKind::Joint { of_claim: true, .. });
    Ok(Judged {
        name: format!("case {}, {}", case.number, changed.name),
        kind: changed.kind,
        case: case.number,
        no_fault: of_claim.then(|| fly(Run::NoFault)).transpose()?,
        pid_only: fly(Run::PidOnly)?,
        compensated: fly(Run::Compensated)?,
    })
}

/// Flies one run and keeps only the verdict: thousands of traces would fill the memory.
fn verdict(case: &Case, run: Run) -> Result<ChangeVerdict, Problem> {
    let settled_from_s = case.duration_s() - SETTLED_S;
    let (mut lost, mut activated, mut sum, mut count) = (false, false, 0.0, 0.0);
    let limits = case.setup.plant.airframe.limits;
    closed_loop::fly(&case.run(run), &mut |record| {
        let truth = &record.truth;
        lost |= limits.are_exceeded(&truth.into());
        activated |= record.log.compensator_active;
        if truth.time.as_seconds() >= settled_from_s {
            sum += truth.euler().phi;
            count += 1.0;
        }
    })?;
    // Of a flight that ended before then this is NaN, which satisfies no limit.
    Ok(ChangeVerdict { lost, activated, settled_rad: sum / count })
}

fn claim_5(judged: &[Judged]) -> Vec<ClaimResult> {
    let single: Vec<&Judged> = judged.iter().filter(|j| j.kind == ChangeKind::Single).collect();
    let of_claim = |j: &&Judged| matches!(j.kind, ChangeKind::Joint { of_claim: true, .. });
    let joint: Vec<&Judged> = judged.iter().filter(of_claim).collect();
    [claim_5_of("one derivative at 0.9 or 1.1", &single), claim_5_of("joint draw at 5 %", &joint)]
        .concat()
}

fn claim_5_of(what: &str, judged: &[&Judged]) -> Vec<ClaimResult> {
    let which = |offends: fn(&Judged) -> bool| -> Vec<String> {
        judged.iter().filter(|j| offends(j)).map(|j| j.name.clone()).collect()
    };
    let settled = || {
        let turns = judged.iter().filter(|j| j.case == 2);
        turns.map(|j| j.compensated.settled_rad / DEG)
    };
    let (low, high) = SETTLED_DEG;
    vec![
        MODEL_ERROR.check_none(
            format!("{what}: lost with the compensator"),
            which(|j| j.compensated.lost),
        ),
        MODEL_ERROR
            .check_none(format!("{what}: not lost with PID only"), which(|j| !j.pid_only.lost)),
        MODEL_ERROR.check_none(
            format!("{what}: activated without a fault"),
            // A flight that is missing proves nothing, so it counts.
            which(|j| j.no_fault.is_none_or(|verdict| verdict.activated)),
        ),
        MODEL_ERROR.check(
            format!("{what}, case 2: smallest mean roll of the last 10 s"),
            min(settled()),
            "deg",
            Limit::AtLeast(low),
        ),
        MODEL_ERROR.check(
            format!("{what}, case 2: largest mean roll of the last 10 s"),
            max(settled()),
            "deg",
            Limit::AtMost(high),
        ),
    ]
}

fn survival(judged: &[Judged]) -> Vec<SurvivalPoint> {
    let mut points: Vec<SurvivalPoint> = Vec::new();
    for j in judged {
        let ChangeKind::Joint { half_width, .. } = j.kind else { continue };
        // Both come from one list, and are equal to the bit.
        let same = |p: &&mut SurvivalPoint| p.case == j.case && p.half_width == half_width;
        let survived = |verdict: &ChangeVerdict| u32::from(!verdict.lost);
        let (compensated, pid_only) = (survived(&j.compensated), survived(&j.pid_only));
        match points.iter_mut().find(same) {
            Some(point) => {
                point.draws += 1;
                point.compensated += compensated;
                point.pid_only += pid_only;
            }
            None => points.push(SurvivalPoint {
                case: j.case,
                half_width,
                draws: 1,
                compensated,
                pid_only,
            }),
        }
    }
    points
}

/// The aerodynamic derivatives that are dispersed, by their letters (docs/paper.md).
pub const DERIVATIVES: [&str; 28] = [
    "CLa", "CLq", "CLde", "CD0", "kCD", "CDb", "CDde", "CDda", "CDdr", "CYb", "CYr", "CYdr", "Clb",
    "Clp", "Clr", "Clde", "Clda", "Cldr", "Cm0", "Cma", "Cmq", "Cmde", "Cnb", "Cnp", "Cnr",
    "rCnde", "rCnda", "Cndr",
];

/// The aircraft with one derivative multiplied by `factor`.
pub fn single(nominal: &Airframe, name: &str, factor: f64) -> Result<Airframe, Problem> {
    let mut airframe = nominal.clone();
    scale(&mut airframe, name, factor)?;
    Ok(airframe)
}

/// Draw number `draw`: every derivative multiplied by its own factor, uniform in 1 ± `half_width`.
///
/// Draws of the same number but another width have the same directions, so that curves over the width
/// compare like with like.
pub fn joint(
    nominal: &Airframe,
    half_width: f64,
    seed: u64,
    draw: u64,
) -> Result<Airframe, Problem> {
    // Another text would be other aircraft in the figures of the claim.
    let mut key = *b"........--------two-step sitl--1";
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&draw.to_le_bytes());
    let mut generator = ChaCha8Rng::from_seed(key);
    let mut airframe = nominal.clone();
    // In this order, or every draw would be another aircraft.
    for name in DERIVATIVES {
        let direction = 2.0 * uniform(&mut generator) - 1.0;
        scale(&mut airframe, name, 1.0 + half_width * direction)?;
    }
    Ok(airframe)
}

fn scale(airframe: &mut Airframe, name: &str, factor: f64) -> Result<(), Problem> {
    if airframe.change_derivative(name, |value| *value *= factor) {
        Ok(())
    } else {
        Err(problem!("the airframe has no derivative {name}"))
    }
}

/// Uniform in [0, 1) with 53 bits.
// 53 bits fit a f64 exactly.
fn uniform(generator: &mut ChaCha8Rng) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    (generator.next_u64() >> 11) as f64 * STEP
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_sim::ReadAirframe as _;

    const GOOD: ChangeVerdict =
        ChangeVerdict { lost: false, activated: false, settled_rad: 10.0 * DEG };

    fn judged(kind: ChangeKind, compensated_lost: bool, pid_lost: bool) -> Judged {
        Judged {
            name: "draw".to_owned(),
            kind,
            case: 2,
            no_fault: Some(GOOD),
            pid_only: ChangeVerdict { lost: pid_lost, activated: true, ..GOOD },
            compensated: ChangeVerdict { lost: compensated_lost, activated: true, ..GOOD },
        }
    }

    fn joint_draw(half_width: f64) -> ChangeKind {
        ChangeKind::Joint { half_width, of_claim: true }
    }

    #[test]
    fn the_claim_fails_for_each_thing_that_must_not_happen() {
        let good = judged(ChangeKind::Single, false, true);
        let passes = |j: Judged| claim_5_of("", &[&j]).iter().map(|r| r.pass).collect::<Vec<_>>();
        assert_eq!(passes(good.clone()), [true; 5]);
        assert!(!passes(judged(ChangeKind::Single, true, true))[0]);
        assert!(!passes(judged(ChangeKind::Single, false, false))[1]);
        let woken =
            Judged { no_fault: Some(ChangeVerdict { activated: true, ..GOOD }), ..good.clone() };
        assert!(!passes(woken)[2]);
        let flat = ChangeVerdict { settled_rad: 6.9 * DEG, ..GOOD };
        assert!(!passes(Judged { compensated: flat, ..good.clone() })[3]);
        let steep = ChangeVerdict { settled_rad: 13.1 * DEG, ..GOOD };
        assert!(!passes(Judged { compensated: steep, ..good })[4]);
    }

    #[test]
    fn survivors_are_counted_by_case_and_width() {
        let all = [
            judged(joint_draw(0.05), false, true),
            judged(joint_draw(0.05), true, true),
            judged(joint_draw(0.20), true, false),
            judged(ChangeKind::Single, true, true),
        ];
        let points = survival(&all);
        assert_eq!(points.len(), 2);
        assert_eq!((points[0].draws, points[0].compensated, points[0].pid_only), (2, 1, 0));
        assert_eq!((points[1].draws, points[1].compensated, points[1].pid_only), (1, 0, 1));
    }

    #[test]
    fn the_campaign_has_the_size_that_the_claim_asks_for() {
        let nominal = Airframe::from_toml("tvc_jet.toml", aircraft::DEFAULT_AIRFRAME).unwrap();
        let all = aircraft(&nominal, 1, &Extent::FULL).unwrap();
        let singles = all.iter().filter(|c| c.kind == ChangeKind::Single).count();
        let of_claim = all
            .iter()
            .filter(|c| matches!(c.kind, ChangeKind::Joint { of_claim: true, .. }))
            .count();
        assert_eq!((singles, of_claim, all.len()), (56, 100, 56 + 5 * 200));
    }

    fn nominal() -> Airframe {
        Airframe::from_toml("tvc_jet.toml", aircraft::DEFAULT_AIRFRAME).unwrap()
    }

    fn factors(airframe: &Airframe) -> Vec<f64> {
        let nominal = nominal();
        let factor =
            |name: &&str| airframe.derivative(name).unwrap() / nominal.derivative(name).unwrap();
        DERIVATIVES.iter().map(factor).collect()
    }

    #[test]
    fn a_single_dispersion_changes_one_derivative_and_nothing_else() {
        for (index, name) in DERIVATIVES.iter().enumerate() {
            let airframe = single(&nominal(), name, 1.1).unwrap();
            for (other, factor) in factors(&airframe).into_iter().enumerate() {
                let expected = if other == index { 1.1 } else { 1.0 };
                assert!((factor - expected).abs() < 1.0e-12, "{name}: {other} {factor}");
            }
        }
    }

    #[test]
    fn a_derivative_that_does_not_exist_is_refused_by_name() {
        let error = single(&nominal(), "Cxyz", 1.1).unwrap_err();
        assert_eq!(error.to_string(), "the airframe has no derivative Cxyz");
    }

    #[test]
    fn joint_draws_fill_the_interval_and_keep_their_direction_at_another_width() {
        let mut all = Vec::new();
        for draw in 0..100 {
            let narrow = factors(&joint(&nominal(), 0.05, 1, draw).unwrap());
            let wide = factors(&joint(&nominal(), 0.20, 1, draw).unwrap());
            for (narrow, wide) in narrow.iter().zip(&wide) {
                // Four times the width, to rounding.
                assert!(((wide - 1.0) - 4.0 * (narrow - 1.0)).abs() < 1.0e-12, "{narrow} {wide}");
            }
            all.extend(narrow);
        }
        let (low, high) = all.iter().fold((2.0_f64, 0.0_f64), |(l, h), f| (l.min(*f), h.max(*f)));
        // 2800 uniform draws leave less than 0.1 % of the interval empty at its ends.
        assert!((0.95..0.9502).contains(&low) && (1.0498..1.05).contains(&high), "{low} {high}");
        let mean = all.iter().sum::<f64>() / 2_800.0;
        // Standard error of the mean: 0.05 / sqrt(3 * 2800) = 0.00055; five of them.
        assert!((mean - 1.0).abs() < 0.0028, "{mean}");
    }

    #[test]
    fn a_draw_is_the_same_whenever_it_is_made_and_differs_with_seed_and_number() {
        let draw = |seed, draw| factors(&joint(&nominal(), 0.1, seed, draw).unwrap());
        assert_eq!(draw(3, 7), draw(3, 7));
        assert_ne!(draw(3, 7), draw(3, 8));
        assert_ne!(draw(3, 7), draw(4, 7));
    }
}
