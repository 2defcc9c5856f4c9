//! Control on the ground: a law of its own for the time between touchdown and lift-off, in which the laws of flight rest.
//!
//! Attitude by the surfaces, as far as the air lets them act, heading by rudder and nose wheel. Without wheels and wind over the
//! surfaces nothing of it acts.

use icd::{AxisGains, Effector};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::design_model::{DesignModel, FlightCondition};
use crate::navigation::NavigationState;
use crate::signals::MainCommand;

gain_set! {
    /// Gains of the law on the ground.
    GroundGains at ground {
        /// Bandwidth of the attitude, rad/s.
        attitude_rad_s = 3.0, "GND_ATT" "rad/s", 0.1 to 10.0, "Bandwidth of the attitude in takeoff roll and rollout";
        /// Fastest change of the pitch reference, rad/s.
        rotation_rad_s = 0.06, "GND_ROT_RATE" "rad/s", 0.005 to 1.0, "Pitch rate of the rotation";
        /// Bandwidth of the heading, 1/s.
        heading_per_s = 0.5, "GND_HDG" "1/s", 0.01 to 10.0, "Bandwidth of the heading";
        /// Wheel base over the ratio of the steering, m: rudder is yaw rate times this over the speed.
        steering_m = 10.0, "GND_STEER" "m", 0.01 to 1000.0, "Wheel base over the ratio of the nose wheel steering";
        /// Heading of the runway, deg from north; negative: not known.
        runway_deg = -1.0, "GND_RWY_HDG" "deg", -1.0 to 360.0, "Heading of the aircraft before its takeoff, of the runway, from true north; negative: by the magnetometer";
    }
}

impl GroundGains {
    /// Heading of the runway, rad from north, where it is known.
    pub fn runway_rad(&self) -> Option<f64> {
        (self.runway_deg >= 0.0).then(|| self.runway_deg.to_radians())
    }
}

/// What the law on the ground is to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GroundDemand {
    /// Heading to be steered, rad from north; `None`: rudder and nose wheel neutral. In the air, just before a touchdown, the one to
    /// which the rudder turns the nose.
    pub heading_rad: Option<f64>,
    /// Pitch attitude to be taken, rad; `None`: elevator and nozzle neutral.
    pub pitch_rad: Option<f64>,
    /// All the thrust there is; otherwise idle.
    pub full_thrust: bool,
    /// Wheel brakes, 0 to 1.
    pub brakes: f64,
}

impl GroundDemand {
    /// To stand with the brakes on, or to come to a stop.
    pub const STAND: Self =
        Self { heading_rad: None, pitch_rad: None, full_thrust: false, brakes: 1.0 };
}

/// Slower than this nothing is steered, m/s.
const STEERED_MIN_M_S: f64 = 0.5;
/// Slower than this the rudder does not turn farther, m/s.
const STEERING_M_S: f64 = 5.0;
/// A missing yaw rate is met by this times the wheel angle that would give it, and its integral by this, 1/s.
const STEERING_FEEDBACK: f64 = 4.0;
const STEERING_INTEGRAL_PER_S: f64 = 4.0;
const YAW_INTEGRAL_MAX_RAD: f64 = 0.5;
/// Largest lateral acceleration that is steered, m/s².
const LATERAL_MAX_M_S2: f64 = 2.0;
/// Surfaces with less effect than this are left alone, rad/s² and rad/s² per rad.
const EFFECT_MIN: f64 = 0.02;
/// Above this pitch angle the nose wheel does not steer, rad.
const NOSE_UP_RAD: f64 = 0.05;
/// The pitch reference leads the aircraft by no more than this, rad.
const AHEAD_RAD: f64 = 0.05;

/// The state of the law.
#[derive(Debug, Clone, Default)]
pub struct GroundControl {
    /// Pitch reference under way, rad.
    pitch_rad: Option<f64>,
    /// Integral of the pitch error, rad s.
    pitch_integral: f64,
    /// Integral of the missing yaw rate, rad.
    yaw_integral_rad: f64,
}

