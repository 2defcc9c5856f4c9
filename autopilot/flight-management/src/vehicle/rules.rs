//! The parameters of the vehicle: limits of references, and the guidance; the checks of references and commands on receipt.
//! Defaults and ranges of the parameters are in their table.

use core::f64::consts::FRAC_PI_2;

use flight_control::aircraft_model::TrimModel;
use flight_control::design_model::atmosphere;
use flight_control::design_model::level_turn::stall_airspeed_m_s;
use flight_control::gains::AltitudeResponse;
use flight_control::guidance::Horizontal;
use flight_control::guidance::approach::planned_radius_m;
use flight_control::{AircraftModel, Gains, GuidanceGains};
use serde::{Deserialize, Serialize};

use super::request::{
    Airspeed, EngineAction, FenceAction, FuelAction, Place, Reference, VehicleRefusal,
};

/// Parameters of the guidance.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct NavigationParameters {
    /// Period of the lateral guidance, s.
    pub l1_period_s: f64,
    /// Damping of the lateral guidance.
    pub l1_damping: f64,
    /// Largest bank angle of the guidance, deg.
    pub bank_max_deg: f64,
    /// Radius of circles without a given radius, m.
    pub loiter_radius_m: f64,
    /// Smallest acceptance radius of waypoints, m.
    pub acceptance_m: f64,
    /// Largest climb rate of stick and offboard references, m/s.
    pub climb_max_m_s: f64,
    /// Altitude of the return, m above the ellipsoid.
    pub return_altitude_m: f64,
    /// Fastest change of a roll reference that the guidance commands, deg/s.
    pub roll_slew_deg_s: f64,
    /// Steepness of the glide to a landing, deg.
    pub landing_angle_deg: f64,
    /// Calibrated airspeed of an approach, m/s; 0: the lowest reference.
    pub landing_airspeed_m_s: f64,
    /// Sink rate at the touchdown, m/s.
    pub touchdown_m_s: f64,
    /// Height above the ground to which a takeoff climbs, m.
    pub takeoff_height_m: f64,
    /// Pitch attitude of the rotation, deg.
    pub takeoff_pitch_deg: f64,
    pub fence_action: FenceAction,
    /// Highest and lowest altitude of the fence above home, m; 0: none.
    pub fence_max_m: f64,
    pub fence_min_m: f64,
    /// Bank angle without a position, deg.
    pub lost_bank_deg: f64,
    pub engine_action: EngineAction,
    pub fuel_action: FuelAction,
    /// Levels of the fuel, of a full tank.
    pub low_fuel: f64,
    pub critical_fuel: f64,
    pub emergency_fuel: f64,
}

impl NavigationParameters {
    /// The fence limits the altitude.
    pub fn has_fence_altitudes(&self) -> bool {
        self.fence_max_m > 0.0 || self.fence_min_m > 0.0
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ReferenceLimits {
    /// Lowest altitude, m.
    pub altitude_min_m: f64,
    /// Highest altitude, m.
    pub altitude_max_m: f64,
    /// Lowest calibrated airspeed, m/s.
    pub airspeed_min_m_s: f64,
    /// Highest calibrated airspeed, m/s.
    pub airspeed_max_m_s: f64,
    /// Largest roll angle either way, deg.
    pub roll_max_deg: f64,
}

impl ReferenceLimits {
    /// Lowest and highest true airspeed at an altitude, m/s.
    pub fn airspeeds_m_s(&self, altitude_m: f64) -> [f64; 2] {
        [self.airspeed_min_m_s, self.airspeed_max_m_s]
            .map(|calibrated_m_s| atmosphere::true_airspeed(calibrated_m_s, altitude_m))
    }

    /// Checks an airspeed of a plan, whose altitude is not known yet.
    pub fn check_airspeed(&self, airspeed: Airspeed) -> Result<(), VehicleRefusal> {
        match airspeed {
            Airspeed::Calibrated(value) => {
                let range = (self.airspeed_min_m_s, self.airspeed_max_m_s);
                within("calibrated airspeed", "m/s", value, range)
            }
            Airspeed::True(value) => {
                // The widest range of all altitudes. Where it is flown, the speed is limited again.
                let [min, _] = self.airspeeds_m_s(self.altitude_min_m);
                let [_, max] = self.airspeeds_m_s(self.altitude_max_m);
                within("true airspeed", "m/s", value, (min, max))
            }
        }
    }

    /// Checks a reference at an altitude; NaN is outside every range.
    pub fn check(&self, reference: Reference, altitude_m: f64) -> Result<(), VehicleRefusal> {
        let roll = (-self.roll_max_deg, self.roll_max_deg);
        match reference {
            Reference::Altitude(value) => {
                within("altitude", "m", value, (self.altitude_min_m, self.altitude_max_m))
            }
            Reference::Airspeed(value) => {
                within("true airspeed", "m/s", value, self.airspeeds_m_s(altitude_m).into())
            }
            Reference::Roll(value) => within("roll", "deg", value.to_degrees(), roll),
            Reference::Course(value) => {
                // West is 270 for some and -90 for others.
                within("course", "deg", value.to_degrees(), (-180.0, 360.0))
            }
        }
    }
}

/// Airspeeds over that of the stall: 14 CFR 25.125 for the approach; 25.107 has at least 1.05 for a rotation.
const APPROACH_OVER_STALL: f64 = 1.3;
const ROTATION_OVER_STALL: f64 = 1.1;

/// Steepest glide where the altitude left needs one, sink per distance (10 deg); from higher up the aircraft lands behind the point.
pub const STEEPEST_GLIDE: f64 = 0.176;

/// Checks a number against its range; NaN is outside every range.
pub fn within(
    what: &'static str,
    unit: &'static str,
    value: f64,
    (min, max): (f64, f64),
) -> Result<(), VehicleRefusal> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(VehicleRefusal::OutOfRange { what, unit, value, min, max })
    }
}

