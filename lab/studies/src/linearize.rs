//! Derives the controller's model from the plant at its design trim.
//!
//! The model is a file, because the controller may not look at the plant: `sitl aircraft linearize` writes it, and
//! a test keeps it current. Derivatives are central differences of the plant's own aerodynamics.

use host_io::print_line;
use std::error::Error;
use std::path::{Path, PathBuf};

use aircraft::{AIRFRAMES, DEFAULT_NAME};
use autopilot::config::PARAMETERS;
use flight_control::AircraftModel;
use flight_control::aircraft_model::schedule::POINTS_MAX;
use flight_control::aircraft_model::{
    AirDataModel, AirframeModel, EffectorModel, EngineModel, GeometryModel, LiftModel, MassModel,
    NozzleModel, Schedule, SchedulePoint, ServoModel, TrimModel,
};
use host_io::file::{self, FileProblem};
use icd::{Body, ControlPeriod, Effector, EffectorKind, PerEffector};
use plant_sim::aerodynamics::{AirState, Coefficients, Geometry};
use plant_sim::{Airframe, Plant, PlantSetup, ReadAirframe as _, Scenario, Start};

use host_io::problem::{Problem, problem};
use lab_engine::configuration::Named;

/// A flight condition of the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Altitude, m.
    pub altitude_m: f64,
    /// Airspeed, m/s.
    pub airspeed_m_s: f64,
}

impl std::str::FromStr for Condition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f64> = text
            .split(',')
            .filter_map(|word| word.trim().parse().ok())
            .filter(|n| f64::is_finite(*n))
            .collect();
        match (numbers.as_slice(), text.split(',').count()) {
            ([altitude_m, airspeed_m_s], 2) => {
                Ok(Self { altitude_m: *altitude_m, airspeed_m_s: *airspeed_m_s })
            }
            _ => Err("expected ALTITUDE_M,AIRSPEED_M_S, as in 5000,264".to_owned()),
        }
    }
}

/// Options of `sitl aircraft linearize`.
#[derive(Debug, clap::Args)]
pub struct LinearizeArgs {
    /// Where the model goes [default: aircraft/tvc_jet/model.toml for that aircraft at its design point]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[arg(
        long,
        value_name = "NAME|FILE",
        default_value = DEFAULT_NAME,
        help = format!("The aircraft: {}, or a file", file::names(AIRFRAMES))
    )]
    airframe: PathBuf,
    /// Flight condition of the model instead of the design point of the airframe; several make a model that is scheduled
    /// between them
    #[arg(long, value_name = "ALTITUDE_M,AIRSPEED_M_S", allow_hyphen_values = true)]
    at: Vec<Condition>,
}

/// The model of the default aircraft at its design point.
const SHIPPED: &str = "aircraft/tvc_jet/model.toml";

/// By this line a model is recognised as one of this program, which it may write over.
pub const MARK: &str = "# Written by `sitl aircraft linearize`";

/// Half width of the differences in angles, rad: tables are linear between breakpoints some degrees apart, and a slope of less
/// than that would be the one of a single interval.
const ANGLE_STEP_RAD: f64 = 3.0e-2;
/// Where the aerodynamics is in tables, the model takes the angle of attack in full up to this fraction of the limit of the
/// airframe.
const LINEAR_FRACTION: f64 = 0.8;
/// Half width of the differences in body rates, rad/s.
const RATE_STEP_RAD_S: f64 = 1.0e-2;
/// Half width of the differences in thrust, of its range.
const THRUST_STEP: f64 = 1.0e-2;
/// Digits that are kept: the differences are good to about eleven.
const DIGITS: i32 = 9;

