//! The sweep as a picture: one field a flight, with its altitude error and what is at its limit.

use std::fmt::Write as _;

use super::{AIRSPEEDS_M_S, ALTITUDES_M, BANKS_DEG, CLIMBS_M, Flown, name};

/// Width and height of a field, pixels.
const FIELD: (usize, usize) = (112, 40);
/// Left of the first field: the altitudes.
const LEFT: usize = 150;
/// Above the first field of a block: its title and the airspeeds.
const TOP: usize = 60;

/// What is seen.
const TITLE: [&str; 3] = [
    "Healthy aircraft: largest altitude error of the last 20 s of each flight, m",
    "Green: within 10 m. Red: not, although a tenth of elevator and thrust is left.",
    "Grey: no such trim. Below the number: what the controller names.",
];

/// Draws it as SVG.
pub(super) fn draw(flown: &[Flown]) -> String {
    let columns = AIRSPEEDS_M_S.len();
    let mut body = String::new();
    let mut y = 80;
    let mut fields = flown.chunks(columns);
    for (line, title) in TITLE.iter().enumerate() {
        let at = 26 + 20 * line;
        let _ = writeln!(body, r##"<text x="20" y="{at}" font-size="15">{title}</text>"##);
    }
    let mut blocks: Vec<(String, Vec<String>)> = BANKS_DEG
        .iter()
        .map(|bank| {
            let rows = ALTITUDES_M.iter().map(|altitude| format!("{altitude:.0} m")).collect();
            (format!("bank {bank:.0} deg"), rows)
        })
        .collect();
    let climbs = CLIMBS_M.iter().map(|[from, to]| format!("{from:.0} to {to:.0} m")).collect();
    blocks.push(("climbs and descents".to_owned(), climbs));
    for (title, rows) in blocks {
        let _ = writeln!(body, r##"<text x="20" y="{}" font-size="16">{title}</text>"##, y + 20);
        for (column, airspeed) in AIRSPEEDS_M_S.iter().enumerate() {
            let x = LEFT + column * FIELD.0 + FIELD.0 / 2;
            let at = y + 46;
            let _ = writeln!(
                body,
                r##"<text x="{x}" y="{at}" font-size="14" text-anchor="middle">{airspeed:.0} m/s</text>"##
            );
        }
        for (row, label) in rows.iter().enumerate() {
            let top = y + TOP + row * FIELD.1;
            let _ = writeln!(
                body,
                r##"<text x="{}" y="{}" font-size="14" text-anchor="end">{label}</text>"##,
                LEFT - 10,
                top + 25
            );
            for (column, f) in fields.next().unwrap_or_default().iter().enumerate() {
                field(&mut body, LEFT + column * FIELD.0, top, f);
            }
        }
        y += TOP + rows.len() * FIELD.1 + 20;
    }
    let width = LEFT + columns * FIELD.0 + 20;
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{y}" font-family="sans-serif">
<rect width="{width}" height="{y}" fill="white"/>
{body}</svg>
"##
    )
}

fn field(body: &mut String, x: usize, y: usize, flown: &Flown) {
    let colour = match (flown.is_held(), flown.has_reserve()) {
        (true, _) => "#bfe3c0",
        (false, true) => "#f0a8a0",
        (false, false) => "#d8d8d8",
    };
    let decimals = if flown.error_m < 10.0 { 1 } else { 0 };
    let (width, height) = (FIELD.0 - 4, FIELD.1 - 4);
    let (middle, first, second) = (x + FIELD.0 / 2 - 2, y + 17, y + 32);
    let _ = writeln!(
        body,
        r##"<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="{colour}"/>
<text x="{middle}" y="{first}" font-size="14" text-anchor="middle">{:.decimals$}</text>
<text x="{middle}" y="{second}" font-size="11" text-anchor="middle">{}</text>"##,
        flown.error_m,
        name(flown)
    );
}
