//! The rows of the parameter table.

use std::sync::LazyLock;

use super::{
    CompensatorMode, Get, Kind, MainLaw, ObserverMode, Parameter, Parameters, Set, TUNABLES,
};

/// All parameters, in the order of their index on the wire.
#[must_use]
pub fn table() -> &'static [Parameter] {
    static TABLE: LazyLock<Vec<Parameter>> = LazyLock::new(|| {
        let gains = TUNABLES.iter().map(|tunable| Parameter {
            name: tunable.name,
            kind: Kind::Real,
            unit: tunable.unit,
            min: tunable.min,
            max: tunable.max,
            meaning: tunable.meaning,
            get: Get::Gain(tunable.get),
            set: Set::Gain(tunable.set),
        });
        SWITCHES.iter().chain(LIMITS).chain(FAILURE).copied().chain(gains).collect()
    });
    &TABLE
}

const fn int(
    name: &'static str,
    max: f64,
    meaning: &'static str,
    get: fn(&Parameters) -> f64,
    set: fn(&mut Parameters, f64),
) -> Parameter {
    let (get, set) = (Get::Own(get), Set::Own(set));
    Parameter { name, kind: Kind::Int, unit: "-", min: 0.0, max, meaning, get, set }
}

const fn real(
    name: &'static str,
    unit: &'static str,
    (min, max): (f64, f64),
    meaning: &'static str,
    get: fn(&Parameters) -> f64,
    set: fn(&mut Parameters, f64),
) -> Parameter {
    let (get, set) = (Get::Own(get), Set::Own(set));
    Parameter { name, kind: Kind::Real, unit, min, max, meaning, get, set }
}

/// Which laws fly.
const SWITCHES: &[Parameter] = &[
    int(
        "FTC_MODE",
        2.0,
        "Compensator: 0 off, 1 armed, 2 always on",
        |p| match p.gains.selection.compensator {
            CompensatorMode::Off => 0.0,
            CompensatorMode::Armed => 1.0,
            CompensatorMode::AlwaysOn => 2.0,
        },
        |p, v| {
            p.gains.selection.compensator = match v {
                0.0 => CompensatorMode::Off,
                1.0 => CompensatorMode::Armed,
                _ => CompensatorMode::AlwaysOn,
            };
        },
    ),
    int(
        "FTC_OBS",
        1.0,
        "Observer: 0 knows the compensation, 1 literal (as printed, does not)",
        |p| f64::from(u8::from(p.gains.selection.observer == ObserverMode::Literal)),
        |p, v| {
            p.gains.selection.observer =
                if v == 0.0 { ObserverMode::Informed } else { ObserverMode::Literal };
        },
    ),
    int(
        "CTL_LAW",
        1.0,
        "Main controller: 0 PID, 1 PID with the nozzle ganged to it (baseline)",
        |p| f64::from(u8::from(p.gains.selection.main == MainLaw::PidGangedNozzle)),
        |p, v| {
            p.gains.selection.main = if v == 0.0 { MainLaw::Pid } else { MainLaw::PidGangedNozzle };
        },
    ),
];

/// References that are accepted.
const LIMITS: &[Parameter] = &[
    real(
        "REF_ALT_MIN",
        "m",
        (0.0, 20_000.0),
        "Lowest altitude reference",
        |p| p.limits.altitude_min_m,
        |p, v| p.limits.altitude_min_m = v,
    ),
    real(
        "REF_ALT_MAX",
        "m",
        (0.0, 20_000.0),
        "Highest altitude reference",
        |p| p.limits.altitude_max_m,
        |p, v| p.limits.altitude_max_m = v,
    ),
    real(
        "FW_AIRSPD_MIN",
        "m/s",
        (50.0, 500.0),
        "Lowest airspeed reference",
        |p| p.limits.airspeed_min_m_s,
        |p, v| p.limits.airspeed_min_m_s = v,
    ),
    real(
        "FW_AIRSPD_MAX",
        "m/s",
        (50.0, 500.0),
        "Highest airspeed reference",
        |p| p.limits.airspeed_max_m_s,
        |p, v| p.limits.airspeed_max_m_s = v,
    ),
    real(
        "REF_ROLL_MAX",
        "deg",
        (1.0, 80.0),
        "Largest roll reference",
        |p| p.limits.roll_max_deg,
        |p, v| p.limits.roll_max_deg = v,
    ),
];

/// Fault injection.
const FAILURE: &[Parameter] = &[
    int(
        "SYS_FAILURE_EN",
        1.0,
        "Fault injection: 0 refused, 1 allowed",
        |p| f64::from(u8::from(p.failure.enabled)),
        |p, v| p.failure.enabled = v != 0.0,
    ),
    int(
        "FLT_STUCK_MODE",
        1.0,
        "STUCK: 0 where it is, 1 at FLT_STUCK_DEG",
        |p| f64::from(u8::from(p.failure.stuck_at_angle)),
        |p, v| p.failure.stuck_at_angle = v != 0.0,
    ),
    real(
        "FLT_STUCK_DEG",
        "deg",
        (-90.0, 90.0),
        "Angle of STUCK with FLT_STUCK_MODE 1",
        |p| p.failure.stuck_deg,
        |p, v| p.failure.stuck_deg = v,
    ),
    int(
        "FLT_STUCK_RATE",
        1.0,
        "STUCK at an angle: 0 jumps there, 1 travels at the actuator's rate",
        |p| f64::from(u8::from(p.failure.stuck_travels)),
        |p, v| p.failure.stuck_travels = v != 0.0,
    ),
    real(
        "FLT_LOE_PCT",
        "%",
        (0.0, 100.0),
        "Effect that is left after WRONG (loss of effectiveness)",
        |p| p.failure.remaining_pct,
        |p, v| p.failure.remaining_pct = v,
    ),
];
