//! What the wing says of the flow: its lift is the specific force, and follows from airspeed and angle of attack.

use icd::SimTime;

use super::covariance::{ATTITUDE, FORCE_BIAS, LIFT, Row, VELOCITY, WIND};
use super::{Estimator, air};

/// The mean over this time is compared, µs: what the model leaves out changes faster.
const EVERY_US: u64 = 500_000;

/// Sum of what the wing carried beyond what it should have, as a part of it, since the last comparison.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lift {
    due: SimTime,
    sum: f64,
    count: u32,
}

impl Lift {
    /// Before the first look.
    pub(super) const NONE: Self = Self { due: SimTime::ZERO, sum: 0.0, count: 0 };
}

impl Estimator {
    /// Compares the specific force along the body's z axis with the lift of the design model.
    pub(super) fn compare_lift(&mut self, now: SimTime) {
        let (Some(present), Some(ground)) = (self.present(), &self.ground) else { return };
        let [.., altitude] = ground.place.coordinates(&self.estimate.position);
        let inertial = self.inertial();
        let Some(wing) = self.air.lift(&present.through_air, inertial.rate.y, altitude) else {
            self.lift = Lift { due: now, ..Lift::NONE };
            return;
        };
        let expected = wing.value * (1.0 + self.estimate.lift_scale);
        self.lift.sum += -inertial.force.z / expected - 1.0;
        self.lift.count += 1;
        if now < self.lift.due {
            return;
        }
        let innovation = self.lift.sum / f64::from(self.lift.count);
        self.lift = Lift { due: SimTime::from_micros(now.as_micros() + EVERY_US), ..Lift::NONE };
        let Some(ground) = &self.ground else { return };
        let mut level = self.smooth_wind;
        if super::probe(13) > 0.0 { level.z = 0.0; }
        let relative = self.estimate.velocity - ground.place.start_from_ned * level;
        let Some(steady) = self.air.lift(&present.matrix.tr_mul(&relative), 0.0, altitude) else { return };
        let along = present.matrix * (steady.gradient / steady.value);
        let wind = -ground.place.start_from_ned.tr_mul(&along);
        let row = Row::empty()
            .with_vector(VELOCITY, &along)
            .with_vector(WIND, &wind)
            .with_vector(ATTITUDE, &along.cross(&relative))
            .with(FORCE_BIAS + 2, -1.0 / steady.value)
            .with(LIFT, 1.0);
        let angle = air::angle_of_attack(&present.steady).map_or(0.0, |flow| flow.gradient.norm());
        let gust = self.gusts.square() * angle * angle * wing.per_angle * wing.per_angle;
        let (base, unsteady) = (super::probe(8), super::probe(9));
        let noise = base * base + unsteady * unsteady * gust;
        let comparison = self.covariance.compare(&row, innovation, noise);
        let ratio = comparison.deviations() / self.gains.gate;
        if ratio <= 1.0 {
            let correction = if super::probe(10) > 0.0 { self.covariance.take_pitot(&comparison) } else {self.covariance.take(&comparison) };
            for (i, v) in [innovation, correction[super::VANES], correction[super::covariance::WIND+2], correction[super::ATTITUDE+1], libm::sqrt(self.gusts.square()), libm::sqrt(self.covariance.variance(super::VANES)).to_degrees()].into_iter().enumerate() { super::set_probe(16 + i, if i == 1 || i == 2 || i == 3 { super::probe(16 + i) + v } else { v }); }
            self.correct(&correction);
        }
    }
}
