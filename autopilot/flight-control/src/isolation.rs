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
//! The verdict is a report. With [`IsolationMode::Use`] the allocations take it into account: see [`Known`].

use arrayvec::ArrayVec;
use icd::{ControlPeriod, Effector, PerEffector};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::aircraft_model::EffectorModel;
use crate::design_model::{DesignModel, FlightCondition};
use evidence::{Behaviour, Candidate, Candidates, Column, Sums};
use gains::{IsolationGains, IsolationMode};
use test_deflection::TestDeflection;

pub mod evidence;
pub mod gains;
pub mod test_deflection;

/// Time between two samples of the estimate, us.
const SAMPLE_US: u32 = 20_000;
/// Time between two looks at the evidence, us.
const LOOK_US: u32 = 100_000;
/// The observer needs this time after the detector has woken, us.
const SETTLES_US: u32 = 60_000;
/// Lag on estimate and positions alike, s: what is quicker than the observer is not compared.
const LAG_S: f64 = 0.05;
/// How late the estimate may be in addition, s.
const LATE_S: f64 = 0.03;
/// Lag behind which the estimate is compared with itself, s: about that of a compensating effector.
const AIR_LAG_S: f64 = 0.1;
/// Longest memory of the mean while asleep, samples.
const ASLEEP_SAMPLES: f64 = 500.0;
/// The mean is only taken below this level: what is above may be the beginning of something.
const ASLEEP_LEVEL: f64 = 0.5;
/// Part of the largest axis by which the model may be wrong on the others, in activation levels.
const CROSS_ERROR: f64 = 0.3;
/// An effector with a smaller part of its effect is taken for one that does not follow.
const EFFECT_MIN: f64 = 0.1;
/// A verdict is dropped below this probability.
const DROPPED_BELOW: f64 = 0.5;

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

/// What an allocation takes for known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Part of its effect that each effector has. One with zero does not follow: what it gives stands in the estimate,
    /// and it keeps the command of the main controller. One with less than one is used less.
    pub effect: PerEffector<f64>,
    /// An effector is named, so the others are taken for healthy.
    pub any: bool,
}

impl Known {
    /// All effectors are healthy, as far as is known.
    #[must_use]
    pub fn nothing() -> Self {
        Self { effect: PerEffector::from_fn(|_| 1.0), any: false }
    }

    /// The effector does not follow its commands.
    #[must_use]
    pub fn is_fixed(&self, effector: Effector) -> bool {
        self.effect[effector] < EFFECT_MIN
    }

    /// The effector is healthy: another one has been named.
    #[must_use]
    pub fn is_cleared(&self, effector: Effector) -> bool {
        self.any && self.effect[effector] >= 1.0
    }

