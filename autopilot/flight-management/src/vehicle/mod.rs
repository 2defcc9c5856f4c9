//! State of the vehicle: mode and references. Accepts or refuses commands of the operator.
//!
//! In the modes that follow a path the guidance computes the roll reference ([`flight_control::guidance`]), one
//! tick at a time, from position and motion of the aircraft. No state here depends on
//! wall time, and a tick does not allocate. The caller of a command has checked that the aircraft is in the air
//! ([`crate::autopilot::Autopilot`]). A refused command changes nothing.

use std::sync::Arc;

use flight_control::guidance::{Horizontal, Steering, hold_course};
use flight_control::{Demand, GroundDemand, NavigationState};
use icd::SimTime;

pub mod failsafe;
pub mod fence;
pub mod geodesy;
mod ground;
mod landing;
mod mission;
mod modes;
pub mod plan;
mod request;
pub mod rules;
pub mod schedule;

use failsafe::{FailsafeWatch, Powerplant};
use fence::{Fence, FenceAction, FenceChange, FenceWatch, RallyPoint};
use geodesy::{Horizon, LocalAxes, Site};
use ground::GroundOperation;
use landing::Approach;
use mission::{Flight, Mission};
use modes::{AltitudeDemand, Flown, Hold, Offboard, Orbit, Pilot, Position, check_sticks};
use plan::{Plan, Progress};
pub use request::{
    Airspeed, LinkLossAction, Mode, Navigation, Place, Reference, Reposition, Setpoint, Sticks,
    Target, VehicleEvent, VehicleRefusal,
};
pub use rules::{NavigationParameters, ReferenceLimits, Rules};
use rules::{check_place, check_radius};
use schedule::ReferenceSchedule;

/// Least height at which the landing of Return begins its glide, m.
const APPROACH_MIN_M: f64 = 40.0;
/// It ends this far behind the beginning of the takeoff roll, as a way of the approach, s.
const AIM_S: f64 = 4.0;
/// Least radius of the circle before it, as a way of the approach, s.
const RETURN_CIRCLE_S: f64 = 6.0;
/// Longest time between two ticks that counts, s.
const DT_MAX_S: f64 = 0.1;

type Publish<'a> = &'a mut dyn FnMut(VehicleEvent);

#[derive(Debug, Clone, Default)]
pub struct Vehicle {
    mode: Mode,
    demand: Option<Demand>,
    schedule: ReferenceSchedule,
    scheduled: usize,
    position: Position,
    hold: Hold,
    mission: Mission,
    offboard: Offboard,
    pilot: Pilot,
    /// The controlling ground station has fallen silent.
    link_lost: bool,
    /// The mode that this has selected, and the one before. `None` once the operator or the plan has selected a mode.
    undo: Option<(Mode, Mode)>,
    home: Option<Site>,
    fence: Arc<Fence>,
    watch: FenceWatch,
    rally: Arc<[RallyPoint]>,
    failsafe: FailsafeWatch,
    /// Rally point to which Return flies; `None`: home.
    refuge: Option<RallyPoint>,
    /// Location at the last tick.
    place: Option<Place>,
    axes: Option<LocalAxes>,
    wind: WindEstimate,
    altitude: AltitudeDemand,
    time: Option<SimTime>,
    terminated: bool,
    ground: GroundOperation,
    /// Altitude to which Takeoff climbs, m; `None`: the parameter.
    takeoff_m: Option<f64>,
    /// Course of the climb of Takeoff, rad from north, once it is in the air.
    takeoff_course_rad: Option<f64>,
    /// The landing of Return on the runway of the takeoff.
    returning: Mission,
    /// Without plan and home.
    navigation: Navigation,
}

impl Vehicle {
    /// In Position, with references by time and without a plan.
    pub fn new(schedule: ReferenceSchedule) -> Self {
        Self { schedule, ..Self::default() }
    }

    /// Begins a flight, or joins one in progress: in Position, with references that start from
    /// the first sample and home below it. The plan stays loaded and starts from its beginning.
    pub fn begin_flight(&mut self) {
        let schedule = core::mem::take(&mut self.schedule);
        let mut mission = core::mem::take(&mut self.mission);
        mission.rewind();
        let (fence, rally) = (Arc::clone(&self.fence), Arc::clone(&self.rally));
        *self = Self { mission, fence, rally, ..Self::new(schedule) };
    }

