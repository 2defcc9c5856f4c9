//! Faults of what is no effector, sensors and parts of the airframe, and of an engine without fuel.

use icd::fault::{AirframePart, FaultKind, SensorKind, Timing};
use icd::{Effector, SimTime};

use super::entry::slot;
use super::{FaultContext, Faults, SensorEffect};

impl Faults {
    /// Whether a sensor has a fault.
    #[inline]
    pub fn has_sensor_faults(&self) -> bool {
        self.alters_sensors
    }

    /// How much of each part of the airframe is torn off at `now`: the fraction of its span from the tip.
    pub fn torn_off(&self, now: SimTime) -> [f64; AirframePart::ALL.len()] {
        AirframePart::ALL.map(|part| {
            let active = self.current[slot(part)].as_ref().and_then(|one| one.active.as_ref());
            active.map_or(0.0, |active| active.torn_off(now))
        })
    }

    /// The effect on a sensor at `now`, and the time of its onset.
    pub fn on_sensor(&self, sensor: SensorKind, now: SimTime) -> Option<(SimTime, SensorEffect)> {
        let active = self.current[slot(sensor)].as_ref()?.active.as_ref()?;
        Some((active.since(), active.on_sensor(now)))
    }

    /// The engine gets no fuel any more: it is out, and no repair brings it back.
    pub fn starve(&mut self, engine: Effector, context: &mut FaultContext<'_>) {
        if matches!(self.active(engine), Some((FaultKind::FlameOut, _))) {
            return;
        }
        let _reply = self.inject(engine.into(), FaultKind::FlameOut, Timing::NOW, context);
        self.look_ahead(context.now);
    }

    /// Whether an effect that acts on effectors or the airframe changes from step to step.
    pub(super) fn vary_after(&self, now: SimTime) -> bool {
        let parts = || AirframePart::ALL.into_iter().filter_map(|part| self.current[slot(part)]);
        self.any(|active| active.varies(now))
            || parts().any(|current| current.active.is_some_and(|active| active.varies(now)))
    }
}
