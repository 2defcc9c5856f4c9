//! Flights that begin on a ground, with the autopilot as in any other.

use autopilot::event::EventKind;
use autopilot::script::{LineRefusal, ScriptEvent};
use autopilot::vehicle::failsafe::{Failsafe, FuelLevel};
use autopilot::vehicle::{Mode, VehicleEvent, VehicleRefusal};
use host_io::problem::Problem;
use lab_engine::Flight;
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, Named};
use lab_judges::flown::{self, Keep};
use lab_judges::outcome::Outcome;
use lab_studies::new::New;
use plant_sim::touchdown::Touchdown;
use plant_sim::{Airframe, ReadAirframe as _};

/// `start` is what `[plant.ground]` has besides the runway.
fn fly(
    airframe: &str,
    start: &str,
    altitude_m: f64,
    airspeed_m_s: f64,
) -> Result<Outcome, Problem> {
    let scenario = format!(
        "[plant]\nduration_s = 60.0\n[plant.ground]\nlatitude_deg = 34.9\nlongitude_deg = -117.9\nelevation_m = 0.0\n\
         heading_deg = 40.0\nlength_m = 3000.0\n{start}\n[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 0.0\n\
         altitude_m = {altitude_m:?}\nairspeed_m_s = {airspeed_m_s:?}\n"
    );
    let aircraft = AircraftArgs { airframe: Some(airframe.into()), ..AircraftArgs::default() };
    let options = SetupOptions { aircraft, ..SetupOptions::default() };
    let setup = options.builder()?.setup(&Named::given("ground", scenario), &[])?;
    flown::fly(&setup, true, Keep::default()).map(|(outcome, _)| outcome)
}

#[test]
fn an_aircraft_launched_by_hand_climbs_to_its_altitude() {
    let launch = "start = \"launched\"\nheight_m = 1.8\nspeed_m_s = 22.0\npitch_deg = 8.0";
    let outcome = fly("aerosonde", launch, 100.0, 25.0).unwrap();
    assert!(outcome.touchdown.is_none());
    assert!(outcome.is_kept() && (outcome.end_s - 60.0).abs() < 1.0e-9, "{outcome:?}");
    let low = launch.replace("height_m = 1.8", "height_m = 0.0");
    let refused = fly("aerosonde", &low, 100.0, 25.0).unwrap_err().to_string();
    assert!(refused.contains("height_m = 0 puts the"), "{refused}");
}

#[test]
fn air_data_that_do_not_change_at_rest_are_not_lost() {
    let outcome = fly(
        "tvc_jet",
        "start = \"ready\"\nalong_m = 50.0\n[plant.sensors]\ngrade = \"tactical\"",
        100.0,
        25.0,
    );
    let outcome = outcome.unwrap();
    assert!(outcome.is_kept() && outcome.sensors_lost.is_empty(), "{:?}", outcome.sensors_lost);
}

#[test]
fn a_launch_that_does_not_fly_ends_with_the_crash() {
    // Nose down and far below the stall.
    let launch = "start = \"launched\"\nheight_m = 30.0\nspeed_m_s = 5.0\npitch_deg = -45.0";
    let outcome = fly("aerosonde", launch, 100.0, 25.0).unwrap();
    assert!(!outcome.is_kept() && outcome.end_s < 10.0, "{outcome:?}");
    let words = outcome.to_string();
    assert!(words.contains("touchdown at a rate of descent of"), "{words}");
}

/// Events of the vehicle and alarms of a flight, each with its time, s, and how it touched down.
struct Circuit {
    events: Vec<(f64, EventKind)>,
    touchdown: Option<Touchdown>,
    crash: Option<String>,
}

impl Circuit {
    fn fly(airframe: &str, script: &str, keys: &[(&str, f64)]) -> Self {
        let aircraft = AircraftArgs { airframe: Some(airframe.into()), ..AircraftArgs::default() };
        let mut options = SetupOptions { aircraft, ..SetupOptions::default() };
        for (key, value) in keys {
            let _ = options.set(key, *value);
        }
        Self::of(&options, script)
    }

