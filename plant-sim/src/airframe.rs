//! The aircraft as data: an airframe file becomes an [`Airframe`].

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;

use host_io::problem::{At as _, Problem, problem};
use icd::effector_list::{EffectorEntry, Name};
use icd::fault::AirframePart;
use icd::wire::Aircraft;
use icd::{AxisGains, Effector, EffectorKind, EffectorList, LateralSide, PerEffector};
use nalgebra::{Matrix3, Vector3};
use serde::de::Error as _;
use serde::{Deserialize, Serialize};

use crate::aerodynamics::{Aero, Aerodynamics, AirForces, SurfaceDerivatives};
use crate::config::{self, gather};
use crate::damage::{Fuel, Panels, PerPart, Remainder};
use crate::derivatives;
use crate::derivatives::MachEffects;
use crate::limits::{FlightLimits, LimitsTable};
use crate::range::{check_range, check_vector};
use crate::rigid_body::MassProperties;
use crate::servos::{DELAY_MAX_S, Imperfections, SecondOrder, Servo};
use crate::start::{Start, StartKeys};
use crate::tables::aerodynamics::TableAero;
use crate::tables::stored;
use crate::tables::thrust::{Propeller, Propulsion, ThrustTables};

/// Whether an aircraft of this name comes with the program; its model does so under the same name.
pub fn is_shipped(name: &Path) -> bool {
    aircraft::AIRFRAMES.iter().any(|(known, _)| Path::new(known) == name)
}

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
    /// Reads an airframe file; errors call it `name`.
    pub fn from_toml(name: &str, text: &str) -> Result<Self, Problem> {
        read(name, config::parse(name, text)?, Some(text))
    }

    /// Reads a file that was parsed already and may have been changed since.
    pub fn from_table(name: &str, table: toml::Table) -> Result<Self, Problem> {
        read(name, table, None)
    }

    /// The aircraft of the paper's cases: [`aircraft::DEFAULT_AIRFRAME`].
    pub fn paper() -> Self {
        Self::from_toml("tvc_jet.toml", aircraft::DEFAULT_AIRFRAME)
            .expect("a test reads the airframe file that is compiled in")
    }

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

/// The airframe file as written: the keys that it has, with derivatives ([`Aero`]) or tables ([`TableAero`]) in
/// `[aerodynamics]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirframeFile<A> {
    name: String,
    mass: Mass,
    aerodynamics: A,
    #[serde(default)]
    effector: Vec<EffectorTable>,
    nozzle: Option<Nozzle>,
    /// A body without effectors needs neither this nor the design point nor limits.
    air_data: Option<AirData>,
    mach: Option<MachEffects>,
    design_point: Option<StartKeys<f64>>,
    limits: Option<LimitsTable>,
    #[serde(default)]
    damage: Panels,
    fuel: Option<Fuel>,
    propulsion: Option<Propulsion>,
}

/// One `[[effector]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectorTable {
    name: String,
    kind: EffectorKind,
    #[serde(default)]
    side: LateralSide,
    partner: Option<String>,
    instance: u8,
    #[serde(default)]
    gains: AxisGains,
    lag_s: Option<f64>,
    natural_frequency_rad_s: Option<f64>,
    damping_ratio: Option<f64>,
    rate_limit_deg_s: Option<f64>,
    travel_deg: Option<[f64; 2]>,
    delay_s: Option<f64>,
    deadband_deg: Option<f64>,
    hysteresis_deg: Option<f64>,
    bias_deg: Option<f64>,
    stall_dynamic_pressure_pa: Option<f64>,
    thrust_min_n: Option<f64>,
    thrust_max_n: Option<f64>,
    c_lift: Option<f64>,
    c_drag: Option<f64>,
    c_side: Option<f64>,
    c_roll: Option<f64>,
    c_pitch: Option<f64>,
    c_yaw: Option<f64>,
    yaw_per_roll: Option<f64>,
}

