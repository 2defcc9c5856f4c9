//! The reach against linear programs solved by trying all vertices.

use nalgebra::Matrix3;

use super::super::attainable::{Reach, axis_reach, largest_scale};
use super::*;

/// Largest t with B (u - at) = t d: the best vertex of the linear program. In a vertex all effectors but two are at a
/// bound, and these two and t solve the three equations.
fn best_vertex(columns: &[Column], at: &[f64], direction: &Vector3<f64>) -> f64 {
    let n = columns.len();
    let mut best = 0.0_f64;
    for (i, j) in (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))) {
        let system = Matrix3::from_columns(&[*direction, -columns[i].effect, -columns[j].effect]);
        let Some(inverse) = system.try_inverse() else { continue };
        for bounds in 0..1_usize << n {
            let mut rest = Vector3::zeros();
            for (k, column) in columns.iter().enumerate() {
                let end = if bounds >> k & 1 == 0 { column.min } else { column.max };
                rest += column.effect * if k == i || k == j { -at[k] } else { end - at[k] };
            }
            let x = inverse * rest;
            let inside = |u: f64, c: &Column| (c.min - 1.0e-9..=c.max + 1.0e-9).contains(&u);
            if inside(x[1], &columns[i]) && inside(x[2], &columns[j]) {
                best = best.max(x[0]);
            }
        }
    }
    best
}

/// Positions inside the bounds at these fractions of the travel.
fn inside(columns: &[Column], fractions: &[f64]) -> Vec<f64> {
    columns.iter().zip(fractions).map(|(c, f)| c.min + f * (c.max - c.min)).collect()
}

fn full_columns() -> impl Strategy<Value = Vec<Column>> {
    columns(3..=6)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn val_the_reach_is_that_of_the_best_vertex(
        columns in full_columns(), fractions in proptest::array::uniform6(0.0..1.0_f64), direction in demand(),
    ) {
        let at = inside(&columns, &fractions);
        let (ours, best) = (largest_scale(&columns, &at, &direction), best_vertex(&columns, &at, &direction));
        // The vertices may be 1e-9 beyond the bounds, which nearly parallel columns magnify.
        prop_assert!((ours - best).abs() < 1.0e-5 * (1.0 + best), "{ours} is not {best}");
    }

    #[test]
    fn no_vertex_of_the_set_is_farther_than_the_reach_in_its_direction(
        columns in full_columns(), fractions in proptest::array::uniform6(0.0..1.0_f64), bounds in 0..64_usize,
    ) {
        let at = inside(&columns, &fractions);
        let mut vertex = Vector3::zeros();
        for (k, column) in columns.iter().enumerate() {
            let end = if bounds >> k & 1 == 0 { column.min } else { column.max };
            vertex += column.effect * (end - at[k]);
        }
        prop_assume!(vertex.norm() > 1.0e-6);
        let scale = largest_scale(&columns, &at, &vertex);
        prop_assert!(scale > 1.0 - 1.0e-6, "{scale} of a vertex");
    }

    #[test]
    fn a_demand_just_inside_is_met_and_one_just_outside_is_not(columns in columns(4..=12), direction in demand()) {
        let columns: Vec<Column> =
            columns.iter().map(|c| Column { preferred: c.min + 0.5 * (c.max - c.min), ..*c }).collect();
        let at: Vec<f64> = columns.iter().map(|c| c.preferred).collect();
        let scale = largest_scale(&columns, &at, &direction);
        let origin: Vector3<f64> = columns.iter().map(|c| c.effect * c.preferred).sum();
        let gamma = 1.0e9;
        let settings = Settings { priority: Vector3::new(1.0, 1.0, 1.0), demand_over_preference: gamma };
        // The search weights each axis with one over its authority, and so do the bounds below.
        let authority = columns.iter().map(|c| (c.effect / c.weight).map(|x| x * x)).sum::<Vector3<f64>>().map(f64::sqrt);
        let weighted = |v: Vector3<f64>| v.zip_map(&authority, |v, all| if all > 0.0 { v / all } else { 0.0 });
        let miss = |part: f64| {
            let demand = origin + direction * (part * scale);
            weighted(allocate(&columns, &demand, &settings, &ActiveSet::default()).attained - demand).norm()
        };
        prop_assume!(scale * direction.norm() > 0.01);
        let half = |c: &Column| 0.5 * (c.max - c.min);
        let cost: f64 = columns.iter().map(|c| (half(c) * c.weight).powi(2)).sum();
        let radius = inner_radius(columns.iter().map(|c| weighted(c.effect * half(c))).collect());
        // An exact solution would cost no more than `cost`, and there is one for every demand up to 1 % of the inner radius away:
        // a bound of the gradient, which is 2 gamma times the miss.
        let most = (cost / gamma).sqrt().min(cost / (0.02 * radius * gamma)) + 1.0e-9;
        prop_assert!(miss(0.99) < 1.01 * most, "{} missed inside, {most} is possible", miss(0.99));
        // What comes nearer than this makes, with the ball, a point of the set beyond its end.
        let least = 0.05 * radius;
        prop_assert!(miss(1.05) > 0.99 * least, "{} missed outside, {least} lacks", miss(1.05));
    }
}

