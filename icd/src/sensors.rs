//! What the aircraft reports to the flight computer, once a control period.

use serde::{Deserialize, Serialize};

use crate::frames::{Attitude, Body, Ned};

/// One set of sensor values, all taken at the packet's simulation time.
///
/// For now the aircraft carries an ideal inertial navigation unit, air-data computer and vanes; only
/// the gyros can be noisy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sensors {
    /// Body rates p, q, r relative to inertial space, rad/s (gyros).
    pub body_rates: Body,
    /// Specific force, m/s² (accelerometers): (0, 0, -g) at rest on the ground.
    pub specific_force: Body,
    /// Attitude relative to the local NED axes (inertial navigation unit).
    pub attitude: Attitude,
    /// Velocity over the ground, m/s.
    pub velocity: Ned,
    /// Position from the start point at altitude zero, m, in the NED axes of that point.
    pub position: Ned,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Altitude above the ellipsoid (or the flat ground), m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Angle of attack, rad (vane).
    pub angle_of_attack_rad: f64,
    /// Sideslip, rad, positive with the wind from the right (vane).
    pub sideslip_rad: f64,
    /// Engine thrust, N (engine monitor).
    pub thrust_n: f64,
}

impl Sensors {
    /// How many numbers a set of sensors has.
    pub const COUNT: usize = 23;

    /// Names of the numbers in the order of [`Sensors::to_array`].
    pub const NAMES: [&'static str; Self::COUNT] = [
        "body_rate_p_rad_s",
        "body_rate_q_rad_s",
        "body_rate_r_rad_s",
        "specific_force_x_m_s2",
        "specific_force_y_m_s2",
        "specific_force_z_m_s2",
        "attitude_w",
        "attitude_x",
        "attitude_y",
        "attitude_z",
        "velocity_north_m_s",
        "velocity_east_m_s",
        "velocity_down_m_s",
        "position_north_m",
        "position_east_m",
        "position_down_m",
        "latitude_rad",
        "longitude_rad",
        "altitude_m",
        "airspeed_m_s",
        "angle_of_attack_rad",
        "sideslip_rad",
        "thrust_n",
    ];

    /// The numbers in wire order.
    #[must_use]
    pub fn to_array(&self) -> [f64; Self::COUNT] {
        let [w, x, y, z] = self.attitude.wxyz();
        [
            self.body_rates.0.x,
            self.body_rates.0.y,
            self.body_rates.0.z,
            self.specific_force.0.x,
            self.specific_force.0.y,
            self.specific_force.0.z,
            w,
            x,
            y,
            z,
            self.velocity.0.x,
            self.velocity.0.y,
            self.velocity.0.z,
            self.position.0.x,
            self.position.0.y,
            self.position.0.z,
            self.latitude_rad,
            self.longitude_rad,
            self.altitude_m,
            self.airspeed_m_s,
            self.angle_of_attack_rad,
            self.sideslip_rad,
            self.thrust_n,
        ]
    }

    /// From the numbers in wire order, bit for bit: the quaternion is not normalised again.
    #[must_use]
    pub fn from_array(v: &[f64; Self::COUNT]) -> Self {
        Self {
            body_rates: Body::new(v[0], v[1], v[2]),
            specific_force: Body::new(v[3], v[4], v[5]),
            attitude: Attitude::from_unit_wxyz([v[6], v[7], v[8], v[9]]),
            velocity: Ned::new(v[10], v[11], v[12]),
            position: Ned::new(v[13], v[14], v[15]),
            latitude_rad: v[16],
            longitude_rad: v[17],
            altitude_m: v[18],
            airspeed_m_s: v[19],
            angle_of_attack_rad: v[20],
            sideslip_rad: v[21],
            thrust_n: v[22],
        }
    }
}
