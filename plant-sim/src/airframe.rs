//! The aircraft as data: an airframe file becomes an [`Airframe`].

use icd::{Effector, PerEffector};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::aerodynamics::Aero;
use crate::config::{self, ConfigError, RangeError, check_range};
use crate::derivatives;
use crate::limits::{FlightLimits, LimitsTable};
use crate::mach::MachEffects;
use crate::rigid_body::MassProperties;
use crate::servos::Servo;
use crate::setup::{Start, StartTable};

/// Text of the airframe file that comes with the crate.
pub const DEFAULT_AIRFRAME: &str = include_str!("../airframes/tvc_jet.toml");

/// Text of the variant with Mach effects, which the controller's model lacks: for studies of false alarms.
pub const MACH_AIRFRAME: &str = include_str!("../airframes/tvc_jet_mach.toml");

/// Shortest lag of a servo, s: RK4 with the longest step (4 ms) is stable down to 1.5 ms.
const LAG_MIN_S: f64 = 0.005;

/// Mass and moments of inertia about the centre of gravity, body axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mass {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Moment of inertia about x, kg m².
    pub ixx_kg_m2: f64,
    /// Moment of inertia about y, kg m².
    pub iyy_kg_m2: f64,
    /// Moment of inertia about z, kg m².
    pub izz_kg_m2: f64,
    /// Product of inertia, plus the integral of x z dm, kg m².
    pub ixz_kg_m2: f64,
}

/// Everything that makes one aircraft differ from another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Airframe {
    /// Mass and inertia.
    pub mass: Mass,
    /// Geometry and aerodynamic derivatives.
    pub aero: Aero,
    /// The actuators.
    pub servos: PerEffector<Servo>,
    /// Distance of the nozzle behind the centre of gravity, m.
    pub nozzle_arm_m: f64,
    /// Where the air data come from.
    pub air_data: AirData,
    /// How the derivatives change with the Mach number; `None` where they do not.
    pub mach: Option<MachEffects>,
    /// Where a scenario without a start begins, and where the controller's model is made.
    #[serde(default = "of_earlier_logs::design_point")]
    pub design_point: Start,
    /// Beyond these it counts as lost.
    #[serde(default = "of_earlier_logs::limits")]
    pub limits: FlightLimits,
}

/// What logs leave out that were written before an airframe had it: their aircraft was the paper's.
mod of_earlier_logs {
    use super::{Airframe, FlightLimits, Start};

    pub fn design_point() -> Start {
        Airframe::paper().design_point
    }

    pub fn limits() -> FlightLimits {
        Airframe::paper().limits
    }
}

/// Where the air data sensors are: from the centre of gravity, body axes (x forward, y right, z down).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirData {
    /// Vanes of angle of attack and sideslip, m.
    pub vanes_m: [f64; 3],
    /// Pitot tube of the airspeed, m.
    pub pitot_m: [f64; 3],
}

impl Airframe {
    /// Reads an airframe file; `name` stands for it in errors.
    ///
    /// # Errors
    /// [`ConfigError`] with line and column for what is not TOML of the right shape, with key, value and range
    /// for a number that cannot be.
    pub fn from_toml(name: &str, text: &str) -> Result<Self, ConfigError> {
        config::parse::<AirframeFile>(name, text)?.into_checked(name)
    }

    /// The same of a file that was read already and may have been changed since.
    ///
    /// # Errors
    /// As [`Airframe::from_toml`], without line and column.
    pub fn from_table(name: &str, table: toml::Table) -> Result<Self, ConfigError> {
        config::of_table::<AirframeFile>(name, table)?.into_checked(name)
    }

