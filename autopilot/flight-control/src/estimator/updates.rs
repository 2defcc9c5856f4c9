//! The measurements: what each sensor should have measured, and how that depends on the error state.

use icd::geomagnetism::field_ned_nt;
use icd::{Body, FlowAngles, GnssFix, Sample, Sensors, SimTime};
use nalgebra::Vector3;

use super::air::{self, Airspeed, FlowOf};
use super::covariance::{
    ATTITUDE, BAROMETER, Comparison, FORCE_BIAS, MAGNETIC_BIAS, PITOT_BIAS, PITOT_SCALE, POSITION,
    Row, VANES, VELOCITY, Vectors, WIND,
};
use super::history::Since;
use super::noise::MANOEUVRE_S;
use super::{Estimator, GroundFix, SourceHealth, UPDATE_EVERY_US};
use crate::design_model::atmosphere;

/// Largest speed that is believed, m/s.
pub(super) const SPEED_MAX_M_S: f64 = 5_000.0;
/// Largest altitude either way that is believed, m.
pub(super) const ALTITUDE_MAX_M: f64 = 200_000.0;
/// Largest distance from the start point along an axis, m.
const DISTANCE_MAX_M: f64 = 2.0e7;
/// Pressures that air has, Pa.
const PRESSURE_PA: [f64; 2] = [100.0, 200_000.0];
/// Largest impact pressure, Pa.
pub(super) const IMPACT_MAX_PA: f64 = 1.0e6;
/// Largest flow angle, rad: a little more than half a turn.
const ANGLE_MAX_RAD: f64 = 3.2;
/// Largest magnetic field along an axis, nT: ten times that of the Earth.
const FIELD_MAX_NT: f64 = 600_000.0;
/// The Earth's field is computed anew after so many metres, because it changes by 10 nT or less in a kilometre.
const FIELD_EVERY_M: f64 = 1_000.0;
/// Without vanes for this long the design model stands in, s.
const WITHOUT_VANES_S: f64 = 0.5;
/// Then it is compared this often, µs: its errors last much longer than a control step.
const MODEL_EVERY_US: u64 = 200_000;
/// The attitude of an aircraft that stands, and with it the errors of the magnetometer's scale, last as long as a stay at the holding
/// point, s.
const STANDING_S: f64 = 1_800.0;
/// A rolling aircraft uses its air data from this part of its stall speed on.
const FLOW_OVER_STALL: f64 = 0.6;
/// Samples of air data and magnetometer that are older than this are not used, s.
const AGE_MAX_S: f64 = 0.2;

/// The Earth's magnetic field where it was last computed.
#[derive(Debug, Clone, Copy)]
pub(super) struct MagneticField {
    place: Option<Vector3<f64>>,
    /// nT, start axes.
    field: Vector3<f64>,
    year: f64,
}

impl Default for MagneticField {
    fn default() -> Self {
        // The first fix brings the date.
        Self { place: None, field: Vector3::zeros(), year: 2_025.0 }
    }
}

impl MagneticField {
    /// nT; zero before the first sample.
    pub(super) fn strength(&self) -> f64 {
        self.field.norm()
    }
}

/// What the aircraft does at this tick, for all comparisons of it.
pub(super) struct Present {
    /// Body to start axes.
    pub(super) matrix: nalgebra::Matrix3<f64>,
    /// Velocity through the air, body axes.
    pub(super) through_air: Vector3<f64>,
    /// Its change, m/s², body axes.
    slope: Vector3<f64>,
    rate: Vector3<f64>,
}

/// A sample of the pitot tube.
pub(super) struct PitotReading {
    pub(super) airspeed_m_s: f64,
    /// Change of the airspeed with the impact pressure, m/s/Pa, and the impact pressure, Pa, both of the estimate.
    per_pascal: f64,
    impact_pa: f64,
}

impl PitotReading {
    /// The row with the errors of the pitot tube, for a quantity that changes so much with the airspeed.
    pub(super) fn with_errors(&self, row: Row, per_speed: f64) -> Row {
        let bias = per_speed * self.per_pascal;
        row.with(PITOT_BIAS, bias).with(PITOT_SCALE, bias * self.impact_pa)
    }
}

