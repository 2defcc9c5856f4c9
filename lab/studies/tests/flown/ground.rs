//! Flights that begin on a ground, with the autopilot as in any other.

use autopilot::event::EventKind;
use autopilot::script::{LineRefusal, ScriptEvent};
use autopilot::vehicle::{VehicleEvent, VehicleRefusal};
use host_io::problem::Problem;
use lab_engine::Flight;
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, Named};
use lab_judges::flown::{self, Keep};
use lab_judges::outcome::Outcome;
use plant_sim::touchdown::Touchdown;

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
    assert!(outcome.is_kept() && (outcome.end_s - 60.0).abs() < 1.0e-9, "{outcome:?}");
    let low = launch.replace("height_m = 1.8", "height_m = 0.0");
    let refused = fly("aerosonde", &low, 100.0, 25.0).unwrap_err().to_string();
    assert!(refused.contains("height_m = 0 puts the"), "{refused}");
}

#[test]
fn a_launch_that_does_not_fly_ends_with_the_crash() {
    // Nose down and far below the stall.
    let launch = "start = \"launched\"\nheight_m = 30.0\nspeed_m_s = 5.0\npitch_deg = -45.0";
    let outcome = fly("aerosonde", launch, 100.0, 25.0).unwrap();
    assert!(!outcome.is_kept() && outcome.end_s < 10.0, "{outcome:?}");
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

    fn time_of(&self, event: VehicleEvent) -> Option<f64> {
        let is_it = |kind: &EventKind| *kind == EventKind::Vehicle(event);
        self.events.iter().find(|(_, kind)| is_it(kind)).map(|(time_s, _)| *time_s)
    }
}

const CIRCUIT: &str = "at 20 s: arm\nafter 1 s: mode takeoff\nafter 80 s: land\n";

#[test]
fn every_aircraft_takes_off_and_lands_where_it_began_without_an_alarm() {
    for airframe in
        ["tvc_jet", "tvc_jet_mach", "f16", "aerosonde", "aerosonde_vtail", "skywalker_x8"]
    {
        let wind = [("plant.wind.speed_m_s", 4.0), ("plant.wind.towards_deg", 250.0)];
        let flown = Circuit::fly(airframe, CIRCUIT, &wind);
        assert_eq!(flown.crash, None, "{airframe}");
        let times = [VehicleEvent::LiftOff, VehicleEvent::TouchDown, VehicleEvent::Armed(false)];
        let [lift_off_s, touchdown_s, _] = times
            .map(|event| flown.time_of(event).unwrap_or_else(|| panic!("{airframe}: {event:?}")));
        let near = |time_s: f64| {
            let since = |event_s| (0.0..10.0).contains(&(time_s - event_s));
            since(lift_off_s) || since(touchdown_s)
        };
        let alarms = flown.events.iter().filter(|(time_s, kind)| {
            matches!(kind, EventKind::CompensatorActive { .. }) && near(*time_s)
        });
        assert_eq!(alarms.count(), 0, "{airframe}: {:?}", flown.events);
        let down = flown.touchdown.unwrap();
        // Measured 0.4 to 1.9 m/s; the start is 100 m from the threshold.
        assert!(down.sink_m_s < 2.4, "{airframe}: {down:?}");
        assert!((100.0..1_300.0).contains(&down.along_m), "{airframe}: {down:?}");
        assert!(down.across_m.abs() < 6.0 && down.roll_rad.abs() < 0.1, "{airframe}: {down:?}");
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
