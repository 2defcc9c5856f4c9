//! The aircraft as data: an [`Airframe`] and the checks of its numbers.

use host_io::problem::{Problem, problem};
use icd::effector_list::Name;
use icd::wire::Aircraft;
use icd::{AxisGains, Effector, EffectorKind, EffectorList, PerEffector};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::aerodynamics::{Aerodynamics, SurfaceDerivatives};
use crate::damage::{Fuel, Panels, PerPart, Remainder};
use crate::derivatives;
use crate::derivatives::MachEffects;
use crate::gear::Gear;
use crate::limits::FlightLimits;
use crate::range::{check_range, check_vector};
use crate::rigid_body::MassProperties;
use crate::servos::{DELAY_MAX_S, Imperfections, Servo};
use crate::start::Start;
use crate::tables::stored;
use crate::tables::thrust::Propulsion;

/// Shortest lag of a servo, s: RK4 with the longest step (4 ms) is stable down to 1.5 ms.
const LAG_MIN_S: f64 = 0.005;

/// Quickest second-order servo. Together they have a pole at -524 1/s: 2.1 over the longest step, and RK4 is stable to 2.78.
const NATURAL_FREQUENCY_MAX_RAD_S: f64 = 200.0;
const DAMPING_RATIO_MAX: f64 = 1.5;

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

/// All data that distinguish one aircraft from another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Airframe {
    /// Name of the aircraft, which the controller's model must have too.
    pub name: Name,
    pub mass: Mass,
    /// Geometry and aerodynamics; derivatives without those of the surfaces.
    pub aero: Aerodynamics,
    pub effectors: EffectorList,
    pub servos: PerEffector<Servo>,
    /// Aerodynamic effect of each surface.
    pub surface_derivatives: PerEffector<SurfaceDerivatives>,
    /// Gains from the main commands to the effectors, by which the aircraft is trimmed.
    pub gains: PerEffector<AxisGains>,
    /// The nozzle; `None` for an aircraft without one.
    pub nozzle: Option<Nozzle>,
    /// Positions of the air data sensors.
    pub air_data: AirData,
    /// Limits of the thrust besides the travel of the engine; `None` if there are none.
    #[serde(with = "stored")]
    pub propulsion: Option<Propulsion>,
    /// How the derivatives change with the Mach number; `None` where they do not.
    pub mach: Option<MachEffects>,
    /// Parts that can be torn off.
    pub damage: Panels,
    /// Fuel that burns; `None` where the mass stays.
    pub fuel: Option<Fuel>,
    /// What touches the ground; `None` for an aircraft that only flies.
    #[serde(default)]
    pub gear: Option<Gear>,
    /// Start of a scenario without one, and design point of the controller's model.
    pub design_point: Start,
    /// Beyond these limits the aircraft counts as lost.
    pub limits: FlightLimits,
}

/// The nozzle that turns the jet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nozzle {
    /// Distance behind the centre of gravity, m.
    pub arm_m: f64,
    /// Thrust below which a controller must not rely on the nozzle, N. The plant does not read it.
    pub thrust_floor_n: f64,
    /// How its two angles combine.
    #[serde(default)]
    pub shape: NozzleShape,
}

/// How the two angles of a nozzle combine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NozzleShape {
    /// The pitch axis carries the yaw axis: Eq. (4) with exact trigonometry.
    #[default]
    Gimbal,
    /// The jet leaves along (1, -tan δy, tan δz): no axis carries the other.
    Axisymmetric,
}

/// Positions of the air data sensors, from the centre of gravity, body axes (x forward, y right, z down).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirData {
    /// Vanes of angle of attack and sideslip, m.
    pub vanes_m: [f64; 3],
    /// Pitot tube of the airspeed, m.
    pub pitot_m: [f64; 3],
}

impl Airframe {
    /// Its identity in packets.
    pub fn aircraft(&self) -> Aircraft {
        Aircraft::new(self.name, &self.effectors)
    }

    /// Positions of the effectors that follow these commands: aileron, elevator, rudder, rad, and thrust, N.
    pub fn follow(&self, commands: [f64; 4]) -> PerEffector<f64> {
        PerEffector::from_fn(|effector| self.gains[effector].of(commands))
    }

    /// Inertia tensor, kg m², body axes.
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
    pub fn mass_properties(&self) -> Option<MassProperties> {
        MassProperties::new(self.mass.mass_kg, self.inertia())
    }

