//! The files of a flight with what `--set` changes in them: aircraft, the controller's model, scenario.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use aircraft::MODELS;
use aircraft::{AIRFRAMES, DEFAULT_NAME};
use autopilot::config::{self, Model};
use autopilot::parameters::Parameters;
use autopilot::script::Script;
use autopilot::vehicle::schedule::ReferenceSchedule;
use host_io::file::{self, TEXT_MAX};
use icd::EffectorList;
use plant_sim::airframe_file;
use plant_sim::scenario;
use plant_sim::{Airframe, PlantPart, ReadAirframe as _, Scenario};
use scenarios::SCENARIOS;
use toml::Table;

use crate::problem::{At as _, Problem, problem};
use crate::settings::{self, Setting, Target};

/// Which aircraft, which model of it, and what is changed in all that is flown.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub struct AircraftArgs {
    #[arg(
        long,
        value_name = "NAME|FILE",
        help = format!("The aircraft: {}, or a file [default: {DEFAULT_NAME}]", file::names(AIRFRAMES))
    )]
    pub airframe: Option<PathBuf>,
    /// The controller's model of the aircraft, by name or from a file [default: that of the airframe's name, else of tvc_jet]
    #[arg(long, value_name = "NAME|FILE")]
    pub model: Option<PathBuf>,
    /// Set a key of the scenario (plant.wind.turbulence_m_s), the airframe (airframe.mass.mass_kg) or the model (model.…), or a
    /// parameter (FTC_MODE); may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    pub settings: Vec<Setting>,
}

/// Parser of a number of an option, from 0 to `max`.
pub fn up_to(
    max: f64,
    unit: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse() {
        Err(_) => Err(format!("not a number; allowed are 0 to {max} {unit}")),
        Ok(value) if (0.0..=max).contains(&value) => Ok(value),
        Ok(value) => Err(format!("{value} is outside 0 to {max} {unit}")),
    }
}

/// Largest gyro noise that an option takes, deg/s rms.
pub const GYRO_NOISE_MAX_DEG_S: f64 = 10.0;
/// Largest turbulence that an option takes, m/s rms.
pub const TURBULENCE_MAX_M_S: f64 = 20.0;

/// A file with its name for messages.
#[derive(Debug, Clone)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: Cow<'static, str>,
    /// The text as a table, read once: every run of a campaign changes a copy of it.
    table: OnceLock<Table>,
}

/// A scenario, both parts of it.
#[derive(Debug, Clone)]
pub struct Flight {
    /// The plant's part.
    pub plant: PlantPart,
    /// References by time.
    pub references: ReferenceSchedule,
    /// What begins with the flight.
    pub script: Option<Script>,
}

impl Named {
    /// A text that comes with the program.
    pub fn shipped(name: &str, text: &'static str) -> Self {
        Self::new(name.to_owned(), Cow::Borrowed(text))
    }

    /// A text that the program made.
    pub fn given(name: &str, text: String) -> Self {
        Self::new(name.to_owned(), Cow::Owned(text))
    }

    fn new(name: String, text: Cow<'static, str>) -> Self {
        Self { name, text, table: OnceLock::new() }
    }

    fn table(&self) -> Result<Table, Problem> {
        if self.table.get().is_none() {
            let table = toml::from_str(&self.text).at(&self.name)?;
            // Another thread may have been quicker, with the same table.
            let _ = self.table.set(table);
        }
        Ok(self.table.get().cloned().unwrap_or_default())
    }

    /// A scenario by name, or from a file.
    pub fn scenario(name: &str) -> Result<Self, Problem> {
        if let Some((name, text)) = SCENARIOS.iter().find(|(known, _)| *known == name) {
            return Ok(Self::shipped(name, text));
        }
        match file::read_text(Path::new(name), TEXT_MAX) {
            Ok(text) => Ok(Self::new(name.to_owned(), Cow::Owned(text))),
            Err(problem) if problem.is_not_found() => Err(problem!(
                "{name}: there is no such scenario and no such file; the scenarios are {}",
                file::names(SCENARIOS)
            )),
            Err(problem) => Err(problem).at(name),
        }
    }

    /// A file of the user.
    pub fn read(path: &Path) -> Result<Self, Problem> {
        let name = path.display().to_string();
        let text = file::read_text(path, TEXT_MAX).at(&name)?;
        Ok(Self::new(name, Cow::Owned(text)))
    }

