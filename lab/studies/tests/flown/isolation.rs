//! Which effector the isolation names, and what becomes of a flight that uses the verdict.
//!
//! `cargo test --workspace --test isolation -- --nocapture` prints the lines of the flights. The faults of these
//! flights are those with which the gains were chosen; `sitl study isolation` flies others (docs/estimation.md).

use autopilot::config;
use autopilot::event::EventKind;
use autopilot::flight_management::event_text::verdict_text;
use core::ops::ControlFlow;
use flight_control::isolation::Verdict;
use flight_control::isolation::evidence::Behaviour;
use flight_control::{AllocationMode, IsolationMode};
use icd::{ControlPeriod, Effector, SimTime, tvc_jet};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{FlightSetup, watch};
use lab_report::runner;
use plant_sim::{Airframe, ReadAirframe as _, Scenario};

const ONSET_S: f64 = 3.0;
const TURN: &str = "[[autopilot.reference]]\nat_s = 2.0\nroll_deg = 15.0\n\
                    [[autopilot.reference]]\nat_s = 10.0\nroll_deg = -10.0\n";

fn setup(text: &str, mode: IsolationMode, allocation: AllocationMode) -> FlightSetup {
    let airframe = Airframe::paper();
    let text = format!("[plant]\nseed = 1\n{text}");
    let scenario = Scenario::from_toml("scenario", &text, &airframe.effectors).expect("above");
    let model = config::model("model", aircraft::DEFAULT_MODEL).expect("a shipped model");
    let mut parameters = model.defaults;
    let selection = &mut parameters.gains.selection;
    (selection.isolation, selection.allocation) = (mode, allocation);
    FlightSetup {
        plant: scenario.plant.setup(airframe, 1, ControlPeriod::DEFAULT, 1_000),
        model: model.aircraft,
        parameters,
        references: config::references("scenario", &text).expect("above"),
        script: None,
        duration: SimTime::from_seconds(30.0).expect("seconds of a flight"),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

fn jam(effector: &str, angle_deg: f64) -> String {
    fault(effector, &format!("kind = \"stuck_at\"\nangle_deg = {angle_deg:?}"))
}

fn fault(effector: &str, rest: &str) -> String {
    format!("[[plant.fault]]\neffector = \"{effector}\"\nonset_s = {ONSET_S:?}\n{rest}\n")
}

#[derive(Debug, Clone, Default)]
struct Flown {
    /// Every verdict that was reported, with its time, s.
    named: Vec<(f64, Verdict)>,
    /// The verdict of the last step.
    last: Option<Verdict>,
    lost_s: Option<f64>,
    altitude_error_m: f64,
    test_rad: f64,
}

fn fly(name: &str, text: &str, mode: IsolationMode, allocation: AllocationMode) -> Flown {
    let setup = setup(text, mode, allocation);
    let mut flown = Flown::default();
    let end = watch(&setup, |tick| {
        let (truth, log) = (tick.plant.truth(), tick.log);
        let t_s = truth.time.as_seconds();
        for event in tick.events {
            if let EventKind::Isolated(verdict) = event.kind {
                flown.named.push((t_s, verdict));
            }
        }
        flown.last = log.isolation.verdict;
        flown.test_rad = flown.test_rad.max(log.isolation.test_rad.abs());
        flown.altitude_error_m = truth.altitude_m - log.altitude_reference_m;
        if setup.plant.airframe.limits.are_exceeded(&truth.into()) {
            flown.lost_s = Some(t_s);
        }
        if flown.lost_s.is_none() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    let _ = end.expect("the shipped aircraft flies");
    let list = &setup.plant.airframe.effectors;
    let named = flown.named.iter().map(|(t, v)| format!("{t:.2} s {}", verdict_text(v, list)));
    let named = named.collect::<Vec<_>>().join("; ");
    let end = flown.lost_s.map_or("kept".to_owned(), |t_s| format!("lost at {t_s:.1} s"));
    println!(
        "{name}, {mode:?}, {allocation:?}: {named}; {end}, altitude error {:.0} m",
        flown.altitude_error_m
    );
    flown
}

const fn one(effector: Effector) -> [Option<Effector>; 2] {
    [Some(effector), None]
}

#[test]
fn every_effector_that_jams_is_named_with_its_angle_and_no_other_one() {
    let mut flights = Vec::new();
    for (name, effector, angles) in [
        ("left_elevator", tvc_jet::LEFT_ELEVATOR, [-20.0, 10.0, 30.0]),
        ("right_elevator", tvc_jet::RIGHT_ELEVATOR, [-20.0, 10.0, 30.0]),
        ("rudder", tvc_jet::RUDDER, [-7.0, 3.0, 7.0]),
        ("nozzle_pitch", tvc_jet::NOZZLE_PITCH, [-8.0, 8.0, 10.0]),
        ("nozzle_yaw", tvc_jet::NOZZLE_YAW, [-8.0, 6.0, 8.0]),
    ] {
        flights.extend(angles.map(|deg| (format!("{name} {deg}"), jam(name, deg), effector, deg)));
        let turn = angles
            .map(|deg| (format!("{name} {deg} in a turn"), jam(name, deg) + TURN, effector, deg));
        flights.extend(turn);
    }
    let flown = runner::map("jams", &flights, |(name, text, ..)| {
        fly(name, text, IsolationMode::Report, AllocationMode::Paper)
    });
    for ((name, _, effector, deg), flown) in flights.iter().zip(flown) {
        let (first_s, _) = flown.named.first().expect(name);
        assert!(first_s - ONSET_S < 1.0, "{name}: {first_s} s");
        assert!(
            flown.named.iter().all(|(_, verdict)| verdict.effectors == one(*effector)),
            "{name}"
        );
        let last = flown.last.expect(name);
        assert_eq!((last.effectors, last.behaviour), (one(*effector), Behaviour::Stuck), "{name}");
        assert!((last.values[0].to_degrees() - deg).abs() < 1.0, "{name}: {last:?}");
        assert_eq!(flown.test_rad, 0.0, "{name}: a report changes no command");
    }
}

#[test]
fn ailerons_are_named_once_a_test_has_moved_them_alike() {
    let flights: Vec<(&str, Effector, f64)> = [-20.0, 10.0, 20.0]
        .into_iter()
        .flat_map(|deg| {
            [
                ("left_aileron", tvc_jet::LEFT_AILERON, deg),
                ("right_aileron", tvc_jet::RIGHT_AILERON, deg),
            ]
        })
        .collect();
    let flown = runner::map("ailerons", &flights, |(name, _, deg)| {
        [IsolationMode::Report, IsolationMode::Test]
            .map(|mode| fly(name, &jam(name, *deg), mode, AllocationMode::Paper))
    });
    for ((name, effector, _), [without, with]) in flights.iter().zip(flown) {
        assert_eq!((without.last, without.test_rad), (None, 0.0), "{name}");
        let last = with.last.expect(name);
        assert_eq!(last.effectors, one(*effector), "{name}");
        assert!(
            with.named.iter().all(|(_, verdict)| verdict.effectors == one(*effector)),
            "{name}"
        );
        assert!(with.test_rad > 0.0 && with.lost_s.is_none(), "{name}");
    }
}

/// Two jammed elevators look like a jammed nozzle at first sight. A law that then gave up the nozzle would be lost.
#[test]
fn both_elevators_are_kept_with_the_verdict_in_use() {
    let both = [tvc_jet::LEFT_ELEVATOR, tvc_jet::RIGHT_ELEVATOR].map(Some);
    let flights = [(10.0, 10.0), (20.0, 20.0), (10.0, 20.0), (20.0, 10.0)];
    let flown = runner::map("both elevators", &flights, |(left, right)| {
        let text = jam("left_elevator", *left) + &jam("right_elevator", *right);
        [AllocationMode::Wls, AllocationMode::Relief].map(|allocation| {
            fly(&format!("elevators {left} and {right}"), &text, IsolationMode::Use, allocation)
        })
    });
    for (flight, flown) in flights.iter().zip(flown) {
        for flown in flown {
            assert_eq!(flown.lost_s, None, "{flight:?}");
            assert!(flown.named.iter().all(|(_, verdict)| verdict.effectors == both), "{flight:?}");
            // In steady flight nothing may be left that distinguishes them, and the verdict may end.
            assert!(!flown.named.is_empty(), "{flight:?}");
        }
    }
}

#[test]
fn the_nozzle_jammed_in_yaw_is_kept_once_the_rudder_is_known_to_be_healthy() {
    let flights = [-15.0, -14.0, 14.0, 15.0];
    let flown = runner::map("nozzle yaw", &flights, |deg| {
        [IsolationMode::Report, IsolationMode::Use].map(|mode| {
            fly(
                &format!("nozzle yaw {deg}"),
                &jam("nozzle_yaw", *deg),
                mode,
                AllocationMode::Relief,
            )
        })
    });
    for (deg, [before, after]) in flights.iter().zip(flown) {
        assert!(before.lost_s.is_some() || deg.abs() < 15.0, "{deg}: it was lost before");
        assert_eq!(after.lost_s, None, "{deg}");
        assert_eq!(after.last.expect("a verdict").effectors, one(tvc_jet::NOZZLE_YAW), "{deg}");
    }
}

#[test]
fn how_an_effector_behaves_is_named_too() {
    let flights = [
        (
            "left_elevator",
            "kind = \"oscillating\"\namplitude_deg = 15.0\nfrequency_hz = 1.0",
            Behaviour::Irregular,
        ),
        ("rudder", "kind = \"biased\"\nbias_deg = 6.0", Behaviour::Biased),
    ];
    let flown = runner::map("behaviours", &flights, |(name, rest, _)| {
        fly(name, &(fault(name, rest) + TURN), IsolationMode::Report, AllocationMode::Paper)
    });
    for ((name, _, behaviour), flown) in flights.iter().zip(flown) {
        // When all is steady again, a bias looks like a jam.
        assert!(flown.named.iter().any(|(_, verdict)| verdict.behaviour == *behaviour), "{name}");
    }
}

/// The engine has no column in the estimate. What its thrust does to the nozzle and to the aircraft must not be taken
/// for an effector.
#[test]
fn a_fault_of_the_engine_is_never_named_as_an_effector() {
    let faults = [
        "kind = \"flame_out\"",
        "kind = \"partial_loss\"\nremaining_percent = 30.0",
        "kind = \"partial_loss\"\nremaining_percent = 70.0",
        "kind = \"stuck_here\"",
        "kind = \"oscillating\"\namplitude_kn = 10.0\nfrequency_hz = 0.5",
        "kind = \"biased\"\nbias_kn = 15.0",
    ];
    let air = "[plant.wind]\nturbulence = \"moderate\"\n";
    let flights: Vec<(String, &str)> = faults
        .iter()
        .flat_map(|rest| {
            [(fault("engine", rest) + TURN, *rest), (fault("engine", rest) + TURN + air, *rest)]
        })
        .collect();
    let flown = runner::map("engine", &flights, |(text, name)| {
        [
            (IsolationMode::Report, AllocationMode::Paper),
            (IsolationMode::Use, AllocationMode::Relief),
        ]
        .map(|(mode, allocation)| fly(&format!("engine: {name}"), text, mode, allocation))
    });
    for ((text, _), flown) in flights.iter().zip(flown) {
        assert!(flown.iter().all(|flown| flown.named.is_empty()), "{text}");
    }
}

/// Two elevators at opposite angles do to the estimate what two ailerons do. A law that then gave up the ailerons lost this
/// flight 2.2 s after the jams.
#[test]
fn elevators_that_jam_at_opposite_angles_cost_no_ailerons() {
    let flights = [(-20.0, 20.0), (20.0, -20.0), (-25.0, 25.0), (19.8, -22.0)];
    let flown = runner::map("opposite elevators", &flights, |(left, right)| {
        let text = jam("left_elevator", *left) + &jam("right_elevator", *right);
        [IsolationMode::Report, IsolationMode::Use].map(|mode| {
            fly(&format!("elevators {left} and {right}"), &text, mode, AllocationMode::Relief)
        })
    });
    for (flight, [without, with]) in flights.iter().zip(flown) {
        assert!(without.lost_s.is_none() && with.lost_s.is_none(), "{flight:?}");
    }
}

/// Until the estimate has followed the end of a fault, what was true before may still be named; nothing else, and nothing later.
#[test]
fn a_fault_that_is_over_names_nothing() {
    const FOLLOWS_S: f64 = 0.3;
    let kinds = [
        "kind = \"stuck_at\"\nangle_deg = 6.0",
        "kind = \"stuck_at\"\nangle_deg = -15.0",
        "kind = \"hard_over\"\nside = \"positive\"",
        "kind = \"biased\"\nbias_deg = 8.0",
        "kind = \"oscillating\"\namplitude_deg = 10.0\nfrequency_hz = 1.0",
        "kind = \"partial_loss\"\nremaining_percent = 10.0",
    ];
    let list = Airframe::paper().effectors;
    let angles = list.all().filter(|effector| list.is_angle(*effector));
    let flights: Vec<(Effector, &str, f64)> = angles
        .flat_map(|effector| kinds.map(|kind| (effector, kind)))
        .zip([0.5, 2.0, 10.0].into_iter().cycle())
        .map(|((effector, kind), duration_s)| (effector, kind, duration_s))
        .collect();
    let flown = runner::map("faults that end", &flights, |(effector, kind, duration_s)| {
        let (key, name) = (list.key(*effector), kind.replace('\n', " "));
        let text = fault(key, &format!("duration_s = {duration_s:?}\n{kind}"));
        [
            (IsolationMode::Report, AllocationMode::Paper),
            (IsolationMode::Use, AllocationMode::Relief),
        ]
        .map(|(mode, allocation)| {
            fly(&format!("{key} {name} {duration_s} s"), &text, mode, allocation)
        })
    });
    let mut named = 0;
    for ((effector, kind, duration_s), flown) in flights.iter().zip(flown) {
        let end_s = ONSET_S + duration_s;
        for flown in flown {
            named += u32::from(flown.named.iter().any(|(t_s, _)| *t_s < end_s));
            for (t_s, verdict) in flown.named.iter().filter(|(t_s, _)| *t_s >= end_s) {
                let is_late = *t_s < end_s + FOLLOWS_S && verdict.effectors == one(*effector);
                assert!(is_late, "{} {kind}: {verdict:?} at {t_s} s", list.name(*effector));
            }
        }
    }
    assert!(named >= 20, "{named}: the faults are seen at all");
}
