//! A `[[plant.fault]]` table of a scenario file: kind, numbers and times of one fault.
//!
//! Every number has its unit in its key. An effector that turns has keys in degrees, the engine in kilonewton.
//! A key that the kind does not know is refused. Ranges that need no aircraft are checked here, with file and
//! key; whether the aircraft's effector can have the fault is found out by [`crate::Plant::new`].

use icd::fault::{FaultKind, Onset, Quantity, Refusal, Repeat, Side, Timing, Travel};
use icd::{EffectorList, SimTime, fault};
use serde::Deserialize;

use crate::config::{self, ConfigError, RangeError, check_range, section};
use crate::faults::ScheduledFault;

const SECTION: &str = "plant.fault";
const NEWTON_PER_KN: f64 = 1_000.0;
const SECOND_PER_MS: f64 = 1.0e-3;

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum KindKey {
    StuckHere,
    StuckAt,
    HardOver,
    PartialLoss,
    Float,
    Slow,
    Delayed,
    Intermittent,
    Oscillating,
    Drifting,
    Biased,
    LimitedTravel,
    FlameOut,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum TravelKey {
    Jump,
    ActuatorRate,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum SideKey {
    Positive,
    Negative,
}

/// One table as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FaultTable {
    effector: String,
    kind: KindKey,
    angle_deg: Option<f64>,
    travel: Option<TravelKey>,
    side: Option<SideKey>,
    remaining_percent: Option<f64>,
    rate_deg_s: Option<f64>,
    rate_kn_s: Option<f64>,
    delay_ms: Option<f64>,
    period_s: Option<f64>,
    present_percent: Option<f64>,
    amplitude_deg: Option<f64>,
    amplitude_kn: Option<f64>,
    frequency_hz: Option<f64>,
    bias_deg: Option<f64>,
    bias_kn: Option<f64>,
    limit_deg: Option<f64>,
    limit_kn: Option<f64>,
    onset_s: f64,
    clear_s: Option<f64>,
    ramp_s: Option<f64>,
    duration_s: Option<f64>,
    every_s: Option<f64>,
    times: Option<u32>,
}

/// The numbers of a table that have not been read yet, each with its key and the range that every aircraft's
/// must lie in.
struct Numbers<'a> {
    file: &'a str,
    number: usize,
    kind: &'static str,
    left: Vec<Number>,
}

struct Number {
    key: &'static str,
    value: Option<f64>,
    range: [f64; 2],
}

impl FaultTable {
    /// The fault; `file` and `number` (from 1) stand for the table in errors.
    pub(super) fn read(
        &self,
        file: &str,
        number: usize,
        effectors: &EffectorList,
    ) -> Result<ScheduledFault, ConfigError> {
        let effector = effectors.by_key(&self.effector).ok_or_else(|| {
            let known: Vec<&str> =
                effectors.all().map(|effector| effectors.key(effector)).collect();
            let (file, effector) = (file.to_owned(), self.effector.clone());
            ConfigError::FaultEffector { file, number, effector, known: known.join(", ") }
        })?;
        let mut numbers = Numbers { file, number, kind: self.kind.name(), left: self.numbers() };
        let kind = self.kind(&mut numbers, effectors.is_angle(effector))?;
        numbers.nothing_left()?;
        if !matches!(self.kind, KindKey::StuckAt) {
            numbers.absent("travel", self.travel.is_some())?;
        }
        if !matches!(self.kind, KindKey::HardOver) {
            numbers.absent("side", self.side.is_some())?;
        }
        let timing = self.timing(&numbers)?;
        fault::check_timing(&kind, &timing).map_err(|refusal| numbers.timing_error(&refusal))?;
        Ok(ScheduledFault { effector, kind, timing })
    }

    fn numbers(&self) -> Vec<Number> {
        let all = [
            ("angle_deg", self.angle_deg, [-90.0, 90.0]),
            ("remaining_percent", self.remaining_percent, [0.0, 100.0]),
            ("rate_deg_s", self.rate_deg_s, [-1_000.0, 1_000.0]),
            ("rate_kn_s", self.rate_kn_s, [-1_000.0, 1_000.0]),
            ("delay_ms", self.delay_ms, [0.0, FaultKind::DELAY_MAX_S / SECOND_PER_MS]),
            ("period_s", self.period_s, fault::PERIOD_S),
            ("present_percent", self.present_percent, [0.0, 100.0]),
            ("amplitude_deg", self.amplitude_deg, [0.0, 90.0]),
            ("amplitude_kn", self.amplitude_kn, [0.0, 1_000.0]),
            ("frequency_hz", self.frequency_hz, fault::FREQUENCY_HZ),
            ("bias_deg", self.bias_deg, [-90.0, 90.0]),
            ("bias_kn", self.bias_kn, [-1_000.0, 1_000.0]),
            ("limit_deg", self.limit_deg, [0.0, 90.0]),
            ("limit_kn", self.limit_kn, [0.0, 1_000.0]),
        ];
        all.into_iter().map(|(key, value, range)| Number { key, value, range }).collect()
    }

