//! The columns of a trajectory of the paper's jet; [`crate::trajectory`] has those of any aircraft.

use flight_control::DesignModel;
use icd::tvc_jet;
use plant_sim::Attained;

use crate::closed_loop::{Record, fault_acceleration};

// One list makes the struct, the header and the values of a tick, so they cannot differ.
macro_rules! columns {
    ($truth:ident, $log:ident, $attitude:ident, $fault:ident:
        $($(#[$doc:meta])* $name:ident => $value:expr,)+) => {
        icd::signals! {
            /// The signals of one control tick, in the order of the columns.
            Row {
                $($(#[$doc])* $name,)+
            }
        }

        impl Row {
            /// Of a tick; `model` is the controller's, against which the fault acceleration F is measured.
            pub fn of(model: &DesignModel, record: &Record) -> Self {
                let ($truth, $log) = (&record.truth, &record.log);
                let ($attitude, $fault) = ($truth.euler(), fault_acceleration(model, record));
                Self { $($name: $value),+ }
            }
        }
    };
}

columns! { truth, log, attitude, fault:
    /// Simulation time, s.
    t_s => truth.time.as_seconds(),
    /// True roll rate, rad/s.
    p_rad_s => truth.body_rates.0.x,
    /// True pitch rate, rad/s.
    q_rad_s => truth.body_rates.0.y,
    /// True yaw rate, rad/s.
    r_rad_s => truth.body_rates.0.z,
    /// True roll angle, rad, in (-pi, pi].
    phi_rad => attitude.phi,
    /// True pitch angle, rad.
    theta_rad => attitude.theta,
    /// True yaw angle, rad.
    psi_rad => attitude.psi,
    /// True airspeed, m/s.
    airspeed_m_s => truth.airspeed_m_s,
    /// True angle of attack, rad.
    alpha_rad => truth.alpha_rad,
    /// True sideslip, rad.
    beta_rad => truth.beta_rad,
    /// True altitude, m.
    altitude_m => truth.altitude_m,
    /// Left aileron, rad, trailing edge down positive.
    left_aileron_rad => truth.deflections[tvc_jet::LEFT_AILERON],
    /// Right aileron, rad, trailing edge down positive.
    right_aileron_rad => truth.deflections[tvc_jet::RIGHT_AILERON],
    /// Left elevator, rad, trailing edge down positive.
    left_elevator_rad => truth.deflections[tvc_jet::LEFT_ELEVATOR],
    /// Right elevator, rad, trailing edge down positive.
    right_elevator_rad => truth.deflections[tvc_jet::RIGHT_ELEVATOR],
    /// Rudder, rad, trailing edge left positive.
    rudder_rad => truth.deflections[tvc_jet::RUDDER],
    /// Nozzle pitch, rad, positive pitches the nose up.
    nozzle_pitch_rad => truth.deflections[tvc_jet::NOZZLE_PITCH],
    /// Nozzle yaw, rad, positive yaws the nose right.
    nozzle_yaw_rad => truth.deflections[tvc_jet::NOZZLE_YAW],
    /// Thrust, N.
    thrust_n => truth.deflections[tvc_jet::ENGINE],
    /// Estimated fault acceleration in roll, rad/s².
    z2_p_rad_s2 => log.z2.x,
    /// Estimated fault acceleration in pitch, rad/s².
    z2_q_rad_s2 => log.z2.y,
    /// Estimated fault acceleration in yaw, rad/s².
    z2_r_rad_s2 => log.z2.z,
    /// True fault acceleration F in roll, rad/s².
    fault_p_rad_s2 => fault.x,
    /// True fault acceleration F in pitch, rad/s².
    fault_q_rad_s2 => fault.y,
    /// True fault acceleration F in yaw, rad/s².
    fault_r_rad_s2 => fault.z,
    /// 1 while the detector is awake, also where the compensator is off; else 0.
    compensator_active => f64::from(u8::from(log.compensator_active)),
    /// Normal load factor, g.
    nz_g => truth.normal_load_factor_g,
    /// Commanded left aileron, rad.
    cmd_left_aileron_rad => log.commands[tvc_jet::LEFT_AILERON],
    /// Commanded right aileron, rad.
    cmd_right_aileron_rad => log.commands[tvc_jet::RIGHT_AILERON],
    /// Commanded left elevator, rad.
    cmd_left_elevator_rad => log.commands[tvc_jet::LEFT_ELEVATOR],
    /// Commanded right elevator, rad.
    cmd_right_elevator_rad => log.commands[tvc_jet::RIGHT_ELEVATOR],
    /// Commanded rudder, rad.
    cmd_rudder_rad => log.commands[tvc_jet::RUDDER],
    /// Commanded nozzle pitch, rad.
    cmd_nozzle_pitch_rad => log.commands[tvc_jet::NOZZLE_PITCH],
    /// Commanded nozzle yaw, rad.
    cmd_nozzle_yaw_rad => log.commands[tvc_jet::NOZZLE_YAW],
    /// Commanded thrust, N.
    cmd_thrust_n => log.commands[tvc_jet::ENGINE],
    /// Aileron that the main controller commands, before limits, rad.
    main_aileron_rad => log.main.aileron_rad,
    /// Aileron that the compensator commands, before limits, rad.
    ucf_aileron_rad => log.compensation.aileron_rad,
    /// Nozzle pitch that the compensator commands, before limits, rad.
    ucf_nozzle_pitch_rad => log.compensation.nozzle_pitch_rad,
    /// Nozzle yaw that the compensator commands, before limits, rad.
    ucf_nozzle_yaw_rad => log.compensation.nozzle_yaw_rad,
}

impl From<&Row> for Attained {
    fn from(row: &Row) -> Self {
        Self {
            roll_rad: row.phi_rad,
            pitch_rad: row.theta_rad,
            alpha_rad: row.alpha_rad,
            beta_rad: row.beta_rad,
            altitude_m: row.altitude_m,
        }
    }
}
