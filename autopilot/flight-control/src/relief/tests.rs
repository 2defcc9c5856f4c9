use super::*;
use crate::testing;
use icd::tvc_jet;
use proptest::prelude::*;

const PERIOD: ControlPeriod = ControlPeriod::DEFAULT;

struct Bench {
    relief: Relief,
    model: DesignModel,
    mixer: Mixer,
    state: NavigationState,
    main: MainCommand,
    gains: ReliefGains,
}

impl Bench {
    fn new(aircraft: crate::AircraftModel) -> Self {
        let model = DesignModel::new(aircraft);
        let main = MainCommand { thrust_n: aircraft.trim.thrust_n, ..MainCommand::default() };
        Self {
            relief: Relief::new(PERIOD),
            mixer: Mixer::new(&aircraft.effectors),
            state: NavigationState {
                specific_force: icd::Body::new(0.0, 0.0, -9.8),
                ..*model.design_point()
            },
            model,
            main,
            gains: ReliefGains::REFERENCE,
        }
    }

    fn jet() -> Self {
        Self::new(testing::aircraft_model())
    }

    fn step(&mut self, z2: Vector3<f64>, fade: f64) -> Relieved {
        let Self { model, mixer, state, main, gains, .. } = self;
        self.relief.observe(&z2, fade, model, &ActivationGains::REFERENCE, gains);
        let at = &model.condition(state);
        let airspeed_reference_m_s = 264.0;
        let known = &Known::default();
        let input =
            ReliefInput { state, at, airspeed_reference_m_s, fade, main, model, mixer, known };
        self.relief.step(&input, gains)
    }

    /// The last of this many steps.
    fn steps(&mut self, count: u32, z2: Vector3<f64>) -> Relieved {
        (0..count).map(|_| self.step(z2, 1.0)).last().unwrap()
    }
}

#[test]
fn asleep_the_commands_are_those_of_the_main_controller_to_the_bit() {
    let mut bench = Bench::jet();
    let relieved = bench.step(Vector3::new(0.3, -0.2, 0.1), 0.0);
    assert_eq!(relieved.mixed, bench.mixer.mix(&bench.main, &Compensation::NONE));
    assert_eq!(relieved.health, CompensationHealth::default());
}

#[test]
fn inside_the_travel_the_commands_are_those_of_the_paper() {
    let mut bench = Bench::jet();
    let relieved = bench.step(Vector3::new(2.0, -0.3, 0.1), 1.0);
    let paper = bench.mixer.mix(&bench.main, &relieved.compensation);
    for effector in tvc_jet::ALL {
        let difference = relieved.mixed.commands[effector] - paper.commands[effector];
        assert!(difference.abs() < 1.0e-6, "{effector:?}: {difference} rad");
    }
}

#[test]
fn what_is_missing_in_yaw_lets_the_ailerons_hold_against_the_dihedral_roll() {
    let mut bench = Bench::jet();
    // A rudder that yaws to the left with more than the nozzle has.
    let z2 = Vector3::new(0.0, 0.0, -0.8);
    let straight = bench.steps(500, z2);
    assert!(straight.log.relief > 0.9 && straight.log.yaw_shortage > 0.1, "{:?}", straight.log);
    let mut slipping = Bench::jet();
    slipping.state.beta = 0.05;
    let slipping = slipping.steps(500, z2);
    // The wind from the right rolls to the left; a positive aileron command does too.
    let roll = |relieved: &Relieved| relieved.mixed.applied.aileron_rad;
    assert!(roll(&slipping) < roll(&straight) - 0.05, "{} {}", roll(&slipping), roll(&straight));
}

#[test]
fn the_rudder_stays_with_the_main_controller() {
    let mut bench = Bench::jet();
    bench.main.rudder_rad = 0.1;
    let relieved = bench.steps(100, Vector3::new(0.0, 0.0, -0.8));
    assert_eq!(relieved.mixed.commands[tvc_jet::RUDDER], 0.1);
}

#[test]
fn the_thrust_floor_holds_while_the_nozzle_needs_it_and_goes_with_the_need() {
    let mut bench = Bench::jet();
    bench.main.thrust_n = 8_000.0;
    // As a jammed elevator pitches: two thirds of the nozzle at the thrust of level flight.
    let relieved = bench.steps(2_000, Vector3::new(0.0, -0.4, 0.0));
    assert!(relieved.health.thrust_floor, "{:?}", relieved.log);
    let thrust_n = relieved.mixed.commands[tvc_jet::ENGINE];
    assert!((18_000.0..27_000.0).contains(&thrust_n), "{thrust_n} N");
    assert_eq!(relieved.mixed.saturation.thrust, Side::Below, "the speed integrator waits");
    let relieved = bench.steps(2_000, Vector3::zeros());
    assert!(!relieved.health.thrust_floor && relieved.mixed.commands[tvc_jet::ENGINE] == 8_000.0);
}

#[test]
fn an_aircraft_without_nozzle_is_allocated_to_all_its_surfaces() {
    let mut bench = Bench::new(testing::aerosonde());
    let z2 = Vector3::new(1.0, 3.0, 0.3);
    let relieved = bench.steps(3, z2);
    let at = bench.model.condition(&bench.state);
    let given = bench.model.effectors(&at, &relieved.mixed.increments);
    assert!((given + z2).norm() < 0.05 * z2.norm(), "{given} for {z2}");
}

proptest! {
    #[test]
    fn commands_are_inside_the_travel_for_any_estimate_and_command(
        z2 in proptest::array::uniform3(-1.0e6..1.0e6_f64), main in proptest::array::uniform4(-1.0e6..1.0e6_f64),
        rates in proptest::array::uniform3(-100.0..100.0_f64), beta in -3.2..3.2_f64, thrust_n in -1.0e8..1.0e8_f64,
    ) {
        let mut bench = Bench::jet();
        bench.state = NavigationState { rates: rates.into(), beta, thrust_n, ..bench.state };
        let [aileron_rad, elevator_rad, rudder_rad, thrust_n] = main;
        bench.main = MainCommand { aileron_rad, elevator_rad, rudder_rad, thrust_n, ..MainCommand::default() };
        for _ in 0..5 {
            let relieved = bench.step(z2.into(), 1.0);
            for effector in tvc_jet::ALL {
                let servo = &bench.model.aircraft().effectors.servos[effector];
                let command = relieved.mixed.commands[effector];
                prop_assert!((servo.min..=servo.max).contains(&command), "{effector:?}: {command}");
            }
        }
    }

    /// A fault on the other side is flown mirrored.
    #[test]
    fn mirrored_estimates_give_mirrored_commands(roll in -6.0..6.0_f64, yaw in -1.0..1.0_f64, beta in -0.2..0.2_f64) {
        let fly = |sign: f64| {
            let mut bench = Bench::jet();
            bench.state.beta = sign * beta;
            bench.steps(50, Vector3::new(sign * roll, -0.4, sign * yaw)).mixed.commands
        };
        let (one, other) = (fly(1.0), fly(-1.0));
        let pairs = [
            (tvc_jet::LEFT_AILERON, tvc_jet::RIGHT_AILERON, 1.0),
            (tvc_jet::LEFT_ELEVATOR, tvc_jet::RIGHT_ELEVATOR, 1.0),
            (tvc_jet::NOZZLE_YAW, tvc_jet::NOZZLE_YAW, -1.0),
            (tvc_jet::NOZZLE_PITCH, tvc_jet::NOZZLE_PITCH, 1.0),
        ];
        for (here, there, sign) in pairs {
            prop_assert!((one[here] - sign * other[there]).abs() < 1.0e-6, "{here:?}");
        }
    }
}
