//! Which figures there are, and what is in them. A signal that the log does not have leaves its curve out.

use flight_control::CompensatorMode;
use icd::record::effector_field;
use icd::units::DEG_PER_RAD;
use icd::{Effector, EffectorKind, LateralSide};
use nalgebra::Vector3;

use super::errors;
use super::events::detections;
use super::flight::{FaultSpan, Flight, Kind};
use lab_report::chart::axis::range;
use lab_report::chart::curve::{Point, thin};
use lab_report::chart::panel::{Band, Curve, Panel, Rule};
use lab_report::chart::{Ink, Pattern};

/// Height of a frame.
const TALL: f64 = 230.0;
/// Height of one of many.
const LOW: f64 = 170.0;

/// A measured or true signal.
const MAIN: Ink = Ink::new("#0050aa", Pattern::Solid);
/// Its reference or command.
const REFERENCE: Ink = Ink::new("#c81e1e", Pattern::Dashed);
/// A second signal of the same kind.
const SECOND: Ink = Ink::new("#c86e00", Pattern::Solid);
const THIRD: Ink = Ink::new("#007d37", Pattern::Solid);
/// A noisy signal under others: an estimate of the observer, or what a sensor reports.
const NOISY: Ink = Ink::new("#6ea0d7", Pattern::Solid).wide(1.0);
/// The truth beside an estimate.
const TRUE: Ink = Ink::new("#964600", Pattern::Solid).wide(1.0);

/// A figure: panels under one heading, with a sentence.
#[derive(Debug)]
pub struct Group {
    pub title: &'static str,
    pub caption: String,
    /// The panels; without one the figure names what is missing.
    pub panels: Vec<Panel<'static>>,
}

/// All figures over time.
pub fn groups(flight: &Flight) -> Vec<Group> {
    let all = [
        path(flight),
        attitude(flight),
        air(flight),
        rates(flight),
        navigation(flight),
        estimate(flight),
        compensator(flight),
        effectors(flight),
    ];
    // Of a flight without an estimator there is nothing to say about one.
    let is_there = |group: &Group| group.title != NAVIGATION || flight.is_estimated();
    all.into_iter().filter(is_there).collect()
}

/// One signal of a panel.
#[derive(Clone, Copy)]
struct PanelSignal<'a> {
    topic: &'a str,
    column: &'a str,
    scale: f64,
    name: &'static str,
    ink: Ink,
}

const fn signal<'a>(
    topic: &'a str,
    column: &'a str,
    scale: f64,
    name: &'static str,
    ink: Ink,
) -> PanelSignal<'a> {
    PanelSignal { topic, column, scale, name, ink }
}

fn curves(flight: &Flight, signals: &[PanelSignal<'_>]) -> Vec<Curve> {
    let curve = |signal: &PanelSignal<'_>| {
        let points = flight.thinned(signal.topic, signal.column, signal.scale)?;
        Some(Curve { name: signal.name, ink: signal.ink, points })
    };
    signals.iter().filter_map(curve).collect()
}

/// A quantity of the state: what its sensor reports; where the autopilot flies on an estimate, that and the truth too.
fn state<'a>(
    flight: &Flight,
    [measured, estimated, truth]: [&'a str; 3],
    scale: f64,
    name: &'static str,
) -> Vec<PanelSignal<'a>> {
    if !flight.is_estimated() {
        return vec![signal("sensors", measured, scale, name, MAIN)];
    }
    vec![
        signal("sensors", measured, scale, "measured", NOISY),
        signal("truth", truth, scale, "truth", TRUE.wide(1.5)),
        signal("control", estimated, scale, "estimate", MAIN),
    ]
}

/// A panel around its curves, or nothing if there is none.
fn panel(
    title: impl Into<String>,
    y_label: &'static str,
    span_min: f64,
    height: f64,
    curves: Vec<Curve>,
) -> Option<Panel<'static>> {
    if curves.is_empty() {
        return None;
    }
    let y = range(curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.1)), span_min);
    Some(Panel { title: title.into(), y_label, y, height, curves, ..Panel::default() })
}

/// A panel of signals: title, label of the values, smallest span, height.
type Plan<'a> = (&'static str, &'static str, f64, f64, &'a [PanelSignal<'a>]);

fn group(flight: &Flight, title: &'static str, caption: &str, plans: &[Plan<'_>]) -> Group {
    let panels = plans.iter().filter_map(|(title, y_label, span_min, height, signals)| {
        panel(*title, y_label, *span_min, *height, curves(flight, signals))
    });
    Group { title, caption: caption.to_owned(), panels: panels.collect() }
}

