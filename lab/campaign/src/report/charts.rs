//! Rows with a value and its interval: what each law survives, and by how much it differs from the first one.

use lab_report::chart::drawing::Drawing;
use lab_report::chart::{Ink, Pattern, WIDTH, axis};

use super::Sources;
use crate::summary::LossDifference;

/// Space left of the axis, for names; right of it, for the last number.
const LEFT: f64 = 240.0;
const RIGHT: f64 = 30.0;
/// Height of a row.
const ROW: f64 = 26.0;
const INTERVAL: Ink = Ink::new("#333333", Pattern::Solid);

/// A row.
struct Bar<'a> {
    name: &'a str,
    value: f64,
    interval: (f64, f64),
    /// Another number of it, as a diamond.
    mark: Option<f64>,
    text: String,
}

/// Share of flights that each law survives.
pub(super) fn survived(sources: &Sources<'_>, airframe: usize) -> String {
    let laws = sources.plan.laws();
    let bars = sources.of(airframe).map(|group| {
        let share = |lost: f64| 100.0 * (1.0 - lost);
        let value = share(group.fraction_lost());
        let text = match value.is_nan() {
            true => "no flight could be flown".to_owned(),
            false => format!("{value:.1} %"),
        };
        let interval = (share(group.interval.1), share(group.interval.0));
        let mark = sources.headline(airframe, group.law);
        Bar { name: laws[group.law], value, interval, mark, text }
    });
    draw(&bars.collect::<Vec<_>>(), (0.0, 100.0), "survived, %")
}

/// Loss fraction of each law minus that of the first one.
pub(super) fn differences(sources: &Sources<'_>, airframe: usize) -> String {
    let laws = sources.plan.laws();
    let bars: Vec<Bar<'_>> = sources
        .of(airframe)
        .filter_map(|group| {
            let LossDifference { mean, interval: (low, high) } = group.difference?;
            let (value, interval) = (100.0 * mean, (100.0 * low, 100.0 * high));
            let text = format!("{value:+.1}");
            Some(Bar { name: laws[group.law], value, interval, mark: None, text })
        })
        .collect();
    let ends = bars.iter().flat_map(|bar| [bar.interval.0, bar.interval.1]);
    let range = axis::range(ends.chain([0.0]), 2.0);
    let title = format!("fraction lost minus that of {}, percentage points", laws[0]);
    draw(&bars, range, &title)
}

fn draw(bars: &[Bar<'_>], range: (f64, f64), title: &str) -> String {
    let mut drawing = Drawing::default();
    let x_of = |v: f64| LEFT + (v - range.0) / (range.1 - range.0) * (WIDTH - LEFT - RIGHT);
    let bottom = 8.0 + ROW * bars.len() as f64;
    let (ticks, decimals) = axis::ticks(range);
    for tick in ticks {
        let x = x_of(tick);
        let style = if tick == 0.0 { r##"stroke="#111""## } else { r##"stroke="#ddd""## };
        drawing.line((x, 4.0), (x, bottom), style, "");
        let number = axis::number(tick, decimals);
        drawing.text((x, bottom + 16.0), "middle", r#" font-size="11""#, &number);
    }
    drawing.text((0.5 * (LEFT + WIDTH - RIGHT), bottom + 34.0), "middle", "", title);
    for (place, Bar { name, value, interval, mark, text }) in bars.iter().enumerate() {
        let y = 8.0 + ROW * place as f64;
        let middle = y + 0.5 * ROW - 2.0;
        drawing.text((LEFT - 8.0, middle + 4.0), "end", r#" font-size="12""#, name);
        if value.is_finite() {
            let (from, to) = (x_of(0.0).min(x_of(*value)), x_of(0.0).max(x_of(*value)));
            let tip = format!("{name}: {text}");
            drawing.rectangle((from, y), (to, y + ROW - 5.0), r##"fill="#a8cde8""##, &tip);
            drawing.path([(x_of(interval.0), middle), (x_of(interval.1), middle)], &INTERVAL);
        }
        drawing.text((x_of(0.0) + 6.0, middle + 4.0), "start", r#" font-size="11""#, text);
        if let Some(mark) = mark {
            let (x, r) = (x_of(*mark), 5.0);
            let diamond = [(x - r, middle), (x, middle - r), (x + r, middle), (x, middle + r)];
            drawing.path(diamond.into_iter().chain([diamond[0]]), &INTERVAL.wide(2.0));
        }
    }
    drawing.finish((WIDTH, bottom + 44.0))
}
