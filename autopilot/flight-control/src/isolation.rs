//! Not in the paper: which effector it is, how it behaves, and how certain that is, from the estimate alone.
//!
//! While the detector is awake, z2 is what the healthy aircraft does not explain. Each effector that is not healthy
//! leaves its own signature in it: the direction of its column of the design model, and how z2 changes when the
//! effector is commanded to move. [`evidence`] weighs all hypotheses, of one effector and of two, with a memory of some
//! seconds; what persists above a confidence is the [`Verdict`].
//!
//! ```text
//!   z2 - mean while asleep ─> lag ─┐
//!   m: modelled positions ─> lag ──┼─> sums ─> evidence of each hypothesis ─> persistence ─> verdict
//!   B: columns of the model ───────┘                    │
//!                                                       └─ two look alike ─> test deflection
//! ```
//!
//! An effector that always moves against another one, as the two ailerons, cannot be distinguished from it by what the
//! laws command. Where the gains allow it, [`test_deflection`] moves both so that healthy ones cancel each other.
//!
//! The verdict is a report. With [`IsolationMode::Use`] the allocation `relief` takes into account which effectors no
//! hypothesis holds for faulty: see [`Known`].

use arrayvec::ArrayVec;
use icd::{ControlPeriod, Effector, PerEffector};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::design_model::{DesignModel, FlightCondition};
use crate::signals::EffectorSet;
use evidence::{Behaviour, Candidate, Candidates, Column, Sums};
use gains::{IsolationGains, IsolationMode};
use signals::{Asleep, Late};
use test_deflection::TestDeflection;

pub mod evidence;
pub mod gains;
mod signals;
pub mod test_deflection;

/// Time between two samples of the estimate, us.
const SAMPLE_US: u32 = 20_000;
/// Time between two looks at the evidence, us.
const LOOK_US: u32 = 100_000;
/// The observer needs this time after the detector has woken, us.
const SETTLES_US: u32 = 60_000;
/// How late the estimate may be in addition, s.
const LATE_S: f64 = 0.03;
/// The mean is only taken below this level: what is above may be the beginning of something.
const ASLEEP_LEVEL: f64 = 1.0;
/// By how much the errors of the sensors may shift the estimate since the detector woke, in activation levels.
const OFFSET_LEVEL: f64 = 0.3;
/// Square of an estimate, in deviations, that is no more than noise: of three axes, 99.3 % are below it.
const NOISE_SQUARE: f64 = 12.0;
/// A fault seems to end when the estimate is this part of its distance from what the fault would give, in squares.
const ENDED_SQUARE: f64 = 0.25;
/// It is over when it is also this part of what the fault would give, in squares: one that swings passes zero quickly.
const OVER_SQUARE: f64 = 0.0625;
/// An estimate that is no more than noise for this long, on balance, ends every fault, s.
const CALM_S: f64 = 1.0;
/// One that contradicts what is suspected counts so many times.
const CONTRADICTS: f64 = 5.0;
/// Nothing is looked for this long after the end of a fault, us: effector and aircraft settle.
const RESTS_US: u32 = 1_000_000;
/// An effector moves by itself when this has been the best explanation for so long, s: it explains most.
const MOVES_S: f64 = 1.0;
/// An effector is cleared while the hypotheses of other ones have this probability together.
const CLEARED: f64 = 0.98;
/// An effector is tested if it has this probability.
const TESTED: f64 = 0.05;
/// Part of the largest axis by which the model may be wrong on the others, in activation levels.
const CROSS_ERROR: f64 = 0.3;
/// A verdict is dropped below this probability: something speaks against it. A test that told two apart which look alike fades from the
/// memory, and leaves them as probable as each other.
const DROPPED_BELOW: f64 = 0.1;

