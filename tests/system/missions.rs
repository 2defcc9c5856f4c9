//! Plans flown by the real aircraft: the whole chain from an operator's command to a track over the ground.

use crate::flights;

use autopilot::command::VehicleCommand;
use core::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use autopilot::command::Command;
use autopilot::event::EventKind;
use autopilot::run::LawArgs;
use autopilot::vehicle::{LinkLossAction, Mode, Place, Reposition};
use autopilot::vehicle::{
    VehicleEvent,
    plan::{Action, Plan},
};
use icd::SimTime;
use lab_engine::configuration::AircraftArgs;
use lab_judges::closed_loop::{FlightSetup, TimedCommand, watch_with_commands};
use lab_studies::mission::{self, Flown, MissionOptions, TrackPoint};
use nalgebra::Vector3;
use plant_sim::EarthModel;
use plant_sim::geodesy::{Geodetic, ecef};

/// Items of the demonstration in the order in which they begin; the jump is flown twice and never listed.
const BEGUN: [u16; 15] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 5, 6, 7, 8, 10, 11];

fn setup(earth: EarthModel, wind_m_s: f64, turbulence_m_s: f64) -> FlightSetup {
    setup_of(earth, wind_m_s, turbulence_m_s, AircraftArgs::default())
}

fn setup_of(
    earth: EarthModel,
    wind_m_s: f64,
    turbulence_m_s: f64,
    aircraft: AircraftArgs,
) -> FlightSetup {
    let out = std::path::PathBuf::new();
    let laws = LawArgs::default();
    let (plan, land_at_s) = (None, None);
    let options = MissionOptions {
        earth,
        wind_m_s,
        turbulence_m_s,
        plan,
        land_at_s,
        seed: 1,
        out,
        aircraft,
        laws,
    };
    mission::setup(&options).expect("the shipped aircraft")
}

fn demo(setup: &FlightSetup) -> Arc<Plan> {
    Arc::new(mission::demo(setup))
}

fn fly(setup: &FlightSetup, commands: &[TimedCommand]) -> Flown {
    mission::fly(setup, commands).expect("the shipped aircraft flies")
}

fn at(seconds: f64, command: Command) -> TimedCommand {
    TimedCommand { at: SimTime::from_seconds(seconds).expect("a time"), command }
}

fn begun(flown: &Flown) -> Vec<u16> {
    let item = |(_, kind): &(f64, EventKind)| match kind {
        EventKind::Vehicle(VehicleEvent::PlanItem(item)) => Some(*item),
        _ => None,
    };
    flown.events.iter().filter_map(item).collect()
}

/// A point of the ellipsoid by the plant's own geodesy, which is independent of the guidance.
fn on_ground(place: Place) -> Vector3<f64> {
    let Place { latitude_rad, longitude_rad } = place;
    ecef(&Geodetic { latitude_rad, longitude_rad, altitude_m: 0.0 })
}

/// Distance from the plane through two points and the Earth's centre, m.
fn beside(a: Place, b: Place, at: Place) -> f64 {
    let normal = on_ground(a).cross(&on_ground(b)).normalize();
    normal.dot(&on_ground(at)).abs()
}

fn place_of(action: &Action) -> Place {
    let place = match action {
        Action::Waypoint { point, .. } => point.place,
        Action::LoiterTurns { circle, .. } | Action::LoiterToAltitude(circle) => {
            circle.centre.place
        }
        _ => None,
    };
    place.expect("an item with a place")
}

/// Sections of the track that were flown with one item after the other.
fn pieces(flown: &Flown) -> Vec<&[TrackPoint]> {
    let in_mission: Vec<_> =
        flown.track.chunk_by(|a, b| (a.item, a.mode) == (b.item, b.mode)).collect();
    in_mission.into_iter().filter(|piece| piece[0].mode == Mode::Mission).collect()
}

