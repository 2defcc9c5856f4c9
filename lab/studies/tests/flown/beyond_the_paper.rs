//! What the allocation `relief` keeps and the paper's does not: each want before and after.
//!
//! `cargo test --workspace --test flown beyond_the_paper -- --nocapture` prints the figures of docs/laws.md.

use core::ops::ControlFlow;
use std::sync::Arc;

use autopilot::config;
use autopilot::event::EventKind;
use autopilot::vehicle::VehicleEvent;
use flight_control::{AllocationMode, CompensatorMode};
use icd::units::DEG;
use icd::{ControlPeriod, SimTime};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{FlightSetup, watch_with_commands};
use lab_report::runner;
use lab_studies::mission;
use plant_sim::{Airframe, ReadAirframe as _, Scenario};

/// Onset of all faults but those of the mission, s.
const ONSET_S: f64 = 1.0;
/// Body rates and the thrust are judged in the last so many seconds.
const LAST_S: f64 = 15.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Law {
    /// The main controller alone.
    Off,
    Paper,
    Relief,
}

const BEFORE_AND_AFTER: [Law; 2] = [Law::Paper, Law::Relief];

/// A reference from a time on.
fn reference(at_s: f64, key: &str, value: f64) -> String {
    format!("[[autopilot.reference]]\nat_s = {at_s:?}\n{key} = {value:?}\n")
}

fn jam(effector: &str, angle_deg: f64) -> String {
    fault(effector, &format!("kind = \"stuck_at\"\nangle_deg = {angle_deg:?}\ntravel = \"jump\""))
}

fn late(effectors: [&str; 2], delay_ms: f64) -> String {
    effectors
        .map(|name| fault(name, &format!("kind = \"delayed\"\ndelay_ms = {delay_ms:?}")))
        .concat()
}

fn fault(effector: &str, rest: &str) -> String {
    format!("[[plant.fault]]\neffector = \"{effector}\"\nonset_s = {ONSET_S:?}\n{rest}\n")
}

