//! No value of a dead sensor is sent as alive. docs/sensors.md has the whole table; tests/clients/dead_sensors.py checks it in
//! flight.

use ::mavlink::dialects::common::{
    ESTIMATOR_STATUS_DATA, GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA, GpsFixType,
    HIGHRES_IMU_DATA, LOCAL_POSITION_NED_DATA, SYS_STATUS_DATA, VFR_HUD_DATA,
};
use icd::sensors::SensorKind;

use super::last;
use crate::tests::world::{Got, World};
use flight_management::event::{Event, EventKind};

/// A flight that loses a sensor, half a second later, with the messages since then.
fn without(lost: SensorKind) -> World {
    let mut world = World::flying();
    world.run_ms(300);
    world.sensors.invalidate(|sensor| sensor == lost);
    world.run_ms(10);
    world.got.clear();
    world.run_ms(1_100);
    world
}

#[test]
fn a_receiver_without_valid_samples_has_no_fix_and_no_numbers() {
    let world = without(SensorKind::Gnss);
    let fix: GPS_RAW_INT_DATA = last(&world);
    assert_eq!(fix.fix_type, GpsFixType::GPS_FIX_TYPE_NO_FIX);
    assert_eq!([fix.eph, fix.epv, fix.vel, fix.cog], [u16::MAX; 4]);
    assert_eq!((fix.satellites_visible, fix.lat, fix.lon, fix.alt), (u8::MAX, 0, 0, 0));
    assert!(!world.got.iter().any(|got| got.read::<GLOBAL_POSITION_INT_DATA>().is_some()));
    let local: LOCAL_POSITION_NED_DATA = last(&world);
    assert!(local.x.is_nan() && local.vx.is_nan());
    let hud: VFR_HUD_DATA = last(&world);
    assert!(hud.groundspeed.is_nan() && hud.climb.is_nan());
    assert!((hud.alt - 5_000.0).abs() < 1.0 && (hud.airspeed - 212.0).abs() < 1.0);
    assert!(world.has_text("GNSS lost"), "{:?}", world.texts());
}

#[test]
fn without_a_pitot_tube_there_is_no_airspeed_and_without_a_barometer_the_altitude_of_the_satellites()
 {
    let world = without(SensorKind::Pitot);
    assert!(last::<VFR_HUD_DATA>(&world).airspeed.is_nan());
    assert!(last::<HIGHRES_IMU_DATA>(&world).diff_pressure.is_nan());
    assert!(world.has_text("Airspeed lost"), "{:?}", world.texts());
    let world = without(SensorKind::Barometer);
    assert!((last::<VFR_HUD_DATA>(&world).alt - 5_000.0).abs() < 1.0);
    let imu: HIGHRES_IMU_DATA = last(&world);
    assert!(imu.abs_pressure.is_nan() && imu.pressure_alt.is_nan());
    assert_eq!(last::<ESTIMATOR_STATUS_DATA>(&world).pos_vert_ratio, 0.0, "no estimator");
}

#[test]
fn no_sensor_is_healthy_that_is_not_present() {
    let check = |world: &World| {
        let status: SYS_STATUS_DATA = last(world);
        let present = status.onboard_control_sensors_present;
        let health = status.onboard_control_sensors_health;
        assert!(present.contains(health), "{:?}", health.difference(present));
    };
    for lost in SensorKind::ALL {
        check(&without(lost));
    }
    let mut world = World::flying();
    world.autopilot.plant_lost();
    world.run_ms(600);
    check(&world);
}

#[test]
fn after_ground_contact_nothing_moves_in_any_message() {
    let mut world = World::flying();
    world.run_ms(300);
    let event = Event { time: world.sim, kind: EventKind::GroundContact };
    world.ground.handle_event(&event, world.now);
    world.got.clear();
    world.send_command(512, [74.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.send_command(512, [24.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let hud: VFR_HUD_DATA = world.got.iter().find_map(Got::read).expect("requested");
    assert_eq!([hud.airspeed, hud.groundspeed, hud.climb], [0.0; 3]);
    assert_eq!(
        world.got.iter().find_map(Got::read::<GPS_RAW_INT_DATA>).map(|fix| fix.vel),
        Some(0)
    );
}