    fn of(options: &SetupOptions, script: &str) -> Self {
        let scenario = format!("{}\n[autopilot]\nscript = '''\n{script}'''\n", scenarios::FIELD);
        let named = Named::given("field", scenario);
        let setup = options.builder().unwrap().setup(&named, &[]).unwrap();
        let mut flight = Flight::new(&setup).unwrap();
        let mut events = Vec::new();
        while let Some(tick) = flight.step([]) {
            events.extend(tick.events.iter().map(|event| (event.time.as_seconds(), event.kind)));
            // It has stopped.
            if matches!(events.last(), Some((_, EventKind::Vehicle(VehicleEvent::Armed(false))))) {
                break;
            }
        }
        let plant = flight.plant();
        let crash = plant.crash().map(|failure| failure.to_string());
        Self { events, touchdown: plant.touchdown().copied(), crash }
    }

    /// The lines of the script that were refused.
    fn refused(&self) -> Vec<(u16, LineRefusal)> {
        let refused = self.events.iter().filter_map(|(_, kind)| match kind {
            EventKind::Script { event: ScriptEvent::LineRefused { line, why }, .. } => {
                Some((*line, *why))
            }
            _ => None,
        });
        refused.collect()
    }

    /// How often the compensator woke within ten seconds after the lift-off or the touchdown; both are there.
    fn alarms_near_ground(&self) -> usize {
        let begins = [VehicleEvent::LiftOff, VehicleEvent::TouchDown]
            .map(|event| self.time_of(event).unwrap_or_else(|| panic!("{event:?}")));
        let is_near = |time_s: f64| begins.iter().any(|s| (0.0..10.0).contains(&(time_s - s)));
        let alarms = self.events.iter().filter(|(time_s, kind)| {
            matches!(kind, EventKind::CompensatorActive { .. }) && is_near(*time_s)
        });
        alarms.count()
    }

    fn time_of(&self, event: VehicleEvent) -> Option<f64> {
        let is_it = |kind: &EventKind| *kind == EventKind::Vehicle(event);
        self.events.iter().find(|(_, kind)| is_it(kind)).map(|(time_s, _)| *time_s)
    }
}

const CIRCUIT: &str = "at 20 s: arm\nafter 1 s: mode takeoff\nafter 80 s: land\n";

#[test]
fn every_aircraft_takes_off_and_lands_where_it_began_without_an_alarm() {
    for airframe in AIRCRAFT {
        let wind = [("plant.wind.speed_m_s", 4.0), ("plant.wind.towards_deg", 250.0)];
        let flown = Circuit::fly(airframe, CIRCUIT, &wind);
        assert_eq!(flown.crash, None, "{airframe}");
        assert_eq!(flown.alarms_near_ground(), 0, "{airframe}: {:?}", flown.events);
        let down = flown.touchdown.unwrap();
        // Measured 0.4 to 1.9 m/s; the start is 100 m from the threshold.
        assert!(down.sink_m_s < 2.4, "{airframe}: {down:?}");
        assert!((100.0..1_300.0).contains(&down.along_m), "{airframe}: {down:?}");
        assert!(down.across_m.abs() < 6.0 && down.roll_rad.abs() < 0.1, "{airframe}: {down:?}");
    }
}

#[test]
fn gusts_near_the_ground_do_not_wake_the_compensator_and_a_fault_does() {
    let options = |airframe: &str, turbulence: &str, seed: i64| {
        let mut options = SetupOptions::default();
        let _ = options.aircraft(airframe).set("plant.wind.turbulence", turbulence);
        let _ = options.set("plant.wind.speed_m_s", 5.0).set("plant.wind.towards_deg", 265.0);
        let _ = options.set("plant.seed", seed);
        options
    };
    // In the first two seconds of these flights the levels from high up were passed 5.4, 4.7 and 1.8 times.
    for (airframe, turbulence, seed) in
        [("skywalker_x8", "light", 5), ("aerosonde", "light", 2), ("f16", "moderate", 5)]
    {
        let flown = Circuit::of(&options(airframe, turbulence, seed), CIRCUIT);
        assert_eq!(flown.crash, None, "{airframe}");
        assert_eq!(flown.alarms_near_ground(), 0, "{airframe}: {:?}", flown.events);
    }
    let script = "at 20 s: arm\nmode takeoff\nafter 10 s: fail rudder stuck at 10 deg\n";
    let mut fails = options("aerosonde", "light", 2);
    let _ = fails.set("plant.duration_s", 35.0);
    let flown = Circuit::of(&fails, script);
    let woken =
        flown.events.iter().find(|(_, kind)| matches!(kind, EventKind::CompensatorActive { .. }));
    let (woken_s, _) = woken.unwrap_or_else(|| panic!("{:?}", flown.events));
    assert!((30.0..30.3).contains(woken_s), "{woken_s} s");
}

