//! The jams of a campaign against the physical limit: which of them leave a steady flight, and what share of these each law
//! survives.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use host_io::file::{self, TEXT_MAX};
use host_io::problem::{Problem, problem};
use icd::EffectorList;
use lab_judges::metrics::wilson_95;
use lab_studies::trimmable::sets::{self, Set};
use lab_studies::trimmable::{Study, Sweep};
use lab_tables::{Table, cells, table};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::plan::{Aircraft, Plan, Value};
use crate::results::Results;
use crate::store::{PROGRAM, RunEnd, write_new};

/// Step of the search for the limits, deg.
const STEP_DEG: f64 = 2.0;
/// Angles of files are rounded: what is at a limit is within it.
pub(crate) const ROUNDING_DEG: f64 = 1.0e-6;

/// Keys that name the jammed effector and its angle.
const EFFECTOR: &str = "plant.fault.1.effector";
const ANGLE: &str = "plant.fault.1.angle_deg";
const KIND: &str = "plant.fault.1.kind";

/// A campaign whose flights each have one effector jammed at an angle.
#[derive(Debug, Clone, Copy)]
pub struct Jams {
    /// Place of the variable; `None` where every flight has the effector of `[set]`.
    effector: Option<usize>,
    angle: usize,
}

impl Jams {
    /// `None` if the campaign is of another kind, or draws the angles: then it has no cells.
    pub fn of(plan: &Plan) -> Option<Self> {
        let place = |key| plan.variables().iter().position(|variable| variable.key == key);
        let has = |key, value: Option<&str>| {
            let known = |aircraft| setting(aircraft, key);
            plan.aircraft
                .iter()
                .map(known)
                .all(|at| at.is_some() && (value.is_none() || at == value))
        };
        let is_jam = has(KIND, Some("stuck_at"));
        let is_single = plan.file.spec.joint.is_empty()
            && !plan.variables().iter().any(|v| v.key.starts_with("plant.fault.2"));
        let (effector, angle) = (place(EFFECTOR), place(ANGLE)?);
        let is_listed = !plan.variables()[angle].is_drawn();
        let is_known = effector.is_some() || has(EFFECTOR, None);
        let is_it = is_jam && is_single && is_listed && is_known && place(KIND).is_none();
        is_it.then_some(Self { effector, angle })
    }

    /// Key of the jammed effector of a flight, and its angle, deg.
    pub fn jam(self, plan: &Plan, flight: usize) -> Option<(String, f64)> {
        let run = plan.run(flight as u64 * plan.laws().len() as u64).ok()?;
        let effector = match self.effector.map(|place| run.values.get(place)) {
            None => setting(&plan.aircraft[run.airframe], EFFECTOR)?,
            Some(Some(Value::Text(effector))) => effector,
            Some(_) => return None,
        };
        Some((effector.to_owned(), run.values.get(self.angle)?.number()?))
    }

    /// Whether a variable is neither the effector nor the angle.
    pub fn is_other(self, place: usize) -> bool {
        Some(place) != self.effector && place != self.angle
    }
}

/// A text that every flight of an aircraft has; of several the last counts.
fn setting<'a>(aircraft: &'a Aircraft, key: &str) -> Option<&'a str> {
    let settings = &aircraft.args.settings;
    settings.iter().rfind(|setting| setting.key == key)?.value.as_str()
}

/// The limits of an aircraft.
#[derive(Debug)]
pub struct PhysicsLimits {
    /// The sets of steady flights.
    pub sets: Vec<Set>,
    found: Vec<JamLimit>,
    list: EffectorList,
}

/// The limit of one effector in one set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct JamLimit {
    set: usize,
    margin: bool,
    effector: usize,
    /// Largest jams to either side, rad or N.
    range: Option<[f64; 2]>,
}

/// The search takes seconds, so its result stays: in the folder of the campaign, and for others of this process, as those of a suite.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct KnownLimits {
    /// Of the aircraft, the sets, the step and the program.
    sha256: String,
    limits: Vec<JamLimit>,
}

