//! The catalogue of faults: one entry for each kind. No other code depends on single kinds, except for their effect in
//! `plant-sim/dynamics/src/faults/active.rs`.
//!
//! Keys of scenario files, phrases of scripts, names in the shell, types, values and parameters of MAVLink, texts, codes in packets
//! and logs, ranges and the tables of the documents are derived from the entries. A new kind goes to the end of
//! the list, with the next free code; codes, modes and numbers of values are never used twice. A kind with two
//! alternatives has two codes and two modes in a row.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::kind::FailureType as T;
use super::kind::Piece::{Choice as C, Number as N, Optional, Words as W};
use super::kind::{
    Alternative, Choice, ChoiceParameter, KindInfo, Mavlink, NUMBERS_MAX, NumberInfo,
    NumberParameter, Part, Parts, SIZE_OPTION, Targets, choices, kinds,
};
use super::quantity::{Quantity as Q, Range, Tidy};
use super::target::TargetClass;

/// How a stuck effector reaches its angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Travel {
    /// At once, as in the paper's u_f.
    Jump,
    /// At the actuator's rate limit.
    AtActuatorRate,
}

/// An end of an effector's travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// That of positive deflections.
    Positive,
    /// That of negative deflections.
    Negative,
}

choices! { Travel: Jump, AtActuatorRate; Side: Positive, Negative; }