    /// Changes the aerodynamic derivative with these letters (docs/paper.md), as in `Cma`; for surfaces, as in `Cmde`, it changes
    /// each one of the kind. False if the aircraft has none. For campaigns, which scale them.
    pub fn change_derivative(&mut self, name: &str, change: impl FnMut(&mut f64)) -> bool {
        let Self { effectors, aero, surface_derivatives, .. } = self;
        // Tables have no derivatives that could be scaled.
        let Aerodynamics::Derivatives(aero) = aero else { return false };
        let place = derivatives::Place::by_name(name);
        place.is_some_and(|place| place.change(effectors, aero, surface_derivatives, change) > 0)
    }

    /// The derivative with these letters, for surfaces that of the first one of the kind; `None` if the aircraft has none.
    pub fn derivative(&self, name: &str) -> Option<f64> {
        let mut first = None;
        // The walk over the derivatives needs a mutable set; on a copy it can serve the reader too.
        self.clone().change_derivative(name, |value| {
            first.get_or_insert(*value);
        });
        first
    }

    /// Sets the derivative with these letters, for surfaces that of the first one of the kind, and sets the mirrored
    /// value on its mirror image. Returns the value before; `None` if the aircraft has none.
    pub fn set_derivative(&mut self, name: &str, instead: f64) -> Option<f64> {
        let before = self.derivative(name)?;
        self.change_derivative(name, |value| {
            // Zero equals minus zero: without the second test every derivative that is zero would
            // count as mirrored.
            *value = if *value == -before && before != 0.0 { -instead } else { instead };
        });
        Some(before)
    }

    /// The table of the airframe file that describes an effector, for errors.
    pub(crate) fn section(&self, effector: Effector) -> String {
        format!("effector.{}", self.effectors.key(effector))
    }

    /// Checks every number; a dispersed airframe has to pass the same check as one from a file.
    pub fn check(&self) -> Result<(), Problem> {
        let m = &self.mass;
        check_range("mass", "mass_kg", m.mass_kg, 1.0, 1.0e6)?;
        check_range("mass", "ixx_kg_m2", m.ixx_kg_m2, 1.0e-3, 1.0e9)?;
        check_range("mass", "iyy_kg_m2", m.iyy_kg_m2, 1.0e-3, 1.0e9)?;
        check_range("mass", "izz_kg_m2", m.izz_kg_m2, 1.0e-3, 1.0e9)?;
        // Beyond the geometric mean no mass distribution has this product of inertia.
        let limit = 0.99 * (m.ixx_kg_m2 * m.izz_kg_m2).sqrt();
        check_range("mass", "ixz_kg_m2", m.ixz_kg_m2, -limit, limit)?;
        self.aero.geometry().check()?;
        if let Some(a) = self.aero.derivatives() {
            derivatives::check(a, self)?;
            for (linear_key, max_key, linear, max) in [
                ("alpha_linear_deg", "alpha_max_deg", a.alpha_linear_rad, a.alpha_max_rad),
                ("beta_linear_deg", "beta_max_deg", a.beta_linear_rad, a.beta_max_rad),
            ] {
                let linear = linear.to_degrees();
                check_range("aerodynamics", linear_key, linear, 1.0, 60.0)?;
                // `bent` divides by the difference of the two.
                check_range("aerodynamics", max_key, max.to_degrees(), linear + 0.1, 90.0)?;
            }
        }
        if let Some(nozzle) = &self.nozzle {
            check_range("nozzle", "arm_m", nozzle.arm_m, 0.0, 100.0)?;
            // The compensator divides by this thrust, so zero is no floor.
            check_range("nozzle", "thrust_floor_n", nozzle.thrust_floor_n, 1.0e-3, 1.0e7)?;
        }
        check_vector("air_data", "vanes_m", self.air_data.vanes_m, 100.0)?;
        check_vector("air_data", "pitot_m", self.air_data.pitot_m, 100.0)?;
        if let Some(mach) = &self.mach {
            mach.check()?;
        }
        self.damage.check()?;
        if let Some(gear) = &self.gear {
            gear.check()?;
            self.check_steering(gear)?;
        }
        if let Some(fuel) = &self.fuel {
            fuel.check(self.mass.mass_kg)?;
            // `without` also gives `None` where nothing is missing, hence the test for zero.
            // With empty tanks there is still a body that can fly.
            let rest = self.without(&PerPart::default(), fuel.initial_kg);
            if rest.is_none() && fuel.initial_kg != 0.0 {
                check_range("fuel", "initial_kg (with [mass])", fuel.initial_kg, 0.0, 0.0)?;
            }
        }
        self.design_point.check("design_point")?;
        self.limits.check()?;
        self.check_effectors()
    }

