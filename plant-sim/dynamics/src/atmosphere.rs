//! The still air: density, pressure, temperature, speed of sound.
//!
//! US Standard Atmosphere 1976, which is the ISA up to 32 km. Its height is the geopotential altitude; the
//! Earth turns a height into that ([`crate::earth::Place::geopotential_altitude_m`]), so that on the flat
//! Earth, where gravity is constant, both are the same. A flight may have air that is warmer or colder by a constant
//! ([`Atmosphere::new`]).

use host_io::problem::Problem;
use icd::units::STANDARD_GRAVITY_M_S2;

use crate::range::check_range;

/// Gas constant of dry air, J/(kg K): 8314.32 / 28.9644 (US-1976).
const GAS_CONSTANT: f64 = 8_314.32 / 28.964_4;

/// Ratio of the specific heats of air (US-1976).
pub const HEAT_RATIO: f64 = 1.4;

/// Lowest geopotential altitude of the model, m; air below it counts as air at it.
pub const LOWEST_M: f64 = -5_000.0;

/// Highest geopotential altitude of the model, m (US-1976); air above it counts as air at it.
pub const HIGHEST_M: f64 = 84_852.0;

/// The air at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Density, kg/m³.
    pub density: f64,
    /// Static pressure, Pa.
    pub pressure: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// Speed of sound, m/s.
    pub speed_of_sound: f64,
}

/// One layer with a constant temperature gradient.
struct Layer {
    base_m: f64,
    base_temperature: f64,
    base_pressure: f64,
    /// dT/dH, K/m.
    gradient: f64,
}

/// US-1976, table 4; the pressures follow from the hydrostatic equation, layer by layer.
const LAYERS: [Layer; 7] = [
    layer(0.0, 288.15, 101_325.0, -0.006_5),
    layer(11_000.0, 216.65, 22_632.063_973_462_9, 0.0),
    layer(20_000.0, 216.65, 5_474.888_669_677_78, 0.001),
    layer(32_000.0, 228.65, 868.018_684_755_229, 0.002_8),
    layer(47_000.0, 270.65, 110.906_305_554_966, 0.0),
    layer(51_000.0, 270.65, 66.938_873_118_687_3, -0.002_8),
    layer(71_000.0, 214.65, 3.956_420_428_040_73, -0.002),
];

const fn layer(base_m: f64, base_temperature: f64, base_pressure: f64, gradient: f64) -> Layer {
    Layer { base_m, base_temperature, base_pressure, gradient }
}

/// The layer of an altitude inside the model.
fn layer_at(altitude_m: f64) -> usize {
    // Below altitude zero the lowest layer goes on.
    LAYERS.iter().rposition(|layer| layer.base_m <= altitude_m).unwrap_or(0)
}

/// The altitude inside the model; a NaN becomes the lowest one, so that everything below is total.
fn inside(geopotential_altitude_m: f64) -> f64 {
    if geopotential_altitude_m.is_nan() {
        return LOWEST_M;
    }
    geopotential_altitude_m.clamp(LOWEST_M, HIGHEST_M)
}

/// The still air of a flight: US-1976, warmer or colder by a constant at all altitudes.
///
/// The pressure at altitude zero stays that of the standard. Above and below it follows from the hydrostatic equation
/// dp/dH = -g0 p / (R T) with the temperature that the air has, so it is another function of the altitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Atmosphere {
    offset_k: f64,
    /// At the base of each layer, Pa.
    base_pressure: [f64; LAYERS.len()],
}

impl Atmosphere {
    pub const STANDARD: Self = {
        let mut base_pressure = [0.0; LAYERS.len()];
        let mut index = 0;
        while index < LAYERS.len() {
            base_pressure[index] = LAYERS[index].base_pressure;
            index += 1;
        }
        Self { offset_k: 0.0, base_pressure }
    };

    /// Warmer than the standard by this, K; colder if it is negative. Zero is [`Atmosphere::STANDARD`], to the bit.
    pub fn new(offset_k: f64) -> Self {
        // Pressures integrated anew could differ from the table in their last digits.
        if offset_k == 0.0 {
            return Self::STANDARD;
        }
        let mut air = Self { offset_k, ..Self::STANDARD };
        // An offset with the pressures of the standard would be air that does not rest.
        for (below, next) in LAYERS[1..].iter().enumerate() {
            air.base_pressure[below + 1] = air.in_layer(below, next.base_m).1;
        }
        air
    }

