//! Health as each client computes it.

use ::mavlink::dialects::common::{
    ESTIMATOR_STATUS_DATA, EXTENDED_SYS_STATE_DATA, EstimatorStatusFlags, HOME_POSITION_DATA,
    MavLandedState, MavSysStatusSensor as Sensor, SYS_STATUS_DATA,
};

use super::{SNAPSHOT_TIMEOUT, last};
use crate::tests::world::{Got, World};
use flight_management::event::{Event, EventKind};
use flight_management::vehicle::VehicleEvent;

const GPS: Sensor = Sensor::MAV_SYS_STATUS_SENSOR_GPS;
const PREARM: Sensor = Sensor::MAV_SYS_STATUS_PREARM_CHECK;
const GEOFENCE: Sensor = Sensor::MAV_SYS_STATUS_GEOFENCE;

/// `health_all_ok` as MAVSDK computes it from the received messages.
fn mavsdk_health_all_ok(world: &World) -> bool {
    let Some(status) = world.got.iter().rev().find_map(Got::read::<SYS_STATUS_DATA>) else {
        return false;
    };
    let (present, enabled, health) = (
        status.onboard_control_sensors_present,
        status.onboard_control_sensors_enabled,
        status.onboard_control_sensors_health,
    );
    let calibrated = [
        Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO,
        Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL,
        Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG,
    ];
    let position = present.contains(GPS) && enabled.contains(GPS) && health.contains(GPS);
    let home = world.got.iter().any(|got| got.read::<HOME_POSITION_DATA>().is_some());
    calibrated.into_iter().all(|bit| present.contains(bit) && health.contains(bit))
        && position
        && home
}

/// QGroundControl's "Ready to fly" for a vehicle that is not armed and has no event metadata.
fn qgroundcontrol_is_ready(status: &SYS_STATUS_DATA) -> bool {
    let (enabled, health) =
        (status.onboard_control_sensors_enabled, status.onboard_control_sensors_health);
    if enabled.contains(PREARM) { health.contains(PREARM) } else { health.contains(enabled) }
}

/// MAVProxy prints "fence breach" when this bit is missing.
fn mavproxy_sees_a_breach(status: &SYS_STATUS_DATA) -> bool {
    !status.onboard_control_sensors_health.contains(GEOFENCE)
}

fn wait(world: &mut World) {
    for _ in 0..50 {
        world.now = world.now + SNAPSHOT_TIMEOUT;
        world.settle();
    }
}

#[test]
fn mavsdk_calls_everything_healthy_within_three_seconds_of_a_flight() {
    let mut world = World::waiting();
    world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    assert!(!mavsdk_health_all_ok(&world));
    world.run_ms(1_000);
    assert!(mavsdk_health_all_ok(&world));
}

#[test]
fn without_an_aircraft_nothing_is_healthy_and_nothing_is_ready() {
    let mut world = World::waiting();
    world.settle();
    wait(&mut world);
    let status: SYS_STATUS_DATA = last(&world);
    assert!(!mavsdk_health_all_ok(&world));
    assert!(!qgroundcontrol_is_ready(&status));
    assert!(!mavproxy_sees_a_breach(&status));
    let health = status.onboard_control_sensors_health;
    assert_eq!(health, GEOFENCE, "nothing else");
    assert!(status.onboard_control_sensors_present.contains(GEOFENCE));
    let state: EXTENDED_SYS_STATE_DATA = last(&world);
    assert_eq!(state.landed_state, MavLandedState::MAV_LANDED_STATE_UNDEFINED);
}

#[test]
fn in_flight_all_that_is_enabled_is_healthy() {
    let mut world = World::flying();
    world.run_ms(600);
    let status: SYS_STATUS_DATA = last(&world);
    let (enabled, health) =
        (status.onboard_control_sensors_enabled, status.onboard_control_sensors_health);
    assert!(health.contains(enabled), "missing: {:?}", enabled.difference(health));
    assert!(qgroundcontrol_is_ready(&status) && !mavproxy_sees_a_breach(&status));
    assert!(!enabled.contains(GEOFENCE), "there is none");
    for absent in [Sensor::MAV_SYS_STATUS_SENSOR_RC_RECEIVER, Sensor::MAV_SYS_STATUS_SENSOR_BATTERY]
    {
        assert!(!status.onboard_control_sensors_present.contains(absent), "{absent:?}");
    }
    let state: EXTENDED_SYS_STATE_DATA = last(&world);
    assert_eq!(state.landed_state, MavLandedState::MAV_LANDED_STATE_IN_AIR);
}

#[test]
fn an_aircraft_that_has_gone_silent_is_not_healthy() {
    let mut world = World::flying();
    world.autopilot.plant_lost();
    world.run_ms(600);
    let status: SYS_STATUS_DATA = last(&world);
    assert!(!mavsdk_health_all_ok(&world) && !qgroundcontrol_is_ready(&status));
    assert!(!status.onboard_control_sensors_health.contains(GPS), "the packets have stopped");
}

