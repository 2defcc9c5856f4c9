//! Airframe files: TOML becomes an [`Airframe`].

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;

use host_io::problem::{At as _, Problem, problem};
use icd::effector_list::{EffectorEntry, Name};
use icd::fault::AirframePart;
use icd::{AxisGains, EffectorKind, EffectorList, LateralSide, PerEffector};
use serde::Deserialize;
use serde::de::Error as _;

use crate::aerodynamics::{Aero, Aerodynamics, AirForces, SurfaceDerivatives};
use crate::airframe::{AirData, Airframe, Mass, Nozzle};
use crate::config::{self, gather};
use crate::damage::{Fuel, Panels};
use crate::derivatives::MachEffects;
use crate::gear::{ContactPoint, Gear};
use crate::limits::FlightLimits;
use crate::range::check_range;
use crate::servos::{Imperfections, SecondOrder, Servo};
use crate::start::{Start, StartKeys};
use crate::tables::aerodynamics::TableAero;
use crate::tables::thrust::{Propeller, Propulsion, ThrustTables};

/// Whether an aircraft of this name comes with the program; its model does so under the same name.
pub fn is_shipped(name: &Path) -> bool {
    aircraft::AIRFRAMES.iter().any(|(known, _)| Path::new(known) == name)
}

/// Reads airframe files: `use plant_sim::ReadAirframe as _;` adds this to [`Airframe`], whose crate knows no files.
pub trait ReadAirframe: Sized {
    /// Reads an airframe file; errors call it `name`.
    fn from_toml(name: &str, text: &str) -> Result<Self, Problem>;

    /// Reads a file that was parsed already and may have been changed since.
    fn from_table(name: &str, table: toml::Table) -> Result<Self, Problem>;

    /// The aircraft of the paper's cases: [`aircraft::DEFAULT_AIRFRAME`].
    fn paper() -> Self;
}

impl ReadAirframe for Airframe {
    fn from_toml(name: &str, text: &str) -> Result<Self, Problem> {
        read(name, config::parse(name, text)?, Some(text))
    }

    fn from_table(name: &str, table: toml::Table) -> Result<Self, Problem> {
        read(name, table, None)
    }

    fn paper() -> Self {
        Self::from_toml("tvc_jet.toml", aircraft::DEFAULT_AIRFRAME)
            .expect("a test reads the airframe file that is compiled in")
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
    gear: Option<GearTable>,
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
            gear: self.gear.map(GearTable::into_gear),
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

/// `[gear]` as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GearTable {
    sink_max_m_s: f64,
    bank_max_deg: f64,
    idle_n: Option<f64>,
    contact: Vec<ContactPoint>,
}

impl GearTable {
    fn into_gear(self) -> Gear {
        let Self { sink_max_m_s, bank_max_deg, idle_n, contact: contacts } = self;
        Gear { sink_max_m_s, bank_max_rad: bank_max_deg.to_radians(), idle_n, contacts }
    }
}

/// The table as written.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsTable {
    roll_deg: f64,
    pitch_deg: f64,
    angle_of_attack_deg: f64,
    sideslip_deg: f64,
    altitude_min_m: f64,
}

impl LimitsTable {
    fn into_limits(self) -> FlightLimits {
        FlightLimits {
            roll_rad: self.roll_deg.to_radians(),
            pitch_rad: self.pitch_deg.to_radians(),
            alpha_rad: self.angle_of_attack_deg.to_radians(),
            beta_rad: self.sideslip_deg.to_radians(),
            altitude_min_m: self.altitude_min_m,
        }
    }
}

#[cfg(test)]
mod tests;
