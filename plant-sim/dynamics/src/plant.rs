//! The plant from outside: sense, advance, truth, faults on request.
//!
//! Commands pass servos with [`Imperfections`](crate::servos::Imperfections) by delay, deadband, hysteresis, bias, and the travel that
//! the hinge moment leaves. A delay is exact to the microsecond, also between ticks. The dynamic pressure is that at the beginning of
//! each control period.
//!
//! Parts are torn off and fuel burns as the flight goes on. When the centre of gravity moves in the airframe, position and velocity
//! move with it: the rest of the aircraft flies on as it did.

use std::collections::VecDeque;

use icd::fault::{PlantReport, Refusal};
use icd::{
    Actuators, Effector, EffectorKind, FaultReply, FaultRequest, Ned, PerEffector, Sensors, SimTime,
};

use crate::airframe::Airframe;
use crate::atmosphere::Atmosphere;
use crate::contact::{ContactFailure, Contacts};
use crate::damage::PerPart;
use crate::dynamics::{Dynamics, Evaluation, State, StepInputs};
use crate::earth::{Earth, Place, Slopes};
use crate::faults::{Effects, FaultContext, Faults, ScheduledFault, micros};
use crate::release::{Controls, ReleaseSetup};
use crate::sensors::{GroundSample, SensorSet, SensorSettings};
use crate::servos::{self, Delayed, Servo};
use crate::settling;
use crate::setup::{self, PlantSetup, SetupError};
use crate::start::Start;
use crate::step_limit;
use crate::touchdown::Touchdown;
use crate::trim::{self, Trim};
use crate::truth::Truth;
use crate::wind::{self, DiscreteGust, DiscreteGusts, Gust, MovingAir, Surroundings, WindSettings};

/// Reports that wait to be fetched; when there are more, the oldest is dropped and counted.
pub const REPORTS_MAX: usize = 256;

/// An aircraft that was in the air for this long touches down, µs: at the start and in a takeoff roll it may bounce.
const TOUCHDOWN_AFTER_US: u64 = 5_000_000;

/// One flight: an aircraft in its air over its Earth, advanced one control period at a time.
///
/// ```text
/// loop { sense(); (controller); advance(&commands) }
/// ```
///
/// No call fails or panics after [`Plant::new`]. Without a ground in its setup the flight is over when the aircraft is at or below
/// altitude zero at the end of a period; with one, when a limit of its gear is passed ([`Plant::crash`]). It is also over, in its last valid state, if the state
/// stops being finite ([`Plant::is_broken`]): an absurd airframe can cause that, and no later number would be
/// meaningful.
#[derive(Debug, Clone)]
pub struct Plant {
    dynamics: Dynamics,
    trim: Trim,
    period_us: u64,
    step_us: u64,
    time: SimTime,
    state: State,
    /// Of second-order servos, rad/s and N/s.
    pub(crate) rates: PerEffector<f64>,
    inputs: StepInputs,
    /// Of `state` with `inputs`: the first stage of the next step needs it as much as `truth`.
    present: Evaluation,
    truth: Truth,
    pub(crate) faults: Faults,
    /// Of the commands; empty if all actuators are ideal.
    paths: Vec<CommandPath>,
    losses: Losses,
    turbulence: MovingAir,
    gusts: DiscreteGusts,
    sensors: SensorSet,
    reports: VecDeque<PlantReport>,
    reports_dropped: u64,
    /// With the ground of the setup.
    contacts: Option<Box<Contacts>>,
    /// Since when nothing touches, before the first touchdown.
    airborne: Option<SimTime>,
    touchdown: Option<Touchdown>,
    on_ground: bool,
    broken: Option<&'static str>,
}

/// What every kind of flight has besides its trim.
struct PlantSettings<'a> {
    wind: &'a WindSettings,
    gusts: &'a [DiscreteGust],
    /// At the start.
    airspeed_m_s: f64,
    sensors: &'a SensorSettings,
    faults: &'a [ScheduledFault],
    seed: u64,
    run: u64,
    period_us: u32,
    step_us: u32,
}

impl Plant {
    /// Checks the setup, trims the aircraft, and starts at time zero; faults due at zero are active already.
    pub fn new(setup: &PlantSetup) -> Result<Self, SetupError> {
        Self::trimmed(setup, None)
    }

