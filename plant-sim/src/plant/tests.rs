use super::*;
use crate::{Airframe, EarthModel, Scenario, ScheduledFault, scenario};
use icd::fault::{FaultKind, FaultState, Timing, Travel};
use icd::tvc_jet;
use icd::{Body, ControlPeriod, Effector, FlowAngles, PerEffector, Sample, Stamp};
use nalgebra::Vector3;

mod other_aircraft;

fn setup(earth: EarthModel) -> PlantSetup {
    let nominal =
        Scenario::from_toml("nominal.toml", scenario::NOMINAL, &tvc_jet::effectors()).unwrap();
    PlantSetup { earth, ..nominal.plant.setup(Airframe::paper(), 0, ControlPeriod::DEFAULT, 1_000) }
}

fn flat() -> PlantSetup {
    setup(EarthModel::Flat)
}

/// In flight: the report of the start is fetched.
fn plant(setup: &PlantSetup) -> Plant {
    let mut plant = Plant::new(setup).unwrap();
    assert!(matches!(plant.pop_report(), Some(PlantReport::Started { .. })));
    plant
}

/// Flies `ticks` periods with the trim commands plus `extra`.
fn fly(plant: &mut Plant, ticks: u32, extra: impl Fn(SimTime, &mut PerEffector<f64>)) {
    for _ in 0..ticks {
        let mut commands = plant.trim().positions();
        extra(plant.time(), &mut commands);
        plant.advance(&Actuators { commands });
    }
}

fn coast(plant: &mut Plant, ticks: u32) {
    fly(plant, ticks, |_, _| {});
}

fn wiggle(time: SimTime, commands: &mut PerEffector<f64>) {
    let s = libm::sin(5.0 * time.as_seconds());
    commands[tvc_jet::LEFT_ELEVATOR] += 0.02 * s;
    commands[tvc_jet::RIGHT_ELEVATOR] += 0.02 * s;
    commands[tvc_jet::RIGHT_AILERON] += 0.01 * s;
    commands[tvc_jet::RUDDER] -= 0.01 * s;
}

fn numbers(truth: &Truth) -> [f64; 12] {
    let (w, v, r, e) = (truth.body_rates.0, truth.velocity.0, truth.position.0, truth.euler());
    [w.x, w.y, w.z, v.x, v.y, v.z, r.x, r.y, r.z, e.phi, e.theta, e.psi]
}

