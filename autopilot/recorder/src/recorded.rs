//! The inputs of a flight from outside the loop, in order: what a replay needs besides the headers.

use icd::fault::{CATALOGUE, PlantAction, PlantRequest};
use icd::pace::Pace;
use icd::wire::Phase;
use icd::{EffectorList, FaultRequest};
use serde::{Deserialize, Serialize};

use flight_management::command::{Command, Configuration, Intent, ScriptCommand, VehicleCommand};
use flight_management::vehicle::Reference;

/// One entry of the topic `recorded`, as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Recorded {
    /// An operator's command, taken before the step of its exchange.
    Intent(Intent),
    /// A request sent to the plant with the answer of its exchange.
    Request(PlantRequest),
    /// The plant had been silent for too long.
    PlantLost,
    /// The plant continues the same flight.
    PlantBack,
}

/// The kind of exchange that an entry belongs to, besides the number of control steps flown before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// In the exchange of a control step.
    Step,
    /// In an exchange while the simulation is paused.
    Holding,
    /// In an exchange on the ground.
    OnGround,
    Between,
}

impl Moment {
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The one with this number.
    pub fn from_code(code: u8) -> Option<Self> {
        [Self::Step, Self::Holding, Self::OnGround, Self::Between]
            .into_iter()
            .find(|moment| moment.code() == code)
    }
}

impl From<Phase> for Moment {
    fn from(phase: Phase) -> Self {
        match phase {
            Phase::Flying => Self::Step,
            Phase::Holding => Self::Holding,
            Phase::OnGround => Self::OnGround,
        }
    }
}

/// Whether it belongs to a stream (setpoints, sticks), which would fill the log.
pub(crate) const fn is_stream(command: &Command) -> bool {
    use VehicleCommand::{Setpoint, Sticks};
    matches!(command, Command::Vehicle(Setpoint(_) | Sticks(_)))
}

/// The codes of faults with their names: `1 stuck_here, 2 stuck_at jump, ...`.
pub(crate) fn fault_kinds() -> String {
    let all = CATALOGUE.iter().flat_map(|kind| {
        let alternatives = kind.choice.map_or(&[][..], |choice| choice.alternatives);
        (kind.code..kind.code + kind.alternatives()).enumerate().map(move |(place, code)| {
            let alternative = alternatives.get(place).map_or("", |one| one.key);
            format!("{code} {} {alternative}", kind.key).trim_end().to_owned()
        })
    });
    all.collect::<Vec<_>>().join(", ")
}

/// Text of an operator's command to an aircraft with these effectors; `None` for streams.
pub fn command_text(command: &Command, effectors: &EffectorList) -> Option<String> {
    match command {
        Command::Vehicle(command) => vehicle_text(command),
        Command::Plant(action) => Some(plant_text(action, effectors)),
        Command::Configuration(configuration) => {
            let text = match configuration {
                Configuration::Gains(_) => "gains",
                Configuration::Limits(_) => "limits of references",
                Configuration::Navigation(_) => "parameters of the guidance",
                Configuration::FaultInjection(true) => "fault injection allowed",
                Configuration::FaultInjection(false) => "fault injection refused",
            };
            Some(text.to_owned())
        }
        Command::Script(ScriptCommand::Run(script)) => Some(format!("script {}", script.name())),
        Command::Script(ScriptCommand::Stop) => Some("stop the script".to_owned()),
    }
}

fn vehicle_text(command: &VehicleCommand) -> Option<String> {
    use VehicleCommand as V;
    Some(match command {
        V::Setpoint(_) | V::Sticks(_) => return None,
        V::Mode(mode) => format!("mode {mode}"),
        V::Refer(Reference::Altitude(m)) => format!("altitude {m:.1} m"),
        V::Refer(Reference::Airspeed(m_s)) => format!("airspeed {m_s:.1} m/s"),
        V::Refer(Reference::Roll(rad)) => format!("roll {:.1} deg", rad.to_degrees()),
        V::Refer(Reference::Course(rad)) => format!("course {:.1} deg", rad.to_degrees()),
        V::Reposition(_) => "reposition".to_owned(),
        V::Plan(plan) => format!("plan of {} items", plan.items.len()),
        V::PlanItem(item) => format!("item {item} of the plan"),
        V::Continue => "go on with the plan".to_owned(),
        V::Home(_) => "home".to_owned(),
        V::Terminate => "terminate the flight".to_owned(),
        V::LinkLost(_) => "the ground station is silent".to_owned(),
        V::LinkBack => "the ground station is back".to_owned(),
    })
}

fn plant_text(action: &PlantAction, effectors: &EffectorList) -> String {
    match action {
        PlantAction::Fault(FaultRequest::Inject { target, kind, timing }) => {
            let kind = kind.described(target.class(effectors));
            format!("fault: {} {kind}{timing}", target.name(effectors))
        }
        PlantAction::Fault(FaultRequest::Clear { target }) => {
            format!("mend {}", target.name(effectors))
        }
        PlantAction::Fault(FaultRequest::ClearAll) => "mend everything".to_owned(),
        PlantAction::Restart => "new flight".to_owned(),
        PlantAction::ListFaults => "the autopilot asks for the faults".to_owned(),
        PlantAction::Pace(Pace::Pause) => "pause".to_owned(),
        PlantAction::Pace(Pace::Run) => "run".to_owned(),
        PlantAction::Pace(Pace::Step(periods)) => format!("step {periods} periods"),
        PlantAction::Pace(Pace::Speed(speed)) => format!("speed x{speed}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_moment_comes_back_from_its_number() {
        for code in 0..4 {
            assert_eq!(Moment::from_code(code).map(Moment::code), Some(code));
        }
        assert_eq!(Moment::from_code(4), None);
    }
}
