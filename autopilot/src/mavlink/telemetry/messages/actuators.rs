//! What the effectors are told, and what the compensator sees.

use ::mavlink::dialects::common::{
    ACTUATOR_OUTPUT_STATUS_DATA, DEBUG_FLOAT_ARRAY_DATA, NAMED_VALUE_FLOAT_DATA,
    SERVO_OUTPUT_RAW_DATA,
};
use flight_control::{Belief, Compensation, Health};
use icd::Effector;

use crate::event::Snapshot;
use crate::mavlink::codec::Encoded;
use crate::mavlink::convert;
use crate::mavlink::telemetry::View;

/// Command of an effector: -1 to 1 of its travel, 0 to 1 of the engine's range.
pub(super) fn fraction_of_range(state: &Snapshot, effector: Effector, belief: &Belief) -> f64 {
    let command = state.log.commands[effector];
    let servo = match effector {
        Effector::LeftAileron | Effector::RightAileron => &belief.effectors.aileron,
        Effector::LeftElevator | Effector::RightElevator => &belief.effectors.elevator,
        Effector::Rudder => &belief.effectors.rudder,
        Effector::NozzlePitch | Effector::NozzleYaw => &belief.effectors.nozzle,
        Effector::Engine => return thrust_fraction(command, belief),
    };
    command / servo.travel_rad
}

/// Thrust as a fraction of the engine's range, 0 to 1 inside it.
pub(super) fn thrust_fraction(thrust_n: f64, belief: &Belief) -> f64 {
    let (min, max) = (belief.effectors.thrust_min_n, belief.effectors.thrust_max_n);
    (thrust_n - min) / (max - min)
}

/// SERVO_OUTPUT_RAW: outputs 1 to 8 are the effectors in their order.
pub fn servo_output_raw(view: &View, state: &Snapshot) -> Encoded {
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
        let fraction = fraction_of_range(state, effector, view.belief);
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

pub fn actuator_output_status(view: &View, state: &Snapshot) -> Encoded {
    let mut actuator = [0.0; 32];
    for (output, effector) in actuator.iter_mut().zip(Effector::ALL) {
        *output = convert::float(fraction_of_range(state, effector, view.belief));
    }
    let active = (1 << Effector::COUNT) - 1;
    Encoded::new(&ACTUATOR_OUTPUT_STATUS_DATA {
        time_usec: state.time.as_micros(),
        active,
        actuator,
    })
}

/// NAMED_VALUE_FLOAT: what the compensator sees, does and has left, SI units and radians, and the two air angles.
pub fn named_values(state: &Snapshot) -> Vec<Encoded> {
    let (log, sensors) = (&state.log, &state.sensors);
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
    .to_vec()
}

/// Identity of the array, beside its name.
const WHY_ID: u16 = 1;

/// DEBUG_FLOAT_ARRAY `WHY`: for each effector, in their order, what it is told (0 to 7), where the model of the
/// healthy actuators has it (8 to 15), and 1 where its demand is beyond its limit (16 to 23); then what the
/// compensator sees, does and has left (24 to 41). docs/mavlink.md has the list.
pub fn why(state: &Snapshot) -> Encoded {
    let log = &state.log;
    let flag = |raised: bool| f64::from(u8::from(raised));
    let effectors = Effector::ALL
        .map(|effector| log.commands[effector])
        .into_iter()
        .chain(Effector::ALL.map(|effector| log.modelled[effector]))
        .chain(Effector::ALL.map(|effector| flag(is_saturated(&log.health, effector))));
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
        .chain([log.authority.roll_pct, log.authority.pitch_pct, log.authority.yaw_pct]);
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

/// Whether the demand of an effector is beyond its limit.
#[must_use]
pub(in crate::mavlink) const fn is_saturated(health: &Health, effector: Effector) -> bool {
    match effector {
        Effector::LeftAileron | Effector::RightAileron => health.aileron_saturated,
        Effector::LeftElevator | Effector::RightElevator => health.elevator_saturated,
        Effector::Rudder => health.rudder_saturated,
        Effector::NozzlePitch => health.nozzle_pitch_saturated,
        Effector::NozzleYaw => health.nozzle_yaw_saturated,
        Effector::Engine => health.thrust_saturated,
    }
}
