//! `param`: the parameters as the parameter protocol has them. A value is set by the same way as PARAM_SET.

use std::fmt::Write as _;

use super::{Answer, Asking, Order, usage};
use crate::param::{Row, rows};
use flight_management::parameters::{FAULT_CHOICES, Kind, is_fault, table};

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    match arguments {
        ["show"] => show("*", asking),
        ["show", pattern] => show(pattern, asking),
        ["get", name] => get(name, asking),
        ["set", name, value] => set(name, value, asking),
        _ => Err(usage("param")),
    }
}

fn show(pattern: &str, asking: &Asking) -> Answer {
    let pattern = pattern.to_ascii_uppercase();
    let mut said = String::new();
    for row in rows(asking.ctx).filter(|row| matches(&pattern, &row.name)) {
        let line = format!("{:<16} {:>12} {}", row.name, value_text(&row), unit(&row));
        let _ = writeln!(said, "{}", line.trim_end());
    }
    if said.is_empty() {
        return Err(format!("no parameter has a name like {pattern}"));
    }
    Ok(Order::say(said))
}

fn get(name: &str, asking: &Asking) -> Answer {
    let row = find(name, asking)?;
    let mut said =
        format!("{} {} {}", row.name, value_text(&row), unit(&row)).trim_end().to_owned();
    said.push('\n');
    if let Some(about) = table().iter().find(|about| *about.name == *row.name) {
        let _ = writeln!(said, "{} ({} to {})", about.meaning, about.min, about.max);
        for choice in about.choices {
            let _ = writeln!(said, "  {} {}", choice.value, choice.label);
        }
    } else if is_fault(&row.name) {
        said.push_str("What acts on an effector; here the command failure breaks and mends it\n");
        for choice in &FAULT_CHOICES {
            let _ = writeln!(said, "  {} {}", choice.value, choice.label);
        }
    } else {
        said.push_str("For ground stations that expect it; it cannot be changed\n");
    }
    Ok(Order::say(said))
}

fn set(name: &str, value: &str, asking: &mut Asking) -> Answer {
    let row = find(name, asking)?;
    if is_fault(&row.name) {
        return Err(format!("{} is not set here: see help failure", row.name));
    }
    let number: Option<f64> = value.parse().ok();
    let number = number
        .filter(|number| number.is_finite())
        .ok_or_else(|| format!("\"{value}\" is no number"))?;
    let Asking { now, ctx, param, out, .. } = asking;
    param.write(&row, number, *now, ctx, out)?;
    let now = find(&row.name, asking)?;
    Ok(Order::say(format!("{} {} -> {}\n", row.name, value_text(&row), value_text(&now))))
}

fn find(name: &str, asking: &Asking) -> Result<Row, String> {
    let found = rows(asking.ctx).find(|row| row.name.eq_ignore_ascii_case(name));
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
        // The first place is the best: it leaves the most for what follows.
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
