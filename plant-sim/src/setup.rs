//! Everything that defines a flight, as plain data, and its errors.

use host_io::problem::Problem;
use icd::effector_list::Name;
use icd::fault::{Refusal, TargetClass};
use icd::wire::Aircraft;
use icd::{ControlPeriod, EffectorList};
use serde::{Deserialize, Serialize};

use crate::airframe::Airframe;
use crate::atmosphere::Atmosphere;
use crate::earth::EarthModel;
use crate::faults::{self, ScheduledFault};
use crate::range::RangeError;
use crate::sensors::SensorSettings;
use crate::start::Start;
use crate::step_limit::TooQuick;
use crate::trim::TrimError;
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
    (1..=longest_us).rev().find(|step| period_us.is_multiple_of(*step)).unwrap_or(period_us)
}

/// Everything that defines a flight; the same setup and the same commands give the same bits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantSetup {
    pub airframe: Airframe,
    /// Start position and motion.
    pub start: Start,
    pub earth: EarthModel,
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
    /// A number outside its range, in the unit of the configuration files.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// The step does not fit the control period.
    #[error("integration step {step_us} us does not divide the control period of {period_us} us")]
    Step {
        /// The refused step, µs.
        step_us: u32,
        /// The control period, µs.
        period_us: u32,
    },
    /// A fault that the aircraft cannot have.
    #[error("fault {number} ({fault}): {}", refusal.described(*class))]
    Fault {
        /// Number of the fault, from 1, in the order of the setup.
        number: usize,
        /// The fault, in words.
        fault: String,
        /// The units of the refusal.
        class: TargetClass,
        refusal: Refusal,
    },
    /// A fault that will be requested, and that the aircraft cannot have.
    #[error("{request}: {}", refusal.described(*class))]
    Request {
        /// The request, with its place.
        request: String,
        /// The units of the refusal.
        class: TargetClass,
        refusal: Refusal,
    },
    /// The controller's model is of another aircraft.
    #[error("the airframe is {airframe}, the controller's model is of {model}")]
    OtherAircraft {
        /// Name in the airframe file.
        airframe: Box<Aircraft>,
        /// Name in the model file.
        model: Box<Aircraft>,
    },
    /// A body that no controller can fly.
    #[error(
        "{airframe} has no [[effector]], so no controller can fly it; `sitl study checkcase` does"
    )]
    NoEffector {
        /// Name in the airframe file.
        airframe: Name,
    },
    /// The integration cannot follow the aircraft.
    #[error(transparent)]
    TooQuick(Box<TooQuick>),
    /// Its tables cannot be evaluated.
    #[error("{0}")]
    Tables(Problem),
    /// Level flight is not possible, so the flight has no start.
    #[error(transparent)]
    Trim(#[from] TrimError),
}

impl From<Problem> for SetupError {
    fn from(problem: Problem) -> Self {
        Self::Tables(problem)
    }
}

impl PlantSetup {
    /// Checks all that can be checked without flying.
    pub fn check(&self) -> Result<(), SetupError> {
        if self.airframe.effectors.is_empty() {
            return Err(SetupError::NoEffector { airframe: self.airframe.name });
        }
        self.airframe.check()?;
        self.start.check()?;
        self.wind.check()?;
        self.profile.check()?;
        Atmosphere::check(self.temperature_offset_k)?;
        check_gusts(&self.gusts)?;
        self.sensors.check(self.period.as_micros())?;
        let period_us = self.period.as_micros();
        if self.step_us == 0 || !period_us.is_multiple_of(self.step_us) {
            return Err(SetupError::Step { step_us: self.step_us, period_us });
        }
        Ok(())
    }

    /// Checks that a controller's model is of this aircraft.
    pub fn check_model(&self, model: Aircraft) -> Result<(), SetupError> {
        let airframe = self.airframe.aircraft();
        if airframe == model {
            return Ok(());
        }
        Err(SetupError::OtherAircraft { airframe: Box::new(airframe), model: Box::new(model) })
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
        let ScheduledFault { target, kind, timing } = fault;
        let Airframe { effectors, servos, .. } = &self.airframe;
        let has = self.sensors.fitted_with(&self.airframe);
        faults::check(effectors, servos, &has, *target, kind, timing)
    }
}

/// The error about a fault that the aircraft cannot have.
pub(crate) fn fault_error(
    effectors: &EffectorList,
    index: usize,
    fault: &ScheduledFault,
    refusal: Refusal,
) -> SetupError {
    let class = fault.target.class(effectors);
    SetupError::Fault { number: index + 1, fault: fault.described(effectors), class, refusal }
}
