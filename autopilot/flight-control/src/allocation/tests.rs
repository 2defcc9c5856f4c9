use std::vec::Vec;

use proptest::prelude::*;

use super::*;

mod attainable_set;
mod optimum;

/// A column from numbers in the order effect, bounds, preferred, weight.
fn column(effect: [f64; 3], a: f64, b: f64, preferred: f64, weight: f64) -> Column {
    Column { effect: effect.into(), min: a.min(b), max: a.max(b), preferred, weight }
}

/// Columns of ordinary size: bounds of either sign, some equal, some effects zero.
fn columns(
    count: impl Into<proptest::collection::SizeRange>,
) -> impl Strategy<Value = Vec<Column>> {
    let effect = prop_oneof![4 => -5.0..5.0_f64, 1 => Just(0.0)];
    let one = (
        proptest::array::uniform3(effect),
        -0.6..0.6_f64,
        prop_oneof![5 => Just(None), 1 => Just(Some(()))],
        -0.6..0.6_f64,
        -0.3..0.3_f64,
        0.3..5.0_f64,
    )
        .prop_map(|(effect, a, equal, b, preferred, weight)| {
            let b = if equal.is_some() { a } else { b };
            column(effect, a, b, preferred, weight)
        });
    proptest::collection::vec(one, count)
}

fn demand() -> impl Strategy<Value = Vector3<f64>> {
    proptest::array::uniform3(-8.0..8.0_f64).prop_map(Into::into)
}

/// Two ailerons, two elevators, rudder, nozzle with two axes: a jet with sides, rad/s² per rad.
fn jet() -> [Column; 7] {
    let surface = |effect, travel: f64| column(effect, -travel, travel, 0.0, 1.0 / travel);
    [
        surface([8.0, 0.0, 0.2], 0.4),
        surface([-8.0, 0.0, -0.2], 0.4),
        surface([5.0, -3.0, 0.2], 0.5),
        surface([-5.0, -3.0, -0.2], 0.5),
        surface([1.0, 0.0, -1.5], 0.5),
        surface([0.0, 2.0, 0.0], 0.25),
        surface([0.0, 0.0, 2.0], 0.25),
    ]
}

fn solve(columns: &[Column], demand: &Vector3<f64>) -> Allocation {
    allocate(columns, demand, &Settings::DEFAULT, &ActiveSet::default())
}

#[test]
fn a_demand_inside_the_attainable_set_is_met_and_a_missing_one_moves_nothing() {
    let demand = Vector3::new(1.0, 0.5, -0.3);
    let met = solve(&jet(), &demand);
    // 1/γ of the preference is what the demand gives way to.
    assert!((met.attained - demand).norm() < 1.0e-5, "{:?}", met.attained);
    assert_eq!(solve(&jet(), &Vector3::zeros()).positions, [0.0; COLUMNS_MAX]);
}

#[test]
fn roll_is_served_before_pitch_and_pitch_before_yaw() {
    // One effector that gives all three: what it is used for is the priority.
    let one = [column([1.0, 1.0, 1.0], -1.0, 1.0, 0.0, 1.0)];
    for (demand, wanted) in [([0.5, -0.5, -0.5], 0.5), ([0.0, 0.5, -0.5], 0.0)] {
        let position = solve(&one, &demand.into()).positions[0];
        assert!((position - wanted).abs() < 0.02, "{position} for {demand:?}");
    }
    let without_roll = [column([0.0, 1.0, 1.0], -1.0, 1.0, 0.0, 1.0)];
    let position = solve(&without_roll, &Vector3::new(0.5, 0.4, -0.4)).positions[0];
    assert!((position - 0.4).abs() < 0.02, "{position}");
}

#[test]
fn a_jammed_elevator_is_carried_by_all_others() {
    let mut broken = jet();
    (broken[2].min, broken[2].max) = (0.3, 0.3);
    let a = solve(&broken, &Vector3::zeros());
    assert_eq!(a.positions[2], 0.3);
    assert!(a.attained.norm() < 1.0e-4, "{:?} left", a.attained);
}

#[test]
fn the_last_active_set_is_the_shortest_start() {
    let demand = Vector3::new(9.0, 1.0, 1.0);
    let cold = solve(&jet(), &demand);
    let warm = allocate(&jet(), &demand, &Settings::DEFAULT, &cold.active);
    assert!(cold.active.iter().any(|bound| *bound != Bound::Free));
    assert_eq!(warm.iterations, 1);
    for (cold, warm) in cold.positions.iter().zip(warm.positions) {
        assert!((cold - warm).abs() < 1.0e-9);
    }
}

#[test]
fn columns_beyond_the_largest_number_are_not_used() {
    let many = [column([1.0, 0.0, 0.0], -1.0, 1.0, 0.0, 1.0); COLUMNS_MAX + 3];
    let a = solve(&many, &Vector3::new(8.0, 0.0, 0.0));
    assert!((a.attained.x - 8.0).abs() < 1.0e-4, "{}", a.attained.x);
}

/// Any number that a float can be.
fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => -2.0..2.0_f64,
        1 => proptest::num::f64::ANY,
        1 => proptest::sample::select(&[0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0e300][..]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn whatever_comes_in_a_position_inside_finite_bounds_comes_out(
        numbers in proptest::collection::vec(proptest::array::uniform7(anything()), 0..=COLUMNS_MAX),
        demand in proptest::array::uniform3(anything()),
        settings in proptest::array::uniform4(anything()),
        start in proptest::array::uniform16(0..3_u8),
    ) {
        let columns: Vec<Column> = numbers
            .iter()
            .map(|n| Column { effect: Vector3::new(n[0], n[1], n[2]), min: n[3], max: n[4], preferred: n[5], weight: n[6] })
            .collect();
        let [roll, pitch, yaw, demand_over_preference] = settings;
        let settings = Settings { priority: Vector3::new(roll, pitch, yaw), demand_over_preference };
        let start = start.map(|b| [Bound::Free, Bound::Min, Bound::Max][usize::from(b)]);
        let a = allocate(&columns, &demand.into(), &settings, &start);
        for (column, position) in columns.iter().zip(a.positions) {
            let ordered = column.min.is_finite() && column.max.is_finite() && column.min <= column.max;
            let allowed = if ordered { column.min..=column.max } else { 0.0..=0.0 };
            prop_assert!(allowed.contains(&position), "{position} of {column:?}");
        }
        prop_assert!(a.iterations <= ITERATIONS_MAX);
        for direction in [Vector3::from(demand), Vector3::x()] {
            let scale = attainable::largest_scale(&columns, &a.positions, &direction);
            prop_assert!(scale >= 0.0 && scale.is_finite(), "{scale}");
        }
    }
}
