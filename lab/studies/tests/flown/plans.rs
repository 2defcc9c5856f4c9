//! Plans of the kinds that people have, flown from their files by the Aerosonde.

use core::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use autopilot::command::{Command, VehicleCommand};
use autopilot::event::EventKind;
use autopilot::run::LawArgs;
use autopilot::vehicle::geodesy::{Horizon, Site};
use autopilot::vehicle::plan::Action;
use autopilot::vehicle::{Place, VehicleEvent};
use icd::SimTime;
use lab_engine::configuration::AircraftArgs;
use lab_judges::closed_loop::{TimedCommand, watch_with_commands};
use lab_studies::mission::{self, MissionOptions};
use plant_sim::EarthModel;

/// Every file ends within this time, s; an endless jump is left at the half of it.
const LONGEST_S: f64 = 1_500.0;

/// The end of a flight.
#[derive(Debug, Default)]
struct Arrival {
    /// Distance from the landing point, m.
    off_m: f64,
    sink_m_s: f64,
    bank_deg: f64,
    on_ground: bool,
    complete: bool,
    passed: Vec<u16>,
    t_s: f64,
}

fn fly(file: &str, wind_m_s: f64) -> Arrival {
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
    // Behind the first landing the flight is over.
    let point = plan.items.iter().find_map(|item| match item.action {
        Action::Land { place, .. } => Some(place),
        _ => None,
    });
    let mut commands = mission::begin(&Arc::new(plan.clone()));
    let endless = |action: &Action| matches!(action, Action::Jump { times: None, to } if *to != 1);
    if plan.items.iter().any(|item| endless(&item.action)) {
        let at = SimTime::from_seconds(0.5 * LONGEST_S).expect("a time");
        commands.push(TimedCommand { at, command: Command::Vehicle(VehicleCommand::Land) });
    }
    let mut arrival = Arrival::default();
    let end = watch_with_commands(&setup, &commands, |tick| {
        for event in tick.events {
            match event.kind {
                EventKind::Vehicle(VehicleEvent::PlanComplete) => arrival.complete = true,
                EventKind::Vehicle(VehicleEvent::ItemPassed(item)) => arrival.passed.push(item),
                _ => {}
            }
        }
        let (motion, truth) = (tick.snapshot.motion(), tick.plant.truth());
        arrival.t_s = tick.exchange.time.as_seconds();
        arrival.sink_m_s = -motion.climb_rate_m_s();
        arrival.bank_deg = truth.euler().phi.to_degrees();
        let here = Horizon::at(Place::of(motion));
        arrival.off_m = point.map_or(0.0, |point| here.offset(&Site::at(point)).norm());
        let is_over = arrival.t_s > LONGEST_S || arrival.complete && point.is_none();
        if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    arrival.on_ground = end.expect("the shipped aircraft flies").on_ground;
    arrival
}

#[test]
fn every_file_with_a_landing_is_flown_to_its_landing_point() {
    for (file, wind_m_s) in [
        ("circles_to_altitudes.waypoints", 0.0),
        ("circuit_for_ever.waypoints", 3.0),
        ("every_kind.waypoints", 0.0),
        ("exchanged_radius.plan", 0.0),
        ("survey_and_landing_pattern.plan", 3.0),
        ("takeoff_circle_land.plan", 0.0),
        ("there_and_back.waypoints", 0.0),
        ("tilt_rotor.waypoints", 0.0),
        ("tilt_rotor_with_land_start.plan", 0.0),
    ] {
        let arrival = fly(file, wind_m_s);
        println!("{file}: {arrival:?}");
        // Measured 28 to 78 m, with glides of 3 to 8 deg, and 0.5 to 0.95 m/s.
        assert!(arrival.on_ground && arrival.off_m < 100.0, "{file}: {arrival:?}");
        assert!((0.0..1.4).contains(&arrival.sink_m_s), "{file}: {arrival:?}");
        assert!(arrival.bank_deg.abs() < 3.0, "{file}: {arrival:?}");
        if file == "every_kind.waypoints" {
            assert_eq!(arrival.passed, [21, 23, 26, 27, 28, 29, 30, 31, 32, 33]);
        }
    }
}

#[test]
fn a_plan_full_of_a_camera_is_flown_to_its_end() {
    let arrival = fly("camera.plan", 3.0);
    assert!(arrival.complete && !arrival.on_ground, "{arrival:?}");
    assert_eq!(arrival.passed, [2, 3, 7, 8, 9, 10]);
}
