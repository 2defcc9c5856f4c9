use super::*;
use crate::signals::Side;
use crate::testing;

/// Asks for the same whatever happens, and remembers that it was started.
struct Constant {
    command: MainCommand,
    started: bool,
}

impl Constant {
    fn new(aileron_rad: f64) -> Self {
        let command = MainCommand { aileron_rad, thrust_n: 2.0e4, ..MainCommand::default() };
        Self { command, started: false }
    }
}

impl Law for Constant {
    fn step(&mut self, _: &LawInput<'_>) -> MainCommand {
        self.command
    }
    fn start_from(&mut self, _: &LawInput<'_>, _: &MainCommand) {
        self.started = true;
    }
}

fn selected(main: MainLaw) -> Gains {
    let mut gains = Gains::REFERENCE;
    gains.selection.main = main;
    gains
}

fn controller(main: MainLaw) -> MainController {
    let model = DesignModel::new(testing::aircraft_model());
    MainController::new(&selected(main), &model, ControlPeriod::DEFAULT)
}

/// A turn that is not quite on its references, so that every integrator has something to do.
fn step(controller: &mut MainController, own: Option<&mut dyn Law>) -> MainCommand {
    let model = DesignModel::new(testing::aircraft_model());
    let mut state = testing::level_state();
    state.attitude.phi = 0.1;
    state.altitude_m += 4.0;
    state.airspeed_m_s -= 1.0;
    state.beta = 0.01;
    let at = model.condition(&state);
    let saturated = Saturation::default();
    controller.step(&state, &at, &testing::level_demand(), &saturated, &model, own)
}

/// Largest difference of two commands; thrust in units of 1e5 N.
fn difference(a: &MainCommand, b: &MainCommand) -> f64 {
    let d = a.combine(b, |a, b| (a - b).abs());
    let angles =
        [d.aileron_rad, d.elevator_rad, d.rudder_rad, d.nozzle_pitch_rad, d.nozzle_yaw_rad];
    angles.into_iter().fold(d.thrust_n / 1.0e5, f64::max)
}

/// Each built-in law and one that a program brings.
fn every_law() -> impl Iterator<Item = MainLaw> {
    MainLaw::NAMES.iter().map(|(_, law)| *law)
}

#[test]
fn a_law_takes_over_from_any_other_without_a_bump() {
    /// Largest change in one period, rad: a tenth of the smallest deflection that moves the aircraft visibly.
    const BUMP_MAX_RAD: f64 = 1.0e-3;
    for (from, to) in every_law().flat_map(|from| every_law().map(move |to| (from, to))) {
        let mut own = Constant::new(0.05);
        let mut controller = controller(from);
        let mut last = step(&mut controller, Some(&mut own));
        for _ in 0..1000 {
            last = step(&mut controller, Some(&mut own));
        }
        controller.set_gains(&selected(to));
        // 3 s: the switch, the fade, and its end.
        for tick in 0..1500 {
            let command = step(&mut controller, Some(&mut own));
            let bump = difference(&command, &last);
            assert!(bump < BUMP_MAX_RAD, "{from:?} to {to:?}, step {tick}: {bump} rad");
            last = command;
        }
        assert_eq!(own.started, from != to && to == MainLaw::Own);
    }
}

#[test]
fn the_integrators_of_the_pid_start_from_the_commands_of_the_law_before() {
    let mut own = Constant::new(0.05);
    let mut controller = controller(MainLaw::Own);
    step(&mut controller, Some(&mut own));
    controller.set_gains(&selected(MainLaw::Pid));
    step(&mut controller, None);
    let transfer = controller.transfer.unwrap().difference;
    // The roll integrator reaches the 0.05 rad; one step of it is what differs.
    assert!(transfer.aileron_rad.abs() < 1.0e-5, "{} rad", transfer.aileron_rad);
    assert!(transfer.thrust_n.abs() < 1.0, "{} N", transfer.thrust_n);
}

#[test]
fn after_the_fade_the_new_law_is_alone() {
    let mut own = Constant::new(0.05);
    let mut controller = controller(MainLaw::Pid);
    step(&mut controller, Some(&mut own));
    controller.set_gains(&selected(MainLaw::Own));
    let mut command = step(&mut controller, Some(&mut own));
    assert!((command.aileron_rad - 0.05).abs() > 0.01, "still the PID's");
    for _ in 0..1001 {
        command = step(&mut controller, Some(&mut own));
    }
    assert_eq!(command, own.command);
}

