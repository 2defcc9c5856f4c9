//! Files of plans as the items that a ground station would upload: `.plan` of QGroundControl and the `.mission` before it
//! (JSON), and waypoints as text (`QGC WPL 110`). The items are checked where uploads are.

use serde_json::Value;

use super::commands::{
    FENCE_CIRCLE_EXCLUSION, FENCE_CIRCLE_INCLUSION, FENCE_POLYGON_EXCLUSION,
    FENCE_POLYGON_INCLUSION, FENCE_RETURN_POINT, JUMP, LAND, LAND_START, LOITER_TO_ALTITUDE,
    RALLY_POINT, VTOL_LAND, WAYPOINT,
};
use super::draft::{self, Finished, PlanContext};
use super::fences;
use crate::codec::{ItemWords, ListKind, MissionItem};
use crate::convert;
use flight_management::vehicle::fence::{Fence, RallyPoint};
use flight_management::vehicle::plan::{ITEMS_MAX, Plan};
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Place};

/// First line of a text of waypoints; the version behind it does not change the columns.
const WAYPOINTS: &str = "QGC WPL";
/// Columns of its lines: number, current, frame, command, seven parameters, autocontinue.
const COLUMNS: usize = 12;
const FRAME_GLOBAL: u8 = 0;
const FRAME_MISSION: u8 = 2;
const FRAME_ABOVE_HOME: u8 = 3;

/// The content of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlanFile {
    home: Option<(Place, f64)>,
    mission: Vec<MissionItem<i32>>,
    fence: Vec<MissionItem<i32>>,
    rally: Vec<MissionItem<i32>>,
    /// What was read in another way than it is written.
    notes: Vec<String>,
}

impl PlanFile {
    /// Reads a file of either kind; a refusal names line or key.
    pub fn read(text: &str) -> Result<Self, String> {
        let text = text.trim_start_matches('\u{feff}');
        if text.trim_start().starts_with(WAYPOINTS) {
            Self::waypoints(text)
        } else {
            Self::json(text)
        }
    }

    /// Planned home, and its altitude above sea level, m: of its own, or item 0.
    pub fn home(&self) -> Option<(Place, f64)> {
        let of_item = |item: &MissionItem<i32>| {
            let place =
                convert::place(convert::degrees_of_e7(item.x), convert::degrees_of_e7(item.y))?;
            Some((place, convert::decimal(item.z)))
        };
        let first = self.mission.first().filter(|_| draft::may_be_home(&self.mission));
        self.home.or_else(|| first.and_then(of_item))
    }

    /// The plan and what of it is flown in another way than it says, or all that is wrong with it; it begins at this airspeed.
    pub fn plan(
        &self,
        rules: &Rules,
        airspeed: Option<Airspeed>,
    ) -> Result<(Plan, Vec<String>), Vec<String>> {
        let home_m = self.home.map(|(_, altitude_m)| altitude_m);
        let present = PlanContext { home_m, airspeed, ..PlanContext::default() };
        match draft::check(self.mission.clone(), present, rules) {
            Ok(Finished { plan, notes, .. }) => {
                Ok((plan, self.notes.iter().cloned().chain(notes.texts()).collect()))
            }
            Err(problems) => Err(problems.into_iter().map(|problem| problem.reason).collect()),
        }
    }

    /// The fence and the rally points, or all that is wrong with them.
    pub fn fence(&self) -> Result<(Fence, Vec<RallyPoint>), Vec<String>> {
        let reasons = |problems: Vec<draft::Rejected>| {
            problems.into_iter().map(|problem| problem.reason).collect::<Vec<_>>()
        };
        let fence = fences::fence(&self.fence).map_err(reasons)?;
        let home_m = self.home().map_or(0.0, |(_, altitude_m)| altitude_m);
        let rally = fences::rally(&self.rally, &fence, home_m, 0.0).map_err(reasons)?;
        Ok((fence, rally))
    }

    /// Names of the commands of the items, for texts about them.
    pub fn name(&self, item: u16) -> String {
        let item = self.mission.get(usize::from(item));
        item.map_or_else(String::new, |item| super::commands::named(item.words.command))
    }