/// What ideal sensors report is the truth, but for the gyros; of others the truth stands beside it.
fn path(flight: &Flight) -> Group {
    let with_reference = |column, reference, name| {
        let mut signals = state(flight, [column; 3], 1.0, name);
        signals.push(signal("control", reference, 1.0, "reference", REFERENCE));
        signals
    };
    let altitude = with_reference("altitude_m", "altitude_reference_m", "altitude");
    let speed = with_reference("airspeed_m_s", "airspeed_reference_m_s", "true airspeed");
    let plans: [Plan<'_>; 2] = [
        ("Altitude above the ellipsoid", "altitude, m", 20.0, TALL, &altitude),
        ("True airspeed", "airspeed, m/s", 5.0, TALL, &speed),
    ];
    let caption = "The reference is what the controller is asked for, after its own slew limit.";
    group(flight, "Altitude and airspeed", caption, &plans)
}

fn attitude(flight: &Flight) -> Group {
    let names = ["attitude_w", "attitude_x", "attitude_y", "attitude_z"];
    let is_estimated = flight.is_estimated();
    let angles = flight.angles("sensors", names).filter(|_| !is_estimated).unwrap_or_default();
    let thinned = |value: fn(&icd::EulerAngles) -> f64| {
        let points = angles.iter().map(|(t_s, angles)| (*t_s, value(angles) * DEG_PER_RAD));
        broken_at_wraps(thin(points, flight.span.0, flight.span.1))
    };
    let curve = |name, value| Curve { name, ink: MAIN, points: thinned(value) };
    let (mut roll, mut pitch) = (Vec::new(), Vec::new());
    if !angles.is_empty() {
        roll.push(curve("roll angle", |angles| angles.phi));
        pitch.push(curve("pitch angle", |angles| angles.theta));
    }
    if is_estimated {
        for (curves_of, column) in [(&mut roll, "roll_rad"), (&mut pitch, "pitch_rad")] {
            let truth = signal("truth", column, DEG_PER_RAD, "truth", TRUE.wide(1.5));
            let estimate = signal("control", column, DEG_PER_RAD, "estimate", MAIN);
            let curves = curves(flight, &[truth, estimate]).into_iter();
            curves_of.extend(
                curves.map(|curve| Curve { points: broken_at_wraps(curve.points), ..curve }),
            );
        }
    }
    let reference = signal("control", "roll_reference_rad", DEG_PER_RAD, "reference", REFERENCE);
    roll.extend(curves(flight, &[reference]));
    let panels = [
        panel("Roll angle (right wing down positive)", "roll, deg", 10.0, TALL, roll),
        panel("Pitch angle (nose up positive)", "pitch, deg", 5.0, TALL, pitch),
    ];
    Group {
        title: "Attitude",
        caption: "Altitude is held by pitch, so pitch has no reference of its own.".to_owned(),
        panels: panels.into_iter().flatten().collect(),
    }
}

/// An angle jumps by a whole turn where its measure wraps; no line is drawn there.
fn broken_at_wraps(points: Vec<Point>) -> Vec<Point> {
    let mut broken: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        if broken.last().is_some_and(|before| (point.1 - before.1).abs() > 180.0) {
            // What is no number makes a gap.
            broken.push((point.0, f64::NAN));
        }
        broken.push(point);
    }
    broken
}

fn air(flight: &Flight) -> Group {
    let sideslip = "sideslip (wind from the right positive)";
    let attack = if flight.is_estimated() {
        [
            signal("truth", "alpha_rad", DEG_PER_RAD, "true angle of attack", TRUE.wide(1.5)),
            signal("control", "alpha_rad", DEG_PER_RAD, "estimated angle of attack", MAIN),
            signal("truth", "beta_rad", DEG_PER_RAD, "true sideslip", SECOND),
            signal("control", "beta_rad", DEG_PER_RAD, "estimated sideslip", THIRD),
        ]
        .to_vec()
    } else {
        [
            signal("sensors", "angle_of_attack_rad", DEG_PER_RAD, "angle of attack", MAIN),
            signal("sensors", "sideslip_rad", DEG_PER_RAD, sideslip, SECOND),
        ]
        .to_vec()
    };
    // Measured: minus the z component of the accelerometers.
    let measured = -1.0 / 9.806_65;
    let name = "normal load factor, measured";
    let load = if flight.signal("truth", "load_factor_g", 1.0).is_some() {
        [signal("truth", "load_factor_g", 1.0, "normal load factor", MAIN)]
    } else {
        [signal("sensors", "specific_force_z_m_s2", measured, name, MAIN)]
    };
    let plans: [Plan<'_>; 2] = [
        ("Angle of attack and sideslip", "angle, deg", 4.0, TALL, &attack),
        ("Normal load factor (1 g in level flight)", "load factor, g", 0.5, LOW, &load),
    ];
    group(flight, "Air", "Both angles are those of the air, gusts included.", &plans)
}

