//! Requests to the vehicle, why it refuses them, and what it reports. Values are in SI and radians, finite, not yet checked against limits.

use core::fmt;

use flight_control::NavigationState;
use flight_control::design_model::atmosphere;
use icd::{Ned, SimTime};
use serde::{Deserialize, Serialize};

/// A point on the Earth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
}

impl Place {
    /// Position of the aircraft.
    pub const fn of(state: &NavigationState) -> Self {
        Self { latitude_rad: state.latitude_rad, longitude_rad: state.longitude_rad }
    }
}

/// An airspeed as an operator gives it, m/s. The laws fly true airspeed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Airspeed {
    True(f64),
    /// That with the same impact pressure at sea level.
    Calibrated(f64),
}

impl Airspeed {
    /// True airspeed at an altitude, m/s.
    pub fn true_m_s(self, altitude_m: f64) -> f64 {
        match self {
            Self::True(airspeed_m_s) => airspeed_m_s,
            Self::Calibrated(airspeed_m_s) => atmosphere::true_airspeed(airspeed_m_s, altitude_m),
        }
    }
}

/// A reference that the operator may change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Reference {
    /// Altitude above the ellipsoid, m.
    Altitude(f64),
    /// True airspeed, m/s.
    Airspeed(f64),
    /// Roll angle, rad; in Position and Offboard.
    Roll(f64),
    /// Course over the ground, rad from north; only in Position.
    Course(f64),
}

/// Fly to a place and circle there. `None` leaves a value unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Reposition {
    /// Centre of the circle; `None`: the centre of the present circle, or else the present position.
    pub place: Option<Place>,
    /// Altitude above the ellipsoid, m.
    pub altitude_m: Option<f64>,
    /// Radius of the circle, m, positive.
    pub radius_m: Option<f64>,
    /// Direction of the circle, seen from above.
    pub clockwise: Option<bool>,
    /// True airspeed, m/s.
    pub airspeed_m_s: Option<f64>,
    /// Change to Hold first; without it the vehicle refuses the request outside Hold.
    pub change_mode: bool,
}

/// One setpoint of an offboard stream; only in Offboard.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Setpoint {
    /// Roll angle, rad; altitude and airspeed references stay.
    Roll(f64),
    /// Fly to a place and circle there.
    Position {
        place: Place,
        /// Altitude above the ellipsoid, m; `None`: unchanged.
        altitude_m: Option<f64>,
    },
    /// The same in the local axes of the flight, m.
    LocalPosition(Ned),
    /// Fly in a direction.
    Velocity {
        /// Course over the ground, rad from north; `None`: unchanged.
        course_rad: Option<f64>,
        /// Speed, m/s, flown as true airspeed; `None`: unchanged.
        speed_m_s: Option<f64>,
        /// Climb rate, m/s, positive up.
        climb_m_s: f64,
    },
}

/// Positions of a pilot's sticks; in Position and Altitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sticks {
    /// -1 left to 1 right: roll reference up to the limit.
    pub roll: f64,
    /// -1 down to 1 up: climb rate.
    pub climb: f64,
    /// 0 to 1: airspeed reference between its limits; `None`: unchanged.
    pub throttle: Option<f64>,
}

impl Sticks {
    /// Centred, without a throttle.
    pub const CENTRED: Self = Self { roll: 0.0, climb: 0.0, throttle: None };
}

/// Reaction to the silence of the controlling ground station (parameter `NAV_DLL_ACT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LinkLossAction {
    #[default]
    Continue,
    /// Circle at the present position.
    Hold,
    Return,
}

/// A state in which the aircraft acts by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failsafe {
    /// The position is not known any more: modes that need it circle with a fixed bank.
    PositionLost,
    /// The engine gives no thrust: the aircraft glides.
    EngineFailed,
    /// This level of the tank is passed.
    Fuel(FuelLevel),
}

/// How full the tank is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum FuelLevel {
    #[default]
    Enough,
    /// Below `BAT_LOW_THR`.
    Low,
    /// Below `BAT_CRIT_THR`.
    Critical,
    /// Below `BAT_EMERGEN_THR`.
    Emergency,
}

/// What happens when the engine fails (parameter `COM_ACT_FAIL_ACT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum EngineAction {
    /// The aircraft glides in its mode.
    Report,
    #[default]
    Return,
    Terminate,
}

