use super::{error, script};
use crate::script::{
    Action, Condition, Crossing, LINES_MAX, Quantity, SEQUENCES_MAX, Script, TEXT_MAX, Trigger,
};
use crate::vehicle::{Mode, Reference};
use icd::effector_list::{EffectorEntry, Name};
use icd::fault::{Onset, Repeat, SensorKind, Side, TargetClass, Timing, Travel};
use icd::tvc_jet;
use icd::units::DEG;
use icd::{EffectorList, FaultKind, FaultRequest};

fn action(text: &str) -> Action {
    let script = script(text);
    let [line] = &script.sequences()[0].lines[..] else { panic!("one line: {text}") };
    line.action
}

fn kind(words: &str) -> FaultKind {
    match action(&format!("fail {words}")) {
        Action::Fault(FaultRequest::Inject { kind, .. }) => kind,
        other => panic!("{words}: {other:?}"),
    }
}

fn trigger(words: &str) -> Trigger {
    script(&format!("{words}: end")).sequences()[0].lines[0].trigger
}

#[test]
fn an_effector_with_another_name_is_found_by_its_role() {
    let mut entries: Vec<EffectorEntry> =
        tvc_jet::ALL.map(|effector| *tvc_jet::effectors().entry(effector).unwrap()).into();
    entries[4].name = Name::from("fin flap").unwrap();
    entries[5].name = Name::from("jet up").unwrap();
    let list = EffectorList::new(entries).unwrap();
    for (name, effector) in [
        ("rudder", tvc_jet::RUDDER),
        ("fin flap", tvc_jet::RUDDER),
        ("nozzle pitch", tvc_jet::NOZZLE_PITCH),
        ("nozzle_pitch", tvc_jet::NOZZLE_PITCH),
        ("left_elevator", tvc_jet::LEFT_ELEVATOR),
    ] {
        let script = Script::parse("s", &format!("fail {name} stuck"), &list).unwrap();
        let request = script.sequences()[0].lines[0].action;
        let Action::Fault(FaultRequest::Inject { target, .. }) = request else { panic!("{name}") };
        assert_eq!(target, effector.into(), "{name}");
    }
}

#[test]
fn every_kind_of_fault_has_its_words() {
    let stuck_at = |travel| FaultKind::StuckAt { angle_rad: 30.0_f64.to_radians(), travel };
    for (words, expected) in [
        ("rudder stuck", FaultKind::StuckHere),
        ("rudder stuck at 30 deg", stuck_at(Travel::Jump)),
        ("rudder stuck at 30 deg at the actuator's rate", stuck_at(Travel::AtActuatorRate)),
        ("rudder stuck at 30deg at actuator rate", stuck_at(Travel::AtActuatorRate)),
        ("rudder hard over positive", FaultKind::HardOver { side: Side::Positive }),
        ("rudder hard over negative", FaultKind::HardOver { side: Side::Negative }),
        ("rudder 40 % left", FaultKind::PartialLoss { remaining: 0.4 }),
        ("left aileron 40% left", FaultKind::PartialLoss { remaining: 0.4 }),
        ("rudder floating", FaultKind::Float),
        ("rudder slow 5 deg/s", FaultKind::Slow { rate: 5.0 * DEG }),
        ("rudder delayed 200 ms", FaultKind::Delayed { delay_s: 0.2 }),
        ("rudder delayed by 0.2 s", FaultKind::Delayed { delay_s: 0.2 }),
        (
            "rudder intermittent 50 % of 0.5 s",
            FaultKind::Intermittent { period_s: 0.5, present: 0.5 },
        ),
        (
            "rudder oscillating 3 deg at 2 Hz",
            FaultKind::Oscillating { amplitude: 3.0 * DEG, frequency_hz: 2.0 },
        ),
        ("rudder drifting -1 deg/s", FaultKind::Drifting { rate: -DEG }),
        ("rudder biased 4 deg", FaultKind::Biased { bias: 4.0 * DEG }),
        ("rudder limited to 10 deg", FaultKind::LimitedTravel { limit: 10.0 * DEG }),
        ("engine flame-out", FaultKind::FlameOut),
        ("engine flame out", FaultKind::FlameOut),
        ("engine stuck", FaultKind::StuckHere),
        ("engine limited to 20 kN", FaultKind::LimitedTravel { limit: 20_000.0 }),
        ("engine limited to 42.5 N", FaultKind::LimitedTravel { limit: 42.5 }),
        ("engine slow 2 kN/s", FaultKind::Slow { rate: 2_000.0 }),
        ("engine biased by -3 kN", FaultKind::Biased { bias: -3_000.0 }),
    ] {
        assert_eq!(kind(words), expected, "{words}");
    }
}

