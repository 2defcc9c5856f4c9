//! Which of the two makes the navigation state of a flight: the samples, or the estimator.

use icd::{Sensors, SimTime};

use crate::aircraft_model::AircraftModel;
use crate::estimator::{Estimator, StateSource};
use crate::gains::Gains;
use crate::navigation::{NavigationState, Navigator};
use crate::on_wheels::{GroundReading, OnWheels};

/// The ground may rise so far above that of the takeoff, m, before a lower height counts as wrong.
const TERRAIN_M: f64 = 50.0;

/// Sensors to [`NavigationState`], by [`Navigator`] or [`Estimator`]; the first control step of a flight decides.
#[derive(Debug, Clone)]
pub struct NavigationSource {
    source: StateSource,
    navigator: Navigator,
    estimator: Estimator,
    on_wheels: OnWheels,
    height_max_m: f64,
    /// Altitude where the aircraft last stood, and of the last step, m.
    ground_m: Option<f64>,
    altitude_m: f64,
    /// Whether the estimator flies; `None` before the first step.
    estimates: Option<bool>,
}

impl NavigationSource {
    /// Before the first samples of a flight. `aircraft` and `gains` are validated by the caller.
    pub fn new(aircraft: &AircraftModel, gains: &Gains) -> Self {
        let of_estimator = gains.of_estimator();
        let mut estimator = Estimator::new(aircraft, of_estimator, gains.selection.earth);
        estimator.set_runway(gains.ground.runway_rad());
        Self {
            source: gains.selection.state,
            navigator: Navigator::default(),
            estimator,
            on_wheels: OnWheels::new(aircraft),
            height_max_m: of_estimator.height_max_m,
            ground_m: None,
            altitude_m: 0.0,
            estimates: None,
        }
    }

    /// Takes other gains of the estimator from the next step on; the choice between the two stays that of the flight.
    pub fn set_gains(&mut self, gains: &Gains) {
        self.estimator.set_gains(gains.of_estimator());
        self.estimator.set_runway(gains.ground.runway_rad());
        self.height_max_m = gains.of_estimator().height_max_m;
        if self.estimates.is_none() {
            self.source = gains.selection.state;
        }
    }

    /// One tick.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> NavigationState {
        let chosen = match self.source {
            StateSource::Automatic => !sensors.attitude.valid,
            StateSource::Samples => false,
            StateSource::Estimator => true,
        };
        // Once for the flight: an attitude unit that fails later does not call the estimator.
        let estimates = *self.estimates.get_or_insert(chosen);
        let ground = self.on_wheels.step(time, sensors, self.height_max_m);
        let GroundReading { over_ground, height_m, on_wheels } = ground;
        let rough_height_m = self.rough_height_m(height_m);
        let state = match estimates {
            true => {
                let ground = GroundReading { height_m: rough_height_m, ..ground };
                self.estimator.step_over(ground, time, sensors)
            }
            false => self.navigator.step(time, sensors),
        };
        self.altitude_m = state.altitude_m;
        if on_wheels && state.valid.altitude {
            self.ground_m = Some(state.altitude_m - height_m.unwrap_or(0.0));
        }
        let height_above_ground_m = height_m;
        NavigationState { over_ground, height_above_ground_m, rough_height_m, on_wheels, ..state }
    }

    /// The measured height where the altitude above the ground of the takeoff lets it be right; without one that altitude.
    fn rough_height_m(&self, height_m: Option<f64>) -> Option<f64> {
        let Some(ground_m) = self.ground_m else { return height_m };
        let above_m = self.altitude_m - ground_m;
        Some(height_m.map_or(above_m, |height_m| height_m.max(above_m - TERRAIN_M)))
    }

    /// The state at these samples while time stands still: nothing is remembered of it, because the number of such looks depends on
    /// wall time.
    pub fn look(&self, time: SimTime, sensors: &Sensors) -> NavigationState {
        match self.estimates {
            Some(true) if self.estimator.time() >= time => self.estimator.state(),
            None | Some(_) => self.clone().step(time, sensors),
        }
    }

    /// The estimator, where it flies.
    pub fn estimator(&self) -> Option<&Estimator> {
        (self.estimates == Some(true)).then_some(&self.estimator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn first_state(source: StateSource, has_unit: bool) -> NavigationState {
        let mut gains = Gains::REFERENCE;
        gains.selection.state = source;
        let mut sensors = testing::level_sensors();
        sensors.attitude.valid = has_unit;
        NavigationSource::new(&testing::aircraft_model(), &gains).step(SimTime::ZERO, &sensors)
    }

    #[test]
    fn the_samples_are_the_state_where_there_is_an_attitude_unit() {
        let samples = Navigator::default().step(SimTime::ZERO, &testing::level_sensors());
        assert_eq!(first_state(StateSource::Automatic, true), samples);
        assert_eq!(first_state(StateSource::Samples, true), samples);
        assert!(first_state(StateSource::Samples, false).estimate.is_none());
        assert!(first_state(StateSource::Automatic, false).estimate.is_some());
        assert!(first_state(StateSource::Estimator, true).estimate.is_some());
    }

    #[test]
    fn a_unit_that_fails_later_does_not_change_the_choice_of_the_flight() {
        let mut source = NavigationSource::new(&testing::aircraft_model(), &Gains::REFERENCE);
        let mut sensors = testing::level_sensors();
        source.step(SimTime::ZERO, &sensors);
        sensors.attitude.valid = false;
        assert!(source.step(SimTime::from_micros(2_000), &sensors).estimate.is_none());
        assert!(source.estimator().is_none());
    }

    #[test]
    fn a_height_that_cannot_be_right_is_replaced_by_the_altitude_above_the_takeoff() {
        let mut source = NavigationSource::new(&testing::aircraft_model(), &Gains::REFERENCE);
        let mut rough = |tick: u64, altitude_m: f64, load_n: f64, height_m: Option<f64>| {
            let mut sensors = testing::level_sensors();
            sensors.fitted = [true; Sensors::SENSORS];
            sensors.weight_on_wheels_n.valid = true;
            sensors.weight_on_wheels_n.value = load_n;
            sensors.radar_altimeter_m.valid = height_m.is_some();
            sensors.radar_altimeter_m.value = height_m.unwrap_or(0.0);
            sensors.barometer.value.altitude_m = altitude_m;
            sensors.gnss.value.altitude_m = altitude_m;
            let step = |source: &mut NavigationSource, tick| {
                source.step(SimTime::from_micros(tick), &sensors).rough_height_m
            };
            // What it knows is of the step before.
            step(&mut source, 100_000 * tick);
            step(&mut source, 100_000 * tick + 50_000)
        };
        assert_eq!(rough(1, 700.0, 90_000.0, Some(0.0)), Some(0.0), "it stands");
        assert_eq!(rough(20, 780.0, 0.0, Some(60.0)), Some(60.0), "over a hill");
        assert_eq!(rough(40, 1_200.0, 0.0, Some(60.0)), Some(450.0), "it sticks");
        assert_eq!(rough(60, 1_200.0, 0.0, None), Some(500.0), "it is away");
    }
}
