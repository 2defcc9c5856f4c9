//! A mission flown in one process and drawn: `sitl study mission`.

use autopilot::command::VehicleCommand;
use core::ops::ControlFlow;
use host_io::print_line;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use autopilot::command::Command;
use autopilot::event::{Event, EventKind};
use autopilot::event_text;
use autopilot::mavlink::mission::file::PlanFile;
use autopilot::parameters::Parameters;
use autopilot::run::LawArgs;
use autopilot::vehicle::geodesy::{Horizon, Site};
use autopilot::vehicle::plan::{self, Action, Circle, Item, Plan};
use autopilot::vehicle::rules::Rules;
use autopilot::vehicle::{Airspeed, Mode, Place, VehicleEvent};
use flight_control::guidance::Horizontal;
use host_io::folder::OutFolder;
use icd::SimTime;
use plant_sim::geodesy::Geodetic;
use plant_sim::ground::{GroundSetup, GroundStart};
use plant_sim::io::{StartPlace, parse_earth, whole};
use plant_sim::{Airframe, ContactFailure, EarthModel, Start};

use host_io::problem::{At as _, Problem, problem};
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, TURBULENCE_MAX_M_S, up_to};
use lab_judges::closed_loop::{FlightSetup, Tick, TimedCommand, watch_with_commands};
use lab_report::chart::axis::range;
use lab_report::chart::curve::{Point, thin};
use lab_report::chart::panel::{Curve, Mark, Panel, Shape, Symbol};
use lab_report::chart::{Figure, Ink, Pattern, sheet, write_figure};

/// Direction that the wind of the demonstration blows to, rad: to the east-north-east.
const WIND_TOWARDS_RAD: f64 = 1.2;
/// Fastest steady wind that an option takes, m/s.
const WIND_MAX_M_S: f64 = 60.0;
/// The plan is handed over and begun at this time, s.
const BEGIN_S: f64 = 5.0;
/// A point of the track is kept this often, control periods.
const TRACK_EVERY: u64 = 250;
/// The flight goes on for this long on the circle after the plan, s.
const AFTER_S: f64 = 200.0;
/// The longest flight, s.
const DURATION_S: f64 = 7_200.0;

/// What the mission takes from an option, whatever a scenario has.
const OPTIONS: [(&str, &str); 5] = [
    ("plant.seed", "--seed"),
    ("plant.earth", "--earth"),
    ("plant.wind.speed_m_s", "--wind-m-s"),
    ("plant.wind.towards_deg", "--wind-m-s"),
    ("plant.wind.turbulence_m_s", "--turbulence-m-s"),
];

/// Options of `sitl study mission`.
#[derive(Debug, Clone, clap::Args)]
pub struct MissionOptions {
    /// Folder for the figure
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Aircraft and settings.
    #[command(flatten)]
    pub aircraft: AircraftArgs,
    /// Main controller, estimator of the compensator, gains.
    #[command(flatten)]
    pub laws: LawArgs,
    /// flat, wgs84, round or round_non_rotating
    #[arg(long, value_name = "MODEL", default_value = "wgs84", value_parser = parse_earth)]
    pub earth: EarthModel,
    /// Steady wind, m/s, to the east-north-east
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 0.0, value_parser = up_to(WIND_MAX_M_S, "m/s"))]
    pub wind_m_s: f64,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 0.0, value_parser = up_to(TURBULENCE_MAX_M_S, "m/s"))]
    pub turbulence_m_s: f64,
    /// Plan to fly instead of the demonstration: a .plan of QGroundControl or a text of waypoints (QGC WPL 110). The flight begins at
    /// its home: on the ground if the plan begins with a takeoff, else at the altitude of its first item
    #[arg(long, value_name = "FILE")]
    pub plan: Option<PathBuf>,
    /// Begin the landing of the plan at this time, s: it leaves an endless jump
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = up_to(DURATION_S, "s"))]
    pub land_at_s: Option<f64>,
    /// Seed of all random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
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
    /// Events of the plan, with their times, s.
    pub events: Vec<(f64, EventKind)>,
    /// If the flight has ended on the ground.
    pub touchdown: Option<Landed>,
    /// Which limit of the gear has ended it.
    pub crash: Option<ContactFailure>,
}