/// Largest radius of a circle, m.
pub const RADIUS_MAX_M: f64 = 200_000.0;
/// Largest latitude either way, deg: at a pole no direction is north.
const LATITUDE_MAX_DEG: f64 = 89.9;

/// Circles have at least this multiple of the radius of the tightest turn, which leaves bank for following
/// them.
const CIRCLE_RESERVE: f64 = 1.1;

/// At this change of the roll reference, deg/s and rad/s (nine digits), rolling into a turn takes [`ROLL_IN_S`].
const ROLL_SLEW_DEG_S: f64 = 20.0;
const ROLL_SLEW_RAD_S: f64 = 0.349_065_85;
const ROLL_IN_S: f64 = 2.0;

/// Turns begin early as if they were no more than a right angle: the rest of a sharper one is flown
/// beyond the point.
const ANTICIPATED_MAX_RAD: f64 = FRAC_PI_2;
/// A turn begins within this fraction of the shorter of its two legs.
pub const LEG_SHARE: f64 = 0.5;

/// The parameters of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    pub limits: ReferenceLimits,
    pub navigation: NavigationParameters,
    pub altitude: AltitudeResponse,
    /// Calibrated airspeeds of the aircraft's model, m/s: of the stall, and of its design point. Zero where the model is not known.
    pub stall_m_s: f64,
    pub design_m_s: f64,
    /// Altitude of the ground, m, from which the lowest altitude reference counts.
    pub ground_m: f64,
}

pub fn check_place(place: Place) -> Result<(), VehicleRefusal> {
    let angle =
        |what, radians: f64, max: f64| within(what, "deg", radians.to_degrees(), (-max, max));
    angle("latitude", place.latitude_rad, LATITUDE_MAX_DEG)?;
    // Slightly more, since a conversion to radians and back rounds.
    angle("longitude", place.longitude_rad, 180.000_001)
}

/// Radius of a circle, m.
pub fn check_radius(radius_m: Option<f64>) -> Result<(), VehicleRefusal> {
    radius_m.map_or(Ok(()), |value| within("radius", "m", value, (1.0, RADIUS_MAX_M)))
}

/// Angle between two directions, rad.
pub fn turn_rad(along: &Horizontal, onwards: &Horizontal) -> f64 {
    libm::acos(along.dot(onwards).clamp(-1.0, 1.0))
}

impl Rules {
    /// The rules of a set of parameters.
    pub fn new(limits: ReferenceLimits, navigation: NavigationParameters, gains: &Gains) -> Self {
        Self {
            limits,
            navigation,
            altitude: gains.altitude_response(),
            stall_m_s: 0.0,
            design_m_s: 0.0,
            ground_m: 0.0,
        }
    }

    /// The same for an aircraft with this model.
    pub fn of_model(self, model: &AircraftModel) -> Self {
        let TrimModel { airspeed_m_s, altitude_m, .. } = model.trim;
        Self {
            stall_m_s: stall_airspeed_m_s(model),
            design_m_s: atmosphere::calibrated_airspeed(airspeed_m_s, altitude_m),
            ..self
        }
    }

    /// The same over ground at this altitude, m.
    pub fn over(mut self, ground_m: f64) -> Self {
        self.limits.altitude_min_m += ground_m - self.ground_m;
        Self { ground_m, ..self }
    }

    /// The same for items that take off or land: down to the ground.
    pub fn near_ground(&self) -> Self {
        let limits = ReferenceLimits { altitude_min_m: self.ground_m, ..self.limits };
        Self { limits, ..*self }
    }

    /// True airspeed of an approach, m/s: by the parameter, or 1.3 times that of the stall.
    pub fn approach_m_s(&self, altitude_m: f64) -> f64 {
        let own_m_s = self.navigation.landing_airspeed_m_s;
        let of_stall_m_s = match self.stall_m_s > 0.0 {
            true => APPROACH_OVER_STALL * self.stall_m_s,
            false => self.limits.airspeed_min_m_s,
        };
        let calibrated_m_s = if own_m_s > 0.0 { own_m_s } else { of_stall_m_s };
        Airspeed::Calibrated(calibrated_m_s).true_m_s(altitude_m)
    }

