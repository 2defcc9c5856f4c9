//! The parameters that QGroundControl requests, by version, from the list that was taken from its source text; and the
//! conditions under which its setup pages are complete.

use std::collections::{BTreeMap, BTreeSet};

use super::world::*;
use ::mavlink::dialects::common::{
    BATTERY_STATUS_DATA, FUEL_STATUS_DATA, GPS_RAW_INT_DATA, MavBatteryChargeState, MavMessage,
    MavParamType, PARAM_REQUEST_LIST_DATA,
};

const LIST: &str = include_str!("../../../../tests/clients/qgroundcontrol_parameters.csv");
const VERSIONS: [&str; 5] = ["4.3.0", "4.4.0", "4.4.4", "5.0.0", "5.0.1"];

/// One line: name, PX4's type, versions, file of the source.
fn rows() -> impl Iterator<Item = [&'static str; 4]> {
    let lines = LIST.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| {
        let mut fields = line.split(',');
        let row = core::array::from_fn(|_| fields.next().unwrap_or_else(|| panic!("{line}")));
        assert_eq!(fields.next(), None, "{line}");
        row
    })
}

/// Type and value of every parameter, as a station gets them.
fn parameters() -> BTreeMap<String, (MavParamType, f64)> {
    let mut world = World::flying();
    world.send(&MavMessage::PARAM_REQUEST_LIST(PARAM_REQUEST_LIST_DATA {
        target_system: 1,
        target_component: 0,
    }));
    world.run_ms(2_000);
    let values = world.values(address(14_550)).into_iter().map(|value| {
        let number = match value.param_type {
            MavParamType::MAV_PARAM_TYPE_INT32 => {
                f64::from(i32::from_le_bytes(value.param_value.to_le_bytes()))
            }
            _ => f64::from(value.param_value),
        };
        (value.param_id.to_str().unwrap().to_owned(), (value.param_type, number))
    });
    values.collect()
}

#[test]
fn every_parameter_that_a_version_requests_exists_with_the_type_of_px4() {
    let parameters = parameters();
    for version in VERSIONS {
        let mut requested = BTreeSet::new();
        for [name, kind, versions, file] in rows() {
            assert!(versions.split(' ').all(|one| VERSIONS.contains(&one)), "{versions}");
            if !versions.split(' ').any(|one| one == version) {
                continue;
            }
            let Some((own, _)) = parameters.get(name) else {
                panic!("{version} asks for {name} in {file}");
            };
            let expected = match kind {
                "INT32" => MavParamType::MAV_PARAM_TYPE_INT32,
                "FLOAT" => MavParamType::MAV_PARAM_TYPE_REAL32,
                other => panic!("{other}"),
            };
            assert_eq!(*own, expected, "{version}: {name} in {file}");
            requested.insert(name);
        }
        assert!(requested.len() > 80, "{version} asks for {} only", requested.len());
    }
}

/// Parameters that a running 4.4 listed as missing in its popup, before the list was taken from its source text.
const MISSED_BY_4_4: [&str; 20] = [
    "FW_ARSP_MODE",
    "CBRK_AIRSPD_CHK",
    "SENS_DPRES_OFF",
    "SYS_AUTOCONFIG",
    "MAV_SYS_ID",
    "RC_MAP_AUX1",
    "RC_MAP_AUX2",
    "RC_MAP_FLAPS",
    "COM_FLTMODE1",
    "COM_FLTMODE2",
    "COM_FLTMODE3",
    "COM_FLTMODE4",
    "COM_FLTMODE5",
    "COM_FLTMODE6",
    "BAT1_N_CELLS",
    "BAT1_V_EMPTY",
    "BAT1_V_CHARGED",
    "RTL_LAND_DELAY",
    "RTL_DESCEND_ALT",
    "NAV_RCL_ACT",
];

#[test]
fn the_list_has_what_a_running_station_missed() {
    for name in MISSED_BY_4_4 {
        let is_listed = |[listed, _, versions, _]: [&str; 4]| {
            listed == name && versions.split(' ').any(|version| version == "4.4.0")
        };
        assert!(rows().any(is_listed), "{name}");
    }
}

