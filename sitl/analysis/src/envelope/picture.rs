//! The sweep as a picture: one field a flight, with its altitude error and what is at its limit.

use super::{AIRSPEEDS_M_S, ALTITUDES_M, BANKS_DEG, CLIMBS_M, Flown, name};
use crate::chart::Figure;
use crate::chart::drawing::Drawing;

/// Width and height of a field.
const FIELD: (f64, f64) = (112.0, 40.0);
/// Left of the first field: the altitudes.
const LEFT: f64 = 150.0;
/// Above the first field of a block: its title and the airspeeds.
const TOP: f64 = 60.0;
/// Around blocks and fields.
const ROOM: f64 = 20.0;

/// What is seen.
const TITLE: [&str; 3] = [
    "Healthy aircraft: largest altitude error of the last 20 s of each flight, m",
    "Green: within 10 m. Red: not, although a tenth of elevator and thrust is left.",
    "Grey: no such trim. Below the number: what the controller names.",
];

/// Draws it.
pub(super) fn figure(flown: &[Flown]) -> Figure {
    let mut drawing = Drawing::default();
    let mut y = 26.0;
    for title in TITLE {
        drawing.text((ROOM, y), "start", r#" font-size="15""#, title);
        y += 20.0;
    }
    let banks = BANKS_DEG.iter().map(|bank| {
        let rows = ALTITUDES_M.iter().map(|altitude| format!("{altitude:.0} m")).collect();
        (format!("bank {bank:.0} deg"), rows)
    });
    let climbs = CLIMBS_M.iter().map(|[from, to]| format!("{from:.0} to {to:.0} m")).collect();
    let blocks = banks.chain([("climbs and descents".to_owned(), climbs)]);
    let mut lines = flown.chunks(AIRSPEEDS_M_S.len());
    for (title, rows) in blocks {
        let rows: Vec<String> = rows;
        drawing.text((ROOM, y + 14.0), "start", r#" font-size="16""#, &title);
        let mut x = LEFT;
        for airspeed in AIRSPEEDS_M_S {
            let label = format!("{airspeed:.0} m/s");
            drawing.text((x + 0.5 * FIELD.0, y + 40.0), "middle", "", &label);
            x += FIELD.0;
        }
        y += TOP;
        for label in rows {
            drawing.text((LEFT - 10.0, y + 25.0), "end", "", &label);
            let mut x = LEFT;
            for flown in lines.next().unwrap_or_default() {
                field(&mut drawing, (x, y), flown);
                x += FIELD.0;
            }
            y += FIELD.1;
        }
        y += ROOM;
    }
    let width = LEFT + AIRSPEEDS_M_S.len() as f64 * FIELD.0 + ROOM;
    let caption = TITLE.join(" ");
    Figure { name: "envelope", caption, svg: drawing.finish((width, y)) }
}

fn field(drawing: &mut Drawing, (x, y): (f64, f64), flown: &Flown) {
    let style = match (flown.is_held(), flown.has_reserve()) {
        (true, _) => r##"fill="#bfe3c0""##,
        (false, true) => r##"fill="#f0a8a0""##,
        (false, false) => r##"fill="#d8d8d8""##,
    };
    let decimals = if flown.error_m < 10.0 { 1 } else { 0 };
    let (middle, limit) = (x + 0.5 * FIELD.0 - 2.0, name(flown));
    drawing.rectangle((x, y), (x + FIELD.0 - 4.0, y + FIELD.1 - 4.0), style, "");
    let error = format!("{:.decimals$}", flown.error_m);
    drawing.text((middle, y + 17.0), "middle", "", &error);
    drawing.text((middle, y + 32.0), "middle", r#" font-size="11""#, limit);
}
