//! Where the parts of an aircraft are and how its effectors turn them: `aircraft/NAME/geometry.toml`.
//!
//! Body axes: x forward, y right, z down, m from the centre of gravity. Nothing here decides a flight.

use std::f64::consts::TAU;
use std::path::Path;

use aircraft::{DEFAULT_NAME, GEOMETRIES};
use host_io::problem::{At as _, Problem, problem};
use icd::{Effector, EffectorList};
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::configuration::{AircraftArgs, Named};

/// A place, m.
pub type BodyPlace = Vector3<f64>;

/// Farther from the centre of gravity is no part of an aircraft, m.
const PLACE_MAX_M: f64 = 100.0;
/// Shorter than this, a hinge axis has no direction and an aircraft no picture, m.
const LENGTH_MIN_M: f64 = 0.001;
/// Corners of a section's outline.
const SECTION_CORNERS: u32 = 24;

/// The parts of an aircraft.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AircraftGeometry {
    #[serde(rename = "part")]
    pub parts: Vec<GeometryPart>,
}

/// A flat panel by its corners, or a body by its elliptical sections.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryPart {
    pub name: String,
    /// Corners of a panel, in order around it.
    #[serde(default)]
    pub corners_m: Vec<BodyPlace>,
    /// Sections of a body, from its nose to its tail.
    #[serde(default)]
    pub sections: Vec<Section>,
    /// Axes about which effectors turn the part.
    #[serde(default, rename = "hinge")]
    pub hinges: Vec<Hinge>,
    /// An effector that is here and turns nothing: the engine.
    pub effector: Option<String>,
}

/// An ellipse across the x axis.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    pub centre_m: BodyPlace,
    pub width_m: f64,
    pub height_m: f64,
}

/// A positive deflection of the effector turns the part right-handed about the axis from the first point to the second.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    pub effector: String,
    pub axis_m: [BodyPlace; 2],
}