impl Estimator {
    /// Compares every new sample with the estimate and corrects it.
    pub(super) fn measure(&mut self, now: SimTime, sensors: &Sensors) {
        self.measure_gnss(now, &sensors.gnss);
        self.measure_barometer(now, sensors);
        let stands = self.stands();
        if stands {
            self.compare_rest(now);
        }
        // At rest also where the tube shows a flow: a bias does so.
        if stands || (self.near_ground.on_wheels && !self.has_flow(sensors)) {
            self.pass_over_air(now, sensors);
            self.measure_field(now, &sensors.magnetometer_nt);
            return;
        }
        self.measure_pitot(now, sensors);
        // Asked behind the pitot tube and before the vanes, so both know what this update has made of it.
        let is_blind = self.sources.pitot.health(now) != SourceHealth::Used;
        self.covariance.consider_vanes(is_blind);
        self.measure_vanes(now, &sensors.vanes);
        self.measure_field(now, &sensors.magnetometer_nt);
        if !self.near_ground.on_wheels {
            self.compare_lift(now);
            self.compare_side_force(now);
        }
    }

    /// Whether the air streams along a rolling aircraft as it does in flight.
    fn has_flow(&self, sensors: &Sensors) -> bool {
        let pitot = &sensors.pitot;
        let impact_pa = pitot.value.impact_pa - self.pitot_zero.offset_pa;
        let airspeed = self.pressure_altitude_m().and_then(|at| air::airspeed(impact_pa, at));
        let least_m_s = FLOW_OVER_STALL * self.stall_m_s;
        pitot.valid && airspeed.is_some_and(|airspeed| airspeed.airspeed_m_s > least_m_s)
    }

    /// Pressure altitude of the estimate, m; `None` before the alignment.
    pub(super) fn pressure_altitude_m(&self) -> Option<f64> {
        let [.., altitude] = self.ground.as_ref()?.place.coordinates(&self.estimate.position);
        Some(air::geopotential(altitude) + self.estimate.barometer_offset)
    }

    /// Takes a comparison that passes the gate; returns whether it did.
    pub(super) fn take(&mut self, comparison: &Comparison) -> bool {
        let passes = comparison.deviations() <= self.gains.gate;
        if passes {
            let correction = self.covariance.take(comparison);
            self.estimate.correct(&correction);
        }
        passes
    }

    /// The direction of flight through the air, unit vectors, NED and start axes.
    fn flow(&self, present: &Present) -> [Vector3<f64>; 2] {
        let start = (present.matrix * present.through_air).normalize();
        let ned = self.ground.as_ref().map(|ground| ground.place.start_from_ned.tr_mul(&start));
        [ned.unwrap_or_default(), start]
    }

    /// Takes a comparison of a flow angle that passes the gate.
    fn take_angle(&mut self, comparison: &Comparison, present: &Present) {
        if comparison.deviations() <= self.gains.gate {
            let correction = self.covariance.take_across(comparison, &self.flow(present)[0]);
            self.estimate.correct(&correction);
        }
    }

    fn ratio(&self, comparison: &Comparison) -> f64 {
        comparison.deviations() / self.gains.gate
    }

    /// GNSS: velocity and position at the time of the fix.
    fn measure_gnss(&mut self, now: SimTime, sample: &Sample<GnssFix>) {
        let GnssFix { velocity, position, .. } = sample.value;
        let is_good = sample.valid && is_possible(&sample.value);
        let mut values = [0.0; 6];
        values[..3].copy_from_slice(velocity.0.as_slice());
        values[3..].copy_from_slice(position.0.as_slice());
        let sources = &mut self.sources;
        // Both watch the same samples.
        let is_new = sources.gnss.is_new(now, sample.time, is_good, &values);
        sources.gnss_velocity.is_new(now, sample.time, is_good, &values);
        if !is_new {
            return;
        }
        self.field.year = sample.value.decimal_year;
        let Some(since) = self.history.since(sample.time, &self.integrals) else {
            self.sources.gnss.mark_late();
            self.late = self.late.saturating_add(1);
            return;
        };
        self.measure_velocity(now, &velocity.0, &since);
        self.measure_position(now, &position.0, &since);
    }

