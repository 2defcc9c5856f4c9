//! The aircraft on the ground, without its guidance.

use super::*;
use crate::vehicle::ground::GroundOperation;

/// An aircraft on the runway at 264 m/s, its rotation long behind it.
struct Roll {
    ground: GroundOperation,
    events: Vec<VehicleEvent>,
    state: NavigationState,
    wants_takeoff: bool,
}

impl Roll {
    /// Armed and at rest.
    fn ready() -> Self {
        let state = NavigationState { on_wheels: true, ..level(SimTime::ZERO) };
        let ground = GroundOperation::default();
        let mut roll = Self { ground, events: Vec::new(), state, wants_takeoff: false };
        roll.speed(0.0);
        roll.tick();
        roll.arm(true);
        roll
    }

    fn rolling() -> Self {
        let mut roll = Self::ready();
        roll.wants_takeoff = true;
        roll.tick();
        roll.speed(264.0);
        roll.tick();
        roll
    }

    fn rules() -> Rules {
        Rules { stall_m_s: 75.0, ..rules() }
    }

    fn speed(&mut self, m_s: f64) {
        (self.state.airspeed_m_s, self.state.velocity.0.x) = (m_s, m_s);
    }

    fn arm(&mut self, armed: bool) {
        self.ground.check(armed).unwrap();
        self.ground.set_armed(armed, &mut |event| self.events.push(event));
    }

    /// A tenth of a second; whether it touches down.
    fn tick(&mut self) -> bool {
        let Self { ground, events, state, wants_takeoff } = self;
        let rules = Self::rules();
        ground.step(state, &rules, 0.1, *wants_takeoff, None, &mut |event| events.push(event))
    }

    fn ticks(&mut self, on_wheels: bool, count: usize) -> bool {
        self.state.on_wheels = on_wheels;
        (0..count).any(|_| self.tick())
    }

    fn accelerates(&self) -> bool {
        self.ground.demand().full_thrust
    }

    fn count(&self, event: VehicleEvent) -> usize {
        self.events.iter().filter(|seen| **seen == event).count()
    }
}

#[test]
fn wheels_that_touch_again_soon_and_fast_belong_to_the_takeoff() {
    let mut roll = Roll::rolling();
    for _ in 0..4 {
        assert!(!roll.ticks(false, 3) && !roll.ticks(true, 3), "no touchdown");
        assert!(roll.accelerates());
    }
    assert_eq!(roll.count(VehicleEvent::LiftOff), 1, "{:?}", roll.events);
    // A little slower than the rotation, by a gust.
    roll.speed(0.95 * Roll::rules().rotation_m_s(roll.state.altitude_m));
    roll.ticks(true, 1);
    assert!(roll.accelerates());
    roll.speed(264.0);
    // In the air for longer than two seconds in all: the next contact is a touchdown.
    assert!(!roll.ticks(false, 12) && roll.ticks(true, 1));
    assert!(roll.ground.is_stopping() && !roll.accelerates());
}

#[test]
fn an_aircraft_that_settles_behind_its_lift_off_gives_the_takeoff_up() {
    let mut roll = Roll::rolling();
    assert!(!roll.ticks(false, 3) && !roll.ticks(true, 3));
    // On its belly it becomes slow.
    roll.speed(20.0);
    roll.ticks(true, 2);
    assert!(roll.ground.is_stopping() && !roll.accelerates());
    assert_eq!(roll.count(VehicleEvent::TakeoffAborted), 1, "{:?}", roll.events);
    // Slow already when it touches: a touchdown.
    let mut roll = Roll::rolling();
    roll.ticks(false, 3);
    roll.speed(20.0);
    assert!(roll.ticks(true, 1) && roll.ground.is_stopping());
}

#[test]
fn a_roll_that_has_left_its_line_is_given_up() {
    for (psi, is_given_up) in [(0.9, false), (-0.9, false), (1.1, true), (-1.1, true)] {
        let mut roll = Roll::rolling();
        roll.state.attitude.psi = psi;
        roll.ticks(true, 3);
        assert_eq!(roll.ground.is_stopping(), is_given_up, "{psi}: {:?}", roll.events);
    }
}

#[test]
fn a_takeoff_after_a_disarming_begins_anew() {
    // In the last seconds of a rollout.
    let mut roll = Roll::rolling();
    roll.ticks(false, 30);
    roll.wants_takeoff = false;
    assert!(roll.ticks(true, 1) && roll.ground.is_stopping());
    roll.speed(1.0);
    roll.ticks(true, 2);
    roll.arm(false);
    roll.ticks(true, 1);
    roll.arm(true);
    roll.wants_takeoff = true;
    roll.ticks(true, 30);
    assert!(roll.accelerates() && roll.ground.is_armed(), "{:?}", roll.events);
    // At the beginning of a roll.
    let mut roll = Roll::ready();
    roll.wants_takeoff = true;
    roll.ticks(true, 2);
    roll.arm(false);
    roll.wants_takeoff = false;
    roll.ticks(true, 1);
    roll.arm(true);
    roll.ticks(true, 1);
    assert!(!roll.accelerates() && !roll.ground.is_stopping(), "{:?}", roll.events);
    assert_eq!(roll.count(VehicleEvent::TakeoffAborted), 0, "{:?}", roll.events);
}
