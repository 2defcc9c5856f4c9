//! The still air: density, pressure, temperature, speed of sound.
//!
//! US Standard Atmosphere 1976, which is the ISA up to 32 km. Its height is the geopotential altitude; the
//! Earth turns a height into that ([`crate::earth::Place::geopotential_altitude_m`]), so that on the flat
//! Earth, where gravity is constant, both are the same.

/// Gas constant of dry air, J/(kg K): 8314.32 / 28.9644 (US-1976).
const GAS_CONSTANT: f64 = 8_314.32 / 28.964_4;

/// Ratio of the specific heats of air (US-1976).
const HEAT_RATIO: f64 = 1.4;

/// Standard gravity g0, m/s² (CGPM 1901; US-1976).
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// Lowest geopotential altitude of the model, m; air below it counts as air at it.
pub const LOWEST_M: f64 = -5_000.0;

/// Highest geopotential altitude of the model, m (US-1976); air above it counts as air at it.
pub const HIGHEST_M: f64 = 84_852.0;

/// The air at one place.
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

/// Temperature (K) and pressure (Pa) at a geopotential altitude.
#[inline]
fn temperature_and_pressure(geopotential_altitude_m: f64) -> (f64, f64) {
    // max before min: a NaN becomes the lowest altitude, so that the function is total.
    let altitude = geopotential_altitude_m.max(LOWEST_M).min(HIGHEST_M);
    let mut at = &LAYERS[0];
    for next in &LAYERS[1..] {
        if altitude < next.base_m {
            break;
        }
        at = next;
    }
    let height = altitude - at.base_m;
    let temperature = at.base_temperature + at.gradient * height;
    // exp(y ln x) instead of pow: half the time, and good to 1e-15 for these small exponents.
    let exponent = if at.gradient == 0.0 {
        -STANDARD_GRAVITY * height / (GAS_CONSTANT * at.base_temperature)
    } else {
        -STANDARD_GRAVITY / (GAS_CONSTANT * at.gradient)
            * libm::log(temperature / at.base_temperature)
    };
    (temperature, at.base_pressure * libm::exp(exponent))
}

/// The air at a geopotential altitude in m.
///
/// Altitudes outside [`LOWEST_M`] to [`HIGHEST_M`] count as the nearer limit.
#[must_use]
pub fn isa(geopotential_altitude_m: f64) -> Air {
    let (temperature, pressure) = temperature_and_pressure(geopotential_altitude_m);
    Air {
        density: pressure / (GAS_CONSTANT * temperature),
        pressure,
        temperature,
        speed_of_sound: f64::sqrt(HEAT_RATIO * GAS_CONSTANT * temperature),
    }
}

/// Density alone, kg/m³: what each stage of the integration needs; the same bits as [`isa`].
#[inline]
#[must_use]
pub fn density(geopotential_altitude_m: f64) -> f64 {
    let (temperature, pressure) = temperature_and_pressure(geopotential_altitude_m);
    pressure / (GAS_CONSTANT * temperature)
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn layers_meet_without_a_step() {
        for layer in &LAYERS[1..] {
            let below = isa(layer.base_m - 1e-6).pressure;
            let above = isa(layer.base_m).pressure;
            // 1e-6 m are 2e-10 of the pressure.
            assert!((below / above - 1.0).abs() < 1e-9, "{} m: {below}, {above} Pa", layer.base_m);
        }
    }

    #[test]
    fn the_short_cut_for_density_has_the_same_bits() {
        for altitude in [-100.0, 0.0, 4_321.0, 12_000.0, 90_000.0] {
            assert_eq!(density(altitude).to_bits(), isa(altitude).density.to_bits(), "{altitude} m");
        }
    }

    #[test]
    fn absurd_altitudes_give_finite_air() {
        for altitude in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert!(isa(altitude).density > 0.0, "{altitude} m");
        }
    }
}
