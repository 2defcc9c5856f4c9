//! The three comparisons: literal observer, always on, the same effectors without observer.

use maud::{Markup, html};

use super::{failed_ids, number};
use crate::metrics::DEG;
use crate::paper::claim::ClaimResult;
use crate::paper::comparisons::{Comparisons, Ganged, Healthy, Literal, Summary, Turbulence};
use crate::paper::estimates::Axis;

/// (a) The observer as equations 21 to 23 literally say.
pub fn literal(cases: &[Literal; 2]) -> Markup {
    html! {
        h3 { "(a) The observer as equations 21 to 23 literally say" }
        p {
            "Read literally, the observer is not told the compensation. What the compensation does then looks like "
            "a second disturbance against the first, and z2 settles at what is left of F. Means of the last 10 s:"
        }
        table {
            thead { tr {
                th { "Case" } th { "Axis" } th.number { "z2, rad/s²" } th.number { "F, rad/s²" }
                th.number { "z2 / F" }
            } }
            tbody { @for (number_of_case, case) in (1..).zip(cases) {
                @for (axis, (z2, fault)) in Axis::ALL.iter().zip(case.z2.iter().zip(&case.fault)) {
                    @if fault.abs() > NOTHING { tr {
                        td { (number_of_case) } td { (axis.name()) }
                        td.number { (number(*z2)) } td.number { (number(*fault)) }
                        td.number { (number(z2 / fault)) }
                    } }
                }
            } }
        }
        table {
            thead { tr {
                th { "Case" } th { "Flight" } th { "Lost" } th.number { "Roll, mean of the last 10 s, deg" }
                th.number { "Altitude at the end, m" } th.number { "below the no-fault run, m" }
            } }
            tbody { @for (number_of_case, case) in (1..).zip(cases) {
                @for (name, flight) in [
                    ("no fault", &case.no_fault), ("informed observer", &case.informed),
                    ("literal observer", &case.flight),
                ] {
                    tr {
                        td { (number_of_case) } td { (name) } (ending(flight))
                        td.number { (number(case.no_fault.end_altitude_m - flight.end_altitude_m)) }
                    }
                }
            } }
        }
    }
}

/// An axis on which the fault does nothing has no ratio worth showing, rad/s².
const NOTHING: f64 = 0.01;

/// Three cells: whether lost, mean roll, altitude at the end. A tumbling aircraft has no mean roll.
fn ending(flight: &Summary) -> Markup {
    let (lost, roll) = match flight.lost_s {
        Some(t) => (format!("at {} s", number(t)), "-".to_owned()),
        None => ("no".to_owned(), number(flight.roll_rad / DEG)),
    };
    html! {
        td { (lost) } td.number { (roll) } td.number { (number(flight.end_altitude_m)) }
    }
}

/// (b) Always on against switched.
pub fn always_on(all: &Comparisons) -> Markup {
    html! {
        h3 { "(b) Always on against switched" }
        p {
            "The paper argues for a compensator that wakes with a fault, and does not test one that is always on. "
            "Healthy level flight with gyro noise, means over " (all.turbulence[0].flights) " seeds:"
        }
        table {
            thead { tr {
                th { "Turbulence" } th { "Compensator" } th.number { "Roll, rms, deg" }
                th.number { "Roll rate, rms, deg/s" } th.number { "Aileron travel, deg/s" }
                th.number { "Nozzle travel, deg/s" }
            } }
            tbody { @for t in &all.turbulence {
                (healthy(t, "switched", &t.switched))
                (healthy(t, "always on", &t.always_on))
            } }
        }
        @for t in &all.turbulence { (price(t)) }
        @for (number_of_case, results) in (1..).zip(&all.always_on) {
            p { "Case " (number_of_case) " with the compensator always on: " (count(results)) }
        }
    }
}

/// What always on costs in healthy flight, in words made from the numbers.
fn price(t: &Turbulence) -> Markup {
    let change = |of: fn(&Healthy) -> f64| {
        let percent = 100.0 * (of(&t.always_on) / of(&t.switched) - 1.0);
        format!("{percent:+.1} %")
    };
    html! { p {
        "At " (number(t.turbulence_m_s)) " m/s always on changes the rms of the roll angle by "
        (change(|h| h.roll_rms_rad)) " and the travel of the aileron by " (change(|h| h.aileron_rad_s))
        ", and keeps the nozzle moving by " (number(t.always_on.nozzle_rad_s / DEG))
        " deg/s where the switched compensator moves it by " (number(t.switched.nozzle_rad_s / DEG)) " deg/s."
    } }
}

