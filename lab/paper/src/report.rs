//! Results for people: one page that opens without a network, and a table for the terminal.

use std::fmt::Write as _;
use std::path::PathBuf;

use icd::units::DEG;
use maud::{Markup, PreEscaped, html};
use plant_sim::FlightLimits;

use crate::claim::ClaimResult;
use crate::claims::{Axis, JUMP_S, REFERENCE_DEG, REFERENCE_M};
use crate::comparisons::{
    Comparisons, Ganged, Healthy, Literal, Sensitivity, Summary, TurbulenceEffect,
};
use crate::{Evaluation, Link, Options};
use lab_report::chart::Figure;
use lab_report::page;

/// What is a significant digit in a table of measured values.
const DIGITS: i32 = 4;

pub fn page(
    options: &Options,
    evaluation: &Evaluation,
    comparisons: &Comparisons,
    sensitivity: &[Sensitivity],
    figures: &[Figure],
) -> String {
    let body = html! {
        h1 { "Two-step fault-tolerant control: the paper, flown" }
        (summary(evaluation))
        (introduction(&evaluation.flown[0].case.setup.plant.airframe.limits))
        h2 { "What was flown" }
        (flown(options, evaluation))
        h2 { "Figures" }
        (drawings(figures))
        h2 { "Claims" }
        (claims(&evaluation.results))
        h2 { "What the compensator itself contributes" }
        (literal(&comparisons.literal))
        (always_on(comparisons))
        (ganged(&comparisons.ganged))
        h2 { "What a reader should doubt" }
        (doubts(sensitivity))
    };
    page::page("Two-step fault-tolerant control: the paper, flown", "", &body)
}

fn summary(evaluation: &Evaluation) -> Markup {
    let results = &evaluation.results;
    let held = results.iter().filter(|r| r.pass).count();
    let all = held == results.len();
    html! {
        p.verdict.good[all].bad[!all] {
            (held) " of " (results.len()) " limits hold"
            @if all { ". Every claim that was checked holds." }
            @else { ". Claims with a limit that does not hold: " (failed_ids(results).join(", ")) "." }
        }
    }
}

/// Numbers of the claims of which a limit does not hold.
fn failed_ids(results: &[ClaimResult]) -> Vec<&'static str> {
    let mut ids: Vec<_> = results.iter().filter(|r| !r.pass).map(|r| r.id).collect();
    ids.dedup();
    ids
}

/// Other files and settings than the shipped ones.
fn changed(options: &Options) -> Vec<(&'static str, String)> {
    let aircraft = &options.aircraft;
    let files = [("Airframe", &aircraft.airframe), ("Model", &aircraft.model)];
    let named =
        |(what, path): (_, &Option<PathBuf>)| Some((what, path.as_ref()?.display().to_string()));
    let settings = aircraft.settings.iter().map(|setting| ("Set", setting.to_string()));
    files.into_iter().filter_map(named).chain(settings).collect()
}

fn flown(options: &Options, evaluation: &Evaluation) -> Markup {
    let [first, second] = &evaluation.flown;
    let plant = &first.case.setup.plant;
    let noise = options.gyro_noise_deg_s;
    html! {
        p {
            "Level flight at " (number(plant.start.airspeed_m_s)) " m/s and " (number(plant.start.altitude_m))
            " m. Case 1 climbs to " (number(REFERENCE_M)) " m; its left elevator jams at " (number(first.case.jam_rad.to_degrees()))
            " deg at " (number(first.case.fault_s)) " s. Case 2 rolls to " (number(REFERENCE_DEG)) " deg and holds the altitude; its rudder jams at "
            (number(second.case.jam_rad.to_degrees())) " deg at " (number(second.case.fault_s)) " s. Each is flown three times: "
            "without fault (compensator armed), with the fault and the PID only, with the fault and the compensator armed."
        }
        table {
            tr { th { "Earth" } td { (earth_name(options)) } }
            tr { th { "Control period" } td { (number(1.0e3 * options.period.as_seconds())) " ms" } }
            tr { th { "Integration step" } td { (number(f64::from(options.step_us()) / 1.0e3)) " ms, RK4" } }
            tr { th { "Gyro noise" } td { (number(noise)) " deg/s rms of each control sample" } }
            tr { th { "Turbulence" } td { (number(options.turbulence_m_s)) " m/s rms (Dryden)" } }
            tr { th { "Seed" } td { (options.seed) } }
            @for (what, value) in changed(options) { tr { th { (what) } td { (value) } } }
            tr { th { "Link" } td { (link_name(options.link)) } }
        }
    }
}

