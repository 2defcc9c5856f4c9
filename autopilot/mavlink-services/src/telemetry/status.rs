//! Messages about the state of the aircraft, the autopilot and its clock.

#![expect(deprecated, reason = "ground stations still request PROTOCOL_VERSION")]

use ::mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, BATTERY_STATUS_DATA, ESTIMATOR_STATUS_DATA, EXTENDED_SYS_STATE_DATA,
    EstimatorStatusFlags as Estimate, MISSION_CURRENT_DATA, MavBatteryChargeState, MavBatteryFault,
    MavBatteryFunction, MavBatteryMode, MavBatteryType, MavLandedState,
    MavProtocolCapability as Capability, MavSysStatusSensor as Sensor, MavSysStatusSensorExtended,
    MavVtolState, MissionState, PROTOCOL_VERSION_DATA, SYS_STATUS_DATA, SYSTEM_TIME_DATA,
    VIBRATION_DATA,
};
use flight_control::estimator::SourceHealth;
use flight_control::navigation::Validity;
use icd::sensors::SensorKind;

use crate::aircraft::{Aircraft, Phase};
use crate::codec::Encoded;
use crate::telemetry::View;
use crate::{convert, heartbeat};
use flight_management::event::Snapshot;
use flight_management::vehicle::Mode;
use flight_management::vehicle::plan::Progress;

/// Sensors that the aircraft reports: an ideal inertial navigation unit, air data, position. There is no
/// magnetometer; the unit gives the heading that one would, and the magnetometer's bit marks that heading as available, since
/// MAVSDK calls no aircraft healthy without it.
const SENSORS: Sensor = Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO
    .union(Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_GPS)
    .union(Sensor::MAV_SYS_STATUS_AHRS);
/// Quantities that the laws and the guidance control.
const CONTROL: Sensor = Sensor::MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
    .union(Sensor::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL)
    .union(Sensor::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS);

/// Sensors that the estimator reads, with their bits.
const SOURCES: [(SensorKind, Sensor); 6] = [
    (SensorKind::Gyro, Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO),
    (SensorKind::Accelerometer, Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL),
    (SensorKind::Magnetometer, Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG),
    (SensorKind::Barometer, Sensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE),
    (SensorKind::Pitot, Sensor::MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE),
    (SensorKind::Gnss, Sensor::MAV_SYS_STATUS_SENSOR_GPS),
];

/// Which parts of the navigation state are valid; none while no packets arrive.
fn validity(aircraft: &Aircraft) -> Validity {
    let state = aircraft.snapshot();
    let state = state.filter(|_| matches!(aircraft.phase(), Phase::Flying | Phase::OnGround));
    state.map_or(Validity::default(), |state| state.motion().valid)
}

