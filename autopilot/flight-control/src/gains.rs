//! Every tunable that the laws read: one set, validated as a whole, swapped between steps.

use core::fmt;

use serde::{Deserialize, Serialize};

#[macro_use]
mod table;

pub use table::{LQR, Tunable, tunables};

pub use crate::activation::{ActivationGains, CompensatorMode};
use crate::compensator::incremental::IncrementalGains;
use crate::compensator::linear_eso::LinearEsoGains;
use crate::compensator::neso::{Lemma1Warning, NesoGains};
pub use crate::estimator::{EarthShape, EstimatorGains, EstimatorPreset, StateSource};
use crate::ground_control::GroundGains;
use crate::isolation::gains::IsolationGains;
pub use crate::isolation::gains::IsolationMode;
use crate::main_controller::lqr::LqrGains;
use crate::main_controller::ndi::NdiGains;
use crate::main_controller::pid::PidGains;
use crate::relief::gains::ReliefGains;

/// All gains and selections of the flight control.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// How references are shaped.
    pub references: ReferenceGains,
    /// Step one: the PID, alone and with the ganged nozzle.
    pub pid: PidGains,
    /// Step one: the nonlinear dynamic inversion.
    pub ndi: NdiGains,
    /// Step one: the linear quadratic regulator.
    pub lqr: LqrGains,
    /// Step two a: the NESO.
    pub neso: NesoGains,
    /// Step two a: the linear observer.
    pub linear_eso: LinearEsoGains,
    /// Step two a: the filter of the incremental compensator.
    pub incremental: IncrementalGains,
    /// Step two b, when it wakes.
    pub activation: ActivationGains,
    /// Step two b beyond the paper.
    pub relief: ReliefGains,
    /// Which effector it is.
    pub isolation: IsolationGains,
    /// Between touchdown and lift-off.
    pub ground: GroundGains,
    /// The estimator of the navigation state.
    pub estimator: EstimatorGains,
    /// Which laws fly.
    pub selection: Selection,
}

impl Default for Gains {
    fn default() -> Self {
        Self::REFERENCE
    }
}

gain_set! {
    /// How references are shaped before any law sees them.
    ///
    /// This project's choice.
    ReferenceGains at references {
        /// Slew limit of the altitude reference, m/s.
        slew_m_s = 100.0, "ALT_SLEW" "m/s", 0.1 to 1000.0, "Slew limit of the altitude reference";
        /// Time constant of the lag on the roll reference, s.
        roll_lag_s = 0.3, "ROL_LAG" "s", 0.01 to 10.0, "Time constant of the lag on the roll reference";
    }
}

/// How the altitude follows its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AltitudeResponse {
    /// No larger error is seen, m.
    pub error_max_m: f64,
    /// Lag of the altitude in a steady climb: a part of its own, s, and one that is this over the airspeed, m.
    lag: [f64; 2],
}

impl AltitudeResponse {
    /// Altitude error over the climb rate that it gives, without an integrator, s.
    pub fn lag_s(&self, airspeed_m_s: f64) -> f64 {
        let [own_s, by_airspeed_m] = self.lag;
        // Gains of a wrong sign follow nothing.
        (own_s + by_airspeed_m / airspeed_m_s.max(1.0)).max(0.0)
    }
}

/// Which laws fly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Selection {
    /// Whether the compensator acts.
    pub compensator: CompensatorMode,
    /// The compensation that the observer takes into account.
    pub observer: ObserverMode,
    /// The law of the healthy aircraft.
    pub main: MainLaw,
    /// The estimator of the compensator.
    pub compensator_law: CompensatorLaw,
    /// How the compensating demand is allocated to the effectors.
    pub allocation: AllocationMode,
    /// What the verdict of the isolation is good for.
    pub isolation: IsolationMode,
    /// Where the navigation state comes from; counts at the start of a flight.
    pub state: StateSource,
    /// The Earth that the estimator assumes; counts at the start of a flight.
    pub earth: EarthShape,
    /// Which numbers the estimator uses.
    pub estimator: EstimatorPreset,
}

