//! Lateral guidance: path and ground velocity to a bank angle. It gives the roll reference of step one
//! where a path is flown; the laws do not know it.
//!
//! S. Park, J. Deyst, J. P. How, "A New Nonlinear Guidance Logic for Trajectory Tracking", AIAA 2004-4900,
//! and "Performance and Lyapunov Stability of a Nonlinear Path Following Guidance Method", Journal of
//! Guidance, Control, and Dynamics 30(6), 2007. Equation numbers in this module are those of the first
//! paper. Both end where a jet begins: their aircraft can always fly the commanded turn. The additions for an
//! aircraft whose turns are kilometres wide are in [`approach`].
//!
//! Everything happens in the plane that touches the Earth at the aircraft: positions are offsets from the
//! aircraft, velocities are over the ground. So wind needs no term of its own: the law turns the track,
//! not the nose. All functions are total: whatever the input, the result is finite.

use icd::units::STANDARD_GRAVITY_M_S2;
use nalgebra::Vector2;

pub mod approach;

use approach::{inside_circle, outside_circle, to_line};

/// The law sees at least this ground speed, m/s, because it divides by it.
const SPEED_MIN_M_S: f64 = 1.0;
/// Shorter vectors have no direction, m or m/s.
const LENGTH_MIN: f64 = 1.0e-6;

/// A horizontal vector: x north, y east. Offsets from the aircraft in m, velocities in m/s.
pub type Horizontal = Vector2<f64>;

/// What the law is tuned by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidanceGains {
    /// Period of the oscillation about a path if it were undamped, s.
    pub period_s: f64,
    /// Damping ratio of it.
    pub damping: f64,
    /// Largest bank angle, rad.
    pub bank_max_rad: f64,
}

/// Output of the guidance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steering {
    /// Roll angle, rad, positive to the right.
    pub bank_rad: f64,
    /// Course over the ground, rad clockwise from north, in (-π, π].
    pub course_rad: f64,
    /// Distance of the aircraft from the path, m: positive to the right of a line, outside of a circle.
    pub cross_track_m: f64,
}

impl GuidanceGains {
    /// L1, m: distance of the point on the path that the law aims at.
    ///
    /// For small deviations Eq. (1) with the gain K in place of 2 is y'' + (K V/L1) y' + (K V²/L1²) y = 0.
    /// Damping ζ and period T of it need K = 4 ζ² and L1 = ζ T V / π. With ζ = 1/√2, K is the paper's 2.
    pub fn look_ahead_m(&self, ground_speed_m_s: f64) -> f64 {
        let scale = self.damping * self.period_s / core::f64::consts::PI;
        scale * ground_speed_m_s.max(SPEED_MIN_M_S)
    }

    /// Lateral acceleration of a coordinated level turn at the largest bank angle, m/s².
    pub fn acceleration_max(&self) -> f64 {
        STANDARD_GRAVITY_M_S2 * libm::tan(self.bank_max_rad)
    }

    /// Radius of the tightest turn over the ground at a ground speed, m.
    pub fn turn_radius_m(&self, ground_speed_m_s: f64) -> f64 {
        ground_speed_m_s * ground_speed_m_s / self.acceleration_max()
    }
}

/// The ground velocity, taken apart once.
#[derive(Debug, Clone, Copy)]
struct Track {
    direction: Horizontal,
    speed_m_s: f64,
}

impl Track {
    /// Without speed the aircraft counts as flying along `fallback`.
    fn new(velocity: &Horizontal, fallback: &Horizontal) -> Self {
        let direction = direction(velocity).unwrap_or(*fallback);
        Self { direction, speed_m_s: velocity.norm().max(SPEED_MIN_M_S) }
    }
}

/// Follows the straight line through two points, from the first to the second and beyond.
///
/// `from` and `to` are offsets from the aircraft, m. A line without length leads to its point, and ends
/// there in whatever direction the aircraft has. Differs from the papers: within L1 of the line the aim
/// is theirs; farther out the angle of approach is limited to what the aircraft can turn off in time
/// ([`to_line`]).
pub fn follow_line(
    from: &Horizontal,
    to: &Horizontal,
    velocity: &Horizontal,
    gains: &GuidanceGains,
) -> Steering {
    let along = direction(&(to - from)).or_else(|| direction(to)).or_else(|| direction(velocity));
    let along = along.unwrap_or(NORTH);
    let track = Track::new(velocity, &along);
    // The aircraft is at the origin, so its offset from a point of the line is minus that of the point.
    let cross_track_m = -cross(&along, to);
    let limit = to_line(cross_track_m.abs(), track.speed_m_s, gains);
    let angle = libm::copysign(limit, cross_track_m);
    steer(&turned(&along, -angle), cross_track_m, 0.0, &track, gains)
}

