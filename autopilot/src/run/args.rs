//! Command line of the autopilot, with the addresses for ground stations: options, the configuration file, and the defaults.

use std::borrow::Cow;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use flight_control::gains::name_of;
use flight_control::{AircraftModel, AllocationMode, CompensatorLaw, MainLaw};
use host_io::instance::whole;
use host_io::problem::{At as _, Problem, problem};
use host_io::process::CORE_MAX;
use host_io::{Instance, Wait, file};
use icd::{EffectorKind, EffectorList};
use serde::Deserialize;
use tracing::warn;

use crate::config::{self, Model};
use crate::io::gcs_link::Links;
use crate::io::store::{KeptKey, KeptParameters, KeptPlan, PathOption};
use ::recorder::LogRate;
use aircraft::MODELS;
use flight_management::autopilot::Settings;
use flight_management::own_law::OwnLaw;
use flight_management::parameters::{self, Parameters};
use flight_management::script::Script;
use mavlink_services::heartbeat::HeartbeatIdentity;
use scenarios::SCENARIOS;

/// Files and folder of a vehicle inside the user's data folder.
const PARAMETER_FILE: &str = "parameters.toml";
const SIGNING_KEY: &str = "signing.key";
const LOG_FOLDER: &str = "logs";
/// Largest size of all flight logs, MB.
const LOG_LIMIT_MAX_MB: u64 = 1_000_000;
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
    /// Value of `FTC_MODE`.
    pub fn value(self) -> f64 {
        f64::from(self as u8)
    }
}

/// One parameter from the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSetting {
    name: String,
    value: f64,
}

/// Which laws fly, and with which gains.
#[derive(Debug, Clone, Default, PartialEq, Eq, clap::Args)]
pub struct LawArgs {
    #[arg(
        long,
        value_name = "LAW",
        value_parser = |text: &str| by_name("law", text, MainLaw::NAMES),
        help = format!("Main controller, parameter CTL_LAW by name: {}", file::names(MainLaw::NAMES))
    )]
    pub law: Option<MainLaw>,
    #[arg(
        long,
        value_name = "LAW",
        value_parser = |text: &str| by_name("law", text, CompensatorLaw::NAMES),
        help = format!(
            "Estimator of the compensator, parameter FTC_LAW by name: {}",
            file::names(CompensatorLaw::NAMES)
        )
    )]
    pub compensator: Option<CompensatorLaw>,
    #[arg(
        long,
        value_name = "HOW",
        value_parser = |text: &str| by_name("allocation", text, AllocationMode::NAMES),
        help = format!(
            "Allocation of the compensating demand, parameter FTC_ALLOC by name: {}",
            file::names(AllocationMode::NAMES)
        )
    )]
    pub allocation: Option<AllocationMode>,
    /// Parameters from a file, as `sitl aircraft design` writes them
    #[arg(long, value_name = "FILE")]
    pub gains: Option<PathBuf>,
    /// The law that `--law own` flies; a program brings it, no option.
    #[arg(skip)]
    pub own: Option<OwnLaw>,
}

impl LawArgs {
    /// Takes a law that the program brings; it flies unless `--law` names another one.
    pub fn set_own_law(&mut self, own: &OwnLaw) {
        if own.role().is_main() {
            self.law.get_or_insert(MainLaw::Own);
        }
        if own.role().compensates() {
            self.allocation.get_or_insert(AllocationMode::Own);
        }
        self.own = Some(own.clone());
    }

    /// The text of the file with gains.
    pub fn gains_text(&self) -> Result<Option<String>, Problem> {
        self.gains.as_deref().map(config::read).transpose()
    }

    /// Sets the values that the options give, and no others; `gains` is the text of the file.
    pub fn apply(
        &self,
        parameters: &mut Parameters,
        gains: Option<&str>,
        model: &AircraftModel,
    ) -> Result<(), Problem> {
        let has_nozzle = model.effectors.list.only(EffectorKind::NozzlePitch).is_some();
        if let Some(law @ MainLaw::PidGangedNozzle) = self.law
            && !has_nozzle
        {
            let (law, aircraft) = (name_of(MainLaw::NAMES, law), model.aircraft);
            return Err(problem!(
                "--law {law}: {aircraft} has no nozzle; without one this law is pid"
            ));
        }
        if let (Some(path), Some(text)) = (&self.gains, gains) {
            parameters::set_from_text(parameters, text)
                .at(format!("--gains {}", path.display()))?;
        }
        parameters.brings_law = self.own.as_ref().map(OwnLaw::role);
        let selection = &mut parameters.gains.selection;
        selection.main = self.law.unwrap_or(selection.main);
        selection.compensator_law = self.compensator.unwrap_or(selection.compensator_law);
        selection.allocation = self.allocation.unwrap_or(selection.allocation);
        Ok(())
    }
}

