use ::mavlink::dialects::common::{
    ATTITUDE_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, LOCAL_POSITION_NED_DATA,
    MavLandedState, MavSysStatusSensor, NAMED_VALUE_FLOAT_DATA, SERVO_OUTPUT_RAW_DATA,
    SYS_STATUS_DATA, VFR_HUD_DATA,
};
use icd::Ned;
use icd::fault::PlantReport;

use crate::mavlink::tests::world::{Got, World, address};

fn count(world: &World, id: u32) -> usize {
    world.got.iter().filter(|got| got.id == id && got.to == address(14_550)).count()
}

fn last<D: ::mavlink::MessageData>(world: &World) -> D {
    world.got.iter().rev().find_map(Got::read).expect("the message is streamed")
}

#[test]
fn each_message_comes_at_its_rate() {
    let mut world = World::flying();
    world.run_ms(10_000);
    for (id, expected) in [
        (1, 20),
        (245, 20),
        (30, 250),
        (31, 250),
        (33, 100),
        (32, 100),
        (74, 100),
        (141, 50),
        (242, 5),
        (36, 100),
        (375, 100),
        (251, 900),
    ] {
        let got = count(&world, id);
        // One period of tolerance at either end.
        assert!(got.abs_diff(expected) <= expected / 50 + 1, "message {id}: {got} of {expected}");
    }
}

#[test]
fn speeds_beyond_the_field_saturate_and_the_float_messages_tell_the_truth() {
    let mut world = World::flying();
    world.sensors.velocity = Ned::new(400.0, -400.0, 0.0);
    world.sensors.airspeed_m_s = 400.0;
    world.run_ms(300);
    let position: GLOBAL_POSITION_INT_DATA = last(&world);
    assert_eq!((position.vx, position.vy), (32_767, -32_768));
    let local: LOCAL_POSITION_NED_DATA = last(&world);
    assert_eq!((local.vx, local.vy), (400.0, -400.0));
    assert_eq!(last::<VFR_HUD_DATA>(&world).airspeed, 400.0);
}

#[test]
fn time_stamps_are_simulation_time() {
    let mut world = World::flying();
    world.run_ms(1_000);
    let told = u64::from(last::<ATTITUDE_DATA>(&world).time_boot_ms);
    let is = world.sim.as_micros() / 1000;
    // 40 ms between two messages, 2 ms a tick.
    assert!(is - told <= 42, "{told} ms told at {is} ms");
}

#[test]
fn health_is_honest_about_the_aircraft() {
    let prearm = MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
    let gyro = MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_3D_GYRO;
    let mut world = World::waiting();
    world.settle();
    for _ in 0..50 {
        world.now = world.now + super::PATIENCE;
        world.settle();
    }
    let status: SYS_STATUS_DATA = last(&world);
    assert!(status.onboard_control_sensors_enabled.contains(prearm | gyro));
    assert!(!status.onboard_control_sensors_health.intersects(prearm | gyro), "no aircraft");
    let state: EXTENDED_SYS_STATE_DATA = last(&world);
    assert_eq!(state.landed_state, MavLandedState::MAV_LANDED_STATE_UNDEFINED);

    let mut world = World::flying();
    world.run_ms(600);
    let status: SYS_STATUS_DATA = last(&world);
    let (enabled, health) =
        (status.onboard_control_sensors_enabled, status.onboard_control_sensors_health);
    assert!(health.contains(enabled), "all that is enabled is healthy in flight");
    assert!(health.contains(MavSysStatusSensor::MAV_SYS_STATUS_GEOFENCE));
    assert!(!enabled.contains(MavSysStatusSensor::MAV_SYS_STATUS_GEOFENCE));

    world.autopilot.plant_lost();
    world.run_ms(600);
    let status: SYS_STATUS_DATA = last(&world);
    assert!(!status.onboard_control_sensors_health.contains(gyro), "the packets have stopped");
}

#[test]
fn ground_contact_is_told_at_once() {
    let mut world = World::flying();
    let at = world.sim;
    world.autopilot.handle_report(&PlantReport::GroundContact { at });
    world.settle();
    let state: EXTENDED_SYS_STATE_DATA = last(&world);
    assert_eq!(state.landed_state, MavLandedState::MAV_LANDED_STATE_ON_GROUND);
    assert!(world.said("Ground contact"), "{:?}", world.texts());
}

#[test]
fn a_plant_that_stands_still_is_shown_as_it_was() {
    let mut world = World::flying();
    world.run_ms(100);
    let told = last::<ATTITUDE_DATA>(&world).time_boot_ms;
    world.got.clear();
    for _ in 0..100 {
        world.now = world.now + super::PATIENCE;
        world.settle();
    }
    assert!(count(&world, 0) >= 4, "heartbeats go on");
    assert!(count(&world, 30) >= 20, "so does telemetry");
    let again = last::<ATTITUDE_DATA>(&world).time_boot_ms;
    assert!(again - told <= 100, "time stands still: {told} ms, {again} ms");
}

#[test]
fn the_compensators_values_have_names() {
    let mut world = World::flying();
    world.run_ms(200);
    let values = world.got.iter().filter_map(Got::read::<NAMED_VALUE_FLOAT_DATA>);
    let names: std::collections::BTreeSet<String> =
        values.map(|value| value.name.to_str().unwrap().to_owned()).collect();
    for name in ["z2_p", "z2_q", "z2_r", "ucf_ail", "ucf_nozp", "ucf_nozy", "ftc_active"] {
        assert!(names.contains(name), "{name}");
    }
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
