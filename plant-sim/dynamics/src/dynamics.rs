//! The aircraft in its air over its Earth: the complete state, and its derivative.
//!
//! One evaluation runs down the signal path: effective deflections, air, forces and moments, motion.

use host_io::problem::Problem;
use icd::{Body, Effector, Ned, PerEffector};
use nalgebra::{Matrix3, Vector3};

use crate::aerodynamics::{AirForces, AirState, Coefficients};
use crate::airframe::Airframe;
use crate::atmosphere::{Atmosphere, LocalDensity};
use crate::damage::{PerPart, Remainder};
use crate::earth::{Earth, Nearby, Place, Slopes};
use crate::faults::Effects;
use crate::integrator::rk4;
use crate::propulsion::Jet;
use crate::rigid_body::{self, HeldForces, MassProperties, RigidDerivative, RigidState, Wrench};
use crate::servos::{Inert, ServoDynamics};
use crate::tables::thrust::EngineAir;
use crate::wind::{Gust, WindProfile};

/// Numbers of the rigid body and of the effectors together: of an aircraft with eight at most, and of any.
const FEW_STATES: usize = rigid_body::STATES + 8;
const STATES: usize = rigid_body::STATES + Effector::MAX;
/// The same with the rates of servos that have inertia.
const STATES_WITH_RATES: usize = STATES + Effector::MAX;

/// The integrated state: the rigid body and the effectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    pub rigid: RigidState,
    /// Positions of the servos, rad; thrust, N. Faults can make the effective deflections differ: see
    /// [`crate::faults`].
    pub positions: PerEffector<f64>,
}

/// Inputs of the integration that stay constant during a step.
#[derive(Debug, Clone, Copy)]
pub struct StepInputs {
    /// Commands inside the travel, rad and N.
    pub commands: PerEffector<f64>,
    /// Steady wind, m/s, local NED, where it blows to.
    pub wind: Ned,
    pub gust: Gust,
    /// Density of the still air around the present altitude.
    pub density: LocalDensity,
    /// How the Earth changes around the present position.
    pub slopes: Slopes,
    /// Effects of the faults.
    pub effects: Effects,
}

/// The aircraft, the air and the Earth.
#[derive(Debug, Clone)]
pub struct Dynamics {
    airframe: Airframe,
    mass: MassProperties,
    /// What is left of an aircraft that has lost parts or burnt fuel.
    remainder: Option<Box<Remainder>>,
    servo_dynamics: ServoDynamics,
    /// The servos of second order.
    inert: Vec<Inert>,
    air: AirForces,
    jet: Jet,
    needs_mach: bool,
    earth: Earth,
    atmosphere: Atmosphere,
    /// Wind over the altitude, besides the steady one of [`StepInputs`].
    profile: WindProfile,
}

/// Result of one evaluation at the present instant.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    pub place: Place,
    /// Density of the air, kg/m³.
    pub density: f64,
    /// Forces and motion of the aircraft.
    pub motion: Motion,
}

/// Forces on the aircraft and the resulting motion.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Turns body axes into frame E.
    pub e_from_body: Matrix3<f64>,
    /// Velocity of the centre of gravity relative to the air, m/s.
    pub velocity: Body,
    /// Motion relative to the air.
    pub air: AirState,
    /// Thrust of the engine, N.
    pub thrust_n: f64,
    /// Smallest and largest thrust in this air, N.
    pub thrust_limits: [f64; 2],
    /// All forces but gravity, and all moments.
    pub wrench: Wrench,
    /// The resulting derivative of the rigid body.
    pub derivative: RigidDerivative,
}

/// Effectors among `N` states.
const fn effectors_of<const N: usize>() -> usize {
    if N == STATES_WITH_RATES { Effector::MAX } else { N - rigid_body::STATES }
}

impl State {
    /// The first `N` numbers of it.
    #[inline]
    fn to_array<const N: usize>(self) -> [f64; N] {
        let mut x = [0.0; N];
        x[..rigid_body::STATES].copy_from_slice(&self.rigid.to_array());
        let count = effectors_of::<N>();
        x[rigid_body::STATES..][..count].copy_from_slice(self.positions.first(count));
        x
    }