/// Reads a file that has been parsed as TOML. `text` provides line and column of errors.
fn read(file: &str, table: toml::Table, text: Option<&str>) -> Result<Airframe, Problem> {
    // Serde could try both forms, but of a mistake in either it would say only that no form fits.
    let has_tables = table
        .get("aerodynamics")
        .and_then(toml::Value::as_table)
        .is_some_and(|part| part.contains_key("sum") || part.contains_key("table"));
    if has_tables {
        let parsed: AirframeFile<TableAero> = config::in_units(file, table, text, &KNOWN_KEYS)?;
        parsed.into_checked(Aerodynamics::Tables).at(file)
    } else {
        let parsed: AirframeFile<Aero> = config::in_units(file, table, text, &KNOWN_KEYS)?;
        parsed.into_checked(Aerodynamics::Derivatives).at(file)
    }
}

/// Converts the keys of a parsed file that have units of its sources to those that its reader has.
pub fn convert_units(file: &str, table: &mut toml::Table) -> Result<(), Problem> {
    config::convert(file, table, &KNOWN_KEYS).map(drop)
}

/// The keys of both forms of the file.
static KNOWN_KEYS: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    let mut keys = BTreeSet::new();
    gather::<AirframeFile<Aero>>("", &mut keys);
    gather::<AirframeFile<TableAero>>("", &mut keys);
    // An enum with a tag shows the search no keys, so each form is searched by itself.
    gather::<ThrustTables>("propulsion", &mut keys);
    gather::<Propeller>("propulsion", &mut keys);
    keys
});

impl<A> AirframeFile<A> {
    fn into_checked(self, form: fn(A) -> Aerodynamics) -> Result<Airframe, Problem> {
        let airframe = self.into_airframe(form)?;
        // The surfaces on the parts of `[damage]` are effectors of the aircraft.
        let parts = AirframePart::ALL.into_iter().zip(airframe.damage.all());
        for ((part, panel), found) in parts.zip(airframe.surfaces_of_parts()) {
            let Some(name) = panel.and_then(|panel| panel.effector) else { continue };
            if found.is_none() {
                let known: Vec<&str> =
                    airframe.effectors.all().map(|e| airframe.effectors.name(e)).collect();
                let key = format!("damage.{}.effector", part.key());
                let known = known.join(", ");
                return Err(problem!("{key} = `{name}`, the aircraft has only {known}"));
            }
        }
        airframe.check()?;
        // No moment of inertia is larger than the sum of the two others: distances are squares of two coordinates each. A dispersed
        // airframe may exceed this bound, as it is varied about a body that obeys it.
        let Mass { ixx_kg_m2: x, iyy_kg_m2: y, izz_kg_m2: z, .. } = airframe.mass;
        for (key, value, others) in
            [("ixx_kg_m2", x, y + z), ("iyy_kg_m2", y, x + z), ("izz_kg_m2", z, x + y)]
        {
            check_range("mass", key, value, 1.0e-3, others)?;
        }
        // Whether the tables can be evaluated.
        AirForces::new(&airframe)?;
        airframe.propulsion.as_ref().map(Propulsion::build).transpose()?;
        Ok(airframe)
    }

