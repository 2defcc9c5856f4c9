//! Whether the isolation names the effectors that failed.

use autopilot::event::EventKind;
use flight_control::isolation::Verdict;
use icd::Effector;
use icd::fault::Target;
use lab_engine::FlightSetup;
use lab_engine::flight::Tick;

use crate::{Judge, onset_s};

/// Numbers of the judge: names in the flight; after the onset of the first fault when the detector was awake, when an effector was named,
/// when the right ones were; whether others ever were; at the end, of faults that were detected, whether the right ones are named, others,
/// or no one.
pub const COLUMNS: [(&str, &str); 9] = [
    ("names", "1"),
    ("detected", "1"),
    ("detected_after", "s"),
    ("named_after", "s"),
    ("right_after", "s"),
    ("ever_wrong", "1"),
    ("right_at_end", "1"),
    ("wrong_at_end", "1"),
    ("no_one_at_end", "1"),
];

/// Looks at the verdicts of a flight.
#[derive(Debug, Clone, Default)]
pub struct VerdictJudge {
    /// The effectors that fail, in the order of the list, and when the first one does, s.
    broken: [Option<Effector>; 2],
    onset_s: Option<f64>,
    is_begun: bool,
    names: u32,
    detected_s: Option<f64>,
    named_s: Option<f64>,
    right_s: Option<f64>,
    is_ever_wrong: bool,
    verdict: Option<Verdict>,
}

impl VerdictJudge {
    pub fn of(setup: &FlightSetup) -> Self {
        let faults = &setup.plant.faults;
        let broken = |effector: &Effector| {
            faults.iter().any(|fault| fault.target == Target::Effector(*effector))
        };
        // The isolation names two at most.
        let mut broken = setup.plant.airframe.effectors.all().filter(broken);
        Self {
            broken: [broken.next(), broken.next()],
            onset_s: faults.iter().map(onset_s).reduce(f64::min),
            ..Self::default()
        }
    }
}

impl Judge for VerdictJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        self.is_begun = true;
        self.verdict = tick.log.isolation.verdict;
        let now_s = tick.exchange.time.as_seconds();
        let after_s = self.onset_s.map(|onset_s| now_s - onset_s).filter(|after| *after >= 0.0);
        if let Some(after_s) = after_s
            && tick.log.compensator_active
        {
            self.detected_s.get_or_insert(after_s);
        }
        for event in tick.events {
            let EventKind::Isolated(verdict) = event.kind else { continue };
            self.names += 1;
            let Some(after_s) = after_s else { continue };
            self.named_s.get_or_insert(after_s);
            match verdict.effectors == self.broken {
                true => _ = self.right_s.get_or_insert(after_s),
                false => self.is_ever_wrong = true,
            }
        }
    }

    fn values(&self) -> Vec<Option<f64>> {
        let flag = |holds: bool| f64::from(u8::from(holds));
        let of_fault = |holds| self.onset_s.filter(|_| self.is_begun).map(|_| flag(holds));
        let at_end = |holds: bool| self.detected_s.map(|_| flag(holds));
        let is_right = self.verdict.map(|verdict| verdict.effectors == self.broken);
        vec![
            self.is_begun.then_some(f64::from(self.names)),
            of_fault(self.detected_s.is_some()),
            self.detected_s,
            self.named_s,
            self.right_s,
            at_end(self.is_ever_wrong),
            at_end(is_right == Some(true)),
            at_end(is_right == Some(false)),
            at_end(is_right.is_none()),
        ]
    }
}
