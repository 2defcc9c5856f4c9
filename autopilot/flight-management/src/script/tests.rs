use super::*;
use icd::tvc_jet;

mod language;
mod running;

/// The script of a valid text.
fn script(text: &str) -> Script {
    Script::parse("s.txt", text, &tvc_jet::effectors()).unwrap_or_else(|error| panic!("{error}"))
}

/// The error of an invalid text.
fn error(text: &str) -> String {
    Script::parse("s.txt", text, &tvc_jet::effectors()).unwrap_err().to_string()
}