    /// One of the files that come with the program by name, or a file of the user.
    pub fn shipped_or_read(name: &Path, shipped: &[(&str, &'static str)]) -> Result<Self, Problem> {
        let (name, text) = file::shipped_or_read(name, shipped).at(name.display())?;
        Ok(Self::new(name, text))
    }
}

impl AircraftArgs {
    /// Checks that every key of the settings exists.
    pub fn check(&self) -> Result<(), Problem> {
        settings::check_keys(&self.settings)
    }

    /// The same for a command that reads only some files.
    pub fn check_read(&self, reads: &'static [Target]) -> Result<(), Problem> {
        let is_read = |option: String, target| match reads.contains(&target) {
            true => Ok(()),
            false => Err(problem!(
                "{option} has no effect: of aircraft and flight this command reads {}",
                reads.iter().map(|target| target.name()).collect::<Vec<_>>().join(" and ")
            )),
        };
        for setting in &self.settings {
            is_read(format!("--set {}", setting.key), setting.target()?)?;
        }
        self.model.as_ref().map_or(Ok(()), |_| is_read("--model".to_owned(), Target::Model))
    }

    /// The same beside options for some keys: those that are given, or that count whatever a scenario has.
    pub fn check_beside(
        &self,
        options: impl IntoIterator<Item = (&'static str, &'static str)>,
    ) -> Result<(), Problem> {
        self.check()?;
        for (key, option) in options {
            if self.settings.iter().any(|setting| setting.key == key) {
                return Err(problem!("--set {key}: this command has the option {option} for it"));
            }
        }
        Ok(())
    }

    /// The aircraft.
    pub fn airframe(&self) -> Result<Airframe, Problem> {
        let file = self.airframe_file()?;
        Ok(match self.changed(&file, Target::Airframe, "airframe.")? {
            None => Airframe::from_toml(&file.name, &file.text)?,
            Some((name, table)) => Airframe::from_table(&name, table)?,
        })
    }

    /// The controller's model, with the defaults of its parameters.
    pub fn model(&self) -> Result<Model, Problem> {
        let file = self.model_file()?;
        Ok(match self.changed(&file, Target::Model, "model.")? {
            None => config::model(&file.name, &file.text)?,
            Some((name, table)) => config::model_of(&name, table)?,
        })
    }

    fn airframe_file(&self) -> Result<Named, Problem> {
        Named::shipped_or_read(self.airframe.as_deref().unwrap_or(DEFAULT_NAME.as_ref()), AIRFRAMES)
    }

    fn model_file(&self) -> Result<Named, Problem> {
        let of_aircraft = self.airframe.as_deref().filter(|name| airframe_file::is_shipped(name));
        let name = self.model.as_deref().or(of_aircraft);
        Named::shipped_or_read(name.unwrap_or(DEFAULT_NAME.as_ref()), MODELS)
    }

    /// The airframe file with what is set in it.
    pub fn airframe_table(&self) -> Result<Table, Problem> {
        self.table(&self.airframe_file()?, Target::Airframe)
    }

    /// The file of the controller's model with what is set in it.
    pub fn model_table(&self) -> Result<Table, Problem> {
        self.table(&self.model_file()?, Target::Model)
    }

    /// A scenario file with what is set in it.
    pub fn scenario_table(&self, file: &Named) -> Result<Table, Problem> {
        self.table(file, Target::Scenario)
    }

    fn table(&self, file: &Named, target: Target) -> Result<Table, Problem> {
        let root = match target {
            Target::Airframe => "airframe.",
            Target::Model => "model.",
            Target::Scenario | Target::Parameter => "",
        };
        match self.changed(file, target, root)? {
            Some((_, table)) => Ok(table),
            None => file.table(),
        }
    }

    /// A scenario with what is set in it, for an aircraft with these effectors.
    pub fn scenario(&self, file: &Named, effectors: &EffectorList) -> Result<Flight, Problem> {
        if let Some((name, table)) = self.changed(file, Target::Scenario, "")? {
            let plant = Scenario::from_table(&name, table.clone(), effectors)?.plant;
            let (references, script) = config::scenario_of(&name, table, effectors)?;
            return Ok(Flight { plant, references, script });
        }
        let (name, text) = (file.name.as_str(), file.text.as_ref());
        Ok(Flight {
            plant: Scenario::from_toml(name, text, effectors)?.plant,
            references: config::references(name, text)?,
            script: config::script(name, text, effectors)?,
        })
    }

    /// Parameters, where those that are not set are as in `parameters`.
    pub fn parameters(&self, mut parameters: Parameters) -> Result<Parameters, Problem> {
        settings::set_parameters(&mut parameters, &self.settings)?;
        Ok(parameters)
    }

    /// A file with what is set in it, and its name with that; `None` if nothing is set.
    fn changed(
        &self,
        file: &Named,
        target: Target,
        root: &str,
    ) -> Result<Option<(String, Table)>, Problem> {
        let settings = settings::of(&self.settings, target);
        if settings.is_empty() {
            return Ok(None);
        }
        let mut table = file.table()?;
        // A setting has the unit of the reader and replaces what the file has in any unit.
        match target {
            Target::Scenario => scenario::convert_units(&file.name, &mut table)?,
            Target::Airframe => airframe_file::convert_units(&file.name, &mut table)?,
            Target::Model | Target::Parameter => {}
        }
        settings::apply(&mut table, root, &settings)?;
        Ok(Some((settings::describe(&file.name, &settings), table)))
    }
}
