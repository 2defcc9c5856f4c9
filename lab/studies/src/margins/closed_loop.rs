//! Plant and laws as one discrete system: its states, one period of it, and its linearisation.

use std::error::Error;

use autopilot::vehicle::schedule::{ReferenceEntry, ReferenceSchedule};
use icd::frames::Attitude;
use icd::{Effector, EulerAngles, PerEffector, SimTime};
use lab_engine::flight::{CannotCopy, Flight, FlightSetup};
use lab_judges::loops::Linear;
use nalgebra::{DMatrix, DVector};
use plant_sim::EarthModel;

/// Flown before the linearisation, until plant and laws agree about the trim, s.
const SETTLING_S: f64 = 300.0;

/// Roll and pitch angle, velocity, body rates, altitude; heading and place over the ground act on nothing.
const BODY_STATES: usize = 9;

/// The aircraft in steady flight under its laws.
#[derive(Debug)]
pub struct ClosedLoop {
    flight: Flight,
    effectors: Vec<Effector>,
}

impl ClosedLoop {
    /// Steady level flight at the start of `setup`, over a flat Earth, settled, without deadband and hysteresis; an error if the
    /// aircraft does not get there.
    pub fn settled(setup: &FlightSetup) -> Result<Self, Box<dyn Error>> {
        let mut setup = setup.clone();
        // On a rotating Earth the trimmed flight turns, so nothing would be steady.
        setup.plant.earth = EarthModel::Flat;
        // Not the end of a flight: the callers decide how long it goes on.
        setup.duration = SimTime::from_seconds(1.0e6).unwrap_or(setup.duration);
        let start = setup.plant.start;
        setup.references = ReferenceSchedule::new(vec![ReferenceEntry {
            at_s: 0.0,
            altitude_m: Some(start.altitude_m),
            roll_deg: Some(0.0),
            airspeed_m_s: Some(start.airspeed_m_s),
        }])?;
        let airframe = &mut setup.plant.airframe;
        for effector in airframe.effectors.all() {
            // They have no slope: in the small nothing moves.
            let imperfections = &mut airframe.servos[effector].imperfections;
            (imperfections.deadband, imperfections.hysteresis) = (0.0, 0.0);
        }
        let effectors = airframe.effectors.all().collect();
        let mut flight = Flight::new(&setup)?;
        // Before the long settling: a law that cannot be copied cannot be linearised.
        flight.copy()?;
        flight.skip_unread_verdict();
        // Some 10^5.
        let periods = SETTLING_S / setup.plant.period.as_seconds();
        let lost = (0..periods as u64).any(|_| flight.step([]).is_none());
        match flight.failure() {
            Some(failure) => Err(failure.into()),
            None if lost => Err("the aircraft is lost before it is settled".into()),
            None => Ok(Self { flight, effectors }),
        }
    }

    /// The same flight once more.
    pub fn copy(&self) -> Self {
        let copied: Result<_, CannotCopy> = self.flight.copy();
        let flight = copied.expect("its law was copied at the start");
        Self { flight, effectors: self.effectors.clone() }
    }

    /// The effectors, in the order of the inputs.
    pub fn effectors(&self) -> &[Effector] {
        &self.effectors
    }

    /// Commands of the laws that the plant obeys in the next period.
    pub fn commands(&self) -> PerEffector<f64> {
        self.flight.commands().copied().unwrap_or_default()
    }

    /// One period in which the plant obeys these commands; `None` if the aircraft is lost.
    pub fn step(&mut self, commands: &PerEffector<f64>) -> Option<()> {
        self.flight.replace_commands(*commands);
        self.flight.step([]).map(drop)
    }

    /// Turns the aircraft: adds to the body rates, rad/s.
    pub fn disturb(&mut self, rate_rad_s: f64) {
        let plant = self.flight.plant_mut();
        let mut state = *plant.state();
        state.rigid.rates.0.add_scalar_mut(rate_rad_s);
        plant.resume_from(&state);
    }

