//! The runs of a campaign: which flight number N is, alone or among a million.
//!
//! ```text
//! run N = flight · laws + law        every law flies the same flights
//! flight = airframe, combination of the listed values, sample of the drawn ones
//! ```

use autopilot::run::LawArgs;
use flight_control::{CompensatorMode, MainLaw};
use host_io::problem::{Problem, problem};
use icd::units::DEG_PER_RAD;
use icd::{EffectorKind, SimTime};
use lab_engine::builder::{SetupBuilder, SetupOptions};
use lab_engine::configuration::{AircraftArgs, Named};
use lab_engine::settings::{Setting, Target, number, written};
use lab_judges::closed_loop::FlightSetup;
use lab_judges::flown;
use lab_judges::outcome::Outcome;
use plant_sim::setup::step_within;
use rand_chacha::rand_core::Rng;
use sha2::{Digest, Sha256};

use crate::draw;
use crate::spec::{
    AirframeSpec, ENDS, LawSpec, Manoeuvres, Meaning, RUNS_MAX, SEED_MAX, Seeds, SpecFile,
    TableSpec, Variable, settings_of,
};

mod aircraft;
mod inputs;
mod setups;

pub use aircraft::Aircraft;
use inputs::{InputText, inputs};

/// Longest step of the plant without `step_us`, µs. None of the 5,740 flights of `jams` is kept or lost otherwise than with 1 ms.
const STEP_US: u32 = 2_000;

/// A value of a variable.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Number(f64),
    Text(String),
}

impl Value {
    /// As it would stand in a file.
    pub fn of_file(&self) -> toml::Value {
        match self {
            Self::Number(number) => toml::Value::Float(*number),
            Self::Text(text) => written(text),
        }
    }

    /// As `--set` takes it.
    pub fn setting(&self) -> String {
        match self {
            Self::Number(number) => format!("{number:?}"),
            Self::Text(text) => text.clone(),
        }
    }

    /// The number; `None` of a text.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Text(_) => None,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub number: u64,
    /// Number of its flight: every law flies it.
    pub flight: u64,
    /// Place of the aircraft in the specification.
    pub airframe: usize,
    /// Place of the law in the specification.
    pub law: usize,
    /// Seed of the random streams of the flight.
    pub seed: u64,
    /// Values of the variables, in the order of the specification, as `--set` takes them.
    pub values: Vec<Value>,
}

/// A specification with everything that it leads to.
#[derive(Debug)]
pub struct Plan {
    pub file: SpecFile,
    pub aircraft: Vec<Aircraft>,
    /// SHA-256 of everything that decides the results but the program, as hexadecimal digits.
    pub fingerprint: String,
    inputs: Vec<InputText>,
    laws: Vec<Law>,
    /// Of each aircraft with each law.
    builders: Vec<SetupBuilder>,
    scenario: Named,
    step_us: u32,
    flights: u64,
}

/// Options and settings of a law.
#[derive(Debug)]
struct Law {
    args: LawArgs,
    settings: Vec<Setting>,
}

impl Plan {
    /// Reads everything that a specification leads to.
    pub fn new(file: SpecFile) -> Result<Self, Problem> {
        let spec = &file.spec;
        // The seed of the last sample still has to be exact in JSON.
        let greatest = SEED_MAX - u64::from(spec.samples);
        if spec.seeds == Seeds::Samples && spec.seed > greatest {
            return Err(problem!("{}: seed = {}: expected 0 to {greatest}", file.name, spec.seed));
        }
        let scenario = file.scenario()?;
        let shipped = [AirframeSpec::default()];
        let specs = if spec.airframe.is_empty() { &shipped[..] } else { &spec.airframe };
        let (mut aircraft, mut flights) = (Vec::new(), 0_u64);
        for spec in specs {
            let one = Aircraft::read(spec, &file, &scenario, flights)?;
            let too_many = || problem!("{}: more than {RUNS_MAX} runs", file.name);
            let own = one.combinations.checked_mul(u64::from(file.spec.samples));
            flights = own.and_then(|own| own.checked_add(flights)).ok_or_else(too_many)?;
            if flights.checked_mul(file.spec.law.len() as u64).is_none_or(|runs| runs > RUNS_MAX) {
                return Err(too_many());
            }
            aircraft.push(one);
        }
        let laws: Vec<Law> =
            spec.law.iter().map(|law| read_law(law, &file)).collect::<Result<_, _>>()?;
        let inputs = inputs(&file, &scenario, &aircraft, &laws)?;
        let mut all = Sha256::new();
        inputs.iter().for_each(|input| all.update(input.sha256));
        let fingerprint = all.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        // In its range, as checked with the file.
        let period_ms = spec.period().unwrap_or_default();
        let step_us = spec.step_us.unwrap_or_else(|| step_within(period_ms, STEP_US));
        let named = || spec.law.iter().zip(&laws);
        let both = aircraft.iter().flat_map(|aircraft| named().map(move |law| (aircraft, law)));
        // Once for each aircraft with each law, and not for each of a million runs.
        let builders: Vec<SetupBuilder> = both
            .map(|(aircraft, (law, read))| {
                let (args, laws) = (aircraft.args.clone(), read.args.clone());
                let options = SetupOptions {
                    aircraft: args,
                    laws,
                    ftc: None,
                    period_ms,
                    step_us: Some(step_us),
                };
                let builder = SetupBuilder::of(aircraft.airframe.clone(), aircraft.model, options)?;
                Ok(builder.of_law(&law.name))
            })
            .collect::<Result<_, Problem>>()?;
        let plan = Self {
            aircraft,
            fingerprint,
            inputs,
            laws,
            builders,
            scenario,
            step_us,
            flights,
            file,
        };
        plan.check()?;
        Ok(plan)
    }