fn earth_name(options: &Options) -> &'static str {
    match options.earth {
        plant_sim::EarthModel::Flat => "flat, constant gravity",
        plant_sim::EarthModel::Wgs84 => "WGS-84, rotating, J2 gravity",
        plant_sim::EarthModel::Round => "sphere, rotating",
        plant_sim::EarthModel::RoundNonRotating => "sphere, not rotating",
    }
}

fn link_name(link: Link) -> &'static str {
    match link {
        Link::InProcess => "one process, function calls",
        Link::Udp => "two processes over UDP",
    }
}

fn drawings(figures: &[Figure]) -> Markup {
    html! {
        @for figure in figures {
            figure id=(figure.name) {
                (PreEscaped(&figure.svg))
                figcaption { (figure.caption) }
            }
        }
    }
}

fn claims(results: &[ClaimResult]) -> Markup {
    html! {
        table.wide {
            thead { tr {
                th { "Claim" } th { "What the paper says" } th { "Measured" } th.number { "Value" }
                th.number { "Limit" } th { "Unit" } th { "Holds" }
            } }
            tbody { @for (index, result) in results.iter().enumerate() {
                @let first = index == 0 || results[index - 1].claim != result.claim;
                tr.first[first] {
                    td { @if first { (result.id) } }
                    td { @if first { (result.claim) } }
                    td { (result.measure) @if !result.failed_runs.is_empty() {
                        div.runs { (result.failed_runs.join("; ")) }
                    } }
                    td.number { (number(result.value)) }
                    td.number { (result.limit) }
                    td { (result.unit) }
                    td class=(if result.pass { "good" } else { "bad" }) { (yes(result.pass)) }
                }
            } }
        }
    }
}

fn yes(pass: bool) -> &'static str {
    if pass { "yes" } else { "NO" }
}

/// A measured value with four significant digits; `none` for one that could not be measured.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "none".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = libm::floor(libm::log10(value.abs()));
    if !(-4.0..7.0).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    // Between -4 and 7.
    let decimals = usize::try_from(DIGITS - 1 - magnitude as i32).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// The claims as a table for the terminal: number, measure, value, limit, whether it holds.
pub fn text_table(results: &[ClaimResult]) -> String {
    let width = results.iter().map(|r| r.measure.chars().count()).max().unwrap_or(0);
    let mut text = format!(
        "{:<3} {:<width$} {:>10} {:>10} {:<6} ok\n",
        "id", "measure", "value", "limit", "unit"
    );
    for r in results {
        let (value, limit) = (number(r.value), r.limit.to_string());
        let line = writeln!(
            text,
            "{:<3} {:<width$} {value:>10} {limit:>10} {:<6} {}",
            r.id,
            r.measure,
            r.unit,
            yes(r.pass)
        );
        line.expect("writing to a String cannot fail");
    }
    let held = results.iter().filter(|r| r.pass).count();
    writeln!(text, "{held} of {} limits hold", results.len())
        .expect("writing to a String cannot fail");
    text
}