#[test]
fn a_law_that_asks_for_nonsense_keeps_its_last_finite_commands_and_is_flagged() {
    for bad in [f64::NAN, f64::INFINITY, -1.0e300] {
        let mut own = Constant::new(0.05);
        let mut controller = controller(MainLaw::Own);
        let good = step(&mut controller, Some(&mut own));
        assert!(!controller.implausible());
        own.command.aileron_rad = bad;
        assert_eq!(step(&mut controller, Some(&mut own)), good);
        assert!(controller.implausible(), "{bad}");
    }
}

#[test]
fn without_a_law_of_its_own_the_pid_flies() {
    let (mut own, mut pid) = (controller(MainLaw::Own), controller(MainLaw::Pid));
    for _ in 0..10 {
        assert_eq!(step(&mut own, None), step(&mut pid, None));
    }
}

#[test]
fn the_integral_stops_at_its_limit_and_comes_back_at_once() {
    let mut integral = Integral::default();
    for _ in 0..100 {
        integral.add(0.1, 0.5);
    }
    assert_eq!(integral.value(), 0.5);
    integral.add(-0.1, 0.5);
    assert!((integral.value() - 0.4).abs() < 1.0e-15);
}

#[test]
fn a_climb_over_a_ground_goes_on_and_without_a_ground_the_references_begin_at_the_aircraft() {
    let begins = |law, height_m: Option<f64>, climb_m_s: f64, towards_m: f64| {
        let mut state = testing::level_state();
        state.velocity.0.z = -climb_m_s;
        state.over_ground = height_m.is_some();
        state.height_above_ground_m = height_m;
        let mut demand = testing::level_demand();
        demand.altitude_m = state.altitude_m + towards_m;
        controller(law).track(&state, &demand).altitude_m - state.altitude_m
    };
    let slew_m = Gains::REFERENCE.references.slew_m_s * ControlPeriod::DEFAULT.as_seconds();
    // The NDI climbs by 0.2 m/s for each metre.
    let lead_m = begins(MainLaw::Ndi, Some(10.0), 3.0, 500.0) - slew_m;
    assert!((lead_m - 15.0).abs() < 1.0e-9, "{lead_m} m");
    let lead_m = begins(MainLaw::Pid, Some(10.0), 300.0, 5_000.0) - slew_m;
    let seen_m = Gains::REFERENCE.pid.altitude.error_max_m;
    assert!((lead_m - seen_m).abs() < 1.0e-9, "no more than the law sees: {lead_m} m");
    // (0.00672 + 0.898 / 264) / 0.00217 s.
    let lead_m = begins(MainLaw::Lqr, Some(10.0), 10.0, 500.0) - slew_m;
    assert!((lead_m - 46.6).abs() < 0.1, "{lead_m} m");
    assert_eq!(begins(MainLaw::Pid, Some(10.0), 3.0, 10.0), 10.0, "no more than is asked for");
    for (height_m, climb_m_s, towards_m) in
        [(None, 3.0, 500.0), (Some(10.0), -3.0, 500.0), (Some(10.0), 3.0, -500.0)]
    {
        let change_m = begins(MainLaw::Pid, height_m, climb_m_s, towards_m);
        assert!((change_m.abs() - slew_m).abs() < 1.0e-9, "{change_m} m");
    }
}

#[test]
fn over_a_ground_no_integrator_waits_for_a_climb_that_the_engine_cannot_give() {
    let model = DesignModel::new(testing::aircraft_model());
    for law in [MainLaw::Lqr, MainLaw::Ndi] {
        // Far below its altitude, or far above it, and in level flight.
        let grown = |towards_m: f64, thrust: Side| {
            let mut state = testing::level_state();
            state.over_ground = true;
            let mut demand = testing::level_demand();
            demand.altitude_m += towards_m;
            let saturated = Saturation { thrust, ..Saturation::default() };
            let mut gains = selected(law);
            gains.references.slew_m_s = 1.0e6;
            let mut controller = MainController::new(&gains, &model, ControlPeriod::DEFAULT);
            let at = model.condition(&state);
            let mut elevator =
                || controller.step(&state, &at, &demand, &saturated, &model, None).elevator_rad;
            let first = elevator();
            let last = (0..500).map(|_| elevator()).last().unwrap();
            last - first
        };
        for (towards_m, limit, other) in
            [(1_000.0, Side::Above, Side::Below), (-1_000.0, Side::Below, Side::Above)]
        {
            let free = grown(towards_m, Side::Inside);
            assert!(free * towards_m < 0.0 && free.abs() > 1.0e-3, "{law:?}, {towards_m}: {free}");
            assert_eq!(grown(towards_m, other), free, "{law:?}, {towards_m}");
            assert!(grown(towards_m, limit).abs() < 0.1 * free.abs(), "{law:?}, {towards_m}");
        }
    }
}