    fn waypoints(text: &str) -> Result<Self, String> {
        let mut file = Self::default();
        let mut items = 0_u16;
        for (line, words) in (1..).zip(text.lines()).skip(1) {
            if words.trim().is_empty() || words.starts_with('#') {
                continue;
            }
            let at = |problem: String| format!("line {line}: {problem}");
            let columns: Vec<&str> = words.split_whitespace().collect();
            let [seq, _, frame, command, p1, p2, p3, p4, x, y, z, autocontinue] = columns[..]
            else {
                return Err(at(format!("{} columns; expected {COLUMNS}", columns.len())));
            };
            let whole = |what: &str, text: &str| {
                text.parse::<u16>().map_err(|_| at(format!("{what} \"{text}\" is no whole number")))
            };
            let real = |text: &str| {
                text.parse::<f64>().map_err(|_| at(format!("\"{text}\" is no number")))
            };
            // Ground stations count the lines, and so do the jumps.
            if whole("item number", seq)? != items {
                file.notes.push(format!("line {line}: item number {seq} is taken as {items}"));
            }
            let frame = u8::try_from(whole("frame", frame)?).unwrap_or(u8::MAX);
            let mut params =
                [real(p1)?, real(p2)?, real(p3)?, real(p4)?, real(x)?, real(y)?, real(z)?];
            let mut command = whole("command", command)?;
            let autocontinue = whole("autocontinue", autocontinue)? != 0;
            // Mission Planner writes zeros for a home that is not set.
            if items == 0 && command == 0 {
                (command, params) = (WAYPOINT, [0.0, 0.0, 0.0, 0.0, f64::NAN, f64::NAN, 0.0]);
            }
            match command {
                command @ FENCE_RETURN_POINT..=FENCE_CIRCLE_EXCLUSION => {
                    push(&mut file.fence, command, frame, params)
                }
                RALLY_POINT => push(&mut file.rally, RALLY_POINT, frame, params),
                // Otherwise the lines would not be the numbers that jumps have.
                _ if file.fence.len() + file.rally.len() > 0 => {
                    Err("an item of the mission behind a fence or rally points".to_owned())
                }
                command => file.push(command, frame, params, autocontinue),
            }
            .map_err(at)?;
            items = items.saturating_add(1);
        }
        // A file of a fence or of rally points may begin with home as well.
        if file.mission.len() == 1
            && file.fence.len() + file.rally.len() > 0
            && draft::may_be_home(&file.mission)
        {
            file.home = file.home();
            file.mission.clear();
        }
        Ok(file)
    }

    fn json(text: &str) -> Result<Self, String> {
        let text = without_comments(text);
        let value: Value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
        // Files before the fence (`.mission`) are what the mission is now.
        let mission = if value["items"].is_array() { &value } else { &value["mission"] };
        let items = mission["items"].as_array().ok_or("mission.items: there is no such list")?;
        let mut file = Self::default();
        let home = &mission["plannedHomePosition"];
        // The first of them have an item there.
        if let Some(home) = home.as_array().or(home["coordinate"].as_array()) {
            let [latitude, longitude, altitude] = numbers(home, "mission.plannedHomePosition")?;
            if !(latitude.is_nan() && longitude.is_nan()) {
                let place = convert::place(latitude, longitude).ok_or_else(|| {
                    format!("mission.plannedHomePosition: {latitude} {longitude} deg is no place")
                })?;
                file.home = Some((place, if altitude.is_finite() { altitude } else { 0.0 }));
            }
        }
        let mut ids = Vec::new();
        for (index, item) in items.iter().enumerate() {
            file.take(item, &mut ids).map_err(|why| format!("mission.items[{index}]: {why}"))?;
        }
        file.take_fence(&value["geoFence"]).map_err(|why| format!("geoFence: {why}"))?;
        for point in list(&value["rallyPoints"]["points"]) {
            let [x, y, z] =
                coordinate(point).map_err(|why| format!("rallyPoints.points: {why}"))?;
            push(&mut file.rally, RALLY_POINT, FRAME_ABOVE_HOME, [0.0, 0.0, 0.0, 0.0, x, y, z])?;
        }
        // A jump names the id of its target, which in a file need not be the number of an item.
        for item in file.mission.iter_mut().filter(|item| item.words.command == JUMP) {
            let target = ids.iter().position(|id| *id == f64::from(item.params[0]));
            item.params[0] = target.map_or(f32::from(u16::MAX), |target| target as f32);
        }
        Ok(file)
    }