/// What begins with the flight.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ScriptArgs {
    /// Script of faults and events that begins with each flight, instead of the scenario's
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,
}

impl ScriptArgs {
    /// For an aircraft with these effectors: the script of the option, or else that of the scenario.
    pub fn read(
        &self,
        scenario: Option<Script>,
        effectors: &EffectorList,
    ) -> Result<Option<Script>, Problem> {
        let Some(path) = &self.script else { return Ok(scenario) };
        config::script_file(path, effectors).map(Some)
    }
}

/// Options of the flight logs.
#[derive(Debug, Clone, clap::Args)]
pub struct RecordingArgs {
    /// Folder for flight logs, or none [default: two-step/logs in the user's data folder]
    #[arg(long, value_name = "DIR|none")]
    pub log_dir: Option<PathOption>,
    /// Size of all flight logs in that folder together, MB; the oldest are removed when a flight begins
    #[arg(long, allow_negative_numbers = true, value_name = "MB", default_value_t = 4000, value_parser = whole(1, LOG_LIMIT_MAX_MB))]
    pub log_limit_mb: u64,
    /// How many control steps a flight log has rows of
    #[arg(long, value_name = "RATE", value_enum, default_value_t)]
    pub log_rate: LogRate,
}

impl RecordingArgs {
    /// Size of all logs together, bytes.
    pub fn limit_bytes(&self) -> u64 {
        self.log_limit_mb.saturating_mul(1_000_000)
    }
}

/// Options of the autopilot.
#[derive(Debug, Clone, clap::Args)]
pub struct AutopilotArgs {
    /// Number of this vehicle among several on this computer; shifts the default ports, MAV_SYS_ID and files
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value = "0")]
    pub instance: Instance,
    /// Where to wait for the plant [default: 127.0.0.1:9960, and N higher for instance N]
    #[arg(long, value_name = "IP:PORT")]
    pub plant_link: Option<SocketAddr>,
    #[arg(
        long,
        value_name = "NAME|FILE",
        default_value = MODELS[0].0,
        help = format!("The controller's model of the aircraft: {}, or a file", file::names(MODELS))
    )]
    pub model: PathBuf,
    #[arg(long, value_name = "NAME|FILE", default_value = "nominal", help = format!("References by time: {}, or a file", file::names(SCENARIOS)))]
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
    /// Set a parameter; may be repeated
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting)]
    pub parameters: Vec<ParameterSetting>,
    /// Where parameters that a ground station sets are kept, and beside them its plan, or none [default: two-step/parameters.toml in the user's data folder]
    #[arg(long, value_name = "FILE|none")]
    pub parameter_file: Option<PathOption>,
    /// Where the MAVLink signing key is kept, or none; with a key there signing is on [default: two-step/signing.key in the user's data folder]
    #[arg(long, value_name = "FILE|none")]
    pub signing_key: Option<PathOption>,
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
    #[arg(long, allow_negative_numbers = true, value_name = "CORE", value_parser = whole(0, CORE_MAX))]
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

impl AutopilotArgs {
    /// The requested sockets for ground stations; `None` if they are disabled.
    pub fn links(&self) -> Result<Option<Links>, Problem> {
        let file = match &self.config {
            None => ConfigFile::default(),
            Some(path) => ConfigFile::read(path)?,
        };
        Ok(self.ground_stations.links(&file.ground_stations, self.instance))
    }

    /// Folder for flight logs, if they are enabled. A flight of a setup writes them only where an option names one.
    pub fn log_folder(&self) -> Option<PathBuf> {
        if self.setup.is_some() && self.recording.log_dir.is_none() {
            return None;
        }
        PathOption::path(self.recording.log_dir.as_ref(), &self.instance.file(LOG_FOLDER))
    }

    /// A file saved for the next start. A flight of a setup is exactly that setup and saves nothing.
    fn kept_file(&self, option: Option<&PathOption>, name: &str) -> Option<PathBuf> {
        if self.setup.is_some() {
            return None;
        }
        PathOption::path(option, &self.instance.file(name))
    }