    /// In SI units, from the key of the effector's own unit.
    fn kind(&self, numbers: &mut Numbers<'_>, is_angle: bool) -> Result<FaultKind, ConfigError> {
        let mut own = |deg: &'static str, kn: &'static str| {
            if is_angle {
                numbers.take(deg).map(f64::to_radians)
            } else {
                numbers.take(kn).map(|value| value * NEWTON_PER_KN)
            }
        };
        Ok(match self.kind {
            KindKey::StuckHere => FaultKind::StuckHere,
            KindKey::Float => FaultKind::Float,
            KindKey::FlameOut => FaultKind::FlameOut,
            KindKey::StuckAt => FaultKind::StuckAt {
                angle_rad: numbers.take("angle_deg")?.to_radians(),
                travel: match self.travel {
                    None | Some(TravelKey::Jump) => Travel::Jump,
                    Some(TravelKey::ActuatorRate) => Travel::AtActuatorRate,
                },
            },
            KindKey::HardOver => FaultKind::HardOver {
                side: match self.side {
                    Some(SideKey::Positive) => Side::Positive,
                    Some(SideKey::Negative) => Side::Negative,
                    None => return Err(numbers.error("side", "is missing")),
                },
            },
            KindKey::PartialLoss => {
                FaultKind::PartialLoss { remaining: numbers.take("remaining_percent")? / 100.0 }
            }
            KindKey::Slow => FaultKind::Slow { rate: own("rate_deg_s", "rate_kn_s")? },
            KindKey::Delayed => {
                FaultKind::Delayed { delay_s: numbers.take("delay_ms")? * SECOND_PER_MS }
            }
            KindKey::Intermittent => FaultKind::Intermittent {
                period_s: numbers.take("period_s")?,
                present: numbers.take("present_percent")? / 100.0,
            },
            KindKey::Oscillating => FaultKind::Oscillating {
                amplitude: own("amplitude_deg", "amplitude_kn")?,
                frequency_hz: numbers.take("frequency_hz")?,
            },
            KindKey::Drifting => FaultKind::Drifting { rate: own("rate_deg_s", "rate_kn_s")? },
            KindKey::Biased => FaultKind::Biased { bias: own("bias_deg", "bias_kn")? },
            KindKey::LimitedTravel => {
                FaultKind::LimitedTravel { limit: own("limit_deg", "limit_kn")? }
            }
        })
    }

    fn timing(&self, numbers: &Numbers<'_>) -> Result<Timing, ConfigError> {
        let onset = numbers.time("onset_s", self.onset_s)?;
        let duration_s = match (self.clear_s, self.duration_s) {
            (None, duration_s) => duration_s,
            (Some(_), Some(_)) => return Err(numbers.error("clear_s", "excludes duration_s")),
            (Some(clear_s), None) => {
                let until = numbers.time("clear_s", clear_s)?;
                if until <= onset {
                    let (file, number) = (numbers.file.to_owned(), numbers.number);
                    let onset_s = self.onset_s;
                    return Err(ConfigError::FaultEndsEarly { file, number, onset_s, clear_s });
                }
                Some(SimTime::from_micros(until.micros_since(onset)).as_seconds())
            }
        };
        let repeat = match (self.every_s, self.times) {
            (None, None) => None,
            (None, Some(_)) => return Err(numbers.error("every_s", "is missing")),
            (Some(_), _) if duration_s.is_none() => {
                return Err(numbers.error("duration_s", "is missing"));
            }
            (Some(every_s), times) => Some(Repeat { every_s, times }),
        };
        let ramp_s = self.ramp_s.unwrap_or(0.0);
        Ok(Timing { onset: Onset::At(onset), ramp_s, duration_s, repeat })
    }
}

impl KindKey {
    const fn name(self) -> &'static str {
        match self {
            Self::StuckHere => "stuck_here",
            Self::StuckAt => "stuck_at",
            Self::HardOver => "hard_over",
            Self::PartialLoss => "partial_loss",
            Self::Float => "float",
            Self::Slow => "slow",
            Self::Delayed => "delayed",
            Self::Intermittent => "intermittent",
            Self::Oscillating => "oscillating",
            Self::Drifting => "drifting",
            Self::Biased => "biased",
            Self::LimitedTravel => "limited_travel",
            Self::FlameOut => "flame_out",
        }
    }
}

impl Numbers<'_> {
    fn error(&self, key: &'static str, problem: &'static str) -> ConfigError {
        let Self { file, number, kind, .. } = *self;
        ConfigError::FaultKey { file: file.to_owned(), number, kind, key, problem }
    }

    fn absent(&self, key: &'static str, is_there: bool) -> Result<(), ConfigError> {
        if is_there { Err(self.error(key, "has no meaning here")) } else { Ok(()) }
    }

    /// A number that the kind needs.
    fn take(&mut self, key: &'static str) -> Result<f64, ConfigError> {
        let number = self.left.iter_mut().find(|number| number.key == key);
        let range = number.as_ref().map_or([0.0; 2], |number| number.range);
        let value = number.and_then(|number| number.value.take());
        let value = value.ok_or_else(|| self.error(key, "is missing"))?;
        check_range(SECTION, key, value, range[0], range[1]).map_err(config::in_file(self.file))?;
        Ok(value)
    }

    /// No number is there that the kind does not know.
    fn nothing_left(&self) -> Result<(), ConfigError> {
        let mut left = self.left.iter().filter(|number| number.value.is_some());
        left.next().map_or(Ok(()), |number| self.absent(number.key, true))
    }

    fn time(&self, key: &'static str, seconds: f64) -> Result<SimTime, ConfigError> {
        let max = SimTime::MAX_SECONDS;
        let refused = RangeError {
            section: section(SECTION),
            key: section(key),
            value: seconds,
            min: 0.0,
            max,
        };
        SimTime::from_seconds(seconds).ok_or_else(|| config::in_file(self.file)(refused))
    }

    fn timing_error(&self, refusal: &Refusal) -> ConfigError {
        let Refusal::OutOfRange { what, value, min, max } = *refusal else {
            return self.error("onset_s", "cannot be");
        };
        let key = match what {
            Quantity::Ramp => "ramp_s",
            Quantity::Every => "every_s",
            Quantity::Times => "times",
            _ => "duration_s",
        };
        config::in_file(self.file)(RangeError {
            section: section(SECTION),
            key: section(key),
            value,
            min,
            max,
        })
    }
}
