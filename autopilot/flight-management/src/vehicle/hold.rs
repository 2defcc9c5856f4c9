//! Hold: around a point.
//!
//! Without a point the circle touches the present track a roll-in ahead, to the right (or to the left if
//! that was asked for): a jet that should stay here begins to turn, instead of flying back over the point.

use flight_control::Demand;

use super::circling::{Flown, Orbit};
use super::geodesy::Site;
use super::request::Reposition;
use super::rules::Rules;
use super::situation::Situation;

/// What Hold circles around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Known from the first tick on.
    centre: Option<Site>,
    radius_m: Option<f64>,
    clockwise: bool,
}

impl Default for Hold {
    /// Here, to the right, with the radius of the parameter.
    fn default() -> Self {
        Self { centre: None, radius_m: None, clockwise: true }
    }
}

impl Hold {
    /// Around this circle.
    #[must_use]
    pub fn around(orbit: Orbit) -> Self {
        Self { centre: Some(orbit.centre), radius_m: orbit.radius_m, clockwise: orbit.clockwise }
    }

    /// Takes what a request names; the rest stays.
    pub fn reposition(&mut self, wanted: &Reposition) {
        self.centre = wanted.place.map(Site::at).or(self.centre);
        self.radius_m = wanted.radius_m.or(self.radius_m);
        self.clockwise = wanted.clockwise.unwrap_or(self.clockwise);
    }

    /// One tick.
    pub fn fly(&mut self, situation: &Situation, demand: &Demand, rules: &Rules) -> Flown {
        let Self { radius_m, clockwise, .. } = *self;
        let orbit = match self.centre {
            Some(centre) => Orbit { centre, radius_m, clockwise },
            None => Orbit::here(situation, radius_m, clockwise, demand, rules),
        };
        self.centre = Some(orbit.centre);
        orbit.fly(situation, demand, rules)
    }
}
