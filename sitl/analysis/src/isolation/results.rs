//! The study as tables, figure and page.

use std::fmt::Write as _;

use flight_control::isolation::Verdict;

use super::flights::{Class, Outcome};
use super::{Options, Study, VARIANTS};
use crate::chart::drawing::Drawing;
use crate::chart::{Figure, WIDTH};
use crate::metrics::{quantile, wilson_95};

/// Columns behind those of the classes: other pairs, no one although detected, not detected.
const FURTHER: [&str; 3] = ["two others", "no one", "not detected"];

/// How often each class was named, at the end of the flights with each class broken.
struct Confusion {
    rows: Vec<Vec<u32>>,
}

impl Confusion {
    fn of(study: &Study, law: usize) -> Self {
        let classes = study.classes.all.len();
        let mut rows = vec![vec![0; classes + FURTHER.len()]; classes];
        for outcome in &study.outcomes[law] {
            rows[outcome.class][column(study, outcome)] += 1;
        }
        Self { rows }
    }

    /// Flights in which the right ones were named, and in which any were.
    fn right_and_named(&self) -> (u32, u32) {
        let right = self.rows.iter().enumerate().map(|(class, row)| row[class]).sum();
        let named = self.rows.iter().flat_map(|row| &row[..=self.rows.len()]).sum();
        (right, named)
    }
}

/// The column of a flight: the place of the class that was named, or one of those behind.
fn column(study: &Study, outcome: &Outcome) -> usize {
    let classes = study.classes.all.len();
    match (&outcome.verdict, outcome.detected_s) {
        (Some(verdict), _) => study.classes.place(verdict).unwrap_or(classes),
        (None, Some(_)) => classes + 1,
        (None, None) => classes + 2,
    }
}

/// One row a flight.
pub fn flights_csv(study: &Study) -> String {
    let mut text = String::from(
        "law,class,seed,fault,detected_s,named_s,right_s,ever_wrong,verdict,behaviour,value,confidence,lost_s\n",
    );
    let seconds = |s: Option<f64>| s.map_or(String::new(), |s| format!("{s:.3}"));
    for (variant, outcomes) in VARIANTS.iter().zip(&study.outcomes) {
        for o in outcomes {
            let (name, behaviour, value, confidence) = verdict_cells(study, o.verdict.as_ref());
            // Writing to a string cannot fail, here and below.
            let _ = writeln!(
                text,
                "\"{}\",{},{},\"{}\",{},{},{},{},{name},{behaviour},{value},{confidence},{}",
                variant.name,
                study.classes.name(&study.classes.all[o.class]),
                o.seed,
                o.fault,
                seconds(o.detected_s),
                seconds(o.named_s),
                seconds(o.right_s),
                u8::from(o.ever_wrong),
                seconds(o.lost_s),
            );
        }
    }
    text
}

/// One row a pair of jams.
pub fn pairs_csv(study: &Study) -> String {
    let mut text = String::from("seed,fault,lost_s,lost_with_the_verdict_s,named_s,verdict\n");
    let seconds = |s: Option<f64>| s.map_or(String::new(), |s| format!("{s:.3}"));
    for [without, with] in &study.pairs {
        let (name, ..) = verdict_cells(study, with.verdict.as_ref());
        let _ = writeln!(
            text,
            "{},\"{}\",{},{},{},{name}",
            without.seed,
            without.fault,
            seconds(without.lost_s),
            seconds(with.lost_s),
            seconds(with.named_s)
        );
    }
    text
}

/// Lost by both, lost with the verdict in use only, lost without it only.
fn compare<'a>(flown: impl Iterator<Item = (&'a Outcome, &'a Outcome)>) -> [u32; 3] {
    let mut counts = [0; 3];
    for (without, with) in flown {
        counts[0] += u32::from(without.lost_s.is_some() && with.lost_s.is_some());
        counts[1] += u32::from(without.lost_s.is_none() && with.lost_s.is_some());
        counts[2] += u32::from(without.lost_s.is_some() && with.lost_s.is_none());
    }
    counts
}

