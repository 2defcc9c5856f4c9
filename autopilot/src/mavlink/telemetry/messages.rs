//! One function for each message that is streamed.

use ::mavlink::dialects::common::{
    ACTUATOR_OUTPUT_STATUS_DATA, ALTITUDE_DATA, ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA,
    EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, LOCAL_POSITION_NED_DATA, MavLandedState,
    MavSysStatusSensor as Sensor, MavSysStatusSensorExtended, MavVtolState, NAMED_VALUE_FLOAT_DATA,
    SERVO_OUTPUT_RAW_DATA, SYS_STATUS_DATA, VFR_HUD_DATA,
};
use flight_control::Belief;
use icd::Effector;

use crate::event::Snapshot;
use crate::mavlink::aircraft::{Aircraft, Phase};
use crate::mavlink::codec::Encoded;
use crate::mavlink::convert;

/// What the aircraft reports: inertial unit with heading, air data, position.
const SENSORS: Sensor = Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO
    .union(Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_GPS)
    .union(Sensor::MAV_SYS_STATUS_AHRS);
/// What the laws control.
const CONTROL: Sensor = Sensor::MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
    .union(Sensor::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS);

/// SYS_STATUS. A sensor is healthy while its packets come and are numbers; control while the aircraft flies.
pub fn sys_status(aircraft: &Aircraft) -> Encoded {
    let present = SENSORS | CONTROL | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
    let finite = aircraft.snapshot().is_some_and(|state| !state.log.health.implausible_input);
    let phase = aircraft.phase();
    // MAVProxy reports a breach unless the geofence, which does not exist, is healthy.
    let mut health = Sensor::MAV_SYS_STATUS_GEOFENCE;
    if matches!(phase, Phase::Flying | Phase::OnGround) && finite {
        health |= SENSORS;
    }
    if phase == Phase::Flying {
        health |= CONTROL | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
    }
    Encoded::new(&SYS_STATUS_DATA {
        onboard_control_sensors_present: present,
        onboard_control_sensors_enabled: present,
        onboard_control_sensors_health: health,
        load: 0,
        // No battery: voltage, current and charge are "not sent".
        voltage_battery: u16::MAX,
        current_battery: -1,
        battery_remaining: -1,
        drop_rate_comm: 0,
        errors_comm: 0,
        errors_count1: 0,
        errors_count2: 0,
        errors_count3: 0,
        errors_count4: 0,
        onboard_control_sensors_present_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_enabled_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_health_extended: MavSysStatusSensorExtended::empty(),
    })
}

pub fn landed_state(aircraft: &Aircraft) -> MavLandedState {
    match aircraft.phase() {
        Phase::NoFlight => MavLandedState::MAV_LANDED_STATE_UNDEFINED,
        Phase::Flying | Phase::Lost => MavLandedState::MAV_LANDED_STATE_IN_AIR,
        Phase::OnGround => MavLandedState::MAV_LANDED_STATE_ON_GROUND,
    }
}

pub fn extended_sys_state(aircraft: &Aircraft) -> Encoded {
    Encoded::new(&EXTENDED_SYS_STATE_DATA {
        vtol_state: MavVtolState::MAV_VTOL_STATE_UNDEFINED,
        landed_state: landed_state(aircraft),
    })
}

pub fn attitude(state: &Snapshot) -> Encoded {
    let euler = state.sensors.attitude.euler();
    let rates = state.sensors.body_rates.0;
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
    let [q1, q2, q3, q4] = state.sensors.attitude.wxyz().map(convert::float);
    let rates = state.sensors.body_rates.0;
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
    let sensors = &state.sensors;
    let velocity = sensors.velocity.0;
    let altitude = convert::millimetres(sensors.altitude_m);
    Encoded::new(&GLOBAL_POSITION_INT_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        lat: convert::degrees_e7(sensors.latitude_rad),
        lon: convert::degrees_e7(sensors.longitude_rad),
        alt: altitude,
        // Home is at altitude zero.
        relative_alt: altitude,
        vx: convert::centimetres_per_second(velocity.x),
        vy: convert::centimetres_per_second(velocity.y),
        vz: convert::centimetres_per_second(velocity.z),
        hdg: convert::heading_centidegrees(sensors.attitude.euler().psi),
    })
}

