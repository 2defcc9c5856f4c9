//! Messages about position and motion of the aircraft, by the navigation state, and about single instruments, by their samples.
//!
//! What no living sensor gives is unknown: NaN, the code of the field, or no message where its definition has none.

use ::mavlink::dialects::common as wire;
use ::mavlink::dialects::common::HighresImuUpdatedFlags as Updated;
use flight_control::NavigationState;
use flight_control::design_model::atmosphere;
use icd::sensors::SensorKind;
use icd::{Attitude, EulerAngles, Ned};

use crate::codec::Encoded;
use crate::convert;
use crate::telemetry::TelemetryView;
use flight_management::event::Snapshot;

/// Whether the samples of a sensor count.
fn is_alive(state: &Snapshot, sensor: SensorKind) -> bool {
    state.motion().alive(&state.sensors)[sensor as usize]
}

/// The navigation state with NaN in each part that is not known. Among samples, rates and attitude give each other exactly, and the
/// satellites the altitude.
pub fn known(state: &Snapshot) -> NavigationState {
    let mut motion = *state.motion();
    let valid = motion.valid;
    let is_exact = motion.estimate.is_none();
    let nothing = Ned::new(f64::NAN, f64::NAN, f64::NAN);
    if !(valid.rates || is_exact && valid.attitude) {
        motion.rates = nothing.0;
    }
    if !(valid.attitude || is_exact && valid.rates) {
        motion.orientation = Attitude::from_unit_wxyz([f64::NAN; 4]);
        motion.attitude = EulerAngles { phi: f64::NAN, theta: f64::NAN, psi: f64::NAN };
    }
    if !valid.velocity {
        motion.velocity = nothing;
    }
    if !valid.position {
        motion.position = nothing;
        (motion.latitude_rad, motion.longitude_rad) = (f64::NAN, f64::NAN);
    }
    if !(valid.altitude || is_exact && valid.position) {
        motion.altitude_m = f64::NAN;
    }
    if !valid.airspeed {
        motion.airspeed_m_s = f64::NAN;
    }
    if !valid.flow_angles {
        (motion.alpha, motion.beta) = (f64::NAN, f64::NAN);
    }
    motion
}

/// Calibrated airspeed of a true one, m/s; NaN without an altitude.
pub fn calibrated_m_s(true_m_s: f64, altitude_m: f64) -> f64 {
    if altitude_m.is_nan() {
        f64::NAN
    } else {
        atmosphere::calibrated_airspeed(true_m_s, altitude_m)
    }
}

pub fn attitude(state: &Snapshot) -> Encoded {
    let NavigationState { attitude: euler, rates, .. } = known(state);
    Encoded::new(&wire::ATTITUDE_DATA {
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
    let NavigationState { orientation, rates, .. } = known(state);
    let [q1, q2, q3, q4] = orientation.wxyz().map(convert::float);
    Encoded::new(&wire::ATTITUDE_QUATERNION_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        q1,
        q2,
        q3,
        q4,
        rollspeed: convert::float(rates.x),
        pitchspeed: convert::float(rates.y),
        yawspeed: convert::float(rates.z),
        ..wire::ATTITUDE_QUATERNION_DATA::DEFAULT
    })
}

/// GLOBAL_POSITION_INT; its definition has no "unknown" for place and velocity, so none is sent without them.
pub fn global_position_int(state: &Snapshot) -> Option<Encoded> {
    let motion = known(state);
    let velocity = motion.velocity.0;
    if motion.latitude_rad.is_nan() || motion.altitude_m.is_nan() || velocity.x.is_nan() {
        return None;
    }
    Some(Encoded::new(&wire::GLOBAL_POSITION_INT_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        lat: convert::degrees_e7(motion.latitude_rad),
        lon: convert::degrees_e7(motion.longitude_rad),
        alt: convert::millimetres(motion.altitude_m),
        // Home is on the ground.
        relative_alt: convert::millimetres(motion.altitude_m - state.navigation.ground_m),
        vx: convert::centimetres_per_second(velocity.x),
        vy: convert::centimetres_per_second(velocity.y),
        vz: convert::centimetres_per_second(velocity.z),
        hdg: convert::heading_centidegrees(motion.attitude.psi),
    }))
}

pub fn local_position_ned(state: &Snapshot) -> Encoded {
    let NavigationState { position: Ned(position), velocity: Ned(velocity), .. } = known(state);
    Encoded::new(&wire::LOCAL_POSITION_NED_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        x: convert::float(position.x),
        y: convert::float(position.y),
        z: convert::float(position.z),
        vx: convert::float(velocity.x),
        vy: convert::float(velocity.y),
        vz: convert::float(velocity.z),
    })
}