    /// Checks a temperature offset.
    pub fn check(offset_k: f64) -> Result<(), Problem> {
        check_range("plant.atmosphere", "temperature_offset_k", offset_k, -60.0, 60.0)
    }

    /// Temperature (K) and pressure (Pa) at an altitude by the law of one layer.
    fn in_layer(&self, index: usize, altitude_m: f64) -> (f64, f64) {
        let at = &LAYERS[index];
        let base_temperature = at.base_temperature + self.offset_k;
        let height = altitude_m - at.base_m;
        let temperature = base_temperature + at.gradient * height;
        // exp(y ln x) instead of pow: a third of the time, and good to 1e-15 for these small exponents.
        let exponent = if at.gradient == 0.0 {
            -STANDARD_GRAVITY_M_S2 * height / (GAS_CONSTANT * base_temperature)
        } else {
            -STANDARD_GRAVITY_M_S2 / (GAS_CONSTANT * at.gradient)
                * libm::log(temperature / base_temperature)
        };
        (temperature, self.base_pressure[index] * libm::exp(exponent))
    }

    /// The air at a geopotential altitude in m.
    ///
    /// Altitudes outside [`LOWEST_M`] to [`HIGHEST_M`] count as the nearer limit.
    pub fn air(&self, geopotential_altitude_m: f64) -> Air {
        let altitude_m = inside(geopotential_altitude_m);
        let (temperature, pressure) = self.in_layer(layer_at(altitude_m), altitude_m);
        Air {
            density: pressure / (GAS_CONSTANT * temperature),
            pressure,
            temperature,
            speed_of_sound: f64::sqrt(HEAT_RATIO * GAS_CONSTANT * temperature),
        }
    }

    /// Speed of sound at a geopotential altitude in m, as in [`Atmosphere::air`]; without the exponential of the pressure.
    pub fn speed_of_sound(&self, geopotential_altitude_m: f64) -> f64 {
        let altitude = inside(geopotential_altitude_m);
        let at = &LAYERS[layer_at(altitude)];
        let temperature =
            at.base_temperature + self.offset_k + at.gradient * (altitude - at.base_m);
        f64::sqrt(HEAT_RATIO * GAS_CONSTANT * temperature)
    }
}

/// Pressure altitude: the geopotential altitude, m, with this static pressure, Pa; the nearer end of the model for a pressure
/// outside it.
pub fn pressure_altitude_m(pressure_pa: f64) -> f64 {
    if pressure_pa.is_nan() {
        return LOWEST_M;
    }
    let at = LAYERS.iter().rev().find(|layer| pressure_pa <= layer.base_pressure);
    // A pressure above that of the ground lies below altitude zero, where the lowest layer goes on.
    let at = at.unwrap_or(&LAYERS[0]);
    // 1e-6 Pa is far below the top of the model (0.37 Pa) and keeps the logarithm finite.
    let logarithm = libm::log(pressure_pa.max(1.0e-6) / at.base_pressure);
    let height = if at.gradient == 0.0 {
        -GAS_CONSTANT * at.base_temperature / STANDARD_GRAVITY_M_S2 * logarithm
    } else {
        let exponent = -GAS_CONSTANT * at.gradient / STANDARD_GRAVITY_M_S2;
        at.base_temperature / at.gradient * (libm::exp(exponent * logarithm) - 1.0)
    };
    inside(at.base_m + height)
}

/// The density around one altitude: a power series instead of logarithm and exponential in each stage of the
/// integration, which moves the aircraft by millimetres to metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalDensity {
    atmosphere: Atmosphere,
    altitude_m: f64,
    /// Range of the series up and down, m: never beyond the layer.
    up_m: f64,
    down_m: f64,
    density: f64,
    /// Coefficients of the first to fourth power of the height difference, 1/m to 1/m^4.
    series: [f64; 4],
}

