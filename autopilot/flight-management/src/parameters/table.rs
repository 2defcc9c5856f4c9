//! The rows of the parameter table.

use std::sync::LazyLock;

use flight_control::gains::{EarthShape, EstimatorPreset, StateSource, Tunable, tunables};
use flight_control::{
    AllocationMode, CompensatorLaw, CompensatorMode, IsolationMode, MainLaw, ObserverMode,
};

use super::failure::settings;
use super::{Access, Choice, Kind, Parameter, SticksLossAction, SwitchChannel, SwitchMode};
use crate::vehicle::LinkLossAction;
use crate::vehicle::failsafe::{EngineAction, FuelAction};
use crate::vehicle::fence::FenceAction;

/// All parameters, in the order of their index on the wire.
pub fn table() -> &'static [Parameter] {
    static TABLE: LazyLock<Vec<Parameter>> = LazyLock::new(|| {
        let gains =
            tunables().map(|&Tunable { name, unit, min, max, meaning, get, set, .. }| {
                let (group, access) = (law(name), Access::Gain(get, set));
                Parameter { name, group, unit, min, max, meaning, access, ..Parameter::NUMBER }
            });
        let own = [LAWS, REFERENCES, FAULTS, settings(), FAULT_SIZES, FAULT_TIMES, GUIDANCE, FENCE];
        let failsafes = [FAILSAFE, FAILSAFE_LEVELS].concat();
        let links = [LINK_LOSS, LINK_SILENCE, LINK_TIMES, STATION, CHANNEL, SLOTS, STREAMS];
        let mut rows =
            [own.concat(), failsafes, links.concat(), gains.collect(), ESTIMATOR.to_vec()].concat();
        // It acts at the start of the program, so that no ground station loses the vehicle while it looks at it.
        for row in rows.iter_mut().filter(|row| row.name == "MAV_SYS_ID") {
            row.at_restart = true;
        }
        rows
    });
    &TABLE
}

/// The law that a gain belongs to, by the first letters of its name.
fn law(name: &str) -> &'static str {
    match name.split('_').next() {
        Some("ALT") => "Altitude law",
        Some("ROL") => "Roll law",
        Some("YAW") => "Yaw damper",
        Some("SPD") => "Speed law",
        Some("NDI") => "Dynamic inversion",
        Some("LQR") => "Linear regulator",
        Some("OBS") => "Observer",
        Some("LES") => "Linear observer",
        Some("INC") => "Incremental law",
        Some("ACT") => "Activation",
        Some("ISO") => "Isolation",
        Some("EST") => "Estimator",
        Some("RLF") => "Relief",
        _ => "Other gains",
    }
}

/// Rows of numbers: name, unit, range, default, field of `Parameters`, meaning.
macro_rules! numbers {
    ($kind:ident, $group:literal; $(
        $name:literal, $unit:literal, $min:literal to $max:literal, $default:literal, $($field:ident).+, $meaning:literal;
    )*) => {
        &[$(Parameter {
            name: $name,
            group: $group,
            kind: Kind::$kind,
            unit: $unit,
            min: $min,
            max: $max,
            meaning: $meaning,
            // A whole number was checked before to be one, and to be in range.
            access: Access::Own(|p| f64::from(p.$($field).+), |p, value| p.$($field).+ = value as _),
            default: Some($default),
            ..Parameter::NUMBER
        }),*]
    };
}

