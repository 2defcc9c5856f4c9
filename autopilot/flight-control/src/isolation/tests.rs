use super::*;
use crate::gains::Gains;
use crate::testing;
use icd::tvc_jet;
use proptest::prelude::*;

/// The isolation on an estimate that is computed here instead of observed.
struct Bench {
    isolation: Isolation,
    model: DesignModel,
    at: FlightCondition,
    positions: PerEffector<f64>,
    last: IsolationLog,
    t_s: f64,
    /// Time since the estimate was large, s: the detector sleeps after half a second.
    calm_s: f64,
}

impl Bench {
    fn new() -> Self {
        let model = DesignModel::new(testing::aircraft_model());
        let at = model.condition(model.design_point());
        Self {
            isolation: Isolation::new(ControlPeriod::DEFAULT),
            model,
            at,
            positions: PerEffector::default(),
            last: IsolationLog::default(),
            t_s: 0.0,
            calm_s: f64::INFINITY,
        }
    }

    /// Flies for so long: `moves` commands, `fault` has the true positions for the modelled ones.
    fn run(
        &mut self,
        seconds: f64,
        moves: impl Fn(f64, &mut PerEffector<f64>),
        fault: impl Fn(f64, &PerEffector<f64>) -> PerEffector<f64>,
    ) {
        let gains = Gains::REFERENCE;
        let levels = gains.activation.levels();
        let end_s = self.t_s + seconds;
        while self.t_s < end_s {
            moves(self.t_s, &mut self.positions);
            let truth = fault(self.t_s, &self.positions);
            let z2 = self.model.effectors(&self.at, &truth)
                - self.model.effectors(&self.at, &self.positions);
            let level = z2.abs().component_div(&levels).amax();
            self.calm_s = if level > 0.25 { 0.0 } else { self.calm_s + 0.002 };
            let input = IsolationInput {
                z2: &z2,
                levels: &levels,
                level,
                active: self.calm_s < 0.5,
                positions: &self.positions,
                // So quick that the estimate is what it is given as.
                bandwidth: 1.0e4,
                model: &self.model,
                at: &self.at,
            };
            self.last = self.isolation.step(&input, &gains.isolation);
            self.t_s += 0.002;
        }
    }

    fn named(&self) -> [Option<Effector>; 2] {
        self.last.verdict.map_or([None; 2], |verdict| verdict.effectors)
    }
}

/// Elevators, ailerons, rudder and nozzle all move, each in its own rhythm.
fn manoeuvre(t_s: f64, positions: &mut PerEffector<f64>) {
    let swing = |rate: f64| 0.1 * libm::sin(rate * t_s);
    for (effector, value) in [
        (tvc_jet::LEFT_AILERON, -swing(1.1)),
        (tvc_jet::RIGHT_AILERON, swing(1.1)),
        (tvc_jet::LEFT_ELEVATOR, swing(1.7)),
        (tvc_jet::RIGHT_ELEVATOR, swing(1.7)),
        (tvc_jet::RUDDER, swing(2.3)),
        (tvc_jet::NOZZLE_PITCH, swing(2.9)),
        (tvc_jet::NOZZLE_YAW, swing(3.7)),
    ] {
        positions[effector] = value;
    }
}

fn with(positions: &PerEffector<f64>, effector: Effector, value: f64) -> PerEffector<f64> {
    let mut truth = *positions;
    truth[effector] = value;
    truth
}

#[test]
fn every_effector_that_moves_alone_is_named_with_its_angle() {
    for effector in [
        tvc_jet::LEFT_ELEVATOR,
        tvc_jet::RIGHT_ELEVATOR,
        tvc_jet::RUDDER,
        tvc_jet::NOZZLE_PITCH,
        tvc_jet::NOZZLE_YAW,
    ] {
        let mut bench = Bench::new();
        bench.run(4.0, manoeuvre, |_, positions| with(positions, effector, 0.22));
        let verdict = bench.last.verdict.unwrap();
        assert_eq!(verdict.effectors, [Some(effector), None]);
        assert_eq!(verdict.behaviour, Behaviour::Stuck);
        assert!((verdict.values[0] - 0.22).abs() < 0.01, "{verdict:?}");
        assert!(verdict.confidence > 0.9);
    }
}

