use super::*;
use proptest::prelude::*;

fn place(latitude_deg: f64, longitude_deg: f64) -> Place {
    Place { latitude_rad: latitude_deg.to_radians(), longitude_rad: longitude_deg.to_radians() }
}

fn offset(from: Place, to: Place) -> Horizontal {
    Horizon::at(from).offset(&Site::at(to))
}

#[test]
fn known_lengths_of_the_ellipsoid_come_out() {
    // WGS-84: one degree of latitude at 45 degrees is 111 132.1 m (44.5 to 45.5), one of longitude at the
    // equator 111 319.5 m, at 60 degrees 55 800.2 m.
    let north = offset(place(44.5, 10.0), place(45.5, 10.0));
    assert!((north.x - 111_132.1).abs() < 111.0 && north.y.abs() < 1.0e-6, "{north}");
    let east = offset(place(0.0, 10.0), place(0.0, 11.0));
    assert!((east.y - 111_319.5).abs() < 130.0, "{east}");
    let east = offset(place(60.0, 10.0), place(60.0, 11.0));
    assert!((east.norm() - 55_800.2).abs() < 60.0, "{east}");
}

#[test]
fn the_date_line_and_the_poles_are_places_like_others() {
    let across = offset(place(20.0, 179.9), place(20.0, -179.9));
    assert!(across.y > 20_000.0 && across.y < 21_500.0, "{across}");
    let over_the_pole = offset(place(89.9, 0.0), place(89.9, 180.0));
    assert!((over_the_pole.x - 22_339.0).abs() < 30.0, "{over_the_pole}");
    assert!(over_the_pole.y.abs() < 1.0e-3);
    let at_the_pole = offset(place(90.0, 0.0), place(89.0, 90.0));
    assert!((at_the_pole.norm() - 111_694.0).abs() < 130.0, "{at_the_pole}");
}

#[test]
fn a_great_circle_is_straight_where_the_aircraft_is() {
    // 200 km: the aircraft half-way has one end exactly behind it and the other ahead.
    let (a, b) = (place(50.0, 0.0), place(50.9, 2.3));
    let horizon = Horizon::at(a);
    let half = horizon.place_at(&(horizon.offset(&Site::at(b)) * 0.5));
    let (back, ahead) = (offset(half, a), offset(half, b));
    let sine = (back.x * ahead.y - back.y * ahead.x) / (back.norm() * ahead.norm());
    // 1e-4 rad: 10 m across at 100 km.
    assert!(sine.abs() < 1.0e-4, "{sine}");
    assert!((back.norm() / ahead.norm() - 1.0).abs() < 2.0e-3);
}

#[test]
fn the_same_place_is_no_distance_away_and_the_other_end_of_the_earth_is_finite() {
    let here = place(34.9, -117.9);
    assert_eq!(offset(here, here), Horizontal::zeros());
    assert!(offset(here, place(-34.9, 62.1)).norm().is_finite());
}

#[test]
fn local_axes_find_their_start_again() {
    let start = place(34.9, -117.9);
    let axes = LocalAxes::of(start, 5_000.0, Ned::new(0.0, 0.0, -5_000.0));
    let (far, altitude_m) = axes.place(Ned::new(80_000.0, -60_000.0, -5_000.0));
    let again = LocalAxes::of(far, altitude_m, Ned::new(80_000.0, -60_000.0, -5_000.0));
    let apart = again.site.ecef - axes.site.ecef;
    assert!(apart.norm() < 0.01, "{apart}");
    // The plane leaves the Earth behind: 100 km away it is 785 m higher.
    assert!((altitude_m - 5_785.0).abs() < 10.0, "{altitude_m} m");
}

proptest! {
    #[test]
    fn there_and_back_is_the_same_place(
        latitude in -89.0..89.0, longitude in -180.0..180.0, north in -2.0e5..2.0e5, east in -2.0e5..2.0e5,
    ) {
        let horizon = Horizon::at(place(latitude, longitude));
        let wanted = Horizontal::new(north, east);
        let found = horizon.offset(&Site::at(horizon.place_at(&wanted)));
        // The guidance relies on half a per cent.
        prop_assert!((found - wanted).norm() <= 0.005 * wanted.norm(), "{found} for {wanted}");
    }

    #[test]
    fn distances_are_the_same_in_both_directions(
        latitude in -89.0..89.0, longitude in -180.0..180.0, north in -2.0e5..2.0e5, east in -2.0e5..2.0e5,
    ) {
        let here = place(latitude, longitude);
        let there = Horizon::at(here).place_at(&Horizontal::new(north, east));
        let (one, other) = (offset(here, there).norm(), offset(there, here).norm());
        prop_assert!((one - other).abs() < 1.0e-6 * one + 1.0e-6);
    }
}
