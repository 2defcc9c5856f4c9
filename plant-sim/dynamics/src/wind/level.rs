//! Turbulence at the levels of MIL-F-8785C: intensity and length by the height above the ground, at any airspeed.
//!
//! | height | lengths | intensities | axes |
//! |---|---|---|---|
//! | below 1000 ft (3.7.3) | L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2, h in ft | σ_w = 0.1 W20, σ_u = σ_v = σ_w / (0.177 + 0.000823 h)^0.4 | horizon, x along the mean wind |
//! | above 2000 ft (3.7.2) | 1750 ft | figure 7: by height and probability of exceedance | body |
//! | between | linear | linear | both, by parts |
//!
//! W20 is the wind at 20 ft: 15, 30 and 45 knots. The ground is at altitude zero.

use core::fmt;

use icd::{Attitude, Body, Ned, named};
use serde::{Deserialize, Serialize};

use super::filters::{Field, Noise, SPANS_ROLL_PITCH, SPANS_YAW, Scales};
use super::{Gust, SLOWEST_M_S};

/// Metres in a foot.
const FOOT_M: f64 = 0.304_8;
/// Metres per second in a knot.
const KNOT_M_S: f64 = 1_852.0 / 3_600.0;

/// Top of the low-altitude form, m: 1000 ft.
pub const LOW_TOP_M: f64 = 1_000.0 * FOOT_M;
/// Bottom of the form for medium and high altitudes, m: 2000 ft.
pub const HIGH_BOTTOM_M: f64 = 2_000.0 * FOOT_M;
/// The height does not count as lower than this, ft: there the lengths would vanish (as in JSBSim).
const LOWEST_FT: f64 = 10.0;

/// A mean wind slower than this, m/s, has no direction; then the axes near the ground follow the nose.
const WIND_MIN_M_S: f64 = 0.1;

/// Heights of the columns of figure 7, ft.
const FIGURE_7_FT: [f64; 12] = [
    500.0, 1_750.0, 3_750.0, 7_500.0, 15_000.0, 25_000.0, 35_000.0, 45_000.0, 55_000.0, 65_000.0,
    75_000.0, 80_000.0,
];

/// Figure 7 of MIL-F-8785C, ft/s: the curves for probabilities of exceedance of 1e-2, 1e-3 and 1e-5. Read off as in JSBSim 1.2,
/// FGWinds.cpp, rows 3, 4 and 6 of its `POE_Table`.
const FIGURE_7_FT_S: [[f64; 12]; 3] = [
    [6.6, 6.9, 7.4, 6.7, 4.6, 2.7, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0],
    [8.6, 9.6, 10.6, 10.1, 8.0, 6.6, 5.0, 4.2, 2.7, 0.0, 0.0, 0.0],
    [15.6, 17.6, 23.0, 23.6, 22.1, 20.0, 16.0, 15.1, 12.1, 7.9, 6.2, 5.1],
];

named! {
    /// Levels of turbulence, the weakest first.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    TurbulenceLevel {
        /// Wind of 15 knots at 20 ft; exceeded with a probability of 1e-2 higher up.
        Light = "light",
        /// Wind of 30 knots at 20 ft; exceeded with a probability of 1e-3 higher up.
        Moderate = "moderate",
        /// Wind of 45 knots at 20 ft; exceeded with a probability of 1e-5 higher up.
        Severe = "severe",
    }
}

/// The same in a file, where a campaign may vary between the levels and none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TurbulenceName {
    /// No turbulence by level.
    None,
    /// [`TurbulenceLevel::Light`].
    Light,
    /// [`TurbulenceLevel::Moderate`].
    Moderate,
    /// [`TurbulenceLevel::Severe`].
    Severe,
}

impl TurbulenceName {
    pub fn level(self) -> Option<TurbulenceLevel> {
        match self {
            Self::None => None,
            Self::Light => Some(TurbulenceLevel::Light),
            Self::Moderate => Some(TurbulenceLevel::Moderate),
            Self::Severe => Some(TurbulenceLevel::Severe),
        }
    }
}

impl TurbulenceLevel {
    /// Intensity by figure 7, m/s: linear between its heights, constant beyond them.
    fn figure_7_m_s(self, height_ft: f64) -> f64 {
        let curve = &FIGURE_7_FT_S[self as usize];
        let above = FIGURE_7_FT.partition_point(|column| *column <= height_ft);
        let foot_s = match above {
            0 => curve[0],
            12.. => curve[11],
            _ => {
                let [low, high] = [FIGURE_7_FT[above - 1], FIGURE_7_FT[above]];
                let part = (height_ft - low) / (high - low);
                curve[above - 1] + part * (curve[above] - curve[above - 1])
            }
        };
        FOOT_M * foot_s
    }

    /// Intensities and lengths at a height above the ground, m.
    pub fn scales(self, height_m: f64) -> Scales {
        let height_ft = height_m / FOOT_M;
        if height_m >= HIGH_BOTTOM_M {
            return Scales::isotropic(super::LENGTH_M, self.figure_7_m_s(height_ft));
        }
        // A tenth of the mean wind at 20 ft.
        let vertical_m_s = 0.1 * (KNOT_M_S * [15.0, 30.0, 45.0][self as usize]);
        if height_m > LOW_TOP_M {
            let part = (height_m - LOW_TOP_M) / (HIGH_BOTTOM_M - LOW_TOP_M);
            let high_m_s = self.figure_7_m_s(HIGH_BOTTOM_M / FOOT_M);
            return Scales::isotropic(
                LOW_TOP_M + part * (super::LENGTH_M - LOW_TOP_M),
                vertical_m_s + part * (high_m_s - vertical_m_s),
            );
        }
        // A NaN counts as the ground.
        let h = height_ft.max(LOWEST_FT);
        let rise = 0.177 + 0.000_823 * h;
        // One logarithm serves both powers.
        let logarithm = libm::log(rise);
        Scales {
            horizontal_m: FOOT_M * h * libm::exp(-1.2 * logarithm),
            vertical_m: FOOT_M * h,
            horizontal_m_s: vertical_m_s * libm::exp(-0.4 * logarithm),
            vertical_m_s,
        }
    }
}