    /// The same in the trimmed flight of another aircraft, from which this one differs in its actuators.
    pub fn with_trim(setup: &PlantSetup, trim: &Trim) -> Result<Self, SetupError> {
        Self::trimmed(setup, Some(trim))
    }

    fn trimmed(setup: &PlantSetup, known: Option<&Trim>) -> Result<Self, SetupError> {
        setup.check()?;
        let mut start = setup.start;
        let ground = match (setup.ground, &setup.airframe.gear) {
            (Some(ground), Some(gear)) => Some(gear.ready(ground)?),
            _ => None,
        };
        if let Some(ground) = &ground
            && let Some(along_m) = ground.start.along_m()
        {
            let here = ground.at(&Earth::new(setup.earth, ground.threshold), along_m);
            start = Start {
                altitude_m: here.altitude_m,
                heading_rad: ground.heading_rad,
                latitude_rad: here.latitude_rad,
                longitude_rad: here.longitude_rad,
                ..start
            };
        }
        let earth = Earth::new(setup.earth, start.geodetic());
        let dynamics = Dynamics::new(setup.airframe.clone(), earth)?
            .in_air(Atmosphere::new(setup.temperature_offset_k))
            .in_wind(setup.profile.clone());
        let place = dynamics.earth().place(&dynamics.earth().position(&start.geodetic()));
        let density = dynamics.atmosphere().air(place.geopotential_altitude_m).density;
        step_limit::check(&dynamics, &start, density, setup.step_us)?;
        let steady = wind::steady(&setup.wind);
        let mut contacts = setup.contacts(&dynamics)?;
        let on_runway = match (&ground, &mut contacts) {
            (Some(ground), Some(contacts)) => {
                settling::on_runway(&dynamics, contacts, ground, &start, steady)?
            }
            _ => None,
        };
        let trim = match on_runway.or(known.copied()) {
            Some(trim) => trim,
            None => trim::solve(&dynamics, &start, &steady).map_err(SetupError::Trim)?,
        };
        if let (Some(ground), Some(contacts)) = (&ground, &contacts) {
            settling::check_clear(&dynamics, contacts, ground, &trim.rigid)?;
        }
        let PlantSetup { wind, gusts, sensors, faults, seed, run, period, step_us, .. } = setup;
        let settings = PlantSettings {
            wind,
            gusts,
            airspeed_m_s: setup.start.airspeed_m_s,
            sensors,
            faults,
            seed: *seed,
            run: *run,
            period_us: period.as_micros(),
            step_us: *step_us,
        };
        Self::begin(dynamics, trim, &settings, contacts)
    }

    /// Begins a flight without a controller, in any state. Its control period is its step.
    pub fn release(setup: &ReleaseSetup) -> Result<Self, SetupError> {
        setup.check()?;
        let earth = Earth::new(setup.earth, setup.initial.origin());
        let earth = match setup.flat_gravity {
            Some(gravity) => earth.tangent(gravity),
            None => earth,
        };
        let mut dynamics = Dynamics::new(setup.airframe.clone(), earth)?
            .in_air(Atmosphere::new(setup.temperature_offset_k))
            .in_wind(setup.profile.clone());
        let steady = wind::steady(&setup.wind);
        let (trim, airspeed_m_s) = released(&mut dynamics, setup, &steady)?;
        let ReleaseSetup { wind, gusts, faults, seed, step_us, .. } = setup;
        let settings = PlantSettings {
            wind,
            gusts,
            airspeed_m_s,
            // Without a controller nobody reads them.
            sensors: &SensorSettings::IDEAL,
            faults,
            seed: *seed,
            run: 0,
            period_us: *step_us,
            step_us: *step_us,
        };
        Self::begin(dynamics, trim, &settings, None)
    }

