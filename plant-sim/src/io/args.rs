//! Command line of the plant.

use std::fmt::{self, Display};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use host_io::file::{self, TEXT_MAX, names};
pub use host_io::instance::whole;
use host_io::problem::{At as _, Problem, problem};
pub use host_io::process::CORE_MAX;
use host_io::{Instance, Wait};
use icd::pace::Pace;
use icd::{ControlPeriod, SimTime};

use crate::airframe::Airframe;
use crate::airframe_file::ReadAirframe as _;
use crate::earth::EarthModel;
use crate::geodesy::Geodetic;
use crate::ground::GroundStart;
use crate::plant::Plant;
use crate::scenario::{PlantPart, Scenario};
use crate::setup::{PlantSetup, default_step_us};
use aircraft::{AIRFRAMES, DEFAULT_NAME};
use scenarios::SCENARIOS;

/// Run number of a live flight; campaigns count from 0.
const RUN: u64 = 0;

/// Options of the plant.
#[derive(Debug, Clone, clap::Args)]
pub struct PlantArgs {
    #[arg(long, value_name = "NAME|FILE", default_value = "nominal", help = format!("What is flown: {}, or a file", names(SCENARIOS)))]
    pub scenario: String,
    #[arg(
        long,
        value_name = "NAME|FILE",
        default_value = DEFAULT_NAME,
        help = format!("The aircraft: {}, or a file", names(AIRFRAMES))
    )]
    pub airframe: PathBuf,
    /// Number of this vehicle among several on this computer
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value = "0")]
    pub instance: Instance,
    /// Where the autopilot listens [default: 127.0.0.1:9960, and N higher for instance N]
    #[arg(long, value_name = "HOST:PORT")]
    pub autopilot: Option<String>,
    /// Simulation time per wall time, 0.01 to 1000, or max
    #[arg(long, allow_negative_numbers = true, value_name = "FACTOR|max", default_value = "1")]
    pub speed: Speed,
    /// Let simulation time stand still at the start, until an operator lets it run
    #[arg(long)]
    pub start_paused: bool,
    /// Control period, 1 to 4 ms
    #[arg(long, allow_negative_numbers = true, value_name = "MS", default_value = "2", value_parser = parse_period)]
    pub period_ms: ControlPeriod,
    /// Integration step, us; divides the control period [default: its largest divisor up to 1000]
    #[arg(long, allow_negative_numbers = true, value_name = "US", value_parser = whole(1, ControlPeriod::MAX_MICROS))]
    pub step_us: Option<u32>,
    /// flat, wgs84, round or round_non_rotating, instead of the scenario's
    #[arg(long, value_name = "MODEL", value_parser = parse_earth)]
    pub earth: Option<EarthModel>,
    /// Where the flight begins, instead of the scenario's place: degrees, m above the ellipsoid (of the runway, or of an aircraft in the
    /// air), degrees from north
    #[arg(long, allow_hyphen_values = true, value_name = "LAT,LON,ALTITUDE,HEADING")]
    pub home: Option<StartPlace>,
    /// Seed of all random streams, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = whole(0, u64::MAX))]
    pub seed: Option<u64>,
    /// White noise of the gyros, deg/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S")]
    pub gyro_noise_deg_s: Option<f64>,
    /// Turbulence, m/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "M_S")]
    pub turbulence_m_s: Option<f64>,
    /// End at this simulation time, or on the ground [default: at the scenario's duration_s, if it has one]
    #[arg(long, allow_negative_numbers = true, value_name = "S", value_parser = parse_seconds)]
    pub until_s: Option<SimTime>,
    /// Write the truth of every tick to this file
    #[arg(long, value_name = "FILE")]
    pub truth_log: Option<PathBuf>,
    /// Write this file once a second while the autopilot answers (for health checks of containers)
    #[arg(long, value_name = "FILE")]
    pub health_file: Option<PathBuf>,
    /// Run the link on this core only
    #[arg(long, allow_negative_numbers = true, value_name = "CORE", value_parser = whole(0, CORE_MAX))]
    pub cpu: Option<usize>,
    /// How to wait for answers: block, yield or spin
    #[arg(long, value_name = "HOW", default_value = "block")]
    pub wait: Wait,
    /// Fly exactly this setup (postcard), whatever the options above say
    #[arg(long, value_name = "FILE", hide = true)]
    pub setup: Option<PathBuf>,
    /// Print one line of JSON about the flight at its end
    #[arg(long, hide = true)]
    pub report: bool,
    /// Take orders about time from the standard input (pause, run, step N, speed X), and end when it ends
    #[arg(long, hide = true)]
    pub with_parent: bool,
    /// Print one line of JSON whenever simulation time begins to pass in another way
    #[arg(long, hide = true)]
    pub status: bool,
}

