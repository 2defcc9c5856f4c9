//! The airframe file as written.

use host_io::problem::{At as _, Problem, problem};
use std::collections::BTreeSet;
use std::sync::LazyLock;

use icd::effector_list::{EffectorEntry, Name};
use icd::fault::AirframePart;
use icd::{AxisGains, Effector, EffectorKind, EffectorList, LateralSide, PerEffector};
use serde::Deserialize;
use serde::de::{DeserializeOwned, Error as _};

use super::{AirData, Airframe, Mass, Nozzle};
use crate::aerodynamics::{Aero, Aerodynamics, SurfaceDerivatives};
use crate::config::keys::gather;
use crate::config::{self, units};
use crate::damage::{Fuel, Panels};
use crate::limits::{FlightLimits, LimitsTable};
use crate::mach::MachEffects;
use crate::servos::{Imperfections, SecondOrder, Servo};
use crate::start::{Start, StartTable};
use crate::tables::aerodynamics::TableAero;
use crate::tables::thrust::{Propeller, Propulsion, ThrustTables};

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
    design_point: Option<StartTable>,
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
pub(super) fn read(
    file: &str,
    mut table: toml::Table,
    text: Option<&str>,
) -> Result<Airframe, Problem> {
    let has_tables = table
        .get("aerodynamics")
        .and_then(toml::Value::as_table)
        .is_some_and(|part| part.contains_key("sum") || part.contains_key("table"));
    // Line and column are those of the text, which has no converted units.
    let text = match units::convert(file, &mut table, known_keys())? {
        true => None,
        false => text,
    };
    if has_tables {
        parse::<TableAero>(file, table, text)?.into_checked(file, Aerodynamics::Tables)
    } else {
        parse::<Aero>(file, table, text)?.into_checked(file, Aerodynamics::Derivatives)
    }
}

fn parse<A: DeserializeOwned>(
    file: &str,
    table: toml::Table,
    text: Option<&str>,
) -> Result<AirframeFile<A>, Problem> {
    text.map_or_else(|| config::of_table(file, table), |text| config::parse(file, text))
}

/// Converts the keys of a parsed file that have units of its sources to those that its reader has.
pub fn convert_units(file: &str, table: &mut toml::Table) -> Result<(), Problem> {
    units::convert(file, table, known_keys()).map(drop)
}

/// The keys of both forms of the file.
fn known_keys() -> &'static BTreeSet<String> {
    static KEYS: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
        let mut keys = BTreeSet::new();
        gather::<AirframeFile<Aero>>("", &mut keys);
        gather::<AirframeFile<TableAero>>("", &mut keys);
        gather::<ThrustTables>("propulsion", &mut keys);
        gather::<Propeller>("propulsion", &mut keys);
        keys
    });
    &KEYS
}

impl<A> AirframeFile<A> {
    fn into_checked(self, name: &str, form: fn(A) -> Aerodynamics) -> Result<Airframe, Problem> {
        let airframe = self.into_airframe(name, form)?;
        surfaces_are_there(name, &airframe)?;
        airframe.check().at(name)?;
        airframe.check_inertia().at(name)?;
        airframe.check_tables().at(name)?;
        Ok(airframe)
    }

