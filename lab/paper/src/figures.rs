//! Figures 4 to 9 of the paper and the survival curve.

use std::fmt;

use icd::units::DEG;
use icd::{Effector, tvc_jet};

use super::cases::Flown;
use super::claims::Axis;
use super::model_error::{CLAIM_DRAWS, CLAIM_WIDTH, SurvivalPoint};
use lab_judges::row::Row;
use lab_judges::trace::Trace;
use lab_report::chart::axis::range;
use lab_report::chart::curve::{Point, thin, unwrap};
use lab_report::chart::panel::{Curve, Mark, Panel, Rule, Shape, Symbol};
use lab_report::chart::{Figure, Ink, Pattern, sheet};

const NO_FAULT: Ink = Ink::new("#0050aa", Pattern::Solid);
/// Flight with the PID only.
const PID_ONLY: Ink = Ink::new("#c81e1e", Pattern::Dashed);
/// Flight with the compensator.
const COMPENSATED: Ink = Ink::new("#007d37", Pattern::Dotted).wide(2.5);
/// Vertical line at the fault.
const FAULT: Ink = Ink::new("#464646", Pattern::Fine);
/// Vertical line where the flight with the PID only is lost.
const LOST: Ink = Ink::new(PID_ONLY.colour, Pattern::Fine);

/// Figures 4 to 9.
pub fn of_the_paper(case1: &Flown, case2: &Flown) -> Vec<Figure> {
    vec![
        figure_4(case1),
        estimate("fig5", "Figure 5", case1),
        deflections("fig6", "Figure 6", case1),
        figure_7(case2),
        estimate("fig8", "Figure 8", case2),
        deflections("fig9", "Figure 9", case2),
    ]
}

/// The vertical line at the fault.
fn fault_mark(flown: &Flown) -> Mark {
    let label = format!("fault, at {} s", flown.case.fault_s);
    Mark { x: flown.case.fault_s, number: None, ink: FAULT, label }
}

/// What breaks in a case, for titles.
struct FaultName<'a>(&'a Flown);

impl fmt::Display for FaultName<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let case = &self.0.case;
        match case.setup.plant.faults.first() {
            Some(fault) => {
                let angle = case.jam_rad.to_degrees();
                let name = fault.target.name(&case.setup.plant.airframe.effectors);
                write!(f, "{name} jams at {angle:+.0} deg at {} s", case.fault_s)
            }
            None => f.write_str("no fault"),
        }
    }
}

/// The rates of case 1 are over after this time; the climb goes on, s.
const RATES_END_S: f64 = 20.0;
/// A diverging curve may widen a panel by this share of what the others need.
const DIVERGING_SHARE: f64 = 0.5;

/// Room beyond the end of such a curve, for its cross, as a share of the same.
const END_SHARE: f64 = 0.08;

/// What a panel shows.
struct FigureSignal {
    title: &'static str,
    y_label: &'static str,
    value: fn(&Row) -> f64,
    /// The value is an angle in deg that runs on at half a turn.
    is_heading: bool,
    /// After the loss the value has no meaning; only the altitude goes on.
    ends_when_lost: bool,
    /// Smallest height of the panel, in the unit of the values.
    span_min: f64,
}

/// A body rate; what the others differ from.
const P: FigureSignal = FigureSignal {
    title: "Roll rate p",
    y_label: "p, deg/s",
    value: |row| row.p_rad_s / DEG,
    is_heading: false,
    ends_when_lost: true,
    span_min: 2.0,
};
const Q: FigureSignal = FigureSignal {
    title: "Pitch rate q",
    y_label: "q, deg/s",
    value: |row| row.q_rad_s / DEG,
    ..P
};
const R: FigureSignal =
    FigureSignal { title: "Yaw rate r", y_label: "r, deg/s", value: |row| row.r_rad_s / DEG, ..P };
const PSI: FigureSignal = FigureSignal {
    title: "Yaw angle",
    y_label: "psi, deg",
    value: |row| row.psi_rad / DEG,
    is_heading: true,
    span_min: 10.0,
    ..P
};
const PHI: FigureSignal = FigureSignal {
    title: "Roll angle",
    y_label: "phi, deg",
    value: |row| row.phi_rad / DEG,
    span_min: 10.0,
    ..P
};
const ALTITUDE: FigureSignal = FigureSignal {
    title: "Altitude",
    y_label: "altitude, m",
    value: |row| row.altitude_m,
    ends_when_lost: false,
    span_min: 40.0,
    ..P
};

