//! Results for people: one page that opens without a network, and a table for the terminal.

use std::fmt::Write as _;
use std::path::PathBuf;

use maud::{Markup, PreEscaped, html};

use crate::chart::Figure;
use crate::page;
use crate::paper::case1::REFERENCE_M;
use crate::paper::case2::REFERENCE_DEG;
use crate::paper::claim::ClaimResult;
use crate::paper::comparisons::Comparisons;
use crate::paper::sensitivity::Sensitivity;
use crate::paper::{Evaluation, Link, Options};

mod comparisons;
mod honesty;

/// What is a significant digit in a table of measured values.
const DIGITS: i32 = 4;

/// The page.
#[must_use]
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
        (honesty::what_this_is(&evaluation.flown[0].case.setup.plant.airframe.limits))
        h2 { "What was flown" }
        (flown(options, evaluation))
        h2 { "Figures" }
        (drawings(figures))
        h2 { "Claims" }
        (claims(&evaluation.results))
        h2 { "What the compensator itself contributes" }
        (comparisons::literal(&comparisons.literal))
        (comparisons::always_on(comparisons))
        (comparisons::ganged(&comparisons.ganged))
        h2 { "What a reader should doubt" }
        (honesty::doubts(sensitivity))
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
            tr { th { "Integration step" } td { (number(f64::from(options.step_us) / 1.0e3)) " ms, RK4" } }
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
#[must_use]
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
    #[expect(clippy::cast_possible_truncation, reason = "between -4 and 7")]
    let decimals = usize::try_from(DIGITS - 1 - magnitude as i32).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// The claims as a table for the terminal: number, measure, value, limit, whether it holds.
#[must_use]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::claim::{Claim, Limit};

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
    fn the_terminal_table_says_what_failed() {
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
