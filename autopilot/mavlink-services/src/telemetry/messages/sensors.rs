//! The navigation state, as a ground station expects it of single instruments.
//!
//! The aircraft carries an ideal navigation unit and an air-data computer, not the instruments behind them.
//! Pressures and temperature are those of the standard atmosphere at the altitude and airspeed that those
//! two tell; a magnetometer there is none.

use ::mavlink::dialects::common::{
    HIGHRES_IMU_DATA, HighresImuUpdatedFlags as Updated, SCALED_PRESSURE_DATA, WIND_COV_DATA,
};
use flight_control::NavigationState;
use flight_control::design_model::atmosphere;

use crate::codec::Encoded;
use crate::convert;
use flight_management::event::Snapshot;

/// Ratio of the specific heats of air.
const GAMMA: f64 = 1.4;

/// What a pressure head would measure.
struct AirData {
    /// Static pressure, Pa.
    static_pa: f64,
    /// Impact pressure, Pa.
    impact_pa: f64,
    /// Static temperature, K.
    temperature_k: f64,
}

impl AirData {
    /// Isentropic flow up to Mach 1: `q_c = p ((1 + (γ - 1)/2 M²)^(γ/(γ - 1)) - 1)`. Beyond it a shock in front
    /// of the head takes some of it away, which is not counted here.
    fn of(motion: &NavigationState) -> Self {
        let temperature_k = atmosphere::temperature(motion.altitude_m);
        let static_pa = atmosphere::pressure(motion.altitude_m);
        let mach =
            motion.airspeed_m_s / libm::sqrt(GAMMA * atmosphere::GAS_CONSTANT * temperature_k);
        let ratio = 1.0 + 0.5 * (GAMMA - 1.0) * mach * mach;
        let impact_pa = static_pa * (libm::pow(ratio, GAMMA / (GAMMA - 1.0)) - 1.0);
        Self { static_pa, impact_pa, temperature_k }
    }
}

/// HIGHRES_IMU. The magnetic field is NaN and not among the updated fields.
pub fn highres_imu(state: &Snapshot) -> Encoded {
    let motion = state.motion();
    let air = AirData::of(motion);
    let (force, rates) = (motion.specific_force.0, motion.rates);
    let magnetic = Updated::HIGHRES_IMU_UPDATED_XMAG
        | Updated::HIGHRES_IMU_UPDATED_YMAG
        | Updated::HIGHRES_IMU_UPDATED_ZMAG;
    Encoded::new(&HIGHRES_IMU_DATA {
        time_usec: state.time.as_micros(),
        xacc: convert::float(force.x),
        yacc: convert::float(force.y),
        zacc: convert::float(force.z),
        xgyro: convert::float(rates.x),
        ygyro: convert::float(rates.y),
        zgyro: convert::float(rates.z),
        xmag: f32::NAN,
        ymag: f32::NAN,
        zmag: f32::NAN,
        abs_pressure: convert::hectopascals(air.static_pa),
        diff_pressure: convert::hectopascals(air.impact_pa),
        pressure_alt: convert::float(motion.altitude_m),
        temperature: convert::celsius(air.temperature_k),
        fields_updated: Updated::all().difference(magnetic),
        id: 0,
    })
}

pub fn scaled_pressure(state: &Snapshot) -> Encoded {
    let air = AirData::of(state.motion());
    Encoded::new(&SCALED_PRESSURE_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        press_abs: convert::hectopascals(air.static_pa),
        press_diff: convert::hectopascals(air.impact_pa),
        temperature: convert::centidegrees_celsius(air.temperature_k),
        // Zero: not available.
        temperature_press_diff: 0,
    })
}

/// WIND_COV: the wind at one tick. Its variability is not estimated: NaN.
pub fn wind_cov(state: &Snapshot) -> Encoded {
    let wind = state.motion().wind().0;
    Encoded::new(&WIND_COV_DATA {
        time_usec: state.time.as_micros(),
        wind_x: convert::float(wind.x),
        wind_y: convert::float(wind.y),
        wind_z: convert::float(wind.z),
        var_horiz: f32::NAN,
        var_vert: f32::NAN,
        wind_alt: convert::float(state.motion().altitude_m),
        // Zero: unknown.
        horiz_accuracy: 0.0,
        vert_accuracy: 0.0,
    })
}