/// A landing: the touchdown of the wheels, or without a ground the last control period above altitude zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landed {
    /// Simulation time, s.
    pub t_s: f64,
    /// Where the autopilot takes itself to be.
    pub place: Place,
    /// Rate of descent, m/s: over a ground the true one, else the measured one.
    pub sink_m_s: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Roll angle, rad.
    pub roll_rad: f64,
}

impl Landed {
    fn of(tick: &Tick<'_>) -> Self {
        let (truth, motion) = (tick.plant.truth(), tick.snapshot.motion());
        Self {
            t_s: tick.exchange.time.as_seconds(),
            place: Place::of(motion),
            sink_m_s: -motion.climb_rate_m_s(),
            airspeed_m_s: truth.airspeed_m_s,
            roll_rad: truth.euler().phi,
        }
    }

    /// The landing of a plan whose point is the nearest, and the distance from it, m.
    pub fn landing(&self, plan: &Plan) -> Option<(u16, f64)> {
        let here = Horizon::at(self.place);
        let lands = |(number, item): (u16, &Item)| match item.action {
            Action::Land { place, .. } => Some((number, here.offset(&Site::at(place)).norm())),
            _ => None,
        };
        (0..).zip(&plan.items).filter_map(lands).min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// A plan with all that a plan can have, around the start of a setup: two legs that climb, a turn on a slow circle, a
/// rectangle flown twice, a descent on a circle to the left, and the return. Its lengths are in units of the
/// aircraft's circles (`NAV_LOITER_RAD`).
pub fn demo(setup: &FlightSetup) -> Plan {
    let radius_m = setup.parameters.navigation.loiter_radius_m;
    let Start { altitude_m: start_m, airspeed_m_s, .. } = setup.plant.start;
    let horizon = Horizon::at(start(setup));
    let point = |north: f64, east: f64, up: f64| plan::Point {
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
        Action::ChangeSpeed { airspeed: Airspeed::True(airspeed_m_s * 10.0 / 11.0) },
        Action::LoiterTurns { circle: circle(0.0, 7.0, 0.1, true), turns: 1.0 },
        Action::ChangeSpeed { airspeed: Airspeed::True(airspeed_m_s) },
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
pub fn setup(options: &MissionOptions) -> Result<FlightSetup, Problem> {
    let aircraft = &options.aircraft;
    aircraft.check_beside(OPTIONS)?;
    let (aircraft, laws) = (aircraft.clone(), options.laws.clone());
    let mut setup = SetupOptions { aircraft, laws, ..SetupOptions::default() }.setup("nominal")?;
    let plant = &mut setup.plant;
    plant.earth = options.earth;
    plant.wind.speed_m_s = options.wind_m_s;
    plant.wind.towards_rad = WIND_TOWARDS_RAD;
    plant.wind.turbulence_m_s = options.turbulence_m_s;
    plant.seed = options.seed;
    setup.duration = SimTime::from_seconds(DURATION_S).unwrap_or(SimTime::ZERO);
    Ok(setup)
}

/// Where a setup starts.
pub fn start(setup: &FlightSetup) -> Place {
    let start = &setup.plant.start;
    Place { latitude_rad: start.latitude_rad, longitude_rad: start.longitude_rad }
}

/// The commands that begin a plan; an aircraft in the air is armed already.
pub fn begin(plan: &Arc<Plan>) -> Vec<TimedCommand> {
    let at = SimTime::from_seconds(BEGIN_S).unwrap_or(SimTime::ZERO);
    let commands = [
        Command::Vehicle(VehicleCommand::Plan(Arc::clone(plan))),
        Command::Vehicle(VehicleCommand::Arm(true)),
        Command::Vehicle(VehicleCommand::Mode(Mode::Mission)),
    ];
    commands.map(|command| TimedCommand { at, command }).into()
}

/// Flies commands until some time after the plan is complete, and keeps the track.
pub fn fly(setup: &FlightSetup, commands: &[TimedCommand]) -> Result<Flown, Problem> {
    let mut flown = Flown::default();
    let (mut over_s, mut last, mut down) = (f64::INFINITY, None, None);
    let mut returns = false;
    let is = |event: &Event, what: VehicleEvent| event.kind == EventKind::Vehicle(what);
    let flight = watch_with_commands(setup, commands, |tick| {
        let t_s = tick.exchange.time.as_seconds();
        flown.events.extend(tick.events.iter().map(|event| (t_s, event.kind)));
        if tick.events.iter().any(|event| is(event, VehicleEvent::PlanComplete)) {
            over_s = t_s + AFTER_S;
        }
        // A return over a ground goes on to the landing.
        let returned = returns;
        returns = tick.snapshot.mode == Mode::Return && tick.log.state.over_ground;
        if returns {
            over_s = f64::INFINITY;
        } else if returned && tick.snapshot.mode != Mode::Mission {
            over_s = t_s + AFTER_S;
        }
        if let (None, Some(touchdown)) = (&down, tick.plant.touchdown()) {
            let sink_m_s = touchdown.sink_m_s;
            down = Some(Landed { sink_m_s, ..Landed::of(tick) });
        }
        // It has stopped, too.
        if tick.events.iter().any(|event| is(event, VehicleEvent::Armed(false))) {
            over_s = t_s;
        }
        if tick.exchange.step.is_multiple_of(TRACK_EVERY) {
            flown.track.push(TrackPoint::of(tick));
        }
        last = Some(Landed::of(tick));
        if t_s < over_s { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })?;
    flown.crash = flight.plant().crash();
    flown.touchdown = down.or_else(|| last.filter(|_| flight.end().on_ground));
    Ok(flown)
}

impl TrackPoint {
    fn of(tick: &Tick<'_>) -> Self {
        let (truth, snapshot) = (tick.plant.truth(), tick.snapshot);
        let navigation = &snapshot.navigation;
        // On the ground the reference is one for later.
        let reference_m = match snapshot.motion().on_wheels {
            true => truth.altitude_m,
            false => snapshot.demand.altitude_m,
        };
        Self {
            t_s: snapshot.time.as_seconds(),
            place: Place::of(snapshot.motion()),
            altitude_m: [truth.altitude_m, reference_m],
            airspeed_m_s: [truth.airspeed_m_s, snapshot.demand.airspeed_m_s],
            roll_rad: [snapshot.motion().attitude.phi, snapshot.demand.roll_rad],
            mode: snapshot.mode,
            item: navigation.item,
            cross_track_m: navigation.cross_track_m,
            radius_m: navigation.target.and_then(|target| target.radius_m),
        }
    }

    /// Where it is in the axes of a place, km north and east.
    pub fn offset_km(&self, horizon: &Horizon) -> (f64, f64) {
        let offset = horizon.offset(&Site::at(self.place)) / 1.0e3;
        (offset.x, offset.y)
    }
}

/// Elevations that a runway may have, m.
const ELEVATIONS_M: [f64; 2] = [-450.0, 9_000.0];
/// Largest file of a plan, bytes.
const FILE_MAX: u64 = 4 << 20;

/// A runway as long as any aircraft needs.
const FIELD: GroundSetup = GroundSetup {
    threshold: Geodetic { latitude_rad: 0.0, longitude_rad: 0.0, altitude_m: 0.0 },
    heading_rad: 0.0,
    length_m: 5_000.0,
    slope: 0.0,
    friction: 1.0,
    start: GroundStart::Ready { along_m: 0.0 },
};

/// The plan of a file, and where a flight of it begins: at its home with the first leg ahead, on the ground if the plan begins with a
/// takeoff, else over it.
#[derive(Debug)]
pub struct PlanStart {
    pub file: PlanFile,
    pub plan: Plan,
    /// What of it is flown in another way than it says.
    pub notes: Vec<String>,
    /// The plan begins with a takeoff, and the aircraft has gear.
    pub from_ground: bool,
    pub home: StartPlace,
}

impl PlanStart {
    /// Of an aircraft with these parameters that starts so in the air.
    pub fn read(
        path: &Path,
        parameters: &Parameters,
        airframe: &Airframe,
        start: &Start,
    ) -> Result<Self, Problem> {
        let name = path.display();
        let text = host_io::file::read_text(path, FILE_MAX).at(&name)?;
        let file = PlanFile::read(&text).map_err(|why| problem!("{name}: {why}"))?;
        let fence_problems = file.fence().err().unwrap_or_default();
        let rules = Rules::new(parameters.limits, parameters.navigation, &parameters.gains);
        let refused = |mut all: Vec<String>| {
            all.extend(fence_problems.iter().cloned());
            problem!("{name}: {}", all.join("; "))
        };
        let airspeed = Some(Airspeed::True(start.airspeed_m_s));
        let (mut plan, mut notes) = file.plan(&rules, airspeed).map_err(refused)?;
        // Behind its home, which a text has as an item, and what is done at once.
        let is_flown =
            |action: &Action| !action.is_immediate() && !matches!(action, Action::Jump { .. });
        let first = plan.items.iter().find(|item| is_flown(&item.action));
        let lifts_off = first.is_some_and(|item| matches!(item.action, Action::Takeoff { .. }));
        let elevation_m = file.home().map(|(_, m)| m).filter(|m| m.is_finite()).unwrap_or(0.0);
        let elevation_m = elevation_m.clamp(ELEVATIONS_M[0], ELEVATIONS_M[1]);
        let from_ground = lifts_off && airframe.gear.is_some();
        if from_ground {
            (plan, notes) = file.plan(&rules.over(elevation_m), airspeed).map_err(refused)?;
        }
        if plan.items.is_empty() {
            return Err(refused(vec!["the mission has no items to fly".to_owned()]));
        }
        let mut places = plan.items.iter().filter_map(|item| item.action.place());
        let home = file.home().map(|(place, _)| place).or_else(|| places.next());
        let Some(home) = home else { return Err(problem!("{name}: no item has a place")) };
        let mut ways = places.map(|place| Horizon::at(home).offset(&Site::at(place)));
        let ahead = ways.find(|way| way.norm() > 1.0).unwrap_or(Horizontal::new(1.0, 0.0));
        let above_ground =
            |item: &Item| item.action.altitude_m().filter(|altitude_m| *altitude_m > 0.0);
        let altitude_m = plan.items.iter().find_map(above_ground).unwrap_or(start.altitude_m);
        let place = Geodetic {
            latitude_rad: home.latitude_rad,
            longitude_rad: home.longitude_rad,
            altitude_m: if from_ground { elevation_m } else { altitude_m },
        };
        let home = StartPlace { place, heading_rad: libm::atan2(ahead.y, ahead.x) };
        Ok(Self { file, plan, notes, from_ground, home })
    }
}

/// The plan of a file, and a flight that begins where it does.
pub fn of_file(path: &Path, setup: &mut FlightSetup) -> Result<(PlanFile, Plan), Problem> {
    let FlightSetup { plant, parameters, .. } = setup;
    let start = PlanStart::read(path, parameters, &plant.airframe, &plant.start)?;
    for note in &start.notes {
        print_line!("{note}");
    }
    plant.ground = start.from_ground.then_some(FIELD);
    start.home.place(plant);
    Ok((start.file, start.plan))
}

/// The commands that load fence and rally points of a file.
fn load(file: &PlanFile, path: &Path) -> Result<Vec<TimedCommand>, Problem> {
    let refused = |all: Vec<String>| problem!("{}: {}", path.display(), all.join("; "));
    let (fence, rally) = file.fence().map_err(refused)?;
    let commands = [VehicleCommand::Fence(Arc::new(fence)), VehicleCommand::Rally(rally.into())];
    let at = SimTime::ZERO;
    Ok(commands.map(|command| TimedCommand { at, command: Command::Vehicle(command) }).into())
}

/// Flies the demonstration, or the plan of a file, and draws it.
pub fn run(options: &MissionOptions) -> Result<(), Problem> {
    let mut setup = setup(options)?;
    let (file, plan) = match &options.plan {
        Some(path) => of_file(path, &mut setup)?,
        None => (PlanFile::default(), demo(&setup)),
    };
    let plan = Arc::new(plan);
    let folder = OutFolder::create(&options.out)?;
    let mut commands = match &options.plan {
        Some(path) => load(&file, path)?,
        None => Vec::new(),
    };
    commands.extend(begin(&plan));
    if let Some(at) = options.land_at_s.and_then(SimTime::from_seconds) {
        commands.push(TimedCommand { at, command: Command::Vehicle(VehicleCommand::Land) });
    }
    let flown = fly(&setup, &commands)?;
    let (parameters, effectors) = (&setup.parameters, &setup.plant.airframe.effectors);
    for (t_s, kind) in &flown.events {
        match kind {
            EventKind::Vehicle(VehicleEvent::ItemPassed(item)) => {
                print_line!("{t_s:.0} s: item {item} passed: {}, not on board", file.name(*item));
            }
            EventKind::Vehicle(VehicleEvent::PlanComplete) => {
                print_line!("{t_s:.0} s: the plan is complete");
            }
            EventKind::Vehicle(_) => {
                if let Some((_, text)) = event_text::of_event(kind, parameters, effectors) {
                    print_line!("{t_s:.0} s: {text}");
                }
            }
            _ => {}
        }
    }
    if let Some(touchdown) = flown.touchdown {
        print_line!("{}", described(&touchdown, &plan));
    }
    let end = flown.track.last();
    let (t_s, item) = end.map_or((0.0, 0), |point| (point.t_s, point.item));
    match (&flown.crash, flown.touchdown) {
        (Some(crash), _) => print_line!("{t_s:.0} s: the aircraft is lost: {crash}"),
        (None, None) => {
            let lands = plan.items.iter().any(|item| matches!(item.action, Action::Land { .. }));
            let hint = if lands { "; --land-at-s begins its landing" } else { "" };
            print_line!("{t_s:.0} s: still in the air, item {item}{hint}");
        }
        (None, Some(_)) => {}
    }
    let missed = missed(&plan, &flown);
    if !missed.is_empty() {
        print_line!("not flown: {missed}");
    }
    write_figure(&folder, &figure(&plan, start(&setup), &flown))?;
    print_line!("wrote {}", folder.path().display());
    Ok(())
}

/// Items with a place that were never begun: `items 3, 20 to 34`.
fn missed(plan: &Plan, flown: &Flown) -> String {
    let was_begun = |number: u16| {
        let begins = EventKind::Vehicle(VehicleEvent::PlanItem(number));
        flown.events.iter().any(|(_, kind)| *kind == begins)
    };
    let items = (0_u16..).zip(&plan.items);
    let missed = items
        .filter(|(number, item)| item.action.place().is_some() && !was_begun(*number))
        .map(|(number, _)| number);
    let mut runs: Vec<[u16; 2]> = Vec::new();
    for number in missed {
        match runs.last_mut() {
            Some([_, last]) if *last + 1 == number => *last = number,
            _ => runs.push([number, number]),
        }
    }
    let words = runs.iter().map(|[first, last]| match first == last {
        true => format!("{first}"),
        false => format!("{first} to {last}"),
    });
    let words: Vec<String> = words.collect();
    if words.is_empty() { String::new() } else { format!("items {}", words.join(", ")) }
}

fn described(touchdown: &Landed, plan: &Plan) -> String {
    let Landed { t_s, sink_m_s, airspeed_m_s, roll_rad, .. } = *touchdown;
    let at =
        touchdown.landing(plan).map(|(item, m)| format!(", {m:.0} m from that of item {item}"));
    format!(
        "{t_s:.0} s: touchdown{}, sink rate {sink_m_s:.2} m/s, airspeed {airspeed_m_s:.1} m/s, roll {:.1} deg",
        at.unwrap_or_default(),
        roll_rad.to_degrees()
    )
}

/// Height of the plan view, in the unit of the chart's width.
const MAP_HEIGHT: f64 = 620.0;
/// Points of a drawn circle.
const CIRCLE_POINTS: u32 = 120;
/// A time stands beside the track this often, s.
const CLOCK_S: f64 = 600.0;

const FIRST: Ink = Ink::new("#0050aa", Pattern::Solid).wide(2.0);
const AGAIN: Ink = Ink::new("#c86e00", Pattern::Dashed).wide(2.5);
const HOME: Ink = Ink::new("#007d37", Pattern::Dotted).wide(2.5);
const LEG: Ink = Ink::new("#969696", Pattern::Fine);
const REFERENCE: Ink = Ink::new("#c81e1e", Pattern::Dashed);
const ITEM: Ink = Ink::new("#bebebe", Pattern::Fine).wide(1.0);
/// Colour of a time beside the track.
const CLOCK: &str = "#282828";

/// The plan as drawn: points with their name, legs, circles. East and north, km.
struct Drawn {
    points: Vec<(String, Point)>,
    legs: Vec<[Point; 2]>,
    circles: Vec<(Point, f64)>,
}

/// Draws a mission that began over `start`.
pub fn figure(plan: &Plan, start: Place, flown: &Flown) -> Figure {
    let legend = [
        ("legs and circles of the plan", LEG),
        ("flown", FIRST),
        ("flown again after the jump", AGAIN),
        ("flown in Return and Hold", HOME),
        ("reference", REFERENCE),
        ("next item begins", ITEM),
    ];
    let begins = flown.events.iter().filter_map(|(t_s, kind)| match kind {
        EventKind::Vehicle(VehicleEvent::PlanItem(item)) => {
            let label = format!("item {item} begins");
            Some(Mark { x: *t_s, number: None, ink: ITEM, label })
        }
        _ => None,
    });
    let marks: Vec<Mark> = begins.collect();
    let [altitude, airspeed, roll] = panels(flown, &marks);
    let map = map(plan, start, flown);
    // A plan without a jump, or a flight without a return, has no such line.
    let is_drawn = |ink: &Ink| {
        ![AGAIN, HOME].contains(ink) || map.curves.iter().any(|curve| curve.ink == *ink)
    };
    let legend: Vec<_> = legend.into_iter().filter(|(_, ink)| is_drawn(ink)).collect();
    let panels = [map, altitude, airspeed, roll];
    Figure {
        name: "mission",
        caption: "Legs, circles and track of a mission over the ground, with altitude, airspeed and bank over time."
            .to_owned(),
        svg: sheet("A mission: the plan and how it was flown", &legend, 1, &panels),
    }
}

fn map(plan: &Plan, start: Place, flown: &Flown) -> Panel<'static> {
    let horizon = Horizon::at(start);
    let track: Vec<Point> = flown.track.iter().map(|point| east_north(point, &horizon)).collect();
    let drawn = drawn(plan, &horizon, flown);
    let title = "Plan view: numbers are the items of the plan; a turn begins before its point";
    let legs = drawn.legs.iter().map(|leg| (leg.to_vec(), LEG));
    let circles = drawn.circles.iter().map(|(centre, radius)| (ring(*centre, *radius), LEG));
    let curves = legs.chain(circles).chain(parts(flown, &track));
    let symbol = |at, colour, label| Symbol { at, shape: Shape::Dot, colour, label };
    let points = drawn.points.into_iter().map(|(label, at)| symbol(at, REFERENCE.colour, label));
    let mut symbols: Vec<Symbol> = points.collect();
    symbols.push(symbol((0.0, 0.0), REFERENCE.colour, "home".to_owned()));
    let mut clock_s = CLOCK_S;
    for (point, at) in flown.track.iter().zip(&track) {
        if point.t_s >= clock_s {
            symbols.push(symbol(*at, CLOCK, format!("{:.0} min", clock_s / 60.0)));
            clock_s += CLOCK_S;
        }
    }
    Panel {
        curves: curves.map(|(points, ink)| Curve::unnamed(points, ink)).collect(),
        symbols,
        ..Panel::map(title, MAP_HEIGHT, &track)
    }
}

fn east_north(point: &TrackPoint, horizon: &Horizon) -> Point {
    let (north, east) = point.offset_km(horizon);
    (east, north)
}

/// The plan over the ground. A leg joins the points of two items that follow each other.
fn drawn(flight: &Plan, horizon: &Horizon, flown: &Flown) -> Drawn {
    let mut drawn = Drawn { points: Vec::new(), legs: Vec::new(), circles: Vec::new() };
    let at = |place: Place| {
        let offset = horizon.offset(&Site::at(place)) / 1.0e3;
        (offset.y, offset.x)
    };
    let mut before = None;
    for (number, item) in (0_u16..).zip(&flight.items) {
        let is_leg = matches!(item.action, Action::Waypoint { .. });
        let target = match item.action {
            Action::Jump { times: Some(0), .. } => None,
            Action::Jump { to, .. } => flight.items.get(usize::from(to)).map(|item| item.action),
            action => Some(action),
        };
        let Some(place) = target.as_ref().and_then(Action::place) else { continue };
        let here = at(place);
        drawn
            .legs
            .extend(before.filter(|_| is_leg || target != Some(item.action)).map(|b| [b, here]));
        if target == Some(item.action) {
            drawn.points.push((name(number, &item.action), here));
            before = is_leg.then_some(here);
            let radius_m = flown
                .track
                .iter()
                .filter(|point| point.item == number && point.mode == Mode::Mission)
                .find_map(|point| point.radius_m);
            drawn.circles.extend(radius_m.map(|radius_m| (here, radius_m / 1.0e3)));
        }
    }
    // The plan does not have the circle at home; its radius is the one that was flown.
    let home = flown.track.last().and_then(|point| point.radius_m);
    drawn.circles.extend(home.map(|radius_m| ((0.0, 0.0), radius_m / 1.0e3)));
    drawn
}

fn ring(centre: Point, radius_km: f64) -> Vec<Point> {
    let angle = |k: u32| TAU * f64::from(k) / f64::from(CIRCLE_POINTS);
    let point = |k| {
        let (sin, cos) = libm::sincos(angle(k));
        (centre.0 + radius_km * sin, centre.1 + radius_km * cos)
    };
    (0..=CIRCLE_POINTS).map(point).collect()
}

/// The track in pieces: the first time, again after a jump back, and outside of Mission.
fn parts(flown: &Flown, track: &[Point]) -> Vec<(Vec<Point>, Ink)> {
    let mut highest = 0;
    let mut again = false;
    let mut parts: Vec<(Vec<Point>, Ink)> = Vec::new();
    for (point, at) in flown.track.iter().zip(track) {
        again = point.item < highest || (again && point.item == highest);
        highest = highest.max(point.item);
        let ink = match point.mode {
            Mode::Return | Mode::Hold => HOME,
            _ if again => AGAIN,
            _ => FIRST,
        };
        match parts.last_mut() {
            Some((points, last)) if *last == ink => points.push(*at),
            open => {
                // The piece begins where the one before it ends.
                let joint = open.and_then(|(points, _)| points.last().copied());
                parts.push((joint.into_iter().chain([*at]).collect(), ink));
            }
        }
    }
    // What is flown twice is drawn above what it covers.
    parts.sort_by_key(|(_, ink)| *ink != FIRST);
    parts
}

/// Short text of an item.
fn name(number: u16, action: &Action) -> String {
    match action {
        Action::LoiterTurns { turns, .. } => format!("{number}: {turns:.0} turn"),
        Action::LoiterTime { seconds, .. } => format!("{number}: {seconds:.0} s"),
        Action::LoiterToAltitude(circle) => match circle.centre.altitude_m {
            Some(altitude_m) => format!("{number}: to {altitude_m:.0} m"),
            None => number.to_string(),
        },
        _ => number.to_string(),
    }
}

fn panels<'a>(flown: &Flown, marks: &'a [Mark]) -> [Panel<'a>; 3] {
    let panel = |value: fn(&TrackPoint) -> [f64; 2], title: &str, y_label, span_min| {
        let end_s = flown.track.last().map_or(1.0, |point| point.t_s);
        let curve = |which: usize, ink| {
            let points = flown.track.iter().map(|point| (point.t_s, value(point)[which]));
            Curve::unnamed(thin(points, 0.0, end_s), ink)
        };
        Panel {
            title: title.to_owned(),
            y_label,
            x: (0.0, end_s),
            y: range(flown.track.iter().flat_map(value), span_min),
            curves: vec![curve(0, FIRST), curve(1, REFERENCE)],
            marks,
            ..Panel::default()
        }
    };
    [
        panel(|p| p.altitude_m, "Altitude", "altitude, m", 100.0),
        panel(|p| p.airspeed_m_s, "True airspeed", "airspeed, m/s", 20.0),
        panel(|p| p.roll_rad.map(f64::to_degrees), "Roll angle (bank)", "phi, deg", 20.0),
    ]
}