/// Linearises and writes the file of the model.
pub fn run(args: &LinearizeArgs) -> Result<(), Box<dyn Error>> {
    let is_shipped = args.airframe == Path::new(DEFAULT_NAME) && args.at.is_empty();
    let out = match &args.out {
        Some(out) => out,
        None if is_shipped => Path::new(SHIPPED),
        None => return Err(format!("--out FILE is needed: {SHIPPED} is another model").into()),
    };
    let file = Named::shipped_or_read(&args.airframe, AIRFRAMES)?;
    let airframe = Airframe::from_toml(&file.name, &file.text)?;
    let nominal = Scenario::from_toml("nominal.toml", scenarios::NOMINAL, &airframe.effectors)?;
    let mut setup = nominal.plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
    let points = schedule_of(&mut setup, &args.at);
    let file = &file.name;
    let model = linearize(&setup, &points).map_err(|error| format!("{file}: {error}"))?;
    model.validate().map_err(|error| format!("{file}: the model: {error}"))?;
    let failed = |problem: FileProblem| format!("--out {}: {problem}", out.display());
    // The parameters that people have written into the file stay.
    let text = to_toml(&model, &parameters_of(out).map_err(failed)?)?;
    file::write(out, text.as_bytes(), MARK.as_bytes()).map_err(failed)?;
    print_line!("wrote {}", out.display());
    if setup.airframe.servos.iter().any(|(_, servo)| !servo.imperfections.are_none()) {
        print_line!(
            "The model has lags, rate limits and travels. Delay, deadband, hysteresis, bias and stall of the actuators are not in it."
        );
    }
    Ok(())
}

/// The starts between which a model of these conditions is scheduled: only several are a schedule, one is that of the setup itself.
pub fn schedule_of(setup: &mut PlantSetup, conditions: &[Condition]) -> Vec<Start> {
    let at = |condition: &Condition| {
        let Condition { altitude_m, airspeed_m_s } = *condition;
        Start { altitude_m, airspeed_m_s, ..setup.start }
    };
    let mut points: Vec<Start> = conditions.iter().map(at).collect();
    if let [only] = points[..] {
        setup.start = only;
        points.clear();
    }
    points
}

/// Linearises the plant of a setup at its trim, and at the trims of further starts, between which the model is scheduled.
pub fn linearize(setup: &PlantSetup, points: &[Start]) -> Result<AircraftModel, Problem> {
    if points.len() > POINTS_MAX {
        return Err(problem!("--at: {} conditions, expected at most {POINTS_MAX}", points.len()));
    }
    let mut schedule = Vec::new();
    for start in points {
        let at = PlantSetup { start: *start, ..setup.clone() };
        schedule.push(schedule_point(&linearize_at(&at)?));
    }
    // A schedule interpolates between neighbours in the dynamic pressure.
    schedule.sort_by(|a, b| a.pressure_pa().total_cmp(&b.pressure_pa()));
    Ok(AircraftModel { schedule: Schedule::new(schedule), ..linearize_at(setup)? })
}

/// What a schedule has of the model at one condition.
fn schedule_point(model: &AircraftModel) -> SchedulePoint {
    let AircraftModel { airframe, lift, trim, effectors, .. } = model;
    SchedulePoint {
        airspeed_m_s: trim.airspeed_m_s,
        altitude_m: trim.altitude_m,
        trim_thrust_n: trim.thrust_n,
        thrust_n: effectors.thrust_range_n(),
        c_lift: effectors.c_lift,
        c_roll: effectors.c_roll,
        c_pitch: effectors.c_pitch,
        c_yaw: effectors.c_yaw,
        airframe: *airframe,
        lift: *lift,
    }
}

fn linearize_at(setup: &PlantSetup) -> Result<AircraftModel, Problem> {
    let plant = Plant::new(setup)?;
    let trim = plant.trim();
    let airframe = &setup.airframe;
    let geometry = airframe.aero.geometry();
    let local = Local { plant: &plant, start: &setup.start, geometry };
    let slopes = local.slopes();
    let mass = &airframe.mass;
    Ok(AircraftModel {
        aircraft: airframe.name,
        mass: MassModel {
            mass_kg: mass.mass_kg,
            ixx_kg_m2: mass.ixx_kg_m2,
            iyy_kg_m2: mass.iyy_kg_m2,
            izz_kg_m2: mass.izz_kg_m2,
            ixz_kg_m2: mass.ixz_kg_m2,
        },
        geometry: GeometryModel {
            wing_area_m2: geometry.area_m2,
            span_m: geometry.span_m,
            chord_m: geometry.chord_m,
        },
        airframe: local.airframe_model(&slopes),
        lift: local.lift_model(&slopes),
        nozzle: airframe.nozzle.map(|nozzle| NozzleModel {
            arm_m: nozzle.arm_m,
            thrust_floor_n: nozzle.thrust_floor_n,
        }),
        effectors: local.effector_model(&slopes),
        engine: local.engine_model(),
        air_data: Some(AirDataModel {
            vanes_m: airframe.air_data.vanes_m,
            pitot_m: airframe.air_data.pitot_m,
            c_side_beta: rounded(local.side_per_sideslip()),
        }),
        schedule: Schedule::default(),
        trim: TrimModel {
            airspeed_m_s: setup.start.airspeed_m_s,
            altitude_m: setup.start.altitude_m,
            theta_rad: rounded(trim.theta_rad),
            elevator_rad: rounded(trim.elevator_rad),
            thrust_n: rounded(trim.thrust_n),
        },
    })
}

