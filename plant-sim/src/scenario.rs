//! Scenarios: a file becomes a [`Scenario`].
//!
//! A file has two tables. `[plant]` is read here; `[autopilot]` belongs to the flight software and is
//! ignored, so that neither side needs to know the other's keys.

use icd::{ControlPeriod, EffectorList, SimTime};
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::airframe::Airframe;
use crate::config::{self, ConfigError};
use crate::earth::EarthModel;
use crate::faults::ScheduledFault;
use crate::range::check_range;
use crate::sensors::SensorSettings;
use crate::setup::PlantSetup;
use crate::start::{Start, StartPart};
use crate::wind::WindSettings;

mod fault_table;

use fault_table::FaultTable;

/// Level flight without commands and without faults.
pub const NOMINAL: &str = include_str!("../scenarios/nominal.toml");
/// The paper's first case: climb with a left elevator that jams at +30 degrees.
pub const CASE1: &str = include_str!("../scenarios/case1.toml");
/// The paper's second case: turn with a rudder that jams at +7 degrees.
pub const CASE2: &str = include_str!("../scenarios/case2.toml");

/// The scenarios that come with the program, by name.
pub const SCENARIOS: [(&str, &str); 3] = [("nominal", NOMINAL), ("case1", CASE1), ("case2", CASE2)];

/// The plant's part of one scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The plant's part.
    pub plant: PlantPart,
}

/// The plant's part of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantPart {
    /// Seed of the random streams.
    pub seed: u64,
    /// Duration of the flight, s; `None` where the scenario has no duration.
    pub duration_s: Option<f64>,
    /// Where the flight starts; missing values are those of the design point of the airframe.
    pub start: StartPart,
    /// The Earth model; WGS-84 if the file has none.
    pub earth: EarthModel,
    /// Wind and turbulence; calm if the file has none.
    pub wind: WindSettings,
    /// Errors of the sensors; ideal if the file has none.
    pub sensors: SensorSettings,
    /// The faults and their times.
    pub faults: Vec<ScheduledFault>,
}

impl Scenario {
    /// Reads a scenario file for an aircraft with these effectors; errors call it `name`.
    ///
    /// # Errors
    /// [`ConfigError`] with line and column for text that is not TOML of the right shape, with key, value and range
    /// for an invalid number. [`crate::Plant::new`] checks whether the aircraft can have the
    /// faults.
    pub fn from_toml(
        name: &str,
        text: &str,
        effectors: &EffectorList,
    ) -> Result<Self, ConfigError> {
        config::parse::<ScenarioFile>(name, text)?.into_scenario(name, effectors)
    }

    /// Reads a file that was parsed already and may have been changed since.
    ///
    /// # Errors
    /// As [`Scenario::from_toml`], without line and column.
    pub fn from_table(
        name: &str,
        table: toml::Table,
        effectors: &EffectorList,
    ) -> Result<Self, ConfigError> {
        config::of_table::<ScenarioFile>(name, table)?.into_scenario(name, effectors)
    }
}

impl PlantPart {
    /// The flight of this scenario with an aircraft, as run number `run`.
    #[must_use]
    pub fn setup(
        &self,
        airframe: Airframe,
        run: u64,
        period: ControlPeriod,
        step_us: u32,
    ) -> PlantSetup {
        PlantSetup {
            start: self.start.over(&airframe.design_point),
            airframe,
            earth: self.earth,
            wind: self.wind,
            sensors: self.sensors,
            faults: self.faults.clone(),
            seed: self.seed,
            run,
            period,
            step_us,
        }
    }
}

/// The plant's part of a scenario file as written: the keys that it has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    plant: PlantTable,
    #[serde(default, rename = "autopilot")]
    _autopilot: Option<IgnoredAny>,
}