    /// The controller's model of the aircraft, with the defaults of its parameters.
    pub fn model(&self) -> Result<Model, Problem> {
        let mut model = config::named_model(&self.model)?;
        model.defaults.link.system_id = self.instance.system_id();
        Ok(model)
    }

    /// The saved parameters of ground stations; `None` if they are not saved.
    pub fn kept_parameters(
        &self,
        defaults: &Parameters,
    ) -> Result<Option<KeptParameters>, Problem> {
        let file = self.kept_file(self.parameter_file.as_ref(), PARAMETER_FILE);
        Ok(file.map(|file| KeptParameters::read(file, defaults)).transpose()?)
    }

    /// The plan that a ground station has uploaded in an earlier run; `None` if it is not saved.
    pub fn kept_plan(&self) -> Result<Option<KeptPlan>, Problem> {
        let file = self.kept_file(self.parameter_file.as_ref(), PARAMETER_FILE);
        Ok(file.map(|file| KeptPlan::read_beside(&file)).transpose()?)
    }

    /// The key file and the key in it; `None` if no key is saved.
    pub fn kept_key(&self) -> Result<Option<KeptKey>, Problem> {
        let file = self.kept_file(self.signing_key.as_ref(), SIGNING_KEY);
        file.map(|file| KeptKey::read(file).at("signing")).transpose()
    }

    /// The control side that the options request, validated. It does not depend on the parameter file, so that a
    /// flight of record does not either.
    pub fn control_setup(&self) -> Result<(Settings, Parameters), Problem> {
        let model = self.model()?;
        self.control_setup_over(&model.aircraft, &model.defaults)
    }

    /// The same with this model; values that the options leave open come from `over`.
    pub fn control_setup_over(
        &self,
        model: &AircraftModel,
        over: &Parameters,
    ) -> Result<(Settings, Parameters), Problem> {
        let mut parameters = *over;
        if let Some(path) = &self.setup {
            let mut setup = read_setup(path)?;
            setup.own_law = self.laws.own.clone();
            parameters.gains = setup.gains;
            parameters.limits = setup.limits;
            parameters.navigation = setup.navigation;
            parameters.failure.enabled = setup.fault_injection;
            parameters.brings_law = setup.own_law.as_ref().map(OwnLaw::role);
            parameters.check_law().at("--param")?;
            return Ok((setup, parameters));
        }
        self.laws.apply(&mut parameters, self.laws.gains_text()?.as_deref(), model)?;
        let ftc = self.ftc.map(|ftc| ("FTC_MODE", ftc.value()));
        let settings = self.parameters.iter().map(|set| (set.name.as_str(), set.value));
        let set = parameters.set_all(ftc.into_iter().chain(settings));
        if let Some(warning) = set.at("--param")? {
            warn!("parameters: {warning}");
        }
        parameters.check_law().at("--param")?;
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
        let setup = Settings {
            model,
            gains,
            limits,
            navigation,
            references,
            script,
            fault_injection: failure.enabled,
            own_law: self.laws.own.clone(),
        };
        Ok((setup, parameters))
    }
}

fn read_scenario(name: &str) -> Result<String, Problem> {
    match file::read_text(Path::new(name), file::TEXT_MAX) {
        Err(problem) if problem.is_not_found() => {
            let known = file::names(SCENARIOS);
            let why = "there is no such scenario and no such file; the scenarios are";
            Err(problem!("--scenario {name}: {why} {known}"))
        }
        read => read.at(name),
    }
}

fn read_setup(path: &Path) -> Result<Settings, Problem> {
    let refused = || problem!("{}: not a control setup of this version", path.display());
    let bytes = file::read(path, file::TEXT_MAX).map_err(|_| refused())?;
    let setup: Settings = postcard::from_bytes(&bytes).map_err(|_| refused())?;
    setup.model.validate().at(path.display())?;
    setup.gains.validate().at("--param")?;
    Ok(setup)
}

fn by_name<T: Copy>(what: &str, text: &str, names: &[(&str, T)]) -> Result<T, String> {
    names
        .iter()
        .find(|(name, _)| *name == text)
        .map(|(_, law)| *law)
        .ok_or_else(|| format!("there is no {what} {text}; the {what}s are {}", file::names(names)))
}

