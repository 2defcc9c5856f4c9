//! The tables as a page: `docs/parameters.md`.

use icd::EffectorList;

use super::{COMPATIBILITY, FAULT_CHOICES, Kind, Parameter, fault_parameters, table};

const OPENING: &str = "\
# Parameters

<!-- Written by `sitl aircraft parameters`; do not edit. -->

Every tunable of the autopilot. A ground station reads and sets them by MAVLink, `--param NAME=VALUE` sets one for a flight. A change acts
at once, but for `MAV_SYS_ID`. A value outside its range is refused; the answer says why and repeats the value that stays. Those marked
`int` are INT32, byte-wise as with PX4; the others are REAL32.

What a ground station sets is kept in a file (`--parameter-file`, by default `two-step/parameters.toml` in the user's data folder), and the
next `sitl` or `autopilot` uses it and says so. The command line wins and is not kept. `sitl study paper`, `sitl study bench` and flights
inside one process never read it.
";

const FAULTS_OPENING: &str = "
## Break an effector

Setting one of these injects a fault as MAV_CMD_INJECT_FAILURE does, with the sizes and times of `FLT_*` above; 0 clears it. The value is the
active fault, else the next one, whoever requested it. They are `int`, begin each flight with 0, are not kept and cannot be set on the
command line. With `SYS_FAILURE_EN` 0 they are refused.

| name | what it breaks |
|---|---|
";

const COMPATIBILITY_OPENING: &str = "
## Compatibility

They have no effect: the heartbeat says PX4, so QGroundControl (4.3 to 5.0, by its source text) and MAVSDK look for these parameters and
warn where one is missing or zero. They are read-only, but for second names of a parameter above.

| name | value | who asks for it, and what the value says |
|---|---|---|
";

pub fn document(effectors: &EffectorList) -> String {
    let mut page = OPENING.to_owned();
    let mut group = "";
    for row in table() {
        if row.group != group {
            group = row.group;
            page += &format!("\n## {group}\n\n| name | range | default | what it does |\n");
            page += "|---|---|---|---|\n";
        }
        page += &line(row);
    }
    page += FAULTS_OPENING;
    for row in fault_parameters(effectors) {
        page += &format!("| `{}` | {} |\n", row.name, row.target.name(effectors));
    }
    page += "\n| value | meaning |\n|---|---|\n";
    for choice in &FAULT_CHOICES {
        page += &format!("| {} | {} |\n", choice.value, choice.label);
    }
    page += COMPATIBILITY_OPENING;
    for row in COMPATIBILITY {
        let label = if row.label.is_empty() { String::new() } else { format!(" {}", row.label) };
        let value = match row.meant() {
            Some(meant) => format!("that of `{}`", meant.name),
            None => row.value.to_string(),
        };
        page +=
            &format!("| `{}` | {value}{label}{} | {} |\n", row.name, mark(row.kind), row.reason);
    }
    page
}

fn line(row: &Parameter) -> String {
    let Parameter { name, unit, min, max, meaning, .. } = row;
    let (int, default) = (mark(row.kind), row.default_value());
    let unit = if *unit == "-" { String::new() } else { format!(" {unit}") };
    let choices = row.choices.iter().map(|choice| format!(" {} {}", choice.value, choice.label));
    let choices: Vec<String> = choices.collect();
    let colon = if choices.is_empty() { "" } else { ":" };
    let meaning = format!("{meaning}{colon}{}", choices.join(";"));
    format!("| `{name}` | {min}…{max}{unit}{int} | {default} | {meaning} |\n")
}

fn mark(kind: Kind) -> &'static str {
    match kind {
        Kind::Int => " int",
        Kind::Real => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;

    #[test]
    fn the_page_in_the_documents_is_the_one_of_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/parameters.md");
        let page = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            page == document(&tvc_jet::effectors()),
            "write it again: sitl aircraft parameters > docs/parameters.md"
        );
    }

    #[test]
    fn every_parameter_stands_on_the_page_once() {
        let page = document(&tvc_jet::effectors());
        let list = tvc_jet::effectors();
        let own = table().iter().map(|row| row.name.to_owned());
        let faults = fault_parameters(&list).map(|row| row.name.to_string());
        let others = COMPATIBILITY.iter().map(|row| row.name.to_owned());
        for name in own.chain(faults).chain(others) {
            assert_eq!(page.matches(&format!("\n| `{name}` |")).count(), 1, "{name}");
        }
    }
}