fn rates(flight: &Flight) -> Group {
    let signals = [
        signal("sensors", "body_rate_p_rad_s", DEG_PER_RAD, "p, roll rate", MAIN),
        signal("sensors", "body_rate_q_rad_s", DEG_PER_RAD, "q, pitch rate", SECOND),
        signal("sensors", "body_rate_r_rad_s", DEG_PER_RAD, "r, yaw rate", THIRD),
    ];
    let plans: [Plan<'_>; 1] = [("Body rates", "rate, deg/s", 4.0, TALL, &signals)];
    group(flight, "Body rates", "As the gyros report them, with their noise.", &plans)
}

const NAVIGATION: &str = "Error of the estimated state";

/// Estimate minus truth, beside the standard deviation that the estimator gives itself.
fn navigation(flight: &Flight) -> Group {
    let panels = errors::QUANTITIES.iter().filter_map(|quantity| {
        let [error, deviation] = errors::of(flight, quantity)?;
        let curve = |name, ink, points| {
            let points = thin(points, flight.span.0, flight.span.1);
            Curve { name, ink, points }
        };
        let curves = vec![
            curve("error", MAIN, error),
            curve("standard deviation of the estimator", REFERENCE, deviation),
        ];
        panel(quantity.title, quantity.y_label, quantity.span_min, LOW, curves)
    });
    Group {
        title: NAVIGATION,
        caption: "Magnitude of estimate minus truth. The estimator knows the standard deviation only; of several \
                  components it is the root of the sum of their variances. An error of up to twice as much is usual."
            .to_owned(),
        panels: panels.collect(),
    }
}

/// Axes of the estimate: name, letter, column of z2.
const AXES: [(&str, &str); 3] =
    [("roll", "z2_roll_rad_s2"), ("pitch", "z2_pitch_rad_s2"), ("yaw", "z2_yaw_rad_s2")];

fn estimate(flight: &Flight) -> Group {
    let truth = flight.true_fault_acceleration();
    let panels = AXES.into_iter().enumerate().filter_map(|(axis, (name, column))| {
        let estimate = signal("control", column, 1.0, "estimate z2", NOISY);
        let mut curves_here = curves(flight, &[estimate]);
        if let Some(truth) = &truth {
            let points = truth.iter().map(|(t_s, f): &(f64, Vector3<f64>)| (*t_s, f[axis]));
            let points = thin(points, flight.span.0, flight.span.1);
            curves_here.push(Curve { name: "true F", ink: TRUE, points });
        }
        let title = format!("Fault acceleration about the {name} axis");
        let mut panel = panel(title, "rad/s\u{b2}", 0.05, LOW, curves_here)?;
        let level = flight.control.as_ref().map(|control| {
            let activation = &control.settings.gains.activation;
            [activation.level_roll, activation.level_pitch, activation.level_yaw][axis]
        });
        if let Some(level) = level {
            // One label is enough for both sides.
            with_rules(&mut panel, &[(level, "level, either way"), (-level, "")]);
        }
        panel.bands = active(flight);
        Some(panel)
    });
    let caption = "What no part of the model explains: the estimate of the observer, and the truth F if the log has it. \
                   Beyond its level for 20 ms a fault is seen (shaded). The levels are those at the beginning of the \
                   flight.";
    Group {
        title: "Estimated fault acceleration",
        caption: caption.to_owned(),
        panels: panels.collect(),
    }
}

/// Draws limits into a panel and makes room for them.
fn with_rules(panel: &mut Panel<'_>, rules: &[(f64, &str)]) {
    for (value, label) in rules {
        let room = 0.06 * (panel.y.1 - panel.y.0).max(value.abs());
        panel.y = (panel.y.0.min(value - room), panel.y.1.max(value + room));
        panel.rules.push(Rule { value: *value, label: (*label).to_owned() });
    }
}

/// When a fault was seen.
fn active(flight: &Flight) -> Vec<Band> {
    let band = |(mode, span)| {
        let label = match mode {
            CompensatorMode::Off => "fault seen, compensator off",
            CompensatorMode::Armed => "compensator awake",
            CompensatorMode::AlwaysOn => "fault seen",
        };
        Band { span, colour: Kind::Compensator.colour(), label: label.to_owned() }
    };
    detections(flight).into_iter().map(band).collect()
}

fn compensator(flight: &Flight) -> Group {
    let fade = [signal("control", "fade", 1.0, "fade: part that is let through", MAIN)];
    let mut panels: Vec<Panel<'static>> =
        panel("How much the compensator acts", "0 to 1", 1.1, 120.0, curves(flight, &fade))
            .map(|panel| Panel { bands: active(flight), y: (-0.05, 1.1), ..panel })
            .into_iter()
            .collect();
    let model = flight.control.as_ref().map(|control| &control.settings.model.effectors);
    let of_kind = |kind| {
        let model = model?;
        Some(model.servos[model.list.of_kind(kind).next()?].max)
    };
    let axes = [
        ("Ailerons: addition to the roll command", "aileron_rad", EffectorKind::Aileron),
        ("Nozzle pitch angle", "nozzle_pitch_rad", EffectorKind::NozzlePitch),
        ("Nozzle yaw angle", "nozzle_yaw_rad", EffectorKind::NozzleYaw),
    ];
    let list = &flight.effectors;
    for (title, column, kind) in axes.into_iter().filter(|(.., kind)| list.only(*kind).is_some()) {
        let demand = format!("compensation_{column}");
        let applied = format!("applied_{column}");
        let signals = [
            signal("control", &demand, DEG_PER_RAD, "demanded", REFERENCE),
            signal("control", &applied, DEG_PER_RAD, "applied, after limits", MAIN),
        ];
        let Some(mut panel) = panel(title, "deg", 2.0, LOW, curves(flight, &signals)) else {
            continue;
        };
        if let Some(limit) = of_kind(kind) {
            let limit = limit * DEG_PER_RAD;
            with_rules(&mut panel, &[(limit, "end of travel, either way"), (-limit, "")]);
        }
        panel.bands = active(flight);
        panels.push(panel);
    }
    // The ailerons have their panel above.
    let other = |kind: &EffectorKind| kind.is_surface() && *kind != EffectorKind::Aileron;
    panels
        .extend(EffectorKind::ALL.into_iter().filter(other).filter_map(|kind| added(flight, kind)));
    panels.extend(authority(flight));
    Group {
        title: "Compensator",
        caption: "What the compensator asks of the effectors to cancel the estimate, and what of it is left \
                  after the limits. The travel is shared with the main controller, whose part is not in these."
            .to_owned(),
        panels,
    }
}

/// What the allocation adds to the surfaces of a kind; `None` where it adds nothing.
fn added(flight: &Flight, kind: EffectorKind) -> Option<Panel<'static>> {
    let list = &flight.effectors;
    let named = |effector: Effector| match list.entry(effector)?.side {
        LateralSide::Left => Some((effector, "left", MAIN)),
        LateralSide::Right => Some((effector, "right", SECOND)),
        LateralSide::Centre => Some((effector, "centre", THIRD)),
    };
    let of = |(effector, name, ink)| {
        let column = effector_field("added", list, effector);
        curves(flight, &[signal("control", &column, DEG_PER_RAD, name, ink)])
    };
    let curves: Vec<Curve> = list.of_kind(kind).filter_map(named).flat_map(of).collect();
    let is_added = |curve: &Curve| curve.points.iter().any(|(_, added)| *added != 0.0);
    let title = format!("{}: addition to the commands", title(&kind.key().replace('_', " ")));
    let panel = panel(title, "deg", 2.0, LOW, curves.into_iter().filter(is_added).collect())?;
    Some(Panel { bands: active(flight), ..panel })
}

