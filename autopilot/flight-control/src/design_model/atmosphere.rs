//! The standard atmosphere as the controller believes it: air density up to 20 km.
//!
//! Source: U.S. Standard Atmosphere 1976 (identical to the ICAO standard in this range). Geometric
//! altitude is taken as geopotential; the difference is 0.1 % of the density at 6 km.

/// Density at sea level, kg/m³.
const DENSITY_SEA_LEVEL: f64 = 1.225;
/// Temperature at sea level, K.
const TEMPERATURE_SEA_LEVEL: f64 = 288.15;
/// Temperature lapse in the troposphere, K/m.
const LAPSE: f64 = 0.0065;
/// g / (R LAPSE), with g = 9.80665 m/s² and R = 287.05287 J/(kg K).
const PRESSURE_EXPONENT: f64 = 9.80665 / (287.052_87 * LAPSE);
/// Top of the troposphere, m.
const TROPOPAUSE_M: f64 = 11_000.0;
/// Scale height of the isothermal layer above it, m: R 216.65 K / g.
const SCALE_HEIGHT_M: f64 = 287.052_87 * 216.65 / 9.80665;

/// Air density at an altitude, kg/m³.
pub(super) fn density(altitude_m: f64) -> f64 {
    let h = altitude_m.clamp(-1_000.0, 20_000.0);
    let troposphere = h.min(TROPOPAUSE_M);
    let ratio = 1.0 - LAPSE / TEMPERATURE_SEA_LEVEL * troposphere;
    let below = DENSITY_SEA_LEVEL * libm::pow(ratio, PRESSURE_EXPONENT - 1.0);
    if h <= TROPOPAUSE_M { below } else { below * libm::exp((TROPOPAUSE_M - h) / SCALE_HEIGHT_M) }
}

#[cfg(test)]
mod tests {
    use super::density;

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
}