    /// Begins with a trim that was found.
    fn begin(
        dynamics: Dynamics,
        trim: Trim,
        settings: &PlantSettings<'_>,
        contacts: Option<Box<Contacts>>,
    ) -> Result<Self, SetupError> {
        let PlantSettings { sensors, faults, seed, run, period_us, step_us, .. } = *settings;
        let (state, steady) = (trim.state(), wind::steady(settings.wind));
        let airframe = dynamics.airframe();
        let (span_m, period_s) = (airframe.aero.geometry().span_m, f64::from(period_us) / 1.0e6);
        let mut turbulence = MovingAir::new(settings.wind, span_m, period_s, seed, run);
        let mut gusts = DiscreteGusts::new(settings.gusts, period_s);
        let time = SimTime::ZERO;
        let place = dynamics.earth().place(&state.rigid.position);
        let turbulent = turbulence.step(&Surroundings {
            airspeed_m_s: settings.airspeed_m_s,
            height_m: height_m(contacts.as_deref(), &state, &place),
            attitude: dynamics.earth().attitude(&place, &state.rigid.q_e_from_body),
            wind: dynamics.wind(&steady, place.geopotential_altitude_m),
        });
        let inputs = StepInputs {
            commands: state.positions,
            wind: steady,
            gust: gusts.step(time, settings.airspeed_m_s, turbulent),
            density: dynamics.density_around(place.geopotential_altitude_m),
            slopes: Slopes::at(dynamics.earth(), &state.rigid.position, &place),
            effects: Effects::none(),
        };
        let present = dynamics.present(&state, &inputs);
        let mut plant = Self {
            truth: Truth::of(&dynamics, time, &state, &inputs, &present),
            present,
            faults: Faults::none(
                &airframe.effectors,
                &airframe.servos,
                &state.positions,
                &sensors.fitted_with(airframe, contacts.is_some()),
            ),
            losses: Losses::default(),
            paths: CommandPath::all(airframe, &state.positions),
            sensors: SensorSet::new(
                airframe,
                contacts.is_some(),
                *dynamics.atmosphere(),
                sensors,
                period_us,
                seed,
                run,
            ),
            reports: VecDeque::with_capacity(REPORTS_MAX),
            reports_dropped: 0,
            period_us: u64::from(period_us),
            step_us: u64::from(step_us),
            on_ground: false,
            broken: None,
            contacts,
            airborne: None,
            touchdown: None,
            dynamics,
            trim,
            time,
            state,
            rates: PerEffector::default(),
            inputs,
            turbulence,
            gusts,
        };
        let positions = plant.trim.positions();
        // The controller's modelled actuators begin here, so these are the healthy positions: the
        // report comes before any fault acts.
        push(&mut plant.reports, &mut plant.reports_dropped, PlantReport::Started { positions });
        // Faults that act from the start need the travel that the hinge moments leave.
        plant.update_hinge_moments();
        plant.schedule(faults)?;
        plant.with_faults(Faults::apply_due);
        // Again, now with the faults that act from the start.
        plant.observe();
        Ok(plant)
    }

    /// Positions of the effectors and of a lever that is held.
    pub fn controls(&self) -> Controls {
        Controls { positions: self.state.positions, lever: self.dynamics.jet().lever() }
    }

    /// Moves the effectors there at once, without the lag of their servos: prescribed controls.
    pub fn set_controls(&mut self, controls: &Controls) {
        self.state.positions = controls.positions;
        self.dynamics.hold_lever(controls.lever);
        self.observe();
    }

    /// Simulation time: a multiple of the control period.
    pub fn time(&self) -> SimTime {
        self.time
    }

    /// Whether the flight is over.
    pub fn on_ground(&self) -> bool {
        self.on_ground
    }

    /// Whether the flight is over because the state was not finite any more.
    pub fn is_broken(&self) -> bool {
        self.broken.is_some()
    }