    pub fn references(&self) -> &ReferenceSchedule {
        &self.schedule
    }

    /// The loaded plan; empty if there is none.
    pub fn plan(&self) -> Arc<Plan> {
        Arc::clone(self.mission.plan())
    }

    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Present references, once there was a first sample.
    pub fn demand(&self) -> Option<&Demand> {
        self.demand.as_ref()
    }

    /// The guidance of the last tick, with plan and home of the present.
    pub fn navigation(&self) -> Navigation {
        let home = self.home.map(|home| home.place());
        let fence = self.watch.status(&self.fence);
        let mut navigation = Navigation { home, fence, ..self.navigation };
        self.mission.describe(&mut navigation);
        navigation
    }

    /// The flight was terminated.
    pub fn is_terminated(&self) -> bool {
        self.terminated
    }

    /// The engine may run.
    pub fn is_armed(&self) -> bool {
        self.ground.is_armed() && !self.terminated
    }

    /// What the law on the ground is to do, and just before the touchdown where the nose is to point.
    pub fn ground_demand(&self, state: &NavigationState, rules: &Rules) -> GroundDemand {
        let align = || {
            let alignment =
                |approach: &Approach| approach.alignment_rad(state.height_above_ground_m, rules);
            GroundDemand { heading_rad: self.approach().and_then(alignment), ..GroundDemand::STAND }
        };
        match (self.terminated, state.on_wheels) {
            (true, _) => GroundDemand::STAND,
            (false, true) => self.ground.demand(),
            (false, false) => align(),
        }
    }

    /// Takes references, home and local axes from the first known state, if there are none yet, so that commands can change
    /// them before the first tick of [`Vehicle::track`].
    pub fn see(&mut self, state: &NavigationState, rules: &Rules) {
        self.ground.see(state);
        let valid = &state.valid;
        let has_air = valid.airspeed || state.on_wheels;
        if self.demand.is_some() || !(valid.altitude && has_air && valid.position) {
            return;
        }
        let mut demand = present(state);
        if state.on_wheels {
            demand.altitude_m = rules.takeoff_altitude_m();
            demand.airspeed_m_s = rules.cruise_m_s(demand.altitude_m);
        }
        self.demand = Some(demand);
        let place = Place::of(state);
        // Near a pole there are no axes: such a flight has no home, and cannot take local setpoints.
        if check_place(place).is_ok() {
            self.home = Some(Site::at(place));
            self.axes = Some(LocalAxes::of(place, state.altitude_m, state.position));
        }
    }

    /// The demand to the laws at this tick: the references, corrected for a persistent altitude error.
    ///
    /// The references are altitude, airspeed and course of the first known state, then what the schedule,
    /// the operator and the mode have set since. Before it they are the state's own.
    pub fn track(
        &mut self,
        state: &NavigationState,
        rules: &Rules,
        propulsion: &Powerplant,
        publish: Publish,
    ) -> Demand {
        let time = state.time;
        let before = self.time.replace(time).unwrap_or(time);
        // Microseconds between two ticks.
        let dt_s = (time.micros_since(before) as f64 * 1.0e-6).min(DT_MAX_S);
        self.see(state, rules);
        self.place = Some(Place::of(state));
        if self.demand.is_some() || state.on_wheels {
            self.step_ground(state, rules, dt_s, publish);
        }
        // On the ground there is nothing to be done about either.
        if state.on_wheels {
            self.watch.rest();
            self.failsafe.rest();
        } else {
            if self.demand.is_some() && self.has_fence(rules) {
                self.watch_fence(state, rules, dt_s, publish);
            }
            self.watch_failsafes(state, rules, propulsion, dt_s, publish);
        }
        let Some(mut demand) = self.demand else { return present(state) };
        self.follow_schedule(time, &mut demand);
        let mut altitude_m = None;
        self.navigation = Navigation { ground_m: rules.ground_m, ..Navigation::default() };
        if state.on_wheels || self.ground.is_stopping() {
            // The guidance rests, and after a bounce the aircraft comes down again with level wings.
            self.demand = Some(demand);
            self.altitude = AltitudeDemand::default();
            let airspeed_m_s = rules.approach_m_s(state.altitude_m);
            return Demand { altitude_m: rules.ground_m, roll_rad: 0.0, airspeed_m_s };
        }
        if self.is_guided() {
            let mut situation = Situation::new(state, rules, &mut self.wind, dt_s);
            situation.may_climb = !self.failsafe.has_engine_failed();
            if let Some(Flown { steering, target }) = self.fly(&situation, &mut demand, publish) {
                // A change of leg or mode is no step of the reference: the ailerons follow this slew without reaching
                // their stops.
                let most = rules.roll_slew_rad_s() * dt_s;
                demand.roll_rad += (steering.bank_rad - demand.roll_rad).clamp(-most, most);
                self.navigation.target = target;
                self.navigation.course_rad = Some(steering.course_rad);
                self.navigation.cross_track_m = steering.cross_track_m;
            }
            if !self.flown_plan().is_flaring() && !self.failsafe.is_flaring() {
                let wanted_m = self.altitude.step(demand.altitude_m, &situation);
                altitude_m = Some(match self.failsafe.has_engine_failed() {
                    true => self.failsafe.limit_altitude(wanted_m, &situation),
                    false => wanted_m,
                });
            }
        } else {
            // The laws get the reference as it is given, so the paper's flights have the same bits.
            self.altitude = AltitudeDemand::default();
        }
        self.demand = Some(demand);
        Demand { altitude_m: altitude_m.unwrap_or(demand.altitude_m), ..demand }
    }