    /// Adds the areas of the JSON; the first version of it has one polygon to stay in.
    fn take_fence(&mut self, value: &Value) -> Result<(), String> {
        let is_inclusion = |area: &Value| area["inclusion"] != false;
        let old = list(&value["polygon"]);
        let old = (!old.is_empty()).then_some((true, old));
        let polygons = list(&value["polygons"]).iter();
        let polygons = polygons.map(|area| (is_inclusion(area), list(&area["polygon"])));
        for (inclusion, vertices) in polygons.chain(old) {
            let command = if inclusion { FENCE_POLYGON_INCLUSION } else { FENCE_POLYGON_EXCLUSION };
            for vertex in vertices {
                let [x, y] = coordinate(vertex)?;
                let params = [vertices.len() as f64, 0.0, 0.0, 0.0, x, y, 0.0];
                push(&mut self.fence, command, FRAME_GLOBAL, params)?;
            }
        }
        for area in list(&value["circles"]) {
            let command =
                if is_inclusion(area) { FENCE_CIRCLE_INCLUSION } else { FENCE_CIRCLE_EXCLUSION };
            let [x, y] = coordinate(&area["circle"]["center"])?;
            let radius = area["circle"]["radius"].as_f64().ok_or("a circle without a radius")?;
            push(&mut self.fence, command, FRAME_GLOBAL, [radius, 0.0, 0.0, 0.0, x, y, 0.0])?;
        }
        Ok(())
    }

    /// Adds an item of the JSON, or the items of which one is made. `ids` are their numbers for jumps.
    fn take(&mut self, item: &Value, ids: &mut Vec<f64>) -> Result<(), String> {
        if item["type"] != "ComplexItem" {
            return self.take_simple(item, ids);
        }
        let kind = item["complexItemType"].as_str().unwrap_or("without a type");
        let transects = item["TransectStyleComplexItem"]["Items"].as_array();
        match (kind, transects) {
            ("fwLandingPattern" | "vtolLandingPattern", _) => {
                self.landing_pattern(item, kind == "vtolLandingPattern")?;
            }
            (_, Some(items)) => items.iter().try_for_each(|item| self.take_simple(item, ids))?,
            _ => return Err(format!("a complex item {kind} without items cannot be read")),
        }
        // The items in it have no ids of their own: a jump leads to the first.
        ids.resize(self.mission.len(), f64::NAN);
        Ok(())
    }

    fn take_simple(&mut self, item: &Value, ids: &mut Vec<f64>) -> Result<(), String> {
        let whole = |key: &str| {
            let number = item[key].as_u64().and_then(|number| u16::try_from(number).ok());
            number.ok_or_else(|| format!("{key}: no whole number of 0 to 65535"))
        };
        let frame = u8::try_from(whole("frame")?).unwrap_or(u8::MAX);
        let params = match (item["coordinate"].as_array(), item["params"].as_array()) {
            (None, Some(params)) => numbers(params, "params")?,
            (Some(place), params) => {
                // Older files have the place apart, and the first of them a key for each parameter.
                let [p1, p2, p3, p4] = match params {
                    Some(params) => numbers(params, "params")?,
                    None => ["param1", "param2", "param3", "param4"]
                        .map(|key| item[key].as_f64().unwrap_or(f64::NAN)),
                };
                let [x, y, z] = numbers(place, "coordinate")?;
                [p1, p2, p3, p4, x, y, z]
            }
            (None, None) => return Err("params: there is no such list".to_owned()),
        };
        let autocontinue = item["autoContinue"].as_bool().unwrap_or(true);
        self.push(whole("command")?, frame, params, autocontinue)?;
        let id = item["doJumpId"].as_f64().or(item["id"].as_f64());
        ids.push(id.unwrap_or(f64::NAN));
        Ok(())
    }