/// What the use of the verdict loses and keeps, in Markdown.
fn comparison(study: &Study) -> String {
    let mut text = String::from(
        "\nWith the verdict in use, compared with the same flights of the law that only reports it:\n\n\
         | faults | flights | lost by both | lost that were kept | of all, 95 % interval | kept that were lost |\n|---|---|---|---|---|---|\n",
    );
    let [_, report, used] = &study.outcomes;
    let pairs = study.pairs.iter().map(|[without, with]| (without, with));
    for (name, flights, [both, lost, kept]) in [
        ("of each class", report.len(), compare(report.iter().zip(used))),
        ("any two effectors jammed", study.pairs.len(), compare(pairs)),
    ] {
        let (low, high) = wilson_95(lost, u32::try_from(flights).unwrap_or(u32::MAX));
        let (low, high) = (100.0 * low, 100.0 * high);
        let _ = writeln!(
            text,
            "| {name} | {flights} | {both} | {lost} | {low:.2} to {high:.2} % | {kept} |"
        );
    }
    text
}

/// Effectors, behaviour, value in degrees or as a part, and confidence; empty without a verdict.
fn verdict_cells(study: &Study, verdict: Option<&Verdict>) -> (String, String, String, String) {
    use flight_control::isolation::evidence::Behaviour;
    let Some(verdict) = verdict else { return Default::default() };
    let value = match verdict.behaviour {
        Behaviour::Stuck | Behaviour::Biased => format!("{:.2}", verdict.values[0].to_degrees()),
        Behaviour::Reduced => format!("{:.3}", verdict.values[0]),
        Behaviour::Irregular => String::new(),
    };
    let name = study.classes.name(&Class { effectors: verdict.effectors });
    let behaviour = format!("{:?}", verdict.behaviour).to_lowercase();
    (name, behaviour, value, format!("{:.4}", verdict.confidence))
}

/// The confusion matrices: one row a law and class.
pub fn confusion_csv(study: &Study) -> String {
    let names = study.classes.all.iter().map(|class| study.classes.name(class));
    let columns: Vec<String> = names.chain(FURTHER.map(str::to_owned)).collect();
    let mut text = format!("law,broken,{}\n", columns.join(","));
    for (law, variant) in VARIANTS.iter().enumerate() {
        for (row, name) in Confusion::of(study, law).rows.iter().zip(&columns) {
            let cells: Vec<String> = row.iter().map(u32::to_string).collect();
            let _ = writeln!(text, "\"{}\",{name},{}", variant.name, cells.join(","));
        }
    }
    text
}

fn percent(part: usize, of: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "numbers of flights")]
    let ratio = part as f64 / of as f64;
    100.0 * ratio
}

/// What matters, in Markdown.
pub fn summary(options: &Options, study: &Study) -> String {
    let mut text = format!(
        "{} flights with a fault for each of {} classes and each law, {} sensors, turbulence {} m/s, gyro noise {} deg/s, seed {}.\n\n\
         | law | detected | right at the end | wrong at the end | no one named | ever wrong | median delay to the right name, s | 95 % of them, s | lost |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        options.flights,
        study.classes.all.len(),
        options.grade.key(),
        options.turbulence_m_s,
        options.gyro_noise_deg_s,
        options.seed,
    );
    for (law, variant) in VARIANTS.iter().enumerate() {
        let outcomes = &study.outcomes[law];
        let detected = outcomes.iter().filter(|o| o.detected_s.is_some()).count();
        let (right, named) = Confusion::of(study, law).right_and_named();
        let (right, named) = (right as usize, named as usize);
        let delays: Vec<f64> = outcomes.iter().filter_map(|o| o.right_s).collect();
        let of = |count: usize| format!("{count} ({:.1} %)", percent(count, detected));
        let _ = writeln!(
            text,
            "| {} | {detected} of {} | {} | {} | {} | {} | {:.2} | {:.2} | {} |",
            variant.name,
            outcomes.len(),
            of(right),
            of(named - right),
            of(detected.saturating_sub(named)),
            of(outcomes.iter().filter(|o| o.ever_wrong).count()),
            quantile(delays.clone(), 0.5),
            quantile(delays, 0.95),
            outcomes.iter().filter(|o| o.lost_s.is_some()).count(),
        );
    }
    text += "\nPercentages are of the detected faults.\n";
    text += &comparison(study);
    text += "\n\
             | law | healthy flight, h | detector woke | an effector was named | named an hour, upper 95 % bound | lost |\n|---|---|---|---|---|---|\n";
    for (variant, healthy) in VARIANTS.iter().zip(&study.healthy) {
        let bound = crate::false_alarms::bound_per_h(healthy.named, healthy.seconds);
        let _ = writeln!(
            text,
            "| {} | {:.1} | {} | {} | {bound:.2} | {} |",
            variant.name,
            healthy.seconds / 3_600.0,
            healthy.woken,
            healthy.named,
            healthy.lost
        );
    }
    text
}

