//! What the vehicle reports: each change of mode, plan, home and link once.

use super::{LinkLossAction, Mode, Place};

/// Something that changed in the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleEvent {
    /// The mode changed.
    Mode(Mode),
    /// This item of the plan is the current one now.
    PlanItem(u16),
    /// This item of the plan has been reached.
    ItemReached(u16),
    /// The last item of the plan is done.
    PlanComplete,
    /// Home was moved to here.
    Home(Place),
    /// The flight was terminated.
    Terminated,
    /// The controlling ground station has fallen silent, and this is done about it.
    LinkLost(LinkLossAction),
    /// It is back, and the mode is this one again.
    LinkBack(Mode),
}
