//! Messages about references, commands of the effectors, and the compensator.

use ::mavlink::dialects::common::{
    ACTUATOR_OUTPUT_STATUS_DATA, ATTITUDE_TARGET_DATA, AttitudeTargetTypemask,
    DEBUG_FLOAT_ARRAY_DATA, DEBUG_VECT_DATA, MavFrame, NAMED_VALUE_FLOAT_DATA,
    NAV_CONTROLLER_OUTPUT_DATA, POSITION_TARGET_GLOBAL_INT_DATA, PositionTargetTypemask as Ignored,
    SERVO_OUTPUT_RAW_DATA,
};
use flight_control::aircraft_model::{EffectorModel, ServoModel};
use flight_control::{AircraftModel, Compensation, StepLog};
use icd::{Attitude, Effector, EffectorKind, EulerAngles, PerEffector};

use crate::codec::Encoded;
use crate::convert;
use crate::telemetry::View;
use crate::telemetry::known::{calibrated_m_s, known};
use flight_management::event::Snapshot;

/// Command of an effector: -1 to 1 of its travel, 0 to 1 of the engine's range.
pub(super) fn fraction_of_range(
    state: &Snapshot,
    effector: Effector,
    model: &AircraftModel,
) -> f64 {
    let command = state.log.commands[effector];
    let EffectorModel { list, servos, .. } = &model.effectors;
    let ServoModel { min, max, .. } = servos[effector];
    if !list.is_angle(effector) {
        return thrust_fraction(command, model);
    }
    // With symmetric travel this is command over travel.
    if command < 0.0 { -command / min } else { command / max }
}

/// Thrust as a fraction of the engine's range, 0 to 1 inside it; 0 without an engine.
pub(super) fn thrust_fraction(thrust_n: f64, model: &AircraftModel) -> f64 {
    let [min, max] = model.effectors.thrust_range_n();
    if max > min { (thrust_n - min) / (max - min) } else { 0.0 }
}

/// Throttle in the same way.
pub(super) fn throttle(state: &Snapshot, model: &AircraftModel) -> f64 {
    let engine = model.effectors.list.only(EffectorKind::Engine);
    engine.map_or(0.0, |engine| fraction_of_range(state, engine, model))
}

