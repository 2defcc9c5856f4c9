//! From names, files and `--set` to a flight: the options that every command which flies in one process takes.
//!
//! ```text
//! SetupOptions ─> SetupBuilder (aircraft, model, laws, read once) ─ scenario, more settings ─> FlightSetup
//! ```

use std::path::PathBuf;
use std::sync::Arc;

use autopilot::config::Model;
use autopilot::parameters::Parameters;
use autopilot::run::{Ftc, LawArgs};
use flight_control::estimator::EstimatorPreset;
use flight_control::{AircraftModel, AllocationMode, MainLaw};
use icd::{ControlPeriod, SimTime};
use plant_sim::io::{parse_period, whole};
use plant_sim::setup::default_step_us;
use plant_sim::{Airframe, GradeName, SensorSettings};
use toml::Value;

use crate::configuration::{AircraftArgs, Named};
use crate::flight::FlightSetup;
use crate::problem::{At as _, Problem};
use crate::settings::{self, Setting, Target};

/// Duration of a scenario without one, s.
const DURATION_S: f64 = 60.0;

/// Everything about a flight but what is flown.
///
/// ```
/// use lab_engine::SetupOptions;
///
/// let mut options = SetupOptions::default();
/// options.aircraft("f16").set("plant.wind.turbulence_m_s", 3.0).set("plant.seed", 7);
/// options.laws.law = Some(flight_control::MainLaw::Ndi);
/// let setup = options.setup("nominal")?;
/// assert_eq!(setup.plant.seed, 7);
/// # Ok::<(), lab_engine::Problem>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub struct SetupOptions {
    /// Aircraft and settings.
    #[command(flatten)]
    pub aircraft: AircraftArgs,
    /// Main controller, estimator of the compensator, gains.
    #[command(flatten)]
    pub laws: LawArgs,
    /// Whether the compensator acts
    #[arg(long, value_enum, value_name = "MODE")]
    pub ftc: Option<Ftc>,
    /// Control period, 1 to 4 ms
    #[arg(long, allow_negative_numbers = true, value_name = "MS", default_value = "2", value_parser = parse_period)]
    pub period_ms: ControlPeriod,
    /// Integration step, us; divides the control period [default: its largest divisor up to 1000]
    #[arg(long, allow_negative_numbers = true, value_name = "US", value_parser = whole(1, ControlPeriod::MAX_MICROS))]
    pub step_us: Option<u32>,
}

/// Aircraft, model and laws, read once, for any number of flights.
#[derive(Debug, Clone)]
pub struct SetupBuilder {
    /// The aircraft.
    pub airframe: Airframe,
    /// The controller's model, with the defaults of its parameters.
    pub model: Model,
    options: SetupOptions,
    /// Text of the file with gains.
    gains: Option<String>,
    /// Name of the law, for messages.
    law: Option<String>,
    /// Duration of a scenario without one, s.
    duration_s: f64,
}

impl SetupOptions {
    /// Flies another aircraft, by name or from a file.
    pub fn aircraft(&mut self, name: impl Into<PathBuf>) -> &mut Self {
        self.aircraft.airframe = Some(name.into());
        self
    }

    /// Sets a key, as `--set` does.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) -> &mut Self {
        self.aircraft.settings.push(Setting::new(key, value));
        self
    }

    /// Integration step of the plant, us.
    pub fn plant_step_us(&self) -> u32 {
        self.step_us.unwrap_or_else(|| default_step_us(self.period_ms))
    }

    /// The flight of a scenario, by name or from a file.
    pub fn setup(&self, scenario: &str) -> Result<FlightSetup, Problem> {
        self.builder()?.setup(&Named::scenario(scenario)?, &[])
    }

    /// Reads aircraft and model.
    pub fn builder(&self) -> Result<SetupBuilder, Problem> {
        let LawArgs { law, compensator, allocation, .. } = &self.laws;
        // A law that the program brings may be replaced.
        let law = law.filter(|law| *law != MainLaw::Own);
        let allocation = allocation.filter(|allocation| *allocation != AllocationMode::Own);
        let given = [
            self.ftc.map(|_| ("FTC_MODE", "--ftc")),
            law.map(|_| ("CTL_LAW", "--law")),
            compensator.map(|_| ("FTC_LAW", "--compensator")),
            allocation.map(|_| ("FTC_ALLOC", "--allocation")),
        ];
        self.aircraft.check_beside(given.into_iter().flatten())?;
        let (airframe, model) = (self.aircraft.airframe()?, self.aircraft.model()?);
        SetupBuilder::of(airframe, model, self.clone())
    }
}

