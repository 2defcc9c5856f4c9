//! The plant as an FMU: commands, wind and faults in; truth and sensors out.

use std::ops::Range;
use std::sync::Arc;

use autopilot::recorder::command_names;
use autopilot::script::Trigger;
use host_io::problem::{At as _, Problem, problem};
use icd::fault::{FaultReply, Onset, TargetClass};
use icd::record::{effector_field, truth_fields};
use icd::{Actuators, FaultRequest, Ned, PerEffector, SimTime};
use lab_engine::fault_words;
use plant_sim::start::Start;
use plant_sim::{Plant, PlantSetup, ScheduledFault, wind};

use crate::variables::{Causality, FmuValue, SensorPlaces, VariableList};

/// One aircraft in its air. It begins when the initialization ends.
#[derive(Debug, Clone)]
pub struct PlantSide {
    setup: Arc<PlantSetup>,
    places: Arc<PlantPlaces>,
    plant: Option<Box<Plant>>,
    /// Text of the input `fault` that was carried out.
    obeyed: String,
    /// Steady wind that blows now, m/s.
    wind: [f64; 3],
}

#[derive(Debug)]
struct PlantPlaces {
    seed: usize,
    start: Range<usize>,
    positions: Range<usize>,
    commands: Range<usize>,
    brakes: Range<usize>,
    wind: Range<usize>,
    fault: usize,
    truth: Range<usize>,
    sensors: SensorPlaces,
}

impl PlantSide {
    pub fn new(setup: PlantSetup) -> Result<(Self, VariableList), Problem> {
        let effectors = setup.airframe.effectors;
        let trim = Plant::new(&setup)?.trim().positions();
        let wind: [f64; 3] = wind::steady(&setup.wind).0.into();
        let mut list = VariableList::of_time();
        let numbers = |names: Vec<String>, values: &[f64]| {
            names.into_iter().zip(values.iter().copied().map(FmuValue::Number)).collect::<Vec<_>>()
        };
        let seed = [("seed".to_owned(), FmuValue::Count(setup.seed))];
        let about = "seed of all random streams";
        let seed = list.add(Causality::Parameter, false, about, seed).start;
        let start = numbers(START.map(str::to_owned).into(), &start_values(&setup.start));
        let about = "start of the flight, trimmed and level";
        let start = list.add(Causality::Parameter, false, about, start);
        let names = effectors.all().map(|e| effector_field("start", &effectors, e).to_string());
        let about = "position of a healthy effector at the start";
        let positions = numbers(names.collect(), trim.first(effectors.len()));
        let positions = list.add(Causality::CalculatedParameter, false, about, positions);
        let names = command_names(&effectors).iter().map(ToString::to_string).collect();
        let commands = numbers(names, trim.first(effectors.len()));
        let about = "command, held during a step";
        let commands = list.add(Causality::Input, false, about, commands);
        // Only over a ground, where they act.
        let brakes = setup.ground.iter().map(|_| ("brakes".to_owned(), FmuValue::Number(0.0)));
        let about = "wheel brakes, 0 to 1, held during a step";
        let brakes = list.add(Causality::Input, false, about, brakes.collect::<Vec<_>>());
        let about = "steady wind, where it blows to";
        let blows = numbers(WIND.map(str::to_owned).into(), &wind);
        let blows = list.add(Causality::Input, true, about, blows);
        let fault = [("fault".to_owned(), FmuValue::Text(String::new()))];
        let about = "faults and repairs in the words of a script, several with a semicolon between; they act when the text changes";
        let fault = list.add(Causality::Input, false, about, fault).start;
        let truth =
            truth_fields(&effectors).map(|name| (format!("truth.{name}"), FmuValue::Number(0.0)));
        let truth = list.add(Causality::Output, true, "true value", truth);
        let fitted = setup.sensors.of(&setup.airframe, setup.ground.is_some());
        let sensors = SensorPlaces::add(&mut list, Causality::Output, &fitted);
        let places = PlantPlaces {
            seed,
            start,
            positions,
            commands,
            brakes,
            wind: blows,
            fault,
            truth,
            sensors,
        };
        let side = Self {
            setup: Arc::new(setup),
            places: Arc::new(places),
            plant: None,
            obeyed: String::new(),
            wind,
        };
        Ok((side, list))
    }

    pub fn setup(&self) -> &PlantSetup {
        &self.setup
    }

    /// Refuses a value of an input before it is taken.
    pub fn check(&self, place: usize, value: &FmuValue) -> Result<(), Problem> {
        match value {
            FmuValue::Text(text) if place == self.places.fault => {
                self.requests(text, SimTime::ZERO).map(drop)
            }
            FmuValue::Number(number)
                if self.places.wind.contains(&place) && !number.is_finite() =>
            {
                Err(problem!("{number}; expected a finite number"))
            }
            _ => Ok(()),
        }
    }

