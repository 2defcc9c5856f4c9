//! The paper's two cases and the runs that each needs.

use flight_control::{CompensatorMode, DesignModel, Gains};
use icd::fault::FaultKind;
use icd::{ControlPeriod, SimTime};
use plant_sim::{Airframe, EarthModel, PlantSetup};
use rayon::prelude::*;

use super::Fly;
use host_io::problem::{At as _, Problem, problem};
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, Named};
use lab_judges::closed_loop::FlightSetup;
use lab_judges::trace::{Sample, Trace};

/// A lost aircraft is followed to the ground, but not longer than this, s.
const FOLLOWED_MAX_S: f64 = 600.0;

/// What is the same in all runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// What is flown over.
    pub earth: EarthModel,
    pub period: ControlPeriod,
    /// Step of the plant's integration, us.
    pub step_us: u32,
    /// White noise of each gyro, rad/s rms of each control sample.
    pub gyro_noise_rad_s: f64,
    /// Intensity of the turbulence, m/s rms.
    pub turbulence_m_s: f64,
    /// Seed of the random streams.
    pub seed: u64,
}

/// One case of the paper: the compensated flight, from which the other runs follow.
#[derive(Debug, Clone)]
pub struct Case {
    /// 1 or 2.
    pub number: u32,
    /// The flight with the fault and the compensator armed.
    pub setup: FlightSetup,
    /// When the fault begins, s.
    pub fault_s: f64,
    /// Where the surface jams, rad.
    pub jam_rad: f64,
}

/// The runs of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Run {
    /// No fault, compensator armed.
    NoFault,
    /// No fault, compensator off: the other half of claim 3.
    NoFaultOff,
    /// The fault, compensator off.
    PidOnly,
    /// The fault, compensator armed.
    Compensated,
}

/// The flown runs of one case.
#[derive(Debug, Clone)]
pub struct Flown {
    pub case: Case,
    /// See [`Run::NoFault`].
    pub no_fault: Trace,
    /// See [`Run::NoFaultOff`].
    pub no_fault_off: Trace,
    /// See [`Run::PidOnly`].
    pub pid_only: Trace,
    /// See [`Run::Compensated`].
    pub compensated: Trace,
}

/// What the claims of a case compare.
#[derive(Debug, Clone, Copy)]
pub struct Runs<'a> {
    pub case: &'a Case,
    pub no_fault: &'a Trace,
    /// Flight with the fault and without compensator.
    pub pid_only: &'a Trace,
    /// Flight with the fault and whatever is to deal with it.
    pub compensated: &'a Trace,
}

impl Run {
    pub const ALL: [Self; 4] = [Self::NoFault, Self::NoFaultOff, Self::PidOnly, Self::Compensated];

    pub const fn name(self) -> &'static str {
        match self {
            Self::NoFault => "no fault",
            Self::NoFaultOff => "no fault, compensator off",
            Self::PidOnly => "PID only",
            Self::Compensated => "compensated",
        }
    }
}

impl Case {
    /// Case `number`, 1 or 2, as shipped.
    pub fn new(number: u32, conditions: &Conditions) -> Result<Self, Problem> {
        Self::with(number, conditions, &AircraftArgs::default())
    }

    /// Case `number`, 1 or 2, with another aircraft or changed values.
    pub fn with(
        number: u32,
        conditions: &Conditions,
        aircraft: &AircraftArgs,
    ) -> Result<Self, Problem> {
        let (file, text) = match number {
            1 => ("case1.toml", scenarios::CASE1),
            _ => ("case2.toml", scenarios::CASE2),
        };
        let options = SetupOptions {
            aircraft: aircraft.clone(),
            period_ms: conditions.period,
            step_us: Some(conditions.step_us),
            ..SetupOptions::default()
        };
        let mut setup = options.builder()?.setup(&Named::shipped(file, text), &[])?;
        conditions.apply(&mut setup.plant);
        let kind = setup.plant.faults.first().map(|fault| (fault, fault.kind));
        let Some((fault, FaultKind::StuckAt { angle_rad, .. })) = kind else {
            return Err(problem!("{file}: the first fault must be one that sticks at an angle"));
        };
        let fault_s = fault.onset().as_seconds();
        Ok(Self { number, fault_s, jam_rad: angle_rad, setup })
    }