    #[inline]
    fn from_array<const N: usize>(x: &[f64; N]) -> Self {
        let (mut rigid, mut positions) = ([0.0; rigid_body::STATES], [0.0; Effector::MAX]);
        rigid.copy_from_slice(&x[..rigid_body::STATES]);
        let count = effectors_of::<N>();
        positions[..count].copy_from_slice(&x[rigid_body::STATES..][..count]);
        Self { rigid: RigidState::from_array(&rigid), positions: PerEffector::new(positions) }
    }

    /// The first quantity that is not finite; `None` if all are.
    pub fn first_not_finite(&self) -> Option<&'static str> {
        let numbers = self.to_array::<STATES>();
        // All at once: a look at each with a jump takes three times as many instructions.
        if numbers.iter().fold(true, |all, x| all & x.is_finite()) {
            return None;
        }
        let index = numbers.iter().position(|x| !x.is_finite())?;
        Some(match index {
            0..3 => "position",
            3..7 => "attitude",
            7..10 => "velocity",
            10..rigid_body::STATES => "body rates",
            _ => "effector position",
        })
    }
}

impl Dynamics {
    pub fn new(airframe: Airframe, earth: Earth) -> Result<Self, Problem> {
        airframe.check()?;
        let mass = airframe.mass_properties().expect("the check refuses impossible masses");
        let servo_dynamics = ServoDynamics::new(&airframe.servos);
        let inert = Inert::all(&airframe.servos);
        let air = AirForces::new(&airframe)?;
        let Airframe { effectors, nozzle, propulsion, .. } = &airframe;
        let jet = Jet::new(effectors, nozzle.as_ref(), propulsion.as_ref())?;
        let needs_mach = air.needs_mach() || propulsion.is_some();
        let (atmosphere, profile) = (Atmosphere::STANDARD, WindProfile::default());
        Ok(Self {
            mass,
            // `[mass]` counts the fuel of the start, so nothing is missing yet.
            remainder: None,
            servo_dynamics,
            inert,
            air,
            jet,
            needs_mach,
            airframe,
            earth,
            atmosphere,
            profile,
        })
    }

    /// The same in warmer or colder air.
    #[must_use]
    pub fn in_air(self, atmosphere: Atmosphere) -> Self {
        Self { atmosphere, ..self }
    }

    /// The same in a wind that changes with the altitude.
    #[must_use]
    pub fn in_wind(self, profile: WindProfile) -> Self {
        Self { profile, ..self }
    }

    /// Holds the lever of the engine, 0 to 1, whatever its command is; `None` releases it.
    pub fn hold_lever(&mut self, lever: Option<f64>) {
        self.jet.hold_lever(lever);
    }

    /// Wind at a geopotential altitude (m) where the steady wind is `steady`, m/s, NED.
    pub fn wind(&self, steady: &Ned, altitude_m: f64) -> Ned {
        // Without a profile the height need not be converted.
        if self.profile.is_empty() {
            return *steady;
        }
        let altitude_m = self.earth.altitude_m(altitude_m);
        Ned(steady.0 + self.profile.at(altitude_m).0)
    }

    /// The same with an engine that gives any commanded thrust, for the search of a steady flight.
    pub(crate) fn with_any_thrust(&self) -> Self {
        Self { jet: self.jet.without_limits(), ..self.clone() }
    }

    /// Coefficients about the centre of gravity at `air` and a geopotential altitude, m, with these effective
    /// deflections (rad), for linearisation.
    pub fn coefficients(
        &self,
        air: &AirState,
        altitude_m: f64,
        effective: &PerEffector<f64>,
    ) -> Coefficients {
        let mach = air.airspeed_m_s / self.atmosphere.speed_of_sound(altitude_m);
        self.air.coefficients(air, mach, effective)
    }

    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    pub fn earth(&self) -> &Earth {
        &self.earth
    }

    pub fn atmosphere(&self) -> &Atmosphere {
        &self.atmosphere
    }

