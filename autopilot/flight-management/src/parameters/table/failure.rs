//! Rows of fault injection.

use super::{Choice, Get, Kind, Parameter, Set};
use crate::parameters::failure::settings;

const GROUP: &str = "Fault injection";

/// In the order of their index on the wire.
pub(super) fn rows() -> Vec<Parameter> {
    [SWITCH, &of_kinds(), NUMBERS, TIMES].concat()
}

const SWITCH: &[Parameter] = choices! { "Fault injection";
    "SYS_FAILURE_EN", failure.enabled, "Fault injection":
        0 false "refused",
        1 true "allowed";
};

/// What the catalogue of faults asks for.
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
