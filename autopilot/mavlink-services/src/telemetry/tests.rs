//! Streams in virtual time, as the ground station at 14550 and others see them.

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{
    ATTITUDE_DATA, ATTITUDE_TARGET_DATA, DEBUG_VECT_DATA, EXTENDED_SYS_STATE_DATA,
    GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA, HIGHRES_IMU_DATA, HighresImuUpdatedFlags,
    LOCAL_POSITION_NED_DATA, MISSION_CURRENT_DATA, MavLandedState, MissionState,
    NAMED_VALUE_FLOAT_DATA, NAV_CONTROLLER_OUTPUT_DATA, ODOMETRY_DATA,
    POSITION_TARGET_GLOBAL_INT_DATA, PositionTargetTypemask, SCALED_PRESSURE_DATA,
    SERVO_OUTPUT_RAW_DATA, SYSTEM_TIME_DATA, VFR_HUD_DATA, WIND_COV_DATA,
};
use icd::fault::PlantReport;
use icd::{Attitude, EulerAngles, Ned};

use super::registry::TABLE;
use super::{Host, SNAPSHOT_TIMEOUT};
use crate::Ground;
use crate::tests::world::{Got, World, address};
use flight_management::parameters::Parameters;

mod dead_sensors;
mod health;
mod intervals;
mod table;

fn count_at(world: &World, port: u16, id: u32) -> usize {
    world.got.iter().filter(|got| got.id == id && got.to == address(port)).count()
}

fn count(world: &World, id: u32) -> usize {
    count_at(world, 14_550, id)
}

fn last<D: MessageData>(world: &World) -> D {
    world.got.iter().rev().find_map(Got::read).expect("the message is streamed")
}

/// How many messages of one row are sent together.
fn group_size(id: u32) -> usize {
    match id {
        NAMED_VALUE_FLOAT_DATA::ID => 21,
        DEBUG_VECT_DATA::ID => 5,
        // The array of the compensator, and the empty list of faults.
        350 => 2,
        _ => 1,
    }
}

#[test]
fn each_message_comes_at_its_rate() {
    let mut world = World::flying();
    let seconds = 10;
    world.run_ms(seconds * 1_000);
    let streams = Parameters::default().streams;
    for row in &TABLE {
        let Some(interval) = row.default_interval(&streams) else { continue };
        // The list of faults comes beside the array of the same number.
        let (size, beside) = if row.id == 350 { (1, seconds) } else { (group_size(row.id), 0) };
        let expected =
            f64::from(beside) + size as f64 * f64::from(seconds) / interval.as_secs_f64();
        let got = count(&world, row.id) as f64;
        // One period of tolerance at either end, and the 2 ms of a tick for each message of 25 Hz.
        let tolerance = group_size(row.id) as f64 + expected / 40.0;
        assert!((got - expected).abs() <= tolerance, "{}: {got} of {expected}", row.name);
    }
}

#[test]
fn messages_that_only_answer_requests_are_not_streamed() {
    let mut world = World::flying();
    world.run_ms(3_000);
    for id in [148, 300, 435, 244] {
        assert_eq!(count(&world, id), 0, "message {id}");
    }
}

#[test]
fn speeds_beyond_the_field_saturate_and_the_float_messages_are_exact() {
    let mut world = World::flying();
    world.sensors.gnss.value.velocity = Ned::new(400.0, -400.0, 0.0);
    world.sensors.pitot.value.airspeed_m_s = 400.0;
    world.run_ms(300);
    let position: GLOBAL_POSITION_INT_DATA = last(&world);
    assert_eq!((position.vx, position.vy), (32_767, -32_768));
    let local: LOCAL_POSITION_NED_DATA = last(&world);
    assert_eq!((local.vx, local.vy), (400.0, -400.0));
    let airspeed = last::<VFR_HUD_DATA>(&world).airspeed;
    assert!((airspeed - 332.6).abs() < 0.5, "{airspeed} m/s, calibrated");
    let fix: GPS_RAW_INT_DATA = last(&world);
    assert_eq!((fix.vel, fix.cog), (56_569, 31_500), "cm/s, centidegrees");
}

#[test]
fn time_stamps_are_simulation_time() {
    let mut world = World::flying();
    world.run_ms(1_000);
    let sent = u64::from(last::<ATTITUDE_DATA>(&world).time_boot_ms);
    let is = world.sim.as_micros() / 1000;
    // 40 ms between two messages, 2 ms a tick.
    assert!(is - sent <= 42, "{sent} ms sent at {is} ms");
}

#[test]
fn the_clock_of_the_computer_is_sent_if_it_is_known() {
    let mut world = World::flying();
    world.run_ms(1_100);
    assert_eq!(last::<SYSTEM_TIME_DATA>(&world).time_unix_usec, 0, "unknown");

    let mut world = World::waiting();
    let model = *world.autopilot.model();
    let host = Host { unix_start_us: Some(1_700_000_000_000_000), ..Host::default() };
    world.ground = Ground::new(&Parameters::default(), &model, &[address(14_550)]).with_host(host);
    for _ in 0..3 {
        world.settle();
        world.now = world.now + SNAPSHOT_TIMEOUT;
    }
    let sent = last::<SYSTEM_TIME_DATA>(&world);
    let since_start = sent.time_unix_usec - 1_700_000_000_000_000;
    assert!(since_start <= world.now.as_micros(), "{since_start} us after the start");
    assert_eq!(sent.time_boot_ms, 0, "no flight");
}

