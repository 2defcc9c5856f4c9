//! Landing: a straight line over the ground, a glide down to the landing point, and a flare. It gives the same references as
//! any leg: roll, altitude and airspeed. Whoever feels the ground ends it ([`super::Vehicle::touch_down`]).

use core::f64::consts::TAU;

use flight_control::Demand;
use flight_control::guidance::{Horizontal, follow_line};

use super::Situation;
use super::geodesy::{Horizon, Site};
use super::ground::CentreLine;
use super::modes::{Flown, target};
use super::request::Place;
use super::rules::{Rules, STEEPEST_GLIDE};

/// The flare reduces the sink rate to that of the touchdown with this time constant, s.
const FLARE_S: f64 = 5.0;
/// A wrong rate of descent is corrected at this rate, 1/s.
const FLARE_RATE_PER_S: f64 = 0.7;
/// And at once by this times what the lead gives.
const FLARE_GAIN: f64 = 2.0;
/// Least lead of the reference in the flare, s per m/s: where the integrator of the altitude law has taken over the glide, the lead seen
/// there is too small. A quick altitude law needs less, this part of its own lag.
const LEAD_MIN_S2_M: f64 = 0.12;
const LEAD_MIN_LAGS: f64 = 0.7;
/// The height of the ground is taken from the measured one with this time constant, s.
const GROUND_LAG_S: f64 = 2.0;
/// The glide leads on below the ground behind the landing point for this time at most, s: an aircraft above it still comes down.
const BEYOND_S: f64 = 15.0;
/// Shortest line of an approach, as a way of the present speed, s.
const LINE_MIN_S: f64 = 2.0;
/// A go-around leads to this height above the ground at least, m.
const AROUND_MIN_M: f64 = 40.0;
/// Whether it is stable is looked at after this time, s.
const DECISION_AFTER_S: f64 = 4.0;
/// An approach that is not stable at this times the height of the flare is given up: it is farther from its line than the way of this time,
/// s, and than this, m; its track is off by more than this, rad; or its airspeed is out of this range over that of the approach.
const DECISION: f64 = 2.0;
const OFF_LINE_S: f64 = 0.15;
const OFF_LINE_MIN_M: f64 = 6.0;
const OFF_COURSE_RAD: f64 = 0.15;
const SPEEDS: core::ops::RangeInclusive<f64> = 0.85..=1.5;
/// The nose is turned into the track below the height that this rate of descent takes this time, s.
const ALIGN_S: f64 = 2.5;
/// Time constant with which the reference comes to lead the glide, s: twice the lag of the slowest altitude law.
const LEAD_S: f64 = 20.0;

/// An approach being flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    from: Site,
    to: Site,
    /// Altitude of the landing point, m.
    ground_m: f64,
    /// Sink per distance.
    slope: f64,
    /// Altitude of a go-around, m.
    abort_m: f64,
    /// True airspeed before the approach, m/s.
    cruise_m_s: f64,
    /// How far the reference leads the glide so that the aircraft is on it, m.
    lead_m: f64,
    flare: Option<Flare>,
    /// Whether it was stable has been looked at.
    decided: bool,
    /// Time since its beginning, s.
    for_s: f64,
    /// Course of a go-around, rad, once it has been commanded; `None` until its first tick.
    around: Option<Option<f64>>,
}

/// The flare: the rate of descent falls with the height. The altitude law follows a reference below it with a rate of descent in
/// proportion, so the reference is placed for the rate wanted, and moved by what that misses.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Flare {
    /// How far the reference led the aircraft at the rate of descent with which the flare began, s.
    lead_s: f64,
    /// Rate of descent that the reference has to give more, m/s.
    correction_m_s: f64,
}

