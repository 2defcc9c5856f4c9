use icd::fault::AirframePart;
use icd::{Body, tvc_jet};
use nalgebra::{Matrix3, Vector3};

use super::{Panel, Panels, PerPart, Remainder, TornPiece};
use crate::Airframe;
use crate::rigid_body::{MassProperties, Wrench};

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1.0e-9 * (1.0 + b.abs()), "{a} and {b}");
}

fn vector_near(a: &Vector3<f64>, b: &Vector3<f64>) {
    assert!((a - b).norm() <= 1.0e-9 * (1.0 + b.norm()), "{a:?} and {b:?}");
}

const NOTHING: Wrench = Wrench { force: Body::zero(), moment: Body::zero() };
const DENSITY: f64 = 0.736;

fn panel() -> Panel {
    Panel {
        root_m: [0.0, 1.0, 0.0],
        tip_m: [-1.0, 4.0, 0.0],
        area_m2: 6.0,
        taper_ratio: 0.5,
        lift_slope: 3.0,
        drag: 0.01,
        mass_percent: 10.0,
        effector: None,
        effector_span: 1.0,
    }
}

fn without(part: AirframePart, lost: f64) -> Remainder {
    let mut torn = PerPart::default();
    torn[part as usize] = lost;
    Airframe::paper().without(&torn, 0.0).expect("something is missing")
}

#[test]
fn a_piece_has_its_part_of_the_tapered_panel() {
    let all = TornPiece::of(AirframePart::RightWing, panel(), 1.0, 2_000.0);
    near(all.area_m2, 6.0);
    near(all.mass_kg, 200.0);
    // Centroid of a trapezium from its wider side: (1 + 2 τ) / (3 (1 + τ)) = 4/9 of the span.
    vector_near(&all.centroid_m, &Vector3::new(-4.0 / 9.0, 1.0 + 3.0 * 4.0 / 9.0, 0.0));
    // Outer half: chords 0.5 to 0.75 of the root's; 0.3125 of 0.75.
    near(
        TornPiece::of(AirframePart::RightWing, panel(), 0.5, 2_000.0).area_m2,
        6.0 * 0.3125 / 0.75,
    );
}

#[test]
fn mass_centre_and_inertia_are_those_of_the_rest() {
    // A rest that is known: 1800 kg of a body about the origin, and a rod that was counted with it.
    let rest = Matrix3::from_diagonal(&Vector3::new(1_000.0, 2_000.0, 2_500.0));
    let piece = TornPiece::of(AirframePart::RightWing, panel(), 1.0, 2_000.0);
    let total_kg = 1_800.0 + piece.mass_kg;
    // About the origin, which is then the centre of gravity of neither.
    let together = MassProperties::new(total_kg, rest + piece.inertia()).expect("possible");
    let panels = Panels { right_wing: Some(panel()), ..Panels::default() };
    let torn = [0.0, 1.0, 0.0, 0.0, 0.0];
    let left = Remainder::of(&together, &panels, &[None; 5], &torn, (0.0, &Vector3::zeros()));
    let left = left.expect("something is missing");
    near(left.mass.mass_kg, 1_800.0);
    let shift = piece.centroid_m * (-piece.mass_kg / 1_800.0);
    vector_near(&left.shift_m, &shift);
    let moved = Matrix3::identity() * shift.norm_squared() - shift * shift.transpose();
    assert!((left.mass.inertia - (rest - moved * 1_800.0)).norm() < 1.0e-9);
}

#[test]
fn a_lost_wing_tip_rolls_to_its_side_and_a_lost_fin_has_no_weathercock_stability() {
    let alpha = 0.035_f64;
    let level = Body::new(264.0 * alpha.cos(), 0.0, 264.0 * alpha.sin());
    let rates = Body::zero();
    for (part, side) in [(AirframePart::LeftWing, -1.0), (AirframePart::RightWing, 1.0)] {
        let left = without(part, 0.3);
        let lost = left.wrench(&NOTHING, &level, &rates, DENSITY);
        assert!(lost.moment.0.x * side > 1_000.0, "{part:?}: roll {} N m", lost.moment.0.x);
        assert!(lost.force.0.z > 1_000.0, "{part:?}: {} N of lift are gone", lost.force.0.z);
        assert!(
            left.shift_m.y * side < 0.0,
            "{part:?}: the centre of gravity goes to the other side"
        );
    }
    // Flow from the right: the lost fin would have turned the nose to it.
    let sideslip = Body::new(264.0, 10.0, 0.0);
    let lost = without(AirframePart::Fin, 0.5).wrench(&NOTHING, &sideslip, &rates, DENSITY);
    assert!(lost.moment.0.z < -1_000.0, "yaw {} N m", lost.moment.0.z);
}

#[test]
fn both_wings_have_the_roll_damping_of_the_whole_aircraft() {
    let airframe = Airframe::paper();
    let geometry = airframe.aero.geometry();
    let clp = airframe.derivative("Clp").expect("it has derivatives");
    let speed = 264.0;
    let rolling = Body::new(0.01, 0.0, 0.0);
    let roll = |lost: f64| {
        let torn = [lost, lost, 0.0, 0.0, 0.0];
        airframe.without(&torn, 0.0).map_or(0.0, |left| {
            left.wrench(&NOTHING, &Body::new(speed, 0.0, 0.0), &rolling, DENSITY).moment.0.x
        })
    };
    let pressure = 0.5 * DENSITY * speed * speed * geometry.area_m2 * geometry.span_m;
    let of_set = clp * rolling.0.x * geometry.span_m / (2.0 * speed) * pressure;
    // A single piece at the centroid underestimates the damping, which goes with the square of the distance.
    let of_panels = -roll(1.0);
    assert!((0.85..0.92).contains(&(of_panels / of_set)), "{of_panels} of {of_set} N m");
}

#[test]
fn a_surface_is_lost_with_what_it_is_on() {
    let aileron = |lost| without(AirframePart::LeftWing, lost).left[tvc_jet::LEFT_AILERON];
    near(aileron(0.225), 0.5);
    near(aileron(0.45), 0.0);
    near(aileron(0.9), 0.0);
    let left = without(AirframePart::LeftTail, 0.25).left;
    near(left[tvc_jet::LEFT_ELEVATOR], 0.75);
    near(left[tvc_jet::RIGHT_ELEVATOR], 1.0);
}

#[test]
fn nothing_is_missing_where_nothing_is_lost_and_still_air_takes_nothing() {
    let none = Airframe::paper().without(&PerPart::default(), 0.0);
    assert!(none.is_none());
    let still = without(AirframePart::Fin, 1.0).wrench(&NOTHING, &Body::zero(), &Body::zero(), 1.2);
    assert!(still.force.0.norm() + still.moment.0.norm() == 0.0);
}
