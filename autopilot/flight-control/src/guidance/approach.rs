//! How steeply a path may be approached: the angle between the aim and the path, by distance from the path.
//!
//! Close to a path the angle is that of Park's geometry: the aim is the point of the path at the distance
//! L1, so that sin δ = y / L1. An aircraft that follows these angles turns with the curvature y / (L1² cos δ), which
//! grows with the distance, and at the bank angles of a jet it is more than the aircraft can fly already a
//! few hundred metres from the path: it would weave across it. So from the distance on at which that turn
//! has the radius that [`RESERVE`] of the largest lateral acceleration gives, the angle is the one from which
//! a turn of this radius leads to that point. All angles are in rad, from 0 to a right angle.

use super::GuidanceGains;

/// Share of the largest lateral acceleration that planned turns use; the rest is for rolling in, wind and
/// gusts.
pub const RESERVE: f64 = 0.75;
/// Least share of the largest lateral acceleration that counts as free for getting back to a circle from
/// inside.
const SHARE_MIN: f64 = 0.1;

/// Radius of a planned turn at a ground speed, m.
pub fn planned_radius_m(ground_speed_m_s: f64, gains: &GuidanceGains) -> f64 {
    gains.turn_radius_m(ground_speed_m_s) / RESERVE
}

/// Angle of approach to a straight line at `distance_m` from it; a right angle from about one radius on.
pub fn to_line(distance_m: f64, ground_speed_m_s: f64, gains: &GuidanceGains) -> f64 {
    let look_ahead_m = gains.look_ahead_m(ground_speed_m_s);
    turn_onto(distance_m, look_ahead_m, planned_radius_m(ground_speed_m_s, gains))
}

/// Angle of approach to a circle of `radius_m` from `r` outside.
///
/// Far outside it is that of a straight line, cos δ = d / r, which meets the circle almost as a tangent: d
/// is chosen so that the bank angle grows from zero to that of the circle where the line comes near.
pub fn outside_circle(r: f64, radius_m: f64, ground_speed_m_s: f64, gains: &GuidanceGains) -> f64 {
    let look_ahead_m = gains.look_ahead_m(ground_speed_m_s);
    let (near_m, cos_near) = near(look_ahead_m, radius_m);
    if r - radius_m <= near_m {
        aim(r - radius_m, look_ahead_m)
    } else {
        // Rounding may leave a little more than one, of which `acos` makes NaN.
        libm::acos(((radius_m + near_m) * cos_near / r).clamp(0.0, 1.0))
    }
}

/// Angle of approach to a circle of `radius_m` from `r` inside.
///
/// As to a line, with the acceleration that the circle itself leaves free.
pub fn inside_circle(r: f64, radius_m: f64, ground_speed_m_s: f64, gains: &GuidanceGains) -> f64 {
    let v2 = ground_speed_m_s * ground_speed_m_s;
    let most = gains.acceleration_max();
    let free = (RESERVE * most - v2 / radius_m).max(SHARE_MIN * most);
    turn_onto(radius_m - r, gains.look_ahead_m(ground_speed_m_s), v2 / free)
}

/// Park's angle nearby, and farther out that of a turn of radius `rho_m`: on it cos δ falls by one for each
/// radius of distance.
fn turn_onto(distance_m: f64, look_ahead_m: f64, rho_m: f64) -> f64 {
    let (near_m, cos_near) = near(look_ahead_m, rho_m);
    if distance_m <= near_m {
        aim(distance_m, look_ahead_m)
    } else {
        libm::acos((cos_near - (distance_m - near_m) / rho_m).clamp(0.0, 1.0))
    }
}

/// Distance up to which Park's angle needs no tighter turn than `rho_m`, y = L1² / ρ, and the cosine of
/// the angle there. A look-ahead longer than the radius is never too much.
fn near(look_ahead_m: f64, rho_m: f64) -> (f64, f64) {
    let sin = (look_ahead_m / rho_m).min(1.0);
    (look_ahead_m * sin, libm::sqrt(1.0 - sin * sin))
}

/// sin δ = y / L1.
fn aim(distance_m: f64, look_ahead_m: f64) -> f64 {
    libm::asin((distance_m / look_ahead_m).clamp(0.0, 1.0))
}
