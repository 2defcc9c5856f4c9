//! Variables of an FMU: what the model description lists and the C interface reads and writes. The place of a variable is its
//! value reference.

use std::ops::Range;

use icd::sensors::SensorKind;
use icd::{Sensors, SimTime, Stamp};

/// The value of a variable, and with it its type.
#[derive(Debug, Clone, PartialEq)]
pub enum FmuValue {
    /// Float64.
    Number(f64),
    /// UInt64.
    Count(u64),
    /// Boolean.
    Flag(bool),
    /// String.
    Text(String),
}

/// Who gives the value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    Independent,
    /// The importer, until the end of the initialization.
    Parameter,
    /// The FMU, at the end of the initialization.
    CalculatedParameter,
    /// The importer, between two steps.
    Input,
    /// The FMU.
    Output,
}

/// An entry of the model description.
#[derive(Debug, Clone, PartialEq)]
pub struct FmuVariable {
    /// The last words are the unit.
    pub name: String,
    pub causality: Causality,
    /// The importer may interpolate it.
    pub is_continuous: bool,
    pub about: &'static str,
    pub start: FmuValue,
}

/// All variables of an FMU; the first one is the time.
#[derive(Debug, Clone, PartialEq)]
pub struct VariableList(Vec<FmuVariable>);

impl VariableList {
    /// With the time alone.
    pub fn of_time() -> Self {
        Self(vec![FmuVariable {
            name: "time".to_owned(),
            causality: Causality::Independent,
            is_continuous: true,
            about: "simulation time",
            start: FmuValue::Number(0.0),
        }])
    }

    pub fn all(&self) -> &[FmuVariable] {
        &self.0
    }

    /// Appends variables that belong together, and gives their places.
    pub fn add(
        &mut self,
        causality: Causality,
        is_continuous: bool,
        about: &'static str,
        variables: impl IntoIterator<Item = (String, FmuValue)>,
    ) -> Range<usize> {
        let first = self.0.len();
        let variable = |(name, start)| FmuVariable { name, causality, is_continuous, about, start };
        self.0.extend(variables.into_iter().map(variable));
        first..self.0.len()
    }
}

impl FmuValue {
    /// Numbers in the places; other values count as zero.
    pub fn numbers(values: &[Self]) -> impl Iterator<Item = f64> + '_ {
        values.iter().map(|value| match value {
            Self::Number(number) => *number,
            _ => 0.0,
        })
    }

    /// Writes numbers into the places.
    pub fn set_numbers(places: &mut [Self], numbers: impl IntoIterator<Item = f64>) {
        for (place, number) in places.iter_mut().zip(numbers) {
            *place = Self::Number(number);
        }
    }
}

/// Where the sensors of an aircraft are among the variables: outputs of the plant, inputs of the autopilot.
#[derive(Debug, Clone)]
pub struct SensorPlaces {
    fitted: [bool; Sensors::SENSORS],
    /// Of all fitted sensors.
    values: Range<usize>,
    times: Range<usize>,
    valid: Range<usize>,
}

impl SensorPlaces {
    pub fn add(
        list: &mut VariableList,
        causality: Causality,
        fitted: &[bool; Sensors::SENSORS],
    ) -> Self {
        let none = Sensors::at(SimTime::ZERO, &[0.0; Sensors::COUNT]).to_array();
        let kinds = || SensorKind::ALL.into_iter().filter(|kind| fitted[*kind as usize]);
        let named = |name: &str| format!("sensors.{name}");
        let values = kinds()
            .flat_map(SensorKind::places)
            .map(|place| (named(Sensors::NAMES[place]), FmuValue::Number(none[place])));
        let values = list.add(causality, false, "latest sample of a sensor", values);
        let times = kinds().map(|kind| (named(Sensors::TIMES[kind as usize]), FmuValue::Count(0)));
        let times = list.add(causality, false, "time of measurement, microseconds", times);
        let valid =
            kinds().map(|kind| (named(Sensors::VALID[kind as usize]), FmuValue::Flag(false)));
        let valid = list.add(causality, false, "the sensor declares its sample valid", valid);
        Self { fitted: *fitted, values, times, valid }
    }

    pub fn write(&self, sensors: &Sensors, all: &mut [FmuValue]) {
        let (numbers, stamps) = (sensors.to_array(), sensors.stamps());
        let kinds = || SensorKind::ALL.into_iter().filter(|kind| self.fitted[*kind as usize]);
        let numbers = kinds().flat_map(SensorKind::places).map(|place| numbers[place]);
        FmuValue::set_numbers(&mut all[self.values.clone()], numbers);
        let fitted = || kinds().map(|kind| stamps[kind as usize]);
        for (place, stamp) in all[self.times.clone()].iter_mut().zip(fitted()) {
            *place = FmuValue::Count(stamp.time.as_micros());
        }
        for (place, stamp) in all[self.valid.clone()].iter_mut().zip(fitted()) {
            *place = FmuValue::Flag(stamp.valid);
        }
    }

    pub fn read(&self, all: &[FmuValue]) -> Sensors {
        let mut numbers = [0.0; Sensors::COUNT];
        let mut stamps = [Stamp { time: SimTime::ZERO, valid: false }; Sensors::SENSORS];
        let mut values = FmuValue::numbers(&all[self.values.clone()]);
        let marks = all[self.times.clone()].iter().zip(&all[self.valid.clone()]);
        let kinds = SensorKind::ALL.into_iter().filter(|kind| self.fitted[*kind as usize]);
        for (kind, mark) in kinds.zip(marks) {
            for place in kind.places() {
                numbers[place] = values.next().unwrap_or_default();
            }
            if let (FmuValue::Count(us), FmuValue::Flag(valid)) = mark {
                stamps[kind as usize] = Stamp { time: SimTime::from_micros(*us), valid: *valid };
            }
        }
        let mut sensors = Sensors::new(&stamps, &numbers);
        sensors.keep(&self.fitted);
        sensors
    }
}
