//! What the effectors of a flight were used for: effort, travel, reversals, time at a limit, farthest position.

use icd::{Effector, PerEffector};
use plant_sim::Airframe;

/// A command this close to the end of its travel is at it, of the travel.
const AT_LIMIT: f64 = 1.0e-9;
/// Effectors that are summed side by side, for the compiler to vectorise.
const LANES: usize = 8;

/// Sums of every effector.
#[derive(Debug, Clone)]
pub(super) struct Used {
    blocks: [EffectorBlock; Effector::MAX / LANES],
    count: usize,
    has_last: bool,
}

/// One value for each effector of a block.
type Lanes = [f64; LANES];

/// Sums of some effectors.
#[derive(Debug, Clone, Copy, Default)]
struct EffectorBlock {
    /// Commands at or beyond these are at a limit.
    limits: [Lanes; 2],
    neutral: Lanes,
    /// From neutral to either end of the travel.
    sides: [Lanes; 2],
    effort: Lanes,
    travel: Lanes,
    reversals: Lanes,
    at_limit: Lanes,
    /// Farthest position from neutral to either side.
    farthest: [Lanes; 2],
    last: Lanes,
    /// Sign of the last movement of the command.
    heading: Lanes,
}

/// The sums of one effector.
#[derive(Debug, Clone, Copy)]
pub(super) struct Use {
    /// Integral of the squared command.
    pub(super) effort: f64,
    /// Way of the command.
    pub(super) travel: f64,
    /// Changes of the command's direction.
    pub(super) reversals: f64,
    /// Ticks with the command at a limit.
    pub(super) at_limit: f64,
    /// Farthest position, of the travel from neutral to that side.
    pub(super) farthest: f64,
}

impl Used {
    /// Before the first tick.
    pub(super) fn new(airframe: &Airframe) -> Self {
        let mut blocks = [EffectorBlock::default(); Effector::MAX / LANES];
        for effector in airframe.effectors.all() {
            let servo = &airframe.servos[effector];
            let (block, lane) = place(effector);
            let block = &mut blocks[block];
            let room = AT_LIMIT * (servo.max - servo.min);
            // Zero for an angle, idle for an engine.
            let neutral = 0.0_f64.clamp(servo.min, servo.max);
            block.neutral[lane] = neutral;
            for side in 0..2 {
                block.limits[side][lane] = [servo.min + room, servo.max - room][side];
                block.sides[side][lane] = [neutral - servo.min, servo.max - neutral][side];
            }
        }
        let count = airframe.effectors.len().div_ceil(LANES);
        Self { blocks, count, has_last: false }
    }

    /// Takes a tick of `period_s` with these commands and positions.
    pub(super) fn tick(
        &mut self,
        commands: &PerEffector<f64>,
        positions: &PerEffector<f64>,
        period_s: f64,
    ) {
        let lanes = |values: &'_ PerEffector<f64>| *values.as_array();
        let (commands, positions) = (lanes(commands), lanes(positions));
        let lanes = commands.as_chunks::<LANES>().0.iter().zip(positions.as_chunks::<LANES>().0);
        for (block, (commands, positions)) in self.blocks[..self.count].iter_mut().zip(lanes) {
            // The first command is no movement.
            if !self.has_last {
                block.last = *commands;
            }
            block.command(commands, period_s);
            block.note_farthest(positions);
        }
        self.has_last = true;
    }

    /// The sums of an effector.
    pub(super) fn of(&self, effector: Effector) -> Use {
        let (block, lane) = place(effector);
        let block = &self.blocks[block];
        let part = |side: usize| block.farthest[side][lane] / block.sides[side][lane];
        Use {
            effort: block.effort[lane],
            travel: block.travel[lane],
            reversals: block.reversals[lane],
            at_limit: block.at_limit[lane],
            // There may be no travel to a side: zero over zero is none.
            farthest: 0.0_f64.max(part(0)).max(part(1)),
        }
    }
}

impl EffectorBlock {
    fn command(&mut self, commands: &Lanes, period_s: f64) {
        for (lane, &command) in commands.iter().enumerate() {
            let step = command - self.last[lane];
            self.last[lane] = command;
            self.effort[lane] += command * command * period_s;
            self.travel[lane] += step.abs();
            let moves = step != 0.0;
            // Without jumps, so that the lanes are computed side by side.
            self.reversals[lane] += one_if(moves & (step * self.heading[lane] < 0.0));
            self.heading[lane] = if moves { step.signum() } else { self.heading[lane] };
            let [low, high] = [self.limits[0][lane], self.limits[1][lane]];
            self.at_limit[lane] += one_if((command <= low) | (command >= high));
        }
    }

    fn note_farthest(&mut self, positions: &Lanes) {
        for (lane, position) in positions.iter().enumerate() {
            let beyond = position - self.neutral[lane];
            for (farthest, beyond) in self.farthest.iter_mut().zip([-beyond, beyond]) {
                farthest[lane] = if beyond > farthest[lane] { beyond } else { farthest[lane] };
            }
        }
    }
}

/// Block and lane of an effector.
fn place(effector: Effector) -> (usize, usize) {
    (effector.index() / LANES, effector.index() % LANES)
}

fn one_if(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;
    use plant_sim::ReadAirframe as _;

    #[test]
    fn sums_of_an_effector_are_those_of_its_own_commands_and_positions() {
        let airframe = Airframe::paper();
        let mut used = Used::new(&airframe);
        let (rudder, engine) = (tvc_jet::RUDDER, tvc_jet::ENGINE);
        let (servo, idle_n) = (airframe.servos[rudder], airframe.servos[engine].min);
        let mut positions = PerEffector::default();
        positions[engine] = idle_n;
        // Up, on, still, back to beyond the lower end: one reversal, two ticks at a limit.
        let commands = [0.1, 0.2, 0.2, servo.min, servo.min - 0.1];
        for command in commands {
            let mut all = PerEffector::default();
            all[rudder] = command;
            positions[rudder] = 0.5 * command;
            used.tick(&all, &positions, 0.5);
        }
        let of = used.of(rudder);
        let squares: f64 = commands.iter().map(|command| command * command * 0.5).sum();
        // Sums of five terms in another order.
        assert!((of.effort - squares).abs() < 1e-15, "{} rad2 s", of.effort);
        assert!((of.travel - (0.1 + 0.2 - servo.min + 0.1)).abs() < 1e-15, "{} rad", of.travel);
        assert_eq!((of.reversals, of.at_limit), (1.0, 2.0));
        assert_eq!(of.farthest, 0.5 * (0.1 - servo.min) / -servo.min, "to the lower side");
        let engine = used.of(engine);
        assert_eq!((engine.travel, engine.farthest), (0.0, 0.0), "idle is neutral");
    }
}