    /// Every state that acts on something, and the commands of the laws at the end.
    fn states(&mut self) -> DVector<f64> {
        let plant = self.flight.plant_mut();
        let state = *plant.state();
        let EulerAngles { phi, theta, .. } =
            Attitude::from_unit_wxyz(state.rigid.q_e_from_body).euler();
        // In this order `set_states` takes them back.
        let mut x = vec![phi, theta];
        x.extend(state.rigid.velocity.0.iter().chain(state.rigid.rates.0.iter()));
        x.push(-state.rigid.position.z);
        x.extend(self.effectors.iter().map(|effector| state.positions[*effector]));
        x.extend(plant.actuator_states().map(|state| *state));
        self.flight.law_states(&mut |state| x.push(*state));
        let commands = self.commands();
        x.extend(self.effectors.iter().map(|effector| commands[*effector]));
        DVector::from_vec(x)
    }

    /// Sets them; the commands stay.
    fn set_states(&mut self, x: &DVector<f64>) {
        let plant = self.flight.plant_mut();
        let mut state = *plant.state();
        // The heading is no state: nothing depends on it.
        let psi = Attitude::from_unit_wxyz(state.rigid.q_e_from_body).euler().psi;
        let attitude = Attitude::from_euler(EulerAngles { phi: x[0], theta: x[1], psi });
        state.rigid.q_e_from_body = attitude.wxyz();
        state.rigid.velocity.0.copy_from(&x.fixed_rows::<3>(2));
        state.rigid.rates.0.copy_from(&x.fixed_rows::<3>(5));
        state.rigid.position.z = -x[8];
        let mut rest = x.iter().skip(BODY_STATES);
        for (effector, x) in self.effectors.iter().zip(&mut rest) {
            state.positions[*effector] = *x;
        }
        plant.resume_from(&state);
        plant.set_actuator_states(rest.by_ref().copied());
        self.flight.law_states(&mut |state| *state = rest.next().copied().unwrap_or(*state));
    }

    /// The states one period after `x` with `commands`.
    fn period(&self, x: &DVector<f64>, commands: &PerEffector<f64>) -> DVector<f64> {
        let mut other = self.copy();
        other.set_states(x);
        // On the ground nothing moves any more, and the differences say so.
        let _ = other.step(commands);
        other.states()
    }

    /// Central differences of one period. `amplitude` is their half width in rad, rad/s, m/s, m and the units of the
    /// laws' states; for thrust it is this fraction of the engine's range.
    pub fn linearise(&self, amplitude: f64) -> Linear {
        let mut here = self.copy();
        let (x, steady) = (here.states(), self.commands());
        let airframe = self.flight.plant().dynamics().airframe();
        let width = |effector: Effector| {
            let servo = &airframe.servos[effector];
            let is_angle = airframe.effectors.is_angle(effector);
            if is_angle { amplitude } else { amplitude * (servo.max - servo.min) }
        };
        let (states, inputs) = (x.len(), self.effectors.len());
        let first_command = states - inputs;
        let mut linear = Linear {
            a: DMatrix::zeros(states, states),
            b: DMatrix::zeros(states, inputs),
            c: DMatrix::zeros(inputs, states),
        };
        // What the plant obeys is an input here, so the commands among the states act on nothing.
        for i in 0..first_command {
            let servo = usize::checked_sub(i, BODY_STATES).and_then(|i| self.effectors.get(i));
            let half = servo.map_or(amplitude, |effector| width(*effector));
            let at = |d: f64| {
                let mut x = x.clone();
                x[i] += d;
                self.period(&x, &steady)
            };
            linear.a.set_column(i, &((at(half) - at(-half)) / (2.0 * half)));
        }
        for (i, effector) in self.effectors.iter().enumerate() {
            let half = width(*effector);
            let at = |d: f64| {
                let mut commands = steady;
                commands[*effector] += d;
                self.period(&x, &commands)
            };
            linear.b.set_column(i, &((at(half) - at(-half)) / (2.0 * half)));
            linear.c[(i, first_command + i)] = 1.0;
        }
        linear
    }
}