#[test]
fn a_wind_from_the_side_is_known_at_the_lift_off() {
    let mut options = SetupOptions::default();
    let _ = options.aircraft("skywalker_x8").set("plant.duration_s", 25.0);
    let _ = options.set("plant.wind.speed_m_s", 5.0).set("plant.wind.towards_deg", 310.0);
    let script = "at 20 s: arm\nmode takeoff\n";
    let scenario = format!("{}\n[autopilot]\nscript = '''\n{script}'''\n", scenarios::FIELD);
    let setup = options.builder().unwrap().setup(&Named::given("field", scenario), &[]).unwrap();
    let mut flight = Flight::new(&setup).unwrap();
    let (mut wrong_rad, mut ticks): (f64, u32) = (0.0, 0);
    while let Some(tick) = flight.step([]) {
        let state = &tick.log.state;
        if !state.on_wheels && ticks < 100 {
            wrong_rad = wrong_rad.max((state.beta - tick.plant.truth().beta_rad).abs());
            ticks += 1;
        }
    }
    // 0.2 s; the sideslip is 14 deg.
    assert!(ticks == 100 && wrong_rad.to_degrees() < 3.0, "{} deg", wrong_rad.to_degrees());
}

#[test]
fn the_pitot_tube_is_set_to_zero_before_the_takeoff() {
    // The lasting error of this grade, 54 Pa rms, is half of the impact pressure of the approach. Of these seeds two had a stall there.
    for (law, seed) in [(0.0, 1), (0.0, 3), (2.0, 1), (3.0, 1)] {
        let mut options = SetupOptions::default();
        let _ = options.aircraft("skywalker_x8").set("plant.sensors.grade", "consumer");
        let _ = options.set("plant.seed", seed).set("CTL_LAW", law);
        let flown = Circuit::of(&options, CIRCUIT);
        let down = flown.touchdown.unwrap_or_else(|| panic!("{law}, {seed}: {:?}", flown.crash));
        assert!(down.sink_m_s < 1.1, "{law}, {seed}: {down:?}");
        assert!((100.0..250.0).contains(&down.along_m), "{law}, {seed}: {down:?}");
    }
}

#[test]
fn an_airspeed_that_is_wrong_does_not_hold_a_law_below_its_altitude() {
    // The elevator of the trim is wrong too: LQR sank into the field, NDI came late.
    for (airframe, law, bias_pa, latest_s) in [
        ("skywalker_x8", 3.0, 40, 480.0),
        ("aerosonde", 3.0, 60, 320.0),
        ("aerosonde", 2.0, 60, 310.0),
    ] {
        let script = format!(
            "at 20 s: arm\nafter 1 s: mode takeoff\nat 30 s: fail pitot biased by {bias_pa} Pa\nat 101 s: land\n"
        );
        let flown = Circuit::fly(airframe, &script, &[("CTL_LAW", law)]);
        let down =
            flown.touchdown.unwrap_or_else(|| panic!("{airframe}, {law}: {:?}", flown.crash));
        assert!((100.0..250.0).contains(&down.along_m), "{airframe}, {law}: {down:?}");
        assert!(down.time.as_seconds() < latest_s, "{airframe}, {law}: {down:?}");
    }
}

#[test]
fn consumer_sensors_take_off_and_land_with_the_heading_of_the_runway_where_the_field_is_steep() {
    // The altimeter of this grade reaches 120 m, and the magnetometer is wrong by 30 deg and more there.
    for airframe in ["tvc_jet", "f16"] {
        let mut options = SetupOptions::default();
        let _ = options.aircraft(airframe).set("plant.sensors.grade", "consumer");
        let _ = options.set("plant.ground.latitude_deg", 78.0).set("GND_RWY_HDG", 40.0);
        let flown = Circuit::of(&options, CIRCUIT);
        let down = flown.touchdown.unwrap_or_else(|| panic!("{airframe}: {:?}", flown.crash));
        assert!(down.sink_m_s < 1.5 && down.across_m.abs() < 15.0, "{airframe}: {down:?}");
    }
}