    /// What of the specification has no meaning for one of its aircraft.
    pub fn notes(&self) -> Vec<String> {
        let laws = self.laws.len();
        let of = |aircraft: &Aircraft| {
            let Aircraft { name, lacking, airframe, .. } = aircraft;
            let names: Vec<&str> = lacking.iter().map(String::as_str).collect();
            let left_out = (!names.is_empty())
                .then(|| format!("{name} has no {}: what names it is left out", names.join(", ")));
            let ganged = |law: &usize| {
                let run = self.run(aircraft.first * laws as u64 + *law as u64).ok();
                let setup = run.and_then(|run| self.setup(&run).ok());
                setup.is_some_and(|s| s.parameters.gains.selection.main == MainLaw::PidGangedNozzle)
            };
            let has_nozzle = airframe.effectors.only(EffectorKind::NozzlePitch).is_some();
            let ganged = (0..laws).filter(|_| !has_nozzle).filter(ganged);
            let ganged = ganged.map(|law| {
                format!("{name} has no nozzle: {} flies as its PID alone", self.laws()[law])
            });
            left_out.into_iter().chain(ganged).collect::<Vec<_>>()
        };
        self.aircraft.iter().flat_map(of).collect()
    }

    /// Checks that the files, which many runs read again, are still those of the fingerprint.
    pub fn check_inputs(&self) -> Result<(), Problem> {
        let now = inputs(&self.file, &self.scenario, &self.aircraft, &self.laws)?;
        match self.inputs.iter().zip(&now).find(|(then, now)| then.sha256 != now.sha256) {
            None => Ok(()),
            Some((input, _)) => Err(problem!(
                "{}: it has changed since the campaign began, so no more runs are kept",
                input.name
            )),
        }
    }

    pub fn runs(&self) -> u64 {
        self.flights * self.laws.len() as u64
    }

    /// Number of flights that every law flies.
    pub fn flights(&self) -> u64 {
        self.flights
    }

    /// Names of the laws.
    pub fn laws(&self) -> Vec<&str> {
        self.file.spec.law.iter().map(|law| law.name.as_str()).collect()
    }

    pub fn variables(&self) -> &[Variable] {
        &self.file.spec.vary
    }

    /// Flights of an aircraft.
    pub fn flights_of(&self, airframe: usize) -> std::ops::Range<usize> {
        let end = self.aircraft.get(airframe + 1).map_or(self.flights, |next| next.first);
        place(self.aircraft[airframe].first)..place(end)
    }