/// Space left of the cells, for names.
const LEFT: f64 = 250.0;
/// Height of a row.
const ROW: f64 = 22.0;
/// Height of the slanted names of the columns.
const HEAD: f64 = 130.0;
/// Colours of a cell without flights, of one that is right with all of them, and of a wrong one.
const EMPTY: [f64; 3] = [247.0, 247.0, 247.0];
const RIGHT: [f64; 3] = [94.0, 164.0, 211.0];
const WRONG: [f64; 3] = [222.0, 120.0, 85.0];
const MISSED: [f64; 3] = [190.0, 190.0, 190.0];

/// The confusion matrix of each law.
pub fn figure(study: &Study) -> Figure {
    let mut drawing = Drawing::default();
    let names: Vec<String> =
        study.classes.all.iter().map(|class| study.classes.name(class)).collect();
    let columns: Vec<&str> = names.iter().map(String::as_str).chain(FURTHER).collect();
    #[expect(clippy::cast_precision_loss, reason = "a few columns")]
    let width = (WIDTH - LEFT - 70.0) / columns.len() as f64;
    drawing.text((14.0, 25.0), "start", r#" font-size="20""#, "Which effector the isolation names");
    let about = "Rows: what is broken. Columns: what is named at the end of the flight. Numbers of flights; blue is right, red wrong.";
    drawing.text((14.0, 46.0), "start", "", about);
    let mut y = 66.0;
    for (law, variant) in VARIANTS.iter().enumerate() {
        let confusion = Confusion::of(study, law);
        let style = r#" font-weight="bold""#;
        drawing.text((14.0, y + HEAD - 8.0), "start", style, variant.name);
        let x_of = |place: usize| {
            #[expect(clippy::cast_precision_loss, reason = "a few columns")]
            let place = place as f64;
            LEFT + width * place
        };
        for (place, name) in columns.iter().enumerate() {
            let (x, base) = (x_of(place) + 0.5 * width, y + HEAD - 6.0);
            let turn = format!(r#" font-size="11" transform="rotate(-40 {x:.1} {base:.1})""#);
            drawing.text((x, base), "start", &turn, name);
        }
        y += HEAD;
        for (class, row) in confusion.rows.iter().enumerate() {
            drawing.text((LEFT - 8.0, y + ROW - 7.0), "end", r#" font-size="12""#, &names[class]);
            let all: u32 = row.iter().sum();
            for (place, count) in row.iter().enumerate() {
                let colour = match place {
                    place if place == class => RIGHT,
                    place if place > names.len() => MISSED,
                    _ => WRONG,
                };
                let part = f64::from(*count) / f64::from(all.max(1));
                // A single flight is to be seen too.
                let part = if *count > 0 { 0.15 + 0.85 * part } else { 0.0 };
                let x = x_of(place);
                let tip =
                    format!("{} broken, {} named: {count} of {all}", names[class], columns[place]);
                let fill = format!(r#"fill="{}""#, mix(colour, part));
                drawing.rectangle((x, y), (x + width - 2.0, y + ROW - 2.0), &fill, &tip);
                if *count > 0 {
                    let at = (x + 0.5 * width, y + ROW - 7.0);
                    drawing.text(at, "middle", r#" font-size="11""#, &count.to_string());
                }
            }
            y += ROW;
        }
        y += 18.0;
    }
    let caption = "What is named at the end of each flight with a fault, for each law".to_owned();
    Figure { name: "isolation", caption, svg: drawing.finish((WIDTH, y)) }
}

/// Between the colour of an empty cell and another one.
fn mix(colour: [f64; 3], part: f64) -> String {
    let [r, g, b] = [0, 1, 2].map(|i| EMPTY[i] + part * (colour[i] - EMPTY[i]));
    format!("rgb({r:.0} {g:.0} {b:.0})")
}
