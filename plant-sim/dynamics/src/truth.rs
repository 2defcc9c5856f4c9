//! The true state of the flight: judges may read it, the autopilot may not.

use icd::record::{TruthEnd, TruthHead, TruthRow};
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Attitude, Body, EulerAngles, Ned, PerEffector, SimTime};
use serde::{Deserialize, Serialize};

use crate::dynamics::{Dynamics, Evaluation, State, StepInputs};
use crate::limits::Attained;

/// No number of a valid flight comes near this, in any unit of the truth.
const BOUND: f64 = 1.0e15;

/// The state of the flight at one instant, complete and without error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    pub time: SimTime,
    /// Body rates p, q, r relative to inertial space, rad/s.
    pub body_rates: Body,
    /// Attitude relative to the local NED axes.
    pub attitude: Attitude,
    /// True airspeed, m/s, gusts included.
    pub airspeed_m_s: f64,
    /// Angle of attack, rad, gusts included.
    pub alpha_rad: f64,
    /// Sideslip, rad, gusts included.
    pub beta_rad: f64,
    /// Altitude above the ellipsoid or the plane, m.
    pub altitude_m: f64,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Velocity over the ground, m/s.
    pub velocity: Ned,
    /// Position from the start point at altitude zero, m, in the NED axes of that point.
    pub position: Ned,
    /// Rate of change of the components of `body_rates`, rad/s².
    pub angular_acceleration: Body,
    /// Specific force (all forces but gravity, per mass), m/s².
    pub specific_force: Body,
    /// Normal load factor, g: minus the z component of the specific force over 9.80665 m/s².
    pub normal_load_factor_g: f64,
    /// Number of effectors of the aircraft.
    pub effectors: usize,
    /// Effective deflection of each effector with its faults, rad; thrust, N.
    pub deflections: PerEffector<f64>,
    /// True position of each effector, with its faults and before a loss of effect, rad; thrust, N.
    pub positions: PerEffector<f64>,
    /// Code of the active fault of each effector ([`crate::faults::Effects::codes`]); 0 for none.
    pub fault_codes: PerEffector<u8>,
    /// Velocity of the air over the ground, gusts included, m/s, where it blows to.
    pub wind: Ned,
    /// Density of the air, kg/m³.
    pub density_kg_m3: f64,
}

impl Truth {
    /// The attitude as roll, pitch, yaw, rad; computed on demand.
    pub fn euler(&self) -> EulerAngles {
        self.attitude.euler()
    }

    /// Dynamic pressure, Pa.
    pub fn dynamic_pressure_pa(&self) -> f64 {
        0.5 * self.density_kg_m3 * self.airspeed_m_s * self.airspeed_m_s
    }

    /// Whether the quantities computed from the state are within [`BOUND`]: forces, accelerations, position and motion in the air.
    #[inline]
    pub(crate) fn is_bounded(&self) -> bool {
        // One sum and one check: a sum with an infinite or undefined term is infinite or undefined itself.
        let (f, a, v) = (&self.specific_force.0, &self.angular_acceleration.0, &self.velocity.0);
        let place = self.altitude_m + self.latitude_rad + self.longitude_rad;
        let air = self.airspeed_m_s + self.alpha_rad + self.beta_rad;
        (f.sum() + a.sum() + v.sum() + place + air).abs() < BOUND
    }