    fn step_ground(&mut self, state: &NavigationState, rules: &Rules, dt_s: f64, publish: Publish) {
        let wants_takeoff = match self.mode {
            Mode::Takeoff => true,
            Mode::Mission => !matches!(self.mission.progress(), Progress::Complete),
            _ => false,
        };
        let line = self.approach().map(Approach::line);
        if !self.ground.step(state, rules, dt_s, wants_takeoff, line, publish) {
            return;
        }
        publish(VehicleEvent::TouchDown);
        self.touch_down(publish);
        self.undo = None;
        self.enter(Mode::Hold, rules, publish);
    }

    /// Whether the guidance or a pilot computes a reference: the laws get more than the given references.
    fn is_guided(&self) -> bool {
        self.mode != Mode::Position || !self.position.is_as_given()
    }

    /// A scheduled roll angle is flown in Position and replaces the course; altitude and airspeed count in every
    /// mode, until the mode sets others.
    fn follow_schedule(&mut self, time: SimTime, demand: &mut Demand) {
        while let Some(entry) = self.schedule.entry(self.scheduled).filter(|entry| entry.at <= time)
        {
            demand.altitude_m = entry.altitude_m.unwrap_or(demand.altitude_m);
            demand.airspeed_m_s = entry.airspeed_m_s.unwrap_or(demand.airspeed_m_s);
            if let (Some(roll_rad), Mode::Position) = (entry.roll_rad, self.mode) {
                demand.roll_rad = roll_rad;
                self.position.release_roll();
            }
            self.scheduled += 1;
        }
    }

    /// The items of Return; in the other modes those of the plan, which only Mission flies.
    fn flown_plan(&self) -> &Mission {
        if self.mode == Mode::Return { &self.returning } else { &self.mission }
    }

    /// The approach under way.
    fn approach(&self) -> Option<&Approach> {
        let flies = matches!(self.mode, Mode::Mission | Mode::Return);
        self.flown_plan().approach().filter(|_| flies)
    }

