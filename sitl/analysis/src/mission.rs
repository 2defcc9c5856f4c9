//! A mission flown in one process and drawn: `sitl mission`.

use autopilot::command::VehicleCommand;
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use autopilot::command::Command;
use autopilot::event::EventKind;
use autopilot::vehicle::plan::{Action, Circle, Item, Plan, Point};
use autopilot::vehicle::{Mode, Place};
use autopilot::vehicle::{
    VehicleEvent,
    geodesy::{Horizon, Site},
};
use flight_control::guidance::Horizontal;
use host_io::file;
use icd::{ControlPeriod, SimTime};
use plant_sim::setup::default_step_us;
use plant_sim::{EarthModel, SetupError, Start, scenario};

use crate::closed_loop::{FlightSetup, Moment, Spoken, fly_while};
use crate::configuration::{AircraftArgs, Named};

mod picture;

/// Direction that the wind of the demonstration blows to, rad: to the east-north-east.
const WIND_TOWARDS_RAD: f64 = 1.2;
/// The plan is handed over and begun at this time, s.
const BEGIN_S: f64 = 5.0;
/// A point of the track is kept this often, control periods.
const TRACK_EVERY: u64 = 250;
/// The flight goes on for this long on the circle after the plan, s.
const AFTER_S: f64 = 200.0;
/// The longest flight, s.
const DURATION_S: f64 = 7_200.0;

/// What the mission takes from an option, whatever a scenario says.
const OPTIONS: [(&str, &str); 5] = [
    ("plant.seed", "--seed"),
    ("plant.earth", "--earth"),
    ("plant.wind.speed_m_s", "--wind-m-s"),
    ("plant.wind.towards_deg", "--wind-m-s"),
    ("plant.wind.turbulence_m_s", "--turbulence-m-s"),
];

/// What a mission is flown with.
#[derive(Debug, Clone)]
pub struct MissionOptions {
    /// Which Earth.
    pub earth: EarthModel,
    /// Steady wind, m/s.
    pub wind_m_s: f64,
    /// Turbulence, m/s rms.
    pub turbulence_m_s: f64,
    /// Seed of the random streams.
    pub seed: u64,
    /// Folder for the figure.
    pub out: PathBuf,
    /// Which aircraft, and what is changed.
    pub aircraft: AircraftArgs,
}

/// One point of a flown track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// Simulation time, s.
    pub t_s: f64,
    /// Where.
    pub place: Place,
    /// Altitude and its reference, m.
    pub altitude_m: [f64; 2],
    /// True airspeed and its reference, m/s.
    pub airspeed_m_s: [f64; 2],
    /// Roll angle and its reference, rad.
    pub roll_rad: [f64; 2],
    /// Mode.
    pub mode: Mode,
    /// Current item.
    pub item: u16,
    /// Distance from the path, m.
    pub cross_track_m: f64,
    /// Radius of the circle that is flown or flown to, m.
    pub radius_m: Option<f64>,
}

/// A flown mission.
#[derive(Debug, Clone, Default)]
pub struct Flown {
    /// The track.
    pub track: Vec<TrackPoint>,
    /// What has happened to the plan, and when (s).
    pub events: Vec<(f64, EventKind)>,
}

/// A plan with all that a plan can have, around the start of a setup: two legs that climb, a turn on a slow circle, a
/// rectangle flown twice, a descent on a circle to the left, and the return. Its lengths are in units of the
/// aircraft's circles (`NAV_LOITER_RAD`).
#[must_use]
pub fn demo(setup: &FlightSetup) -> Plan {
    let radius_m = setup.parameters.navigation.loiter_radius_m;
    let Start { altitude_m: start_m, airspeed_m_s, .. } = setup.plant.start;
    let horizon = Horizon::at(start(setup));
    let point = |north: f64, east: f64, up: f64| Point {
        place: Some(horizon.place_at(&Horizontal::new(north * radius_m, east * radius_m))),
        altitude_m: Some(start_m + up * radius_m),
    };
    let waypoint =
        |north, east, up| Action::Waypoint { point: point(north, east, up), acceptance_m: None };
    let circle = |north, east, up, clockwise| Circle {
        centre: point(north, east, up),
        radius_m: Some(radius_m),
        clockwise,
    };
    let actions = vec![
        waypoint(3.0, 0.0, 0.05),
        waypoint(3.0, 4.0, 0.15),
        Action::ChangeSpeed { airspeed_m_s: airspeed_m_s * 10.0 / 11.0 },
        Action::LoiterTurns { circle: circle(0.0, 7.0, 0.1, true), turns: 1.0 },
        Action::ChangeSpeed { airspeed_m_s },
        waypoint(-4.5, 5.0, 0.0),
        waypoint(-4.5, 0.0, 0.0),
        waypoint(-1.0, 0.0, 0.05),
        waypoint(-1.0, 5.0, 0.05),
        Action::Jump { to: 5, times: Some(1) },
        Action::LoiterToAltitude(circle(1.0, 1.5, -0.1, false)),
        Action::Return,
    ];
    let items = actions.into_iter().map(|action| Item { action, autocontinue: true }).collect();
    Plan { id: 1, items }
}