    /// Whether every wheel that is steered is so by a surface of the aircraft.
    fn check_steering(&self, gear: &Gear) -> Result<(), Problem> {
        let list = &self.effectors;
        let surfaces = || list.all().filter(|e| list.is_angle(*e)).map(|e| list.name(e));
        for contact in &gear.contacts {
            let Some(steering) = contact.steering else { continue };
            if !surfaces().any(|name| name == steering.effector.as_str()) {
                let known = surfaces().collect::<Vec<_>>().join(", ");
                return Err(problem!(
                    "[gear.contact.{}] steering.effector = `{}`; the aircraft has the surfaces {known}",
                    contact.name,
                    steering.effector
                ));
            }
        }
        Ok(())
    }

    /// The surface on each part of the airframe that can be torn off.
    pub fn surfaces_of_parts(&self) -> PerPart<Option<Effector>> {
        let named =
            |name: Name| self.effectors.all().find(|e| self.effectors.name(*e) == name.as_str());
        self.damage.all().map(|panel| panel?.effector.and_then(named))
    }

    /// Which parts can be torn off: those of `[damage]`, if without all of them and without fuel a body with a possible mass and
    /// inertia is left. Then it is also left without some of them.
    pub fn parts(&self) -> PerPart<bool> {
        let described = self.damage.all().map(|panel| panel.is_some());
        let all = described.map(|is_described| f64::from(u8::from(is_described)));
        let rest = self.without(&all, self.fuel.map_or(0.0, |fuel| fuel.initial_kg));
        described.map(|is_described| is_described && rest.is_some())
    }

    /// What is left without parts and burnt fuel, kg; `None` if nothing is missing or the rest is no possible body.
    pub fn without(&self, torn_off: &PerPart<f64>, burnt_kg: f64) -> Option<Remainder> {
        let tanks_m = self.fuel.map_or_else(Vector3::zeros, |fuel| fuel.at_m.into());
        let surfaces = self.surfaces_of_parts();
        let whole = self.mass_properties()?;
        Remainder::of(&whole, &self.damage, &surfaces, torn_off, (burnt_kg, &tanks_m))
    }

    fn check_effectors(&self) -> Result<(), Problem> {
        for effector in self.effectors.all() {
            let section = self.section(effector);
            let servo = &self.servos[effector];
            let check = |key, value, min, max| check_range(&section, key, value, min, max);
            let Imperfections { delay_s, deadband, hysteresis, bias, stall_pressure_pa } =
                servo.imperfections;
            if let Some(order) = &servo.second_order {
                let omega = order.natural_frequency_rad_s;
                check("natural_frequency_rad_s", omega, 0.5, NATURAL_FREQUENCY_MAX_RAD_S)?;
                check("damping_ratio", order.damping_ratio, 0.1, DAMPING_RATIO_MAX)?;
            } else {
                check("lag_s", servo.lag_s, LAG_MIN_S, 60.0)?;
            }
            check("delay_s", delay_s, 0.0, DELAY_MAX_S)?;
            if let Some(pressure_pa) = stall_pressure_pa {
                check("stall_dynamic_pressure_pa", pressure_pa, 1.0, 1.0e7)?;
            }
            if self.effectors.kind(effector) == Some(EffectorKind::Engine) {
                check("thrust_min_n", servo.min, -1.0e7, 1.0e7)?;
                check("thrust_max_n", servo.max, servo.min, 1.0e7)?;
            } else {
                check("rate_limit_deg_s", servo.rate_limit.to_degrees(), 0.1, 10_000.0)?;
                check("travel_deg (lower end)", servo.min.to_degrees(), -90.0, 0.0)?;
                let [lower, upper] = [servo.min, servo.max].map(f64::to_degrees);
                check("travel_deg (upper end)", upper, (lower + 0.1).max(0.0), 90.0)?;
                let half = 0.5 * (upper - lower);
                check("deadband_deg", deadband.to_degrees(), 0.0, half)?;
                check("hysteresis_deg", hysteresis.to_degrees(), 0.0, half)?;
                check("bias_deg", bias.to_degrees(), -half, half)?;
            }
            for (key, gain) in self.gains[effector].named() {
                check(key, gain, -10.0, 10.0)?;
            }
        }
        Ok(())
    }
}
