//! Figures 6 and 9: what the effectors do in the compensated run.

use icd::{Effector, tvc_jet};
use plotters::prelude::RGBColor;

use super::curve::thin;
use super::panel::{Curve, Ink, Panel, Pattern, Rule};
use super::{Entry, FaultName, Figure, FigureError, fault_entry, fault_event, range, sheet};
use crate::metrics::DEG;
use crate::paper::cases::Flown;
use crate::table::Row;

/// Left surface, nozzle pitch, and what there is one of.
const FIRST: Ink = Ink { colour: RGBColor(0, 80, 170), pattern: Pattern::Solid, width: 3 };
/// Right surface, nozzle yaw.
const SECOND: Ink = Ink { colour: RGBColor(200, 90, 0), pattern: Pattern::Dashed, width: 4 };
/// Smallest height of a panel, deg.
const SPAN_MIN_DEG: f64 = 4.0;
/// A limit is drawn where a curve comes this close to it, as a share of the limit.
const NEAR: f64 = 0.5;

/// The four panels of the paper: elevators, ailerons, rudder, nozzle.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn figure(name: &'static str, number: &str, flown: &Flown) -> Result<Figure, FigureError> {
    let servos = &flown.case.setup.belief.effectors.servos;
    let deg = |effector: Effector| servos[effector].max / DEG;
    let elevators: [fn(&Row) -> f64; 2] = [|r| r.left_elevator_rad, |r| r.right_elevator_rad];
    let ailerons: [fn(&Row) -> f64; 2] = [|r| r.left_aileron_rad, |r| r.right_aileron_rad];
    let rudder: [fn(&Row) -> f64; 1] = [|r| r.rudder_rad];
    let nozzle: [fn(&Row) -> f64; 2] = [|r| r.nozzle_pitch_rad, |r| r.nozzle_yaw_rad];
    let panels = [
        panel(flown, "(a) Elevators, left and right", deg(tvc_jet::LEFT_ELEVATOR), &elevators),
        panel(flown, "(b) Ailerons, left and right", deg(tvc_jet::LEFT_AILERON), &ailerons),
        panel(flown, "(c) Rudder", deg(tvc_jet::RUDDER), &rudder),
        panel(flown, "(d) Nozzle, pitch and yaw", deg(tvc_jet::NOZZLE_PITCH), &nozzle),
    ];
    let title = format!("{number}. Case {}: deflections, compensated", flown.case.number);
    let caption = format!(
        "{title} ({}). Trailing edge down and left positive; the nozzle positive towards nose up and nose \
         right. Dashed grey: limits of travel.",
        FaultName(flown)
    );
    let legend = [
        Entry::new(FIRST, "left; rudder; nozzle pitch"),
        Entry::new(SECOND, "right; nozzle yaw"),
        fault_entry(flown),
    ];
    Ok(Figure { name, caption, svg: sheet(&title, &legend, &panels)? })
}

fn panel(flown: &Flown, title: &str, limit_deg: f64, signals: &[fn(&Row) -> f64]) -> Panel {
    let end_s = flown.case.duration_s();
    let samples = flown.compensated.samples();
    let curves: Vec<Curve> = signals
        .iter()
        .zip([FIRST, SECOND])
        .map(|(signal, ink)| {
            let points = samples.iter().map(|s| (s.row.t_s, signal(&s.row) / DEG));
            Curve { points: thin(points, 0.0, end_s), ink }
        })
        .collect();
    let values = || curves.iter().flat_map(|c| &c.points).map(|point| point.1);
    let near = [limit_deg, -limit_deg]
        .into_iter()
        .filter(|limit| values().any(|v| v * limit.signum() >= NEAR * limit_deg));
    let rules: Vec<Rule> =
        near.map(|value| Rule { value, label: format!("limit {value:+.0} deg") }).collect();
    let y = range(values().chain(rules.iter().map(|rule| rule.value)), SPAN_MIN_DEG);
    Panel {
        title: format!("{title} (travel ±{limit_deg:.0} deg)"),
        y_label: "deflection, deg".to_owned(),
        x: (0.0, end_s),
        y,
        curves,
        rules,
        events: vec![fault_event(flown)],
        ends: Vec::new(),
    }
}