#[test]
fn a_sensor_whose_values_are_no_numbers_is_not_healthy_and_the_others_are() {
    let mut world = World::flying();
    world.sensors.gnss.value.latitude_rad = f64::NAN;
    world.run_ms(1_100);
    assert!(!mavsdk_health_all_ok(&world));
    let status: SYS_STATUS_DATA = last(&world);
    let enabled = status.onboard_control_sensors_enabled;
    assert_eq!(enabled.difference(status.onboard_control_sensors_health), GPS);
    let estimate: ESTIMATOR_STATUS_DATA = last(&world);
    assert!(!estimate.flags.contains(EstimatorStatusFlags::ESTIMATOR_POS_HORIZ_ABS));
    assert!(estimate.flags.contains(EstimatorStatusFlags::ESTIMATOR_ATTITUDE));
}

/// An aircraft without an attitude unit, with the magnetometer and the air data of level flight.
fn on_estimated_states() -> World {
    let mut world = World::waiting();
    world.sensors.attitude.valid = false;
    world.sensors.accelerometer.value = icd::Body::new(0.0, 0.0, -9.797);
    world.sensors.gnss.value.velocity = icd::Ned::new(264.0, 0.0, 0.0);
    world.sensors.gnss.value.altitude_m = 5_000.0;
    world.sensors.gnss.value.decimal_year = 2_026.5;
    world.sensors.magnetometer_nt.value = icd::Body::new(22_000.0, 4_500.0, 40_000.0);
    world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    fly(&mut world, 600);
    world
}

/// Level flight to the north, with samples of each step; samples of one value bit for bit would count as stuck.
fn fly(world: &mut World, milliseconds: u32) {
    for step in 0..milliseconds / 2 {
        let time = world.sim + icd::ControlPeriod::DEFAULT;
        let seconds = time.as_micros() as f64 * 1.0e-6;
        let other = if step % 2 == 0 { 1.0e-9 } else { -1.0e-9 };
        let sensors = &mut world.sensors;
        sensors.gnss.value.position.0.x = 264.0 * seconds;
        sensors.gyro.value.0.x = other;
        sensors.accelerometer.value.0.x = other;
        sensors.magnetometer_nt.value.0.x += other;
        for stamp in [
            &mut sensors.gyro.time,
            &mut sensors.accelerometer.time,
            &mut sensors.gnss.time,
            &mut sensors.magnetometer_nt.time,
        ] {
            *stamp = time;
        }
        world.step();
    }
}

#[test]
fn on_estimated_states_the_innovations_and_the_accuracy_are_those_of_the_estimator() {
    let mut world = on_estimated_states();
    world.send_command(512, [230.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let status: ESTIMATOR_STATUS_DATA = last(&world);
    let estimate = world.autopilot.snapshot().and_then(|state| state.motion().estimate).unwrap();
    assert!(estimate.is_aligned);
    assert_eq!(status.pos_horiz_accuracy, estimate.horizontal_m);
    assert_eq!(status.pos_vert_accuracy, estimate.vertical_m);
    assert!((0.5..10.0).contains(&status.pos_horiz_accuracy), "{}", status.pos_horiz_accuracy);
    let ratios = [status.vel_ratio, status.pos_horiz_ratio, status.mag_ratio, status.tas_ratio];
    assert_eq!(
        ratios,
        [
            estimate.velocity_ratio,
            estimate.horizontal_ratio,
            estimate.magnetic_ratio,
            estimate.airspeed_ratio
        ]
    );
    assert!(status.mag_ratio > 0.0);
    assert!(status.hagl_ratio.is_nan(), "nothing measures it");
    assert!(status.flags.contains(EstimatorStatusFlags::ESTIMATOR_ATTITUDE), "{:?}", status.flags);
}

#[test]
fn on_estimated_states_a_sensor_is_healthy_while_the_estimator_uses_it() {
    let mut world = on_estimated_states();
    let health = |world: &mut World| {
        world.send_command(512, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        last::<SYS_STATUS_DATA>(world).onboard_control_sensors_health
    };
    let magnetometer = Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG;
    assert!(health(&mut world).contains(magnetometer | GPS));
    world.sensors.magnetometer_nt.valid = false;
    fly(&mut world, 1_100);
    let now = health(&mut world);
    assert!(!now.contains(magnetometer) && now.contains(Sensor::MAV_SYS_STATUS_AHRS), "{now:?}");
}

#[test]
fn a_terminated_flight_has_healthy_sensors_and_no_control() {
    let mut world = World::flying();
    world.run_ms(100);
    let event = Event { time: world.sim, kind: EventKind::Vehicle(VehicleEvent::Terminated) };
    world.ground.handle_event(&event, world.now);
    world.send_command(512, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let status: SYS_STATUS_DATA = last(&world);
    let health = status.onboard_control_sensors_health;
    assert!(health.contains(GPS));
    assert!(!health.intersects(PREARM | Sensor::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION));
}
