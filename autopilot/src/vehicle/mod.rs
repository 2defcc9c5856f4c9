//! What the aircraft is doing: mode and references. Accepts or refuses what the operator wants.

use flight_control::Demand;
use icd::{Sensors, SimTime};

pub mod mode;
pub mod navigation;
pub mod plan;
pub mod request;
pub mod schedule;

use crate::parameters::ReferenceLimits;
pub use mode::Mode;
pub use navigation::Navigation;
pub use request::{LinkLossAction, Place, Reference, Reposition, Setpoint, Sticks};
use schedule::ReferenceSchedule;

/// Mode and references.
#[derive(Debug, Clone)]
pub struct Vehicle {
    mode: Mode,
    demand: Option<Demand>,
    schedule: ReferenceSchedule,
    scheduled: usize,
}

/// Why the vehicle does not do what was asked.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum VehicleRefusal {
    /// Outside the reference limits.
    #[error("{what} {value:.1} {unit} is outside {min:.1} to {max:.1} {unit}")]
    OutOfRange {
        /// Which reference.
        what: &'static str,
        /// Unit of the numbers.
        unit: &'static str,
        /// Asked for.
        value: f64,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
    },
    /// Only in Offboard.
    #[error("a roll reference needs Offboard")]
    NotOffboard,
    /// No plant, or it has gone silent: there is nothing to fly.
    #[error("no aircraft is connected")]
    NoFlight,
    /// The aircraft is on the ground.
    #[error("the flight is over")]
    FlightOver,
}

impl Vehicle {
    /// In Hold, with references by time.
    #[must_use]
    pub fn new(schedule: ReferenceSchedule) -> Self {
        Self { mode: Mode::Reference, demand: None, schedule, scheduled: 0 }
    }

    /// A flight begins: back to Hold, the references start from the first sample.
    pub fn begin_flight(&mut self) {
        self.mode = Mode::Reference;
        self.demand = None;
        self.scheduled = 0;
    }

    /// Mode now.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// References now, once there was a first sample.
    #[must_use]
    pub fn demand(&self) -> Option<&Demand> {
        self.demand.as_ref()
    }

    /// References at this tick: the first sample's altitude and airspeed with wings level, then what the
    /// schedule and the operator said since.
    pub fn track(&mut self, time: SimTime, sensors: &Sensors) -> Demand {
        let demand = self.demand.get_or_insert(Demand {
            altitude_m: sensors.altitude_m,
            roll_rad: 0.0,
            airspeed_m_s: sensors.airspeed_m_s,
        });
        while let Some(entry) = self.schedule.entry(self.scheduled).filter(|entry| entry.at <= time)
        {
            demand.altitude_m = entry.altitude_m.unwrap_or(demand.altitude_m);
            demand.roll_rad = entry.roll_rad.unwrap_or(demand.roll_rad);
            demand.airspeed_m_s = entry.airspeed_m_s.unwrap_or(demand.airspeed_m_s);
            self.scheduled += 1;
        }
        *demand
    }

    /// Changes a reference.
    ///
    /// # Errors
    /// [`VehicleRefusal`] says why not; nothing changes then.
    pub fn refer(
        &mut self,
        reference: Reference,
        limits: &ReferenceLimits,
    ) -> Result<(), VehicleRefusal> {
        limits.check(reference)?;
        let demand = self.demand.as_mut().ok_or(VehicleRefusal::NoFlight)?;
        match reference {
            Reference::Altitude(altitude_m) => demand.altitude_m = altitude_m,
            Reference::Airspeed(airspeed_m_s) => demand.airspeed_m_s = airspeed_m_s,
            Reference::Roll(roll_rad) if self.mode == Mode::Offboard => demand.roll_rad = roll_rad,
            Reference::Roll(_) | Reference::Course(_) => return Err(VehicleRefusal::NotOffboard),
        }
        Ok(())
    }

    /// Changes the mode. Hold levels the wings; Offboard keeps the references until the first setpoint.
    pub fn set_mode(&mut self, mode: Mode) {
        self.mode = mode;
        if let (Mode::Hold | Mode::Reference, Some(demand)) = (mode, self.demand.as_mut()) {
            demand.roll_rad = 0.0;
        }
    }
}

#[cfg(test)]
mod tests;
