//! Command line of the autopilot.

use std::borrow::Cow;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flight_control::{AircraftModel, Gains};
use host_io::{Wait, file};
use serde::{Deserialize, Serialize};
use tracing::warn;

use super::RunError;
use super::ground_stations::{ConfigFile, GroundStationArgs};
use super::laws::LawArgs;
use super::recording::RecordingArgs;
use super::script::ScriptArgs;
use super::signing::SigningArgs;
use crate::config::{self, ConfigError, Model};
use crate::io::gcs_link::Links;
use crate::io::key_store::KeptKey;
use crate::io::store::{Kept, KeptPlan, ParameterFile};
use flight_management::own_law::OwnLaw;
use flight_management::parameters::{self, NavigationParameters, Parameters, ReferenceLimits};
use flight_management::script::Script;
use flight_management::vehicle::schedule::ReferenceSchedule;

/// Name of the model that comes with the program, for messages.
const DEFAULT_MODEL_NAME: &str = "tvc_jet.toml";

/// Highest number of a core that the system's masks have.
const CORE_MAX: usize = 1023;
/// The scenarios that both programs know by name. Only the autopilot's part is read here.
const SCENARIOS: [(&str, &str); 3] = [
    ("nominal", include_str!("../../../plant-sim/scenarios/nominal.toml")),
    ("case1", include_str!("../../../plant-sim/scenarios/case1.toml")),
    ("case2", include_str!("../../../plant-sim/scenarios/case2.toml")),
];

/// Whether the compensator acts: parameter `FTC_MODE` by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Ftc {
    /// Never.
    Off,
    /// When a fault is seen (normal).
    Armed,
    /// All the time.
    Always,
}

impl Ftc {
    /// Name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Armed => "armed",
            Self::Always => "always",
        }
    }

    /// Value of `FTC_MODE`.
    #[must_use]
    pub const fn value(self) -> f64 {
        match self {
            Self::Off => 0.0,
            Self::Armed => 1.0,
            Self::Always => 2.0,
        }
    }
}

/// One parameter from the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSetting {
    name: String,
    value: f64,
}

/// Options of the autopilot.
#[derive(Debug, Clone, clap::Args)]
pub struct AutopilotArgs {
    /// Where to wait for the plant
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:9960")]
    pub plant_link: SocketAddr,
    /// The controller's model of the aircraft, instead of what comes with the program
    #[arg(long, visible_alias = "belief", value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// References by time: nominal, case1, case2, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "nominal")]
    pub scenario: String,
    /// What begins with the flight.
    #[command(flatten)]
    pub script: ScriptArgs,
    /// Whether the compensator acts
    #[arg(long, value_enum, value_name = "MODE")]
    pub ftc: Option<Ftc>,
    /// Main controller, estimator of the compensator, gains.
    #[command(flatten)]
    pub laws: LawArgs,
    /// The law that `--law own` flies; a program brings it, no option.
    #[arg(skip)]
    pub own_law: Option<OwnLaw>,
    /// Set a parameter; may be repeated
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting)]
    pub parameters: Vec<ParameterSetting>,
    /// Where parameters that a ground station sets are kept, and beside them its plan, or none [default: two-step/parameters.toml in the user's data folder]
    #[arg(long, value_name = "FILE|none")]
    pub parameter_file: Option<ParameterFile>,
    /// Where the signing key is.
    #[command(flatten)]
    pub signing: SigningArgs,
    /// Settings from a file; the options here win over it
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Where ground stations can be.
    #[command(flatten)]
    pub ground_stations: GroundStationArgs,
    /// Flight logs.
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// Write the signals of every control step to this file
    #[arg(long, value_name = "FILE")]
    pub step_log: Option<PathBuf>,
    /// Write this file once a second while the control loop runs (for health checks of containers)
    #[arg(long, value_name = "FILE")]
    pub health_file: Option<PathBuf>,
    /// Run the control thread on this core only
    #[arg(long, allow_negative_numbers = true, value_name = "CORE", value_parser = parse_core)]
    pub cpu: Option<usize>,
    /// How to wait for the plant: block, yield or spin
    #[arg(long, value_name = "HOW", default_value = "block")]
    pub wait: Wait,
    /// Print one line of JSON about the flight ten times a second
    #[arg(long)]
    pub status: bool,
    /// Fly exactly this setup (postcard), whatever the options above say
    #[arg(long, value_name = "FILE", hide = true)]
    pub setup: Option<PathBuf>,
    /// End when the standard input ends
    #[arg(long, hide = true)]
    pub with_parent: bool,
}

/// What defines the control side of a flight, as it is handed to a process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlSetup {
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    /// Gains.
    pub gains: Gains,
    /// References that are accepted.
    pub limits: ReferenceLimits,
    /// Guidance.
    pub navigation: NavigationParameters,
    /// Scripts may break the aircraft.
    pub fault_injection: bool,
    /// References by time.
    pub references: ReferenceSchedule,
    /// What begins with each flight.
    pub script: Option<Arc<Script>>,
}

