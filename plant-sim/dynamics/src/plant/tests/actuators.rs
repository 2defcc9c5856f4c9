use super::*;
use aircraft::DEFAULT_AIRFRAME;
use icd::fault::Side;

const PERIOD_S: f64 = 0.002;
const LAG_S: f64 = 0.05;

/// The paper's aircraft with more keys at its rudder.
fn with(more: &str) -> Airframe {
    let text = DEFAULT_AIRFRAME.replacen(
        "name = \"rudder\"\n",
        &format!("name = \"rudder\"\n{more}\n"),
        1,
    );
    Airframe::from_toml("jet.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// Position of the rudder, deg, at the end of each period, while the aircraft is held in its trimmed flight at `speed` times
/// its airspeed, and the rudder is commanded there, deg, at these times, s.
fn held(plant: &mut Plant, speed: f64, seconds: f64, command: impl Fn(f64) -> f64) -> Vec<f64> {
    let ticks = (seconds / PERIOD_S).round() as usize;
    let mut rigid = plant.trim().rigid;
    rigid.velocity.0 *= speed;
    let mut positions = Vec::with_capacity(ticks);
    for _ in 0..ticks {
        plant.resume_from(&State { rigid, ..*plant.state() });
        let mut commands = plant.trim().positions();
        commands[tvc_jet::RUDDER] = command(plant.time().as_seconds()).to_radians();
        plant.advance(&Actuators::new(commands));
        positions.push(plant.truth().positions[tvc_jet::RUDDER].to_degrees());
    }
    positions
}

fn moved(more: &str, seconds: f64, command: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut plant = plant(&PlantSetup { airframe: with(more), ..flat() });
    held(&mut plant, 1.0, seconds, command)
}

/// Up and down between plus and minus one, from zero, with a period of 4 s.
fn triangle(time_s: f64) -> f64 {
    let part = (time_s / 4.0 + 0.25) % 1.0;
    if part < 0.5 { 4.0 * part - 1.0 } else { 3.0 - 4.0 * part }
}

#[test]
fn val_a_second_order_servo_takes_the_place_of_the_lag_and_steps_by_the_formula() {
    let positions = moved("natural_frequency_rad_s = 30\ndamping_ratio = 0.6", 0.5, |_| 2.0);
    for (tick, at) in positions.iter().enumerate() {
        let (zeta, x) = (0.6, 30.0 * PERIOD_S * (tick + 1) as f64);
        let root = 0.8;
        let (sin, cos) = libm::sincos(root * x);
        let expected = 2.0 * (1.0 - libm::exp(-zeta * x) * (cos + zeta / root * sin));
        // RK4 at 1 ms: (0.03)^4 of the step.
        assert!((at - expected).abs() < 2.0e-6, "tick {tick}: {at} deg, {expected} deg");
    }
    let most = positions.iter().fold(0.0_f64, |most, at| most.max(*at));
    assert!(most > 2.18, "the overshoot of a damping of 0.6 is 9.5 %: {most} deg");
}

#[test]
fn a_second_order_servo_keeps_the_rate_limit_and_a_fault_makes_it_slower() {
    let fastest = |positions: &[f64]| {
        positions.windows(2).map(|two| two[1] - two[0]).fold(0.0, f64::max) / PERIOD_S
    };
    let setup = PlantSetup { airframe: with("natural_frequency_rad_s = 60"), ..flat() };
    let mut healthy = plant(&setup);
    let rate = fastest(&held(&mut healthy, 1.0, 1.0, |_| 25.0));
    assert!((rate - 80.0).abs() < 1.0e-9, "{rate} deg/s");
    let mut slow = plant(&setup);
    let kind = FaultKind::Slow { rate: 10.0_f64.to_radians() };
    let inject =
        |kind| FaultRequest::Inject { target: tvc_jet::RUDDER.into(), kind, timing: Timing::NOW };
    slow.request(&inject(kind));
    let positions = held(&mut slow, 1.0, 1.0, |_| 5.0);
    let rate = fastest(&positions);
    assert!((rate - 10.0).abs() < 1.0e-9, "{rate} deg/s");
    let most = positions.iter().fold(0.0_f64, |most, at| most.max(*at));
    assert!(most < 5.05, "no rate winds up behind the fault: {most} deg");
    // Stuck, it has no rate, and starts from rest after the repair.
    slow.request(&inject(FaultKind::StuckHere));
    let at = held(&mut slow, 1.0, 0.1, |_| -5.0);
    assert!(at.iter().all(|still| *still == at[0]), "it stands still");
    assert_eq!(slow.rates[tvc_jet::RUDDER], 0.0);
}

#[test]
fn a_delay_shifts_the_motion_by_whole_samples_exactly_and_by_parts_of_one_too() {
    let command = |time_s: f64| 5.0 * triangle(time_s);
    let ideal = moved("", 1.0, command);
    let late = moved("delay_s = 0.02", 1.0, command);
    assert!(late[..10].iter().all(|at| *at == 0.0));
    assert_eq!(late[10..], ideal[..490]);
    // 20.5 ms: between two ticks, and on no integration step.
    let late = moved("delay_ms = 20.5", 0.2, |_| 2.0);
    for (tick, at) in late.iter().enumerate() {
        let since_s = PERIOD_S * (tick + 1) as f64 - 0.0205;
        let expected = if since_s < 0.0 { 0.0 } else { 2.0 * (1.0 - libm::exp(-since_s / LAG_S)) };
        // RK4 at a fiftieth of the lag.
        assert!((at - expected).abs() < 1.0e-8, "tick {tick}: {at} deg, {expected} deg");
    }
}

#[test]
fn the_delay_of_a_fault_comes_on_top_of_that_of_the_actuator() {
    let setup = PlantSetup { airframe: with("delay_s = 0.02"), ..flat() };
    let mut plant = plant(&setup);
    let (target, kind) = (tvc_jet::RUDDER.into(), FaultKind::Delayed { delay_s: 0.03 });
    plant.request(&FaultRequest::Inject { target, kind, timing: Timing::NOW });
    let late = held(&mut plant, 1.0, 0.2, |_| 2.0);
    let first = late.iter().position(|at| *at != 0.0);
    // 50 ms are 25 periods; the motion shows at the end of the next one.
    assert_eq!(first, Some(25));
}

#[test]
fn a_deadband_ignores_a_small_change_and_follows_a_larger_one_in_full() {
    let small = moved("deadband_deg = 0.5", 0.5, |_| 0.49);
    assert!(small.iter().all(|at| *at == 0.0));
    let large = moved("deadband_deg = 0.5", 1.0, |time_s| if time_s < 0.5 { 0.51 } else { 0.1 });
    assert!((large[499] - 0.51).abs() < 1.0e-6, "{} deg", large[499]);
    let back = moved("deadband_deg = 0.5", 1.5, |time_s| if time_s < 0.5 { 0.51 } else { 0.0 });
    assert!(back[749].abs() < 1.0e-6, "{} deg", back[749]);
}

#[test]
fn backlash_makes_a_loop_of_its_width_on_a_triangle() {
    // 4 deg over 1 s: a ramp of 4 deg/s, behind which the lag of 50 ms stays by 0.2 deg.
    let positions = moved("hysteresis_deg = 1.0", 8.0, |time_s| 4.0 * triangle(time_s));
    let at = |time_s: f64| positions[(time_s / PERIOD_S).round() as usize - 1];
    let (falling, rising) = (at(6.0), at(8.0));
    assert!((falling - 0.7).abs() < 1.0e-2, "{falling} deg on the way down");
    assert!((rising + 0.7).abs() < 1.0e-2, "{rising} deg on the way up");
    // After the turn it rests until the play is through.
    let rest = [at(5.15), at(5.2)];
    assert!((rest[0] - 3.5).abs() < 2.0e-2 && rest[0] - rest[1] < 2.0e-2, "{rest:?} deg");
    let most = positions.iter().fold(0.0_f64, |most, at| most.max(*at));
    assert!(most <= 3.5, "half of the play is missing at the turn: {most} deg");
}

#[test]
fn a_bias_moves_the_neutral_point_and_ends_at_the_travel() {
    let rest = moved("bias_deg = -1.5", 1.0, |_| 0.0);
    assert!((rest[499] + 1.5).abs() < 1.0e-6, "{} deg", rest[499]);
    let end = moved("bias_deg = -1.5", 3.0, |_| -30.0);
    assert!((end[1_499] + 30.0).abs() < 1.0e-6, "{} deg", end[1_499]);
}

#[test]
fn the_travel_falls_with_the_dynamic_pressure_for_commands_and_for_a_hard_over() {
    let airframe = with("stall_dynamic_pressure_kpa = 20");
    for speed in [0.6, 0.9, 1.2] {
        let mut commanded = plant(&PlantSetup { airframe: airframe.clone(), ..flat() });
        let at = held(&mut commanded, speed, 3.0, |_| 30.0)[1_499];
        let pressure_pa = commanded.truth().dynamic_pressure_pa();
        let expected = 30.0 * (20.0e3 / pressure_pa).min(1.0);
        // What the pressure changes while the aircraft falls through a period.
        assert!((at - expected).abs() < 1.0e-2, "{pressure_pa} Pa: {at} deg, {expected} deg");
        assert_eq!(speed < 0.9, pressure_pa < 20.0e3, "one of them has its full travel");
        let mut failed = plant(&PlantSetup { airframe: airframe.clone(), ..flat() });
        held(&mut failed, speed, 0.01, |_| 0.0);
        let (target, kind) = (tvc_jet::RUDDER.into(), FaultKind::HardOver { side: Side::Negative });
        failed.request(&FaultRequest::Inject { target, kind, timing: Timing::NOW });
        let at = held(&mut failed, speed, 3.0, |_| 30.0)[1_499];
        assert!((at + expected).abs() < 1.0e-2, "{pressure_pa} Pa: {at} deg after a hard over");
    }
}

#[test]
fn the_trim_knows_what_the_hinge_moment_leaves() {
    // Level flight at 200 m/s needs 0.4 deg more elevator than at the design point.
    let text = DEFAULT_AIRFRAME
        .replace("kind = \"elevator\"", "kind = \"elevator\"\nstall_dynamic_pressure_pa = 100.0");
    let airframe = Airframe::from_toml("jet.toml", &text).unwrap();
    let mut setup = PlantSetup { airframe, ..flat() };
    assert!(Plant::new(&setup).is_ok(), "at the design point the elevator is at zero");
    setup.start.airspeed_m_s = 200.0;
    let error = Plant::new(&setup).unwrap_err().to_string();
    assert!(error.contains("left_elevator") && error.contains("deflection_deg"), "{error}");
}
