//! The truth of a tick as a row of numbers, for the recorder of the flight.

use icd::record::TruthRow;

use super::Truth;

impl Truth {
    /// The values in the order of [`icd::record::truth_fields`]. `on_ground` and `broken` are those of the plant at that
    /// time ([`crate::Plant::on_ground`], [`crate::Plant::is_broken`]).
    #[must_use]
    pub fn to_row(&self, on_ground: bool, broken: bool) -> TruthRow {
        let euler = self.euler();
        let q = self.attitude.q_ned_from_body;
        let motion = [self.body_rates.0.x, self.body_rates.0.y, self.body_rates.0.z];
        let angles = [euler.phi, euler.theta, euler.psi];
        let air = [self.airspeed_m_s, self.alpha_rad, self.beta_rad];
        let place = [self.altitude_m, self.latitude_rad, self.longitude_rad];
        let vectors =
            [self.velocity.0, self.position.0, self.angular_acceleration.0, self.specific_force.0];
        let wind = self.wind.0;
        let count = self.effectors;
        motion
            .into_iter()
            .chain(angles)
            .chain(air)
            .chain(place)
            .chain(vectors.into_iter().flat_map(|v| [v.x, v.y, v.z]))
            .chain([self.normal_load_factor_g, wind.x, wind.y, wind.z, self.density_kg_m3])
            .chain(self.deflections.first(count).iter().copied())
            .chain(self.positions.first(count).iter().copied())
            .chain(self.fault_codes.first(count).iter().map(|code| f64::from(*code)))
            .chain([q.w, q.i, q.j, q.k])
            .chain([on_ground, broken].map(|flag| f64::from(u8::from(flag))))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Airframe, Plant, Scenario, scenario};
    use icd::fault::{FaultKind, FaultRequest, Timing};
    use icd::record::truth_fields;
    use icd::tvc_jet;
    use icd::{Actuators, ControlPeriod};

    fn flown() -> Truth {
        let nominal = Scenario::from_toml("nominal.toml", scenario::NOMINAL, &tvc_jet::effectors())
            .unwrap()
            .plant;
        let setup = nominal.setup(Airframe::paper(), 0, ControlPeriod::DEFAULT, 1_000);
        let mut plant = Plant::new(&setup).unwrap();
        let (effector, kind) = (tvc_jet::NOZZLE_PITCH, FaultKind::PartialLoss { remaining: 0.5 });
        plant.request(&FaultRequest::Inject { target: effector.into(), kind, timing: Timing::NOW });
        let mut commands = plant.trim().positions();
        commands[tvc_jet::LEFT_AILERON] = 0.05;
        commands[tvc_jet::RUDDER] = -0.05;
        commands[tvc_jet::NOZZLE_PITCH] = 0.1;
        for _ in 0..100 {
            plant.advance(&Actuators { commands });
        }
        plant.truth()
    }

    #[test]
    fn every_column_has_the_value_that_its_name_says() {
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