/// Which effectors are not healthy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The effector; the second one where two are stuck.
    pub effectors: [Option<Effector>; 2],
    /// How they behave.
    pub behaviour: Behaviour,
    /// For each: angle or bias, rad; the part of its effect that remains; zero if it moves by itself.
    pub values: [f64; 2],
    /// Probability, given that one of the hypotheses holds.
    pub confidence: f64,
}

/// What the isolation reports of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct IsolationLog {
    /// What is found; `None` before the detector has woken, and while nothing is certain.
    pub verdict: Option<Verdict>,
    /// The most probable effectors now, with or without a verdict.
    pub likely: [Option<Effector>; 2],
    /// Their probability.
    pub probability: f64,
    /// Test deflection of the first of the two effectors under test, rad; zero without a test.
    pub test_rad: f64,
}

/// What an allocation takes for known: never that an effector cannot be used, only that one can.
///
/// Hypotheses that the estimate cannot tell apart share the probability, and what all of them leave healthy is cleared whichever
/// of them holds. What an effector does not give stands in the next estimate; giving up one that follows has lost aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    cleared: EffectorSet,
}

impl Known {
    /// The effector is healthy: something else explains the estimate.
    pub fn is_cleared(&self, effector: Effector) -> bool {
        self.cleared.contains(effector)
    }
}

/// All that one step is given.
#[derive(Debug, Clone, Copy)]
pub struct IsolationInput<'a> {
    /// The estimate, rad/s².
    pub z2: &'a Vector3<f64>,
    /// Activation levels, rad/s².
    pub levels: &'a Vector3<f64>,
    /// Largest |z2| in units of its level.
    pub level: f64,
    /// The detector is awake.
    pub active: bool,
    /// Where the observer has the effectors, rad.
    pub positions: &'a PerEffector<f64>,
    /// Bandwidth of the observer, rad/s.
    pub bandwidth: f64,
    /// The model of the healthy aircraft.
    pub model: &'a DesignModel,
    /// Dynamic pressure and arms.
    pub at: &'a FlightCondition,
}

/// The isolation with what it remembers.
#[derive(Debug, Clone)]
pub struct Isolation {
    period: ControlPeriod,
    asleep: Asleep,
    awake: Option<AwakeIsolation>,
    /// Time until the next sample while asleep, us.
    due_us: u32,
    /// The fault has ended, and no other one has begun: time for which none is looked for, us.
    rests_us: Option<u32>,
}

/// What is forgotten when the detector sleeps.
#[derive(Debug, Clone, Default)]
struct AwakeIsolation {
    late: Late,
    sums: Sums,
    /// The estimate of the sample before, rad/s².
    z2_before: Vector3<f64>,
    /// Time since the detector woke, us.
    since_us: u32,
    sample_due_us: u32,
    look_due_us: u32,
    /// How long the same effectors have been above the confidence, s.
    persists_s: f64,
    /// The effectors whose persistence is counted.
    candidate: [Option<Effector>; 2],
    /// The best hypothesis of the last look.
    best: Option<Candidate>,
    /// How long its behaviour has been the best one for these effectors, s.
    behaves_s: f64,
    /// How long the estimate has been noise, or nearer to it than to what is suspected, on balance, s.
    ended_s: f64,
    /// It is nearer to noise than to what is suspected now.
    seems_over: bool,
    /// How long each effector has been cleared without a break, s.
    clear_s: PerEffector<f64>,
    /// The effectors that have been so for long enough.
    cleared: EffectorSet,
    log: IsolationLog,
    test: TestDeflection,
}

impl Isolation {
    /// Nothing is known.
    pub fn new(period: ControlPeriod) -> Self {
        Self { period, asleep: Asleep::default(), awake: None, due_us: 0, rests_us: None }
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        *self = Self::new(self.period);
    }