    /// The quantity that was no longer finite, if that has ended the flight.
    pub fn broken_by(&self) -> Option<&'static str> {
        self.broken
    }

    /// The steady flight in which it started.
    pub fn trim(&self) -> &Trim {
        &self.trim
    }

    /// The aircraft, the air and the Earth.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// The contact points over the ground of the setup.
    pub fn contacts(&self) -> Option<&Contacts> {
        self.contacts.as_deref()
    }

    /// The limit of the gear whose violation has ended the flight.
    pub fn crash(&self) -> Option<ContactFailure> {
        self.contacts.as_ref()?.failure().filter(|_| self.on_ground)
    }

    /// The first touchdown of the flight.
    pub fn touchdown(&self) -> Option<&Touchdown> {
        self.touchdown.as_ref()
    }

    /// Kinetic and potential energy over the ground and energy in the springs of the gear, J; `None` without a ground.
    pub fn mechanical_energy_j(&self) -> Option<f64> {
        let (contacts, rigid, e) = (self.contacts.as_ref()?, &self.state.rigid, &self.present);
        let (mass, earth) = (self.dynamics.mass(), self.dynamics.earth());
        let turning = rigid.rates.0 - earth.rotation_in(&e.motion.e_from_body).0;
        let kinetic =
            mass.mass_kg * rigid.velocity.0.norm_squared() + turning.dot(&(mass.inertia * turning));
        let height_m = height_m(Some(contacts), &self.state, &e.place);
        let potential = mass.mass_kg * e.place.gravity.norm() * height_m;
        Some(0.5 * kinetic + potential + contacts.stored_j(&self.dynamics, rigid))
    }

    /// Position and motion of the aircraft, with its servos.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Continues from another state, for a linearisation: time and all other values stay.
    pub fn resume_from(&mut self, state: &State) {
        self.state = *state;
        self.observe();
    }

    /// Smallest and largest thrust of the engine at this airspeed and altitude, N; zeros without an engine.
    pub fn thrust_range_n(&self) -> [f64; 2] {
        let Evaluation { place, density, motion } = &self.present;
        let altitude_m = place.geopotential_altitude_m;
        self.dynamics.thrust_range_n(motion.air.airspeed_m_s, *density, altitude_m)
    }

    /// Roll moment on the airframe of what turns with the engine at this thrust, airspeed and altitude, N m.
    pub fn engine_roll_n_m(&self, thrust_n: f64) -> f64 {
        let Evaluation { place, density, motion } = &self.present;
        let (airspeed_m_s, altitude_m) = (motion.air.airspeed_m_s, place.geopotential_altitude_m);
        let air = self.dynamics.engine_air(airspeed_m_s, *density, altitude_m);
        self.dynamics.jet().roll_n_m(thrust_n, &air)
    }

    /// Changes the steady wind from now on: velocity of the air over the ground, m/s, where it blows to.
    pub fn set_steady_wind(&mut self, wind: Ned) {
        self.inputs.wind = wind;
        self.observe();
    }

    /// The sensor data of this instant. Draws this tick's noise: call it once each control tick.
    pub fn sense(&mut self) -> Sensors {
        let ground = self.contacts.as_ref().map(|contacts| GroundSample {
            height_m: -contacts.deepest(&self.dynamics, &self.state.rigid).1,
            load_n: contacts.load_n(),
        });
        let fuel_pct = self.dynamics.airframe().fuel.map_or(0.0, |fuel| {
            100.0 * (1.0 - self.losses.burnt_kg / fuel.initial_kg.max(f64::MIN_POSITIVE))
        });
        let Self { truth, present, inputs, faults, .. } = self;
        self.sensors.sense(truth, present, &inputs.gust, ground, fuel_pct, faults)
    }

    /// Errors of the gyros without rotation, rad/s, and of the accelerometers in level flight, m/s², without noise: for judges of
    /// an estimator.
    pub fn inertial_biases(&self) -> [icd::Body; 2] {
        self.sensors.inertial_biases()
    }

    /// The true state of this instant.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The present effects of all faults.
    pub fn fault_effects(&self) -> &Effects {
        self.faults.effects()
    }

    /// Advances one control period with these commands held.
    ///
    /// Commands beyond the travel count as its end; a command that is not finite counts as the effector's last
    /// one. On the ground this has no effect.
    pub fn advance(&mut self, actuators: &Actuators) {
        if self.on_ground {
            return;
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.set_brakes(actuators.brakes);
        }
        self.command(actuators);
        // Before the steps: the period burns by the thrust of its beginning.
        self.burn_fuel();
        let before = self.state;
        // Of the beginning of the period, like the other surroundings: the steps move `present` on.
        let height_m = height_m(self.contacts.as_deref(), &before, &self.present.place);
        self.integrate(self.time.as_micros() + self.period_us);
        let mut broken = self.state.first_not_finite();
        if broken.is_some() {
            self.state = before;
        }
        // Still of the beginning of the period: the new airspeed depends on the gust that is made
        // here.
        let airspeed_m_s = self.truth.airspeed_m_s;
        let turbulence = self.turbulence.step(&Surroundings {
            airspeed_m_s,
            height_m,
            attitude: self.truth.attitude,
            wind: self.dynamics.wind(&self.inputs.wind, self.present.place.geopotential_altitude_m),
        });
        self.inputs.gust = self.gusts.step(self.time, airspeed_m_s, turbulence);
        self.observe();
        // Forces and position can be absurd while the state is still finite.
        if broken.is_none() && !self.truth.is_bounded() {
            broken = self.truth.first_unbounded();
            self.state = before;
            self.observe();
        }
        if broken.is_some() {
            self.broken = broken;
            // To everybody else this is an end like that on the ground; `is_broken` tells the two
            // apart.
            self.touch_down();
        }
        self.note_touchdown();
        let is_down = match &self.contacts {
            None => self.truth.altitude_m <= 0.0,
            Some(contacts) => contacts.failure().is_some(),
        };
        if !self.on_ground && is_down {
            self.touch_down();
        }
    }

    /// Injects or clears a fault, now or later, and returns the answer.
    pub fn request(&mut self, request: &FaultRequest) -> FaultReply {
        if self.on_ground {
            return FaultReply::Refused(Refusal::FlightOver);
        }
        let reply = self.with_faults(|faults, context| faults.request(request, context));
        // The sensors of this instant have to show what acts at once.
        self.observe();
        reply
    }

    /// Reports every active, pausing or scheduled fault.
    pub fn list_faults(&mut self) {
        let Self { faults, reports, reports_dropped, .. } = self;
        faults.list(&mut |report| push(reports, reports_dropped, report));
    }

    /// The events that were not fetched yet, oldest first.
    pub fn pop_report(&mut self) -> Option<PlantReport> {
        self.reports.pop_front()
    }

    /// How many reports were dropped because the caller did not fetch them.
    pub fn reports_dropped(&self) -> u64 {
        self.reports_dropped
    }

    /// Steps on the grid of multiples of the step; a step with an event is split there.
    ///
    /// The caller checks for the end of the flight.
    fn integrate(&mut self, end_us: u64) {
        let mut now_us = self.time.as_micros();
        while now_us < end_us {
            let grid_us = (now_us / self.step_us + 1) * self.step_us;
            let event_us = self.faults.next_event().map_or(u64::MAX, SimTime::as_micros);
            let arrival_us = self.next_arrival().map_or(u64::MAX, SimTime::as_micros);
            // At least a microsecond, or an event that is overdue would stop the time.
            let next_us = grid_us.min(end_us).min(event_us.min(arrival_us).max(now_us + 1));
            let step_s = SimTime::from_micros(next_us - now_us).as_seconds();
            let Self { dynamics, state, rates, present, inputs, contacts, .. } = self;
            *state = match contacts {
                None => dynamics.step(state, rates, present, inputs, step_s),
                Some(contacts) => {
                    let next = match contacts.held() {
                        None => dynamics.step(state, rates, present, inputs, step_s),
                        Some(held) => {
                            dynamics.step_on_ground(state, rates, present, inputs, step_s, held)
                        }
                    };
                    contacts.finish_step(&state.rigid, &next.rigid);
                    next
                }
            };
            now_us = next_us;
            self.time = SimTime::from_micros(now_us);
            // A fault at the same microsecond finds the command that has just arrived.
            if arrival_us <= now_us {
                self.deliver_due_commands();
            }
            if event_us <= now_us {
                self.with_faults(Faults::apply_due);
            } else if self.faults.varies() {
                self.faults.vary(self.time, &mut self.state.positions);
                self.hold_faults();
            }
            // At the end of the period `observe` does this, with the next gust.
            if now_us < end_us {
                self.evaluate();
            }
        }
    }

    /// Applies the events of the faults that are due.
    fn with_faults<R>(
        &mut self,
        happens: impl FnOnce(&mut Faults, &mut FaultContext<'_>) -> R,
    ) -> R {
        let Self { faults, state, reports, reports_dropped, time, .. } = self;
        let result = happens(
            faults,
            &mut FaultContext {
                now: *time,
                positions: &mut state.positions,
                report: &mut |report| push(reports, reports_dropped, report),
            },
        );
        self.hold_faults();
        result
    }

    /// Copies the effects of the faults, which stay constant until the next event.
    fn hold_faults(&mut self) {
        self.inputs.effects = *self.faults.effects();
        // The parts that the faults have torn off.
        let torn_off = self.faults.torn_off(self.time);
        if torn_off != self.losses.torn_off {
            self.losses.torn_off = torn_off;
            self.remove_lost_mass();
        }
        self.receive();
    }

    /// Puts the faults of the setup on the list.
    fn schedule(&mut self, scheduled: &[ScheduledFault]) -> Result<(), SetupError> {
        let Self { dynamics, faults, reports, reports_dropped, .. } = self;
        let effectors = &dynamics.airframe().effectors;
        for (index, fault) in scheduled.iter().enumerate() {
            faults
                .schedule(fault, &mut |report| push(reports, reports_dropped, report))
                .map_err(|refusal| setup::fault_error(effectors, index, fault, refusal))?;
        }
        Ok(())
    }

    /// Forces and motion of this instant, with those of the ground.
    fn evaluate(&mut self) {
        let Self { dynamics, state, inputs, present, contacts, .. } = self;
        *present = dynamics.present(state, inputs);
        if let Some(contacts) = contacts {
            contacts.solve(dynamics, &state.rigid, &state.positions, present);
        }
    }

    /// Data of this instant that sensors, judges and the next step share, computed once.
    fn observe(&mut self) {
        self.evaluate();
        let altitude_m = self.present.place.geopotential_altitude_m;
        if !self.inputs.density.covers(altitude_m) {
            self.inputs.density = self.dynamics.density_around(altitude_m);
        }
        let position = &self.state.rigid.position;
        if !self.inputs.slopes.cover(position) {
            self.inputs.slopes = Slopes::at(self.dynamics.earth(), position, &self.present.place);
        }
        self.truth = Truth::of(&self.dynamics, self.time, &self.state, &self.inputs, &self.present);
    }

    fn note_touchdown(&mut self) {
        let Some(contacts) = &self.contacts else { return };
        match (contacts.is_bearing(), &mut self.airborne) {
            (false, airborne @ None) => *airborne = Some(self.time),
            (true, Some(since)) => {
                let flown_us = self.time.micros_since(*since);
                self.airborne = None;
                match &mut self.touchdown {
                    Some(touchdown) => touchdown.bounces += 1,
                    None if flown_us >= TOUCHDOWN_AFTER_US => {
                        let (along_m, across_m) =
                            contacts.on_runway_m(&self.state.rigid.position, &self.present.place);
                        self.touchdown = Some(Touchdown::of(&self.truth, along_m, across_m));
                    }
                    None => {}
                }
            }
            _ => {}
        }
    }

    fn touch_down(&mut self) {
        self.on_ground = true;
        let report = PlantReport::GroundContact { at: self.time };
        push(&mut self.reports, &mut self.reports_dropped, report);
    }

    /// Sends commands to the effectors, which follow them now or after their delay.
    fn command(&mut self, actuators: &Actuators) {
        let Airframe { effectors, servos, .. } = self.dynamics.airframe();
        let (count, now) = (effectors.len(), self.time);
        let idle_n = self.contacts.as_ref().and_then(|contacts| contacts.idle_n());
        let on_ground = idle_n.and_then(|idle_n| {
            let (mut servos, engine) = (*servos, effectors.only(EffectorKind::Engine)?);
            servos[engine].min = servos[engine].min.min(idle_n);
            Some(servos)
        });
        let servos = on_ground.as_ref().unwrap_or(servos);
        // Ideal actuators need no paths: they cost nothing and keep the bits that they have without
        // any.
        if self.paths.is_empty() {
            let previous = self.faults.commands();
            let commands = servos::accepted(count, servos, &actuators.commands, previous);
            self.faults.command(&commands, now);
            self.inputs.commands = *self.faults.received();
            return;
        }
        let previous = PerEffector::from_values(self.paths.iter().map(|path| path.sent));
        let commands = servos::accepted(count, servos, &actuators.commands, &previous);
        for path in &mut self.paths {
            path.sent = commands[path.effector];
            let due = SimTime::from_micros(now.as_micros() + path.delay_us);
            path.pending.push(due, path.sent);
        }
        // First the travel, since commands without a delay arrive right after, inside of it.
        self.update_hinge_moments();
        self.deliver_due_commands();
    }

    /// When the next command arrives.
    fn next_arrival(&self) -> Option<SimTime> {
        self.paths.iter().filter_map(|path| path.pending.next()).min()
    }

    /// Hands every command that is due to the servos and their faults.
    fn deliver_due_commands(&mut self) {
        for path in &mut self.paths {
            if let Some(command) = path.pending.due(self.time) {
                self.faults.command_one(path.effector, path.pass(command), self.time);
            }
        }
        self.hold_faults();
    }

    /// Sets the travel that the hinge moments leave at the present dynamic pressure.
    fn update_hinge_moments(&mut self) {
        let pressure_pa = self.truth.dynamic_pressure_pa();
        for path in &mut self.paths {
            path.travel = path.servo.travel_at(pressure_pa);
            self.faults.limit_travel(path.effector, path.travel);
        }
    }

    /// Copies what the servos receive, inside the travel that the hinge moments leave.
    fn receive(&mut self) {
        self.inputs.commands = *self.faults.received();
        for path in &self.paths {
            let ([low, high], command) = (path.travel, &mut self.inputs.commands[path.effector]);
            // The command of an engine that is out is below its travel.
            if path.servo.imperfections.stall_pressure_pa.is_some() {
                *command = command.max(low).min(high);
            }
        }
    }

    /// States of the actuators besides the positions, for a linearisation: of every second-order servo its rate, rad/s or N/s, of
    /// every late effector the command that it follows now and those on their way, rad or N.
    pub fn actuator_states(&mut self) -> impl Iterator<Item = &mut f64> {
        let inert = &self.dynamics.airframe().servos;
        let rates = self.rates.iter_mut();
        let rates = rates.filter(|(effector, _)| inert[*effector].second_order.is_some());
        let late = self.paths.iter_mut().filter(|path| path.delay_us > 0);
        let commands = late
            .flat_map(|path| std::iter::once(&mut path.followed).chain(path.pending.commands()));
        rates.map(|(_, rate)| rate).chain(commands)
    }

    /// Sets [`Plant::actuator_states`].
    pub fn set_actuator_states(&mut self, mut values: impl Iterator<Item = f64>) {
        for state in self.actuator_states() {
            *state = values.next().unwrap_or(*state);
        }
        for path in self.paths.iter_mut().filter(|path| path.delay_us > 0) {
            self.faults.command_one(path.effector, path.pass(path.followed), self.time);
        }
        self.hold_faults();
    }

    /// Burns the fuel of one control period at the present thrust. Without fuel the engine is out, whatever is repaired.
    fn burn_fuel(&mut self) {
        let Some(fuel) = self.dynamics.airframe().fuel else { return };
        let period_s = self.period_us as f64 * 1.0e-6;
        // A propeller that brakes makes no fuel.
        let flow_kg_s = fuel.flow_kg_n_s * self.present.motion.thrust_n.max(0.0);
        let burnt_kg = (self.losses.burnt_kg + flow_kg_s * period_s).min(fuel.initial_kg);
        // Mass and inertia are worked out again only while fuel burns.
        if burnt_kg != self.losses.burnt_kg {
            self.losses.burnt_kg = burnt_kg;
            self.remove_lost_mass();
        }
        let Some(engine) = self.dynamics.jet().engine() else { return };
        if burnt_kg >= fuel.initial_kg {
            self.with_faults(|faults, context| faults.starve(engine, context));
        }
    }

    fn remove_lost_mass(&mut self) {
        let before = self.dynamics.shift_m();
        self.dynamics.remove_lost_mass(&self.losses.torn_off, self.losses.burnt_kg);
        let moved = self.dynamics.shift_m() - before;
        let rigid = &mut self.state.rigid;
        // The airframe stays where it is; only the point that the state describes moves.
        rigid.position += rigid.e_from_body() * moved;
        rigid.velocity.0 += rigid.rates.0.cross(&moved);
        // The step that comes begins with the forces on what is left.
        self.evaluate();
    }
}