fn apart(a: &Truth, b: &Truth) -> f64 {
    numbers(a).iter().zip(numbers(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn stuck(effector: Effector, angle_rad: f64, at_us: u64) -> ScheduledFault {
    let kind = FaultKind::StuckAt { angle_rad, travel: Travel::Jump };
    ScheduledFault {
        target: effector.into(),
        kind,
        timing: Timing::at(SimTime::from_micros(at_us)),
    }
}

#[test]
fn trimmed_flight_stays_level_for_ten_seconds() {
    // The phugoid is slow and stable here; what is left of the trim is rounding on the flat Earth, and the
    // changing latitude and heading on the round one.
    for (earth, metres) in [(EarthModel::Flat, 1e-6), (EarthModel::Wgs84, 0.05)] {
        let mut plant = plant(&setup(earth));
        coast(&mut plant, 5_000);
        let truth = plant.truth();
        assert!((truth.altitude_m - 5_000.0).abs() < metres, "{earth:?}: {} m", truth.altitude_m);
        assert!(truth.euler().phi.abs() < 1e-4, "{earth:?}: roll {} rad", truth.euler().phi);
        assert!((truth.normal_load_factor_g - 1.0).abs() < 0.01, "{earth:?}");
    }
}

#[test]
fn steady_wind_carries_the_aircraft_and_nothing_else() {
    let calm = flat();
    let mut windy = flat();
    windy.wind.speed_m_s = 20.0;
    windy.wind.towards_rad = 1.0;
    let (mut a, mut b) = (plant(&calm), plant(&windy));
    coast(&mut a, 1_000);
    coast(&mut b, 1_000);
    let (a, b) = (a.truth(), b.truth());
    assert!((a.airspeed_m_s - b.airspeed_m_s).abs() < 1e-9);
    let drift = b.position.0 - a.position.0;
    let expected = Vector3::new(libm::cos(1.0), libm::sin(1.0), 0.0) * 40.0;
    // 1 um: rounding of 500 m over a thousand steps.
    assert!((drift - expected).norm() < 1e-6, "drift {drift:?} m");
}

#[test]
fn quarter_steps_change_the_flight_by_a_millionth() {
    for earth in [EarthModel::Flat, EarthModel::Wgs84] {
        let coarse = setup(earth);
        let fine = PlantSetup { step_us: 250, ..coarse.clone() };
        let (mut a, mut b) = (plant(&coarse), plant(&fine));
        fly(&mut a, 1_500, wiggle);
        fly(&mut b, 1_500, wiggle);
        let error = apart(&a.truth(), &b.truth());
        // Rad, rad/s, m/s, m alike; the servos' rate limit is not smooth, so it is not RK4's 1e-12.
        assert!(error < 1e-6, "{earth:?}: {error} apart");
        assert!(a.truth().euler().phi.abs() > 0.01, "the flight must not be trivial");
    }
}

#[test]
fn the_same_setup_and_commands_give_the_same_bits() {
    let mut setup = setup(EarthModel::Wgs84);
    setup.wind.turbulence_m_s = 1.5;
    setup.sensors.gyro_noise_rad_s = 0.001;
    let (mut a, mut b) = (plant(&setup), plant(&setup));
    for _ in 0..500 {
        assert_eq!(a.sense(), b.sense());
        fly(&mut a, 1, wiggle);
        fly(&mut b, 1, wiggle);
        assert_eq!(a.truth(), b.truth());
    }
}

#[test]
fn another_run_has_another_gust_and_other_noise() {
    let mut first = flat();
    first.wind.turbulence_m_s = 1.5;
    first.sensors.gyro_noise_rad_s = 0.001;
    let second = PlantSetup { run: 1, ..first.clone() };
    let (mut a, mut b) = (plant(&first), plant(&second));
    assert_ne!(a.sense().gyro.value, b.sense().gyro.value);
    assert_ne!(a.truth().wind, b.truth().wind);
}

#[test]
fn gyro_noise_does_not_touch_the_flight_or_the_gusts() {
    let mut ideal = flat();
    ideal.wind.turbulence_m_s = 1.5;
    let mut noisy = ideal.clone();
    noisy.sensors.gyro_noise_rad_s = 0.01;
    let (mut a, mut b) = (plant(&ideal), plant(&noisy));
    for _ in 0..200 {
        a.sense();
        let sensed = b.sense();
        assert_ne!(sensed.gyro.value, b.truth().body_rates);
        coast(&mut a, 1);
        coast(&mut b, 1);
    }
    assert_eq!(a.truth(), b.truth());
}

#[test]
fn ideal_sensors_report_the_truth_to_the_bit() {
    let mut plant = plant(&setup(EarthModel::Wgs84));
    fly(&mut plant, 300, wiggle);
    let (truth, sensors) = (plant.truth(), plant.sense());
    assert_eq!(sensors.gyro, Sample::at(truth.time, truth.body_rates));
    assert_eq!(sensors.attitude, Sample::at(truth.time, truth.attitude));
    assert_eq!(sensors.vanes.value.sideslip_rad, truth.beta_rad);
    assert_eq!(sensors.engine_n.value, truth.deflections[tvc_jet::ENGINE]);
    assert!(sensors.stamps().iter().all(|s| *s == Stamp { time: truth.time, valid: true }));
}

#[test]
fn gusts_show_in_the_air_data() {
    let mut setup = flat();
    setup.wind.turbulence_m_s = 3.0;
    let mut plant = plant(&setup);
    coast(&mut plant, 2_000);
    let truth = plant.truth();
    let gust = truth.attitude.to_body(truth.wind).0;
    let air = truth.attitude.to_body(truth.velocity).0 - gust;
    assert!(gust.norm() > 0.3, "gust {} m/s", gust.norm());
    // The same sums in another order.
    assert!((truth.airspeed_m_s - air.norm()).abs() < 1e-9);
    assert!((truth.alpha_rad - libm::atan2(air.z, air.x)).abs() < 1e-12);
}

#[test]
fn vanes_and_pitot_tube_feel_the_gust_where_they_are() {
    let mut setup = flat();
    setup.wind.turbulence_m_s = 6.0;
    setup.airframe.air_data.pitot_m = [8.0, 2.0, -1.0];
    let mut plant = plant(&setup);
    let mut largest = [0.0_f64; 3];
    for _ in 0..5_000 {
        coast(&mut plant, 1);
        let (gust, motion) = (plant.inputs.gust, plant.present.motion);
        let (truth, sensors) = (plant.truth(), plant.sense());
        // Velocity of each place relative to the air there, less what the aircraft's own rotation adds.
        let vanes = motion.velocity.0 - gust.rates.0.cross(&Vector3::new(7.0, 0.0, 0.0));
        let pitot = motion.velocity.0 - gust.rates.0.cross(&Vector3::new(8.0, 2.0, -1.0));
        let expected =
            [pitot.norm(), libm::atan2(vanes.z, vanes.x), libm::asin(vanes.y / vanes.norm())];
        let FlowAngles { angle_of_attack_rad, sideslip_rad } = sensors.vanes.value;
        let sensed = [sensors.pitot_m_s.value, angle_of_attack_rad, sideslip_rad];
        let centre = [truth.airspeed_m_s, truth.alpha_rad, truth.beta_rad];
        for i in 0..3 {
            assert!((sensed[i] - expected[i]).abs() < 1e-9, "{i}: {} {}", sensed[i], expected[i]);
            largest[i] = largest[i].max((sensed[i] - centre[i]).abs());
        }
    }
    // 6 m/s: q_g and r_g have some 0.1 rad/s rms, so the vanes are 0.7 m/s off the centre, 0.003 rad; the pitot
    // tube, 2 m to the side, 0.2 m/s.
    assert!(largest[0] > 0.2 && largest[1] > 0.003 && largest[2] > 0.003, "{largest:?}");
}

#[test]
fn damping_sees_the_rates_relative_to_the_gust() {
    let plant = plant(&flat());
    let (state, mut inputs) = (plant.state, plant.inputs);
    let calm = plant.dynamics.present(&state, &inputs).motion;
    let rates = Body::new(0.05, -0.03, 0.02);
    inputs.gust.rates = rates;
    let gusty = plant.dynamics.present(&state, &inputs).motion;
    let mut turning = state;
    turning.rigid.rates = Body(state.rigid.rates.0 - rates.0);
    inputs.gust.rates = Body::zero();
    let against = plant.dynamics.present(&turning, &inputs).motion;
    // Air that turns with +p acts as an aircraft that turns with -p: the same moment, to rounding.
    assert!((gusty.wrench.moment.0 - against.wrench.moment.0).norm() < 1e-6);
    // Damping drags the aircraft along with the air, on each axis.
    let added = gusty.wrench.moment.0 - calm.wrench.moment.0;
    for axis in 0..3 {
        assert!(added[axis] * rates.0[axis] > 0.0, "axis {axis}: {} N m", added[axis]);
    }
    // The air itself does not turn the gyros.
    assert_eq!(plant.truth().body_rates, state.rigid.rates);
}

#[test]
fn angular_acceleration_is_the_slope_of_the_rates() {
    for earth in [EarthModel::Flat, EarthModel::Wgs84] {
        let setup =
            PlantSetup { period: ControlPeriod::from_micros(1_000).unwrap(), ..setup(earth) };
        let mut plant = plant(&setup);
        fly(&mut plant, 200, wiggle);
        let before = plant.truth();
        fly(&mut plant, 1, wiggle);
        let middle = plant.truth();
        fly(&mut plant, 1, wiggle);
        let slope = (plant.truth().body_rates.0 - before.body_rates.0) / 0.002;
        let error = (slope - middle.angular_acceleration.0).norm();
        // The commands step at the tick: the slope bends there by rate times step.
        assert!(error < 2e-3, "{earth:?}: {error} rad/s2");
        assert!(slope.norm() > 0.02, "{earth:?}: the flight must not be trivial");
    }
}

#[test]
fn a_fault_due_at_a_tick_shows_at_that_tick() {
    let mut setup = flat();
    setup.faults = vec![stuck(tvc_jet::RUDDER, 0.1, 4_000), stuck(tvc_jet::LEFT_ELEVATOR, 0.2, 0)];
    let mut plant = plant(&setup);
    assert_eq!(plant.truth().deflections[tvc_jet::LEFT_ELEVATOR], 0.2);
    coast(&mut plant, 1);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.0);
    coast(&mut plant, 1);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.1);
    assert!(plant.truth().angular_acceleration.0.z < 0.0, "the force acts at the same instant");
}

#[test]
fn a_fault_between_ticks_acts_at_its_exact_time() {
    // A rudder stuck for 5300.7 us more or less: yaw rate grows linearly with the time it had.
    let yaw_after = |at_us| {
        let mut setup = flat();
        setup.faults = vec![stuck(tvc_jet::RUDDER, 0.1, at_us)];
        let mut plant = plant(&setup);
        coast(&mut plant, 10);
        let reports = std::iter::from_fn(|| plant.pop_report()).collect::<Vec<_>>();
        let at = SimTime::from_micros(at_us);
        let states = [FaultState::Scheduled { at }, FaultState::Active { since: at }];
        assert!(matches!(reports[..],
            [PlantReport::Fault(first), PlantReport::Fault(second)]
                if [first.state, second.state] == states));
        plant.truth().body_rates.0.z
    };
    let (early, late) = (yaw_after(15_000), yaw_after(14_463));
    let ratio = late / early;
    // 5.537 ms against 5 ms; damping in 5 ms is below a percent.
    assert!((ratio - 5.537 / 5.0).abs() < 0.005, "ratio {ratio}");
}

#[test]
fn a_fault_without_effect_splits_a_step_and_leaves_the_grid() {
    // Stuck where it stands in trim: only the split of one step at 3.333 ms remains.
    let healthy = flat();
    let mut split = flat();
    split.faults = vec![ScheduledFault {
        target: tvc_jet::NOZZLE_YAW.into(),
        kind: FaultKind::StuckHere,
        timing: Timing { duration_s: Some(0.000_444), ..Timing::at(SimTime::from_micros(3_333)) },
    }];
    let (mut a, mut b) = (plant(&healthy), plant(&split));
    fly(&mut a, 500, wiggle);
    fly(&mut b, 500, wiggle);
    assert_eq!(a.time(), b.time());
    let error = apart(&a.truth(), &b.truth());
    // One step of 1 ms cut in three: its own error of some 1e-13, amplified a little.
    assert!(error < 1e-10, "{error} apart");
}

#[test]
fn a_stuck_surface_moves_back_at_its_own_rate_when_it_is_mended() {
    let mut setup = flat();
    setup.faults = vec![ScheduledFault {
        timing: Timing { duration_s: Some(0.02), ..Timing::at(SimTime::ZERO) },
        ..stuck(tvc_jet::RUDDER, 0.3, 0)
    }];
    let mut plant = plant(&setup);
    coast(&mut plant, 10);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.3);
    coast(&mut plant, 5);
    let expected = 0.3 - 80.0_f64.to_radians() * 0.01;
    let ours = plant.truth().deflections[tvc_jet::RUDDER];
    assert!((ours - expected).abs() < 1e-12, "{ours} rad instead of {expected}");
}