    /// True airspeed of the rotation, m/s.
    pub fn rotation_m_s(&self, altitude_m: f64) -> f64 {
        Airspeed::Calibrated(ROTATION_OVER_STALL * self.stall_m_s).true_m_s(altitude_m)
    }

    /// True airspeed of a flight that nobody has given another, m/s: that of the design point.
    pub fn cruise_m_s(&self, altitude_m: f64) -> f64 {
        self.nearest_airspeed_m_s(Airspeed::Calibrated(self.design_m_s), altitude_m)
    }

    /// Pitch attitude of the rotation, rad.
    pub fn takeoff_pitch_rad(&self) -> f64 {
        self.navigation.takeoff_pitch_deg.to_radians()
    }

    /// Altitude to which a takeoff climbs, m.
    pub fn takeoff_altitude_m(&self) -> f64 {
        self.nearest_altitude_m(self.ground_m + self.navigation.takeoff_height_m)
    }

    /// An altitude counts as reached within this, m: the climb of the aircraft in a second.
    pub fn altitude_reached_m(&self) -> f64 {
        self.navigation.climb_max_m_s
    }

    /// Tuning of the guidance: it commands no more bank than a reference may have.
    pub fn guidance(&self) -> GuidanceGains {
        let NavigationParameters { l1_period_s, l1_damping, bank_max_deg, .. } = self.navigation;
        GuidanceGains {
            period_s: l1_period_s,
            damping: l1_damping,
            bank_max_rad: bank_max_deg.min(self.limits.roll_max_deg).to_radians(),
        }
    }

    /// Radius of the smallest circle that is flown at a ground speed, m.
    pub fn smallest_circle_m(&self, ground_speed_m_s: f64) -> f64 {
        CIRCLE_RESERVE * self.guidance().turn_radius_m(ground_speed_m_s)
    }

    /// Fastest change of a roll reference that the guidance commands, rad/s.
    pub fn roll_slew_rad_s(&self) -> f64 {
        ROLL_SLEW_RAD_S * self.slews()
    }

    /// Time to roll into a turn of a right angle or more, s.
    pub fn roll_in_s(&self) -> f64 {
        ROLL_IN_S / self.slews()
    }

    /// How far before a point a turn has to begin, m: R tan(Δχ/2) and the way of rolling in.
    pub fn turn_lead_m(&self, turn_rad: f64, ground_speed_m_s: f64) -> f64 {
        let turn_rad = turn_rad.min(ANTICIPATED_MAX_RAD);
        let radius_m = planned_radius_m(ground_speed_m_s, &self.guidance());
        let roll_in_m = ground_speed_m_s * self.roll_in_s() * turn_rad / ANTICIPATED_MAX_RAD;
        radius_m * libm::tan(0.5 * turn_rad) + roll_in_m
    }

    /// Fastest change of the roll reference in units of [`ROLL_SLEW_RAD_S`].
    fn slews(&self) -> f64 {
        self.navigation.roll_slew_deg_s / ROLL_SLEW_DEG_S
    }

    /// Largest roll reference, rad.
    pub fn roll_max_rad(&self) -> f64 {
        self.limits.roll_max_deg.to_radians()
    }

    /// Airspeed of a throttle stick at an altitude, m/s: its range, 0 to 1, is that of the limits.
    pub fn airspeed_of_throttle(&self, throttle: f64, altitude_m: f64) -> f64 {
        let [low, high] = self.limits.airspeeds_m_s(altitude_m);
        low + throttle * (high - low)
    }

    /// Checks an optional place and altitude.
    pub fn check_some(
        &self,
        place: Option<Place>,
        altitude_m: Option<f64>,
    ) -> Result<(), VehicleRefusal> {
        place.map_or(Ok(()), check_place)?;
        altitude_m.map_or(Ok(()), |value| self.limits.check(Reference::Altitude(value), value))
    }

    /// The nearest allowed altitude, m.
    pub fn nearest_altitude_m(&self, altitude_m: f64) -> f64 {
        altitude_m.min(self.limits.altitude_max_m).max(self.limits.altitude_min_m)
    }

    /// Altitude of Return, m.
    pub fn return_altitude_m(&self) -> f64 {
        self.nearest_altitude_m(self.navigation.return_altitude_m)
    }

    /// The nearest true airspeed that is allowed at an altitude, m/s.
    pub fn nearest_airspeed_m_s(&self, airspeed: Airspeed, altitude_m: f64) -> f64 {
        let [low, high] = self.limits.airspeeds_m_s(altitude_m);
        airspeed.true_m_s(altitude_m).min(high).max(low)
    }
}
