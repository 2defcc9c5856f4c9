//! Errors of the estimated state beside the standard deviations that the estimator gives.

use icd::EulerAngles;
use nalgebra::Vector3;

use super::flight::Flight;
use lab_report::chart::curve::Point;

/// A quantity of the state with up to three components.
pub struct Quantity {
    /// Title of its panel.
    pub title: &'static str,
    /// Label of the values.
    pub y_label: &'static str,
    /// Smallest span of the values.
    pub span_min: f64,
    /// From the unit of the log to that of the label.
    scale: f64,
    /// Columns of the topic `truth`.
    truth: [&'static str; 3],
    /// Columns of the topic `control`.
    control: [&'static str; 3],
    /// Column of the topic `estimator_status`.
    deviation: &'static str,
    /// Magnitude of the difference, from truth and estimate.
    difference: fn([f64; 3], [f64; 3]) -> f64,
}

const ANGLES: [&str; 3] = ["roll_rad", "pitch_rad", "yaw_rad"];
const POSITION: [&str; 3] = ["position_north_m", "position_east_m", "position_down_m"];
// One component: `difference` reads the first.
const ALTITUDE: [&str; 3] = ["altitude_m"; 3];

pub const QUANTITIES: [Quantity; 4] = [
    Quantity {
        title: "Attitude: angle between estimate and truth",
        y_label: "deg",
        span_min: 0.2,
        scale: 180.0 / std::f64::consts::PI,
        truth: ANGLES,
        control: ANGLES,
        deviation: "attitude_std_rad",
        difference: |truth, estimate| rotation(truth).angle_to(&rotation(estimate)),
    },
    Quantity {
        title: "Velocity",
        y_label: "m/s",
        span_min: 0.2,
        scale: 1.0,
        truth: ["velocity_north_m_s", "velocity_east_m_s", "velocity_down_m_s"],
        control: ["velocity_north_m_s", "velocity_east_m_s", "climb_rate_m_s"],
        deviation: "velocity_std_m_s",
        // The estimate has a climb rate, the truth a velocity downwards.
        difference: |truth, [north, east, climb]| distance(truth, [north, east, -climb]),
    },
    Quantity {
        title: "Horizontal position",
        y_label: "m",
        span_min: 1.0,
        scale: 1.0,
        truth: POSITION,
        control: POSITION,
        deviation: "position_horizontal_std_m",
        difference: |truth, estimate| (truth[0] - estimate[0]).hypot(truth[1] - estimate[1]),
    },
    Quantity {
        title: "Altitude",
        y_label: "m",
        span_min: 1.0,
        scale: 1.0,
        truth: ALTITUDE,
        control: ALTITUDE,
        deviation: "altitude_std_m",
        difference: |truth, estimate| (truth[0] - estimate[0]).abs(),
    },
];

fn rotation([phi, theta, psi]: [f64; 3]) -> nalgebra::UnitQuaternion<f64> {
    icd::Attitude::from_euler(EulerAngles { phi, theta, psi }).q_ned_from_body
}

fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    (Vector3::from(one) - Vector3::from(other)).norm()
}

/// Error and standard deviation over time; `None` if the log lacks one of them.
pub fn of(flight: &Flight, quantity: &Quantity) -> Option<[Vec<Point>; 2]> {
    let truth = flight.rows("truth", quantity.truth);
    let control = flight.rows("control", quantity.control);
    let deviation = flight.rows("estimator_status", [quantity.deviation]);
    // A damaged log has rows of the one without rows of the other.
    let error: Vec<Point> = truth
        .iter()
        .filter_map(|(us, truth)| {
            let k = control.binary_search_by_key(us, |(us, _)| *us).ok()?;
            let error = (quantity.difference)(*truth, control[k].1);
            Some((*us as f64 * 1.0e-6, error * quantity.scale))
        })
        .collect();
    let deviation: Vec<Point> = deviation
        .iter()
        .map(|(us, [deviation])| (*us as f64 * 1.0e-6, deviation * quantity.scale))
        .collect();
    (!error.is_empty() && !deviation.is_empty()).then_some([error, deviation])
}