fn setup(text: &str, law: Law, duration_s: f64) -> FlightSetup {
    let airframe = Airframe::paper();
    let text = format!("[plant]\nseed = 1\n{text}");
    let scenario = Scenario::from_toml("scenario", &text, &airframe.effectors).expect("above");
    let model = config::model("model", aircraft::DEFAULT_MODEL).expect("a shipped model");
    let mut parameters = model.defaults;
    let selection = &mut parameters.gains.selection;
    match law {
        Law::Off => selection.compensator = CompensatorMode::Off,
        Law::Paper => selection.allocation = AllocationMode::Paper,
        Law::Relief => selection.allocation = AllocationMode::Relief,
    }
    FlightSetup {
        plant: scenario.plant.setup(airframe, 1, ControlPeriod::DEFAULT, 1_000),
        model: model.aircraft,
        parameters,
        references: config::references("scenario", &text).expect("above"),
        script: None,
        duration: SimTime::from_seconds(duration_s).expect("seconds of a flight"),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

#[derive(Debug, Clone, Default)]
struct Flown {
    /// When the aircraft was lost, s.
    lost_s: Option<f64>,
    /// Roll angle at the end, deg.
    roll_deg: f64,
    /// From the onset until the roll angle stays within 0.5 deg of its reference, s.
    settled_s: f64,
    /// Altitude minus its reference at the end, m.
    altitude_m: f64,
    airspeed_m_s: f64,
    /// Of the last seconds, deg/s.
    roll_rate_rms_deg_s: f64,
    /// Largest distance of the airspeed from its reference in the last seconds, m/s.
    speed_error_m_s: f64,
    events: Vec<(f64, EventKind)>,
}

impl Flown {
    fn kept(&self) -> bool {
        self.lost_s.is_none()
    }

    fn has(&self, kind: EventKind) -> bool {
        self.events.iter().any(|(_, event)| *event == kind)
    }
}

fn fly(setup: &FlightSetup) -> Flown {
    fly_plan(setup, &[])
}

fn fly_plan(setup: &FlightSetup, commands: &[lab_judges::closed_loop::TimedCommand]) -> Flown {
    let mut flown = Flown::default();
    let (mut squares, mut count) = (0.0, 0_u32);
    let end_s = setup.duration.as_seconds();
    let flight = watch_with_commands(setup, commands, |tick| {
        let (truth, log, events) = (tick.plant.truth(), tick.log, tick.events);
        let t_s = truth.time.as_seconds();
        flown.events.extend(events.iter().map(|event| (t_s, event.kind)));
        if setup.plant.airframe.limits.are_exceeded(&truth.into()) {
            flown.lost_s = Some(t_s);
        }
        flown.roll_deg = truth.euler().phi / DEG;
        if (flown.roll_deg - log.roll_reference_rad / DEG).abs() > 0.5 && t_s > ONSET_S {
            flown.settled_s = t_s - ONSET_S;
        }
        flown.altitude_m = truth.altitude_m - log.altitude_reference_m;
        flown.airspeed_m_s = truth.airspeed_m_s;
        if t_s > end_s - LAST_S {
            squares += (truth.body_rates.0.x / DEG).powi(2);
            count += 1;
            let error = (truth.airspeed_m_s - log.airspeed_reference_m_s).abs();
            flown.speed_error_m_s = flown.speed_error_m_s.max(error);
        }
        let complete = EventKind::Vehicle(VehicleEvent::PlanComplete);
        let goes_on = flown.kept() && events.iter().all(|event| event.kind != complete);
        if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    let _ = flight.expect("the shipped aircraft flies");
    flown.roll_rate_rms_deg_s = (squares / f64::from(count.max(1))).sqrt();
    flown
}

/// Flies each text with each law and prints a line of each.
fn fly_all<const N: usize>(
    flights: &[(String, String)],
    laws: [Law; N],
    duration_s: f64,
) -> Vec<[Flown; N]> {
    let flown = runner::map("beyond", flights, |(_, text)| {
        laws.map(|law| fly(&setup(text, law, duration_s)))
    });
    for ((name, _), flown) in flights.iter().zip(&flown) {
        for (law, o) in laws.iter().zip(flown) {
            let lost = o.lost_s.map_or("kept".to_owned(), |t_s| format!("lost at {t_s:.1} s"));
            println!(
                "| {name} | {law:?} | {lost} | roll {:.2} deg, settled {:.1} s, altitude {:.1} m, {:.1} m/s, roll rate {:.2} deg/s rms |",
                o.roll_deg, o.settled_s, o.altitude_m, o.airspeed_m_s, o.roll_rate_rms_deg_s
            );
        }
    }
    flown
}

fn turn() -> String {
    reference(0.0, "roll_deg", 15.0)
}

fn level() -> String {
    reference(0.0, "roll_deg", 0.0)
}

/// Case 2 of the paper asks for 15 deg of roll.
#[test]
fn case_2_flies_the_roll_angle_that_is_asked_for_within_three_seconds() {
    let flights =
        [7.0, -7.0].map(|deg| (format!("rudder {deg}, turn"), turn() + &jam("rudder", deg)));
    for [paper, relief] in fly_all(&flights, BEFORE_AND_AFTER, 40.0) {
        assert!(paper.kept() && (paper.roll_deg - 15.0).abs() > 4.0, "{paper:?}");
        assert!(relief.kept() && (relief.roll_deg - 15.0).abs() < 0.2, "{relief:?}");
        assert!(relief.settled_s < 3.0 && relief.altitude_m.abs() < 3.0, "{relief:?}");
    }
}

/// `sitl aircraft trimmable`: a level turn at 15 deg of bank and 264 m/s exists up to 21.1 deg, and at less speed further.
#[test]
fn rudder_jams_are_kept_up_to_23_deg_in_the_turn_and_in_level_flight() {
    let mut flights = Vec::new();
    for deg in [13.0, 15.0, 18.0, 20.0, 22.0, 23.0] {
        flights.push((format!("rudder {deg}, turn"), turn() + &jam("rudder", deg)));
        flights.push((format!("rudder {deg}, level"), level() + &jam("rudder", deg)));
    }
    for deg in [-13.0, -18.0, -22.0] {
        flights.push((format!("rudder {deg}, turn"), turn() + &jam("rudder", deg)));
    }
    for ((name, _), [paper, relief]) in
        flights.iter().zip(fly_all(&flights, BEFORE_AND_AFTER, 40.0))
    {
        assert!(!paper.kept(), "{name}: {paper:?}");
        assert!(relief.kept() && relief.settled_s < 15.0, "{name}: {relief:?}");
    }
}

/// Below its level the detector sleeps, and the aircraft flies off its roll angle: the page has the figures.
#[test]
fn the_page_has_the_roll_angles_with_small_rudder_jams() {
    const JAMS_DEG: [f64; 10] = [-3.0, -2.0, -1.5, -1.0, -0.5, 0.5, 1.0, 1.5, 2.0, 3.0];
    let page = include_str!("../../../../docs/laws.md");
    for speed in [200.0, 230.0, 264.0] {
        let start = format!("[plant.start]\nairspeed_m_s = {speed:?}\n");
        let flight = reference(0.0, "roll_deg", 15.0) + &format!("airspeed_m_s = {speed:?}\n");
        let flights = JAMS_DEG.map(|deg| {
            (format!("rudder {deg}, {speed} m/s"), start.clone() + &flight + &jam("rudder", deg))
        });
        let mut row = format!("| {speed} m/s |");
        for [relief] in fly_all(&flights, [Law::Relief], 40.0) {
            assert!(relief.kept(), "{relief:?}");
            row += &format!(" {:.1} |", relief.roll_deg);
        }
        assert!(page.contains(&row), "{row}");
    }
}

#[test]
fn an_elevator_and_the_rudder_together_are_kept_near_the_altitude() {
    let both = jam("left_elevator", 30.0) + &jam("rudder", 7.0);
    let flights = [("level", level()), ("turn", turn())]
        .map(|(name, text)| (format!("elevator 30, rudder 7, {name}"), text + &both));
    for [off, paper, relief] in fly_all(&flights, [Law::Off, Law::Paper, Law::Relief], 60.0) {
        assert!(off.kept() && off.altitude_m.abs() > 100.0, "{off:?}");
        assert!(!paper.kept(), "{paper:?}");
        assert!(relief.kept() && relief.altitude_m.abs() < 5.0, "{relief:?}");
        assert!(relief.settled_s < 5.0, "{relief:?}");
    }
}

#[test]
fn a_low_speed_reference_does_not_take_the_thrust_that_the_nozzle_needs() {
    let flights = [220.0, 200.0].map(|speed| {
        let text = level() + &reference(10.0, "airspeed_m_s", speed);
        (format!("elevator 30, {speed} m/s"), text + &jam("left_elevator", 30.0))
    });
    for [paper, relief] in fly_all(&flights, BEFORE_AND_AFTER, 150.0) {
        assert!(!paper.kept(), "{paper:?}");
        assert!(relief.kept() && relief.speed_error_m_s < 2.0, "{relief:?}");
        assert!(relief.altitude_m.abs() < 5.0, "{relief:?}");
        for event in [EventKind::ThrustFloorTaken, EventKind::ThrustFloorReleased] {
            assert!(relief.has(event), "{event:?}: {:?}", relief.events);
        }
    }
}

/// A turn is begun and ended, so that the ailerons work.
fn manoeuvre() -> String {
    level() + &reference(3.0, "roll_deg", 15.0) + &reference(12.0, "roll_deg", 0.0)
}

#[test]
fn with_late_ailerons_the_compensator_yields_and_says_so() {
    let flights = [100.0, 120.0, 130.0, 150.0].map(|ms| {
        let ailerons = late(["left_aileron", "right_aileron"], ms);
        (format!("ailerons {ms} ms late"), manoeuvre() + &ailerons)
    });
    for [paper, relief] in fly_all(&flights, BEFORE_AND_AFTER, 40.0) {
        assert!(paper.roll_rate_rms_deg_s > 20.0, "{paper:?}");
        assert!(relief.kept() && relief.roll_rate_rms_deg_s < 0.1, "{relief:?}");
        assert!(relief.has(EventKind::CompensatorYields), "{:?}", relief.events);
    }
}

/// What moves by itself at 2 to 3 Hz is faster than servos can cancel: the flight is not worse than without the compensator.
#[test]
fn an_oscillating_elevator_is_not_made_worse() {
    let flights = [2.0, 3.0].map(|hz| {
        let rest = format!("kind = \"oscillating\"\namplitude_deg = 15.0\nfrequency_hz = {hz:?}");
        (format!("elevator swings at {hz} Hz"), manoeuvre() + &fault("left_elevator", &rest))
    });
    for [off, paper, relief] in fly_all(&flights, [Law::Off, Law::Paper, Law::Relief], 40.0) {
        let [off, paper, relief_rms] =
            [&off, &paper, &relief].map(|flown| flown.roll_rate_rms_deg_s);
        assert!(paper > 1.1 * off && relief_rms < 1.05 * off, "{off} {paper} {relief_rms} deg/s");
        assert!(relief.has(EventKind::CompensatorYields), "{:?}", relief.events);
    }
}

#[test]
fn a_late_nozzle_and_a_jammed_rudder_are_kept_at_the_roll_angle_that_is_asked_for() {
    let flights = [100.0, 200.0, 300.0].map(|ms| {
        let nozzle = late(["nozzle_pitch", "nozzle_yaw"], ms);
        (format!("nozzle {ms} ms late, rudder 7"), turn() + &jam("rudder", 7.0) + &nozzle)
    });
    for [paper, relief] in fly_all(&flights, BEFORE_AND_AFTER, 60.0) {
        assert!(paper.kept() && (paper.roll_deg - 15.0).abs() > 4.0, "{paper:?}");
        assert!(relief.kept() && (relief.roll_deg - 15.0).abs() < 1.0, "{relief:?}");
    }
}

/// A late nozzle swings with the elevator's jam on both of its axes.
#[test]
fn a_late_nozzle_and_a_jammed_elevator_are_kept_without_the_swing_of_the_papers_compensator() {
    let flights = [200.0, 250.0, 300.0, 350.0].map(|ms| {
        let nozzle = late(["nozzle_pitch", "nozzle_yaw"], ms);
        let text = level() + &jam("left_elevator", 30.0) + &nozzle;
        (format!("nozzle {ms} ms late, elevator 30"), text)
    });
    for [paper, relief] in fly_all(&flights, BEFORE_AND_AFTER, 60.0) {
        assert!(!paper.kept() || paper.roll_rate_rms_deg_s > 4.0, "{paper:?}");
        assert!(relief.kept() && relief.roll_rate_rms_deg_s < 2.0, "{relief:?}");
        assert!(relief.altitude_m.abs() < 20.0, "{relief:?}");
        assert!(relief.has(EventKind::CompensatorYields), "{:?}", relief.events);
    }
}

/// The demonstration mission with its turns of 45 deg.
#[test]
fn the_mission_is_flown_to_its_end_with_a_jammed_elevator() {
    let elevator = jam("left_elevator", 30.0).replace("onset_s = 1.0", "onset_s = 60.0");
    let flown = runner::map("mission", &BEFORE_AND_AFTER, |law| {
        let setup = setup(&elevator, *law, 3_000.0);
        let plan = Arc::new(mission::demo(&setup));
        fly_plan(&setup, &mission::begin(&plan))
    });
    let [paper, relief] = &flown[..] else { panic!("two laws") };
    assert!(!paper.kept(), "{:?}", paper.lost_s);
    let complete = EventKind::Vehicle(VehicleEvent::PlanComplete);
    assert!(
        relief.kept() && relief.has(complete),
        "{:?} {:?}",
        relief.lost_s,
        relief.events.last()
    );
    println!("mission: paper lost at {:?} s, relief complete", paper.lost_s);
}
