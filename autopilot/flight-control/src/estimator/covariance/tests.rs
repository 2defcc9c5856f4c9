use super::*;
use nalgebra::SMatrix;

type Square = SMatrix<f64, STATES, STATES>;

fn dense(covariance: &Covariance) -> Square {
    Square::from_fn(|row, column| covariance.p[row][column])
}

fn spreads() -> States {
    core::array::from_fn(|index| 0.1 + 0.05 * index as f64)
}

fn transition() -> Transition {
    Transition {
        seconds: 0.01,
        turned: Matrix3::new(0.1, 0.2, -0.3, 0.4, 0.5, 0.6, -0.7, 0.8, 0.9) * 0.01,
        force: Vector3::new(0.1, -0.2, -0.09),
        gust: 0.99,
        lasting: 0.999,
    }
}

#[test]
fn the_prediction_is_that_of_the_dense_product() {
    let mut covariance = Covariance::new(&spreads());
    let noise = core::array::from_fn(|index| 1.0e-6 * index as f64);
    let mut phi = Square::zeros();
    for column in 0..STATES {
        let mut unit = [0.0; STATES];
        unit[column] = 1.0;
        transition().apply(&mut unit);
        for row in 0..STATES {
            phi[(row, column)] = unit[row];
        }
    }
    let q = Square::from_diagonal(&noise.into());
    let mut expected = dense(&covariance);
    for _ in 0..50 {
        covariance.predict(&transition(), &noise);
        expected = phi * expected * phi.transpose() + q;
    }
    assert!((dense(&covariance) - expected).amax() < 1.0e-12);
}

#[test]
fn an_update_is_that_of_the_joseph_form() {
    let mut covariance = Covariance::new(&spreads());
    covariance.predict(&transition(), &[1.0e-4; STATES]);
    let row = Row::empty()
        .with_vector(ATTITUDE, &Vector3::new(1.0, -2.0, 0.5))
        .with(WIND, 3.0)
        .with(PITOT_BIAS, 1.5);
    let mut h = SMatrix::<f64, 1, STATES>::zeros();
    (h[0], h[1], h[2], h[WIND], h[PITOT_BIAS]) = (1.0, -2.0, 0.5, 3.0, 1.5);
    let before = dense(&covariance);
    let noise = 0.04;
    let mut gain = before * h.transpose() / ((h * before * h.transpose())[0] + noise);
    gain.rows_mut(CONSIDERED, STATES - CONSIDERED).fill(0.0);
    let rest = Square::identity() - gain * h;
    let expected = rest * before * rest.transpose() + gain * noise * gain.transpose();
    let comparison = covariance.compare(&row, 0.7, noise);
    let correction = covariance.take(&comparison);
    assert!((dense(&covariance) - expected).amax() < 1.0e-12);
    for (index, value) in correction.iter().enumerate() {
        assert!((value - 0.7 * gain[index]).abs() < 1.0e-12);
    }
}

/// With any gain P becomes (I - K H) P (I - K H)ᵀ + K r Kᵀ, and the correction of a unit innovation is the gain.
#[test]
fn an_update_with_a_part_of_the_gain_leaves_what_it_should_and_is_that_of_the_joseph_form() {
    let flow = Vector3::new(0.6, -0.64, 0.48);
    let start = Vector3::new(0.0, 0.8, 0.6);
    let row = Row::empty()
        .with_vector(VELOCITY, &Vector3::new(1.0, -2.0, 0.5))
        .with_vector(WIND, &Vector3::new(-0.7, 0.3, 2.0))
        .with(VANES, 1.0)
        .with(LIFT, 1.5);
    let h = SMatrix::<f64, 1, STATES>::from_fn(|_, column| {
        row.parts().iter().filter(|part| part.0 == column).map(|part| part.1).sum()
    });
    for considers_vanes in [false, true] {
        for is_speed in [false, true] {
            let mut covariance = Covariance::new(&spreads());
            covariance.predict(&transition(), &[1.0e-4; STATES]);
            covariance.consider_vanes(considers_vanes);
            let before = dense(&covariance);
            let comparison = covariance.compare(&row, 1.0, 0.04);
            let gain = match is_speed {
                true => covariance.take_along(&comparison, &flow, &start),
                false => covariance.take_across(&comparison, &flow),
            };
            let k = SMatrix::<f64, STATES, 1>::from(gain);
            let rest = Square::identity() - k * h;
            let expected = rest * before * rest.transpose() + k * 0.04 * k.transpose();
            assert!((dense(&covariance) - expected).amax() < 1.0e-12);
            let wind = Vector3::new(gain[WIND], gain[WIND + 1], gain[WIND + 2]);
            let considered = if considers_vanes { VANES } else { CONSIDERED };
            if is_speed {
                assert!(wind.cross(&flow).norm() < 1.0e-12 && wind.norm() > 0.01, "{wind}");
                assert!(gain[VELOCITY + 1] != 0.0 && gain[VELOCITY] == 0.0);
                assert!(gain[..VELOCITY].iter().chain(&gain[POSITION..WIND]).all(|k| *k == 0.0));
                assert!(gain[VANES..].iter().all(|k| *k == 0.0));
            } else {
                assert!(wind.dot(&flow).abs() < 1.0e-12 && wind.norm() > 0.01, "{wind}");
                assert!(gain[considered..].iter().all(|k| *k == 0.0));
                assert!(considers_vanes || gain[VANES] != 0.0);
                assert!(gain[POSITION] != 0.0);
            }
        }
    }
}

#[test]
fn errors_that_last_do_not_count_as_changing() {
    let covariance = Covariance::new(&spreads());
    let row = Row::empty().with(WIND, 2.0).with(PITOT_BIAS, 3.0);
    let expected = 4.0 * covariance.variance(WIND);
    assert!((covariance.variance_of_changing(&row) - expected).abs() < 1.0e-12);
}

#[test]
fn the_variance_of_vectors_is_that_of_their_row_to_the_bit() {
    let mut covariance = Covariance::new(&spreads());
    covariance.predict(&transition(), &[1.0e-4; STATES]);
    let factors = Vector3::new(0.6, -0.7, 0.5);
    let vectors = [VELOCITY, WIND, ATTITUDE].map(|from| (from, factors * (from + 1) as f64));
    let row = vectors.iter().fold(Row::empty(), |row, (from, by)| row.with_vector(*from, by));
    let expected = covariance.compare(&row, 0.0, 0.0).variance;
    assert_eq!(covariance.variance_of_vectors(&vectors).to_bits(), expected.to_bits());
}

#[test]
fn it_stays_positive_through_very_good_measurements() {
    let mut covariance = Covariance::new(&spreads());
    for step in 0..20_000 {
        covariance.predict(&transition(), &[1.0e-14; STATES]);
        let row = Row::empty().with(step % STATES, 1.0).with((step * 7 + 1) % STATES, 1.0e3);
        let comparison = covariance.compare(&row, 0.0, 1.0e-10);
        covariance.take(&comparison);
        assert!(covariance.is_sound(), "step {step}");
    }
    let lowest = dense(&covariance).symmetric_eigenvalues().min();
    assert!(lowest > -1.0e-9, "{lowest}");
}