/// The plant around its trim.
struct Local<'a> {
    plant: &'a Plant,
    start: &'a Start,
    geometry: Geometry,
}

impl Local<'_> {
    fn at(
        &self,
        alpha_rad: f64,
        beta_rad: f64,
        rates: Body,
        positions: &PerEffector<f64>,
    ) -> Coefficients {
        let Start { airspeed_m_s, altitude_m, .. } = *self.start;
        let air = AirState { airspeed_m_s, alpha_rad, beta_rad, rates };
        self.plant.dynamics().coefficients(&air, altitude_m, positions)
    }

    fn trimmed(&self, alpha_rad: f64, beta_rad: f64, rates: Body) -> Coefficients {
        self.at(alpha_rad, beta_rad, rates, &self.plant.trim().positions())
    }

    /// Angles of attack, rad, up to which a coefficient is linear and to which it tends beyond.
    fn stall(&self) -> [f64; 2] {
        let airframe = self.plant.dynamics().airframe();
        let limit = airframe.limits.alpha_rad;
        let tables = [LINEAR_FRACTION * limit, limit];
        airframe.aero.derivatives().map_or(tables, |a| [a.alpha_linear_rad, a.alpha_max_rad])
    }

    fn airframe_model(&self, slopes: &PerEffector<ModelSlopes>) -> AirframeModel {
        let trim = self.plant.trim();
        let alpha = trim.alpha_rad;
        let still = Body::zero();
        let d_alpha = difference(ANGLE_STEP_RAD, |d| self.trimmed(alpha + d, 0.0, still));
        let d_beta = difference(ANGLE_STEP_RAD, |d| self.trimmed(alpha, d, still));
        let rate = |axis: Body| {
            difference(RATE_STEP_RAD_S, |d| self.trimmed(alpha, 0.0, Body(axis.0 * d)))
        };
        let (d_p, d_q, d_r) = (
            rate(Body::new(1.0, 0.0, 0.0)),
            rate(Body::new(0.0, 1.0, 0.0)),
            rate(Body::new(0.0, 0.0, 1.0)),
        );
        let per_span = 2.0 * self.start.airspeed_m_s / self.geometry.span_m;
        let per_chord = 2.0 * self.start.airspeed_m_s / self.geometry.chord_m;
        let [stall_onset_rad, stall_ceiling_rad] = self.stall();
        // On the tangent at the trim, which need not meet the coefficient at zero.
        let at_zero = self.trimmed(alpha, 0.0, still).pitch
            - d_alpha.pitch * alpha
            - self.in_trim(slopes, |slopes| slopes.pitch);
        AirframeModel {
            c_roll_beta: rounded(d_beta.roll),
            c_roll_p: rounded(d_p.roll * per_span),
            c_roll_r: rounded(d_r.roll * per_span),
            c_pitch_0: rounded(at_zero),
            c_pitch_alpha: rounded(d_alpha.pitch),
            c_pitch_q: rounded(d_q.pitch * per_chord),
            c_yaw_beta: rounded(d_beta.yaw),
            c_yaw_p: rounded(d_p.yaw * per_span),
            c_yaw_r: rounded(d_r.yaw * per_span),
            stall_onset_rad: rounded(stall_onset_rad),
            stall_ceiling_rad: rounded(stall_ceiling_rad),
        }
    }

    /// Side force per sideslip.
    fn side_per_sideslip(&self) -> f64 {
        let alpha = self.plant.trim().alpha_rad;
        let side = |beta| self.trimmed(alpha, beta, Body::zero()).side;
        (side(ANGLE_STEP_RAD) - side(-ANGLE_STEP_RAD)) / (2.0 * ANGLE_STEP_RAD)
    }

    /// What the effectors add to a coefficient in the trim, by their slopes.
    fn in_trim(&self, slopes: &PerEffector<ModelSlopes>, of: fn(&ModelSlopes) -> f64) -> f64 {
        let (list, trim) = (&self.plant.dynamics().airframe().effectors, self.plant.trim());
        list.all().map(|effector| of(&slopes[effector]) * trim.positions[effector]).sum()
    }

    fn lift_model(&self, slopes: &PerEffector<ModelSlopes>) -> LiftModel {
        let (alpha, still) = (self.plant.trim().alpha_rad, Body::zero());
        let d_alpha = difference(ANGLE_STEP_RAD, |d| self.trimmed(alpha + d, 0.0, still));
        let d_q = difference(RATE_STEP_RAD_S, |d| self.trimmed(alpha, 0.0, Body::new(0.0, d, 0.0)));
        let per_chord = 2.0 * self.start.airspeed_m_s / self.geometry.chord_m;
        let at_zero = self.trimmed(alpha, 0.0, still).lift
            - d_alpha.lift * alpha
            - self.in_trim(slopes, |slopes| slopes.lift);
        LiftModel {
            c_lift_0: rounded(at_zero),
            c_lift_alpha: rounded(d_alpha.lift),
            c_lift_q: rounded(d_q.lift * per_chord),
        }
    }

    /// What each surface does around the trim; zeros for what is none.
    fn slopes(&self) -> PerEffector<ModelSlopes> {
        let (list, trim) = (&self.plant.dynamics().airframe().effectors, self.plant.trim());
        PerEffector::from_fn(|effector: Effector| {
            if !list.kind(effector).is_some_and(EffectorKind::is_surface) {
                return ModelSlopes::default();
            }
            difference(ANGLE_STEP_RAD, |d| {
                let mut positions = trim.positions();
                positions[effector] += d;
                self.at(trim.alpha_rad, 0.0, Body::zero(), &positions)
            })
        })
    }

    /// The moment of what turns with the engine, around the trim.
    fn engine_model(&self) -> Option<EngineModel> {
        let thrust_n = self.plant.trim().thrust_n;
        let [least, most] = self.plant.thrust_range_n();
        let step = THRUST_STEP * (most - least);
        let at = |thrust_n: f64| self.plant.engine_roll_n_m(thrust_n);
        let per_thrust = (at(thrust_n + step) - at(thrust_n - step)) / (2.0 * step);
        let roll_per_thrust_m = rounded(per_thrust);
        let roll_zero_n_m = rounded(at(thrust_n) - per_thrust * thrust_n);
        // Without an engine the step is zero, and the slope no number.
        let turns = (roll_per_thrust_m, roll_zero_n_m) != (0.0, 0.0) && per_thrust.is_finite();
        turns.then_some(EngineModel { roll_zero_n_m, roll_per_thrust_m })
    }

    fn effector_model(&self, slopes: &PerEffector<ModelSlopes>) -> EffectorModel {
        let Airframe { effectors: list, servos, gains, .. } = self.plant.dynamics().airframe();
        let column = |of: fn(&ModelSlopes) -> f64| {
            PerEffector::from_fn(|effector| rounded(of(&slopes[effector])))
        };
        let servo = |effector: Effector| {
            let servo = &servos[effector];
            if list.is_angle(effector) {
                ServoModel {
                    lag_s: servo.lag_s,
                    rate_limit: rounded(servo.rate_limit),
                    min: rounded(servo.min),
                    max: rounded(servo.max),
                }
            } else {
                // What the engine can give at this flight condition, which may be less than its
                // travel.
                let [min, max] = self.plant.thrust_range_n();
                ServoModel { lag_s: servo.lag_s, rate_limit: servo.rate_limit, min, max }
            }
        };
        let mut models = PerEffector::default();
        for effector in list.all() {
            models[effector] = servo(effector);
        }
        EffectorModel {
            list: *list,
            servos: models,
            c_lift: column(|slopes| slopes.lift),
            c_roll: column(|slopes| slopes.roll),
            c_pitch: column(|slopes| slopes.pitch),
            c_yaw: column(|slopes| slopes.yaw),
            gains: *gains,
        }
    }
}