#[test]
fn what_cannot_be_done_on_the_ground_or_in_the_air_is_refused() {
    // The estimator needs a moment for its alignment; a takeoff and a disarming are for the ground.
    let script = "mode takeoff\nat 20 s: arm\nafter 60 s: mode takeoff\ndisarm\nland\n";
    let flown = Circuit::fly("aerosonde", script, &[]);
    let in_the_air = LineRefusal::Vehicle(VehicleRefusal::InTheAir);
    assert_eq!(flown.refused(), [(3, in_the_air), (4, in_the_air)]);
    assert!(flown.touchdown.is_some() && flown.crash.is_none(), "{:?}", flown.crash);
}

#[test]
fn a_takeoff_that_is_given_up_ends_in_a_stop() {
    let script = "at 20 s: arm\nmode takeoff\nafter 8 s: disarm\nmode hold\n";
    let flown = Circuit::fly("tvc_jet", script, &[]);
    // Only a slow aircraft is disarmed: nobody would steer it.
    let moving = |why: &LineRefusal| matches!(why, LineRefusal::Vehicle(VehicleRefusal::Moving { m_s }) if *m_s > 10.0);
    assert!(matches!(&flown.refused()[..], [(3, why)] if moving(why)), "{:?}", flown.refused());
    assert_eq!(flown.crash, None);
    assert!(flown.time_of(VehicleEvent::TakeoffAborted).is_some(), "{:?}", flown.events);
    assert!(flown.time_of(VehicleEvent::Armed(false)).is_some(), "{:?}", flown.events);
    assert_eq!(flown.time_of(VehicleEvent::LiftOff), None);
}

const AIRCRAFT: [&str; 6] =
    ["tvc_jet", "tvc_jet_mach", "f16", "aerosonde", "aerosonde_vtail", "skywalker_x8"];

fn begins(failsafe: Failsafe) -> VehicleEvent {
    VehicleEvent::Failsafe { failsafe, is_there: true }
}

#[test]
fn every_aircraft_glides_down_and_lands_after_a_flame_out() {
    let script =
        "at 20 s: arm\nmode takeoff\nafter 60 s: mode hold\nafter 40 s: fail engine flame-out\n";
    for airframe in AIRCRAFT {
        let flown = Circuit::fly(airframe, script, &[]);
        assert_eq!(flown.crash, None, "{airframe}");
        assert!(flown.time_of(begins(Failsafe::EngineFailed)).is_some(), "{airframe}");
        let down = flown.touchdown.unwrap_or_else(|| panic!("{airframe} is still in the air"));
        // Measured 0.4 to 0.6 m/s.
        assert!(down.sink_m_s < 1.5 && down.roll_rad.abs() < 0.1, "{airframe}: {down:?}");
    }
}

/// Shortly before the approach of the Aerosonde is judged.
fn before_the_decision_s(options: &SetupOptions) -> f64 {
    let down_s = Circuit::of(options, CIRCUIT).time_of(VehicleEvent::TouchDown);
    down_s.expect("a touchdown").round() - 8.0
}

#[test]
fn an_engine_that_fails_on_the_approach_or_in_a_go_around_does_not_lose_the_aircraft() {
    for airframe in ["aerosonde", "skywalker_x8", "f16"] {
        let flown = Circuit::fly(airframe, CIRCUIT, &[]);
        let down_s = flown.time_of(VehicleEvent::TouchDown).expect("a touchdown");
        let script = format!("{CIRCUIT}at {:.0} s: fail engine flame-out\n", down_s - 20.0);
        let flown = Circuit::fly(airframe, &script, &[]);
        assert_eq!(flown.crash, None, "{airframe}");
        let down = flown.touchdown.unwrap_or_else(|| panic!("{airframe}: {:?}", flown.events));
        // On its line, and not in a circle.
        assert!(down.across_m.abs() < 6.0 && down.roll_rad.abs() < 0.1, "{airframe}: {down:?}");
    }
    let mut options = SetupOptions::default();
    let _ = options.aircraft("aerosonde").set("plant.sensors.grade", "ideal");
    let bias_s = before_the_decision_s(&options);
    let script = format!(
        "{CIRCUIT}at {bias_s:.0} s: fail gnss biased 100 m\nafter 17 s: fail engine flame-out\n"
    );
    let flown = Circuit::of(&options, &script);
    assert!(flown.time_of(VehicleEvent::GoAround).is_some(), "{:?}", flown.events);
    assert!(flown.time_of(begins(Failsafe::EngineFailed)).is_some(), "{:?}", flown.events);
    assert_eq!(flown.crash, None);
    let down = flown.touchdown.unwrap_or_else(|| panic!("{:?}", flown.events));
    assert!(down.sink_m_s < 2.4 && down.roll_rad.abs() < 0.2, "{down:?}");
}

