//! The moving air: steady wind and its shear, Dryden turbulence, discrete gusts.

use host_io::problem::Problem;
use icd::{Body, Ned, SimTime};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::range::{check_range, check_vector};

mod filters;
pub mod level;

pub use level::{LevelTurbulence, Surroundings, TurbulenceLevel, TurbulenceName};

pub use filters::Scales;
use filters::{Field, Noise};

/// Turbulence length above 2000 ft for every axis, m: 1750 ft (MIL-F-8785C, 3.7.2.1).
pub const LENGTH_M: f64 = 533.4;

/// Airspeed below which the turbulence does not change more slowly, m/s.
const SLOWEST_M_S: f64 = 20.0;

/// Motion of the air over the ground; by default it is calm.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
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
    pub turbulence: Option<TurbulenceLevel>,
}

impl WindSettings {
    /// The same with turbulence of this rms on each axis, m/s, in place of any other.
    #[must_use]
    pub fn with_turbulence_m_s(self, turbulence_m_s: f64) -> Self {
        Self { turbulence_m_s, turbulence: None, ..self }
    }

    pub fn check(&self) -> Result<(), Problem> {
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
    span_m: f64,
    period_s: f64,
    noise: Noise,
    field: Field,
}

impl Turbulence {
    /// Calm air that turbulence of rms `intensity_m_s` will move, advanced every `period_s`, around an aircraft of
    /// this span.
    pub fn new(intensity_m_s: f64, span_m: f64, period_s: f64, seed: u64, run: u64) -> Self {
        let (noise, field) = (Noise::new(seed, run), Field::default());
        Self { intensity_m_s, span_m, period_s, noise, field }
    }

    /// Advances one control tick at this true airspeed (m/s); returns the gust until the next tick.
    ///
    /// Without intensity no random number is drawn and the gust is exactly zero.
    pub fn step(&mut self, airspeed_m_s: f64) -> Gust {
        if self.intensity_m_s <= 0.0 {
            return Gust::none();
        }
        let scales = Scales::isotropic(LENGTH_M, self.intensity_m_s);
        let way_m = airspeed_m_s.max(SLOWEST_M_S) * self.period_s;
        // The order of the draws is part of every recorded flight.
        let (along, across) = (self.noise.velocity.draw(), self.noise.across());
        self.field.step(&scales, self.span_m, way_m, (along, across), &mut self.noise)
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

const GUST_SECTION: &str = "plant.gust";

/// A 1-cosine gust, body axes, along the path that the aircraft flies through the air.
///
/// MIL-F-8785C, 3.7.2.3: with the distance x since the onset and the gust length d,
/// v = v_m / 2 (1 - cos(π x / d)) up to d, and v_m from there on. With `returns` it goes back to zero the same way up to
/// 2 d, as the gusts of CS-25.341 do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiscreteGust {
    /// Simulation time at which the aircraft enters it, s.
    pub onset_s: f64,
    /// d: distance over which it rises, m.
    pub length_m: f64,
    /// v_m along x: positive blows from behind, m/s.
    #[serde(default)]
    pub forward_m_s: f64,
    /// v_m along y: positive blows to the right, m/s.
    #[serde(default)]
    pub right_m_s: f64,
    /// v_m along z: positive blows down, m/s.
    #[serde(default)]
    pub down_m_s: f64,
    /// It goes back to zero.
    #[serde(default)]
    pub returns: bool,
}

impl DiscreteGust {
    /// Most gusts of a scenario.
    pub const MAX: usize = 16;

    pub fn check(&self) -> Result<(), Problem> {
        check_range(GUST_SECTION, "onset_s", self.onset_s, 0.0, SimTime::MAX_SECONDS)?;
        check_range(GUST_SECTION, "length_m", self.length_m, 1.0, 10_000.0)?;
        check_range(GUST_SECTION, "forward_m_s", self.forward_m_s, -50.0, 50.0)?;
        check_range(GUST_SECTION, "right_m_s", self.right_m_s, -50.0, 50.0)?;
        check_range(GUST_SECTION, "down_m_s", self.down_m_s, -50.0, 50.0)
    }

