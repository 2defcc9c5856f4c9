//! The plant from outside: sense, advance, truth, faults on request.

use std::collections::VecDeque;

use icd::fault::PlantReport;
use icd::fault::Refusal;
use icd::{Actuators, FaultReply, FaultRequest, Ned, PerEffector, Sensors, SimTime};

use crate::atmosphere::Atmosphere;
use crate::dynamics::{Dynamics, Evaluation, State, StepInputs};
use crate::earth::Earth;
use crate::earth::slopes::Slopes;
use crate::faults::{Effects, FaultContext, Faults, ScheduledFault};
use crate::release::{Controls, ReleaseSetup};
use crate::sensors::{SensorSet, SensorSettings};
use crate::setup::{self, PlantSetup, SetupError};
use crate::step_limit;
use crate::trim::{self, Trim};
use crate::truth::Truth;
use crate::wind::{self, DiscreteGust, DiscreteGusts, MovingAir, Surroundings, WindSettings};

mod actuation;
mod losses;
mod released;

use actuation::CommandPath;
use losses::Losses;
use released::released;

/// Reports that wait to be fetched; when there are more, the oldest is dropped and counted.
pub const REPORTS_MAX: usize = 256;

/// One flight: an aircraft in its air over its Earth, advanced one control period at a time.
///
/// ```text
/// loop { sense(); (controller); advance(&commands) }
/// ```
///
/// No call fails or panics after [`Plant::new`]. The flight is over when the aircraft is at or below
/// altitude zero at the end of a period. It is also over, in its last valid state, if the state
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
    on_ground: bool,
    broken: Option<&'static str>,
}

/// The air at the start.
struct StartAir<'a> {
    wind: &'a WindSettings,
    gusts: &'a [DiscreteGust],
    /// The steady wind, m/s, local NED.
    steady: Ned,
    airspeed_m_s: f64,
}