    fn into_airframe(self, file: &str, form: fn(A) -> Aerodynamics) -> Result<Airframe, Problem> {
        let (air_data, design_point, limits) = self.about_flight(file)?;
        let aero = form(self.aerodynamics);
        let has_tables = aero.derivatives().is_none();
        let name = short(file, &self.name)?;
        let entries: Vec<EffectorEntry> =
            self.effector.iter().map(|table| table.entry(file)).collect::<Result<_, _>>()?;
        let effectors = match entries.is_empty() {
            true => EffectorList::default(),
            false => EffectorList::new(entries).at(file)?,
        };
        let tables: Vec<(Effector, &EffectorTable)> = effectors.all().zip(&self.effector).collect();
        let (mut servos, mut surface_derivatives) =
            (PerEffector::default(), PerEffector::default());
        let mut gains = PerEffector::default();
        for (effector, table) in tables {
            servos[effector] = table.servo(file)?;
            surface_derivatives[effector] = table.derivatives(file, has_tables)?;
            gains[effector] = table.gains;
        }
        let nozzle = effectors
            .all()
            .find(|effector| effectors.kind(*effector).is_some_and(EffectorKind::is_nozzle));
        if let (Some(nozzle), None) = (nozzle, self.nozzle) {
            return Err(problem!(
                "{file}: effector `{}`: [nozzle] is missing, and a nozzle needs its arm_m and thrust_floor_n",
                effectors.name(nozzle)
            ));
        }
        let excluded =
            |section, other| Err(problem!("{file}: [{section}] has no meaning beside {other}"));
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
            air_data,
            propulsion: self.propulsion,
            mach: self.mach,
            damage: self.damage,
            fuel: self.fuel,
            design_point,
            limits,
        })
    }

    /// Places of the air data sensors, design point and limits: an aircraft needs them, a body without effectors does not.
    fn about_flight(&self, file: &str) -> Result<(AirData, Start, FlightLimits), Problem> {
        let missing = |field| Err(toml::de::Error::missing_field(field)).at(file);
        let is_aircraft = !self.effector.is_empty();
        if is_aircraft && self.air_data.is_none() {
            return missing("air_data");
        }
        if is_aircraft && self.design_point.is_none() {
            return missing("design_point");
        }
        if is_aircraft && self.limits.is_none() {
            return missing("limits");
        }
        Ok((
            self.air_data.unwrap_or(AirData { vanes_m: [0.0; 3], pitot_m: [0.0; 3] }),
            self.design_point.map_or(Start::NOT_USED, StartTable::into_start),
            self.limits.map_or(FlightLimits::NONE, LimitsTable::into_limits),
        ))
    }
}

/// Checks that the surfaces on the parts of `[damage]` are effectors of the aircraft.
fn surfaces_are_there(file: &str, airframe: &Airframe) -> Result<(), Problem> {
    let parts = AirframePart::ALL.into_iter().zip(airframe.damage.all());
    for ((part, panel), found) in parts.zip(airframe.surfaces_of_parts()) {
        let Some(name) = panel.and_then(|panel| panel.effector) else { continue };
        if found.is_none() {
            let known: Vec<&str> =
                airframe.effectors.all().map(|e| airframe.effectors.name(e)).collect();
            let key = format!("damage.{}.effector", part.key());
            let known = known.join(", ");
            return Err(problem!("{file}: {key} = `{name}`, the aircraft has only {known}"));
        }
    }
    Ok(())
}

/// A name within the length limit.
fn short(file: &str, name: &str) -> Result<Name, Problem> {
    Name::from(name).map_err(|_| {
        let longest = icd::effector_list::NAME_MAX;
        problem!("{file}: name = `{name}` is too long, at most {longest} bytes")
    })
}

impl EffectorTable {
    fn entry(&self, file: &str) -> Result<EffectorEntry, Problem> {
        Ok(EffectorEntry {
            name: short(file, &self.name)?,
            kind: self.kind,
            side: self.side,
            partner: self.partner.as_ref().map(|partner| short(file, partner)).transpose()?,
            instance: self.instance,
        })
    }

    fn error(&self, file: &str, key: &str, problem: &str) -> Problem {
        problem!("{file}: effector `{}`: {key} {problem}", self.name)
    }