/// Largest distance from the legs between two points of the plan, in the last 40 % of each.
fn worst_beside(plan: &Plan, flown: &Flown) -> f64 {
    let mut worst = 0.0_f64;
    let mut legs = 0;
    let pieces = pieces(flown);
    for pair in pieces.windows(2) {
        let [before, leg] =
            [pair[0][0].item, pair[1][0].item].map(|item| plan.items[usize::from(item)].action);
        let (Action::Waypoint { .. }, Action::Waypoint { .. }) = (&before, &leg) else { continue };
        legs += 1;
        let settled = pair[1].len() * 6 / 10;
        for point in &pair[1][settled..] {
            worst = worst.max(beside(place_of(&before), place_of(&leg), point.place));
        }
    }
    // 0-1, and the rectangle twice: 5-6, 6-7, 7-8, 8-5.
    assert_eq!(legs, 8, "legs between points");
    worst
}

/// Largest distance from the circle of item 3 once it was reached, m.
fn worst_off_circle(plan: &Plan, flown: &Flown) -> f64 {
    let circle = pieces(flown).into_iter().find(|piece| piece[0].item == 3).expect("item 3");
    let Action::LoiterTurns { circle: expected, .. } = plan.items[3].action else {
        panic!("item 3")
    };
    let centre = on_ground(expected.centre.place.expect("a place"));
    let radius_m = expected.radius_m.expect("a radius");
    let settled = circle.len() * 6 / 10;
    let off = |point: &TrackPoint| ((on_ground(point.place) - centre).norm() - radius_m).abs();
    circle[settled..].iter().map(off).fold(0.0, f64::max)
}

/// Largest altitude error at the passage of a point, m.
fn worst_altitude(plan: &Plan, flown: &Flown) -> f64 {
    let mut worst = 0.0_f64;
    for piece in pieces(flown) {
        let (Action::Waypoint { point, .. }, Some(last)) =
            (plan.items[usize::from(piece[0].item)].action, piece.last())
        else {
            continue;
        };
        worst = worst.max((last.altitude_m[0] - point.altitude_m.expect("an altitude")).abs());
    }
    worst
}

/// Flies the demonstration and checks what must hold in any wind: the order, the end, home.
fn demonstrate(earth: EarthModel, wind_m_s: f64, turbulence_m_s: f64) -> (Arc<Plan>, Flown) {
    let setup = setup(earth, wind_m_s, turbulence_m_s);
    let plan = demo(&setup);
    let flown = fly(&setup, &mission::begin(&plan));
    assert_eq!(begun(&flown), BEGUN);
    let ended = flown
        .events
        .iter()
        .any(|(_, kind)| *kind == EventKind::Vehicle(VehicleEvent::PlanComplete));
    assert!(ended, "the plan was completed");
    let last = flown.track.last().expect("a track");
    assert_eq!(last.mode, Mode::Return);
    (plan, flown)
}

#[test]
fn in_calm_air_legs_circles_and_altitudes_are_flown_closely() {
    for earth in [EarthModel::Wgs84, EarthModel::Flat] {
        let (plan, flown) = demonstrate(earth, 0.0, 0.0);
        let beside_m = worst_beside(&plan, &flown);
        assert!(beside_m < 50.0, "{earth:?}: {beside_m} m beside a leg");
        let off_m = worst_off_circle(&plan, &flown);
        assert!(off_m < 100.0, "{earth:?}: {off_m} m off the circle");
        // The altitude law lags about 10 s behind a ramp: 90 m at 9 m/s.
        let altitude_m = worst_altitude(&plan, &flown);
        assert!(altitude_m < 150.0, "{earth:?}: {altitude_m} m at a point");
    }
}

#[test]
fn wind_and_turbulence_leave_the_aircraft_on_its_path() {
    for earth in [EarthModel::Wgs84, EarthModel::Flat] {
        let (plan, flown) = demonstrate(earth, 30.0, 1.5);
        let beside_m = worst_beside(&plan, &flown);
        assert!(beside_m < 100.0, "{earth:?}: {beside_m} m beside a leg");
        let off_m = worst_off_circle(&plan, &flown);
        assert!(off_m < 150.0, "{earth:?}: {off_m} m off the circle");
    }
}

#[test]
fn the_same_commands_at_the_same_ticks_fly_the_same_bits() {
    let setup = setup(EarthModel::Wgs84, 20.0, 1.5);
    let plan = demo(&setup);
    let mut commands = mission::begin(&plan);
    commands.push(at(
        150.0,
        Command::Vehicle(VehicleCommand::Reposition(Reposition {
            change_mode: true,
            ..Reposition::default()
        })),
    ));
    commands.push(at(300.0, Command::Vehicle(VehicleCommand::LinkLost(LinkLossAction::Return))));
    commands.push(at(400.0, Command::Vehicle(VehicleCommand::LinkBack)));
    commands.push(at(420.0, Command::Vehicle(VehicleCommand::Mode(Mode::Mission))));
    let mut short = setup.clone();
    short.duration = SimTime::from_micros(600_000_000);
    let (one, other) = (fly(&short, &commands), fly(&short, &commands));
    assert_eq!(one.track, other.track);
    assert_eq!(one.events, other.events);
}