    /// Name of the first number beyond [`BOUND`], as in the flight log.
    pub(crate) fn first_unbounded(&self) -> Option<&'static str> {
        let beyond = |value: &f64| value.is_nan() || value.abs() >= BOUND;
        let (head, end) = (self.head().values(), self.end(false, false).values());
        let fixed = head.iter().zip(TruthHead::NAMES).chain(end.iter().zip(TruthEnd::NAMES));
        let name = fixed.into_iter().find(|(value, _)| beyond(value)).map(|(_, name)| name);
        let effectors = [&self.deflections, &self.positions];
        let effectors = || effectors.iter().any(|all| all.first(self.effectors).iter().any(beyond));
        // If only the sum above is beyond it, the forces are the largest part.
        Some(name.unwrap_or(if effectors() { "effector" } else { "specific_force" }))
    }

    /// For a state at `time`, with its inputs and the results of its evaluation.
    pub fn of(
        dynamics: &Dynamics,
        time: SimTime,
        state: &State,
        inputs: &StepInputs,
        e: &Evaluation,
    ) -> Self {
        let mut deflections = dynamics.effective(state, &inputs.effects);
        // The thrust that there is, and not the one that is asked for.
        if let Some(engine) = dynamics.jet().engine() {
            deflections[engine] = e.motion.thrust_n;
        }
        let rigid = &state.rigid;
        let earth = dynamics.earth();
        let here = inputs.slopes.geodetic(earth, &rigid.position, &e.place);
        let attitude = earth.attitude(&e.place, &rigid.q_e_from_body);
        let ned = |v: &Body| Ned(e.place.e_from_ned.tr_mul(&(e.motion.e_from_body * v.0)));
        let specific_force = Body(e.motion.wrench.force.0 * dynamics.mass().per_mass);
        Self {
            time,
            body_rates: rigid.rates,
            attitude,
            airspeed_m_s: e.motion.air.airspeed_m_s,
            alpha_rad: e.motion.air.alpha_rad,
            beta_rad: e.motion.air.beta_rad,
            altitude_m: e.place.altitude_m,
            latitude_rad: here.latitude_rad,
            longitude_rad: here.longitude_rad,
            velocity: ned(&rigid.velocity),
            position: earth.local_position(&rigid.position),
            angular_acceleration: e.motion.derivative.rates,
            specific_force,
            normal_load_factor_g: -specific_force.0.z / STANDARD_GRAVITY_M_S2,
            effectors: dynamics.airframe().effectors.len(),
            deflections,
            positions: inputs.effects.positions(&state.positions),
            fault_codes: *inputs.effects.codes(),
            wind: Ned(dynamics.wind(&inputs.wind, e.place.geopotential_altitude_m).0
                + ned(&inputs.gust.velocity).0),
            density_kg_m3: e.density,
        }
    }

    /// The values in the order of [`icd::record::truth_fields`]. `on_ground` and `broken` are those of the plant at that
    /// time ([`crate::Plant::on_ground`], [`crate::Plant::is_broken`]).
    pub fn to_row(&self, on_ground: bool, broken: bool) -> TruthRow {
        let count = self.effectors;
        let codes = self.fault_codes.first(count).iter().map(|code| f64::from(*code));
        let effectors = [&self.deflections, &self.positions].map(|all| all.first(count));
        let head = self.head().values().into_iter().chain(effectors.into_iter().flatten().copied());
        head.chain(codes).chain(self.end(on_ground, broken).values()).collect()
    }

    fn head(&self) -> TruthHead {
        let (w, v, r) = (&self.body_rates.0, &self.velocity.0, &self.position.0);
        let (w_dot, f) = (&self.angular_acceleration.0, &self.specific_force.0);
        let (wind, euler) = (&self.wind.0, self.euler());
        TruthHead {
            p_rad_s: w.x,
            q_rad_s: w.y,
            r_rad_s: w.z,
            roll_rad: euler.phi,
            pitch_rad: euler.theta,
            yaw_rad: euler.psi,
            airspeed_m_s: self.airspeed_m_s,
            alpha_rad: self.alpha_rad,
            beta_rad: self.beta_rad,
            altitude_m: self.altitude_m,
            latitude_rad: self.latitude_rad,
            longitude_rad: self.longitude_rad,
            velocity_north_m_s: v.x,
            velocity_east_m_s: v.y,
            velocity_down_m_s: v.z,
            position_north_m: r.x,
            position_east_m: r.y,
            position_down_m: r.z,
            p_dot_rad_s2: w_dot.x,
            q_dot_rad_s2: w_dot.y,
            r_dot_rad_s2: w_dot.z,
            force_x_m_s2: f.x,
            force_y_m_s2: f.y,
            force_z_m_s2: f.z,
            load_factor_g: self.normal_load_factor_g,
            wind_north_m_s: wind.x,
            wind_east_m_s: wind.y,
            wind_down_m_s: wind.z,
            density_kg_m3: self.density_kg_m3,
        }
    }

    fn end(&self, on_ground: bool, broken: bool) -> TruthEnd {
        let [q_w, q_x, q_y, q_z] = self.attitude.wxyz();
        let [on_ground, broken] = [on_ground, broken].map(|flag| f64::from(u8::from(flag)));
        TruthEnd { q_w, q_x, q_y, q_z, on_ground, broken }
    }
}

