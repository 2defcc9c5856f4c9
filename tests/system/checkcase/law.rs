//! The maneuvers of the F-16 in the check cases, with the control law of the source around the plant.
//!
//! The law is that of `F16_control.dml` (linear quadratic regulators with limits). Its gains are in the reference data and not in
//! the project: it is here to move the plant as NASA's simulators were moved, not to fly anything.

use std::collections::BTreeMap;
use std::path::Path;

use icd::{Actuators, SimTime};
use lab_studies::checkcase::CheckcaseArgs;
use lab_studies::checkcase::columns::CheckcaseColumns;
use lab_studies::checkcase::reference::References;
use lab_studies::checkcase::trajectory::Trajectory;
use plant_sim::Plant;
use plant_sim::release::Controls;
use plant_sim::scenario::case::CheckCase;

const FOOT: f64 = 0.304_8;
const KNOT: f64 = 1_852.0 / 3_600.0;
/// Density at sea level, kg/m³ (US-1976).
const SEA_LEVEL: f64 = 1.225;

/// What the law follows at a time in s: altitude, ft, and course, deg.
type Demand = fn(f64) -> (f64, f64);

/// The maneuvers: name in the reference data, duration in s, demand. The altitude has the bias that makes the law's demand zero at
/// the trim.
const MANEUVERS: [(&str, f64, Demand); 2] = [
    ("13p1", 20.0, |t| (if t < 5.0 { 10_012.691_6 } else { 10_112.691_6 }, 45.0)),
    ("13p3", 30.0, |t| (10_012.691_6, if t < 15.0 { 45.0 } else { 60.0 })),
];

struct Law {
    gains: BTreeMap<String, f64>,
    start: Controls,
    airspeed_kt: f64,
}

impl Law {
    fn new(data: &Path, plant: &Plant) -> Self {
        let text = std::fs::read_to_string(data.join("f16_s119.json")).expect("the F-16's data");
        let json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
        let gains = serde_json::from_value(json["control"]["gains"].clone()).expect("numbers");
        Self { gains, start: plant.controls(), airspeed_kt: equivalent_airspeed_kt(plant) }
    }

    fn gain(&self, name: &str) -> f64 {
        self.gains[name]
    }

    /// Minus the sum of four errors with the gains of a row.
    fn row(&self, name: &str, errors: [f64; 4]) -> f64 {
        let numbered = (1..).zip(errors);
        -numbered.map(|(n, error)| self.gain(&format!("{name}{n}")) * error).sum::<f64>()
    }

    /// The controls for the state of the plant, with angles in deg and rates in rad/s as the source has them.
    fn controls(&self, plant: &Plant, demand: Demand) -> Controls {
        let truth = plant.truth();
        let (altitude_ft, course_deg) = demand(truth.time.as_seconds());
        let euler = truth.euler();
        let [phi, theta, psi] = [euler.phi, euler.theta, euler.psi].map(f64::to_degrees);
        let [alpha, beta] = [truth.alpha_rad, truth.beta_rad].map(f64::to_degrees);
        let rates = truth.body_rates.0;
        let climb = self.gain("thetaCmdAltErrGain") * (truth.altitude_m / FOOT - altitude_ft);
        let theta_c = self.gain("trimmedTheta") + climb.clamp(-5.0, 5.0);
        let course_error = (psi + beta - course_deg + 180.0).rem_euclid(360.0) - 180.0;
        let phi_c = (self.gain("phiCmdChiErrGain") * course_error).clamp(-30.0, 30.0);
        let airspeed_error = equivalent_airspeed_kt(plant) - self.airspeed_kt;
        let along = [airspeed_error, alpha - self.gain("trimmedAlpha"), rates.y, theta - theta_c];
        let across = [phi - phi_c, beta, rates.x, rates.z];
        let airframe = plant.dynamics().airframe();
        let elevator = airframe.effectors.by_key("left_elevator").expect("it has one");
        let trimmed = -self.start.positions[elevator].to_degrees() / 25.0;
        let longitudinal = (self.row("longLQR1", along) + trimmed).clamp(-1.0, 1.0);
        let lateral = self.row("latdLQR1", across).clamp(-1.0, 1.0);
        let pedal = self.row("latdLQR2", across).clamp(-1.0, 1.0);
        let lever = self.start.lever.expect("its engine has a lever");
        let throttle = (self.row("longLQR2", along) + lever).clamp(0.0, 1.0);
        let aileron = -21.5 * lateral;
        let surfaces = [aileron, -25.0 * longitudinal, -30.0 * pedal + 0.008 * aileron];
        let [aileron, elevator, rudder] = surfaces.map(f64::to_radians);
        let positions = airframe.follow([aileron, elevator, rudder, 0.0]);
        Controls { positions, lever: Some(throttle) }
    }
}

fn equivalent_airspeed_kt(plant: &Plant) -> f64 {
    let truth = plant.truth();
    truth.airspeed_m_s * (truth.density_kg_m3 / SEA_LEVEL).sqrt() / KNOT
}

/// The trajectory of a maneuver, with the controls held during a step.
fn flown(case: &CheckCase, data: &Path, end: SimTime, demand: Demand) -> Trajectory {
    let mut plant = Plant::release(&case.setup).expect("the trim exists");
    let law = Law::new(data, &plant);
    let columns = CheckcaseColumns::new(&plant);
    let mut text = format!("{}\n", columns.header());
    loop {
        if plant.time().as_micros().is_multiple_of(case.output_us) {
            text += &columns.row(&plant);
            text.push('\n');
        }
        if plant.time() >= end {
            return Trajectory::read("maneuver", &text).expect("its own table");
        }
        plant.set_controls(&law.controls(&plant, demand));
        plant.advance(&Actuators::new(plant.controls().positions));
    }
}

#[test]
fn val_maneuvers_of_the_f16_with_the_sources_law_are_inside_the_spread_of_nasas_simulators() {
    let Some(folder) = std::env::var_os("TWO_STEP_REFERENCE_DATA") else { return };
    let data = Path::new(&folder).join("checkcases");
    let references = References::open(&data.join("data")).expect("the reference data");
    for (name, seconds, demand) in MANEUVERS {
        for step_ms in [1.0, 10.0] {
            let scenario = super::scenario("11_f16_subsonic");
            let case = CheckcaseArgs::of(scenario, Some(step_ms)).case().expect("a shipped case");
            let end = SimTime::from_seconds(seconds).expect("in range");
            let reference = references.case(name).expect("it is among them");
            let ours = flown(&case, &data, end, demand);
            let deviations = reference.deviations(&ours).expect("the same times");
            for of in &deviations {
                // The controls are held during a step, so with 10 ms the law is another one than a continuous law.
                let passes = of.passes() && (step_ms > 1.0 || of.passes_tight());
                assert!(passes, "{name}, {step_ms} ms: {of:?}");
            }
        }
    }
}
