//! The study as a table and a figure.

use std::fmt::Write as _;

use super::flights::{Flown, GROUPS, PerGroup, SETTLED_S};
use super::{CASES, Options};
use crate::chart::panel::{Curve, Panel, Rule};
use crate::chart::{Figure, Ink, Pattern, sheet};
use crate::metrics::mean;

/// Degrees of freedom of a group.
const FREEDOM: f64 = 3.0;
/// 95 % quantile of χ² with three degrees of freedom.
const QUANTILE_95: f64 = 7.815;
/// Largest NEES that the figure shows.
const NEES_MAX: f64 = 9.0;
/// Colours of the cases.
const INKS: [Ink; CASES.len()] = [
    Ink::new("#0050aa", Pattern::Solid),
    Ink::new("#3a8f5c", Pattern::Dashed),
    Ink::new("#d95f02", Pattern::Solid),
    Ink::new("#8c3a6b", Pattern::Dashed),
];

/// Band in which the mean NEES of so many flights lies with 95 % probability: χ² with 3 N degrees of freedom over N, by the
/// approximation of Wilson and Hilferty (1931), which is good to a thousandth here.
pub fn band(flights: f64) -> [f64; 2] {
    let freedom = FREEDOM * flights;
    [-1.96, 1.96].map(|deviations: f64| {
        let part = 2.0 / (9.0 * freedom);
        let root = 1.0 - part + deviations * part.sqrt();
        freedom * root * root * root / flights
    })
}

/// The rows of flights after the settling.
fn settled<T>(of: &[T]) -> impl Iterator<Item = &T> {
    of.iter().zip(0_u32..).filter(|(_, second)| f64::from(*second) > SETTLED_S).map(|(row, _)| row)
}

/// Mean NEES of a group over all settled seconds of all flights.
pub fn mean_nees(flights: &[Flown], group: usize) -> f64 {
    mean(flights.iter().flat_map(|flown| settled(&flown.nees).map(move |row| row[group])))
}

/// Mean over flights at each second.
fn history(flights: &[Flown], group: usize) -> Vec<(f64, f64)> {
    let seconds = flights.iter().map(|flown| flown.nees.len()).max().unwrap_or(0);
    (0..seconds)
        .map(|second| {
            let values = flights.iter().filter_map(|flown| Some(flown.nees.get(second)?[group]));
            (second as f64, mean(values).min(NEES_MAX))
        })
        .collect()
}

/// Normalised squares over time, a panel for each group.
pub fn figure(duration_s: f64, flown: &[Vec<Flown>]) -> Figure {
    let flights = flown[0].len() as f64;
    let [low, high] = band(flights);
    let panels: Vec<Panel> = GROUPS
        .iter()
        .enumerate()
        .map(|(group, (name, ..))| Panel {
            title: format!("{name}, mean of {flights} flights"),
            y_label: "NEES, three states",
            x: (0.0, duration_s),
            y: (0.0, NEES_MAX),
            curves: (0..CASES.len())
                .map(|case| Curve::unnamed(history(&flown[case], group), INKS[case]))
                .collect(),
            rules: [(low, ""), (high, "95 % band")]
                .map(|(value, label)| Rule { value, label: label.to_owned() })
                .into(),
            ..Panel::default()
        })
        .collect();
    let legend: Vec<(&str, Ink)> = CASES.iter().map(|case| case.name).zip(INKS).collect();
    let title = "Estimation errors squared, over what the estimator says of them";
    Figure {
        name: "estimator",
        caption: "Normalised estimation error squared over time; three is what a consistent estimator has"
            .to_owned(),
        svg: sheet(title, &legend, 2, &panels),
    }
}

/// Mean NEES, part below the 95 % quantile, error and standard deviation of each group.
pub fn summary(options: &Options, duration_s: f64, flown: &[Vec<Flown>]) -> String {
    let [low, high] = band(f64::from(options.flights));
    let mut text = format!(
        "{} flights of {duration_s} s for each row, judged once a second from {SETTLED_S} s on; turbulence {} m/s, steady wind up to \
         20 m/s, seed {}. A consistent estimator has a mean NEES of 3; the mean of {} independent values is within {low:.2} to \
         {high:.2} with 95 % probability.\n\n\
         | sensors | states | mean NEES | seconds with the mean in its band | below 7.81 (95 %) | error, rms | by the estimator, rms |\n\
         |---|---|---|---|---|---|---|\n",
        options.flights, options.turbulence_m_s, options.seed, options.flights,
    );
    for (case, flights) in CASES.iter().zip(flown) {
        for (group, (name, unit, size)) in GROUPS.iter().enumerate() {
            let all = |of: fn(&Flown) -> &Vec<PerGroup<f64>>| {
                flights.iter().flat_map(move |flown| settled(of(flown)).map(move |row| row[group]))
            };
            let below = mean(all(|f| &f.nees).map(|nees| f64::from(nees < QUANTILE_95)));
            let means = history(flights, group);
            let inside =
                mean(settled(&means).map(|(_, value)| f64::from((low..=high).contains(value))));
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "| {} | {name} | {:.2} | {:.0} % | {:.1} % | {:.3} {unit} | {:.3} {unit} |",
                case.name,
                mean_nees(flights, group),
                100.0 * inside,
                100.0 * below,
                mean(all(|f| &f.squares)).sqrt() / size,
                mean(all(|f| &f.variances)).sqrt() / size,
            );
        }
    }
    text += "\n| sensors | airspeed, rms | angle of attack, rms | sideslip, rms | aligned again | lost |\n|---|---|---|---|---|---|\n";
    for (case, flights) in CASES.iter().zip(flown) {
        let rms = |place: usize| {
            mean(flights.iter().flat_map(|f| settled(&f.flow).map(move |row| row[place]))).sqrt()
        };
        let _ = writeln!(
            text,
            "| {} | {:.2} m/s | {:.2} deg | {:.2} deg | {} | {} |",
            case.name,
            rms(0),
            rms(1).to_degrees(),
            rms(2).to_degrees(),
            flights.iter().map(|flown| flown.realigned).sum::<u32>(),
            flights.iter().filter(|flown| flown.lost).count(),
        );
    }
    text
}

/// Mean NEES of each case and group at each second.
pub fn csv(flown: &[Vec<Flown>]) -> String {
    let names: Vec<String> = GROUPS.iter().map(|(name, ..)| name.replace(' ', "_")).collect();
    let mut text = format!("sensors,time_s,{}\n", names.join(","));
    for (case, flights) in CASES.iter().zip(flown) {
        let groups: Vec<Vec<(f64, f64)>> =
            (0..GROUPS.len()).map(|group| history(flights, group)).collect();
        for second in 0..groups[0].len() {
            let cells: Vec<String> =
                groups.iter().map(|group| format!("{:.3}", group[second].1)).collect();
            let _ = writeln!(text, "{},{second},{}", case.name, cells.join(","));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_is_that_of_chi_square() {
        // χ² with 150 degrees of freedom: 117.985 and 185.800 (tables).
        let [low, high] = band(50.0);
        assert!((low - 117.985 / 50.0).abs() < 2.0e-3, "{low}");
        assert!((high - 185.800 / 50.0).abs() < 2.0e-3, "{high}");
    }
}
