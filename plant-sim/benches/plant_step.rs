//! Time of one integration step, one control period and one look at the sensors, on both Earths.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use icd::{Actuators, ControlPeriod};
use plant_sim::atmosphere::LocalDensity;
use plant_sim::dynamics::Held;
use plant_sim::earth::slopes::Slopes;
use plant_sim::faults::Effects;
use plant_sim::{Airframe, EarthModel, Plant, Scenario, scenario};

/// The nominal flight with one step for each period of 2 ms.
fn plant(earth: EarthModel) -> Plant {
    let nominal =
        Scenario::from_toml("nominal.toml", scenario::NOMINAL).expect("file of the crate");
    let mut setup = nominal.plant.setup(Airframe::paper(), 0, ControlPeriod::DEFAULT, 2_000);
    setup.earth = earth;
    Plant::new(&setup).expect("the paper's aircraft can fly")
}

fn bench(c: &mut Criterion) {
    for (name, earth) in [("flat", EarthModel::Flat), ("wgs84", EarthModel::Wgs84)] {
        let mut flight = plant(earth);
        let trim = *flight.trim();
        let commands = trim.positions();
        let dynamics = flight.dynamics().clone();
        let place = dynamics.earth().place(&trim.rigid.position);
        let held = Held {
            commands,
            wind: icd::Ned::zero(),
            gust: plant_sim::wind::Gust::none(),
            density: LocalDensity::around(place.geopotential_altitude_m),
            slopes: Slopes::at(dynamics.earth(), &trim.rigid.position, &place),
            effects: Effects::none(),
        };
        c.bench_function(&format!("rk4_step/{name}"), |b| {
            let state = trim.state();
            b.iter(|| {
                let (state, held) = (black_box(&state), black_box(&held));
                let present = dynamics.present(state, held);
                dynamics.step(state, &present, held, black_box(0.002))
            });
        });
        c.bench_function(&format!("sense_and_truth/{name}"), |b| {
            b.iter(|| (flight.sense(), flight.truth()));
        });
        c.bench_function(&format!("advance_2ms_and_sense/{name}"), |b| {
            let actuators = Actuators { commands };
            b.iter(|| {
                flight.advance(black_box(&actuators));
                black_box(flight.sense());
                black_box(flight.truth());
            });
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
