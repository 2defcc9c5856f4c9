//! Where the path goes on after the current item.

use super::Mission;
use crate::vehicle::geodesy::Site;
use crate::vehicle::plan::Action;

/// Items without a place that are looked past.
const STEPS_MAX: usize = 32;

impl Mission {
    /// The point that is flown to after the current item, if there is one and the item goes on by itself.
    pub(super) fn next_point(&self, home: Option<Site>) -> Option<Site> {
        let current = self.plan.items.get(usize::from(self.current))?;
        if !current.autocontinue {
            return None;
        }
        let mut at = self.current.saturating_add(1);
        for _ in 0..STEPS_MAX {
            let item = self.plan.items.get(usize::from(at))?;
            match item.action {
                Action::Waypoint { point, .. } => return point.place.map(Site::at),
                Action::LoiterUnlimited(circle)
                | Action::LoiterToAltitude(circle)
                | Action::LoiterTurns { circle, .. }
                | Action::LoiterTime { circle, .. } => return circle.centre.place.map(Site::at),
                Action::Return => return home,
                Action::ChangeAltitude { .. } => return None,
                Action::ChangeSpeed { .. } if item.autocontinue => at = at.saturating_add(1),
                Action::ChangeSpeed { .. } => return None,
                Action::Jump { to, times } => {
                    let jumped = self.jumped.get(usize::from(at)).copied().unwrap_or(0);
                    let leads_on = times.is_none_or(|times| jumped < times);
                    at = if leads_on { to } else { at.saturating_add(1) };
                }
            }
        }
        None
    }
}
