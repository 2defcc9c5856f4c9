//! One instance of an FMU: its variables, its modes, and its steps of whole control periods.
//!
//! ```text
//! Instantiated ─ enter ─> Initialization ─ exit ─> Stepping ─ terminate ─> Terminated
//!      ^────────────────────── reset ──────────────────────────────────────────┘
//! ```

use std::sync::Arc;

use host_io::problem::{At as _, Problem, problem};
use icd::{ControlPeriod, SimTime};

use crate::autopilot::AutopilotSide;
use crate::plant::PlantSide;
use crate::setup::SideSetup;
use crate::variables::{Causality, FmuValue, FmuVariable, VariableList};

/// A communication step may differ this much from a multiple of the control period, and a communication point from the time,
/// s: importers add up both.
const TIME_ERROR_MAX_S: f64 = 1.0e-7;

/// An instance. A copy continues with the same bits.
#[derive(Debug, Clone)]
pub struct FmuInstance {
    side: Side,
    list: Arc<VariableList>,
    values: Vec<FmuValue>,
    mode: InstanceMode,
    /// Time at which the flight begins, s.
    start_s: f64,
    time: SimTime,
    /// The flight of these parameters has begun.
    is_begun: bool,
}

/// Where in its life an instance is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum InstanceMode {
    Instantiated,
    Initialization,
    Stepping,
    Terminated,
}

#[derive(Debug, Clone)]
enum Side {
    Plant(PlantSide),
    Autopilot(AutopilotSide),
}

impl FmuInstance {
    pub fn new(setup: SideSetup) -> Result<Self, Problem> {
        let (side, list) = match setup {
            SideSetup::Plant(setup) => {
                let (side, list) = PlantSide::new(*setup)?;
                (Side::Plant(side), list)
            }
            SideSetup::Autopilot(setup) => {
                let (side, list) = AutopilotSide::new(*setup)?;
                (Side::Autopilot(side), list)
            }
        };
        let mut instance = Self {
            side,
            list: Arc::new(list),
            values: Vec::new(),
            mode: InstanceMode::Instantiated,
            start_s: 0.0,
            time: SimTime::ZERO,
            is_begun: false,
        };
        instance.reset();
        Ok(instance)
    }

    pub fn variables(&self) -> &[FmuVariable] {
        self.list.all()
    }

    pub fn period(&self) -> ControlPeriod {
        match &self.side {
            Side::Plant(side) => side.setup().period,
            Side::Autopilot(side) => side.setup().period,
        }
    }

    /// Back to what it was when it was made.
    pub fn reset(&mut self) {
        self.values = self.variables().iter().map(|variable| variable.start.clone()).collect();
        (self.mode, self.is_begun) = (InstanceMode::Instantiated, false);
        (self.start_s, self.time) = (0.0, SimTime::ZERO);
    }

    pub fn enter_initialization(&mut self, start_s: f64) -> Result<(), Problem> {
        self.expect(&[InstanceMode::Instantiated], "enter the initialization")?;
        self.mode = InstanceMode::Initialization;
        self.start_s = start_s;
        self.values[0] = FmuValue::Number(start_s);
        Ok(())
    }

    /// Begins the flight.
    pub fn exit_initialization(&mut self) -> Result<(), Problem> {
        self.expect(&[InstanceMode::Initialization], "exit the initialization")?;
        self.begin()?;
        self.mode = InstanceMode::Stepping;
        Ok(())
    }

    pub fn terminate(&mut self) -> Result<(), Problem> {
        self.expect(&[InstanceMode::Stepping], "terminate")?;
        self.mode = InstanceMode::Terminated;
        Ok(())
    }

    /// The value of a variable.
    pub fn get(&mut self, reference: u32) -> Result<&FmuValue, Problem> {
        // Outputs of the initialization are those of the parameters that were set last.
        if self.mode == InstanceMode::Initialization {
            self.begin()?;
        }
        self.values.get(reference as usize).ok_or_else(|| problem!("no variable {reference}"))
    }

    /// Sets a parameter or an input.
    pub fn set(&mut self, reference: u32, value: FmuValue) -> Result<(), Problem> {
        let place = reference as usize;
        let variable = self.list.all().get(place);
        let variable = variable.ok_or_else(|| problem!("no variable {reference}"))?;
        let before_flight = [InstanceMode::Instantiated, InstanceMode::Initialization];
        let in_flight = [&before_flight[..], &[InstanceMode::Stepping]].concat();
        let (modes, what) = match variable.causality {
            Causality::Parameter => (&before_flight[..], "set a parameter"),
            Causality::Input => (&in_flight[..], "set an input"),
            _ => return Err(problem!("{}: only parameters and inputs can be set", variable.name)),
        };
        self.expect(modes, what).at(&variable.name)?;
        if std::mem::discriminant(&value) != std::mem::discriminant(&variable.start) {
            return Err(problem!("{} has another type", variable.name));
        }
        if let Side::Plant(side) = &self.side {
            side.check(place, &value).at(&variable.name)?;
        }
        self.values[place] = value;
        self.is_begun &= self.mode == InstanceMode::Stepping;
        Ok(())
    }

    /// Flies from the communication point over a step; true once the flight is over.
    pub fn step(&mut self, point_s: f64, size_s: f64) -> Result<bool, Problem> {
        self.expect(&[InstanceMode::Stepping], "step")?;
        let now_s = self.now_s();
        let is_here = (point_s - now_s).abs() <= TIME_ERROR_MAX_S;
        if !is_here {
            return Err(problem!("the communication point is {point_s} s; the time is {now_s} s"));
        }
        for _ in 0..self.periods(size_s)? {
            match &mut self.side {
                Side::Plant(side) => side.step(&mut self.values)?,
                Side::Autopilot(side) => side.step(&mut self.values)?,
            }
            self.time = self.time + self.period();
            self.values[0] = FmuValue::Number(self.now_s());
        }
        Ok(matches!(&self.side, Side::Plant(side) if side.is_over()))
    }

    /// Simulation time, s.
    pub fn now_s(&self) -> f64 {
        self.start_s + self.time.as_seconds()
    }

    /// How many control periods a step has.
    fn periods(&self, size_s: f64) -> Result<u64, Problem> {
        let period_s = self.period().as_seconds();
        let count = (size_s / period_s).round();
        let error_s = (size_s - count * period_s).abs();
        match count >= 1.0 && size_s <= SimTime::MAX_SECONDS && error_s <= TIME_ERROR_MAX_S {
            true => Ok(count as u64),
            false => Err(problem!(
                "communication step {size_s} s; expected a multiple of the control period of {period_s} s"
            )),
        }
    }

    fn begin(&mut self) -> Result<(), Problem> {
        if !self.is_begun {
            match &mut self.side {
                Side::Plant(side) => side.begin(&mut self.values)?,
                Side::Autopilot(side) => side.begin(&mut self.values),
            }
            self.is_begun = true;
        }
        Ok(())
    }

    fn expect(&self, modes: &[InstanceMode], what: &str) -> Result<(), Problem> {
        match modes.contains(&self.mode) {
            true => Ok(()),
            false => Err(problem!("an instance in the mode {:?} cannot {what}", self.mode)),
        }
    }
}
