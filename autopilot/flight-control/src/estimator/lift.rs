//! What the wing says of the flow: the specific force is its lift, which follows from airspeed and angle of attack.

use icd::SimTime;

use super::covariance::{FORCE_BIAS, LIFT};
use super::{Estimator, SourceHealth, air};

/// The mean over this time is compared, µs: what the model leaves out changes faster.
const EVERY_US: u64 = 500_000;
/// Error of such a mean as a part of the lift: engine, elevators and the like.
const ERROR: f64 = 0.02;
/// Part of the gusts, rms, that the wing has not answered to yet, or averages over its span.
const UNSTEADY: f64 = 0.1;

/// Sum of what the wing carried beyond what it should have, as a part of it, since the last comparison.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    due: SimTime,
    sum: f64,
    count: u32,
}

impl Mean {
    /// Before the first look.
    pub(super) const NONE: Self = Self { due: SimTime::ZERO, sum: 0.0, count: 0 };

    const fn after(now: SimTime) -> Self {
        Self { due: SimTime::from_micros(now.as_micros() + EVERY_US), ..Self::NONE }
    }
}

impl Estimator {
    /// While a pitot tube or the vanes are missing: compares the specific force along the body's z axis with the lift of the design model.
    pub(super) fn compare_lift(&mut self, now: SimTime) {
        let sources = &self.sources;
        let is_used = |source: &super::Source| source.health(now) == SourceHealth::Used;
        let (Some(present), Some(ground)) = (self.present(), &self.ground) else { return };
        let [.., altitude] = ground.place.coordinates(&self.estimate.position);
        let inertial = self.inertial();
        let wing = self.air.lift(&present.through_air, inertial.rate.y, altitude);
        let Some(wing) = wing.filter(|_| !(is_used(&sources.pitot) && is_used(&sources.vanes)))
        else {
            self.lift = Mean::after(now);
            return;
        };
        self.lift.sum += -inertial.force.z / wing.value - 1.0;
        self.lift.count += 1;
        if now < self.lift.due {
            return;
        }
        let innovation = self.lift.sum / f64::from(self.lift.count);
        self.lift = Mean::after(now);
        let Some(row) = self.row_along(&present, &(wing.gradient / wing.value)) else { return };
        let row = row.with(FORCE_BIAS + 2, -1.0 / wing.value).with(LIFT, 1.0);
        let per_gust = air::angle_of_attack(&present.through_air)
            .map_or(0.0, |angle| angle.gradient.norm() * wing.per_angle);
        // Without vanes the mean knows nothing of how a gust has changed since.
        let changed = match is_used(&self.sources.vanes) {
            true => 0.0,
            false => EVERY_US as f64 * 1.0e-6 / (3.0 * self.gust_s()),
        };
        let unsteady = per_gust * per_gust * (UNSTEADY * UNSTEADY + changed);
        let noise = ERROR * ERROR + unsteady * self.gusts.square();
        let comparison = self.covariance.compare(&row, innovation, noise);
        self.take(&comparison);
    }
}