static KEPT: Mutex<Vec<KnownLimits>> = Mutex::new(Vec::new());

impl KnownLimits {
    /// From this process, else from the file; a file that is not whole, or of something else, is as none.
    fn find(sha256: &str, path: &Path) -> Option<Self> {
        // A thread that panicked has left the list whole.
        let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let here = kept.iter().find(|kept| kept.sha256 == sha256).cloned();
        // The disk is read without the lock.
        drop(kept);
        let read = || serde_json::from_slice(&file::read(path, TEXT_MAX).ok()?).ok();
        here.or_else(read).filter(|kept: &Self| kept.sha256 == sha256)
    }

    fn keep(&self, path: &Path) -> Result<(), Problem> {
        let text = serde_json::to_string(self)?;
        write_new(path, text.as_bytes(), b"{\"sha256\":")?;
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        if !kept.contains(self) {
            kept.push(self.clone());
        }
        Ok(())
    }
}

impl PhysicsLimits {
    /// The limits of the aircraft of a campaign, without what is varied; what was found before is in `folder`.
    pub fn of(plan: &Plan, airframe: usize, folder: &Path) -> Result<Self, Problem> {
        let path = folder.join(format!("limits-{airframe}.json"));
        let airframe = plan.aircraft[airframe].airframe.clone();
        let sets = sets::read("sets.toml", sets::SHIPPED)?;
        let list = airframe.effectors;
        // With the program, whose search may find other limits in another version.
        let of = (serde_json::to_string(&airframe)?, sets::SHIPPED, STEP_DEG, PROGRAM);
        let digest = Sha256::digest(postcard::to_allocvec(&of)?);
        let sha256: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        let found = match KnownLimits::find(&sha256, &path) {
            Some(kept) => kept,
            None => {
                let study = Study::new(airframe, sets.clone());
                let sweeps = study.map_err(|error| problem!("{error}"))?.singles(STEP_DEG);
                let limit = |Sweep { set, margin, effector, limits: range, .. }| JamLimit {
                    set,
                    margin,
                    effector,
                    range,
                };
                let limits = sweeps.into_iter().map(limit).collect();
                KnownLimits { sha256, limits }
            }
        };
        // Also what another campaign of this process has found, for the next start here.
        found.keep(&path)?;
        Ok(Self { sets, found: found.limits, list })
    }

    /// Smallest and largest angle at which an effector leaves a steady flight of a set, deg.
    pub fn range_deg(&self, set: usize, margin: bool, effector: &str) -> Option<[f64; 2]> {
        let effector = self.list.by_key(effector)?.index();
        let is_it = |s: &&JamLimit| s.set == set && s.margin == margin && s.effector == effector;
        Some(self.found.iter().find(is_it)?.range?.map(f64::to_degrees))
    }
}

/// Share of the trimmable jams that a law survives.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Place of the aircraft.
    pub airframe: usize,
    /// Place of the law.
    pub law: usize,
    /// Place of the set.
    pub set: usize,
    /// With a tenth of the authority left.
    pub margin: bool,
    /// Flights whose jam leaves a steady flight of the set.
    pub flights: u32,
    /// Of these, kept ones.
    pub kept: u32,
}

impl Score {
    /// The share, percent; `None` of no flight.
    pub fn percent(&self) -> Option<f64> {
        (self.flights > 0).then(|| 100.0 * f64::from(self.kept) / f64::from(self.flights))
    }
}

/// An aircraft of the campaign with what was found.
#[derive(Debug)]
pub struct Studied {
    /// The physical limit, where the campaign is of jams and there is one.
    pub limits: Option<PhysicsLimits>,
    /// Share of the trimmable jams that each law survives.
    pub scores: Vec<Score>,
}