    /// By how much more its deflection costs in an allocation.
    #[must_use]
    pub fn cost(&self, effector: Effector) -> f64 {
        1.0 / self.effect[effector].max(EFFECT_MIN)
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

/// Mean and variance of the estimate while the detector sleeps.
#[derive(Debug, Clone, Copy, Default)]
struct Asleep {
    samples: f64,
    mean: Vector3<f64>,
    variance: Vector3<f64>,
}

impl Asleep {
    fn add(&mut self, z2: &Vector3<f64>) {
        self.samples = (self.samples + 1.0).min(ASLEEP_SAMPLES);
        let deviation = z2 - self.mean;
        self.mean += deviation / self.samples;
        let square = deviation.component_mul(&deviation);
        self.variance += (square - self.variance) / self.samples;
    }
}

/// The positions as late as the estimate.
#[derive(Debug, Clone, Copy, Default)]
struct Late {
    /// The two poles of the observer, and the common lag.
    stages: [PerEffector<f64>; 3],
    z2: Vector3<f64>,
    /// z2 behind a further lag.
    z2_lagged: Vector3<f64>,
}

/// The isolation with what it remembers.
#[derive(Debug, Clone)]
pub struct Isolation {
    period: ControlPeriod,
    asleep: Asleep,
    awake: Option<Awake>,
    /// Time until the next sample while asleep, us.
    due_us: u32,
}

/// What is forgotten when the detector sleeps.
#[derive(Debug, Clone)]
struct Awake {
    late: Late,
    sums: Sums,
    /// The estimate of the sample before, rad/s².
    z2_before: Vector3<f64>,
    /// Time since the detector woke, us; counted up to a minute.
    since_us: u32,
    sample_due_us: u32,
    look_due_us: u32,
    /// How long the same effectors have been above the confidence, s.
    persists_s: f64,
    /// The effectors whose persistence is counted.
    candidate: [Option<Effector>; 2],
    log: IsolationLog,
    test: TestDeflection,
}

impl Isolation {
    /// Nothing is known.
    #[must_use]
    pub fn new(period: ControlPeriod) -> Self {
        Self { period, asleep: Asleep::default(), awake: None, due_us: 0 }
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        *self = Self::new(self.period);
    }

    /// One control period with the estimate of this step.
    pub fn step(&mut self, input: &IsolationInput<'_>, gains: &IsolationGains) -> IsolationLog {
        let period_us = self.period.as_micros();
        if !input.active {
            self.awake = None;
            self.due_us = self.due_us.saturating_sub(period_us);
            if self.due_us == 0 {
                self.due_us = SAMPLE_US;
                if input.level < ASLEEP_LEVEL {
                    self.asleep.add(input.z2);
                }
            }
            return IsolationLog::default();
        }
        let asleep = self.asleep;
        let awake = self.awake.get_or_insert_with(|| Awake::new(input, &asleep));
        awake.step(input, &asleep, gains, self.period);
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
    #[must_use]
    pub fn test_rad(&self) -> f64 {
        self.awake.as_ref().map_or(0.0, |awake| awake.test.now_rad())
    }

    /// What the allocations may count on: of an effector that is stuck, moves by itself, or has a part of its effect.
    #[must_use]
    pub fn known(&self, mode: IsolationMode) -> Known {
        let mut known = Known::nothing();
        let verdict = self.awake.as_ref().and_then(|awake| awake.log.verdict);
        let Some(verdict) = verdict.filter(|_| mode == IsolationMode::Use) else { return known };
        for (effector, value) in verdict.effectors.into_iter().zip(verdict.values) {
            let Some(effector) = effector else { continue };
            known.any = true;
            known.effect[effector] = match verdict.behaviour {
                Behaviour::Stuck | Behaviour::Irregular => 0.0,
                Behaviour::Reduced => value.clamp(0.0, 1.0),
                Behaviour::Biased => 1.0,
            };
        }
        known
    }
}

impl Awake {
    fn new(input: &IsolationInput<'_>, asleep: &Asleep) -> Self {
        let z2 = input.z2 - asleep.mean;
        let late = Late { stages: [*input.positions; 3], z2, z2_lagged: z2 };
        Self {
            late,
            sums: Sums::default(),
            z2_before: Vector3::zeros(),
            since_us: 0,
            sample_due_us: 0,
            look_due_us: LOOK_US,
            persists_s: 0.0,
            candidate: [None; 2],
            log: IsolationLog::default(),
            test: TestDeflection::default(),
        }
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
        let deviation = Vector3::from_fn(|axis, _| {
            let noise = gains.noise_level * input.levels[axis];
            let late = LATE_S * (z2[axis] - self.z2_before[axis]) / sample_s;
            let square = noise * noise + wrong[axis] * wrong[axis] + late * late;
            libm::sqrt(asleep.variance[axis] + square)
        });
        self.z2_before = z2;
        let lagged = &self.late.z2_lagged;
        self.sums.add(&self.columns(input), &z2, lagged, &deviation, share, keep);
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
        let angles = effectors.list.all().filter(|effector| effectors.list.is_angle(*effector));
        angles
            .map(|effector| {
                let servo = &effectors.servos[effector];
                Column {
                    effector,
                    effect: input.model.effect(input.at, effector),
                    position: self.late.stages[2][effector],
                    travel: [servo.min, servo.max],
                    partner: partner(effectors, effector),
                }
            })
            .collect()
    }

    /// Probabilities from the evidence, persistence, verdict.
    fn look(&mut self, input: &IsolationInput<'_>, gains: &IsolationGains) {
        let columns = self.columns(input);
        let wrong = self.model_error(input, gains).add_scalar(1.0e-6);
        let candidates = self.sums.forgiving(&wrong, columns.len()).candidates(&columns);
        let Some((best, probability)) = most_probable(&candidates, |_| true) else { return };
        let rival = most_probable(&candidates, |other| other.effectors != best.effectors);
        (self.log.likely, self.log.probability) = (best.effectors, probability);

        let look_s = f64::from(LOOK_US) * 1.0e-6;
        let is_candidate = best.behaviour.is_some() && probability >= gains.confidence;
        self.persists_s = match is_candidate {
            true if self.candidate == best.effectors => self.persists_s + look_s,
            true => look_s,
            false => 0.0,
        };
        self.candidate = if is_candidate { best.effectors } else { [None; 2] };
        match (best.behaviour, self.log.verdict) {
            // Half a look of slack: sums of tenths are not exact.
            (Some(behaviour), _)
                if is_candidate && self.persists_s + 0.5 * look_s >= gains.persistence_s =>
            {
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
        if let Some((rival, _)) = rival.filter(|_| self.log.verdict.is_none()) {
            self.test.propose(best.effectors, rival.effectors, self.since_us);
        }
    }
}

impl Late {
    /// The common lag begins here.
    fn catch_up(&mut self, input: &IsolationInput<'_>, asleep: &Asleep) {
        self.z2 = input.z2 - asleep.mean;
        self.z2_lagged = self.z2;
        self.stages[2] = self.stages[1];
    }

    fn step(&mut self, input: &IsolationInput<'_>, asleep: &Asleep, h: f64) {
        let observer = h / (h + 1.0 / input.bandwidth);
        let lag = h / (h + LAG_S);
        self.z2 += (input.z2 - asleep.mean - self.z2) * lag;
        self.z2_lagged += (self.z2 - self.z2_lagged) * (h / (h + AIR_LAG_S));
        let list = &input.model.aircraft().effectors.list;
        for effector in list.all() {
            let mut before = input.positions[effector];
            for (stage, part) in self.stages.iter_mut().zip([observer, observer, lag]) {
                stage[effector] += (before - stage[effector]) * part;
                before = stage[effector];
            }
        }
    }
}

/// The effector on the other side, and whether a command moves it the same way (1) or the other way (-1).
fn partner(effectors: &EffectorModel, effector: Effector) -> Option<(Effector, f64)> {
    let other = effectors.list.mirrored(effector);
    let (one, two) = (&effectors.gains[effector], &effectors.gains[other]);
    let product = one.roll * two.roll + one.pitch * two.pitch + one.yaw * two.yaw;
    (other != effector).then_some((other, if product < 0.0 { -1.0 } else { 1.0 }))
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
    let most = candidates.iter().fold(f64::MIN, |most, other| most.max(other.log_evidence));
    let weight = |candidate: &Candidate| libm::exp(candidate.log_evidence - most);
    let all: f64 = candidates.iter().map(weight).sum();
    let of = candidates.iter().filter(|candidate| candidate.effectors == effectors);
    of.map(weight).sum::<f64>() / all
}

#[cfg(test)]
mod tests;