/// `setupComplete` of each page under src/AutoPilotPlugins/PX4 for a fixed wing with flight version 1.17. The other pages
/// (Safety, Tuning, Motors, Actuators without a page of their own) are always complete.
fn incomplete(version: &str, value: impl Fn(&str) -> f64) -> Vec<&'static str> {
    // SensorsComponent.cc: since 4.4.4 versions from 1.14 on are judged by SYS_HAS_NUM_ASPD.
    let airspeed = if ["4.3.0", "4.4.0"].contains(&version) {
        value("FW_ARSP_MODE") != 0.0 || value("CBRK_AIRSPD_CHK") == 162_128.0
    } else {
        value("SYS_HAS_NUM_ASPD") == 0.0
    };
    let mag = value("SYS_HAS_MAG") == 0.0 || value("CAL_MAG0_ID") != 0.0;
    let is_joystick_only = value("COM_RC_IN_MODE") == 1.0;
    let sticks = ["RC_MAP_ROLL", "RC_MAP_PITCH", "RC_MAP_YAW", "RC_MAP_THROTTLE"];
    // FlightModesComponent.h: since 5.0 always complete.
    let modes = version.starts_with('5') || value("RC_MAP_FLTMODE") != 0.0;
    let battery = ["BAT1_V_CHARGED", "BAT1_V_EMPTY", "BAT1_N_CELLS"];
    [
        ("Airframe", value("SYS_AUTOSTART") != 0.0),
        (
            "Sensors",
            value("CAL_GYRO0_ID") != 0.0
                && value("CAL_ACC0_ID") != 0.0
                && mag
                && (airspeed || value("SENS_DPRES_OFF") != 0.0),
        ),
        ("Radio", is_joystick_only || sticks.iter().all(|name| value(name) != 0.0)),
        ("Flight Modes", is_joystick_only || modes),
        ("Power", value("BAT1_SOURCE") == -1.0 || battery.iter().all(|name| value(name) != 0.0)),
    ]
    .into_iter()
    .filter_map(|(page, is_complete)| (!is_complete).then_some(page))
    .collect()
}

#[test]
fn every_setup_page_is_complete_in_every_version() {
    let parameters = parameters();
    for version in VERSIONS {
        let pages = incomplete(version, |name| parameters[name].1);
        assert_eq!(pages, [""; 0], "{version}");
    }
    // The conditions can fail.
    assert_eq!(incomplete("4.4.0", |_| 0.0).len(), 5);
    assert_eq!(
        incomplete("5.0.1", |name| if name == "SYS_HAS_NUM_ASPD" { 1.0 } else { 0.0 }),
        ["Airframe", "Sensors", "Radio", "Power"]
    );
}

#[test]
fn the_fuel_is_shown_as_what_is_left_of_a_battery_because_stations_warn_of_that() {
    let mut world = World::flying();
    world.sensors.fuel_gauge_pct.value = 6.4;
    world.run_ms(1_100);
    let battery: BATTERY_STATUS_DATA = world.got.iter().rev().find_map(Got::read).unwrap();
    assert_eq!(battery.battery_remaining, 6);
    assert_eq!(battery.charge_state, MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_CRITICAL);
    let fuel: FUEL_STATUS_DATA = world.got.iter().rev().find_map(Got::read).unwrap();
    assert_eq!((fuel.percent_remaining, fuel.maximum_fuel), (6, 1.0));
}

#[test]
fn the_supply_is_the_one_of_the_parameters_and_has_a_number_to_show() {
    let parameters = parameters();
    let mut world = World::flying();
    world.run_ms(1_100);
    let battery: BATTERY_STATUS_DATA = world.got.iter().rev().find_map(Got::read).unwrap();
    let full_v = parameters["BAT1_N_CELLS"].1 * parameters["BAT1_V_CHARGED"].1;
    assert!((f64::from(battery.voltages[0]) / 1000.0 - full_v).abs() < 1e-3, "{full_v} V");
    assert_eq!((battery.battery_remaining, battery.voltages[1]), (100, u16::MAX));
    let fix: GPS_RAW_INT_DATA = world.got.iter().rev().find_map(Got::read).unwrap();
    assert!((4..=40).contains(&fix.satellites_visible), "as many as a 3D fix needs");
}

#[test]
fn parameters_that_open_a_warning_or_a_page_of_another_vehicle_do_not_exist() {
    let parameters = parameters();
    for name in ["SYS_HITL", "_HASH_CHECK", "TRIG_MODE", "SYS_VEHICLE_RESP", "SLNK_RADIO_CHAN"] {
        assert!(!parameters.contains_key(name), "{name}");
    }
}
