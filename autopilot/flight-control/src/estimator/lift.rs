//! What the wing says of the flow: the specific force is its lift, which follows from airspeed and angle of attack.

use icd::SimTime;

use nalgebra::Vector3;

use super::covariance::{FORCE_BIAS, LIFT, Row};
use super::gusts::Contrast;
use super::updates::{PitotReading, Present};
use super::{Estimator, SourceHealth, air};

/// The mean over this time is compared, µs: what the model leaves out changes faster.
const EVERY_US: u64 = 500_000;
/// Error of such a mean as a part of the lift: engine, elevators and the like.
const ERROR: f64 = 0.02;
/// Part of the gusts, rms, that the wing has not answered to yet, or averages over its span.
const UNSTEADY: f64 = 0.1;
/// Beyond this airspeed, m/s, about M 0.3, lift depends on the Mach number, which the model does not have: it shows no airspeed
/// and accuses no pitot tube.
const SLOW_M_S: f64 = 100.0;

/// Sum of what the wing carried beyond what it should have, as a part of it, since the last comparison.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mean {
    due: SimTime,
    sum: f64,
    count: u32,
    /// The same at the airspeed of the pitot tube.
    contrast: Contrast,
}

impl Mean {
    fn begin(&mut self, now: SimTime) {
        self.due = SimTime::from_micros(now.as_micros() + EVERY_US);
        (self.sum, self.count) = (0.0, 0);
    }
}

impl Estimator {
    /// The lift of the design model here, at a velocity through the air, m/s, body axes.
    fn wing(&self, through_air: &Vector3<f64>) -> Option<air::Wing> {
        let [.., altitude] = self.ground.as_ref()?.place.coordinates(&self.estimate.position);
        self.air.lift(through_air, self.inertial().rate.y, altitude)
    }

    /// While a pitot tube or the vanes are missing: compares the specific force along the body's z axis with the lift of the design model.
    pub(super) fn compare_lift(&mut self, now: SimTime) {
        let is_used = |source: &super::Source| source.health(now) == SourceHealth::Used;
        let has_vanes = is_used(&self.sources.vanes);
        if has_vanes && is_used(&self.sources.pitot) {
            return self.lift.begin(now);
        }
        let Some(present) = self.present() else { return };
        // With vanes, lift shows the airspeed alone, to a few per cent: of a fast aircraft the last good wind knows it better.
        if has_vanes && present.through_air.norm() > SLOW_M_S {
            return self.lift.begin(now);
        }
        let inertial = self.inertial();
        let Some(wing) = self.wing(&present.through_air) else { return self.lift.begin(now) };
        // The body's z axis points down.
        self.lift.sum += -inertial.force.z / wing.value - 1.0;
        self.lift.count += 1;
        if now < self.lift.due {
            return;
        }
        let innovation = self.lift.sum / f64::from(self.lift.count);
        self.lift.begin(now);
        let Some(row) = self.row_along(&present, &(wing.gradient / wing.value)) else { return };
        let row = row.with(FORCE_BIAS + 2, -1.0 / wing.value).with(LIFT, 1.0);
        let per_gust = air::angle_of_attack(&present.through_air)
            .map_or(0.0, |angle| angle.gradient.norm() * wing.per_angle);
        // Without vanes the mean knows nothing of how a gust has changed since.
        let changed = match has_vanes {
            true => 0.0,
            false => EVERY_US as f64 * 1.0e-6 / (3.0 * self.gust_s()),
        };
        let unsteady = per_gust * per_gust * (UNSTEADY * UNSTEADY + changed);
        let noise = ERROR * ERROR + unsteady * self.gusts.square();
        let comparison = self.covariance.compare(&row, innovation, noise);
        self.take(&comparison);
    }

    /// Whether the pitot tube agrees in the mean with the lift of a slow aircraft. Wind and gusts follow a drift of it, lift does not.
    pub(super) fn lift_agrees(
        &mut self,
        now: SimTime,
        present: &Present,
        reading: &PitotReading,
    ) -> bool {
        let speed = reading.airspeed_m_s;
        if speed > SLOW_M_S {
            return true;
        }
        // The direction of the estimate, at the speed of the tube: the speed alone is to be judged.
        let Some(wing) = self.wing(&(present.through_air.normalize() * speed)) else { return true };
        let excess = -self.inertial().force.z / wing.value - 1.0;
        let contrast = self.lift.contrast.follow(now, excess);
        // Lift grows with the square of the airspeed.
        let row = reading.with_errors(Row::empty().with(LIFT, 1.0), 2.0 / speed);
        let angle = self.flow_variance(present, air::angle_of_attack);
        let variance = self.covariance.compare(&row, 0.0, 0.0).variance
            + wing.per_angle * wing.per_angle * angle;
        self.is_within(contrast, variance)
    }
}
