//! Every two effectors jammed, each pair flown without and with the verdict in use: which aircraft does it lose, which does it keep?

use std::fmt::Write as _;

use flight_control::CompensatorMode;
use icd::units::DEG;
use icd::{Effector, EffectorList};
use plant_sim::{GradeName, Scenario};

use super::flights::{Outcome, fly_each, references};
use super::{Options, VARIANTS, Variant};
use crate::false_alarms::flights::{Air, conditions, setup};
use crate::problem::Problem;
use crate::runner;
use crate::study::{Sides, draws};

/// The law beyond the paper, without and with the use of the verdict.
pub const COMPARED: [Variant; 2] = [VARIANTS[1], VARIANTS[2]];
/// The jams begin at this time, s.
const ONSET_S: [f64; 2] = [4.0, 20.0];
/// In half of the flights the second effector jams later, by up to this time, s.
const LATER_S: f64 = 5.0;
/// A flight ends this long after the first jam, s.
const AFTER_S: f64 = 30.0;
/// The same of the travel of each effector.
const PART: [f64; 2] = [0.2, 1.0];
/// Signs of the two angles.
const SIGNS: [[f64; 2]; 4] = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];

/// Every two angles of an aircraft.
fn of_two(list: &EffectorList) -> Vec<[Effector; 2]> {
    let angles: Vec<Effector> = list.all().filter(|effector| list.is_angle(*effector)).collect();
    let with = |(place, one): (usize, &Effector)| {
        let one = *one;
        angles[place + 1..].iter().map(move |other| [one, *other]).collect::<Vec<_>>()
    };
    angles.iter().enumerate().flat_map(with).collect()
}

/// Flies `options.pairs` pairs, on the aircraft of the study and on that of the paper by turns.
pub fn fly(options: &Options, sides: &Sides) -> Result<Vec<[Outcome; COMPARED.len()]>, Problem> {
    let paper = options.study.sides(CompensatorMode::Armed, &[])?;
    let is_given = options.study.flight.aircraft.airframe.is_some();
    let both = if is_given { [sides; 2] } else { [sides, &paper] };
    let numbers: Vec<u32> = (0..options.pairs).collect();
    let one = |number: &u32| fly_pair(options, both, *number);
    runner::try_map("pairs of jams", &numbers, one)
}

fn fly_pair(
    options: &Options,
    both: [&Sides; 2],
    number: u32,
) -> Result<[Outcome; COMPARED.len()], Problem> {
    // Other air than that of the other flights.
    let seed = options.seed.wrapping_add(1 << 33).wrapping_add(u64::from(number));
    let mut between = draws(seed, *b"------two-step iso pairs");
    let mut coin = || between(0.0, 1.0) < 0.5;
    let (is_later, is_calm, is_tactical) = (coin(), coin(), coin() && coin());
    let sides = both[usize::from(coin())];
    let airframe = sides.airframe();
    let number = number as usize;
    let pairs = of_two(&airframe.effectors);
    let pair = pairs[number % pairs.len()];
    let signs = SIGNS[number / pairs.len() % SIGNS.len()];
    let conditions = conditions(&[], &sides.scale());
    let condition =
        &conditions[(between(0.0, conditions.len() as f64) as usize).min(conditions.len() - 1)];
    let onset_s = (between(ONSET_S[0], ONSET_S[1]) * 1.0e3).round() / 1.0e3;
    let later_s = if is_later { (between(0.0, LATER_S) * 1.0e3).round() / 1.0e3 } else { 0.0 };
    let (mut tables, mut line) = (String::new(), String::new());
    for (place, effector) in pair.into_iter().enumerate() {
        let [min, max] = [airframe.servos[effector].min, airframe.servos[effector].max];
        let end = if signs[place] < 0.0 { min } else { max };
        let angle_deg = between(PART[0], PART[1]) * end / DEG;
        let (key, at_s) = (airframe.effectors.key(effector), onset_s + later_s * place as f64);
        // Writing to a string cannot fail.
        let _ = writeln!(
            tables,
            "[[plant.fault]]\neffector = \"{key}\"\nonset_s = {at_s:.3}\nkind = \"stuck_at\"\nangle_deg = {angle_deg:.2}"
        );
        let _ = write!(line, "{key} {angle_deg:.2} deg at {at_s:.3} s; ");
    }
    let references = references(condition, onset_s, &mut between);
    let turbulence_m_s = if is_calm { 0.0 } else { between(0.0, options.turbulence_m_s) };
    let grade = if is_tactical { GradeName::Tactical } else { GradeName::Ideal };
    let air = Air { grade, turbulence_m_s, ..options.air() };
    let mut setup = setup(&air, sides, condition, seed, &references, onset_s + AFTER_S)?;
    let _ = write!(
        line,
        "{}, {:.0} m, {:.0} m/s, turbulence {turbulence_m_s:.2} m/s, {} sensors",
        airframe.name,
        condition.altitude_m,
        condition.airspeed_m_s,
        grade.key()
    );
    let text = format!("[plant]\nseed = {seed}\n{tables}");
    setup.plant.faults = Scenario::from_toml("the study", &text, &airframe.effectors)?.plant.faults;
    let class = number % pairs.len();
    let start = Outcome { class, seed, fault: line, ..Outcome::default() };
    fly_each(&setup, &COMPARED, pair.map(Some), onset_s, &start)
}