fn parse_setting(text: &str) -> Result<ParameterSetting, String> {
    let refused = || format!("{text} is not NAME=VALUE with a number");
    let (name, value) = text.split_once('=').ok_or_else(refused)?;
    let value = value.trim().parse().map_err(|_| refused())?;
    Ok(ParameterSetting { name: name.trim().to_owned(), value })
}

/// Where every vehicle calls `QGroundControl`.
const STATION_PORT: u16 = 14_550;
/// Where the first vehicle calls offboard scripts.
const SCRIPT_PORT: u16 = 14_540;
/// For ground stations that call: the port of PX4's simulation, and the step to that of the next vehicle.
const UDP_SERVER: (u16, u16) = (18_570, 1);
/// For ground stations that connect: the port of `ArduPilot`'s simulation, and the step.
const TCP_SERVER: (u16, u16) = (5_760, 10);

const fn local(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

/// An address with a port of at least `FIRST_PORT`, or none. Port 0 lets the system choose one to listen at; it cannot be called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "toml::Value")]
struct Endpoint<const FIRST_PORT: u16>(Option<SocketAddr>);

/// A ground station that is called.
type Client = Endpoint<1>;
/// Where ground stations call.
type Server = Endpoint<0>;

impl<const FIRST_PORT: u16> FromStr for Endpoint<FIRST_PORT> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self(None));
        }
        match text.parse::<SocketAddr>() {
            Err(_) => Err(format!("{text} is not IP:PORT or none")),
            Ok(address) if address.port() < FIRST_PORT => Err(format!(
                "{text} is not IP:PORT with a port from {FIRST_PORT} to 65535, or none"
            )),
            Ok(address) => Ok(Self(Some(address))),
        }
    }
}

impl<const FIRST_PORT: u16> TryFrom<toml::Value> for Endpoint<FIRST_PORT> {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, String> {
        value.as_str().map_or_else(|| value.to_string(), str::to_owned).parse()
    }
}

/// Options about ground stations.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct GroundStationArgs {
    /// Their addresses.
    #[command(flatten)]
    table: GroundStationTable,
    /// The autopilot that heartbeats name: of an unknown one ground stations show little more than telemetry
    #[arg(long = "mavlink-autopilot", value_enum, value_name = "NAME", default_value = "px4")]
    pub identity: HeartbeatIdentity,
    /// No ground stations at all
    #[arg(long, conflicts_with_all = ["clients", "bind", "udp_server", "tcp_server"])]
    no_gcs: bool,
}

/// What a configuration file may say.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfigFile {
    /// Where ground stations can be.
    #[serde(default)]
    pub ground_stations: GroundStationTable,
}

/// The table `[ground_stations]`, and the options of the same meaning.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, clap::Args)]
#[serde(deny_unknown_fields)]
pub struct GroundStationTable {
    /// Where a ground station listens; may be repeated [default: 127.0.0.1:14550, and :14540 + instance]
    #[arg(long = "gcs", value_name = "IP:PORT|none")]
    clients: Option<Vec<Client>>,
    /// Own address for calling them [default: any port of loopback, or of every address if one of them is elsewhere]
    #[arg(long = "gcs-bind", value_name = "IP:PORT")]
    bind: Option<SocketAddr>,
    /// Where ground stations can call by UDP [default: 127.0.0.1:18570 + instance]
    #[arg(long = "gcs-udp-server", value_name = "IP:PORT|none")]
    udp_server: Option<Server>,
    /// Where ground stations can connect by TCP [default: 127.0.0.1:5760 + 10 * instance]
    #[arg(long = "gcs-tcp", value_name = "IP:PORT|none")]
    tcp_server: Option<Server>,
}

impl ConfigFile {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, Problem> {
        Self::from_toml(&path.display().to_string(), &config::read(path)?)
    }

    /// Reads the text of a file; `file` is its name for error messages.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Problem> {
        toml::from_str(text).at(file)
    }
}