/// The fault, and the loss of the flight with the PID only.
fn marks(flown: &Flown) -> Vec<Mark> {
    let lost = flown.pid_only.lost_at().map(|t| {
        let label = format!("PID only: lost at {t:.1} s");
        Mark { x: t, number: None, ink: LOST, label }
    });
    [fault_mark(flown)].into_iter().chain(lost).collect()
}

/// Case 1: p, q, r, altitude.
fn figure_4(flown: &Flown) -> Figure {
    let end_s = flown.case.duration_s();
    let rates_end_s = RATES_END_S.min(end_s);
    let panels = [
        response_panel(flown, 'a', &P, rates_end_s),
        response_panel(flown, 'b', &Q, rates_end_s),
        response_panel(flown, 'c', &R, rates_end_s),
        response_panel(flown, 'd', &ALTITUDE, end_s),
    ];
    response("fig4", "Figure 4", flown, panels)
}

/// Case 2: p, q, r, yaw angle, roll angle, altitude.
fn figure_7(flown: &Flown) -> Figure {
    let end_s = flown.case.duration_s();
    let panels = [
        response_panel(flown, 'a', &P, end_s),
        response_panel(flown, 'b', &Q, end_s),
        response_panel(flown, 'c', &R, end_s),
        response_panel(flown, 'd', &PSI, end_s),
        response_panel(flown, 'e', &PHI, end_s),
        response_panel(flown, 'f', &ALTITUDE, end_s),
    ];
    response("fig7", "Figure 7", flown, panels)
}

fn response<const N: usize>(
    name: &'static str,
    number: &str,
    flown: &Flown,
    panels: [Panel<'_>; N],
) -> Figure {
    let title = format!("{number}. Case {}: {}", flown.case.number, FaultName(flown));
    let lost = flown.pid_only.lost_at().map_or_else(String::new, |t| {
        format!(
            " The run with the PID only is lost at {t:.1} s; its rates and angles are drawn up to there (cross), \
             its altitude until it leaves the frame."
        )
    });
    let caption = format!("{title}. Response of the aircraft in the three runs.{lost}");
    let marks = marks(flown);
    let panels = panels.map(|panel| Panel { marks: &marks, ..panel });
    let runs = [
        ("no fault", NO_FAULT),
        ("fault, PID only", PID_ONLY),
        ("fault, PID and compensator", COMPENSATED),
    ];
    let marked = marks.iter().map(|mark| (mark.label.as_str(), mark.ink));
    let legend: Vec<_> = runs.into_iter().chain(marked).collect();
    Figure { name, caption, svg: sheet(&title, &legend, 2, &panels) }
}

fn response_panel(
    flown: &Flown,
    letter: char,
    signal: &FigureSignal,
    end_s: f64,
) -> Panel<'static> {
    let curve = |trace: &Trace, to_s: f64| points(trace, signal, end_s, to_s);
    let (no_fault, compensated) = (curve(&flown.no_fault, end_s), curve(&flown.compensated, end_s));
    let lost = flown.pid_only.lost_at().filter(|_| signal.ends_when_lost);
    let pid = curve(&flown.pid_only, lost.unwrap_or(end_s));
    // The scale is that of the flights that stay; the diverging one would flatten them.
    let readable = no_fault.iter().chain(&compensated).map(|point| point.1);
    let y = widened(range(readable, signal.span_min), &pid);
    let end = lost.and(pid.last()).map(|at| Symbol {
        at: *at,
        shape: Shape::Cross,
        colour: PID_ONLY.colour,
        label: String::new(),
    });
    Panel {
        title: format!("({letter}) {}", signal.title),
        y_label: signal.y_label,
        x: (0.0, end_s),
        y,
        curves: vec![
            // Below the others, which stay visible where curves meet.
            Curve::unnamed(pid, PID_ONLY),
            Curve::unnamed(no_fault, NO_FAULT),
            Curve::unnamed(compensated, COMPENSATED),
        ],
        symbols: end.into_iter().collect(),
        ..Panel::default()
    }
}