impl PlantArgs {
    /// The setup of the flight from the options.
    pub fn plant_setup(&self) -> Result<PlantSetup, Problem> {
        if let Some(path) = &self.setup {
            let bytes = file::read(path, TEXT_MAX).at(path.display())?;
            return postcard::from_bytes(&bytes)
                .map_err(|_| problem!("{}: not a plant setup of this version", path.display()));
        }
        let airframe = self.read_airframe()?;
        let plant = self.scenario(&airframe)?;
        let step_us = self.step_us.unwrap_or_else(|| default_step_us(self.period_ms));
        let mut setup = plant.setup(airframe, RUN, self.period_ms, step_us);
        setup.earth = self.earth.unwrap_or(setup.earth);
        setup.seed = self.seed.unwrap_or(setup.seed);
        if let Some(home) = self.home {
            home.place(&mut setup);
        }
        if let Some(noise) = self.gyro_noise_deg_s {
            setup.sensors.gyro_noise_rad_s = noise.to_radians();
        }
        if let Some(intensity_m_s) = self.turbulence_m_s {
            setup.wind = setup.wind.with_turbulence_m_s(intensity_m_s);
        }
        // After the options, which may be out of range as well.
        setup.check()?;
        setup.check_faults().at(&self.scenario)?;
        Ok(setup)
    }

    /// When the flight ends at the latest: at the time of the option, or else at that of the scenario.
    pub fn until(&self) -> Result<Option<SimTime>, Problem> {
        // A setup is complete, so the scenario of the options is not flown.
        if self.until_s.is_some() || self.setup.is_some() {
            return Ok(self.until_s);
        }
        Ok(self.scenario(&self.read_airframe()?)?.duration_s.and_then(SimTime::from_seconds))
    }

    fn read_airframe(&self) -> Result<Airframe, Problem> {
        let path = &self.airframe;
        let read = file::shipped_or_read(path, AIRFRAMES);
        let (name, text) = read.at(format_args!("--airframe {}", path.display()))?;
        Airframe::from_toml(&name, &text)
    }

    fn scenario(&self, airframe: &Airframe) -> Result<PlantPart, Problem> {
        let name = self.scenario.as_str();
        // Names before files: what lies in the folder does not change the meaning of `nominal`.
        let text = match SCENARIOS.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Ok((*text).to_owned()),
            None => file::read_text(Path::new(name), TEXT_MAX),
        };
        let text = match text {
            Err(problem) if problem.is_not_found() => {
                let known = names(SCENARIOS);
                return Err(problem!(
                    "--scenario {name}: there is no such scenario and no such file; the scenarios are {known}"
                ));
            }
            read => read.at(name)?,
        };
        Ok(Scenario::from_toml(name, &text, &airframe.effectors)?.plant)
    }

    /// The aircraft at the start of the flight of this setup.
    pub fn plant(&self, setup: &PlantSetup) -> Result<Plant, Problem> {
        let (airframe, scenario) = (self.airframe_name(), &self.scenario);
        Plant::new(setup).at(format_args!("airframe {airframe}, scenario {scenario}"))
    }

    /// Name of the airframe for messages.
    pub(super) fn airframe_name(&self) -> String {
        self.setup.as_ref().unwrap_or(&self.airframe).display().to_string()
    }
}

