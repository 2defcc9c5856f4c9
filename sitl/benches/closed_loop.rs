//! One control tick in process: plant, laws, and both sides of the link without a socket.

use autopilot::autopilot::Autopilot;
use criterion::{Criterion, criterion_group, criterion_main};
use flight_control::{Demand, FlightControl, Navigator};
use icd::lockstep::{FlightEvent, FlightSide, PlantEvent, PlantSide};
use icd::tvc_jet;
use icd::wire::{Phase, Reports};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::FlightSetup;
use plant_sim::Plant;

fn setup(step_us: u32) -> FlightSetup {
    let options = SetupOptions { step_us: Some(step_us), ..SetupOptions::default() };
    options.setup("case1").expect("the shipped files are right")
}

/// A tick of the loop without link.
fn direct(c: &mut Criterion) {
    for step_us in [2_000, 1_000] {
        let setup = setup(step_us);
        let mut plant = Plant::new(&setup.plant).expect("the shipped setup flies");
        let mut autopilot = Autopilot::new(&setup.settings());
        autopilot.begin_flight(setup.plant.period, plant.time(), false);
        c.bench_function(&format!("closed loop tick, plant step {step_us} us"), |b| {
            b.iter(|| {
                let sensors = plant.sense();
                let actuators = autopilot.step(plant.time(), &sensors).actuators();
                while autopilot.pop_event().is_some() {}
                plant.advance(&actuators);
                actuators
            });
        });
        assert!(!plant.on_ground(), "the bench has measured a plant that stands still");
    }
}

/// One control step alone: navigator, laws, observer and compensator, awake.
fn control(c: &mut Criterion) {
    let setup = setup(1_000);
    let mut plant = Plant::new(&setup.plant).expect("the shipped setup flies");
    let mut flight = FlightControl::new(setup.plant.period, &setup.model, &setup.parameters.gains);
    let demand = Demand { altitude_m: 6_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let mut navigator = Navigator::default();
    let mut step =
        |time, sensors: &icd::Sensors| flight.step(&navigator.step(time, sensors), &demand);
    // Four seconds: the fault of case 1 acts and the compensator is awake.
    for _ in 0..2_000 {
        let log = step(plant.time(), &plant.sense());
        plant.advance(&log.actuators());
    }
    let sensors = plant.sense();
    let time = plant.time();
    assert!(step(time, &sensors).compensator_active);
    c.bench_function("control step", |b| b.iter(|| step(time, &sensors)));
}

/// What the link adds, without the socket: both packets encoded, checked and decoded.
fn link(c: &mut Criterion) {
    let setup = setup(1_000);
    let mut plant = Plant::new(&setup.plant).expect("the shipped setup flies");
    let sensors = plant.sense();
    let plant_address = std::net::SocketAddr::from((std::net::Ipv4Addr::LOCALHOST, 1));
    let mut plant_side = PlantSide::new(1, tvc_jet::aircraft());
    let mut flight_side = FlightSide::new(tvc_jet::aircraft());
    let mut autopilot = Autopilot::new(&setup.settings());
    let actuators = autopilot.step(plant.time(), &sensors).actuators();
    c.bench_function("link exchange without socket", |b| {
        b.iter(|| {
            let period = setup.plant.period;
            let question = plant_side.begin_exchange(
                plant.time(),
                Phase::Flying,
                period,
                &sensors,
                Reports::new(),
                &[],
            );
            let event = flight_side.handle(question, plant_address, false);
            assert!(matches!(event, FlightEvent::NewFlight(_) | FlightEvent::Next(_)));
            let answer = flight_side.answer(&actuators, None, false).expect("there is a question");
            assert!(matches!(plant_side.handle(answer), PlantEvent::Answer(_)));
        });
    });
}

criterion_group!(benches, direct, control, link);
criterion_main!(benches);
