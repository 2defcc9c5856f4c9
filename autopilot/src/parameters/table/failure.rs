//! Rows of fault injection.

use super::{Choice, Get, Kind, Parameter, Set};
use crate::parameters::WrongMode;

/// In the order of their index on the wire.
pub(super) const ROWS: [&[Parameter]; 3] = [CHOICES, NUMBERS, TIMES];

const CHOICES: &[Parameter] = choices! { "Fault injection";
    "SYS_FAILURE_EN", failure.enabled, "Fault injection":
        0 false "refused",
        1 true "allowed";
    "FLT_STUCK_MODE", failure.stuck_at_angle, "Where STUCK holds an effector":
        0 false "where it is",
        1 true "at FLT_STUCK_DEG";
    "FLT_STUCK_RATE", failure.stuck_travels, "How STUCK comes to an angle":
        0 false "jumps there",
        1 true "travels at the actuator's rate";
    "FLT_WRONG_MODE", failure.wrong, "What WRONG means":
        0 WrongMode::Loss "loss of effectiveness, FLT_LOE_PCT",
        1 WrongMode::Bias "bias, FLT_BIAS_DEG",
        2 WrongMode::HardOverPositive "hard over to positive deflections (not of the engine)",
        3 WrongMode::HardOverNegative "hard over to negative deflections (not of the engine)",
        4 WrongMode::Limit "limited travel, FLT_LIMIT_DEG";
};

const NUMBERS: &[Parameter] = numbers! { Real, "Fault injection";
    "FLT_STUCK_DEG", "deg", -90.0 to 90.0, failure.stuck_deg,
        "Angle of STUCK with FLT_STUCK_MODE 1; the engine sticks where it is";
    "FLT_LOE_PCT", "%", 0.0 to 100.0, failure.remaining_pct,
        "Effect that is left after a loss of effectiveness";
    "FLT_BIAS_DEG", "deg", -90.0 to 90.0, failure.bias_deg,
        "Bias of WRONG with FLT_WRONG_MODE 1; of the engine FLT_ENG_PCT";
    "FLT_LIMIT_DEG", "deg", 0.0 to 90.0, failure.limit_deg,
        "Largest deflection of WRONG with FLT_WRONG_MODE 4; of the engine FLT_ENG_PCT";
    "FLT_RATE_DPS", "deg/s", 0.01 to 1_000.0, failure.rate_dps,
        "Largest speed of SLOW; of the engine FLT_ENG_PCT";
    "FLT_DELAY_MS", "ms", 0.0 to 1_000.0, failure.delay_ms,
        "Delay of DELAYED";
    "FLT_DUTY_PCT", "%", 0.0 to 100.0, failure.present_pct,
        "Part of each period of INTERMITTENT in which commands get through";
    "FLT_PERIOD_S", "s", 0.02 to 60.0, failure.period_s,
        "Period of INTERMITTENT";
    "FLT_OSC_DEG", "deg", 0.01 to 90.0, failure.oscillation_deg,
        "Amplitude of GARBAGE; of the engine FLT_ENG_PCT";
    "FLT_OSC_HZ", "Hz", 0.01 to 20.0, failure.oscillation_hz,
        "Frequency of GARBAGE";
    "FLT_DRIFT_DPS", "deg/s", -100.0 to 100.0, failure.drift_dps,
        "Speed and direction of DRIFT; of the engine FLT_ENG_PCT";
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
    group: "Fault injection",
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