/// Radius of the largest ball in a set around its centre, from half of its edges: the distance of the nearest face.
fn inner_radius(edges: Vec<Vector3<f64>>) -> f64 {
    let pairs = (0..edges.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let normals = pairs.filter_map(|(i, j)| edges[i].cross(&edges[j]).try_normalize(1.0e-12));
    let height = |n: Vector3<f64>| edges.iter().map(|edge| n.dot(edge).abs()).sum();
    let nearest = normals.map(height).fold(f64::INFINITY, f64::min);
    if nearest.is_finite() { nearest } else { 0.0 }
}

#[test]
fn three_orthogonal_effectors_reach_a_box() {
    let box_columns = [
        column([2.0, 0.0, 0.0], -0.5, 1.0, 0.0, 1.0),
        column([0.0, 3.0, 0.0], -1.0, 1.0, 0.0, 1.0),
        column([0.0, 0.0, 4.0], -0.25, 0.25, 0.0, 1.0),
    ];
    let reach = axis_reach(&box_columns, &[0.0; 3]);
    let both = |negative, positive| Reach { negative, positive };
    let expected = [both(1.0, 2.0), both(3.0, 3.0), both(1.0, 1.0)];
    for (ours, expected) in [reach.roll, reach.pitch, reach.yaw].into_iter().zip(expected) {
        assert!((ours.negative - expected.negative).abs() < 1.0e-12, "{ours:?}, not {expected:?}");
        assert!((ours.positive - expected.positive).abs() < 1.0e-12, "{ours:?}, not {expected:?}");
    }
    let half = axis_reach(&box_columns, &[0.0, 0.5, 0.0]);
    assert!((half.pitch.left_pct(&reach.pitch) - 50.0).abs() < 1.0e-9);
    assert_eq!(half.roll.left_pct(&reach.roll), 100.0);
    assert_eq!(Reach::default().left_pct(&Reach::default()), 0.0);
}

#[test]
fn a_flat_set_and_a_line_reach_where_they_lie_and_nowhere_else() {
    let flat = [
        column([1.0, 1.0, 0.0], -1.0, 1.0, 0.0, 1.0),
        column([1.0, -1.0, 0.0], -1.0, 1.0, 0.0, 1.0),
    ];
    let at = [0.0; 2];
    assert_eq!(largest_scale(&flat, &at, &Vector3::x()), 2.0);
    assert_eq!(largest_scale(&flat, &at, &Vector3::z()), 0.0);
    assert_eq!(largest_scale(&flat, &at, &Vector3::new(1.0, 0.0, 0.1)), 0.0);
    // In a plane that no axis lies in, rounding must not decide.
    let skew = [
        column([0.3, 0.7, 0.2], -1.0, 1.0, 0.0, 1.0),
        column([-0.1, 0.9, 0.6], -1.0, 1.0, 0.0, 1.0),
    ];
    let within = skew[0].effect * 0.5 + skew[1].effect;
    assert!((largest_scale(&skew, &at, &within) - 1.0).abs() < 1.0e-9);
    let line = &flat[..1];
    assert!((largest_scale(line, &at, &Vector3::new(0.5, 0.5, 0.0)) - 2.0).abs() < 1.0e-12);
    assert_eq!(largest_scale(line, &at, &Vector3::x()), 0.0);
    assert_eq!(largest_scale(&[], &at, &Vector3::x()), 0.0);
}

#[test]
fn a_jammed_elevator_takes_its_part_of_the_reach() {
    let mut broken = jet();
    let whole = axis_reach(&broken, &[0.0; 7]);
    (broken[2].min, broken[2].max) = (0.3, 0.3);
    let mut at = [0.0; 7];
    at[2] = 0.3;
    let left = axis_reach(&broken, &at);
    assert!(left.pitch.positive < whole.pitch.positive);
    assert!((0.0..100.0).contains(&left.pitch.left_pct(&whole.pitch)));
}