#[test]
fn texts_name_a_fault_as_scripts_do() {
    for code in 1..=u8::MAX {
        let Some(expected) = FaultKind::from_code(code, [0.5, 0.5]) else { break };
        for (target, class) in [("rudder", TargetClass::Angle), ("engine", TargetClass::Thrust)] {
            if !expected.info().targets.allow(class) {
                continue;
            }
            let text = expected.described(class).to_string();
            let read = kind(&format!("{target} {text}"));
            assert_eq!((read.code(), read.described(class).to_string()), (code, text));
        }
    }
}

#[test]
fn a_sensor_can_be_named_and_is_left_to_the_plant() {
    let target = SensorKind::EngineMonitor.into();
    let expected = Action::Fault(FaultRequest::Clear { target });
    assert_eq!(action("clear engine monitor"), expected);
}

#[test]
fn every_effector_has_its_names() {
    for effector in tvc_jet::ALL {
        let servo = match effector {
            tvc_jet::ENGINE => "motor 1".to_owned(),
            other => format!("servo {}", other.index() + 1),
        };
        let list = tvc_jet::effectors();
        for name in [list.name(effector).to_owned(), list.key(effector).to_owned(), servo] {
            let expected = Action::Fault(FaultRequest::Clear { target: effector.into() });
            assert_eq!(action(&format!("clear {name}")), expected, "{name}");
            assert_eq!(action(&format!("CLEAR {}", name.to_uppercase())), expected, "{name}");
        }
    }
    assert_eq!(action("clear all"), Action::Fault(FaultRequest::ClearAll));
}

#[test]
fn the_timing_of_a_fault_stands_behind_its_kind() {
    let timing = |words: &str| match action(&format!("fail rudder floating{words}")) {
        Action::Fault(FaultRequest::Inject { timing, .. }) => timing,
        other => panic!("{other:?}"),
    };
    let whole = Timing {
        onset: Onset::AtOnce,
        ramp_s: 1.0,
        duration_s: Some(5.0),
        repeat: Some(Repeat { every_s: 10.0, times: Some(3) }),
    };
    assert_eq!(timing(", ramp 1 s, for 5 s, every 10 s, 3 times"), whole);
    let endless = Some(Repeat { every_s: 10.0, times: None });
    let expected = Timing { ramp_s: 0.0, repeat: endless, ..whole };
    assert_eq!(timing(", for 5 s, every 10 s"), expected);
    assert_eq!(timing(", ramp 500 ms"), Timing { ramp_s: 0.5, ..Timing::NOW });
    assert_eq!(timing(""), Timing::NOW);
}

#[test]
fn references_modes_texts_and_the_end_are_actions() {
    for (words, expected) in [
        ("altitude 6000 m", Action::Refer(Reference::Altitude(6_000.0))),
        ("airspeed 280 m/s", Action::Refer(Reference::Airspeed(280.0))),
        ("roll -15 deg", Action::Refer(Reference::Roll(-15.0 * DEG))),
        ("course 90 deg", Action::Refer(Reference::Course(90.0 * DEG))),
        ("mode hold", Action::Mode(Mode::Hold)),
        ("mode mission", Action::Mode(Mode::Mission)),
        ("mode return", Action::Mode(Mode::Return)),
        ("mode position", Action::Mode(Mode::Position)),
        ("say Watch the rudder, now!", Action::Say),
        ("end", Action::End),
    ] {
        assert_eq!(action(words), expected, "{words}");
    }
}

