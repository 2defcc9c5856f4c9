//! Messages about position and motion of the aircraft, and the navigation state in the form that a ground station expects from
//! single instruments.
//!
//! The aircraft carries an ideal navigation unit and an air-data computer, not the instruments behind them. Pressures and
//! temperature are those of the standard atmosphere at their altitude and airspeed; there is no magnetometer.

use ::mavlink::dialects::common::{
    ALTITUDE_DATA, ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA, GLOBAL_POSITION_INT_DATA,
    GPS_RAW_INT_DATA, GpsFixType, HIGHRES_IMU_DATA, HOME_POSITION_DATA,
    HighresImuUpdatedFlags as Updated, LOCAL_POSITION_NED_DATA, MavEstimatorType, MavFrame,
    ODOMETRY_DATA, SCALED_PRESSURE_DATA, VFR_HUD_DATA, WIND_COV_DATA,
};
use flight_control::NavigationState;
use flight_control::design_model::atmosphere;
use icd::Ned;

use crate::codec::Encoded;
use crate::convert;
use crate::telemetry::View;
use crate::telemetry::controls::throttle;
use flight_management::event::Snapshot;

pub fn attitude(state: &Snapshot) -> Encoded {
    let euler = state.motion().attitude;
    let rates = state.motion().rates;
    Encoded::new(&ATTITUDE_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        roll: convert::float(euler.phi),
        pitch: convert::float(euler.theta),
        yaw: convert::float(euler.psi),
        rollspeed: convert::float(rates.x),
        pitchspeed: convert::float(rates.y),
        yawspeed: convert::float(rates.z),
    })
}

pub fn attitude_quaternion(state: &Snapshot) -> Encoded {
    let [q1, q2, q3, q4] = state.motion().orientation.wxyz().map(convert::float);
    let rates = state.motion().rates;
    Encoded::new(&ATTITUDE_QUATERNION_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        q1,
        q2,
        q3,
        q4,
        rollspeed: convert::float(rates.x),
        pitchspeed: convert::float(rates.y),
        yawspeed: convert::float(rates.z),
        repr_offset_q: [0.0; 4],
    })
}

pub fn global_position_int(state: &Snapshot) -> Encoded {
    let motion = state.motion();
    let velocity = motion.velocity.0;
    let altitude = convert::millimetres(motion.altitude_m);
    Encoded::new(&GLOBAL_POSITION_INT_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        lat: convert::degrees_e7(motion.latitude_rad),
        lon: convert::degrees_e7(motion.longitude_rad),
        alt: altitude,
        // Home is at altitude zero.
        relative_alt: altitude,
        vx: convert::centimetres_per_second(velocity.x),
        vy: convert::centimetres_per_second(velocity.y),
        vz: convert::centimetres_per_second(velocity.z),
        hdg: convert::heading_centidegrees(motion.attitude.psi),
    })
}

pub fn local_position_ned(state: &Snapshot) -> Encoded {
    let (position, velocity) = (state.motion().position.0, state.motion().velocity.0);
    Encoded::new(&LOCAL_POSITION_NED_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        x: convert::float(position.x),
        y: convert::float(position.y),
        z: convert::float(position.z),
        vx: convert::float(velocity.x),
        vy: convert::float(velocity.y),
        vz: convert::float(velocity.z),
    })
}

/// Satellites that GPS_RAW_INT reports. None is simulated: the navigation unit is ideal, and a station that shows a 3D fix
/// with none, or with an unknown number (which QGroundControl shows as 0), would warn.
const SATELLITES: u8 = 16;
/// Dilution of precision that it reports, hundredths: a good one, since QGroundControl shows no number of satellites besides an
/// unknown one.
const DILUTION: u16 = 100;

