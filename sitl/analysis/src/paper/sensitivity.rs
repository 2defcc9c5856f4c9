//! How the outcomes depend on the parameters that a reader will doubt.
//!
//! The paper prints no parameters. Here one of this project's is replaced by another value, the controller is
//! told (its model is derived anew), and both cases are flown again.

use rayon::prelude::*;

use super::cases::{Case, Conditions, Run, Runs};
use super::{PaperError, case1, case2, in_process};
use crate::configuration::AircraftArgs;
use crate::linearize::linearize;

/// A parameter that a reader will doubt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// Letters (docs/parameter-set.md).
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// The value to try instead, of surfaces that of the left one.
    pub instead: f64,
    /// Where that value comes from.
    pub why: &'static str,
}

/// Values of the F-16 (NASA S-119 model at 2.5 deg of incidence), from which the aircraft departs, and the two
/// other ratios of yaw to roll that were tried.
pub const DOUBTS: [Doubt; 12] = [
    f16("Cmde", "pitch moment of an elevator", -0.28),
    f16("CLde", "lift of an elevator", 0.218),
    f16("Clda", "roll moment of an aileron", 0.073_75),
    f16("Cma", "pitch stiffness", 0.05),
    f16("Cnb", "yaw stiffness", 0.212),
    f16("Clb", "dihedral effect", -0.115),
    f16("Clp", "roll damping", -0.43),
    f16("CD0", "drag, which sets the thrust and with it the nozzle's authority", 0.020),
    f16("Cndr", "yaw moment of the rudder", -0.0859),
    ratio("rCnde", "yaw over roll moment of an elevator", 0.15),
    ratio("rCnde", "yaw over roll moment of an elevator", 0.22),
    ratio("rCnda", "yaw over roll moment of the ailerons", 0.15),
];

const fn f16(name: &'static str, meaning: &'static str, instead: f64) -> Doubt {
    Doubt { name, meaning, instead, why: "F-16" }
}

const fn ratio(name: &'static str, meaning: &'static str, instead: f64) -> Doubt {
    Doubt { name, meaning, instead, why: "not equal to the other one" }
}

/// What becomes of the claims with another value.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The parameter.
    pub doubt: Doubt,
    /// This project's value.
    pub value: f64,
    /// Limits of claims 1 and 2 that are met, and how many there are; `None` if the aircraft cannot be trimmed
    /// or the controller cannot be told.
    pub held: Option<(usize, usize)>,
    /// Claims of which a limit is not met.
    pub broken: Vec<&'static str>,
}

/// Flies both cases for each doubt.
///
/// # Errors
/// [`PaperError`] if a file or a value is not what it should be.
pub fn study(
    conditions: &Conditions,
    aircraft: &AircraftArgs,
) -> Result<Vec<Sensitivity>, PaperError> {
    let still = Conditions { gyro_noise_rad_s: 0.0, turbulence_m_s: 0.0, ..*conditions };
    let cases = [Case::with(1, &still, aircraft)?, Case::with(2, &still, aircraft)?];
    DOUBTS.par_iter().map(|doubt| one(&cases, doubt)).collect()
}

fn one(cases: &[Case; 2], doubt: &Doubt) -> Result<Sensitivity, PaperError> {
    let mut airframe = cases[0].setup.plant.airframe.clone();
    let unknown = || crate::dispersion::UnknownDerivative { name: doubt.name.to_owned() };
    let value = airframe.set_derivative(doubt.name, doubt.instead).ok_or_else(unknown)?;

    let mut results = Vec::new();
    for case in cases {
        let mut case = case.with_airframe(airframe.clone());
        let model = linearize(&case.setup.plant, &[]).ok().filter(|b| b.validate().is_ok());
        let Some(model) = model else {
            return Ok(Sensitivity { doubt: *doubt, value, held: None, broken: Vec::new() });
        };
        case.setup.model = model;
        let fly = |run| case.fly(run, &in_process);
        let (no_fault, pid_only, compensated) =
            (fly(Run::NoFault)?, fly(Run::PidOnly)?, fly(Run::Compensated)?);
        let runs = Runs {
            case: &case,
            no_fault: &no_fault,
            pid_only: &pid_only,
            compensated: &compensated,
        };
        results.extend(match case.number {
            1 => case1::claims(&runs),
            _ => case2::claims(&runs),
        });
    }
    let mut broken: Vec<_> = results.iter().filter(|r| !r.pass).map(|r| r.id).collect();
    broken.dedup();
    let held = results.iter().filter(|r| r.pass).count();
    Ok(Sensitivity { doubt: *doubt, value, held: Some((held, results.len())), broken })
}