    /// The density of the still air around a geopotential altitude in m.
    pub fn density_around(&self, geopotential_altitude_m: f64) -> LocalDensity {
        LocalDensity::of(&self.atmosphere, geopotential_altitude_m)
    }

    /// The engine and its nozzle.
    pub fn jet(&self) -> &Jet {
        &self.jet
    }

    /// Smallest and largest thrust of the engine at an airspeed (m/s), a density (kg/m³) and a geopotential altitude (m), N;
    /// zeros without an engine.
    pub fn thrust_range_n(&self, airspeed_m_s: f64, density: f64, altitude_m: f64) -> [f64; 2] {
        let Some(engine) = self.jet.engine() else { return [0.0; 2] };
        let servo = &self.airframe.servos[engine];
        let at = self.engine_air(airspeed_m_s, density, altitude_m);
        self.jet
            .thrust_range_n(&at)
            .map_or([servo.min, servo.max], |ends| ends.map(|end| servo.limited(end)))
    }

    /// Forces and motion of the body with these effective deflections (rad; thrust in N).
    pub fn evaluate(
        &self,
        rigid: &RigidState,
        effective: &PerEffector<f64>,
        wind: &Ned,
        gust: &Gust,
        density: &LocalDensity,
    ) -> Evaluation {
        let place = self.earth.place(&rigid.position);
        let mut nearby = place.nearby(wind);
        if !self.profile.is_empty() {
            nearby.wind = place.e_from_ned * self.wind(wind, place.geopotential_altitude_m).0;
        }
        let density = density.at(nearby.geopotential_altitude_m);
        let motion = self.motion(rigid, effective, gust, &nearby, density, None);
        Evaluation { place, density, motion }
    }

    /// Forces and motion where Earth and density (kg/m³) are known already, and perhaps the limits of the thrust, N: within
    /// a step they are those of its beginning.
    fn motion(
        &self,
        rigid: &RigidState,
        effective: &PerEffector<f64>,
        gust: &Gust,
        nearby: &Nearby,
        density: f64,
        thrust_limits: Option<[f64; 2]>,
    ) -> Motion {
        let e_from_body = rigid.e_from_body();
        let mut velocity = Body(rigid.velocity.0 - gust.velocity.0);
        // In calm air, the usual case, the rotation would be work for nothing.
        if nearby.wind != Vector3::zeros() {
            velocity.0 -= e_from_body.tr_mul(&nearby.wind);
        }
        // The air turns with the Earth and with the gust, so damping knows only the rates relative to both.
        let earth_rate = self.earth.rotation_in(&e_from_body);
        // The aerodynamics counts from the centre of gravity of the airframe file.
        if let Some(remainder) = &self.remainder {
            velocity.0 -= rigid.rates.0.cross(&remainder.shift_m);
        }
        let air = AirState::new(&velocity, Body(rigid.rates.0 - earth_rate.0 - gust.rates.0));
        // The speed of sound costs a root that most aircraft do not need.
        let engine_air = match self.needs_mach {
            true => self.engine_air(air.airspeed_m_s, density, nearby.geopotential_altitude_m),
            false => EngineAir::default(),
        };
        let thrust_limits = thrust_limits.unwrap_or_else(|| self.jet.limits(&engine_air));
        let (jet, thrust_n) = self.jet.wrench(effective, &engine_air, thrust_limits);
        let mach = engine_air.mach;
        let mut wrench = self.air.wrench(&air, &velocity, density, mach, effective).plus(&jet);
        // With the jet in the sum, whose moment is about the old centre too.
        if let Some(remainder) = &self.remainder {
            wrench = remainder.wrench(&wrench, &velocity, &air.rates, density);
        }
        let gravity = &nearby.gravity;
        let derivative =
            rigid_body::derivative(rigid, &e_from_body, self.mass(), &wrench, &earth_rate, gravity);
        Motion { e_from_body, velocity, air, thrust_n, thrust_limits, wrench, derivative }
    }

    /// Effective deflections of a state: the positions with the effect of the faults.
    #[inline]
    pub fn effective(&self, state: &State, effects: &Effects) -> PerEffector<f64> {
        let count = self.airframe.effectors.len();
        match &self.remainder {
            None => effects.effective(count, &state.positions),
            Some(remainder) => remainder.effective(count, &state.positions, effects),
        }
    }

