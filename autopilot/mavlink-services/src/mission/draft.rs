//! A plan during upload: every item is checked on receipt, and the whole plan takes effect at the end.

use ::mavlink::dialects::common::MavMissionResult;

use crate::codec::MissionItem;
use crate::mission::action;
use crate::mission::fields::{Note, Notes, Param, Rejected, is_absolute};
use crate::mission::wire::Stored;
use flight_management::vehicle::geodesy::{Horizon, Site};
use flight_management::vehicle::plan::{Action, Circle, ITEMS_MAX, Item, Plan};
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Place};

/// Longest leg, m. A longer one ends on another continent: latitude and longitude exchanged, or a plan
/// for another aircraft.
const LEG_MAX_M: f64 = 5.0e6;

/// Items received, in order.
#[derive(Debug)]
pub struct Draft {
    count: u16,
    wire: Vec<MissionItem<i32>>,
    items: Vec<Item>,
    /// Item 0, taken as home until an item shows that it is a waypoint.
    home: Option<MissionItem<i32>>,
    /// The last point so far.
    place: Option<Place>,
    /// Airspeed reference so far.
    airspeed: Option<Airspeed>,
    notes: Notes,
}

/// A plan whose items have all been received.
#[derive(Debug)]
pub struct Finished {
    pub stored: Stored,
    pub plan: Plan,
    /// Differences between the two.
    pub notes: Notes,
}

impl Draft {
    /// Waits for this many items. `place` and `airspeed` are the present ones of the aircraft.
    pub fn new(
        count: u16,
        place: Option<Place>,
        airspeed: Option<Airspeed>,
    ) -> Result<Self, Rejected> {
        if usize::from(count) > ITEMS_MAX {
            return Err(Rejected {
                result: MavMissionResult::MAV_MISSION_NO_SPACE,
                reason: format!("{count} items are more than {ITEMS_MAX}"),
            });
        }
        let (wire, items) = (Vec::new(), Vec::new());
        let notes = Notes::default();
        Ok(Self { count, wire, items, home: None, place, airspeed, notes })
    }

    /// Number of items to come in all.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// The item to request next.
    pub fn next(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }

    /// All items have been received.
    pub fn is_complete(&self) -> bool {
        self.next() >= self.count
    }

    /// Adds the next item. An item 0 that is the home position of a file (`QGC WPL 110`) leads to item 1, so that the
    /// targets of jumps stay right.
    pub fn take(&mut self, item: &MissionItem<i32>, rules: &Rules) -> Result<(), Rejected> {
        let seq = self.next();
        let flown = if seq == 0 && self.count > 1 && action::may_be_home(item) {
            self.home = Some(*item);
            Item { action: Action::Jump { to: 1, times: None }, autocontinue: true }
        } else {
            self.settle_home(item, rules)?;
            self.check(item, seq, rules)?
        };
        self.items.push(flown);
        self.wire.push(*item);
        Ok(())
    }

    /// Decides what item 0 is when the first item that is flown arrives: a waypoint where that item is absolute too and
    /// the altitude could be flown, else home.
    fn settle_home(&mut self, item: &MissionItem<i32>, rules: &Rules) -> Result<(), Rejected> {
        let Some(first) = self.home.take_if(|_| !action::is_immediate(item)) else { return Ok(()) };
        let is_low = first.z <= 0.0 || f64::from(first.z) < rules.limits.altitude_min_m;
        if !is_absolute(item) || is_low {
            self.notes.add(Note::Home, 0);
            return Ok(());
        }
        let waypoint = self.check(&first, 0, rules)?;
        if let Some(item) = self.items.first_mut() {
            *item = waypoint;
        }
        Ok(())
    }

    /// The item as flown. A delay is flown at the point before it.
    fn check(
        &mut self,
        item: &MissionItem<i32>,
        seq: u16,
        rules: &Rules,
    ) -> Result<Item, Rejected> {
        let mut taken = action::of(item, rules, &mut |note| self.notes.add(note, seq));
        if let (action::DELAY, Ok(Action::LoiterTime { circle, .. })) =
            (item.words.command, &mut taken)
        {
            circle.centre.place = self.place;
        }
        let action = taken
            .and_then(|action| self.follow(&action, rules).map(|()| action))
            .map_err(|rejected| rejected.of_item(seq))?;
        Ok(Item { action, autocontinue: item.words.autocontinue })
    }

    /// Checks an action against the earlier ones, and records what it changes for the later ones.
    fn follow(&mut self, action: &Action, rules: &Rules) -> Result<(), Rejected> {
        match action {
            Action::Waypoint { point, .. } => self.go_to(point.place)?,
            Action::LoiterUnlimited(circle)
            | Action::LoiterToAltitude(circle)
            | Action::LoiterTurns { circle, .. }
            | Action::LoiterTime { circle, .. } => {
                self.go_to(circle.centre.place)?;
                self.circle(circle, rules);
            }
            Action::ChangeSpeed { airspeed } => self.airspeed = Some(*airspeed),
            Action::Jump { to, .. } if *to >= self.count => {
                let last = self.count.saturating_sub(1);
                let reason = format!("jump to item {to} is outside 0 to {last}");
                return Err(Rejected::param(Param::P1, reason));
            }
            Action::ChangeAltitude { .. } | Action::Jump { .. } | Action::Return => {}
        }
        Ok(())
    }

    fn go_to(&mut self, place: Option<Place>) -> Result<(), Rejected> {
        let (Some(from), Some(to)) = (self.place, place) else {
            self.place = place.or(self.place);
            return Ok(());
        };
        let distance_m = Horizon::at(from).offset(&Site::at(to)).norm();
        if distance_m > LEG_MAX_M {
            let reason = format!(
                "the way there, {:.0} km, is longer than {:.0} km",
                distance_m / 1.0e3,
                LEG_MAX_M / 1.0e3
            );
            return Err(Rejected::param(Param::X, reason));
        }
        self.place = Some(to);
        Ok(())
    }

    /// A circle that is too small at the airspeed it will have is widened.
    fn circle(&mut self, circle: &Circle, rules: &Rules) {
        let (Some(radius_m), Some(airspeed)) = (circle.radius_m, self.airspeed) else {
            return;
        };
        let altitude_m = circle.centre.altitude_m.unwrap_or(rules.limits.altitude_min_m);
        let airspeed_m_s = airspeed.true_m_s(altitude_m);
        let needed_m = rules.smallest_circle_m(airspeed_m_s);
        if radius_m < needed_m {
            self.notes.add(Note::Widened { airspeed_m_s, radius_m: needed_m }, self.next());
        }
    }

    /// The plan, once it is complete.
    pub fn finish(mut self) -> Finished {
        if self.home.is_some() {
            self.notes.add(Note::Home, 0);
        }
        let stored = Stored::new(self.wire);
        let plan = Plan { id: stored.id, items: self.items };
        Finished { stored, plan, notes: self.notes }
    }
}