#[test]
fn the_other_behaviours_are_recognised() {
    let rudder = tvc_jet::RUDDER;
    let part = |t_s: f64, positions: &PerEffector<f64>| match t_s {
        t_s if t_s < 100.0 => with(positions, rudder, 0.3 * positions[rudder]),
        t_s if t_s < 200.0 => with(positions, rudder, positions[rudder] + 0.12),
        t_s => with(positions, rudder, positions[rudder] + 0.2 * libm::sin(9.0 * t_s)),
    };
    for (start_s, behaviour, value) in [
        (0.0, Behaviour::Reduced, 0.3),
        (100.0, Behaviour::Biased, 0.12),
        (200.0, Behaviour::Irregular, 0.0),
    ] {
        let mut bench = Bench { t_s: start_s, ..Bench::new() };
        let manoeuvre = |t_s: f64, positions: &mut PerEffector<f64>| {
            manoeuvre(t_s, positions);
            // Never in the middle, where a part of the effect is no loss.
            positions[rudder] = 0.25 + 0.1 * libm::sin(2.3 * t_s);
        };
        bench.run(6.0, manoeuvre, part);
        let verdict = bench.last.verdict.unwrap();
        assert_eq!((verdict.effectors[0], verdict.behaviour), (Some(rudder), behaviour));
        assert!((verdict.values[0] - value).abs() < 0.05, "{verdict:?}");
    }
}

#[test]
fn two_jammed_elevators_are_not_taken_for_the_nozzle() {
    let mut bench = Bench::new();
    bench.run(4.0, manoeuvre, |_, positions| {
        with(&with(positions, tvc_jet::LEFT_ELEVATOR, 0.3), tvc_jet::RIGHT_ELEVATOR, 0.3)
    });
    assert_eq!(bench.named(), [Some(tvc_jet::LEFT_ELEVATOR), Some(tvc_jet::RIGHT_ELEVATOR)]);
}

#[test]
fn what_stands_in_no_column_names_no_effector() {
    let mut bench = Bench::new();
    // The manoeuvre of the truth is another one than that of the model: everything is wrong at once.
    bench.run(4.0, manoeuvre, |t_s, _| {
        let mut truth = PerEffector::default();
        manoeuvre(1.7 * t_s + 2.0, &mut truth);
        truth
    });
    assert_eq!(bench.last.verdict, None);
}

#[test]
fn the_verdict_ends_with_the_fault() {
    let mut bench = Bench::new();
    bench.run(3.0, manoeuvre, |_, positions| with(positions, tvc_jet::RUDDER, 0.2));
    assert!(bench.last.verdict.is_some());
    bench.run(1.0, manoeuvre, |_, positions| *positions);
    assert_eq!(bench.last, IsolationLog::default());
}

/// The memory of a jam that is over looks like an effector that moves by itself.
#[test]
fn a_verdict_ends_with_the_fault_before_the_detector_sleeps_and_never_changes() {
    for effector in [tvc_jet::LEFT_ELEVATOR, tvc_jet::RUDDER, tvc_jet::NOZZLE_PITCH] {
        let mut bench = Bench::new();
        bench.run(3.0, manoeuvre, |_, positions| with(positions, effector, 0.2));
        let named = bench.last.verdict.map(|verdict| (verdict.effectors, verdict.behaviour));
        assert_eq!(named, Some(([Some(effector), None], Behaviour::Stuck)));
        for _ in 0..18 {
            bench.run(0.02, manoeuvre, |_, positions| *positions);
            let now = bench.last.verdict.map(|verdict| (verdict.effectors, verdict.behaviour));
            assert!(now.is_none() || now == named, "{now:?}");
        }
        assert_eq!((bench.last.verdict, bench.calm_s < 0.5), (None, true));
    }
}

/// Opposite elevators and ailerons do the same to the estimate. All hypotheses leave the rudder alone.
#[test]
fn what_no_hypothesis_needs_is_cleared_though_none_is_certain() {
    let mut bench = Bench::new();
    let still = |_: f64, positions: &mut PerEffector<f64>| *positions = PerEffector::default();
    bench.run(1.5, still, |_, positions| {
        with(&with(positions, tvc_jet::LEFT_ELEVATOR, 0.35), tvc_jet::RIGHT_ELEVATOR, -0.35)
    });
    let known = bench.isolation.known(IsolationMode::Use);
    assert_eq!(bench.last.verdict, None);
    assert!(known.is_cleared(tvc_jet::RUDDER) && known.is_cleared(tvc_jet::NOZZLE_YAW));
    for effector in [
        tvc_jet::LEFT_ELEVATOR,
        tvc_jet::RIGHT_ELEVATOR,
        tvc_jet::LEFT_AILERON,
        tvc_jet::RIGHT_AILERON,
    ] {
        assert!(!known.is_cleared(effector), "{effector:?}");
    }
}