    /// Part of v_m at a distance in m since the onset, and how it changes with that, 1/m.
    fn part(&self, distance_m: f64) -> (f64, f64) {
        let end = if self.returns { 2.0 } else { 1.0 };
        let x = (distance_m / self.length_m).min(end);
        let (sin, cos) = libm::sincos(core::f64::consts::PI * x);
        // Behind its end it is constant; at the end the slope is zero anyhow.
        let slope = if x < end { sin } else { 0.0 };
        (0.5 * (1.0 - cos), 0.5 * core::f64::consts::PI / self.length_m * slope)
    }
}

/// Checks the gusts of a scenario.
pub fn check_gusts(gusts: &[DiscreteGust]) -> Result<(), Problem> {
    check_range(
        GUST_SECTION,
        "number of gusts",
        gusts.len() as f64,
        0.0,
        DiscreteGust::MAX as f64,
    )?;
    gusts.iter().try_for_each(DiscreteGust::check)
}

/// The gusts of a flight, with the way that was flown in each.
#[derive(Debug, Clone)]
pub struct DiscreteGusts {
    /// Each with the distance since its onset, m.
    all: Vec<(DiscreteGust, f64)>,
    period_s: f64,
}

impl DiscreteGusts {
    /// All are still ahead.
    pub fn new(gusts: &[DiscreteGust], period_s: f64) -> Self {
        Self { all: gusts.iter().map(|gust| (*gust, 0.0)).collect(), period_s }
    }

    /// Adds their air to that of the turbulence, for the period from `time` on, with this true airspeed, m/s.
    ///
    /// As a field that lies still in the air it rotates too: q_g = -∂w_g/∂x, r_g = ∂v_g/∂x.
    pub fn step(&mut self, time: SimTime, airspeed_m_s: f64, turbulence: Gust) -> Gust {
        let mut air = turbulence;
        for (gust, distance_m) in &mut self.all {
            if time.as_seconds() < gust.onset_s {
                continue;
            }
            let (part, slope) = gust.part(*distance_m);
            let DiscreteGust { forward_m_s, right_m_s, down_m_s, .. } = *gust;
            air.velocity =
                Body(air.velocity.0 + part * Vector3::new(forward_m_s, right_m_s, down_m_s));
            air.rates = Body(air.rates.0 + slope * Vector3::new(0.0, -down_m_s, right_m_s));
            // After its use, so that the gust begins at zero.
            *distance_m += airspeed_m_s * self.period_s;
        }
        air
    }
}

const LEVEL_SECTION: &str = "plant.wind.level";

/// The wind at one altitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindLevel {
    /// Altitude above the ellipsoid, the sphere or the plane, m.
    pub altitude_m: f64,
    /// Velocity of the air over the ground, m/s, local NED, where it blows to.
    pub velocity_ned_m_s: [f64; 3],
}

/// Wind over the altitude: linear between its levels, constant below the lowest and above the highest one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct WindProfile {
    levels: Vec<WindLevel>,
}

impl WindProfile {
    pub const LEVELS_MAX: usize = 1_000;

    /// From levels with increasing altitudes.
    pub fn new(levels: Vec<WindLevel>) -> Result<Self, Problem> {
        let profile = Self { levels };
        profile.check()?;
        Ok(profile)
    }

    pub fn check(&self) -> Result<(), Problem> {
        let (count, max) = (self.levels.len() as f64, Self::LEVELS_MAX as f64);
        check_range("plant.wind", "number of levels", count, 0.0, max)?;
        let mut least = -5_000.0;
        for level in &self.levels {
            check_range(LEVEL_SECTION, "altitude_m", level.altitude_m, least, 100_000.0)?;
            // Two levels at one altitude would divide by zero in `at`.
            least = level.altitude_m.next_up();
            check_vector(LEVEL_SECTION, "velocity_ned_m_s", level.velocity_ned_m_s, 200.0)?;
        }
        Ok(())
    }

    /// Whether there are no levels.
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// Velocity of the air at an altitude in m, m/s, local NED; zero without levels.
    pub fn at(&self, altitude_m: f64) -> Ned {
        let above = self.levels.partition_point(|level| level.altitude_m <= altitude_m);
        let below = above.checked_sub(1).and_then(|index| self.levels.get(index));
        let wind = match (below, self.levels.get(above)) {
            (Some(low), Some(high)) => {
                let part = (altitude_m - low.altitude_m) / (high.altitude_m - low.altitude_m);
                std::array::from_fn(|i| {
                    low.velocity_ned_m_s[i]
                        + part * (high.velocity_ned_m_s[i] - low.velocity_ned_m_s[i])
                })
            }
            (Some(end), None) | (None, Some(end)) => end.velocity_ned_m_s,
            (None, None) => [0.0; 3],
        };
        Ned::new(wind[0], wind[1], wind[2])
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
            ..WindSettings::default()
        };
        assert!((steady(&east).0 - Vector3::new(0.0, 10.0, -1.0)).norm() < 1e-14);
    }
}

#[cfg(test)]
mod gust_tests {
    use super::*;

