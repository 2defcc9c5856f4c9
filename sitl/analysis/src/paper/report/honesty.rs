//! What the page does not prove.

use maud::{Markup, html};
use plant_sim::FlightLimits;

use super::number;
use crate::metrics::DEG;
use crate::paper::estimates::JUMP_S;
use crate::paper::sensitivity::Sensitivity;

/// Paper, and what could and could not be compared with it.
pub fn what_this_is(limits: &FlightLimits) -> Markup {
    html! {
        p {
            "The paper is Wang, Chen, Ren, Liu, \u{201c}Two-Step Robust Fault-Tolerant Controller Design Based on "
            "NESO for UAVs with Actuator Faults and Disturbances\u{201d}, Drones 2025, 9(3), 183. It prints no "
            "parameters of the aircraft and no gains, and its curves were not available to compare with. So this "
            "page does not say that the curves are those of the paper. It says whether, with one documented set of "
            "parameters and gains, every outcome occurs that the paper describes in words. The limits below put "
            "numbers on those words; they are this project\u{2019}s."
        }
        p {
            "A flight is lost when the magnitude of the roll angle passes " (degrees(limits.roll_rad))
            ", of the angle of attack " (degrees(limits.alpha_rad)) ", of the sideslip " (degrees(limits.beta_rad))
            ", of the pitch angle " (degrees(limits.pitch_rad)) ", or when the altitude falls below "
            (number(limits.altitude_min_m)) " m, at any time. F is the true angular acceleration minus that which the "
            "controller\u{2019}s model gives for healthy effectors at their modelled positions. The jump is the "
            "largest magnitude of F within " (number(JUMP_S)) " s of the fault."
        }
    }
}

fn degrees(angle_rad: f64) -> String {
    format!("{} deg", number(angle_rad / DEG))
}

/// The parameters that carry the result, and what happens with others.
pub fn doubts(sensitivity: &[Sensitivity]) -> Markup {
    html! {
        p {
            "The aircraft is built from an F-16 model, and departs from it where the paper\u{2019}s outcomes could "
            "not occur otherwise: with the elevators of an F-16 a jammed one has several times the moment of the "
            "nozzle, and with its ailerons the PID alone does not lose the roll axis. Weak ailerons and elevators, "
            "the drag (it sets the thrust of level flight, and with it what the nozzle can do), the yaw that an "
            "elevator and an aileron make with their roll being exactly in the same ratio, and a rudder with more "
            "yaw moment than the fin are therefore choices, and the results rest on them. For each, both cases were "
            "flown again in still air with the other value, the controller being told, gains unchanged, and the "
            "limits of claims 1 and 2 counted:"
        }
        table {
            thead { tr {
                th { "Parameter" } th { "What" } th.number { "Here" } th.number { "Instead" } th { "Because" }
                th.number { "Limits held" } th { "Claims broken" }
            } }
            tbody { @for s in sensitivity { tr {
                td { (s.doubt.name) }
                td { (s.doubt.meaning) }
                td.number { (number(s.value)) }
                td.number { (number(s.doubt.instead)) }
                td { (s.doubt.why) }
                @match s.held {
                    Some((held, of)) => {
                        td.number { (held) " of " (of) }
                        td { (if s.broken.is_empty() { "none".to_owned() } else { s.broken.join(", ") }) }
                    }
                    None => { td.number { "none" } td { "cannot be trimmed or controlled" } }
                }
            } } }
        }
        p {
            "The observer is told the compensation that was applied; the paper\u{2019}s equations 21 to 23 leave it "
            "out, while its error equation 26 holds only if it is in. When the compensator wakes is not in the "
            "paper either: here |z2| must exceed a level for some time, because the residual z - y returns to zero "
            "once the observer has converged. Speed hold, limits, lags and rates are this project\u{2019}s too."
        }
    }
}