impl GroundControl {
    /// One control period of `h` s.
    pub fn step(
        &mut self,
        state: &NavigationState,
        demand: &GroundDemand,
        gains: &GroundGains,
        model: &DesignModel,
        at: &FlightCondition,
        h: f64,
    ) -> MainCommand {
        let GroundGains { attitude_rad_s: w, rotation_rad_s, .. } = *gains;
        let (p, q) = (state.rates.x, state.rates.y);
        let attitude = &state.attitude;
        let effectors = &model.aircraft().effectors;
        let effect = |gain| effect(model, at, gain);
        // Elevator and nozzle share the pitch by their travel: the elevators of the jet alone could not raise the nose.
        let [_, elevator_max] = effectors.command_range(|gains| gains.pitch);
        let nozzle = model.nozzle_effectors()[0];
        let nozzle_max = nozzle.map_or(0.0, |nozzle| effectors.servos[nozzle].max);
        let full_pitch = effect(|gains| gains.pitch).y.abs() * elevator_max
            + nozzle.map_or(0.0, |nozzle| model.effect(at, nozzle).y) * nozzle_max;
        let pitch = match demand.pitch_rad {
            None => {
                (self.pitch_rad, self.pitch_integral) = (None, 0.0);
                0.0
            }
            Some(wanted_rad) => {
                let before = self.pitch_rad.unwrap_or(attitude.theta);
                let most = rotation_rad_s * h;
                let reference = before + (wanted_rad - before).clamp(-most, most);
                // Where nothing moves yet it does not run away.
                let reference = reference.min(attitude.theta + AHEAD_RAD);
                self.pitch_rad = Some(reference);
                let error = reference - attitude.theta;
                let demanded = w * w * (error + w * self.pitch_integral) - 2.0 * w * q;
                if demanded.abs() < full_pitch {
                    self.pitch_integral += error * h;
                }
                demanded
            }
        };
        let share =
            if full_pitch > EFFECT_MIN { (pitch / full_pitch).clamp(-1.0, 1.0) } else { 0.0 };
        // An aircraft that has its attitude, as on a catapult, leaves with the elevator of level flight.
        let near = demand.pitch_rad.map_or(0.0, |wanted_rad| {
            (1.0 - (wanted_rad - attitude.theta).abs() / AHEAD_RAD).max(0.0)
        });
        let trim_rad = if near > 0.0 { near * model.trim(state, at).elevator_rad } else { 0.0 };
        let roll = -w * w * attitude.phi - 2.0 * w * p;
        let roll_effect = effect(|gains| gains.roll).x;
        let aileron_rad = if roll_effect.abs() > EFFECT_MIN { roll / roll_effect } else { 0.0 };
        let thrust_n = model.thrust_range_n()[usize::from(demand.full_thrust)];
        let main = MainCommand {
            aileron_rad,
            // A positive elevator command pitches down.
            elevator_rad: trim_rad - share * elevator_max,
            nozzle_pitch_rad: share * nozzle_max,
            rudder_rad: self.steer(state, demand.heading_rad, gains, h),
            thrust_n,
            ..MainCommand::default()
        };
        match demand.heading_rad {
            // The nose wheel is in the air: the wind would turn the nose.
            Some(heading_rad) if attitude.theta > NOSE_UP_RAD => {
                align(state, heading_rad, gains, model, at, main)
            }
            _ => main,
        }
    }
}

/// Angular acceleration by the surfaces of an axis, rad/s² per rad of its command.
fn effect(model: &DesignModel, at: &FlightCondition, gain: fn(&AxisGains) -> f64) -> Vector3<f64> {
    let effectors = &model.aircraft().effectors;
    let of = |e: Effector| model.effect(at, e) * gain(&effectors.gains[e]);
    effectors.list.all().map(of).sum()
}

/// The command of flight with another rudder: it turns the nose to a heading, rad from north, whatever the wind does with it. Without a
/// rudder it changes nothing.
pub fn align(
    state: &NavigationState,
    heading_rad: f64,
    gains: &GroundGains,
    model: &DesignModel,
    at: &FlightCondition,
    main: MainCommand,
) -> MainCommand {
    let rudder = effect(model, at, |gains| gains.yaw).z;
    if rudder.abs() < EFFECT_MIN {
        return main;
    }
    let w = gains.attitude_rad_s;
    let error = libm::remainder(heading_rad - state.attitude.psi, core::f64::consts::TAU);
    let by_itself = model.bare_airframe(state, at).z;
    let rudder_rad = (w * w * error - 2.0 * w * state.rates.z - by_itself) / rudder;
    MainCommand { rudder_rad, ..main }
}

