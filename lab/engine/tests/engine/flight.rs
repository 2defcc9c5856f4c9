//! A flight as a value: it can be copied, and a law of one's own may capture and may fail.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use autopilot::command::{Command, Intent, VehicleCommand};
use autopilot::own_law::OwnLaw;
use autopilot::recorder::Recorded;
use autopilot::vehicle::Mode;
use flight_control::main_controller::pid::Pid;
use flight_control::{Gains, Law, LawInput, MainCommand};
use lab_engine::flight::{Record, Tick};
use lab_engine::law::{FallibleLaw, fallible};
use lab_engine::watch::watch;
use lab_engine::{Flight, FlightSetup, SetupOptions};

/// Steps before a copy is made, and in all.
const BEFORE: u64 = 700;
const STEPS: u64 = 1_500;

/// Everything that carries state from step to step: estimator, turbulence, faults, script, compensator, isolation.
fn options() -> SetupOptions {
    let mut options = SetupOptions::default();
    options
        .set("plant.sensors.grade", "consumer")
        .set("plant.wind.turbulence_m_s", 1.5)
        .set("plant.fault.1.onset_s", 1.0)
        .set("plant.duration_s", 3.0)
        .set("FTC_ALLOC", 2.0);
    options
}

fn own(options: &mut SetupOptions, law: OwnLaw) -> FlightSetup {
    options.laws.set_own_law(&law);
    options.setup("case1").expect("the shipped case")
}

fn rest(flight: &mut Flight) -> Vec<Record> {
    std::iter::from_fn(|| flight.step([]).map(|tick| tick.record())).collect()
}

#[test]
fn a_copied_flight_continues_with_the_bits_of_the_original() {
    let laws = [
        options().setup("case1").expect("the shipped case"),
        own(&mut options(), OwnLaw::new("PID", || Pid::new(&Gains::REFERENCE.pid))),
    ];
    for setup in laws {
        let mut flight = Flight::new(&setup).expect("it can start");
        while flight.steps() < BEFORE {
            flight.step([]).expect("it flies");
        }
        let mut copy = flight.copy().expect("every law here can be copied");
        let (original, copied) = (rest(&mut flight), rest(&mut copy));
        assert_eq!(original.len() as u64, STEPS + 1 - BEFORE);
        assert!(original == copied, "{:?}", setup.own_law);
        assert_eq!(flight.end(), copy.end());
        // The copy is a flight of its own: what happens in it does not reach the original.
        let mut flight = Flight::new(&setup).expect("it can start");
        let mut copy = flight.copy().expect("every law here can be copied");
        let hold = Command::Vehicle(VehicleCommand::Mode(Mode::Hold));
        let intent = Recorded::Intent(Intent { number: 1, command: hold });
        let mode = |tick: Option<Tick<'_>>| tick.expect("it flies").snapshot.mode;
        assert_eq!(mode(copy.step([intent])), Mode::Hold);
        assert_ne!(mode(flight.step([])), Mode::Hold);
    }
}

/// Flies as the PID for some steps.
struct Short {
    pid: Pid,
    left: u32,
    can_copy: bool,
}

impl FallibleLaw for Short {
    fn step(&mut self, input: &LawInput<'_>) -> Result<MainCommand, Box<dyn Error + Send + Sync>> {
        self.left = self.left.checked_sub(1).ok_or("the tape is at its end")?;
        Ok(self.pid.step(input))
    }

    fn copy(&self) -> Option<Box<dyn FallibleLaw>> {
        let Self { pid, left, can_copy } = self;
        let copy = || Self { pid: pid.clone(), left: *left, can_copy: true };
        can_copy.then(|| Box::new(copy()) as Box<dyn FallibleLaw>)
    }
}

fn short(left: u32, can_copy: bool) -> OwnLaw {
    let pid = Pid::new(&Gains::REFERENCE.pid);
    fallible("tape", move || Box::new(Short { pid: pid.clone(), left, can_copy }))
}

#[test]
fn a_law_that_fails_ends_its_flight_after_that_step_with_the_last_command() {
    let setup = own(&mut options(), short(100, true));
    let mut flight = Flight::new(&setup).expect("it can start");
    let mut copy = flight.copy().expect("it can be copied");
    let records = rest(&mut flight);
    assert_eq!(records.len(), 101);
    assert_eq!(records[99].log.main, records[100].log.main);
    let failure = flight.failure().expect("the law has failed").to_string();
    assert_eq!(failure, "the law has failed: the tape is at its end");
    assert!(flight.step([]).is_none() && flight.steps() == 101);
    assert!(rest(&mut copy) == records, "the copy fails in the same step");
    let error = watch(&setup, |_| core::ops::ControlFlow::Continue(())).expect_err("it fails");
    assert_eq!(error.to_string(), failure);
    // The next flight begins with a law of its own.
    assert_eq!(rest(&mut Flight::new(&setup).expect("it can start")).len(), 101);
}

#[test]
fn a_flight_whose_law_cannot_be_copied_cannot_be_copied() {
    let setup = own(&mut options(), short(u32::MAX, false));
    let mut flight = Flight::new(&setup).expect("it can start");
    flight.step([]).expect("it flies");
    let refused = flight.copy().map(drop).expect_err("the law cannot be copied").to_string();
    assert_eq!(refused, "the flight cannot be copied: its law cannot");
    assert!(flight.step([]).is_some(), "the original goes on");
}

/// The PID with what it captures: a bias of the elevator, and a counter that the caller keeps.
#[derive(Clone)]
struct Biased {
    pid: Pid,
    bias_rad: f64,
    steps: Arc<AtomicU64>,
}

impl Law for Biased {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let _ = self.steps.fetch_add(1, Ordering::Relaxed);
        let command = self.pid.step(input);
        MainCommand { elevator_rad: command.elevator_rad + self.bias_rad, ..command }
    }
}

#[test]
fn a_law_has_what_it_captures() {
    let steps = Arc::new(AtomicU64::new(0));
    let first = |bias_rad: f64| {
        let (pid, steps) = (Pid::new(&Gains::REFERENCE.pid), Arc::clone(&steps));
        let law = Biased { pid, bias_rad, steps };
        let setup = own(&mut options(), OwnLaw::new("biased", move || law.clone()));
        let mut flight = Flight::new(&setup).expect("it can start");
        let record = flight.step([]).expect("it flies").record();
        record.log.main.elevator_rad
    };
    let difference = first(0.01) - first(0.0);
    assert!((difference - 0.01).abs() < 1.0e-12, "{difference} rad");
    assert_eq!(steps.load(Ordering::Relaxed), 2);
}
