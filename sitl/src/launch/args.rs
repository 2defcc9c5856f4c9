//! Options of `sitl` itself, and what they become for the two processes.

use std::path::{Path, PathBuf};

use aircraft::AIRFRAMES;
use autopilot::config;
use autopilot::own_law::OwnLaw;
use autopilot::run::AutopilotArgs;
use clap::{Args, Command};
use flight_control::{AllocationMode, CompensatorLaw, MainLaw};
use host_io::file;
use host_io::problem::{Problem, problem};
use lab_engine::builder::{fitted, preset_note};
use lab_studies::mission::PlanStart;
use plant_sim::airframe_file;
use plant_sim::io::{PlantArgs, Speed};
use scenarios::SCENARIOS;
use serde::Serialize;
use serde_json::Value;

use super::keys::PaceState;
use super::screen::Advice;

/// Options of a flight; each is explained by `sitl autopilot --help` and `sitl plant-sim --help`.
#[derive(Debug, Clone, Default, clap::Args, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct LaunchArgs {
    #[arg(long, value_name = "NAME|FILE", help = format!("{}, or a file", file::names(SCENARIOS).replacen(',', " (default),", 1)))]
    scenario: Option<String>,
    /// Script of faults and events that begins with each flight, instead of the scenario's
    #[arg(long, value_name = "FILE")]
    script: Option<String>,
    /// Compensator: off, armed or always [default: armed]
    #[arg(long, value_name = "MODE")]
    ftc: Option<String>,
    #[arg(long, value_name = "LAW", help = file::names(MainLaw::NAMES).replacen(',', " (default),", 1))]
    law: Option<String>,
    #[arg(
        long,
        value_name = "LAW",
        help = format!("Estimator of the compensator: {} [default: neso]", file::names(CompensatorLaw::NAMES))
    )]
    compensator: Option<String>,
    #[arg(
        long,
        value_name = "HOW",
        help = format!(
            "Allocation of the compensating demand: {} [default: as the model file says, else paper]",
            file::names(AllocationMode::NAMES)
        )
    )]
    allocation: Option<String>,
    /// Parameters from a file, as `sitl aircraft design` writes them
    #[arg(long, value_name = "FILE")]
    gains: Option<String>,
    /// The law that `--law own` flies; a program brings it, no option.
    #[arg(skip)]
    #[serde(skip)]
    own_law: Option<OwnLaw>,
    /// 0.01 to 1000 times real time, or max [default: 1]
    #[arg(long, allow_negative_numbers = true, value_name = "FACTOR|max")]
    speed: Option<String>,
    /// Let simulation time stand still at the start, until an operator lets it run
    #[arg(long)]
    start_paused: bool,
    /// Control period, 1 to 4 ms [default: 2]
    #[arg(long, allow_negative_numbers = true, value_name = "MS")]
    period_ms: Option<String>,
    /// Integration step, us; divides the control period [default: its largest divisor up to 1000]
    #[arg(long, allow_negative_numbers = true, value_name = "US")]
    step_us: Option<String>,
    /// flat, wgs84, round or round_non_rotating, instead of the scenario's
    #[arg(long, value_name = "MODEL")]
    earth: Option<String>,
    /// Where the flight begins, instead of the scenario's place: degrees, m above the ellipsoid (of the runway, or of an aircraft in the
    /// air), degrees from north
    #[arg(long, allow_hyphen_values = true, value_name = "LAT,LON,ALTITUDE,HEADING")]
    home: Option<String>,
    /// Begin where this plan does, which a ground station uploads: at its home, on the ground (scenario field) if it begins with a
    /// takeoff, else as the scenario does
    #[arg(long, value_name = "FILE", conflicts_with = "home")]
    plan: Option<PathBuf>,
    /// Seed of all random streams, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "N")]
    seed: Option<String>,
    /// White noise of the gyros, deg/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S")]
    gyro_noise_deg_s: Option<String>,
    /// Turbulence, m/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "M_S")]
    turbulence_m_s: Option<String>,
    #[arg(long, value_name = "NAME|FILE", help = format!("{}, or a file", file::names(AIRFRAMES)))]
    airframe: Option<String>,
    /// The controller's model of the aircraft, by name or from a file [default: that of the airframe's name, else of tvc_jet]
    #[arg(long, value_name = "NAME|FILE")]
    model: Option<String>,
    /// Set a parameter of the autopilot; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    param: Vec<String>,
    /// Where parameters that a ground station sets are kept, and beside them its plan, or none [default: two-step/parameters.toml in the user's data folder]
    #[arg(long, value_name = "FILE|none")]
    parameter_file: Option<String>,
    /// Where the MAVLink signing key is kept, or none; with a key there signing is on [default: two-step/signing.key in the user's data folder]
    #[arg(long, value_name = "FILE|none")]
    signing_key: Option<String>,
    /// Folder for flight logs, or none [default: two-step/logs in the user's data folder]
    #[arg(long, value_name = "DIR|none")]
    log_dir: Option<String>,
    /// Size of all flight logs in that folder together, MB [default: 4000]
    #[arg(long, allow_negative_numbers = true, value_name = "MB")]
    log_limit_mb: Option<String>,
    /// How many control steps a flight log has rows of: events (20 each second, all around events) or full [default: events]
    #[arg(long, value_name = "RATE")]
    log_rate: Option<String>,
    /// Number of this vehicle; shifts ports [default: 0]
    #[arg(long, allow_negative_numbers = true, value_name = "N")]
    instance: Option<String>,
    /// Where the autopilot waits for the plant [default: 127.0.0.1:9960 + instance]
    #[arg(long, value_name = "IP:PORT")]
    plant_link: Option<String>,
    /// Settings of the autopilot from a file; the options here win over it
    #[arg(long, value_name = "FILE")]
    config: Option<String>,
    /// Where a ground station listens; may be repeated [default: 127.0.0.1:14550, and :14540 + instance]
    #[arg(long, value_name = "IP:PORT|none")]
    gcs: Vec<String>,
    /// Own address for calling them [default: any port of loopback]
    #[arg(long, value_name = "IP:PORT")]
    gcs_bind: Option<String>,
    /// Where ground stations can call by UDP [default: 127.0.0.1:18570 + instance]
    #[arg(long, value_name = "IP:PORT|none")]
    gcs_udp_server: Option<String>,
    /// Where ground stations can connect by TCP [default: 127.0.0.1:5760 + 10 * instance]
    #[arg(long, value_name = "IP:PORT|none")]
    gcs_tcp: Option<String>,
    /// The autopilot that heartbeats name, px4 or generic [default: px4]
    #[arg(long, value_name = "NAME")]
    mavlink_autopilot: Option<String>,
    /// No ground stations at all
    #[arg(long)]
    no_gcs: bool,
}

