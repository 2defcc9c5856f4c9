//! `fail` and `clear`: effectors, kinds of faults and their timing in words.

use core::f64::consts::PI;

use icd::fault::{FaultKind, Onset, Repeat, Side, Timing, Travel};
use icd::{Effector, EffectorList, FaultRequest, SimTime};

use super::cursor::Cursor;
use super::error::{Problem, ScriptError};
use super::parser::{DEGREES, SECONDS};

const KINDS: &str = "a kind of fault: stuck, stuck at, hard over, a number % left, floating, slow, delayed, \
                     intermittent, oscillating, drifting, biased, limited to, flame-out";
const DEG: f64 = PI / 180.0;
const DEGREES_PER_SECOND: [(&str, f64); 1] = [("deg/s", DEG)];
const KILONEWTONS: [(&str, f64); 1] = [("kn", 1.0e3)];
const KILONEWTONS_PER_SECOND: [(&str, f64); 1] = [("kn/s", 1.0e3)];
const HERTZ: [(&str, f64); 1] = [("hz", 1.0)];
/// How often a fault can come again.
const TIMES_MAX: u32 = 1_000_000;

/// What follows `fail`.
pub(super) fn fail(
    cursor: &mut Cursor,
    effectors: &EffectorList,
) -> Result<FaultRequest, ScriptError> {
    let effector = effector(cursor, effectors, &names(effectors))?;
    let kind = kind(cursor, effectors.is_angle(effector))?;
    let timing = timing(cursor)?;
    Ok(FaultRequest::Inject { effector, kind, timing })
}

/// What follows `clear`.
pub(super) fn clear(
    cursor: &mut Cursor,
    effectors: &EffectorList,
) -> Result<FaultRequest, ScriptError> {
    if cursor.take("all") {
        return Ok(FaultRequest::ClearAll);
    }
    let wanted = format!("`all` or {}", names(effectors));
    Ok(FaultRequest::Clear { effector: effector(cursor, effectors, &wanted)? })
}

/// Words of ground stations for servos and motors.
const UNITS: [(&str, bool); 2] = [("servo", true), ("motor", false)];

/// The effectors in messages.
fn names(effectors: &EffectorList) -> String {
    let mut names: Vec<String> =
        effectors.all().map(|effector| effectors.name(effector).to_owned()).collect();
    for (unit, is_angle) in UNITS {
        match effectors.by_unit(is_angle).last().map(|last| effectors.instance(*last)) {
            Some(1) => names.push(format!("{unit} 1")),
            Some(last) => names.push(format!("{unit} 1 to {last}")),
            None => {}
        }
    }
    format!("an effector: {}", names.join(", "))
}

/// An effector by its name for people, for files, or for ground stations. The longest name that fits counts.
fn effector(
    cursor: &mut Cursor,
    effectors: &EffectorList,
    wanted: &str,
) -> Result<Effector, ScriptError> {
    let mut all: Vec<Effector> = effectors.all().collect();
    all.sort_by_key(|effector| core::cmp::Reverse(effectors.name(*effector).len()));
    let named = |cursor: &mut Cursor, effector: &Effector| {
        cursor.take(effectors.name(*effector)) || cursor.take(effectors.key(*effector))
    };
    if let Some(effector) = all.iter().find(|effector| named(cursor, effector)) {
        return Ok(*effector);
    }
    for (unit, is_angle) in UNITS {
        let members = effectors.by_unit(is_angle);
        let in_one_word = |cursor: &mut Cursor, effector: &Effector| {
            cursor.take(&format!("{unit}{}", effectors.instance(*effector)))
        };
        if let Some(effector) = members.iter().find(|effector| in_one_word(cursor, effector)) {
            return Ok(*effector);
        }
        let Some(last) = members.last() else { continue };
        let before = cursor.clone();
        if cursor.take(unit) {
            let instance = cursor.whole(unit, effectors.instance(*last).into())?;
            let mut members = members.iter();
            let found =
                members.find(|effector| u32::from(effectors.instance(**effector)) == instance);
            return found.copied().ok_or_else(|| before.wanted(wanted));
        }
    }
    Err(cursor.wanted(wanted))
}