    /// One tick of the mode; `None` if it leaves the roll reference unchanged.
    fn fly_mode(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        publish: Publish,
    ) -> Option<Flown> {
        let rules = situation.rules;
        if self.failsafe.is_position_lost() && self.needs_position() {
            // An approach is flown again once the position is back.
            let _ = self.go_around(None, rules);
            demand.altitude_m = rules.nearest_altitude_m(demand.altitude_m);
            let bank_rad = rules.navigation.lost_bank_deg.to_radians();
            let course_rad = situation.course_rad();
            let steering = Steering { bank_rad, course_rad, cross_track_m: 0.0 };
            return Some(Flown { steering, target: None });
        }
        if self.mode == Mode::Mission {
            let Self { home, watch: fence, .. } = self;
            let mut tick = mission::Tick { situation, home, fence, publish };
            match self.mission.fly(demand, &mut tick) {
                Flight::Fly(flown) => return Some(flown),
                Flight::Complete(around) => {
                    self.mode = Mode::Hold;
                    self.hold = Hold::around(around);
                }
                Flight::Home => {
                    self.mode = Mode::Return;
                    demand.altitude_m = self.begin_return(situation.rules);
                }
            }
            // The plan has just ended.
            self.undo = None;
            publish(VehicleEvent::Mode(self.mode));
        }
        match self.mode {
            Mode::Mission => None,
            Mode::Position => self.position.fly(situation, demand),
            Mode::Hold => Some(self.hold.fly(situation, demand)),
            Mode::Takeoff => {
                let course_rad =
                    *self.takeoff_course_rad.get_or_insert_with(|| situation.course_rad());
                demand.altitude_m =
                    self.takeoff_m.unwrap_or_else(|| situation.rules.takeoff_altitude_m());
                let left_m = demand.altitude_m - situation.altitude_m;
                if left_m < situation.rules.altitude_reached_m() {
                    self.mode = Mode::Hold;
                    self.hold = Hold::default();
                    publish(VehicleEvent::Mode(self.mode));
                }
                Some(situation.hold_course(course_rad))
            }
            // Without thrust the way onto the runway is not flown: nobody knows whether the height is enough for it.
            Mode::Return
                if !self.returning.is_empty()
                    && (self.is_landing() || !self.failsafe.has_engine_failed()) =>
            {
                let Self { home, watch: fence, .. } = self;
                // The items are nobody's plan.
                let publish = &mut |event| {
                    if event == VehicleEvent::GoAround {
                        publish(event);
                    }
                };
                let mut tick = mission::Tick { situation, home, fence, publish };
                match self.returning.fly(demand, &mut tick) {
                    Flight::Fly(flown) => Some(flown),
                    Flight::Complete(orbit) => Some(orbit.fly(situation, demand)),
                    Flight::Home => None,
                }
            }
            Mode::Return => {
                let refuge = self.refuge.map(|point| Site::at(point.place)).or(self.home);
                refuge.map(|refuge| Orbit::around(refuge).fly(situation, demand))
            }
            Mode::Offboard => self.offboard.fly(situation, demand),
            Mode::Altitude => {
                self.pilot.fly(situation, demand);
                None
            }
        }
    }

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
        if mode == Mode::Takeoff && !self.ground.is_on_wheels() {
            return Err(VehicleRefusal::InTheAir);
        }
        self.undo = None;
        self.enter(mode, rules, publish);
        Ok(())
    }

    /// Continues a paused plan; no effect on a plan in progress.
    pub fn continue_plan(&mut self, rules: &Rules, publish: Publish) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        match self.mission.progress() {
            Progress::Paused | Progress::Active => self.change_mode(Mode::Mission, rules, publish),
            _ => Err(VehicleRefusal::NoPausedPlan),
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
        // Nobody has followed the wind since the last guided tick.
        if !self.is_guided() {
            self.wind = None;
        }
        self.mission.pause();
        match mode {
            Mode::Position => {}
            Mode::Hold => self.hold = Hold::default(),
            Mode::Mission => self.mission.start(),
            Mode::Takeoff => (self.takeoff_m, self.takeoff_course_rad) = (None, None),
            Mode::Return => {
                let altitude_m = self.begin_return(rules);
                if let Some(demand) = self.demand.as_mut() {
                    demand.altitude_m = altitude_m;
                }
            }
            Mode::Offboard => self.offboard = Offboard::default(),
            Mode::Altitude => {
                self.pilot = Pilot::default();
                if let Some(demand) = self.demand.as_mut() {
                    demand.roll_rad = 0.0;
                }
            }
        }
        self.mode = mode;
        publish(VehicleEvent::Mode(mode));
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
                // Else the leg would put its own altitude over it in the next tick.
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
        check_radius(request.radius_m)?;
        if self.mode != Mode::Hold && !request.change_mode {
            return Err(VehicleRefusal::NotHold);
        }
        if self.demand.is_none() {
            return Err(VehicleRefusal::NoFlight);
        }
        self.undo = None;
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
        let held = match self.mode {
            Mode::Position => &mut self.position.sticks,
            Mode::Altitude => &mut self.pilot.sticks,
            _ => return Err(VehicleRefusal::NotPiloted),
        };
        check_sticks(&sticks)?;
        *held = Some(sticks);
        Ok(())
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
                self.undo = None;
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

    /// Replaces the fence; an empty one removes it.
    pub fn replace_fence(&mut self, fence: &Arc<Fence>) {
        self.fence = Arc::clone(fence);
        self.watch.restart();
    }

    /// Replaces the rally points.
    ///
    /// # Errors
    /// One is beyond the fence.
    pub fn replace_rally(&mut self, rally: &Arc<[RallyPoint]>) -> Result<(), VehicleRefusal> {
        for (item, point) in (0..).zip(rally.iter()) {
            check_place(point.place)?;
            if self.fence.breach(point.place).is_some() {
                return Err(VehicleRefusal::RallyBeyondFence { item });
            }
        }
        self.rally = Arc::clone(rally);
        Ok(())
    }

    /// Switches the fence on or off.
    pub fn enable_fence(&mut self, enabled: bool) {
        self.watch.is_off = !enabled;
    }

    /// Whether there is anything to watch: flights without a fence pay nothing for it.
    fn has_fence(&self, rules: &Rules) -> bool {
        !self.fence.areas().is_empty() || rules.navigation.has_fence_altitudes()
    }

    fn watch_fence(&mut self, state: &NavigationState, rules: &Rules, dt_s: f64, publish: Publish) {
        let lands = match self.mode {
            Mode::Mission => self.mission.is_near_ground(),
            Mode::Return => !self.returning.is_empty(),
            _ => false,
        };
        let lands = lands || self.failsafe.has_engine_failed();
        // The wind does not matter here.
        let situation = Situation::new(state, rules, &mut None, dt_s);
        let fence = Arc::clone(&self.fence);
        let Some(change) = self.watch.step(&fence, &situation, lands, state.time) else { return };
        publish(VehicleEvent::Fence(change));
        let action = rules.navigation.fence_action;
        if self.terminated || change == FenceChange::Back {
            return;
        }
        self.undo = None;
        match action {
            FenceAction::Nothing | FenceAction::Report => {}
            FenceAction::Hold => self.enter(Mode::Hold, rules, publish),
            FenceAction::Land if self.land(rules, publish).is_ok() => {}
            FenceAction::Land | FenceAction::Return => self.enter(Mode::Return, rules, publish),
            FenceAction::Terminate => self.terminate(publish),
        }
    }

    /// Chooses where Return flies to: the nearest of home and the rally points inside the fence. Its altitude, m.
    fn choose_refuge(&mut self, rules: &Rules) -> f64 {
        self.refuge = None;
        let Some(here) = self.place else { return rules.return_altitude_m() };
        let distance_m = |place: Place| Horizon::at(here).offset(&Site::at(place)).norm();
        let mut nearest_m = self.home.map_or(f64::INFINITY, |home| distance_m(home.place()));
        for point in self.rally.iter().filter(|point| self.fence.breach(point.place).is_none()) {
            if distance_m(point.place) < nearest_m {
                (nearest_m, self.refuge) = (distance_m(point.place), Some(*point));
            }
        }
        let altitude_m = self.refuge.map(|point| rules.nearest_altitude_m(point.altitude_m));
        altitude_m.unwrap_or_else(|| rules.return_altitude_m())
    }

    /// Begins the way back, and its altitude, m.
    fn begin_return(&mut self, rules: &Rules) -> f64 {
        let landing = self.landing_at_runway(rules);
        self.returning.replace(Arc::new(landing));
        self.returning.start();
        let altitude_m = self.choose_refuge(rules);
        // That of a rally point is for those who circle there.
        if self.returning.is_empty() { altitude_m } else { rules.return_altitude_m() }
    }

    /// The way back to the runway of the takeoff and onto it, in its direction; empty if the flight began in the air.
    fn landing_at_runway(&self, rules: &Rules) -> Plan {
        let Some(runway) = self.ground.runway() else { return Plan::default() };
        let (sin, cos) = libm::sincos(runway.course_rad);
        let (ahead, right) = (Horizontal::new(cos, sin), Horizontal::new(-sin, cos));
        // Behind the place where the roll began, so that a short landing is one on the runway too.
        let aim = ahead * (AIM_S * rules.approach_m_s(rules.ground_m));
        let place = Horizon::at(runway.through.place()).place_at(&aim);
        let height_m = rules.limits.altitude_min_m - rules.ground_m;
        let altitude_m = rules.ground_m + height_m.max(APPROACH_MIN_M);
        let glide_m = (altitude_m - rules.ground_m)
            / libm::tan(rules.navigation.landing_angle_deg.to_radians());
        let approach_m_s = rules.approach_m_s(altitude_m);
        let radius_m = rules.smallest_circle_m(approach_m_s).max(RETURN_CIRCLE_S * approach_m_s);
        let horizon = Horizon::at(place);
        let point = |offset: Horizontal| plan::Point {
            place: Some(horizon.place_at(&offset)),
            altitude_m: Some(altitude_m),
        };
        // The circle touches the extended centre line, far enough out for the turn onto it.
        let out = ahead * -(1.3 * glide_m + radius_m);
        let circle = plan::Circle {
            centre: point(out + right * radius_m),
            radius_m: Some(radius_m),
            clockwise: true,
        };
        let fix =
            plan::Action::Waypoint { point: point(ahead * -(1.15 * glide_m)), acceptance_m: None };
        let touchdown =
            plan::Action::Land { place, altitude_m: rules.ground_m, abort_m: Some(altitude_m) };
        // After a go-around it begins again with the circle.
        let items =
            [plan::Action::LandStart, plan::Action::LoiterToAltitude(circle), fix, touchdown];
        let items = items.map(|action| plan::Item { action, autocontinue: true }).to_vec();
        Plan { id: 1, items }
    }

    /// Arms on the ground, or disarms there once the aircraft is slow.
    pub fn arm(&mut self, armed: bool, publish: Publish) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        if armed == self.ground.is_armed() {
            return Ok(());
        }
        self.ground.check(armed)?;
        if armed && self.demand.is_none() {
            return Err(VehicleRefusal::NotAligned);
        }
        self.ground.set_armed(armed, publish);
        Ok(())
    }

    /// Selects Takeoff: an armed aircraft rolls at once, another when it is armed. An altitude, m, above the ellipsoid.
    pub fn take_off(
        &mut self,
        altitude_m: Option<f64>,
        rules: &Rules,
        publish: Publish,
    ) -> Result<(), VehicleRefusal> {
        rules.check_some(None, altitude_m)?;
        self.change_mode(Mode::Takeoff, rules, publish)?;
        self.takeoff_m = altitude_m;
        Ok(())
    }

    /// Begins the landing of the plan, in Mission; without one that of Return, where the aircraft took off from a runway.
    pub fn land(&mut self, rules: &Rules, publish: Publish) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        let from = self.place.ok_or(VehicleRefusal::NoFlight)?;
        let Some(item) = self.mission.landing(from) else {
            return match self.ground.runway() {
                Some(_) => self.change_mode(Mode::Return, rules, publish),
                None => Err(VehicleRefusal::NoLanding),
            };
        };
        self.select_item(item, publish)?;
        self.change_mode(Mode::Mission, rules, publish)
    }

    /// Ends the approach under way: climbs to an altitude, m, and flies the landing of the plan again.
    pub fn go_around(
        &mut self,
        altitude_m: Option<f64>,
        rules: &Rules,
    ) -> Result<(), VehicleRefusal> {
        self.can_obey()?;
        rules.check_some(None, altitude_m)?;
        match self.mode {
            Mode::Mission => self.mission.go_around(altitude_m),
            Mode::Return => self.returning.go_around(altitude_m),
            _ => Err(VehicleRefusal::NoApproach),
        }
    }

    /// The aircraft is on the ground.
    pub fn touch_down(&mut self, publish: Publish) {
        if self.mode == Mode::Mission {
            self.mission.touch_down(publish);
        }
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
        if core::mem::replace(&mut self.link_lost, true) {
            return;
        }
        let chosen = match action {
            LinkLossAction::Continue => None,
            LinkLossAction::Hold => Some(Mode::Hold),
            LinkLossAction::Return => Some(Mode::Return),
        };
        // A mode that is flown already needs no undoing.
        let chosen = chosen.filter(|chosen| *chosen != self.mode);
        self.undo = chosen.map(|chosen| (chosen, self.mode));
        publish(VehicleEvent::LinkLost(action));
        if let (Some(mode), false) = (chosen, self.terminated) {
            self.enter(mode, rules, publish);
        }
    }

    /// It is back: undoes the reaction to its silence, unless another mode was commanded since. A mode that depends on a
    /// stream is not restored: the stream has to command it again.
    pub fn regain_link(&mut self, rules: &Rules, publish: Publish) {
        if !core::mem::take(&mut self.link_lost) {
            return;
        }
        let undo = self.undo.take().filter(|(chosen, _)| *chosen == self.mode);
        let mode = match undo {
            Some((_, Mode::Offboard | Mode::Altitude)) => Mode::Hold,
            Some((_, before)) => before,
            None => self.mode,
        };
        // The plan may have been cleared meanwhile.
        let can_fly = mode != Mode::Mission || !self.mission.is_empty();
        if can_fly && !self.terminated {
            self.enter(mode, rules, publish);
        }
        publish(VehicleEvent::LinkBack(self.mode));
    }
}