#[test]
fn an_approach_without_a_position_is_flown_again_once_it_is_back() {
    let script = "at 20 s: arm\nmode takeoff\nafter 80 s: land\nafter 60 s: fail gnss off\nafter 150 s: clear gnss\n";
    for grade in ["ideal", "tactical"] {
        let mut options = SetupOptions::default();
        let _ = options.aircraft("aerosonde").set("plant.sensors.grade", grade);
        let flown = Circuit::of(&options, script);
        let down = flown.touchdown.unwrap_or_else(|| panic!("{grade}: {:?}", flown.crash));
        assert!(down.along_m < 400.0 && down.across_m.abs() < 6.0, "{grade}: {down:?}");
        // The estimator of the tactical grade is certain enough for so long.
        let lost = flown.time_of(begins(Failsafe::PositionLost));
        assert_eq!(lost.is_some(), grade == "ideal", "{:?}", flown.events);
    }
}

#[test]
fn an_approach_that_is_not_stable_is_flown_again() {
    // Just before the decision the position jumps, north, east and down: to 12 m beside the line.
    let mut options = SetupOptions::default();
    // The estimator of the tactical grade would not believe it.
    let _ = options.aircraft("aerosonde").set("plant.sensors.grade", "ideal");
    let bias_s = before_the_decision_s(&options);
    let script = format!("{CIRCUIT}at {bias_s:.0} s: fail gnss biased 100 m\n");
    let flown = Circuit::of(&options, &script);
    let around_s = flown.time_of(VehicleEvent::GoAround).expect("a go-around");
    let down = flown.touchdown.unwrap_or_else(|| panic!("{:?}", flown.crash));
    assert!((0.0..7.0).contains(&(around_s - bias_s)), "{around_s} s");
    assert!(down.time.as_seconds() > around_s + 100.0 && down.sink_m_s < 2.0, "{down:?}");
}

#[test]
fn the_nose_points_along_the_runway_at_the_touchdown_also_in_a_wind_from_the_side() {
    let wind = [("plant.wind.speed_m_s", 5.0), ("plant.wind.towards_deg", 310.0)];
    // Less than the crab of an approach in this wind, asin(5/106) and asin(5/21): 2.7 and 13.8 deg.
    for (airframe, largest_deg) in [("tvc_jet", 1.5), ("aerosonde", 8.0)] {
        let flown = Circuit::fly(airframe, CIRCUIT, &wind);
        let down = flown.touchdown.unwrap_or_else(|| panic!("{airframe}: {:?}", flown.crash));
        let crab_deg = down.crab_rad.to_degrees().abs();
        assert!(crab_deg < largest_deg && down.across_m.abs() < 10.0, "{airframe}: {down:?}");
    }
}

#[test]
fn a_strong_wind_from_the_side_does_not_roll_the_aircraft_over_in_its_rollout() {
    // Before the rudder held the nose, five of the first six seeds were lost. The wind is beyond the stated limit: of twenty seeds four
    // strike the runway with the nozzle, the second and the sixth among them.
    for seed in [1, 3, 4] {
        let mut options = SetupOptions::default();
        let _ = options.aircraft("f16").set("plant.wind.turbulence", "moderate");
        for (key, value) in [("plant.wind.speed_m_s", 9.0), ("plant.wind.towards_deg", 310.0)] {
            let _ = options.set(key, value);
        }
        let _ = options.set("plant.seed", seed);
        let flown = Circuit::of(&options, CIRCUIT);
        assert_eq!(flown.crash, None, "seed {seed}");
        assert!(flown.time_of(VehicleEvent::Armed(false)).is_some(), "{:?}", flown.events);
    }
}

