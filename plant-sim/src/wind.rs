//! The moving air: steady wind, Dryden turbulence, discrete gusts.

use icd::{Body, Ned};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::noise::{Normals, Source};
use crate::range::{RangeError, check_range};

mod filters;
mod gust;
pub mod level;
mod profile;

pub use gust::{DiscreteGust, DiscreteGusts, check as check_gusts};
pub use level::{LevelTurbulence, Surroundings, TurbulenceLevel, TurbulenceName};
pub use profile::{WindLevel, WindProfile};

use filters::{Rotary, SecondOrder, Transition};

/// Turbulence length above 2000 ft for every axis, m: 1750 ft (MIL-F-8785C, 3.7.2.1).
pub const LENGTH_M: f64 = 533.4;

/// Airspeed below which the turbulence does not change more slowly, m/s.
const SLOWEST_M_S: f64 = 20.0;

/// Motion of the air over the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WindSettings {
    /// Horizontal speed of the steady wind, m/s.
    pub speed_m_s: f64,
    /// Where the steady wind blows to, rad, clockwise from north.
    pub towards_rad: f64,
    /// Vertical speed of the steady wind, m/s, down positive.
    pub down_m_s: f64,
    /// Intensity σ of turbulence that is the same at every altitude, m/s rms on each axis.
    pub turbulence_m_s: f64,
    /// Turbulence of the standard at this level, instead of a constant intensity.
    #[serde(default)]
    pub turbulence: Option<TurbulenceLevel>,
}

impl WindSettings {
    /// No wind, no turbulence.
    pub const CALM: Self = Self {
        speed_m_s: 0.0,
        towards_rad: 0.0,
        down_m_s: 0.0,
        turbulence_m_s: 0.0,
        turbulence: None,
    };

    /// The same with turbulence of this rms on each axis, m/s, in place of any other.
    #[must_use]
    pub fn with_turbulence_m_s(self, turbulence_m_s: f64) -> Self {
        Self { turbulence_m_s, turbulence: None, ..self }
    }
}

impl WindSettings {
    pub fn check(&self) -> Result<(), RangeError> {
        const SECTION: &str = "plant.wind";
        check_range(SECTION, "speed_m_s", self.speed_m_s, 0.0, 150.0)?;
        check_range(SECTION, "towards_deg", self.towards_rad.to_degrees(), -360.0, 360.0)?;
        check_range(SECTION, "down_m_s", self.down_m_s, -50.0, 50.0)?;
        if self.turbulence.is_some() {
            // Expected one of them; shipped scenarios have a zero.
            let key = "turbulence_m_s beside turbulence";
            return check_range(SECTION, key, self.turbulence_m_s, 0.0, 0.0);
        }
        check_range(SECTION, "turbulence_m_s", self.turbulence_m_s, 0.0, 20.0)
    }
}

/// Steady wind as a velocity of the air over the ground, m/s: it points to where the wind blows.
pub fn steady(settings: &WindSettings) -> Ned {
    let (sin, cos) = libm::sincos(settings.towards_rad);
    Ned::new(settings.speed_m_s * cos, settings.speed_m_s * sin, settings.down_m_s)
}

/// The moving air around the centre of gravity: its velocity there, and its rotation.
///
/// At a point `r` from the centre of gravity the air blows with `velocity + rates × r`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gust {
    /// Velocity of the air at the centre of gravity, m/s, body axes, where it blows to.
    pub velocity: Body,
    /// p_g, q_g, r_g, rad/s, body axes: the air turns like a rigid body, right-handed, as the aircraft does with
    /// p, q, r. So p_g = ∂w_g/∂y, q_g = −∂w_g/∂x, r_g = ∂v_g/∂x, and damping sees p − p_g, q − q_g, r − r_g.
    pub rates: Body,
}

impl Gust {
    /// Air that does not move.
    pub fn none() -> Self {
        Self { velocity: Body::zero(), rates: Body::zero() }
    }

    /// Velocity of the air, m/s, at a point that lies `arm_m` from the centre of gravity, body axes.
    pub fn at(&self, arm_m: &Body) -> Body {
        Body(self.velocity.0 + self.rates.0.cross(&arm_m.0))
    }
}

/// Dryden turbulence on six axes (MIL-F-8785C 3.7, form for altitudes above 2000 ft), body axes.
///
/// White noise through first order along x and second order along y and z:
/// σ √(2T) / (1 + T s) and σ √T (1 + √3 T s) / (1 + T s)², T = L / V, for white noise of one unit²·s.
/// The rotation is in the file `wind/filters.rs`. The filters are advanced by their exact solution from one control tick to the
/// next, so that the gusts have their rms and spectrum at any period; between ticks the gust is constant.
///
/// Its intensity is the same at every altitude. [`LevelTurbulence`] has the intensities of the standard, and its form below 2000 ft.
/// The flight begins in calm air and reaches the full rms after some 2 T (4 s at 264 m/s), because a jump of
/// the wind at the start would not be turbulence.
#[derive(Debug, Clone)]
pub struct Turbulence {
    intensity_m_s: f64,
    period_s: f64,
    normals: Normals,
    along: f64,
    across: [SecondOrder; 2],
    rotation: Rotary,
}

impl Turbulence {
    /// Calm air that turbulence of rms `intensity_m_s` will move, advanced every `period_s`, around an aircraft of
    /// this span.
    pub fn new(intensity_m_s: f64, span_m: f64, period_s: f64, seed: u64, run: u64) -> Self {
        Self {
            intensity_m_s,
            period_s,
            normals: Normals::new(seed, run, Source::Turbulence),
            along: 0.0,
            across: [SecondOrder::default(); 2],
            rotation: Rotary::new(span_m, seed, run),
        }
    }