/// Farther than this from its centre, m, the series is not used: its fifth power would reach 1e-16.
const SERIES_M: f64 = 10.0;

impl LocalDensity {
    /// Of this air around a geopotential altitude in m.
    pub fn of(atmosphere: &Atmosphere, geopotential_altitude_m: f64) -> Self {
        let altitude_m = inside(geopotential_altitude_m);
        let index = layer_at(altitude_m);
        let top_m = LAYERS.get(index + 1).map_or(HIGHEST_M, |next| next.base_m);
        let bottom_m = if index == 0 { LOWEST_M } else { LAYERS[index].base_m };
        let air = atmosphere.air(altitude_m);
        // d(rho)/dH = -k rho / T with T linear: the binomial series, for any gradient including zero.
        let gradient = LAYERS[index].gradient;
        let k = STANDARD_GRAVITY_M_S2 / GAS_CONSTANT + gradient;
        let y = -1.0 / air.temperature;
        let first = k * y;
        let second = first * (k + gradient) * y / 2.0;
        let third = second * (k + 2.0 * gradient) * y / 3.0;
        let fourth = third * (k + 3.0 * gradient) * y / 4.0;
        Self {
            atmosphere: *atmosphere,
            altitude_m,
            up_m: (top_m - altitude_m).min(SERIES_M),
            down_m: (bottom_m - altitude_m).max(-SERIES_M),
            density: air.density,
            series: [first, second, third, fourth],
        }
    }

    /// Whether the series is valid at this altitude and half its range around it; otherwise it has to be renewed.
    #[inline]
    pub fn covers(&self, geopotential_altitude_m: f64) -> bool {
        // Half of the range, so that the stages of the step that begins here stay inside it.
        (geopotential_altitude_m - self.altitude_m).abs() < 0.5 * SERIES_M
    }

