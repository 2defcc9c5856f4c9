//! Helpers for several tests of this crate: aircraft and flights from files, parts of airframe files, reference data.

use host_io::problem::Problem;
use icd::{ControlPeriod, tvc_jet};
use plant_sim::ReadAirframe as _;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Airframe, PlantSetup, SensorSettings};

/// The same value as a type of the other build of this crate: the one that `plant-sim` reads files for has no tests.
fn translated<T: Serialize, U: DeserializeOwned>(value: &T) -> U {
    // Binary, as every number keeps its bits.
    postcard::from_bytes(&postcard::to_stdvec(value).unwrap()).unwrap()
}

impl Airframe {
    pub fn from_toml(name: &str, text: &str) -> Result<Self, Problem> {
        let read = plant_sim::Airframe::from_toml(name, text)?;
        // The list of a body has no effectors, and an empty one cannot be read back.
        let effectors = read.effectors;
        let aircraft = plant_sim::Airframe { effectors: tvc_jet::effectors(), ..read };
        Ok(Self { effectors, ..translated(&aircraft) })
    }

    pub fn paper() -> Self {
        translated(&plant_sim::Airframe::paper())
    }
}

/// The nominal flight of an aircraft.
pub fn nominal(airframe: &Airframe, step_us: u32) -> PlantSetup {
    let (name, effectors) = ("nominal.toml", &airframe.effectors);
    let nominal = plant_sim::Scenario::from_toml(name, scenarios::NOMINAL, effectors).unwrap();
    let design_point = translated(&airframe.design_point);
    let jet = plant_sim::Airframe { design_point, ..plant_sim::Airframe::paper() };
    let setup = nominal.plant.setup(jet, 0, ControlPeriod::DEFAULT, step_us);
    PlantSetup { airframe: airframe.clone(), ..translated(&setup) }
}

/// Sensors of the tactical grade.
pub fn tactical() -> SensorSettings {
    translated(&plant_sim::grade_file::of_grade(plant_sim::GradeName::Tactical))
}

/// The F-16's airframe file.
pub use aircraft::F16_AIRFRAME as F16;

/// One table of an airframe file.
pub fn part<T: DeserializeOwned>(text: &str, name: &str) -> T {
    let file: toml::Table = toml::from_str(text).unwrap();
    file[name].clone().try_into().unwrap()
}

/// Check points of the F-16 (`aero` or `prop`) from the folder in `TWO_STEP_REFERENCE_DATA`; `None` without it.
pub fn check_points(kind: &str) -> Option<Vec<serde_json::Value>> {
    let folder = std::env::var_os("TWO_STEP_REFERENCE_DATA")?;
    let path = std::path::Path::new(&folder).join("checkcases/f16_s119.json");
    let text = std::fs::read_to_string(path).expect("the reference data can be read");
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    Some(data["check_data"][kind].as_array().unwrap().clone())
}