/// An aircraft in level flight, with a wind.
///
/// # Errors
/// What is wrong with a file or a value.
pub fn setup(options: &MissionOptions) -> Result<FlightSetup, Box<dyn Error>> {
    let aircraft = &options.aircraft;
    aircraft.check_beside(&OPTIONS)?;
    let airframe = aircraft.airframe()?;
    let file = Named::shipped("nominal.toml", scenario::NOMINAL);
    let nominal = aircraft.scenario(&file, &airframe.effectors)?;
    let period = ControlPeriod::DEFAULT;
    let mut plant = nominal.plant.setup(airframe, 0, period, default_step_us(period));
    plant.earth = options.earth;
    plant.wind.speed_m_s = options.wind_m_s;
    plant.wind.towards_rad = WIND_TOWARDS_RAD;
    plant.wind.turbulence_m_s = options.turbulence_m_s;
    plant.seed = options.seed;
    let model = aircraft.model()?;
    Ok(FlightSetup {
        plant,
        model: model.aircraft,
        parameters: aircraft.parameters(model.defaults)?,
        references: nominal.references,
        script: nominal.script.map(Arc::new),
        duration: SimTime::from_seconds(DURATION_S).unwrap_or(SimTime::ZERO),
    })
}

/// Where a setup starts.
#[must_use]
pub fn start(setup: &FlightSetup) -> Place {
    let start = &setup.plant.start;
    Place { latitude_rad: start.latitude_rad, longitude_rad: start.longitude_rad }
}

/// The commands that begin a plan.
#[must_use]
pub fn begin(plan: &Arc<Plan>) -> Vec<Spoken> {
    let at = SimTime::from_seconds(BEGIN_S).unwrap_or(SimTime::ZERO);
    let commands = [
        Command::Vehicle(VehicleCommand::Plan(Arc::clone(plan))),
        Command::Vehicle(VehicleCommand::Mode(Mode::Mission)),
    ];
    commands.map(|command| Spoken { at, command }).into()
}

/// Flies commands until some time after the plan is complete, and keeps the track.
///
/// # Errors
/// [`SetupError`] if the plant cannot start.
pub fn fly(setup: &FlightSetup, spoken: &[Spoken]) -> Result<Flown, SetupError> {
    let mut flown = Flown::default();
    let mut tick = 0;
    let mut over_s = f64::INFINITY;
    let mut sink = |moment: &Moment| {
        let t_s = moment.snapshot.time.as_seconds();
        flown.events.extend(moment.events.iter().map(|event| (t_s, event.kind)));
        if moment
            .events
            .iter()
            .any(|event| event.kind == EventKind::Vehicle(VehicleEvent::PlanComplete))
        {
            over_s = t_s + AFTER_S;
        }
        if tick % TRACK_EVERY == 0 {
            flown.track.push(TrackPoint::of(moment));
        }
        tick += 1;
        t_s < over_s
    };
    fly_while(setup, spoken, &mut sink)?;
    Ok(flown)
}

impl TrackPoint {
    fn of(moment: &Moment) -> Self {
        let Moment { truth, snapshot, .. } = moment;
        let navigation = &snapshot.navigation;
        Self {
            t_s: snapshot.time.as_seconds(),
            place: Place::of(snapshot.motion()),
            altitude_m: [truth.altitude_m, snapshot.demand.altitude_m],
            airspeed_m_s: [truth.airspeed_m_s, snapshot.demand.airspeed_m_s],
            roll_rad: [snapshot.motion().attitude.phi, snapshot.demand.roll_rad],
            mode: snapshot.mode,
            item: navigation.item,
            cross_track_m: navigation.cross_track_m,
            radius_m: navigation.target.and_then(|target| target.radius_m),
        }
    }

    /// Where it is in the axes of a place, km north and east.
    #[must_use]
    pub fn offset_km(&self, horizon: &Horizon) -> (f64, f64) {
        let offset = horizon.offset(&Site::at(self.place)) / 1.0e3;
        (offset.x, offset.y)
    }
}

/// Flies the demonstration and draws it.
///
/// # Errors
/// What keeps it from being flown or drawn, in words for the operator.
pub fn run(options: &MissionOptions) -> Result<(), Box<dyn Error>> {
    let setup = setup(options)?;
    let plan = Arc::new(demo(&setup));
    let flown = fly(&setup, &begin(&plan))?;
    let figure = picture::figure(&plan, start(&setup), &flown);
    fs::create_dir_all(&options.out)?;
    for (name, bytes) in figure.files()? {
        let path = options.out.join(name);
        file::write(&path, &bytes, file::beginning(&bytes))
            .map_err(|problem| format!("{}: {problem}", path.display()))?;
        println!("wrote {}", path.display());
    }
    Ok(())
}
