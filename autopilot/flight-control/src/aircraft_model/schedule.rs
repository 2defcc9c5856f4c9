//! The model over flight condition: what of it changes with the dynamic pressure.
//!
//! Coefficients of an aircraft depend on its angle of attack, and the angle of attack of level flight on the dynamic
//! pressure. A model file can therefore have points, each linearised at one flight condition; between them the coefficients
//! are interpolated linearly over the dynamic pressure, beyond them they stay. Without points the model is the same
//! everywhere.

use arrayvec::ArrayVec;
use icd::{Effector, EffectorKind, PerEffector};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{AircraftModel, AircraftModelError, AirframeModel, LiftModel, check};
use crate::design_model::atmosphere;

/// Most points of a schedule.
pub const POINTS_MAX: usize = 8;

/// The model at one flight condition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SchedulePoint {
    /// Airspeed of the condition, m/s.
    pub airspeed_m_s: f64,
    /// Altitude of the condition, m.
    pub altitude_m: f64,
    /// Thrust of level flight, N.
    pub trim_thrust_n: f64,
    /// Smallest and largest thrust, N.
    pub thrust_n: [f64; 2],
    /// Lift coefficient per deflection, 1/rad, in the order of the effectors; zeros at the end may be left out.
    #[serde(with = "column")]
    pub c_lift: PerEffector<f64>,
    /// Roll moment coefficient per deflection, likewise.
    #[serde(with = "column")]
    pub c_roll: PerEffector<f64>,
    /// Pitch moment coefficient per deflection, likewise.
    #[serde(with = "column")]
    pub c_pitch: PerEffector<f64>,
    /// Yaw moment coefficient per deflection, likewise.
    #[serde(with = "column")]
    pub c_yaw: PerEffector<f64>,
    /// Moment coefficients with all surfaces at zero.
    pub airframe: AirframeModel,
    /// Lift coefficients.
    pub lift: LiftModel,
}

/// The points of a model file, in the order of increasing dynamic pressure.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Schedule {
    points: [Option<SchedulePoint>; POINTS_MAX],
}

impl Schedule {
    /// Of these points, at most [`POINTS_MAX`].
    pub fn new(points: impl IntoIterator<Item = SchedulePoint>) -> Self {
        let mut schedule = Self::default();
        for (place, point) in schedule.points.iter_mut().zip(points) {
            *place = Some(point);
        }
        schedule
    }

    /// The points.
    pub fn points(&self) -> impl Iterator<Item = &SchedulePoint> {
        self.points.iter().flatten()
    }

    /// Whether the model is the same everywhere.
    pub fn is_empty(&self) -> bool {
        self.points[0].is_none()
    }

    /// The two points around a dynamic pressure, Pa, and the fraction of the way from the first to the second, 0 to 1; `None`
    /// without points.
    fn around(&self, pressure_pa: f64) -> Option<(&SchedulePoint, &SchedulePoint, f64)> {
        let mut below = self.points[0].as_ref()?;
        for above in self.points().skip(1) {
            let end = above.pressure_pa();
            if pressure_pa < end {
                let start = below.pressure_pa();
                let part = (pressure_pa - start) / (end - start);
                // Below the first point the fraction is negative; the first point holds there.
                return Some((below, above, part.max(0.0)));
            }
            below = above;
        }
        Some((below, below, 0.0))
    }

    /// Puts the coefficients at a dynamic pressure, Pa, into the model that has this schedule; false without points.
    pub fn put(&self, pressure_pa: f64, aircraft: &mut AircraftModel) -> bool {
        let Some((below, above, part)) = self.around(pressure_pa) else { return false };
        below.mixed(above, part).put(aircraft);
        true
    }

    /// Checks that the points are in order and each can be flown as the model could.
    pub(super) fn validate(&self, aircraft: &AircraftModel) -> Result<(), AircraftModelError> {
        let mut least = 0.0;
        for (number, point) in (1..).zip(self.points()) {
            let numbered = |error| AircraftModelError { point: number, ..error };
            point.validate(aircraft).map_err(numbered)?;
            let pressure_pa = point.pressure_pa();
            // At least 1 Pa between two points, because `around` divides by their distance.
            let key = "airspeed_m_s (dynamic pressure in Pa, which increases from point to point)";
            check(key, pressure_pa, least + 1.0, 1.0e7).map_err(numbered)?;
            least = pressure_pa;
        }
        Ok(())
    }
}

