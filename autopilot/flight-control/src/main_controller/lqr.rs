//! Linear quadratic regulator with integral action about the trim of level flight.
//!
//! B. D. O. Anderson, J. B. Moore, "Optimal Control: Linear Quadratic Methods", Prentice Hall 1990. The gains are
//! parameters; `sitl aircraft design lqr` solves the discrete Riccati equation for a model file and writes them into a file.

use serde::{Deserialize, Serialize};

use super::{Integral, Law, LawInput, MainCommand, Visitor};

/// Gains of the regulator: u = u_trim - K (x - x_trim).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LqrGains {
    /// Elevator, rad.
    pub elevator: LongitudinalRow,
    /// Thrust per mass, m/s².
    pub thrust: LongitudinalRow,
    /// Aileron, rad.
    pub aileron: LateralRow,
    /// Rudder, rad.
    pub rudder: LateralRow,
    /// Largest altitude error that the law sees, m.
    pub error_max_m: f64,
}

/// Gains of one input on the longitudinal states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LongitudinalRow {
    /// Per m/s of climb rate.
    pub climb: f64,
    /// Per m/s of airspeed error, measured minus reference.
    pub airspeed: f64,
    /// Per rad of pitch angle.
    pub theta: f64,
    /// Per rad/s of pitch rate.
    pub q: f64,
    /// Per m of altitude error, measured minus reference.
    pub altitude: f64,
    /// Per m s of its integral.
    pub altitude_i: f64,
    /// Per m of the integral of the airspeed error.
    pub airspeed_i: f64,
}

/// Gains of one input on the lateral states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LateralRow {
    /// Per rad of sideslip.
    pub beta: f64,
    /// Per rad/s of roll rate.
    pub p: f64,
    /// Per rad/s of yaw rate.
    pub r: f64,
    /// Per rad of roll angle error, measured minus reference.
    pub phi: f64,
    /// Per rad s of its integral.
    pub phi_i: f64,
}

impl LqrGains {
    /// What `sitl aircraft design lqr` gives for the shipped model file; the design states its Q and R.
    pub const REFERENCE: Self = Self {
        elevator: LongitudinalRow {
            climb: -0.00672113,
            airspeed: 0.00200537,
            theta: -0.897625,
            q: -0.963808,
            altitude: -0.00217256,
            altitude_i: -9.89655e-5,
            airspeed_i: 0.000176029,
        },
        thrust: LongitudinalRow {
            climb: -0.00607536,
            airspeed: 0.357434,
            theta: -0.828364,
            q: -0.29715,
            altitude: 0.00478392,
            altitude_i: 0.000198364,
            airspeed_i: 0.0198171,
        },
        aileron: LateralRow {
            beta: 6.05377,
            p: -0.422124,
            r: -1.21233,
            phi: -1.29237,
            phi_i: -0.0199075,
        },
        rudder: LateralRow {
            beta: 2.07129,
            p: 0.0110129,
            r: -1.00497,
            phi: 0.0346783,
            phi_i: -4.88049e-5,
        },
        error_max_m: 200.0,
    };
}

/// Largest elevator of the altitude integrator, rad.
const ELEVATOR_INTEGRAL_MAX: f64 = 0.2;
/// Largest aileron of the roll integrator, rad.
const AILERON_INTEGRAL_MAX: f64 = 0.2;
/// The altitude integrator runs while the error is below this part of the largest that the law sees.
const ALTITUDE_BAND: f64 = 0.3;

/// The regulator: gains, integrals of the errors, and the trim about which it flies.
#[derive(Debug, Clone)]
pub struct Lqr {
    gains: LqrGains,
    /// Integral of the altitude error, m s.
    altitude: Integral,
    /// Integral of the airspeed error, m.
    speed: Integral,
    /// Integral of the roll angle error, rad s.
    roll: Integral,
}

/// A bound on an integral whose gain is `gain`, so that it moves its effector by `most` at most.
// Without a gain the integral moves nothing, and no bound would hold it.
fn bound(most: f64, gain: f64) -> f64 {
    if gain == 0.0 { 0.0 } else { most / gain.abs() }
}

impl Lqr {
    /// With empty integrators.
    pub fn new(gains: &LqrGains) -> Self {
        let empty = Integral::default();
        Self { gains: *gains, altitude: empty, speed: empty, roll: empty }
    }

    /// Takes new gains; the integrators stay.
    pub fn set_gains(&mut self, gains: &LqrGains) {
        self.gains = *gains;
    }

