//! The standard atmosphere in the controller's model, up to 20 km.
//!
//! Source: U.S. Standard Atmosphere 1976 (identical to the ICAO standard in this range). Geometric
//! altitude is taken as geopotential; the difference is 0.1 % of the density at 6 km.

use icd::units::STANDARD_GRAVITY_M_S2;

/// Density at sea level, kg/m³.
const DENSITY_SEA_LEVEL: f64 = 1.225;
/// Temperature at sea level, K.
const TEMPERATURE_SEA_LEVEL: f64 = 288.15;
/// Temperature lapse in the troposphere, K/m.
const LAPSE: f64 = 0.0065;
/// Ratio of the specific heats of air.
pub const HEAT_RATIO: f64 = 1.4;
/// R: gas constant of dry air, J/(kg K).
pub const GAS_CONSTANT: f64 = 287.052_87;
/// g / (R LAPSE), with g = 9.80665 m/s².
const PRESSURE_EXPONENT: f64 = STANDARD_GRAVITY_M_S2 / (GAS_CONSTANT * LAPSE);
/// Top of the troposphere, m.
const TROPOPAUSE_M: f64 = 11_000.0;
/// Scale height of the isothermal layer above it, m: R 216.65 K / g.
const SCALE_HEIGHT_M: f64 = GAS_CONSTANT * 216.65 / STANDARD_GRAVITY_M_S2;

/// Altitudes outside the model count as its ends, m.
fn inside(altitude_m: f64) -> f64 {
    altitude_m.clamp(-1_000.0, 20_000.0)
}

/// Air density at an altitude, kg/m³.
pub fn density(altitude_m: f64) -> f64 {
    let h = inside(altitude_m);
    let troposphere = h.min(TROPOPAUSE_M);
    let ratio = 1.0 - LAPSE / TEMPERATURE_SEA_LEVEL * troposphere;
    // exp(y ln x) instead of pow: half the time, and good to 1e-15 for these small exponents.
    let below = DENSITY_SEA_LEVEL * libm::exp((PRESSURE_EXPONENT - 1.0) * libm::log(ratio));
    if h <= TROPOPAUSE_M { below } else { below * libm::exp((TROPOPAUSE_M - h) / SCALE_HEIGHT_M) }
}

/// Air temperature at an altitude, K.
pub fn temperature(altitude_m: f64) -> f64 {
    TEMPERATURE_SEA_LEVEL - LAPSE * inside(altitude_m).min(TROPOPAUSE_M)
}

/// Static pressure at an altitude, Pa: `p = ρ R T`.
pub fn pressure(altitude_m: f64) -> f64 {
    density(altitude_m) * GAS_CONSTANT * temperature(altitude_m)
}

/// Speed of sound at an altitude, m/s.
fn speed_of_sound(altitude_m: f64) -> f64 {
    libm::sqrt(HEAT_RATIO * GAS_CONSTANT * temperature(altitude_m))
}

/// The airspeed at one altitude that has the impact pressure of an airspeed at another one, m/s.
///
/// Isentropic flow: `q_c = p ((1 + 0.2 M²)^3.5 - 1)`. Above Mach 1 a shock in front of the tube reduces the pressure, which is
/// neglected here, as it is in the pitot tube of the simulation.
fn same_impact(airspeed_m_s: f64, from_m: f64, to_m: f64) -> f64 {
    let mach = airspeed_m_s / speed_of_sound(from_m);
    let impact = libm::pow(1.0 + 0.2 * mach * mach, 3.5) - 1.0;
    let ratio = 1.0 + impact * pressure(from_m) / pressure(to_m);
    speed_of_sound(to_m) * libm::sqrt(5.0 * (libm::pow(ratio, 1.0 / 3.5) - 1.0))
}

/// Calibrated airspeed of a true one at an altitude, m/s: the airspeed at sea level with the same impact pressure.
pub fn calibrated_airspeed(true_m_s: f64, altitude_m: f64) -> f64 {
    same_impact(true_m_s, altitude_m, 0.0)
}

/// True airspeed of a calibrated one at an altitude, m/s.
pub fn true_airspeed(calibrated_m_s: f64, altitude_m: f64) -> f64 {
    same_impact(calibrated_m_s, 0.0, altitude_m)
}

/// Altitude with this static pressure (Pa), m: the inverse of [`pressure`].
pub fn pressure_altitude(pressure_pa: f64) -> f64 {
    // From the constants of `density` and not 101325 Pa, so that this is the inverse of `pressure` to rounding.
    let sea_level = DENSITY_SEA_LEVEL * GAS_CONSTANT * TEMPERATURE_SEA_LEVEL;
    // Zero and less have no logarithm.
    let ratio = libm::exp(libm::log(pressure_pa.max(1.0) / sea_level) / PRESSURE_EXPONENT);
    let troposphere = (1.0 - ratio) * TEMPERATURE_SEA_LEVEL / LAPSE;
    if troposphere <= TROPOPAUSE_M {
        return inside(troposphere);
    }
    inside(TROPOPAUSE_M + SCALE_HEIGHT_M * libm::log(pressure(TROPOPAUSE_M) / pressure_pa.max(1.0)))
}

#[cfg(test)]
mod tests {
    use super::{
        calibrated_airspeed, density, pressure, pressure_altitude, temperature, true_airspeed,
    };

    #[test]
    fn calibrated_and_true_airspeed_agree_with_a_table_and_are_inverse() {
        // Knots of calibrated airspeed, feet and knots of true airspeed, by the same definition: E. Lowry's table of 2002, one knot.
        const KNOT: f64 = 1_852.0 / 3_600.0;
        for (calibrated_kt, altitude_ft, true_kt) in
            [(250.0, 10_000.0, 288.0), (300.0, 20_000.0, 401.0), (280.0, 30_000.0, 436.0)]
        {
            let (calibrated, altitude_m) = (calibrated_kt * KNOT, altitude_ft * 0.3048);
            let found = true_airspeed(calibrated, altitude_m);
            assert!((found / KNOT - true_kt).abs() < 1.5, "{calibrated_kt}: {} kt", found / KNOT);
            assert!((calibrated_airspeed(found, altitude_m) - calibrated).abs() < 1.0e-9);
        }
        let jet = calibrated_airspeed(264.0, 5_000.0);
        assert!((jet - 212.0).abs() < 0.01, "{jet} m/s");
        assert!((calibrated_airspeed(264.0, 0.0) - 264.0).abs() < 1.0e-9, "sea level");
    }

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