impl AutopilotArgs {
    /// The sockets for ground stations that options and file ask for; `None` if there are to be none.
    ///
    /// # Errors
    /// [`RunError`] names the file, and key, value and allowed form.
    pub fn links(&self) -> Result<Option<Links>, RunError> {
        let file = match &self.config {
            None => ConfigFile::default(),
            Some(path) => ConfigFile::read(path)?,
        };
        Ok(self.ground_stations.links(&file.ground_stations))
    }

    /// Folder for flight logs, if there are to be any.
    #[must_use]
    pub fn log_folder(&self) -> Option<PathBuf> {
        self.recording.folder(self.setup.is_some())
    }

    /// The controller's model of the aircraft, with the defaults of its parameters.
    ///
    /// # Errors
    /// [`RunError`] names file, key, value and allowed range.
    pub fn model(&self) -> Result<Model, RunError> {
        Ok(match &self.model {
            None => config::model(DEFAULT_MODEL_NAME, config::DEFAULT_MODEL)?,
            Some(path) => config::model(&path.display().to_string(), &config::read(path)?)?,
        })
    }

    /// The parameters that ground stations have set; `None` where none are kept.
    ///
    /// # Errors
    /// [`RunError`] names file, parameter, value and allowed range.
    pub fn kept_parameters(&self, defaults: &Parameters) -> Result<Option<Kept>, RunError> {
        if self.setup.is_some() {
            // Exactly that setup.
            return Ok(None);
        }
        Ok(self.parameter_file.clone().unwrap_or_default().read(defaults)?)
    }

    /// The plan that a ground station has uploaded in an earlier run; `None` where none is kept.
    ///
    /// # Errors
    /// [`RunError`] names the file and what is wrong with it.
    pub fn kept_plan(&self) -> Result<Option<KeptPlan>, RunError> {
        if self.setup.is_some() {
            // Exactly that setup.
            return Ok(None);
        }
        Ok(self.parameter_file.clone().unwrap_or_default().read_plan()?)
    }

    /// The key file and the key in it; `None` where no key is kept.
    ///
    /// # Errors
    /// [`RunError`] names the file and what is wrong with it.
    pub fn kept_key(&self) -> Result<Option<KeptKey>, RunError> {
        // A flight from a setup is one of record, and nobody's key is its business.
        if self.setup.is_some() { Ok(None) } else { self.signing.kept_key() }
    }

    /// The control side that the options ask for, validated. The parameter file is not looked at, so that a
    /// flight of record does not depend on it.
    ///
    /// # Errors
    /// [`RunError`] names file or parameter, value and allowed range.
    pub fn control_setup(&self) -> Result<(ControlSetup, Parameters), RunError> {
        let model = self.model()?;
        self.control_setup_over(&model.aircraft, &model.defaults)
    }

    /// The same with this model, where what the options leave open is as in `over`.
    ///
    /// # Errors
    /// [`RunError`] names file or parameter, value and allowed range.
    pub fn control_setup_over(
        &self,
        model: &AircraftModel,
        over: &Parameters,
    ) -> Result<(ControlSetup, Parameters), RunError> {
        let mut parameters = *over;
        if let Some(path) = &self.setup {
            let setup = read_setup(path)?;
            parameters.gains = setup.gains;
            parameters.limits = setup.limits;
            parameters.navigation = setup.navigation;
            parameters.failure.enabled = setup.fault_injection;
            parameters.brings_law = self.own_law.is_some();
            parameters.check_law()?;
            return Ok((setup, parameters));
        }
        parameters.brings_law = self.own_law.is_some();
        self.laws.apply(&mut parameters)?;
        let ftc = self.ftc.map(|ftc| ("FTC_MODE", ftc.value()));
        let settings = self.parameters.iter().map(|set| (set.name.as_str(), set.value));
        if let Some(warning) = parameters.set_all(ftc.into_iter().chain(settings))? {
            warn!("parameters: {warning}");
        }
        parameters.check_law()?;
        let model = *model;
        let known = SCENARIOS.iter().find(|(name, _)| *name == self.scenario);
        let (name, text) = match known {
            Some((name, text)) => (*name, Cow::Borrowed(*text)),
            None => (self.scenario.as_str(), Cow::Owned(read_scenario(&self.scenario)?)),
        };
        let references = config::references(name, &text)?;
        let list = &model.effectors.list;
        let script = self.script.read(config::script(name, &text, list)?, list)?.map(Arc::new);
        let Parameters { gains, limits, navigation, failure, .. } = parameters;
        let fault_injection = failure.enabled;
        let setup =
            ControlSetup { model, gains, limits, navigation, fault_injection, references, script };
        Ok((setup, parameters))
    }
}