    /// The landing pattern of QGroundControl: the marker, a circle or a point to come down to, and the landing.
    fn landing_pattern(&mut self, item: &Value, vtol: bool) -> Result<(), String> {
        let place = |key: &str| coordinate::<3>(&item[key]).map_err(|why| format!("{key}: {why}"));
        let radius = item["loiterRadius"].as_f64().unwrap_or(0.0);
        let radius = if item["loiterClockwise"] == false { -radius } else { radius };
        // Files before version 2 have a key for each altitude.
        let frame = |key: &str| {
            let is_absolute = item["altitudesAreRelative"] == false || item[key] == false;
            if is_absolute { FRAME_GLOBAL } else { FRAME_ABOVE_HOME }
        };
        let approach_frame = frame("loiterAltitudeRelative");
        let [x, y, z] = match place("landingApproachCoordinate") {
            Ok(approach) => approach,
            // Its name in files before version 2.
            Err(why) => place("loiterCoordinate").map_err(|_| why)?,
        };
        self.push(LAND_START, FRAME_MISSION, [0.0; 7], true)?;
        if item["useLoiterToAlt"] == false {
            self.push(WAYPOINT, approach_frame, [0.0, 0.0, 0.0, f64::NAN, x, y, z], true)?;
        } else {
            self.push(LOITER_TO_ALTITUDE, approach_frame, [1.0, radius, 0.0, 1.0, x, y, z], true)?;
        }
        let [x, y, z] = place("landCoordinate")?;
        let land = if vtol { VTOL_LAND } else { LAND };
        let land_frame = frame("landAltitudeRelative");
        self.push(land, land_frame, [0.0, 0.0, 0.0, f64::NAN, x, y, z], true)
    }

    fn push(
        &mut self,
        command: u16,
        frame: u8,
        params: [f64; 7],
        autocontinue: bool,
    ) -> Result<(), String> {
        push(&mut self.mission, command, frame, params)?;
        if let Some(item) = self.mission.last_mut() {
            item.words.autocontinue = autocontinue;
        }
        Ok(())
    }
}

/// Adds an item to a list.
fn push(
    items: &mut Vec<MissionItem<i32>>,
    command: u16,
    frame: u8,
    [p1, p2, p3, p4, x, y, z]: [f64; 7],
) -> Result<(), String> {
    let seq = u16::try_from(items.len()).unwrap_or(u16::MAX);
    if usize::from(seq) >= ITEMS_MAX {
        return Err(format!("more than {ITEMS_MAX} items"));
    }
    let is_place = convert::GLOBAL_FRAMES.contains(&frame);
    let whole = |value: f64| match value {
        value if value.is_nan() => i32::MAX,
        value if is_place => convert::degrees_e7(convert::radians(value)),
        value => convert::to_i32(value),
    };
    let list = ListKind::MISSION;
    let words = ItemWords { seq, command, frame, current: 0, autocontinue: true, list };
    let params = [p1, p2, p3, p4].map(|value| value as f32);
    items.push(MissionItem { params, x: whole(x), y: whole(y), z: z as f32, words });
    Ok(())
}

/// The values of a list; none if there is no list.
fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// A place, and its altitude where N is 3.
fn coordinate<const N: usize>(value: &Value) -> Result<[f64; N], String> {
    let numbers = numbers(value.as_array().ok_or("there is no such list")?, "coordinate")?;
    if numbers.iter().any(|number: &f64| number.is_nan()) {
        return Err(format!("{value} are not {N} numbers"));
    }
    Ok(numbers)
}

/// Numbers of a list, with `null` for "not given"; what is missing at its end is not given either.
fn numbers<const N: usize>(list: &[Value], what: &str) -> Result<[f64; N], String> {
    let mut numbers = [f64::NAN; N];
    if list.len() > N {
        return Err(format!("{what}: {} numbers; expected {N}", list.len()));
    }
    for (number, value) in numbers.iter_mut().zip(list) {
        *number = match value {
            Value::Null => f64::NAN,
            value => value.as_f64().ok_or_else(|| format!("{what}: {value} is no number"))?,
        };
    }
    Ok(numbers)
}

/// Some files have comments (`//` to the end of the line), which JSON does not know.
fn without_comments(text: &str) -> String {
    let (mut kept, mut in_string, mut escaped) = (String::with_capacity(text.len()), false, false);
    for line in text.lines() {
        let mut before = '\0';
        for letter in line.chars() {
            if !in_string && letter == '/' && before == '/' {
                kept.truncate(kept.len() - 1);
                break;
            }
            in_string ^= letter == '"' && !escaped;
            escaped = in_string && letter == '\\' && !escaped;
            kept.push(letter);
            before = if in_string { '\0' } else { letter };
        }
        kept.push('\n');
    }
    kept
}
