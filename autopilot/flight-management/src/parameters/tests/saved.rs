use crate::TextError;
use crate::parameters::*;

fn to_text(parameters: &Parameters) -> String {
    crate::parameters::to_text(parameters, &Parameters::default())
}

fn from_text(file: &str, text: &str) -> Result<Parameters, TextError> {
    crate::parameters::from_text(file, text, &Parameters::default())
}

#[test]
fn the_defaults_are_a_text_without_values_and_come_back() {
    let text = to_text(&Parameters::default());
    assert!(text.lines().all(|line| line.starts_with('#')), "{text}");
    assert_eq!(from_text("f", &text), Ok(Parameters::default()));
    assert_eq!(from_text("f", ""), Ok(Parameters::default()));
}

#[test]
fn every_parameter_comes_back_to_the_bit() {
    for row in table() {
        for value in [row.min, row.max, 0.3 * row.min + 0.7 * row.max] {
            let mut parameters = Parameters::default();
            if parameters.set(row.name, value).is_ok() {
                let back = from_text("f", &to_text(&parameters)).unwrap();
                let (back, value) = (row.value(&back), row.value(&parameters));
                assert_eq!(back.to_bits(), value.to_bits(), "{} = {value}", row.name);
            }
        }
    }
}

#[test]
fn limits_that_move_together_come_back_in_any_order() {
    let mut parameters = Parameters::default();
    parameters.set_all([("FW_AIRSPD_MIN", 330.0), ("FW_AIRSPD_MAX", 400.0)]).unwrap();
    let text = to_text(&parameters);
    assert_eq!(from_text("f", &text), Ok(parameters));
    let reversed: Vec<&str> = text.lines().rev().collect();
    assert_eq!(from_text("f", &reversed.join("\n")), Ok(parameters));
}

#[test]
fn a_damaged_text_names_file_key_value_and_range() {
    for (text, words) in [
        ("OBS_W0 = -1", "p.toml: OBS_W0 = -1 is outside 1 to 500 rad/s"),
        ("OBS_W0 = nan", "OBS_W0 = NaN is outside"),
        ("OBS_W0 = 99999999999999", "OBS_W0 = inf is outside"),
        ("OBS_W0 = \"40\"", "OBS_W0 = \"40\" is not a number"),
        ("NOPE = 1", "there is no parameter NOPE"),
        ("SYS_AUTOSTART = 1", "SYS_AUTOSTART is read-only"),
        ("FW_AIRSPD_MIN = 400", "FW_AIRSPD_MIN = 400 m/s is above FW_AIRSPD_MAX = 280 m/s"),
        ("OBS_W0 = 40\nOBS_W0 = 41", "line 2 (OBS_W0 = 41): duplicate key"),
        ("OBS_W0 = 40\nOBS_", "line 2 (OBS_): "),
    ] {
        let message = from_text("p.toml", text).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
        assert!(message.starts_with("p.toml: ") && message.contains("--parameter-file none"));
    }
}