impl From<&Truth> for Attained {
    fn from(truth: &Truth) -> Self {
        let attitude = truth.euler();
        Self {
            roll_rad: attitude.phi,
            pitch_rad: attitude.theta,
            alpha_rad: truth.alpha_rad,
            beta_rad: truth.beta_rad,
            altitude_m: truth.altitude_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::nominal;
    use crate::{Airframe, Plant};
    use icd::Actuators;
    use icd::fault::{FaultKind, FaultRequest, Timing};
    use icd::record::truth_fields;
    use icd::tvc_jet;

    fn flown() -> Truth {
        let mut plant = Plant::new(&nominal(&Airframe::paper(), 1_000)).unwrap();
        let (effector, kind) = (tvc_jet::NOZZLE_PITCH, FaultKind::PartialLoss { remaining: 0.5 });
        plant.request(&FaultRequest::Inject { target: effector.into(), kind, timing: Timing::NOW });
        let mut commands = plant.trim().positions();
        commands[tvc_jet::LEFT_AILERON] = 0.05;
        commands[tvc_jet::RUDDER] = -0.05;
        commands[tvc_jet::NOZZLE_PITCH] = 0.1;
        for _ in 0..100 {
            plant.advance(&Actuators::new(commands));
        }
        *plant.truth()
    }

    #[test]
    fn every_column_has_the_value_of_its_name() {
        let truth = flown();
        let row = truth.to_row(true, false);
        let column = |name: &str| {
            let at = truth_fields(&tvc_jet::effectors()).position(|field| field.as_str() == name);
            row[at.unwrap_or_else(|| panic!("no column {name}"))]
        };
        let euler = truth.euler();
        let q = truth.attitude.q_ned_from_body;
        let expected = [
            ("p_rad_s", truth.body_rates.0.x),
            ("r_rad_s", truth.body_rates.0.z),
            ("roll_rad", euler.phi),
            ("yaw_rad", euler.psi),
            ("airspeed_m_s", truth.airspeed_m_s),
            ("beta_rad", truth.beta_rad),
            ("altitude_m", truth.altitude_m),
            ("longitude_rad", truth.longitude_rad),
            ("velocity_north_m_s", truth.velocity.0.x),
            ("position_down_m", truth.position.0.z),
            ("q_dot_rad_s2", truth.angular_acceleration.0.y),
            ("force_z_m_s2", truth.specific_force.0.z),
            ("load_factor_g", truth.normal_load_factor_g),
            ("wind_down_m_s", truth.wind.0.z),
            ("density_kg_m3", truth.density_kg_m3),
            ("q_w", q.w),
            ("q_z", q.k),
            ("on_ground", 1.0),
            ("broken", 0.0),
        ];
        for (name, value) in expected {
            assert_eq!(column(name), value, "{name}");
        }
        assert!(truth.body_rates.0.x != 0.0 && euler.phi != 0.0, "the flight is not trivial");
    }

    #[test]
    fn every_effector_stands_in_its_own_columns() {
        let truth = flown();
        let row = truth.to_row(false, true);
        let list = tvc_jet::effectors();
        for effector in tvc_jet::ALL {
            let (unit, key) = (list.unit(effector), list.key(effector));
            let column = |name: String| {
                let at =
                    truth_fields(&tvc_jet::effectors()).position(|field| field.as_str() == name);
                row[at.unwrap_or_else(|| panic!("no column {name}"))]
            };
            assert_eq!(column(format!("effect_{key}_{unit}")), truth.deflections[effector]);
            assert_eq!(column(format!("position_{key}_{unit}")), truth.positions[effector]);
            let code = f64::from(truth.fault_codes[effector]);
            assert_eq!(column(format!("fault_{key}")), code);
        }
        let nozzle = tvc_jet::NOZZLE_PITCH;
        assert_eq!(truth.fault_codes[nozzle], FaultKind::PartialLoss { remaining: 0.5 }.code());
        assert!(truth.positions[nozzle] > 0.09, "{} rad", truth.positions[nozzle]);
        assert_eq!(truth.deflections[nozzle], 0.5 * truth.positions[nozzle]);
        assert_eq!(row[row.len() - 2..], [0.0, 1.0]);
    }
}
