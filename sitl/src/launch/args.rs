//! Options of `sitl` itself, and what they become for the two processes.

use std::net::SocketAddr;

use autopilot::run::{AutopilotArgs, DEFAULT_GROUND_STATIONS};
use clap::{Args, Command};
use plant_sim::Plant;
use plant_sim::io::{PlantArgs, Speed};

/// Options of a flight; each is explained by `sitl autopilot --help` and `sitl plant-sim --help`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct LaunchArgs {
    /// What is flown: nominal, case1, case2, or a file [default: nominal]
    #[arg(long, value_name = "NAME|FILE")]
    scenario: Option<String>,
    /// Whether the compensator acts: off, armed or always [default: armed]
    #[arg(long, value_name = "MODE")]
    ftc: Option<String>,
    /// Simulation time per wall time, 0.01 to 1000, or max [default: 1]
    #[arg(long, allow_negative_numbers = true, value_name = "FACTOR|max")]
    speed: Option<String>,
    /// Control period, 1 to 4 ms [default: 2]
    #[arg(long, allow_negative_numbers = true, value_name = "MS")]
    period_ms: Option<String>,
    /// Integration step, us; divides the control period [default: 1000]
    #[arg(long, value_name = "US")]
    step_us: Option<String>,
    /// flat or wgs84, instead of the scenario's
    #[arg(long, value_name = "MODEL")]
    earth: Option<String>,
    /// Seed of all random streams, instead of the scenario's
    #[arg(long, value_name = "N")]
    seed: Option<String>,
    /// White noise of the gyros, deg/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S")]
    gyro_noise_deg_s: Option<String>,
    /// Turbulence, m/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "M_S")]
    turbulence_m_s: Option<String>,
    /// The aircraft, instead of the one that comes with the program
    #[arg(long, value_name = "FILE")]
    airframe: Option<String>,
    /// What the controller believes about the aircraft, instead of what comes with the program
    #[arg(long, value_name = "FILE")]
    belief: Option<String>,
    /// Set a parameter of the autopilot; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    param: Vec<String>,
    /// Where the autopilot waits for the plant [default: 127.0.0.1:9960]
    #[arg(long, value_name = "IP:PORT")]
    plant_link: Option<String>,
    /// Where a ground station listens; may be repeated [default: 127.0.0.1:14550 and :14540]
    #[arg(long, value_name = "IP:PORT")]
    gcs: Vec<String>,
}

/// Words for the two processes.
pub(super) struct Options {
    pub(super) autopilot: Vec<String>,
    pub(super) plant: Vec<String>,
}

/// An option, or a file that it names, is wrong.
#[derive(Debug, thiserror::Error)]
pub enum OptionError {
    /// An option that cannot be read.
    #[error("{}", without_frame(&.0.to_string()))]
    Syntax(clap::Error),
    /// The autopilot would not start.
    #[error(transparent)]
    Autopilot(#[from] autopilot::run::RunError),
    /// The plant would not start.
    #[error(transparent)]
    Plant(#[from] plant_sim::io::RunError),
    /// There is no flight to start from.
    #[error(transparent)]
    Flight(#[from] plant_sim::SetupError),
}

/// What clap says, without its label and its hint.
fn without_frame(message: &str) -> String {
    let text = message.strip_prefix("error: ").unwrap_or(message);
    text.split("\n\n").next().unwrap_or(text).to_owned()
}

impl LaunchArgs {
    /// Where ground stations are spoken to.
    pub(super) fn ground_stations(&self) -> Vec<SocketAddr> {
        if self.gcs.is_empty() {
            return DEFAULT_GROUND_STATIONS.to_vec();
        }
        self.gcs.iter().filter_map(|address| address.parse().ok()).collect()
    }

    /// Whether the two processes should not wait for the wall clock.
    pub(super) fn is_as_fast_as_possible(&self) -> bool {
        self.speed.as_ref().is_some_and(|speed| speed.parse() == Ok(Speed::Max))
    }

    /// The options for each process, after both have been asked whether they would start with them.
    pub(super) fn check(&self) -> Result<Options, OptionError> {
        let options = Options { autopilot: self.autopilot_words(), plant: self.plant_words() };
        let autopilot: AutopilotArgs = parse("sitl autopilot", &options.autopilot)?;
        autopilot.control_setup()?;
        let plant: PlantArgs = parse("sitl plant-sim", &options.plant)?;
        Plant::new(&plant.plant_setup()?)?;
        Ok(options)
    }

    fn autopilot_words(&self) -> Vec<String> {
        let mut words = Vec::new();
        add(&mut words, "--scenario", &self.scenario);
        add(&mut words, "--ftc", &self.ftc);
        add(&mut words, "--belief", &self.belief);
        add(&mut words, "--plant-link", &self.plant_link);
        for setting in &self.param {
            words.push(format!("--param={setting}"));
        }
        for station in &self.gcs {
            words.push(format!("--gcs={station}"));
        }
        words
    }

    fn plant_words(&self) -> Vec<String> {
        let mut words = Vec::new();
        add(&mut words, "--scenario", &self.scenario);
        add(&mut words, "--airframe", &self.airframe);
        add(&mut words, "--speed", &self.speed);
        add(&mut words, "--period-ms", &self.period_ms);
        add(&mut words, "--step-us", &self.step_us);
        add(&mut words, "--earth", &self.earth);
        add(&mut words, "--seed", &self.seed);
        add(&mut words, "--gyro-noise-deg-s", &self.gyro_noise_deg_s);
        add(&mut words, "--turbulence-m-s", &self.turbulence_m_s);
        words
    }
}

/// One word, so that a value that begins with a dash stays a value.
fn add(words: &mut Vec<String>, option: &str, value: &Option<String>) {
    if let Some(value) = value {
        words.push(format!("{option}={value}"));
    }
}

fn parse<T: Args>(program: &'static str, words: &[String]) -> Result<T, OptionError> {
    let command = T::augment_args(Command::new(program));
    let all = std::iter::once(program).chain(words.iter().map(String::as_str));
    let matches = command.try_get_matches_from(all).map_err(OptionError::Syntax)?;
    T::from_arg_matches(&matches).map_err(OptionError::Syntax)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(args: &LaunchArgs) -> String {
        args.check().err().map_or_else(|| "accepted".to_owned(), |error| error.to_string())
    }

    #[test]
    fn wrong_options_are_refused_before_anything_starts() {
        let some = |text: &str| Some(text.to_owned());
        let base = LaunchArgs::default;
        for (args, words) in [
            (LaunchArgs { speed: some("-1"), ..base() }, "0.01 to 1000"),
            (LaunchArgs { period_ms: some("7"), ..base() }, "1 to 4"),
            (LaunchArgs { step_us: some("300"), ..base() }, "does not divide"),
            (LaunchArgs { ftc: some("maybe"), ..base() }, "off, armed, always"),
            (LaunchArgs { scenario: some("no.toml"), ..base() }, "no.toml: "),
            (LaunchArgs { param: vec!["NOPE=1".to_owned()], ..base() }, "NOPE"),
            (LaunchArgs { gcs: vec!["nowhere".to_owned()], ..base() }, "nowhere"),
        ] {
            let refusal = refusal(&args);
            assert!(refusal.contains(words), "{refusal}");
        }
        assert_eq!(refusal(&base()), "accepted");
    }
}
