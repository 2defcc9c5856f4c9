use super::*;
use crate::fault::{CATALOGUE, SensorKind, TargetClass};
use std::collections::BTreeSet;
use std::string::ToString;
use std::vec::Vec;

/// Each alternative of each kind, with numbers.
fn all() -> impl Iterator<Item = FaultKind> {
    (0..=u8::MAX).filter_map(|code| FaultKind::from_code(code, [0.25, 0.5]))
}

#[test]
fn every_code_comes_back_with_its_values() {
    let codes: Vec<u8> = all().map(|kind| kind.code()).collect();
    let last = codes.last().copied().unwrap_or(0);
    assert!(codes.iter().copied().eq(1..=last), "codes follow each other: {codes:?}");
    assert_eq!(last, CATALOGUE.iter().map(KindInfo::alternatives).sum());
    for kind in all() {
        assert_eq!(FaultKind::from_code(kind.code(), kind.values()), Some(kind));
    }
}

#[test]
fn an_entry_fits_the_fields_of_its_kind() {
    for kind in all() {
        let info = kind.info();
        let given = kind.values().into_iter().filter(|value| *value != 0.0).count();
        assert_eq!(given, info.numbers.len(), "{}: numbers and fields", info.key);
        let named: Vec<_> = info
            .phrase
            .iter()
            .filter_map(|piece| match piece {
                N(quantity) => Some(*quantity),
                _ => None,
            })
            .collect();
        for number in info.numbers {
            assert!(
                named.contains(&number.quantity),
                "{}: a number missing in the phrase",
                info.key
            );
        }
        assert_eq!(named.len(), info.numbers.len(), "{}: a number only in the phrase", info.key);
        assert_eq!(info.phrase.contains(&C), info.choice.is_some(), "{}", info.key);
        let labels =
            if info.mavlink.failure_type.mode().is_some() { info.alternatives() } else { 0 };
        let is_choice_of_parameter = info.choice.is_some_and(|choice| choice.parameter.is_some());
        let labels = if is_choice_of_parameter { 1 } else { labels };
        assert_eq!(info.mavlink.mode.len(), usize::from(labels), "{}: labels of modes", info.key);
        assert!(info.numbers.len() < 2 || info.size().is_some(), "{}: no size", info.key);
    }
}

#[test]
fn phrases_names_and_numbers_are_unique() {
    let (class, list) = (TargetClass::Angle, &CATALOGUE);
    assert_eq!(list.iter().map(|info| info.key).collect::<BTreeSet<_>>().len(), list.len());
    let texts: BTreeSet<_> = all().map(|kind| kind.described(class).to_string()).collect();
    assert_eq!(texts.len(), all().count(), "{texts:?}");
    let words: Vec<_> = list.iter().filter_map(|info| info.mavlink.word).collect();
    assert_eq!(words.iter().collect::<BTreeSet<_>>().len(), words.len());
    let values: Vec<_> = list.iter().filter_map(|info| info.mavlink.user_1).collect();
    assert_eq!(values.iter().collect::<BTreeSet<_>>().len(), values.len());
    for failure_type in T::ALL.into_iter().filter(|one| one.mode().is_some()) {
        let of_type = list.iter().filter(|info| info.mavlink.failure_type == failure_type);
        let mut modes: Vec<u8> = of_type
            .flat_map(|info| (info.mavlink.first_mode..).take(info.mavlink.mode.len()))
            .collect();
        modes.sort_unstable();
        assert!(modes.iter().copied().eq(0..modes.len() as u8), "{failure_type:?}: {modes:?}");
    }
    let quantities = Q::ALL.iter().map(|quantity| *quantity as u8).collect::<BTreeSet<_>>();
    assert_eq!(quantities.len(), Q::ALL.len());
}

#[test]
fn a_text_has_the_units_of_the_target() {
    let deg = f64::to_radians;
    for (kind, class, text) in [
        (FaultKind::StuckHere, TargetClass::Angle, "stuck"),
        (
            FaultKind::StuckAt { angle_rad: deg(-7.0), travel: Travel::Jump },
            TargetClass::Angle,
            "stuck at -7.0 deg",
        ),
        (
            FaultKind::StuckAt { angle_rad: deg(7.0), travel: Travel::AtActuatorRate },
            TargetClass::Angle,
            "stuck at 7.0 deg at the actuator's rate",
        ),
        (FaultKind::HardOver { side: Side::Negative }, TargetClass::Angle, "hard over negative"),
        (FaultKind::PartialLoss { remaining: 0.4 }, TargetClass::Thrust, "40 % left"),
        (FaultKind::Delayed { delay_s: 0.2 }, TargetClass::Angle, "delayed by 200 ms"),
        (
            FaultKind::Intermittent { period_s: 0.5, present: 0.3 },
            TargetClass::Angle,
            "intermittent 30 % of 0.5 s",
        ),
        (
            FaultKind::Oscillating { amplitude: 2_000.0, frequency_hz: 1.5 },
            TargetClass::Thrust,
            "oscillating 2.0 kN at 1.5 Hz",
        ),
        (FaultKind::Drifting { rate: deg(-0.25) }, TargetClass::Angle, "drifting -0.25 deg/s"),
        (FaultKind::Slow { rate: 2_000.0 }, TargetClass::Thrust, "slow 2.0 kN/s"),
        (FaultKind::LimitedTravel { limit: 42.5 }, TargetClass::Thrust, "limited to 42.5 N"),
        (FaultKind::Slow { rate: 85.0 }, TargetClass::Thrust, "slow 85.0 N/s"),
        (
            FaultKind::Biased { bias: -5.0 },
            TargetClass::Sensor(SensorKind::EngineMonitor),
            "biased by -5.0 N",
        ),
    ] {
        assert_eq!(kind.described(class).to_string(), text);
    }
}
