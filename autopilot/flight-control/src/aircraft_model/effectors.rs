//! The effectors in the controller's model: what each is, how a healthy one moves, what moments it makes.

use arrayvec::ArrayVec;
use icd::effector_list::{EffectorEntry, EffectorListError, Name};
use icd::{AxisGains, Effector, EffectorKind, EffectorList, LateralSide, PerEffector};
use serde::{Deserialize, Serialize};

use super::{AircraftModelError, check_of};

/// The effectors of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Tables", into = "Tables")]
pub struct EffectorModel {
    /// What they are.
    pub list: EffectorList,
    /// How the healthy ones move.
    pub servos: PerEffector<ServoModel>,
    /// Lift coefficient per deflection, 1/rad.
    pub c_lift: PerEffector<f64>,
    /// Roll moment coefficient per deflection, 1/rad.
    pub c_roll: PerEffector<f64>,
    /// Pitch moment coefficient per deflection, 1/rad.
    pub c_pitch: PerEffector<f64>,
    /// Yaw moment coefficient per deflection, 1/rad.
    pub c_yaw: PerEffector<f64>,
    /// What each gets of the main command.
    pub gains: PerEffector<AxisGains>,
}

/// How a healthy effector moves: rad, an engine newton.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoModel {
    /// Time constant of the first-order lag, s.
    pub lag_s: f64,
    /// Rate limit, rad/s; infinite for an engine, because the model does not limit how fast thrust changes.
    pub rate_limit: f64,
    /// Lower end of the travel, rad or N.
    pub min: f64,
    /// Upper end of the travel, rad or N.
    pub max: f64,
}

/// One `[[effector]]` of a model file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectorFile {
    /// Name, as in `left aileron`.
    pub name: Name,
    /// What it is.
    pub kind: EffectorKind,
    /// Where it is.
    #[serde(default)]
    pub side: LateralSide,
    /// Name of the one on the other side.
    #[serde(default)]
    pub partner: Option<Name>,
    /// Number in MAVLink.
    pub instance: u8,
    /// Time constant, s.
    pub lag_s: f64,
    /// Rate limit; none for an engine.
    #[serde(default)]
    pub rate_limit_rad_s: Option<f64>,
    /// Travel, lower and upper end; none for an engine.
    #[serde(default)]
    pub travel_rad: Option<[f64; 2]>,
    /// Smallest and largest thrust; for an engine only.
    #[serde(default)]
    pub thrust_n: Option<[f64; 2]>,
    /// Lift per rad.
    #[serde(default)]
    pub c_lift: f64,
    /// Roll moment per rad.
    #[serde(default)]
    pub c_roll: f64,
    /// Pitch moment per rad.
    #[serde(default)]
    pub c_pitch: f64,
    /// Yaw moment per rad.
    #[serde(default)]
    pub c_yaw: f64,
    /// What it gets of the main command.
    #[serde(default)]
    pub gains: AxisGains,
}

type Tables = ArrayVec<EffectorFile, { Effector::MAX }>;

/// Why the tables are no list of effectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TablesError {
    /// The list cannot be.
    List(EffectorListError),
    /// A key is missing, or stands where it means nothing.
    Key {
        /// Name of the effector.
        effector: Name,
        /// The keys that its kind has.
        expected: &'static str,
    },
}

impl core::fmt::Display for TablesError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::List(error) => error.fmt(f),
            Self::Key { effector, expected } => {
                write!(
                    f,
                    "effector `{effector}`: expected the keys {expected}, and no others of travel and rate"
                )
            }
        }
    }
}

impl TryFrom<Tables> for EffectorModel {
    type Error = TablesError;

    fn try_from(tables: Tables) -> Result<Self, TablesError> {
        let entries = tables.iter().map(|table| EffectorEntry {
            name: table.name,
            kind: table.kind,
            side: table.side,
            partner: table.partner,
            instance: table.instance,
        });
        let list = EffectorList::new(entries).map_err(TablesError::List)?;
        let mut servos = PerEffector::default();
        // The list keeps the order of the tables: an effector's place is the number of its table.
        for (effector, table) in list.all().zip(&tables) {
            servos[effector] = table.servo()?;
        }
        let column = |of: fn(&EffectorFile) -> f64| PerEffector::from_values(tables.iter().map(of));
        Ok(Self {
            list,
            servos,
            c_lift: column(|table| table.c_lift),
            c_roll: column(|table| table.c_roll),
            c_pitch: column(|table| table.c_pitch),
            c_yaw: column(|table| table.c_yaw),
            gains: PerEffector::from_values(tables.iter().map(|table| table.gains)),
        })
    }
}

