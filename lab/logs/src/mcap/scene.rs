//! The aircraft in three dimensions: frames of its body and of each part that turns, and the shapes in them.
//!
//! Frame `world` has the axes east, north, up at the start point at altitude zero, frame `body` forward, left, up at the centre of
//! gravity, as viewers expect. A part that turns has a frame of its own at its hinge, `body/left elevator`, parallel to the
//! body as long as the deflection is zero. Geometry and truth have x forward, y right, z down, and north, east, down.

use lab_engine::geometry::{BodyPlace, GeometryPart};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::foxglove::{
    Color, NumericType, PackedElementField, Point, PointCloud, Pose, SceneEntity, Timestamp,
    TriangleListPrimitive,
};

pub const WORLD: &str = "world";
pub const BODY: &str = "body";
/// Distances between points of a cloud along an edge of a triangle.
const EDGE_STEPS: u32 = 3;

/// East, north, up from north, east, down.
pub fn enu(ned: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(ned.y, ned.x, -ned.z)
}

/// Forward, left, up from forward, right, down.
fn flu(frd: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(frd.x, -frd.y, -frd.z)
}

/// Frame `body` in frame `world`.
pub fn body_in_world(
    position_ned_m: &Vector3<f64>,
    q_ned_from_body: &UnitQuaternion<f64>,
) -> Isometry3<f64> {
    // Half a turn about the axis between north and east.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let q_enu_from_ned = Quaternion::new(0.0, half, half, 0.0);
    let q_body_from_flu = Quaternion::new(0.0, 1.0, 0.0, 0.0);
    let q = q_enu_from_ned * q_ned_from_body.quaternion() * q_body_from_flu;
    let position = Translation3::from(enu(position_ned_m));
    Isometry3::from_parts(position, UnitQuaternion::from_quaternion(q))
}

/// The origin of a part's frame: a point of its first hinge; none for a part that is fixed to the body.
fn origin(part: &GeometryPart) -> Option<BodyPlace> {
    part.hinges.first().map(|hinge| hinge.axis_m[0])
}

/// Frame of a part that turns in frame `body`, with its effectors at these angles.
pub fn part_in_body(
    part: &GeometryPart,
    angle_rad: impl Fn(&str) -> f64,
) -> Option<Isometry3<f64>> {
    let motion = part.motion(angle_rad);
    let at = motion * nalgebra::Point3::from(origin(part)?);
    let q = motion.rotation.quaternion();
    // Half a turn of both axes about x.
    let q = UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.i, -q.j, -q.k));
    Some(Isometry3::from_parts(Translation3::from(flu(&at.coords)), q))
}

/// Name of the frame that a part is in.
pub fn frame_of(part: &GeometryPart) -> String {
    match part.hinges.first() {
        Some(_) => format!("{BODY}/{}", part.name),
        None => BODY.to_owned(),
    }
}

/// A part in its frame.
pub fn entity(part: &GeometryPart, color: Color, timestamp: Timestamp) -> SceneEntity {
    let triangles = TriangleListPrimitive {
        pose: Pose::from(&Isometry3::identity()),
        points: surface(part).iter().flatten().map(Point::from).collect(),
        color,
    };
    SceneEntity {
        timestamp,
        frame_id: frame_of(part),
        id: part.name.clone(),
        frame_locked: true,
        triangles: vec![triangles],
        ..SceneEntity::default()
    }
}

/// The same part as points all over its surface.
pub fn cloud(part: &GeometryPart, timestamp: Timestamp) -> PointCloud {
    let mut data = Vec::new();
    for [a, b, c] in surface(part) {
        for (i, j) in (0..=EDGE_STEPS).flat_map(|i| (0..=EDGE_STEPS - i).map(move |j| (i, j))) {
            let [i, j] = [i, j].map(|step| f64::from(step) / f64::from(EDGE_STEPS));
            let place = a + (b - a) * i + (c - a) * j;
            place.iter().for_each(|m| data.extend((*m as f32).to_le_bytes()));
        }
    }
    let field = |(name, offset): (&str, u32)| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: NumericType::FLOAT32,
    };
    PointCloud {
        timestamp,
        frame_id: frame_of(part),
        pose: Pose::from(&Isometry3::identity()),
        point_stride: 12,
        fields: [("x", 0), ("y", 4), ("z", 8)].map(field).into(),
        data,
    }
}

type Triangle = [BodyPlace; 3];

/// The surface of a part in its frame: its panel, or the skin of a body with both ends.
fn surface(part: &GeometryPart) -> Vec<Triangle> {
    let zero = origin(part).unwrap_or_default();
    let in_frame = |triangle: Triangle| triangle.map(|place| flu(&(place - zero)));
    skin(part).into_iter().map(in_frame).collect()
}