    /// One control period with the estimate of this step.
    pub fn step(&mut self, input: &IsolationInput<'_>, gains: &IsolationGains) -> IsolationLog {
        let period_us = self.period.as_micros();
        if !input.active {
            (self.awake, self.rests_us) = (None, None);
            self.due_us = self.due_us.saturating_sub(period_us);
            if self.due_us == 0 {
                self.due_us = SAMPLE_US;
                if input.level < ASLEEP_LEVEL {
                    self.asleep.add(input.z2);
                }
            }
            return IsolationLog::default();
        }
        if let Some(left_us) = self.rests_us {
            // Its time over, the rest goes on until there is something to look at.
            let rests = left_us > 0 || input.level < 1.0;
            self.rests_us = rests.then(|| left_us.saturating_sub(period_us));
            return IsolationLog::default();
        }
        let asleep = self.asleep;
        let awake = self.awake.get_or_insert_with(|| AwakeIsolation::new(input, &asleep));
        awake.step(input, &asleep, gains, self.period);
        if awake.ended_s >= CALM_S {
            (self.awake, self.rests_us) = (None, Some(RESTS_US));
            return IsolationLog::default();
        }
        awake.log
    }

    /// Test deflections for this step, rad, of at most `size_rad`, which the travel leaves above `commands`; zeros
    /// without a test.
    pub fn test(
        &mut self,
        commands: &PerEffector<f64>,
        rates: &Vector3<f64>,
        model: &DesignModel,
        at: &FlightCondition,
        size_rad: f64,
    ) -> PerEffector<f64> {
        let h = self.period.as_seconds();
        match &mut self.awake {
            Some(awake) => awake.test.step(commands, rates, model, at, size_rad, h),
            None => PerEffector::default(),
        }
    }

    /// Test deflection of the first effector under test, rad; zero without a test.
    pub fn test_rad(&self) -> f64 {
        self.awake.as_ref().map_or(0.0, |awake| awake.test.now_rad())
    }

    /// What an allocation may count on.
    pub fn known(&self, mode: IsolationMode) -> Known {
        match &self.awake {
            Some(awake) if mode == IsolationMode::Use => Known { cleared: awake.cleared },
            _ => Known::default(),
        }
    }
}

impl AwakeIsolation {
    fn new(input: &IsolationInput<'_>, asleep: &Asleep) -> Self {
        let z2 = input.z2 - asleep.mean;
        let late = Late { stages: [*input.positions; 3], z2, z2_lagged: z2 };
        Self { late, look_due_us: LOOK_US, ..Self::default() }
    }

    fn step(
        &mut self,
        input: &IsolationInput<'_>,
        asleep: &Asleep,
        gains: &IsolationGains,
        period: ControlPeriod,
    ) {
        let (h, period_us) = (period.as_seconds(), period.as_micros());
        self.late.step(input, asleep, h);
        self.since_us = self.since_us.saturating_add(period_us);
        if self.since_us < SETTLES_US {
            // Until then the lag would carry along what the observer had not seen yet.
            self.late.catch_up(input, asleep);
            return;
        }
        self.sample_due_us = self.sample_due_us.saturating_sub(period_us);
        self.look_due_us = self.look_due_us.saturating_sub(period_us);
        if self.sample_due_us == 0 {
            self.sample_due_us = SAMPLE_US;
            self.sample(input, asleep, gains);
        }
        if self.look_due_us == 0 {
            self.look_due_us = LOOK_US;
            self.look(input, gains);
        }
    }

