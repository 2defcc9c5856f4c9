//! The charts of the report, as data and layout of plotly.js.

use serde_json::{Value as Json, json};

use super::{Sources, bars, effectors, list};
use crate::curves::{COLOURS, Curves, Point, Quantity};
use crate::limit::Jams;
use crate::map::{edges, is_flown};
use crate::plan::Plan;
use crate::store::RunEnd;

#[derive(Debug)]
pub struct Chart {
    pub data: Json,
    pub layout: Json,
    /// Its height, pixels.
    pub height: usize,
}

/// Colour of survived and of lost, as in the map.
const KEPT: &str = "rgb(168,205,232)";
const LOST: &str = "rgb(178,58,30)";
/// Height of a row of a law, and of what stands around the rows, pixels.
const ROW: usize = 26;
const AROUND: usize = 110;
/// Height of a row in the map, and of the axis and title of an effector.
const CELL: f64 = 17.0;
const AXIS: f64 = 62.0;

/// Letters and margins of every chart.
pub(super) fn layout(more: &Json) -> Json {
    let mut layout = json!({
        "font": {"family": "sans-serif", "size": 12},
        "margin": {"l": 190, "r": 30, "t": 30, "b": 50},
        "plot_bgcolor": "#fff",
        "hovermode": "closest",
    });
    if let (Some(layout), Some(more)) = (layout.as_object_mut(), more.as_object()) {
        layout.extend(more.clone());
    }
    layout
}

/// Share of flights that each law survives.
pub(super) fn survived(sources: &Sources<'_>, airframe: usize) -> Chart {
    let laws = sources.plan.laws();
    let groups: Vec<_> = sources.of(airframe).collect();
    let share = |lost: f64| 100.0 * (1.0 - lost);
    let kept: Vec<f64> = groups.iter().map(|group| share(group.fraction_lost())).collect();
    let above = groups.iter().zip(&kept).map(|(group, kept)| share(group.interval.0) - kept);
    let below = groups.iter().zip(&kept).map(|(group, kept)| kept - share(group.interval.1));
    let texts = kept.iter().map(|kept| match kept.is_nan() {
        true => "no flight could be flown".to_owned(),
        false => format!("{kept:.1} %"),
    });
    let texts: Vec<String> = texts.collect();
    let mut data = vec![json!({
        "type": "bar", "orientation": "h", "name": "of all flights",
        "y": laws, "x": list(kept.iter().copied()), "text": texts, "textposition": "inside", "insidetextanchor": "start",
        "marker": {"color": KEPT},
        "error_x": {"type": "data", "array": list(above), "arrayminus": list(below), "color": "#333"},
        "hovertemplate": "%{y}: %{x:.1f} % survived<extra></extra>",
    })];
    let headline: Vec<Option<f64>> =
        (0..laws.len()).map(|law| sources.headline(airframe, law)).collect();
    if headline.iter().any(Option::is_some) {
        data.push(json!({
            "type": "scatter", "mode": "markers", "name": "of those that leave a steady flight",
            "y": laws, "x": headline, "marker": {"symbol": "diamond", "size": 10, "color": "#111"},
            "hovertemplate": "%{y}: %{x:.1f} % of the jams that leave a steady flight<extra></extra>",
        }));
    }
    let layout = layout(&json!({
        "xaxis": {"title": {"text": "survived, %"}, "range": [0, 101]},
        "yaxis": {"autorange": "reversed"},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
    }));
    Chart { data: Json::from(data), layout, height: AROUND + 30 + ROW * laws.len() }
}

/// Loss fraction of each law minus that of the first one.
pub(super) fn differences(sources: &Sources<'_>, airframe: usize) -> Chart {
    let laws = sources.plan.laws();
    let rows: Vec<_> = sources
        .of(airframe)
        .filter_map(|group| Some((laws[group.law], bars(group.difference, 100.0)?)))
        .collect();
    let of = |place: usize| list(rows.iter().map(|(_, bars)| bars[place]));
    let names: Vec<&str> = rows.iter().map(|(name, _)| *name).collect();
    let data = json!([{
        "type": "scatter", "mode": "markers", "y": names, "x": of(0),
        "error_x": {"type": "data", "array": of(1), "arrayminus": of(2), "color": "#333"},
        "marker": {"size": 9, "color": "#1f4e8c"},
        "hovertemplate": "%{y}: %{x:+.1f} points<extra></extra>",
    }]);
    let title = format!("fraction lost minus that of {}, percentage points", laws[0]);
    let layout = layout(&json!({
        "xaxis": {"title": {"text": title}, "zeroline": true, "zerolinecolor": "#111", "rangemode": "tozero"},
        "yaxis": {"autorange": "reversed"},
        "showlegend": false,
    }));
    Chart { data, layout, height: AROUND + ROW * rows.len() }
}

