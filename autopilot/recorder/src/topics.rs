//! Topics of a flight log: their columns, and rows from the values of a tick.
//!
//! The last part of a column's name is its unit. Axes, signs and units are those of crate `icd`.

use arrayvec::ArrayVec;
use flight_control::StepLog;
use flight_control::estimator::EstimatorStatus;
use icd::fault::FaultEntry;
use icd::record::{FieldName, TruthRow, effector_field, truth_fields};
use icd::sensors::SensorKind;
use icd::{Actuators, Effector, EffectorList, Sensors, SimTime};
use ulog::format::{Field, FieldType, Format};
use ulog::writer::Row;

use super::{Moment, RunHash};
use flight_management::event::Axis;
use flight_management::vehicle::Mode;

/// Characters of one row of the topic `recorded`; longer entries take several rows.
pub const PIECE_CHARS: usize = 200;

/// Characters of a run hash.
const HASH_CHARS: usize = 64;

/// Columns of the topic `commands`: one for each effector.
pub fn command_names(effectors: &EffectorList) -> Vec<FieldName> {
    effectors.all().map(|effector| effector_field("", effectors, effector)).collect()
}

// One list makes the names and the values, so their orders cannot differ.
macro_rules! columns {
    ($names:ident, $values:ident($step:ident): $($name:literal => $value:expr,)+) => {
        const $names: [&str; [$($name),+].len()] = [$($name),+];

        fn $values($step: &StepLog) -> [f64; $names.len()] {
            [$($value),+]
        }
    };
}

fn flag(flag: bool) -> f64 {
    f64::from(u8::from(flag))
}

/// Place of an effector from 1; 0 for none.
fn place(effector: Option<Effector>) -> f64 {
    effector.map_or(0.0, |effector| f64::from(effector.code()) + 1.0)
}

// First columns of the topic `control`.
columns! { CONTROL_HEAD, control_head(step):
    "p_rad_s" => step.state.rates.x,
    "q_rad_s" => step.state.rates.y,
    "r_rad_s" => step.state.rates.z,
    "roll_rad" => step.state.attitude.phi,
    "pitch_rad" => step.state.attitude.theta,
    "yaw_rad" => step.state.attitude.psi,
    "alpha_rad" => step.state.alpha,
    "beta_rad" => step.state.beta,
    "airspeed_m_s" => step.state.airspeed_m_s,
    "altitude_m" => step.state.altitude_m,
    "climb_rate_m_s" => step.state.climb_rate_m_s(),
    "thrust_n" => step.state.thrust_n,
    "altitude_reference_m" => step.altitude_reference_m,
    "roll_reference_rad" => step.roll_reference_rad,
    "airspeed_reference_m_s" => step.airspeed_reference_m_s,
    "z_roll_rad_s" => step.z.x,
    "z_pitch_rad_s" => step.z.y,
    "z_yaw_rad_s" => step.z.z,
    "z2_roll_rad_s2" => step.z2.x,
    "z2_pitch_rad_s2" => step.z2.y,
    "z2_yaw_rad_s2" => step.z2.z,
    "level_roll" => step.levels.x,
    "level_pitch" => step.levels.y,
    "level_yaw" => step.levels.z,
    "level" => step.level,
    "compensator_active" => flag(step.compensator_active),
    "fade" => step.fade,
    "main_aileron_rad" => step.main.aileron_rad,
    "main_elevator_rad" => step.main.elevator_rad,
    "main_rudder_rad" => step.main.rudder_rad,
    "main_nozzle_pitch_rad" => step.main.nozzle_pitch_rad,
    "main_nozzle_yaw_rad" => step.main.nozzle_yaw_rad,
    "main_thrust_n" => step.main.thrust_n,
    "compensation_aileron_rad" => step.compensation.aileron_rad,
    "compensation_nozzle_pitch_rad" => step.compensation.nozzle_pitch_rad,
    "compensation_nozzle_yaw_rad" => step.compensation.nozzle_yaw_rad,
    "applied_aileron_rad" => step.applied_compensation.aileron_rad,
    "applied_nozzle_pitch_rad" => step.applied_compensation.nozzle_pitch_rad,
    "applied_nozzle_yaw_rad" => step.applied_compensation.nozzle_yaw_rad,
}