/// Satellites that GPS_RAW_INT reports with a fix. None is simulated, and a station that shows a 3D fix with none, or with an
/// unknown number (which QGroundControl shows as 0), would warn.
const SATELLITES: u8 = 16;
/// Dilution of precision that it reports then, hundredths: a good one, since QGroundControl shows no number of satellites besides an
/// unknown one.
const DILUTION: u16 = 100;

/// GPS_RAW_INT: what the receiver says. Its accuracy is that which the estimator assumes; the receiver of the ideal unit has no errors.
pub fn gps_raw_int(view: &TelemetryView, state: &Snapshot) -> Encoded {
    let nothing = wire::GPS_RAW_INT_DATA {
        time_usec: state.time.as_micros(),
        fix_type: wire::GpsFixType::GPS_FIX_TYPE_NO_FIX,
        eph: u16::MAX,
        epv: u16::MAX,
        vel: u16::MAX,
        cog: u16::MAX,
        satellites_visible: u8::MAX,
        // The receiver gives no yaw; the navigation unit does.
        yaw: 0,
        ..wire::GPS_RAW_INT_DATA::DEFAULT
    };
    if !is_alive(state, SensorKind::Gnss) {
        return Encoded::new(&nothing);
    }
    let fix = state.sensors.gnss.value;
    let velocity = fix.velocity.0;
    let altitude = convert::millimetres(fix.altitude_m);
    let gains = view.shared.parameters.gains.of_estimator();
    let is_exact = state.motion().estimate.is_none();
    let accuracy = |error: f64| convert::accuracy_mm(if is_exact { 0.0 } else { error });
    let position_m = libm::hypot(gains.gnss_position_m, gains.gnss_drift_m);
    Encoded::new(&wire::GPS_RAW_INT_DATA {
        fix_type: wire::GpsFixType::GPS_FIX_TYPE_3D_FIX,
        lat: convert::degrees_e7(fix.latitude_rad),
        lon: convert::degrees_e7(fix.longitude_rad),
        alt: altitude,
        alt_ellipsoid: altitude,
        eph: DILUTION,
        epv: DILUTION,
        satellites_visible: SATELLITES,
        vel: convert::centimetres_per_second_unsigned(libm::hypot(velocity.x, velocity.y)),
        cog: convert::heading_centidegrees(libm::atan2(velocity.y, velocity.x)),
        h_acc: accuracy(position_m),
        v_acc: accuracy(position_m * gains.gnss_vertical),
        vel_acc: accuracy(gains.gnss_velocity_m_s),
        ..nothing
    })
}

pub fn altitude(state: &Snapshot) -> Encoded {
    let motion = known(state);
    let altitude = convert::float(motion.altitude_m);
    // The ground is level.
    let above_ground_m = motion.altitude_m - state.navigation.ground_m;
    let clearance_m = motion.height_above_ground_m.unwrap_or(above_ground_m);
    Encoded::new(&wire::ALTITUDE_DATA {
        time_usec: state.time.as_micros(),
        altitude_monotonic: altitude,
        altitude_amsl: altitude,
        altitude_local: convert::float(-motion.position.0.z),
        altitude_relative: convert::float(above_ground_m),
        altitude_terrain: convert::float(above_ground_m),
        bottom_clearance: convert::float(clearance_m),
    })
}

/// HOME_POSITION, once home is known.
pub fn home_position(view: &TelemetryView) -> Option<Encoded> {
    let home = view.shared.aircraft.home()?;
    let position = home.position.0;
    Some(Encoded::new(&wire::HOME_POSITION_DATA {
        latitude: convert::degrees_e7(home.latitude_rad),
        longitude: convert::degrees_e7(home.longitude_rad),
        altitude: convert::millimetres(view.shared.aircraft.ground_m()),
        x: convert::float(position.x),
        y: convert::float(position.y),
        z: convert::float(position.z),
        q: [1.0, 0.0, 0.0, 0.0],
        time_usec: view.shared.aircraft.snapshot().map_or(0, |state| state.time.as_micros()),
        ..wire::HOME_POSITION_DATA::DEFAULT
    }))
}

/// ODOMETRY: position in the local axes, velocity in body axes.
pub fn odometry(state: &Snapshot) -> Encoded {
    let motion = known(state);
    let (position, rates) = (motion.position.0, motion.rates);
    let velocity = motion.orientation.to_body(motion.velocity).0;
    // A NaN in the first place marks the covariance as unknown.
    let mut unknown = [0.0; 21];
    unknown[0] = f32::NAN;
    Encoded::new(&wire::ODOMETRY_DATA {
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
        frame_id: wire::MavFrame::MAV_FRAME_LOCAL_NED,
        child_frame_id: wire::MavFrame::MAV_FRAME_BODY_FRD,
        estimator_type: wire::MavEstimatorType::MAV_ESTIMATOR_TYPE_AUTOPILOT,
        ..wire::ODOMETRY_DATA::DEFAULT
    })
}