    /// Row and innovation of an axis of a GNSS velocity, m/s, NED.
    fn velocity_row(&self, measured: &Vector3<f64>, since: &Since, axis: usize) -> (Row, f64) {
        let Some(GroundFix { place, .. }) = &self.ground else { return (Row::empty(), 0.0) };
        let along: Vector3<f64> = place.start_from_ned.column(axis).into();
        let then = self.estimate.velocity - since.velocity;
        // δv(t - d) = δv + S × θ + A b, where S = ∫ C f over the delay, what the acceleration has without gravity, and A = ∫ C, about
        // what C is now times the delay. With the tilt and without the bias, a late fix would seem to tell one from the other.
        let force = since.velocity - place.gravity * since.seconds;
        let bias = self.estimate.matrix().tr_mul(&along) * since.seconds;
        let row = Row::empty()
            .with_vector(VELOCITY, &along)
            .with_vector(ATTITUDE, &along.cross(&force))
            .with_vector(FORCE_BIAS, &bias);
        (row, measured[axis] - along.dot(&then))
    }

    fn measure_velocity(&mut self, now: SimTime, measured: &Vector3<f64>, since: &Since) {
        let noise = self.gains.gnss_velocity_m_s * self.gains.gnss_velocity_m_s;
        let mut ratio: f64 = 0.0;
        // The gates of all three first: a correction by one axis would change the innovations of the others.
        for axis in 0..3 {
            let (row, innovation) = self.velocity_row(measured, since, axis);
            ratio = ratio.max(self.ratio(&self.covariance.compare(&row, innovation, noise)));
        }
        self.velocity_ratio = ratio;
        if ratio <= 1.0 {
            for axis in 0..3 {
                let (row, innovation) = self.velocity_row(measured, since, axis);
                let comparison = self.covariance.compare(&row, innovation, noise);
                self.take(&comparison);
            }
            self.sources.gnss_velocity.believe(ratio);
        // Rejected for so long: now rather the estimate is wrong than the receiver.
        } else if self.sources.gnss_velocity.reject(now, ratio, self.gains.reopen_s)
            && let Some(GroundFix { place, .. }) = &self.ground
        {
            self.estimate.velocity = place.start_from_ned * measured + since.velocity;
            for axis in 0..3 {
                self.covariance.forget(VELOCITY + axis, 4.0 * noise);
            }
            // A velocity that ran away shows that attitude or biases are wrong too.
            self.doubt_inertial();
            self.sources.gnss_velocity.believe(ratio);
        }
    }

    /// Row and innovation of an axis of a GNSS position, m, start axes.
    fn position_row(&self, measured: &Vector3<f64>, since: &Since, axis: usize) -> (Row, f64) {
        let Since { seconds, bend, .. } = since;
        let then = self.estimate.position - self.estimate.velocity * *seconds - bend;
        let row = Row::empty().with(POSITION + axis, 1.0).with(VELOCITY + axis, -seconds);
        (row, measured[axis] - then[axis])
    }

    fn measure_position(&mut self, now: SimTime, measured: &Vector3<f64>, since: &Since) {
        let horizontal = self.gains.gnss_position_m;
        let vertical = horizontal * self.gains.gnss_vertical;
        let noise = [horizontal, horizontal, vertical].map(|spread| spread * spread);
        let mut ratios = [0.0; 3];
        for (axis, ratio) in ratios.iter_mut().enumerate() {
            let (row, innovation) = self.position_row(measured, since, axis);
            *ratio = self.ratio(&self.covariance.compare(&row, innovation, noise[axis]));
        }
        let ratio = ratios[0].max(ratios[1]).max(ratios[2]);
        if ratio <= 1.0 {
            for (axis, noise) in noise.into_iter().enumerate() {
                let (row, innovation) = self.position_row(measured, since, axis);
                let comparison = self.covariance.compare(&row, innovation, noise);
                self.take(&comparison);
            }
            self.sources.gnss.believe(ratio);
        } else if self.sources.gnss.reject(now, ratio, self.gains.reopen_s) {
            let Since { seconds, bend, .. } = since;
            self.estimate.position = measured + self.estimate.velocity * *seconds + bend;
            for (axis, noise) in noise.into_iter().enumerate() {
                self.covariance.forget(POSITION + axis, 4.0 * noise);
            }
            self.sources.gnss.believe(ratio);
        }
        // Barometer and flow are compared at the corrected position.
        self.find_place();
    }

