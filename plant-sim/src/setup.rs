//! Everything that defines a flight, as plain data, and what can be wrong with it.

use icd::ControlPeriod;
use icd::fault::{Refusal, TargetClass};
use icd::wire::Aircraft;
use serde::{Deserialize, Serialize};

use crate::airframe::Airframe;
use crate::config::{RangeError, check_range};
use crate::earth::EarthModel;
use crate::faults::{self, ScheduledFault};
use crate::geodesy::Geodetic;
use crate::step_limit::TooQuick;
use crate::tables::TablesError;
use crate::trim::TrimError;

/// Longest integration step where nothing else is asked for, µs.
pub const DEFAULT_STEP_US: u32 = 1_000;

/// Integration step where nothing else is asked for, µs: the largest divisor of the period up to
/// [`DEFAULT_STEP_US`].
#[must_use]
pub fn default_step_us(period: ControlPeriod) -> u32 {
    let period_us = period.as_micros();
    (1..=DEFAULT_STEP_US).rev().find(|step| period_us.is_multiple_of(*step)).unwrap_or(period_us)
}

/// Everything that defines a flight; the same setup and the same commands give the same bits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantSetup {
    /// The aircraft.
    pub airframe: Airframe,
    /// Where and how it starts.
    pub start: Start,
    /// What it flies over.
    pub earth: EarthModel,
    /// How the air moves.
    pub wind: WindSettings,
    /// What is wrong with the sensors.
    pub sensors: SensorSettings,
    /// What breaks and when.
    pub faults: Vec<ScheduledFault>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Number of the run under that seed: other runs have other random streams.
    pub run: u64,
    /// Control period.
    pub period: ControlPeriod,
    /// Step of the integration, µs; must divide the period.
    pub step_us: u32,
}

/// Where the flight starts: wings level, no sideslip, level flight, trimmed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Altitude above the ellipsoid or the plane, m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Heading of the nose, rad, clockwise from north.
    pub heading_rad: f64,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
}

/// What a scenario says about its start; the rest is as at the design point of the airframe.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartPart {
    /// Altitude, m.
    pub altitude_m: Option<f64>,
    /// True airspeed, m/s.
    pub airspeed_m_s: Option<f64>,
    /// Heading of the nose, deg.
    pub heading_deg: Option<f64>,
    /// Geodetic latitude, deg.
    pub latitude_deg: Option<f64>,
    /// Longitude, deg.
    pub longitude_deg: Option<f64>,
}

impl StartPart {
    /// The start of a flight with this design point.
    #[must_use]
    pub fn over(&self, design_point: &Start) -> Start {
        let angle = |degrees: Option<f64>, other| degrees.map_or(other, f64::to_radians);
        Start {
            altitude_m: self.altitude_m.unwrap_or(design_point.altitude_m),
            airspeed_m_s: self.airspeed_m_s.unwrap_or(design_point.airspeed_m_s),
            heading_rad: angle(self.heading_deg, design_point.heading_rad),
            latitude_rad: angle(self.latitude_deg, design_point.latitude_rad),
            longitude_rad: angle(self.longitude_deg, design_point.longitude_rad),
        }
    }
}

/// A start as it stands in an airframe file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartTable {
    altitude_m: f64,
    airspeed_m_s: f64,
    heading_deg: f64,
    latitude_deg: f64,
    longitude_deg: f64,
}

impl StartTable {
    pub(crate) fn into_start(self) -> Start {
        Start {
            altitude_m: self.altitude_m,
            airspeed_m_s: self.airspeed_m_s,
            heading_rad: self.heading_deg.to_radians(),
            latitude_rad: self.latitude_deg.to_radians(),
            longitude_rad: self.longitude_deg.to_radians(),
        }
    }
}

/// How the air moves over the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WindSettings {
    /// Horizontal speed of the steady wind, m/s.
    pub speed_m_s: f64,
    /// Where the steady wind blows to, rad, clockwise from north.
    pub towards_rad: f64,
    /// Vertical speed of the steady wind, m/s, down positive.
    pub down_m_s: f64,
    /// Intensity σ of the turbulence, m/s rms on each axis.
    pub turbulence_m_s: f64,
}

impl WindSettings {
    /// No wind, no turbulence.
    pub const CALM: Self =
        Self { speed_m_s: 0.0, towards_rad: 0.0, down_m_s: 0.0, turbulence_m_s: 0.0 };
}

/// What is wrong with the sensors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorSettings {
    /// White noise of each gyro, rad/s rms of the control samples.
    pub gyro_noise_rad_s: f64,
}

