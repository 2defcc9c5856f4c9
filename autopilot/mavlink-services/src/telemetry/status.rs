//! Messages about references, commands of the effectors and the compensator, and about the state of the aircraft, the
//! autopilot and its clock.

#![expect(deprecated, reason = "ground stations still request PROTOCOL_VERSION")]

use ::mavlink::dialects::common as wire;
use ::mavlink::dialects::common::{
    AttitudeTargetTypemask as AttitudeIgnored, EstimatorStatusFlags as Estimate,
    MavProtocolCapability as Capability, MavSysStatusSensor as Sensor,
    PositionTargetTypemask as Ignored,
};
use flight_control::aircraft_model::{EffectorModel, ServoModel};
use flight_control::estimator::SourceHealth;
use flight_control::navigation::Validity;
use flight_control::{AircraftModel, Compensation, StepLog};
use icd::sensors::SensorKind;
use icd::{Attitude, Effector, EffectorKind, EulerAngles, PerEffector};

use crate::aircraft::{Aircraft, Phase};
use crate::codec::Encoded;
use crate::fault_list::float_array;
use crate::telemetry::TelemetryView;
use crate::telemetry::motion::{calibrated_m_s, known};
use crate::{convert, heartbeat};
use flight_management::event::Snapshot;
use flight_management::vehicle::Mode;
use flight_management::vehicle::fence::{Breach, FenceAction, FenceStatus};
use flight_management::vehicle::plan::Progress;

/// Command of an effector: -1 to 1 of its travel, 0 to 1 of the engine's range.
fn fraction_of_range(state: &Snapshot, effector: Effector, model: &AircraftModel) -> f64 {
    let command = state.log.commands[effector];
    let EffectorModel { list, servos, .. } = &model.effectors;
    let ServoModel { min, max, .. } = servos[effector];
    if !list.is_angle(effector) {
        return thrust_fraction(command, model);
    }
    // With symmetric travel this is command over travel.
    // Either side by its own end, so that the whole travel is -1 to 1.
    if command < 0.0 { -command / min } else { command / max }
}

/// Thrust as a fraction of the engine's range, 0 to 1 inside it; 0 without an engine.
fn thrust_fraction(thrust_n: f64, model: &AircraftModel) -> f64 {
    let [min, max] = model.effectors.thrust_range_n();
    if max > min { (thrust_n - min) / (max - min) } else { 0.0 }
}

pub fn vfr_hud(view: &TelemetryView, state: &Snapshot) -> Encoded {
    let (motion, model) = (known(state), &view.shared.model);
    let velocity = motion.velocity.0;
    let engine = model.effectors.list.only(EffectorKind::Engine);
    let throttle = engine.map_or(0.0, |engine| fraction_of_range(state, engine, model));
    Encoded::new(&wire::VFR_HUD_DATA {
        airspeed: convert::float(calibrated_m_s(motion.airspeed_m_s, motion.altitude_m)),
        groundspeed: convert::float(libm::hypot(velocity.x, velocity.y)),
        alt: convert::float(motion.altitude_m),
        // Not its negative: at rest that would be minus zero.
        climb: convert::float(0.0 - velocity.z),
        heading: convert::heading_degrees(motion.attitude.psi),
        throttle: convert::percent(throttle),
    })
}

/// SERVO_OUTPUT_RAW: the outputs are the effectors in order; unused ones are 0.
pub fn servo_output_raw(view: &TelemetryView, state: &Snapshot) -> Encoded {
    let list = &view.shared.model.effectors.list;
    let pulse = |place: usize| {
        let effector = Effector::from_index(place).filter(|effector| list.contains(*effector));
        let Some(effector) = effector else { return 0 };
        let fraction = fraction_of_range(state, effector, &view.shared.model);
        if list.is_angle(effector) {
            convert::servo_pulse_us(fraction)
        } else {
            convert::throttle_pulse_us(fraction)
        }
    };
    Encoded::new(&wire::SERVO_OUTPUT_RAW_DATA {
        time_usec: convert::boot_us_low(state.time),
        servo1_raw: pulse(0),
        servo2_raw: pulse(1),
        servo3_raw: pulse(2),
        servo4_raw: pulse(3),
        servo5_raw: pulse(4),
        servo6_raw: pulse(5),
        servo7_raw: pulse(6),
        servo8_raw: pulse(7),
        port: 0,
        servo9_raw: pulse(8),
        servo10_raw: pulse(9),
        servo11_raw: pulse(10),
        servo12_raw: pulse(11),
        servo13_raw: pulse(12),
        servo14_raw: pulse(13),
        servo15_raw: pulse(14),
        servo16_raw: pulse(15),
    })
}

