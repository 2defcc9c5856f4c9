//! The standard atmosphere in the controller's model, up to 20 km.
//!
//! Source: U.S. Standard Atmosphere 1976 (identical to the ICAO standard in this range). Geometric
//! altitude is taken as geopotential; the difference is 0.1 % of the density at 6 km.

/// Density at sea level, kg/m³.
const DENSITY_SEA_LEVEL: f64 = 1.225;
/// Temperature at sea level, K.
const TEMPERATURE_SEA_LEVEL: f64 = 288.15;
/// Temperature lapse in the troposphere, K/m.
const LAPSE: f64 = 0.0065;
/// R: gas constant of dry air, J/(kg K).
pub const GAS_CONSTANT: f64 = 287.052_87;
/// g / (R LAPSE), with g = 9.80665 m/s².
const PRESSURE_EXPONENT: f64 = 9.80665 / (GAS_CONSTANT * LAPSE);
/// Top of the troposphere, m.
const TROPOPAUSE_M: f64 = 11_000.0;
/// Scale height of the isothermal layer above it, m: R 216.65 K / g.
const SCALE_HEIGHT_M: f64 = GAS_CONSTANT * 216.65 / 9.80665;

/// Altitudes outside the model count as its ends, m.
fn inside(altitude_m: f64) -> f64 {
    altitude_m.clamp(-1_000.0, 20_000.0)
}

/// Air density at an altitude, kg/m³.
#[must_use]
pub fn density(altitude_m: f64) -> f64 {
    let h = inside(altitude_m);
    let troposphere = h.min(TROPOPAUSE_M);
    let ratio = 1.0 - LAPSE / TEMPERATURE_SEA_LEVEL * troposphere;
    // exp(y ln x) instead of pow: half the time, and good to 1e-15 for these small exponents.
    let below = DENSITY_SEA_LEVEL * libm::exp((PRESSURE_EXPONENT - 1.0) * libm::log(ratio));
    if h <= TROPOPAUSE_M { below } else { below * libm::exp((TROPOPAUSE_M - h) / SCALE_HEIGHT_M) }
}

/// Air temperature at an altitude, K.
#[must_use]
pub fn temperature(altitude_m: f64) -> f64 {
    TEMPERATURE_SEA_LEVEL - LAPSE * inside(altitude_m).min(TROPOPAUSE_M)
}

/// Static pressure at an altitude, Pa: `p = ρ R T`.
#[must_use]
pub fn pressure(altitude_m: f64) -> f64 {
    density(altitude_m) * GAS_CONSTANT * temperature(altitude_m)
}

/// Altitude with this static pressure (Pa), m: the inverse of [`pressure`].
#[must_use]
pub fn pressure_altitude(pressure_pa: f64) -> f64 {
    let sea_level = DENSITY_SEA_LEVEL * GAS_CONSTANT * TEMPERATURE_SEA_LEVEL;
    let ratio = libm::exp(libm::log(pressure_pa.max(1.0) / sea_level) / PRESSURE_EXPONENT);
    let troposphere = (1.0 - ratio) * TEMPERATURE_SEA_LEVEL / LAPSE;
    if troposphere <= TROPOPAUSE_M {
        return inside(troposphere);
    }
    inside(TROPOPAUSE_M + SCALE_HEIGHT_M * libm::log(pressure(TROPOPAUSE_M) / pressure_pa.max(1.0)))
}

#[cfg(test)]
mod tests {
    use super::{density, pressure, pressure_altitude, temperature};

    #[test]
    fn the_pressure_altitude_is_the_inverse_of_the_pressure() {
        for altitude_m in [-500.0, 0.0, 5_000.0, 10_999.0, 11_001.0, 19_000.0] {
            let found = pressure_altitude(pressure(altitude_m));
            assert!((found - altitude_m).abs() < 1.0e-6, "{altitude_m} m: {found} m");
        }
        assert!(pressure_altitude(0.0).is_finite());
    }

    #[test]
    fn density_agrees_with_the_printed_table() {
        // U.S. Standard Atmosphere 1976, table of geopotential altitude, four digits.
        for (altitude_m, expected) in
            [(0.0, 1.2250), (5_000.0, 0.73612), (11_000.0, 0.36392), (15_000.0, 0.19367)]
        {
            let found = density(altitude_m);
            assert!((found / expected - 1.0).abs() < 2.0e-4, "{altitude_m} m: {found} kg/m3");
        }
    }

    #[test]
    fn temperature_and_pressure_agree_with_the_printed_table() {
        // The same table: K, Pa.
        for (altitude_m, kelvin, pascal) in
            [(0.0, 288.15, 101_325.0), (5_000.0, 255.65, 54_020.0), (15_000.0, 216.65, 12_045.0)]
        {
            assert!((temperature(altitude_m) - kelvin).abs() < 0.01, "{altitude_m} m");
            let found = pressure(altitude_m);
            assert!((found / pascal - 1.0).abs() < 5.0e-4, "{altitude_m} m: {found} Pa");
        }
    }
}
