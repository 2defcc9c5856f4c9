//! Control allocation beside one control step: bounded weighted least squares with 12 effectors, and the attainable set.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use flight_control::allocation::attainable::axis_reach;
use flight_control::allocation::{ActiveSet, Column, Settings, allocate};
use flight_control::gains::{AllocationMode, CompensatorMode};
use flight_control::{AircraftModel, Demand, FlightControl, Gains, NavigationState};
use icd::{ControlPeriod, EulerAngles, Ned};
use nalgebra::Vector3;

/// Two pairs of ailerons, two elevators, two canards, two rudders, nozzle with two axes: rad/s² per rad.
fn twelve() -> [Column; 12] {
    let column = |roll: f64, pitch: f64, yaw: f64, travel_deg: f64| {
        let travel = travel_deg.to_radians();
        let effect = Vector3::new(roll, pitch, yaw);
        Column { effect, min: -travel, max: travel, preferred: 0.0, weight: 1.0 / travel }
    };
    [
        column(9.0, -0.2, 0.3, 25.0),
        column(-9.0, -0.2, -0.3, 25.0),
        column(6.0, -0.4, 0.2, 20.0),
        column(-6.0, -0.4, -0.2, 20.0),
        column(4.0, -5.0, 0.5, 30.0),
        column(-4.0, -5.0, -0.5, 30.0),
        column(1.0, 3.0, -0.3, 25.0),
        column(-1.0, 3.0, 0.3, 25.0),
        column(0.8, 0.1, -1.6, 30.0),
        column(0.8, -0.1, -1.6, 30.0),
        column(0.0, 2.3, 0.0, 15.0),
        column(0.0, 0.0, 2.0, 15.0),
    ]
}

fn allocation(c: &mut Criterion) {
    let columns = twelve();
    let mut broken = columns;
    // The left elevator sticks at its end; the others have to hold against it.
    (broken[4].min, broken[4].max) = (broken[4].max, broken[4].max);
    let solve = |columns: &[Column], demand: &Vector3<f64>, start: &ActiveSet| {
        allocate(black_box(columns), black_box(demand), &Settings::DEFAULT, start)
    };
    let free = ActiveSet::default();
    for (name, columns, demand) in [
        ("small demand", &columns, Vector3::new(1.0, 0.5, -0.2)),
        ("elevator jammed", &broken, Vector3::new(0.5, 1.0, 0.0)),
        ("not attainable", &broken, Vector3::new(12.0, 6.0, 3.0)),
    ] {
        let warm = solve(columns, &demand, &free);
        assert!(warm.optimal);
        println!("{name}: {} iterations from nothing", warm.iterations);
        c.bench_function(&format!("wls/{name}"), |b| b.iter(|| solve(columns, &demand, &free)));
        c.bench_function(&format!("wls/{name}, from the last step"), |b| {
            b.iter(|| solve(columns, &demand, &warm.active));
        });
    }
    let positions = [0.1; 12];
    c.bench_function("attainable set, three axes", |b| {
        b.iter(|| axis_reach(black_box(&columns), black_box(&positions)));
    });
}

/// One control step with the compensator awake, to compare with; then the same that allocates by least squares, one look
/// at the attainable set in fifty steps included.
fn control_step(c: &mut Criterion) {
    let aircraft: AircraftModel =
        toml::from_str(aircraft::DEFAULT_MODEL).expect("file of the crate");
    let mut gains = Gains::REFERENCE;
    gains.selection.compensator = CompensatorMode::AlwaysOn;
    let demand = Demand { altitude_m: 6_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let trim = &aircraft.trim;
    let state = NavigationState {
        rates: Vector3::new(0.1, 0.02, -0.01),
        attitude: EulerAngles { phi: 0.05, theta: trim.theta_rad, psi: 0.0 },
        velocity: Ned::new(264.0, 0.0, 0.0),
        altitude_m: 5_000.0,
        airspeed_m_s: 264.0,
        alpha: trim.theta_rad,
        beta: 0.01,
        thrust_n: trim.thrust_n,
        ..NavigationState::at_rest()
    };
    for (name, allocation) in [
        ("control step", AllocationMode::Paper),
        ("control step, compensation by wls", AllocationMode::Wls),
        ("control step, compensation by relief", AllocationMode::Relief),
    ] {
        gains.selection.allocation = allocation;
        let mut flight = FlightControl::new(ControlPeriod::DEFAULT, &aircraft, &gains);
        c.bench_function(name, |b| b.iter(|| flight.step(black_box(&state), &demand)));
    }
}

criterion_group!(benches, control_step, allocation);
criterion_main!(benches);