/// What every kind of flight has besides its start.
struct Settings<'a> {
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
        setup.check()?;
        let earth = Earth::new(setup.earth, setup.start.geodetic());
        let dynamics = Dynamics::new(setup.airframe.clone(), earth)?
            .in_air(Atmosphere::new(setup.temperature_offset_k))
            .in_wind(setup.profile.clone());
        let start = dynamics.earth().place(&dynamics.earth().position(&setup.start.geodetic()));
        let density = dynamics.atmosphere().air(start.geopotential_altitude_m).density;
        step_limit::check(&dynamics, &setup.start, density, setup.step_us)
            .map_err(|found| SetupError::TooQuick(Box::new(found)))?;
        let steady = wind::steady(&setup.wind);
        let trim = trim::solve(&dynamics, &setup.start, &steady)?;
        let PlantSetup { wind, gusts, sensors, faults, seed, run, period, step_us, .. } = setup;
        let air = StartAir { wind, gusts, steady, airspeed_m_s: setup.start.airspeed_m_s };
        let (seed, run, period_us) = (*seed, *run, period.as_micros());
        let settings = Settings { sensors, faults, seed, run, period_us, step_us: *step_us };
        Self::begin(dynamics, trim, &air, &settings)
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
        let trim = released(&mut dynamics, setup, &steady)?;
        let airspeed_m_s = trim.airspeed_m_s;
        let ReleaseSetup { wind, gusts, faults, seed, step_us, .. } = setup;
        let air = StartAir { wind, gusts, steady, airspeed_m_s };
        let sensors = &SensorSettings::IDEAL;
        let (seed, run, step_us) = (*seed, 0, *step_us);
        let settings = Settings { sensors, faults, seed, run, period_us: step_us, step_us };
        Self::begin(dynamics, trim.trim, &air, &settings)
    }

    /// Begins with a trim that was found.
    fn begin(
        dynamics: Dynamics,
        trim: Trim,
        air: &StartAir<'_>,
        settings: &Settings<'_>,
    ) -> Result<Self, SetupError> {
        let Settings { sensors, faults, seed, run, period_us, step_us } = *settings;
        let state = trim.state();
        let airframe = dynamics.airframe();
        let (span_m, period_s) = (airframe.aero.geometry().span_m, f64::from(period_us) / 1.0e6);
        let mut turbulence = MovingAir::new(air.wind, span_m, period_s, seed, run);
        let mut gusts = DiscreteGusts::new(air.gusts, period_s);
        let time = SimTime::ZERO;
        let place = dynamics.earth().place(&state.rigid.position);
        let turbulent = turbulence.step(&Surroundings {
            airspeed_m_s: air.airspeed_m_s,
            height_m: place.altitude_m,
            attitude: dynamics.earth().attitude(&place, &state.rigid.q_e_from_body),
            wind: dynamics.wind(&air.steady, place.geopotential_altitude_m),
        });
        let inputs = StepInputs {
            commands: state.positions,
            wind: air.steady,
            gust: gusts.step(time, air.airspeed_m_s, turbulent),
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
                &sensors.fitted_with(airframe),
            ),
            losses: Losses::default(),
            paths: CommandPath::all(airframe, &state.positions),
            sensors: SensorSet::new(airframe, sensors, period_us, seed, run)
                .in_air(*dynamics.atmosphere()),
            reports: VecDeque::with_capacity(REPORTS_MAX),
            reports_dropped: 0,
            period_us: u64::from(period_us),
            step_us: u64::from(step_us),
            on_ground: false,
            broken: None,
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
        push(&mut plant.reports, &mut plant.reports_dropped, PlantReport::Started { positions });
        plant.feel_hinge_moments();
        plant.schedule(faults)?;
        plant.let_events_happen();
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

    /// Position and motion of the aircraft, with its servos.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Continues from another state, for a linearisation: time and all other values stay.
    pub fn go_on_from(&mut self, state: &State) {
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
        let altitude_m = place.geopotential_altitude_m;
        self.dynamics.engine_roll_n_m(thrust_n, motion.air.airspeed_m_s, *density, altitude_m)
    }

    /// The sensor data of this instant. Draws this tick's noise: call it once each control tick.
    pub fn sense(&mut self) -> Sensors {
        self.sensors.sense(&self.truth, &self.present, &self.inputs.gust, &self.faults)
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
        self.command(actuators);
        self.burn_fuel();
        let before = self.state;
        self.integrate(self.time.as_micros() + self.period_us);
        let mut broken = self.state.first_not_finite();
        if broken.is_some() {
            self.state = before;
        }
        let airspeed_m_s = self.truth.airspeed_m_s;
        let turbulence = self.turbulence.step(&Surroundings {
            airspeed_m_s,
            height_m: self.truth.altitude_m,
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
            self.touch_down();
        }
        if !self.on_ground && self.truth.altitude_m <= 0.0 {
            self.touch_down();
        }
    }

    /// Injects or clears a fault, now or later, and returns the answer.
    pub fn request(&mut self, request: &FaultRequest) -> FaultReply {
        if self.on_ground {
            return FaultReply::Refused(Refusal::FlightOver);
        }
        let reply = self.with_faults(|faults, context| faults.request(request, context));
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
            let next_us = grid_us.min(end_us).min(event_us.min(arrival_us).max(now_us + 1));
            let step_s = SimTime::from_micros(next_us - now_us).as_seconds();
            let Self { dynamics, state, rates, present, inputs, .. } = self;
            *state = dynamics.step(state, rates, present, inputs, step_s);
            now_us = next_us;
            self.time = SimTime::from_micros(now_us);
            if arrival_us <= now_us {
                self.let_commands_arrive();
            }
            if event_us <= now_us {
                self.let_events_happen();
            } else if self.faults.varies() {
                self.faults.vary(self.time, &mut self.state.positions);
                self.hold_faults();
            }
            if now_us < end_us {
                self.present = self.dynamics.present(&self.state, &self.inputs);
            }
        }
    }

    fn let_events_happen(&mut self) {
        self.with_faults(Faults::apply_due);
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
        self.lose_parts();
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

    /// Data of this instant that sensors, judges and the next step share, computed once.
    fn observe(&mut self) {
        self.present = self.dynamics.present(&self.state, &self.inputs);
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

    fn touch_down(&mut self) {
        self.on_ground = true;
        let report = PlantReport::GroundContact { at: self.time };
        push(&mut self.reports, &mut self.reports_dropped, report);
    }
}

fn push(reports: &mut VecDeque<PlantReport>, dropped: &mut u64, report: PlantReport) {
    if reports.len() == REPORTS_MAX {
        reports.pop_front();
        *dropped += 1;
    }
    reports.push_back(report);
}

#[cfg(test)]
mod tests;