impl EffectorFile {
    fn servo(&self) -> Result<ServoModel, TablesError> {
        let effector = self.name;
        let lag_s = self.lag_s;
        if self.kind.is_angle() {
            let expected = "travel_rad, rate_limit_rad_s";
            // All three keys are matched, so one that means nothing for this kind is refused instead of ignored.
            match (self.travel_rad, self.rate_limit_rad_s, self.thrust_n) {
                (Some([min, max]), Some(rate_limit), None) => {
                    Ok(ServoModel { lag_s, rate_limit, min, max })
                }
                _ => Err(TablesError::Key { effector, expected }),
            }
        } else {
            match (self.travel_rad, self.rate_limit_rad_s, self.thrust_n) {
                (None, None, Some([min, max])) => {
                    Ok(ServoModel { lag_s, rate_limit: f64::INFINITY, min, max })
                }
                _ => Err(TablesError::Key { effector, expected: "thrust_n" }),
            }
        }
    }
}

impl From<EffectorModel> for Tables {
    fn from(aircraft: EffectorModel) -> Self {
        let table = |effector| {
            let entry = aircraft.list.entry(effector)?;
            let servo = &aircraft.servos[effector];
            let is_angle = entry.kind.is_angle();
            Some(EffectorFile {
                name: entry.name,
                kind: entry.kind,
                side: entry.side,
                partner: entry.partner,
                instance: entry.instance,
                lag_s: servo.lag_s,
                rate_limit_rad_s: is_angle.then_some(servo.rate_limit),
                travel_rad: is_angle.then_some([servo.min, servo.max]),
                thrust_n: (!is_angle).then_some([servo.min, servo.max]),
                c_lift: aircraft.c_lift[effector],
                c_roll: aircraft.c_roll[effector],
                c_pitch: aircraft.c_pitch[effector],
                c_yaw: aircraft.c_yaw[effector],
                gains: aircraft.gains[effector],
            })
        };
        aircraft.list.all().filter_map(table).collect()
    }
}

impl EffectorModel {
    /// Smallest and largest thrust, N; zeros without an engine.
    pub fn thrust_range_n(&self) -> [f64; 2] {
        self.list.only(EffectorKind::Engine).map_or([0.0; 2], |engine| {
            let ServoModel { min, max, .. } = self.servos[engine];
            [min, max]
        })
    }

    /// Coefficient of all effectors together per rad of one part of the main command.
    pub fn per_command(
        &self,
        coefficients: &PerEffector<f64>,
        gain: impl Fn(&AxisGains) -> f64,
    ) -> f64 {
        let with_gain = self.list.all().filter(|e| gain(&self.gains[*e]) != 0.0);
        // -0.0 is the neutral element of the sum: from 0.0 a single coefficient of -0.0 would come out as 0.0.
        with_gain.map(|e| gain(&self.gains[e]) * coefficients[e]).fold(-0.0, |sum, c| sum + c)
    }

    /// How far a part of the main command can go before every effector that follows it is at an end of its travel:
    /// from and to, rad or N. Zeros if none follows.
    pub fn command_range(&self, gain: impl Fn(&AxisGains) -> f64) -> [f64; 2] {
        let ranges = self.list.all().filter_map(|effector| {
            let (gain, servo) = (gain(&self.gains[effector]), &self.servos[effector]);
            // Without a gain these are infinite or NaN; they are dropped below.
            let ends = [servo.min / gain, servo.max / gain];
            // A negative gain exchanges the ends.
            (gain != 0.0).then_some(if gain > 0.0 { ends } else { [ends[1], ends[0]] })
        });
        ranges.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([0.0; 2])
    }

    /// Checks every number.
    pub(super) fn validate(&self) -> Result<(), AircraftModelError> {
        for effector in self.list.all() {
            let Some(entry) = self.list.entry(effector) else { continue };
            let check = |key, value, min, max| check_of(&entry.name, key, value, min, max);
            let servo = &self.servos[effector];
            check("lag_s", servo.lag_s, 1.0e-3, 60.0)?;
            if entry.kind.is_angle() {
                check("rate_limit_rad_s", servo.rate_limit, 1.0e-3, 100.0)?;
                check("travel_rad (lower end)", servo.min, -1.6, 0.0)?;
                check("travel_rad (upper end)", servo.max, servo.min + 1.0e-3, 1.6)?;
            } else {
                check("thrust_n (smallest)", servo.min, -1.0e7, 1.0e7)?;
                check("thrust_n (largest)", servo.max, servo.min, 1.0e7)?;
            }
            for (key, column) in [
                ("c_lift", &self.c_lift),
                ("c_roll", &self.c_roll),
                ("c_pitch", &self.c_pitch),
                ("c_yaw", &self.c_yaw),
            ] {
                check(key, column[effector], -10.0, 10.0)?;
            }
            for (key, gain) in self.gains[effector].named() {
                check(key, gain, -10.0, 10.0)?;
            }
        }
        Ok(())
    }
}