#[test]
fn a_travelling_surface_arrives_exactly_and_stays() {
    let mut setup = flat();
    setup.faults = vec![ScheduledFault {
        kind: FaultKind::StuckAt { angle_rad: 0.3, travel: Travel::AtActuatorRate },
        ..stuck(tvc_jet::RUDDER, 0.3, 0)
    }];
    let mut plant = plant(&setup);
    coast(&mut plant, 50);
    let on_the_way = plant.truth().deflections[tvc_jet::RUDDER];
    assert!((on_the_way - 80.0_f64.to_radians() * 0.1).abs() < 1e-12, "{on_the_way} rad");
    coast(&mut plant, 100);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.3);
}

#[test]
fn half_the_engine_gives_half_the_thrust() {
    let mut plant = plant(&flat());
    let request = FaultRequest::Inject {
        target: tvc_jet::ENGINE.into(),
        kind: FaultKind::PartialLoss { remaining: 0.5 },
        timing: Timing::NOW,
    };
    assert_eq!(plant.request(&request), FaultReply::Applied { at: SimTime::ZERO });
    let thrust = plant.trim().thrust_n;
    assert_eq!(plant.truth().deflections[tvc_jet::ENGINE], 0.5 * thrust);
    assert_eq!(plant.sense().engine_n.value, 0.5 * thrust);
}

