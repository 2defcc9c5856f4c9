//! Figures 4 to 9 of the paper and the survival curve.

use std::fmt;

use super::cases::Flown;
use crate::chart::panel::Mark;
use crate::chart::{Figure, Ink, Pattern};

mod deflections;
mod estimate;
mod response;
mod survive;

pub use survive::survival;

/// Flight without fault.
const NO_FAULT: Ink = Ink::new("#0050aa", Pattern::Solid);
/// Flight with the PID only.
const PID_ONLY: Ink = Ink::new("#c81e1e", Pattern::Dashed);
/// Flight with the compensator.
const COMPENSATED: Ink = Ink::new("#007d37", Pattern::Dotted).wide(2.5);
/// Vertical line at the fault.
const FAULT: Ink = Ink::new("#464646", Pattern::Fine);
/// Vertical line where the flight with the PID only is lost.
const LOST: Ink = Ink::new(PID_ONLY.colour, Pattern::Fine);

/// Figures 4 to 9.
#[must_use]
pub fn of_the_paper(case1: &Flown, case2: &Flown) -> Vec<Figure> {
    vec![
        response::figure_4(case1),
        estimate::figure("fig5", "Figure 5", case1),
        deflections::figure("fig6", "Figure 6", case1),
        response::figure_7(case2),
        estimate::figure("fig8", "Figure 8", case2),
        deflections::figure("fig9", "Figure 9", case2),
    ]
}

/// The vertical line at the fault.
fn fault_mark(flown: &Flown) -> Mark {
    let label = format!("fault, at {} s", flown.case.fault_s);
    Mark { x: flown.case.fault_s, number: None, ink: FAULT, label }
}

/// What breaks in a case, for titles.
struct FaultName<'a>(&'a Flown);

impl fmt::Display for FaultName<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let case = &self.0.case;
        match case.setup.plant.faults.first() {
            Some(fault) => {
                let angle = case.jam_rad.to_degrees();
                let name = fault.target.name(&case.setup.plant.airframe.effectors);
                write!(f, "{name} jams at {angle:+.0} deg at {} s", case.fault_s)
            }
            None => f.write_str("no fault"),
        }
    }
}