    const PERIOD_S: f64 = 0.01;
    const AIRSPEED_M_S: f64 = 100.0;

    /// One value each metre.
    fn air(returns: bool) -> Vec<Gust> {
        let gust = DiscreteGust {
            onset_s: 1.0,
            length_m: 50.0,
            forward_m_s: 1.0,
            right_m_s: 2.0,
            down_m_s: -4.0,
            returns,
        };
        let mut gusts = DiscreteGusts::new(&[gust], PERIOD_S);
        let time = |tick: u32| SimTime::from_seconds(PERIOD_S * f64::from(tick)).unwrap();
        (0..300).map(|tick| gusts.step(time(tick), AIRSPEED_M_S, Gust::none())).collect()
    }

    #[test]
    fn it_rises_over_its_length_and_stays_or_returns() {
        for (returns, end) in [(false, 1.0), (true, 0.0)] {
            let air = air(returns);
            let down = |tick: usize| air[tick].velocity.0.z / -4.0;
            assert_eq!(down(100), 0.0);
            assert!((down(125) - 0.5).abs() < 1.0e-12 && (down(150) - 1.0).abs() < 1.0e-12);
            for tick in [200, 250, 299] {
                assert!((down(tick) - end).abs() < 1.0e-12, "{}", down(tick));
            }
            assert_eq!(air[130].velocity.0.x * 2.0, air[130].velocity.0.y);
        }
    }

    #[test]
    fn its_rotation_is_the_slope_of_its_velocity() {
        let air = air(true);
        for tick in 101..298 {
            let slope = |axis: usize| {
                0.5 * (air[tick + 1].velocity.0[axis] - air[tick - 1].velocity.0[axis])
            };
            let [p, q, r]: [f64; 3] = air[tick].rates.0.into();
            assert_eq!(p, 0.0);
            assert!((q + slope(2)).abs() < 5.0e-3 && (r - slope(1)).abs() < 5.0e-3, "{tick}");
        }
    }

    #[test]
    fn what_cannot_be_is_named() {
        let gust = DiscreteGust {
            onset_s: 1.0,
            length_m: 0.5,
            forward_m_s: 0.0,
            right_m_s: 0.0,
            down_m_s: f64::NAN,
            returns: false,
        };
        let text = |gusts: &[DiscreteGust]| check_gusts(gusts).unwrap_err().to_string();
        assert!(
            text(&[gust]).contains("length_m = 0.5 is outside 1 to 10000"),
            "{}",
            text(&[gust])
        );
        let gust = DiscreteGust { length_m: 100.0, ..gust };
        assert!(text(&[gust]).contains("down_m_s = NaN"), "{}", text(&[gust]));
        assert!(text(&[gust; 17]).contains("number of gusts"), "{}", text(&[gust; 17]));
    }
}

#[cfg(test)]
mod profile_tests {
    use super::*;

    fn level(altitude_m: f64, east: f64) -> WindLevel {
        WindLevel { altitude_m, velocity_ned_m_s: [1.0, east, 0.0] }
    }

    #[test]
    fn wind_is_linear_between_levels_and_constant_outside() {
        let profile =
            WindProfile::new(vec![level(0.0, -6.0), level(1_000.0, 4.0), level(3_000.0, 0.0)])
                .unwrap();
        for (altitude_m, east) in [
            (-50.0, -6.0),
            (0.0, -6.0),
            (600.0, 0.0),
            (1_000.0, 4.0),
            (2_000.0, 2.0),
            (3_000.0, 0.0),
            (9_000.0, 0.0),
        ] {
            let wind = profile.at(altitude_m).0;
            assert!((wind.y - east).abs() < 1e-12, "{} m/s at {altitude_m} m", wind.y);
            assert_eq!((wind.x, wind.z), (1.0, 0.0));
        }
        assert_eq!(WindProfile::default().at(100.0), Ned::zero());
        assert!(profile.at(f64::NAN).0.y.is_finite());
    }

    #[test]
    fn levels_out_of_order_or_range_are_refused_with_key_and_value() {
        let message = |levels: Vec<WindLevel>| WindProfile::new(levels).unwrap_err().to_string();
        assert!(
            message(vec![level(10.0, 0.0), level(10.0, 1.0)])
                .starts_with("[plant.wind.level] altitude_m = 10 is outside 10")
        );
        assert!(message(vec![level(f64::NAN, 0.0)]).contains("altitude_m = NaN"));
        assert_eq!(
            message(vec![level(0.0, 300.0)]),
            "[plant.wind.level] velocity_ned_m_s = 300 is outside -200 to 200"
        );
    }
}