#[derive(Clone, Copy, Default)]
struct ModelSlopes {
    lift: f64,
    roll: f64,
    pitch: f64,
    yaw: f64,
}

/// Central difference of the coefficients of lift and moments.
fn difference(step: f64, at: impl Fn(f64) -> Coefficients) -> ModelSlopes {
    let (above, below) = (at(step), at(-step));
    let slope = |a: f64, b: f64| (a - b) / (2.0 * step);
    ModelSlopes {
        lift: slope(above.lift, below.lift),
        roll: slope(above.roll, below.roll),
        pitch: slope(above.pitch, below.pitch),
        yaw: slope(above.yaw, below.yaw),
    }
}

/// Keeps [`DIGITS`] significant digits, so that the file does not carry rounding noise.
fn rounded(value: f64) -> f64 {
    // What cancels leaves noise, which must not look like a coefficient.
    if value.abs() < 1.0e-12 {
        return 0.0;
    }
    let text = format!("{value:.*e}", usize::try_from(DIGITS - 1).unwrap_or(0));
    text.parse().unwrap_or(value)
}

/// The text of the table `[parameters]` in a model file, as it stands there, comments and all: what stands from its heading
/// to the next one or to the end. Empty for a file without one, or that is not there.
pub fn parameters_of(path: &Path) -> Result<String, FileProblem> {
    let text = match file::read_text(path, file::TEXT_MAX) {
        Err(problem) if problem.is_not_found() => return Ok(String::new()),
        text => text?,
    };
    let heading = format!("[{PARAMETERS}]");
    let from_heading = text.lines().skip_while(|line| line.trim() != heading);
    let ends = |(index, line): &(usize, &str)| *index > 0 && line.trim_start().starts_with('[');
    let table = from_heading.enumerate().take_while(|line| !ends(line)).map(|(_, line)| line);
    Ok(table.map(|line| format!("{line}\n")).collect())
}