/// The same in body axes.
fn skin(part: &GeometryPart) -> Vec<Triangle> {
    if !part.corners_m.is_empty() {
        return panel(&part.corners_m);
    }
    let rings: Vec<_> = part.sections.iter().map(|section| section.around()).collect();
    let ends = [rings.first(), rings.last()].into_iter().flatten();
    let mut triangles: Vec<_> = ends.flat_map(|ring| panel(ring)).collect();
    for pair in rings.windows(2) {
        for (at, corner) in pair[0].iter().enumerate() {
            let next = (at + 1) % pair[0].len();
            triangles.push([*corner, pair[0][next], pair[1][at]]);
            triangles.push([pair[1][at], pair[0][next], pair[1][next]]);
        }
    }
    triangles
}

/// A flat panel, convex or not, in triangles: cuts off one corner after the other.
fn panel(corners: &[BodyPlace]) -> Vec<Triangle> {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let normal: Vector3<f64> = edges.map(|(a, b)| a.cross(b)).sum();
    let is_left =
        |a: &BodyPlace, b: &BodyPlace, c: &BodyPlace| (b - a).cross(&(c - b)).dot(&normal);
    let mut left = corners.to_vec();
    let mut triangles = Vec::new();
    while left.len() > 3 {
        let around = |at: usize| {
            let n = left.len();
            [left[(at + n - 1) % n], left[at], left[(at + 1) % n]]
        };
        let is_ear = |at: &usize| {
            let [a, b, c] = around(*at);
            let is_outside = |p: &BodyPlace| {
                [a, b, c].contains(p)
                    || is_left(&a, &b, p) < 0.0
                    || is_left(&b, &c, p) < 0.0
                    || is_left(&c, &a, p) < 0.0
            };
            is_left(&a, &b, &c) > 0.0 && left.iter().all(is_outside)
        };
        // A panel without an area has no ear.
        let at = (0..left.len()).find(is_ear).unwrap_or(0);
        triangles.push(around(at));
        left.remove(at);
    }
    triangles.extend(<Triangle>::try_from(left));
    triangles
}

#[cfg(test)]
mod tests {
    use aircraft::{AIRFRAMES, GEOMETRIES};
    use lab_engine::geometry::AircraftGeometry;
    use nalgebra::Point3;
    use plant_sim::{Airframe, ReadAirframe as _};

    use super::*;

    fn shipped() -> impl Iterator<Item = AircraftGeometry> {
        AIRFRAMES.iter().zip(GEOMETRIES).map(|((name, airframe), (_, geometry))| {
            let list = Airframe::from_toml(name, airframe).unwrap().effectors;
            AircraftGeometry::from_toml(name, geometry, &list).unwrap()
        })
    }

    #[test]
    fn a_panel_has_the_area_of_its_triangles_also_with_a_notch() {
        let panels = shipped().flat_map(|geometry| geometry.parts);
        for part in panels.filter(|part| !part.corners_m.is_empty()) {
            let corners = &part.corners_m;
            let edges = corners.iter().zip(corners.iter().cycle().skip(1));
            let area = 0.5 * edges.map(|(a, b)| a.cross(b)).sum::<Vector3<f64>>().norm();
            let triangles = panel(corners);
            assert_eq!(triangles.len(), corners.len() - 2, "{}", part.name);
            let of_triangles: f64 =
                triangles.iter().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum();
            assert!(
                (of_triangles / area - 1.0).abs() < 1.0e-9,
                "{}: {of_triangles} {area}",
                part.name
            );
        }
    }

    #[test]
    fn a_part_stands_in_its_frame_where_its_deflections_turn_it() {
        for geometry in shipped() {
            for part in geometry.parts.iter().filter(|part| !part.hinges.is_empty()) {
                // Also two hinges at once.
                let angle = |name: &str| 0.01 * name.len() as f64;
                let frame = part_in_body(part, angle).unwrap();
                let zero = origin(part).unwrap();
                let turned = part.deflected(angle);
                let places = |part: &GeometryPart| -> Vec<BodyPlace> {
                    let centres = part.sections.iter().map(|section| section.centre_m);
                    part.corners_m.iter().copied().chain(centres).collect()
                };
                for (place, expected) in places(part).iter().zip(places(&turned)) {
                    let seen = frame * Point3::from(flu(&(place - zero)));
                    assert!((seen.coords - flu(&expected)).norm() < 1.0e-12, "{}", part.name);
                }
            }
        }
    }

    #[test]
    fn an_aircraft_that_climbs_to_the_north_points_north_and_up() {
        let climb = UnitQuaternion::from_euler_angles(0.0, 0.3, 0.0);
        let body = body_in_world(&Vector3::new(10.0, 20.0, -30.0), &climb);
        assert_eq!(body.translation.vector, Vector3::new(20.0, 10.0, 30.0));
        let nose = body.rotation * Vector3::x();
        assert!(
            (nose - Vector3::new(0.0, 0.3_f64.cos(), 0.3_f64.sin())).norm() < 1.0e-12,
            "{nose}"
        );
        let left = body.rotation * Vector3::y();
        assert!((left + Vector3::x()).norm() < 1.0e-12, "the left wing points west: {left}");
    }
}