#[test]
fn ailerons_that_mirror_each_other_need_a_test_deflection() {
    for tested in [false, true] {
        let mut bench = Bench::new();
        let (left, right) = (tvc_jet::LEFT_AILERON, tvc_jet::RIGHT_AILERON);
        let size_rad = Gains::REFERENCE.isolation.test_rad;
        let jam = |_: f64, positions: &PerEffector<f64>| with(positions, left, 0.3);
        let mut largest: f64 = 0.0;
        for _ in 0..2_000 {
            let mut added = PerEffector::default();
            if tested {
                let (rates, commands) = (Vector3::zeros(), PerEffector::default());
                added = bench.isolation.test(&commands, &rates, &bench.model, &bench.at, size_rad);
            }
            // Healthy ones cancel each other, on all axes.
            let moment = bench.model.effectors(&bench.at, &added);
            assert!(moment.norm() < 1.0e-12, "{moment}");
            largest = largest.max(added[left].abs()).max(added[right].abs());
            let moves = |t_s: f64, positions: &mut PerEffector<f64>| {
                let swing = 0.05 * libm::sin(1.1 * t_s);
                positions[left] = added[left] - swing;
                positions[right] = added[right] + swing;
            };
            bench.run(0.002, moves, jam);
        }
        let expected = if tested { [Some(left), None] } else { [None; 2] };
        assert_eq!(bench.named(), expected);
        let limit = if tested { size_rad } else { 0.0 };
        assert!((largest - limit).abs() < 1.0e-6, "{largest} rad");
    }
}

#[test]
fn a_test_waits_for_travel_and_for_a_calm_aircraft() {
    let model = DesignModel::new(testing::aircraft_model());
    let at = model.condition(model.design_point());
    let pair = [tvc_jet::LEFT_AILERON, tvc_jet::RIGHT_AILERON];
    let begins = |commands: &PerEffector<f64>, rate: f64, pair: [Effector; 2]| {
        let mut test = TestDeflection::default();
        test.propose([Some(pair[0]), None], [Some(pair[1]), None], 1_000_000);
        let rates = Vector3::new(rate, 0.0, 0.0);
        test.step(commands, &rates, &model, &at, 0.05, 0.002);
        test.step(commands, &rates, &model, &at, 0.05, 0.002);
        test.now_rad() != 0.0
    };
    let mut commands = PerEffector::default();
    assert!(begins(&commands, 0.0, pair));
    assert!(!begins(&commands, 0.3, pair));
    assert!(
        !begins(&commands, 0.0, [tvc_jet::RUDDER, tvc_jet::NOZZLE_YAW]),
        "they do not look alike"
    );
    // One aileron at each end: neither way round is there travel for both.
    commands[pair[0]] = model.aircraft().effectors.servos[pair[0]].max;
    commands[pair[1]] = model.aircraft().effectors.servos[pair[1]].min;
    assert!(!begins(&commands, 0.0, pair));
}

#[test]
fn only_a_verdict_that_may_be_used_is_known() {
    let mut bench = Bench::new();
    bench.run(3.0, manoeuvre, |_, positions| with(positions, tvc_jet::RUDDER, 0.2));
    let isolation = &bench.isolation;
    for mode in [IsolationMode::Report, IsolationMode::Test] {
        assert_eq!(isolation.known(mode), Known::default());
    }
    let known = isolation.known(IsolationMode::Use);
    assert!(!known.is_cleared(tvc_jet::RUDDER) && known.is_cleared(tvc_jet::NOZZLE_YAW));
}

proptest! {
    #[test]
    fn no_estimate_makes_it_leave_the_numbers(z2 in prop::array::uniform3(prop::num::f64::ANY)) {
        let mut bench = Bench::new();
        let levels = Gains::REFERENCE.activation.levels();
        let z2 = Vector3::from(z2);
        for step in 0..400 {
            manoeuvre(0.002 * f64::from(step), &mut bench.positions);
            let input = IsolationInput {
                z2: &z2,
                levels: &levels,
                level: 2.0,
                active: true,
                positions: &bench.positions,
                bandwidth: 50.0,
                model: &bench.model,
                at: &bench.at,
            };
            let log = bench.isolation.step(&input, &Gains::REFERENCE.isolation);
            if let Some(verdict) = log.verdict {
                prop_assert!((0.5..=1.0 + 1.0e-9).contains(&verdict.confidence), "{:?}", verdict);
                prop_assert!(verdict.values.iter().all(|value| value.is_finite()), "{:?}", verdict);
            }
        }
    }
}