// Last columns of the topic `control`.
columns! { CONTROL_TAIL, control_tail(step):
    "brakes" => step.brakes,
    "on_wheels" => f64::from(u8::from(step.state.on_wheels)),
    "attained_roll_rad_s2" => step.attained.x,
    "attained_pitch_rad_s2" => step.attained.y,
    "attained_yaw_rad_s2" => step.attained.z,
    "authority_roll_pct" => Axis::Roll.authority_pct(&step.authority),
    "authority_pitch_pct" => Axis::Pitch.authority_pct(&step.authority),
    "authority_yaw_pct" => Axis::Yaw.authority_pct(&step.authority),
    "authority_roll_negative_pct" => step.authority.negative_pct[0],
    "authority_pitch_negative_pct" => step.authority.negative_pct[1],
    "authority_yaw_negative_pct" => step.authority.negative_pct[2],
    "authority_roll_positive_pct" => step.authority.positive_pct[0],
    "authority_pitch_positive_pct" => step.authority.positive_pct[1],
    "authority_yaw_positive_pct" => step.authority.positive_pct[2],
    // 0: held, or nothing is at its limit; 1 engine, 2 elevator, 3 wing.
    "altitude_limit" => step.altitude_limit.map_or(0.0, |limit| f64::from(limit.code())),
    "modelled_roll_rad_s2" => step.modelled_acceleration.x,
    "modelled_pitch_rad_s2" => step.modelled_acceleration.y,
    "modelled_yaw_rad_s2" => step.modelled_acceleration.z,
    "implausible_input" => flag(step.health.implausible_input),
    "implausible_command" => flag(step.health.implausible_command),
    "aileron_saturated" => flag(step.health.aileron_saturated),
    "elevator_saturated" => flag(step.health.elevator_saturated),
    "rudder_saturated" => flag(step.health.rudder_saturated),
    "nozzle_pitch_saturated" => flag(step.health.nozzle_pitch_saturated),
    "nozzle_yaw_saturated" => flag(step.health.nozzle_yaw_saturated),
    "thrust_saturated" => flag(step.health.thrust_saturated),
    // The allocation beyond the paper; zeros where another one is chosen.
    "yaw_shortage_rad_s2" => step.relief.yaw_shortage,
    "yaw_relief" => step.relief.relief,
    "thrust_boost_n" => step.relief.boost_n,
    "thrust_floor_n" => step.relief.thrust_floor_n,
    "yields_roll" => step.relief.quiet.axes.x,
    "yields_pitch" => step.relief.quiet.axes.y,
    "yields_yaw" => step.relief.quiet.axes.z,
    "yields_main_roll" => step.relief.quiet.main_roll,
    "thrust_floor" => flag(step.health.compensation.thrust_floor),
    "yields" => flag(step.health.compensation.yields),
    // The isolation: effectors by their place from 1, 0 none; behaviour 1 stuck, 2 reduced, 3 biased, 4 moves by itself.
    "isolated" => place(step.isolation.verdict.and_then(|verdict| verdict.effectors[0])),
    "isolated_second" => place(step.isolation.verdict.and_then(|verdict| verdict.effectors[1])),
    "isolated_behaviour" => step.isolation.verdict.map_or(0.0, |verdict| f64::from(verdict.behaviour.code())),
    "isolated_value" => step.isolation.verdict.map_or(0.0, |verdict| verdict.values[0]),
    "isolated_second_value" => step.isolation.verdict.map_or(0.0, |verdict| verdict.values[1]),
    "isolated_confidence" => step.isolation.verdict.map_or(0.0, |verdict| verdict.confidence),
    "likely" => place(step.isolation.likely[0]),
    "likely_second" => place(step.isolation.likely[1]),
    "likely_probability" => step.isolation.probability,
    "test_deflection_rad" => step.isolation.test_rad,
    // Further parts of the navigation state, and which parts are valid.
    "specific_force_x_m_s2" => step.state.specific_force.0.x,
    "specific_force_y_m_s2" => step.state.specific_force.0.y,
    "specific_force_z_m_s2" => step.state.specific_force.0.z,
    "velocity_north_m_s" => step.state.velocity.0.x,
    "velocity_east_m_s" => step.state.velocity.0.y,
    "position_north_m" => step.state.position.0.x,
    "position_east_m" => step.state.position.0.y,
    "position_down_m" => step.state.position.0.z,
    "latitude_rad" => step.state.latitude_rad,
    "longitude_rad" => step.state.longitude_rad,
    "rates_valid" => flag(step.state.valid.rates),
    "attitude_valid" => flag(step.state.valid.attitude),
    "specific_force_valid" => flag(step.state.valid.specific_force),
    "velocity_valid" => flag(step.state.valid.velocity),
    "position_valid" => flag(step.state.valid.position),
    "altitude_valid" => flag(step.state.valid.altitude),
    "airspeed_valid" => flag(step.state.valid.airspeed),
    "flow_angles_valid" => flag(step.state.valid.flow_angles),
    "thrust_valid" => flag(step.state.valid.thrust),
}