pub fn actuator_output_status(view: &TelemetryView, state: &Snapshot) -> Encoded {
    let list = &view.shared.model.effectors.list;
    let mut actuator = [0.0; 32];
    for (output, effector) in actuator.iter_mut().zip(list.all()) {
        *output = convert::float(fraction_of_range(state, effector, &view.shared.model));
    }
    // No more effectors than a u32 has bits.
    let (time_usec, active) = (state.time.as_micros(), (1 << list.len()) - 1);
    Encoded::new(&wire::ACTUATOR_OUTPUT_STATUS_DATA { time_usec, active, actuator })
}

/// NAMED_VALUE_FLOAT: estimate, action and remaining authority of the compensator, SI units and radians, and the two air angles.
pub fn named_values(state: &Snapshot) -> Vec<Encoded> {
    let (log, motion) = (&state.log, known(state));
    let verdict = log.isolation.verdict;
    [
        ("z2_p", log.z2.x),
        ("z2_q", log.z2.y),
        ("z2_r", log.z2.z),
        ("ucf_ail", log.compensation.aileron_rad),
        ("ucf_nozp", log.compensation.nozzle_pitch_rad),
        ("ucf_nozy", log.compensation.nozzle_yaw_rad),
        ("lvl_p", log.levels.x),
        ("lvl_q", log.levels.y),
        ("lvl_r", log.levels.z),
        ("lvl_max", log.level),
        ("auth_roll", log.authority.roll_pct),
        ("auth_pitch", log.authority.pitch_pct),
        ("auth_yaw", log.authority.yaw_pct),
        ("ftc_fade", log.fade),
        ("ftc_active", f64::from(u8::from(log.compensator_active))),
        ("iso_eff", isolated(log)),
        ("iso_how", verdict.map_or(0.0, |verdict| f64::from(verdict.behaviour.code()))),
        ("iso_value", verdict.map_or(0.0, |verdict| verdict.values[0])),
        ("iso_conf", verdict.map_or(0.0, |verdict| verdict.confidence)),
        ("alpha", motion.alpha),
        ("beta", motion.beta),
    ]
    .map(|(name, value)| {
        Encoded::new(&wire::NAMED_VALUE_FLOAT_DATA {
            time_boot_ms: convert::boot_ms(state.time),
            value: convert::float(value),
            name: name.into(),
        })
    })
    .to_vec()
}

/// Place of the effector that the isolation names, from 1; 0 without a verdict.
fn isolated(log: &StepLog) -> f64 {
    let effector = log.isolation.verdict.and_then(|verdict| verdict.effectors[0]);
    effector.map_or(0.0, |effector| f64::from(effector.code()) + 1.0)
}

/// Identity of the array, beside its name.
const WHY_ID: u16 = 1;

/// Effectors in `WHY`: the array has room for no more.
const WHY_EFFECTORS: usize = 8;

/// DEBUG_FLOAT_ARRAY `WHY`: for each of the first eight effectors, in order, its command (0 to 7), its position by the
/// model of the healthy actuators (8 to 15), and 1 where its demand exceeds its limit (16 to 23); then estimate,
/// action and remaining authority of the compensator (24 to 41), the compensation within each command (42 to 49), and
/// the remaining authority in either direction (50 to 55), and the effector that the isolation names with its
/// confidence (56, 57). docs/mavlink.md has the list.
pub fn why(state: &Snapshot) -> Encoded {
    let log = &state.log;
    let flag = |raised: bool| f64::from(u8::from(raised));
    let first = |values: &PerEffector<f64>| values.first(WHY_EFFECTORS).to_vec();
    let limited = PerEffector::from_fn(|effector| flag(log.limited.contains(effector)));
    let effectors = [log.commands, log.modelled, limited].into_iter().flat_map(|all| first(&all));
    let compensator = [log.z2.into(), log.levels.into()]
        .into_iter()
        .flat_map(|axes: [f64; 3]| axes)
        .chain([log.level, flag(log.compensator_active), log.fade])
        .chain(angles(&log.compensation))
        .chain(angles(&log.applied_compensation))
        .chain(authority(log))
        .chain(first(&log.increments))
        .chain(log.authority.negative_pct)
        .chain(log.authority.positive_pct)
        .chain([isolated(log), log.isolation.verdict.map_or(0.0, |verdict| verdict.confidence)]);
    float_array(state, WHY_ID, "WHY", effectors.chain(compensator))
}

