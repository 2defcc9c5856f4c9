//! How long the detectors take to notice faults, in the same air.

use icd::fault::{FaultKind, Side, Timing, Travel};
use icd::{Effector, SimTime, tvc_jet};
use plant_sim::{Airframe, ScheduledFault};

use super::detectors::{Detectors, KINDS, PerDetector, SCALES};
use super::flights::{CONDITIONS, Condition, setup};
use super::statistics::median;
use super::{Options, StudyError};
use crate::closed_loop::fly;
use crate::runner;

/// The fault begins at this time, s: the turbulence has built up.
const FAULT_S: f64 = 20.0;
/// What is not noticed within this time counts as not noticed, s.
pub const WAITED_S: f64 = 5.0;
/// Flights for each fault, each in air of its own.
pub const SEEDS: u64 = 5;
/// A turn to the right, which the faults of the second half of the list meet.
const ROLL_DEG: f64 = 15.0;

/// A fault and the flight in which it comes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// For people.
    pub name: &'static str,
    /// What breaks.
    pub effector: Effector,
    /// How.
    pub kind: FaultKind,
    /// Altitude reference from the start on, over the altitude of the start, m.
    pub climb_m: f64,
    /// Roll reference from the start on, deg.
    pub roll_deg: f64,
}

const fn stuck(name: &'static str, effector: Effector, deg: f64) -> Fault {
    let angle_rad = deg * crate::metrics::DEG;
    let kind = FaultKind::StuckAt { angle_rad, travel: Travel::Jump };
    Fault { name, effector, kind, climb_m: 0.0, roll_deg: 0.0 }
}

/// The paper's two faults first, then smaller and other ones.
pub const FAULTS: [Fault; 14] = [
    Fault {
        climb_m: 1_000.0,
        ..stuck("case 1: left elevator at +30 deg, in a climb", tvc_jet::LEFT_ELEVATOR, 30.0)
    },
    Fault {
        roll_deg: ROLL_DEG,
        ..stuck("case 2: rudder at +7 deg, in a turn", tvc_jet::RUDDER, 7.0)
    },
    stuck("left elevator at -30 deg", tvc_jet::LEFT_ELEVATOR, -30.0),
    stuck("left elevator at +15 deg", tvc_jet::LEFT_ELEVATOR, 15.0),
    stuck("left elevator at +8 deg", tvc_jet::LEFT_ELEVATOR, 8.0),
    stuck("right elevator at -8 deg", tvc_jet::RIGHT_ELEVATOR, -8.0),
    stuck("rudder at +20 deg", tvc_jet::RUDDER, 20.0),
    stuck("rudder at +3 deg", tvc_jet::RUDDER, 3.0),
    stuck("rudder at -3 deg", tvc_jet::RUDDER, -3.0),
    stuck("right aileron at +25 deg", tvc_jet::RIGHT_AILERON, 25.0),
    stuck("right aileron at +12 deg", tvc_jet::RIGHT_AILERON, 12.0),
    stuck("nozzle in pitch at +15 deg", tvc_jet::NOZZLE_PITCH, 15.0),
    Fault {
        kind: FaultKind::HardOver { side: Side::Negative },
        ..stuck("rudder hard over, by its rate", tvc_jet::RUDDER, 0.0)
    },
    Fault {
        kind: FaultKind::Oscillating { amplitude: 8.0 * crate::metrics::DEG, frequency_hz: 1.0 },
        ..stuck("right elevator oscillates, 8 deg at 1 Hz", tvc_jet::RIGHT_ELEVATOR, 0.0)
    },
];

/// Delays of the detectors for one fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Delays {
    /// The fault.
    pub fault: Fault,
    /// Median over the flights, s; infinite where it is not noticed.
    pub median_s: Box<PerDetector<f64>>,
    /// Longest, s.
    pub longest_s: Box<PerDetector<f64>>,
}

/// Flies every fault in the air of the study, at the design point.
///
/// # Errors
/// [`StudyError`] if a flight cannot be flown.
pub fn measure(options: &Options, airframe: &Airframe) -> Result<Vec<Delays>, StudyError> {
    let items: Vec<(Fault, u64)> =
        FAULTS.iter().flat_map(|fault| (0..SEEDS).map(|seed| (*fault, seed))).collect();
    let one = |(fault, number): &(Fault, u64)| {
        noticed(options, airframe, fault, options.seed.wrapping_add(*number))
    };
    let flights = runner::map("faults", &items, one).into_iter().collect::<Result<Vec<_>, _>>()?;
    let per_fault = flights.chunks(usize::try_from(SEEDS).unwrap_or(1));
    Ok(FAULTS
        .into_iter()
        .zip(per_fault)
        .map(|(fault, flights)| Delays::of(fault, flights))
        .collect())
}

impl Delays {
    fn of(fault: Fault, flights: &[Box<PerDetector<f64>>]) -> Self {
        let mut median_s = Box::new([[0.0; SCALES]; KINDS]);
        let mut longest_s = Box::new([[0.0; SCALES]; KINDS]);
        for kind in 0..KINDS {
            for index in 0..SCALES {
                let all: Vec<f64> = flights.iter().map(|flight| flight[kind][index]).collect();
                longest_s[kind][index] = all.iter().copied().fold(0.0, f64::max);
                median_s[kind][index] = median(all);
            }
        }
        Self { fault, median_s, longest_s }
    }
}

/// Time from the fault until each detector wakes, s. A false alarm before does not count.
fn noticed(
    options: &Options,
    airframe: &Airframe,
    fault: &Fault,
    seed: u64,
) -> Result<Box<PerDetector<f64>>, StudyError> {
    let [_, design, _] = CONDITIONS;
    let Condition { altitude_m, airspeed_m_s } = design;
    let references = format!(
        "[[autopilot.reference]]\nat_s = 0.0\naltitude_m = {altitude_m:?}\nairspeed_m_s = {airspeed_m_s:?}\n\
         roll_deg = 0.0\n[[autopilot.reference]]\nat_s = 17.0\naltitude_m = {:?}\nroll_deg = {:?}\n",
        altitude_m + fault.climb_m,
        fault.roll_deg,
    );
    let duration_s = FAULT_S + WAITED_S;
    let mut setup = setup(options, airframe, &design, seed, &references, duration_s)?;
    let onset = SimTime::from_seconds(FAULT_S).unwrap_or(SimTime::ZERO);
    let (effector, kind, timing) = (fault.effector, fault.kind, Timing::at(onset));
    setup.plant.faults = vec![ScheduledFault { target: effector.into(), kind, timing }];
    let mut detectors = Detectors::new(&setup.parameters.gains.activation, setup.plant.period);
    let mut delays: Box<PerDetector<f64>> = Box::new([[f64::INFINITY; SCALES]; KINDS]);
    fly(&setup, &mut |record| {
        let after_s = record.truth.time.as_seconds() - FAULT_S;
        detectors.step(&record.log.z2, |kind, index| {
            if after_s >= 0.0 && delays[kind][index].is_infinite() {
                delays[kind][index] = after_s;
            }
        });
    })?;
    Ok(delays)
}