#[test]
fn positive_effectors_turn_the_aircraft_as_the_interface_document_defines() {
    let table = [
        (tvc_jet::LEFT_AILERON, [1.0, 0.0, 1.0]),
        (tvc_jet::RIGHT_AILERON, [-1.0, 0.0, -1.0]),
        (tvc_jet::LEFT_ELEVATOR, [1.0, -1.0, 1.0]),
        (tvc_jet::RIGHT_ELEVATOR, [-1.0, -1.0, -1.0]),
        (tvc_jet::RUDDER, [1.0, 0.0, -1.0]),
        (tvc_jet::NOZZLE_PITCH, [0.0, 1.0, 0.0]),
        (tvc_jet::NOZZLE_YAW, [0.0, 0.0, 1.0]),
    ];
    for (effector, signs) in table {
        let mut setup = flat();
        setup.faults = vec![stuck(effector, 0.1, 0)];
        let acceleration = plant(&setup).truth().angular_acceleration.0;
        for (axis, sign) in signs.into_iter().enumerate() {
            let ours = acceleration[axis];
            if sign == 0.0 {
                // Nozzle yaw rolls a little through the product of inertia; pitch is untouched by the rest.
                assert!(ours.abs() < 0.03, "{effector:?}, axis {axis}: {ours} rad/s2");
            } else {
                assert!(ours * sign > 0.01, "{effector:?}, axis {axis}: {ours} rad/s2");
            }
        }
    }
}