/// SERVO_OUTPUT_RAW: the outputs are the effectors in order; unused ones are 0.
pub fn servo_output_raw(view: &View, state: &Snapshot) -> Encoded {
    let list = &view.shared.model.effectors.list;
    let pulse = |place: usize| {
        let effector = Effector::from_index(place).filter(|effector| list.contains(*effector));
        effector.map_or(0, |effector| {
            let fraction = fraction_of_range(state, effector, &view.shared.model);
            if list.is_angle(effector) {
                convert::servo_pulse_us(fraction)
            } else {
                convert::throttle_pulse_us(fraction)
            }
        })
    };
    Encoded::new(&SERVO_OUTPUT_RAW_DATA {
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

pub fn actuator_output_status(view: &View, state: &Snapshot) -> Encoded {
    let list = &view.shared.model.effectors.list;
    let mut actuator = [0.0; 32];
    for (output, effector) in actuator.iter_mut().zip(list.all()) {
        *output = convert::float(fraction_of_range(state, effector, &view.shared.model));
    }
    let active = (1 << list.len()) - 1;
    Encoded::new(&ACTUATOR_OUTPUT_STATUS_DATA {
        time_usec: state.time.as_micros(),
        active,
        actuator,
    })
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
        Encoded::new(&NAMED_VALUE_FLOAT_DATA {
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
    let compensations = [log.compensation, log.applied_compensation];
    let compensator = [log.z2, log.levels]
        .into_iter()
        .flat_map(|axes| [axes.x, axes.y, axes.z])
        .chain([log.level, flag(log.compensator_active), log.fade])
        .chain(compensations.into_iter().flat_map(
            |Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad }| {
                [aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad]
            },
        ))
        .chain([log.authority.roll_pct, log.authority.pitch_pct, log.authority.yaw_pct])
        .chain(first(&log.increments))
        .chain(log.authority.negative_pct)
        .chain(log.authority.positive_pct)
        .chain([isolated(log), log.isolation.verdict.map_or(0.0, |verdict| verdict.confidence)]);
    let mut data = [0.0; 58];
    for (place, value) in data.iter_mut().zip(effectors.chain(compensator)) {
        *place = convert::float(value);
    }
    Encoded::new(&DEBUG_FLOAT_ARRAY_DATA {
        time_usec: state.time.as_micros(),
        array_id: WHY_ID,
        name: "WHY".into(),
        data,
    })
}

/// A signal: roll, pitch, yaw.
struct Signal {
    /// Component id, of those that MAVLink leaves to the user (MAV_COMP_ID_USER1 is 25).
    component: u8,
    /// Name, at most nine characters: QGroundControl shows no more.
    name: &'static str,
    of: fn(&StepLog) -> [f64; 3],
}

/// Estimate, rad/s^2; level, in units of its threshold; authority, percent; compensation after limits, rad;
/// its effect by the design model, rad/s^2.
const SIGNALS: [Signal; 5] = [
    Signal { component: 25, name: "estimate", of: |log| [log.z2.x, log.z2.y, log.z2.z] },
    Signal { component: 26, name: "level", of: |log| [log.levels.x, log.levels.y, log.levels.z] },
    Signal {
        component: 27,
        name: "authority",
        of: |log| [log.authority.roll_pct, log.authority.pitch_pct, log.authority.yaw_pct],
    },
    Signal {
        component: 28,
        name: "applied",
        of: |log| {
            let applied = &log.applied_compensation;
            [applied.aileron_rad, applied.nozzle_pitch_rad, applied.nozzle_yaw_rad]
        },
    },
    Signal {
        component: 29,
        name: "attained",
        of: |log| [log.attained.x, log.attained.y, log.attained.z],
    },
];

/// DEBUG_VECT of each signal; x is roll, y pitch, z yaw.
pub fn vectors(state: &Snapshot) -> Vec<Encoded> {
    let vector = |signal: &Signal| {
        let [x, y, z] = (signal.of)(&state.log).map(convert::float);
        let time_usec = state.time.as_micros();
        let message = DEBUG_VECT_DATA { time_usec, x, y, z, name: signal.name.into() };
        Encoded::new(&message).from_component(signal.component)
    };
    SIGNALS.iter().map(vector).collect()
}

/// ATTITUDE_TARGET: the roll reference that the law tracks. The laws have no pitch or heading reference, so
/// those two angles are the present ones.
pub fn attitude_target(view: &View, state: &Snapshot) -> Encoded {
    let present = known(state).attitude;
    let attitude =
        Attitude::from_euler(EulerAngles { phi: state.log.roll_reference_rad, ..present });
    let thrust = thrust_fraction(state.log.main.thrust_n, &view.shared.model);
    Encoded::new(&ATTITUDE_TARGET_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        q: attitude.wxyz().map(convert::float),
        body_roll_rate: 0.0,
        body_pitch_rate: 0.0,
        body_yaw_rate: 0.0,
        thrust: convert::float(thrust.clamp(0.0, 1.0)),
        type_mask: AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
            | AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
            | AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE,
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
    Encoded::new(&POSITION_TARGET_GLOBAL_INT_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        lat_int,
        lon_int,
        alt: convert::float(state.demand.altitude_m),
        vx: 0.0,
        vy: 0.0,
        vz: 0.0,
        afx: 0.0,
        afy: 0.0,
        afz: 0.0,
        yaw: convert::float(navigation.course_rad.unwrap_or(0.0)),
        yaw_rate: 0.0,
        type_mask: ignored,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL,
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
    Encoded::new(&NAV_CONTROLLER_OUTPUT_DATA {
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