/// The signal up to `to_s`, thinned for a panel that ends at `end_s`.
fn points(trace: &Trace, signal: &FigureSignal, end_s: f64, to_s: f64) -> Vec<Point> {
    let raw = trace.window(0.0, to_s).iter().map(|s| (s.row.t_s, (signal.value)(&s.row)));
    if signal.is_heading { thin(unwrap(raw, 360.0), 0.0, end_s) } else { thin(raw, 0.0, end_s) }
}

/// A range with some room for a curve that leaves it.
fn widened((low, high): (f64, f64), diverging: &[Point]) -> (f64, f64) {
    let (room, margin) = (DIVERGING_SHARE * (high - low), END_SHARE * (high - low));
    let values = || diverging.iter().map(|point| point.1);
    (
        values().fold(low, |low, value| low.min(value - margin)).max(low - room),
        values().fold(high, |high, value| high.max(value + margin)).min(high + room),
    )
}

/// The close-up begins this long before the fault, s.
const BEFORE_S: f64 = 0.2;
/// The close-up ends this long after the fault, s.
const AFTER_S: f64 = 0.8;
/// Smallest height of a panel, rad/s².
const ESTIMATE_SPAN_MIN: f64 = 0.02;

/// F: broad and pale, so that the estimate can be seen on top of it.
const F: Ink = Ink::new("#faaa5a", Pattern::Solid).wide(5.0);
/// z2.
const Z2: Ink = Ink::new("#003c8c", Pattern::Solid);

/// The estimate of each axis of the compensated run: the whole run, and close up around the fault.
fn estimate(name: &'static str, number: &str, flown: &Flown) -> Figure {
    let (fault_s, end_s) = (flown.case.fault_s, flown.case.duration_s());
    let marks = [fault_mark(flown)];
    let panels: Vec<Panel<'_>> = Axis::ALL
        .into_iter()
        .zip(['a', 'b', 'c'])
        .flat_map(|(axis, letter)| {
            [
                estimate_panel(flown, axis, letter, (0.0, end_s), ""),
                estimate_panel(
                    flown,
                    axis,
                    letter,
                    (fault_s - BEFORE_S, fault_s + AFTER_S),
                    ", close up",
                ),
            ]
        })
        .map(|panel| Panel { marks: &marks, ..panel })
        .collect();
    let title = format!("{number}. Case {}: estimate of the fault, compensated", flown.case.number);
    let caption = format!(
        "{title} ({}). Angular acceleration that the model of the healthy aircraft does not explain. Left: \
         the whole run; right: the same around the fault.",
        FaultName(flown)
    );
    let legend = [
        ("z2, the observer's estimate", Z2),
        ("F, the truth of the simulation", F),
        (marks[0].label.as_str(), FAULT),
    ];
    Figure { name, caption, svg: sheet(&title, &legend, 2, &panels) }
}

fn estimate_panel(
    flown: &Flown,
    axis: Axis,
    letter: char,
    x: (f64, f64),
    what: &str,
) -> Panel<'static> {
    let run: &Trace = &flown.compensated;
    let curve = |value: fn(Axis, &Row) -> f64| {
        thin(run.samples().iter().map(|s| (s.row.t_s, value(axis, &s.row))), x.0, x.1)
    };
    let truth = curve(|axis, row| axis.fault(row));
    let z2 = curve(|axis, row| axis.estimate(row));
    let y = range(truth.iter().chain(&z2).map(|point| point.1), ESTIMATE_SPAN_MIN);
    Panel {
        title: format!("({letter}) {}{what}", capital(axis.name())),
        y_label: "rad/s²",
        x,
        y,
        curves: vec![Curve::unnamed(truth, F), Curve::unnamed(z2, Z2)],
        ..Panel::default()
    }
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Left surface, nozzle pitch, and what there is one of.
const FIRST: Ink = Ink::new("#0050aa", Pattern::Solid);
/// Right surface, nozzle yaw.
const SECOND: Ink = Ink::new("#c85a00", Pattern::Dashed).wide(2.0);
/// Smallest height of a panel, deg.
const SPAN_MIN_DEG: f64 = 4.0;
/// A limit is drawn where a curve comes this close to it, as a share of the limit.
const NEAR: f64 = 0.5;

