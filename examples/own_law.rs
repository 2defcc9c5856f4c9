//! A main controller that is not ours, in about 50 lines. docs/own-law.md goes through it.
//!
//! `cargo run --example own_law` flies it under a ground station, with every option of `sitl`.

use std::process::ExitCode;

use autopilot::own_law::OwnLaw;
use flight_control::{Law, LawInput, MainCommand, Visitor};

/// Altitude by climb rate, pitch rate; roll by roll rate; airspeed by thrust; two integrals that trim.
#[derive(Clone, Default)]
pub struct MyLaw {
    elevator_rad: f64,
    thrust_m_s2: f64,
}

impl Law for MyLaw {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let LawInput { state, references, model, h, .. } = *input;
        let (aircraft, rates) = (model.aircraft(), state.rates);
        let climb_m_s = (0.2 * (references.altitude_m - state.altitude_m)).clamp(-40.0, 40.0);
        let climb_error = climb_m_s - state.climb_rate_m_s();
        let speed_error = references.airspeed_m_s - state.airspeed_m_s;
        self.elevator_rad = (self.elevator_rad - 0.0002 * climb_error * h).clamp(-0.1, 0.1);
        self.thrust_m_s2 = (self.thrust_m_s2 + 0.02 * speed_error * h).clamp(-4.0, 4.0);
        MainCommand {
            // Positive aileron rolls left, positive elevator lowers the nose.
            aileron_rad: 1.5 * (state.attitude.phi - references.roll_rad) + 0.5 * rates.x,
            elevator_rad: aircraft.trim.elevator_rad - 0.003 * climb_error
                + 1.2 * rates.y
                + 1.0 * (state.attitude.theta - aircraft.trim.theta_rad)
                + self.elevator_rad,
            rudder_rad: 0.2 * rates.z,
            thrust_n: aircraft.trim.thrust_n
                + aircraft.mass.mass_kg * (0.3 * speed_error + self.thrust_m_s2),
            ..MainCommand::default()
        }
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        visit(&mut self.elevator_rad);
        visit(&mut self.thrust_m_s2);
    }
}

fn main() -> ExitCode {
    sitl::cli::main(Some(OwnLaw::new("my law", MyLaw::default)))
}