/// Rows of choices: name, field of `Parameters`, default unless it is a gain, meaning, then number, variant and meaning of each
/// value, by rising numbers.
macro_rules! choices {
    ($group:literal; $(
        $name:literal, $($field:ident).+ $([$place:literal])? $(= $default:literal)?, $meaning:literal:
        $($value:literal $($variant:tt)::+ $label:literal),+;
    )*) => {
        &[$(Parameter {
            name: $name,
            group: $group,
            kind: Kind::Int,
            min: [$($value),+][0] as f64,
            max: [$($value),+][[$($value),+].len() - 1] as f64,
            meaning: $meaning,
            choices: &[$(Choice { value: $value, label: $label }),+],
            access: Access::Own(
                |p| match p.$($field).+ $([$place])? {
                    $($($variant)::+ => f64::from($value)),+
                },
                |p, value| {
                    let choices = [$(($value, $($variant)::+)),+];
                    let chosen = choices.into_iter().find(|(number, _)| f64::from(*number) == value);
                    if let Some((_, variant)) = chosen {
                        p.$($field).+ $([$place])? = variant;
                    }
                },
            ),
            default: [$(Some($default as f64),)? None][0],
            ..Parameter::NUMBER
        }),*]
    };
}

const LAWS: &[Parameter] = choices! { "Laws";
    "FTC_MODE", gains.selection.compensator, "When the compensator acts":
        0 CompensatorMode::Off "never",
        1 CompensatorMode::Armed "when a fault is seen",
        2 CompensatorMode::AlwaysOn "always";
    "FTC_OBS", gains.selection.observer, "Observer":
        0 ObserverMode::Informed "knows the compensation",
        1 ObserverMode::Literal "as printed, does not know the compensation";
    "CTL_LAW", gains.selection.main, "Main controller":
        0 MainLaw::Pid "PID",
        1 MainLaw::PidGangedNozzle "PID with the nozzle ganged to it (baseline)",
        2 MainLaw::Ndi "nonlinear dynamic inversion",
        3 MainLaw::Lqr "linear quadratic regulator",
        9 MainLaw::Own "law that the program brings";
    "FTC_LAW", gains.selection.compensator_law, "Estimator of the compensator":
        0 CompensatorLaw::Neso "nonlinear extended state observer (NESO)",
        1 CompensatorLaw::LinearEso "linear extended state observer",
        2 CompensatorLaw::Incremental "filtered angular acceleration (incremental)";
    "FTC_ALLOC", gains.selection.allocation, "Allocation of the compensating demand":
        0 AllocationMode::Paper "ailerons and nozzle, by the inverse of the paper",
        1 AllocationMode::Wls "all surfaces and nozzle angles, bounded weighted least squares",
        2 AllocationMode::Relief "the same about the command of the paper, with relief in yaw (beyond the paper)",
        9 AllocationMode::Own "the compensation that the program brings";
    "FTC_ISO", gains.selection.isolation, "What the verdict of the isolation is good for":
        0 IsolationMode::Report "reported, changes no command",
        1 IsolationMode::Test "the same, with test deflections where two effectors look alike",
        2 IsolationMode::Use "the same, and the allocation relief uses a rudder known to be healthy";
};

const ESTIMATOR: &[Parameter] = choices! { "Estimator";
    "EST_SOURCE", gains.selection.state, "Where the navigation state of the next flight comes from":
        0 StateSource::Automatic "samples where the attitude unit is valid at the start, else the estimator",
        1 StateSource::Samples "latest samples",
        2 StateSource::Estimator "estimator";
    "EST_EARTH", gains.selection.earth, "The Earth that the estimator assumes in the next flight":
        0 EarthShape::Wgs84 "rotating WGS-84 ellipsoid",
        1 EarthShape::Flat "plane that does not rotate";
    "EST_PRESET", gains.selection.estimator, "Noise and priors of the estimator":
        0 EstimatorPreset::Parameters "those of the parameters EST_*, by default for sensors of the tactical grade",
        1 EstimatorPreset::Consumer "those for sensors of the consumer grade, whatever the parameters are";
};

