//! Every tunable that the laws read: one set, validated as a whole, swapped between steps.

use core::fmt;

use serde::{Deserialize, Serialize};

mod table;

pub use table::{TUNABLES, Tunable};

/// All gains and selections of the flight control.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// Step one.
    pub main: MainGains,
    /// Step two a.
    pub observer: ObserverGains,
    /// Step two b, when it wakes.
    pub activation: ActivationGains,
    /// Which laws fly.
    pub selection: Selection,
}

/// Gains of the main controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MainGains {
    /// Altitude hold by elevator, see Eq. (15).
    pub altitude: AltitudeGains,
    /// Roll by aileron, see Eq. (16).
    pub roll: RollGains,
    /// Yaw damper by rudder, see Eq. (16).
    pub yaw: YawGains,
    /// Speed hold by thrust.
    pub speed: SpeedGains,
}

/// Gains of the altitude law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AltitudeGains {
    /// K_q, s: elevator per pitch rate.
    pub k_q: f64,
    /// K_θ: elevator per pitch angle.
    pub k_theta: f64,
    /// K_hd, rad s/m: elevator per climb rate.
    pub k_hd: f64,
    /// K_h, rad/m: elevator per altitude error.
    pub k_h: f64,
    /// K_hi, rad/(m s): elevator rate per altitude error.
    pub k_hi: f64,
    /// Largest altitude error that the law sees, m; sets the climb rate.
    pub error_max_m: f64,
    /// Slew limit of the altitude reference, m/s.
    pub slew_m_s: f64,
    /// The integrator runs while the altitude error is below this, m.
    pub integral_band_m: f64,
    /// Beyond the band it runs while the climb rate stays below this either way, m/s.
    pub settled_climb_m_s: f64,
    /// Time that the climb rate must have been below it, s.
    pub settled_after_s: f64,
    /// Largest contribution of the integrator, rad.
    pub integral_max_rad: f64,
    /// K_α: elevator per angle of attack beyond the stall onset of the model.
    pub k_alpha: f64,
}

/// Gains of the roll law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RollGains {
    /// K_p, s: aileron per roll rate.
    pub k_p: f64,
    /// K_φ: aileron per roll angle error.
    pub k_phi: f64,
    /// K_φi, 1/s: aileron rate per roll angle error; small, so that the integral trims and does not
    /// fight the compensator.
    pub k_phi_i: f64,
    /// Largest contribution of the integrator, rad.
    pub integral_max_rad: f64,
    /// Time constant of the lag on the roll reference, s.
    pub reference_lag_s: f64,
}

/// Gain of the yaw damper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct YawGains {
    /// K_r, s: rudder per yaw rate.
    pub k_r: f64,
}

/// Gains of the speed hold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpeedGains {
    /// K_V, 1/s: acceleration per speed error.
    pub k_v: f64,
    /// K_Vi, 1/s²: acceleration rate per speed error.
    pub k_vi: f64,
}

/// Gains of the nonlinear extended state observer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObserverGains {
    /// ω₀, rad/s: bandwidth of the linear zone.
    pub bandwidth: f64,
    /// k_b: β₁ = k_b ω₀. Twice the damping ratio of the linear zone.
    pub rate_factor: f64,
    /// δ, rad/s: half width of the linear zone of `fal`.
    pub fal_width: f64,
}

/// Gains of the activation logic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ActivationGains {
    /// Roll level of |z2|, rad/s².
    pub level_roll: f64,
    /// Pitch level of |z2|, rad/s².
    pub level_pitch: f64,
    /// Yaw level of |z2|, rad/s².
    pub level_yaw: f64,
    /// The level must be exceeded this long without a break, s.
    pub on_dwell_s: f64,
    /// Release below this fraction of the level.
    pub hysteresis: f64,
    /// The estimate must stay below the release level this long without a break, s.
    pub off_dwell_s: f64,
    /// The compensation fades in and out over this time, s.
    pub fade_s: f64,
}

/// Which laws fly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Selection {
    /// Whether the compensator acts.
    pub compensator: CompensatorMode,
    /// What the observer is told about the compensation.
    pub observer: ObserverMode,
    /// The law of the healthy aircraft.
    pub main: MainLaw,
}

/// Whether the compensator acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompensatorMode {
    /// Never; the observer and the detector still run.
    Off,
    /// When the activation logic wakes it (normal).
    Armed,
    /// All the time, whatever the activation logic says.
    AlwaysOn,
}

