//! A wing, a tail half or the fin is torn off in flight: which law keeps the aircraft. docs/faults.md has the campaign.

use autopilot::config;
use autopilot::parameters::Parameters;
use flight_control::{AllocationMode, CompensatorMode, DesignModel, Gains};
use icd::fault::{AirframePart, FaultKind, Timing};
use icd::{ControlPeriod, SimTime};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{self, FlightSetup, Record};
use lab_judges::trace::Sample;
use plant_sim::{Airframe, ReadAirframe as _, Scenario, ScheduledFault};

/// PID alone; with the paper's compensator; with the law beyond the paper.
const PID: (CompensatorMode, AllocationMode) = (CompensatorMode::Off, AllocationMode::Paper);
const PAPER: (CompensatorMode, AllocationMode) = (CompensatorMode::Armed, AllocationMode::Paper);
const RELIEF: (CompensatorMode, AllocationMode) = (CompensatorMode::Armed, AllocationMode::Relief);

struct Flown {
    kept: bool,
    woke: bool,
    largest_roll_deg: f64,
}

/// Straight flight, in which a part loses its outer end at three seconds.
fn fly(part: AirframePart, lost: f64, law: (CompensatorMode, AllocationMode)) -> Flown {
    let airframe = Airframe::paper();
    let nominal = Scenario::from_toml("nominal", scenarios::NOMINAL, &airframe.effectors)
        .expect("a shipped scenario");
    let mut plant = nominal.plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
    let at = SimTime::from_micros(3_000_000);
    let (kind, timing) = (FaultKind::TornOff { lost }, Timing::at(at));
    plant.faults = vec![ScheduledFault { target: part.into(), kind, timing }];
    let mut gains = Gains::REFERENCE;
    gains.selection.compensator = law.0;
    gains.selection.allocation = law.1;
    let setup = FlightSetup {
        plant,
        model: config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL)
            .expect("the shipped model"),
        parameters: Parameters { gains, ..Parameters::default() },
        references: config::references("nominal", scenarios::NOMINAL).expect("a shipped scenario"),
        script: None,
        duration: SimTime::from_micros(40_000_000),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    };
    let (limits, model) = (setup.plant.airframe.limits, DesignModel::new(setup.model));
    let mut flown = Flown { kept: true, woke: false, largest_roll_deg: 0.0 };
    let end = closed_loop::fly(&setup, &mut |record: &Record| {
        let roll_deg = record.truth.euler().phi.to_degrees().abs();
        flown.largest_roll_deg = flown.largest_roll_deg.max(roll_deg);
        flown.kept &= !limits.are_exceeded(&(&Sample::of(&model, record).row).into());
        flown.woke |= record.log.compensator_active;
    })
    .expect("it flies");
    flown.kept &= !end.on_ground;
    flown
}

#[test]
fn the_compensator_keeps_an_aircraft_without_its_fin_or_a_tail_half() {
    for (part, lost) in [(AirframePart::Fin, 0.7), (AirframePart::LeftTail, 1.0)] {
        assert!(!fly(part, lost, PID).kept, "{part:?}: the PID alone");
        let flown = fly(part, lost, PAPER);
        assert!(flown.kept && flown.woke, "{part:?}: with the compensator");
    }
}

#[test]
fn the_law_beyond_the_paper_keeps_an_aircraft_with_half_a_wing() {
    for part in [AirframePart::LeftWing, AirframePart::RightWing] {
        assert!(!fly(part, 0.7, PAPER).kept, "{part:?}: with the paper's allocation");
        let flown = fly(part, 0.7, RELIEF);
        assert!(flown.kept && flown.woke, "{part:?}: {} deg of roll", flown.largest_roll_deg);
    }
}

#[test]
fn every_part_is_felt_and_more_of_it_more() {
    for (part, law) in [(AirframePart::LeftWing, PID), (AirframePart::RightWing, PID)] {
        let roll = [0.1, 0.3, 0.5].map(|lost| fly(part, lost, law).largest_roll_deg);
        assert!(roll[0] > 0.1 && roll[1] > roll[0] && roll[2] > roll[1], "{part:?}: {roll:?} deg");
    }
}