/// Most columns of the topic `control`.
const CONTROL_MAX: usize = CONTROL_HEAD.len() + 3 * Effector::MAX + CONTROL_TAIL.len();

/// Columns of the topic `control`: the signals of a control step ([`StepLog`]), with the command, the compensation in
/// it and the modelled position of each effector between them; flags are 0 or 1.
pub fn control_names(effectors: &EffectorList) -> Vec<FieldName> {
    let fixed = |name: &str| FieldName::from(name).unwrap_or_default();
    let of = |before| effectors.all().map(move |e| effector_field(before, effectors, e));
    let of_effectors = ["command", "added", "modelled"].into_iter().flat_map(of);
    let (head, tail) = (CONTROL_HEAD.into_iter(), CONTROL_TAIL.into_iter());
    head.map(fixed).chain(of_effectors).chain(tail.map(fixed)).collect()
}

/// The values of a control step in the order of [`control_names`], of an aircraft with so many effectors.
pub fn control_values(step: &StepLog, effectors: usize) -> ArrayVec<f64, CONTROL_MAX> {
    let of_effectors = [&step.commands, &step.increments, &step.modelled];
    let of_effectors = of_effectors.into_iter().flat_map(|values| values.first(effectors));
    control_head(step).into_iter().chain(of_effectors.copied()).chain(control_tail(step)).collect()
}

/// A topic of numbers.
fn numbers<N: AsRef<str>>(name: &str, columns: impl IntoIterator<Item = N>) -> Format {
    let columns = columns.into_iter().map(|column| Field::new(FieldType::F64, column.as_ref()));
    topic(name, columns)
}

fn topic(name: &str, columns: impl IntoIterator<Item = Field>) -> Format {
    let time = Field::new(FieldType::U64, "timestamp");
    Format { name: name.to_owned(), fields: std::iter::once(time).chain(columns).collect() }
}

/// The samples of a control step: their values, times and validity.
pub fn sensors() -> Format {
    use FieldType::{Bool, F64, U64};
    let values = Sensors::NAMES.map(|name| Field::new(F64, name));
    let times = Sensors::TIMES.map(|name| Field::new(U64, name));
    let valid = Sensors::VALID.map(|name| Field::new(Bool, name));
    topic("sensors", values.into_iter().chain(times).chain(valid))
}

/// The commands of a control step.
pub fn commands(effectors: &EffectorList) -> Format {
    numbers("commands", command_names(effectors))
}

/// The signals of a control step.
pub fn control(effectors: &EffectorList) -> Format {
    numbers("control", control_names(effectors))
}