const REFERENCES: &[Parameter] = numbers! { Real, "References";
    "REF_ALT_MIN", "m", 0.0 to 20_000.0, 500.0, limits.altitude_min_m,
        "Lowest altitude reference, above the ellipsoid";
    "REF_ALT_MAX", "m", 0.0 to 20_000.0, 12_000.0, limits.altitude_max_m,
        "Highest altitude reference, above the ellipsoid";
    "FW_AIRSPD_MIN", "m/s", 5.0 to 500.0, 140.0, limits.airspeed_min_m_s,
        "Lowest calibrated airspeed reference";
    "FW_AIRSPD_MAX", "m/s", 5.0 to 500.0, 280.0, limits.airspeed_max_m_s,
        "Highest calibrated airspeed reference";
    "REF_ROLL_MAX", "deg", 1.0 to 80.0, 45.0, limits.roll_max_deg,
        "Largest roll reference";
};

const GUIDANCE: &[Parameter] = numbers! { Real, "Guidance";
    "FW_L1_PERIOD", "s", 1.0 to 100.0, 25.0, navigation.l1_period_s,
        "Period of the lateral guidance: longer is softer, and cuts corners more";
    "FW_L1_DAMPING", "-", 0.4 to 1.5, 0.75, navigation.l1_damping,
        "Damping of the lateral guidance";
    // The ailerons of the paper's jet follow the default without reaching their stops.
    "FW_PN_R_SLEW_MAX", "deg/s", 1.0 to 500.0, 20.0, navigation.roll_slew_deg_s,
        "Fastest change of the roll reference that the guidance makes";
    "NAV_BANK_MAX", "deg", 1.0 to 80.0, 45.0, navigation.bank_max_deg,
        "Largest bank angle of the guidance, at most REF_ROLL_MAX";
    "NAV_LOITER_RAD", "m", 10.0 to 100_000.0, 10_000.0, navigation.loiter_radius_m,
        "Radius of circles that have none of their own";
    "NAV_ACC_RAD", "m", 1.0 to 20_000.0, 500.0, navigation.acceptance_m,
        "Smallest acceptance radius of waypoints";
    "NAV_CLIMB_MAX", "m/s", 0.1 to 100.0, 30.0, navigation.climb_max_m_s,
        "Largest climb rate of stick and offboard references";
    "RTL_RETURN_ALT", "m", 0.0 to 20_000.0, 5_000.0, navigation.return_altitude_m,
        "Altitude of the return, above the ellipsoid, from REF_ALT_MIN to REF_ALT_MAX";
    "FW_LND_ANG", "deg", 1.0 to 15.0, 3.0, navigation.landing_angle_deg,
        "Glide to a landing; steeper where the altitude left needs it";
    "FW_LND_AIRSPD", "m/s", 0.0 to 500.0, 0.0, navigation.landing_airspeed_m_s,
        "Calibrated airspeed of the approach; 0 is 1.3 times that of the stall by the model";
    "FW_LND_FL_SINK", "m/s", 0.05 to 2.0, 0.6, navigation.touchdown_m_s,
        "Sink rate to which the flare leads";
    "MIS_TAKEOFF_ALT", "m", 5.0 to 5_000.0, 500.0, navigation.takeoff_height_m,
        "Height above the ground to which Takeoff climbs without a given altitude";
    "FW_TKO_PITCH", "deg", 0.0 to 30.0, 10.0, navigation.takeoff_pitch_deg,
        "Pitch angle of the rotation";
    "GF_MAX_VER_DIST", "m", 0.0 to 20_000.0, 0.0, navigation.fence_max_m,
        "Highest altitude of the fence above home; 0 none";
    "GF_MIN_VER_DIST", "m", 0.0 to 20_000.0, 0.0, navigation.fence_min_m,
        "Lowest altitude of the fence above home; 0 none";
};

const FENCE: &[Parameter] = choices! { "Guidance";
    "GF_ACTION", navigation.fence_action = 2, "What happens at a breach of the fence":
        0 FenceAction::Nothing "none, the fence is off",
        1 FenceAction::Report "reported",
        2 FenceAction::Hold "circle where the aircraft is",
        3 FenceAction::Return "Return",
        4 FenceAction::Terminate "end the flight",
        5 FenceAction::Land "the landing of the plan, or Return";
};