#[test]
fn a_line_waits_for_a_time_or_a_quantity() {
    assert_eq!(trigger("at 3 s"), Trigger::At(3_000_000));
    assert_eq!(trigger("at 1.5 min"), Trigger::At(90_000_000));
    assert_eq!(trigger("after 200 ms"), Trigger::After(200_000));
    assert_eq!(script("end").sequences()[0].lines[0].trigger, Trigger::AtOnce);
    for (words, quantity, crossing, value) in [
        ("roll passes 10 deg", Quantity::Roll, Crossing::Passes, 10.0 * DEG),
        ("pitch rises above -5 deg", Quantity::Pitch, Crossing::RisesAbove, -5.0 * DEG),
        ("heading falls below 90 deg", Quantity::Heading, Crossing::FallsBelow, 90.0 * DEG),
        ("altitude passes 5500 m", Quantity::Altitude, Crossing::Passes, 5_500.0),
        ("climb rate passes 3 m/s", Quantity::ClimbRate, Crossing::Passes, 3.0),
        ("airspeed passes 270 m/s", Quantity::Airspeed, Crossing::Passes, 270.0),
        ("alpha passes 8 deg", Quantity::Alpha, Crossing::Passes, 8.0 * DEG),
        ("beta passes 2 deg", Quantity::Beta, Crossing::Passes, 2.0 * DEG),
        ("roll rate passes 20 deg/s", Quantity::RollRate, Crossing::Passes, 20.0 * DEG),
        ("pitch rate passes 20 deg/s", Quantity::PitchRate, Crossing::Passes, 20.0 * DEG),
        ("yaw rate passes 20 deg/s", Quantity::YawRate, Crossing::Passes, 20.0 * DEG),
        ("load factor passes 3 g", Quantity::LoadFactor, Crossing::Passes, 3.0),
        ("time passes 20 s", Quantity::Time, Crossing::Passes, 20.0),
    ] {
        let expected = Trigger::When(Condition { quantity, crossing, value });
        assert_eq!(trigger(&format!("when {words}")), expected, "{words}");
    }
}

#[test]
fn sequences_have_names_and_lines_keep_their_numbers() {
    let script = script("# first\n\nend\nsequence other # beside\nsay a\n\nsay b\n");
    let [first, other] = script.sequences() else { panic!("two sequences") };
    assert_eq!((first.name.clone(), first.lines[0].number), (None, 3));
    assert_eq!(other.name, Some((4, "other".to_owned())));
    assert_eq!(other.lines.iter().map(|line| line.number).collect::<Vec<_>>(), [5, 7]);
    assert_eq!(script.line(7).unwrap().words(), Some("b"));
}

const EVERYTHING: &str = "\
# A comment
At 3 s :  fail  LEFT elevator stuck at 30.0 deg at the actuator's rate , for 5s, every 10 s , 3 times # why
when roll passes -10deg: fail engine limited to 20 kN, ramp 0.5 s

after 2 s: say Now, watch!  Two  spaces # not this
sequence beside
when load factor rises above 3 g: fail servo 3 oscillating 3 deg at 2 hz
clear all
end
";

#[test]
fn the_plain_form_of_a_script_is_the_same_script() {
    let first = script(EVERYTHING);
    let plain = first.to_string();
    let again = script(&plain);
    assert_eq!(again.sequences(), first.sequences());
    assert_eq!(again.to_string(), plain);
    assert_eq!(
        first.line(2).unwrap().text,
        "at 3 s: fail left elevator stuck at 30 deg at the actuator's rate, for 5 s, every 10 s, 3 times"
    );
    assert_eq!(
        first.line(3).unwrap().text,
        "when roll passes -10 deg: fail engine limited to 20 kN, ramp 0.5 s"
    );
    assert_eq!(first.line(5).unwrap().words(), Some("Now, watch!  Two  spaces"));
}

