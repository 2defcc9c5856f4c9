//! A control step allocates nothing.
#![allow(unsafe_code, reason = "a counting allocator cannot be written without")]

#[allow(dead_code, reason = "the other flights are for the program `system`")]
#[path = "system/flights.rs"]
mod flights;

use autopilot::command::VehicleCommand;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use autopilot::autopilot::Autopilot;
use autopilot::command::{Command, Intent};
use autopilot::event::EventKind;
use autopilot::vehicle::{Mode, VehicleEvent};
use flight_control::{Demand, FlightControl, Navigator};
use icd::fault::{FaultReply, PlantReport, Repeat, Timing};
use icd::tvc_jet;
use icd::{Actuators, FaultKind, FaultRequest};
use plant_sim::{EarthModel, GradeName, Plant, grade_file};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting for each thread.
struct Counting;

// SAFETY: every call goes unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

#[test]
fn the_counter_counts() {
    let before = allocations();
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(allocations(), before + 1);
}

#[test]
fn a_control_step_and_a_plant_step_allocate_nothing_also_through_a_fault() {
    let setup = flights::case_1(EarthModel::Wgs84);
    let mut plant = Plant::new(&setup.plant).expect("the shipped aircraft");
    let mut flight = FlightControl::new(setup.plant.period, &setup.model, &setup.parameters.gains);
    let mut navigator = Navigator::default();
    let demand = Demand { altitude_m: 6_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let before = allocations();
    let mut woke = false;
    for _ in 0..5_000 {
        let state = navigator.step(plant.time(), &plant.sense());
        let log = flight.step(&state, &demand);
        woke |= log.compensator_active;
        plant.advance(&log.actuators());
        while plant.pop_report().is_some() {}
    }
    assert_eq!(allocations() - before, 0);
    assert!(woke, "the fault was part of it");
}

#[test]
fn a_control_step_on_estimated_states_allocates_nothing() {
    let mut setup = flights::case_1(EarthModel::Wgs84);
    setup.plant.sensors = grade_file::of_grade(GradeName::Consumer);
    let mut plant = Plant::new(&setup.plant).expect("the shipped aircraft");
    let mut autopilot = Autopilot::new(&setup.settings());
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    let before = allocations();
    for _ in 0..5_000 {
        let sensors = plant.sense();
        let log = *autopilot.step(plant.time(), &sensors);
        while autopilot.pop_event().is_some() {}
        plant.advance(&log.actuators());
        while plant.pop_report().is_some() {}
    }
    assert_eq!(allocations() - before, 0);
    assert!(autopilot.estimator().is_some(), "it was part of it");
}

#[test]
fn faults_that_come_and_go_allocate_nothing() {
    let setup = flights::case_1(EarthModel::Wgs84);
    let mut plant = Plant::new(&setup.plant).expect("the shipped aircraft");
    let actuators = Actuators::new(plant.trim().positions());
    let repeat = Some(Repeat { every_s: 0.5, times: None });
    let timing = Timing { duration_s: Some(0.3), repeat, ramp_s: 0.1, ..Timing::NOW };
    let kinds = [
        FaultKind::Delayed { delay_s: 1.0 },
        FaultKind::Oscillating { amplitude: 0.1, frequency_hz: 5.0 },
        FaultKind::Intermittent { period_s: 0.05, present: 0.5 },
        FaultKind::LimitedTravel { limit: 0.1 },
        FaultKind::Slow { rate: 0.1 },
    ];
    let before = allocations();
    let mut acted = 0_u32;
    for (effector, kind) in tvc_jet::ALL.into_iter().zip(kinds) {
        let reply = plant.request(&FaultRequest::Inject { target: effector.into(), kind, timing });
        assert!(matches!(reply, FaultReply::Applied { .. }), "{reply:?}");
    }
    for _ in 0..2_000 {
        plant.advance(&actuators);
        while let Some(report) = plant.pop_report() {
            acted += u32::from(matches!(report, PlantReport::Fault(_)));
        }
    }
    plant.request(&FaultRequest::ClearAll);
    assert_eq!(allocations() - before, 0);
    assert!(acted > 50, "{acted} reports of faults");
}

#[test]
fn a_control_step_of_a_mission_allocates_nothing() {
    let out = std::path::PathBuf::new();
    let earth = EarthModel::Wgs84;
    let options = lab_studies::mission::MissionOptions {
        earth,
        wind_m_s: 20.0,
        turbulence_m_s: 1.5,
        plan: None,
        land_at_s: None,
        seed: 1,
        out,
        aircraft: lab_engine::configuration::AircraftArgs::default(),
        laws: autopilot::run::LawArgs::default(),
    };
    let setup = lab_studies::mission::setup(&options).expect("the shipped aircraft");
    let plan = std::sync::Arc::new(lab_studies::mission::demo(&setup));
    let mut plant = Plant::new(&setup.plant).expect("the shipped aircraft");
    let mut autopilot = Autopilot::new(&setup.settings());
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    autopilot.step(plant.time(), &plant.sense());
    for (number, command) in (1..).zip([
        Command::Vehicle(VehicleCommand::Plan(plan)),
        Command::Vehicle(VehicleCommand::Mode(Mode::Mission)),
    ]) {
        autopilot.handle_intent(Intent { number, command });
    }
    let before = allocations();
    let mut reached = 0;
    // 260 s: two legs, a change of speed, and the way to a circle.
    for _ in 0..130_000 {
        let sensors = plant.sense();
        let log = *autopilot.step(plant.time(), &sensors);
        while let Some(event) = autopilot.pop_event() {
            reached +=
                u32::from(matches!(event.kind, EventKind::Vehicle(VehicleEvent::ItemReached(_))));
        }
        plant.advance(&log.actuators());
    }
    assert_eq!(allocations() - before, 0);
    assert_eq!(reached, 3, "items were part of it");
}
