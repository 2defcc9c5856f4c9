use super::*;
use crate::tests::{F16, check_points, part};
use proptest::prelude::*;

const EFFECTORS: [&str; 5] = [
    "left_aileron_rad",
    "right_aileron_rad",
    "left_elevator_rad",
    "right_elevator_rad",
    "rudder_rad",
];

fn file() -> TableAero {
    part(F16, "aerodynamics")
}

fn f16() -> AeroTables {
    file().build(&EFFECTORS.map(str::to_owned)).unwrap()
}

/// Inputs of a check point in the units of the source: airspeed ft/s, angles deg, rates rad/s; elevator, aileron and rudder.
type Inputs = [f64; 9];

fn coefficients(inputs: &Inputs) -> [f64; 6] {
    let [airspeed, alpha, beta, p, q, r, elevator, aileron, rudder] = *inputs;
    let air = AirState {
        airspeed_m_s: airspeed * 0.3048,
        alpha_rad: alpha.to_radians(),
        beta_rad: beta.to_radians(),
        rates: Body::new(p, q, r),
    };
    let deflections = [-aileron, aileron, elevator, elevator, rudder].map(f64::to_radians);
    let [x, y, z, _, _, roll, pitch, yaw, _] = f16().coefficients(&air, 0.3, &deflections);
    [x, y, z, roll, pitch, yaw]
}

fn check(name: &str, inputs: &Inputs, expected: [f64; 6]) {
    for (axis, (ours, theirs)) in coefficients(inputs).into_iter().zip(expected).enumerate() {
        // The tolerance of the source.
        assert!(
            (ours - theirs).abs() <= 1.0e-6,
            "{name}: coefficient {axis} is {ours}, expected {theirs}"
        );
    }
}