#[test]
fn a_takeoff_whose_wheels_touch_again_goes_on() {
    let mut options = SetupOptions::default();
    let _ = options.aircraft("f16").set("plant.wind.turbulence", "moderate").set("plant.seed", 5);
    let _ = options.set("plant.wind.speed_m_s", 9.0).set("plant.wind.towards_deg", 310.0);
    let _ = options.set("plant.duration_s", 45.0);
    let flown = Circuit::of(&options, CIRCUIT);
    let is_lift_off = |kind: &EventKind| *kind == EventKind::Vehicle(VehicleEvent::LiftOff);
    let lift_offs = flown.events.iter().filter(|(_, kind)| is_lift_off(kind)).count();
    let given_up = [VehicleEvent::TouchDown, VehicleEvent::TakeoffAborted];
    assert_eq!((lift_offs, &flown.crash), (1, &None), "{:?}", flown.events);
    for event in given_up {
        assert_eq!(flown.time_of(event), None, "{:?}", flown.events);
    }
}

#[test]
fn a_flying_wing_leaves_its_catapult_across_the_wind_and_comes_back() {
    // With the fourth seed gusts carry the aircraft on its rail.
    for seed in [1, 4, 5] {
        let mut options = SetupOptions::default();
        let _ = options.aircraft("skywalker_x8").set("plant.wind.turbulence", "light");
        let _ = options.set("plant.wind.speed_m_s", 6.0).set("plant.wind.towards_deg", 310.0);
        let _ = options.set("plant.seed", seed);
        let flown = Circuit::of(&options, CIRCUIT);
        assert_eq!(flown.crash, None, "seed {seed}");
        assert!(flown.time_of(VehicleEvent::Armed(true)).is_some(), "{:?}", flown.events);
        assert!(flown.time_of(VehicleEvent::Armed(false)).is_some(), "{:?}", flown.events);
    }
}

#[test]
fn a_throw_by_hand_is_a_rail_as_long_as_an_arm() {
    let throw = [("height_m", 1.8), ("speed_m_s", 13.0), ("pitch_deg", 12.0), ("rail_m", 1.0)];
    let mut options = SetupOptions::default();
    let _ = options.aircraft("skywalker_x8").set("plant.wind.turbulence", "light");
    let _ = options.set("plant.ground.start", "catapult");
    for (key, value) in throw {
        let _ = options.set(&format!("plant.ground.{key}"), value);
    }
    let flown = Circuit::of(&options, CIRCUIT);
    let down = flown.touchdown.unwrap_or_else(|| panic!("{:?}", flown.crash));
    assert!(down.sink_m_s < 2.4 && down.across_m.abs() < 10.0, "{down:?}");
}

#[test]
fn every_law_lands() {
    // NDI and LQR follow an altitude three to four times as fast as the PID.
    for (airframe, law, most_m_s) in [
        ("tvc_jet", 2.0, 2.0),
        ("tvc_jet", 3.0, 3.2),
        ("aerosonde", 2.0, 1.5),
        ("skywalker_x8", 3.0, 1.5),
    ] {
        let flown = Circuit::fly(airframe, CIRCUIT, &[("CTL_LAW", law)]);
        let down =
            flown.touchdown.unwrap_or_else(|| panic!("{airframe}, {law}: {:?}", flown.crash));
        assert_eq!(flown.crash, None, "{airframe}, {law}");
        assert!(
            down.sink_m_s < most_m_s && down.across_m.abs() < 10.0,
            "{airframe}, {law}: {down:?}"
        );
    }
}

#[test]
fn every_aircraft_comes_to_rest_in_a_breath_of_wind() {
    for airframe in AIRCRAFT {
        for towards_deg in [0.0, 40.0, 85.0, 130.0, 310.0] {
            let wind = [("plant.wind.speed_m_s", 1.0), ("plant.wind.towards_deg", towards_deg)];
            let mut options = SetupOptions::default();
            let _ = options.aircraft(airframe);
            for (key, value) in wind {
                let _ = options.set(key, value);
            }
            let named = Named::given("field", scenarios::FIELD.to_owned());
            let setup = options.builder().unwrap().setup(&named, &[]).unwrap();
            assert!(Flight::new(&setup).is_ok(), "{airframe}, {towards_deg}");
        }
    }
}

/// An aircraft from its file, with the model that is found for it.
struct OwnAircraft {
    folder: tempfile::TempDir,
    made: New,
}