    /// Begins the flight of these parameters.
    pub fn begin(&mut self, values: &mut [FmuValue]) -> Result<(), Problem> {
        let mut setup = PlantSetup::clone(&self.setup);
        if let FmuValue::Count(seed) = values[self.places.seed] {
            setup.seed = seed;
        }
        setup.start = start_of(FmuValue::numbers(&values[self.places.start.clone()]));
        let wind = three(&values[self.places.wind.clone()]);
        self.wind = wind::steady(&setup.wind).0.into();
        if wind != self.wind {
            // For the trim; the last bits follow below.
            setup.wind.speed_m_s = libm::hypot(wind[0], wind[1]);
            setup.wind.towards_rad = libm::atan2(wind[1], wind[0]);
            setup.wind.down_m_s = wind[2];
            self.wind = wind::steady(&setup.wind).0.into();
        }
        let mut plant = Box::new(Plant::new(&setup)?);
        self.obeyed.clear();
        let trim = plant.trim().positions();
        FmuValue::set_numbers(
            &mut values[self.places.positions.clone()],
            trim.as_array().to_owned(),
        );
        self.blow(&mut plant, wind);
        self.show(&mut plant, values);
        self.plant = Some(plant);
        Ok(())
    }

    /// Flies one control period.
    pub fn step(&mut self, values: &mut [FmuValue]) -> Result<(), Problem> {
        let Some(mut plant) = self.plant.take() else {
            return Err(problem!("no flight has begun"));
        };
        let answer = self.obey(&mut plant, &values[self.places.fault]).at("fault");
        if answer.is_ok() {
            self.blow(&mut plant, three(&values[self.places.wind.clone()]));
            let commands = FmuValue::numbers(&values[self.places.commands.clone()]);
            let commands = PerEffector::from_values(commands);
            let brakes = FmuValue::numbers(&values[self.places.brakes.clone()]).next();
            plant.advance(&Actuators { commands, brakes: brakes.unwrap_or(0.0) });
            self.show(&mut plant, values);
        }
        self.plant = Some(plant);
        answer
    }

    /// The aircraft is on the ground, or no number is possible any more.
    pub fn is_over(&self) -> bool {
        self.plant.as_ref().is_some_and(|plant| plant.on_ground())
    }

    /// Carries out the input `fault` if it has changed.
    fn obey(&mut self, plant: &mut Plant, fault: &FmuValue) -> Result<(), Problem> {
        let FmuValue::Text(text) = fault else { return Ok(()) };
        if *text == self.obeyed {
            return Ok(());
        }
        self.obeyed.clone_from(text);
        let effectors = &self.setup.airframe.effectors;
        for request in self.requests(text, plant.time())? {
            if let FaultReply::Refused(refusal) = plant.request(&request) {
                let class = request.target().map_or(TargetClass::Angle, |of| of.class(effectors));
                return Err(problem!("{text:?}: {}", refusal.described(class)));
            }
        }
        Ok(())
    }

    /// The requests of a text at this time, of which the aircraft can have every fault.
    fn requests(&self, text: &str, now: SimTime) -> Result<Vec<FaultRequest>, Problem> {
        let effectors = &self.setup.airframe.effectors;
        let one = |text: &str| -> Result<FaultRequest, Problem> {
            let (trigger, mut request) = fault_words::line(text, effectors)?;
            if let FaultRequest::Inject { target, kind, timing } = &mut request {
                match trigger {
                    Trigger::At(us) => timing.onset = Onset::At(SimTime::from_micros(us)),
                    Trigger::After(us) => {
                        timing.onset = Onset::At(SimTime::from_micros(now.as_micros() + us));
                    }
                    Trigger::AtOnce | Trigger::When(_) => {}
                }
                let fault = ScheduledFault { target: *target, kind: *kind, timing: *timing };
                self.setup.check_fault(&fault).map_err(|refusal| {
                    problem!("{}", refusal.described(target.class(effectors)))
                })?;
            }
            Ok(request)
        };
        let texts = text.split([';', '\n']).map(str::trim).filter(|text| !text.is_empty());
        texts.map(|text| one(text).at(format_args!("{text:?}"))).collect()
    }

    fn blow(&mut self, plant: &mut Plant, wind: [f64; 3]) {
        if wind != self.wind {
            let [north, east, down] = wind;
            plant.set_steady_wind(Ned::new(north, east, down));
            self.wind = wind;
        }
    }

    /// Writes the outputs of this instant; draws its noise.
    fn show(&self, plant: &mut Plant, values: &mut [FmuValue]) {
        self.places.sensors.write(&plant.sense(), values);
        let truth = plant.truth().to_row(plant.on_ground(), plant.is_broken());
        FmuValue::set_numbers(&mut values[self.places.truth.clone()], truth.iter().copied());
    }
}

/// Parameters of the start.
const START: [&str; 5] = [
    "start_altitude_m",
    "start_airspeed_m_s",
    "start_heading_rad",
    "start_latitude_rad",
    "start_longitude_rad",
];

const WIND: [&str; 3] = ["wind_north_m_s", "wind_east_m_s", "wind_down_m_s"];

const fn start_values(start: &Start) -> [f64; 5] {
    let Start { altitude_m, airspeed_m_s, heading_rad, latitude_rad, longitude_rad } = *start;
    [altitude_m, airspeed_m_s, heading_rad, latitude_rad, longitude_rad]
}

fn start_of(mut numbers: impl Iterator<Item = f64>) -> Start {
    let mut next = || numbers.next().unwrap_or_default();
    Start {
        altitude_m: next(),
        airspeed_m_s: next(),
        heading_rad: next(),
        latitude_rad: next(),
        longitude_rad: next(),
    }
}

fn three(values: &[FmuValue]) -> [f64; 3] {
    let mut numbers = FmuValue::numbers(values);
    std::array::from_fn(|_| numbers.next().unwrap_or_default())
}
