//! Commands of the operator to the vehicle.
//!
//! The caller has checked that the aircraft is in the air ([`crate::autopilot::Autopilot`]). A refused
//! command changes nothing.

use std::sync::Arc;

use super::altitude::Pilot;
use super::circle::Hold;
use super::offboard::Offboard;
use super::plan::{Plan, Progress};
use super::position::Position;
use super::rules::{check_place, radius};
use super::{
    LinkLossAction, Mode, Place, Reference, Reposition, Rules, Setpoint, Site, Sticks, Vehicle,
    VehicleRefusal, WindEstimate,
};
use crate::vehicle::VehicleEvent;

type Publish<'a> = &'a mut dyn FnMut(VehicleEvent);

impl Vehicle {
    /// Changes the mode. A request for the present mode changes nothing, except that Position levels the wings and then holds
    /// the course of that moment.
    ///
    /// # Errors
    /// The flight was terminated, or there is no plan for Mission.
    pub fn change_mode(
        &mut self,
        mode: Mode,
        rules: &Rules,
        publish: Publish,
    ) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        if mode == Mode::Mission && self.mission.is_empty() {
            return Err(VehicleRefusal::NoPlan);
        }
        self.link.forget();
        self.enter(mode, rules, publish);
        Ok(())
    }

    /// Continues a paused plan; no effect on a plan in progress.
    pub fn continue_plan(&mut self, rules: &Rules, publish: Publish) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        match self.mission.progress() {
            Progress::Paused | Progress::Active => self.change_mode(Mode::Mission, rules, publish),
            Progress::NoPlan | Progress::NotStarted | Progress::Complete => {
                Err(VehicleRefusal::NoPausedPlan)
            }
        }
    }

    fn can_obey(&self) -> Result<(), VehicleRefusal> {
        if self.terminated { Err(VehicleRefusal::Terminated) } else { Ok(()) }
    }

    /// Enters a mode that can be flown. Altitude and airspeed references stay valid in all modes, except that Return has its own
    /// altitude. Offboard keeps the roll reference until the first setpoint.
    fn enter(&mut self, mode: Mode, rules: &Rules, publish: Publish) {
        if mode == Mode::Position {
            self.position = Position::default();
        }
        if mode == self.mode {
            return;
        }
        if !self.is_guided() {
            self.wind = WindEstimate::default();
        }
        self.mission.pause();
        match mode {
            Mode::Position => {}
            Mode::Hold => self.hold = Hold::default(),
            Mode::Mission => self.mission.start(),
            Mode::Return => {
                if let Some(demand) = self.demand.as_mut() {
                    demand.altitude_m =
                        rules.nearest_altitude_m(rules.navigation.return_altitude_m);
                }
            }
            Mode::Offboard => self.offboard = Offboard::default(),
            Mode::Altitude => {
                self.pilot = Pilot::default();
                self.level_wings();
            }
        }
        self.mode = mode;
        publish(VehicleEvent::Mode(mode));
    }

    fn level_wings(&mut self) {
        if let Some(demand) = self.demand.as_mut() {
            demand.roll_rad = 0.0;
        }
    }

    /// Changes a reference. An altitude or airspeed in Mission holds until the next item that sets one.
    pub fn refer(&mut self, reference: Reference, rules: &Rules) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        let demand = self.demand.as_mut().ok_or(VehicleRefusal::NoFlight)?;
        rules.limits.check(reference, demand.altitude_m)?;
        match (reference, self.mode) {
            (Reference::Altitude(_), Mode::Return | Mode::Altitude) => {
                return Err(VehicleRefusal::AltitudeIsTaken(self.mode));
            }
            (Reference::Altitude(altitude_m), _) => {
                demand.altitude_m = altitude_m;
                self.mission.release_altitude();
            }
            (Reference::Airspeed(airspeed_m_s), _) => demand.airspeed_m_s = airspeed_m_s,
            (Reference::Roll(roll_rad), Mode::Offboard) => {
                let setpoint = Setpoint::Roll(roll_rad);
                return self.offboard.take(setpoint, None, demand, rules);
            }
            (Reference::Roll(roll_rad), Mode::Position) => {
                demand.roll_rad = roll_rad;
                self.position.release_roll();
            }
            (Reference::Course(course_rad), Mode::Position) => self.position.hold(course_rad),
            (Reference::Roll(_), _) => return Err(VehicleRefusal::NoRollHere),
            (Reference::Course(_), _) => return Err(VehicleRefusal::NoCourseHere),
        }
        Ok(())
    }

    /// Circles around a place.
    pub fn reposition(
        &mut self,
        request: &Reposition,
        rules: &Rules,
        publish: Publish,
    ) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        rules.check_some(request.place, request.altitude_m)?;
        if let (Some(airspeed_m_s), Some(demand)) = (request.airspeed_m_s, &self.demand) {
            let altitude_m = request.altitude_m.unwrap_or(demand.altitude_m);
            rules.limits.check(Reference::Airspeed(airspeed_m_s), altitude_m)?;
        }
        request.radius_m.map_or(Ok(()), |radius_m| radius(radius_m).check())?;
        if self.mode != Mode::Hold && !request.change_mode {
            return Err(VehicleRefusal::NotHold);
        }
        if self.demand.is_none() {
            return Err(VehicleRefusal::NoFlight);
        }
        self.link.forget();
        self.enter(Mode::Hold, rules, publish);
        self.hold.reposition(request);
        if let Some(demand) = self.demand.as_mut() {
            demand.altitude_m = request.altitude_m.unwrap_or(demand.altitude_m);
            demand.airspeed_m_s = request.airspeed_m_s.unwrap_or(demand.airspeed_m_s);
        }
        Ok(())
    }

    /// Sets a setpoint of an offboard stream.
    pub fn take_setpoint(
        &mut self,
        setpoint: Setpoint,
        rules: &Rules,
    ) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        if self.mode != Mode::Offboard {
            return Err(VehicleRefusal::NotOffboard);
        }
        let demand = self.demand.as_mut().ok_or(VehicleRefusal::NoFlight)?;
        self.offboard.take(setpoint, self.axes.as_ref(), demand, rules)
    }

    pub fn take_sticks(&mut self, sticks: Sticks) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        match self.mode {
            Mode::Position => self.position.take(sticks),
            Mode::Altitude => self.pilot.take(sticks),
            _ => Err(VehicleRefusal::NotPiloted),
        }
    }

    /// Replaces the plan; an empty one only clears it. While Mission flies, the new plan begins with its first
    /// item at once, and without a plan the aircraft holds.
    pub fn replace_plan(
        &mut self,
        plan: &Arc<Plan>,
        rules: &Rules,
        publish: Publish,
    ) -> Result<(), VehicleRefusal> {
        plan.check(rules)?;
        self.mission.replace(Arc::clone(plan));
        if self.mode == Mode::Mission {
            if self.mission.is_empty() {
                self.link.forget();
                self.enter(Mode::Hold, rules, publish);
            } else {
                self.mission.start();
            }
        }
        Ok(())
    }

    /// Makes an item the current one; Mission continues with it at once.
    ///
    /// # Errors
    /// There is no such item, or the flight was terminated.
    pub fn select_item(&mut self, item: u16, publish: Publish) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        self.mission.select(item)?;
        // In Mission the next tick begins the item, and reports it.
        if self.mode != Mode::Mission {
            publish(VehicleEvent::PlanItem(item));
        }
        Ok(())
    }

    pub fn set_home(&mut self, place: Place, publish: Publish) -> Result<(), VehicleRefusal> {
        check_place(place)?;
        self.home = Some(Site::at(place));
        publish(VehicleEvent::Home(place));
        Ok(())
    }

    /// Ends the flight permanently; [`crate::termination`] has the commands of the effectors.
    pub fn terminate(&mut self, publish: Publish) {
        if !core::mem::replace(&mut self.terminated, true) {
            publish(VehicleEvent::Terminated);
        }
    }

    /// The controlling ground station has fallen silent.
    pub fn lose_link(&mut self, action: LinkLossAction, rules: &Rules, publish: Publish) {
        let Some(chosen) = self.link.lose(action, self.mode) else { return };
        publish(VehicleEvent::LinkLost(action));
        if let (Some(mode), false) = (chosen, self.terminated) {
            self.enter(mode, rules, publish);
        }
    }

    /// It is back: undoes the reaction to its silence, unless another mode was commanded since.
    pub fn regain_link(&mut self, rules: &Rules, publish: Publish) {
        let Some(mode) = self.link.regain(self.mode) else { return };
        let can_fly = mode != Mode::Mission || !self.mission.is_empty();
        if can_fly && !self.terminated {
            self.enter(mode, rules, publish);
        }
        publish(VehicleEvent::LinkBack(self.mode));
    }
}
