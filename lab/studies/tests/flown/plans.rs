//! Plans of the kinds that people have, flown from their files by the Aerosonde.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use autopilot::command::{Command, VehicleCommand};
use autopilot::event::EventKind;
use autopilot::run::LawArgs;
use autopilot::vehicle::VehicleEvent;
use autopilot::vehicle::plan::{Action, Item, Plan};
use icd::SimTime;
use lab_engine::configuration::AircraftArgs;
use lab_judges::closed_loop::TimedCommand;
use lab_studies::mission::{self, Flown, MissionOptions};
use plant_sim::EarthModel;

/// Every file ends within this time, s; an endless jump is left at the half of it.
const LONGEST_S: f64 = 1_500.0;

/// What was flown, whether the plan was complete, and the items that were passed.
fn fly(file: &str, wind_m_s: f64) -> (Flown, Plan, Vec<u16>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../autopilot/mavlink-services/src/tests/mission/files")
        .join(file);
    let aircraft = AircraftArgs { airframe: Some("aerosonde".into()), ..AircraftArgs::default() };
    let options = MissionOptions {
        out: PathBuf::new(),
        aircraft,
        laws: LawArgs::default(),
        earth: EarthModel::Wgs84,
        wind_m_s,
        turbulence_m_s: 0.0,
        plan: None,
        land_at_s: None,
        seed: 1,
    };
    let mut setup = mission::setup(&options).expect("the shipped aircraft");
    let (_, plan) = mission::of_file(&path, &mut setup).expect(file);
    setup.duration = SimTime::from_seconds(LONGEST_S).expect("a time");
    let mut commands = mission::begin(&Arc::new(plan.clone()));
    let endless = |action: &Action| matches!(action, Action::Jump { times: None, to } if *to != 1);
    if plan.items.iter().any(|item| endless(&item.action)) {
        let at = SimTime::from_seconds(0.5 * LONGEST_S).expect("a time");
        commands.push(TimedCommand { at, command: Command::Vehicle(VehicleCommand::Land) });
    }
    let flown = mission::fly(&setup, &commands).expect("the shipped aircraft flies");
    let passed = flown.events.iter().filter_map(|(_, kind)| match kind {
        EventKind::Vehicle(VehicleEvent::ItemPassed(item)) => Some(*item),
        _ => None,
    });
    let passed = passed.collect();
    (flown, plan, passed)
}

#[test]
fn every_file_with_a_landing_is_flown_to_its_landing_point() {
    for (file, wind_m_s) in [
        ("before_fences.mission", 0.0),
        ("circles_to_altitudes.waypoints", 0.0),
        ("circuit_for_ever.waypoints", 3.0),
        ("every_kind.waypoints", 0.0),
        ("exchanged_radius.plan", 0.0),
        ("home_on_the_ground.waypoints", 0.0),
        ("landing_point_in_the_air.waypoints", 3.0),
        ("survey_and_landing_pattern.plan", 3.0),
        ("takeoff_circle_land.plan", 0.0),
        ("there_and_back.waypoints", 0.0),
        ("tilt_rotor.waypoints", 0.0),
        ("tilt_rotor_with_land_start.plan", 0.0),
    ] {
        let (flown, plan, passed) = fly(file, wind_m_s);
        let touchdown = flown.touchdown.expect(file);
        assert_eq!(flown.crash, None, "{file}");
        let lifts_off = EventKind::Vehicle(VehicleEvent::LiftOff);
        let takes_off = |item: &Item| matches!(item.action, Action::Takeoff { .. });
        let lifted_off = flown.events.iter().any(|(_, kind)| *kind == lifts_off);
        assert_eq!(lifted_off, plan.items.iter().any(takes_off), "{file}");
        let (_, off_m) = touchdown.landing(&plan).expect("it has a landing");
        println!("{file}: {off_m:.0} m, {touchdown:?}");
        // Measured 28 to 78 m, with glides of 3 to 8 deg, and 0.5 to 0.95 m/s.
        assert!(off_m < 100.0, "{file}: {off_m} m");
        assert!((0.0..1.4).contains(&touchdown.sink_m_s), "{file}: {touchdown:?}");
        // In a wind from the side the nose points along the track, and the wing into the wind.
        let most_rad = 0.05 + 0.03 * wind_m_s;
        assert!(touchdown.roll_rad.abs() < most_rad, "{file}: {touchdown:?}");
        if file == "every_kind.waypoints" {
            assert_eq!(passed, [21, 23, 26, 27, 28, 29, 30, 31, 32, 33]);
        }
    }
}

#[test]
fn a_plan_that_ends_with_a_return_lands_where_it_began() {
    let item = |number: u8, frame: u8, command: u8, place: &str| {
        format!("{number}\t{}\t{frame}\t{command}\t0\t0\t0\t0\t{place}\t1\n", u8::from(number == 0))
    };
    let text = "QGC WPL 110\n".to_owned()
        + &item(0, 0, 16, "34.9\t-117.9\t700")
        + &item(1, 3, 22, "34.905\t-117.9\t60")
        + &item(2, 3, 16, "34.912\t-117.895\t80")
        + &item(3, 3, 20, "0\t0\t0");
    let file = tempfile::NamedTempFile::with_suffix(".waypoints").expect("a file");
    std::fs::write(file.path(), text).expect("it is written");
    let (flown, ..) = fly(file.path().to_str().expect("a path in UTF-8"), 0.0);
    assert_eq!(flown.crash, None);
    let down = flown.touchdown.expect("a touchdown");
    assert!(down.sink_m_s < 1.5, "{} m/s", down.sink_m_s);
    let disarmed = EventKind::Vehicle(VehicleEvent::Armed(false));
    assert!(flown.events.iter().any(|(_, kind)| *kind == disarmed), "{:?}", flown.events);
}

#[test]
fn points_at_one_place_are_no_line_to_land_along_and_the_aircraft_lands_ahead() {
    for wind_m_s in [0.0, 4.0] {
        let (flown, _, _) = fly("all_at_one_place.waypoints", wind_m_s);
        let touchdown = flown.touchdown.expect("a touchdown");
        assert!(touchdown.sink_m_s < 1.4 && touchdown.roll_rad.abs() < 0.2, "{touchdown:?}");
        assert_eq!(flown.crash, None);
    }
}

#[test]
fn a_plan_full_of_a_camera_is_flown_to_its_end() {
    let (flown, _, passed) = fly("camera.plan", 3.0);
    let complete = EventKind::Vehicle(VehicleEvent::PlanComplete);
    assert!(flown.touchdown.is_some() && flown.events.iter().any(|(_, kind)| *kind == complete));
    assert_eq!(passed, [2, 3, 7, 8, 9, 10]);
}