/// Follows a circle of `radius_m` around `centre` (offset from the aircraft, m).
///
/// Differs from the papers: the centripetal acceleration V²/r is fed forward, so that the circle is flown
/// without a steady error whatever the damping (theirs needs K = 2); far outside the aim is the tangent
/// of the circle ([`outside_circle`]), inside it the angle is limited to what can be turned off
/// ([`inside_circle`]). A circle tighter than the aircraft can fly is flown at the largest bank angle.
pub fn follow_circle(
    centre: &Horizontal,
    radius_m: f64,
    clockwise: bool,
    velocity: &Horizontal,
    gains: &GuidanceGains,
) -> Steering {
    let side = if clockwise { 1.0 } else { -1.0 };
    // In the very centre every direction leads outwards: the present one is as good as another.
    let inwards =
        direction(centre).or_else(|| direction(velocity).map(|v| turned(&v, side * RIGHT)));
    let inwards = inwards.unwrap_or(NORTH);
    let tangent = turned(&inwards, -side * RIGHT);
    let track = Track::new(velocity, &tangent);
    // A circle without a radius would need an acceleration without a limit.
    let (r, radius_m) = (centre.norm(), radius_m.max(1.0));
    let cross_track_m = r - radius_m;
    let angle = if cross_track_m >= 0.0 {
        outside_circle(r, radius_m, track.speed_m_s, gains)
    } else {
        -inside_circle(r, radius_m, track.speed_m_s, gains)
    };
    // Flying round the other way feeds nothing forward.
    let around = (track.speed_m_s * track.direction.dot(&tangent)).max(0.0);
    // Deep inside, V²/r would grow without a limit.
    let centripetal = around * around / r.max(0.5 * radius_m);
    steer(&turned(&tangent, side * angle), cross_track_m, side * centripetal, &track, gains)
}

/// Holds a course over the ground, rad clockwise from north.
pub fn hold_course(course_rad: f64, velocity: &Horizontal, gains: &GuidanceGains) -> Steering {
    let (sin, cos) = libm::sincos(course_rad);
    let direction = Horizontal::new(cos, sin);
    steer(&direction, 0.0, 0.0, &Track::new(velocity, &direction), gains)
}

/// Bank angle of the lateral acceleration that turns the track towards `aim`.
///
/// Park's Eq. (1), a = 2 V²/L1 sin η, with K = 4 ζ² in place of 2 (see
/// [`GuidanceGains::look_ahead_m`]); η is the angle from the ground velocity to the aim, and beyond a
/// right angle it counts as one. `extra` is a lateral acceleration that the path itself needs, m/s².
fn steer(
    aim: &Horizontal,
    cross_track_m: f64,
    extra: f64,
    track: &Track,
    gains: &GuidanceGains,
) -> Steering {
    let sin_eta = cross(&track.direction, aim);
    // Straight behind, right is as good as left.
    let sin_eta = match track.direction.dot(aim) < 0.0 {
        true if sin_eta < 0.0 => -1.0,
        true => 1.0,
        false => sin_eta,
    };
    let gain = 4.0 * gains.damping * gains.damping;
    let v = track.speed_m_s;
    let acceleration = gain * v * v / gains.look_ahead_m(v) * sin_eta + extra;
    let bank = libm::atan(acceleration / STANDARD_GRAVITY_M_S2);
    // Not `clamp`, which has a panic for limits that are no numbers.
    let bank = bank.max(-gains.bank_max_rad).min(gains.bank_max_rad);
    let course_rad = libm::atan2(aim.y, aim.x);
    let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
    Steering {
        bank_rad: finite(bank),
        course_rad: finite(course_rad),
        cross_track_m: finite(cross_track_m),
    }
}

const NORTH: Horizontal = Horizontal::new(1.0, 0.0);
/// A quarter turn to the right, rad.
const RIGHT: f64 = core::f64::consts::FRAC_PI_2;

/// Unit vector along `v`, if it has a direction.
fn direction(v: &Horizontal) -> Option<Horizontal> {
    let length = v.norm();
    (length > LENGTH_MIN && length.is_finite()).then(|| v / length)
}

/// Positive when `b` points to the right of `a`.
fn cross(a: &Horizontal, b: &Horizontal) -> f64 {
    a.x * b.y - a.y * b.x
}

/// `v` turned to the right by an angle, rad.
fn turned(v: &Horizontal, angle: f64) -> Horizontal {
    let (sin, cos) = libm::sincos(angle);
    Horizontal::new(v.x * cos - v.y * sin, v.x * sin + v.y * cos)
}

#[cfg(test)]
mod tests;