    fn integrate(&mut self, input: &LawInput<'_>) {
        let LawInput { state, references, saturated, model, h, .. } = *input;
        let LqrGains { elevator, thrust, aileron, .. } = &self.gains;
        let altitude = state.altitude_m - references.altitude_m;
        let most = self.gains.error_max_m;
        let altitude = if altitude.abs() < ALTITUDE_BAND * most {
            altitude
        } else if state.over_ground && elevator.altitude != 0.0 {
            // What the steady climb lacks of the one that the largest error asks for: where the airspeed of a slow aircraft is wrong, the
            // elevator of its trim is, and the error alone does not replace it.
            let lead_s = (elevator.climb + elevator.theta / model.aircraft().trim.airspeed_m_s)
                / elevator.altitude;
            let lacking = altitude.clamp(-most, most) + lead_s * state.climb_rate_m_s();
            // What the engine cannot give is none of it.
            if saturated.thrust.blocks(-lacking) { 0.0 } else { lacking }
        } else {
            0.0
        };
        // Too high asks for positive elevator, which lowers the nose.
        if !saturated.elevator.blocks(altitude) {
            let most = bound(ELEVATOR_INTEGRAL_MAX, elevator.altitude_i);
            self.altitude.add(altitude * h, most);
        }
        let speed = state.airspeed_m_s - references.airspeed_m_s;
        // Too fast asks for less thrust.
        if !saturated.thrust.blocks(-speed) {
            let aircraft = model.aircraft();
            let most = aircraft.effectors.thrust_range_n()[1] / aircraft.mass.mass_kg;
            self.speed.add(speed * h, bound(most, thrust.airspeed_i));
        }
        let roll = state.attitude.phi - references.roll_rad;
        // Too far right asks for positive aileron, which rolls left.
        if !saturated.aileron.blocks(roll) {
            self.roll.add(roll * h, bound(AILERON_INTEGRAL_MAX, aileron.phi_i));
        }
    }
}

impl Law for Lqr {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        self.integrate(input);
        let LawInput { state, references, model, .. } = *input;
        let (trim, aircraft) = (input.model.trim(input.state, input.at), model.aircraft());
        let most = self.gains.error_max_m;
        let altitude = (state.altitude_m - references.altitude_m).clamp(-most, most);
        let longitudinal = |row: &LongitudinalRow| {
            -(row.climb * state.climb_rate_m_s()
                + row.airspeed * (state.airspeed_m_s - references.airspeed_m_s)
                + row.theta * (state.attitude.theta - trim.theta_rad)
                + row.q * (state.rates.y - trim.pitch_rate_rad_s)
                + row.altitude * altitude
                + row.altitude_i * self.altitude.value()
                + row.airspeed_i * self.speed.value())
        };
        let lateral = |row: &LateralRow| {
            -(row.beta * state.beta
                + row.p * state.rates.x
                + row.r * state.rates.z
                + row.phi * (state.attitude.phi - references.roll_rad)
                + row.phi_i * self.roll.value())
        };
        MainCommand {
            aileron_rad: lateral(&self.gains.aileron),
            elevator_rad: trim.elevator_rad + longitudinal(&self.gains.elevator),
            rudder_rad: lateral(&self.gains.rudder),
            nozzle_pitch_rad: 0.0,
            nozzle_yaw_rad: 0.0,
            thrust_n: aircraft.trim.thrust_n
                + aircraft.mass.mass_kg * longitudinal(&self.gains.thrust),
        }
    }

    /// Elevator and thrust give the two longitudinal integrals, the aileron the lateral one.
    fn start_from(&mut self, input: &LawInput<'_>, command: &MainCommand) {
        // Without time, so that the integrators of this trial step stay empty.
        let input = LawInput { h: 0.0, ..*input };
        let without = Self::new(&self.gains).step(&input);
        let aircraft = input.model.aircraft();
        let elevator = without.elevator_rad - command.elevator_rad;
        let thrust = (without.thrust_n - command.thrust_n) / aircraft.mass.mass_kg;
        let LqrGains { elevator: e, thrust: t, aileron, .. } = &self.gains;
        let determinant = e.altitude_i * t.airspeed_i - e.airspeed_i * t.altitude_i;
        // Without gains of the integrals there is nothing to start.
        if determinant != 0.0 {
            let altitude = (elevator * t.airspeed_i - e.airspeed_i * thrust) / determinant;
            let speed = (e.altitude_i * thrust - t.altitude_i * elevator) / determinant;
            self.altitude.start(altitude, bound(ELEVATOR_INTEGRAL_MAX, e.altitude_i));
            let most = aircraft.effectors.thrust_range_n()[1] / aircraft.mass.mass_kg;
            self.speed.start(speed, bound(most, t.airspeed_i));
        }
        if aileron.phi_i != 0.0 {
            let roll = (without.aileron_rad - command.aileron_rad) / aileron.phi_i;
            self.roll.start(roll, bound(AILERON_INTEGRAL_MAX, aileron.phi_i));
        }
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        for integral in [&mut self.altitude, &mut self.speed, &mut self.roll] {
            visit(integral.state());
        }
    }
}