impl ScenarioFile {
    fn into_scenario(self, name: &str, effectors: &EffectorList) -> Result<Scenario, ConfigError> {
        Ok(Scenario { plant: self.plant.into_part(name, effectors)? })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantTable {
    seed: u64,
    duration_s: Option<f64>,
    earth: Option<EarthModel>,
    #[serde(default)]
    start: StartPart,
    wind: Option<WindTable>,
    sensors: Option<SensorTable>,
    #[serde(default)]
    fault: Vec<FaultTable>,
}

/// Missing values are calm.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct WindTable {
    speed_m_s: f64,
    towards_deg: f64,
    down_m_s: f64,
    turbulence_m_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorTable {
    gyro_noise_deg_s: f64,
}

/// A start within all ranges, for a check of the given keys.
const ANYWHERE: Start = Start {
    altitude_m: 1_000.0,
    airspeed_m_s: 100.0,
    heading_rad: 0.0,
    latitude_rad: 0.0,
    longitude_rad: 0.0,
};

impl PlantTable {
    fn into_part(self, file: &str, effectors: &EffectorList) -> Result<PlantPart, ConfigError> {
        let range = config::in_file(file);
        if let Some(duration_s) = self.duration_s {
            check_range("plant", "duration_s", duration_s, 0.001, SimTime::MAX_SECONDS)
                .map_err(&range)?;
        }
        self.start.over(&ANYWHERE).check().map_err(&range)?;
        let wind = self.wind.map_or(WindSettings::CALM, |w| WindSettings {
            speed_m_s: w.speed_m_s,
            towards_rad: w.towards_deg.to_radians(),
            down_m_s: w.down_m_s,
            turbulence_m_s: w.turbulence_m_s,
        });
        wind.check().map_err(&range)?;
        let sensors = self.sensors.map_or(SensorSettings::IDEAL, |s| SensorSettings {
            gyro_noise_rad_s: s.gyro_noise_deg_s.to_radians(),
        });
        sensors.check().map_err(&range)?;
        let faults = self.fault.iter().enumerate();
        Ok(PlantPart {
            seed: self.seed,
            duration_s: self.duration_s,
            start: self.start,
            earth: self.earth.unwrap_or(EarthModel::Wgs84),
            wind,
            sensors,
            faults: faults
                .map(|(i, f)| f.read(file, i + 1, effectors))
                .collect::<Result<_, _>>()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::fault::{FaultKind, Repeat, SensorKind, Side, TargetClass, Timing, Travel};
    use icd::tvc_jet;

    fn refusal(scenario: &str, from: &str, to: &str) -> String {
        assert!(scenario.contains(from), "the file has no {from}");
        let text = scenario.replacen(from, to, 1);
        Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).unwrap_err().to_string()
    }

    #[test]
    fn the_scenarios_of_the_crate_are_those_of_the_paper() {
        let nominal =
            Scenario::from_toml("nominal.toml", NOMINAL, &tvc_jet::effectors()).unwrap().plant;
        assert_eq!(nominal.faults, []);
        // The flight begins at the design point of whatever airframe flies it.
        assert_eq!((nominal.start, nominal.duration_s), (StartPart::default(), None));

        let case1 = Scenario::from_toml("case1.toml", CASE1, &tvc_jet::effectors()).unwrap().plant;
        let jam = |effector: icd::Effector, degrees: f64, seconds: u64| ScheduledFault {
            target: effector.into(),
            kind: FaultKind::StuckAt { angle_rad: degrees.to_radians(), travel: Travel::Jump },
            timing: Timing::at(SimTime::from_micros(seconds * 1_000_000)),
        };
        assert_eq!(case1.faults, [jam(tvc_jet::LEFT_ELEVATOR, 30.0, 3)]);
        assert_eq!(case1.duration_s, Some(90.0));

        let case2 = Scenario::from_toml("case2.toml", CASE2, &tvc_jet::effectors()).unwrap().plant;
        assert_eq!(case2.faults, [jam(tvc_jet::RUDDER, 7.0, 1)]);
        assert_eq!(case2.duration_s, Some(40.0));
    }

    #[test]
    fn every_kind_of_the_catalogue_is_read_by_its_keys() {
        let list = tvc_jet::effectors();
        for code in 1..=u8::MAX {
            let Some(kind) = FaultKind::from_code(code, [0.5, 0.5]) else { break };
            for (effector, class) in
                [("rudder", TargetClass::Angle), ("engine", TargetClass::Thrust)]
            {
                let info = kind.info();
                let mut lines = format!("effector = \"{effector}\"\nkind = \"{}\"\n", info.key);
                for (number, value) in info.numbers.iter().zip(kind.values()) {
                    let (key, measure) = (number.quantity.key(class), number.quantity.measure());
                    lines += &format!("{key} = {:?}\n", measure.unit(class).from_si(value));
                }
                if let Some(choice) = info.choice {
                    let word = choice.alternatives[usize::from(code - info.code)].key;
                    lines += &format!("{} = \"{word}\"\n", choice.key);
                }
                let read = with_fault(&lines).unwrap();
                assert_eq!(read.target, list.by_key(effector).unwrap().into());
                assert_eq!(read.kind.code(), code, "{lines}");
                let off = read.kind.values().into_iter().zip(kind.values()).map(|(a, b)| a - b);
                assert!(off.into_iter().all(|off| off.abs() < 1.0e-9), "{lines}: {:?}", read.kind);
            }
        }
    }

    #[test]
    fn a_fault_of_a_sensor_is_read_and_left_to_the_plant() {
        let table = "sensor = \"gnss\"\nkind = \"stuck_here\"";
        assert_eq!(with_fault(table).unwrap().target, SensorKind::Gnss.into());
        let unknown = with_fault("sensor = \"radar\"\nkind = \"stuck_here\"").unwrap_err();
        assert!(unknown.contains("sensor = `radar`, the aircraft has only gyro,"), "{unknown}");
        let both = format!("effector = \"rudder\"\n{table}");
        assert!(with_fault(&both).unwrap_err().contains("of an effector or of a sensor"));
        let neither = with_fault("kind = \"stuck_here\"").unwrap_err();
        assert!(neither.contains("missing field `effector`"), "{neither}");
        let unknown = with_fault("effector = \"rudder\"\nkind = \"broken\"").unwrap_err();
        assert!(
            unknown.contains("unknown variant `broken`, expected one of `stuck_here`"),
            "{unknown}"
        );
        let key =
            with_fault("effector = \"rudder\"\nkind = \"float\"\nanglee_deg = 3").unwrap_err();
        assert!(key.contains("unknown field `anglee_deg`, expected one of `effector`"), "{key}");
    }

    #[test]
    fn every_kind_of_fault_can_be_written() {
        let text = format!(
            "{NOMINAL}\n[[plant.fault]]\neffector = \"rudder\"\nkind = \"stuck_here\"\nonset_s = 1.0\nclear_s = 2.5\n\
             [[plant.fault]]\neffector = \"engine\"\nkind = \"partial_loss\"\nremaining_percent = 40\nonset_s = 2\n\
             [[plant.fault]]\neffector = \"nozzle_yaw\"\nkind = \"float\"\nonset_s = 3\n\
             [[plant.fault]]\neffector = \"left_aileron\"\nkind = \"stuck_at\"\nangle_deg = -5\n\
             travel = \"actuator_rate\"\nonset_s = 4\n"
        );
        let faults =
            Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).unwrap().plant.faults;
        assert_eq!(faults[0].timing.duration_s, Some(1.5));
        assert_eq!(faults[1].kind, FaultKind::PartialLoss { remaining: 0.4 });
        assert_eq!(faults[2].kind, FaultKind::Float);
        let angle_rad = (-5.0_f64).to_radians();
        let travel = Travel::AtActuatorRate;
        assert_eq!(faults[3].kind, FaultKind::StuckAt { angle_rad, travel });
    }

    /// The nominal flight with one fault that has these lines besides its onset at 1 s.
    fn with_fault(lines: &str) -> Result<ScheduledFault, String> {
        let text = format!("{NOMINAL}\n[[plant.fault]]\nonset_s = 1\n{lines}\n");
        let scenario = Scenario::from_toml("my.toml", &text, &tvc_jet::effectors())
            .map_err(|error| error.to_string())?;
        Ok(scenario.plant.faults[0])
    }

    #[test]
    fn every_kind_has_its_keys_with_the_units_of_its_effector() {
        use FaultKind as K;
        let degrees = |value: f64| value.to_radians();
        let table = [
            ("rudder", "hard_over", "side = \"negative\"", K::HardOver { side: Side::Negative }),
            ("rudder", "slow", "rate_deg_s = 5", K::Slow { rate: degrees(5.0) }),
            ("engine", "slow", "rate_kn_s = 2.5", K::Slow { rate: 2_500.0 }),
            ("engine", "delayed", "delay_ms = 250", K::Delayed { delay_s: 0.25 }),
            (
                "nozzle_yaw",
                "intermittent",
                "period_s = 0.5\npresent_percent = 50",
                K::Intermittent { period_s: 0.5, present: 0.5 },
            ),
            (
                "left_elevator",
                "oscillating",
                "amplitude_deg = 3\nfrequency_hz = 1.5",
                K::Oscillating { amplitude: degrees(3.0), frequency_hz: 1.5 },
            ),
            ("right_aileron", "drifting", "rate_deg_s = -0.5", K::Drifting { rate: degrees(-0.5) }),
            ("engine", "biased", "bias_kn = -3", K::Biased { bias: -3_000.0 }),
            ("rudder", "limited_travel", "limit_deg = 8", K::LimitedTravel { limit: degrees(8.0) }),
            ("engine", "limited_travel", "limit_kn = 20", K::LimitedTravel { limit: 20_000.0 }),
            ("engine", "flame_out", "", K::FlameOut),
        ];
        for (effector, kind, keys, expected) in table {
            let lines = format!("effector = \"{effector}\"\nkind = \"{kind}\"\n{keys}");
            let fault = with_fault(&lines).unwrap();
            assert_eq!(
                (fault.target, fault.kind),
                (tvc_jet::effectors().by_key(effector).unwrap().into(), expected)
            );
        }
    }

    #[test]
    fn ramp_duration_and_repetition_are_read() {
        let rudder = "effector = \"rudder\"\nkind = \"biased\"\nbias_deg = 2\n";
        let timing = |keys: &str| with_fault(&format!("{rudder}{keys}")).map(|fault| fault.timing);
        let whole = Timing {
            ramp_s: 0.5,
            duration_s: Some(2.0),
            repeat: Some(Repeat { every_s: 5.0, times: Some(3) }),
            ..Timing::at(SimTime::from_micros(1_000_000))
        };
        let keys = "ramp_s = 0.5\nduration_s = 2\nevery_s = 5\ntimes = 3";
        assert_eq!(timing(keys), Ok(whole));
        for (keys, problem) in [
            ("ramp_s = -1", "[plant.fault] ramp_s = -1 is outside 0 to 3600"),
            ("duration_s = 1\nramp_s = 2", "[plant.fault] duration_s = 1 is outside 2 to 2592000"),
            (
                "duration_s = 2\nevery_s = 1",
                "[plant.fault] every_s = 1 is outside 2.000001 to 2592000",
            ),
            (
                "duration_s = 2\nevery_s = 3\ntimes = 1",
                "[plant.fault] times = 1 is outside 2 to 1000",
            ),
            ("every_s = 3", "[[plant.fault]] number 1, kind biased: duration_s is missing"),
            ("times = 3", "[[plant.fault]] number 1, kind biased: every_s is missing"),
            (
                "clear_s = 3\nduration_s = 1",
                "[[plant.fault]] number 1, kind biased: clear_s excludes duration_s",
            ),
        ] {
            assert_eq!(timing(keys), Err(format!("my.toml: {problem}")));
        }
        assert_eq!(
            with_fault("effector = \"rudder\"\nkind = \"stuck_here\"\nramp_s = 1"),
            Err("my.toml: [plant.fault] ramp_s = 1 is outside 0 to 0".to_owned())
        );
    }

    #[test]
    fn a_number_of_a_fault_in_the_wrong_unit_or_range_is_refused() {
        for (lines, problem) in [
            (
                "effector = \"engine\"\nkind = \"biased\"\nbias_deg = 3",
                "[[plant.fault]] number 1, kind biased: bias_kn is missing",
            ),
            (
                "effector = \"rudder\"\nkind = \"biased\"\nbias_deg = 3\nbias_kn = 3",
                "[[plant.fault]] number 1, kind biased: bias_kn has no meaning here",
            ),
            (
                "effector = \"rudder\"\nkind = \"hard_over\"",
                "[[plant.fault]] number 1, kind hard_over: side is missing",
            ),
            (
                "effector = \"rudder\"\nkind = \"float\"\nside = \"positive\"",
                "[[plant.fault]] number 1, kind float: side has no meaning here",
            ),
            (
                "effector = \"rudder\"\nkind = \"delayed\"\ndelay_ms = 1001",
                "[plant.fault] delay_ms = 1001 is outside 0 to 1000",
            ),
            (
                "effector = \"rudder\"\nkind = \"oscillating\"\namplitude_deg = 1\nfrequency_hz = nan",
                "[plant.fault] frequency_hz = NaN is outside 0.001 to 20",
            ),
        ] {
            assert_eq!(with_fault(lines), Err(format!("my.toml: {problem}")));
        }
    }

    #[test]
    fn a_start_and_a_wind_may_have_only_the_keys_that_differ() {
        let text = NOMINAL.split("[plant.wind]").next().unwrap();
        let text = format!(
            "{text}[plant.wind]\nturbulence_m_s = 2.0\n[plant.start]\naltitude_m = 3000.0\n"
        );
        let plant = Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).unwrap().plant;
        let airframe = Airframe::paper();
        let at = airframe.design_point;
        let start = Start { altitude_m: 3_000.0, ..at };
        let setup = plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
        assert_eq!(setup.start, start);
        assert_eq!(setup.wind, WindSettings { turbulence_m_s: 2.0, ..WindSettings::CALM });
    }

    #[test]
    fn the_autopilots_table_is_not_read() {
        let text = format!("{NOMINAL}\n[autopilot.whatever]\nit = \"likes\"\n");
        assert!(Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).is_ok());
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_line() {
        let message = refusal(NOMINAL, "seed", "sead");
        assert!(message.contains("sead") && message.contains("line"), "{message}");
    }

    #[test]
    fn values_out_of_range_name_key_value_and_range() {
        assert_eq!(
            refusal(CASE1, "altitude_m = 5000.0", "altitude_m = -5.0"),
            "my.toml: [plant.start] altitude_m = -5 is outside 1 to 25000"
        );
        assert_eq!(
            refusal(CASE1, "onset_s = 3.0", "onset_s = -3.0"),
            "my.toml: [plant.fault] onset_s = -3 is outside 0 to 2592000"
        );
        assert_eq!(
            refusal(CASE1, "angle_deg = 30.0", "angle_deg = nan"),
            "my.toml: [plant.fault] angle_deg = NaN is outside -90 to 90"
        );
    }

    #[test]
    fn a_fault_with_too_few_or_too_many_keys_is_refused() {
        assert_eq!(
            refusal(CASE1, "angle_deg = 30.0", ""),
            "my.toml: [[plant.fault]] number 1, kind stuck_at: angle_deg is missing"
        );
        assert_eq!(
            refusal(CASE1, "stuck_at", "float"),
            "my.toml: [[plant.fault]] number 1, kind float: angle_deg has no meaning here"
        );
    }

    #[test]
    fn a_fault_that_ends_before_it_begins_is_refused() {
        assert_eq!(
            refusal(CASE1, "onset_s = 3.0", "onset_s = 3.0\nclear_s = 2.0"),
            "my.toml: [[plant.fault]] number 1: clear_s = 2 is not after onset_s = 3"
        );
    }
}
