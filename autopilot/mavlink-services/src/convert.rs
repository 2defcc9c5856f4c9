//! The only unit conversions of the ground-station side: from the project's SI and radians to MAVLink's
//! fields and back.
//!
//! A value outside the range of its field saturates and never wraps; NaN becomes zero in an integer field,
//! which has no other way to mark it.

use flight_management::vehicle::Place;
use icd::{EulerAngles, SimTime};

// `as` saturates from float to integer, and negative values at zero in unsigned fields.

fn to_i16(value: f64) -> i16 {
    libm::round(value) as i16
}

fn to_u16(value: f64) -> u16 {
    libm::round(value) as u16
}

/// The nearest whole number.
pub fn to_i32(value: f64) -> i32 {
    libm::round(value) as i32
}

/// 32-bit float field. A number too large for it becomes the largest; infinity and NaN stay unchanged.
pub fn float(value: f64) -> f32 {
    let max = f64::from(f32::MAX);
    if value.is_finite() { value.clamp(-max, max) as f32 } else { value as f32 }
}

/// The decimal number that was typed when `value` arrived on the wire: 0.35, not
/// 0.3499999940395355. So a default that a station sends back is the same default again, to the bit.
pub fn decimal(value: f32) -> f64 {
    // The shortest decimal text of a float always reads back, also "NaN" and "inf".
    value.to_string().parse().unwrap_or(f64::NAN)
}

/// time_boot_ms, milliseconds of simulation time.
pub fn boot_ms(time: SimTime) -> u32 {
    u32::try_from(time.as_micros() / 1000).unwrap_or(u32::MAX)
}

/// Microseconds of simulation time in a 32-bit field; wraps after 71 minutes, as the field's users expect.
pub fn boot_us_low(time: SimTime) -> u32 {
    time.as_micros() as u32
}

/// The whole number that a float encodes, if the type has it.
pub fn whole_number<T: TryFrom<i64>>(value: f64) -> Option<T> {
    // `as` saturates; the types have no number that large.
    let whole = value as i64;
    // NaN has become zero, which it does not equal.
    (whole as f64 == value).then(|| T::try_from(whole).ok()).flatten()
}

/// MAV_FRAME of altitudes above mean sea level (the ellipsoid here).
pub const FRAMES_SEA_LEVEL: [u8; 2] = [0, 5];
/// MAV_FRAME of altitudes above mean sea level and above home. Home is on the ground, and the ground is at altitude zero,
/// so the two are the same.
pub const FRAMES_WITH_ALTITUDE: [u8; 4] = [FRAMES_SEA_LEVEL[0], FRAMES_SEA_LEVEL[1], 3, 6];

/// MAV_FRAME of places in degrees: with the altitude above sea level, above home and above the ground.
pub const GLOBAL_FRAMES: [u8; 6] = [0, 3, 5, 6, 10, 11];

/// A place by degrees; `None` if it is none on the Earth.
pub fn place(latitude_deg: f64, longitude_deg: f64) -> Option<Place> {
    let is_there =
        (-90.0..=90.0).contains(&latitude_deg) && (-180.0..=180.0).contains(&longitude_deg);
    let (latitude_rad, longitude_rad) = (radians(latitude_deg), radians(longitude_deg));
    is_there.then_some(Place { latitude_rad, longitude_rad })
}

/// Latitude or longitude, 1e-7 deg.
pub fn degrees_e7(angle_rad: f64) -> i32 {
    to_i32(angle_rad.to_degrees() * 1.0e7)
}

/// Latitude or longitude in degrees from 1e-7 deg.
pub fn degrees_of_e7(angle: i32) -> f64 {
    f64::from(angle) / 1.0e7
}

/// Millimetres.
pub fn millimetres(metres: f64) -> i32 {
    to_i32(metres * 1.0e3)
}

/// Speed component, cm/s; ±327.67 m/s at most.
pub fn centimetres_per_second(metres_per_second: f64) -> i16 {
    to_i16(metres_per_second * 1.0e2)
}

/// Speed, cm/s; 655.34 m/s at most, since one more means "unknown".
pub fn centimetres_per_second_unsigned(metres_per_second: f64) -> u16 {
    to_u16(metres_per_second * 1.0e2).min(u16::MAX - 1)
}

/// Uncertainty, mm or mm/s.
pub fn accuracy_mm(metres: f64) -> u32 {
    u32::from(to_u16(metres * 1.0e3))
}

/// Distance in whole metres; 65535 m at most, and where it is not known.
pub fn whole_metres(metres: f64) -> u16 {
    if metres.is_nan() { u16::MAX } else { to_u16(metres) }
}

/// Pressure, hPa.
pub fn hectopascals(pascals: f64) -> f32 {
    float(pascals * 1.0e-2)
}

/// Temperature, degC.
pub fn celsius(kelvin: f64) -> f32 {
    float(kelvin - 273.15)
}

/// Temperature, 0.01 degC; the largest number where it is not known.
pub fn centidegrees_celsius(kelvin: f64) -> i16 {
    if kelvin.is_nan() { i16::MAX } else { to_i16((kelvin - 273.15) * 1.0e2) }
}

/// Degrees, not wrapped.
pub fn degrees(angle_rad: f64) -> f64 {
    angle_rad.to_degrees()
}

/// Bearing, -180 to 180 degrees; 32767 where it is not known.
pub fn bearing_degrees(bearing_rad: f64) -> i16 {
    if bearing_rad.is_nan() {
        return i16::MAX;
    }
    let degrees = heading_degrees(bearing_rad);
    if degrees > 180 { degrees - 360 } else { degrees }
}

