//! Time of one integration step, one control period and one reading of the sensors, on both Earths.

use std::hint::black_box;

use aircraft::F16_AIRFRAME;
use criterion::{Criterion, criterion_group, criterion_main};
use icd::{Actuators, Body, ControlPeriod, PerEffector};
use plant_sim::aerodynamics::{AirState, Surfaces, coefficients};
use plant_sim::atmosphere::{Atmosphere, LocalDensity};
use plant_sim::dynamics::StepInputs;
use plant_sim::earth::Slopes;
use plant_sim::faults::Effects;
use plant_sim::tables::aerodynamics::TableAero;
use plant_sim::tables::thrust::{EngineAir, Propulsion};
use plant_sim::{Airframe, EarthModel, Plant, ReadAirframe as _, Scenario};

/// The nominal flight with one step for each period of 2 ms.
fn plant(airframe: Airframe, earth: EarthModel) -> Plant {
    let nominal = Scenario::from_toml("nominal.toml", scenarios::NOMINAL, &airframe.effectors)
        .expect("file of the crate");
    let mut setup = nominal.plant.setup(airframe, 0, ControlPeriod::DEFAULT, 2_000);
    setup.earth = earth;
    Plant::new(&setup).expect("an aircraft that can fly")
}

fn bench(c: &mut Criterion) {
    let f16 = Airframe::from_toml("f16.toml", F16_AIRFRAME).expect("file of the crate");
    for (name, airframe, earth) in [
        ("flat", Airframe::paper(), EarthModel::Flat),
        ("wgs84", Airframe::paper(), EarthModel::Wgs84),
        ("flat, F-16", f16.clone(), EarthModel::Flat),
        ("wgs84, F-16", f16, EarthModel::Wgs84),
    ] {
        let mut flight = plant(airframe, earth);
        let trim = *flight.trim();
        let commands = trim.positions();
        let dynamics = flight.dynamics().clone();
        let place = dynamics.earth().place(&trim.rigid.position);
        let inputs = StepInputs {
            commands,
            wind: icd::Ned::zero(),
            gust: plant_sim::wind::Gust::none(),
            density: LocalDensity::of(&Atmosphere::STANDARD, place.geopotential_altitude_m),
            slopes: Slopes::at(dynamics.earth(), &trim.rigid.position, &place),
            effects: Effects::none(),
        };
        c.bench_function(&format!("rk4_step/{name}"), |b| {
            let state = trim.state();
            b.iter(|| {
                let (state, inputs) = (black_box(&state), black_box(&inputs));
                let present = dynamics.present(state, inputs);
                dynamics.step(state, &mut PerEffector::default(), &present, inputs, 0.002)
            });
        });
        c.bench_function(&format!("sense_and_truth/{name}"), |b| {
            b.iter(|| (flight.sense(), *flight.truth()));
        });
        c.bench_function(&format!("advance_2ms_and_sense/{name}"), |b| {
            let actuators = Actuators::new(commands);
            b.iter(|| {
                flight.advance(black_box(&actuators));
                black_box(flight.sense());
                black_box(flight.truth());
            });
        });
    }
}

/// Forces by derivatives and by tables, side by side: their share of one evaluation of the derivative.
fn forces(c: &mut Criterion) {
    let airframe = Airframe::paper();
    let air = AirState {
        airspeed_m_s: 180.0,
        alpha_rad: 0.06,
        beta_rad: 0.02,
        rates: Body::new(0.1, 0.05, -0.1),
    };
    let deflections = PerEffector::from_fn(|_| 0.05);
    let ours = Surfaces::new(&airframe.effectors, &airframe.surface_derivatives);
    let derivatives = airframe.aero.derivatives().expect("file of the crate");
    c.bench_function("aerodynamics/derivatives", |b| {
        b.iter(|| coefficients(derivatives, &ours, black_box(&air), black_box(&deflections)));
    });
    let f16: toml::Table = toml::from_str(F16_AIRFRAME).expect("file of the crate");
    let aero: TableAero = f16["aerodynamics"].clone().try_into().expect("file of the crate");
    let surfaces = ["left_aileron", "right_aileron", "left_elevator", "right_elevator", "rudder"];
    let aero = aero.build(&surfaces.map(|name| format!("{name}_rad"))).expect("file of the crate");
    c.bench_function("aerodynamics/tables of the F-16", |b| {
        b.iter(|| aero.coefficients(black_box(&air), black_box(0.5), black_box(&[0.05; 5])));
    });
    let engine: Propulsion = f16["propulsion"].clone().try_into().expect("file of the crate");
    let engine = engine.build().expect("file of the crate");
    let at = EngineAir { airspeed_m_s: 180.0, density: 0.9, mach: 0.5, altitude_m: 3_000.0 };
    c.bench_function("thrust/tables of the F-16", |b| {
        b.iter(|| engine.ends(black_box(&at)));
    });
}

criterion_group!(benches, bench, forces);
criterion_main!(benches);
