//! Numbers of the configuration that are outside their range.

use host_io::problem::{Problem, problem};

/// Checks that a value is inside `min` to `max`, all three in the unit that the key names; NaN is outside every range. `section` is a
/// table of the file, without brackets.
pub fn check_range(
    section: &str,
    key: &str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), Problem> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(out_of_range(section, key, [value, min, max]))
    }
}

/// Checks that no value of a vector is larger than `most`, either way.
pub(crate) fn check_vector(
    section: &str,
    key: &str,
    vector: impl IntoIterator<Item = f64>,
    most: f64,
) -> Result<(), Problem> {
    vector.into_iter().try_for_each(|value| check_range(section, key, value, -most, most))
}

/// A value that is outside its range.
pub fn out_of_range(section: &str, key: &str, numbers: [f64; 3]) -> Problem {
    let [value, min, max] = numbers.map(tidy);
    problem!("[{section}] {key} = {value} is outside {min} to {max}")
}

/// Rounded to nine decimals: a value in degrees was converted through radians and would show rounding errors.
fn tidy(value: f64) -> f64 {
    let rounded = libm::round(value * 1.0e9) / 1.0e9;
    // A tiny number must not be shown as zero, nor a huge one as infinite.
    if rounded.is_finite() && (value == 0.0 || rounded != 0.0) { rounded } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_error_names_key_value_and_limits() {
        let error = check_range("mass", "mass_kg", -1.0, 1.0, 1.0e6).unwrap_err();
        assert_eq!(error.to_string(), "[mass] mass_kg = -1 is outside 1 to 1000000");
    }

    #[test]
    fn nan_and_infinity_are_outside_every_range() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(check_range("a", "b", value, -1.0e300, 1.0e300).is_err(), "{value}");
        }
    }

    #[test]
    fn degrees_that_went_through_radians_are_shown_as_written() {
        let there_and_back = 31.7_f64.to_radians().to_degrees();
        let error = check_range("elevator", "travel_deg", there_and_back, 1.0, 30.0).unwrap_err();
        assert_eq!(error.to_string(), "[elevator] travel_deg = 31.7 is outside 1 to 30");
    }
}