    /// Checks that the effector has the keys that its kind needs, and no others.
    fn servo(&self, file: &str) -> Result<Servo, Problem> {
        let is_angle = self.kind.is_angle();
        let of_angles = [
            ("rate_limit_deg_s", self.rate_limit_deg_s.is_some()),
            ("travel_deg", self.travel_deg.is_some()),
        ];
        let of_engines = [
            ("thrust_min_n", self.thrust_min_n.is_some()),
            ("thrust_max_n", self.thrust_max_n.is_some()),
        ];
        let (needed, others) =
            if is_angle { (of_angles, of_engines) } else { (of_engines, of_angles) };
        if let Some((key, _)) = needed.into_iter().find(|(_, is_there)| !is_there) {
            return Err(self.error(file, key, "is missing"));
        }
        if let Some((key, _)) = others.into_iter().find(|(_, is_there)| *is_there) {
            return Err(self.error(file, key, "has no meaning for this kind"));
        }
        let (second_order, lag_s) = self.order(file)?;
        let imperfections = self.imperfections(file)?;
        Ok(if is_angle {
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
            Servo { lag_s, rate_limit: f64::INFINITY, min, max, second_order, imperfections }
        })
    }

    /// The order of the servo, and its lag, which a second order replaces.
    fn order(&self, file: &str) -> Result<(Option<SecondOrder>, f64), Problem> {
        match (self.natural_frequency_rad_s, self.damping_ratio, self.lag_s) {
            (Some(natural_frequency_rad_s), damping_ratio, _) => {
                let damping_ratio = damping_ratio.unwrap_or(DAMPING_RATIO);
                let order = SecondOrder { natural_frequency_rad_s, damping_ratio };
                Ok((Some(order), order.lag_s()))
            }
            (None, Some(_), _) => Err(self.error(
                file,
                "damping_ratio",
                "has no meaning without natural_frequency_rad_s",
            )),
            (None, None, Some(lag_s)) => Ok((None, lag_s)),
            (None, None, None) => {
                Err(self.error(file, "lag_s", "or natural_frequency_rad_s is missing"))
            }
        }
    }

    fn imperfections(&self, file: &str) -> Result<Imperfections, Problem> {
        let of_angles = [
            ("deadband_deg", self.deadband_deg),
            ("hysteresis_deg", self.hysteresis_deg),
            ("bias_deg", self.bias_deg),
        ];
        let misplaced = |(key, value): (&'static str, Option<f64>)| value.is_some().then_some(key);
        let misplaced = match self.kind {
            kind if kind.is_surface() => None,
            kind => {
                let stall = ("stall_dynamic_pressure_pa", self.stall_dynamic_pressure_pa);
                let angles = of_angles.into_iter().filter(|_| !kind.is_angle());
                angles.chain([stall]).find_map(misplaced)
            }
        };
        if let Some(key) = misplaced {
            return Err(self.error(file, key, "has no meaning for this kind"));
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

    fn derivatives(&self, file: &str, has_tables: bool) -> Result<SurfaceDerivatives, Problem> {
        let given = [
            ("c_lift", self.c_lift),
            ("c_drag", self.c_drag),
            ("c_side", self.c_side),
            ("c_roll", self.c_roll),
            ("c_pitch", self.c_pitch),
            ("c_yaw", self.c_yaw),
            ("yaw_per_roll", self.yaw_per_roll),
        ];
        let problem = match (self.kind.is_surface(), has_tables) {
            (false, _) => Some("has no meaning for what is no surface"),
            (true, true) => Some("has no meaning beside tables in [aerodynamics]"),
            (true, false) => None,
        };
        if let (Some(problem), Some((key, _))) =
            (problem, given.into_iter().find(|(_, value)| value.is_some()))
        {
            return Err(self.error(file, key, problem));
        }
        let [c_lift, c_drag, c_side, c_roll, c_pitch, c_yaw, yaw_per_roll] =
            given.map(|(_, value)| value.unwrap_or(0.0));
        Ok(SurfaceDerivatives { c_lift, c_drag, c_side, c_roll, c_pitch, c_yaw, yaw_per_roll })
    }
}

/// Damping ratio of a second-order servo whose file has none: the usual one, with an overshoot of 5 %.
const DAMPING_RATIO: f64 = 0.7;
