//! A control step allocates nothing.
#![allow(unsafe_code, reason = "a counting allocator cannot be written without")]

mod flights;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use flight_control::{Demand, FlightControl};
use plant_sim::{EarthModel, Plant};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting for each thread.
struct Counting;

// SAFETY: every call is passed on unchanged to the system's allocator.
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
    let mut flight = FlightControl::new(setup.plant.period, &setup.belief, &setup.gains);
    let demand = Demand { altitude_m: 6_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let before = allocations();
    let mut woke = false;
    for _ in 0..5_000 {
        let sensors = plant.sense();
        let output = flight.step(&sensors, &demand);
        woke |= output.log.compensator_active;
        plant.advance(&output.actuators);
        while plant.pop_report().is_some() {}
    }
    assert_eq!(allocations() - before, 0);
    assert!(woke, "the fault was part of it");
}