    /// Barometer: pressure altitude, which has an offset.
    fn measure_barometer(&mut self, now: SimTime, sensors: &Sensors) {
        let sample = &sensors.barometer;
        let pressure = sample.value.pressure_pa;
        let is_good = sample.valid && (PRESSURE_PA[0]..=PRESSURE_PA[1]).contains(&pressure);
        if !self.sources.barometer.is_new(now, sample.time, is_good, &[pressure]) {
            return;
        }
        let Some(age) = age(sample.time, now) else { return };
        let Some(GroundFix { place, .. }) = &self.ground else { return };
        let up = place.up();
        let [.., altitude] = place.coordinates(&self.estimate.position);
        let then = altitude - up.dot(&self.estimate.velocity) * age;
        let expected = air::geopotential(then) + self.estimate.barometer_offset;
        let innovation = atmosphere::pressure_altitude(pressure) - expected;
        let row = Row::empty()
            .with_vector(POSITION, &up)
            .with_vector(VELOCITY, &(up * -age))
            .with(BAROMETER, 1.0);
        let noise = self.gains.barometer_noise_m * self.gains.barometer_noise_m;
        let comparison = self.covariance.compare(&row, innovation, noise);
        let ratio = self.ratio(&comparison);
        self.vertical_ratio = ratio;
        if self.take(&comparison) {
            self.sources.barometer.believe(ratio);
        } else if self.sources.barometer.reject(now, ratio, self.gains.reopen_s) {
            // Position and altitude stay with GNSS; what has changed is the offset.
            self.estimate.barometer_offset += innovation;
            self.covariance.forget(BAROMETER, noise + innovation * innovation);
            self.sources.barometer.believe(ratio);
        }
    }

    pub(super) fn present(&self) -> Option<Present> {
        let ground = self.ground.as_ref()?;
        let inertial = self.inertial();
        let matrix = self.estimate.matrix();
        let through_air = self.through_air(ground);
        let gravity = matrix.tr_mul(&ground.place.gravity);
        let slope = inertial.force + gravity - inertial.rate.cross(&through_air);
        Some(Present { matrix, through_air, slope, rate: inertial.rate })
    }

    /// Row of a quantity of the flow: its gradient in body axes leads to velocity, wind and attitude.
    ///
    /// δ(Cᵀ (v - w)) = Cᵀ (δv - δw + (v - w) × θ).
    fn flow_row(&self, present: &Present, of: FlowOf) -> Option<Row> {
        self.row_along(present, &of(&present.through_air)?.gradient)
    }

    /// The same of a gradient.
    pub(super) fn row_along(&self, present: &Present, gradient: &Vector3<f64>) -> Option<Row> {
        let vectors = self.vectors(present, gradient)?;
        Some(vectors.iter().fold(Row::empty(), |row, (from, by)| row.with_vector(*from, by)))
    }

    /// The vectors of states in it.
    pub(super) fn vectors(&self, present: &Present, gradient: &Vector3<f64>) -> Option<Vectors> {
        let along = present.matrix * gradient;
        let GroundFix { place, .. } = self.ground.as_ref()?;
        let wind = -place.start_from_ned.tr_mul(&along);
        let relative = present.matrix * present.through_air;
        Some([(VELOCITY, along), (WIND, wind), (ATTITUDE, along.cross(&relative))])
    }

    /// Pitot tube: true airspeed where it is, from its impact pressure.
    fn measure_pitot(&mut self, now: SimTime, sensors: &Sensors) {
        let sample = &sensors.pitot;
        let impact = sample.value.impact_pa;
        let is_good = sample.valid && impact.abs() <= IMPACT_MAX_PA;
        if !self.sources.pitot.is_new(now, sample.time, is_good, &[impact]) {
            return;
        }
        let impact = impact - self.pitot_zero.offset_pa;
        let Some(age) = age(sample.time, now) else { return };
        let (Some(present), Some(pressure_altitude)) = (self.present(), self.pressure_altitude_m())
        else {
            return;
        };
        let Some(measured) = air::airspeed(impact, pressure_altitude) else { return };
        let there = present.at(&self.air.pitot_m, age);
        let Some(flow) = air::speed(&there) else { return };
        // The pressure that there should be: the measured one has noise, which is also in the innovation.
        let expected = air::impact(flow.value, pressure_altitude);
        let Some(Airspeed { per_pascal: slope, .. }) = air::airspeed(expected, pressure_altitude)
        else {
            return;
        };
        let Some(row) = self.flow_row(&present, air::speed) else { return };
        let Airspeed { airspeed_m_s, .. } = measured;
        let reading = PitotReading { airspeed_m_s, per_pascal: slope, impact_pa: expected };
        let row = reading.with_errors(row, 1.0);
        // Both follow every sample.
        let agrees = self.pitot_agrees(now, &present, &reading);
        let agrees = self.lift_agrees(now, &present, &reading) && agrees;
        let noise = self.gains.pitot_noise_pa * slope;
        let innovation = airspeed_m_s - flow.value;
        let comparison = self.covariance.compare(&row, innovation, noise * noise);
        let ratio = self.ratio(&comparison);
        if self.sources.pitot.is_doubted() {
            // Only counted. `pitot_agrees` says when the tube is right again.
            self.sources.pitot.reject(now, ratio, self.gains.reopen_s);
            self.sources.pitot.doubt(!agrees);
        } else if !agrees {
            self.doubt_pitot();
        } else if ratio <= 1.0 {
            let [flow, start] = self.flow(&present);
            let correction = self.covariance.take_along(&comparison, &flow, &start);
            self.estimate.correct(&correction);
            self.sources.pitot.believe(ratio);
        // Any other sensor is believed again after so long. This one is doubted, because wind and velocity would
        // follow it.
        } else if self.sources.pitot.reject(now, ratio, self.gains.reopen_s) {
            self.doubt_pitot();
        }
    }

