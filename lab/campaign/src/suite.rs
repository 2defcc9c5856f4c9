//! `sitl campaign suite`: FTC-1 to FTC-12 with every law, and the table of what each law lost.

use host_io::{print_line, print_text};
use std::fmt::Write as _;
use std::path::Path;

use crate::fly;
use crate::plan::Plan;
use crate::spec::SpecFile;
use crate::store::RunStore;
use crate::summary::Group;
use autopilot::own_law::OwnLaw;
use host_io::folder::OutFolder;
use host_io::problem::Problem;
use lab_engine::configuration::AircraftArgs;
use studies::SUITE;

/// Name of the table.
const TABLE: &str = "suite.md";

/// Flies the suite with this aircraft or these settings besides its own and with the laws that the program brings, each campaign in a folder of
/// its own, and writes the table.
pub fn run(folder: &Path, aircraft: &AircraftArgs, own: &[OwnLaw]) -> Result<(), Problem> {
    let mut flown = Vec::new();
    for (name, plan) in plans(aircraft, own)? {
        print_line!("{}", plan.file.spec.name);
        let store = RunStore::open(&plan, &folder.join(name))?;
        // How many were flown just now does not matter.
        let _ = fly::fly(&plan, &store, None)?;
        let groups = crate::write(&plan, &store)?;
        flown.push(FlownCampaign { name, plan, groups });
    }
    let text = table(&flown);
    OutFolder::create(folder)?.write_markdown(TABLE, &text)?;
    print_text!("{text}");
    print_line!("wrote {}", folder.join(TABLE).display());
    Ok(())
}

/// A campaign of the suite that was flown.
struct FlownCampaign {
    name: &'static str,
    plan: Plan,
    groups: Vec<Group>,
}

/// The campaigns, all planned before the first one flies. Those that another aircraft cannot fly are left out, which is said.
fn plans(aircraft: &AircraftArgs, own: &[OwnLaw]) -> Result<Vec<(&'static str, Plan)>, Problem> {
    let plan = |name| Plan::new(SpecFile::read_with(name, own, aircraft)?);
    let planned: Vec<_> = SUITE.iter().map(|(name, _)| (*name, plan(name))).collect();
    let is_any = aircraft.airframe.is_some() && planned.iter().any(|(_, plan)| plan.is_ok());
    let mut plans = Vec::new();
    for (name, plan) in planned {
        match plan {
            Ok(plan) => plans.push((name, plan)),
            Err(problem) if is_any => print_line!("{name} is left out: {problem}"),
            Err(problem) => return Err(problem),
        }
    }
    Ok(plans)
}

/// Losses of every law in every campaign, and the medians of the first measure of each.
fn table(flown: &[FlownCampaign]) -> String {
    let mut text = "Flights lost:\n\n".to_owned();
    let flights = |_: &Plan, groups: &[Group]| {
        let flights = groups.first().map_or(0, |group| group.flown + group.failed);
        format!("of {flights}")
    };
    push_table(&mut text, flown, flights, |group| {
        // Of flights that could not begin nothing was lost.
        let flown = group.filter(|group| group.flown > 0);
        flown.map_or_else(|| "-".to_owned(), |group| group.lost.to_string())
    });
    text.push_str("\nMedian of the first measure of each, over the flights that were kept:\n\n");
    let measure = |plan: &Plan, _: &[Group]| {
        let name = plan.file.spec.measures.first().map_or("", String::as_str);
        format!("`{name}`, {}", plan.unit_of(name))
    };
    push_table(&mut text, flown, measure, |group| {
        let median = group.and_then(|group| group.medians.first().copied().flatten());
        median.map_or_else(|| "-".to_owned(), |median| format!("{median:.3}"))
    });
    text
}

/// A table with a column for each campaign and a row for each law.
fn push_table(
    text: &mut String,
    flown: &[FlownCampaign],
    about: impl Fn(&Plan, &[Group]) -> String,
    cell: impl Fn(Option<&Group>) -> String,
) {
    text.push_str("| law |");
    for FlownCampaign { name, plan, groups } in flown {
        let number = name.trim_start_matches("ftc-").trim_start_matches('0');
        let _ = write!(text, " FTC-{number} {} |", about(plan, groups));
    }
    let _ = write!(text, "\n|---|{}\n", "---|".repeat(flown.len()));
    let laws: Vec<&str> = flown.first().map_or_else(Vec::new, |first| first.plan.laws());
    for (law, name) in laws.iter().enumerate() {
        let _ = write!(text, "| {name} |");
        for FlownCampaign { groups, .. } in flown {
            let _ = write!(text, " {} |", cell(groups.get(law)));
        }
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_planned_first_and_what_another_aircraft_cannot_fly_is_left_out() {
        let args = AircraftArgs::default();
        assert_eq!(plans(&args, &[]).unwrap().len(), SUITE.len());
        let args = AircraftArgs { airframe: Some("aerosonde".into()), ..args };
        let names: Vec<&str> = plans(&args, &[]).unwrap().iter().map(|(name, _)| *name).collect();
        assert!(names.contains(&"ftc-06") && !names.contains(&"ftc-10"), "{names:?}");
        let args = AircraftArgs { airframe: Some("nothing.toml".into()), ..args };
        assert!(plans(&args, &[]).is_err());
    }
}