/// A control period in milliseconds from the command line.
pub fn parse_period(text: &str) -> Result<ControlPeriod, String> {
    let (min, max) = (ControlPeriod::MIN_MICROS, ControlPeriod::MAX_MICROS);
    let (min_ms, max_ms) = (f64::from(min) / 1.0e3, f64::from(max) / 1.0e3);
    let refused = || format!("{text} is not a number from {min_ms} to {max_ms}");
    let ms: f64 = text.parse().map_err(|_| refused())?;
    if !(min_ms..=max_ms).contains(&ms) {
        return Err(refused());
    }
    // The range was checked above.
    let micros = libm::round(ms * 1.0e3) as u32;
    ControlPeriod::from_micros(micros).map_err(|error| error.to_string())
}

/// An Earth model by its name.
pub fn parse_earth(text: &str) -> Result<EarthModel, String> {
    let found = EarthModel::ALL.into_iter().find(|model| model.key() == text);
    found.ok_or_else(|| {
        format!("the models are {}", EarthModel::ALL.map(EarthModel::key).join(", "))
    })
}

fn parse_seconds(text: &str) -> Result<SimTime, String> {
    let seconds = text.parse().ok().and_then(SimTime::from_seconds);
    seconds.ok_or_else(|| format!("{text} is not a number from 0 to {}", SimTime::MAX_SECONDS))
}

/// Where a flight begins: the runway, or without one the aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartPlace {
    pub place: Geodetic,
    /// Of the runway or the aircraft, rad from north.
    pub heading_rad: f64,
}

impl StartPlace {
    /// Moves the runway there, with the aircraft at its threshold; an aircraft in the air itself.
    pub fn place(&self, setup: &mut PlantSetup) {
        let Self { place, heading_rad } = *self;
        let PlantSetup { ground, start, .. } = setup;
        (start.latitude_rad, start.longitude_rad) = (place.latitude_rad, place.longitude_rad);
        start.heading_rad = heading_rad;
        let Some(ground) = ground else {
            start.altitude_m = place.altitude_m;
            return;
        };
        if ground.start == GroundStart::Air {
            // As high above the runway as before.
            start.altitude_m += place.altitude_m - ground.threshold.altitude_m;
        }
        ground.move_to(place, heading_rad);
    }
}

impl FromStr for StartPlace {
    type Err = Problem;
    fn from_str(text: &str) -> Result<Self, Problem> {
        // Their ranges are those of the setup.
        let numbers: Result<Vec<f64>, _> =
            text.split(',').map(|part| part.trim().parse()).collect();
        let Ok(&[latitude, longitude, altitude_m, heading]) = numbers.as_deref() else {
            return Err(problem!("\"{text}\" is not LAT,LON,ALTITUDE,HEADING: four numbers"));
        };
        let [latitude_rad, longitude_rad] = [latitude, longitude].map(f64::to_radians);
        let place = Geodetic { latitude_rad, longitude_rad, altitude_m };
        Ok(Self { place, heading_rad: heading.to_radians() })
    }
}

impl Display for StartPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Geodetic { latitude_rad, longitude_rad, altitude_m } = self.place;
        let [latitude, longitude, heading] =
            [latitude_rad, longitude_rad, self.heading_rad].map(f64::to_degrees);
        write!(f, "{latitude},{longitude},{altitude_m},{heading}")
    }
}

/// How fast simulation time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// As fast as both processes can.
    Max,
    /// This many times as fast as the wall clock.
    Times(f64),
}

impl Speed {
    /// As fast as the wall clock.
    pub const REAL_TIME: Self = Self::Times(1.0);
}

impl FromStr for Speed {
    type Err = Problem;
    fn from_str(text: &str) -> Result<Self, Problem> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor = text.parse().ok().filter(|factor| Pace::Speed(*factor).is_valid());
        let (min, max) = Pace::SPEED;
        factor.map(Self::Times).ok_or_else(|| {
            problem!("speed {text:?} is neither max nor a number from {min} to {max}")
        })
    }
}