impl GroundStationArgs {
    /// The requested sockets; `None` if they are disabled.
    pub fn links(&self, file: &GroundStationTable, instance: Instance) -> Option<Links> {
        let options = &self.table;
        let clients = match options.clients.as_ref().or(file.clients.as_ref()) {
            // From the eleventh vehicle on scripts share a port, as with PX4.
            None => {
                let script = instance.local(SCRIPT_PORT, 1).min(local(STATION_PORT - 1));
                vec![local(STATION_PORT), script]
            }
            Some(clients) => clients.iter().filter_map(|client| client.0).collect(),
        };
        let server = |option: Option<Server>, key: Option<Server>, (port, step): (u16, u16)| {
            option.or(key).map_or_else(|| Some(instance.local(port, step)), |server| server.0)
        };
        let links = Links {
            client_bind: options.bind.or(file.bind).unwrap_or_else(|| bind_for(&clients)),
            udp_server: server(options.udp_server, file.udp_server, UDP_SERVER),
            tcp_server: server(options.tcp_server, file.tcp_server, TCP_SERVER),
            clients,
        };
        let any =
            !links.clients.is_empty() || links.udp_server.is_some() || links.tcp_server.is_some();
        (any && !self.no_gcs).then_some(links)
    }
}

/// Local address for calling `clients`: loopback unless one of them is on another computer.
fn bind_for(clients: &[SocketAddr]) -> SocketAddr {
    match clients.first() {
        _ if clients.iter().all(|client| client.ip() == local(0).ip()) => local(0),
        Some(SocketAddr::V6(_)) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
        Some(SocketAddr::V4(_)) | None => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, Command, FromArgMatches};
    use flight_control::CompensatorMode;

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
    fn files_and_folders_that_are_kept_are_a_path_or_none_and_never_empty() {
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
        let message = error(&["--model", "no.toml"]);
        assert!(message.starts_with("--model no.toml: "), "{message}");
        let message = error(&["--scenario", "case9"]);
        let words = "--scenario case9: there is no such scenario and no such file; the scenarios are nominal, case1, case2, field, circuit";
        assert_eq!(message, words);
    }

    #[test]
    fn a_flight_of_a_setup_writes_a_log_only_where_an_option_names_a_folder() {
        let folder = |options: &[&str]| parse(options).unwrap().log_folder();
        let here = Some(PathBuf::from("here"));
        assert_eq!(folder(&["--setup", "s"]), None);
        assert_eq!(folder(&["--setup", "s", "--log-dir", "here"]), here);
        assert_eq!(folder(&["--log-dir", "here"]), here);
        assert_eq!(folder(&["--log-dir", "none"]), None);
        let limit = parse(&["--log-limit-mb", "1"]).unwrap().recording.limit_bytes();
        assert_eq!(limit, 1_000_000);
    }

    #[test]
    fn a_script_that_is_too_long_or_no_file_or_not_there_is_named() {
        let error = |path: &str| {
            let args = ScriptArgs { script: Some(path.into()) };
            args.read(None, &icd::tvc_jet::effectors()).unwrap_err().to_string()
        };
        let endless = error("/dev/zero");
        assert_eq!(endless, "--script /dev/zero: this is a device, and an ordinary file is needed");
        let folder = tempfile::tempdir().unwrap();
        let long = folder.path().join("long");
        std::fs::write(&long, [b'#'; 16_385]).unwrap();
        let long = error(long.to_str().unwrap());
        assert!(long.contains("16385 bytes"), "{long}");
        assert!(error("/nowhere/x.txt").starts_with("--script /nowhere/x.txt: "));
    }
}

#[cfg(test)]
mod ground_station_tests {
    use super::*;
    use clap::{Args, Command, FromArgMatches};

    fn parse(options: &[&str]) -> Result<GroundStationArgs, clap::Error> {
        let command = GroundStationArgs::augment_args(Command::new("autopilot"));
        let words = ["autopilot"].iter().chain(options);
        GroundStationArgs::from_arg_matches(&command.try_get_matches_from(words)?)
    }

    fn links(options: &[&str], file: &str) -> Option<Links> {
        let file = ConfigFile::from_toml("my.toml", file).unwrap();
        parse(options).unwrap().links(&file.ground_stations, Instance::default())
    }