pub fn gps_raw_int(state: &Snapshot) -> Encoded {
    let motion = state.motion();
    let velocity = motion.velocity.0;
    let altitude = convert::millimetres(motion.altitude_m);
    Encoded::new(&GPS_RAW_INT_DATA {
        time_usec: state.time.as_micros(),
        fix_type: GpsFixType::GPS_FIX_TYPE_3D_FIX,
        lat: convert::degrees_e7(motion.latitude_rad),
        lon: convert::degrees_e7(motion.longitude_rad),
        alt: altitude,
        alt_ellipsoid: altitude,
        eph: DILUTION,
        epv: DILUTION,
        satellites_visible: SATELLITES,
        vel: convert::centimetres_per_second_unsigned(libm::hypot(velocity.x, velocity.y)),
        cog: convert::heading_centidegrees(course_rad(&motion.velocity)),
        // The navigation unit is ideal: no uncertainty.
        h_acc: 0,
        v_acc: 0,
        vel_acc: 0,
        hdg_acc: 0,
        // The receiver gives no yaw; the navigation unit does.
        yaw: 0,
    })
}

/// Course over the ground, rad from north.
fn course_rad(velocity: &Ned) -> f64 {
    libm::atan2(velocity.0.y, velocity.0.x)
}

pub fn vfr_hud(view: &View, state: &Snapshot) -> Encoded {
    let motion = state.motion();
    let velocity = motion.velocity.0;
    Encoded::new(&VFR_HUD_DATA {
        airspeed: convert::float(motion.airspeed_m_s),
        groundspeed: convert::float(libm::hypot(velocity.x, velocity.y)),
        alt: convert::float(motion.altitude_m),
        climb: convert::float(motion.climb_rate_m_s()),
        heading: convert::heading_degrees(motion.attitude.psi),
        throttle: convert::percent(throttle(state, &view.shared.model)),
    })
}

pub fn altitude(state: &Snapshot) -> Encoded {
    let altitude = convert::float(state.motion().altitude_m);
    Encoded::new(&ALTITUDE_DATA {
        time_usec: state.time.as_micros(),
        altitude_monotonic: altitude,
        altitude_amsl: altitude,
        altitude_local: convert::float(-state.motion().position.0.z),
        altitude_relative: altitude,
        // The ground is at altitude zero everywhere.
        altitude_terrain: altitude,
        bottom_clearance: altitude,
    })
}

/// HOME_POSITION, once home is known.
pub fn home_position(view: &View) -> Option<Encoded> {
    let home = view.shared.aircraft.home()?;
    let position = home.position.0;
    Some(Encoded::new(&HOME_POSITION_DATA {
        latitude: convert::degrees_e7(home.latitude_rad),
        longitude: convert::degrees_e7(home.longitude_rad),
        altitude: 0,
        x: convert::float(position.x),
        y: convert::float(position.y),
        z: convert::float(position.z),
        q: [1.0, 0.0, 0.0, 0.0],
        approach_x: 0.0,
        approach_y: 0.0,
        approach_z: 0.0,
        time_usec: view.shared.aircraft.snapshot().map_or(0, |state| state.time.as_micros()),
    }))
}

/// ODOMETRY: position in the local axes, velocity in body axes.
pub fn odometry(state: &Snapshot) -> Encoded {
    let motion = state.motion();
    let (position, rates) = (motion.position.0, motion.rates);
    let velocity = motion.orientation.to_body(motion.velocity).0;
    // A NaN in the first place marks the covariance as unknown.
    let mut unknown = [0.0; 21];
    unknown[0] = f32::NAN;
    Encoded::new(&ODOMETRY_DATA {
        time_usec: state.time.as_micros(),
        x: convert::float(position.x),
        y: convert::float(position.y),
        z: convert::float(position.z),
        q: motion.orientation.wxyz().map(convert::float),
        vx: convert::float(velocity.x),
        vy: convert::float(velocity.y),
        vz: convert::float(velocity.z),
        rollspeed: convert::float(rates.x),
        pitchspeed: convert::float(rates.y),
        yawspeed: convert::float(rates.z),
        pose_covariance: unknown,
        velocity_covariance: unknown,
        frame_id: MavFrame::MAV_FRAME_LOCAL_NED,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        reset_counter: 0,
        estimator_type: MavEstimatorType::MAV_ESTIMATOR_TYPE_AUTOPILOT,
        quality: 0,
    })
}