    /// Text of the airframe file that comes with the crate.
    #[must_use]
    pub const fn default_text() -> &'static str {
        DEFAULT_AIRFRAME
    }

    /// The aircraft of the paper's cases: [`DEFAULT_AIRFRAME`].
    #[must_use]
    pub fn paper() -> Self {
        Self::from_toml("tvc_jet.toml", DEFAULT_AIRFRAME)
            .expect("a test reads the airframe file that is compiled in")
    }

    /// Inertia tensor, kg m², body axes.
    #[must_use]
    pub fn inertia(&self) -> Matrix3<f64> {
        let m = &self.mass;
        #[rustfmt::skip]
        let inertia = Matrix3::new(
            m.ixx_kg_m2,            0.0, -m.ixz_kg_m2,
                    0.0,    m.iyy_kg_m2,          0.0,
            -m.ixz_kg_m2,           0.0,  m.izz_kg_m2,
        );
        inertia
    }

    /// Mass and inertia for the equations of motion; `None` for what [`Airframe::check`] refuses.
    #[must_use]
    pub fn mass_properties(&self) -> Option<MassProperties> {
        MassProperties::new(self.mass.mass_kg, self.inertia())
    }

    /// The aerodynamic derivative with these letters of the parameter set, as in `Cma`.
    ///
    /// `None` for any other name. For campaigns, which scale them.
    pub fn derivative_mut(&mut self, name: &str) -> Option<&mut f64> {
        derivatives::by_name(&mut self.aero, name)
    }

    /// Checks every number; a dispersed airframe has to pass it like one from a file.
    ///
    /// # Errors
    /// [`RangeError`] for the first number that cannot be, in the unit of the airframe file.
    pub fn check(&self) -> Result<(), RangeError> {
        self.check_mass()?;
        let a = &self.aero;
        check_range("aerodynamics", "area_m2", a.area_m2, 0.01, 10_000.0)?;
        check_range("aerodynamics", "span_m", a.span_m, 0.1, 200.0)?;
        check_range("aerodynamics", "chord_m", a.chord_m, 0.01, 100.0)?;
        derivatives::check(a)?;
        for (linear_key, max_key, linear, max) in [
            ("alpha_linear_deg", "alpha_max_deg", a.alpha_linear_rad, a.alpha_max_rad),
            ("beta_linear_deg", "beta_max_deg", a.beta_linear_rad, a.beta_max_rad),
        ] {
            let linear = linear.to_degrees();
            check_range("aerodynamics", linear_key, linear, 1.0, 60.0)?;
            check_range("aerodynamics", max_key, max.to_degrees(), linear + 0.1, 90.0)?;
        }
        check_range("nozzle", "arm_m", self.nozzle_arm_m, 0.0, 100.0)?;
        let AirData { vanes_m, pitot_m } = self.air_data;
        for (key, place) in [("vanes_m", vanes_m), ("pitot_m", pitot_m)] {
            for value in place {
                check_range("air_data", key, value, -100.0, 100.0)?;
            }
        }
        if let Some(mach) = &self.mach {
            mach.check()?;
        }
        self.design_point.check_table("design_point")?;
        self.limits.check()?;
        self.check_servos()
    }

    fn check_mass(&self) -> Result<(), RangeError> {
        let m = &self.mass;
        check_range("mass", "mass_kg", m.mass_kg, 1.0, 1.0e6)?;
        check_range("mass", "ixx_kg_m2", m.ixx_kg_m2, 1.0e-3, 1.0e9)?;
        check_range("mass", "iyy_kg_m2", m.iyy_kg_m2, 1.0e-3, 1.0e9)?;
        check_range("mass", "izz_kg_m2", m.izz_kg_m2, 1.0e-3, 1.0e9)?;
        // Beyond the geometric mean no mass distribution has this product of inertia.
        let limit = 0.99 * (m.ixx_kg_m2 * m.izz_kg_m2).sqrt();
        check_range("mass", "ixz_kg_m2", m.ixz_kg_m2, -limit, limit)
    }

    /// Of three moments of inertia none is larger than the other two together: distances are squares of two
    /// coordinates each. A dispersed airframe may leave this bound, as it is varied about a body that obeys it.
    fn check_inertia(&self) -> Result<(), RangeError> {
        let Mass { ixx_kg_m2: x, iyy_kg_m2: y, izz_kg_m2: z, .. } = self.mass;
        for (key, value, others) in
            [("ixx_kg_m2", x, y + z), ("iyy_kg_m2", y, x + z), ("izz_kg_m2", z, x + y)]
        {
            check_range("mass", key, value, 1.0e-3, others)?;
        }
        Ok(())
    }

    fn check_servos(&self) -> Result<(), RangeError> {
        for (effector, servo) in self.servos.iter() {
            let section = section(effector);
            check_range(section, "lag_s", servo.lag_s, LAG_MIN_S, 60.0)?;
            if effector == Effector::Engine {
                check_range(section, "thrust_min_n", servo.min, 0.0, 1.0e7)?;
                check_range(section, "thrust_max_n", servo.max, servo.min, 1.0e7)?;
            } else {
                let rate_deg_s = servo.rate_limit.to_degrees();
                check_range(section, "rate_limit_deg_s", rate_deg_s, 0.1, 10_000.0)?;
                check_range(section, "travel_deg", servo.max.to_degrees(), 0.1, 90.0)?;
                check_range(section, "travel_deg", -servo.min.to_degrees(), 0.1, 90.0)?;
            }
        }
        Ok(())
    }
}

/// Table of the airframe file that describes an effector.
const fn section(effector: Effector) -> &'static str {
    match effector {
        Effector::LeftAileron | Effector::RightAileron => "aileron",
        Effector::LeftElevator | Effector::RightElevator => "elevator",
        Effector::Rudder => "rudder",
        Effector::NozzlePitch | Effector::NozzleYaw => "nozzle",
        Effector::Engine => "engine",
    }
}

