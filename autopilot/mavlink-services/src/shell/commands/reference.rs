//! `reference`: altitude, airspeed, roll angle and course. The aircraft has the limits.

use super::{Answer, Asking, Order, number, usage};
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Reference;

pub(super) fn run(arguments: &[&str], _: &mut Asking) -> Answer {
    let [name, value] = arguments else { return Err(usage("reference")) };
    let (reference, said) = match *name {
        "altitude" => {
            let metres = number(name, value, "m")?;
            (Reference::Altitude(metres), format!("{metres} m"))
        }
        "airspeed" => {
            let speed = number(name, value, "m/s")?;
            (Reference::Airspeed(speed), format!("{speed} m/s"))
        }
        "roll" => {
            let degrees = number(name, value, "deg")?;
            (Reference::Roll(degrees.to_radians()), format!("{degrees} deg"))
        }
        "course" => {
            let degrees = number(name, value, "deg")?;
            if !(0.0..=360.0).contains(&degrees) {
                return Err(format!("course {degrees} deg is outside 0 to 360 deg"));
            }
            (Reference::Course((degrees % 360.0).to_radians()), format!("{degrees} deg"))
        }
        _ => return Err(usage("reference")),
    };
    Ok(Order::ask(VehicleCommand::Refer(reference), format!("Reference {name}: {said}\n")))
}
