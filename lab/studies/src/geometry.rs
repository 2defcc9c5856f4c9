//! `sitl aircraft draw`: the parts of an aircraft and its effectors in three views.

use std::path::PathBuf;

use host_io::folder::OutFolder;
use host_io::print_line;
use host_io::problem::{Problem, problem};
use icd::{Effector, PerEffector};
use lab_engine::configuration::AircraftArgs;
use lab_engine::geometry::{AircraftGeometry, BodyPlace, GeometryPart, Hinge, Section};
use lab_engine::settings::Target;
use lab_report::chart::drawing::{Drawing, stroke};
use lab_report::chart::{Figure, Ink, Pattern, WIDTH, write_figure};
use nalgebra::Vector3;
use plant_sim::Airframe;

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
    let file = args.geometry.as_deref();
    let geometry = AircraftGeometry::of_aircraft(&args.aircraft, file, &airframe.effectors)?;
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
        let side = |sign: f64| move |section: &Section| self.edge(section, sign);
        let there = part.sections.iter().map(side(1.0));
        there.chain(part.sections.iter().rev().map(side(-1.0))).collect()
    }

    /// The edge of a section on one side of the line of sight.
    fn edge(&self, section: &Section, sign: f64) -> BodyPlace {
        let half = Vector3::new(0.0, 0.5 * section.width_m, 0.5 * section.height_m);
        let across = self.right.abs() + self.up.abs();
        section.centre_m + half.component_mul(&across) * sign
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use aircraft::GEOMETRIES;
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
}