/// The four panels of the paper: elevators, ailerons, rudder, nozzle.
fn deflections(name: &'static str, number: &str, flown: &Flown) -> Figure {
    let servos = &flown.case.setup.model.effectors.servos;
    let deg = |effector: Effector| servos[effector].max / DEG;
    let elevators: [fn(&Row) -> f64; 2] = [|r| r.left_elevator_rad, |r| r.right_elevator_rad];
    let ailerons: [fn(&Row) -> f64; 2] = [|r| r.left_aileron_rad, |r| r.right_aileron_rad];
    let rudder: [fn(&Row) -> f64; 1] = [|r| r.rudder_rad];
    let nozzle: [fn(&Row) -> f64; 2] = [|r| r.nozzle_pitch_rad, |r| r.nozzle_yaw_rad];
    let marks = [fault_mark(flown)];
    let panels = [
        deflection_panel(
            flown,
            "(a) Elevators, left and right",
            deg(tvc_jet::LEFT_ELEVATOR),
            &elevators,
        ),
        deflection_panel(
            flown,
            "(b) Ailerons, left and right",
            deg(tvc_jet::LEFT_AILERON),
            &ailerons,
        ),
        deflection_panel(flown, "(c) Rudder", deg(tvc_jet::RUDDER), &rudder),
        deflection_panel(flown, "(d) Nozzle, pitch and yaw", deg(tvc_jet::NOZZLE_PITCH), &nozzle),
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

fn deflection_panel(
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

/// With the compensator; points need an unbroken line between them.
const WITH: Ink = Ink::new(COMPENSATED.colour, Pattern::Solid);
/// Half width of the bars of the intervals, percent of dispersion.
const BAR: f64 = 0.4;
/// The two curves stand this far apart, so that their bars do not cover each other, percent of dispersion.
const APART: f64 = 0.25;

/// Share of aircraft that survive, over the half width of the dispersion of all derivatives together.
pub fn survival(points: &[SurvivalPoint]) -> Figure {
    let draws = points.first().map_or(0, |point| point.draws);
    let title = format!("Survival under model error, {draws} aircraft a point");
    let legend = [("PID and compensator", WITH), ("PID only", PID_ONLY)];
    let panels = [1, 2].map(|case| survival_panel(case, points));
    let svg = sheet(&title, &legend, 2, &panels);
    let caption = format!(
        "{title}. Every aerodynamic derivative multiplied by its own factor, uniform in 1 ± the number on the \
         axis; the controller keeps its nominal model. Bars: Wilson's 95 % interval. Claim 5 looks at the first \
         {CLAIM_DRAWS} aircraft at ± {:.0} %.",
        100.0 * CLAIM_WIDTH
    );
    Figure { name: "survival", caption, svg }
}

/// Share that survived, with its interval.
type Share = fn(&SurvivalPoint) -> (f64, (f64, f64));

fn survival_panel(case: u32, points: &[SurvivalPoint]) -> Panel<'static> {
    let points: Vec<&SurvivalPoint> = points.iter().filter(|point| point.case == case).collect();
    let letter = if case == 1 { 'a' } else { 'b' };
    let mut panel = Panel {
        title: format!("({letter}) Case {case}"),
        x_label: "dispersion of every derivative, ± %",
        y_label: "aircraft that survive, %",
        x: (0.0, 32.0),
        y: (-4.0, 104.0),
        ..Panel::default()
    };
    let runs: [(Ink, f64, Share); 2] = [
        (PID_ONLY, APART, SurvivalPoint::pid_only_share),
        (WITH, -APART, SurvivalPoint::compensated_share),
    ];
    for (ink, aside, share) in runs {
        let place = |point: &SurvivalPoint| 100.0 * point.half_width + aside;
        let curve: Vec<_> = points.iter().map(|p| (place(p), 100.0 * share(p).0)).collect();
        let symbol = |at: &(f64, f64)| Symbol {
            at: *at,
            shape: Shape::Dot,
            colour: ink.colour,
            label: String::new(),
        };
        panel.symbols.extend(curve.iter().map(symbol));
        panel.curves.push(Curve::unnamed(curve, ink));
        let line = Ink::new(ink.colour, Pattern::Solid).wide(1.0);
        for point in &points {
            let (at, (low, high)) = (place(point), share(point).1);
            let (low, high) = (100.0 * low, 100.0 * high);
            let bar = [(at, low), (at, high)];
            let ends = [low, high].map(|y| [(at - BAR, y), (at + BAR, y)]);
            let lines = ends.into_iter().chain([bar]);
            panel.curves.extend(lines.map(|line_of| Curve::unnamed(line_of.to_vec(), line)));
        }
    }
    panel
}
