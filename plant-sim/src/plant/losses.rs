//! Parts that are torn off and fuel that burns, as the flight goes on.
//!
//! When the centre of gravity moves in the airframe, position and velocity move with it: the rest of the aircraft flies on as it did.

use super::Plant;
use crate::damage::PerPart;

/// What the aircraft has lost.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Losses {
    torn_off: PerPart<f64>,
    burnt_kg: f64,
}

impl Plant {
    /// Fuel that is left, kg; `None` for an aircraft whose mass stays.
    pub fn fuel_kg(&self) -> Option<f64> {
        let fuel = self.dynamics.airframe().fuel?;
        Some((fuel.initial_kg - self.losses.burnt_kg).max(0.0))
    }

    /// Takes the parts away that the faults have torn off.
    pub(super) fn lose_parts(&mut self) {
        let torn_off = self.faults.torn_off(self.time);
        if torn_off != self.losses.torn_off {
            self.losses.torn_off = torn_off;
            self.take_away();
        }
    }

    /// Burns the fuel of one control period at the present thrust. Without fuel the engine is out, whatever is repaired.
    pub(super) fn burn_fuel(&mut self) {
        let Some(fuel) = self.dynamics.airframe().fuel else { return };
        let period_s = self.period_us as f64 * 1.0e-6;
        let flow_kg_s = fuel.flow_kg_n_s * self.present.motion.thrust_n.max(0.0);
        let burnt_kg = (self.losses.burnt_kg + flow_kg_s * period_s).min(fuel.initial_kg);
        if burnt_kg != self.losses.burnt_kg {
            self.losses.burnt_kg = burnt_kg;
            self.take_away();
        }
        let Some(engine) = self.dynamics.jet().engine() else { return };
        if burnt_kg >= fuel.initial_kg {
            self.with_faults(|faults, context| faults.starve(engine, context));
        }
    }

    fn take_away(&mut self) {
        let before = self.dynamics.shift_m();
        self.dynamics.take_away(&self.losses.torn_off, self.losses.burnt_kg);
        let moved = self.dynamics.shift_m() - before;
        let rigid = &mut self.state.rigid;
        rigid.position += rigid.e_from_body() * moved;
        rigid.velocity.0 += rigid.rates.0.cross(&moved);
        // The step that comes begins with the forces on what is left.
        self.present = self.dynamics.present(&self.state, &self.inputs);
    }
}
