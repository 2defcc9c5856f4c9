//! How much of its effectors the compensator still has: the reserve of each axis.

use icd::{ControlPeriod, Effector, PerEffector};
use serde::{Deserialize, Serialize};

use crate::aircraft_model::ServoModel;
use crate::allocation::attainable::axis_reach;
use crate::allocator::Columns;
use crate::design_model::{DesignModel, FlightCondition};
use crate::gains::AllocationMode;

/// Remaining authority of each axis, 0 (nothing left) to 100 (all effectors at neutral), percent.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Authority {
    /// Left in roll, in the direction that has less.
    pub roll_pct: f64,
    /// Left in pitch, likewise.
    pub pitch_pct: f64,
    /// Left in yaw, likewise.
    pub yaw_pct: f64,
    /// Left for negative moments of roll, pitch and yaw: to the left, nose down, nose left.
    pub negative_pct: [f64; 3],
    /// Left for positive ones: to the right, nose up, nose right.
    pub positive_pct: [f64; 3],
}

impl Authority {
    /// Nothing is left on any axis.
    pub const NONE: Self = Self {
        roll_pct: 0.0,
        pitch_pct: 0.0,
        yaw_pct: 0.0,
        negative_pct: [0.0; 3],
        positive_pct: [0.0; 3],
    };

    /// All of it: nothing is used.
    pub const FULL: Self = Self {
        roll_pct: 100.0,
        pitch_pct: 100.0,
        yaw_pct: 100.0,
        negative_pct: [100.0; 3],
        positive_pct: [100.0; 3],
    };
}

/// Time between two looks at the attainable set, which costs several control steps, us.
const LOOK_EVERY_US: u32 = 100_000;

/// Computes the authority: of Eq. (25) in each step, of the attainable set ten times a second.
#[derive(Debug, Clone)]
pub struct AuthorityWatch {
    period: ControlPeriod,
    /// Time until the next look at the attainable set, us.
    due_us: u32,
    last: Authority,
}

impl AuthorityWatch {
    /// Looks in its first step.
    pub fn new(period: ControlPeriod) -> Self {
        Self { period, due_us: 0, last: Authority::NONE }
    }

    /// Looks in the next step.
    pub fn reset(&mut self) {
        *self = Self::new(self.period);
    }

    /// What is left with these commands, rad, engine N; `thrust_n` is measured.
    pub fn step(
        &mut self,
        allocation: AllocationMode,
        commands: &PerEffector<f64>,
        thrust_n: f64,
        model: &DesignModel,
        at: &FlightCondition,
    ) -> Authority {
        if matches!(allocation, AllocationMode::Paper | AllocationMode::Own) {
            // So another allocation chosen in flight looks at once.
            self.due_us = 0;
            return authority(commands, thrust_n, model);
        }
        if self.due_us == 0 {
            self.last = attainable_authority(commands, model, at);
            self.due_us = LOOK_EVERY_US;
        }
        self.due_us = self.due_us.saturating_sub(self.period.as_micros());
        self.last
    }
}

/// Authority from the attainable set ([`crate::allocation::attainable`]): how far each axis can still be driven from the
/// present commands, the other two left as they are, over how far it could be driven from neutral. Both ways; what
/// is more than from neutral counts as 100 %.
pub fn attainable_authority(
    commands: &PerEffector<f64>,
    model: &DesignModel,
    at: &FlightCondition,
) -> Authority {
    let neutral = PerEffector::default();
    let columns = Columns::new(model, at, &neutral);
    let reach = |positions| axis_reach(columns.as_slice(), &columns.pick(positions)).axes();
    let (left, whole) = (reach(commands), reach(&neutral));
    let part = |left: f64, whole: f64| {
        if whole > 0.0 { 100.0 * (left / whole).clamp(0.0, 1.0) } else { 0.0 }
    };
    let of = |axis: usize| {
        let (left, whole) = (&left[axis], &whole[axis]);
        [part(left.negative, whole.negative), part(left.positive, whole.positive)]
    };
    Authority::of_sides([of(0), of(1), of(2)])
}

impl Authority {
    /// From what is left for negative and positive moments of each axis.
    fn of_sides(sides: [[f64; 2]; 3]) -> Self {
        let [roll_pct, pitch_pct, yaw_pct] =
            sides.map(|[negative, positive]| negative.min(positive));
        let (negative_pct, positive_pct) = (sides.map(|side| side[0]), sides.map(|side| side[1]));
        Self { roll_pct, pitch_pct, yaw_pct, negative_pct, positive_pct }
    }
}