/// Aileron, nozzle pitch and nozzle yaw, rad.
fn angles(compensation: &Compensation) -> [f64; 3] {
    let Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad } = *compensation;
    [aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad]
}

/// Remaining authority of roll, pitch and yaw, percent.
fn authority(log: &StepLog) -> [f64; 3] {
    [log.authority.roll_pct, log.authority.pitch_pct, log.authority.yaw_pct]
}

/// A signal: component id, of those that MAVLink leaves to the user (MAV_COMP_ID_USER1 is 25); name, at most nine
/// characters, since QGroundControl shows no more; roll, pitch, yaw.
type Signal = (u8, &'static str, fn(&StepLog) -> [f64; 3]);

/// Estimate, rad/s^2; level, in units of its threshold; authority, percent; compensation after limits, rad;
/// its effect by the design model, rad/s^2.
const SIGNALS: [Signal; 5] = [
    (25, "estimate", |log| log.z2.into()),
    (26, "level", |log| log.levels.into()),
    (27, "authority", authority),
    (28, "applied", |log| angles(&log.applied_compensation)),
    (29, "attained", |log| log.attained.into()),
];

/// DEBUG_VECT of each signal; x is roll, y pitch, z yaw.
pub fn vectors(state: &Snapshot) -> Vec<Encoded> {
    let vector = |(component, name, of): &Signal| {
        let [x, y, z] = of(&state.log).map(convert::float);
        let (time_usec, name) = (state.time.as_micros(), (*name).into());
        let message = wire::DEBUG_VECT_DATA { time_usec, x, y, z, name };
        Encoded::new(&message).from_component(*component)
    };
    SIGNALS.iter().map(vector).collect()
}

/// ATTITUDE_TARGET: the roll reference that the law tracks. The laws have no pitch or heading reference, so
/// those two angles are the present ones.
pub fn attitude_target(view: &TelemetryView, state: &Snapshot) -> Encoded {
    let present = known(state).attitude;
    let attitude =
        Attitude::from_euler(EulerAngles { phi: state.log.roll_reference_rad, ..present });
    let thrust = thrust_fraction(state.log.main.thrust_n, &view.shared.model);
    Encoded::new(&wire::ATTITUDE_TARGET_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        q: attitude.wxyz().map(convert::float),
        thrust: convert::float(thrust.clamp(0.0, 1.0)),
        type_mask: AttitudeIgnored::ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
            | AttitudeIgnored::ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
            | AttitudeIgnored::ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE,
        ..wire::ATTITUDE_TARGET_DATA::DEFAULT
    })
}

/// POSITION_TARGET_GLOBAL_INT: altitude reference always, place and course where the guidance has them.
pub fn position_target_global_int(state: &Snapshot) -> Encoded {
    let navigation = &state.navigation;
    let mut ignored = Ignored::POSITION_TARGET_TYPEMASK_VX_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_VY_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_VZ_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_AX_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_AY_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_AZ_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
    let (lat_int, lon_int) = match navigation.target {
        Some(target) => {
            let place = target.place;
            (convert::degrees_e7(place.latitude_rad), convert::degrees_e7(place.longitude_rad))
        }
        None => {
            ignored |= Ignored::POSITION_TARGET_TYPEMASK_X_IGNORE
                | Ignored::POSITION_TARGET_TYPEMASK_Y_IGNORE;
            (0, 0)
        }
    };
    if navigation.course_rad.is_none() {
        ignored |= Ignored::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
    }
    Encoded::new(&wire::POSITION_TARGET_GLOBAL_INT_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        lat_int,
        lon_int,
        alt: convert::float(state.demand.altitude_m),
        yaw: convert::float(navigation.course_rad.unwrap_or(0.0)),
        type_mask: ignored,
        coordinate_frame: wire::MavFrame::MAV_FRAME_GLOBAL,
        ..wire::POSITION_TARGET_GLOBAL_INT_DATA::DEFAULT
    })
}