#[test]
fn val_the_f16_has_the_coefficients_of_its_check_points() {
    // F16_aero.dml, Mod P, checkData: X, Y, Z, roll, pitch, yaw.
    for (name, inputs, expected) in [
        (
            "Nominal",
            [300.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [-0.004, 0.0, -0.416, 0.0, -0.005, 0.0],
        ),
        (
            "Negative sideslip",
            [300.0, 5.0, -2.34, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [-0.004, 0.0468, -0.415_306_127_332_19, 0.005_616, -0.005, -0.008_892],
        ),
        (
            "Positive elevator",
            [300.0, 5.0, 0.0, 0.0, 0.0, 0.0, 12.92, 0.0, 0.0],
            [-0.028_603_333_333_33, 0.0, -0.514_192, 0.0, -0.132_06, 0.0],
        ),
        (
            "Skewed inputs",
            [300.0, 16.2, -3.24, 0.56, -0.76, -0.94, 4.567, 7.654, -2.991],
            [
                0.047_949_945_333_33,
                0.027_353_86,
                -0.729_348_525_543_44,
                -0.026_917_840_128,
                0.059_176_257_333_33,
                0.013_526_640_528,
            ],
        ),
    ] {
        check(name, &inputs, expected);
    }
}

#[test]
fn val_the_f16_has_the_coefficients_of_all_check_points_of_the_reference_data() {
    let Some(points) = check_points("aero") else { return };
    assert_eq!(points.len(), 16);
    for point in &points {
        let input = |key: &str| point["in"][key].as_f64().unwrap();
        let output = |key: &str| point["out"][format!("aeroBody{key}")][0].as_f64().unwrap();
        let inputs = [
            "trueAirspeed",
            "angleOfAttack",
            "angleOfSideslip",
            "bodyAngularRate_Roll",
            "bodyAngularRate_Pitch",
            "bodyAngularRate_Yaw",
            "elevatorDeflection",
            "aileronDeflection",
            "rudderDeflection",
        ]
        .map(input);
        let expected = [
            "ForceCoefficient_X",
            "ForceCoefficient_Y",
            "ForceCoefficient_Z",
            "MomentCoefficient_Roll",
            "MomentCoefficient_Pitch",
            "MomentCoefficient_Yaw",
        ]
        .map(output);
        check(point["name"].as_str().unwrap(), &inputs, expected);
    }
}

#[test]
fn one_half_of_the_tail_rolls_to_its_own_side_and_both_together_do_not() {
    let air = AirState { airspeed_m_s: 150.0, alpha_rad: 0.05, beta_rad: 0.0, rates: Body::zero() };
    let at = |left: f64, right: f64| f16().coefficients(&air, 0.4, &[0.0, 0.0, left, right, 0.0]);
    let (clean, both, right) = (at(0.0, 0.0), at(0.2, 0.2), at(0.0, 0.2));
    assert!(
        right[5] < 0.0 && right[6] < clean[6],
        "trailing edge down on the right rolls left and pitches down"
    );
    assert!(right[7] > 0.0, "and its drag turns the nose right: {}", right[7]);
    assert_eq!((both[5], both[7]), (0.0, 0.0));
    for (axis, (one, two)) in
        right.iter().zip(both).enumerate().filter(|(axis, _)| [0, 2, 6].contains(axis))
    {
        let effect = (one - clean[axis]) / (two - clean[axis]);
        assert!((effect - 0.5).abs() < 1.0e-12, "coefficient {axis}: {effect} of both");
    }
}

#[test]
fn moments_are_moved_from_their_reference_to_the_centre_of_gravity() {
    let velocity = Body::new(150.0, 3.0, 8.0);
    let air = AirState::new(&velocity, Body::new(0.1, 0.05, -0.1));
    let coefficients = f16().coefficients(&air, 0.4, &[0.01, -0.01, 0.02, 0.02, 0.03]);
    let about = |moment_reference_m: [f64; 3]| {
        let aero = TableAero { moment_reference_m, ..file() }
            .build(&EFFECTORS.map(str::to_owned))
            .unwrap();
        aero.wrench(&air, &velocity, 1.0, &coefficients)
    };
    let (there, here) = (about([0.0; 3]), f16().wrench(&air, &velocity, 1.0, &coefficients));
    // M about the centre of gravity, which is 0.345 m ahead: lift behind it pushes the nose down.
    let expected = there.moment.0.y + 0.345_033_6 * there.force.0.z;
    assert!((here.moment.0.y - expected).abs() < 1.0e-9 && here.moment.0.y < there.moment.0.y);
    assert!((here.moment.0.z - there.moment.0.z + 0.345_033_6 * there.force.0.y).abs() < 1.0e-9);
    assert_eq!(here.force, there.force);
}

#[test]
fn lift_and_drag_act_along_the_airflow() {
    let toml = "area_m2 = 2\nspan_m = 3\nchord_m = 1\n[sum]\nc_lift = [\"1\"]\nc_drag = [\"0.5\"]";
    let aero: TableAero = toml::from_str(toml).unwrap();
    let velocity = Body::new(30.0, 0.0, 40.0);
    let air = AirState::new(&velocity, Body::zero());
    let aero = aero.build(&[]).unwrap();
    let wrench = aero.wrench(&air, &velocity, 1.0, &aero.coefficients(&air, 0.1, &[]));
    // Half of 50 squared, times the area.
    let force = 2_500.0;
    let expected = [force * (0.8 - 0.5 * 0.6), 0.0, -force * (0.6 + 0.5 * 0.8)];
    for (ours, expected) in wrench.force.0.iter().zip(expected) {
        assert!((ours - expected).abs() < 1.0e-9, "{ours} is not {expected}");
    }
}

#[test]
fn an_error_in_the_file_names_its_place() {
    let refusal = |change: &dyn Fn(&mut TableAero)| {
        let mut aero = file();
        change(&mut aero);
        aero.build(&EFFECTORS.map(str::to_owned)).unwrap_err().to_string()
    };
    let unsorted =
        refusal(&|aero| aero.table[0].csv = aero.table[0].csv.replace("\n -5,", "\n -15,"));
    assert_eq!(
        unsorted,
        "[[aerodynamics.table]] number 1: line 3: alpha_deg = -15, expected more than -10: breakpoints increase"
    );
    let unknown = refusal(&|aero| aero.sum.c_y.push("0.1 canard_deg".to_owned()));
    assert!(
        unknown.starts_with(
            "[aerodynamics.sum] c_y: term \"0.1 canard_deg\" has canard_deg, expected"
        ),
        "{unknown}"
    );
    assert_eq!(
        refusal(&|aero| aero.span_m = -1.0),
        "[aerodynamics] span_m = -1 is outside 0.1 to 200"
    );
    let twice = refusal(&|aero| aero.table.push(aero.table[0].clone()));
    assert!(
        twice.starts_with(
            "[[aerodynamics.table]] number 5: the function c_z stands in another table"
        ),
        "{twice}"
    );
}

proptest! {
    #[test]
    fn a_mirrored_f16_has_mirrored_coefficients(
        alpha_rad in -0.3..0.9, beta_rad in -0.6..0.6, rates in proptest::array::uniform3(-2.0..2.0),
        elevators in proptest::array::uniform2(-0.5..0.5),
    ) {
        let [p, q, r]: [f64; 3] = rates;
        let air = AirState { airspeed_m_s: 150.0, alpha_rad, beta_rad, rates: Body::new(p, q, r) };
        let other = AirState { beta_rad: -beta_rad, rates: Body::new(-p, q, -r), ..air };
        // Aileron and rudder stay: the source lists their effects for both sides, not always with the same number.
        let [left, right] = elevators;
        let c = f16().coefficients(&air, 0.4, &[0.0, 0.0, left, right, 0.0]);
        let m = f16().coefficients(&other, 0.4, &[0.0, 0.0, right, left, 0.0]);
        for (axis, sign) in [1.0, -1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0].into_iter().enumerate() {
            prop_assert!((c[axis] - sign * m[axis]).abs() < 1.0e-12, "{c:?} and {m:?}");
        }
    }
}