/// Height above the ground, without one above altitude zero, m.
fn height_m(contacts: Option<&Contacts>, state: &State, place: &Place) -> f64 {
    let elevation_m =
        |contacts: &Contacts| contacts.under(&state.rigid.position, place).elevation_m;
    contacts.map_or(place.altitude_m, |contacts| place.altitude_m - elevation_m(contacts))
}

fn push(reports: &mut VecDeque<PlantReport>, dropped: &mut u64, report: PlantReport) {
    if reports.len() == REPORTS_MAX {
        reports.pop_front();
        *dropped += 1;
    }
    reports.push_back(report);
}

/// The way of the commands to one effector, rad or N.
#[derive(Debug, Clone)]
struct CommandPath {
    effector: Effector,
    servo: Servo,
    delay_us: u64,
    pending: Delayed,
    /// The latest command, which arrives after the delay.
    sent: f64,
    /// The last command that the deadband let through.
    followed: f64,
    /// The same behind the play.
    played: f64,
    /// Ends of the travel that the hinge moment leaves.
    travel: [f64; 2],
}

impl CommandPath {
    /// Those of an aircraft whose effectors are at rest at these positions; none if all its actuators are ideal.
    pub fn all(airframe: &Airframe, positions: &PerEffector<f64>) -> Vec<Self> {
        let Airframe { effectors, servos, .. } = airframe;
        if effectors.all().all(|effector| servos[effector].imperfections.are_none()) {
            return Vec::new();
        }
        let path = |effector: Effector| {
            let (servo, at) = (servos[effector], positions[effector]);
            Self {
                effector,
                servo,
                delay_us: micros(servo.imperfections.delay_s),
                pending: Delayed::new(),
                sent: at,
                followed: at,
                played: at,
                travel: [servo.min, servo.max],
            }
        };
        effectors.all().map(path).collect()
    }

