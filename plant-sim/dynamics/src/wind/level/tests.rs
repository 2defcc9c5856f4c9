use icd::EulerAngles;

use super::*;

const FEET: f64 = FOOT_M;

#[test]
fn val_intensities_are_those_of_figure_7_and_of_the_low_altitude_form() {
    // Heights and intensities that figure 7 of MIL-F-8785C shows, ft and ft/s.
    for (level, height_ft, expected) in [
        (TurbulenceLevel::Light, 3_750.0, 7.4),
        (TurbulenceLevel::Moderate, 7_500.0, 10.1),
        (TurbulenceLevel::Severe, 15_000.0, 22.1),
        (TurbulenceLevel::Severe, 20_000.0, 21.05),
        (TurbulenceLevel::Light, 60_000.0, 0.0),
        (TurbulenceLevel::Severe, 90_000.0, 5.1),
    ] {
        let scales = level.scales(height_ft * FEET);
        assert!((scales.vertical_m_s / FEET - expected).abs() < 1e-9, "{level} {height_ft} ft");
        assert_eq!(scales.horizontal_m_s, scales.vertical_m_s);
        assert_eq!(scales.horizontal_m, 533.4);
    }
    // By hand at 200 ft: 0.177 + 0.1646 = 0.3416; 200 / 0.3416^1.2 = 725.7 ft; 1 / 0.3416^0.4 = 1.5367.
    let scales = TurbulenceLevel::Moderate.scales(200.0 * FEET);
    assert!((scales.horizontal_m / FEET - 725.7).abs() < 0.1, "{}", scales.horizontal_m / FEET);
    assert!((scales.vertical_m / FEET - 200.0).abs() < 1e-9);
    assert!((scales.vertical_m_s - 1.543_33).abs() < 1e-5, "3 knots");
    assert!((scales.horizontal_m_s / scales.vertical_m_s - 1.5367).abs() < 1e-4);
}

#[test]
fn lengths_and_intensities_have_no_step_over_the_height() {
    for level in TurbulenceLevel::ALL {
        let mut before = level.scales(-10.0);
        for decimetre in -100..300_000 {
            let now = level.scales(0.1 * f64::from(decimetre));
            let steps = [
                (now.horizontal_m - before.horizontal_m).abs() / 10.0,
                (now.vertical_m - before.vertical_m).abs(),
                (now.horizontal_m_s - before.horizontal_m_s).abs(),
                (now.vertical_m_s - before.vertical_m_s).abs(),
            ];
            // At 1000 ft the form has L = 1000 ft to 1e-4, so 0.1 m.
            assert!(steps.iter().all(|step| *step < 0.15), "{level} {decimetre} dm: {steps:?}");
            before = now;
        }
    }
    assert_eq!(TurbulenceLevel::Light.scales(f64::NAN), TurbulenceLevel::Light.scales(0.0));
}

fn surroundings(height_m: f64, psi: f64, wind: Ned) -> Surroundings {
    let attitude = Attitude::from_euler(EulerAngles { phi: 0.0, theta: 0.0, psi });
    Surroundings { airspeed_m_s: 100.0, height_m, attitude, wind }
}

/// Variances of the velocity of the air over many lengths of turbulence, m²/s².
fn variances(level: TurbulenceLevel, at: &Surroundings) -> [f64; 3] {
    let mut air = LevelTurbulence::new(level, 10.0, 0.5, 1, 0);
    let (mut sums, n) = ([0.0; 3], 200_000);
    for k in 0..n + 200 {
        let gust = air.step(at).velocity.0;
        if k >= 200 {
            for (sum, value) in sums.iter_mut().zip(gust.iter()) {
                *sum += value * value / f64::from(n);
            }
        }
    }
    sums
}

#[test]
fn flown_intensities_are_those_of_the_height_also_in_between() {
    for height_m in [20.0, 150.0, 304.8, 400.0, 500.0, 609.6, 3_000.0] {
        for level in TurbulenceLevel::ALL {
            let scales = level.scales(height_m);
            let [u, v, w] = variances(level, &surroundings(height_m, 0.7, Ned::zero()));
            for (ours, expected) in
                [(u, scales.horizontal_m_s), (v, scales.horizontal_m_s), (w, scales.vertical_m_s)]
            {
                // At least 1.5e4 independent samples: 0.6 % of the rms, five times that allowed.
                let ratio = ours.sqrt() / expected;
                assert!((ratio - 1.0).abs() < 0.03, "{level}, {height_m} m: {ratio}");
            }
        }
    }
}