/// (a) The observer of equations 21 to 23, taken literally.
fn literal(cases: &[Literal; 2]) -> Markup {
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
fn always_on(all: &Comparisons) -> Markup {
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

/// What always on costs in healthy flight.
fn price(t: &TurbulenceEffect) -> Markup {
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

fn healthy(t: &TurbulenceEffect, name: &str, h: &Healthy) -> Markup {
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
fn ganged(cases: &[Ganged; 2]) -> Markup {
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

/// How much of the benefit is the nozzle's.
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

/// Paper, and what could and could not be compared with it.
fn introduction(limits: &FlightLimits) -> Markup {
    html! {
        p {
            "The paper is Wang, Chen, Ren, Liu, \u{201c}Two-Step Robust Fault-Tolerant Controller Design Based on "
            "NESO for UAVs with Actuator Faults and Disturbances\u{201d}, Drones 2025, 9(3), 183. It prints no "
            "parameters of the aircraft and no gains, and its curves were not available to compare with. So this "
            "page does not say that the curves are those of the paper. It says whether, with one documented set of "
            "parameters and gains, every outcome occurs that the paper describes in words. The limits below put "
            "numbers on those words; they are this project\u{2019}s."
        }
        p {
            "A flight is lost when the magnitude of the roll angle passes " (degrees(limits.roll_rad))
            ", of the angle of attack " (degrees(limits.alpha_rad)) ", of the sideslip " (degrees(limits.beta_rad))
            ", of the pitch angle " (degrees(limits.pitch_rad)) ", or when the altitude falls below "
            (number(limits.altitude_min_m)) " m, at any time. F is the true angular acceleration minus that which the "
            "controller\u{2019}s model gives for healthy effectors at their modelled positions. The jump is the "
            "largest magnitude of F within " (number(JUMP_S)) " s of the fault."
        }
    }
}

fn degrees(angle_rad: f64) -> String {
    format!("{} deg", number(angle_rad / DEG))
}

/// The parameters that carry the result, and what happens with others.
fn doubts(sensitivity: &[Sensitivity]) -> Markup {
    html! {
        p {
            "The aircraft is built from an F-16 model, and departs from it where the paper\u{2019}s outcomes could "
            "not occur otherwise: with the elevators of an F-16 a jammed one has several times the moment of the "
            "nozzle, and with its ailerons the PID alone does not lose the roll axis. Weak ailerons and elevators, "
            "the drag (it sets the thrust of level flight, and with it what the nozzle can do), the yaw that an "
            "elevator and an aileron make with their roll being exactly in the same ratio, and a rudder with more "
            "yaw moment than the fin are therefore choices, and the results rest on them. For each, both cases were "
            "flown again in still air with the other value, the controller being told, gains unchanged, and the "
            "limits of claims 1 and 2 counted:"
        }
        table {
            thead { tr {
                th { "Parameter" } th { "What" } th.number { "Here" } th.number { "Instead" } th { "Because" }
                th.number { "Limits held" } th { "Claims broken" }
            } }
            tbody { @for s in sensitivity { tr {
                td { (s.doubt.name) }
                td { (s.doubt.meaning) }
                td.number { (number(s.value)) }
                td.number { (number(s.doubt.instead)) }
                td { (s.doubt.why) }
                @match s.held {
                    Some((held, of)) => {
                        td.number { (held) " of " (of) }
                        td { (if s.broken.is_empty() { "none".to_owned() } else { s.broken.join(", ") }) }
                    }
                    None => { td.number { "none" } td { "cannot be trimmed or controlled" } }
                }
            } } }
        }
        p {
            "The observer is told the compensation that was applied; the paper\u{2019}s equations 21 to 23 leave it "
            "out, while its error equation 26 holds only if it is in. When the compensator wakes is not in the "
            "paper either: here |z2| must exceed a level for some time, because the residual z - y returns to zero "
            "once the observer has converged. Speed hold, limits, lags and rates are this project\u{2019}s too."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::{Claim, Limit};

    #[test]
    fn numbers_have_four_digits_and_no_trailing_zeros() {
        let cases = [
            (0.0, "0"),
            (90.0, "90"),
            (123_456.0, "123456"),
            (0.012_345_6, "0.01235"),
            (-2.500_04, "-2.5"),
            (1.0e-9, "1.00e-9"),
            (f64::NAN, "none"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn the_terminal_table_marks_what_failed() {
        let claim = Claim { id: "1a", text: "no fault: climb is smooth" };
        let results = [
            claim.check("overshoot", 3.0, "m", Limit::AtMost(20.0)),
            claim.check("drop", 30.0, "m", Limit::AtMost(20.0)),
        ];
        let text = text_table(&results);
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[1].starts_with("1a") && lines[1].ends_with("yes"), "{text}");
        assert!(lines[2].contains("30") && lines[2].contains("<= 20"), "{text}");
        assert!(lines[2].ends_with("NO"), "{text}");
        assert_eq!(lines[3], "1 of 2 limits hold");
    }
}