fn healthy(t: &Turbulence, name: &str, h: &Healthy) -> Markup {
    html! { tr {
        td { (number(t.turbulence_m_s)) " m/s rms" } td { (name) }
        td.number { (number(h.roll_rms_rad / DEG)) }
        td.number { (number(h.roll_rate_rms_rad_s / DEG)) }
        td.number { (number(h.aileron_rad_s / DEG)) }
        td.number { (number(h.nozzle_rad_s / DEG)) }
    } }
}

fn count(results: &[ClaimResult]) -> String {
    let held = results.iter().filter(|r| r.pass).count();
    let failed = failed_ids(results);
    let broken = if failed.is_empty() {
        "none is broken".to_owned()
    } else {
        format!("broken: {}", failed.join(", "))
    };
    format!("{held} of {} limits hold; {broken}.", results.len())
}

/// (c) The same effectors without observer.
pub fn ganged(cases: &[Ganged; 2]) -> Markup {
    html! {
        h3 { "(c) The same effectors without observer" }
        p {
            "The paper gives the nozzle to the compensator alone, so a part of the benefit is the nozzle\u{2019}s. Here "
            "the PID has the nozzle too, ganged by a static law: nozzle pitch = -(elevator - trim), nozzle yaw = "
            "4 sideslip - 0.4 r. No observer, no compensator. The limits are those of claims a and c (how well the "
            "aircraft flies without and with the fault), each controller against its own flight without fault."
        }
        table {
            thead { tr {
                th { "Case" } th { "Controller" } th { "Lost" } th.number { "Roll, mean of the last 10 s, deg" }
                th.number { "Altitude at the end, m" } th { "Limits of claims a and c" }
            } }
            tbody { @for (number_of_case, case) in (1..).zip(cases) {
                @for (name, results, flight) in [
                    ("PID only", &case.pid_only, &case.flights[0]),
                    ("PID with ganged nozzle", &case.ganged, &case.flights[1]),
                    ("two-step", &case.two_step, &case.flights[2]),
                ] {
                    tr {
                        td { (number_of_case) } td { (name) } (ending(flight))
                        td { (count(results)) }
                    }
                }
            } }
        }
        @for (number_of_case, case) in (1..).zip(cases) {
            (verdict(number_of_case, case))
        }
        (broken_limits(cases))
    }
}

/// How much of the benefit is the nozzle's, in words made from the numbers.
fn verdict(case: u32, g: &Ganged) -> Markup {
    let held = |results: &[ClaimResult]| results.iter().filter(|r| r.pass).count();
    let (pid, ganged, two_step) = (held(&g.pid_only), held(&g.ganged), held(&g.two_step));
    let [_, flight, _] = &g.flights;
    html! { p {
        "Case " (case) ": of " (g.two_step.len()) " limits the PID alone meets " (pid)
        ", with the ganged nozzle " (ganged) ", the two-step controller " (two_step) ". "
        @match flight.lost_s {
            Some(t) => {
                "With the ganged nozzle the aircraft is lost at " (number(t)) " s: here survival is the "
                "compensator\u{2019}s."
            }
            None => {
                "The ganged nozzle, without any estimate of the fault, keeps the aircraft in the air: survival is "
                "the nozzle\u{2019}s. "
                @if ganged < two_step { "The estimate adds " (two_step - ganged) " limits." }
                @else { "By these limits the estimate adds nothing." }
            }
        }
    } }
}

fn broken_limits(cases: &[Ganged; 2]) -> Markup {
    let broken = || cases.iter().flat_map(|case| &case.ganged).filter(|r| !r.pass);
    html! {
        @if broken().next().is_some() {
            p { "Limits that the ganged nozzle breaks:" }
            table {
                thead { tr {
                    th { "Claim" } th { "Measured" } th.number { "Value" } th.number { "Limit" } th { "Unit" }
                } }
                tbody { @for r in broken() { tr {
                    td { (r.id) } td { (r.measure) } td.number { (number(r.value)) }
                    td.number { (r.limit) } td { (r.unit) }
                } } }
            }
        }
    }
}
