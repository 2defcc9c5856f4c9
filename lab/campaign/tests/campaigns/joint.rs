//! Keys that are varied together, and the curves over their level.

use std::path::PathBuf;

use lab_campaign::plan::{Plan, Run};
use lab_campaign::results::Results;
use lab_campaign::spec::SpecFile;
use lab_campaign::store::{RunEnd, RunStore};
use lab_campaign::{curves, fly};

const SPEC: &str = r#"
name = "joint"
duration_s = 4.0
scenario = "nominal"
samples = 6
measures = ["peak_roll_rate"]

[set]
"plant.fault.1.kind" = "stuck_at"
"plant.fault.1.effector" = "rudder"
"plant.fault.1.angle_deg" = 14.0
"plant.fault.1.onset_s" = 1.0
"plant.fault.2.effector" = "left_aileron"
"plant.fault.2.kind" = "delayed"
"plant.fault.2.onset_s" = 0.0
"plant.fault.3.effector" = "right_aileron"
"plant.fault.3.kind" = "delayed"
"plant.fault.3.onset_s" = 0.0

[[joint]]
name = "model_error"
levels = [0.0, 0.1, 0.3]
as = "error"
keys = ["model.mass.mass_kg", "model.airframe.c_roll_p"]

[[joint]]
name = "delay"
unit = "ms"
levels = [0.0, 40.0]
keys = ["plant.fault.2.delay_ms", "plant.fault.3.delay_ms"]

[[law]]
name = "PID alone"
set = { FTC_MODE = 0 }

[[law]]
name = "paper"
set = { FTC_MODE = 1 }
"#;

fn plan(text: &str) -> Result<Plan, String> {
    let file = SpecFile::parse("joint.toml", text.to_owned(), PathBuf::new())
        .map_err(|error| error.to_string())?;
    Plan::new(file).map_err(|error| error.to_string())
}

fn value(plan: &Plan, run: &Run, key: &str) -> f64 {
    let place = plan.variables().iter().position(|variable| variable.key == key);
    run.values[place.expect(key)].number().expect("a number")
}

#[test]
fn a_part_of_the_travel_is_that_of_the_effector_of_the_case_not_of_all_flights() {
    let jam = "[[joint]]\nname = \"jam\"\nas = \"travel\"\n[[joint.case]]\nname = \"aileron\"\n\
               \"plant.fault.1.effector\" = \"left_aileron\"\n\"plant.fault.1.angle_deg\" = 1.0\n\n[[law]]";
    let text = SPEC.replace("\"plant.fault.1.angle_deg\" = 14.0\n", "");
    let plan = plan(&text.replacen("[[law]]", jam, 1)).unwrap();
    let settings = plan.settings(&plan.run(0).unwrap()).unwrap();
    let angle = settings.iter().rfind(|setting| setting.key == "plant.fault.1.angle_deg").unwrap();
    // The rudder goes to 30 deg.
    assert_eq!(lab_engine::settings::number(&angle.value), Some(25.0));
}

#[test]
fn an_error_scales_the_same_draws_of_every_key() {
    let plan = plan(SPEC).expect("above");
    assert_eq!(plan.flights(), 3 * 2 * 6);
    let runs: Vec<Run> = (0..plan.runs()).map(|run| plan.run(run).expect("a run")).collect();
    let nominal = plan.setup(&runs[0]).expect("a flight").model;
    let of = |run: &Run| {
        let model = plan.setup(run).expect("a flight").model;
        [
            model.mass.mass_kg / nominal.mass.mass_kg - 1.0,
            model.airframe.c_roll_p / nominal.airframe.c_roll_p - 1.0,
        ]
    };
    let mut largest = 0.0_f64;
    for run in &runs {
        let level = value(&plan, run, "model_error");
        let [mass, roll] = of(run);
        assert!(mass.abs() <= level && roll.abs() <= level, "{mass} {roll} at {level}");
        assert!(level == 0.0 || mass != roll, "each key has draws of its own");
        // The same sample at the largest level: three times as far at 0.3 as at 0.1.
        let sample = run.flight % 6;
        let same =
            |other: &&Run| value(&plan, other, "model_error") == 0.3 && other.flight % 6 == sample;
        let [far, _] = of(runs.iter().find(same).expect("it is there"));
        assert!((mass - far * level / 0.3).abs() < 1.0e-12, "{mass} {far} at {level}");
        largest = largest.max(mass.abs());
    }
    assert!(largest > 0.15, "{largest}");
}

