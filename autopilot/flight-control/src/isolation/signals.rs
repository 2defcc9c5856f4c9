//! What the evidence compares: the estimate without what it is while the detector sleeps, and the positions as late as it.

use icd::PerEffector;
use nalgebra::Vector3;

use super::IsolationInput;

/// Lag on estimate and positions alike, s: what is quicker than the observer is not compared.
const LAG_S: f64 = 0.05;
/// Lag behind which the estimate is compared with itself, s: about that of a compensating effector.
const AIR_LAG_S: f64 = 0.1;
/// Longest memory of the mean while asleep, samples.
const ASLEEP_SAMPLES: f64 = 500.0;

/// Mean and variance of the estimate while the detector sleeps.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Asleep {
    samples: f64,
    pub(super) mean: Vector3<f64>,
    pub(super) variance: Vector3<f64>,
}

impl Asleep {
    pub(super) fn add(&mut self, z2: &Vector3<f64>) {
        // A plain mean at first, later one that fades: a flight of minutes must not freeze it.
        self.samples = (self.samples + 1.0).min(ASLEEP_SAMPLES);
        let deviation = z2 - self.mean;
        self.mean += deviation / self.samples;
        let square = deviation.component_mul(&deviation);
        self.variance += (square - self.variance) / self.samples;
    }
}

/// The positions as late as the estimate.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Late {
    /// The two poles of the observer, and the common lag.
    pub(super) stages: [PerEffector<f64>; 3],
    pub(super) z2: Vector3<f64>,
    /// z2 behind a further lag.
    pub(super) z2_lagged: Vector3<f64>,
}

impl Late {
    /// The common lag begins here.
    pub(super) fn catch_up(&mut self, input: &IsolationInput<'_>, asleep: &Asleep) {
        self.z2 = input.z2 - asleep.mean;
        self.z2_lagged = self.z2;
        self.stages[2] = self.stages[1];
    }

    pub(super) fn step(&mut self, input: &IsolationInput<'_>, asleep: &Asleep, h: f64) {
        // Implicit, so stable with every bandwidth and period.
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