impl Approach {
    /// Along the line from a point. The glide is as steep as `FW_LND_ANG`, or as the altitude left needs where that is steeper.
    pub fn new(
        from: Site,
        place: Place,
        (ground_m, abort_m): (f64, Option<f64>),
        situation: &Situation,
        demand: &mut Demand,
    ) -> Self {
        let (to, rules, horizon) = (Site::at(place), situation.rules, situation.horizon());
        // Points closer to each other have no direction to land in: that from here has, or the present course.
        let shortest_m = LINE_MIN_S * situation.speed_m_s;
        let is_line =
            |from: &Site| (horizon.offset(&to) - horizon.offset(from)).norm() > shortest_m;
        let (sin, cos) = libm::sincos(situation.course_rad());
        let behind = horizon.offset(&to) - Horizontal::new(cos, sin) * shortest_m;
        let from = [from, horizon.site].into_iter().find(is_line);
        let from = from.unwrap_or_else(|| Site::at(horizon.place_at(&behind)));
        let height_m = demand.altitude_m - ground_m;
        let distance_m = horizon.offset(&to).norm().max(1.0);
        let shallow = libm::tan(rules.navigation.landing_angle_deg.to_radians());
        let cruise_m_s = demand.airspeed_m_s;
        demand.airspeed_m_s = rules.approach_m_s(ground_m);
        Self {
            from,
            to,
            ground_m,
            slope: shallow.max((height_m / distance_m).min(STEEPEST_GLIDE)),
            abort_m: abort_m.unwrap_or(demand.altitude_m).max(ground_m + AROUND_MIN_M),
            cruise_m_s,
            lead_m: 0.0,
            flare: None,
            decided: false,
            for_s: 0.0,
            around: None,
        }
    }

    /// From here down with this slope, without a go-around: the landing of an aircraft that cannot climb.
    pub fn straight_ahead(from: Site, place: Place, slope: f64, rules: &Rules) -> Self {
        Self {
            from,
            to: Site::at(place),
            ground_m: rules.ground_m,
            slope,
            abort_m: rules.ground_m,
            cruise_m_s: 0.0,
            lead_m: 0.0,
            flare: None,
            decided: true,
            for_s: 0.0,
            around: None,
        }
    }

    /// The line over the ground.
    pub fn line(&self) -> CentreLine {
        let along = Horizon::at(self.from.place()).offset(&self.to);
        CentreLine { through: self.to, course_rad: libm::atan2(along.y, along.x) }
    }

    /// The flare has begun: the altitude of the reference is no path.
    pub fn is_flaring(&self) -> bool {
        self.flare.is_some() && self.around.is_none()
    }

    /// It leads down, and is not given up.
    pub fn leads_down(&self) -> bool {
        self.around.is_none()
    }

    /// Height above the ground, m: the measured one where there is one.
    fn height_m(&self, situation: &Situation) -> f64 {
        situation.height_m.unwrap_or(situation.altitude_m - self.ground_m)
    }

    /// Height of the flare, m: there its rate of descent is that of the glide.
    fn flare_m(&self, situation: &Situation) -> f64 {
        FLARE_S * (situation.speed_m_s * self.slope - situation.rules.navigation.touchdown_m_s)
    }

    /// Whether it has just been found unstable, which is looked at once, while there is height for a go-around.
    pub fn is_unstable(&mut self, situation: &Situation) -> bool {
        let is_early = self.height_m(situation) > DECISION * self.flare_m(situation)
            || self.for_s < DECISION_AFTER_S;
        if is_early
            || self.flare.is_some()
            || self.around.is_some()
            || core::mem::replace(&mut self.decided, true)
        {
            return false;
        }
        let line = self.line();
        let to = situation.horizon().offset(&line.through);
        let (sin, cos) = libm::sincos(line.course_rad);
        let off_m = Horizontal::new(-sin, cos).dot(&to).abs();
        let off_rad = libm::remainder(situation.course_rad() - line.course_rad, TAU).abs();
        let speed = situation.airspeed_m_s / situation.rules.approach_m_s(self.ground_m);
        off_m > OFF_LINE_MIN_M.max(OFF_LINE_S * situation.speed_m_s)
            || off_rad > OFF_COURSE_RAD
            || !SPEEDS.contains(&speed)
    }