/// NAV_CONTROLLER_OUTPUT. Errors are reference minus measured value. There is no pitch reference: NaN.
/// Without guidance the bearings are the present heading and the distance is zero.
pub fn nav_controller_output(state: &Snapshot) -> Encoded {
    let (navigation, motion) = (&state.navigation, known(state));
    let calibrated = |true_m_s| calibrated_m_s(true_m_s, motion.altitude_m);
    // Distances are from the place of the aircraft.
    let measured = |metres: f64| if motion.latitude_rad.is_nan() { f64::NAN } else { metres };
    let heading = motion.attitude.psi;
    let course = navigation.course_rad.unwrap_or(heading);
    let bearing = navigation.target.map_or(course, |target| target.bearing_rad);
    let distance = navigation.target.map_or(0.0, |target| target.distance_m);
    Encoded::new(&wire::NAV_CONTROLLER_OUTPUT_DATA {
        nav_roll: convert::float(convert::degrees(state.demand.roll_rad)),
        nav_pitch: f32::NAN,
        nav_bearing: convert::bearing_degrees(course),
        target_bearing: convert::bearing_degrees(bearing),
        wp_dist: convert::whole_metres(measured(distance)),
        alt_error: convert::float(state.demand.altitude_m - motion.altitude_m),
        aspd_error: convert::float(
            calibrated(state.demand.airspeed_m_s) - calibrated(motion.airspeed_m_s),
        ),
        xtrack_error: convert::float(measured(navigation.cross_track_m)),
    })
}

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
    // Of a plant that is silent nothing is known.
    let state = state.filter(|_| matches!(aircraft.phase(), Phase::Flying | Phase::OnGround));
    state.map_or(Validity::default(), |state| state.motion().valid)
}

/// SYS_STATUS. A sensor is healthy while its measurement is valid, and where the estimator flies, while that uses it; control while the
/// aircraft flies and has not been terminated. The same condition makes it ready.
pub fn sys_status(view: &TelemetryView) -> Option<Encoded> {
    let aircraft = &view.shared.aircraft;
    let navigation = &view.shared.parameters.navigation;
    let fence = aircraft.snapshot().map(|state| state.navigation.fence).unwrap_or_default();
    let has_fence = fence.has_areas || navigation.has_fence_altitudes();
    let is_watched = has_fence && !fence.is_off && navigation.fence_action != FenceAction::Nothing;
    let mut enabled = SENSORS | CONTROL | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
    // Also without areas and limits: MAVProxy reports a breach where the bit of health is missing.
    let present = enabled | Sensor::MAV_SYS_STATUS_GEOFENCE;
    enabled.set(Sensor::MAV_SYS_STATUS_GEOFENCE, is_watched);
    let mut health = Sensor::empty();
    health.set(Sensor::MAV_SYS_STATUS_GEOFENCE, fence.breach.is_none());
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
            // What the estimator used last says nothing on the ground, or while no packets arrive.
            health.set(sensor, is_used && aircraft.phase() == Phase::Flying);
        }
    }
    if view.shared.not_ready().is_none() {
        health |= CONTROL | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
    }
    Some(Encoded::new(&wire::SYS_STATUS_DATA {
        onboard_control_sensors_present: present,
        onboard_control_sensors_enabled: enabled,
        onboard_control_sensors_health: health,
        voltage_battery: SUPPLY_MV,
        current_battery: -1,
        battery_remaining: supply_left_pct(view),
        onboard_control_sensors_present_extended: wire::MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_enabled_extended: wire::MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_health_extended: wire::MavSysStatusSensorExtended::empty(),
        ..wire::SYS_STATUS_DATA::DEFAULT
    }))
}

/// FENCE_STATUS: the breach that lasts, and the last one.
pub fn fence_status(state: &Snapshot) -> Encoded {
    let FenceStatus { breach, breaches, last, .. } = state.navigation.fence;
    let kind = |breach| match breach {
        Breach::Low => wire::FenceBreach::FENCE_BREACH_MINALT,
        Breach::High => wire::FenceBreach::FENCE_BREACH_MAXALT,
        Breach::Outside | Breach::Exclusion => wire::FenceBreach::FENCE_BREACH_BOUNDARY,
    };
    Encoded::new(&wire::FENCE_STATUS_DATA {
        breach_time: last.map_or(0, |(_, time)| convert::boot_ms(time)),
        breach_count: breaches,
        breach_status: u8::from(breach.is_some()),
        breach_type: last.map_or(wire::FenceBreach::FENCE_BREACH_NONE, |(breach, _)| kind(breach)),
        breach_mitigation: wire::FenceMitigate::FENCE_MITIGATE_NONE,
    })
}