impl GroundControl {
    /// Rudder command with which the nose wheel turns the aircraft to a heading, rad; positive turns left.
    fn steer(
        &mut self,
        state: &NavigationState,
        heading_rad: Option<f64>,
        gains: &GroundGains,
        h: f64,
    ) -> f64 {
        let speed_m_s = libm::hypot(state.velocity.0.x, state.velocity.0.y);
        let Some(heading_rad) = heading_rad.filter(|_| speed_m_s >= STEERED_MIN_M_S) else {
            self.yaw_integral_rad = 0.0;
            return 0.0;
        };
        let error = libm::remainder(heading_rad - state.attitude.psi, core::f64::consts::TAU);
        let most = LATERAL_MAX_M_S2 / speed_m_s;
        let rate = (gains.heading_per_s * error).clamp(-most, most);
        let missing = rate - state.rates.z;
        // The wind turns the nose all the time.
        self.yaw_integral_rad = (self.yaw_integral_rad + missing * h)
            .clamp(-YAW_INTEGRAL_MAX_RAD, YAW_INTEGRAL_MAX_RAD);
        let feedback =
            STEERING_FEEDBACK * missing + STEERING_INTEGRAL_PER_S * self.yaw_integral_rad;
        -gains.steering_m * (rate + feedback) / speed_m_s.max(STEERING_M_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::{EulerAngles, Ned};

    fn rolling(speed_m_s: f64, attitude: EulerAngles) -> NavigationState {
        NavigationState {
            airspeed_m_s: speed_m_s,
            altitude_m: 0.0,
            velocity: Ned::new(speed_m_s * attitude.psi.cos(), speed_m_s * attitude.psi.sin(), 0.0),
            attitude,
            on_wheels: true,
            rates: Vector3::zeros(),
            ..NavigationState::at_rest()
        }
    }

    fn step(
        control: &mut GroundControl,
        state: &NavigationState,
        demand: &GroundDemand,
    ) -> MainCommand {
        let model = DesignModel::new(testing::aircraft_model());
        let at = model.condition(state);
        control.step(state, demand, &GroundGains::REFERENCE, &model, &at, 0.002)
    }

    const LEVEL: EulerAngles = EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 };

    #[test]
    fn every_command_turns_towards_its_reference() {
        let run = GroundDemand {
            heading_rad: Some(0.2),
            pitch_rad: Some(0.15),
            full_thrust: true,
            brakes: 0.0,
        };
        let mut control = GroundControl::default();
        let attitude = EulerAngles { phi: 0.05, theta: 0.0, psi: 0.0 };
        let mut command = MainCommand::default();
        for _ in 0..500 {
            command = step(&mut control, &rolling(90.0, attitude), &run);
        }
        // A positive aileron rolls left, a positive elevator pitches down, a positive rudder yaws left.
        assert!(
            command.aileron_rad > 0.0 && command.elevator_rad < 0.0 && command.rudder_rad < 0.0
        );
        let model = DesignModel::new(testing::aircraft_model());
        assert_eq!(command.thrust_n, model.thrust_range_n()[1]);
        // A nose that does not come up holds the reference.
        assert!((control.pitch_rad.unwrap() - AHEAD_RAD).abs() < 1.0e-9);
        let back = EulerAngles { psi: 0.4, ..LEVEL };
        assert!(step(&mut control, &rolling(90.0, back), &run).rudder_rad > 0.0);
        // Coming to a stop without a heading it keeps the one that it has.
        assert_eq!(step(&mut control, &rolling(90.0, back), &GroundDemand::STAND).rudder_rad, 0.0);
    }

    #[test]
    fn the_rudder_turns_the_nose_while_its_wheel_is_in_the_air_and_meets_the_wind() {
        let model = DesignModel::new(testing::aircraft_model());
        let at_pitch = |theta, beta| {
            let attitude = EulerAngles { phi: 0.0, theta, psi: 0.2 };
            NavigationState { beta, ..rolling(90.0, attitude) }
        };
        let run = GroundDemand { heading_rad: Some(0.2), ..GroundDemand::STAND };
        // On its heading nothing is to be steered, but for a wind from the right that turns the nose into itself.
        let [up, down] = [0.1, 0.0].map(|theta| {
            step(&mut GroundControl::default(), &at_pitch(theta, 0.1), &run).rudder_rad
        });
        assert!(up > 0.01 && down == 0.0, "{up} and {down}");
        let left = at_pitch(0.1, 0.0);
        let to_the_right = GroundDemand { heading_rad: Some(0.3), ..run };
        assert!(step(&mut GroundControl::default(), &left, &to_the_right).rudder_rad < 0.0);
        // It gives the acceleration that the bandwidth asks for.
        let at = model.condition(&left);
        let main = MainCommand { thrust_n: 1.0, ..MainCommand::default() };
        let gains = GroundGains::REFERENCE;
        let turned = align(&left, 0.3, &gains, &model, &at, main);
        let by_rudder = effect(&model, &at, |gains| gains.yaw).z * turned.rudder_rad;
        let wanted = gains.attitude_rad_s * gains.attitude_rad_s * 0.1;
        let by_itself = model.bare_airframe(&left, &at).z;
        assert!((by_rudder + by_itself - wanted).abs() < 1.0e-9, "{by_rudder} of {wanted}");
        assert_eq!(turned, MainCommand { rudder_rad: turned.rudder_rad, ..main });
    }

    #[test]
    fn an_aircraft_at_its_pitch_angle_has_the_elevator_of_level_flight() {
        let model = DesignModel::new(testing::aircraft_model());
        let state = rolling(110.0, EulerAngles { theta: 0.15, ..LEVEL });
        let trim = model.trim(&state, &model.condition(&state)).elevator_rad;
        let run = GroundDemand { pitch_rad: Some(0.15), ..GroundDemand::STAND };
        let command = step(&mut GroundControl::default(), &state, &run).elevator_rad;
        assert!(trim.abs() > 0.01 && (command - trim).abs() < 1.0e-9, "{command} of {trim}");
    }

    #[test]
    fn standing_still_everything_is_neutral_at_idle() {
        let state = NavigationState { airspeed_m_s: 0.0, ..rolling(0.0, LEVEL) };
        let command = step(&mut GroundControl::default(), &state, &GroundDemand::STAND);
        let idle = DesignModel::new(testing::aircraft_model()).thrust_range_n()[0];
        assert_eq!(command, MainCommand { thrust_n: idle, ..MainCommand::default() });
    }
}