#[test]
fn a_joint_value_is_that_of_every_key() {
    let plan = plan(SPEC).expect("above");
    for number in 0..plan.runs() {
        let run = plan.run(number).expect("a run");
        let settings = plan.settings(&run).expect("they are");
        let of = |key: &str| settings.iter().find(|setting| setting.key == key).map(|s| &s.value);
        let expected = toml::Value::Float(value(&plan, &run, "delay"));
        for key in ["plant.fault.2.delay_ms", "plant.fault.3.delay_ms"] {
            assert_eq!(of(key), Some(&expected), "run {number}");
        }
        assert_eq!(of("delay"), None, "a level is no key of --set");
    }
}

#[test]
fn a_curve_counts_the_runs_of_its_level() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(SPEC).expect("above");
    let store = RunStore::open(&plan, folder.path()).expect("a new folder");
    let _ = fly::fly(&plan, &store, None).expect("it can be written");
    let _ = lab_campaign::write(&plan, &store).expect("it can be written");
    let (mut results, mut lost) = (Results::new(&plan), 0);
    let mut rows = Vec::new();
    for part in 0..store.count() {
        rows.extend(store.runs(part).expect("it is finished"));
    }
    rows.iter().for_each(|row| results.add(row));
    let all = curves::of(&plan, &results, 0);
    assert_eq!(all.iter().map(|c| c.joint.as_str()).collect::<Vec<_>>(), ["model_error", "delay"]);
    for found in &all {
        let quantity = &found.quantities[0];
        for (law, points) in quantity.laws.iter().enumerate() {
            for point in points {
                let runs = rows.iter().filter(|row| {
                    let run = plan.run(row.run).expect("a run");
                    run.law == law && value(&plan, &run, &found.joint) == point.level
                });
                let ends: Vec<RunEnd> = runs.map(|row| row.end).collect();
                let count = ends.iter().filter(|end| **end == RunEnd::Lost).count();
                assert_eq!(point.flights as usize, ends.len());
                assert!((point.value - 100.0 * count as f64 / ends.len() as f64).abs() < 1.0e-9);
                assert!(point.interval.0 <= point.value && point.value <= point.interval.1);
                lost += count;
            }
        }
    }
    // Both curves are of all runs. The PID alone loses a rudder at 14 deg.
    let all_lost = rows.iter().filter(|row| row.end == RunEnd::Lost).count();
    assert!(all_lost > 0 && lost == 2 * all_lost, "{lost} and {all_lost}");
    for name in ["curves.csv", "curves.parquet", "curves.svg", "curves.png"] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
}

#[test]
fn a_joint_that_cannot_be_flown_names_what_is_wrong() {
    for (from, to, expected) in [
        ("\"model_error\"", "\"model error\"", "letters, digits and _"),
        ("[0.0, 0.1, 0.3]", "[0.0, 1.5]", "from 0 to 0.95"),
        ("[0.0, 0.1, 0.3]", "[]", "from 0 to 0.95"),
        ("[0.0, 40.0]", "[nan]", "finite numbers"),
        ("[0.0, 40.0]", "[0.0, 4000.0]", "delay_ms"),
        ("\"model.mass.mass_kg\"", "\"model.mass.mass\"", "nearest is model.mass.mass_kg"),
        ("\"model.mass.mass_kg\"", "\"model.airframe.c_roll_p\"", "each key once"),
        ("\"delay\"", "\"model_error\"", "each key once"),
        ("\"model.mass.mass_kg\"", "\"plant.fault.1.effector\"", "needs a number in the file"),
    ] {
        assert!(SPEC.contains(from), "{from}");
        let message = plan(&SPEC.replacen(from, to, 1)).map(drop).expect_err(to);
        assert!(message.contains(expected), "{to}: {message}");
    }
}