/// The truth at a control step, as the plant reports it.
pub fn truth(effectors: &EffectorList) -> Format {
    numbers("truth", truth_fields(effectors))
}

/// The type of a column by the name that Rust has for it.
fn field_type(name: &str) -> FieldType {
    match name {
        "u8" => FieldType::U8,
        "u32" => FieldType::U32,
        "u64" => FieldType::U64,
        "f32" => FieldType::F32,
        "bool" => FieldType::Bool,
        _ => FieldType::F64,
    }
}

// The same for whole topics, with the type of each column.
macro_rules! topics {
    ($(
        $(#[$doc:meta])* $vis:vis $format:ident, $(#[$row_doc:meta])* $row:ident($($argument:ident: $type:ty),+) {
            $($kind:ident $name:literal => $value:expr,)+
        }
    )*) => {$(
        $(#[$doc])*
        $vis fn $format() -> Format {
            topic(stringify!($format), [$(Field::new(field_type(stringify!($kind)), $name)),+])
        }

        $(#[$row_doc])*
        $vis fn $row(row: &mut Row, time: SimTime, $($argument: $type),+) {
            row.begin(time.as_micros())$(.$kind($value))+;
        }
    )*};
}

topics! {
    /// Mode and references in a control step.
    pub vehicle,
    /// Row of [`vehicle`]; the references are altitude, m, roll, rad, and airspeed, m/s.
    vehicle_row(mode: Mode, references: [f64; 3], terminated: bool) {
        f64 "altitude_m" => references[0],
        f64 "roll_rad" => references[1],
        f64 "airspeed_m_s" => references[2],
        u8 "mode" => mode as u8,
        bool "terminated" => terminated,
    }

    /// A change of a fault on the plant's list: scheduled, active, pausing, or over.
    pub fault,
    /// Row of [`fault`].
    fault_row(entry: &FaultEntry) {
        u64 "at_us" => entry.state.time().as_micros(),
        u64 "next_us" => entry.state.next_onset().unwrap_or_default().as_micros(),
        f64 "value_1" => entry.kind.values()[0],
        f64 "value_2" => entry.kind.values()[1],
        f64 "ramp_s" => entry.timing.ramp_s,
        f64 "duration_s" => entry.timing.duration_s.unwrap_or(0.0),
        f64 "every_s" => entry.timing.repeat.map_or(0.0, |repeat| repeat.every_s),
        u32 "id" => entry.id,
        u32 "times" => entry.timing.repeat.and_then(|repeat| repeat.times).unwrap_or(0),
        u8 "effector" => entry.target.into(),
        u8 "kind" => entry.kind.code(),
        u8 "state" => entry.state.code(),
    }

    /// Standard deviations, ratios and counts of the estimate. A standard deviation of several states is the root of the sum of their
    /// variances; a ratio is an innovation over its gate, and above 1 the sample is rejected.
    estimate,
    /// Row of [`estimate`].
    estimate_row(status: &EstimatorStatus) {
        f32 "attitude_std_rad" => status.attitude_rad,
        f32 "velocity_std_m_s" => status.velocity_m_s,
        f32 "position_horizontal_std_m" => status.horizontal_m,
        f32 "altitude_std_m" => status.vertical_m,
        f32 "wind_std_m_s" => status.wind_m_s,
        f32 "airspeed_std_m_s" => status.airspeed_m_s,
        f32 "gyro_bias_std_rad_s" => status.gyro_bias_rad_s,
        f32 "accelerometer_bias_std_m_s2" => status.force_bias_m_s2,
        f32 "magnetometer_bias_std_nt" => status.magnetic_bias_nt,
        f32 "barometer_offset_std_m" => status.barometer_offset_m,
        f32 "vane_bias_std_rad" => status.vane_bias_rad,
        f32 "velocity_ratio" => status.velocity_ratio,
        f32 "position_horizontal_ratio" => status.horizontal_ratio,
        f32 "altitude_ratio" => status.vertical_ratio,
        f32 "magnetometer_ratio" => status.magnetic_ratio,
        f32 "airspeed_ratio" => status.airspeed_ratio,
        f32 "vanes_ratio" => status.flow_ratio,
        u32 "rejected" => status.rejected,
        u32 "late" => status.late,
        u32 "realigned" => status.realigned,
    }
}

/// Covariance, innovations and sources of the estimate in a control step; no rows where the navigation state is that of the samples.
pub fn estimator_status() -> Format {
    let mut format = Format { name: "estimator_status".to_owned(), ..estimate() };
    let health = |sensor: SensorKind| Field::new(FieldType::U8, format!("{}_health", sensor.key()));
    format.fields.extend(SensorKind::ALL.map(health));
    format.fields.push(Field::new(FieldType::Bool, "aligned"));
    format
}

/// Row of [`estimator_status`].
pub fn estimator_status_row(row: &mut Row, time: SimTime, status: &EstimatorStatus) {
    estimate_row(row, time, status);
    for sensor in SensorKind::ALL {
        row.u8(status.source(sensor) as u8);
    }
    row.bool(status.is_aligned);
}

/// Inputs in their order, as JSON.
pub fn recorded() -> Format {
    use FieldType::{Char, U8, U16, U64};
    topic(
        "recorded",
        [
            Field::new(U64, "step"),
            Field::new(U16, "part"),
            Field::new(U16, "parts"),
            Field::new(U8, "phase"),
            Field::new(U8, "length"),
            Field::array(Char, PIECE_CHARS, "text"),
        ],
    )
}

/// The run hash of all control steps so far, with their number.
pub fn hash() -> Format {
    let columns = [
        Field::new(FieldType::U64, "steps"),
        Field::array(FieldType::Char, HASH_CHARS, "run_hash"),
    ];
    topic("hash", columns)
}

/// Row of [`hash`], after the control step of this time.
pub fn hash_row(row: &mut Row, time: SimTime, hash: &RunHash) {
    row.begin(time.as_micros()).u64(hash.steps()).chars(hash.hex().as_bytes(), HASH_CHARS);
}

/// Row of [`sensors`].
pub fn sensors_row(row: &mut Row, time: SimTime, sensors: &Sensors) {
    let stamps = sensors.stamps();
    row.begin(time.as_micros()).f64s(&sensors.to_array());
    for stamp in stamps {
        row.u64(stamp.time.as_micros());
    }
    for stamp in stamps {
        row.bool(stamp.valid);
    }
}

/// Row of [`commands`], for this number of effectors.
pub fn commands_row(row: &mut Row, time: SimTime, actuators: &Actuators, effectors: usize) {
    row.begin(time.as_micros()).f64s(actuators.commands.first(effectors));
}

/// Row of [`control`], for this number of effectors.
pub fn control_row(row: &mut Row, time: SimTime, log: &StepLog, effectors: usize) {
    row.begin(time.as_micros()).f64s(&control_values(log, effectors));
}

/// Row of [`truth`].
pub fn truth_row(row: &mut Row, time: SimTime, truth: &TruthRow) {
    row.begin(time.as_micros()).f64s(truth);
}

/// Position of an entry of [`recorded`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Simulation time.
    pub time: SimTime,
    /// Control steps flown before its exchange.
    pub step: u64,
    /// Kind of exchange.
    pub moment: Moment,
}

/// One row of [`recorded`]: piece `part` of `parts`, at most [`PIECE_CHARS`] bytes.
pub fn recorded_row(row: &mut Row, place: Place, part: u16, parts: u16, piece: &[u8]) {
    // At most PIECE_CHARS.
    let length = piece.len().min(PIECE_CHARS) as u8;
    row.begin(place.time.as_micros())
        .u64(place.step)
        .u16(part)
        .u16(parts)
        .u8(place.moment.code())
        .u8(length)
        .chars(piece, PIECE_CHARS);
}

#[cfg(test)]
mod tests {
    use super::*;
    use aircraft::DEFAULT_MODEL;
    use flight_control::isolation::evidence::Behaviour;
    use flight_control::isolation::{IsolationLog, Verdict};
    use flight_control::{AltitudeLimit, Demand, FlightControl, Gains, NavigationState};
    use flight_management::configuration;
    use icd::fault::{FaultKind, FaultState, Onset, Repeat, Timing};
    use icd::tvc_jet;
    use icd::{ControlPeriod, Effector};

    /// Value of a column of doubles.
    fn double(format: &Format, row: &Row, name: &str) -> f64 {
        let at = format.fields.iter().take_while(|field| field.name != name).map(Field::size);
        let bytes = &row.bytes()[at.sum::<usize>()..];
        f64::from_le_bytes(bytes[..8].try_into().unwrap())
    }

    #[test]
    fn every_row_has_the_length_of_its_topic() {
        let mut row = Row::default();
        let time = SimTime::from_micros(4_000);
        let mut values = [0.0; Sensors::COUNT];
        values[6] = 1.0;
        sensors_row(&mut row, time, &Sensors::at(time, &values));
        assert_eq!(row.bytes().len(), sensors().size());
        let list = tvc_jet::effectors();
        commands_row(&mut row, time, &Actuators::default(), list.len());
        assert_eq!(row.bytes().len(), commands(&list).size());
        truth_row(&mut row, time, &[0.0; 59].into_iter().collect());
        assert_eq!(row.bytes().len(), truth(&list).size());
        estimator_status_row(&mut row, time, &EstimatorStatus::default());
        assert_eq!(row.bytes().len(), estimator_status().size());
        vehicle_row(&mut row, time, Mode::Hold, [1.0, 2.0, 3.0], true);
        assert_eq!(row.bytes().len(), vehicle().size());
        let place = Place { time, step: 2, moment: Moment::Step };
        recorded_row(&mut row, place, 0, 1, b"{}");
        assert_eq!(row.bytes().len(), recorded().size());
    }

    #[test]
    fn commands_stand_under_the_names_of_their_effectors() {
        let list = tvc_jet::effectors();
        let control = control_names(&list);
        for (name, effector) in command_names(&list).iter().zip(tvc_jet::ALL) {
            assert_eq!(name.as_str(), format!("{}_{}", list.key(effector), list.unit(effector)));
            for before in ["command", "added", "modelled"] {
                assert!(control.iter().any(|other| other.as_str() == format!("{before}_{name}")));
            }
        }
        assert_eq!(control.len(), 128);
    }

    /// Replaces each number by a different one, and each flag by true.
    fn number(value: &mut serde_json::Value, next: &mut u32) {
        use serde_json::Value;
        match value {
            Value::Object(fields) => fields.values_mut().for_each(|field| number(field, next)),
            Value::Array(fields) => fields.iter_mut().for_each(|field| number(field, next)),
            Value::Bool(flag) => *flag = true,
            // A code without a value.
            Value::Null => {}
            _ => {
                *next += 1;
                *value = f64::from(*next).into();
            }
        }
    }

    #[test]
    fn every_number_and_flag_of_a_step_has_its_own_column() {
        let model = configuration::aircraft_model("model", DEFAULT_MODEL).unwrap();
        let mut flight = FlightControl::new(ControlPeriod::DEFAULT, &model, &Gains::REFERENCE);
        let level = NavigationState { airspeed_m_s: 264.0, ..NavigationState::at_rest() };
        let demand = Demand { altitude_m: 0.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
        let mut json = serde_json::to_value(flight.step(&level, &demand)).unwrap();
        // Each row has its time, the angles are redundant with the rotation, and the ground is of the whole flight.
        let state = json["state"].as_object_mut().unwrap();
        let kept =
            ["time", "orientation", "over_ground"].map(|name| (name, state.remove(name).unwrap()));
        let limited = json.as_object_mut().unwrap().remove("limited").unwrap();
        let mut numbers = 1;
        number(&mut json, &mut numbers);
        json["limited"] = limited;
        for (name, value) in kept {
            json["state"][name] = value;
        }
        let log: StepLog = serde_json::from_value(json).unwrap();
        // As for an aircraft with the most effectors.
        let values = control_values(&log, Effector::MAX);
        for n in 2..=numbers {
            let columns = values.iter().filter(|value| value.abs() == f64::from(n)).count();
            assert_eq!(columns, 1, "number {n} of {log:?}");
        }
        // The others are flags: true.
        let flags = values.iter().filter(|value| **value == 1.0).count();
        assert_eq!(flags, format!("{log:?}").matches("true").count());
        // The limit of the altitude is a code; six columns of a verdict and the two likely effectors have no value yet.
        assert_eq!(values.len(), numbers as usize - 1 + flags + 1 + 8);
        let values = control_values(&log, 8);
        let names = control_names(&tvc_jet::effectors());
        let column = |name| names.iter().position(|column| column.as_str() == name).unwrap();
        assert_eq!(values[column("level_pitch")], log.levels.y);
        assert_eq!(values[column("authority_yaw_pct")], log.authority.yaw_pct);
        assert_eq!(values[column("modelled_yaw_rad_s2")], log.modelled_acceleration.z);
        let wing = StepLog { altitude_limit: Some(AltitudeLimit::Wing), ..log };
        assert_eq!(
            [log, wing].map(|log| control_values(&log, 8)[column("altitude_limit")]),
            [0.0, 3.0]
        );
        let verdict = Verdict {
            effectors: [Some(tvc_jet::RUDDER), Some(tvc_jet::LEFT_AILERON)],
            behaviour: Behaviour::Stuck,
            values: [0.1, 0.2],
            confidence: 0.95,
        };
        let isolation =
            IsolationLog { verdict: Some(verdict), likely: verdict.effectors, ..log.isolation };
        let values = control_values(&StepLog { isolation, ..log }, 8);
        for (name, value) in [
            ("isolated", 5.0),
            ("isolated_second", 1.0),
            ("isolated_behaviour", 1.0),
            ("isolated_value", 0.1),
            ("isolated_second_value", 0.2),
            ("isolated_confidence", 0.95),
            ("likely", 5.0),
            ("likely_second", 1.0),
        ] {
            assert_eq!(values[column(name)], value, "{name}");
        }
    }

    #[test]
    fn a_fault_keeps_its_numbers() {
        let repeat = Some(Repeat { every_s: 5.0, times: Some(3) });
        let entry = FaultEntry {
            id: 7,
            target: tvc_jet::NOZZLE_YAW.into(),
            kind: FaultKind::Oscillating { amplitude: 0.1, frequency_hz: 2.0 },
            timing: Timing {
                onset: Onset::At(SimTime::ZERO),
                ramp_s: 0.5,
                duration_s: Some(1.0),
                repeat,
            },
            state: FaultState::Resting {
                since: SimTime::from_micros(9),
                next: SimTime::from_micros(11),
            },
        };
        let mut row = Row::default();
        fault_row(&mut row, SimTime::from_micros(10), &entry);
        let format = fault();
        assert_eq!(row.bytes().len(), format.size());
        for (name, value) in [
            ("value_1", 0.1),
            ("value_2", 2.0),
            ("ramp_s", 0.5),
            ("duration_s", 1.0),
            ("every_s", 5.0),
        ] {
            assert_eq!(double(&format, &row, name), value, "{name}");
        }
        let end = &row.bytes()[row.bytes().len() - 11..];
        assert_eq!(end, [7, 0, 0, 0, 3, 0, 0, 0, tvc_jet::NOZZLE_YAW.code(), 11, 3]);
        assert_eq!(
            row.bytes()[..24],
            [10, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 11, 0, 0, 0, 0, 0, 0, 0]
        );
    }
}