/// A demand that keeps altitude and airspeed, with wings level.
fn present(state: &NavigationState) -> Demand {
    Demand { altitude_m: state.altitude_m, roll_rad: 0.0, airspeed_m_s: state.airspeed_m_s }
}

/// Time constant of the wind estimate, s: so slow that turbulence does not move the circles that depend on it.
const WIND_LAG_S: f64 = 30.0;

/// Input of the guidance at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Situation<'a> {
    rules: &'a Rules,
    /// Time since the previous tick, s.
    dt_s: f64,
    /// Below or above the aircraft.
    place: Place,
    /// Over the ground, m/s.
    velocity: Horizontal,
    /// Ground speed, m/s.
    speed_m_s: f64,
    /// Altitude above the ellipsoid, m.
    altitude_m: f64,
    /// Climb rate, m/s.
    climb_m_s: f64,
    /// Roll angle, rad, positive to the right.
    bank_rad: f64,
    /// Speed of the wind over the ground, m/s, smoothed.
    wind_m_s: f64,
    /// True airspeed, m/s.
    airspeed_m_s: f64,
    /// The engine has not failed.
    may_climb: bool,
    /// Height above the ground, m, where it is measured.
    height_m: Option<f64>,
}

/// A slow estimate of the steady wind over the ground, m/s.
type WindEstimate = Option<Horizontal>;

