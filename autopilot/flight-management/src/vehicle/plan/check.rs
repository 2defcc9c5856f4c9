//! A plan is checked as a whole before it replaces another.

use super::{Action, Circle, ITEMS_MAX, Item, Plan, Point};
use crate::vehicle::VehicleRefusal;
use crate::vehicle::rules::{self, Checked, RADIUS_MAX_M, Rules};

/// Most turns of a circle.
const TURNS_MAX: f64 = 1_000.0;
/// Longest time on a circle, s: a day.
const SECONDS_MAX: f64 = 86_400.0;

impl Plan {
    /// Checks every item against the limits.
    ///
    /// # Errors
    /// [`VehicleRefusal`] names the first item that cannot be flown, its value and the range.
    pub fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        let count = self.items.len();
        if count > ITEMS_MAX {
            return Err(VehicleRefusal::PlanTooLong { items: count, max: ITEMS_MAX });
        }
        for (number, item) in (0_u16..).zip(&self.items) {
            item.check(rules).map_err(|refusal| refusal.of_item(number))?;
            if let Action::Jump { to, times } = item.action {
                self.check_jump(number, to, times)?;
            }
        }
        Ok(())
    }

    /// The jump arrives, and if it has no end, not at itself again before something has been flown. Counted
    /// jumps are used up sooner or later and do not lead away then.
    fn check_jump(&self, number: u16, to: u16, times: Option<u16>) -> Result<(), VehicleRefusal> {
        if usize::from(to) >= self.items.len() {
            return Err(VehicleRefusal::NoSuchItem { item: to, items: self.count() });
        }
        if times.is_some() {
            return Ok(());
        }
        let mut at = to;
        for _ in 0..self.items.len() {
            let Some(item) = self.items.get(usize::from(at)) else { return Ok(()) };
            match item.action {
                Action::Jump { to, times: None } => at = to,
                Action::Jump { times: Some(_), .. } => at += 1,
                Action::ChangeSpeed { .. } if item.autocontinue => at += 1,
                _ => return Ok(()),
            }
        }
        Err(VehicleRefusal::EndlessJump { item: number })
    }

    /// How many items there are.
    #[must_use]
    pub fn count(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }
}

impl VehicleRefusal {
    /// The same about an item of a plan.
    fn of_item(self, item: u16) -> Self {
        match self {
            Self::OutOfRange { what, unit, value, min, max } => {
                Self::ItemOutOfRange { item, what, unit, value, min, max }
            }
            other => other,
        }
    }
}

impl Item {
    fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        let ranged = |checked: Checked| checked.check();
        match self.action {
            Action::Waypoint { point, acceptance_m } => {
                point.check(rules)?;
                let acceptance_m = acceptance_m.unwrap_or(0.0);
                ranged(rules::up_to("acceptance radius", "m", acceptance_m, RADIUS_MAX_M))
            }
            Action::LoiterUnlimited(circle) | Action::LoiterToAltitude(circle) => {
                circle.check(rules)
            }
            Action::LoiterTurns { circle, turns } => {
                circle.check(rules)?;
                ranged(rules::up_to("number of turns", "turns", turns, TURNS_MAX))
            }
            Action::LoiterTime { circle, seconds } => {
                circle.check(rules)?;
                ranged(rules::up_to("time", "s", seconds, SECONDS_MAX))
            }
            Action::ChangeSpeed { airspeed_m_s } => {
                rules.check_some(None, None, Some(airspeed_m_s))
            }
            Action::ChangeAltitude { altitude_m } => rules.check_some(None, Some(altitude_m), None),
            Action::Jump { .. } | Action::Return => Ok(()),
        }
    }
}

impl Point {
    fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        rules.check_some(self.place, self.altitude_m, None)
    }
}

impl Circle {
    fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        self.centre.check(rules)?;
        self.radius_m.map_or(Ok(()), |radius_m| rules::radius(radius_m).check())
    }
}