pub fn landed_state(aircraft: &Aircraft) -> wire::MavLandedState {
    match aircraft.phase() {
        Phase::NoFlight => wire::MavLandedState::MAV_LANDED_STATE_UNDEFINED,
        Phase::Flying if aircraft.is_on_wheels() => {
            wire::MavLandedState::MAV_LANDED_STATE_ON_GROUND
        }
        Phase::Flying if aircraft.mode() == Mode::Takeoff => {
            wire::MavLandedState::MAV_LANDED_STATE_TAKEOFF
        }
        Phase::Flying | Phase::Lost => wire::MavLandedState::MAV_LANDED_STATE_IN_AIR,
        Phase::OnGround => wire::MavLandedState::MAV_LANDED_STATE_ON_GROUND,
    }
}

pub fn extended_sys_state(aircraft: &Aircraft) -> Encoded {
    Encoded::new(&wire::EXTENDED_SYS_STATE_DATA {
        vtol_state: wire::MavVtolState::MAV_VTOL_STATE_UNDEFINED,
        landed_state: landed_state(aircraft),
    })
}

/// Voltage of the supply, mV: seven cells of 4.05 V, as BAT1_N_CELLS and BAT1_V_CHARGED have it.
pub(crate) const SUPPLY_MV: u16 = 28_350;
/// Fuel by the gauge, whole percent of a full tank; `None` without a valid sample.
fn fuel_pct(view: &TelemetryView) -> Option<u8> {
    let gauge = view.shared.aircraft.snapshot().map(|state| state.sensors.fuel_gauge_pct)?;
    // The gauge may have an error.
    gauge.valid.then_some(gauge.value.clamp(0.0, 100.0) as u8)
}

/// What the supply shows, percent: the fuel of an aircraft that burns some, because ground stations warn of a low battery.
fn supply_left_pct(view: &TelemetryView) -> i8 {
    // At most 100.
    fuel_pct(view).map_or(100, |pct| pct as i8)
}

/// FUEL_STATUS, of an aircraft with a gauge; the tank holds 1.
pub fn fuel_status(view: &TelemetryView) -> Option<Encoded> {
    let percent = fuel_pct(view)?;
    Some(Encoded::new(&wire::FUEL_STATUS_DATA {
        id: 0,
        maximum_fuel: 1.0,
        consumed_fuel: f32::NAN,
        remaining_fuel: f32::from(percent) / 100.0,
        percent_remaining: percent,
        flow_rate: f32::NAN,
        temperature: f32::NAN,
        fuel_type: wire::MavFuelType::MAV_FUEL_TYPE_UNKNOWN,
    }))
}

/// BATTERY_STATUS. The electrical supply is not modelled: it is always full, or as full as the tank, so that a ground station
/// has a number to show. Its current is "unknown".
pub fn battery_status(view: &TelemetryView) -> Option<Encoded> {
    let left_pct = supply_left_pct(view);
    let levels = &view.shared.parameters.navigation;
    let is_below = |level: f64| f64::from(left_pct) < 100.0 * level;
    let charge_state = if is_below(levels.emergency_fuel) {
        wire::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_EMERGENCY
    } else if is_below(levels.critical_fuel) {
        wire::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_CRITICAL
    } else if is_below(levels.low_fuel) {
        wire::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_LOW
    } else {
        wire::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_OK
    };
    Some(Encoded::new(&wire::BATTERY_STATUS_DATA {
        battery_function: wire::MavBatteryFunction::MAV_BATTERY_FUNCTION_ALL,
        mavtype: wire::MavBatteryType::MAV_BATTERY_TYPE_LION,
        temperature: i16::MAX,
        voltages: core::array::from_fn(|place| if place == 0 { SUPPLY_MV } else { u16::MAX }),
        current_battery: -1,
        current_consumed: -1,
        energy_consumed: -1,
        battery_remaining: left_pct,
        charge_state,
        fault_bitmask: wire::MavBatteryFault::empty(),
        ..wire::BATTERY_STATUS_DATA::DEFAULT
    }))
}

