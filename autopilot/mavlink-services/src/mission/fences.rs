//! The other two lists: items to areas of a fence and to rally points.

use super::commands::{
    FENCE_CIRCLE_EXCLUSION, FENCE_CIRCLE_INCLUSION, FENCE_POLYGON_EXCLUSION,
    FENCE_POLYGON_INCLUSION, FENCE_RETURN_POINT, RALLY_POINT,
};
use super::draft::{
    P1, R, Rejected, X, Z, altitude, needed_place, number, of_limits, word, zero_m,
};
use crate::codec::MissionItem;
use flight_management::vehicle::Place;
use flight_management::vehicle::fence::{Area, AreaShape, Fence, FenceProblem, RallyPoint};
use flight_management::vehicle::rules::check_place;

type Problems = Vec<(u16, Rejected)>;

/// The fence that these items are, or all that is wrong with them.
pub fn fence(items: &[MissionItem<i32>]) -> Result<Fence, Vec<Rejected>> {
    let (mut areas, mut problems) = (Vec::new(), Problems::new());
    // The item of each vertex and circle.
    let mut seqs = Vec::new();
    let mut rest = (0_u16..).zip(items).peekable();
    while let Some((seq, item)) = rest.next() {
        let command = item.words.command;
        let shape = match command {
            FENCE_POLYGON_INCLUSION | FENCE_POLYGON_EXCLUSION => {
                let mut vertices = vec![(seq, item)];
                // A polygon ends where its count says, or where another one begins.
                while let Some(more) = rest.next_if(|(_, next)| {
                    next.words.command == command
                        && next.params[0] == item.params[0]
                        && f64::from(item.params[0]) > vertices.len() as f64
                }) {
                    vertices.push(more);
                }
                polygon(&vertices, &mut problems)
            }
            FENCE_CIRCLE_INCLUSION | FENCE_CIRCLE_EXCLUSION => circle(item).map_err(|rejected| {
                problems.push((seq, rejected));
            }),
            // Return has rally points and home.
            FENCE_RETURN_POINT => continue,
            _ => {
                problems.push((seq, Rejected::unsupported("not an item of a fence")));
                continue;
            }
        };
        if let Ok(shape) = shape {
            let inclusion = [FENCE_POLYGON_INCLUSION, FENCE_CIRCLE_INCLUSION].contains(&command);
            let area = Area { inclusion, shape };
            seqs.extend((seq..).take(area.items()));
            areas.push(area);
        }
    }
    let fence = Fence::new(areas).map_err(|found| {
        let at = |item: usize| seqs.get(item).copied().unwrap_or(0);
        problems.extend(found.iter().map(|(item, problem)| (at(*item), rejected(problem))));
    });
    match fence {
        Ok(fence) if problems.is_empty() => Ok(fence),
        _ => Err(Rejected::all(problems, items)),
    }
}

fn polygon(
    vertices: &[(u16, &MissionItem<i32>)],
    problems: &mut Problems,
) -> Result<AreaShape, ()> {
    let mut places = Vec::new();
    for (number, (seq, item)) in vertices.iter().enumerate() {
        match needed_place(item) {
            Ok(place) => places.push(place),
            Err(rejected) => problems.push((*seq, rejected)),
        }
        let count = word(P1, "number of vertices", item.params[0]).map(usize::from);
        if number == 0 && count != Ok(vertices.len()) {
            let rejected = count.err().unwrap_or_else(|| {
                let text = format!("{} vertices; expected {}", vertices.len(), item.params[0]);
                Rejected::param(P1, text)
            });
            problems.push((*seq, rejected));
            return Err(());
        }
    }
    if places.len() == vertices.len() { Ok(AreaShape::Polygon(places)) } else { Err(()) }
}

fn circle(item: &MissionItem<i32>) -> Result<AreaShape, Rejected> {
    let radius_m = number(P1, "radius", item.params[0])?
        .ok_or_else(|| Rejected::param(P1, "it needs a radius"))?;
    Ok(AreaShape::Circle { centre: needed_place(item)?, radius_m })
}

fn rejected(problem: &FenceProblem) -> Rejected {
    let result = match problem {
        FenceProblem::Count { .. } => P1,
        FenceProblem::TooMany { .. } => R::MAV_MISSION_NO_SPACE,
        FenceProblem::Same { .. } | FenceProblem::Crossing { .. } | FenceProblem::OnEdge { .. } => {
            X
        }
        FenceProblem::Range(refusal) => {
            let Rejected { result, reason } = of_limits(FENCE_CIRCLE_INCLUSION, refusal);
            // A radius is the first parameter here.
            let result = if reason.starts_with("radius") { P1 } else { result };
            return Rejected { result, reason };
        }
    };
    Rejected { result, reason: problem.to_string() }
}

/// The rally points that these items are, all inside the fence, or all that is wrong with them. Altitudes above sea level count
/// from home, which the plan has at `home_m`; it is on the ground.
pub fn rally(
    items: &[MissionItem<i32>],
    fence: &Fence,
    home_m: f64,
    ground_m: f64,
) -> Result<Vec<RallyPoint>, Vec<Rejected>> {
    let (mut points, mut problems) = (Vec::new(), Problems::new());
    for (seq, item) in (0_u16..).zip(items) {
        match point(item, fence, home_m, ground_m) {
            Ok(point) => points.push(point),
            Err(rejected) => problems.push((seq, rejected)),
        }
    }
    if problems.is_empty() { Ok(points) } else { Err(Rejected::all(problems, items)) }
}

fn point(
    item: &MissionItem<i32>,
    fence: &Fence,
    home_m: f64,
    ground_m: f64,
) -> Result<RallyPoint, Rejected> {
    if item.words.command != RALLY_POINT {
        return Err(Rejected::unsupported("not a rally point"));
    }
    let place: Place = needed_place(item)?;
    check_place(place).map_err(|refusal| of_limits(RALLY_POINT, &refusal))?;
    if fence.breach(place).is_some() {
        return Err(Rejected::param(X, "beyond the fence; expected a place inside it"));
    }
    let altitude_m = altitude(item)?.ok_or_else(|| Rejected::param(Z, "it needs an altitude"))?;
    Ok(RallyPoint { place, altitude_m: altitude_m + zero_m(item, home_m, ground_m) })
}