fn kind(cursor: &mut Cursor, is_angle: bool) -> Result<FaultKind, ScriptError> {
    let only_angles = |cursor: &Cursor, why| {
        let problem = Problem::NotForThisEffector(why);
        if is_angle { Ok(()) } else { Err(cursor.problem(problem)) }
    };
    if cursor.take("stuck at") {
        only_angles(cursor, "the engine cannot be stuck at an angle, only `stuck`")?;
        let angle_rad = cursor.amount("the angle", &DEGREES)?.within(ANGLE, ("deg", DEG))?;
        let slowly = ["at the actuator's rate", "at actuator rate", "at the actuator rate"];
        let slowly = slowly.iter().any(|words| cursor.take(words));
        let travel = if slowly { Travel::AtActuatorRate } else { Travel::Jump };
        return Ok(FaultKind::StuckAt { angle_rad, travel });
    }
    if cursor.take("stuck") {
        return Ok(FaultKind::StuckHere);
    }
    if cursor.take("hard over") {
        only_angles(cursor, "the engine has no end of travel to run to")?;
        let sides = [("positive", Side::Positive), ("negative", Side::Negative)];
        let side = cursor.need_one("the end, by the sign of the deflection", &sides)?;
        return Ok(FaultKind::HardOver { side });
    }
    if cursor.take("floating") || cursor.take("float") {
        only_angles(cursor, "the engine cannot float")?;
        return Ok(FaultKind::Float);
    }
    if cursor.take("flame-out") || cursor.take("flame out") {
        return if is_angle {
            Err(cursor.problem(Problem::NotForThisEffector("only the engine can flame out")))
        } else {
            Ok(FaultKind::FlameOut)
        };
    }
    if cursor.take("slow") {
        return Ok(FaultKind::Slow { rate: rate(cursor, is_angle, Sign::Positive)? });
    }
    if cursor.take("delayed") {
        cursor.take("by");
        let delay = cursor.amount("the delay", &SECONDS)?;
        let delay_s = delay.within((0.0, FaultKind::DELAY_MAX_S), ("s", 1.0))?;
        return Ok(FaultKind::Delayed { delay_s });
    }
    if cursor.take("intermittent") {
        let present = percent(cursor, "the part of a period in which commands get through")?;
        cursor.need("of")?;
        let period_s = duration(cursor, "the period")?;
        return Ok(FaultKind::Intermittent { period_s, present });
    }
    if cursor.take("oscillating") {
        let amplitude = deviation(cursor, "the amplitude", is_angle, Sign::Positive)?;
        cursor.need("at")?;
        let frequency = cursor.amount("the frequency", &HERTZ)?;
        let range = (f64::MIN_POSITIVE, FaultKind::FREQUENCY_MAX_HZ);
        let frequency_hz = frequency.within(range, ("Hz", 1.0))?;
        return Ok(FaultKind::Oscillating { amplitude, frequency_hz });
    }
    if cursor.take("drifting") {
        return Ok(FaultKind::Drifting { rate: rate(cursor, is_angle, Sign::Any)? });
    }
    if cursor.take("biased") {
        cursor.take("by");
        return Ok(FaultKind::Biased { bias: deviation(cursor, "the bias", is_angle, Sign::Any)? });
    }
    if cursor.take("limited to") {
        let limit = deviation(cursor, "the limit", is_angle, Sign::Positive)?;
        return Ok(FaultKind::LimitedTravel { limit });
    }
    if cursor.is_number() {
        let remaining = percent(cursor, "the effect left")?;
        cursor.need("left")?;
        return Ok(FaultKind::PartialLoss { remaining });
    }
    Err(cursor.wanted(KINDS))
}

/// Angles that an effector might have, rad; the plant knows each one's travel.
const ANGLE: (f64, f64) = (-PI, PI);
/// Largest thrust that is looked at, N.
const THRUST_MAX_N: f64 = 1.0e6;

/// Which signs a value may have.
#[derive(Clone, Copy, PartialEq)]
enum Sign {
    Any,
    Positive,
}

impl Sign {
    fn range(self, max: f64) -> (f64, f64) {
        match self {
            Self::Any => (-max, max),
            Self::Positive => (0.0, max),
        }
    }
}

/// An angle, or of the engine a thrust.
fn deviation(
    cursor: &mut Cursor,
    what: &'static str,
    is_angle: bool,
    sign: Sign,
) -> Result<f64, ScriptError> {
    if is_angle {
        cursor.amount(what, &DEGREES)?.within(sign.range(PI), ("deg", DEG))
    } else {
        cursor.amount(what, &KILONEWTONS)?.within(sign.range(THRUST_MAX_N), ("kN", 1.0e3))
    }
}

fn rate(cursor: &mut Cursor, is_angle: bool, sign: Sign) -> Result<f64, ScriptError> {
    if is_angle {
        let range = sign.range(100.0 * PI);
        cursor.amount("the rate", &DEGREES_PER_SECOND)?.within(range, ("deg/s", DEG))
    } else {
        let range = sign.range(THRUST_MAX_N);
        cursor.amount("the rate", &KILONEWTONS_PER_SECOND)?.within(range, ("kN/s", 1.0e3))
    }
}

/// A percentage as a fraction.
fn percent(cursor: &mut Cursor, what: &'static str) -> Result<f64, ScriptError> {
    let percent = cursor.amount(what, &[("%", 1.0)])?;
    Ok(percent.within((0.0, 100.0), ("%", 1.0))? / 100.0)
}

/// A time longer than nothing, s.
fn duration(cursor: &mut Cursor, what: &'static str) -> Result<f64, ScriptError> {
    let duration = cursor.amount(what, &SECONDS)?;
    duration.within((1.0e-6, SimTime::MAX_SECONDS), ("s", 1.0))
}

/// `, ramp 1 s, for 5 s, every 10 s, 3 times`, in this order, each part once or not at all.
fn timing(cursor: &mut Cursor) -> Result<Timing, ScriptError> {
    let mut timing = Timing::from_onset(Onset::AtOnce);
    if cursor.take(", ramp") {
        timing.ramp_s = duration(cursor, "the ramp")?;
    }
    if cursor.take(", for") {
        timing.duration_s = Some(duration(cursor, "the duration")?);
    }
    if cursor.take(", every") {
        let problem = cursor.problem(Problem::EveryWithoutFor);
        let every_s = duration(cursor, "the repetition")?;
        if timing.duration_s.is_none_or(|duration_s| duration_s >= every_s) {
            return Err(problem);
        }
        let times = if cursor.take(",") {
            let times = cursor.whole_from(2, "how often", TIMES_MAX)?;
            cursor.need("times")?;
            Some(times)
        } else {
            None
        };
        timing.repeat = Some(Repeat { every_s, times });
    }
    if cursor.is_at_end() {
        Ok(timing)
    } else {
        Err(cursor.wanted("the end of the line, or `, ramp`, `, for`, `, every` in this order"))
    }
}
