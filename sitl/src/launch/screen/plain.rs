//! Plain lines: for a file instead of a terminal, and after the flight.

use std::path::Path;

use autopilot::io::status::{FlightStatus, PlantState};

use super::view::{compensator_words, fault_words};
use crate::launch::pace::Passing;

/// The flight now.
pub(super) fn line(flight: &FlightStatus, passing: Passing, achieved: Option<f64>) -> String {
    let FlightStatus { plant, t_s, altitude_m, airspeed_m_s, roll_deg, mode, .. } = flight;
    let speed = passing.words(achieved);
    // Single steps are to be seen.
    let time = if passing.paused { format!("{t_s:11.3}") } else { format!("{t_s:9.1}") };
    let (_, compensator) = compensator_words(flight);
    let plant = match plant {
        PlantState::Flying => "",
        PlantState::OnGround => "   ON THE GROUND",
        PlantState::Lost => "   PLANT LOST",
    };
    let faults = flight.faults.iter().map(|fault| format!("   fault: {}", fault_words(fault)));
    let faults: String = faults.collect();
    format!(
        "t {time} s   altitude {altitude_m:6.0} m   speed {airspeed_m_s:6.1} m/s   roll {roll_deg:6.1} deg   \
         compensator {compensator}   {mode}   {speed}{plant}{faults}"
    )
}

/// What became of the flight, as far as it was reported.
pub(super) fn outcome(flight: &FlightStatus) -> Vec<String> {
    let FlightStatus { plant, t_s, altitude_m, airspeed_m_s, .. } = flight;
    let state = match plant {
        PlantState::Flying => format!("in the air, {altitude_m:.0} m, {airspeed_m_s:.1} m/s"),
        PlantState::OnGround => "on the ground: the flight is over".to_owned(),
        PlantState::Lost => format!("the plant was lost in the air, at {altitude_m:.0} m"),
    };
    let (_, compensator) = compensator_words(flight);
    let mut lines = vec![format!("ended at {t_s:.1} s   {state}   compensator {compensator}")];
    lines.extend(
        flight.faults.iter().map(|fault| format!("fault            {}", fault_words(fault))),
    );
    if flight.more_faults > 0 {
        lines.push(format!("                 and {} more", flight.more_faults));
    }
    lines
}

/// Where the log of the flight is.
pub(super) fn flight_log(path: &Path) -> String {
    format!("flight log       {}", path.display())
}

/// How to look at the log.
pub(super) fn how_to_draw(path: &Path, program: &Path) -> String {
    format!("draw it          {} plot '{}'", program.display(), path.display())
}

#[cfg(test)]
mod tests {
    use super::super::view::tests::flight;
    use super::*;

    #[test]
    fn the_line_tells_a_switched_off_compensator_from_a_sleeping_one() {
        let mut flight = flight();
        let expected = "t      12.3 s   altitude   5000 m   speed  264.0 m/s   roll   -0.2 deg   \
                        compensator asleep   Hold   x1.0";
        let running = Passing { paused: false, speed: Some(1.0) };
        assert_eq!(line(&flight, running, None), expected);
        flight.compensator_active = true;
        assert!(line(&flight, running, None).contains("compensator fault seen, off"));
        flight.fade = 0.5;
        assert!(line(&flight, running, None).contains("compensator ACTIVE 50 %"));
        let paused = line(&flight, Passing { paused: true, speed: None }, None);
        assert!(paused.starts_with("t      12.340 s ") && paused.ends_with("PAUSED"), "{paused}");
    }

    #[test]
    fn after_the_flight_it_is_said_how_it_ended_and_what_was_broken() {
        let mut flight = flight();
        flight.faults = super::super::view::tests::faults(1);
        let said = outcome(&flight);
        assert!(said[0].starts_with("ended at 12.3 s   in the air, 5000 m"), "{said:?}");
        assert!(said[1].ends_with("left elevator stuck at 30.0 deg, since 3.0 s"), "{said:?}");
        flight.plant = PlantState::OnGround;
        assert!(outcome(&flight)[0].contains("on the ground"));
        flight.plant = PlantState::Lost;
        assert!(outcome(&flight)[0].contains("the plant was lost in the air"));
    }
}
