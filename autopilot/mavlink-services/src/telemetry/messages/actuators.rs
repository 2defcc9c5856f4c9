//! What the effectors are told, and what the compensator sees.

use ::mavlink::dialects::common::{
    ACTUATOR_OUTPUT_STATUS_DATA, DEBUG_FLOAT_ARRAY_DATA, NAMED_VALUE_FLOAT_DATA,
    SERVO_OUTPUT_RAW_DATA,
};
use flight_control::aircraft_model::{EffectorModel, ServoModel};
use flight_control::{AircraftModel, Compensation};
use icd::{Effector, EffectorKind, PerEffector};

use crate::codec::Encoded;
use crate::convert;
use crate::telemetry::View;
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
    // Where the travel is the same either way this is command over travel.
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

/// SERVO_OUTPUT_RAW: the outputs are the effectors in their order; those beyond are 0.
pub fn servo_output_raw(view: &View, state: &Snapshot) -> Encoded {
    let list = &view.model.effectors.list;
    let pulse = |place: usize| {
        let effector = Effector::from_index(place).filter(|effector| list.contains(*effector));
        effector.map_or(0, |effector| {
            let fraction = fraction_of_range(state, effector, view.model);
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
    let list = &view.model.effectors.list;
    let mut actuator = [0.0; 32];
    for (output, effector) in actuator.iter_mut().zip(list.all()) {
        *output = convert::float(fraction_of_range(state, effector, view.model));
    }
    let active = (1 << list.len()) - 1;
    Encoded::new(&ACTUATOR_OUTPUT_STATUS_DATA {
        time_usec: state.time.as_micros(),
        active,
        actuator,
    })
}

/// NAMED_VALUE_FLOAT: what the compensator sees, does and has left, SI units and radians, and the two air angles.
pub fn named_values(state: &Snapshot) -> Vec<Encoded> {
    let (log, motion) = (&state.log, state.motion());
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

/// Identity of the array, beside its name.
const WHY_ID: u16 = 1;

/// Effectors of which `WHY` tells: the array has room for no more.
const WHY_EFFECTORS: usize = 8;

/// DEBUG_FLOAT_ARRAY `WHY`: for each of the first eight effectors, in their order, what it is told (0 to 7), where the
/// model of the healthy actuators has it (8 to 15), and 1 where its demand is beyond its limit (16 to 23); then what
/// the compensator sees, does and has left (24 to 41), what of each command is compensation (42 to 49), and
/// what is left in either direction (50 to 55). docs/mavlink.md has the list.
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
        .chain(log.authority.positive_pct);
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