impl AircraftGeometry {
    /// Reads the file of an aircraft with these effectors; `file` stands for it in messages.
    pub fn from_toml(file: &str, text: &str, effectors: &EffectorList) -> Result<Self, Problem> {
        let geometry: Self = toml::from_str(text).at(file)?;
        for (index, part) in geometry.parts.iter().enumerate() {
            let name = &part.name;
            if geometry.parts[..index].iter().any(|other| other.name == *name) {
                return Err(problem!("{file}: two parts have the name {name:?}"));
            }
            part.check(effectors).at(format_args!("{file}: part {name:?}"))?;
        }
        let x_m = geometry.parts.iter().flat_map(GeometryPart::shape).map(|place| place.x);
        let (tail, nose) =
            x_m.fold((f64::INFINITY, -f64::INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if nose - tail < LENGTH_MIN_M {
            return Err(problem!(
                "{file}: the aircraft is {} m long; expected at least {LENGTH_MIN_M}",
                (nose - tail).max(0.0)
            ));
        }
        let named = |effector: &Effector| geometry.part_of(effectors.name(*effector)).is_some();
        match effectors.all().find(|effector| !named(effector)) {
            None => Ok(geometry),
            Some(missing) => Err(problem!(
                "{file}: no part has the effector {:?}, which the aircraft has",
                effectors.name(missing)
            )),
        }
    }

    /// The geometry in `file`, or else the one that comes with an aircraft: with the program, or beside its airframe file.
    pub fn of_aircraft(
        aircraft: &AircraftArgs,
        file: Option<&Path>,
        effectors: &EffectorList,
    ) -> Result<Self, Problem> {
        let name = aircraft.airframe.as_deref().unwrap_or(DEFAULT_NAME.as_ref());
        let is_shipped = GEOMETRIES.iter().any(|(known, _)| Path::new(known) == name);
        let file = match file {
            Some(file) => Named::read(file)?,
            None if is_shipped => Named::shipped_or_read(name, GEOMETRIES)?,
            None => Named::read(&name.with_file_name("geometry.toml"))
                .at("geometry of the aircraft, by default beside the airframe file")?,
        };
        Self::from_toml(&file.name, &file.text, effectors)
    }

    /// The part that an effector turns, or where it is.
    pub fn part_of(&self, effector: &str) -> Option<&GeometryPart> {
        self.parts.iter().find(|part| part.effectors().any(|name| name == effector))
    }
}

impl GeometryPart {
    /// Names of the effectors that turn it or are here.
    pub fn effectors(&self) -> impl Iterator<Item = &str> {
        self.hinges.iter().map(|hinge| hinge.effector.as_str()).chain(self.effector.as_deref())
    }

    /// The corners of a panel, or the centres of a body's sections.
    fn shape(&self) -> impl Iterator<Item = &BodyPlace> {
        self.corners_m.iter().chain(self.sections.iter().map(|section| &section.centre_m))
    }

    fn places(&self) -> impl Iterator<Item = &BodyPlace> {
        self.shape().chain(self.hinges.iter().flat_map(|hinge| &hinge.axis_m))
    }

    fn check(&self, effectors: &EffectorList) -> Result<(), Problem> {
        match (self.corners_m.len(), self.sections.len()) {
            (3.., 0) | (0, 2..) => {}
            (corners, sections) => {
                return Err(problem!(
                    "{corners} corners_m and {sections} sections; expected at least 3 corners_m, or at least 2 sections"
                ));
            }
        }
        let is_near = |place: &BodyPlace| place.iter().all(|m| m.abs() <= PLACE_MAX_M);
        if let Some(place) = self.places().find(|place| !is_near(place)) {
            return Err(problem!(
                "the place [{}, {}, {}]; expected numbers from -{PLACE_MAX_M} to {PLACE_MAX_M}",
                place.x,
                place.y,
                place.z
            ));
        }
        for Section { width_m, height_m, .. } in &self.sections {
            let is_size = |m: &f64| (0.0..=PLACE_MAX_M).contains(m);
            if !(is_size(width_m) && is_size(height_m)) {
                return Err(problem!(
                    "a section with width_m = {width_m}, height_m = {height_m}; expected 0 to {PLACE_MAX_M}"
                ));
            }
        }
        for Hinge { effector, axis_m: [from, to] } in &self.hinges {
            let length_m = (to - from).norm();
            if length_m < LENGTH_MIN_M {
                return Err(problem!(
                    "hinge of {effector:?}: the points of axis_m are {length_m} m apart; expected at least {LENGTH_MIN_M}"
                ));
            }
        }
        match self.effectors().find(|name| effectors.all().all(|e| effectors.name(e) != *name)) {
            None => Ok(()),
            Some(unknown) => {
                let known: Vec<_> = effectors.all().map(|e| effectors.name(e)).collect();
                Err(problem!("no effector {unknown:?}; the aircraft has {}", known.join(", ")))
            }
        }
    }

    /// How its effectors at these angles move it, hinge after hinge.
    pub fn motion(&self, angle_rad: impl Fn(&str) -> f64) -> Isometry3<f64> {
        let mut motion = Isometry3::identity();
        for Hinge { effector, axis_m: [from, to] } in &self.hinges {
            let axis = Unit::new_normalize(to - from);
            let turn = UnitQuaternion::from_axis_angle(&axis, angle_rad(effector));
            motion.append_rotation_wrt_point_mut(&turn, &Point3::from(*from));
        }
        motion
    }

    /// The same part with its effectors at these angles.
    #[must_use]
    pub fn deflected(&self, angle_rad: impl Fn(&str) -> f64) -> Self {
        let mut part = self.clone();
        let motion = self.motion(angle_rad);
        let moved = |place: &mut BodyPlace| *place = (motion * Point3::from(*place)).coords;
        part.corners_m.iter_mut().for_each(moved);
        part.sections.iter_mut().for_each(|section| moved(&mut section.centre_m));
        part
    }

    /// The middle of its corners or sections.
    pub fn middle_m(&self) -> BodyPlace {
        self.shape().sum::<BodyPlace>() / self.shape().count() as f64
    }
}

impl Section {
    /// Corners of its outline.
    pub fn around(&self) -> Vec<BodyPlace> {
        let corner = |index| {
            let (sin, cos) = libm::sincos(f64::from(index) * TAU / f64::from(SECTION_CORNERS));
            self.centre_m + Vector3::new(0.0, 0.5 * self.width_m * cos, 0.5 * self.height_m * sin)
        };
        (0..SECTION_CORNERS).map(corner).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use aircraft::MODELS;
    use autopilot::config;
    use icd::EffectorKind;
    use plant_sim::{Airframe, ReadAirframe as _};

    use super::*;

    fn shipped() -> impl Iterator<Item = (&'static str, Airframe, AircraftGeometry)> {
        aircraft::AIRFRAMES.iter().zip(GEOMETRIES).map(|((name, airframe), (same, geometry))| {
            assert_eq!(name, same, "airframes and geometries are in one order");
            let airframe = Airframe::from_toml(name, airframe).unwrap();
            let geometry =
                AircraftGeometry::from_toml(name, geometry, &airframe.effectors).unwrap();
            (*name, airframe, geometry)
        })
    }

    /// Where the middle of the effector's part goes with a small positive deflection, and where it was.
    fn moved(geometry: &AircraftGeometry, name: &str) -> (BodyPlace, BodyPlace) {
        let part = geometry.part_of(name).unwrap();
        let turned = part.deflected(|other| if other == name { 0.01 } else { 0.0 });
        (turned.middle_m() - part.middle_m(), part.middle_m())
    }

    #[test]
    fn a_positive_deflection_turns_each_part_as_its_moments_say() {
        for (name, airframe, geometry) in shipped() {
            let list = airframe.effectors;
            let text = MODELS.iter().find(|(known, _)| *known == name).unwrap().1;
            let model = config::model("model.toml", text).unwrap().aircraft;
            for effector in list.all().filter(|effector| list.is_angle(*effector)) {
                let effector_name = list.name(effector);
                let (motion, arm) = moved(&geometry, effector_name);
                // Air and exhaust push against the motion.
                let moment = arm.cross(&-motion);
                let surface = &model.effectors;
                let (axis, sign) = match list.kind(effector).unwrap() {
                    EffectorKind::Aileron => (0, surface.c_roll[effector]),
                    EffectorKind::Elevator | EffectorKind::Elevon | EffectorKind::Ruddervator => {
                        (1, surface.c_pitch[effector])
                    }
                    EffectorKind::Rudder => (2, surface.c_yaw[effector]),
                    EffectorKind::NozzlePitch => (1, 1.0),
                    EffectorKind::NozzleYaw => (2, 1.0),
                    kind => panic!("{effector_name}: {kind:?}"),
                };
                assert!(moment[axis] * sign > 0.0, "{name}: {effector_name}: {moment:?}");
            }
        }
    }

    #[test]
    fn the_wing_is_as_wide_as_the_span_and_each_side_mirrors_the_other() {
        for (_, airframe, geometry) in shipped() {
            let places = geometry.parts.iter().flat_map(|part| &part.corners_m);
            let half = places.map(|place| place.y).fold(0.0, f64::max);
            assert!((2.0 * half - airframe.aero.geometry().span_m).abs() < 1e-3, "{half} m");
            let rounded = |part: &GeometryPart, sign: f64| -> BTreeSet<[i64; 3]> {
                let mm = |m: f64| (m * 1000.0).round() as i64;
                part.corners_m.iter().map(|at| [mm(at.x), mm(sign * at.y), mm(at.z)]).collect()
            };
            let left = geometry.parts.iter().filter(|part| part.name.starts_with("left"));
            for part in left {
                let other = part.name.replacen("left", "right", 1);
                let other = geometry.parts.iter().find(|part| part.name == other).unwrap();
                assert_eq!(rounded(part, -1.0), rounded(other, 1.0), "{}", part.name);
            }
        }
    }

    #[test]
    fn an_aircraft_without_length_is_refused() {
        let list = Airframe::paper().effectors;
        let text = "[[part]]\nname = \"fin\"\ncorners_m = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n";
        let error =
            AircraftGeometry::from_toml("geometry.toml", text, &list).unwrap_err().to_string();
        assert!(error.starts_with("geometry.toml: the aircraft is 0 m long"), "{error}");
    }

    #[test]
    fn a_mistake_in_the_file_is_named() {
        let list = Airframe::paper().effectors;
        let shipped = GEOMETRIES[0].1;
        let refused = [
            (
                "name = \"left wing\"",
                "name = \"right wing\"",
                "two parts have the name \"right wing\"",
            ),
            (
                "\"left aileron\"\naxis",
                "\"left flap\"\naxis",
                "no effector \"left flap\"; the aircraft has left aileron,",
            ),
            ("effector = \"engine\"", "", "no part has the effector \"engine\""),
            (
                "corners_m = [[",
                "corners_m = [[nan, 0.0, 0.0], [",
                "the place [NaN, 0, 0]; expected numbers from -100 to 100",
            ),
            ("width_m = 1.1", "width_m = -1.1", "width_m = -1.1"),
            ("sections = [", "section = [", "unknown field `section`"),
            (
                "\naxis_m = [[",
                "\naxis_m = [[5.0, 0.0, 0.0], [5.0, 0.0, 0.0]]\n#",
                "the points of axis_m are 0 m apart",
            ),
        ];
        for (from, to, expected) in refused {
            let text = shipped.replacen(from, to, 1);
            assert_ne!(text, shipped, "{from}");
            let error = AircraftGeometry::from_toml("geometry.toml", &text, &list).unwrap_err();
            let error = error.to_string();
            assert!(error.contains("geometry.toml") && error.contains(expected), "{error}");
        }
    }
}