kinds! {
    /// Stuck at its position at the onset: a jam.
    StuckHere => KindInfo {
        code: 1,
        key: "stuck_here",
        targets: Targets::EVERY,
        phrase: &[W(&["stuck"])],
        numbers: &[],
        choice: None,
        servo: "stands still here",
        acts: "its position",
        ramp: "",
        mavlink: Mavlink { mode: &["where it is"], ..Mavlink::new(T::Stuck) },
    };

    /// Stuck at an angle: a jam, as in the paper's two cases.
    StuckAt {
        /// The angle, rad, inside the effector's travel.
        angle_rad: f64,
        /// How it gets there.
        travel: Travel,
    } => KindInfo {
        code: 2,
        key: "stuck_at",
        targets: Targets::ANGLES,
        phrase: &[W(&["stuck at"]), N(Q::Angle), C],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Angle, Range::Travel, Some(1), NumberParameter {
            name: "FLT_STUCK_DEG", min: -90.0, max: 90.0, default: 0.0,
            meaning: "Angle of STUCK with FLT_STUCK_MODE 1; the engine sticks where it is",
        })],
        choice: Some(Choice {
            key: "travel",
            title: "how it comes to its angle",
            alternatives: &[
                Alternative { key: "jump", words: &[], value: None, label: "jumps there" },
                Alternative {
                    key: "actuator_rate",
                    words: &["at the actuator's rate", "at actuator rate", "at the actuator rate"],
                    value: None,
                    label: "travels at the actuator's rate",
                },
            ],
            default: Some(0),
            parameter: Some(ChoiceParameter {
                name: "FLT_STUCK_RATE", meaning: "How STUCK comes to an angle",
            }),
        }),
        servo: "is at the angle at once, or runs there at its rate limit; stays",
        acts: "its position",
        ramp: "goes there evenly in that time, with the actuator's rate no faster than it",
        mavlink: Mavlink { first_mode: 1, mode: &["at FLT_STUCK_DEG"], user_1: Some(1), ..Mavlink::new(T::Stuck) },
    };

    /// Runs to one end of its travel at the actuator's rate limit and stays there, whatever the command: a runaway.
    HardOver {
        /// The end. It is that of the deflection's sign and never that of the command.
        side: Side,
    } => KindInfo {
        code: 4,
        key: "hard_over",
        targets: Targets::ANGLES,
        phrase: &[W(&["hard over"]), C],
        numbers: &[],
        choice: Some(Choice {
            key: "side",
            title: "the end, by the sign of the deflection",
            alternatives: &[
                Alternative {
                    key: "positive", words: &["positive"], value: Some(("+", 1.0)),
                    label: "to positive deflections",
                },
                Alternative {
                    key: "negative", words: &["negative"], value: Some(("-", -1.0)),
                    label: "to negative deflections",
                },
            ],
            default: None,
            parameter: None,
        }),
        servo: "runs to that end of its travel at its rate limit, whatever is commanded; stays",
        acts: "its position",
        ramp: "",
        mavlink: Mavlink {
            first_mode: 2,
            mode: &[
                "hard over to positive deflections (not of the engine)",
                "hard over to negative deflections (not of the engine)",
            ],
            word: Some("hardover"),
            user_1: Some(10),
            ..Mavlink::new(T::Wrong)
        },
    };

    /// Partial loss of effectiveness: the effector keeps this fraction of its effect (the paper's x in `(x - 1) u`).
    PartialLoss {
        /// Fraction remaining, 0 to 1.
        remaining: f64,
    } => KindInfo {
        code: 6,
        key: "partial_loss",
        targets: Targets::EFFECTORS,
        phrase: &[N(Q::Remaining), W(&["left"])],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Remaining, Range::Fixed([0.0, 1.0]), Some(0), NumberParameter {
            name: "FLT_LOE_PCT", min: 0.0, max: 100.0, default: 50.0,
            meaning: "Effect that is left after a loss of effectiveness",
        })],
        choice: None,
        servo: "follows the commands",
        acts: "that part of its position; of the engine that part of its thrust",
        ramp: "the part sinks from 100 %",
        mavlink: Mavlink {
            mode: &["loss of effectiveness, FLT_LOE_PCT"],
            word: Some("loss"),
            user_1: Some(2),
            ..Mavlink::new(T::Wrong)
        },
    };

    /// Disconnected linkage: floats to zero deflection, where it has no moment.
    Float => KindInfo {
        code: 7,
        key: "float",
        targets: Targets::ANGLES,
        phrase: &[W(&["floating", "float"])],
        numbers: &[],
        choice: None,
        servo: "is at zero at once; stays",
        acts: "nothing",
        ramp: "goes to zero evenly in that time",
        mavlink: Mavlink { word: Some("float"), ..Mavlink::new(T::Off) },
    };

    /// Moves no faster than this: loss of hydraulic pressure.
    Slow {
        /// Largest speed either way, rad/s or N/s, more than 0.
        rate: f64,
    } => KindInfo {
        code: 8,
        key: "slow",
        targets: Targets::EFFECTORS,
        phrase: &[W(&["slow"]), N(Q::Rate)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Rate, Range::Speed, Some(1), NumberParameter {
            name: "FLT_RATE_DPS", min: 0.01, max: 1_000.0, default: 10.0,
            meaning: "Largest speed of SLOW; of the engine FLT_ENG_PCT",
        })],
        choice: None,
        servo: "follows the commands no faster than this",
        acts: "its position",
        ramp: "the rate sinks from the fastest",
        mavlink: Mavlink { user_1: Some(4), ..Mavlink::new(T::Slow) },
    };

    /// Follows its command of this time ago. No command acts twice: at the onset the effector waits at its position.
    Delayed {
        /// Delay, s, 0 to [`FaultKind::DELAY_MAX_S`].
        delay_s: f64,
    } => KindInfo {
        code: 9,
        key: "delayed",
        targets: Targets::EVERY,
        phrase: &[W(&["delayed"]), Optional("by"), N(Q::Delay)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Delay, Range::Fixed([0.0, FaultKind::DELAY_MAX_S]), Some(0), NumberParameter {
            name: "FLT_DELAY_MS", min: 0.0, max: 1_000.0, default: 200.0,
            meaning: "Delay of DELAYED",
        })],
        choice: None,
        servo: "follows the commands of so long ago; until the first is due, the last one from before the onset",
        acts: "its position",
        ramp: "the delay grows from 0",
        mavlink: Mavlink { user_1: Some(5), ..Mavlink::new(T::Delayed) },
    };

    /// Receives commands during a part of each period only, and stands still otherwise: a loose contact.
    Intermittent {
        /// Length of a period, s. A period begins with the gap.
        period_s: f64,
        /// Fraction of the period with commands, 0 to 1.
        present: f64,
    } => KindInfo {
        code: 10,
        key: "intermittent",
        targets: Targets::EVERY,
        phrase: &[W(&["intermittent"]), N(Q::Present), W(&["of"]), N(Q::Period)],
        numbers: &[
            NumberInfo::new("-p", Q::Period, Range::Fixed([0.02, 60.0]), None, NumberParameter {
                name: "FLT_PERIOD_S", min: 0.02, max: 60.0, default: 1.0,
                meaning: "Period of INTERMITTENT",
            }),
            NumberInfo::new(SIZE_OPTION, Q::Present, Range::Fixed([0.0, 1.0]), Some(0), NumberParameter {
                name: "FLT_DUTY_PCT", min: 0.0, max: 100.0, default: 50.0,
                meaning: "Part of each period of INTERMITTENT in which commands get through",
            }),
        ],
        choice: None,
        servo: "stands still in the gap at the begin of each period, else follows the commands",
        acts: "its position",
        ramp: "the gap of a period grows from 0",
        mavlink: Mavlink { user_1: Some(7), ..Mavlink::new(T::Intermittent) },
    };

    /// Oscillates about its proper position: oscillatory failure, "liquid" form.
    Oscillating {
        /// Largest deviation, rad or N.
        amplitude: f64,
        /// Frequency, Hz.
        frequency_hz: f64,
    } => KindInfo {
        code: 11,
        key: "oscillating",
        targets: Targets::EFFECTORS,
        phrase: &[W(&["oscillating"]), N(Q::Amplitude), W(&["at"]), N(Q::Frequency)],
        numbers: &[
            NumberInfo::new(SIZE_OPTION, Q::Amplitude, Range::HalfTravel, Some(1), NumberParameter {
                name: "FLT_OSC_DEG", min: 0.01, max: 90.0, default: 5.0,
                meaning: "Amplitude of GARBAGE; of the engine FLT_ENG_PCT",
            }),
            NumberInfo::new("-f", Q::Frequency, Range::Fixed([0.001, 20.0]), None, NumberParameter {
                name: "FLT_OSC_HZ", min: 0.01, max: 20.0, default: 2.0,
                meaning: "Frequency of GARBAGE",
            }),
        ],
        choice: None,
        servo: "follows the commands",
        acts: "its position plus a sine that begins at zero, inside the travel",
        ramp: "the amplitude grows from 0",
        mavlink: Mavlink { word: Some("oscillate"), user_1: Some(6), ..Mavlink::new(T::Garbage) },
    };

    /// Its deviation grows until the end of the travel: drift of the servo's sensor.
    Drifting {
        /// Speed and direction, rad/s or N/s.
        rate: f64,
    } => KindInfo {
        code: 12,
        key: "drifting",
        targets: Targets::EVERY,
        phrase: &[W(&["drifting"]), N(Q::Rate)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Rate, Range::SpeedEitherWay, Some(2), NumberParameter {
            name: "FLT_DRIFT_DPS", min: -100.0, max: 100.0, default: 1.0,
            meaning: "Speed and direction of DRIFT; of the engine FLT_ENG_PCT",
        })],
        choice: None,
        servo: "follows the commands",
        acts: "its position plus speed times time, inside the travel",
        ramp: "the speed grows from 0",
        mavlink: Mavlink { user_1: Some(8), ..Mavlink::new(T::Drift) },
    };

    /// Constant deviation: offset of the servo's sensor.
    Biased {
        /// Deviation, rad or N.
        bias: f64,
    } => KindInfo {
        code: 13,
        key: "biased",
        targets: Targets::EVERY,
        phrase: &[W(&["biased"]), Optional("by"), N(Q::Bias)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Bias, Range::HalfTravelEitherWay, Some(1), NumberParameter {
            name: "FLT_BIAS_DEG", min: -90.0, max: 90.0, default: 5.0,
            meaning: "Bias of WRONG with FLT_WRONG_MODE 1; of the engine FLT_ENG_PCT",
        })],
        choice: None,
        servo: "follows the commands",
        acts: "its position plus the bias, inside the travel",
        ramp: "the bias grows from 0",
        mavlink: Mavlink {
            first_mode: 1, mode: &["bias, FLT_BIAS_DEG"], word: Some("bias"), user_1: Some(3),
            ..Mavlink::new(T::Wrong)
        },
    };

    /// Moves only this far; an effector beyond it at the onset is pushed back: an obstacle.
    LimitedTravel {
        /// Largest deflection either way, rad; of the engine the largest thrust, N.
        limit: f64,
    } => KindInfo {
        code: 14,
        key: "limited_travel",
        targets: Targets::EFFECTORS,
        phrase: &[W(&["limited to"]), N(Q::Limit)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Limit, Range::UpToTravel, Some(1), NumberParameter {
            name: "FLT_LIMIT_DEG", min: 0.0, max: 90.0, default: 5.0,
            meaning: "Largest deflection of WRONG with FLT_WRONG_MODE 4; of the engine FLT_ENG_PCT",
        })],
        choice: None,
        servo: "follows the commands up to the limit; pushed back to it at once",
        acts: "its position",
        ramp: "the limit comes in from the end of the travel",
        mavlink: Mavlink {
            first_mode: 4, mode: &["limited travel, FLT_LIMIT_DEG"], word: Some("limit"), user_1: Some(9),
            ..Mavlink::new(T::Wrong)
        },
    };

    /// The engine is out: thrust runs down to zero, below its idle.
    FlameOut => KindInfo {
        code: 15,
        key: "flame_out",
        targets: Targets::THRUST,
        phrase: &[W(&["flame-out", "flame out"])],
        numbers: &[],
        choice: None,
        servo: "runs down to zero with its lag, below its idle",
        acts: "its thrust",
        ramp: "",
        mavlink: Mavlink { word: Some("flameout"), ..Mavlink::new(T::Off) },
    };

    /// A sensor gives no valid sample any more; its last value stands in.
    Off => KindInfo {
        code: 16,
        key: "off",
        targets: Targets::SENSORS,
        phrase: &[W(&["off"])],
        numbers: &[],
        choice: None,
        servo: "(only of sensors)",
        acts: "its last sample, declared invalid",
        ramp: "",
        mavlink: Mavlink::new(T::Off),
    };

    /// White noise on each sample of a sensor, besides its own.
    Noisy {
        /// Its root mean square, in the SI unit of the sensor.
        rms: f64,
    } => KindInfo {
        code: 17,
        key: "noisy",
        targets: Targets::SENSORS,
        phrase: &[W(&["noisy"]), Optional("by"), N(Q::Noise)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Noise, Range::HalfTravel, None, NumberParameter {
            name: "FLT_SENSOR", min: -100_000.0, max: 100_000.0, default: 1.0,
            meaning: "Bias of WRONG, speed of DRIFT, noise of GARBAGE of a sensor, in the unit of its output: deg/s, m/s2, deg, m, Pa, kN, nT",
        })],
        choice: None,
        servo: "(only of sensors)",
        acts: "its sample plus white noise on each axis",
        ramp: "the noise grows from 0",
        mavlink: Mavlink { word: Some("noise"), user_1: Some(11), ..Mavlink::new(T::Garbage) },
    };

    /// Damage: the outer end of a part of the airframe is torn off, with its forces, its mass and what it has of a surface.
    TornOff {
        /// Fraction of the part's span that is gone, from its tip, 0 to 1.
        lost: f64,
    } => KindInfo {
        code: 18,
        key: "torn_off",
        targets: Targets::PARTS,
        phrase: &[W(&["torn off"]), Optional("by"), N(Q::Lost)],
        numbers: &[NumberInfo::new(SIZE_OPTION, Q::Lost, Range::Fixed([0.0, 1.0]), Some(0), NumberParameter {
            name: "FLT_TORN_PCT", min: 0.0, max: 100.0, default: 30.0,
            meaning: "Part of the span of a wing, tail or fin that is torn off, from its tip",
        })],
        choice: None,
        servo: "(only of parts of the airframe)",
        acts: "what is left of the part",
        ramp: "the lost end grows from 0",
        mavlink: Mavlink { word: Some("torn"), user_1: Some(12), ..Mavlink::new(T::Off) },
    };
}

