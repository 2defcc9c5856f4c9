//! Plant and laws as one discrete system: its states, one period of it, and its linearisation.

use std::error::Error;

use autopilot::own_law::Brought;
use flight_control::{Demand, FlightControl, Navigator, Visitor};
use icd::frames::Attitude;
use icd::{Actuators, Effector, EulerAngles, PerEffector};
use lab_engine::flight::{CannotCopy, FlightSetup};
use lab_engine::law::LawFailure;
use nalgebra::{DMatrix, DVector};
use plant_sim::{Airframe, EarthModel, Plant, PlantSetup};

/// Flown before the linearisation, until plant and laws agree about the trim, s.
const SETTLING_S: f64 = 300.0;

/// Roll and pitch angle, velocity, body rates, altitude; heading and place over the ground act on nothing.
const BODY_STATES: usize = 9;

/// The aircraft in steady flight under its laws.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    plant: Plant,
    control: FlightControl,
    own: Option<Brought>,
    demand: Demand,
    effectors: Vec<Effector>,
}

/// x' = A x + B u with A for commands that stay, and C x, the change of the commands that the laws command.
#[derive(Debug, Clone)]
pub struct Linear {
    /// States in which everything that the laws command is ignored by the plant.
    pub a: DMatrix<f64>,
    /// From the commands of the effectors, rad or N.
    pub b: DMatrix<f64>,
    pub c: DMatrix<f64>,
}

impl ClosedLoop {
    /// Steady flight at the start of `setup`, over a flat Earth in still air, settled, without deadband and hysteresis.
    ///
    /// # Errors
    /// If there is no steady flight there; or the law that the program brings fails or cannot be copied.
    pub fn settled(setup: &FlightSetup) -> Result<Self, Box<dyn Error>> {
        let FlightSetup { model, parameters, own_law, .. } = setup;
        let mut setup = PlantSetup { earth: EarthModel::Flat, ..setup.plant.clone() };
        let Airframe { effectors, servos, .. } = &mut setup.airframe;
        for effector in effectors.all() {
            // They have no slope: in the small nothing moves.
            let imperfections = &mut servos[effector].imperfections;
            (imperfections.deadband, imperfections.hysteresis) = (0.0, 0.0);
        }
        let plant = Plant::new(&setup)?;
        let mut control = FlightControl::new(setup.period, model, &parameters.gains);
        control.start_at(&plant.trim().positions());
        let effectors = setup.airframe.effectors.all().collect();
        let demand = Demand {
            altitude_m: setup.start.altitude_m,
            roll_rad: 0.0,
            airspeed_m_s: setup.start.airspeed_m_s,
        };
        let own = own_law.clone().map(Brought::new);
        if own.as_ref().is_some_and(|own| own.law().copy().is_none()) {
            return Err(CannotCopy.into());
        }
        let mut settled = Self { plant, control, own, demand, effectors };
        let periods = SETTLING_S / setup.period.as_seconds();
        // Some 10^5.
        for _ in 0..periods as u64 {
            let commands = settled.command();
            settled.go_on(&commands);
        }
        match settled.own.as_ref().and_then(|own| own.law().failure()) {
            Some(failure) => Err(LawFailure(failure).into()),
            None => Ok(settled),
        }
    }

    /// The effectors, in the order of the inputs.
    pub fn effectors(&self) -> &[Effector] {
        &self.effectors
    }

    /// Commands of the laws now. Their states move on.
    pub fn command(&mut self) -> PerEffector<f64> {
        // Every sample is good, so the navigator remembers nothing.
        let state = Navigator::default().step(self.plant.time(), &self.plant.sense());
        let own = self.own.as_mut().map(Brought::law_mut);
        self.control.step_with(&state, &self.demand, own).actuators().commands
    }

    /// The plant moves on with these commands.
    pub fn go_on(&mut self, commands: &PerEffector<f64>) {
        self.plant.advance(&Actuators { commands: *commands });
    }