/// The scores of every law of an aircraft.
pub fn scores(
    plan: &Plan,
    results: &Results,
    jams: Jams,
    limits: &PhysicsLimits,
    airframe: usize,
) -> Vec<Score> {
    let mut scores = Vec::new();
    let flights: Vec<_> = plan
        .flights_of(airframe)
        .filter_map(|flight| Some((flight, jams.jam(plan, flight)?)))
        .collect();
    for set in 0..limits.sets.len() {
        for margin in [false, true] {
            let is_trimmable = |(effector, deg): &(String, f64)| {
                limits.range_deg(set, margin, effector).is_some_and(|[low, high]| {
                    (low - ROUNDING_DEG..=high + ROUNDING_DEG).contains(deg)
                })
            };
            let counted: Vec<usize> =
                flights.iter().filter(|(_, jam)| is_trimmable(jam)).map(|(f, _)| *f).collect();
            for law in 0..plan.laws().len() {
                let kept = counted.iter().filter(|f| results.end(**f, law) == RunEnd::Kept).count();
                let [flights, kept] =
                    [counted.len(), kept].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
                scores.push(Score { airframe, law, set, margin, flights, kept });
            }
        }
    }
    scores
}

pub fn table(plan: &Plan, studied: &[Studied]) -> Table {
    let mut table = table!("scores",
        airframe: Text, law: Text, set: Text, margin: Integer, trimmable_flights: Integer,
        kept: Integer, kept_percent: Number, kept_low_percent: Number, kept_high_percent: Number);
    for Studied { limits, scores } in studied {
        let sets = limits.as_ref().map_or(&[][..], |limits| &limits.sets);
        for score in scores {
            let Score { airframe, law, set, margin, flights, kept } = score;
            let (name, law) = (&plan.aircraft[*airframe].name, plan.laws()[*law]);
            let mut row = cells![name, law, &sets[*set].key, *margin, *flights, *kept];
            let (low, high) = wilson_95(*kept, *flights);
            let percent = |part: f64| (*flights > 0).then_some(100.0 * part);
            row.extend(cells![score.percent(), percent(low), percent(high)]);
            table.rows.push(row);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_that_were_found_are_read_again_and_damaged_or_other_ones_are_not() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("limits-0.json");
        let limits = vec![JamLimit { set: 1, margin: true, effector: 2, range: Some([-0.1, 0.3]) }];
        let kept = KnownLimits { sha256: "a".repeat(64), limits };
        kept.keep(&path).unwrap();
        KEPT.lock().unwrap().clear();
        assert_eq!(KnownLimits::find(&kept.sha256, &path), Some(kept.clone()));
        assert_eq!(KnownLimits::find("b", &path), None);
        let whole = std::fs::read(&path).unwrap();
        for end in 0..whole.len() {
            std::fs::write(&path, &whole[..end]).unwrap();
            assert_eq!(KnownLimits::find(&kept.sha256, &path), None, "{end} bytes");
        }
    }
    use crate::spec::SpecFile;

    #[test]
    fn a_campaign_with_one_effector_is_one_of_jams_unless_its_angles_are_drawn() {
        let plan = |name| Plan::new(SpecFile::read(name).expect("it is shipped")).expect("a plan");
        let rudder = plan("ftc-06");
        let jams = Jams::of(&rudder).expect("jams of the rudder");
        assert_eq!(jams.jam(&rudder, 0), Some(("rudder".to_owned(), -20.0)));
        assert!(Jams::of(&plan("jams")).is_some() && Jams::of(&plan("smoke")).is_none());
    }

    #[test]
    fn a_share_of_no_flight_is_an_empty_cell() {
        let plan = Plan::new(SpecFile::read("ftc-06").expect("it is shipped")).expect("a plan");
        let set = sets::read("sets.toml", sets::SHIPPED).expect("the sets");
        let limits =
            Some(PhysicsLimits { sets: set, found: Vec::new(), list: EffectorList::default() });
        let none = Score { airframe: 0, law: 0, set: 0, margin: false, flights: 0, kept: 0 };
        let csv = table(&plan, &[Studied { limits, scores: vec![none] }]).csv();
        assert!(csv.ends_with(",straight_level,0,0,0,,,\n"), "{csv}");
    }
}