    /// Vanes: angle of attack and sideslip where they are, each with a bias.
    fn measure_vanes(&mut self, now: SimTime, sample: &Sample<FlowAngles>) {
        let FlowAngles { angle_of_attack_rad, sideslip_rad } = sample.value;
        let measured = [angle_of_attack_rad, sideslip_rad];
        let is_good = sample.valid && is_flow(&sample.value);
        if !self.sources.vanes.is_new(now, sample.time, is_good, &measured) {
            return;
        }
        let Some(age) = age(sample.time, now) else { return };
        let noise = self.gains.vane_noise_deg.to_radians();
        let noise = noise * noise;
        let mut worst: f64 = 0.0;
        let mut innovations = [0.0; 2];
        for (vane, of) in [air::angle_of_attack, air::sideslip].into_iter().enumerate() {
            // Anew for each angle, because the first one has corrected the estimate.
            let Some(present) = self.present() else { return };
            let Some(flow) = of(&present.at(&self.air.vanes_m, age)) else { return };
            let Some(row) = self.flow_row(&present, of) else { return };
            let row = row.with(VANES + vane, 1.0);
            let innovation = measured[vane] - flow.value - self.estimate.vane_bias[vane];
            let comparison = self.covariance.compare(&row, innovation, noise);
            worst = worst.max(self.ratio(&comparison));
            self.take_angle(&comparison, &present);
            innovations[vane] = innovation;
        }
        if worst <= 1.0 {
            self.sources.vanes.believe(worst);
        } else if self.sources.vanes.reject(now, worst, self.gains.reopen_s) {
            for (vane, innovation) in innovations.into_iter().enumerate() {
                let variance = self.covariance.variance(VANES + vane) + innovation * innovation;
                self.covariance.raise(VANES + vane, variance);
            }
            self.sources.vanes.believe(worst);
        }
    }

    /// Magnetometer: the Earth's field in body axes, with a bias.
    fn measure_field(&mut self, now: SimTime, sample: &Sample<Body>) {
        let is_good = sample.valid && is_field(&sample.value);
        let values = sample.value.0;
        // Before `is_new`, which ends the silence.
        let between = self.sources.magnetometer.silence_s(now).min(MANOEUVRE_S);
        if !self.sources.magnetometer.is_new(now, sample.time, is_good, values.as_ref()) {
            return;
        }
        let Some(age) = age(sample.time, now) else { return };
        self.find_field();
        // Errors of scale and direction change with the attitude and last as long as it does. As white noise of the samples they would
        // be averaged to nothing in a straight flight, and every little swing would seem to tell the biases from the attitude.
        let lasting = self.gains.magnetic_scale * self.field.strength();
        let lasts_s = if self.stands() { STANDING_S } else { MANOEUVRE_S };
        let noise = self.gains.magnetic_noise_nt * self.gains.magnetic_noise_nt
            + lasting * lasting * 2.0 * lasts_s / between.max(UPDATE_EVERY_US as f64 * 1.0e-6);
        let mut worst: f64 = 0.0;
        let mut innovations = [0.0; 3];
        for axis in 0..3 {
            let matrix = self.estimate.matrix();
            let field = matrix.tr_mul(&self.field.field);
            // At the time of measurement the aircraft had turned less.
            let then = field + self.inertial().rate.cross(&field) * age;
            let innovation = values[axis] - then[axis] - self.estimate.magnetic_bias[axis];
            let along: Vector3<f64> = matrix.column(axis).into();
            let row = Row::empty()
                .with_vector(ATTITUDE, &along.cross(&self.field.field))
                .with(MAGNETIC_BIAS + axis, 1.0);
            let comparison = self.covariance.compare(&row, innovation, noise);
            worst = worst.max(self.ratio(&comparison));
            self.take(&comparison);
            innovations[axis] = innovation;
        }
        if worst <= 1.0 {
            self.sources.magnetometer.believe(worst);
        } else if self.sources.magnetometer.reject(now, worst, self.gains.reopen_s) {
            for (axis, innovation) in innovations.into_iter().enumerate() {
                let state = MAGNETIC_BIAS + axis;
                let variance = self.covariance.variance(state) + innovation * innovation;
                self.covariance.raise(state, variance);
            }
            self.sources.magnetometer.believe(worst);
        }
    }