#[test]
fn a_script_as_data_is_its_name_and_its_text() {
    let first = script(EVERYTHING);
    let json = serde_json::to_string(&first).unwrap();
    assert_eq!(serde_json::from_str::<Script>(&json).unwrap(), first);
    let bytes = postcard::to_stdvec(&first).unwrap();
    assert_eq!(postcard::from_bytes::<Script>(&bytes).unwrap(), first);
    let bad = json.replace("stuck", "stack");
    let error = serde_json::from_str::<Script>(&bad).unwrap_err().to_string();
    assert!(error.contains("s.txt, line 2"), "{error}");
}

#[test]
fn an_error_names_the_place_what_stands_there_and_what_is_allowed() {
    for (text, expected) in [
        (
            "\n  fial rudder",
            "s.txt, line 2, column 3: `fial` found, expected an action: fail, clear",
        ),
        (
            "fail elevator stuck",
            "line 1, column 6: `elevator` found, expected an effector: left aileron",
        ),
        ("fail rudder", "column 12: end of the line found, expected a kind of fault: stuck"),
        ("fail rudder broken", "column 13: `broken` found, expected a kind of fault"),
        ("fail servo 8 stuck", "column 12: servo 8 is outside 1 to 7"),
        ("fail rudder stuck at 30", "column 24: end of the line found, expected the unit deg"),
        ("fail rudder stuck at 30 rad", "column 25: `rad` found, expected the unit deg"),
        ("fail rudder stuck at deg", "column 22: `deg` found, expected a number (angle)"),
        ("fail rudder stuck at 400 deg", "column 22: angle 400 deg is outside -90 to 90 deg"),
        ("fail rudder 140 % left", "column 13: remaining effect 140 % is outside 0 to 100 %"),
        ("fail rudder 40 %", "column 17: end of the line found, expected `left`"),
        ("fail rudder delayed 2 s", "delay 2 s is outside 0 to 1 s"),
        (
            "fail rudder hard over up",
            "`up` found, expected the end, by the sign of the deflection: positive, negative",
        ),
        ("fail rudder oscillating 3 deg at 50 Hz", "frequency 50 Hz is outside 0.001 to 20 Hz"),
        ("fail rudder slow -5 deg/s", "rate -5 deg/s is outside 0 to 1000 deg/s"),
        ("fail engine stuck at 3 deg", "column 13: `stuck at` is not for the engine"),
        ("fail engine hard over positive", "`hard over` is not for the engine"),
        ("fail engine floating", "`floating` is not for the engine"),
        ("fail engine slow 5 deg/s", "`deg/s` found, expected the unit kN/s"),
        ("fail rudder flame-out", "`flame-out` is only for the engine"),
        ("fail gyro floating", "column 11: `floating` is not for sensors"),
        ("fail rudder noisy 3 deg", "column 13: `noisy` is only for sensors"),
        ("fail gyro biased by 3 m", "deg/s"),
        ("fail rudder limited to 10 kN", "`kN` found, expected the unit deg"),
        ("fail rudder stuck, every 3 s", "column 18: a repetition needs a duration"),
        (
            "fail rudder stuck, for 3 s, every 3 s",
            "repetition 3 s is outside 3.000001 to 2592000 s",
        ),
        (
            "fail rudder stuck, for 3 s, every 5 s, 1 times",
            "number of repetitions 1 times is outside 2 to 1000 times",
        ),
        ("fail rudder delayed 2000 ms", "delay 2000 ms is outside 0 to 1000 ms"),
        ("fail rudder stuck, ramp 1 s", "column 18: this kind of fault has no ramp"),
        ("fail rudder stuck, for 3 s, ramp 1 s", "`,` found, expected the end of the line, or"),
        ("clear everything", "expected `all` or an effector"),
        ("at 3: end", "`:` found, expected the unit s or ms or min"),
        ("at 3 s end", "column 8: `end` found, expected `:`"),
        ("at -3 s: end", "the time -3 is outside 0 to"),
        (
            "when roll is 10 deg: end",
            "`is` found, expected how it is crossed: passes, rises above, falls below",
        ),
        ("when speed passes 10 m/s: end", "`speed` found, expected a quantity: roll rate"),
        ("when pitch passes 95 deg: end", "pitch 95 is outside -90 to 90 deg"),
        ("when altitude passes 10 ft: end", "`ft` found, expected the unit m"),
        ("mode offboard", "`offboard` found, expected a mode: position, hold, mission, return"),
        ("mode reference", "`reference` found, expected a mode: position, hold, mission, return"),
        ("altitude 99999 m", "altitude 99999 is outside 0 to 20000 m"),
        ("say", "column 4: end of the line found, expected the text to say"),
        ("end now", "column 5: `now` found, expected the end of the line"),
        ("sequence", "expected the name of the sequence"),
        ("sequence a\nend\nsequence a\nend", "line 3, column 10: there is a sequence a already"),
        ("roll 1.2.3 deg", "column 6: `1.2.3` found, expected a number such as 10 or -2.5"),
        ("roll 10\u{b0}", "column 8: '\u{b0}' belongs to no word"),
        ("# nothing\n", "no line does anything"),
    ] {
        let error = error(text);
        assert!(error.contains(expected), "{text:?}: {error}");
    }
}

