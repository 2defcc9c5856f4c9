//! Figures 4 and 7: how the aircraft answers, in the three runs of a case.

use super::{COMPENSATED, FaultName, LOST, NO_FAULT, PID_ONLY, fault_mark};
use crate::chart::axis::range;
use crate::chart::curve::{Point, thin, unwrap};
use crate::chart::panel::{Curve, Mark, Panel, Shape, Symbol};
use crate::chart::{Figure, sheet};
use crate::metrics::DEG;
use crate::paper::cases::Flown;
use crate::paper::trace::Trace;
use crate::table::Row;

/// The rates of case 1 are over after this time; the climb goes on, s.
const RATES_END_S: f64 = 20.0;
/// A diverging curve may widen a panel by this share of what the others need.
const DIVERGING_SHARE: f64 = 0.5;

/// Room beyond the end of such a curve, for its cross, as a share of the same.
const END_SHARE: f64 = 0.08;

/// What a panel shows.
struct Signal {
    title: &'static str,
    y_label: &'static str,
    value: fn(&Row) -> f64,
    /// The value is an angle in deg that runs on at half a turn.
    is_heading: bool,
    /// After the loss the value tumbles about and says nothing; only the altitude goes on.
    ends_when_lost: bool,
    /// Smallest height of the panel, in the unit of the values.
    span_min: f64,
}

/// A body rate; what the others differ from.
const P: Signal = Signal {
    title: "Roll rate p",
    y_label: "p, deg/s",
    value: |row| row.p_rad_s / DEG,
    is_heading: false,
    ends_when_lost: true,
    span_min: 2.0,
};
const Q: Signal =
    Signal { title: "Pitch rate q", y_label: "q, deg/s", value: |row| row.q_rad_s / DEG, ..P };
const R: Signal =
    Signal { title: "Yaw rate r", y_label: "r, deg/s", value: |row| row.r_rad_s / DEG, ..P };
const PSI: Signal = Signal {
    title: "Yaw angle",
    y_label: "psi, deg",
    value: |row| row.psi_rad / DEG,
    is_heading: true,
    span_min: 10.0,
    ..P
};
const PHI: Signal = Signal {
    title: "Roll angle",
    y_label: "phi, deg",
    value: |row| row.phi_rad / DEG,
    span_min: 10.0,
    ..P
};
const ALTITUDE: Signal = Signal {
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
pub fn figure_4(flown: &Flown) -> Figure {
    let end_s = flown.case.duration_s();
    let rates_end_s = RATES_END_S.min(end_s);
    let panels = [
        panel(flown, 'a', &P, rates_end_s),
        panel(flown, 'b', &Q, rates_end_s),
        panel(flown, 'c', &R, rates_end_s),
        panel(flown, 'd', &ALTITUDE, end_s),
    ];
    figure("fig4", "Figure 4", flown, panels)
}

/// Case 2: p, q, r, yaw angle, roll angle, altitude.
pub fn figure_7(flown: &Flown) -> Figure {
    let end_s = flown.case.duration_s();
    let panels = [
        panel(flown, 'a', &P, end_s),
        panel(flown, 'b', &Q, end_s),
        panel(flown, 'c', &R, end_s),
        panel(flown, 'd', &PSI, end_s),
        panel(flown, 'e', &PHI, end_s),
        panel(flown, 'f', &ALTITUDE, end_s),
    ];
    figure("fig7", "Figure 7", flown, panels)
}

fn figure<const N: usize>(
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

fn panel(flown: &Flown, letter: char, signal: &Signal, end_s: f64) -> Panel<'static> {
    let curve = |trace: &Trace, to_s: f64| points(trace, signal, end_s, to_s);
    let (no_fault, compensated) = (curve(&flown.no_fault, end_s), curve(&flown.compensated, end_s));
    let lost = flown.pid_only.lost_at().filter(|_| signal.ends_when_lost);
    let pid = curve(&flown.pid_only, lost.unwrap_or(end_s));
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
            Curve::unnamed(pid, PID_ONLY),
            Curve::unnamed(no_fault, NO_FAULT),
            Curve::unnamed(compensated, COMPENSATED),
        ],
        symbols: end.into_iter().collect(),
        ..Panel::default()
    }
}

/// The signal up to `to_s`, thinned for a panel that ends at `end_s`.
fn points(trace: &Trace, signal: &Signal, end_s: f64, to_s: f64) -> Vec<Point> {
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
