//! Texts: scripts of faults and all files in TOML.

use autopilot::config;
use autopilot::parameters::{Parameters, from_text, table, to_text};
use autopilot::run::ConfigFile;
use autopilot::script::Script;
use icd::tvc_jet;
use icd::{Actuators, ControlPeriod};
use plant_sim::{Airframe, Plant, ReadAirframe as _, Scenario};

use super::choices::Choices;

/// Control steps flown with an accepted text.
const STEPS: usize = 3;
/// Replacements for a word.
const WORDS: [&str; 40] = [
    "",
    "0",
    "-1",
    "1e308",
    "-1e-308",
    "nan",
    "inf",
    "9999999999999999999999",
    "0x10",
    "1_000",
    "'x'",
    "\"\"",
    "[]",
    "[[",
    "{}",
    "true",
    "1979-05-27",
    "\u{feff}",
    "\0",
    "\u{202e}",
    "at",
    "when",
    "fail",
    "rudder",
    "left elevator",
    "stuck",
    "30 deg",
    "passes",
    "roll",
    "altitude",
    "5000 m",
    "every",
    "for",
    "then",
    ":",
    "#",
    "\r",
    "=",
    "mend",
    "3 s",
];

const SCENARIOS: [&str; 4] =
    [scenarios::NOMINAL, scenarios::CASE1, scenarios::CASE2, scenarios::CHAIN];
const SCRIPT: &str = "# a flight\nat 1.6 s: fail rudder 50 % left\nat 2 s: altitude 3200 m\n\
    when roll passes 10 deg: fail left elevator stuck at 30 deg\n";
const CONFIG: &str = "[ground_stations]\nclients = [\"127.0.0.1:14550\"]\nudp_server = \"none\"\n";

/// A text in which words, lines or bytes are changed.
fn damaged(seed: &str, choices: &mut Choices) -> String {
    let mut text = seed.to_owned();
    for _ in 0..choices.below(6) {
        text = match choices.below(4) {
            0 | 1 => with_another_word(&text, choices),
            2 => with_other_lines(&text, choices),
            _ => {
                let mut bytes = text.into_bytes();
                choices.damage(&mut bytes);
                String::from_utf8_lossy(&bytes).into_owned()
            }
        };
    }
    text
}

/// Replaces one of the words; numbers are words.
fn with_another_word(text: &str, choices: &mut Choices) -> String {
    let is_word = |c: char| c.is_alphanumeric() || "._-+".contains(c);
    let mut begins: Vec<usize> = Vec::new();
    let mut before = false;
    for (at, c) in text.char_indices() {
        if is_word(c) && !before {
            begins.push(at);
        }
        before = is_word(c);
    }
    if begins.is_empty() {
        return (*choices.one_of(&WORDS)).to_owned();
    }
    let begin = *choices.one_of(&begins);
    let rest = &text[begin..];
    let end = begin + rest.find(|c| !is_word(c)).unwrap_or(rest.len());
    format!("{}{}{}", &text[..begin], choices.one_of(&WORDS), &text[end..])
}

/// Removes, repeats or moves lines.
fn with_other_lines(text: &str, choices: &mut Choices) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.is_empty() {
        return String::new();
    }
    let (from, to) = (choices.below(lines.len()), choices.below(lines.len()));
    match choices.below(3) {
        0 => drop(lines.remove(from)),
        1 => lines.insert(to, lines[from]),
        _ => lines.swap(from, to),
    }
    lines.join("\n")
}

#[test]
fn scripts() {
    bolero::check!().for_each(|input: &[u8]| {
        let mut choices = Choices::new(input);
        let text = damaged(SCRIPT, &mut choices);
        if let Err(error) = Script::parse("a script", &text, &tvc_jet::effectors()) {
            assert!(!error.to_string().is_empty());
        }
    });
}

/// Flies an accepted text for a few steps.
fn fly(scenario: &Scenario, airframe: Airframe) {
    let setup = scenario.plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
    let Ok(mut plant) = Plant::new(&setup) else { return };
    for _ in 0..STEPS {
        plant.sense();
        plant.advance(&Actuators::default());
        while plant.pop_report().is_some() {}
    }
}

#[test]
fn toml_scenarios() {
    bolero::check!().for_each(|input: &[u8]| {
        let mut choices = Choices::new(input);
        let seed = SCENARIOS[choices.below(SCENARIOS.len())];
        let text = damaged(seed, &mut choices);
        if let Ok(scenario) = Scenario::from_toml("scenario", &text, &tvc_jet::effectors()) {
            fly(&scenario, Airframe::paper());
        }
        // The autopilot's part; any error in it is reported as an error.
        let _ = config::references("scenario", &text);
        let _ = config::script("scenario", &text, &tvc_jet::effectors());
    });
}

#[test]
fn toml_airframes() {
    let nominal = Scenario::from_toml("nominal", SCENARIOS[0], &tvc_jet::effectors()).unwrap();
    bolero::check!().for_each(|input: &[u8]| {
        let mut choices = Choices::new(input);
        let text = damaged(aircraft::DEFAULT_AIRFRAME, &mut choices);
        if let Ok(airframe) = Airframe::from_toml("airframe", &text) {
            fly(&nominal, airframe);
        }
    });
}

/// Parameters, each of which may differ slightly from its default.
fn changed_parameters() -> Parameters {
    let mut parameters = Parameters::default();
    for row in table() {
        let value = row.default_value();
        // Where a value is not allowed, or inconsistent with the others, the default stays.
        let _ = parameters.set(row.name, if value == 0.0 { 1.0 } else { value * 0.9 });
    }
    parameters
}

/// The controller's model, the autopilot's settings and the saved parameters.
#[test]
fn toml_of_the_autopilot() {
    let parameters = to_text(&changed_parameters(), &Parameters::default());
    bolero::check!().for_each(|input: &[u8]| {
        let mut choices = Choices::new(input);
        // Any invalid text gives an error.
        match choices.below(3) {
            0 => drop(config::aircraft_model(
                "model",
                &damaged(aircraft::DEFAULT_MODEL, &mut choices),
            )),
            1 => drop(ConfigFile::from_toml("settings", &damaged(CONFIG, &mut choices))),
            _ => {
                let read = from_text(
                    "parameters",
                    &damaged(&parameters, &mut choices),
                    &Parameters::default(),
                );
                if let Ok(read) = read {
                    assert_eq!(read.check(), Ok(()), "what was read is in range");
                }
            }
        }
    });
}