impl SchedulePoint {
    /// Dynamic pressure, Pa.
    pub fn pressure_pa(&self) -> f64 {
        0.5 * atmosphere::density(self.altitude_m) * self.airspeed_m_s * self.airspeed_m_s
    }

    /// Between this point and another one.
    fn mixed(&self, other: &Self, part: f64) -> Self {
        let of = |a: f64, b: f64| a + part * (b - a);
        let column = |a: &PerEffector<f64>, b: &PerEffector<f64>| {
            PerEffector::from_fn(|effector| of(a[effector], b[effector]))
        };
        Self {
            airspeed_m_s: of(self.airspeed_m_s, other.airspeed_m_s),
            altitude_m: of(self.altitude_m, other.altitude_m),
            trim_thrust_n: of(self.trim_thrust_n, other.trim_thrust_n),
            thrust_n: [0, 1].map(|end| of(self.thrust_n[end], other.thrust_n[end])),
            c_lift: column(&self.c_lift, &other.c_lift),
            c_roll: column(&self.c_roll, &other.c_roll),
            c_pitch: column(&self.c_pitch, &other.c_pitch),
            c_yaw: column(&self.c_yaw, &other.c_yaw),
            airframe: self.airframe.mixed(&other.airframe, of),
            lift: self.lift.mixed(&other.lift, of),
        }
    }

    /// Replaces what a model has for all conditions.
    fn put(&self, aircraft: &mut AircraftModel) {
        let effectors = &mut aircraft.effectors;
        (effectors.c_lift, effectors.c_roll) = (self.c_lift, self.c_roll);
        (effectors.c_pitch, effectors.c_yaw) = (self.c_pitch, self.c_yaw);
        if let Some(engine) = effectors.list.only(EffectorKind::Engine) {
            [effectors.servos[engine].min, effectors.servos[engine].max] = self.thrust_n;
        }
        (aircraft.airframe, aircraft.lift) = (self.airframe, self.lift);
        aircraft.trim.thrust_n = self.trim_thrust_n;
    }

    fn validate(&self, aircraft: &AircraftModel) -> Result<(), AircraftModelError> {
        check("airspeed_m_s", self.airspeed_m_s, 1.0, 1.0e3)?;
        check("altitude_m", self.altitude_m, 0.0, 25_000.0)?;
        let [min, max] = self.thrust_n;
        check("thrust_n (smallest)", min, -1.0e7, 1.0e7)?;
        check("thrust_n (largest)", max, min, 1.0e7)?;
        check("trim_thrust_n", self.trim_thrust_n, min, max)?;
        for (key, column) in [
            ("c_lift", &self.c_lift),
            ("c_roll", &self.c_roll),
            ("c_pitch", &self.c_pitch),
            ("c_yaw", &self.c_yaw),
        ] {
            for (effector, value) in column.iter() {
                // What no effector has is nothing.
                let most =
                    if aircraft.effectors.list.entry(effector).is_some() { 10.0 } else { 0.0 };
                check(key, *value, -most, most)?;
            }
        }
        // A point can only be judged together with the inertia and the gains of the whole model. Without the
        // schedule, because its own check calls this one.
        let mut at_point = AircraftModel { schedule: Schedule::default(), ..*aircraft };
        self.put(&mut at_point);
        at_point.validate()
    }
}

impl Serialize for Schedule {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let points: ArrayVec<SchedulePoint, POINTS_MAX> = self.points().copied().collect();
        // `None` leaves the key out: a model without points has the file that it had before there were any.
        (!self.is_empty()).then_some(points).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Schedule {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let points = Option::<ArrayVec<SchedulePoint, POINTS_MAX>>::deserialize(deserializer)?;
        Ok(Self::new(points.into_iter().flatten()))
    }
}

/// Values of effectors without the zeros at the end.
mod column {
    use super::{
        ArrayVec, Deserialize, Deserializer, Effector, PerEffector, Serialize, Serializer,
    };

    pub fn serialize<S: Serializer>(column: &PerEffector<f64>, to: S) -> Result<S::Ok, S::Error> {
        // The column has room for sixteen effectors; a file should not list zeros for those that the aircraft does
        // not have.
        let used = column.as_array().iter().rposition(|value| *value != 0.0);
        column.first(used.map_or(0, |last| last + 1)).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<PerEffector<f64>, D::Error> {
        ArrayVec::<f64, { Effector::MAX }>::deserialize(from).map(PerEffector::from_values)
    }
}

#[cfg(test)]
mod tests;
