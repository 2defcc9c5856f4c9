//! Everything that defines a flight, as plain data, and its errors.

use host_io::problem::{Problem, problem};
use icd::effector_list::Name;
use icd::fault::Refusal;
use icd::wire::Aircraft;
use icd::{ControlPeriod, EffectorList};
use serde::{Deserialize, Serialize};

use crate::airframe::Airframe;
use crate::atmosphere::Atmosphere;
use crate::contact::Contacts;
use crate::dynamics::Dynamics;
use crate::earth::EarthModel;
use crate::faults::{self, ScheduledFault};
use crate::ground::{GroundSetup, SECTION};
use crate::limits::FlightLimits;
use crate::sensors::SensorSettings;
use crate::start::Start;
use crate::step_limit::{self, TooQuick};
use crate::wind::{DiscreteGust, WindProfile, WindSettings, check_gusts};

/// Longest default integration step, µs.
pub const DEFAULT_STEP_US: u32 = 1_000;

/// Default integration step, µs: the largest divisor of the period up to
/// [`DEFAULT_STEP_US`].
pub fn default_step_us(period: ControlPeriod) -> u32 {
    step_within(period, DEFAULT_STEP_US)
}

/// The largest divisor of the period up to `longest_us`, µs.
pub fn step_within(period: ControlPeriod, longest_us: u32) -> u32 {
    let period_us = period.as_micros();
    // One divides every period, so this ends with a divisor.
    (1..=longest_us).rev().find(|step| period_us.is_multiple_of(*step)).unwrap_or(period_us)
}

/// Everything that defines a flight; the same setup and the same commands give the same bits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantSetup {
    pub airframe: Airframe,
    /// Start position and motion.
    pub start: Start,
    pub earth: EarthModel,
    /// The ground; without it the flight ends at altitude zero.
    #[serde(default)]
    pub ground: Option<GroundSetup>,
    pub wind: WindSettings,
    /// Wind over the altitude, added to the steady one.
    pub profile: WindProfile,
    /// How much warmer the air is than the standard, K.
    pub temperature_offset_k: f64,
    pub gusts: Vec<DiscreteGust>,
    /// Errors of the sensors.
    pub sensors: SensorSettings,
    /// The faults of the scenario.
    pub faults: Vec<ScheduledFault>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Number of the run under that seed: other runs have other random streams.
    pub run: u64,
    pub period: ControlPeriod,
    /// Step of the integration, µs; must divide the period.
    pub step_us: u32,
}

/// Why a flight cannot start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// A body that no controller can fly, with its name in the airframe file.
    #[error("{0} has no [[effector]], so no controller can fly it; `sitl study checkcase` does")]
    NoEffector(Name),
    /// The integration cannot follow the aircraft.
    #[error(transparent)]
    TooQuick(#[from] Box<TooQuick>),
    /// Level flight is not possible, so the flight has no start.
    #[error("{0}")]
    Trim(Problem),
    /// A number, the step, a fault, the model or a table does not fit.
    #[error("{0}")]
    Other(Problem),
}

impl From<Problem> for SetupError {
    fn from(problem: Problem) -> Self {
        Self::Other(problem)
    }
}

impl PlantSetup {
    /// Checks all that can be checked without flying.
    pub fn check(&self) -> Result<(), SetupError> {
        if self.airframe.effectors.is_empty() {
            return Err(SetupError::NoEffector(self.airframe.name));
        }
        self.airframe.check()?;
        self.start.check("plant.start")?;
        if let Some(ground) = &self.ground {
            ground.check()?;
            if self.airframe.gear.is_none() {
                let name = self.airframe.name;
                return Err(problem!(
                    "[{SECTION}] needs [gear] in the airframe file; {name} has none"
                )
                .into());
            }
        }
        self.wind.check()?;
        self.profile.check()?;
        Atmosphere::check(self.temperature_offset_k)?;
        check_gusts(&self.gusts)?;
        self.sensors.check(self.period.as_micros())?;
        let (step_us, period_us) = (self.step_us, self.period.as_micros());
        if step_us == 0 || !period_us.is_multiple_of(step_us) {
            return Err(problem!(
                "integration step {step_us} us does not divide the control period of {period_us} us"
            )
            .into());
        }
        Ok(())
    }

    /// Beyond these the aircraft counts as lost.
    pub fn limits(&self) -> FlightLimits {
        let limits = self.airframe.limits;
        if self.ground.is_some() { limits.over_ground() } else { limits }
    }

    /// The contact points over the ground; `None` without one. Refused where the steps are too long for them.
    pub(crate) fn contacts(
        &self,
        dynamics: &Dynamics,
    ) -> Result<Option<Box<Contacts>>, SetupError> {
        let (Some(gear), Some(ground)) = (&self.airframe.gear, &self.ground) else {
            return Ok(None);
        };
        step_limit::check_contacts(gear, dynamics.mass(), self.step_us)?;
        Ok(Some(Box::new(Contacts::new(gear, ground, dynamics, self.step_us))))
    }

    /// Checks that a controller's model is of this aircraft.
    pub fn check_model(&self, model: Aircraft) -> Result<(), SetupError> {
        let airframe = self.airframe.aircraft();
        if airframe == model {
            return Ok(());
        }
        Err(problem!(
            "the airframe is {airframe}, the controller's model is of {model}: name the model with --model FILE; \
             `sitl aircraft linearize` writes it"
        )
        .into())
    }

    /// Checks that the aircraft's effectors can have the faults.
    pub fn check_faults(&self) -> Result<(), SetupError> {
        for (index, fault) in self.faults.iter().enumerate() {
            self.check_fault(fault)
                .map_err(|refusal| fault_error(&self.airframe.effectors, index, fault, refusal))?;
        }
        Ok(())
    }

    /// Checks that the aircraft can have a fault.
    pub fn check_fault(&self, fault: &ScheduledFault) -> Result<(), Refusal> {
        let Airframe { effectors, servos, .. } = &self.airframe;
        let has = self.sensors.fitted_with(&self.airframe, self.ground.is_some());
        faults::check(effectors, servos, &has, fault)
    }
}

/// The error about a fault that the aircraft cannot have.
pub(crate) fn fault_error(
    effectors: &EffectorList,
    index: usize,
    fault: &ScheduledFault,
    refusal: Refusal,
) -> SetupError {
    let refusal = refusal.described(fault.target.class(effectors));
    problem!("fault {} ({}): {refusal}", index + 1, fault.described(effectors)).into()
}