    /// Whether the aircraft still flies.
    pub fn flies(&self) -> bool {
        !self.plant.on_ground()
    }

    /// Turns the aircraft: adds to the body rates, rad/s.
    pub fn disturb(&mut self, rate_rad_s: f64) {
        let mut state = *self.plant.state();
        state.rigid.rates.0.add_scalar_mut(rate_rad_s);
        self.plant.go_on_from(&state);
    }

    /// Every state that acts on something.
    fn states(&mut self) -> DVector<f64> {
        let state = self.plant.state();
        let EulerAngles { phi, theta, .. } =
            Attitude::from_unit_wxyz(state.rigid.q_e_from_body).euler();
        let mut x = vec![phi, theta];
        x.extend(state.rigid.velocity.0.iter().chain(state.rigid.rates.0.iter()));
        x.push(-state.rigid.position.z);
        x.extend(self.effectors.iter().map(|effector| state.positions[*effector]));
        x.extend(self.plant.actuator_states().map(|state| *state));
        self.law_states(&mut |state| x.push(*state));
        DVector::from_vec(x)
    }

    fn set_states(&mut self, x: &DVector<f64>) {
        let mut state = *self.plant.state();
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
        self.plant.go_on_from(&state);
        self.plant.set_actuator_states(rest.by_ref().copied());
        self.law_states(&mut |state| *state = rest.next().copied().unwrap_or(*state));
    }

    /// The continuous states of the laws.
    fn law_states(&mut self, visit: &mut Visitor<'_>) {
        self.control.states(visit);
        if let Some(own) = &mut self.own {
            own.law_mut().states(visit);
        }
    }

    /// One period from `x` with `commands`: the states after it, and the commands of the laws.
    fn period(
        &self,
        x: &DVector<f64>,
        commands: &PerEffector<f64>,
    ) -> (DVector<f64>, DVector<f64>) {
        let mut other = self.clone();
        other.set_states(x);
        let commanded = other.command();
        other.go_on(commands);
        (other.states(), self.inputs(&commanded))
    }

    fn inputs(&self, commands: &PerEffector<f64>) -> DVector<f64> {
        DVector::from_iterator(
            self.effectors.len(),
            self.effectors.iter().map(|effector| commands[*effector]),
        )
    }

    /// Central differences of one period. `amplitude` is their half width in rad, rad/s, m/s, m and the units of the
    /// laws' states; for thrust it is this fraction of the engine's range.
    pub fn linearise(&self, amplitude: f64) -> Linear {
        let mut here = self.clone();
        let x = here.states();
        let steady = here.command();
        let list = &self.plant.dynamics().airframe().effectors;
        let width = |effector: Effector| {
            let servo = &self.plant.dynamics().airframe().servos[effector];
            if list.is_angle(effector) { amplitude } else { amplitude * (servo.max - servo.min) }
        };
        let (states, inputs) = (x.len(), self.effectors.len());
        let mut linear = Linear {
            a: DMatrix::zeros(states, states),
            b: DMatrix::zeros(states, inputs),
            c: DMatrix::zeros(inputs, states),
        };
        for i in 0..states {
            let servo = usize::checked_sub(i, BODY_STATES).and_then(|i| self.effectors.get(i));
            let half = servo.map_or(amplitude, |effector| width(*effector));
            let at = |d: f64| {
                let mut x = x.clone();
                x[i] += d;
                self.period(&x, &steady)
            };
            let (above, below) = (at(half), at(-half));
            linear.a.set_column(i, &((above.0 - below.0) / (2.0 * half)));
            linear.c.set_column(i, &((above.1 - below.1) / (2.0 * half)));
        }
        for (i, effector) in self.effectors.iter().enumerate() {
            let half = width(*effector);
            let at = |d: f64| {
                let mut commands = steady;
                commands[*effector] += d;
                self.period(&x, &commands).0
            };
            linear.b.set_column(i, &((at(half) - at(-half)) / (2.0 * half)));
        }
        linear
    }
}