    fn sample(&mut self, input: &IsolationInput<'_>, asleep: &Asleep, gains: &IsolationGains) {
        let sample_s = f64::from(SAMPLE_US) * 1.0e-6;
        let share = sample_s / gains.correlation_s;
        let keep = libm::exp(-sample_s / gains.memory_s);
        let z2 = self.late.z2;
        let wrong = self.model_error(input, gains);
        let noise = asleep.variance + (gains.noise_level * input.levels).map(|noise| noise * noise);
        let deviation = Vector3::from_fn(|axis, _| {
            // While the estimate moves, so much of it may only be late.
            let late = LATE_S * (z2[axis] - self.z2_before[axis]) / sample_s;
            libm::sqrt(noise[axis] + wrong[axis] * wrong[axis] + late * late)
        });
        self.z2_before = z2;
        let lagged = &self.late.z2_lagged;
        let columns = self.columns(input);
        self.sums.add(&columns, &z2, lagged, &deviation, share, keep);

        let square = |z: Vector3<f64>| z.component_mul(&z).component_div(&noise).sum();
        let expected = self.best.and_then(|best| best.estimate(&columns));
        let [away, size] =
            expected.map_or([0.0; 2], |expected| [z2 - expected, expected].map(square));
        let here = square(z2);
        self.seems_over = away > NOISE_SQUARE && here < ENDED_SQUARE * away;
        let times = match self.seems_over {
            true if here < NOISE_SQUARE.max(OVER_SQUARE * size) => CONTRADICTS,
            _ if here < NOISE_SQUARE => 1.0,
            _ => -CONTRADICTS,
        };
        self.ended_s = (self.ended_s + times * sample_s).max(0.0);
    }

    /// How wrong the estimate may be on each axis because the model is, rad/s².
    fn model_error(&self, input: &IsolationInput<'_>, gains: &IsolationGains) -> Vector3<f64> {
        let z2 = self.late.z2;
        let level = z2.component_div(input.levels).amax();
        z2.abs().zip_map(input.levels, |z2, of_axis| {
            gains.model_error * (z2 + CROSS_ERROR * level * of_axis)
        })
    }

    fn columns(&self, input: &IsolationInput<'_>) -> ArrayVec<Column, { Effector::MAX }> {
        let effectors = &input.model.aircraft().effectors;
        let partner = |effector| Some(effectors.list.mirrored(effector)).filter(|e| *e != effector);
        let angles = effectors.list.all().filter(|effector| effectors.list.is_angle(*effector));
        angles
            .map(|effector| {
                let servo = &effectors.servos[effector];
                Column {
                    effector,
                    effect: input.model.effect(input.at, effector),
                    position: self.late.stages[2][effector],
                    travel: [servo.min, servo.max],
                    partner: partner(effector),
                }
            })
            .collect()
    }

    /// Probabilities from the evidence, persistence, verdict. None changes while a fault seems to end, which looks like an
    /// effector that moves by itself.
    fn look(&mut self, input: &IsolationInput<'_>, gains: &IsolationGains) {
        if self.seems_over || self.ended_s > 0.0 {
            return;
        }
        let columns = self.columns(input);
        // Never zero, because `forgiving` divides by its square.
        let wrong = self.model_error(input, gains).add_scalar(1.0e-6);
        let offset = OFFSET_LEVEL * input.levels;
        let candidates = self.sums.forgiving(&wrong, &offset, columns.len()).candidates(&columns);
        let Some((best, probability)) = most_probable(&candidates, |_| true) else { return };
        (self.log.likely, self.log.probability) = (best.effectors, probability);

        let look_s = f64::from(LOOK_US) * 1.0e-6;
        self.clear(&candidates, &columns, gains);
        let is_candidate = best.behaviour.is_some() && probability >= gains.confidence;
        self.persists_s = match is_candidate {
            true if self.candidate == best.effectors => self.persists_s + look_s,
            true => look_s,
            false => 0.0,
        };
        self.candidate = if is_candidate { best.effectors } else { [None; 2] };
        let named = |candidate: &Candidate| (candidate.effectors, candidate.behaviour);
        let behaves = self.best.as_ref().map(named) == Some(named(&best));
        self.behaves_s = if behaves { self.behaves_s + look_s } else { look_s };
        self.best = Some(best);
        let is_other = self.log.verdict.is_none_or(|verdict| verdict.effectors != best.effectors);
        // A new effector may be named whatever it does; the behaviour of a named one has to persist by itself.
        let (persists_s, needed_s) = match best.behaviour {
            Some(Behaviour::Irregular) => (self.behaves_s, MOVES_S.max(gains.persistence_s)),
            _ if is_other => (self.persists_s, gains.persistence_s),
            _ => (self.behaves_s, gains.persistence_s),
        };
        match (best.behaviour, self.log.verdict) {
            // Half a look of slack: sums of tenths are not exact.
            (Some(behaviour), _) if is_candidate && persists_s + 0.5 * look_s >= needed_s => {
                let (effectors, values) = (best.effectors, best.values);
                self.log.verdict =
                    Some(Verdict { effectors, behaviour, values, confidence: probability });
            }
            (_, Some(mut verdict)) => {
                let now = probability_of(&candidates, verdict.effectors);
                verdict.confidence = now;
                self.log.verdict = (now >= DROPPED_BELOW).then_some(verdict);
            }
            _ => {}
        }
        let fades = |verdict: Verdict| {
            verdict.effectors[1].is_none() && verdict.confidence < gains.confidence
        };
        if self.log.verdict.is_none_or(fades) {
            self.propose(&candidates);
        }
    }