const FAILSAFE: &[Parameter] = choices! { "Failsafes";
    "COM_ACT_FAIL_ACT", navigation.engine_action = 3, "What happens when the engine gives no thrust, not in Position and Altitude":
        0 EngineAction::Report "the aircraft glides in its mode",
        3 EngineAction::Return "it glides home",
        4 EngineAction::Terminate "end the flight";
    "COM_LOW_BAT_ACT", navigation.fuel_action = 0, "What happens when the fuel runs low":
        0 FuelAction::Report "reported",
        2 FuelAction::Land "below BAT_CRIT_THR the landing of the plan, or Return",
        3 FuelAction::Return "below BAT_CRIT_THR Return, below BAT_EMERGEN_THR as 2";
};

const FAILSAFE_LEVELS: &[Parameter] = numbers! { Real, "Failsafes";
    "BAT_LOW_THR", "-", 0.0 to 1.0, 0.15, navigation.low_fuel, "Low level of the fuel, of a full tank";
    "BAT_CRIT_THR", "-", 0.0 to 1.0, 0.07, navigation.critical_fuel, "Critical level of the fuel";
    "BAT_EMERGEN_THR", "-", 0.0 to 1.0, 0.05, navigation.emergency_fuel, "Emergency level of the fuel";
    "FW_GPSF_R", "deg", 0.0 to 30.0, 15.0, navigation.lost_bank_deg,
        "Bank angle of the circle that is flown without a position";
};

const LINK_LOSS: &[Parameter] = choices! { "Link loss";
    "NAV_DLL_ACT", link.loss_action = 0, "What happens when the controlling ground station falls silent":
        0 LinkLossAction::Continue "the flight goes on",
        1 LinkLossAction::Hold "circle where the aircraft is",
        2 LinkLossAction::Return "Return";
    "NAV_RCL_ACT", link.sticks_loss_action = 1, "What happens when a pilot's sticks fall silent in a mode that needs them":
        1 SticksLossAction::Hold "circle where the aircraft is",
        2 SticksLossAction::Return "Return";
};

/// In whole seconds, as PX4 has it.
const LINK_SILENCE: &[Parameter] = numbers! { Int, "Link loss";
    "COM_DL_LOSS_T", "s", 2.0 to 300.0, 10.0, link.loss_s,
        "Silence of the controlling ground station until NAV_DLL_ACT, whole seconds of wall time";
};

const LINK_TIMES: &[Parameter] = numbers! { Real, "Link loss";
    "COM_OF_LOSS_T", "s", 0.1 to 60.0, 0.5, link.offboard_loss_s,
        "Silence of an offboard stream until Offboard ends, wall time";
    "COM_RC_LOSS_T", "s", 0.1 to 35.0, 0.5, link.sticks_loss_s,
        "Silence of a pilot's sticks until they no longer count, wall time";
};

const STREAMS: &[Parameter] = numbers! { Real, "Streams";
    "STR_ATT_HZ", "Hz", 0.1 to 100.0, 25.0, streams.attitude_hz,
        "Attitude messages where nothing else is asked for, wall time";
    "STR_POS_HZ", "Hz", 0.1 to 100.0, 10.0, streams.position_hz,
        "Position and speed messages where nothing else is asked for, wall time";
    "STR_ACT_HZ", "Hz", 0.1 to 100.0, 10.0, streams.actuators_hz,
        "Messages of the effectors' commands where nothing else is asked for, wall time";
    "STR_FTC_HZ", "Hz", 0.1 to 100.0, 10.0, streams.compensator_hz,
        "Messages about the compensator where nothing else is asked for, wall time";
};

/// The parameter whose name takes the fewest changes of letters.
pub fn nearest(name: &str) -> Option<&'static str> {
    let upper = name.to_uppercase();
    table().iter().map(|row| row.name).min_by_key(|known| changes(&upper, known))
}

