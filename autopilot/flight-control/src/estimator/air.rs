//! Air data: pressures to altitude and airspeed, the flow at a place of the aircraft, and what the design model says of it.

use icd::units::STANDARD_GRAVITY_M_S2;
use nalgebra::Vector3;

use crate::aircraft_model::AircraftModel;
use crate::design_model::atmosphere;

/// Radius that turns geometric into geopotential altitude, m (US-1976).
const GEOPOTENTIAL_RADIUS_M: f64 = 6_356_766.0;
/// Slower than this a flow has no direction that a vane could show, m/s.
const FLOW_MIN_M_S: f64 = 5.0;

/// Geopotential altitude of a geometric one, m.
pub fn geopotential(altitude_m: f64) -> f64 {
    GEOPOTENTIAL_RADIUS_M * altitude_m / (GEOPOTENTIAL_RADIUS_M + altitude_m)
}

/// An airspeed and how it changes with the impact pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Airspeed {
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// m/s per Pa.
    pub per_pascal: f64,
}

/// True airspeed of an impact pressure (Pa) at a pressure altitude (m) with the temperature of US-1976.
///
/// M² = 5 ((q_c/p + 1)^(2/7) - 1); `None` for less than 5 m/s.
pub fn airspeed(impact_pa: f64, pressure_altitude_m: f64) -> Option<Airspeed> {
    let static_pa = atmosphere::pressure(pressure_altitude_m);
    let kelvin = atmosphere::temperature(pressure_altitude_m);
    let sound_m_s = libm::sqrt(atmosphere::HEAT_RATIO * atmosphere::GAS_CONSTANT * kelvin);
    // Noise makes the impact pressure of an aircraft at rest negative at times.
    let ratio = 1.0 + impact_pa.max(0.0) / static_pa;
    // Half the time of `pow`, as in `atmosphere::density`.
    let power = libm::exp(libm::log(ratio) / 3.5);
    let mach = libm::sqrt(5.0 * (power - 1.0));
    let airspeed_m_s = sound_m_s * mach;
    if airspeed_m_s < FLOW_MIN_M_S {
        return None;
    }
    // d(M²)/dq_c = 10/7 (q_c/p + 1)^(-5/7) / p.
    let per_pascal = sound_m_s / (2.0 * mach) * (10.0 / 7.0) * power / ratio / static_pa;
    Some(Airspeed { airspeed_m_s, per_pascal })
}

/// Impact pressure (Pa) of a true airspeed at a pressure altitude (m): the inverse of [`airspeed`].
pub fn impact(airspeed_m_s: f64, pressure_altitude_m: f64) -> f64 {
    let kelvin = atmosphere::temperature(pressure_altitude_m);
    let sound_2 = atmosphere::HEAT_RATIO * atmosphere::GAS_CONSTANT * kelvin;
    let part = 1.0 + 0.2 * airspeed_m_s * airspeed_m_s / sound_2;
    atmosphere::pressure(pressure_altitude_m) * (libm::pow(part, 3.5) - 1.0)
}

/// A quantity of the flow and its gradient with the velocity through the air, body axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// The quantity.
    pub value: f64,
    /// Per m/s.
    pub gradient: Vector3<f64>,
}

/// How a quantity follows from the velocity.
pub(super) type FlowOf = fn(&Vector3<f64>) -> Option<Flow>;

/// V of a velocity through the air, m/s.
pub fn speed(v: &Vector3<f64>) -> Option<Flow> {
    let value = v.norm();
    (value > FLOW_MIN_M_S).then(|| Flow { value, gradient: v / value })
}

/// α = atan2(w, u).
pub fn angle_of_attack(v: &Vector3<f64>) -> Option<Flow> {
    let square = v.x * v.x + v.z * v.z;
    (square > FLOW_MIN_M_S * FLOW_MIN_M_S).then(|| Flow {
        value: icd::frames::atan2(v.z, v.x),
        gradient: Vector3::new(-v.z, 0.0, v.x) / square,
    })
}