/// What the observer is told about the compensation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObserverMode {
    /// The applied, saturated compensation (normal).
    Informed,
    /// Nothing, as equations 21 to 23 of the paper literally say.
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
}

impl Gains {
    /// The documented gain set with which every outcome of the paper occurs.
    ///
    /// The paper prints no gains; these are this project's choice. docs/decisions.md gives the reasons.
    pub const REFERENCE: Self = Self {
        main: MainGains {
            altitude: AltitudeGains {
                k_q: 1.20,
                k_theta: 2.20,
                k_hd: 0.0040,
                k_h: 0.00125,
                k_hi: 0.00008,
                error_max_m: 400.0,
                slew_m_s: 100.0,
                integral_band_m: 60.0,
                settled_climb_m_s: 2.0,
                settled_after_s: 3.0,
                integral_max_rad: 0.20,
                k_alpha: 8.0,
            },
            roll: RollGains {
                k_p: 0.60,
                k_phi: 2.2,
                k_phi_i: 0.005,
                integral_max_rad: 9.0,
                reference_lag_s: 0.3,
            },
            yaw: YawGains { k_r: 0.20 },
            speed: SpeedGains { k_v: 0.30, k_vi: 0.02 },
        },
        observer: ObserverGains { bandwidth: 50.0, rate_factor: 2.2, fal_width: 0.02 },
        activation: ActivationGains {
            level_roll: 1.05,
            level_pitch: 0.30,
            level_yaw: 0.18,
            on_dwell_s: 0.02,
            hysteresis: 0.25,
            off_dwell_s: 5.0,
            fade_s: 0.05,
        },
        selection: Selection {
            compensator: CompensatorMode::Armed,
            observer: ObserverMode::Informed,
            main: MainLaw::Pid,
        },
    };

    /// Checks the whole set.
    ///
    /// # Errors
    /// [`GainError`] names the first gain that is not finite or outside its range.
    pub fn validate(&self) -> Result<Option<Lemma1Warning>, GainError> {
        for tunable in &TUNABLES {
            let value = (tunable.get)(self);
            if !(tunable.min..=tunable.max).contains(&value) {
                let Tunable { name, unit, min, max, .. } = *tunable;
                return Err(GainError { name, unit, value, min, max });
            }
        }
        Ok(self.observer.lemma_1())
    }
}

impl ObserverGains {
    /// β₁, 1/s.
    #[must_use]
    pub fn beta_1(&self) -> f64 {
        self.rate_factor * self.bandwidth
    }

    /// β₂, (rad/s)^(1/2)/s²: the linear zone is s² + k_b ω₀ s + ω₀².
    #[must_use]
    pub fn beta_2(&self) -> f64 {
        self.bandwidth * self.bandwidth * libm::sqrt(self.fal_width)
    }

    /// The condition of Lemma 1, β₁² > 4 k β₂ dg₂/de for some k > 1, at the steepest slope 1/√δ of g₂.
    ///
    /// The condition is sufficient, not necessary, so a violation is a warning.
    #[must_use]
    pub fn lemma_1(&self) -> Option<Lemma1Warning> {
        let beta_1_squared = self.beta_1() * self.beta_1();
        let bound = 4.0 * self.beta_2() / libm::sqrt(self.fal_width);
        (beta_1_squared <= bound).then_some(Lemma1Warning { beta_1_squared, bound })
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
        write!(f, "{name} = {value} is outside {min} to {max} {unit}")
    }
}

impl core::error::Error for GainError {}

/// Observer gains outside Lemma 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lemma1Warning {
    /// β₁², 1/s².
    pub beta_1_squared: f64,
    /// 4 β₂ max dg₂/de, 1/s²; Lemma 1 asks that β₁² is larger.
    pub bound: f64,
}

impl fmt::Display for Lemma1Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { beta_1_squared, bound } = self;
        write!(
            f,
            "outside Lemma 1 (sufficient, not necessary): beta1^2 {beta_1_squared:.0} <= {bound:.0}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_set_is_valid_and_inside_lemma_1() {
        assert_eq!(Gains::REFERENCE.validate(), Ok(None));
    }

    #[test]
    fn every_gain_is_refused_when_it_is_nan_or_outside_its_range() {
        for tunable in &TUNABLES {
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
        gains.observer.rate_factor = 1.5;
        let warning = gains.validate().unwrap().unwrap();
        assert!((warning.beta_1_squared - 5_625.0).abs() < 1e-9);
        assert!((warning.bound - 10_000.0).abs() < 1e-9);
    }
}