/// Letters to put in, take out or change on the way from one word to another (Levenshtein 1966).
pub fn changes(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (index, letter) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = index + 1;
        for (place, other) in to.iter().enumerate() {
            let changed = diagonal + usize::from(letter != *other);
            diagonal = row[place + 1];
            row[place + 1] = changed.min(diagonal + 1).min(row[place] + 1);
        }
    }
    row[to.len()]
}

const FAULTS: &[Parameter] = choices! { "Fault injection";
    "SYS_FAILURE_EN", failure.enabled = 1, "Fault injection":
        0 false "refused",
        1 true "allowed";
};

const FAULT_SIZES: &[Parameter] = numbers! { Real, "Fault injection";
    "FLT_ENG_PCT", "%", -100.0 to 100.0, 10.0, failure.engine_pct,
        "Size of the engine's faults in place of the degrees, percent of its largest thrust; of SLOW and DRIFT percent/s";
    "FLT_RAMP_S", "s", 0.0 to 3_600.0, 0.0, failure.ramp_s,
        "Time from nothing to the whole fault; not used where an effector sticks in place, runs hard over or flames out";
    "FLT_DUR_S", "s", 0.0 to 100_000.0, 0.0, failure.duration_s,
        "How long a fault acts, in simulation time; 0 for ever";
    "FLT_RPT_S", "s", 0.0 to 100_000.0, 0.0, failure.every_s,
        "From one onset of a fault to the next, needs FLT_DUR_S; 0 once only";
};

const FAULT_TIMES: &[Parameter] = numbers! { Int, "Fault injection";
    "FLT_RPT_N", "-", 0.0 to 1_000.0, 0.0, failure.times,
        "How often a fault acts in all with FLT_RPT_S; 0 without end";
};

const CHANNEL: &[Parameter] = choices! { "Mode switch";
    "RC_MAP_FLTMODE", mode_switch.channel = 0, "Channel of RC_CHANNELS_OVERRIDE that selects a mode when it changes its slot":
        0 SwitchChannel::None "Unassigned",
        5 SwitchChannel::Five "Channel 5",
        6 SwitchChannel::Six "Channel 6",
        7 SwitchChannel::Seven "Channel 7",
        8 SwitchChannel::Eight "Channel 8";
};

/// Name, place, default and range of each slot; the modes are the same for all.
macro_rules! slots {
    ($($name:literal $place:literal $default:literal $meaning:literal,)*) => {
        choices! { "Mode switch"; $(
            $name, mode_switch.slots[$place] = $default, $meaning:
                -1 SwitchMode::Unassigned "Unassigned",
                0 SwitchMode::Manual "Manual",
                1 SwitchMode::Altitude "Altitude",
                2 SwitchMode::Position "Position",
                3 SwitchMode::Mission "Mission",
                4 SwitchMode::Hold "Hold",
                5 SwitchMode::Return "Return",
                6 SwitchMode::Acro "Acro",
                7 SwitchMode::Offboard "Offboard",
                8 SwitchMode::Stabilized "Stabilized";
        )* }
    };
}

const SLOTS: &[Parameter] = slots! {
    "COM_FLTMODE1" 0 2 "Mode of the lowest sixth of the switch's channel, from 1000 us",
    "COM_FLTMODE2" 1 1 "Mode of the second sixth, from 1167 us",
    "COM_FLTMODE3" 2 4 "Mode of the third sixth, from 1333 us",
    "COM_FLTMODE4" 3 3 "Mode of the fourth sixth, from 1500 us",
    "COM_FLTMODE5" 4 5 "Mode of the fifth sixth, from 1667 us",
    "COM_FLTMODE6" 5 -1 "Mode of the highest sixth, from 1833 us to 2000 us",
};

/// System ids up to 250, as PX4 has it; above are ground stations.
const STATION: &[Parameter] = numbers! { Int, "Ground stations";
    "MAV_SYS_ID", "-", 1.0 to 250.0, 1.0, link.system_id, "MAVLink system id of the vehicle";
};