impl<'a> Situation<'a> {
    /// From the navigation state of a tick, which updates the estimate of the wind. The first wind is the estimate.
    fn new(state: &NavigationState, rules: &'a Rules, wind: &mut WindEstimate, dt_s: f64) -> Self {
        let now = state.wind().0.xy();
        let wind = wind.get_or_insert(now);
        let share = dt_s / (WIND_LAG_S + dt_s);
        *wind += (now - *wind) * share;
        let velocity = state.velocity.0.xy();
        Self {
            rules,
            dt_s,
            place: Place::of(state),
            velocity,
            speed_m_s: velocity.norm(),
            altitude_m: state.altitude_m,
            climb_m_s: state.climb_rate_m_s(),
            bank_rad: state.attitude.phi,
            wind_m_s: wind.norm(),
            airspeed_m_s: state.airspeed_m_s,
            may_climb: true,
            height_m: state.height_above_ground_m,
        }
    }

    /// The axes at the aircraft; computed on demand.
    fn horizon(&self) -> Horizon {
        Horizon::at(self.place)
    }

    /// Course over the ground, rad from north.
    fn course_rad(&self) -> f64 {
        libm::atan2(self.velocity.y, self.velocity.x)
    }

    /// Steering of the guidance that holds a course, rad.
    fn hold_course(&self, course_rad: f64) -> Flown {
        let steering = hold_course(course_rad, &self.velocity, &self.rules.guidance());
        Flown { steering, target: None }
    }
}

#[cfg(test)]
mod tests;