    /// Unit of a measure; empty if no aircraft has it.
    pub fn unit_of(&self, measure: &str) -> &'static str {
        let all = self.aircraft.iter().flat_map(|aircraft| &aircraft.measures);
        all.clone().find(|(name, _)| name == measure).map_or("", |(_, unit)| unit)
    }

    /// Unit of a measure for people, and how many of it are one of its own unit.
    pub(crate) fn shown_unit(&self, measure: &str) -> (&'static str, f64) {
        match self.unit_of(measure) {
            "rad" => ("deg", DEG_PER_RAD),
            "rad/s" => ("deg/s", DEG_PER_RAD),
            unit => (unit, 1.0),
        }
    }

    /// The number of a run that there is.
    pub(crate) fn number(&self, run: i128) -> Result<u64, Problem> {
        let (file, last) = (&self.file.name, self.runs() - 1);
        let number = u64::try_from(run).ok().filter(|number| *number <= last);
        number.ok_or_else(|| problem!("--run {run}: {file} has the runs 0 to {last}"))
    }

    /// Run `number`.
    pub fn run(&self, number: u64) -> Result<Run, Problem> {
        let run = self.drawn(number)?;
        self.translated(run)
    }

    /// A run whose values are as the specification has them, with its factors and parts of a travel.
    pub(crate) fn drawn(&self, number: u64) -> Result<Run, Problem> {
        let number = self.number(number.into())?;
        let laws = self.laws.len() as u64;
        let (flight, law) = (number / laws, place(number % laws));
        let airframe = self.aircraft.partition_point(|aircraft| aircraft.first <= flight) - 1;
        let aircraft = &self.aircraft[airframe];
        let spec = &self.file.spec;
        let own = flight - aircraft.first;
        let samples = u64::from(spec.samples);
        let (mut combination, sample) = (own / samples, own % samples);
        let sample = u32::try_from(sample).unwrap_or(u32::MAX);
        let mut values = vec![Value::Number(f64::NAN); spec.vary.len()];
        // The last variable of the specification changes fastest.
        for (value, list) in values.iter_mut().zip(&aircraft.lists).rev() {
            if let Some(list) = list {
                let length = list.len() as u64;
                *value = list[place(combination % length)].clone();
                combination /= length;
            }
        }
        // Listed variables have no dimension, so another list leaves the draws as they are.
        let mut dimension = 0;
        for (value, variable) in values.iter_mut().zip(&spec.vary) {
            if variable.is_drawn() {
                let source = (variable.key.as_str(), dimension);
                let p = draw::probability(spec.design, spec.seed, source, (sample, spec.samples));
                *value = Value::Number(variable.quantile(p));
                dimension += 1;
            }
        }
        // A file and a table in JSON have whole numbers to 53 bits.
        let seed = match spec.seeds {
            Seeds::Flights => draw::stream(spec.seed, "flight", flight).next_u64() >> 11,
            Seeds::Samples => spec.seed.wrapping_add(u64::from(sample)),
        };
        Ok(Run { number, flight, airframe, law, seed, values })
    }

    /// The same run with values as `--set` takes them.
    pub(crate) fn translated(&self, run: Run) -> Result<Run, Problem> {
        let values = self.aircraft[run.airframe].translate(self, &run.values)?;
        Ok(Run { values, ..run })
    }

    /// The scenario of a run as a file that `sitl fly` flies, and the options that belong to it: files and settings that a
    /// scenario does not have.
    pub fn scenario_of(&self, run: &Run) -> Result<(toml::Table, Vec<String>), Problem> {
        let args = self.args(run)?;
        let mut table = args.scenario_table(&self.scenario)?;
        let plant = table.entry("plant").or_insert_with(|| toml::Table::new().into());
        if let Some(plant) = plant.as_table_mut() {
            // In place of what the scenario says.
            let _ = plant.insert("seed".to_owned(), run.seed.cast_signed().into());
            let _ = plant.insert("duration_s".to_owned(), self.file.spec.duration_s.into());
        }
        let paths = [
            ("--airframe", &args.airframe),
            ("--model", &args.model),
            ("--gains", &self.laws[run.law].args.gains),
        ];
        let paths = paths.into_iter().filter_map(|(option, path)| {
            path.as_ref().map(|path| [option.to_owned(), path.display().to_string()])
        });
        let settings = args.settings.iter().filter(|s| s.target() != Ok(Target::Scenario));
        let settings = settings.map(|setting| ["--set".to_owned(), setting.to_string()]);
        let steps = [
            ["--period-ms".to_owned(), self.file.spec.period_ms.to_string()],
            ["--step-us".to_owned(), self.step_us.to_string()],
        ];
        Ok((table, paths.chain(settings).chain(steps).flatten().collect()))
    }

    /// The settings of a run, in the order in which they are made: of the campaign, the aircraft, the law, and the variables.
    pub fn settings(&self, run: &Run) -> Result<Vec<Setting>, Problem> {
        let mut settings = self.aircraft[run.airframe].args.settings.clone();
        settings.extend(self.laws[run.law].settings.iter().cloned());
        let aircraft = &self.aircraft[run.airframe];
        for (place, (variable, value)) in self.variables().iter().zip(&run.values).enumerate() {
            let is_key = variable.meaning != Meaning::Level;
            let keys = is_key.then_some(&variable.key).into_iter().chain(&variable.sets);
            let keys = keys.filter(|key| aircraft.sets(key));
            settings.extend(keys.map(|key| Setting::new(key, value.of_file())));
            settings.extend(aircraft.settings_of_case(self, place, &run.values)?);
        }
        if let Some(manoeuvres) = &self.file.spec.manoeuvres {
            let start = |key, design| {
                let set = settings.iter().rfind(|setting| setting.key == key);
                set.and_then(|setting| number(&setting.value)).unwrap_or(design)
            };
            let design = &aircraft.airframe.design_point;
            let start = [
                start("plant.start.altitude_m", design.altitude_m),
                start("plant.start.airspeed_m_s", design.airspeed_m_s),
            ];
            settings.extend(manoeuvres.settings(start, self.file.spec.duration_s, run.seed));
        }
        Ok(settings)
    }

    /// Files and settings of a run.
    pub fn args(&self, run: &Run) -> Result<AircraftArgs, Problem> {
        let args = &self.aircraft[run.airframe].args;
        Ok(AircraftArgs { settings: self.settings(run)?, ..args.clone() })
    }

    /// The flight of a run.
    pub fn setup(&self, run: &Run) -> Result<FlightSetup, Problem> {
        let law = &self.file.spec.law[run.law];
        let builder = &self.builders[run.airframe * self.laws.len() + run.law];
        let beyond = self.aircraft[run.airframe].args.settings.len();
        // The builder has the settings of the aircraft already.
        let mut setup = builder.setup(&self.scenario, &self.settings(run)?[beyond..])?;
        setup.plant.seed = run.seed;
        setup.knows_fault = law.fault_known;
        setup.duration = SimTime::from_seconds(self.file.spec.duration_s).unwrap_or(SimTime::ZERO);
        let compensator = setup.parameters.gains.selection.compensator;
        if law.fault_known && compensator != CompensatorMode::Off {
            return Err(problem!(
                "law {}: fault_known = true needs FTC_MODE = 0: it takes the compensator's place",
                law.name
            ));
        }
        Ok(setup)
    }

    /// Whether a run has the reference that knows the fault.
    pub fn knows_fault(&self, run: &Run) -> bool {
        self.file.spec.law[run.law].fault_known
    }

    /// Flies a run to its end, or to the loss of the aircraft.
    pub fn fly(&self, run: &Run) -> Result<Outcome, Problem> {
        flown::outcome(&self.setup(run)?, &self.file.spec.judges)
    }

    /// The first and the last flight of every aircraft with every law must be possible, so that a mistake is found at once.
    fn check(&self) -> Result<(), Problem> {
        let spec = &self.file.spec;
        let read = spec.tables.iter().flat_map(TableSpec::reads);
        let read = read.filter(|name| !ENDS.contains(name));
        for name in spec.measures.iter().map(String::as_str).chain(read) {
            if self.unit_of(name).is_empty() {
                return Err(problem!(
                    "{}: measures: there is no measure {name}; docs/fly.md has the list",
                    self.file.name
                ));
            }
        }
        let laws = self.laws.len() as u64;
        for (place, aircraft) in self.aircraft.iter().enumerate() {
            let end = self.aircraft.get(place + 1).map_or(self.flights, |next| next.first);
            for flight in [aircraft.first, end - 1] {
                for law in 0..laws {
                    // Only whether it can be made.
                    let _ = self.setup(&self.run(flight * laws + law)?)?;
                }
            }
        }
        Ok(())
    }
}

