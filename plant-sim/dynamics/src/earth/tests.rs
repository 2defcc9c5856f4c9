//! The Earth against printed values, and against itself.

use super::*;
use icd::EulerAngles;

fn at(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Geodetic {
    Geodetic {
        latitude_rad: latitude_deg.to_radians(),
        longitude_rad: longitude_deg.to_radians(),
        altitude_m,
    }
}

#[test]
fn val_gravity_at_equator_and_pole_is_that_of_wgs84() {
    // WGS-84 theoretical gravity (NIMA TR8350.2): equator 9.7803253359, pole 9.8321849379 m/s2.
    for (latitude, printed) in [(0.0, 9.780_325_335_9), (90.0, 9.832_184_937_9)] {
        let place = Earth::new(EarthModel::Wgs84, at(latitude, 0.0, 0.0));
        let ours = place.place(&place.origin).gravity.norm();
        // J2 alone leaves out the terms from J4 on: 1e-5 of gravity and less.
        assert!(
            (ours - printed).abs() < 1.5e-4,
            "{latitude} deg: {ours} m/s2 instead of {printed}"
        );
    }
}

#[test]
fn plumb_line_and_ellipsoid_normal_agree_at_middle_latitude() {
    let start = at(45.0, 30.0, 0.0);
    let earth = Earth::new(EarthModel::Wgs84, start);
    let place = earth.place(&earth.origin);
    let gravity = place.e_from_ned.tr_mul(&place.gravity);
    // The ellipsoid is a level surface of the full field; without J4 the plumb line is off by some 1e-5.
    assert!((gravity.x / gravity.z).abs() < 2e-5, "north {} m/s2", gravity.x);
    assert!((gravity.y / gravity.z).abs() < 1e-12, "east {} m/s2", gravity.y);
}

#[test]
fn local_axes_are_right_handed_and_of_unit_length() {
    let earth = Earth::new(EarthModel::Wgs84, at(-33.0, 151.0, 0.0));
    let m = earth.place(&earth.origin).e_from_ned;
    assert!((m.tr_mul(&m) - Matrix3::identity()).norm() < 1e-14);
    assert!((m.determinant() - 1.0).abs() < 1e-14);
}

#[test]
fn quaternion_and_matrix_mean_the_same_local_axes() {
    for model in EarthModel::ALL {
        let here = at(47.0, 8.5, 500.0);
        let earth = Earth::new(model, here);
        let attitude = Attitude::from_euler(EulerAngles { phi: 0.3, theta: -0.2, psi: 2.0 });
        let q = earth.q_e_from_body(&here, &attitude);
        let by_quaternion = Attitude::from_unit_wxyz(q).matrix();
        let by_matrix = earth.place(&earth.position(&here)).e_from_ned * attitude.matrix();
        // The matrix comes from a position by Bowring's formula, good to 1e-12 rad.
        let error = (by_quaternion - by_matrix).norm();
        assert!(error < 1e-11, "{model:?}: {error}");
        let place = earth.place(&earth.position(&here));
        let back = earth.attitude(&place, &q).euler();
        let error = (back.phi - 0.3).abs().max((back.psi - 2.0).abs());
        assert!(error < 1e-11, "{model:?}: {error} rad");
    }
}

#[test]
fn positions_survive_the_round_trip_on_both_earths() {
    for model in EarthModel::ALL {
        let earth = Earth::new(model, at(47.0, 8.5, 0.0));
        let there = at(47.3, 8.1, 5_000.0);
        let back = earth.geodetic(&earth.position(&there));
        assert!((back.latitude_rad - there.latitude_rad).abs() < 1e-12, "{model:?}");
        assert!((back.longitude_rad - there.longitude_rad).abs() < 1e-12, "{model:?}");
        assert!((back.altitude_m - there.altitude_m).abs() < 1e-8, "{model:?}");
    }
}

#[test]
fn local_position_counts_from_the_ground_below_the_start() {
    for model in EarthModel::ALL {
        let earth = Earth::new(model, at(47.0, 8.5, 5_000.0));
        let ours = earth.local_position(&earth.position(&at(47.0, 8.5, 5_000.0)));
        assert!((ours.0 - Vector3::new(0.0, 0.0, -5_000.0)).norm() < 1e-8, "{model:?}: {ours:?}");
    }
}

#[test]
fn the_two_earths_agree_on_a_point_near_the_start() {
    let there = at(47.001, 8.501, 0.0);
    let [flat, round] = [EarthModel::Flat, EarthModel::Wgs84].map(|model| {
        let earth = Earth::new(model, at(47.0, 8.5, 0.0));
        earth.local_position(&earth.position(&there)).0
    });
    // 135 m away the ground has curved down by 1.4 mm; meridians converge by as much.
    assert!((flat - round).norm() < 5e-3, "{} m", (flat - round).norm());
}