impl OwnAircraft {
    fn of(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let made = New::make(Airframe::from_toml("own.toml", text).unwrap(), &[]).unwrap();
        std::fs::write(folder.path().join("own.toml"), text).unwrap();
        std::fs::write(folder.path().join("model.toml"), &made.text).unwrap();
        Self { folder, made }
    }

    fn options(&self) -> SetupOptions {
        let [airframe, model] =
            ["own.toml", "model.toml"].map(|name| Some(self.folder.path().join(name)));
        let aircraft = AircraftArgs { airframe, model, ..AircraftArgs::default() };
        SetupOptions { aircraft, ..SetupOptions::default() }
    }
}

/// The Aerosonde on wheels, without a rudder: a servo of its own steers the nose wheel.
fn trike() -> String {
    let (head, rest) =
        aircraft::AEROSONDE_AIRFRAME.split_once("[[effector]]\nname = \"rudder\"").unwrap();
    let (_, engine) = rest.split_once("[[effector]]").unwrap();
    let (engine, rest) = engine.split_once("[[gear.contact]]").unwrap();
    let (_, tips) = rest.split_once("[[gear.contact]]\nname = \"left wing tip\"").unwrap();
    let servo = "[[effector]]\nname = \"steering\"\nkind = \"wheel\"\nside = \"centre\"\ninstance = 5\ngains = { yaw = 1.0 }\n\
                 lag_s = 0.05\nrate_limit_deg_s = 400.0\ntravel_deg = [-25.0, 25.0]\n\n";
    let wheel = |name: &str, x: f64, y: f64, more: &str| {
        format!(
            "[[gear.contact]]\nname = \"{name}\"\nat_m = [{x:?}, {y:?}, 0.3]\nspring_n_m = 7_000.0\ndamper_n_s_m = 110.0\n\
             load_max_n = 1_500.0\ngrip_spring_n_m = 7_000.0\nfriction = 0.7\nrolling_friction = 0.03\n{more}\n\n"
        )
    };
    let wheels = wheel("front", 0.45, 0.0, "steering = { effector = \"steering\", ratio = -0.8 }")
        + &wheel("left", -0.12, -0.35, "brake_friction = 0.3")
        + &wheel("right", -0.12, 0.35, "brake_friction = 0.3");
    let text = format!(
        "{head}{servo}[[effector]]{engine}{wheels}[[gear.contact]]\nname = \"left wing tip\"{tips}"
    );
    let catapult = text.lines().find(|line| line.starts_with("catapult")).unwrap();
    text.replace(catapult, "").replace("name = \"aerosonde\"", "name = \"trike\"")
}

#[test]
fn an_own_aircraft_with_a_steered_wheel_stands_in_wind_from_everywhere_and_lands_across_it() {
    let own = OwnAircraft::of(&trike());
    assert_eq!(own.made.weak, [""; 0], "{}", own.made.report);
    let options = |speed_m_s: f64, towards_deg: f64| {
        let mut options = own.options();
        let _ = options.set("plant.wind.speed_m_s", speed_m_s);
        let _ = options.set("plant.wind.towards_deg", towards_deg);
        options
    };
    let start = |speed_m_s: f64, towards_deg: f64| {
        let named = Named::given("field", scenarios::FIELD.to_owned());
        let setup = options(speed_m_s, towards_deg).builder().unwrap().setup(&named, &[]).unwrap();
        Flight::new(&setup).map(|_| ()).map_err(|problem| problem.to_string())
    };
    for twelfth in 0..12 {
        for speed_m_s in [0.5, 5.0, 10.0] {
            assert_eq!(
                start(speed_m_s, 40.0 + 30.0 * f64::from(twelfth - 6)),
                Ok(()),
                "{speed_m_s} m/s"
            );
        }
    }
    let blown_over = start(25.0, 310.0).unwrap_err();
    assert!(
        blown_over.contains("falls over") && blown_over.contains("bank_max_deg is 30"),
        "{blown_over}"
    );
    let flown = Circuit::of(&options(5.0, 310.0), CIRCUIT);
    assert_eq!(flown.crash, None);
    let down = flown.touchdown.expect("a touchdown");
    assert!(down.across_m.abs() < 3.0, "{down:?}");
    assert!(flown.time_of(VehicleEvent::Armed(false)).is_some(), "{:?}", flown.events);
}

