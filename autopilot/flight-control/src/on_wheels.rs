//! Whether the aircraft stands on the ground, by the sensors of an aircraft that flies over one.

use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Sensors, SimTime, sensors::SensorKind};

use crate::aircraft_model::AircraftModel;

/// The wheels carry more than this part of the weight.
const LOAD_SHARE: f64 = 0.1;
/// A load for this long is a touchdown, s: before the forces of the ground look like a fault. None for this long is a lift-off and
/// no bounce.
const TOUCHDOWN_S: f64 = 0.005;
const LIFT_OFF_S: f64 = 0.3;
/// As high as this, m, nothing bounces: no load for this time, s, is enough.
const NO_BOUNCE_M: f64 = 1.0;
const LIFT_OFF_HIGH_S: f64 = 0.02;
/// Higher than this no load is believed, m: a rail may be this high.
const HEIGHT_DOUBT_M: f64 = 12.0;
/// Without a valid load it stands on the ground below this height, m.
const HEIGHT_ON_GROUND_M: f64 = 0.1;

/// What is known of the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroundReading {
    /// As [`crate::NavigationState::over_ground`].
    pub over_ground: bool,
    /// As [`crate::NavigationState::height_above_ground_m`].
    pub height_m: Option<f64>,
    /// As [`crate::NavigationState::on_wheels`].
    pub on_wheels: bool,
}

/// Watches load and height.
#[derive(Debug, Clone)]
pub struct OnWheels {
    weight_n: f64,
    on_wheels: Option<bool>,
    /// How long the samples have said otherwise, s.
    otherwise_s: f64,
    time: SimTime,
}

impl OnWheels {
    /// Before the first samples of an aircraft.
    pub fn new(aircraft: &AircraftModel) -> Self {
        let weight_n = aircraft.mass.mass_kg * STANDARD_GRAVITY_M_S2;
        Self { weight_n, on_wheels: None, otherwise_s: 0.0, time: SimTime::ZERO }
    }

    /// One tick. Without both sensors it is never on the ground. Beyond its range, m, the radar altimeter shows no height.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors, range_m: f64) -> GroundReading {
        let before = core::mem::replace(&mut self.time, time);
        let dt_s = time.micros_since(before) as f64 * 1.0e-6;
        let is_fitted = |sensor: SensorKind| sensors.fitted[sensor as usize];
        if !is_fitted(SensorKind::WeightOnWheels) && !is_fitted(SensorKind::RadarAltimeter) {
            return GroundReading::default();
        }
        let height = &sensors.radar_altimeter_m;
        let height_m = (height.valid && height.value.is_finite()).then_some(height.value);
        let load = &sensors.weight_on_wheels_n;
        let is_load_known = load.valid && load.value.is_finite();
        let is_high = height_m.is_some_and(|height_m| height_m > HEIGHT_DOUBT_M);
        let is_low = height_m.map(|height_m| height_m < HEIGHT_ON_GROUND_M);
        let says = match (is_high, is_load_known) {
            (true, _) => Some(false),
            (false, true) => Some(load.value > LOAD_SHARE * self.weight_n),
            (false, false) => is_low,
        };
        let now = self.on_wheels.unwrap_or(says == Some(true));
        let differs = says.is_some_and(|says| says != now);
        self.otherwise_s = if differs { self.otherwise_s + dt_s } else { 0.0 };
        let is_no_bounce = height_m.is_some_and(|height_m| height_m > NO_BOUNCE_M);
        let patience_s = match (now, is_no_bounce) {
            (true, true) => LIFT_OFF_HIGH_S,
            (true, false) => LIFT_OFF_S,
            (false, _) => TOUCHDOWN_S,
        };
        let changes = differs && self.otherwise_s >= patience_s;
        if changes {
            self.otherwise_s = 0.0;
        }
        let on_wheels = now != changes;
        self.on_wheels = Some(on_wheels);
        let height_m = height_m.filter(|height_m| *height_m < range_m);
        GroundReading { over_ground: true, height_m, on_wheels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    const RANGE_M: f64 = 120.0;

    /// What it says after so many ticks of 10 ms of a load, parts of the weight, and a height, m; `None` is not valid.
    fn after(
        watch: &mut OnWheels,
        tick: &mut u64,
        load: Option<f64>,
        height: Option<f64>,
        ticks: u64,
    ) -> bool {
        let weight_n = testing::aircraft_model().mass.mass_kg * STANDARD_GRAVITY_M_S2;
        let mut ground = GroundReading::default();
        for _ in 0..ticks {
            *tick += 1;
            let mut sensors = testing::level_sensors();
            sensors.fitted = [true; Sensors::SENSORS];
            sensors.weight_on_wheels_n.valid = load.is_some();
            sensors.weight_on_wheels_n.value = load.unwrap_or(0.0) * weight_n;
            sensors.radar_altimeter_m.valid = height.is_some();
            sensors.radar_altimeter_m.value = height.unwrap_or(0.0);
            ground = watch.step(SimTime::from_micros(10_000 * *tick), &sensors, RANGE_M);
            assert_eq!(ground.height_m, height.filter(|height_m| *height_m < RANGE_M));
        }
        ground.on_wheels
    }

    #[test]
    fn load_and_height_say_whether_it_stands_and_one_of_them_suffices() {
        let mut watch = OnWheels::new(&testing::aircraft_model());
        let mut tick = 0;
        let mut says = |load, height, ticks| after(&mut watch, &mut tick, load, height, ticks);
        assert!(says(Some(1.0), Some(0.0), 1), "parked, from the first sample on");
        assert!(says(Some(0.0), Some(0.2), 25), "a bounce");
        assert!(says(Some(0.5), Some(0.0), 1));
        assert!(!says(Some(0.0), Some(0.9), 35), "a lift-off");
        assert!(says(Some(0.3), Some(0.0), 1), "a touchdown");
        assert!(!says(Some(1.0), Some(50.0), 40), "a load that is stuck in the air");
        assert!(!says(Some(1.0), Some(RANGE_M), 40), "the same higher than the height is measured");
        assert!(says(None, Some(0.05), 10), "by the height alone");
        assert!(says(None, None, 100), "as it was");
        assert!(!says(Some(0.0), None, 40), "by the load alone");
        assert!(says(Some(1.0), Some(1.4), 1), "on a catapult");
        assert!(!says(Some(0.0), Some(1.4), 3), "at the end of its rail");
    }

    #[test]
    fn without_the_sensors_it_is_never_on_the_ground() {
        let mut watch = OnWheels::new(&testing::aircraft_model());
        let ground = watch.step(SimTime::ZERO, &testing::level_sensors(), RANGE_M);
        assert_eq!(ground, GroundReading::default());
    }
}