/// The name of a value on a command line, from a list like [`MainLaw::NAMES`].
pub fn name_of<T: PartialEq>(names: &[(&'static str, T)], value: T) -> &'static str {
    names.iter().find(|(_, named)| *named == value).map_or("?", |(name, _)| *name)
}

/// The compensation that the observer takes into account.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObserverMode {
    /// The applied, saturated compensation (normal).
    Informed,
    /// None, as equations 21 to 23 of the paper are printed.
    Literal,
}

/// The law of the healthy aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MainLaw {
    /// The paper's PID; the nozzle belongs to the compensator.
    Pid,
    /// The same PID with the nozzle ganged to it by a static law.
    PidGangedNozzle,
    /// Nonlinear dynamic inversion of the design model.
    Ndi,
    /// Linear quadratic regulator.
    Lqr,
    /// A law that a program brings; see [`crate::Law`].
    Own,
}

impl MainLaw {
    /// All of them with their names on a command line.
    pub const NAMES: &[(&'static str, Self)] = &[
        ("pid", Self::Pid),
        ("pid-ganged-nozzle", Self::PidGangedNozzle),
        ("ndi", Self::Ndi),
        ("lqr", Self::Lqr),
        ("own", Self::Own),
    ];
}

/// The estimator of the compensator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompensatorLaw {
    /// The paper's nonlinear extended state observer.
    #[default]
    Neso,
    /// A linear extended state observer.
    LinearEso,
    /// The filtered angular acceleration of an incremental dynamic inversion.
    Incremental,
}

impl CompensatorLaw {
    /// All of them with their names on a command line.
    pub const NAMES: &[(&'static str, Self)] = &[
        ("neso", Self::Neso),
        ("linear-eso", Self::LinearEso),
        ("incremental", Self::Incremental),
    ];
}

/// How the compensating demand is allocated to the effectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AllocationMode {
    /// Eq. (25): roll by the ailerons, pitch and yaw by the nozzle.
    #[default]
    Paper,
    /// Bounded weighted least squares over all surfaces and nozzle angles.
    Wls,
    /// The same about the paper's command, with relief in yaw and protection of what it lives on; see [`crate::relief`].
    Relief,
    /// The compensation of a law that the program brings: [`crate::Law::compensate`].
    Own,
}

impl AllocationMode {
    /// All of them with their names on a command line.
    pub const NAMES: &[(&'static str, Self)] =
        &[("paper", Self::Paper), ("wls", Self::Wls), ("relief", Self::Relief), ("own", Self::Own)];
}

impl Gains {
    /// That of the main controller.
    pub fn altitude_response(&self) -> AltitudeResponse {
        let (error_max_m, lag) = match self.selection.main {
            MainLaw::Ndi => (self.ndi.climb_max_m_s / self.ndi.k_h, [1.0 / self.ndi.k_h, 0.0]),
            MainLaw::Lqr => {
                let row = &self.lqr.elevator;
                (self.lqr.error_max_m, [row.climb, row.theta].map(|gain| gain / row.altitude))
            }
            // A program's law is taken to be as quick as the PID.
            MainLaw::Pid | MainLaw::PidGangedNozzle | MainLaw::Own => {
                let law = &self.pid.altitude;
                (law.error_max_m, [law.k_hd / law.k_h, law.k_theta / law.k_h])
            }
        };
        AltitudeResponse { error_max_m, lag }
    }

    /// The documented gain set with which every outcome of the paper occurs.
    ///
    /// The paper prints no gains; these are this project's choice. docs/paper.md gives the reasons.
    pub const REFERENCE: Self = Self {
        references: ReferenceGains::REFERENCE,
        pid: PidGains::REFERENCE,
        ndi: NdiGains::REFERENCE,
        lqr: LqrGains::REFERENCE,
        neso: NesoGains::REFERENCE,
        linear_eso: LinearEsoGains::REFERENCE,
        incremental: IncrementalGains::REFERENCE,
        activation: ActivationGains::REFERENCE,
        relief: ReliefGains::REFERENCE,
        isolation: IsolationGains::REFERENCE,
        ground: GroundGains::REFERENCE,
        estimator: EstimatorGains::REFERENCE,
        selection: Selection {
            compensator: CompensatorMode::Armed,
            observer: ObserverMode::Informed,
            main: MainLaw::Pid,
            compensator_law: CompensatorLaw::Neso,
            allocation: AllocationMode::Paper,
            isolation: IsolationMode::Report,
            state: StateSource::Automatic,
            earth: EarthShape::Wgs84,
            estimator: EstimatorPreset::Parameters,
        },
    };

    /// Noise and priors of the estimator that are selected.
    pub fn of_estimator(&self) -> &EstimatorGains {
        match self.selection.estimator {
            EstimatorPreset::Parameters => &self.estimator,
            EstimatorPreset::Consumer => &EstimatorGains::CONSUMER,
        }
    }

    /// Bandwidth of the estimator that is selected, rad/s.
    pub fn bandwidth(&self) -> f64 {
        match self.selection.compensator_law {
            CompensatorLaw::Neso => self.neso.bandwidth,
            CompensatorLaw::LinearEso => self.linear_eso.bandwidth,
            CompensatorLaw::Incremental => self.incremental.bandwidth,
        }
    }

    /// Checks the whole set.
    pub fn validate(&self) -> Result<Option<Lemma1Warning>, GainError> {
        for tunable in tunables() {
            let value = (tunable.get)(self);
            // NaN is in no range.
            if !(tunable.min..=tunable.max).contains(&value) {
                let Tunable { name, unit, min, max, .. } = *tunable;
                return Err(GainError { name, unit, value, min, max });
            }
        }
        Ok(self.neso.lemma_1())
    }
}

/// A gain that the laws cannot fly with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainError {
    /// Parameter name.
    pub name: &'static str,
    /// Unit of the numbers.
    pub unit: &'static str,
    /// The refused value.
    pub value: f64,
    /// Smallest allowed.
    pub min: f64,
    /// Largest allowed.
    pub max: f64,
}

impl fmt::Display for GainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, unit, value, min, max } = self;
        write!(f, "{name} = {value} is outside {min} to {max}")?;
        if *unit == "-" { Ok(()) } else { write!(f, " {unit}") }
    }
}

impl core::error::Error for GainError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_set_is_valid_and_inside_lemma_1() {
        assert_eq!(Gains::REFERENCE.validate(), Ok(None));
    }

    #[test]
    fn every_gain_is_refused_when_it_is_nan_or_outside_its_range() {
        for tunable in tunables() {
            for bad in [
                f64::NAN,
                f64::INFINITY,
                -f64::INFINITY,
                tunable.max * 1.01 + 1.0,
                tunable.min - 1.0,
            ] {
                let mut gains = Gains::REFERENCE;
                (tunable.set)(&mut gains, bad);
                let error = gains.validate().unwrap_err();
                assert_eq!(error.name, tunable.name, "{bad}");
            }
        }
    }

    #[test]
    fn a_set_outside_lemma_1_is_accepted_with_its_numbers() {
        let mut gains = Gains::REFERENCE;
        gains.neso.rate_factor = 1.5;
        let warning = gains.validate().unwrap().unwrap();
        assert!((warning.beta_1_squared - 5_625.0).abs() < 1e-9);
        assert!((warning.bound - 10_000.0).abs() < 1e-9);
    }
}