/// SYS_STATUS. A sensor is healthy while its measurement is valid, and where the estimator flies, while that uses it; control while the
/// aircraft flies and has not been terminated. The same condition makes it ready.
pub fn sys_status(view: &View) -> Option<Encoded> {
    let enabled = SENSORS | CONTROL | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
    let aircraft = &view.shared.aircraft;
    // A geofence that is switched off: MAVProxy reports a breach of one that is absent.
    let mut health = Sensor::MAV_SYS_STATUS_GEOFENCE;
    let present = enabled | health;
    let valid = validity(aircraft);
    for (is_valid, sensor) in [
        (valid.rates, Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO),
        (valid.specific_force, Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL),
        (valid.attitude, Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG | Sensor::MAV_SYS_STATUS_AHRS),
        (valid.altitude, Sensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE),
        (valid.airspeed, Sensor::MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE),
        (valid.position && valid.velocity, Sensor::MAV_SYS_STATUS_SENSOR_GPS),
    ] {
        health.set(sensor, is_valid);
    }
    let estimate = aircraft.snapshot().and_then(|state| state.motion().estimate);
    if let Some(estimate) = estimate {
        for (source, sensor) in SOURCES {
            let is_used = estimate.source(source) == SourceHealth::Used;
            health.set(sensor, is_used && aircraft.phase() == Phase::Flying);
        }
    }
    if aircraft.phase() == Phase::Flying && !aircraft.is_terminated() {
        health |= CONTROL | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
    }
    Some(Encoded::new(&SYS_STATUS_DATA {
        onboard_control_sensors_present: present,
        onboard_control_sensors_enabled: enabled,
        onboard_control_sensors_health: health,
        load: 0,
        voltage_battery: SUPPLY_MV,
        current_battery: -1,
        battery_remaining: SUPPLY_LEFT_PCT,
        drop_rate_comm: 0,
        errors_comm: 0,
        errors_count1: 0,
        errors_count2: 0,
        errors_count3: 0,
        errors_count4: 0,
        onboard_control_sensors_present_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_enabled_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_health_extended: MavSysStatusSensorExtended::empty(),
    }))
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

/// Voltage of the supply, mV: seven cells of 4.05 V, as BAT1_N_CELLS and BAT1_V_CHARGED have it.
pub(crate) const SUPPLY_MV: u16 = 28_350;
/// Remaining charge of the supply, percent.
const SUPPLY_LEFT_PCT: i8 = 100;

/// BATTERY_STATUS. Neither fuel nor electrical supply is modelled, and nothing can run low: a supply that is always
/// full, so that a ground station has a number to show. Its current is "unknown".
pub fn battery_status(_: &View) -> Option<Encoded> {
    Some(Encoded::new(&BATTERY_STATUS_DATA {
        id: 0,
        battery_function: MavBatteryFunction::MAV_BATTERY_FUNCTION_ALL,
        mavtype: MavBatteryType::MAV_BATTERY_TYPE_LION,
        temperature: i16::MAX,
        voltages: core::array::from_fn(|place| if place == 0 { SUPPLY_MV } else { u16::MAX }),
        voltages_ext: [0; 4],
        current_battery: -1,
        current_consumed: -1,
        energy_consumed: -1,
        battery_remaining: SUPPLY_LEFT_PCT,
        time_remaining: 0,
        charge_state: MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_OK,
        mode: MavBatteryMode::MAV_BATTERY_MODE_UNKNOWN,
        fault_bitmask: MavBatteryFault::empty(),
    }))
}

/// ESTIMATOR_STATUS. Where the estimator flies: its innovations over their gates, one standard deviation of the position, and what is
/// wrong with a source. Where the navigation unit is ideal there is no innovation and no error. Outputs are good while they are valid.
pub fn estimator_status(view: &View, state: &Snapshot) -> Encoded {
    let estimate = &state.motion().estimate;
    let valid = validity(&view.shared.aircraft);
    let mut flags = Estimate::empty();
    flags.set(Estimate::ESTIMATOR_ATTITUDE, valid.attitude);
    let velocity = Estimate::ESTIMATOR_VELOCITY_HORIZ | Estimate::ESTIMATOR_VELOCITY_VERT;
    flags.set(velocity, valid.velocity);
    let horizontal = Estimate::ESTIMATOR_POS_HORIZ_REL
        | Estimate::ESTIMATOR_POS_HORIZ_ABS
        | Estimate::ESTIMATOR_PRED_POS_HORIZ_REL
        | Estimate::ESTIMATOR_PRED_POS_HORIZ_ABS;
    flags.set(horizontal, valid.position);
    let vertical = Estimate::ESTIMATOR_POS_VERT_ABS | Estimate::ESTIMATOR_POS_VERT_AGL;
    flags.set(vertical, valid.altitude);
    let Some(estimate) = estimate else {
        return Encoded::new(&ESTIMATOR_STATUS_DATA {
            time_usec: state.time.as_micros(),
            flags,
            ..ESTIMATOR_STATUS_DATA::DEFAULT
        });
    };
    let is_off = |sensor| estimate.source(sensor) == SourceHealth::Rejected;
    flags.set(Estimate::ESTIMATOR_GPS_GLITCH, is_off(SensorKind::Gnss));
    let accelerometer = estimate.source(SensorKind::Accelerometer);
    flags.set(Estimate::ESTIMATOR_ACCEL_ERROR, accelerometer.is_gone());
    // Before the alignment there is nothing to be accurate, and nobody measures the height above the ground.
    let known = |value: f32| if estimate.is_aligned { value } else { f32::NAN };
    let alive = state.motion().alive(&state.sensors);
    let ratio = |sensor: SensorKind, value: f32| {
        if alive[sensor as usize] { known(value) } else { f32::NAN }
    };
    Encoded::new(&ESTIMATOR_STATUS_DATA {
        time_usec: state.time.as_micros(),
        flags,
        vel_ratio: ratio(SensorKind::Gnss, estimate.velocity_ratio),
        pos_horiz_ratio: ratio(SensorKind::Gnss, estimate.horizontal_ratio),
        pos_vert_ratio: ratio(SensorKind::Barometer, estimate.vertical_ratio),
        mag_ratio: ratio(SensorKind::Magnetometer, estimate.magnetic_ratio),
        hagl_ratio: f32::NAN,
        tas_ratio: ratio(SensorKind::Pitot, estimate.airspeed_ratio),
        pos_horiz_accuracy: known(estimate.horizontal_m),
        pos_vert_accuracy: known(estimate.vertical_m),
    })
}

/// VIBRATION. The airframe of the simulation is rigid and its accelerometers have no range: no vibration,
/// no clipping.
pub fn vibration(state: &Snapshot) -> Encoded {
    Encoded::new(&VIBRATION_DATA {
        time_usec: state.time.as_micros(),
        vibration_x: 0.0,
        vibration_y: 0.0,
        vibration_z: 0.0,
        clipping_0: 0,
        clipping_1: 0,
        clipping_2: 0,
    })
}

/// mission_mode: Mission flies the plan.
const IN_MISSION_MODE: u8 = 1;
/// mission_mode: another mode flies.
const SUSPENDED: u8 = 2;

pub fn mission_current(state: &Snapshot) -> Encoded {
    let navigation = &state.navigation;
    Encoded::new(&MISSION_CURRENT_DATA {
        seq: navigation.item,
        // The greatest number means that there is no mission; zero would mean "not supported".
        total: if navigation.items == 0 { u16::MAX } else { navigation.items },
        mission_state: match navigation.progress {
            Progress::NoPlan => MissionState::MISSION_STATE_NO_MISSION,
            Progress::NotStarted => MissionState::MISSION_STATE_NOT_STARTED,
            Progress::Active => MissionState::MISSION_STATE_ACTIVE,
            Progress::Paused => MissionState::MISSION_STATE_PAUSED,
            Progress::Complete => MissionState::MISSION_STATE_COMPLETE,
        },
        mission_mode: if state.mode == Mode::Mission { IN_MISSION_MODE } else { SUSPENDED },
        mission_id: navigation.plan_id,
        fence_id: 0,
        rally_points_id: 0,
    })
}

/// flight_sw_version: PX4 1.17.0, a development version (type byte 0), since ground stations derive a PX4's
/// features from it.
const FLIGHT_SW_VERSION: u32 = u32::from_be_bytes([1, 17, 0, 0]);

/// middleware_sw_version: the version of this program, in the same layout.
const OWN_VERSION: u32 = u32::from_be_bytes([
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
    0,
]);

/// A decimal number in a text; the build fails if it does not fit a byte.
const fn number(text: &str) -> u8 {
    match u8::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("a part of the version is no number of 0 to 255"),
    }
}