#[test]
fn ground_contact_is_sent_at_once() {
    let mut world = World::flying();
    let at = world.sim;
    world.autopilot.handle_report(&PlantReport::GroundContact { at });
    world.settle();
    let state: EXTENDED_SYS_STATE_DATA = last(&world);
    assert_eq!(state.landed_state, MavLandedState::MAV_LANDED_STATE_ON_GROUND);
    assert!(world.has_text("Ground contact"), "{:?}", world.texts());
}

#[test]
fn a_plant_that_stands_still_is_shown_as_it_was_at_the_same_rates() {
    let mut world = World::flying();
    world.run_ms(100);
    let sent = last::<ATTITUDE_DATA>(&world).time_boot_ms;
    world.got.clear();
    for _ in 0..1_000 {
        world.now = world.now + SNAPSHOT_TIMEOUT / 10;
        world.settle();
    }
    // Five seconds; the first wait for a snapshot takes one of the 125 messages' time, and a bit.
    assert!(count(&world, 0) >= 4, "heartbeats go on");
    assert!(count(&world, 30) >= 120, "so does telemetry: {}", count(&world, 30));
    let again = last::<ATTITUDE_DATA>(&world).time_boot_ms;
    assert!(again - sent <= 100, "time stands still: {sent} ms, {again} ms");

    world.run_ms(1_000);
    let moved = last::<ATTITUDE_DATA>(&world).time_boot_ms;
    assert!(moved - again >= 900, "time goes on: {again} ms, {moved} ms");
}

#[test]
fn the_rare_messages_come_with_the_first_state_of_a_flight() {
    let mut world = World::waiting();
    world.run_ms(1_000);
    world.got.clear();
    world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    world.run_ms(200);
    for id in [242, 42, 1, 230] {
        assert!(count(&world, id) >= 1, "message {id}");
    }
}