#[test]
fn val_effectiveness_at_the_design_point_is_that_of_the_parameter_set() {
    // docs/parameter-set.md, section 8: rad/s2 per rad, printed with three decimals.
    let table = [
        (tvc_jet::LEFT_AILERON, [4.845, 0.0, 0.209]),
        (tvc_jet::LEFT_ELEVATOR, [5.712, -0.847, 0.246]),
        (tvc_jet::RIGHT_ELEVATOR, [-5.712, -0.847, -0.246]),
        (tvc_jet::RUDDER, [13.470, 0.0, -5.751]),
        (tvc_jet::NOZZLE_PITCH, [0.0, 2.329, 0.0]),
        (tvc_jet::NOZZLE_YAW, [0.213, 0.0, 2.064]),
    ];
    for (effector, printed) in table {
        let mut setup = flat();
        // 1 mrad: the nozzle's sine is linear to 2e-7.
        setup.faults = vec![stuck(effector, 0.001, 0)];
        let ours = plant(&setup).truth().angular_acceleration.0 * 1_000.0;
        for axis in 0..3 {
            let (ours, printed) = (ours[axis], printed[axis]);
            assert!(
                (ours - printed).abs() < 1e-3,
                "{effector:?}, axis {axis}: {ours}, not {printed}"
            );
        }
    }
}

