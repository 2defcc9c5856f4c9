//! Circles, and the mode Hold, which flies one around a point.
//!
//! Without a point the circle touches the present track a roll-in ahead, to the right (or to the left if the
//! request says so): a jet that should stay here begins to turn, instead of flying back over the point.

use super::geodesy::Site;
use super::report::Target;
use super::request::Reposition;
use super::rules::Rules;
use super::situation::Situation;
use flight_control::Demand;
use flight_control::guidance::{Horizontal, Steering, follow_circle};

/// The circle that Hold flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Known from the first tick on.
    centre: Option<Site>,
    radius_m: Option<f64>,
    clockwise: bool,
}

impl Default for Hold {
    /// At the present position, to the right, with the radius of the parameter.
    fn default() -> Self {
        Self { centre: None, radius_m: None, clockwise: true }
    }
}

impl Hold {
    pub fn around(orbit: Orbit) -> Self {
        Self { centre: Some(orbit.centre), radius_m: orbit.radius_m, clockwise: orbit.clockwise }
    }

    /// Applies the values of a request; the others stay.
    pub fn reposition(&mut self, request: &Reposition) {
        self.centre = request.place.map(Site::at).or(self.centre);
        self.radius_m = request.radius_m.or(self.radius_m);
        self.clockwise = request.clockwise.unwrap_or(self.clockwise);
    }

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

/// A circle around a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    pub centre: Site,
    /// Radius of the request, m; `None`: the parameter `NAV_LOITER_RAD`.
    pub radius_m: Option<f64>,
    /// Direction, seen from above.
    pub clockwise: bool,
}

/// A command of the guidance, and its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flown {
    /// For the roll reference.
    pub steering: Steering,
    /// The target, if it is a point.
    pub target: Option<Target>,
}

impl Orbit {
    /// A circle that the present track touches: the aircraft only has to roll in.
    pub fn here(
        situation: &Situation,
        radius_m: Option<f64>,
        clockwise: bool,
        demand: &Demand,
        rules: &Rules,
    ) -> Self {
        let circle = Self { centre: *situation.horizon().site(), radius_m, clockwise };
        let course = situation.course_rad();
        let (sin, cos) = libm::sincos(course);
        let ahead = Horizontal::new(cos, sin);
        let side = if clockwise { 1.0 } else { -1.0 };
        let abeam = Horizontal::new(-sin, cos) * side;
        let radius_m = circle.flown_radius_m(situation, demand, rules);
        // The circle begins when the aircraft has rolled in.
        let centre = ahead * (situation.speed_m_s * rules.roll_in_s()) + abeam * radius_m;
        Self { centre: Site::at(situation.horizon().place_at(&centre)), ..circle }
    }

    /// The radius flown, m: that of the request, or the smallest possible one.
    pub fn flown_radius_m(&self, situation: &Situation, demand: &Demand, rules: &Rules) -> f64 {
        let radius_m = self.radius_m.unwrap_or(rules.navigation.loiter_radius_m);
        radius_m.max(situation.smallest_circle_m(demand.airspeed_m_s, rules))
    }

    /// One tick on the way to the circle or on it.
    pub fn fly(&self, situation: &Situation, demand: &Demand, rules: &Rules) -> Flown {
        let radius_m = self.flown_radius_m(situation, demand, rules);
        let centre = situation.horizon().offset(&self.centre);
        let steering = follow_circle(
            &centre,
            radius_m,
            self.clockwise,
            &situation.velocity,
            &rules.guidance(),
        );
        let target = target(&self.centre, &centre, demand.altitude_m, Some(radius_m));
        Flown { steering, target: Some(target) }
    }
}

/// The target for telemetry.
pub fn target(site: &Site, offset: &Horizontal, altitude_m: f64, radius_m: Option<f64>) -> Target {
    Target {
        place: site.place(),
        altitude_m,
        distance_m: offset.norm(),
        bearing_rad: libm::atan2(offset.y, offset.x),
        radius_m,
    }
}
