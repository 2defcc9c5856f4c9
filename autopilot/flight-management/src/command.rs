//! Commands of operators, for the vehicle, the plant, the configuration or the script, and their outcomes.

use std::sync::Arc;

use flight_control::Gains;
use icd::FaultRequest;
use icd::fault::{FaultReply, PlantAction};
use icd::pace::Pace;
use serde::{Deserialize, Serialize};

use crate::script::Script;
use crate::vehicle::fence::{Fence, RallyPoint};
use crate::vehicle::plan::Plan;
use crate::vehicle::{
    LinkLossAction, Mode, NavigationParameters, Place, Reference, ReferenceLimits, Reposition,
    Setpoint, Sticks, VehicleRefusal,
};

/// First number of requests of scripts to the plant; those of intents are smaller.
pub const FIRST_SCRIPT_REQUEST: u32 = 0x8000_0000;

/// A numbered command, so that its outcome can be assigned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Intent {
    /// Number that [`crate::event::EventKind::Outcome`] repeats, less than [`FIRST_SCRIPT_REQUEST`].
    pub number: u32,
    /// The command.
    pub command: Command,
}

/// A command, by the component that executes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "Logged", into = "Logged")]
pub enum Command {
    /// For the vehicle, which executes or refuses it.
    Vehicle(VehicleCommand),
    /// For the plant, which executes or refuses it; the autopilot forwards it without reading it.
    Plant(PlantAction),
    /// New parameters for the control side, already validated.
    Configuration(Configuration),
    /// Starts or stops a script.
    Script(ScriptCommand),
}

macro_rules! from_group {
    ($($group:ident($kind:ty)),*) => {
        $(impl From<$kind> for Command {
            fn from(command: $kind) -> Self {
                Self::$group(command)
            }
        })*
    };
}
from_group!(
    Vehicle(VehicleCommand),
    Plant(PlantAction),
    Configuration(Configuration),
    Script(ScriptCommand)
);

/// A command for the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleCommand {
    /// Change the mode.
    Mode(Mode),
    /// Change a reference.
    Refer(Reference),
    /// Fly to a place and circle there.
    Reposition(Reposition),
    /// A setpoint of an offboard stream.
    Setpoint(Setpoint),
    /// Positions of a pilot's sticks.
    Sticks(Sticks),
    /// Replace the plan.
    Plan(Arc<Plan>),
    /// Continue with this item of the plan.
    PlanItem(u16),
    /// Resume the plan that was paused.
    Continue,
    /// Replace the fence.
    Fence(Arc<Fence>),
    /// Replace the rally points.
    Rally(Arc<[RallyPoint]>),
    /// Switch the fence on or off.
    EnableFence(bool),
    /// Begin the landing of the plan.
    Land,
    /// End an approach: climb to this altitude above the ellipsoid, m, and fly it again.
    GoAround(Option<f64>),
    /// Arm, or disarm, standing on the ground.
    Arm(bool),
    /// Take off and climb to this altitude above the ellipsoid, m, once armed.
    TakeOff(Option<f64>),
    /// Location of home; its altitude is that of the ground.
    Home(Place),
    /// End the flight: engine off, surfaces to the stops. Only a new flight undoes it.
    Terminate,
    /// The controlling ground station has fallen silent.
    LinkLost(LinkLossAction),
    /// The controlling ground station is back: undo the reaction to its silence.
    LinkBack,
}

/// New parameters for the control side.
#[derive(Debug, Clone, PartialEq)]
pub enum Configuration {
    /// A validated set of gains.
    Gains(Box<Gains>),
    /// Limits of references.
    Limits(ReferenceLimits),
    /// Parameters of the guidance.
    Navigation(NavigationParameters),
    /// Whether scripts may inject faults (`SYS_FAILURE_EN`).
    FaultInjection(bool),
}

/// A command about the script of the flight.
#[derive(Debug, Clone, PartialEq)]
pub enum ScriptCommand {
    /// Run a script instead of the running one.
    Run(Arc<Script>),
    /// Stop the running script.
    Stop,
}

/// Outcome of an intent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// Done, effective from the next control step on.
    Done,
    /// Not done.
    Refused(VehicleRefusal),
    /// The plant's reply.
    Plant(FaultReply),
    /// The plant went away before it answered, or its queue was full.
    NoAnswer,
}

/// A command as recorded in flight logs, and both directions between them from one table: the variant of a log, its value, and the
/// command. The numbers of the variants are recorded. New variants come last.
macro_rules! logged {
    ($($logged:ident $(($value:ident: $type:ty))? = $group:ident($kind:ident::$variant:ident)),* $(,)?) => {
        #[derive(Clone, Serialize, Deserialize)]
        enum Logged {
            $($logged $(($type))?,)*
        }

        impl From<Logged> for Command {
            fn from(logged: Logged) -> Self {
                match logged {
                    $(Logged::$logged $(($value))? => Self::$group($kind::$variant $(($value))?),)*
                }
            }
        }

        impl From<Command> for Logged {
            fn from(command: Command) -> Self {
                match command {
                    $(Command::$group($kind::$variant $(($value))?) => Self::$logged $(($value))?,)*
                }
            }
        }
    };
}

logged! {
    Mode(mode: Mode) = Vehicle(VehicleCommand::Mode),
    Refer(reference: Reference) = Vehicle(VehicleCommand::Refer),
    Gains(gains: Box<Gains>) = Configuration(Configuration::Gains),
    Limits(limits: ReferenceLimits) = Configuration(Configuration::Limits),
    Fault(request: FaultRequest) = Plant(PlantAction::Fault),
    Restart = Plant(PlantAction::Restart),
    Navigation(parameters: NavigationParameters) = Configuration(Configuration::Navigation),
    Reposition(place: Reposition) = Vehicle(VehicleCommand::Reposition),
    Setpoint(setpoint: Setpoint) = Vehicle(VehicleCommand::Setpoint),
    Sticks(sticks: Sticks) = Vehicle(VehicleCommand::Sticks),
    Plan(plan: Arc<Plan>) = Vehicle(VehicleCommand::Plan),
    PlanItem(item: u16) = Vehicle(VehicleCommand::PlanItem),
    Continue = Vehicle(VehicleCommand::Continue),
    Home(place: Place) = Vehicle(VehicleCommand::Home),
    Terminate = Vehicle(VehicleCommand::Terminate),
    LinkLost(action: LinkLossAction) = Vehicle(VehicleCommand::LinkLost),
    LinkBack = Vehicle(VehicleCommand::LinkBack),
    ListFaults = Plant(PlantAction::ListFaults),
    Pace(pace: Pace) = Plant(PlantAction::Pace),
    Script(script: Arc<Script>) = Script(ScriptCommand::Run),
    StopScript = Script(ScriptCommand::Stop),
    FaultInjection(allowed: bool) = Configuration(Configuration::FaultInjection),
    Land = Vehicle(VehicleCommand::Land),
    GoAround(altitude_m: Option<f64>) = Vehicle(VehicleCommand::GoAround),
    Fence(fence: Arc<Fence>) = Vehicle(VehicleCommand::Fence),
    Rally(points: Arc<[RallyPoint]>) = Vehicle(VehicleCommand::Rally),
    EnableFence(enabled: bool) = Vehicle(VehicleCommand::EnableFence),
    Arm(armed: bool) = Vehicle(VehicleCommand::Arm),
    TakeOff(altitude_m: Option<f64>) = Vehicle(VehicleCommand::TakeOff),
}
