//! Prescribed controls of a check case: keys of effectors, of a pilot's commands, and of the engine.

use host_io::problem::Problem;
use std::collections::BTreeMap;

use icd::{EffectorKind, PerEffector};

use super::key;
use crate::airframe::Airframe;
use crate::config::units;
use crate::release::Controls;

const CONTROLS: &str = "plant.controls";
/// Key of the engine's lever.
const THROTTLE: &str = "throttle_percent";
/// Commands that several effectors follow, in the order of [`Airframe::follow`].
const COMMANDS: [&str; 3] = ["aileron", "elevator", "rudder"];

/// Reads controls for an aircraft.
pub(super) struct Reader<'a> {
    pub(super) file: &'a str,
    pub(super) airframe: &'a Airframe,
}

impl Reader<'_> {
    /// The controls at the start. An engine has to be among them, unless a trim finds its thrust.
    pub(super) fn at_start(
        &self,
        table: &BTreeMap<String, f64>,
        is_trimmed: bool,
    ) -> Result<Controls, Problem> {
        let controls = self.change(table)?;
        let Some(engine) = self.airframe.effectors.only(EffectorKind::Engine) else {
            return Ok(controls);
        };
        let thrust_key = format!("{}_n", self.airframe.effectors.key(engine));
        let engine_key = if self.has_lever() { THROTTLE } else { thrust_key.as_str() };
        let is_given = self.gives_engine(table);
        match (is_trimmed, is_given) {
            (true, true) => {
                let problem = "has no meaning beside trim = \"longitudinal\", which finds it";
                Err(key(self.file, CONTROLS, engine_key, problem))
            }
            (false, false) => {
                Err(key(self.file, CONTROLS, engine_key, "is missing, the aircraft has an engine"))
            }
            _ => Ok(controls),
        }
    }

    /// Whether the table has the engine.
    fn gives_engine(&self, table: &BTreeMap<String, f64>) -> bool {
        table.keys().any(|name| name == THROTTLE || units::factor_to(name, "n").is_some())
    }

    /// Controls, or changes of them.
    pub(super) fn change(&self, table: &BTreeMap<String, f64>) -> Result<Controls, Problem> {
        let mut controls = Controls::default();
        for (name, value) in table {
            if name == THROTTLE && self.has_lever() {
                controls.lever = Some(value / 100.0);
                continue;
            }
            let followed = self.positions(name, *value).ok_or_else(|| {
                let known = self.known().join(", ");
                let problem = match known.is_empty() {
                    true => "has no meaning for a body without effectors".to_owned(),
                    false => format!("is unknown, expected one of {known}"),
                };
                key(self.file, CONTROLS, name, &problem)
            })?;
            controls.positions = PerEffector::from_fn(|e| controls.positions[e] + followed[e]);
        }
        Ok(controls)
    }

    /// What one key gives: the position of one effector, or those of all that follow a command.
    fn positions(&self, name: &str, value: f64) -> Option<PerEffector<f64>> {
        let list = &self.airframe.effectors;
        let mut positions = PerEffector::default();
        if let Some((stem, factor)) = units::factor_to(name, "deg") {
            let angle_rad = (value * factor).to_radians();
            if let Some(effector) = list.by_key(stem).filter(|effector| list.is_angle(*effector)) {
                positions[effector] = angle_rad;
                return Some(positions);
            }
            let command = COMMANDS.iter().position(|command| *command == stem)?;
            let mut commands = [0.0; 4];
            commands[command] = angle_rad;
            let has_follower = list.all().any(|effector| {
                let gains = &self.airframe.gains[effector];
                [gains.roll, gains.pitch, gains.yaw][command] != 0.0
            });
            return has_follower.then(|| self.airframe.follow(commands));
        }
        let (stem, factor) = units::factor_to(name, "n")?;
        let engine = list.by_key(stem).filter(|e| !list.is_angle(*e) && !self.has_lever())?;
        positions[engine] = value * factor;
        Some(positions)
    }

    fn has_lever(&self) -> bool {
        self.airframe.propulsion.is_some()
    }

    /// All keys of this aircraft.
    fn known(&self) -> Vec<String> {
        let list = &self.airframe.effectors;
        let of_effector = |effector| {
            let stem = list.key(effector);
            match (list.is_angle(effector), self.has_lever()) {
                (true, _) => format!("{stem}_deg"),
                (false, true) => THROTTLE.to_owned(),
                (false, false) => format!("{stem}_n"),
            }
        };
        let mut known: Vec<String> = list.all().map(of_effector).collect();
        if !known.is_empty() {
            known.extend(COMMANDS.map(|command| format!("{command}_deg")));
        }
        known
    }
}
