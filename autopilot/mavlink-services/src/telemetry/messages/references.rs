//! What the laws are asked for.

use ::mavlink::dialects::common::{
    ATTITUDE_TARGET_DATA, AttitudeTargetTypemask, MavFrame, NAV_CONTROLLER_OUTPUT_DATA,
    POSITION_TARGET_GLOBAL_INT_DATA, PositionTargetTypemask as Ignored,
};
use icd::{Attitude, EulerAngles};

use super::actuators::thrust_fraction;
use crate::codec::Encoded;
use crate::convert;
use crate::telemetry::View;
use flight_management::event::Snapshot;

/// ATTITUDE_TARGET: the roll reference that the law tracks. The laws have no pitch or heading reference, so
/// those two angles are the present ones.
pub fn attitude_target(view: &View, state: &Snapshot) -> Encoded {
    let present = state.motion().attitude;
    let attitude =
        Attitude::from_euler(EulerAngles { phi: state.log.roll_reference_rad, ..present });
    let thrust = thrust_fraction(state.log.main.thrust_n, view.model);
    Encoded::new(&ATTITUDE_TARGET_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        q: attitude.wxyz().map(convert::float),
        body_roll_rate: 0.0,
        body_pitch_rate: 0.0,
        body_yaw_rate: 0.0,
        thrust: convert::float(thrust.clamp(0.0, 1.0)),
        type_mask: AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
            | AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
            | AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE,
    })
}

/// POSITION_TARGET_GLOBAL_INT: altitude reference always, place and course where the guidance has them.
pub fn position_target_global_int(state: &Snapshot) -> Encoded {
    let navigation = &state.navigation;
    let mut ignored = Ignored::POSITION_TARGET_TYPEMASK_VX_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_VY_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_VZ_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_AX_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_AY_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_AZ_IGNORE
        | Ignored::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
    let (lat_int, lon_int) = match navigation.target {
        Some(target) => {
            let place = target.place;
            (convert::degrees_e7(place.latitude_rad), convert::degrees_e7(place.longitude_rad))
        }
        None => {
            ignored |= Ignored::POSITION_TARGET_TYPEMASK_X_IGNORE
                | Ignored::POSITION_TARGET_TYPEMASK_Y_IGNORE;
            (0, 0)
        }
    };
    if navigation.course_rad.is_none() {
        ignored |= Ignored::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
    }
    Encoded::new(&POSITION_TARGET_GLOBAL_INT_DATA {
        time_boot_ms: convert::boot_ms(state.time),
        lat_int,
        lon_int,
        alt: convert::float(state.demand.altitude_m),
        vx: 0.0,
        vy: 0.0,
        vz: 0.0,
        afx: 0.0,
        afy: 0.0,
        afz: 0.0,
        yaw: convert::float(navigation.course_rad.unwrap_or(0.0)),
        yaw_rate: 0.0,
        type_mask: ignored,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL,
    })
}

/// NAV_CONTROLLER_OUTPUT. Errors are reference minus measured value. There is no pitch reference: NaN.
/// Without guidance the bearings are the present heading and the distance is zero.
pub fn nav_controller_output(state: &Snapshot) -> Encoded {
    let (navigation, motion) = (&state.navigation, state.motion());
    let heading = motion.attitude.psi;
    let course = navigation.course_rad.unwrap_or(heading);
    let bearing = navigation.target.map_or(course, |target| target.bearing_rad);
    let distance = navigation.target.map_or(0.0, |target| target.distance_m);
    Encoded::new(&NAV_CONTROLLER_OUTPUT_DATA {
        nav_roll: convert::float(convert::degrees(state.demand.roll_rad)),
        nav_pitch: f32::NAN,
        nav_bearing: convert::bearing_degrees(course),
        target_bearing: convert::bearing_degrees(bearing),
        wp_dist: convert::whole_metres(distance),
        alt_error: convert::float(state.demand.altitude_m - motion.altitude_m),
        aspd_error: convert::float(state.demand.airspeed_m_s - motion.airspeed_m_s),
        xtrack_error: convert::float(navigation.cross_track_m),
    })
}