#[test]
fn a_mirrored_flight_is_mirrored_to_the_bit() {
    let side = |mirrored: bool| {
        let mut setup = flat();
        let effector = if mirrored { tvc_jet::RIGHT_ELEVATOR } else { tvc_jet::LEFT_ELEVATOR };
        setup.faults = vec![stuck(effector, 0.3, 500_000)];
        let mut plant = plant(&setup);
        fly(&mut plant, 1_000, |time, commands| {
            wiggle(time, commands);
            if mirrored {
                let c = *commands;
                *commands = PerEffector::from_fn(|e| c[tvc_jet::effectors().mirrored(e)]);
                commands[tvc_jet::RUDDER] = -c[tvc_jet::RUDDER];
            }
        });
        plant.truth()
    };
    let (left, right) = (side(false), side(true));
    let mirror = [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
    for ((left, right), sign) in numbers(&left).into_iter().zip(numbers(&right)).zip(mirror) {
        assert_eq!(left, sign * right);
    }
    assert!(left.euler().phi > 0.1, "the flight must not be trivial: {} rad", left.euler().phi);
}

#[test]
fn the_flight_ends_on_the_ground_and_stays_there() {
    let mut setup = flat();
    setup.start.altitude_m = 50.0;
    setup.start.airspeed_m_s = 200.0;
    let mut plant = plant(&setup);
    let dive = |_: SimTime, commands: &mut PerEffector<f64>| {
        commands[tvc_jet::LEFT_ELEVATOR] = 0.3;
        commands[tvc_jet::RIGHT_ELEVATOR] = 0.3;
    };
    fly(&mut plant, 3_000, dive);
    assert!(plant.on_ground());
    let (truth, time) = (plant.truth(), plant.time());
    assert!(truth.altitude_m <= 0.0 && truth.altitude_m > -2.0, "{} m", truth.altitude_m);
    assert_eq!(plant.pop_report(), Some(PlantReport::GroundContact { at: time }));
    fly(&mut plant, 10, dive);
    assert_eq!((plant.truth(), plant.time(), plant.pop_report()), (truth, time, None));
    let request = FaultRequest::Clear { target: tvc_jet::RUDDER.into() };
    assert_eq!(plant.request(&request), FaultReply::Refused(Refusal::FlightOver));
    assert!(!plant.is_broken());
}

#[test]
fn commands_that_are_no_numbers_change_nothing() {
    let (mut a, mut b) = (plant(&flat()), plant(&flat()));
    fly(&mut a, 10, wiggle);
    fly(&mut b, 10, wiggle);
    for _ in 0..10 {
        a.advance(&Actuators { commands: a.inputs.commands });
        b.advance(&Actuators { commands: PerEffector::from_fn(|_| f64::NAN) });
    }
    assert_eq!(a.truth(), b.truth());
}

#[test]
fn the_wildest_commands_keep_every_number_finite() {
    let mut setup = setup(EarthModel::Wgs84);
    setup.wind.turbulence_m_s = 3.0;
    let mut plant = plant(&setup);
    let mut worst = 0.0_f64;
    fly(&mut plant, 15_000, |time, commands| {
        let sign = if (time.as_micros() / 700_000).is_multiple_of(2) { 1.0 } else { -1.0 };
        *commands =
            PerEffector::from_fn(|e| if e.index() % 2 == 0 { sign * 1e9 } else { -sign * 1e9 });
    });
    for number in numbers(&plant.truth()) {
        assert!(number.is_finite());
        worst = worst.max(number.abs());
    }
    assert!(!plant.is_broken() && worst > 1.0);
}

#[test]
fn an_airframe_that_blows_up_ends_the_flight_in_its_last_good_state() {
    let mut setup = flat();
    assert!(setup.airframe.change_derivative("Cmq", |value| *value = 100.0));
    assert!(setup.airframe.change_derivative("Clp", |value| *value = 50.0));
    let mut plant = plant(&setup);
    fly(&mut plant, 20_000, wiggle);
    assert!(plant.on_ground());
    assert!(plant.is_broken(), "altitude {} m", plant.truth().altitude_m);
    assert!(plant.broken_by().is_some_and(|quantity| !quantity.is_empty()));
    assert!(numbers(&plant.truth()).iter().all(|x| x.is_finite()));
}

#[test]
fn reports_are_bounded_and_the_oldest_go_first() {
    let mut plant = plant(&flat());
    let effector = tvc_jet::RUDDER;
    for _ in 0..REPORTS_MAX {
        let (kind, timing) = (FaultKind::Float, Timing::NOW);
        plant.request(&FaultRequest::Inject { target: effector.into(), kind, timing });
        plant.request(&FaultRequest::Clear { target: effector.into() });
    }
    let waiting = std::iter::from_fn(|| plant.pop_report()).count();
    assert_eq!((waiting, plant.reports_dropped()), (REPORTS_MAX, REPORTS_MAX as u64));
}

#[test]
fn a_setup_that_cannot_be_is_refused_with_the_reason() {
    let refusal = |change: fn(&mut PlantSetup)| {
        let mut setup = flat();
        change(&mut setup);
        Plant::new(&setup).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|s| s.step_us = 300),
        "integration step 300 us does not divide the control period of 2000 us"
    );
    assert_eq!(
        refusal(|s| s.airframe.mass.mass_kg = f64::NAN),
        "[mass] mass_kg = NaN is outside 1 to 1000000"
    );
    assert_eq!(
        refusal(|s| s.faults = vec![stuck(tvc_jet::ENGINE, 0.1, 0)]),
        "fault 1 (engine, stuck at 5.7 deg): this effector has no such fault"
    );
    assert_eq!(
        refusal(|s| {
            let timing = Timing { duration_s: Some(0.0), ..Timing::NOW };
            s.faults = vec![ScheduledFault { timing, ..stuck(tvc_jet::RUDDER, 0.1, 5) }];
        }),
        "fault 1 (rudder, stuck at 5.7 deg): duration 0 s is outside 0.0001 to 2592000 s"
    );
    assert!(refusal(|s| s.start.airspeed_m_s = 40.0).contains("level flight"));
}