    /// Evaluates a state with these inputs.
    pub fn present(&self, state: &State, inputs: &StepInputs) -> Evaluation {
        let effective = self.effective(state, &inputs.effects);
        self.evaluate(&state.rigid, &effective, &inputs.wind, &inputs.gust, &inputs.density)
    }

    /// Adds forces that are held during a step to the evaluation of a state.
    pub fn support(&self, e: &mut Evaluation, held: &HeldForces) {
        let more = held.wrench(&e.motion.e_from_body);
        e.motion.wrench = e.motion.wrench.plus(&more);
        e.motion.derivative.add(self.mass(), &more);
    }

    /// Derivative of everything at a state inside the step that began at `start` with `present`.
    fn stage<const N: usize>(
        &self,
        x: &[f64; N],
        start: &Vector3<f64>,
        present: &Evaluation,
        inputs: &StepInputs,
        push: impl Fn(&Matrix3<f64>, &mut RigidDerivative),
    ) -> [f64; N] {
        let state = State::from_array(x);
        let position = &state.rigid.position;
        let nearby_in =
            |wind: &Ned| inputs.slopes.nearby(&self.earth, start, &present.place, position, wind);
        let mut nearby = nearby_in(&inputs.wind);
        if !self.profile.is_empty() {
            nearby = nearby_in(&self.wind(&inputs.wind, nearby.geopotential_altitude_m));
        }
        let density = inputs.density.at(nearby.geopotential_altitude_m);
        let effective = self.effective(&state, &inputs.effects);
        // A held lever makes the thrust follow the air in each stage. Otherwise the limits stay
        // those of the beginning of the step.
        let limits = self.jet.lever().is_none().then_some(present.motion.thrust_limits);
        let mut motion =
            self.motion(&state.rigid, &effective, &inputs.gust, &nearby, density, limits);
        push(&motion.e_from_body, &mut motion.derivative);
        self.with_servos(&motion.derivative, x, &state, inputs)
    }

    /// The complete derivative, from that of the body.
    #[inline]
    fn with_servos<const N: usize>(
        &self,
        body: &RigidDerivative,
        x: &[f64; N],
        state: &State,
        inputs: &StepInputs,
    ) -> [f64; N] {
        let mut rates = [0.0; N];
        rates[..rigid_body::STATES].copy_from_slice(&body.to_array());
        let count = effectors_of::<N>();
        let mut servos = self.servo_dynamics.rates(count, &inputs.commands, &state.positions);
        if N == STATES_WITH_RATES {
            for inert in &self.inert {
                let e = inert.effector;
                let (command, at) = (inputs.commands[e], state.positions[e]);
                let (rate, limit) = (STATES + e.index(), inputs.effects.of(e).rate_limit);
                [servos[e], rates[rate]] = inert.derivative(command, at, x[rate], limit);
            }
        }
        // Last: a fault decides how far a servo follows at all.
        let servos = inputs.effects.rates(count, &servos);
        rates[rigid_body::STATES..][..count].copy_from_slice(servos.first(count));
        rates
    }

    /// The state `step_s` seconds later. `present` is [`Dynamics::present`] of `state`, which a caller that evaluates
    /// every state has already. `rates` are those of second-order servos, rad/s and N/s, which move on too.
    pub fn step(
        &self,
        state: &State,
        rates: &mut PerEffector<f64>,
        present: &Evaluation,
        inputs: &StepInputs,
        step_s: f64,
    ) -> State {
        self.step_pushed(state, rates, present, inputs, step_s, |_, _| {})
    }

    /// The same with forces of the ground, which `present` has already.
    #[cold]
    pub fn step_on_ground(
        &self,
        state: &State,
        rates: &mut PerEffector<f64>,
        present: &Evaluation,
        inputs: &StepInputs,
        step_s: f64,
        held: &HeldForces,
    ) -> State {
        let push = |e_from_body: &Matrix3<f64>, derivative: &mut RigidDerivative| {
            derivative.add(self.mass(), &held.wrench(e_from_body));
        };
        self.step_pushed(state, rates, present, inputs, step_s, push)
    }