impl fmt::Display for TurbulenceLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.key())
    }
}

/// Where the aircraft is and how it flies.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings {
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Height above the ground, m.
    pub height_m: f64,
    /// Attitude of the aircraft.
    pub attitude: Attitude,
    /// Mean wind, m/s, where it blows to.
    pub wind: Ned,
}

/// Dryden turbulence on six axes at a level of the standard.
///
/// The filters are those of [`super::Turbulence`], of unit intensity, in a time that is counted in L/V: height and airspeed change
/// how fast they move and how large their output is, and never make a step. Between 1000 and 2000 ft the air is a sum of
/// two independent fields, one in the axes of the low-altitude form and one in body axes, with the roots of their parts as weights,
/// so that its intensity is that of the height.
#[derive(Debug, Clone)]
pub struct LevelTurbulence {
    level: TurbulenceLevel,
    span_m: f64,
    period_s: f64,
    noise: Noise,
    low: Field,
    high: Field,
}

impl LevelTurbulence {
    /// Calm air that turbulence of this level will move, advanced every `period_s`, around an aircraft of this span.
    pub fn new(level: TurbulenceLevel, span_m: f64, period_s: f64, seed: u64, run: u64) -> Self {
        let noise = Noise::new(seed, run);
        let (low, high) = (Field::default(), Field::default());
        Self { level, span_m, period_s, noise, low, high }
    }

    /// Advances one control tick; returns the gust until the next one, in body axes.
    pub fn step(&mut self, at: &Surroundings) -> Gust {
        let scales = self.level.scales(at.height_m);
        let way_m = at.airspeed_m_s.max(SLOWEST_M_S) * self.period_s;
        let part = (at.height_m - LOW_TOP_M) / (HIGH_BOTTOM_M - LOW_TOP_M);
        let part = if part > 0.0 { part.min(1.0) } else { 0.0 };
        let (noise, span_m) = (&mut self.noise, self.span_m);
        // The order is part of every recorded flight.
        let drawn = |noise: &mut Noise| {
            let across = noise.across();
            (noise.velocity.draw(), across)
        };
        let mut air = Gust::none();
        // A field without weight rests; when it is needed again its state is as good a sample as
        // any.
        if part < 1.0 {
            let excitation = drawn(noise);
            let gust = self.low.step(&scales, span_m, way_m, excitation, noise);
            let (sin, cos) = at.mean_wind();
            let in_body = |v: &Body| {
                let [x, y, z]: [f64; 3] = v.0.into();
                at.attitude.to_body(Ned::new(cos * x - sin * y, sin * x + cos * y, z)).0
            };
            let weight = (1.0 - part).sqrt();
            air.velocity.0 += weight * in_body(&gust.velocity);
            air.rates.0 += weight * in_body(&gust.rates);
        }
        if part > 0.0 {
            let excitation = drawn(noise);
            let gust = self.high.step(&scales, span_m, way_m, excitation, noise);
            let weight = part.sqrt();
            air.velocity.0 += weight * gust.velocity.0;
            air.rates.0 += weight * gust.rates.0;
        }
        air
    }
}

impl Surroundings {
    /// Sine and cosine of the direction to which the mean wind blows; of the nose where there is none.
    fn mean_wind(&self) -> (f64, f64) {
        let wind = self.wind.0.xy();
        let along =
            if wind.norm() > WIND_MIN_M_S { wind } else { self.attitude.matrix().column(0).xy() };
        let size = along.norm();
        // An aircraft on its tail has no heading.
        if size > 1.0e-9 { (along.y / size, along.x / size) } else { (0.0, 1.0) }
    }
}

/// One-sided spectra of u, v, w, (m/s)²/(rad/m), and of p, q, r, (rad/s)²/(rad/m), at a spatial frequency in rad/m, as
/// MIL-F-8785C prints them (3.7.1.2 and 3.7.5), for an aircraft of this span in m.
pub fn spectra(scales: &Scales, span_m: f64, omega_rad_m: f64) -> [f64; 6] {
    let pi = core::f64::consts::PI;
    let Scales { horizontal_m, vertical_m, horizontal_m_s, vertical_m_s } = *scales;
    let square = |length_m: f64| length_m * omega_rad_m * (length_m * omega_rad_m);
    let u =
        2.0 * horizontal_m_s * horizontal_m_s * horizontal_m / pi / (1.0 + square(horizontal_m));
    let across = |intensity: f64, length_m: f64| {
        let x = square(length_m);
        intensity * intensity * length_m / pi * (1.0 + 3.0 * x) / ((1.0 + x) * (1.0 + x))
    };
    let (v, w) = (across(horizontal_m_s, horizontal_m), across(vertical_m_s, vertical_m));
    let lag = |spans: f64| 1.0 / (1.0 + square(spans * span_m / pi));
    let p = vertical_m_s * vertical_m_s / vertical_m
        * 0.8
        * libm::cbrt(pi * vertical_m / (4.0 * span_m))
        * lag(SPANS_ROLL_PITCH);
    let slope = omega_rad_m * omega_rad_m;
    [u, v, w, p, slope * lag(SPANS_ROLL_PITCH) * w, slope * lag(SPANS_YAW) * v]
}

#[cfg(test)]
mod tests;