/// Way that is left to the effectors by which the compensator acts, in the direction in which they stand.
///
/// With δ the total command after limits, steps one and two together, and δ_max the travel of the effector:
///
/// * roll: 100 (1 - |δ_a| / δ_a,max), δ_a + Δδ_a being the command of the ailerons, by the one with most left;
/// * pitch: 100 (1 - |δ_z| / δ_z,max);
/// * yaw: 100 (1 - |δ_y| / δ_y,max).
///
/// The nozzle works by thrust alone. Below T_min, the thrust that Eq. (25) divides by at least, it gives only
/// the part T / T_min of the moment that is counted on; pitch and yaw are multiplied by that. `thrust_n` is the
/// measured T, N. For either direction of the moment the same holds with the travel in that direction.
pub fn authority(commands: &PerEffector<f64>, thrust_n: f64, model: &DesignModel) -> Authority {
    let aircraft = model.aircraft();
    let effectors = &aircraft.effectors;
    let servo = |effector: Effector| &effectors.servos[effector];
    // In percent: less than what an effector has left where it stands, and to either side.
    let left = |effector| {
        let [below, above] = ways(commands[effector], servo(effector));
        [if commands[effector] < 0.0 { below } else { above }, below, above]
    };
    let nozzle = |effector| {
        let (Some(nozzle), Some(effector)) = (&aircraft.nozzle, effector) else {
            return [0.0; 3];
        };
        let floor_n = nozzle.thrust_floor_n;
        // The order makes zero of a thrust that is not a number.
        let effect = if thrust_n >= floor_n { 1.0 } else { (thrust_n / floor_n).max(0.0) };
        left(effector).map(|left| effect * left)
    };
    let rolls = effectors.list.all().filter(|effector| effectors.gains[*effector].roll != 0.0);
    let most = |most: [f64; 3], left: [f64; 3]| {
        [most[0].max(left[0]), most[1].max(left[1]), most[2].max(left[2])]
    };
    // A surface whose deflection rolls to the left has its way to the right below it.
    let of_roll = |effector| match left(effector) {
        [here, below, above] if effectors.c_roll[effector] < 0.0 => [here, above, below],
        left => left,
    };
    let [pitch, yaw] = model.nozzle_effectors().map(nozzle);
    let axes = [rolls.map(of_roll).fold([0.0; 3], most), pitch, yaw];
    let [roll_pct, pitch_pct, yaw_pct] = axes.map(|axis| axis[0]);
    let (negative_pct, positive_pct) = (axes.map(|axis| axis[1]), axes.map(|axis| axis[2]));
    Authority { roll_pct, pitch_pct, yaw_pct, negative_pct, positive_pct }
}

