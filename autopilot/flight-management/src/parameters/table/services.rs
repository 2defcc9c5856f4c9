//! Rows of fault injection, of the mode switch (with PX4's names and numbers) and of the link to ground stations, each in the order of
//! their index on the wire.

use super::{Choice, Get, Kind, Parameter, Set};
use crate::parameters::failure::settings;
use crate::parameters::{SwitchChannel, SwitchMode};

const GROUP: &str = "Fault injection";

/// In the order of their index on the wire.
pub(super) fn failure_rows() -> Vec<Parameter> {
    [SWITCH, &of_kinds(), NUMBERS, TIMES].concat()
}

const SWITCH: &[Parameter] = choices! { "Fault injection";
    "SYS_FAILURE_EN", failure.enabled, "Fault injection":
        0 false "refused",
        1 true "allowed";
};

/// Parameters of the catalogue of faults.
fn of_kinds() -> Vec<Parameter> {
    let rows = settings().iter().enumerate().map(|(place, setting)| Parameter {
        name: setting.name,
        group: GROUP,
        kind: if setting.choices.is_empty() { Kind::Real } else { Kind::Int },
        unit: setting.unit,
        min: setting.min,
        max: setting.max,
        meaning: setting.meaning,
        choices: &setting.choices,
        at_restart: false,
        get: Get::Fault(place),
        set: Set::Fault(place),
    });
    rows.collect()
}

const NUMBERS: &[Parameter] = numbers! { Real, "Fault injection";
    "FLT_ENG_PCT", "%", -100.0 to 100.0, failure.engine_pct,
        "Size of the engine's faults in place of the degrees, percent of its largest thrust; of SLOW and DRIFT percent/s";
    "FLT_RAMP_S", "s", 0.0 to 3_600.0, failure.ramp_s,
        "Time from nothing to the whole fault; not used where an effector sticks in place, runs hard over or flames out";
    "FLT_DUR_S", "s", 0.0 to 100_000.0, failure.duration_s,
        "How long a fault acts, in simulation time; 0 for ever";
    "FLT_RPT_S", "s", 0.0 to 100_000.0, failure.every_s,
        "From one onset of a fault to the next, needs FLT_DUR_S; 0 once only";
};

/// Largest number of repetitions.
const TIMES_MAX: f64 = 1_000.0;

const TIMES: &[Parameter] = &[Parameter {
    name: "FLT_RPT_N",
    group: GROUP,
    kind: Kind::Int,
    unit: "-",
    min: 0.0,
    max: TIMES_MAX,
    meaning: "How often a fault acts in all with FLT_RPT_S; 0 without end",
    choices: &[],
    at_restart: false,
    get: Get::Own(|p| f64::from(p.failure.times)),
    set: Set::Own(|p, value| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as checked before"
        )]
        let times = value as u32;
        p.failure.times = times;
    }),
}];

/// In the order of their index on the wire.
pub(super) const MODE_SWITCH_ROWS: [&[Parameter]; 2] = [CHANNEL, SLOTS];

const CHANNEL: &[Parameter] = choices! { "Mode switch";
    "RC_MAP_FLTMODE", mode_switch.channel, "Channel of RC_CHANNELS_OVERRIDE that selects a mode when it changes its slot":
        0 SwitchChannel::None "Unassigned",
        5 SwitchChannel::Five "Channel 5",
        6 SwitchChannel::Six "Channel 6",
        7 SwitchChannel::Seven "Channel 7",
        8 SwitchChannel::Eight "Channel 8";
};

/// Name, place and range of each slot; the modes are the same for all.
macro_rules! slots {
    ($($name:literal $place:literal $meaning:literal,)*) => {
        choices! { "Mode switch"; $(
            $name, mode_switch.slots[$place], $meaning:
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
    "COM_FLTMODE1" 0 "Mode of the lowest sixth of the switch's channel, from 1000 us",
    "COM_FLTMODE2" 1 "Mode of the second sixth, from 1167 us",
    "COM_FLTMODE3" 2 "Mode of the third sixth, from 1333 us",
    "COM_FLTMODE4" 3 "Mode of the fourth sixth, from 1500 us",
    "COM_FLTMODE5" 4 "Mode of the fifth sixth, from 1667 us",
    "COM_FLTMODE6" 5 "Mode of the highest sixth, from 1833 us to 2000 us",
};

/// Largest system id, as PX4 has it; above are ground stations.
const SYSTEM_ID_MAX: f64 = 250.0;

/// In the order of their index on the wire.
pub(super) const STATION_ROWS: &[Parameter] = &[Parameter {
    name: "MAV_SYS_ID",
    group: "Ground stations",
    kind: Kind::Int,
    unit: "-",
    min: 1.0,
    max: SYSTEM_ID_MAX,
    meaning: "MAVLink system id of the vehicle",
    choices: &[],
    at_restart: true,
    get: Get::Own(|p| f64::from(p.link.system_id)),
    set: Set::Own(|p, value| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as checked before"
        )]
        let system_id = value as u8;
        p.link.system_id = system_id;
    }),
}];