/// Temperature of the standard atmosphere, K: there is no thermometer.
fn temperature_k(state: &Snapshot) -> f64 {
    let altitude_m = known(state).altitude_m;
    if altitude_m.is_nan() { f64::NAN } else { atmosphere::temperature(altitude_m) }
}

/// HIGHRES_IMU. What is unknown is NaN and not among the updated fields; so is the magnetic field.
pub fn highres_imu(state: &Snapshot) -> Encoded {
    let mut updated = Updated::HIGHRES_IMU_UPDATED_TEMPERATURE;
    let mut values = |sensor, values: [f64; 3], flags: Updated| {
        let alive = is_alive(state, sensor);
        updated.set(flags, alive);
        values.map(|value| if alive { value } else { f64::NAN })
    };
    let samples = &state.sensors;
    let [xacc, yacc, zacc] = values(
        SensorKind::Accelerometer,
        samples.accelerometer.value.0.into(),
        Updated::HIGHRES_IMU_UPDATED_XACC
            | Updated::HIGHRES_IMU_UPDATED_YACC
            | Updated::HIGHRES_IMU_UPDATED_ZACC,
    );
    let [xgyro, ygyro, zgyro] = values(
        SensorKind::Gyro,
        samples.gyro.value.0.into(),
        Updated::HIGHRES_IMU_UPDATED_XGYRO
            | Updated::HIGHRES_IMU_UPDATED_YGYRO
            | Updated::HIGHRES_IMU_UPDATED_ZGYRO,
    );
    let barometer = samples.barometer.value;
    let [static_pa, pressure_altitude_m, _] = values(
        SensorKind::Barometer,
        [barometer.pressure_pa, barometer.altitude_m, 0.0],
        Updated::HIGHRES_IMU_UPDATED_ABS_PRESSURE | Updated::HIGHRES_IMU_UPDATED_PRESSURE_ALT,
    );
    let [impact_pa, ..] = values(
        SensorKind::Pitot,
        [samples.pitot.value.impact_pa, 0.0, 0.0],
        Updated::HIGHRES_IMU_UPDATED_DIFF_PRESSURE,
    );
    let kelvin = temperature_k(state);
    updated.set(Updated::HIGHRES_IMU_UPDATED_TEMPERATURE, !kelvin.is_nan());
    Encoded::new(&wire::HIGHRES_IMU_DATA {
        time_usec: state.time.as_micros(),
        xacc: convert::float(xacc),
        yacc: convert::float(yacc),
        zacc: convert::float(zacc),
        xgyro: convert::float(xgyro),
        ygyro: convert::float(ygyro),
        zgyro: convert::float(zgyro),
        xmag: f32::NAN,
        ymag: f32::NAN,
        zmag: f32::NAN,
        abs_pressure: convert::hectopascals(static_pa),
        diff_pressure: convert::hectopascals(impact_pa),
        pressure_alt: convert::float(pressure_altitude_m),
        temperature: convert::celsius(kelvin),
        fields_updated: updated,
        id: 0,
    })
}

pub fn scaled_pressure(state: &Snapshot) -> Encoded {
    let pressure = |sensor, pascals: f64| {
        convert::hectopascals(if is_alive(state, sensor) { pascals } else { f64::NAN })
    };
    let samples = &state.sensors;
    Encoded::new(&wire::SCALED_PRESSURE_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        press_abs: pressure(SensorKind::Barometer, samples.barometer.value.pressure_pa),
        press_diff: pressure(SensorKind::Pitot, samples.pitot.value.impact_pa),
        temperature: convert::centidegrees_celsius(temperature_k(state)),
        // Zero: not available.
        temperature_press_diff: 0,
    })
}

/// WIND_COV: the wind at one tick. Its variability is not estimated: NaN.
pub fn wind_cov(state: &Snapshot) -> Encoded {
    let motion = known(state);
    let wind = motion.wind().0;
    Encoded::new(&wire::WIND_COV_DATA {
        time_usec: state.time.as_micros(),
        wind_x: convert::float(wind.x),
        wind_y: convert::float(wind.y),
        wind_z: convert::float(wind.z),
        var_horiz: f32::NAN,
        var_vert: f32::NAN,
        wind_alt: convert::float(motion.altitude_m),
        // The accuracies are zero: unknown.
        ..wire::WIND_COV_DATA::DEFAULT
    })
}