/// The airframe file as written: the keys that there are.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirframeFile {
    mass: Mass,
    aerodynamics: Aero,
    aileron: SurfaceTable,
    elevator: SurfaceTable,
    rudder: SurfaceTable,
    nozzle: NozzleTable,
    engine: EngineTable,
    air_data: AirData,
    mach: Option<MachEffects>,
    design_point: StartTable,
    limits: LimitsTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceTable {
    lag_s: f64,
    rate_limit_deg_s: f64,
    travel_deg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NozzleTable {
    arm_m: f64,
    lag_s: f64,
    rate_limit_deg_s: f64,
    travel_deg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EngineTable {
    lag_s: f64,
    thrust_min_n: f64,
    thrust_max_n: f64,
}

impl AirframeFile {
    fn into_checked(self, name: &str) -> Result<Airframe, ConfigError> {
        let airframe = self.into_airframe();
        airframe.check().map_err(config::in_file(name))?;
        airframe.check_inertia().map_err(config::in_file(name))?;
        Ok(airframe)
    }

    fn into_airframe(self) -> Airframe {
        let surface = |lag_s, rate_limit_deg_s: f64, travel_deg: f64| Servo {
            lag_s,
            rate_limit: rate_limit_deg_s.to_radians(),
            min: -travel_deg.to_radians(),
            max: travel_deg.to_radians(),
        };
        let of = |t: &SurfaceTable| surface(t.lag_s, t.rate_limit_deg_s, t.travel_deg);
        let (aileron, elevator, rudder) = (of(&self.aileron), of(&self.elevator), of(&self.rudder));
        let n = &self.nozzle;
        let nozzle = surface(n.lag_s, n.rate_limit_deg_s, n.travel_deg);
        let engine = Servo {
            lag_s: self.engine.lag_s,
            rate_limit: f64::INFINITY,
            min: self.engine.thrust_min_n,
            max: self.engine.thrust_max_n,
        };
        Airframe {
            mass: self.mass,
            servos: PerEffector::from_fn(|effector| match effector {
                Effector::LeftAileron | Effector::RightAileron => aileron,
                Effector::LeftElevator | Effector::RightElevator => elevator,
                Effector::Rudder => rudder,
                Effector::NozzlePitch | Effector::NozzleYaw => nozzle,
                Effector::Engine => engine,
            }),
            nozzle_arm_m: self.nozzle.arm_m,
            air_data: self.air_data,
            mach: self.mach,
            design_point: self.design_point.into_start(),
            limits: self.limits.into_limits(),
            aero: self.aerodynamics,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(from: &str, to: &str) -> String {
        assert!(DEFAULT_AIRFRAME.contains(from), "the file has no {from}");
        let text = DEFAULT_AIRFRAME.replacen(from, to, 1);
        Airframe::from_toml("jet.toml", &text).unwrap_err().to_string()
    }

    #[test]
    fn the_airframe_file_of_the_crate_is_good() {
        let airframe = Airframe::from_toml("tvc_jet.toml", DEFAULT_AIRFRAME).unwrap();
        assert_eq!(airframe.mass.mass_kg, 9_295.0);
        assert_eq!(airframe.inertia()[(0, 2)], -1_331.0);
        assert_eq!(airframe.servos[Effector::Engine].max, 60_000.0);
    }

    #[test]
    fn a_negative_mass_is_refused_with_file_key_value_and_range() {
        assert_eq!(
            refusal("mass_kg = 9295.0", "mass_kg = -1"),
            "jet.toml: [mass] mass_kg = -1 is outside 1 to 1000000"
        );
    }

    #[test]
    fn a_value_that_is_no_number_is_refused() {
        let message = refusal("c_pitch_q = -5.245", "c_pitch_q = nan");
        assert_eq!(message, "jet.toml: [aerodynamics] c_pitch_q = NaN is outside -1000 to 1000");
    }

    #[test]
    fn a_moment_of_inertia_beyond_the_other_two_together_is_refused() {
        assert_eq!(
            refusal("izz_kg_m2 = 85552.0", "izz_kg_m2 = 90000"),
            "jet.toml: [mass] izz_kg_m2 = 90000 is outside 0.001 to 88549"
        );
    }

    #[test]
    fn an_impossible_product_of_inertia_is_refused() {
        assert!(
            refusal("ixz_kg_m2 = 1331.0", "ixz_kg_m2 = 40000").contains("ixz_kg_m2 = 40000 is")
        );
    }

    #[test]
    fn a_vane_far_outside_the_aircraft_is_refused() {
        assert_eq!(
            refusal("vanes_m = [7.0,", "vanes_m = [700.0,"),
            "jet.toml: [air_data] vanes_m = 700 is outside -100 to 100"
        );
    }

    #[test]
    fn a_misspelt_key_is_refused_with_its_line() {
        let message = refusal("span_m", "spann_m");
        assert!(message.contains("jet.toml") && message.contains("line"), "{message}");
        assert!(message.contains("spann_m"), "{message}");
    }

    #[test]
    fn a_missing_key_is_named() {
        let message = refusal("c_yaw_beta = 0.075", "");
        assert!(message.contains("c_yaw_beta"), "{message}");
    }
}