    /// Heading to which the nose is turned just before the touchdown, rad from north.
    pub fn alignment_rad(&self, height_m: Option<f64>, rules: &Rules) -> Option<f64> {
        let is_low = height_m.is_some_and(|m| m < ALIGN_S * rules.navigation.touchdown_m_s);
        (self.is_flaring() && is_low).then(|| self.line().course_rad)
    }

    pub fn go_around(&mut self, altitude_m: Option<f64>) {
        self.abort_m = altitude_m.unwrap_or(self.abort_m);
        self.around = Some(None);
    }

    /// One tick; `None` at the altitude of a go-around.
    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand) -> Option<Flown> {
        let (rules, horizon) = (situation.rules, situation.horizon());
        self.for_s += situation.dt_s;
        if let Some(height_m) = situation.height_m {
            let change_m = situation.altitude_m - height_m - self.ground_m;
            self.ground_m += change_m * situation.dt_s / (GROUND_LAG_S + situation.dt_s);
        }
        if let Some(course) = &mut self.around {
            let course_rad = *course.get_or_insert_with(|| situation.course_rad());
            demand.altitude_m = rules.nearest_altitude_m(self.abort_m);
            demand.airspeed_m_s = self.cruise_m_s;
            let left_m = demand.altitude_m - situation.altitude_m;
            return (left_m > rules.altitude_reached_m())
                .then(|| situation.hold_course(course_rad));
        }
        let (from, to) = (horizon.offset(&self.from), horizon.offset(&self.to));
        let line = to - from;
        let left_m = if line.norm() > 1.0 { to.dot(&line) / line.norm() } else { to.norm() };
        let (altitude_m, touchdown_m_s) = (situation.altitude_m, rules.navigation.touchdown_m_s);
        // The glide is as good as the altitude, the flare has to be better.
        let height_m = self.height_m(situation);
        let sink_m_s = -situation.climb_m_s;
        let wanted_m_s = height_m.max(0.0) / FLARE_S + touchdown_m_s;
        // An aircraft that does not sink yet has nothing to flare from.
        let is_flare = height_m <= self.flare_m(situation).max(touchdown_m_s)
            && (sink_m_s >= wanted_m_s || height_m <= touchdown_m_s);
        if self.flare.is_none() && !is_flare {
            // Level until the glide begins, and never back up to it.
            let beyond_m = BEYOND_S * situation.speed_m_s;
            let glide_m = self.ground_m + self.slope * left_m.max(-beyond_m);
            if glide_m < demand.altitude_m + self.lead_m {
                let change = (altitude_m - glide_m) * situation.dt_s / LEAD_S;
                self.lead_m = (self.lead_m + change).min(rules.altitude.error_max_m).max(0.0);
                // Farther below it the altitude law sees nothing more, and the flare would have to come up from there.
                demand.altitude_m =
                    (glide_m - self.lead_m).max(altitude_m - rules.altitude.error_max_m);
            }
        } else {
            let lead_s = (altitude_m - demand.altitude_m) / sink_m_s.max(touchdown_m_s);
            let least_s = (LEAD_MIN_S2_M * situation.speed_m_s)
                .min(LEAD_MIN_LAGS * rules.altitude.lag_s(situation.airspeed_m_s));
            let begun = Flare { lead_s: lead_s.min(LEAD_S).max(least_s), correction_m_s: 0.0 };
            let flare = self.flare.get_or_insert(begun);
            let too_fast_m_s = sink_m_s - wanted_m_s;
            flare.correction_m_s += FLARE_RATE_PER_S * too_fast_m_s * situation.dt_s;
            demand.altitude_m = altitude_m
                + flare.lead_s * (FLARE_GAIN * too_fast_m_s + flare.correction_m_s - wanted_m_s);
            demand.airspeed_m_s =
                0.5 * (rules.approach_m_s(self.ground_m) + rules.rotation_m_s(self.ground_m));
        }
        let steering = follow_line(&from, &to, &situation.velocity, &rules.guidance());
        Some(Flown { steering, target: Some(target(&self.to, &to, demand.altitude_m, None)) })
    }
}