impl FaultKind {
    /// Longest delay, s.
    pub const DELAY_MAX_S: f64 = 1.0;

    /// Number in packets and logs, from 1; 0 stands for no fault.
    pub fn code(&self) -> u8 {
        self.info().code + self.parts().choice
    }

    /// The numbers of the kind in the order of its fields; 0 for those it does not have.
    pub fn values(&self) -> [f64; NUMBERS_MAX] {
        self.parts().values
    }

    /// The kind with this number and these values; `None` if there is none.
    pub fn from_code(code: u8, values: [f64; NUMBERS_MAX]) -> Option<Self> {
        let is_it = |info: &KindInfo| (info.code..info.code + info.alternatives()).contains(&code);
        let place = CATALOGUE.iter().position(is_it)?;
        let choice = code - CATALOGUE[place].code;
        Self::from_parts(place, Parts { choice, values, next: 0 })
    }

    /// Whether it has a size, which a ramp can increase from nothing.
    pub fn has_size(&self) -> bool {
        self.info().has_size()
    }

    /// As a phrase of the script language, with the units of the target's class.
    pub const fn described(&self, class: TargetClass) -> Described<Self> {
        Described { what: *self, class }
    }
}

impl KindInfo {
    /// The kind with this alternative (from 0) and these numbers, SI units; `None` without such an alternative.
    pub fn with(&self, alternative: u8, values: [f64; NUMBERS_MAX]) -> Option<FaultKind> {
        let code = self.code.checked_add(alternative)?;
        // Beyond its own alternatives the number belongs to the next kind.
        FaultKind::from_code(code, values).filter(|kind| kind.info().code == self.code)
    }