    /// The same case with other air, sensors and seed.
    pub fn under(&self, conditions: &Conditions) -> Self {
        let mut case = self.clone();
        conditions.apply(&mut case.setup.plant);
        case
    }

    /// The same case flown with other gains and laws.
    pub fn with_gains(&self, change: impl Fn(&mut Gains)) -> Self {
        let mut case = self.clone();
        change(&mut case.setup.parameters.gains);
        case
    }

    /// The same case flown by another aircraft; the controller does not know.
    pub fn with_airframe(&self, airframe: Airframe) -> Self {
        let mut case = self.clone();
        case.setup.plant.airframe = airframe;
        case
    }

    /// Setup of one run.
    pub fn run(&self, run: Run) -> FlightSetup {
        let mut setup = self.setup.clone();
        if matches!(run, Run::NoFault | Run::NoFaultOff) {
            setup.plant.faults.clear();
        }
        if matches!(run, Run::PidOnly | Run::NoFaultOff) {
            setup.parameters.gains.selection.compensator = CompensatorMode::Off;
        }
        setup
    }

    /// How long the case lasts, s.
    pub fn duration_s(&self) -> f64 {
        self.setup.duration.as_seconds()
    }

    /// The controller's model, against which F is measured.
    pub fn model(&self) -> DesignModel {
        DesignModel::new(self.setup.model)
    }

    pub fn fly(&self, run: Run, fly: &Fly) -> Result<Trace, Problem> {
        fly_to_the_end(&self.run(run), fly).at(format_args!("case {}, {}", self.number, run.name()))
    }

    /// Flies all runs, `parallel` on all cores.
    pub fn fly_all(&self, fly: &Fly, parallel: bool) -> Result<Flown, Problem> {
        let one = |run: &Run| self.fly(*run, fly);
        let traces: Result<Vec<Trace>, Problem> = if parallel {
            Run::ALL.par_iter().map(one).collect()
        } else {
            Run::ALL.iter().map(one).collect()
        };
        let traces: [Trace; 4] = traces?.try_into().expect("one trace for each of the four runs");
        let [no_fault, no_fault_off, pid_only, compensated] = traces;
        Ok(Flown { case: self.clone(), no_fault, no_fault_off, pid_only, compensated })
    }
}

impl Conditions {
    fn apply(&self, plant: &mut PlantSetup) {
        plant.earth = self.earth;
        plant.period = self.period;
        plant.step_us = self.step_us;
        plant.sensors.gyro_noise_rad_s = self.gyro_noise_rad_s;
        plant.wind.turbulence_m_s = self.turbulence_m_s;
        plant.seed = self.seed;
    }

    /// Still air and perfect gyros, for which the strict limits are meant.
    pub fn are_ideal(&self) -> bool {
        self.gyro_noise_rad_s == 0.0 && self.turbulence_m_s == 0.0
    }
}

impl Flown {
    /// What the claims of the case compare.
    pub fn runs(&self) -> Runs<'_> {
        Runs {
            case: &self.case,
            no_fault: &self.no_fault,
            pid_only: &self.pid_only,
            compensated: &self.compensated,
        }
    }
}

/// Flies a setup; an aircraft that is lost is followed to the ground.
fn fly_to_the_end(setup: &FlightSetup, fly: &Fly) -> Result<Trace, Problem> {
    let trace = fly_once(setup, fly)?;
    if trace.on_ground() || trace.lost_at().is_none() {
        return Ok(trace);
    }
    // The same flight again, with time to reach the ground: its beginning is the same to the bit.
    fly_once(&FlightSetup { duration: seconds(FOLLOWED_MAX_S), ..setup.clone() }, fly)
}

/// Flies a setup for its duration.
pub fn fly_once(setup: &FlightSetup, fly: &Fly) -> Result<Trace, Problem> {
    let model = DesignModel::new(setup.model);
    let mut samples = Vec::new();
    let end = fly(setup, &mut |record| samples.push(Sample::of(&model, record)))?;
    Ok(Trace::new(samples, setup.plant.period, end.on_ground, setup.plant.airframe.limits))
}

/// Durations come from checked scenario files; what is not a time is no flight at all.
fn seconds(seconds: f64) -> SimTime {
    SimTime::from_seconds(seconds).unwrap_or(SimTime::ZERO)
}
