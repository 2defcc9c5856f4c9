//! The keys that the readers of scenario, airframe and model files know, found by probing the readers
//! ([`plant_sim::config::gather`]).

use std::collections::BTreeSet;
use std::sync::LazyLock;

use autopilot::config::ScenarioFile as AutopilotFile;
use autopilot::parameters::changes;
use flight_control::AircraftModel;
use plant_sim::aerodynamics::Aero;
use plant_sim::airframe_file::AirframeFile;
use plant_sim::config::{ANY, gather};
use plant_sim::scenario::ScenarioFile as PlantFile;
use plant_sim::tables::aerodynamics::TableAero;
use plant_sim::tables::thrust::{Propeller, ThrustTables};

/// Keys of all files; an entry of a list is `N`.
pub fn all() -> &'static BTreeSet<String> {
    static KEYS: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
        let mut keys = BTreeSet::new();
        gather::<PlantFile>("", &mut keys);
        gather::<AutopilotFile>("", &mut keys);
        gather::<AirframeFile<Aero>>("airframe", &mut keys);
        gather::<AirframeFile<TableAero>>("airframe", &mut keys);
        // An enum with a tag shows the search no keys, so its forms are searched one by one.
        gather::<ThrustTables>("airframe.propulsion", &mut keys);
        gather::<Propeller>("airframe.propulsion", &mut keys);
        gather::<AircraftModel>("model", &mut keys);
        keys
    });
    &KEYS
}

/// Whether a reader knows this key.
pub fn is_known(key: &str) -> bool {
    let pattern = pattern(key);
    let any = pattern.rsplit_once('.').map(|(table, _)| format!("{table}.{ANY}"));
    all().contains(&pattern) || any.is_some_and(|any| all().contains(&any))
}

/// A key with its numbers of list entries as `N`.
pub fn pattern(key: &str) -> String {
    let word = |word| if str::parse::<usize>(word).is_ok() { "N" } else { word };
    key.split('.').map(word).collect::<Vec<_>>().join(".")
}

/// Longest key that is compared with those that there are, bytes: twice the longest of them. The time of a comparison grows
/// with the length.
const COMPARED_MAX: usize = 128;

/// The key that looks most like this one: the one with the same last word, or else with the fewest changes of letters. `None`
/// if this one is far longer than any.
pub fn nearest(key: &str, keys: impl Iterator<Item = String>) -> Option<String> {
    if key.len() > COMPARED_MAX {
        return None;
    }
    let last = |key: &str| key.rsplit('.').next().map(str::to_lowercase);
    let rank = |known: &String| {
        let changes = changes(&key.to_lowercase(), &known.to_lowercase());
        (last(known) != last(key), changes)
    };
    // As a key that can be typed.
    keys.filter(|known| !known.ends_with(ANY)).min_by_key(rank).map(|key| key.replace(".N", ".1"))
}