/// Ratio of the specific heats of air.
const GAMMA: f64 = 1.4;

/// Air data, as a pitot-static tube would measure them.
struct AirData {
    /// Static pressure, Pa.
    static_pa: f64,
    /// Impact pressure, Pa.
    impact_pa: f64,
    /// Static temperature, K.
    temperature_k: f64,
}

impl AirData {
    /// Isentropic flow up to Mach 1: `q_c = p ((1 + (γ - 1)/2 M²)^(γ/(γ - 1)) - 1)`. Beyond it a shock in front
    /// of the tube reduces the pressure, which is neglected here.
    fn of(motion: &NavigationState) -> Self {
        let temperature_k = atmosphere::temperature(motion.altitude_m);
        let static_pa = atmosphere::pressure(motion.altitude_m);
        let mach =
            motion.airspeed_m_s / libm::sqrt(GAMMA * atmosphere::GAS_CONSTANT * temperature_k);
        let ratio = 1.0 + 0.5 * (GAMMA - 1.0) * mach * mach;
        let impact_pa = static_pa * (libm::pow(ratio, GAMMA / (GAMMA - 1.0)) - 1.0);
        Self { static_pa, impact_pa, temperature_k }
    }
}

/// HIGHRES_IMU. The magnetic field is NaN and not among the updated fields.
pub fn highres_imu(state: &Snapshot) -> Encoded {
    let motion = state.motion();
    let air = AirData::of(motion);
    let (force, rates) = (motion.specific_force.0, motion.rates);
    let magnetic = Updated::HIGHRES_IMU_UPDATED_XMAG
        | Updated::HIGHRES_IMU_UPDATED_YMAG
        | Updated::HIGHRES_IMU_UPDATED_ZMAG;
    Encoded::new(&HIGHRES_IMU_DATA {
        time_usec: state.time.as_micros(),
        xacc: convert::float(force.x),
        yacc: convert::float(force.y),
        zacc: convert::float(force.z),
        xgyro: convert::float(rates.x),
        ygyro: convert::float(rates.y),
        zgyro: convert::float(rates.z),
        xmag: f32::NAN,
        ymag: f32::NAN,
        zmag: f32::NAN,
        abs_pressure: convert::hectopascals(air.static_pa),
        diff_pressure: convert::hectopascals(air.impact_pa),
        pressure_alt: convert::float(motion.altitude_m),
        temperature: convert::celsius(air.temperature_k),
        fields_updated: Updated::all().difference(magnetic),
        id: 0,
    })
}

pub fn scaled_pressure(state: &Snapshot) -> Encoded {
    let air = AirData::of(state.motion());
    Encoded::new(&SCALED_PRESSURE_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        press_abs: convert::hectopascals(air.static_pa),
        press_diff: convert::hectopascals(air.impact_pa),
        temperature: convert::centidegrees_celsius(air.temperature_k),
        // Zero: not available.
        temperature_press_diff: 0,
    })
}

/// WIND_COV: the wind at one tick. Its variability is not estimated: NaN.
pub fn wind_cov(state: &Snapshot) -> Encoded {
    let wind = state.motion().wind().0;
    Encoded::new(&WIND_COV_DATA {
        time_usec: state.time.as_micros(),
        wind_x: convert::float(wind.x),
        wind_y: convert::float(wind.y),
        wind_z: convert::float(wind.z),
        var_horiz: f32::NAN,
        var_vert: f32::NAN,
        wind_alt: convert::float(state.motion().altitude_m),
        // Zero: unknown.
        horiz_accuracy: 0.0,
        vert_accuracy: 0.0,
    })
}
