use super::*;
use icd::tvc_jet;

mod language;
mod running;

/// The script of a text, which must be one.
fn script(text: &str) -> Script {
    Script::parse("s.txt", text, &tvc_jet::effectors()).unwrap_or_else(|error| panic!("{error}"))
}

/// What is wrong with a text.
fn error(text: &str) -> String {
    Script::parse("s.txt", text, &tvc_jet::effectors()).unwrap_err().to_string()
}