impl Manoeuvres {
    /// The references of a flight from a start, m and m/s, drawn by its seed.
    fn settings(
        &self,
        [altitude_m, airspeed_m_s]: [f64; 2],
        duration_s: f64,
        seed: u64,
    ) -> Vec<Setting> {
        let mut between = draw::manoeuvres(seed);
        let mut entries = vec![[0.0, 0.0, altitude_m, airspeed_m_s]];
        let mut at_s = self.from_s;
        while at_s < duration_s {
            // The order of the draws is part of every recorded campaign.
            let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
            let roll_deg = side * between(self.roll_deg[0], self.roll_deg[1]);
            let most_m = self.altitude_part * altitude_m;
            let altitude_m = altitude_m + between(-most_m, most_m);
            let part = between(-self.airspeed_part, self.airspeed_part);
            let airspeed_m_s = airspeed_m_s * (1.0 + part);
            entries.push([at_s, roll_deg, altitude_m, airspeed_m_s]);
            entries.push([at_s + self.turn_s, 0.0, altitude_m, airspeed_m_s]);
            at_s += self.turn_s + self.level_s;
        }
        const KEYS: [&str; 4] = ["at_s", "roll_deg", "altitude_m", "airspeed_m_s"];
        let of = |(place, entry): (usize, &[f64; 4])| {
            let key = move |key| format!("autopilot.reference.{}.{key}", place + 1);
            KEYS.into_iter().zip(*entry).map(move |(word, value)| Setting::new(&key(word), value))
        };
        entries.iter().enumerate().flat_map(of).collect()
    }
}

fn read_law(law: &LawSpec, file: &SpecFile) -> Result<Law, Problem> {
    let gains = law.gains.as_deref().map(|path| file.beside(path));
    let args = LawArgs { gains, own: file.own_law(&law.name).cloned(), ..LawArgs::default() };
    Ok(Law { args, settings: settings_of(&law.set, &file.name)? })
}

/// A number below the length of a list.
fn place(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}