/// What happens when fuel runs low (parameter `COM_LOW_BAT_ACT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum FuelAction {
    #[default]
    Report,
    /// The landing of the plan, or Return without one, from the critical level on.
    Land,
    /// Return from the critical level on, that landing from the emergency level on.
    Return,
}

/// Why a place is beyond the fence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breach {
    /// Outside of every area to stay in.
    Outside,
    /// In an area to stay out of.
    Exclusion,
    High,
    Low,
}

/// The fence of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FenceStatus {
    /// It has areas, beside the altitude limits of the parameters.
    pub has_areas: bool,
    /// Switched off by DO_FENCE_ENABLE.
    pub is_off: bool,
    /// The breach that lasts.
    pub breach: Option<Breach>,
    /// Number of breaches, and the last of them.
    pub breaches: u16,
    pub last: Option<(Breach, SimTime)>,
}

/// What happens at a breach (parameter `GF_ACTION`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum FenceAction {
    /// There is no fence.
    Nothing,
    Report,
    #[default]
    Hold,
    Return,
    Terminate,
    /// The landing of the plan, or Return without one.
    Land,
}

/// A change that the watch has seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FenceChange {
    Breached(Breach),
    Back,
}

/// Why the vehicle refuses a command. The text is for the operator.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum VehicleRefusal {
    /// Outside the reference limits.
    #[error(
        "{what} {} {unit} is outside {} to {} {unit}",
        digits(*value), digits(*min), digits(*max)
    )]
    OutOfRange {
        what: &'static str,
        /// Unit of the numbers.
        unit: &'static str,
        value: f64,
        min: f64,
        max: f64,
    },
    /// A number in a plan that cannot be flown.
    #[error("item {item}: {what} {value:.1} {unit} is outside {min:.1} to {max:.1} {unit}")]
    ItemOutOfRange {
        /// The item, from 0.
        item: u16,
        /// Name of the number.
        what: &'static str,
        /// Unit of the numbers.
        unit: &'static str,
        value: f64,
        min: f64,
        max: f64,
    },
    /// A jump to an item that does not exist, or a command to select one.
    #[error("there is no item {item}: the plan has {items}")]
    NoSuchItem {
        /// The item of the command, from 0.
        item: u16,
        items: u16,
    },
    /// Jumps that lead to each other without an item to fly between them.
    #[error("item {item} jumps in a circle without a point to fly to")]
    EndlessJump {
        /// The item where the check found it, from 0.
        item: u16,
    },
    /// More items than a plan may have.
    #[error("{items} items are too many: at most {max}")]
    PlanTooLong { items: usize, max: usize },
    /// Mission needs a plan.
    #[error("there is no plan: upload one first")]
    NoPlan,
    /// Only a plan that was begun and is not complete can continue.
    #[error("no plan is paused")]
    NoPausedPlan,
    #[error("setpoints need Offboard")]
    NotOffboard,
    /// Only in Position and Altitude.
    #[error("stick positions need Position or Altitude")]
    NotPiloted,
    /// Only in Position and Offboard.
    #[error("a roll reference needs Position or Offboard")]
    NoRollHere,
    #[error("a course reference needs Position")]
    NoCourseHere,
    /// Only in Hold, or with the flag that changes to it.
    #[error("a new position needs Hold, or the flag that changes to it")]
    NotHold,
    /// The mode determines the altitude.
    #[error("{0} sets the altitude itself: change to Hold first")]
    AltitudeIsTaken(Mode),
    /// A return must not lead beyond the fence.
    #[error("item {item}: rally point is beyond the fence")]
    RallyBeyondFence { item: u16 },
    /// A takeoff, or to be disarmed.
    #[error("the aircraft is in the air")]
    InTheAir,
    /// To be disarmed.
    #[error("the aircraft moves at {m_s:.1} m/s")]
    Moving { m_s: f64 },
    /// Not before the navigation state is known.
    #[error("position, altitude or airspeed are not known yet")]
    NotAligned,
    /// A go-around without a landing to end.
    #[error("no landing is under way")]
    NoApproach,
    /// The plan has no landing, or there is none.
    #[error("the plan has no landing (NAV_LAND)")]
    NoLanding,
    /// No plant, or a silent one: there is no aircraft to command.
    #[error("no aircraft is connected")]
    NoFlight,
    /// The aircraft is on the ground.
    #[error("the flight is over: a reboot begins a new one")]
    FlightOver,
    /// Terminated: only a new flight helps.
    #[error("the flight was terminated")]
    Terminated,
    /// Fault injection is off.
    #[error("fault injection is off (SYS_FAILURE_EN 0)")]
    FaultInjectionOff,
    /// No script is running.
    #[error("no script runs")]
    NoScript,
}

