//! The reference model and level flight at the design point, for the tests of this crate.

use std::sync::LazyLock;

use icd::sensors::SensorKind;
use icd::{Attitude, EulerAngles, Sensors, SimTime};

use crate::aircraft_model::AircraftModel;
use crate::main_controller::Demand;
use crate::navigation::{NavigationState, Navigator};

/// The shipped model; read once, because properties ask for it in every case.
pub fn aircraft_model() -> AircraftModel {
    static MODEL: LazyLock<AircraftModel> =
        LazyLock::new(|| toml::from_str(aircraft::DEFAULT_MODEL).unwrap());
    *MODEL
}

/// The model of an aircraft without nozzle; its file has parameters too.
pub fn aerosonde() -> AircraftModel {
    let mut file: toml::Table = aircraft::AEROSONDE_MODEL.parse().unwrap();
    file.remove("parameters");
    file.try_into().unwrap()
}

/// Level flight at 264 m/s and 5000 m.
pub fn level_sensors() -> Sensors {
    let trim = aircraft_model().trim;
    let euler = EulerAngles { phi: 0.0, theta: trim.theta_rad, psi: 0.0 };
    let [w, x, y, z] = Attitude::from_euler(euler).wxyz();
    let inertial = [[0.0; 3], [0.0, 0.0, -9.8]].concat();
    let fix = [264.0, 0.0, 0.0, 0.0, 0.0, -5_000.0, 0.609, -2.058, 5_000.0, 2_026.0];
    // Of an aircraft without fuel that is not over a ground.
    let ground = [0.0; 3];
    // Static pressure and altitude, impact pressure of US-1976 and airspeed, vanes, thrust, magnetic field.
    let air = [54_019.9, 5_000.0, 28_620.0, 264.0, trim.theta_rad, 0.0];
    let rest = [trim.thrust_n, 23_000.0, 4_500.0, 41_000.0];
    let values = [&inertial[..], &[w, x, y, z], &fix, &air, &rest, &ground].concat();
    let mut sensors = Sensors::at(SimTime::ZERO, &values.try_into().unwrap());
    sensors.keep(&SensorKind::ALL.map(|kind| kind <= SensorKind::Magnetometer));
    sensors
}

/// The state of [`level_sensors`].
pub fn level_state() -> NavigationState {
    Navigator::default().step(SimTime::ZERO, &level_sensors())
}

/// Keep doing that.
pub fn level_demand() -> Demand {
    Demand { altitude_m: 5_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 }
}