/// For each quantity a line of each law over the level, in the band of its interval.
pub(super) fn curves(plan: &Plan, curves: &Curves) -> Vec<Chart> {
    let laws = plan.laws();
    let chart = |quantity: &Quantity| {
        let mut data = Vec::new();
        for (law, points) in quantity.laws.iter().enumerate() {
            let (name, colour) = (laws[law], COLOURS[law % COLOURS.len()]);
            let of = |value: fn(&Point) -> f64| list(points.iter().map(value));
            let there = || points.iter().filter(|point| point.value.is_finite());
            let around = there().map(|point| (point.level, point.interval.1));
            let around: Vec<_> =
                around.chain(there().rev().map(|point| (point.level, point.interval.0))).collect();
            data.push(json!({
                "type": "scatter", "mode": "lines", "fill": "toself", "legendgroup": name,
                "showlegend": false, "hoverinfo": "skip", "opacity": 0.15, "line": {"width": 0},
                "x": list(around.iter().map(|point| point.0)), "y": list(around.iter().map(|point| point.1)),
                "fillcolor": colour,
            }));
            data.push(json!({
                "type": "scatter", "mode": "lines+markers", "name": name, "legendgroup": name,
                "x": of(|point| point.level), "y": of(|point| point.value),
                "line": {"color": colour, "width": 2},
                "customdata": points.iter().map(|p| json!([p.interval.0, p.interval.1, p.flights])).collect::<Json>(),
                "hovertemplate": format!("{name}: %{{y:.2f}} ({}: %{{customdata[0]:.2f}} to %{{customdata[1]:.2f}}) of %{{customdata[2]}} flights<extra></extra>", quantity.interval),
            }));
        }
        let title = format!("{}, {}", quantity.name, quantity.unit);
        let layout = layout(&json!({
            "margin": {"l": 80, "r": 30, "t": 30, "b": 50},
            "xaxis": {"title": {"text": curves.title}, "zeroline": false},
            "yaxis": {"title": {"text": title}, "rangemode": "tozero"},
        }));
        Chart { data: Json::from(data), layout, height: 420 }
    };
    curves.quantities.iter().map(chart).collect()
}

/// A field of cells for each effector: laws over the angle of the jam.
pub(super) fn map(sources: &Sources<'_>, jams: Jams, airframe: usize) -> Chart {
    let laws = sources.plan.laws();
    let effectors = effectors(sources, jams, airframe);
    let field = CELL * laws.len() as f64;
    let height = (field + AXIS) * effectors.len() as f64 + 20.0;
    let (mut data, mut shapes, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    let mut layout_axes = serde_json::Map::new();
    for (place, (key, name, angles)) in effectors.iter().enumerate() {
        let number = if place == 0 { String::new() } else { (place + 1).to_string() };
        let edges = edges(angles);
        let (Some(first), Some(last)) = (edges.first(), edges.last()) else { continue };
        let top = 1.0 - (AXIS - 40.0 + (field + AXIS) * place as f64) / height;
        let domain = [(top - field / height).max(0.0), top];
        let kept = |law: usize, flights: &[usize]| {
            flights.iter().filter(|f| sources.results.end(**f, law) == RunEnd::Kept).count()
        };
        let of_law = |law: usize| {
            list(
                angles
                    .iter()
                    .map(|(_, flights)| 100.0 * kept(law, flights) as f64 / flights.len() as f64),
            )
        };
        let hover = |law: usize| -> Json {
            angles
                .iter()
                .map(|(deg, flights)| {
                    let run = flights[0] * laws.len() + law;
                    json!(format!(
                        "{}<br>{name} at {deg:+.1} deg: {} of {} kept<br>first run {run}:<br>{}",
                        laws[law],
                        kept(law, flights),
                        flights.len(),
                        sources.command(run)
                    ))
                })
                .collect()
        };
        data.push(json!({
            "type": "heatmap", "x": list(edges.iter().copied()), "y": laws,
            "z": (0..laws.len()).map(of_law).collect::<Json>(),
            "text": (0..laws.len()).map(hover).collect::<Json>(),
            "hovertemplate": "%{text}<extra></extra>",
            "zmin": 0, "zmax": 100, "colorscale": [[0, LOST], [1, KEPT]], "ygap": 2,
            "xaxis": format!("x{number}"), "yaxis": format!("y{number}"),
            "showscale": place == 0,
            "colorbar": {"title": {"text": "kept, %"}, "len": 200, "lenmode": "pixels", "y": 1, "yanchor": "top"},
        }));
        let _ = layout_axes.insert(
            format!("xaxis{number}"),
            json!({"anchor": format!("y{number}"), "ticksuffix": " deg", "zeroline": false, "range": [first, last]}),
        );
        let _ = layout_axes.insert(
            format!("yaxis{number}"),
            json!({"domain": domain, "anchor": format!("x{number}"), "autorange": "reversed"}),
        );
        notes.push(json!({
            "text": format!("<b>{name} jammed at</b>"), "showarrow": false, "xref": "paper",
            "x": 0, "xanchor": "left", "yref": "paper", "y": domain[1], "yanchor": "bottom",
        }));
        let limits = sources.studied[airframe].limits.as_ref();
        for (set, dash) in [("any", "solid"), ("straight_level", "dot")] {
            let found = limits.and_then(|limits| {
                let set = limits.sets.iter().position(|known| known.key == set)?;
                limits.range_deg(set, false, key)
            });
            for deg in found.into_iter().flatten().filter(|deg| is_flown(*deg, (*first, *last))) {
                shapes.push(json!({
                    "type": "line", "x0": deg, "x1": deg, "y0": 0, "y1": 1,
                    "xref": format!("x{number}"), "yref": format!("y{number} domain"),
                    "line": {"color": "#111", "width": 2, "dash": dash},
                }));
            }
        }
    }
    let mut layout = layout(&json!({"shapes": shapes, "annotations": notes}));
    if let Some(layout) = layout.as_object_mut() {
        layout.extend(layout_axes);
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand")]
    let height = height as usize + 80;
    Chart { data: Json::from(data), layout, height }
}