#[test]
fn every_step_that_divides_the_period_is_allowed() {
    for (period, step_us) in
        [(1_000, 1_000), (2_500, 500), (2_500, 2_500), (4_000, 1), (3_001, 3_001)]
    {
        let period = ControlPeriod::from_micros(period).unwrap();
        let mut plant = plant(&PlantSetup { period, step_us, ..flat() });
        coast(&mut plant, 3);
        assert_eq!(plant.time().as_micros(), 3 * u64::from(period.as_micros()));
    }
}

#[test]
fn body_rates_of_level_flight_on_the_round_earth_are_those_of_the_earth_and_the_way() {
    let truth = plant(&setup(EarthModel::Wgs84)).truth();
    let rate = truth.attitude.to_ned(truth.body_rates).0;
    let radius = crate::geodesy::radii(libm::sin(truth.latitude_rad)).meridian_m + 5_000.0;
    let expected = -truth.velocity.0.x / radius;
    // Northbound: the nose follows the curvature, about the axis to the east.
    assert!((rate.y / expected - 1.0).abs() < 1e-9, "{} rad/s instead of {expected}", rate.y);
    assert_ne!(truth.body_rates, Body::zero());
}

#[test]
fn the_first_report_is_where_the_healthy_effectors_stand_whatever_is_broken_at_time_zero() {
    let mut healthy = flat();
    healthy.start.altitude_m = 10_000.0;
    healthy.start.airspeed_m_s = 180.0;
    let mut broken = healthy.clone();
    let flame_out = ScheduledFault {
        target: tvc_jet::ENGINE.into(),
        kind: FaultKind::FlameOut,
        timing: Timing::at(SimTime::ZERO),
    };
    broken.faults = vec![stuck(tvc_jet::LEFT_ELEVATOR, 0.1, 0), flame_out];
    let [mut healthy, mut broken] = [healthy, broken].map(|setup| Plant::new(&setup).unwrap());
    assert_ne!(healthy.truth().deflections, broken.truth().deflections, "the faults act");
    let started = healthy.pop_report();
    assert_eq!(broken.pop_report(), started);
    let Some(PlantReport::Started { positions }) = started else { panic!("{started:?}") };
    assert_eq!(positions, healthy.truth().deflections);
    coast(&mut broken, 3);
    let later = std::iter::from_fn(|| broken.pop_report());
    assert!(later.into_iter().all(|report| matches!(report, PlantReport::Fault(_))));
}