/// The flying wing of R. W. Beard and T. W. McLain, "Small Unmanned Aircraft", Princeton 2012, table E.1, with gear and engine of the
/// Skywalker X8. Its yawing moment by sideslip and by aileron both turn the nose out of the wind, and it has no rudder.
const WING: &str = "
    mass_kg = 1.56, ixx_kg_m2 = 0.1147, iyy_kg_m2 = 0.0576, izz_kg_m2 = 0.1712, ixz_kg_m2 = 0.0015, area_m2 = 0.2589, span_m = 1.4224,
    chord_m = 0.3302, alpha_linear_deg = 15.0, alpha_max_deg = 27.0, c_lift_zero = 0.09167, c_lift_alpha = 3.5016, c_lift_q = 2.8932,
    c_drag_zero = 0.01631, c_drag_alpha = 0.2108, c_drag_lift = 0.0, c_drag_induced = 0.0, c_drag_beta = 0.0, c_side_beta = -0.07359,
    c_side_p = 0.0, c_side_r = 0.0, c_roll_beta = -0.02854, c_roll_p = -0.3209, c_roll_r = 0.03066, c_pitch_zero = -0.02338,
    c_pitch_alpha = -0.5675, c_pitch_q = -1.399, c_yaw_beta = -0.0004, c_yaw_p = -0.01297, c_yaw_r = -0.00434, c_lift = 0.1362,
    c_drag = 0.0, c_side = 0.0, c_pitch = -0.1627, yaw_per_roll = -0.0195, airspeed_m_s = 16.0, angle_of_attack_deg = 27.0,
    spring_n_m = 600.0, grip_spring_n_m = 600.0, damper_n_s_m = 6.0";

fn wing() -> String {
    let values: Vec<_> = WING.split(',').filter_map(|entry| entry.split_once('=')).collect();
    let of_wing = |line: &str| {
        let (key, value) = line.split_once('=')?;
        match key.trim() {
            // Left and right have opposite signs.
            "c_roll" => {
                Some(format!("c_roll = {}0.0841", if value.contains('-') { "-" } else { "" }))
            }
            key => values
                .iter()
                .find(|(known, _)| known.trim() == key)
                .map(|(_, value)| format!("{key} ={value}")),
        }
    };
    let (_, text) = aircraft::AIRFRAMES.iter().find(|(name, _)| *name == "skywalker_x8").unwrap();
    let text = text.replace("name = \"skywalker_x8\"", "name = \"wing\"");
    text.lines().map(|line| of_wing(line).unwrap_or_else(|| line.to_owned()) + "\n").collect()
}

#[test]
fn a_wing_that_no_aileron_holds_in_a_turn_lands_with_the_law_that_its_model_names() {
    let own = OwnAircraft::of(&wing());
    let says = |what: &str| own.made.weak.iter().any(|line| line.contains(what));
    assert!(
        says("pid does not keep it: it flies with lqr") && says("out of the wind"),
        "{}",
        own.made.report
    );
    for seed in [1, 2] {
        let mut options = own.options();
        let _ = options.set("plant.seed", seed);
        let flown = Circuit::of(&options, CIRCUIT);
        let down = flown.touchdown.unwrap_or_else(|| panic!("{:?}", flown.crash));
        assert!(down.sink_m_s < 1.5 && down.across_m.abs() < 30.0, "{down:?}");
    }
}

#[test]
fn little_fuel_leads_home_and_the_rest_is_enough_to_get_there() {
    let fuel = [
        ("airframe.fuel.initial_kg", 2_000.0),
        ("airframe.fuel.flow_kg_n_s", 1.0e-4),
        ("COM_LOW_BAT_ACT", 3.0),
        ("BAT_CRIT_THR", 0.4),
    ];
    let flown = Circuit::fly("tvc_jet", "at 20 s: arm\nmode takeoff\n", &fuel);
    let low_s = flown.time_of(begins(Failsafe::Fuel(FuelLevel::Critical)));
    assert!(low_s.is_some(), "{:?}", flown.events);
    assert_eq!(flown.time_of(VehicleEvent::Mode(Mode::Return)), low_s);
    assert_eq!(flown.time_of(begins(Failsafe::EngineFailed)), None);
    let down = flown.touchdown.unwrap_or_else(|| panic!("{:?}", flown.crash));
    assert!(down.across_m.abs() < 10.0, "{down:?}");
}
