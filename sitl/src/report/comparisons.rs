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
            "Read literally, the observer is not told the compensation. It then takes its own compensation for a "
            "part of the disturbance that is no longer there, and z2 settles short of F. Means of the last 10 s:"
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
                        td { (number_of_case) } td { (name) } td { (lost(flight)) }
                        td.number { (number(flight.roll_rad / DEG)) }
                        td.number { (number(flight.end_altitude_m)) }
                        td.number { (number(case.no_fault.end_altitude_m - flight.end_altitude_m)) }
                    }
                }
            } }
        }
    }
}

/// An axis on which the fault does nothing has no ratio worth showing, rad/s².
const NOTHING: f64 = 0.01;

fn lost(flight: &Summary) -> String {
    flight.lost_s.map_or_else(|| "no".to_owned(), |t| format!("at {} s", number(t)))
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
        @for (number_of_case, results) in (1..).zip(&all.always_on) {
            p { "Case " (number_of_case) " always on: " (count(results)) }
        }
    }
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
                        td { (number_of_case) } td { (name) } td { (lost(flight)) }
                        td.number { (number(flight.roll_rad / DEG)) }
                        td.number { (number(flight.end_altitude_m)) }
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
            None => { "The nozzle alone, without any estimate of the fault, keeps the aircraft in the air: survival is the \
                       nozzle\u{2019}s, what the two-step controller adds is how well it flies." }
            Some(t) => { "With the ganged nozzle the aircraft is lost at " (number(t)) " s: here survival is the \
                          compensator\u{2019}s." }
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