/// β = asin(v / V).
pub fn sideslip(v: &Vector3<f64>) -> Option<Flow> {
    let in_plane_2 = v.x * v.x + v.z * v.z;
    if in_plane_2 < FLOW_MIN_M_S * FLOW_MIN_M_S {
        return None;
    }
    let in_plane = libm::sqrt(in_plane_2);
    let square = in_plane_2 + v.y * v.y;
    let part = v.y / (in_plane * square);
    let gradient = Vector3::new(-v.x * part, in_plane / square, -v.z * part);
    // The same angle as asin(v / V), which has no slope at its ends.
    Some(Flow { value: icd::frames::atan2(v.y, in_plane), gradient })
}

/// Less lift than this over the mass says nothing of the speed, m/s².
const LIFT_MIN_M_S2: f64 = 3.0;

/// Lift of the wing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wing {
    /// Over the mass, m/s².
    pub value: f64,
    /// Per m/s of the velocity through the air, body axes.
    pub gradient: Vector3<f64>,
    /// Its change with the angle of attack as a part of it, per rad.
    pub per_angle: f64,
}

/// The part of the aircraft model that tells the flow from the specific force.
#[derive(Debug, Clone, Copy)]
pub struct AirModel {
    /// Reference area over mass, m²/kg.
    area_per_mass: f64,
    /// With it the lift of the trimmed aircraft is its weight.
    c_lift_0: f64,
    c_lift_alpha: f64,
    c_lift_q: f64,
    chord_m: f64,
    /// Zero if it is not known.
    c_side_beta: f64,
    stall_onset_rad: f64,
    /// Vanes from the centre of gravity, m, body axes.
    pub vanes_m: Vector3<f64>,
    /// Pitot tube from the centre of gravity, m, body axes.
    pub pitot_m: Vector3<f64>,
}

impl AirModel {
    /// Of an aircraft model.
    pub fn new(aircraft: &AircraftModel) -> Self {
        let data = aircraft.air_data.unwrap_or_default();
        let trim = &aircraft.trim;
        let area_per_mass = aircraft.geometry.wing_area_m2 / aircraft.mass.mass_kg;
        // All of the weight, with what elevators and jet carry of it: without that, airspeed from lift is 4 % off on an F-16.
        let per_coefficient = dynamic_pressure(trim.airspeed_m_s, trim.altitude_m) * area_per_mass;
        let coefficient = STANDARD_GRAVITY_M_S2 * libm::cos(trim.theta_rad) / per_coefficient;
        Self {
            area_per_mass,
            c_lift_0: coefficient - aircraft.lift.c_lift_alpha * trim.theta_rad,
            c_lift_alpha: aircraft.lift.c_lift_alpha,
            c_lift_q: aircraft.lift.c_lift_q,
            chord_m: aircraft.geometry.chord_m,
            c_side_beta: data.c_side_beta,
            stall_onset_rad: aircraft.airframe.stall_onset_rad,
            vanes_m: data.vanes_m.into(),
            pitot_m: data.pitot_m.into(),
        }
    }

    /// Lift over mass (m/s²) at a velocity through the air (m/s, body axes), a pitch rate (rad/s) and an altitude (m), with its gradient:
    /// L = q S (C_L0 + C_Lα α + C_Lq q c / 2V). `None` where it is small, or the flow is not attached.
    pub fn lift(&self, v: &Vector3<f64>, pitch_rate_rad_s: f64, altitude_m: f64) -> Option<Wing> {
        let angle = angle_of_attack(v).filter(|flow| flow.value.abs() < self.stall_onset_rad)?;
        let speed_2 = v.norm_squared();
        let per_speed_2 = dynamic_pressure(1.0, altitude_m) * self.area_per_mass;
        let pitching =
            self.c_lift_q * pitch_rate_rad_s * self.chord_m / (2.0 * libm::sqrt(speed_2));
        let coefficient = self.c_lift_0 + self.c_lift_alpha * angle.value + pitching;
        let value = per_speed_2 * speed_2 * coefficient;
        // The pitching term changes with the speed too, but is a few per cent of the lift.
        let gradient = (v * (2.0 * coefficient) + angle.gradient * (self.c_lift_alpha * speed_2))
            * per_speed_2;
        let per_angle = self.c_lift_alpha / coefficient;
        (value > LIFT_MIN_M_S2).then_some(Wing { value, gradient, per_angle })
    }