/// What is left of the effectors, if the log has it.
fn authority(flight: &Flight) -> Option<Panel<'static>> {
    const AXES: [(&str, [&str; 2], Ink); 3] = [
        ("roll", ["authority_roll_pct", "roll_pct"], MAIN),
        ("pitch", ["authority_pitch_pct", "pitch_pct"], SECOND),
        ("yaw", ["authority_yaw_pct", "yaw_pct"], THIRD),
    ];
    let of = |(name, columns, ink): (&'static str, [&str; 2], Ink)| {
        let places = ["why", "control"];
        let mut found = places.into_iter().flat_map(|topic| columns.map(|column| (topic, column)));
        let points = found.find_map(|(topic, column)| flight.thinned(topic, column, 1.0))?;
        Some(Curve { name, ink, points })
    };
    let curves: Vec<Curve> = AXES.into_iter().filter_map(of).collect();
    let panel = panel("Authority that the compensator has left", "%", 100.0, LOW, curves)?;
    Some(Panel { y: (-4.0, 104.0), bands: active(flight), ..panel })
}

fn effectors(flight: &Flight) -> Group {
    let list = &flight.effectors;
    let panels = list.all().filter_map(|effector| {
        let (_, largest) = travel(flight, effector).unwrap_or((0.0, f64::INFINITY));
        let (scale, y_label) = list.shown_unit(effector, largest);
        let [command, position, effect] =
            ["", "position", "effect"].map(|before| effector_field(before, list, effector));
        let signals = [
            signal("truth", &effect, scale, "what acts, after faults", SECOND),
            signal("truth", &position, scale, "true position", MAIN),
            signal("commands", &command, scale, "command", REFERENCE),
        ];
        let mut panel =
            panel(title(list.name(effector)), y_label, 2.0, LOW, curves(flight, &signals))?;
        if let Some((min, max)) = travel(flight, effector) {
            with_rules(&mut panel, &[(max * scale, "end of travel"), (min * scale, "")]);
        }
        let here = flight.faults.iter().filter(|fault| fault.effector == effector);
        let band = |fault: &FaultSpan| Band {
            span: fault.span,
            colour: Kind::Fault.colour(),
            label: fault.text.clone(),
        };
        panel.bands = here.map(band).collect();
        Some(panel)
    });
    let nozzle = match list.only(EffectorKind::NozzlePitch) {
        Some(_) => {
            "; the nozzle's pitch angle pitches the nose up, its yaw angle yaws it to the right"
        }
        None => "",
    };
    Group {
        title: "Effectors",
        caption: format!(
            "Shaded: the time in which a fault acts. Signs: a surface's trailing edge down is positive, the rudder's \
             left{nozzle}."
        ),
        panels: panels.collect(),
    }
}