    /// What the servo gets of a command that has arrived: deadband, play, bias, travel.
    fn pass(&mut self, command: f64) -> f64 {
        let imperfections = &self.servo.imperfections;
        if (command - self.followed).abs() > imperfections.deadband {
            self.followed = command;
        }
        let half = 0.5 * imperfections.hysteresis;
        self.played = self.played.max(self.followed - half).min(self.followed + half);
        // The travel comes last, since no bias pushes a surface beyond its stop.
        self.servo.limited(self.played + imperfections.bias)
    }
}

/// What the aircraft has lost.
#[derive(Debug, Clone, Copy, Default)]
struct Losses {
    torn_off: PerPart<f64>,
    burnt_kg: f64,
}

/// A body slower than this, m/s, has no aerodynamic motion that the integration would have to follow.
const SLOWEST_CHECKED_M_S: f64 = 1.0;

/// The state in which a flight without a controller begins, steady only if it asks for that, and its true airspeed, m/s; `dynamics`
/// gets the lever of its engine.
fn released(
    dynamics: &mut Dynamics,
    setup: &ReleaseSetup,
    steady: &Ned,
) -> Result<(Trim, f64), SetupError> {
    let ReleaseSetup { initial, controls, .. } = setup;
    let earth = dynamics.earth();
    let (theta_rad, elevator_rad, controls) = if initial.is_trimmed {
        let trim = trim::solve_longitudinal(dynamics, initial, controls, steady)
            .map_err(SetupError::Trim)?;
        (trim.theta_rad, trim.elevator_rad, trim.controls)
    } else {
        (initial.attitude.theta, 0.0, *controls)
    };
    let rigid = initial.rigid(earth, theta_rad);
    let here = earth.geodetic(&rigid.position);
    // Before the forces: the thrust follows the lever.
    dynamics.hold_lever(controls.lever);
    let place = dynamics.earth().place(&rigid.position);
    let density = dynamics.density_around(place.geopotential_altitude_m);
    let e = dynamics.evaluate(&rigid, &controls.positions, steady, &Gust::none(), &density);
    let airspeed_m_s = e.motion.air.airspeed_m_s;
    let start = Start {
        altitude_m: place.altitude_m,
        airspeed_m_s,
        heading_rad: initial.attitude.psi,
        latitude_rad: here.latitude_rad,
        longitude_rad: here.longitude_rad,
    };
    if airspeed_m_s >= SLOWEST_CHECKED_M_S {
        step_limit::check(dynamics, &start, e.density, setup.step_us)?;
    }
    let mut positions = controls.positions;
    if let Some(engine) = dynamics.jet().engine() {
        // The thrust that a lever gives, so that the log begins with it.
        positions[engine] = e.motion.thrust_n;
    }
    let trim = Trim {
        alpha_rad: e.motion.air.alpha_rad,
        theta_rad,
        elevator_rad,
        aileron_rad: 0.0,
        rudder_rad: 0.0,
        thrust_n: e.motion.thrust_n,
        positions,
        turn_rate_rad_s: 0.0,
        beta_rad: e.motion.air.beta_rad,
        rigid,
    };
    Ok((trim, airspeed_m_s))
}

#[cfg(test)]
mod tests;
