//! Figures 6 and 9: what the effectors do in the compensated run.

use icd::{Effector, tvc_jet};

use super::{FAULT, FaultName, fault_mark};
use crate::chart::axis::range;
use crate::chart::curve::thin;
use crate::chart::panel::{Curve, Panel, Rule};
use crate::chart::{Figure, Ink, Pattern, sheet};
use crate::metrics::DEG;
use crate::paper::cases::Flown;
use crate::table::Row;

/// Left surface, nozzle pitch, and what there is one of.
const FIRST: Ink = Ink::new("#0050aa", Pattern::Solid);
/// Right surface, nozzle yaw.
const SECOND: Ink = Ink::new("#c85a00", Pattern::Dashed).wide(2.0);
/// Smallest height of a panel, deg.
const SPAN_MIN_DEG: f64 = 4.0;
/// A limit is drawn where a curve comes this close to it, as a share of the limit.
const NEAR: f64 = 0.5;

/// The four panels of the paper: elevators, ailerons, rudder, nozzle.
pub fn figure(name: &'static str, number: &str, flown: &Flown) -> Figure {
    let servos = &flown.case.setup.model.effectors.servos;
    let deg = |effector: Effector| servos[effector].max / DEG;
    let elevators: [fn(&Row) -> f64; 2] = [|r| r.left_elevator_rad, |r| r.right_elevator_rad];
    let ailerons: [fn(&Row) -> f64; 2] = [|r| r.left_aileron_rad, |r| r.right_aileron_rad];
    let rudder: [fn(&Row) -> f64; 1] = [|r| r.rudder_rad];
    let nozzle: [fn(&Row) -> f64; 2] = [|r| r.nozzle_pitch_rad, |r| r.nozzle_yaw_rad];
    let marks = [fault_mark(flown)];
    let panels = [
        panel(flown, "(a) Elevators, left and right", deg(tvc_jet::LEFT_ELEVATOR), &elevators),
        panel(flown, "(b) Ailerons, left and right", deg(tvc_jet::LEFT_AILERON), &ailerons),
        panel(flown, "(c) Rudder", deg(tvc_jet::RUDDER), &rudder),
        panel(flown, "(d) Nozzle, pitch and yaw", deg(tvc_jet::NOZZLE_PITCH), &nozzle),
    ]
    .map(|panel| Panel { marks: &marks, ..panel });
    let title = format!("{number}. Case {}: deflections, compensated", flown.case.number);
    let caption = format!(
        "{title} ({}). Trailing edge down and left positive; the nozzle positive towards nose up and nose \
         right. Dashed horizontal lines: limits of travel.",
        FaultName(flown)
    );
    let legend = [
        ("left; rudder; nozzle pitch", FIRST),
        ("right; nozzle yaw", SECOND),
        (marks[0].label.as_str(), FAULT),
    ];
    Figure { name, caption, svg: sheet(&title, &legend, 2, &panels) }
}

fn panel(
    flown: &Flown,
    title: &str,
    limit_deg: f64,
    signals: &[fn(&Row) -> f64],
) -> Panel<'static> {
    let end_s = flown.case.duration_s();
    let samples = flown.compensated.samples();
    let curves: Vec<Curve> = signals
        .iter()
        .zip([FIRST, SECOND])
        .map(|(signal, ink)| {
            let points = samples.iter().map(|s| (s.row.t_s, signal(&s.row) / DEG));
            Curve::unnamed(thin(points, 0.0, end_s), ink)
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
        y_label: "deflection, deg",
        x: (0.0, end_s),
        y,
        curves,
        rules,
        ..Panel::default()
    }
}