pub fn local_position_ned(state: &Snapshot) -> Encoded {
    let (position, velocity) = (state.sensors.position.0, state.sensors.velocity.0);
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

pub fn vfr_hud(state: &Snapshot, belief: &Belief) -> Encoded {
    let sensors = &state.sensors;
    let velocity = sensors.velocity.0;
    Encoded::new(&VFR_HUD_DATA {
        airspeed: convert::float(sensors.airspeed_m_s),
        groundspeed: convert::float(libm::hypot(velocity.x, velocity.y)),
        alt: convert::float(sensors.altitude_m),
        climb: convert::float(-velocity.z),
        heading: convert::heading_degrees(sensors.attitude.euler().psi),
        throttle: convert::percent(fraction_of_range(state, Effector::Engine, belief)),
    })
}

pub fn altitude(state: &Snapshot) -> Encoded {
    let altitude = convert::float(state.sensors.altitude_m);
    Encoded::new(&ALTITUDE_DATA {
        time_usec: state.time.as_micros(),
        altitude_monotonic: altitude,
        altitude_amsl: altitude,
        altitude_local: convert::float(-state.sensors.position.0.z),
        altitude_relative: altitude,
        // The ground is at altitude zero everywhere.
        altitude_terrain: altitude,
        bottom_clearance: altitude,
    })
}

/// Command of an effector: -1 to 1 of its travel, 0 to 1 of the engine's range.
fn fraction_of_range(state: &Snapshot, effector: Effector, belief: &Belief) -> f64 {
    let command = state.log.commands[effector];
    let servo = match effector {
        Effector::LeftAileron | Effector::RightAileron => &belief.effectors.aileron,
        Effector::LeftElevator | Effector::RightElevator => &belief.effectors.elevator,
        Effector::Rudder => &belief.effectors.rudder,
        Effector::NozzlePitch | Effector::NozzleYaw => &belief.effectors.nozzle,
        Effector::Engine => {
            let (min, max) = (belief.effectors.thrust_min_n, belief.effectors.thrust_max_n);
            return (command - min) / (max - min);
        }
    };
    command / servo.travel_rad
}

/// SERVO_OUTPUT_RAW: outputs 1 to 8 are the effectors in their order.
pub fn servo_output_raw(state: &Snapshot, belief: &Belief) -> Encoded {
    let [
        servo1_raw,
        servo2_raw,
        servo3_raw,
        servo4_raw,
        servo5_raw,
        servo6_raw,
        servo7_raw,
        servo8_raw,
    ] = Effector::ALL.map(|effector| {
        let fraction = fraction_of_range(state, effector, belief);
        if effector.is_angle() {
            convert::servo_pulse_us(fraction)
        } else {
            convert::throttle_pulse_us(fraction)
        }
    });
    Encoded::new(&SERVO_OUTPUT_RAW_DATA {
        time_usec: convert::boot_us_low(state.time),
        servo1_raw,
        servo2_raw,
        servo3_raw,
        servo4_raw,
        servo5_raw,
        servo6_raw,
        servo7_raw,
        servo8_raw,
        port: 0,
        servo9_raw: 0,
        servo10_raw: 0,
        servo11_raw: 0,
        servo12_raw: 0,
        servo13_raw: 0,
        servo14_raw: 0,
        servo15_raw: 0,
        servo16_raw: 0,
    })
}

pub fn actuator_output_status(state: &Snapshot, belief: &Belief) -> Encoded {
    let mut actuator = [0.0; 32];
    for (output, effector) in actuator.iter_mut().zip(Effector::ALL) {
        *output = convert::float(fraction_of_range(state, effector, belief));
    }
    let active = (1 << Effector::COUNT) - 1;
    Encoded::new(&ACTUATOR_OUTPUT_STATUS_DATA {
        time_usec: state.time.as_micros(),
        active,
        actuator,
    })
}

/// NAMED_VALUE_FLOAT: what the compensator sees and does, SI units and radians, and the two air angles.
pub fn named_values(state: &Snapshot) -> [Encoded; 9] {
    let (log, sensors) = (&state.log, &state.sensors);
    [
        ("z2_p", log.z2.x),
        ("z2_q", log.z2.y),
        ("z2_r", log.z2.z),
        ("ucf_ail", log.compensation.aileron_rad),
        ("ucf_nozp", log.compensation.nozzle_pitch_rad),
        ("ucf_nozy", log.compensation.nozzle_yaw_rad),
        ("ftc_active", f64::from(u8::from(log.compensator_active))),
        ("alpha", sensors.angle_of_attack_rad),
        ("beta", sensors.sideslip_rad),
    ]
    .map(|(name, value)| {
        Encoded::new(&NAMED_VALUE_FLOAT_DATA {
            time_boot_ms: convert::boot_ms(state.time),
            value: convert::float(value),
            name: name.into(),
        })
    })
}