/// ESTIMATOR_STATUS. Where the estimator flies: its innovations over their gates, one standard deviation of the position, and what is
/// wrong with a source. Where the navigation unit is ideal there is no innovation and no error. Outputs are good while they are valid.
pub fn estimator_status(view: &TelemetryView, state: &Snapshot) -> Encoded {
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
        return Encoded::new(&wire::ESTIMATOR_STATUS_DATA {
            time_usec: state.time.as_micros(),
            flags,
            ..wire::ESTIMATOR_STATUS_DATA::DEFAULT
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
    Encoded::new(&wire::ESTIMATOR_STATUS_DATA {
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
    let time_usec = state.time.as_micros();
    Encoded::new(&wire::VIBRATION_DATA { time_usec, ..wire::VIBRATION_DATA::DEFAULT })
}

/// mission_mode: Mission flies the plan.
const IN_MISSION_MODE: u8 = 1;
/// mission_mode: another mode flies.
const SUSPENDED: u8 = 2;

pub fn mission_current(state: &Snapshot) -> Encoded {
    let navigation = &state.navigation;
    Encoded::new(&wire::MISSION_CURRENT_DATA {
        seq: navigation.item,
        // The greatest number means that there is no mission; zero would mean "not supported".
        total: if navigation.items == 0 { u16::MAX } else { navigation.items },
        mission_state: match navigation.progress {
            Progress::NoPlan => wire::MissionState::MISSION_STATE_NO_MISSION,
            Progress::NotStarted => wire::MissionState::MISSION_STATE_NOT_STARTED,
            Progress::Active => wire::MissionState::MISSION_STATE_ACTIVE,
            Progress::Paused => wire::MissionState::MISSION_STATE_PAUSED,
            Progress::Complete => wire::MissionState::MISSION_STATE_COMPLETE,
        },
        mission_mode: if state.mode == Mode::Mission { IN_MISSION_MODE } else { SUSPENDED },
        mission_id: navigation.plan_id,
        ..wire::MISSION_CURRENT_DATA::DEFAULT
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

/// Capabilities of the services.
const CAPABILITIES: Capability = Capability::MAV_PROTOCOL_CAPABILITY_MISSION_INT
    .union(Capability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_MISSION_FENCE)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_MISSION_RALLY)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_FTP)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_MAVLINK2);

pub fn autopilot_version(_: &TelemetryView) -> Option<Encoded> {
    Some(Encoded::new(&wire::AUTOPILOT_VERSION_DATA {
        capabilities: CAPABILITIES,
        flight_sw_version: FLIGHT_SW_VERSION,
        middleware_sw_version: OWN_VERSION,
        ..wire::AUTOPILOT_VERSION_DATA::DEFAULT
    }))
}

/// PROTOCOL_VERSION: the autopilot reads MAVLink 1 and 2, and sends MAVLink 2.
pub fn protocol_version(_: &TelemetryView) -> Option<Encoded> {
    Some(Encoded::new(&wire::PROTOCOL_VERSION_DATA {
        version: 200,
        min_version: 100,
        max_version: 200,
        ..wire::PROTOCOL_VERSION_DATA::DEFAULT
    }))
}

/// SYSTEM_TIME: the clock of this computer, zero if it is not known, and the simulation time of the flight.
pub fn system_time(view: &TelemetryView) -> Option<Encoded> {
    let time = view.shared.aircraft.snapshot().map(|state| state.time);
    let start = view.shared.host.unix_start_us;
    Some(Encoded::new(&wire::SYSTEM_TIME_DATA {
        time_unix_usec: start.map_or(0, |start| start.saturating_add(view.now.as_micros())),
        time_boot_ms: time.map_or(0, convert::boot_ms),
    }))
}

/// COMPONENT_METADATA: location of the descriptions of parameters, effectors and events.
pub fn component_metadata(view: &TelemetryView) -> Option<Encoded> {
    let time = view.shared.aircraft.snapshot().map(|state| state.time);
    Some(view.shared.metadata.message(time.map_or(0, convert::boot_ms)))
}

/// HEARTBEAT, on request; it is also sent once a second.
pub fn heartbeat(view: &TelemetryView) -> Option<Encoded> {
    Some(heartbeat::message(view.shared.host.identity, &view.shared.aircraft))
}