#[test]
fn the_compensators_values_have_names() {
    let mut world = World::flying();
    world.run_ms(1_000);
    assert_eq!(count(&world, NAMED_VALUE_FLOAT_DATA::ID), 0, "only on request");
    world.send_command(511, [251.0, 100_000.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.run_ms(200);
    let values = world.got.iter().filter_map(Got::read::<NAMED_VALUE_FLOAT_DATA>);
    let names: std::collections::BTreeSet<String> =
        values.map(|value| value.name.to_str().unwrap().to_owned()).collect();
    for name in ["z2_p", "z2_q", "z2_r", "ucf_ail", "ucf_nozp", "ucf_nozy", "ftc_active"] {
        assert!(names.contains(name), "{name}");
    }
}

#[test]
fn each_signal_comes_from_its_own_component_with_its_own_sequence() {
    let mut world = World::flying();
    world.run_ms(10_000);
    let at = address(14_550);
    let mut names = std::collections::BTreeSet::new();
    for component in 25..=29 {
        // The component is the seventh byte of a frame of MAVLink 2.
        let of_component = |got: &&Got| got.to == at && got.bytes[6] == component;
        let got: Vec<&Got> = world.got.iter().filter(of_component).collect();
        // 4 Hz, and the one at the flight's beginning.
        assert!((39..=42).contains(&got.len()), "{} of component {component}", got.len());
        let vectors: Vec<DEBUG_VECT_DATA> =
            got.iter().map(|got| got.read().expect("no HEARTBEAT, nothing else")).collect();
        let name = vectors[0].name.to_str().unwrap().to_owned();
        assert!(vectors.iter().all(|vector| vector.name.to_str().unwrap() == name));
        assert!(got.windows(2).all(|two| two[1].sequence == two[0].sequence.wrapping_add(1)));
        names.insert(name);
    }
    let expected = ["applied", "attained", "authority", "estimate", "level"];
    assert!(names.iter().eq(expected.iter()), "{names:?}");
    let log = world.autopilot.snapshot().unwrap().log;
    let last = world.got.iter().rev().filter_map(Got::read::<DEBUG_VECT_DATA>);
    let authority = last.into_iter().find(|vector| vector.name.to_str().unwrap() == "authority");
    let (sent, is) = (authority.unwrap().x, log.authority.roll_pct as f32);
    // A quarter of a second earlier, in level flight.
    assert!((sent - is).abs() < 5.0, "{sent} %, {is} %");
}

#[test]
fn outputs_are_pulses_around_1500_and_the_engine_from_1000() {
    let mut world = World::flying();
    world.run_ms(200);
    let outputs: SERVO_OUTPUT_RAW_DATA = last(&world);
    assert!((1000..=2000).contains(&outputs.servo1_raw), "{} us", outputs.servo1_raw);
    assert!((1000..=2000).contains(&outputs.servo8_raw), "{} us", outputs.servo8_raw);
    assert_eq!(outputs.servo9_raw, 0);
}

#[test]
fn the_wind_is_what_the_ground_speed_has_more_than_the_airspeed() {
    let mut world = World::flying();
    // Nose north, 3 degrees up with the same angle of attack, so level through the air at 264 m/s.
    let alpha = 3.0_f64.to_radians();
    let euler = EulerAngles { phi: 0.0, theta: alpha, psi: 0.0 };
    world.sensors.attitude.value = Attitude::from_euler(euler);
    world.sensors.vanes.value.angle_of_attack_rad = alpha;
    world.sensors.gnss.value.velocity = Ned::new(274.0, -7.0, 1.5);
    world.run_ms(1_100);
    let wind: WIND_COV_DATA = last(&world);
    // 1e-3 m/s: a float has seven digits, and 264 m/s is subtracted.
    for (sent, is) in [(wind.wind_x, 10.0), (wind.wind_y, -7.0), (wind.wind_z, 1.5)] {
        assert!((sent - is).abs() < 1.0e-3, "{sent} m/s, not {is}");
    }
    assert!(wind.var_horiz.is_nan() && wind.var_vert.is_nan());
}

#[test]
fn pressures_are_those_of_the_samples() {
    let mut world = World::flying();
    world.run_ms(600);
    let pressure: SCALED_PRESSURE_DATA = last(&world);
    // 5000 m: 540.2 hPa, -17.5 degC. 264 m/s are Mach 0.8236 there, and 540.2 hPa ((1 + 0.2 M^2)^3.5 - 1)
    // = 303.5 hPa. 0.5 hPa: the table has four digits.
    assert!((pressure.press_abs - 540.2).abs() < 0.5, "{} hPa", pressure.press_abs);
    assert!((pressure.press_diff - 303.5).abs() < 0.5, "{} hPa", pressure.press_diff);
    assert_eq!(pressure.temperature, -1_750, "centidegrees");
}

#[test]
fn a_magnetometer_that_does_not_exist_measures_nothing() {
    let mut world = World::flying();
    world.run_ms(200);
    let imu: HIGHRES_IMU_DATA = last(&world);
    assert!(imu.xmag.is_nan() && imu.ymag.is_nan() && imu.zmag.is_nan());
    let magnetic = HighresImuUpdatedFlags::HIGHRES_IMU_UPDATED_XMAG;
    assert!(!imu.fields_updated.contains(magnetic));
    assert!(imu.fields_updated.contains(HighresImuUpdatedFlags::HIGHRES_IMU_UPDATED_ZGYRO));
    assert!(imu.zacc < 0.0 || world.sensors.accelerometer.value.0.z == 0.0, "body axes, z down");
}

#[test]
fn references_are_sent_as_the_laws_have_them() {
    let mut world = World::flying();
    world.run_ms(600);
    let state = *world.autopilot.snapshot().unwrap();
    let nav: NAV_CONTROLLER_OUTPUT_DATA = last(&world);
    let error_m = (state.demand.altitude_m - state.motion().altitude_m) as f32;
    assert_eq!(nav.alt_error, error_m);
    assert!(nav.nav_pitch.is_nan(), "there is no pitch reference");
    let target: ATTITUDE_TARGET_DATA = last(&world);
    assert!((0.0..=1.0).contains(&target.thrust), "{}", target.thrust);
    let length: f32 = target.q.iter().map(|part| part * part).sum();
    // 1e-5: four squares of numbers with seven digits.
    assert!((length - 1.0).abs() < 1.0e-5, "{:?}", target.q);
    let place: POSITION_TARGET_GLOBAL_INT_DATA = last(&world);
    assert_eq!(place.alt, state.demand.altitude_m as f32);
    let no_place = PositionTargetTypemask::POSITION_TARGET_TYPEMASK_X_IGNORE;
    assert_eq!(place.type_mask.contains(no_place), state.navigation.target.is_none());
}

#[test]
fn odometry_has_its_velocity_in_body_axes() {
    let mut world = World::flying();
    let euler = EulerAngles { phi: 0.0, theta: 0.0, psi: 90.0_f64.to_radians() };
    world.sensors.attitude.value = Attitude::from_euler(euler);
    world.sensors.gnss.value.velocity = Ned::new(0.0, 264.0, 0.0);
    world.run_ms(200);
    let odometry: ODOMETRY_DATA = last(&world);
    assert!((odometry.vx - 264.0).abs() < 1.0e-3 && odometry.vy.abs() < 1.0e-3, "forward");
    assert!(odometry.pose_covariance[0].is_nan() && odometry.velocity_covariance[0].is_nan());
}

#[test]
fn without_a_plan_the_current_item_has_its_own_number() {
    let mut world = World::flying();
    world.run_ms(1_100);
    let mission: MISSION_CURRENT_DATA = last(&world);
    assert_eq!(mission.total, u16::MAX);
    assert_eq!(mission.mission_state, MissionState::MISSION_STATE_NO_MISSION);
    assert_eq!((mission.mission_mode, mission.mission_id), (2, 0));
}
