//! `param`: the parameters of the parameter protocol, set in the same way as by PARAM_SET.

use std::fmt::Write as _;

use super::{Answer, Output, usage};
use crate::Shared;
use crate::param::{self, Row, rows};
use crate::wall_time::WallTime;
use flight_management::parameters::{FAULT_CHOICES, Kind, is_fault, table};

pub(super) fn run(arguments: &[&str], now: WallTime, shared: &mut Shared) -> Answer {
    match arguments {
        ["show"] => show("*", shared),
        ["show", pattern] => show(pattern, shared),
        ["get", name] => get(name, shared),
        ["set", name, value] => set(name, value, now, shared),
        _ => Err(usage("param")),
    }
}

fn show(pattern: &str, shared: &Shared) -> Answer {
    let pattern = pattern.to_ascii_uppercase();
    let mut text = String::new();
    for row in rows(shared).filter(|row| matches(&pattern, &row.name)) {
        let line = format!("{:<16} {:>12} {}", row.name, value_text(&row), unit(&row));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    if text.is_empty() {
        return Err(format!("no parameter has a name like {pattern}"));
    }
    Ok(Output::text(text))
}

fn get(name: &str, shared: &Shared) -> Answer {
    let row = find(name, shared)?;
    let mut text =
        format!("{} {} {}", row.name, value_text(&row), unit(&row)).trim_end().to_owned();
    text.push('\n');
    if let Some(about) = table().iter().find(|about| *about.name == *row.name) {
        let _ = writeln!(text, "{} ({} to {})", about.meaning, about.min, about.max);
        for choice in about.choices {
            let _ = writeln!(text, "  {} {}", choice.value, choice.label);
        }
    } else if is_fault(&row.name) {
        text.push_str("What acts on an effector; here the command failure breaks and mends it\n");
        for choice in &FAULT_CHOICES {
            let _ = writeln!(text, "  {} {}", choice.value, choice.label);
        }
    } else {
        text.push_str("For ground stations that expect it; it cannot be changed\n");
    }
    Ok(Output::text(text))
}

fn set(name: &str, value: &str, now: WallTime, shared: &mut Shared) -> Answer {
    let row = find(name, shared)?;
    if is_fault(&row.name) {
        return Err(format!("{} is not set here: see help failure", row.name));
    }
    let number: Option<f64> = value.parse().ok();
    let number = number
        .filter(|number| number.is_finite())
        .ok_or_else(|| format!("\"{value}\" is no number"))?;
    param::write(&row, number, now, shared)?;
    let new = find(&row.name, shared)?;
    Ok(Output::text(format!("{} {} -> {}\n", row.name, value_text(&row), value_text(&new))))
}

fn find(name: &str, shared: &Shared) -> Result<Row, String> {
    let found = rows(shared).find(|row| row.name.eq_ignore_ascii_case(name));
    found.ok_or_else(|| format!("there is no parameter {name}"))
}

fn value_text(row: &Row) -> String {
    match row.kind {
        Kind::Int => format!("{:.0}", row.value),
        Kind::Real => row.value.to_string(),
    }
}

fn unit(row: &Row) -> &'static str {
    let about = table().iter().find(|about| *about.name == *row.name);
    about.map_or("", |about| about.unit).trim_matches('-')
}

/// Whether a name fits a pattern, where `*` stands for any letters.
fn matches(pattern: &str, name: &str) -> bool {
    let Some((head, tail)) = pattern.split_once('*') else { return pattern == name };
    let Some(mut rest) = name.strip_prefix(head) else { return false };
    let mut parts: Vec<&str> = tail.split('*').collect();
    let last = parts.pop().unwrap_or_default();
    for part in parts {
        // The first match is the best: it leaves the most for the rest.
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_any_letters() {
        for (pattern, name) in [
            ("*", "FTC_MODE"),
            ("FTC*", "FTC_MODE"),
            ("*MODE", "FTC_MODE"),
            ("F*_M*E", "FTC_MODE"),
            ("FTC_MODE", "FTC_MODE"),
            ("FTC_MODE*", "FTC_MODE"),
            ("**", "FTC_MODE"),
        ] {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [
            ("FTC", "FTC_MODE"),
            ("MODE*", "FTC_MODE"),
            ("*FTC", "FTC_MODE"),
            ("FTC_MODE*E", "FTC_MODE"),
            ("", "FTC_MODE"),
        ] {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }
}