    /// A test of the two most probable single effectors. Two that are stuck may be as probable, if they do the same to the estimate
    /// as one: the test contradicts them too.
    fn propose(&mut self, candidates: &Candidates) {
        let is_single = |other: &Candidate| matches!(other.effectors, [Some(_), None]);
        let Some((one, probability)) = most_probable(candidates, is_single) else { return };
        let rival =
            most_probable(candidates, |other| is_single(other) && other.effectors != one.effectors);
        if let Some((rival, _)) = rival.filter(|_| probability >= TESTED) {
            self.test.propose(one.effectors, rival.effectors, self.since_us);
        }
    }

    /// Which effectors none of the probable hypotheses needs, for long enough.
    fn clear(&mut self, candidates: &Candidates, columns: &[Column], gains: &IsolationGains) {
        let look_s = f64::from(LOOK_US) * 1.0e-6;
        for effector in columns.iter().map(|column| column.effector) {
            let without = probability(candidates, |other| {
                other.behaviour.is_some() && !other.effectors.contains(&Some(effector))
            });
            let clear_s = &mut self.clear_s[effector];
            *clear_s = if without >= CLEARED { *clear_s + look_s } else { 0.0 };
            let is_cleared = *clear_s + 0.5 * look_s >= gains.persistence_s;
            self.cleared = self.cleared.with(effector, is_cleared);
        }
    }
}

/// The best hypothesis among those whose effectors together are the most probable, and that probability.
fn most_probable(
    candidates: &Candidates,
    which: impl Fn(&Candidate) -> bool,
) -> Option<(Candidate, f64)> {
    let evidence = |candidate: &&Candidate| candidate.log_evidence;
    let best = candidates
        .iter()
        .filter(|candidate| which(candidate))
        .max_by(|a, b| evidence(a).total_cmp(&evidence(b)))?;
    Some((*best, probability_of(candidates, best.effectors)))
}

/// Probability that these effectors are the ones that are not healthy.
fn probability_of(candidates: &Candidates, effectors: [Option<Effector>; 2]) -> f64 {
    probability(candidates, |candidate| candidate.effectors == effectors)
}

/// Probability of these hypotheses together.
fn probability(candidates: &Candidates, which: impl Fn(&Candidate) -> bool) -> f64 {
    // Relative to the best one, or `exp` would make zero of all of them.
    let most = candidates.iter().fold(f64::MIN, |most, other| most.max(other.log_evidence));
    let weight = |candidate: &Candidate| libm::exp(candidate.log_evidence - most);
    let all: f64 = candidates.iter().map(weight).sum();
    let of = candidates.iter().filter(|candidate| which(candidate));
    of.map(weight).sum::<f64>() / all
}

#[cfg(test)]
mod tests;