/// One decimal, or two where one would show a different number: a limit of 0.01 is not 0.0.
fn digits(value: f64) -> String {
    let one = format!("{value:.1}");
    let two = format!("{value:.2}");
    if value.abs() < 1.0 && !two.ends_with('0') { two } else { one }
}

impl VehicleRefusal {
    /// The same request may be accepted later: in another mode, with another plan, in another flight.
    pub const fn is_temporary(&self) -> bool {
        !matches!(
            self,
            Self::OutOfRange { .. }
                | Self::ItemOutOfRange { .. }
                | Self::NoSuchItem { .. }
                | Self::EndlessJump { .. }
                | Self::PlanTooLong { .. }
                | Self::RallyBeyondFence { .. }
                | Self::FaultInjectionOff
        )
    }
}

icd::named! {
    /// Source of the references.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
    Mode {
        /// Given references, or a pilot's sticks; without either the aircraft holds altitude, course and
        /// speed. A flight begins in this mode.
        #[default]
        Position = "Position",
        /// The aircraft circles around a point.
        Hold = "Hold",
        /// The aircraft flies its plan.
        Mission = "Mission",
        /// The aircraft flies home and circles there, or lands where it took off.
        Return = "Return",
        /// A ground station streams setpoints.
        Offboard = "Offboard",
        /// A pilot's sticks give roll angle, climb and airspeed.
        Altitude = "Altitude",
        /// The aircraft takes off, climbs straight on, and then holds.
        Takeoff = "Takeoff",
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.key())
    }
}

/// Progress of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Progress {
    /// There is no plan.
    #[default]
    NoPlan,
    /// Loaded, not begun.
    NotStarted,
    Active,
    /// Begun, while another mode is active.
    Paused,
    /// The last item is done.
    Complete,
}

/// Guidance at one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Navigation {
    /// Point that the aircraft flies to or circles around.
    pub target: Option<Target>,
    /// Course over the ground of the guidance, rad from north.
    pub course_rad: Option<f64>,
    /// Distance from the path, m, positive to its right.
    pub cross_track_m: f64,
    /// Plan being flown or loaded: its [`super::plan::Plan::id`].
    pub plan_id: u32,
    /// Items of that plan.
    pub items: u16,
    /// Current item of that plan.
    pub item: u16,
    /// Progress of the plan.
    pub progress: Progress,
    /// Home, once there was a first sample.
    pub home: Option<Place>,
    pub fence: FenceStatus,
    /// Altitude of the ground, m.
    pub ground_m: f64,
}

/// A point that the guidance flies to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    pub place: Place,
    /// Altitude above the ellipsoid, m.
    pub altitude_m: f64,
    /// Horizontal distance to it, m.
    pub distance_m: f64,
    /// Bearing from the aircraft to it, rad from north.
    pub bearing_rad: f64,
    /// Radius of the circle flown around it, m; `None` on a leg.
    pub radius_m: Option<f64>,
}

/// A change in the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleEvent {
    Mode(Mode),
    /// This item of the plan is now the current one.
    PlanItem(u16),
    /// The aircraft has reached this item of the plan.
    ItemReached(u16),
    /// The aircraft lacks the equipment that this item is for, and flies past it.
    ItemPassed(u16),
    /// The last item of the plan is done.
    PlanComplete,
    /// The aircraft is beyond the fence, or back inside.
    Fence(FenceChange),
    /// The aircraft acts by itself, or the reason for it is over.
    Failsafe {
        failsafe: Failsafe,
        is_there: bool,
    },
    /// Home was moved to here.
    Home(Place),
    /// The flight was terminated.
    Terminated,
    /// The engine may run, or may not any more.
    Armed(bool),
    LiftOff,
    TouchDown,
    TakeoffAborted,
    /// The approach was not stable, and is flown again.
    GoAround,
    /// The controlling ground station has fallen silent, and this is the reaction.
    LinkLost(LinkLossAction),
    /// It is back, and this mode is restored.
    LinkBack(Mode),
}