/// Capabilities of the services. No geofence and no rally points.
const CAPABILITIES: Capability = Capability::MAV_PROTOCOL_CAPABILITY_MISSION_INT
    .union(Capability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_FTP)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_MAVLINK2);

pub fn autopilot_version(_: &View) -> Option<Encoded> {
    Some(Encoded::new(&AUTOPILOT_VERSION_DATA {
        capabilities: CAPABILITIES,
        uid: 0,
        flight_sw_version: FLIGHT_SW_VERSION,
        middleware_sw_version: OWN_VERSION,
        os_sw_version: 0,
        board_version: 0,
        vendor_id: 0,
        product_id: 0,
        flight_custom_version: [0; 8],
        middleware_custom_version: [0; 8],
        os_custom_version: [0; 8],
        uid2: [0; 18],
    }))
}

/// PROTOCOL_VERSION: the autopilot reads MAVLink 1 and 2, and sends MAVLink 2.
pub fn protocol_version(_: &View) -> Option<Encoded> {
    Some(Encoded::new(&PROTOCOL_VERSION_DATA {
        version: 200,
        min_version: 100,
        max_version: 200,
        spec_version_hash: [0; 8],
        library_version_hash: [0; 8],
    }))
}

/// SYSTEM_TIME: the clock of this computer, zero if it is not known, and the simulation time of the flight.
pub fn system_time(view: &View) -> Option<Encoded> {
    let time = view.shared.aircraft.snapshot().map(|state| state.time);
    Some(Encoded::new(&SYSTEM_TIME_DATA {
        time_unix_usec: view
            .shared
            .host
            .unix_start_us
            .map_or(0, |start| start.saturating_add(view.now.as_micros())),
        time_boot_ms: time.map_or(0, convert::boot_ms),
    }))
}

/// COMPONENT_METADATA: location of the descriptions of parameters, effectors and events.
pub fn component_metadata(view: &View) -> Option<Encoded> {
    let time = view.shared.aircraft.snapshot().map(|state| state.time);
    Some(view.shared.metadata.message(time.map_or(0, convert::boot_ms)))
}

/// HEARTBEAT, on request; it is also sent once a second.
pub fn heartbeat(view: &View) -> Option<Encoded> {
    Some(heartbeat::message(view.shared.host.identity, &view.shared.aircraft))
}
