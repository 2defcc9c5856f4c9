//! The sets of steady flights: what the file of bounds says.

use plant_sim::start::Start;
use serde::Deserialize;

use host_io::problem::{At as _, Problem, problem};
use lab_judges::steady::{FlightBounds, Interval};

/// The sets that come with the program.
pub const SHIPPED: &str = include_str!("sets.toml");

/// A set of steady flights.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// Name in tables, one word.
    pub key: String,
    pub name: String,
    angle_of_attack_deg: [f64; 2],
    sideslip_deg: [f64; 2],
    bank_deg: [f64; 2],
    climb_deg: [f64; 2],
    turn_rate_deg_s: [f64; 2],
    airspeed_ratio: [f64; 2],
    /// Of the range of the engine.
    pub thrust_part: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SetsFile {
    set: Vec<Set>,
}

/// Reads a file of sets; `file` stands for it in messages.
pub fn read(file: &str, text: &str) -> Result<Vec<Set>, Problem> {
    let SetsFile { set: sets } = toml::from_str(text).at(file)?;
    if sets.is_empty() {
        return Err(problem!("{file}: expected at least one [[set]]"));
    }
    for (place, set) in sets.iter().enumerate() {
        let key = &set.key;
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let is_new = sets[..place].iter().all(|other| other.key != *key);
        if key.is_empty() || !key.chars().all(is_word) || !is_new {
            return Err(problem!(
                "{file}: the key {key:?} of a set: expected letters, digits and _, and each key once"
            ));
        }
        for (pair, [low, high], [min, max]) in set.pairs() {
            if !(min <= low && low <= high && high <= max) {
                return Err(problem!(
                    "{file}: set {key}, {pair} = [{low}, {high}]: expected two numbers in rising order from {min} to {max}"
                ));
            }
        }
    }
    Ok(sets)
}

impl Set {
    /// Every pair with its key and what it may be.
    fn pairs(&self) -> [(&'static str, [f64; 2], [f64; 2]); 7] {
        [
            ("angle_of_attack_deg", self.angle_of_attack_deg, [-90.0, 90.0]),
            ("sideslip_deg", self.sideslip_deg, [-90.0, 90.0]),
            ("bank_deg", self.bank_deg, [-85.0, 85.0]),
            ("climb_deg", self.climb_deg, [-60.0, 60.0]),
            ("turn_rate_deg_s", self.turn_rate_deg_s, [-180.0, 180.0]),
            ("airspeed_ratio", self.airspeed_ratio, [0.1, 10.0]),
            ("thrust_part", self.thrust_part, [0.0, 1.0]),
        ]
    }

    /// The bounds at a design point.
    pub fn bounds(&self, design: &Start) -> FlightBounds {
        let angle = |[low, high]: [f64; 2]| Interval::new(low.to_radians(), high.to_radians());
        let [slow, fast] = self.airspeed_ratio.map(|ratio| ratio * design.airspeed_m_s);
        FlightBounds {
            alpha: angle(self.angle_of_attack_deg),
            beta: angle(self.sideslip_deg),
            bank: angle(self.bank_deg),
            climb: angle(self.climb_deg),
            airspeed: Interval::new(slow, fast),
            turn_rate: angle(self.turn_rate_deg_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sets_of_the_program_are_read() {
        let keys: Vec<String> =
            read("sets.toml", SHIPPED).unwrap().into_iter().map(|set| set.key).collect();
        assert_eq!(keys, ["straight_level", "straight", "bank_15", "any"]);
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_key_and_range() {
        let refusal = |from: &str, to: &str| {
            read("s.toml", &SHIPPED.replacen(from, to, 1)).unwrap_err().to_string()
        };
        let swapped = refusal("[-45.0, 45.0]", "[45.0, -45.0]");
        assert!(swapped.contains("straight_level, bank_deg = [45, -45]"), "{swapped}");
        assert!(refusal("[0.0, 1.0]", "[0.0, nan]").contains("thrust_part"));
        assert!(refusal("\"straight\"", "\"any\"").contains("any"));
        assert!(refusal("bank_deg", "banks_deg").contains("banks_deg"));
        assert!(read("s.toml", "set = []").unwrap_err().to_string().contains("[[set]]"));
    }
}