/// The model as the file that the autopilot reads; `parameters` is the text of the table of parameters in it.
///
/// # Errors
/// Only if a number cannot be written as TOML, which a validated model has none of.
pub fn to_toml(model: &AircraftModel, parameters: &str) -> Result<String, toml::ser::Error> {
    let body = toml::to_string_pretty(model)?;
    let gap = if parameters.is_empty() { "" } else { "\n" };
    Ok(format!(
        "# The controller's model of the aircraft: the plant's airframe linearised at its design trim.\n\
         {MARK}; edit [{PARAMETERS}] only. Angles in rad, coefficients per rad.\n\n{body}{gap}{parameters}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parameters_of_a_model_file_are_kept_with_their_comments() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.toml");
        assert_eq!(parameters_of(&path).unwrap(), "");
        let airframe = Airframe::paper();
        let text = scenarios::NOMINAL;
        let scenario = Scenario::from_toml("s", text, &airframe.effectors).unwrap();
        let setup = scenario.plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
        let model = linearize(&setup, &[]).unwrap();
        let table = "[parameters]\n# why\nFTC_ALLOC = 1 # how\n";
        std::fs::write(&path, to_toml(&model, table).unwrap()).unwrap();
        assert_eq!(parameters_of(&path).unwrap(), table);
        let read = autopilot::config::model("m", &to_toml(&model, table).unwrap()).unwrap();
        assert_eq!(read.aircraft, model);
    }

    #[test]
    fn rounding_keeps_nine_digits() {
        assert_eq!(rounded(0.123_456_789_123), 0.123_456_789);
        assert_eq!(rounded(-27_120.123_456_7), -27_120.123_5);
        assert_eq!(rounded(1.0e-17), 0.0);
    }
}