    /// The same with what else pushes in every stage but the first.
    #[inline]
    fn step_pushed(
        &self,
        state: &State,
        rates: &mut PerEffector<f64>,
        present: &Evaluation,
        inputs: &StepInputs,
        step_s: f64,
        push: impl Fn(&Matrix3<f64>, &mut RigidDerivative),
    ) -> State {
        if !self.inert.is_empty() {
            return self.step_with_rates(state, rates, present, inputs, step_s, push);
        }
        // RK4 works on every number four times, so an aircraft with few effectors gets the shorter
        // array.
        match self.airframe.effectors.len() {
            ..=8 => {
                let x = state.to_array::<FEW_STATES>();
                self.step_of(&x, state, present, inputs, step_s, push).0
            }
            _ => {
                let x = state.to_array::<STATES>();
                self.step_of(&x, state, present, inputs, step_s, push).0
            }
        }
    }

    /// The same with servos of second order.
    #[cold]
    fn step_with_rates(
        &self,
        state: &State,
        rates: &mut PerEffector<f64>,
        present: &Evaluation,
        inputs: &StepInputs,
        step_s: f64,
        push: impl Fn(&Matrix3<f64>, &mut RigidDerivative),
    ) -> State {
        let mut x: [f64; STATES_WITH_RATES] = state.to_array();
        x[STATES..].copy_from_slice(rates.as_array());
        let (mut next, x) = self.step_of(&x, state, present, inputs, step_s, push);
        for inert in &self.inert {
            let (e, effect) = (inert.effector, inputs.effects.of(inert.effector));
            // A servo that a fault holds or moves has no rate of its own.
            rates[e] = effect.following * x[STATES + e.index()];
            let (at, rate) = (&mut next.positions[e], &mut rates[e]);
            inert.settle(inputs.commands[e], at, rate, effect.rate_limit);
        }
        next
    }

    /// The same with the first `N` states, and their numbers.
    #[inline]
    fn step_of<const N: usize>(
        &self,
        x: &[f64; N],
        state: &State,
        present: &Evaluation,
        inputs: &StepInputs,
        step_s: f64,
        push: impl Fn(&Matrix3<f64>, &mut RigidDerivative),
    ) -> (State, [f64; N]) {
        // The first stage is the evaluation that the caller has already made.
        let k1 = self.with_servos(&present.motion.derivative, x, state, inputs);
        let start = &state.rigid.position;
        let x = rk4(x, &k1, step_s, |x| self.stage(x, start, present, inputs, &push));
        let next = State::from_array(&x);
        // RK4 does not keep the length of the quaternion.
        (State { rigid: next.rigid.normalised(), ..next }, x)
    }

    /// The air that the engine works in, with its Mach number: airspeed, m/s, density, kg/m³, and geopotential altitude, m.
    #[inline]
    pub(crate) fn engine_air(&self, airspeed_m_s: f64, density: f64, altitude_m: f64) -> EngineAir {
        let mach = airspeed_m_s / self.atmosphere.speed_of_sound(altitude_m);
        EngineAir { airspeed_m_s, density, mach, altitude_m }
    }

    /// Present mass and inertia.
    #[inline]
    pub fn mass(&self) -> &MassProperties {
        self.remainder.as_ref().map_or(&self.mass, |remainder| &remainder.mass)
    }

    /// Present centre of gravity from that of the airframe file, m, body axes.
    pub fn shift_m(&self) -> Vector3<f64> {
        self.remainder.as_ref().map_or_else(Vector3::zeros, |remainder| remainder.shift_m)
    }

    /// Takes away parts of the airframe and fuel: the fraction of the span that each part has lost, and what is burnt, kg; of parts
    /// that [`Airframe::parts`](crate::Airframe::parts) lets go.
    pub fn remove_lost_mass(&mut self, torn_off: &PerPart<f64>, burnt_kg: f64) {
        self.remainder = self.airframe.without(torn_off, burnt_kg).map(Box::new);
    }
}