/// Way below and above a command in parts of the travel there, percent.
fn ways(command: f64, servo: &ServoModel) -> [f64; 2] {
    // Neutral may be an end of the travel; there is no way beyond it.
    [servo.min, servo.max].map(|end| match command * end {
        _ if end == 0.0 => 0.0,
        // The command is on the other side of neutral.
        product if product <= 0.0 => 100.0,
        _ => 100.0 * (1.0 - command / end).max(0.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::tvc_jet;
    use proptest::prelude::*;

    /// The reserve with each compensating effector at this fraction of its travel.
    fn at(fraction: f64, thrust_n: f64) -> [f64; 3] {
        let aircraft = testing::aircraft_model();
        let mut commands = PerEffector::default();
        for effector in [tvc_jet::LEFT_AILERON, tvc_jet::RIGHT_AILERON] {
            commands[effector] = fraction * aircraft.effectors.servos[effector].max;
        }
        for effector in [tvc_jet::NOZZLE_PITCH, tvc_jet::NOZZLE_YAW] {
            commands[effector] = fraction * aircraft.effectors.servos[effector].max;
        }
        let Authority { roll_pct, pitch_pct, yaw_pct, .. } =
            authority(&commands, thrust_n, &DesignModel::new(aircraft));
        [roll_pct, pitch_pct, yaw_pct]
    }

    #[test]
    fn all_is_left_at_neutral_half_at_half_the_travel_and_nothing_at_the_limit() {
        assert_eq!(at(0.0, 27_000.0), [100.0; 3]);
        assert_eq!(at(0.5, 27_000.0), [50.0; 3]);
        assert_eq!(at(-0.5, 27_000.0), [50.0; 3], "either way");
        assert_eq!(at(1.0, 27_000.0), [0.0; 3]);
        assert_eq!(at(-1.0, 27_000.0), [0.0; 3]);
    }

    #[test]
    fn below_the_thrust_floor_the_nozzle_has_less_without_thrust_nothing_and_the_ailerons_all() {
        let floor_n = testing::aircraft_model().nozzle.unwrap().thrust_floor_n;
        assert_eq!(at(0.0, floor_n), [100.0; 3]);
        assert_eq!(at(0.0, floor_n / 2.0), [100.0, 50.0, 50.0]);
        assert_eq!(at(0.0, 0.0), [100.0, 0.0, 0.0]);
        assert_eq!(at(0.0, -1.0), [100.0, 0.0, 0.0]);
        assert_eq!(at(0.0, f64::NAN), [100.0, 0.0, 0.0]);
    }

    #[test]
    fn elevators_and_rudder_do_not_count() {
        let mut commands = PerEffector::default();
        for effector in [tvc_jet::LEFT_ELEVATOR, tvc_jet::RIGHT_ELEVATOR, tvc_jet::RUDDER] {
            commands[effector] = 0.3;
        }
        let left = authority(&commands, 27_000.0, &DesignModel::new(testing::aircraft_model()));
        assert_eq!([left.roll_pct, left.pitch_pct, left.yaw_pct], [100.0; 3]);
    }

    #[test]
    fn with_the_ailerons_to_the_left_all_is_left_to_the_right() {
        let aircraft = testing::aircraft_model();
        let mut commands = PerEffector::default();
        // A positive aileron command rolls to the left.
        commands[tvc_jet::RIGHT_AILERON] =
            0.75 * aircraft.effectors.servos[tvc_jet::RIGHT_AILERON].max;
        commands[tvc_jet::LEFT_AILERON] = -commands[tvc_jet::RIGHT_AILERON];
        let left = authority(&commands, 27_000.0, &DesignModel::new(aircraft));
        assert_eq!(
            (left.negative_pct[0], left.positive_pct[0], left.roll_pct),
            (25.0, 100.0, 25.0)
        );
    }

    /// An aircraft without a nozzle.
    fn aerosonde() -> (DesignModel, FlightCondition) {
        let model = DesignModel::new(testing::aerosonde());
        let at = model.condition(model.design_point());
        (model, at)
    }

    #[test]
    fn the_attainable_set_has_everything_at_neutral_and_the_rest_of_the_elevators_in_pitch() {
        let (model, at) = aerosonde();
        let neutral = attainable_authority(&PerEffector::default(), &model, &at);
        for left in neutral.negative_pct.into_iter().chain(neutral.positive_pct) {
            assert!((left - 100.0).abs() < 1.0e-9, "{left} %");
        }
        let effectors = &model.aircraft().effectors;
        let elevators = |part: f64| {
            PerEffector::from_fn(|effector| {
                let pitches = effectors.gains[effector].pitch != 0.0;
                if pitches { part * effectors.servos[effector].max } else { 0.0 }
            })
        };
        // Down is where a positive elevator pushes.
        let down = attainable_authority(&elevators(0.6), &model, &at);
        assert!((down.negative_pct[1] - 40.0).abs() < 1.0e-6, "{down:?}");
        assert!(
            (down.pitch_pct - 40.0).abs() < 1.0e-6 && down.positive_pct[1] == 100.0,
            "{down:?}"
        );
        let end = attainable_authority(&elevators(1.0), &model, &at);
        assert!(end.pitch_pct < 1.0e-6 && end.roll_pct > 90.0, "{end:?}");
    }

    #[test]
    fn the_watch_looks_at_the_attainable_set_ten_times_a_second() {
        let (model, at) = aerosonde();
        let mut watch = AuthorityWatch::new(ControlPeriod::DEFAULT);
        let mut changes = 0;
        let mut last = Authority::NONE;
        for tick in 0..500_u32 {
            let commands = PerEffector::from_fn(|_| 2.0e-4 * f64::from(tick));
            let now = watch.step(AllocationMode::Wls, &commands, 10.0, &model, &at);
            changes += u32::from(now != last);
            last = now;
        }
        assert_eq!(changes, 10);
    }

    proptest! {
        #[test]
        fn it_is_always_a_percentage(fraction in -10.0..10.0_f64, thrust_n in -1.0e5..1.0e5_f64) {
            for percent in at(fraction, thrust_n) {
                prop_assert!((0.0..=100.0).contains(&percent), "{percent} %");
            }
        }
    }
}