    /// The entry with this name in scenario files.
    pub fn by_key(key: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|info| info.key == key)
    }
}

/// Something about a fault as text, with the units of its target's class.
#[derive(Debug, Clone, Copy)]
pub struct Described<T> {
    pub(super) what: T,
    pub(super) class: TargetClass,
}

impl fmt::Display for Described<FaultKind> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (info, Parts { choice, values, .. }) = (self.what.info(), self.what.parts());
        let mut before = "";
        for piece in info.phrase.iter().copied() {
            let words = match piece {
                W(words) => words.first().copied(),
                Optional(word) => Some(word),
                C => info
                    .choice
                    .and_then(|all| all.alternatives.get(usize::from(choice)))
                    .and_then(|one| one.words.first().copied()),
                N(quantity) => {
                    let mut numbers = info.numbers.iter().zip(values);
                    if let Some((number, si)) = numbers.find(|(n, _)| n.quantity == quantity) {
                        let unit = quantity.measure().shown_unit(self.class, si.abs());
                        let value = unit.from_si(si);
                        match number.decimals.map(usize::from) {
                            Some(decimals) => write!(f, "{before}{value:.decimals$} {}", unit.name),
                            None => write!(f, "{before}{} {}", Tidy(value), unit.name),
                        }?;
                        before = " ";
                    }
                    None
                }
            };
            if let Some(words) = words {
                write!(f, "{before}{words}")?;
                before = " ";
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