impl Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Max => f.write_str("max"),
            Self::Times(factor) => write!(f, "{factor}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aircraft::DEFAULT_AIRFRAME;
    use clap::{Args, Command, FromArgMatches};
    use scenarios::NOMINAL;
    use std::fs;

    fn parse(options: &[&str]) -> Result<PlantArgs, clap::Error> {
        let command = PlantArgs::augment_args(Command::new("plant-sim"));
        let words = ["plant-sim"].iter().chain(options);
        PlantArgs::from_arg_matches(&command.try_get_matches_from(words)?)
    }

    #[test]
    fn options_replace_values_of_the_scenario() {
        for (period, step_us) in [("4", 1_000), ("2.5", 625), ("1.3", 650), ("1", 1_000)] {
            let setup = parse(&["--period-ms", period]).unwrap().plant_setup().unwrap();
            assert_eq!(setup.step_us, step_us, "{period} ms");
        }
        let options = ["--scenario", "case1", "--earth", "flat", "--seed", "7", "--period-ms", "4"];
        let setup = parse(&options).unwrap().plant_setup().unwrap();
        assert_eq!((setup.earth, setup.seed), (EarthModel::Flat, 7));
        assert_eq!(setup.period.as_micros(), 4_000);
        assert_eq!(setup.faults.len(), 1);
    }

    #[test]
    fn a_fault_that_the_aircraft_cannot_have_names_file_fault_and_effector() {
        let folder = std::env::temp_dir().join(format!("plant-sim-args-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("case.toml");
        let file = path.to_str().unwrap();
        for (table, words) in [
            (
                "effector = \"engine\"\nkind = \"hard_over\"\nside = \"positive\"",
                "case.toml: fault 1 (engine, hard over positive): this effector has no such fault",
            ),
            (
                "effector = \"nozzle_pitch\"\nkind = \"biased\"\nbias_deg = 20",
                "case.toml: fault 1 (nozzle pitch, biased by 20.0 deg): bias 20 deg is outside -15 to 15 deg",
            ),
        ] {
            let text = format!("{NOMINAL}\n[[plant.fault]]\n{table}\nonset_s = 3\n");
            fs::write(&path, text).unwrap();
            let error = parse(&["--scenario", file]).unwrap().plant_setup().unwrap_err();
            assert!(error.to_string().ends_with(words), "{error}");
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn options_out_of_range_name_the_range() {
        for (option, value, range) in [
            ("--period-ms", "5", "1 to 4"),
            ("--period-ms", "NaN", "1 to 4"),
            ("--speed", "0", "0.01 to 1000"),
            ("--until-s", "-1", "0 to 2592000"),
            ("--seed", "-1", "-1 is not a whole number from 0 to 18446744073709551615"),
            ("--seed", "1.5", "from 0 to 18446744073709551615"),
            ("--step-us", "-300", "1 to 4000"),
            ("--cpu", "-1", "0 to 1023"),
            ("--earth", "disc", "flat, wgs84, round, round_non_rotating"),
        ] {
            let error = parse(&[option, value]).unwrap_err().to_string();
            assert!(error.contains(option) && error.contains(range), "{error}");
        }
        for (option, value, key) in [
            ("--gyro-noise-deg-s", "1e9", "gyro_noise_deg_s"),
            ("--turbulence-m-s", "NaN", "turbulence_m_s"),
            ("--step-us", "300", "300 us"),
        ] {
            let error = parse(&[option, value]).unwrap().plant_setup().unwrap_err().to_string();
            assert!(error.contains(key), "{error}");
        }
    }

    #[test]
    fn a_flight_begins_at_the_home_of_an_option_on_the_runway_or_in_the_air() {
        let setup = |scenario: &str| {
            let options = ["--scenario", scenario, "--home=-35.36,149.16,584.1,350"];
            parse(&options).unwrap().plant_setup().unwrap()
        };
        let place = |it: &Geodetic| {
            (it.latitude_rad.to_degrees(), it.longitude_rad.to_degrees(), it.altitude_m)
        };
        let ground = setup("field").ground.unwrap();
        assert_eq!(place(&ground.threshold), (-35.36, 149.16, 584.1));
        assert_eq!((ground.heading_rad, ground.start.along_m()), (350_f64.to_radians(), Some(0.0)));
        let over = |home: &str| {
            let mut setup = parse(&["--scenario=field"]).unwrap().plant_setup().unwrap();
            setup.start.altitude_m = 1_000.0;
            setup.ground.as_mut().unwrap().start = GroundStart::Air;
            home.parse::<StartPlace>().unwrap().place(&mut setup);
            setup.start.altitude_m
        };
        assert_eq!(over("1,2,1500,4"), 1_800.0, "300 m above the runway, as before");
        let start = setup("nominal").start;
        assert_eq!((start.latitude_rad.to_degrees(), start.altitude_m), (-35.36, 584.1));
        for home in ["1,2,3", "1,2,x,4", "1,2,3,4,5"] {
            let error = parse(&["--home", home]).unwrap_err().to_string();
            assert!(error.contains("is not LAT,LON,ALTITUDE,HEADING: four numbers"), "{error}");
        }
        for (scenario, home, words) in [
            ("nominal", "91,2,3,4", "latitude_deg = 91 is outside"),
            ("nominal", "1,2,NaN,4", "altitude_m = NaN is outside"),
            ("nominal", "1,2,300,inf", "heading_deg = inf is outside"),
            ("field", "91,2,3,4", "latitude_deg = 91 is outside"),
            ("field", "1,200,3,4", "longitude_deg = 200 is outside"),
            ("field", "1,2,9500,4", "elevation_m = 9500 is outside"),
            ("field", "1,2,3,inf", "heading_deg = inf is outside"),
        ] {
            let options = ["--scenario", scenario, "--home", home];
            let error = parse(&options).unwrap().plant_setup().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_flight_ends_at_the_duration_of_its_scenario_unless_an_option_gives_another() {
        let until = |options: &[&str]| parse(options).unwrap().until().unwrap();
        let seconds = |s: u64| Some(SimTime::from_micros(s * 1_000_000));
        assert_eq!(until(&["--scenario", "nominal"]), None);
        assert_eq!(until(&["--scenario", "case2"]), seconds(40));
        assert_eq!(until(&["--scenario", "case2", "--until-s", "7"]), seconds(7));
    }

    #[test]
    fn a_missing_scenario_is_named() {
        let error = parse(&["--scenario", "no.toml"]).unwrap().plant_setup().unwrap_err();
        let words = "--scenario no.toml: there is no such scenario and no such file; the scenarios are nominal, case1, case2, field, circuit";
        assert_eq!(error.to_string(), words);
        let error = parse(&["--airframe", "no.toml"]).unwrap().plant_setup().unwrap_err();
        assert!(error.to_string().starts_with("--airframe no.toml: "), "{error}");
    }

    #[test]
    fn an_aircraft_that_cannot_fly_is_refused_with_file_key_value_and_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("jet.toml");
        let file = path.to_str().unwrap();
        for (from, to, words) in [
            ("mass_kg = 9295.0", "mass_kg = 3", "[mass] mass_kg = 3 is too small"),
            ("ixx_kg_m2 = 12875.0", "ixx_kg_m2 = 170000", "ixx_kg_m2 = 170000 is outside"),
            ("mass_kg = 9295.0", "mass_kg = 900000", "steady level flight"),
        ] {
            assert!(DEFAULT_AIRFRAME.contains(from), "the file has no {from}");
            fs::write(&path, DEFAULT_AIRFRAME.replacen(from, to, 1)).unwrap();
            let args = parse(&["--airframe", file]).unwrap();
            let error = args.plant_setup().and_then(|setup| args.plant(&setup)).unwrap_err();
            let error = error.to_string();
            assert!(error.contains(file) && error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_setup_comes_through_a_file_bit_for_bit() {
        let folder = std::env::temp_dir().join(format!("plant-setup-{}", std::process::id()));
        let setup = parse(&["--scenario", "case2"]).unwrap().plant_setup().unwrap();
        fs::write(&folder, postcard::to_stdvec(&setup).unwrap()).unwrap();
        let path = folder.to_str().unwrap();
        let read_back = parse(&["--setup", path]).unwrap().plant_setup();
        fs::remove_file(&folder).unwrap();
        assert_eq!(read_back.unwrap(), setup);
    }

    #[test]
    fn speeds_outside_the_range_are_refused_with_the_range() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("0.01".parse(), Ok(Speed::Times(0.01)));
        for bad in ["0", "-1", "NaN", "inf", "1001", "fast", ""] {
            let error = bad.parse::<Speed>().unwrap_err().to_string();
            let expected = format!("speed {bad:?} is neither max nor a number from 0.01 to 1000");
            assert_eq!(error, expected);
        }
    }
}