/// Words for the two processes.
pub(super) struct Options {
    pub(super) autopilot: Vec<String>,
    pub(super) plant: Vec<String>,
    /// What the operator has to know at the start.
    pub(super) note: Option<String>,
    /// What the aircraft has of the jet.
    pub(super) inherited: Option<String>,
    /// What can be broken.
    pub(super) advice: Option<Advice>,
}

/// The message of clap, without its label and its hint.
fn without_frame(message: &str) -> String {
    let text = message.strip_prefix("error: ").unwrap_or(message);
    text.split("\n\n").next().unwrap_or(text).to_owned()
}

impl LaunchArgs {
    /// Whether the two processes should not wait for the wall clock.
    pub(super) fn is_as_fast_as_possible(&self) -> bool {
        self.speed() == Speed::Max
    }

    /// How simulation time passes at the start.
    pub(super) fn pace(&self) -> PaceState {
        PaceState::new(self.start_paused, self.speed())
    }

    fn speed(&self) -> Speed {
        // A word that is no speed is refused by `check`.
        self.speed.as_ref().and_then(|speed| speed.parse().ok()).unwrap_or(Speed::REAL_TIME)
    }

    /// The options for each process, after checking that both would start with them.
    pub(super) fn check(&self) -> Result<Options, Problem> {
        let words = self.words_for::<PlantArgs>();
        let plant: PlantArgs = parse("sitl plant-sim", &words)?;
        let setup = plant.plant_setup()?;
        // A flight that cannot begin is refused here, with its reason, and not by a child that
        // ends.
        plant.plant(&setup)?;
        // The autopilot has no option for the airframe: the name of a shipped one becomes that of
        // its model.
        let named = self.airframe.clone().filter(|name| airframe_file::is_shipped(Path::new(name)));
        let of_autopilot = Self { model: self.model.clone().or(named), ..self.clone() };
        let mut options = Options {
            autopilot: of_autopilot.words_for::<AutopilotArgs>(),
            plant: words,
            note: None,
            inherited: None,
            advice: Advice::of(&setup.airframe),
        };
        let mut autopilot: AutopilotArgs = parse("sitl autopilot", &options.autopilot)?;
        // No option can carry a law; the child is this same program and brings it as well.
        autopilot.laws.own = self.own_law.clone();
        let model = autopilot.model()?;
        let kept = autopilot.kept_parameters(&model.defaults)?;
        let saved = kept.map_or(model.defaults, |kept| kept.parameters);
        let (_, parameters) = autopilot.control_setup_over(&model.aircraft, &saved)?;
        // The autopilot knows what it is fitted with, in whatever program, unless an option or the file of gains says otherwise.
        let fitted = fitted(saved, &setup.sensors);
        let mut with_gains = fitted;
        let laws = &autopilot.laws;
        laws.apply(&mut with_gains, laws.gains_text()?.as_deref(), &model.aircraft)?;
        if let Some(plan) = &self.plan {
            let start = PlanStart::read(plan, &parameters, &setup.airframe, &setup.start)?;
            let has_ground = setup.ground.is_some();
            let field = start.from_ground.then(|| "field".to_owned());
            if let (true, false, Some(scenario)) = (start.from_ground, has_ground, &self.scenario) {
                let plan = plan.display();
                return Err(problem!(
                    "--plan {plan} begins with a takeoff, and scenario {scenario} has no ground; field has one"
                ));
            }
            let mut home = start.home;
            // On the ground all the same, which stays at its elevation: the plan does not say where it is.
            if let (false, Some(ground)) = (start.from_ground, &setup.ground) {
                home.place.altitude_m = ground.threshold.altitude_m;
            }
            let (home, scenario) = (Some(home.to_string()), self.scenario.clone().or(field));
            return Self { plan: None, home, scenario, ..self.clone() }.check();
        }
        options.inherited = config::inherited(&model.aircraft, &parameters);
        let preset = parameters.gains.selection.estimator;
        let is_option = self.param.iter().any(|setting| setting.starts_with("EST_PRESET="));
        let expected = with_gains.gains.selection.estimator;
        if is_option || preset == expected {
            options.note = preset_note(preset, &setup.sensors);
        } else {
            options.autopilot.push(format!("--param=EST_PRESET={}", expected as u8));
        }
        // Only checked; the autopilot's process reads both again.
        autopilot.links()?;
        autopilot.kept_key()?;
        Ok(options)
    }