    fn into_airframe(self, form: fn(A) -> Aerodynamics) -> Result<Airframe, Problem> {
        // A body without effectors has no air data sensors, no design point and no limits; an aircraft needs them.
        for (field, is_there) in [
            ("air_data", self.air_data.is_some()),
            ("design_point", self.design_point.is_some()),
            ("limits", self.limits.is_some()),
        ] {
            if !self.effector.is_empty() && !is_there {
                return Err(toml::de::Error::missing_field(field).into());
            }
        }
        let aero = form(self.aerodynamics);
        let has_tables = aero.derivatives().is_none();
        let name = short(&self.name)?;
        let entries: Vec<EffectorEntry> =
            self.effector.iter().map(|table| table.entry()).collect::<Result<_, _>>()?;
        // `new` refuses an empty list, which a body without effectors has.
        let effectors = match entries.is_empty() {
            true => EffectorList::default(),
            false => EffectorList::new(entries)?,
        };
        let mut servos = PerEffector::default();
        let mut surface_derivatives = PerEffector::default();
        let mut gains = PerEffector::default();
        for (effector, table) in effectors.all().zip(&self.effector) {
            servos[effector] = table.servo()?;
            surface_derivatives[effector] = table.derivatives(has_tables)?;
            gains[effector] = table.gains;
        }
        let nozzle = effectors
            .all()
            .find(|effector| effectors.kind(*effector).is_some_and(EffectorKind::is_nozzle));
        if let (Some(nozzle), None) = (nozzle, self.nozzle) {
            return Err(problem!(
                "effector `{}`: [nozzle] is missing, and a nozzle needs its arm_m and thrust_floor_n",
                effectors.name(nozzle)
            ));
        }
        let excluded = |section, other| Err(problem!("[{section}] has no meaning beside {other}"));
        if has_tables && self.mach.is_some() {
            return excluded("mach", "tables in [aerodynamics]: they have the input mach");
        }
        if self.propulsion.is_some() && effectors.only(EffectorKind::Engine).is_none() {
            return excluded("propulsion", "effectors without an engine");
        }
        Ok(Airframe {
            name,
            mass: self.mass,
            aero,
            effectors,
            servos,
            surface_derivatives,
            gains,
            nozzle: self.nozzle,
            // Only a body without effectors can lack these three, as checked above, and nothing
            // reads them then.
            air_data: self.air_data.unwrap_or(AirData { vanes_m: [0.0; 3], pitot_m: [0.0; 3] }),
            propulsion: self.propulsion,
            mach: self.mach,
            damage: self.damage,
            fuel: self.fuel,
            design_point: self
                .design_point
                .map_or(Start::NOT_USED, |keys| keys.over(&Start::NOT_USED)),
            limits: self.limits.map_or(FlightLimits::NONE, LimitsTable::into_limits),
        })
    }
}

/// A name within the length limit.
fn short(name: &str) -> Result<Name, Problem> {
    Name::from(name).map_err(|_| {
        let longest = icd::effector_list::NAME_MAX;
        problem!("name = `{name}` is too long, at most {longest} bytes")
    })
}

impl EffectorTable {
    fn entry(&self) -> Result<EffectorEntry, Problem> {
        Ok(EffectorEntry {
            name: short(&self.name)?,
            kind: self.kind,
            side: self.side,
            partner: self.partner.as_ref().map(|partner| short(partner)).transpose()?,
            instance: self.instance,
        })
    }

    fn error(&self, key: &str, problem: &str) -> Problem {
        problem!("effector `{}`: {key} {problem}", self.name)
    }

    /// Checks that the effector has the keys that its kind needs, and no others.
    fn servo(&self) -> Result<Servo, Problem> {
        let is_angle = self.kind.is_angle();
        let keys = [
            ("rate_limit_deg_s", self.rate_limit_deg_s.is_some(), true),
            ("travel_deg", self.travel_deg.is_some(), true),
            ("thrust_min_n", self.thrust_min_n.is_some(), false),
            ("thrust_max_n", self.thrust_max_n.is_some(), false),
        ];
        let is_own = |of_angles: bool| of_angles == is_angle;
        if let Some((key, ..)) = keys.iter().find(|(_, there, of)| is_own(*of) && !there) {
            return Err(self.error(key, "is missing"));
        }
        if let Some((key, ..)) = keys.iter().find(|(_, there, of)| !is_own(*of) && *there) {
            return Err(self.error(key, "has no meaning for this kind"));
        }
        let (second_order, lag_s) = self.order()?;
        let imperfections = self.imperfections()?;
        Ok(if is_angle {
            // Present, as checked above.
            let [min, max] = self.travel_deg.unwrap_or_default();
            Servo {
                lag_s,
                rate_limit: self.rate_limit_deg_s.unwrap_or_default().to_radians(),
                // The negative of the same number has the same bits.
                min: if min == -max { -max.to_radians() } else { min.to_radians() },
                max: max.to_radians(),
                second_order,
                imperfections,
            }
        } else {
            let (min, max) = (self.thrust_min_n, self.thrust_max_n);
            let (min, max) = (min.unwrap_or_default(), max.unwrap_or_default());
            // The lag alone slows an engine; files have no rate for it.
            Servo { lag_s, rate_limit: f64::INFINITY, min, max, second_order, imperfections }
        })
    }