    /// Density at a geopotential altitude in m, kg/m³; that of [`Atmosphere::air`] to the last digits, anywhere.
    #[inline]
    pub fn at(&self, geopotential_altitude_m: f64) -> f64 {
        let x = geopotential_altitude_m - self.altitude_m;
        if x < self.down_m || x > self.up_m {
            return self.atmosphere.air(geopotential_altitude_m).density;
        }
        let [c1, c2, c3, c4] = self.series;
        self.density * (1.0 + x * (c1 + x * (c2 + x * (c3 + x * c4))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The standard air at a geopotential altitude in m.
    fn isa(geopotential_altitude_m: f64) -> Air {
        Atmosphere::STANDARD.air(geopotential_altitude_m)
    }

    #[test]
    fn val_isa_agrees_with_the_printed_tables() {
        // US-1976 as printed: altitude m, density kg/m3, pressure Pa, temperature K, speed of sound m/s.
        let table = [
            (0.0, 1.2250, 101_325.0, 288.15, 340.29),
            (5_000.0, 0.736_12, 54_019.9, 255.65, 320.53),
            (11_000.0, 0.363_92, 22_632.1, 216.65, 295.07),
            (15_000.0, 0.193_67, 12_044.6, 216.65, 295.07),
            (20_000.0, 0.088_035, 5_474.89, 216.65, 295.07),
            (32_000.0, 0.013_225, 868.019, 228.65, 303.13),
        ];
        for (altitude, density, pressure, temperature, speed_of_sound) in table {
            let air = isa(altitude);
            // 5 printed digits.
            for (what, ours, printed) in [
                ("density", air.density, density),
                ("pressure", air.pressure, pressure),
                ("temperature", air.temperature, temperature),
                ("speed of sound", air.speed_of_sound, speed_of_sound),
            ] {
                assert!(
                    (ours / printed - 1.0).abs() < 2e-5,
                    "{what} at {altitude} m: {ours} instead of {printed}"
                );
            }
        }
    }

    #[test]
    fn the_pressure_altitude_is_the_altitude_of_its_pressure() {
        for altitude_m in [-4_000.0, 0.0, 5_000.0, 11_000.0, 15_000.0, 25_000.0, 60_000.0] {
            let found = pressure_altitude_m(isa(altitude_m).pressure);
            assert!((found - altitude_m).abs() < 1e-6, "{found} m instead of {altitude_m} m");
        }
        for pressure in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            assert!(pressure_altitude_m(pressure).is_finite(), "{pressure} Pa");
        }
    }

    #[test]
    fn layers_meet_without_a_step() {
        for layer in &LAYERS[1..] {
            let below = isa(layer.base_m - 1e-6).pressure;
            let above = isa(layer.base_m).pressure;
            // 1e-6 m are 2e-10 of the pressure.
            assert!((below / above - 1.0).abs() < 1e-9, "{} m: {below}, {above} Pa", layer.base_m);
        }
    }

    #[test]
    fn warm_air_obeys_the_hydrostatic_equation_and_the_gas_law() {
        for offset_k in [-60.0, -20.0, 15.0, 60.0] {
            let atmosphere = Atmosphere::new(offset_k);
            assert_eq!(atmosphere.air(0.0).pressure, 101_325.0, "the pressure at zero stays");
            for altitude in [-1_000.0, 300.0, 5_000.0, 10_980.0, 15_000.0, 40_000.0, 80_000.0] {
                let (here, standard) = (atmosphere.air(altitude), isa(altitude));
                assert!((here.temperature - standard.temperature - offset_k).abs() < 1e-9);
                let gas = here.pressure / (GAS_CONSTANT * here.temperature);
                assert!((here.density / gas - 1.0).abs() < 1e-15, "{} kg/m3", here.density);
                // Central difference over 20 m inside one layer: curvature of 1e-6.
                let [below, above] = [-10.0, 10.0].map(|d| atmosphere.air(altitude + d).pressure);
                let slope = (above - below) / 20.0;
                let weight = -STANDARD_GRAVITY_M_S2 * here.density;
                assert!((slope / weight - 1.0).abs() < 1e-5, "{offset_k} K, {altitude} m: {slope}");
                let quick = atmosphere.speed_of_sound(altitude);
                assert_eq!(quick, here.speed_of_sound, "{offset_k} K, {altitude} m");
            }
        }
        // Warm air is thinner near the ground, and its pressure falls more slowly.
        let warm = Atmosphere::new(20.0);
        assert!(warm.air(0.0).density < isa(0.0).density);
        assert!(warm.air(20_000.0).pressure > isa(20_000.0).pressure);
        assert_eq!(Atmosphere::new(0.0), Atmosphere::STANDARD);
    }

    #[test]
    fn the_local_series_is_the_density_of_the_atmosphere() {
        for (centre, offset_k) in
            [-5_100.0, 0.0, 4_996.0, 10_999.0, 11_000.0, 15_000.0, 25_000.0, 84_851.0, 9e4]
                .into_iter()
                .flat_map(|centre| [(centre, 0.0), (centre, -35.0), (centre, 60.0)])
        {
            let atmosphere = Atmosphere::new(offset_k);
            let isa = |altitude_m: f64| atmosphere.air(altitude_m);
            let local = LocalDensity::of(&atmosphere, centre);
            assert_eq!(local.at(centre), isa(centre).density, "{centre} m");
            for offset in [-300.0, -9.9, -1.5, 1e-3, 0.7, 9.9, 12.0, 500.0] {
                let (ours, exact) = (local.at(centre + offset), isa(centre + offset).density);
                // 1e-14: rounding of the exponent, which the pressure has 34 times; the series is better.
                assert!(
                    (ours / exact - 1.0).abs() < 1e-14,
                    "{centre} + {offset} m: {ours}, {exact}"
                );
            }
        }
    }

    #[test]
    fn the_local_series_is_total() {
        for centre in [f64::NAN, f64::INFINITY, 0.0] {
            for altitude in [f64::NAN, f64::NEG_INFINITY, 1e300] {
                let density = LocalDensity::of(&Atmosphere::STANDARD, centre).at(altitude);
                assert!(density > 0.0 || altitude.is_nan(), "{density} kg/m3 at {altitude} m");
            }
        }
    }

    #[test]
    fn absurd_altitudes_give_finite_air() {
        for altitude in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert!(isa(altitude).density > 0.0, "{altitude} m");
        }
    }
}
