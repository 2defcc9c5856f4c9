//! The autopilot as an FMU: sensors in; commands, its signals and its requests for faults out.

use std::ops::Range;
use std::sync::Arc;

use autopilot::autopilot::{Autopilot, Settings};
use autopilot::recorder::{command_names, control_names, control_values};
use autopilot::script::Action;
use host_io::problem::{At as _, Problem, problem};
use icd::fault::{PlantAction, PlantReport};
use icd::record::effector_field;
use icd::sensors::SensorKind;
use icd::{Actuators, ControlPeriod, EffectorList, PerEffector, Sensors, SimTime};
use lab_engine::FlightSetup;
use plant_sim::Plant;
use serde::{Deserialize, Serialize};

use crate::variables::{Causality, FmuValue, SensorPlaces, VariableList};

/// What defines the autopilot's side of a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AutopilotSetup {
    settings: Settings,
    pub(crate) period: ControlPeriod,
    effectors: EffectorList,
    /// Which sensors the aircraft has.
    fitted: [bool; Sensors::SENSORS],
    /// Of the effectors in the trimmed flight at the start, as the plant reports them.
    positions: PerEffector<f64>,
}

impl AutopilotSetup {
    /// Of a flight, which is trimmed for it.
    pub fn of(flight: &FlightSetup) -> Result<Self, Problem> {
        if flight.own_law.is_some() {
            return Err(problem!("a law that the program brings cannot be stored in an FMU"));
        }
        flight.plant.check_model(flight.model.aircraft())?;
        let effectors = flight.plant.airframe.effectors;
        Ok(Self {
            settings: flight.settings(),
            period: flight.plant.period,
            effectors,
            fitted: flight.plant.sensors.of(&flight.plant.airframe, flight.plant.ground.is_some()),
            positions: Plant::new(&flight.plant)?.trim().positions(),
        })
    }
}

/// The control side of one flight.
#[derive(Debug, Clone)]
pub struct AutopilotSide {
    setup: Arc<AutopilotSetup>,
    places: Arc<AutopilotPlaces>,
    autopilot: Option<Box<Autopilot>>,
    /// Of the next control step.
    time: SimTime,
}

#[derive(Debug)]
struct AutopilotPlaces {
    positions: Range<usize>,
    sensors: SensorPlaces,
    commands: Range<usize>,
    brakes: Range<usize>,
    fault: usize,
    control: Range<usize>,
}

impl AutopilotSide {
    pub fn new(setup: AutopilotSetup) -> Result<(Self, VariableList), Problem> {
        setup.settings.model.validate().at("the model of the aircraft")?;
        let effectors = &setup.effectors;
        let mut list = VariableList::of_time();
        let trim = || setup.positions.iter().map(|(_, position)| FmuValue::Number(*position));
        let names = effectors.all().map(|e| effector_field("start", effectors, e).to_string());
        let about = "position of a healthy effector at the start: that of the plant";
        let positions = list.add(Causality::Parameter, false, about, names.zip(trim()));
        let sensors = SensorPlaces::add(&mut list, Causality::Input, &setup.fitted);
        let names = command_names(effectors).into_iter().map(|name| name.to_string());
        let about = "command for the plant, held during a step";
        let commands = list.add(Causality::Output, false, about, names.zip(trim()));
        let is_over_ground = setup.fitted[SensorKind::WeightOnWheels as usize];
        let brakes = is_over_ground.then(|| ("brakes".to_owned(), FmuValue::Number(0.0)));
        let about = "wheel brakes for the plant, 0 to 1";
        let brakes = list.add(Causality::Output, false, about, brakes);
        let fault = [("fault".to_owned(), FmuValue::Text(String::new()))];
        let about = "what the script requests of the plant in this step";
        let fault = list.add(Causality::Output, false, about, fault).start;
        let names = control_names(effectors).into_iter().map(|name| format!("control.{name}"));
        let about = "signal of the control step";
        let control = names.map(|name| (name, FmuValue::Number(0.0)));
        let control = list.add(Causality::Output, false, about, control);
        let places = AutopilotPlaces { positions, sensors, commands, brakes, fault, control };
        let (setup, places) = (Arc::new(setup), Arc::new(places));
        Ok((Self { setup, places, autopilot: None, time: SimTime::ZERO }, list))
    }

    pub fn setup(&self) -> &AutopilotSetup {
        &self.setup
    }

    /// Begins a flight from these positions.
    pub fn begin(&mut self, values: &mut [FmuValue]) {
        let mut autopilot = Box::new(Autopilot::new(&self.setup.settings));
        self.time = SimTime::ZERO;
        autopilot.begin_flight(self.setup.period, self.time, false);
        let positions = FmuValue::numbers(&values[self.places.positions.clone()]);
        let positions = PerEffector::from_values(positions);
        autopilot.handle_report(&PlantReport::Started { positions });
        let commands = &mut values[self.places.commands.clone()];
        FmuValue::set_numbers(commands, positions.as_array().to_owned());
        self.autopilot = Some(autopilot);
    }

    /// Makes one control step with the sensors at its beginning. The plant obeys its commands in the same period.
    pub fn step(&mut self, values: &mut [FmuValue]) -> Result<(), Problem> {
        let Some(autopilot) = &mut self.autopilot else {
            return Err(problem!("no flight has begun"));
        };
        let sensors = self.places.sensors.read(values);
        let Actuators { commands, brakes } = autopilot.step(self.time, &sensors).actuators();
        // Nobody reads them here, and a full queue would count them as lost.
        while autopilot.pop_event().is_some() {}
        let request = autopilot.next_request().map(|request| request.action);
        values[self.places.fault] = FmuValue::Text(self.setup.words(request));
        FmuValue::set_numbers(
            &mut values[self.places.commands.clone()],
            commands.as_array().to_owned(),
        );
        FmuValue::set_numbers(&mut values[self.places.brakes.clone()], [brakes]);
        if let Some(snapshot) = autopilot.snapshot() {
            let control = control_values(&snapshot.log, self.setup.effectors.len());
            FmuValue::set_numbers(&mut values[self.places.control.clone()], control);
        }
        self.time = self.time + self.setup.period;
        Ok(())
    }
}

impl AutopilotSetup {
    /// The line of the script that requests this, as the plant's FMU reads it.
    fn words(&self, action: Option<PlantAction>) -> String {
        let (Some(PlantAction::Fault(fault)), Some(script)) = (action, &self.settings.script)
        else {
            return String::new();
        };
        let line = script.lines().find(|line| line.action == Action::Fault(fault));
        // Without its trigger, which has passed.
        let action = |text: &str| text.rsplit(':').next().unwrap_or_default().trim().to_owned();
        line.map_or(String::new(), |line| action(&line.text))
    }
}