#[test]
fn an_aircraft_of_eleven_kilograms_flies_the_same_with_circles_of_100_m() {
    let file = |path: &str| Some(Path::new(env!("CARGO_MANIFEST_DIR")).join(path));
    let aircraft = AircraftArgs {
        airframe: file("../aircraft/aerosonde/airframe.toml"),
        model: file("../aircraft/aerosonde/model.toml"),
        ..AircraftArgs::default()
    };
    let setup = setup_of(EarthModel::Wgs84, 3.0, 0.0, aircraft);
    let plan = demo(&setup);
    let flown = fly(&setup, &mission::begin(&plan));
    assert_eq!(begun(&flown), BEGUN);
    let (legs, circle, altitude) = (
        worst_beside(&plan, &flown),
        worst_off_circle(&plan, &flown),
        worst_altitude(&plan, &flown),
    );
    assert!(legs < 3.0 && circle < 5.0 && altitude < 5.0, "{legs} m, {circle} m, {altitude} m");
}

#[test]
fn after_a_pause_the_mission_goes_on_and_is_completed() {
    let setup = setup(EarthModel::Wgs84, 0.0, 0.0);
    let plan = demo(&setup);
    let mut commands = mission::begin(&plan);
    commands.push(at(150.0, Command::Vehicle(VehicleCommand::Mode(Mode::Hold))));
    commands.push(at(500.0, Command::Vehicle(VehicleCommand::Mode(Mode::Mission))));
    let flown = fly(&setup, &commands);
    let mut expected = BEGUN.to_vec();
    // The paused item begins again.
    expected.insert(2, 1);
    assert_eq!(begun(&flown), expected);
}

#[test]
fn with_a_jammed_elevator_the_aircraft_can_be_sent_to_a_circle() {
    let mut setup = flights::case_1(EarthModel::Wgs84);
    setup.duration = SimTime::from_micros(500_000_000);
    setup.references = autopilot::vehicle::schedule::ReferenceSchedule::default();
    let reposition =
        Reposition { radius_m: Some(15_000.0), change_mode: true, ..Reposition::default() };
    let flown = fly(&setup, &[at(60.0, Command::Vehicle(VehicleCommand::Reposition(reposition)))]);
    let last = flown.track.last().expect("a track");
    assert!(last.t_s > 499.0, "still flying: {last:?}");
    assert!(last.cross_track_m.abs() < 100.0, "{last:?}");
}

#[test]
fn a_terminated_flight_comes_down_near_where_it_was_terminated() {
    let mut setup = setup(EarthModel::Wgs84, 0.0, 0.0);
    setup.duration = SimTime::from_micros(300_000_000);
    let commands = [
        at(20.0, Command::Vehicle(VehicleCommand::Terminate)),
        at(25.0, Command::Vehicle(VehicleCommand::Mode(Mode::Hold))),
    ];
    let (mut terminated_at, mut last, mut reports) = (None, None, 0);
    let flight = watch_with_commands(&setup, &commands, |tick| {
        reports += tick
            .events
            .iter()
            .filter(|event| event.kind == EventKind::Vehicle(VehicleEvent::Terminated))
            .count();
        if tick.snapshot.terminated {
            terminated_at.get_or_insert(tick.plant.truth().position);
            assert_eq!(tick.snapshot.mode, Mode::Position, "no command has an effect");
        }
        last = Some(tick.plant.truth().position);
        ControlFlow::Continue(())
    });
    assert!(flight.expect("the shipped aircraft flies").end().on_ground);
    assert_eq!(reports, 1, "reported once");
    let (from, to) = (terminated_at.expect("terminated"), last.expect("flown"));
    let way_m = (to.0 - from.0).xy().norm();
    assert!(way_m < 2_500.0, "{way_m} m on from where it was terminated");
}