    /// Sideslip (rad) that gives a specific force (m/s², body axes) at an airspeed (m/s) and an altitude (m): β = f_y m / (q S C_Yβ).
    /// `None` where the model does not tell.
    pub fn sideslip(
        &self,
        force: &Vector3<f64>,
        airspeed_m_s: f64,
        altitude_m: f64,
    ) -> Option<f64> {
        if airspeed_m_s < FLOW_MIN_M_S {
            return None;
        }
        let pressure = dynamic_pressure(airspeed_m_s, altitude_m);
        // Zero says that the model does not know it. Flight without sideslip is then the best guess.
        let beta = match self.c_side_beta < 0.0 {
            true => force.y / (pressure * self.area_per_mass * self.c_side_beta),
            false => 0.0,
        };
        (beta.abs() < self.stall_onset_rad).then_some(beta)
    }
}

/// ½ ρ V², Pa.
fn dynamic_pressure(airspeed_m_s: f64, altitude_m: f64) -> f64 {
    0.5 * atmosphere::density(altitude_m) * airspeed_m_s * airspeed_m_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_airspeed_is_that_of_isentropic_flow() {
        // M = 0.8 at 5000 m: p = 54,020 Pa (US-1976), q_c = p ((1 + 0.2 M²)^3.5 - 1), a = 320.5 m/s.
        let impact = 54_020.0 * (libm::pow(1.0 + 0.2 * 0.64, 3.5) - 1.0);
        let found = airspeed(impact, 5_000.0).unwrap();
        assert!((found.airspeed_m_s - 0.8 * 320.53).abs() < 0.1, "{}", found.airspeed_m_s);
        let beyond = airspeed(impact + 10.0, 5_000.0).unwrap();
        let slope = (beyond.airspeed_m_s - found.airspeed_m_s) / 10.0;
        assert!((slope / found.per_pascal - 1.0).abs() < 1.0e-3, "{slope}");
        assert!((super::impact(found.airspeed_m_s, 5_000.0) - impact).abs() < 1.0e-6 * impact);
        assert_eq!(airspeed(-50.0, 5_000.0), None);
    }

    #[test]
    fn gradients_are_the_slopes_of_their_quantities() {
        let v = Vector3::new(250.0, -12.0, 20.0);
        for of in [speed, angle_of_attack, sideslip] {
            let flow = of(&v).unwrap();
            for axis in 0..3 {
                let mut moved = v;
                moved[axis] += 1.0e-3;
                let slope = (of(&moved).unwrap().value - flow.value) / 1.0e-3;
                assert!((slope - flow.gradient[axis]).abs() < 1.0e-5, "axis {axis}");
            }
            assert_eq!(of(&Vector3::new(0.1, 0.0, 0.1)), None);
        }
    }

    #[test]
    fn level_flight_of_the_design_point_is_carried_by_the_wing() {
        let aircraft = crate::testing::aircraft_model();
        let trim = aircraft.trim;
        let model = AirModel::new(&aircraft);
        let (sine, cosine) = libm::sincos(trim.theta_rad);
        let v = Vector3::new(trim.airspeed_m_s * cosine, 0.0, trim.airspeed_m_s * sine);
        let wing = model.lift(&v, 0.0, trim.altitude_m).unwrap();
        assert!((wing.value / (9.806_65 * cosine) - 1.0).abs() < 1.0e-6, "{wing:?}");
        let faster = model.lift(&(v * 2.0), 0.0, trim.altitude_m).unwrap();
        assert!((faster.value / wing.value - 4.0).abs() < 1.0e-9, "{faster:?}");
        for axis in 0..3 {
            let mut moved = v;
            moved[axis] += 1.0e-3;
            let slope =
                (model.lift(&moved, 0.0, trim.altitude_m).unwrap().value - wing.value) / 1.0e-3;
            assert!((slope - wing.gradient[axis]).abs() < 1.0e-4, "axis {axis}");
        }
        assert_eq!(
            model.sideslip(&Vector3::zeros(), trim.airspeed_m_s, trim.altitude_m),
            Some(0.0)
        );
    }
}