    /// Takes a law that the program brings; it flies unless `--law` names another one.
    pub(crate) fn set_own_law(&mut self, own: &OwnLaw) {
        self.own_law = Some(own.clone());
        self.law.get_or_insert_with(|| "own".to_owned());
    }

    /// The options that a process has too, as its words.
    fn words_for<T: Args>(&self) -> Vec<String> {
        let process = T::augment_args(Command::new("process"));
        let takes =
            |option: &str| process.get_arguments().any(|arg| arg.get_long() == Some(option));
        let Ok(Value::Object(options)) = serde_json::to_value(self) else { return Vec::new() };
        let mut words = Vec::new();
        for (option, value) in options.into_iter().filter(|(option, _)| takes(option)) {
            // One word with its value: a value that begins with a dash would else be taken as an option.
            match value {
                Value::Bool(true) => words.push(format!("--{option}")),
                Value::String(value) => words.push(format!("--{option}={value}")),
                Value::Array(values) => {
                    let values = values.iter().filter_map(Value::as_str);
                    words.extend(values.map(|value| format!("--{option}={value}")));
                }
                _ => {}
            }
        }
        words
    }
}

fn parse<T: Args>(program: &'static str, words: &[String]) -> Result<T, Problem> {
    // Usage and hints name the command of the child, which the operator has not typed.
    let refused = |error: clap::Error| problem!("{}", without_frame(&error.to_string()));
    let command = T::augment_args(Command::new(program));
    let all = std::iter::once(program).chain(words.iter().map(String::as_str));
    let matches = command.try_get_matches_from(all).map_err(refused)?;
    T::from_arg_matches(&matches).map_err(refused)
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
        let base = || LaunchArgs {
            parameter_file: some("none"),
            signing_key: some("none"),
            ..LaunchArgs::default()
        };
        for (args, words) in [
            (LaunchArgs { speed: some("-1"), ..base() }, "0.01 to 1000"),
            (LaunchArgs { period_ms: some("7"), ..base() }, "1 to 4"),
            (LaunchArgs { step_us: some("300"), ..base() }, "does not divide"),
            (LaunchArgs { ftc: some("maybe"), ..base() }, "off, armed, always"),
            (
                LaunchArgs { scenario: some("no.toml"), ..base() },
                "the scenarios are nominal, case1",
            ),
            (LaunchArgs { param: vec!["NOPE=1".to_owned()], ..base() }, "NOPE"),
            (LaunchArgs { gcs: vec!["nowhere".to_owned()], ..base() }, "nowhere"),
            (LaunchArgs { mavlink_autopilot: some("apm"), ..base() }, "px4, generic"),
            (LaunchArgs { gcs: vec!["127.0.0.1:0".to_owned()], ..base() }, "127.0.0.1:0 is not"),
            (
                LaunchArgs { instance: some("250"), ..base() },
                "250 is not a whole number from 0 to 249",
            ),
            (LaunchArgs { seed: some("-1"), ..base() }, "from 0 to 18446744073709551615"),
            (LaunchArgs { gcs_tcp: some("5760"), ..base() }, "5760 is not IP:PORT or none"),
            (LaunchArgs { gcs_udp_server: some("x"), ..base() }, "x is not IP:PORT or none"),
            (LaunchArgs { config: some("no.toml"), ..base() }, "no.toml: "),
            (LaunchArgs { script: some("no.txt"), ..base() }, "no.txt: "),
            (LaunchArgs { signing_key: some("/dev/null"), ..base() }, "this is a device"),
        ] {
            let refusal = refusal(&args);
            assert!(refusal.contains(words), "{refusal}");
        }
        assert_eq!(refusal(&base()), "accepted");
    }

    #[test]
    fn a_plan_places_the_aircraft_at_its_home_on_the_ground_or_in_the_air() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let file = |name: &str, first: &str| {
            let path = folder.path().join(name);
            let rows = ["16 0 0 0 0 47.4 8.5 489", first, "16 0 0 0 0 47.41 8.5 60"];
            let rows = rows.iter().enumerate().map(|(number, row)| {
                let frame = if number == 0 { 0 } else { 3 };
                format!("{number}\t0\t{frame}\t{}\t1\n", row.replace(' ', "\t"))
            });
            std::fs::write(&path, format!("QGC WPL 110\n{}", rows.collect::<String>())).unwrap();
            Some(path)
        };
        let some = |text: &str| Some(text.to_owned());
        let base = |plan: Option<PathBuf>| LaunchArgs {
            parameter_file: some("none"),
            signing_key: some("none"),
            airframe: some("aerosonde"),
            plan,
            ..LaunchArgs::default()
        };
        let takeoff = file("takeoff.txt", "22 0 0 0 0 47.405 8.5 50");
        let air = file("air.txt", "16 0 0 0 0 47.405 8.5 70");
        let words =
            |args: LaunchArgs| args.check().map_err(|error| error.to_string()).unwrap().plant;
        let on_ground = words(base(takeoff.clone()));
        assert!(on_ground.contains(&"--scenario=field".to_owned()), "{on_ground:?}");
        let is_there = |word: &String| word.starts_with("--home=47.4") && word.contains(",489,");
        assert!(on_ground.iter().any(is_there), "{on_ground:?}");
        let in_air = words(base(air));
        assert!(!in_air.iter().any(|word| word.starts_with("--scenario")), "{in_air:?}");
        let parked = words(LaunchArgs {
            scenario: some("field"),
            ..base(file("air.txt", "16 0 0 0 0 47.405 8.5 70"))
        });
        assert!(
            parked.iter().any(|word| word.starts_with("--home=47.4") && word.contains(",700,"))
        );
        let refused = refusal(&LaunchArgs { scenario: some("nominal"), ..base(takeoff) });
        assert!(refused.ends_with("scenario nominal has no ground; field has one"), "{refused}");
        assert!(refusal(&base(Some("no.plan".into()))).contains("no.plan"));
    }

    #[test]
    fn the_preset_of_the_estimator_follows_the_sensors_and_one_that_the_user_sets_stands_and_is_announced()
     {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = |name: &str| folder.path().join(name).display().to_string();
        let (scenario, gains) = (path("consumer.toml"), path("gains.toml"));
        std::fs::write(&scenario, "[plant]\nseed = 1\n[plant.sensors]\ngrade = \"consumer\"\n")
            .unwrap();
        std::fs::write(&gains, "EST_PRESET = 0\n").unwrap();
        let base = || LaunchArgs {
            parameter_file: Some("none".to_owned()),
            signing_key: Some("none".to_owned()),
            scenario: Some(scenario.clone()),
            ..LaunchArgs::default()
        };
        let added = |args: LaunchArgs| {
            let options = args.check().map_err(|error| error.to_string()).unwrap();
            let added = options.autopilot.last().is_some_and(|word| word == "--param=EST_PRESET=1");
            (added, options.note)
        };
        let note = "EST_PRESET is 0 as set; for consumer sensors it would be 1".to_owned();
        let set = |value: &str| vec![format!("EST_PRESET={value}")];
        for (args, expected) in [
            (LaunchArgs { scenario: None, ..base() }, (false, None)),
            (base(), (true, None)),
            (LaunchArgs { gains: Some(gains.clone()), ..base() }, (false, Some(note.clone()))),
            (LaunchArgs { param: set("0"), ..base() }, (false, Some(note))),
        ] {
            let shown = format!("{args:?}");
            assert_eq!(added(args), expected, "{shown}");
        }
    }
}