    /// Advances one control tick at this true airspeed (m/s); returns the gust until the next tick.
    ///
    /// Without intensity no random number is drawn and the gust is exactly zero.
    pub fn step(&mut self, airspeed_m_s: f64) -> Gust {
        if self.intensity_m_s <= 0.0 {
            return Gust::none();
        }
        let t = Transition::new(airspeed_m_s.max(SLOWEST_M_S) * self.period_s / LENGTH_M);
        self.along = t.decay * self.along + t.l11 * self.normals.draw();
        let before = self.across;
        let noise = [(); 2].map(|()| [self.normals.draw(), self.normals.draw()]);
        for (axis, [n1, n2]) in self.across.iter_mut().zip(noise) {
            axis.step(&t, n1, n2);
        }
        self.rotation.step(&t, &before, &noise);
        let [y, z] = self.across.map(|axis| axis.output());
        Gust {
            velocity: Body(Vector3::new(self.along, y, z) * self.intensity_m_s),
            rates: Body(self.rotation.rates(y, z) * self.intensity_m_s),
        }
    }
}

/// The turbulence of a flight.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one in a flight, and it is the usual one")]
pub enum MovingAir {
    /// Of one intensity everywhere, or none.
    Constant(Turbulence),
    /// At a level of the standard.
    Level(Box<LevelTurbulence>),
}

impl MovingAir {
    /// Still at the start, advanced every `period_s`, around an aircraft of this span.
    pub fn new(settings: &WindSettings, span_m: f64, period_s: f64, seed: u64, run: u64) -> Self {
        match settings.turbulence {
            None => {
                let intensity_m_s = settings.turbulence_m_s;
                Self::Constant(Turbulence::new(intensity_m_s, span_m, period_s, seed, run))
            }
            Some(level) => {
                Self::Level(Box::new(LevelTurbulence::new(level, span_m, period_s, seed, run)))
            }
        }
    }

    /// Advances one control tick; returns the gust until the next tick.
    pub fn step(&mut self, at: &Surroundings) -> Gust {
        match self {
            Self::Constant(turbulence) => turbulence.step(at.airspeed_m_s),
            Self::Level(turbulence) => turbulence.step(at),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.002;
    const AIRSPEED: f64 = 264.0;
    const SPAN_M: f64 = 9.144;

    /// Mean of f(gust, gust `lag` ticks before) for each axis over many lengths of turbulence.
    fn statistics(lag: usize) -> ([f64; 3], [f64; 3]) {
        // 0.2 s ticks, so that 2e5 of them are 2e4 turbulence times.
        let mut turbulence = Turbulence::new(1.5, SPAN_M, 0.2, 1, 0);
        let mut past = vec![[0.0; 3]; lag];
        let (mut square, mut product) = ([0.0; 3], [0.0; 3]);
        let n = 200_000;
        for k in 0..n + 1_000 {
            let gust: [f64; 3] = turbulence.step(AIRSPEED).velocity.0.into();
            let before = past[k % lag];
            past[k % lag] = gust;
            if k >= 1_000 {
                for i in 0..3 {
                    square[i] += gust[i] * gust[i] / f64::from(200_000);
                    product[i] += gust[i] * before[i] / f64::from(200_000);
                }
            }
        }
        (square, product)
    }

    #[test]
    fn rms_on_each_axis_is_the_intensity() {
        let (square, _) = statistics(1);
        for (axis, square) in ["u", "v", "w"].into_iter().zip(square) {
            // About 1e4 independent samples: the rms is good to 0.7 %, four times that allowed.
            assert!((square.sqrt() / 1.5 - 1.0).abs() < 0.03, "{axis}: {} m/s", square.sqrt());
        }
    }

    #[test]
    fn correlation_is_that_of_the_dryden_spectra() {
        // Longitudinal exp(-x/L), lateral (1 - x/2L) exp(-x/L), with x = V t the distance flown.
        let lag = 5;
        let x = AIRSPEED * 0.2 * 5.0 / LENGTH_M;
        let (square, product) = statistics(lag);
        let expected =
            [libm::exp(-x), (1.0 - 0.5 * x) * libm::exp(-x), (1.0 - 0.5 * x) * libm::exp(-x)];
        for i in 0..3 {
            let ours = product[i] / square[i];
            // 1e4 independent samples: 0.01, three times that allowed.
            assert!(
                (ours - expected[i]).abs() < 0.03,
                "axis {i}: {ours} instead of {}",
                expected[i]
            );
        }
    }

    #[test]
    fn without_intensity_the_air_is_exactly_calm() {
        let mut turbulence = Turbulence::new(0.0, SPAN_M, PERIOD_S, 1, 0);
        assert_eq!(turbulence.step(AIRSPEED), Gust::none());
    }

    #[test]
    fn the_first_gusts_are_small() {
        let mut turbulence = Turbulence::new(1.5, SPAN_M, PERIOD_S, 1, 0);
        // sigma sqrt(3) sqrt(2 h/T) = 0.12 m/s is one deviation of the first lateral gust.
        assert!(turbulence.step(AIRSPEED).velocity.0.norm() < 0.6);
    }

    #[test]
    fn wind_blows_to_where_its_direction_points() {
        let east = WindSettings {
            speed_m_s: 10.0,
            towards_rad: core::f64::consts::FRAC_PI_2,
            down_m_s: -1.0,
            ..WindSettings::CALM
        };
        assert!((steady(&east).0 - Vector3::new(0.0, 10.0, -1.0)).norm() < 1e-14);
    }
}