#[test]
fn near_the_ground_the_axes_are_those_of_the_mean_wind_and_of_the_horizon() {
    // The same random numbers in a wind to the east and for a nose to the north: x of the field is the right wing.
    let east = surroundings(100.0, 0.0, Ned::new(0.0, 9.0, 0.0));
    let calm = surroundings(100.0, 0.0, Ned::zero());
    let [mut in_wind, mut in_calm] =
        [(); 2].map(|()| LevelTurbulence::new(TurbulenceLevel::Light, 10.0, 0.02, 5, 0));
    for _ in 0..100 {
        let (a, b) = (in_wind.step(&east), in_calm.step(&calm));
        for (a, b) in [(a.velocity.0, b.velocity.0), (a.rates.0, b.rates.0)] {
            assert!((a.x + b.y).abs() < 1e-12 && (a.y - b.x).abs() < 1e-12 && a.z == b.z);
        }
    }
    // On its side the aircraft meets the vertical gusts with its wing: y of the body is down.
    let attitude = Attitude::from_euler(EulerAngles {
        phi: core::f64::consts::FRAC_PI_2,
        theta: 0.0,
        psi: 0.0,
    });
    let on_side = Surroundings { attitude, ..calm };
    let [mut banked, mut level] =
        [(); 2].map(|()| LevelTurbulence::new(TurbulenceLevel::Light, 10.0, 0.02, 5, 0));
    for _ in 0..100 {
        let (a, b) = (banked.step(&on_side).velocity.0, level.step(&calm).velocity.0);
        assert!((a.y - b.z).abs() < 1e-12 && (a.z + b.y).abs() < 1e-12, "{a} {b}");
    }
    // High up they are body axes.
    let high = |attitude| Surroundings { attitude, height_m: 3_000.0, ..calm };
    let [mut banked, mut level] =
        [(); 2].map(|()| LevelTurbulence::new(TurbulenceLevel::Light, 10.0, 0.02, 5, 0));
    assert_eq!(banked.step(&high(attitude)), level.step(&high(Attitude::identity())));
}

#[test]
fn val_formulas_of_the_spectra_are_those_that_the_standard_prints() {
    // By hand at Ω = 0.01 rad/m for L = 533.4 m, σ = 1 m/s, b = 10 m: (LΩ)² = 28.452, (4bΩ/π)² = 0.016211.
    let scales = Scales::isotropic(533.4, 1.0);
    let expected = [11.529_883, 16.903_338, 16.903_338, 5.125_866e-3, 1.663_368e-3, 1.675_059e-3];
    for (ours, expected) in spectra(&scales, 10.0, 0.01).into_iter().zip(expected) {
        assert!((ours / expected - 1.0).abs() < 1e-6, "{ours} instead of {expected}");
    }
}

#[test]
fn flying_through_all_heights_the_air_moves_without_a_step() {
    for from_m in [900.0, -20.0] {
        let mut air = LevelTurbulence::new(TurbulenceLevel::Severe, 10.0, 0.002, 1, 0);
        let mut before: Option<Gust> = None;
        for tick in 0..100_000 {
            let way = 0.01 * f64::from(tick);
            let height_m = if from_m > 0.0 { from_m - way } else { from_m + way };
            let gust = air.step(&surroundings(height_m, 0.3, Ned::new(3.0, 1.0, 0.0)));
            if let Some(before) = before {
                let step = (gust.velocity.0 - before.velocity.0).norm();
                // White noise through 2 ms: σ √(3 · 2h V/L), 2.4 m/s for 3 m of length at 3.5 m/s; in the air above far less.
                let limit = if height_m > 30.0 { 1.3 } else { 12.0 };
                assert!(step < limit, "{step} m/s at {height_m} m");
            }
            assert!(gust.rates.0.norm() < 20.0, "{} rad/s at {height_m} m", gust.rates.0);
            before = Some(gust);
        }
    }
}
