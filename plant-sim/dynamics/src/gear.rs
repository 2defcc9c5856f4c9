//! The landing gear as data: the points of the airframe that touch the ground, and what they bear.

use std::collections::BTreeSet;

use host_io::problem::{Problem, problem};
use icd::effector_list::Name;
use serde::{Deserialize, Serialize};

use crate::ground::{GroundSetup, GroundStart, Launch, SECTION};
use crate::range::{check_range, check_vector};

/// Most points of an airframe that touch the ground.
pub const CONTACTS_MAX: usize = 16;

/// All that touches the ground, and the limits of a touchdown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gear {
    /// Largest rate of descent at a touchdown, m/s.
    pub sink_max_m_s: f64,
    /// Largest magnitude of the roll angle on the ground, rad.
    pub bank_max_rad: f64,
    /// Thrust of the engine at ground idle, N, while anything touches; without it flight idle holds there too.
    #[serde(default)]
    pub idle_n: Option<f64>,
    /// How an aircraft without wheels begins a flight.
    #[serde(default)]
    pub catapult: Option<Catapult>,
    /// Wheels, skids and points of the structure.
    pub contacts: Vec<ContactPoint>,
}

/// The catapult of an aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catapult {
    /// Height of the centre of gravity at its lower end, m.
    pub height_m: f64,
    /// Speed at its upper end, m/s.
    pub speed_m_s: f64,
    pub pitch_deg: f64,
    /// Length, m.
    pub rail_m: f64,
}

impl Catapult {
    /// On it, this far from the threshold, m.
    pub fn start(&self, along_m: f64) -> GroundStart {
        let Self { height_m, speed_m_s, pitch_deg, rail_m } = *self;
        let launch = Launch { along_m, height_m, speed_m_s, pitch_rad: pitch_deg.to_radians() };
        GroundStart::Catapult { launch, rail_m }
    }
}

/// A point of the airframe that touches the ground: a wheel if it rolls, else a skid or a part of the structure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactPoint {
    pub name: Name,
    /// Its place without load from the centre of gravity, m, body axes.
    pub at_m: [f64; 3],
    /// Stiffness across the ground, N/m.
    pub spring_n_m: f64,
    /// Damping across the ground, N s/m.
    pub damper_n_s_m: f64,
    /// Largest force across the ground that it bears, N.
    pub load_max_n: f64,
    /// Stiffness along the ground before it slips, N/m.
    pub grip_spring_n_m: f64,
    /// Largest force along the ground over that across it, on a dry runway.
    pub friction: f64,
    /// The same of a wheel that rolls, along its rolling direction; without it the point is no wheel.
    pub rolling_friction: Option<f64>,
    /// What full brakes add to the rolling friction.
    #[serde(default)]
    pub brake_friction: f64,
    pub steering: Option<WheelSteering>,
}

/// A wheel that turns with a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelSteering {
    /// Name of the surface.
    pub effector: Name,
    /// Angle of the wheel, positive to the right, over the deflection.
    pub ratio: f64,
}

impl Gear {
    /// The ground with the start of an aircraft with this gear.
    pub fn ready(&self, mut ground: GroundSetup) -> Result<GroundSetup, Problem> {
        if let GroundStart::Ready { along_m } = ground.start {
            let has_wheels = self.contacts.iter().any(ContactPoint::is_wheel);
            ground.start = match &self.catapult {
                _ if has_wheels => GroundStart::Parked { along_m },
                Some(catapult) => catapult.start(along_m),
                None => {
                    return Err(problem!(
                        "[{SECTION}] start = \"ready\" needs wheels or [gear.catapult] in the airframe file"
                    ));
                }
            };
        }
        Ok(ground)
    }

    /// Checks every number.
    pub fn check(&self) -> Result<(), Problem> {
        check_range("gear", "sink_max_m_s", self.sink_max_m_s, 0.1, 100.0)?;
        check_range("gear", "bank_max_deg", self.bank_max_rad.to_degrees(), 1.0, 180.0)?;
        check_range("gear", "idle_n", self.idle_n.unwrap_or(0.0), 0.0, 1.0e6)?;
        if let Some(catapult) = &self.catapult {
            catapult.start(0.0).check("gear.catapult", 0.0)?;
        }
        let count = self.contacts.len();
        if !(1..=CONTACTS_MAX).contains(&count) {
            return Err(problem!(
                "[[gear.contact]] stands {count} times; 1 to {CONTACTS_MAX} are possible"
            ));
        }
        let mut names = BTreeSet::new();
        for contact in &self.contacts {
            contact.check()?;
            if !names.insert(contact.name) {
                return Err(problem!("[[gear.contact]] has the name `{}` twice", contact.name));
            }
        }
        Ok(())
    }
}

impl ContactPoint {
    pub fn is_wheel(&self) -> bool {
        self.rolling_friction.is_some()
    }

    fn check(&self) -> Result<(), Problem> {
        let section = format!("gear.contact.{}", self.name);
        check_vector(&section, "at_m", self.at_m, 100.0)?;
        for (key, value, min, max) in [
            ("spring_n_m", self.spring_n_m, 1.0, 1.0e9),
            ("damper_n_s_m", self.damper_n_s_m, 0.0, 1.0e9),
            ("load_max_n", self.load_max_n, 1.0, 1.0e9),
            ("grip_spring_n_m", self.grip_spring_n_m, 1.0, 1.0e9),
            ("friction", self.friction, 0.0, 2.0),
            ("rolling_friction", self.rolling_friction.unwrap_or(0.0), 0.0, 2.0),
            ("brake_friction", self.brake_friction, 0.0, 2.0),
            ("steering.ratio", self.steering.map_or(0.0, |steering| steering.ratio), -10.0, 10.0),
        ] {
            check_range(&section, key, value, min, max)?;
        }
        let of_wheels =
            [("brake_friction", self.brake_friction != 0.0), ("steering", self.steering.is_some())];
        let stray = of_wheels.iter().find(|(_, is_there)| *is_there && !self.is_wheel());
        stray.map_or(Ok(()), |(key, _)| {
            Err(problem!("[{section}] {key} has no meaning without rolling_friction"))
        })
    }
}
