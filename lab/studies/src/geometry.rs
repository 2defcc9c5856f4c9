//! Where the parts of an aircraft are and how its effectors turn them: `aircraft/NAME/geometry.toml`, and
//! `sitl aircraft draw`.
//!
//! Body axes: x forward, y right, z down, m from the centre of gravity. Nothing here decides a flight.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use aircraft::{DEFAULT_NAME, GEOMETRIES};
use host_io::folder::OutFolder;
use host_io::print_line;
use host_io::problem::{At as _, Problem, problem};
use icd::{Effector, EffectorList, PerEffector};
use lab_engine::configuration::{AircraftArgs, Named};
use lab_engine::settings::Target;
use lab_report::chart::drawing::{Drawing, stroke};
use lab_report::chart::{Figure, Ink, Pattern, WIDTH, write_figure};
use nalgebra::Vector3;
use plant_sim::Airframe;
use serde::Deserialize;

/// A place, m.
type BodyPlace = Vector3<f64>;

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

    /// The part that an effector turns, or where it is.
    pub fn part_of(&self, effector: &str) -> Option<&GeometryPart> {
        self.parts.iter().find(|part| part.effectors().any(|name| name == effector))
    }
}

impl GeometryPart {
    fn effectors(&self) -> impl Iterator<Item = &str> {
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

    /// The same part with its effectors at these angles.
    #[must_use]
    pub fn deflected(&self, angle_rad: impl Fn(&str) -> f64) -> Self {
        let mut part = self.clone();
        for hinge in &self.hinges {
            let (sin, cos) = libm::sincos(angle_rad(&hinge.effector));
            let [from, to] = hinge.axis_m;
            let axis = (to - from).normalize();
            // Rodrigues' rotation about an axis that does not pass through the origin.
            let turn = |place: &mut BodyPlace| {
                let arm = *place - from;
                *place = from
                    + arm * cos
                    + axis.cross(&arm) * sin
                    + axis * (axis.dot(&arm) * (1.0 - cos));
            };
            part.corners_m.iter_mut().for_each(turn);
            part.sections.iter_mut().for_each(|section| turn(&mut section.centre_m));
        }
        part
    }

    /// The middle of its corners or sections.
    pub fn middle_m(&self) -> BodyPlace {
        self.shape().sum::<BodyPlace>() / self.shape().count() as f64
    }
}

/// Options of `sitl aircraft draw`.
#[derive(Debug, Clone, clap::Args)]
pub struct DrawArgs {
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// Its geometry [default: geometry.toml beside the airframe file]
    #[arg(long, value_name = "FILE")]
    geometry: Option<PathBuf>,
    /// Draw an effector at this angle, deg, as left_elevator=30; repeatable
    #[arg(long, value_name = "NAME=DEG", value_parser = parse_deflection)]
    deflect: Vec<(String, f64)>,
    /// Folder for the picture
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

fn parse_deflection(text: &str) -> Result<(String, f64), String> {
    let parts = text.split_once('=').and_then(|(name, deg)| Some((name.trim(), deg.parse().ok()?)));
    match parts {
        Some((name, deg)) if f64::is_finite(deg) => Ok((name.to_owned(), deg)),
        _ => Err("expected NAME=DEG, as in left_elevator=30".to_owned()),
    }
}

/// Draws the aircraft: `aircraft.svg` and `aircraft.png`.
pub fn run(args: &DrawArgs) -> Result<(), Problem> {
    args.aircraft.check_read(&[Target::Airframe])?;
    let airframe = args.aircraft.airframe()?;
    let name = args.aircraft.airframe.as_deref().unwrap_or(DEFAULT_NAME.as_ref());
    let is_shipped = GEOMETRIES.iter().any(|(known, _)| Path::new(known) == name);
    let file = match &args.geometry {
        Some(file) => Named::read(file)?,
        None if is_shipped => Named::shipped_or_read(name, GEOMETRIES)?,
        None => Named::read(&name.with_file_name("geometry.toml"))
            .at("--geometry FILE, by default beside the airframe file")?,
    };
    let list = &airframe.effectors;
    let geometry = AircraftGeometry::from_toml(&file.name, &file.text, list)?;
    let deflections = deflections(&args.deflect, &airframe)?;
    let title = format!("{}, three views", airframe.name);
    let figure = Figure {
        name: "aircraft",
        caption: title.clone(),
        svg: draw(&title, &geometry, &airframe, &deflections),
    };
    let folder = OutFolder::create(&args.out)?;
    write_figure(&folder, &figure)?;
    print_line!("wrote {}", folder.path().display());
    Ok(())
}

/// The angles of the options, rad, inside each travel.
fn deflections(
    options: &[(String, f64)],
    airframe: &Airframe,
) -> Result<PerEffector<f64>, Problem> {
    let list = &airframe.effectors;
    let mut angles = PerEffector::default();
    for (key, deg) in options {
        let Some(effector) = list.by_key(key).filter(|effector| list.is_angle(*effector)) else {
            let known: Vec<_> =
                list.all().filter(|e| list.is_angle(*e)).map(|e| list.key(e)).collect();
            return Err(problem!("--deflect {key}: expected one of {}", known.join(", ")));
        };
        let [low, high] = travel_deg(airframe, effector);
        if !(low..=high).contains(deg) {
            return Err(problem!("--deflect {key}={deg}: expected {low} to {high} deg"));
        }
        angles[effector] = deg.to_radians();
    }
    Ok(angles)
}

/// The travel, to the hundredth: the file's degrees went through radians.
fn travel_deg(airframe: &Airframe, effector: Effector) -> [f64; 2] {
    let servo = &airframe.servos[effector];
    [servo.min, servo.max].map(rounded_deg)
}

fn rounded_deg(rad: f64) -> f64 {
    (rad.to_degrees() * 100.0).round() / 100.0
}

/// A view: to the right and up on the paper, in body axes.
#[derive(Debug, Clone, Copy)]
struct Projection {
    title: &'static str,
    right: BodyPlace,
    up: BodyPlace,
}

const PROJECTIONS: [Projection; 3] = [
    Projection {
        title: "from above",
        right: Vector3::new(0.0, 1.0, 0.0),
        up: Vector3::new(1.0, 0.0, 0.0),
    },
    Projection {
        title: "from the left",
        right: Vector3::new(-1.0, 0.0, 0.0),
        up: Vector3::new(0.0, 0.0, -1.0),
    },
    Projection {
        title: "from behind",
        right: Vector3::new(0.0, 1.0, 0.0),
        up: Vector3::new(0.0, 0.0, -1.0),
    },
];

/// Colours of the effectors, in the order of the aircraft's list.
const COLOURS: [&str; Effector::MAX] = [
    "#0072b2", "#56b4e9", "#d55e00", "#e69f00", "#009e73", "#cc79a7", "#8c5fa8", "#777777",
    "#1f4e79", "#2a9d8f", "#9b2226", "#b5a400", "#6b8e23", "#d4418e", "#4b3f8f", "#3d3d3d",
];
const MARGIN: f64 = 40.0;
/// Height of the title and of a view's.
const HEAD: f64 = 60.0;
const LINE_HEIGHT: f64 = 24.0;
const OUTLINE: Ink = Ink::new("#444", Pattern::Solid).wide(1.2);
const FIXED: &str = "#e4e8ee";
const HINGE: Ink = Ink::new("#000", Pattern::Fine).wide(1.2);

/// From above on the left; from the left, from behind and the effectors by colour on the right. One scale.
fn draw(
    title: &str,
    geometry: &AircraftGeometry,
    airframe: &Airframe,
    angles: &PerEffector<f64>,
) -> String {
    let list = &airframe.effectors;
    let by_name = |name: &str| list.all().find(|effector| list.name(*effector) == name);
    let angle = |name: &str| by_name(name).map_or(0.0, |effector| angles[effector]);
    let parts: Vec<_> = geometry.parts.iter().map(|part| part.deflected(angle)).collect();
    let [top, side, back] = PROJECTIONS.map(|view| (view, view.extent(&parts)));
    let right_width = side.1.width().max(back.1.width());
    let scale = (WIDTH - 3.0 * MARGIN) / (top.1.width() + right_width);
    let right_x = 2.0 * MARGIN + scale * top.1.width();
    let back_y = HEAD + scale * side.1.height() + HEAD;
    let mut drawing = Drawing::default();
    drawing.text((14.0, 25.0), "start", r#" font-size="20""#, title);
    let corners = [(MARGIN, HEAD), (right_x, HEAD), (right_x, back_y)];
    for ((view, extent), (x, y)) in [top, side, back].into_iter().zip(corners) {
        drawing.text((x, y - 8.0), "start", r##" fill="#555""##, view.title);
        let on_paper = |place: &BodyPlace| {
            let (right, up) = view.seen(place);
            (x + scale * (right - extent.right[0]), y + scale * (extent.up[1] - up))
        };
        // What is farther away is drawn first.
        let mut sorted: Vec<_> = parts.iter().collect();
        sorted.sort_by(|a, b| view.depth(a).total_cmp(&view.depth(b)));
        for part in sorted {
            // A panel that is seen edge-on has nothing but its outline.
            let (fill, outline) = match part.effectors().find_map(by_name) {
                Some(effector) => (colour(effector), Ink { colour: colour(effector), ..OUTLINE }),
                None => (FIXED, OUTLINE),
            };
            let style = format!(r#"fill="{fill}" fill-opacity="0.85" {}"#, stroke(&outline));
            drawing.polygon(view.outline(part).iter().map(on_paper), &style, &part.name);
            for Hinge { axis_m, .. } in part.hinges.iter().filter(|_| !part.corners_m.is_empty()) {
                drawing.path(axis_m.iter().map(on_paper), &HINGE);
            }
        }
    }
    let legend_y = back_y + scale * back.1.height() + HEAD;
    let low = draw_legend(&mut drawing, (right_x, legend_y), geometry, airframe, angles);
    let left_height = HEAD + scale * top.1.height();
    drawing.finish((WIDTH, low.max(left_height) + MARGIN))
}

/// The effectors with their colours and angles; where it ends, from the top.
fn draw_legend(
    drawing: &mut Drawing,
    (x, mut y): (f64, f64),
    geometry: &AircraftGeometry,
    airframe: &Airframe,
    angles: &PerEffector<f64>,
) -> f64 {
    let list = &airframe.effectors;
    let by_name = |name: &str| list.all().find(|effector| list.name(*effector) == name);
    let mut line = |text: &str, colour: Option<&str>, drawing: &mut Drawing| {
        if let Some(colour) = colour {
            let style = format!(r#"fill="{colour}""#);
            drawing.rectangle((x, y - 11.0), (x + 14.0, y + 1.0), &style, "");
        }
        drawing.text((x + 22.0, y), "start", "", text);
        y += LINE_HEIGHT;
    };
    let shared = |name: &str| geometry.part_of(name)?.effectors().find_map(by_name);
    for effector in list.all() {
        let text = match list.is_angle(effector) {
            true => {
                let [low, high] = travel_deg(airframe, effector);
                let at = rounded_deg(angles[effector]);
                format!("{}: {low} to {high} deg, here {at} deg", list.name(effector))
            }
            false => list.name(effector).to_owned(),
        };
        let of_part = shared(list.name(effector)).unwrap_or(effector);
        line(&text, Some(colour(of_part)), drawing);
    }
    let metres = format!("span {} m", airframe.aero.geometry().span_m);
    line(&metres, None, drawing);
    drawing.path([(x, y - 5.0), (x + 14.0, y - 5.0)], &HINGE);
    drawing.text((x + 22.0, y), "start", "", "hinge axis");
    y
}

fn colour(effector: Effector) -> &'static str {
    COLOURS[effector.index() % COLOURS.len()]
}

/// What a view shows, m: from left to right and from low to high.
#[derive(Debug, Clone, Copy)]
struct DrawnBox {
    right: [f64; 2],
    up: [f64; 2],
}

impl DrawnBox {
    fn width(&self) -> f64 {
        self.right[1] - self.right[0]
    }

    fn height(&self) -> f64 {
        self.up[1] - self.up[0]
    }
}

impl Projection {
    fn seen(&self, place: &BodyPlace) -> (f64, f64) {
        (self.right.dot(place), self.up.dot(place))
    }

    /// Larger is nearer to the eye.
    fn depth(&self, part: &GeometryPart) -> f64 {
        self.right.cross(&self.up).dot(&part.middle_m())
    }

    fn extent(&self, parts: &[GeometryPart]) -> DrawnBox {
        let mut extent = DrawnBox {
            right: [f64::INFINITY, -f64::INFINITY],
            up: [f64::INFINITY, -f64::INFINITY],
        };
        for place in parts.iter().flat_map(|part| self.outline(part)) {
            let (right, up) = self.seen(&place);
            extent.right = [extent.right[0].min(right), extent.right[1].max(right)];
            extent.up = [extent.up[0].min(up), extent.up[1].max(up)];
        }
        extent
    }

    /// The corners of a panel; of a body its sides, or its sections where the view is along it.
    fn outline(&self, part: &GeometryPart) -> Vec<BodyPlace> {
        if !part.corners_m.is_empty() {
            return part.corners_m.clone();
        }
        let forward = Vector3::x();
        if self.right.dot(&forward) == 0.0 && self.up.dot(&forward) == 0.0 {
            let area = |section: &&Section| section.width_m * section.height_m;
            let largest = part.sections.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
            return largest.map(Section::around).unwrap_or_default();
        }
        let side = |sign: f64| move |section: &Section| section.side(self, sign);
        let there = part.sections.iter().map(side(1.0));
        there.chain(part.sections.iter().rev().map(side(-1.0))).collect()
    }
}

impl Section {
    fn around(&self) -> Vec<BodyPlace> {
        let corner = |index| {
            let (sin, cos) = libm::sincos(f64::from(index) * TAU / f64::from(SECTION_CORNERS));
            self.centre_m + Vector3::new(0.0, 0.5 * self.width_m * cos, 0.5 * self.height_m * sin)
        };
        (0..SECTION_CORNERS).map(corner).collect()
    }

    /// The edge on one side of the line of sight.
    fn side(&self, view: &Projection, sign: f64) -> BodyPlace {
        let half = Vector3::new(0.0, 0.5 * self.width_m, 0.5 * self.height_m);
        let across = view.right.abs() + view.up.abs();
        self.centre_m + half.component_mul(&across) * sign
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use aircraft::MODELS;
    use autopilot::config;
    use icd::EffectorKind;
    use plant_sim::ReadAirframe as _;

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
                    EffectorKind::Elevator => (1, surface.c_pitch[effector]),
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
    fn the_picture_names_every_effector_and_a_deflection_changes_its_part_alone() {
        for (name, airframe, geometry) in shipped() {
            let polygons = |svg: &str| -> BTreeSet<String> {
                svg.split("<polygon")
                    .skip(1)
                    .map(|text| text.split('>').next().unwrap().to_owned())
                    .collect()
            };
            let plain = draw(name, &geometry, &airframe, &PerEffector::default());
            let list = &airframe.effectors;
            for effector in list.all() {
                assert!(plain.contains(list.name(effector)), "{name}: {}", list.name(effector));
            }
            let options = [("left_elevator".to_owned(), 20.0)];
            let Ok(angles) = deflections(&options, &airframe) else { continue };
            let turned = draw(name, &geometry, &airframe, &angles);
            // In each of the three views.
            assert_eq!(polygons(&turned).difference(&polygons(&plain)).count(), 3, "{name}");
        }
    }

    #[test]
    fn an_angle_outside_its_travel_and_an_unknown_effector_are_refused() {
        let airframe = Airframe::paper();
        let refused = |key: &str, deg| {
            deflections(&[(key.to_owned(), deg)], &airframe).unwrap_err().to_string()
        };
        assert_eq!(
            refused("left_elevator", 31.0),
            "--deflect left_elevator=31: expected -30 to 30 deg"
        );
        let known = "left_aileron, right_aileron, left_elevator";
        for key in ["flap", "engine"] {
            let message = refused(key, 1.0);
            assert!(
                message.starts_with(&format!("--deflect {key}: expected one of {known}")),
                "{message}"
            );
        }
        assert!(
            parse_deflection("left_elevator").is_err() && parse_deflection("rudder=nan").is_err()
        );
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