impl SetupBuilder {
    /// Of an aircraft and a model that were read with these options.
    pub fn of(airframe: Airframe, model: Model, options: SetupOptions) -> Result<Self, Problem> {
        let gains = options.laws.gains_text()?;
        Ok(Self { airframe, model, options, gains, law: None, duration_s: DURATION_S })
    }

    /// With the name of the law, which messages about its parameters have.
    #[must_use]
    pub fn of_law(mut self, name: &str) -> Self {
        self.law = Some(name.to_owned());
        self
    }

    /// With another duration, s, of a scenario that has none.
    #[must_use]
    pub fn lasting(mut self, duration_s: f64) -> Self {
        self.duration_s = duration_s;
        self
    }

    /// The flight of a scenario with `more` settings, which win over those of the options.
    pub fn setup(&self, scenario: &Named, more: &[Setting]) -> Result<FlightSetup, Problem> {
        let SetupOptions { aircraft, laws, period_ms, .. } = &self.options;
        let settings = aircraft.settings.iter().chain(more).cloned().collect();
        let all = AircraftArgs { settings, ..aircraft.clone() };
        let changes = |target| more.iter().any(|setting| setting.target() == Ok(target));
        // Read anew only where this flight has another one.
        let airframe = match changes(Target::Airframe) {
            true => all.airframe()?,
            false => self.airframe.clone(),
        };
        let model = if changes(Target::Model) { all.model()? } else { self.model };
        let flight = all.scenario(scenario, &airframe.effectors)?;
        let step_us = self.options.plant_step_us();
        let plant = flight.plant.setup(airframe, 0, *period_ms, step_us);
        plant.check()?;
        plant.check_faults().at(format_args!("scenario {}", scenario.name))?;
        // Its sensors are known only with the scenario. What is set below wins over their preset.
        let parameters = fitted(model.defaults, &plant.sensors);
        let parameters = self.parameters(parameters, &all.settings, &model.aircraft);
        let parameters = match &self.law {
            Some(law) => parameters.at(format_args!("law {law}"))?,
            None => parameters?,
        };
        let duration_s = flight.plant.duration_s.unwrap_or(self.duration_s);
        Ok(FlightSetup {
            plant,
            model: model.aircraft,
            parameters,
            references: flight.references,
            script: flight.script.map(Arc::new),
            own_law: laws.own.clone(),
            knows_fault: false,
            // Its range was checked with the scenario.
            duration: SimTime::from_seconds(duration_s).unwrap_or(SimTime::ZERO),
        })
    }

    /// Parameters with what laws, options and settings change in them.
    fn parameters(
        &self,
        mut parameters: Parameters,
        settings: &[Setting],
        model: &AircraftModel,
    ) -> Result<Parameters, Problem> {
        // Gains, options and single settings in this order: each wins over the one before.
        self.options.laws.apply(&mut parameters, self.gains.as_deref(), model)?;
        if let Some(ftc) = self.options.ftc {
            parameters.set("FTC_MODE", ftc.value()).at("--ftc")?;
        }
        settings::set_parameters(&mut parameters, settings)?;
        parameters.check_law()?;
        Ok(parameters)
    }
}

/// The estimator's preset for sensors of a grade.
pub const fn preset_of(grade: GradeName) -> EstimatorPreset {
    match grade {
        GradeName::Consumer => EstimatorPreset::Consumer,
        GradeName::Ideal | GradeName::Tactical => EstimatorPreset::Parameters,
    }
}

/// Parameters before anybody sets one: those of the model, with the estimator's preset of the fitted sensors.
pub fn fitted(mut defaults: Parameters, sensors: &SensorSettings) -> Parameters {
    if sensors.name == GradeName::Consumer {
        defaults.gains.selection.estimator = preset_of(sensors.name);
    }
    defaults
}

/// Tells the operator that the estimator assumes sensors other than the fitted ones, because its preset was set by hand.
pub fn preset_note(preset: EstimatorPreset, sensors: &SensorSettings) -> Option<String> {
    let expected = preset_of(sensors.name);
    // With ideal sensors the estimator does not fly unless it is selected.
    let differs = sensors.name != GradeName::Ideal && preset != expected;
    differs.then(|| {
        format!(
            "EST_PRESET is {} as set; for {} sensors it would be {}",
            preset as u8,
            sensors.name.key(),
            expected as u8,
        )
    })
}