/// Heading, 0 to 35999 centidegrees; 65535 where it is not known.
pub fn heading_centidegrees(psi_rad: f64) -> u16 {
    if psi_rad.is_nan() {
        return u16::MAX;
    }
    // After rounding, or 359.996 deg would be 36000.
    let centidegrees = to_i32(psi_rad.to_degrees() * 1.0e2).rem_euclid(36_000);
    u16::try_from(centidegrees).unwrap_or(0)
}

/// Heading, 0 to 359 degrees; -1 where it is not known.
pub fn heading_degrees(psi_rad: f64) -> i16 {
    if psi_rad.is_nan() {
        return -1;
    }
    to_i16(psi_rad.to_degrees()).rem_euclid(360)
}

/// Fraction of a range in percent, 0 to 100.
pub fn percent(fraction: f64) -> u16 {
    to_u16(fraction.clamp(0.0, 1.0) * 100.0)
}

/// Percent to a fraction.
pub fn fraction(percent: f64) -> f64 {
    percent / 100.0
}

/// Degrees to radians.
pub fn radians(degrees: f64) -> f64 {
    degrees.to_radians()
}

/// A deflection as a servo pulse: 1500 us in the middle, 500 us to either end of the travel.
pub fn servo_pulse_us(fraction_of_travel: f64) -> u16 {
    to_u16(1500.0 + 500.0 * fraction_of_travel.clamp(-1.0, 1.0))
}

/// A throttle as a servo pulse: 1000 us closed, 2000 us full.
pub fn throttle_pulse_us(fraction: f64) -> u16 {
    to_u16(1000.0 + 1000.0 * fraction.clamp(0.0, 1.0))
}

/// Roll, pitch and yaw of a quaternion (scalar first) that should have unit length; `None` if it is not
/// finite or its squared length is more than 2 % off, which is beyond any rounding.
pub fn euler_of(q: [f32; 4]) -> Option<EulerAngles> {
    let [w, x, y, z] = q.map(f64::from);
    let squared = w * w + x * x + y * y + z * z;
    if !(0.98..=1.02).contains(&squared) {
        return None;
    }
    Some(icd::Attitude::from_quaternion(w, x, y, z).euler())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_speed_beyond_its_field_saturates() {
        assert_eq!(centimetres_per_second(264.0), 26_400);
        assert_eq!(centimetres_per_second(400.0), 32_767);
        assert_eq!(centimetres_per_second(-400.0), -32_768);
        assert_eq!(millimetres(1.0e9), i32::MAX);
        assert_eq!(centimetres_per_second(f64::NAN), 0);
        assert_eq!(centimetres_per_second_unsigned(400.0), 40_000);
        assert_eq!(centimetres_per_second_unsigned(700.0), 65_534, "65535 means unknown");
        assert_eq!(whole_metres(1.0e6), 65_535);
        assert_eq!(centidegrees_celsius(1.0e6), 32_767);
        assert_eq!(float(1.0e300), f32::MAX);
    }

    #[test]
    fn headings_stay_on_the_compass() {
        assert_eq!(heading_centidegrees(-0.5_f64.to_radians()), 35_950);
        assert_eq!(heading_degrees(-0.4_f64.to_radians()), 0);
        assert_eq!(heading_degrees(-90.0_f64.to_radians()), 270);
        assert_eq!(bearing_degrees(270.0_f64.to_radians()), -90);
        assert_eq!(bearing_degrees(180.0_f64.to_radians()), 180);
        assert_eq!(heading_centidegrees(core::f64::consts::TAU), 0);
    }

    #[test]
    fn a_typed_decimal_survives_the_wire() {
        for typed in [0.35, 0.1, 30.0, -7.1, 1.0e-7, 12.3] {
            assert_eq!(decimal(float(typed)).to_bits(), typed.to_bits(), "{typed}");
        }
        assert!(decimal(f32::NAN).is_nan());
        assert_eq!(decimal(f32::NEG_INFINITY), f64::NEG_INFINITY);
    }

    #[test]
    fn a_quaternion_that_is_none_gives_no_angles() {
        assert_eq!(euler_of([f32::NAN, 0.0, 0.0, 0.0]), None);
        assert_eq!(euler_of([0.0; 4]), None);
        assert_eq!(euler_of([2.0, 0.0, 0.0, 0.0]), None);
        let roll = euler_of([0.991_444_9, 0.130_526_2, 0.0, 0.0]).map(|euler| euler.phi);
        // 1e-6 rad: the quaternion has seven digits.
        assert!(
            roll.is_some_and(|phi| (phi - 15.0_f64.to_radians()).abs() < 1.0e-6),
            "{roll:?} rad"
        );
    }

    proptest! {
        #[test]
        fn every_float_reads_back_from_its_decimal(bits in any::<u32>()) {
            let value = f32::from_bits(bits);
            prop_assume!(!value.is_nan());
            prop_assert_eq!(float(decimal(value)), value);
        }

        #[test]
        fn no_value_leaves_its_field(value in any::<f64>()) {
            prop_assert!(heading_centidegrees(value) < 36_000);
            prop_assert!((0..360).contains(&heading_degrees(value)));
            prop_assert!((-180..=180).contains(&bearing_degrees(value)));
            prop_assert!(centimetres_per_second_unsigned(value) < u16::MAX);
            prop_assert!(percent(value) <= 100);
            prop_assert!((1000..=2000).contains(&servo_pulse_us(value)) || value.is_nan());
        }
    }
}