    fn at(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    const FILE: &str = r#"
        [ground_stations]
        clients = ["127.0.0.1:1", "192.0.2.7:2"]
        udp_server = "none"
        tcp_server = "127.0.0.1:3"
    "#;

    #[test]
    fn without_options_only_loopback_is_used() {
        let links = links(&[], "").unwrap();
        assert_eq!(links.clients, [at("127.0.0.1:14550"), at("127.0.0.1:14540")]);
        assert_eq!(links.client_bind, at("127.0.0.1:0"));
        assert_eq!(links.udp_server, Some(at("127.0.0.1:18570")));
        assert_eq!(links.tcp_server, Some(at("127.0.0.1:5760")));
    }

    #[test]
    fn further_vehicles_have_the_ports_that_those_of_px4_have() {
        let links = |number: &str| {
            let instance = number.parse().unwrap();
            let table = GroundStationTable::default();
            let links = parse(&[]).unwrap().links(&table, instance).unwrap();
            let ports: Vec<u16> = links.clients.iter().map(SocketAddr::port).collect();
            let servers = [links.udp_server, links.tcp_server].map(|at| at.unwrap().port());
            (ports, servers)
        };
        assert_eq!(links("1"), (vec![14_550, 14_541], [18_571, 5_770]));
        assert_eq!(links("9"), (vec![14_550, 14_549], [18_579, 5_850]));
        assert_eq!(links("249"), (vec![14_550, 14_549], [18_819, 8_250]));
        let file = ConfigFile::from_toml("my.toml", FILE).unwrap().ground_stations;
        let links = parse(&[]).unwrap().links(&file, "1".parse().unwrap()).unwrap();
        assert_eq!(links.tcp_server, Some(at("127.0.0.1:3")), "an address that is given stays");
    }

    #[test]
    fn the_command_line_wins_over_the_file() {
        let from_file = links(&[], FILE).unwrap();
        assert_eq!(from_file.clients, [at("127.0.0.1:1"), at("192.0.2.7:2")]);
        assert_eq!(from_file.client_bind, at("0.0.0.0:0"), "one of them is elsewhere");
        assert_eq!(from_file.udp_server, None);
        assert_eq!(from_file.tcp_server, Some(at("127.0.0.1:3")));
        let options = ["--gcs", "[::1]:4", "--gcs-tcp=none", "--gcs-udp-server=127.0.0.1:5"];
        let both = links(&options, FILE).unwrap();
        assert_eq!(both.clients, [at("[::1]:4")]);
        assert_eq!(both.udp_server, Some(at("127.0.0.1:5")));
        assert_eq!(both.tcp_server, None);
    }

    #[test]
    fn the_autopilot_that_heartbeats_name_is_px4_unless_another_is_requested() {
        assert_eq!(parse(&[]).unwrap().identity, HeartbeatIdentity::Px4);
        let generic = parse(&["--mavlink-autopilot", "generic"]).unwrap();
        assert_eq!(generic.identity, HeartbeatIdentity::Generic);
        assert!(parse(&["--mavlink-autopilot", "ardupilot"]).is_err());
    }

    #[test]
    fn everything_can_be_switched_off() {
        assert_eq!(links(&["--no-gcs"], ""), None);
        let off = ["--gcs", "none", "--gcs-udp-server", "none", "--gcs-tcp", "none"];
        assert_eq!(links(&off, FILE), None);
        assert_eq!(links(&["--gcs", "none"], "").unwrap().clients, []);
    }

    #[test]
    fn wrong_addresses_are_refused_with_the_allowed_form() {
        for option in ["--gcs=here", "--gcs-tcp=5760", "--gcs-udp-server=localhost:1"] {
            let message = parse(&[option]).unwrap_err().to_string();
            assert!(message.contains("IP:PORT or none"), "{message}");
        }
        for station in ["--gcs=127.0.0.1:0", "--gcs=[::1]:0"] {
            let message = parse(&[station]).unwrap_err().to_string();
            assert!(message.contains("1 to 65535"), "{message}");
        }
        for (line, words) in [
            ("tcp_server = \"5760\"", ["tcp_server", "\"5760\"", "IP:PORT or none"]),
            ("udp_server = 18570", ["udp_server", "18570", "IP:PORT or none"]),
            ("clients = [\"here\"]", ["clients", "here", "IP:PORT or none"]),
            ("clients = [\"127.0.0.1:0\"]", ["clients", "127.0.0.1:0", "1 to 65535"]),
            ("tcp = \"none\"", ["my.toml", "`tcp`", "tcp_server"]),
        ] {
            let text = format!("[ground_stations]\n{line}\n");
            let message = ConfigFile::from_toml("my.toml", &text).unwrap_err().to_string();
            assert!(message.starts_with("my.toml: "), "{message}");
            for word in words {
                assert!(message.contains(word), "{word} is missing: {message}");
            }
        }
    }
}
