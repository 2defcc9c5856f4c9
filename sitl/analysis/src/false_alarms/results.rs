//! The study as tables and as a page.

use std::fmt::Write as _;

use flight_control::Gains;
use maud::{PreEscaped, html};

use super::delays::{FAULTS, SEEDS, WAITED_S};
use super::detectors::{KINDS, SCALES, scale};
use super::flights::CONDITIONS;
use super::{ALLOWED_PER_H, Options, Shipped, Study, bound_per_h, of_kind};
use crate::chart::Figure;
use crate::page;

/// One row a detector: alarms at each flight condition and together, with the bound.
pub fn alarms_csv(study: &Study) -> String {
    let mut text = String::from(
        "lag_s,dwell_s,level,alarms_slow,alarms_design,alarms_fast,alarms,hours,alarms_per_h,bound_95_per_h\n",
    );
    let all = study.healthy();
    let hours = all.seconds / 3_600.0;
    for kind in 0..KINDS {
        let (lag_s, dwell_s) = of_kind(kind);
        for index in 0..SCALES {
            let [a, b, c] = study.conditions.each_ref().map(|at| at.alarms[kind][index]);
            let alarms = all.alarms[kind][index];
            // Writing to a string cannot fail, here and below.
            let _ = writeln!(
                text,
                "{lag_s},{dwell_s},{:.1},{a},{b},{c},{alarms},{hours:.3},{:.4},{:.4}",
                scale(index),
                f64::from(alarms) / hours,
                bound_per_h(alarms, all.seconds)
            );
        }
    }
    text
}

/// One row a detector and fault.
pub fn delays_csv(study: &Study) -> String {
    let mut text = String::from("fault,lag_s,dwell_s,level,median_s,longest_s\n");
    for delays in &study.delays {
        for kind in 0..KINDS {
            let (lag_s, dwell_s) = of_kind(kind);
            for index in 0..SCALES {
                let (median_s, longest_s) =
                    (delays.median_s[kind][index], delays.longest_s[kind][index]);
                let _ = writeln!(
                    text,
                    "\"{}\",{lag_s},{dwell_s},{:.1},{median_s:.3},{longest_s:.3}",
                    delays.fault.name,
                    scale(index)
                );
            }
        }
    }
    text
}

/// What matters, in Markdown.
pub fn summary(options: &Options, study: &Study) -> String {
    let Shipped { kind, index } = Shipped::find();
    let all = study.healthy();
    let hours = all.seconds / 3_600.0;
    let alarms = all.alarms[kind][index];
    let bound = bound_per_h(alarms, all.seconds);
    let gains = Gains::REFERENCE.activation;
    let verdict = if bound <= ALLOWED_PER_H { "holds" } else { "is not shown" };
    let mut text = format!(
        "Levels {}, {}, {} rad/s2 (roll, pitch, yaw) for {} s: {alarms} alarms in {hours:.1} h of healthy flight, {:.0} % of it in \
         manoeuvres,\nturbulence {} m/s, gyro noise {} deg/s, seed {}. Upper 95 % bound {bound:.2} an hour; \"at most {ALLOWED_PER_H} \
         an hour\" {verdict}.\nThe detector that flies, which stays awake until it is released, woke {} times. Aircraft lost: {}.\n\n",
        gains.level_roll,
        gains.level_pitch,
        gains.level_yaw,
        gains.on_dwell_s,
        100.0 * all.manoeuvring_s / all.seconds,
        options.turbulence_m_s,
        options.gyro_noise_deg_s,
        options.seed,
        all.flown,
        all.lost,
    );
    text += "| flight condition | hours | alarms | rms of z2 over its level: roll, pitch, yaw | largest |\n|---|---|---|---|---|\n";
    for (condition, at) in CONDITIONS.iter().zip(&study.conditions) {
        let (rms, largest) = (at.rms(), at.largest);
        let _ = writeln!(
            text,
            "| {} m/s at {} m | {:.1} | {} | {:.3}, {:.3}, {:.3} | {:.2}, {:.2}, {:.2} |",
            condition.airspeed_m_s,
            condition.altitude_m,
            at.seconds / 3_600.0,
            at.alarms[kind][index],
            rms.x,
            rms.y,
            rms.z,
            largest.x,
            largest.y,
            largest.z
        );
    }
    text += &lowest_levels(study);
    let _ = writeln!(
        text,
        "\n| fault, median of {SEEDS} flights in the same air | delay, s | longest |\n|---|---|---|"
    );
    for (delays, fault) in study.delays.iter().zip(FAULTS) {
        let seconds =
            |s: f64| if s.is_finite() { format!("{s:.3}") } else { format!("over {WAITED_S}") };
        let (median_s, longest_s) = (delays.median_s[kind][index], delays.longest_s[kind][index]);
        let _ =
            writeln!(text, "| {} | {} | {} |", fault.name, seconds(median_s), seconds(longest_s));
    }
    text
}

/// For each lag and dwell the lowest level with which the bound is kept, and the delays that follow.
fn lowest_levels(study: &Study) -> String {
    let all = study.healthy();
    let mut text = String::from(
        "\n| lag, s | dwell, s | lowest level for the bound | alarms | delay of case 1, s | delay of case 2, s | faults noticed |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for kind in 0..KINDS {
        let (lag_s, dwell_s) = of_kind(kind);
        let keeps =
            |index: &usize| bound_per_h(all.alarms[kind][*index], all.seconds) <= ALLOWED_PER_H;
        let Some(index) = (0..SCALES).find(keeps) else {
            let _ = writeln!(text, "| {lag_s} | {dwell_s} | none | | | | |");
            continue;
        };
        let of =
            |fault: usize| study.delays.get(fault).map_or(f64::NAN, |d| d.median_s[kind][index]);
        let noticed = study.delays.iter().filter(|d| d.longest_s[kind][index].is_finite()).count();
        let _ = writeln!(
            text,
            "| {lag_s} | {dwell_s} | {:.1} | {} | {:.3} | {:.3} | {noticed} of {} |",
            scale(index),
            all.alarms[kind][index],
            of(0),
            of(1),
            study.delays.len()
        );
    }
    text
}

/// One page that opens without a network.
pub fn page(options: &Options, study: &Study, figure: &Figure) -> String {
    let body = html! {
        h1 { "False alarms and detection delay" }
        figure {
            (PreEscaped(&figure.svg))
            figcaption { (figure.caption) }
        }
        pre { (summary(options, study)) }
    };
    page::page("False alarms", "", &body)
}
