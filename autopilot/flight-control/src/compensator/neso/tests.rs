use super::*;
use proptest::prelude::*;

fn gains() -> NesoGains {
    NesoGains::REFERENCE
}

fn period(micros: u32) -> ControlPeriod {
    ControlPeriod::from_micros(micros).unwrap()
}

/// Time until z2 reaches 90 % of a constant F that no model explains, and its overshoot.
fn response(f: f64, period: ControlPeriod) -> (f64, f64) {
    let step = NesoStep::new(&gains(), period);
    let mut channel = Channel::default();
    let (mut t90, mut peak, mut y) = (f64::INFINITY, 0.0_f64, 0.0);
    for k in 1..=3000 {
        y += step.h * f;
        channel.step(y, 0.0, &step);
        peak = peak.max(channel.z2 / f);
        if channel.z2 / f >= 0.9 {
            t90 = t90.min(f64::from(k) * step.h);
        }
    }
    (t90, peak - 1.0)
}

#[test]
fn an_unexplained_acceleration_is_found_in_a_tenth_of_a_second_without_overshoot() {
    let (t90, overshoot) = response(3.0, period(1_000));
    // docs/paper.md: 0.09 s for 3 rad/s².
    assert!((0.08..0.10).contains(&t90), "{t90} s");
    assert!(overshoot < 1.0e-3, "{overshoot}");
}

#[test]
fn the_estimate_converges_at_every_allowed_period() {
    for micros in [1_000, 2_000, 2_500, 4_000] {
        let (t90, overshoot) = response(3.0, period(micros));
        assert!(t90 < 0.12, "{micros} us: {t90} s");
        assert!(overshoot < 0.01, "{micros} us: {overshoot}");
    }
}

#[test]
fn the_first_step_takes_the_measurement_and_estimates_nothing() {
    let mut observer = Neso::new(&gains(), period(2_000));
    let estimate = observer.step(&Vector3::new(0.3, -0.2, 0.1), &Vector3::new(9.0, 9.0, 9.0));
    assert_eq!(estimate.z, Vector3::new(0.3, -0.2, 0.1));
    assert_eq!(estimate.z2, Vector3::zeros());
}

proptest! {
    #[test]
    fn fal_is_odd_continuous_and_growing(e in -1.0..1.0_f64, width in 1.0e-4..0.5_f64) {
        prop_assert_eq!(fal(-e, width), -fal(e, width));
        prop_assert!(fal(e + 1.0e-6, width) > fal(e, width));
        let (inside, outside) = (fal(width, width), fal(width * (1.0 + 1.0e-12), width));
        prop_assert!((inside - outside).abs() < 1.0e-9);
    }

    #[test]
    fn the_implicit_step_solves_its_equation(
        e_minus in -5.0..5.0_f64, w0 in 1.0..200.0_f64, kb in 0.5..4.0_f64, width in 1.0e-4..0.5_f64,
    ) {
        let gains = NesoGains { bandwidth: w0, rate_factor: kb, fal_width: width };
        let step = NesoStep::new(&gains, period(2_000));
        let (e, g_2) = step.solve(e_minus);
        prop_assert!((g_2 - fal(e, width)).abs() < 1.0e-9 * (1.0 + g_2.abs()));
        let left = e + step.h * gains.beta_1() * e + step.h * step.h * gains.beta_2() * fal(e, width);
        prop_assert!((left - e_minus).abs() < 1.0e-9 * (1.0 + e_minus.abs()), "{} {}", left, e_minus);
    }

    #[test]
    fn mirrored_measurements_give_mirrored_estimates_to_the_bit(y in -2.0..2.0_f64, a in -5.0..5.0_f64) {
        let step = NesoStep::new(&gains(), period(2_000));
        let (mut one, mut other) = (Channel::default(), Channel::default());
        for k in 0..50 {
            let y = y * f64::from(k);
            one.step(y, a, &step);
            other.step(-y, -a, &step);
        }
        prop_assert_eq!((one.z, one.z2), (-other.z, -other.z2));
    }
}