    /// The order of the servo, and its lag, which a second order replaces.
    fn order(&self) -> Result<(Option<SecondOrder>, f64), Problem> {
        match (self.natural_frequency_rad_s, self.damping_ratio, self.lag_s) {
            (Some(natural_frequency_rad_s), damping_ratio, _) => {
                let damping_ratio = damping_ratio.unwrap_or(DAMPING_RATIO);
                let order = SecondOrder { natural_frequency_rad_s, damping_ratio };
                Ok((Some(order), order.lag_s()))
            }
            (None, Some(_), _) => {
                Err(self.error("damping_ratio", "has no meaning without natural_frequency_rad_s"))
            }
            (None, None, Some(lag_s)) => Ok((None, lag_s)),
            (None, None, None) => Err(self.error("lag_s", "or natural_frequency_rad_s is missing")),
        }
    }

    fn imperfections(&self) -> Result<Imperfections, Problem> {
        let of_angles = [
            ("deadband_deg", self.deadband_deg),
            ("hysteresis_deg", self.hysteresis_deg),
            ("bias_deg", self.bias_deg),
        ];
        let stall = [("stall_dynamic_pressure_pa", self.stall_dynamic_pressure_pa)];
        let angles = of_angles.into_iter().filter(|_| !self.kind.is_angle());
        let stall = stall.into_iter().filter(|_| !self.kind.is_surface());
        if let Some((key, _)) = angles.chain(stall).find(|(_, value)| value.is_some()) {
            return Err(self.error(key, "has no meaning for this kind"));
        }
        let [deadband, hysteresis, bias] =
            of_angles.map(|(_, value)| value.unwrap_or_default().to_radians());
        Ok(Imperfections {
            delay_s: self.delay_s.unwrap_or_default(),
            deadband,
            hysteresis,
            bias,
            stall_pressure_pa: self.stall_dynamic_pressure_pa,
        })
    }

    fn derivatives(&self, has_tables: bool) -> Result<SurfaceDerivatives, Problem> {
        let Self { c_lift, c_drag, c_side, c_roll, c_pitch, c_yaw, yaw_per_roll, .. } = *self;
        // In the order of `DERIVATIVES`, with which the list is zipped below.
        let given = [c_lift, c_drag, c_side, c_roll, c_pitch, c_yaw, yaw_per_roll];
        let problem = match (self.kind.is_surface(), has_tables) {
            (false, _) => Some("has no meaning for what is no surface"),
            (true, true) => Some("has no meaning beside tables in [aerodynamics]"),
            (true, false) => None,
        };
        let mut derivatives = SurfaceDerivatives::default();
        for (derivative, value) in SurfaceDerivatives::DERIVATIVES.iter().zip(given) {
            if let (Some(problem), Some(_)) = (problem, value) {
                return Err(self.error(derivative.key, problem));
            }
            *(derivative.field)(&mut derivatives) = value.unwrap_or(0.0);
        }
        Ok(derivatives)
    }
}

/// Damping ratio of a second-order servo whose file has none: the usual one, with an overshoot of 5 %.
const DAMPING_RATIO: f64 = 0.7;

#[cfg(test)]
mod tests;