fn title(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}

/// Ends of an effector's travel: of the aircraft, or of the controller's model; rad; engine N.
fn travel(flight: &Flight, effector: Effector) -> Option<(f64, f64)> {
    if let Some(plant) = &flight.plant {
        let servo = &plant.setup.airframe.servos[effector];
        return Some((servo.min, servo.max));
    }
    let servo = &flight.control.as_ref()?.settings.model.effectors.servos[effector];
    Some((servo.min, servo.max))
}

/// The modes as a strip.
pub fn modes(flight: &Flight) -> Option<Panel<'static>> {
    const COLOURS: [&str; 2] = ["#5b3fa0", "#1f5fbf"];
    let modes = super::events::mode_spans(flight);
    let band = |(index, (from, to, name)): (usize, &(f64, f64, &str))| Band {
        span: (*from, *to),
        colour: COLOURS[index % COLOURS.len()],
        label: (*name).to_owned(),
    };
    let bands: Vec<Band> = modes.iter().enumerate().map(band).collect();
    let title = "Mode: who gives the references".to_owned();
    (!bands.is_empty()).then(|| Panel {
        title,
        height: 26.0,
        x: flight.span,
        bands,
        ..Panel::default()
    })
}

/// The track over the ground, east and north of the start, km, thinned by time.
pub fn track(flight: &Flight) -> Option<Vec<(f64, Point)>> {
    const POINTS: usize = 3_000;
    let north = flight.signal("sensors", "position_north_m", 1.0e-3)?;
    let east = flight.signal("sensors", "position_east_m", 1.0e-3)?;
    let every = (north.len() / POINTS).max(1);
    let last = north.len().checked_sub(1)?;
    let places = (0..last).step_by(every).chain([last]);
    Some(places.map(|k| (north[k].0, (east[k].1, north[k].1))).collect())
}

/// Ink of the track.
pub const TRACK: Ink = MAIN;
