//! The pure crates in a program without `std` and without an allocator.
//!
//! Its own panic handler: a second one, which `std` would link, is an error. No global allocator:
//! `alloc` in any dependency is an error.

#![no_std]

use core::net::SocketAddr;
use core::panic::PanicInfo;

use flight_control::{AircraftModel, Demand, FlightControl, Gains, Navigator, StepLog};
use icd::lockstep::{FlightEvent, FlightSide};
use icd::{ControlPeriod, Sensors, SimTime};

/// Navigator and laws, from construction to one step.
#[used]
static STEP: fn(ControlPeriod, &AircraftModel, &Gains, &Sensors, &Demand) -> StepLog = step;

/// The link, from datagram to event.
#[used]
static HANDLE: for<'a> fn(&'a mut FlightSide, &[u8], SocketAddr, bool) -> FlightEvent<'a> =
    FlightSide::handle;

fn step(
    period: ControlPeriod,
    model: &AircraftModel,
    gains: &Gains,
    sensors: &Sensors,
    demand: &Demand,
) -> StepLog {
    let state = Navigator::default().step(SimTime::ZERO, sensors);
    FlightControl::new(period, model, gains).step(&state, demand)
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {}
}