impl SensorSettings {
    /// Sensors that report the truth.
    pub const IDEAL: Self = Self { gyro_noise_rad_s: 0.0 };
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
        /// Which one, counted from 1 in the order of the setup.
        number: usize,
        /// It, in words.
        fault: String,
        /// The units of the refusal.
        class: TargetClass,
        /// Why not.
        refusal: Refusal,
    },
    /// The controller's model is of another aircraft.
    #[error("the airframe is {airframe}, the controller's model is of {model}")]
    OtherAircraft {
        /// That of the airframe file.
        airframe: Box<Aircraft>,
        /// That of the model file.
        model: Box<Aircraft>,
    },
    /// The integration cannot follow the aircraft.
    #[error(transparent)]
    TooQuick(Box<TooQuick>),
    /// Its tables cannot be evaluated.
    #[error(transparent)]
    Tables(#[from] Box<TablesError>),
    /// Level flight is not possible, so there is nothing to start from.
    #[error(transparent)]
    Trim(#[from] TrimError),
}

impl Start {
    /// The place.
    #[must_use]
    pub fn geodetic(&self) -> Geodetic {
        Geodetic {
            latitude_rad: self.latitude_rad,
            longitude_rad: self.longitude_rad,
            altitude_m: self.altitude_m,
        }
    }

    /// Checks every number of a scenario's start.
    ///
    /// # Errors
    /// [`RangeError`] for the first one that cannot be.
    pub fn check(&self) -> Result<(), RangeError> {
        self.check_table("plant.start")
    }

    /// Checks every number; `section` is the table of the file that it stands in.
    ///
    /// # Errors
    /// [`RangeError`] for the first one that cannot be.
    pub(crate) fn check_table(&self, section: &'static str) -> Result<(), RangeError> {
        check_range(section, "altitude_m", self.altitude_m, 1.0, 25_000.0)?;
        check_range(section, "airspeed_m_s", self.airspeed_m_s, 1.0, 1_000.0)?;
        check_range(section, "heading_deg", self.heading_rad.to_degrees(), -360.0, 360.0)?;
        // North and east lose their meaning at the poles.
        check_range(section, "latitude_deg", self.latitude_rad.to_degrees(), -89.0, 89.0)?;
        check_range(section, "longitude_deg", self.longitude_rad.to_degrees(), -180.0, 180.0)
    }
}

impl WindSettings {
    /// Checks every number.
    ///
    /// # Errors
    /// [`RangeError`] for the first one that cannot be.
    pub fn check(&self) -> Result<(), RangeError> {
        const SECTION: &str = "plant.wind";
        check_range(SECTION, "speed_m_s", self.speed_m_s, 0.0, 150.0)?;
        check_range(SECTION, "towards_deg", self.towards_rad.to_degrees(), -360.0, 360.0)?;
        check_range(SECTION, "down_m_s", self.down_m_s, -50.0, 50.0)?;
        check_range(SECTION, "turbulence_m_s", self.turbulence_m_s, 0.0, 20.0)
    }
}

impl SensorSettings {
    /// Checks every number.
    ///
    /// # Errors
    /// [`RangeError`] if it cannot be.
    pub fn check(&self) -> Result<(), RangeError> {
        let noise_deg_s = self.gyro_noise_rad_s.to_degrees();
        check_range("plant.sensors", "gyro_noise_deg_s", noise_deg_s, 0.0, 100.0)
    }
}

impl PlantSetup {
    /// Checks all that can be checked without flying.
    ///
    /// # Errors
    /// [`SetupError`], the first one found; faults and trim are left to [`crate::Plant::new`].
    pub fn check(&self) -> Result<(), SetupError> {
        self.airframe.check()?;
        self.start.check()?;
        self.wind.check()?;
        self.sensors.check()?;
        let period_us = self.period.as_micros();
        if self.step_us == 0 || !period_us.is_multiple_of(self.step_us) {
            return Err(SetupError::Step { step_us: self.step_us, period_us });
        }
        Ok(())
    }

    /// Checks that a controller's model is of this aircraft.
    ///
    /// # Errors
    /// [`SetupError::OtherAircraft`] if it is not.
    pub fn check_model(&self, model: Aircraft) -> Result<(), SetupError> {
        let airframe = self.airframe.aircraft();
        if airframe == model {
            return Ok(());
        }
        Err(SetupError::OtherAircraft { airframe: Box::new(airframe), model: Box::new(model) })
    }

    /// Checks that the aircraft's effectors can have the faults.
    ///
    /// # Errors
    /// [`SetupError::Fault`], the first one found.
    pub fn check_faults(&self) -> Result<(), SetupError> {
        for (index, fault) in self.faults.iter().enumerate() {
            let ScheduledFault { target, kind, timing } = fault;
            let Airframe { effectors, servos, .. } = &self.airframe;
            faults::check(effectors, servos, *target, kind, timing)
                .map_err(|refusal| self.fault_error(index, refusal))?;
        }
        Ok(())
    }

    /// What is said of a fault that the aircraft cannot have.
    pub(crate) fn fault_error(&self, index: usize, refusal: Refusal) -> SetupError {
        let effectors = &self.airframe.effectors;
        let fault = self.faults.get(index);
        let class = fault.map_or(TargetClass::Angle, |fault| fault.target.class(effectors));
        let fault = fault.map_or_else(String::new, |fault| fault.described(effectors));
        SetupError::Fault { number: index + 1, fault, class, refusal }
    }
}