    /// The Earth's field, computed anew where the aircraft has moved far enough.
    fn find_field(&mut self) {
        let Some(GroundFix { place, .. }) = &self.ground else { return };
        let position = self.estimate.position;
        let is_near =
            |at: Vector3<f64>| (position - at).norm_squared() < FIELD_EVERY_M * FIELD_EVERY_M;
        if self.field.place.is_some_and(is_near) {
            return;
        }
        let [latitude, longitude, altitude] = place.coordinates(&position);
        let ned = field_ned_nt(latitude, longitude, altitude, self.field.year);
        self.field.place = Some(position);
        self.field.field = place.start_from_ned * ned.0;
    }

    /// Without vanes: the sideslip that gives the specific force by the design model.
    fn compare_side_force(&mut self, now: SimTime) {
        if self.sources.vanes.silence_s(now) < WITHOUT_VANES_S && !self.sources.vanes.is_stuck(now)
            || now < self.model_due
        {
            return;
        }
        self.model_due = SimTime::from_micros(now.as_micros() + MODEL_EVERY_US);
        let (Some(present), Some(ground)) = (self.present(), &self.ground) else { return };
        let [.., altitude] = ground.place.coordinates(&self.estimate.position);
        let force = self.inertial().force;
        let expected = self.air.sideslip(&force, present.through_air.norm(), altitude);
        let (Some(expected), Some(flow)) = (expected, air::sideslip(&present.through_air)) else {
            return;
        };
        let Some(row) = self.flow_row(&present, air::sideslip) else { return };
        let noise = self.gains.model_beta_deg.to_radians();
        let comparison = self.covariance.compare(&row, expected - flow.value, noise * noise);
        self.take_angle(&comparison, &present);
    }
}

impl Present {
    /// Velocity through the air at a place of the aircraft, m/s, body axes, at an earlier time.
    fn at(&self, place: &Vector3<f64>, age: f64) -> Vector3<f64> {
        self.through_air - self.slope * age + self.rate.cross(place)
    }
}

/// Age of a sample, s; `None` for one that is too old to be compared.
fn age(measured: SimTime, now: SimTime) -> Option<f64> {
    let age = now.as_micros().saturating_sub(measured.as_micros()) as f64 * 1.0e-6;
    (age <= AGE_MAX_S).then_some(age)
}

/// Every number is one that a receiver can give.
pub(super) fn is_possible(fix: &GnssFix) -> bool {
    let within = |values: &[f64], max: f64| values.iter().all(|value| value.abs() <= max);
    within(fix.velocity.0.as_ref(), SPEED_MAX_M_S)
        && within(fix.position.0.as_ref(), DISTANCE_MAX_M)
        && within(&[fix.latitude_rad, fix.longitude_rad], ANGLE_MAX_RAD)
        && within(&[fix.altitude_m], ALTITUDE_MAX_M)
        && fix.decimal_year.is_finite()
}

/// Both angles are some that a vane can have.
pub(super) fn is_flow(angles: &FlowAngles) -> bool {
    angles.angle_of_attack_rad.abs() <= ANGLE_MAX_RAD && angles.sideslip_rad.abs() <= ANGLE_MAX_RAD
}

/// The field is one that is near the Earth.
pub(super) fn is_field(field: &Body) -> bool {
    field.0.iter().all(|value| value.abs() <= FIELD_MAX_NT) && field.0.norm_squared() > 1.0
}