#[test]
fn text_lines_and_sequences_are_limited() {
    assert!(error(&"#".repeat(TEXT_MAX + 1)).contains("16385 bytes or more, at most 16384"));
    let lines = |count: usize| "end\n".repeat(count);
    assert_eq!(script(&lines(LINES_MAX)).lines().count(), LINES_MAX);
    assert!(error(&lines(LINES_MAX + 1)).contains("line 257, column 1: more than 256 lines"));
    let sequences = |count: usize| -> String {
        (0..count).map(|number| format!("sequence s{number}\nend\n")).collect()
    };
    assert_eq!(script(&sequences(SEQUENCES_MAX)).sequences().len(), SEQUENCES_MAX);
    assert!(error(&sequences(SEQUENCES_MAX + 1)).contains("more than 16 sequences"));
    assert!(error(&format!("end\n{}", sequences(SEQUENCES_MAX))).contains("more than 16"));
}

#[test]
fn the_examples_of_the_documentation_are_scripts() {
    let document = include_str!("../../../../../docs/scripts.md");
    let examples = document.split_once("\n## Examples\n").unwrap().1;
    let head = document.split_once("\n## ").unwrap().0;
    let mut count = 0;
    for part in [head, examples] {
        for block in part.split("```text\n").skip(1) {
            let text = block.split_once("```").unwrap().0;
            assert!(script(text).has_faults(), "{text}");
            count += 1;
        }
    }
    assert_eq!(count, 4);
}

proptest::proptest! {
    #[test]
    fn no_text_breaks_the_reader(text in "[ -~\n\u{e9}]{0,200}") {
        if let Ok(script) = Script::parse("p", &text, &tvc_jet::effectors()) {
            let again = Script::parse("p", &script.to_string(), &tvc_jet::effectors()).unwrap();
            proptest::prop_assert_eq!(again.sequences(), script.sequences());
        }
    }

    #[test]
    fn words_of_the_language_in_any_order_break_nothing(
        words in proptest::collection::vec(0..WORDS.len(), 0..40),
    ) {
        let text: Vec<&str> = words.iter().map(|index| WORDS[*index]).collect();
        if let Ok(script) = Script::parse("p", &text.join(" "), &tvc_jet::effectors()) {
            let again = Script::parse("p", &script.to_string(), &tvc_jet::effectors()).unwrap();
            proptest::prop_assert_eq!(again.sequences(), script.sequences());
        }
    }
}

const WORDS: [&str; 24] = [
    "fail", "clear", "all", "rudder", "engine", "stuck", "at", "after", "when", "roll", "passes",
    "10", "-0.5", "deg", "s", ":", ",", "%", "left", "\n", "say", "end", "sequence", "for",
];

#[test]
fn a_byte_order_mark_before_the_text_is_skipped() {
    let marked = Script::parse("s", "\u{feff}say one\n", &tvc_jet::effectors()).unwrap();
    assert_eq!(marked, Script::parse("s", "say one\n", &tvc_jet::effectors()).unwrap());
}