fn read_scenario(name: &str) -> Result<String, ConfigError> {
    let path = Path::new(name);
    file::read_text(path, file::TEXT_MAX).map_err(|problem| {
        if problem.is_not_found() {
            let known = SCENARIOS.map(|(name, _)| name).join(", ");
            ConfigError::NoScenario { name: name.to_owned(), known }
        } else {
            ConfigError::Read { path: path.to_path_buf(), source: problem.into() }
        }
    })
}

fn read_setup(path: &Path) -> Result<ControlSetup, RunError> {
    let refused = || RunError::Setup { path: path.to_path_buf() };
    let bytes = file::read(path, file::TEXT_MAX).map_err(|_| refused())?;
    let setup: ControlSetup = postcard::from_bytes(&bytes).map_err(|_| refused())?;
    let file = path.display().to_string();
    let model = setup.model.validate();
    model.map_err(|source| ConfigError::Model { file, source })?;
    setup.gains.validate().map_err(parameters::ParameterError::from)?;
    Ok(setup)
}

fn parse_core(text: &str) -> Result<usize, String> {
    let core = text.parse().ok().filter(|core| *core <= CORE_MAX);
    core.ok_or_else(|| format!("{text} is not a whole number from 0 to {CORE_MAX}"))
}

fn parse_setting(text: &str) -> Result<ParameterSetting, String> {
    let refused = || format!("{text} is not NAME=VALUE with a number");
    let (name, value) = text.split_once('=').ok_or_else(refused)?;
    let value = value.trim().parse().map_err(|_| refused())?;
    Ok(ParameterSetting { name: name.trim().to_owned(), value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, Command, FromArgMatches};
    use flight_control::{CompensatorMode, MainLaw};

    fn parse(options: &[&str]) -> Result<AutopilotArgs, clap::Error> {
        let command = AutopilotArgs::augment_args(Command::new("autopilot"));
        let words = ["autopilot"].iter().chain(options);
        AutopilotArgs::from_arg_matches(&command.try_get_matches_from(words)?)
    }

    fn error(options: &[&str]) -> String {
        parse(options).unwrap().control_setup().unwrap_err().to_string()
    }

    #[test]
    fn options_become_parameters_and_references() {
        let options = ["--ftc", "off", "--param", "OBS_W0=40", "--scenario", "case1"];
        let (setup, parameters) = parse(&options).unwrap().control_setup().unwrap();
        assert_eq!(setup.gains.selection.compensator, CompensatorMode::Off);
        assert_eq!(setup.gains.neso.bandwidth, 40.0);
        assert_eq!(setup.gains, parameters.gains);
        assert_eq!(setup.references.entry(0).unwrap().altitude_m, Some(6_000.0));
    }

    #[test]
    fn wrong_parameters_name_the_parameter_and_its_range() {
        assert_eq!(error(&["--param", "NOPE=1"]), "--param: there is no parameter NOPE");
        let message = error(&["--param", "REF_ROLL_MAX=NaN"]);
        assert_eq!(message, "--param: REF_ROLL_MAX = NaN is outside 1 to 80 deg");
        let message = parse(&["--param", "OBS_W0"]).unwrap_err().to_string();
        assert!(message.contains("OBS_W0 is not NAME=VALUE"), "{message}");
    }

    #[test]
    fn a_place_to_keep_something_is_a_path_or_none_and_never_empty() {
        for option in ["--log-dir", "--signing-key", "--parameter-file"] {
            let empty = parse(&[option, ""]).unwrap_err();
            assert_eq!(empty.exit_code(), 2, "a usage error");
            assert!(empty.to_string().contains(option), "{empty}");
            assert!(parse(&[option, "none"]).is_ok() && parse(&[option, "some/where"]).is_ok());
        }
    }

    #[test]
    fn laws_are_chosen_by_name_and_one_that_is_not_there_is_refused() {
        let options = ["--law", "pid-ganged-nozzle", "--compensator", "neso"];
        let (setup, _) = parse(&options).unwrap().control_setup().unwrap();
        assert_eq!(setup.gains.selection.main, MainLaw::PidGangedNozzle);
        let message = parse(&["--law", "lqg"]).unwrap_err().to_string();
        assert!(message.contains("there is no law lqg; the laws are pid, "), "{message}");
        assert!(parse(&["--compensator", "pid"]).is_err());
        for options in [["--law", "own"], ["--param", "CTL_LAW=9"]] {
            let message = error(&options);
            assert!(message.contains("CTL_LAW = 9") && message.contains("own-law.md"), "{message}");
        }
    }

    #[test]
    fn a_missing_file_is_named() {
        let message = error(&["--belief", "no.toml"]);
        assert!(message.starts_with("no.toml: "), "{message}");
        let message = error(&["--scenario", "case9"]);
        let words = "--scenario case9: there is no such scenario and no such file; the scenarios are nominal, case1, case2";
        assert_eq!(message, words);
    }
}
