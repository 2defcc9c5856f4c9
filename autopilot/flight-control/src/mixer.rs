//! Commands of both steps to effectors, inside their travel, with a report of what could not be given.

use arrayvec::ArrayVec;
use icd::{AxisGains, Effector, EffectorKind, EffectorList, PerEffector};

use crate::aircraft_model::EffectorModel;
use crate::allocator::Increments;
use crate::signals::{Compensation, EffectorSet, MainCommand, Saturation, Side};

/// Commands to the effectors, and what was cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixed {
    /// One command for each effector, rad; engine N.
    pub commands: PerEffector<f64>,
    /// What of the compensation got through.
    pub applied: Compensation,
    /// The same by effectors: what of each command is compensation, rad.
    pub increments: PerEffector<f64>,
    /// What did not, by the parts of the main command.
    pub saturation: Saturation,
    /// Effectors whose command was beyond their travel.
    pub limited: EffectorSet,
}

/// Parts of a command: aileron, elevator, rudder, thrust, nozzle pitch, nozzle yaw.
const PARTS: usize = 6;
/// Behind them, a part that is always plus zero: for effectors that follow nothing.
const NO_PART: usize = PARTS;

/// What an effector gets of one part.
#[derive(Debug, Clone, Copy)]
struct MixerTerm {
    part: usize,
    gain: f64,
}

/// Commands of both steps to effectors: from the gains and the travel that the model file has.
#[derive(Debug, Clone)]
pub struct Mixer {
    list: EffectorList,
    /// The first part that each effector follows, and its gain: most follow no other.
    first: PerEffector<MixerTerm>,
    /// What else is followed.
    further: ArrayVec<(Effector, MixerTerm), { Effector::MAX * (PARTS - 1) }>,
    /// Ends of the travel, rad; engine N.
    ends: PerEffector<[f64; 2]>,
    /// How far each part can go before every effector that follows it is at its end.
    ranges: [[f64; 2]; PARTS],
}

impl Mixer {
    /// For the effectors of a validated model.
    pub fn new(effectors: &EffectorModel) -> Self {
        let list = effectors.list;
        let mut first = PerEffector::from_fn(|_| MixerTerm::NONE);
        let mut further = ArrayVec::new();
        for effector in list.all() {
            let AxisGains { roll, pitch, yaw, thrust } = effectors.gains[effector];
            let of_kind = |kind| f64::from(u8::from(list.kind(effector) == Some(kind)));
            let nozzle = [EffectorKind::NozzlePitch, EffectorKind::NozzleYaw].map(of_kind);
            let gains = [roll, pitch, yaw, thrust, nozzle[0], nozzle[1]];
            let all = gains.into_iter().enumerate().filter(|(_, gain)| *gain != 0.0);
            let mut all = all.map(|(part, gain)| MixerTerm { part, gain });
            first[effector] = all.next().unwrap_or(MixerTerm::NONE);
            further.extend(all.map(|term| (effector, term)));
        }
        let ends = PerEffector::from_fn(|effector| {
            let servo = &effectors.servos[effector];
            [servo.min, servo.max]
        });
        let of_nozzle = |kind| list.only(kind).map_or([0.0; 2], |nozzle| ends[nozzle]);
        let ranges = [
            effectors.command_range(|gains| gains.roll),
            effectors.command_range(|gains| gains.pitch),
            effectors.command_range(|gains| gains.yaw),
            effectors.command_range(|gains| gains.thrust),
            of_nozzle(EffectorKind::NozzlePitch),
            of_nozzle(EffectorKind::NozzleYaw),
        ];
        Self { list, first, further, ends, ranges }
    }

    /// Adds the compensation to the main command and cuts the sum at the travel of the effectors.
    ///
    /// The ailerons are shared: the main command is served first, the compensation gets the rest.
    pub fn mix(&self, main: &MainCommand, compensation: &Compensation) -> Mixed {
        let demanded = [
            main.aileron_rad + compensation.aileron_rad,
            main.elevator_rad,
            main.rudder_rad,
            main.thrust_n,
            main.nozzle_pitch_rad + compensation.nozzle_pitch_rad,
            main.nozzle_yaw_rad + compensation.nozzle_yaw_rad,
        ];
        let mut given = demanded;
        let mut sides = [Side::Inside; PARTS];
        // A part is cut where all that follow it are at their ends, and each effector below, where its parts add up
        // to more.
        for ((given, side), [min, max]) in given.iter_mut().zip(&mut sides).zip(self.ranges) {
            (*given, *side) = clip(*given, min, max);
        }
        let mut commands = self.sums(&given);
        // Demand and command differ only if a part is cut.
        let is_cut = sides.iter().any(|side| side.is_saturated());
        let demanded = is_cut.then(|| self.sums(&demanded));
        let mut limited = EffectorSet::default();
        for effector in self.list.all() {
            let [min, max] = self.ends[effector];
            let (command, mut side) = clip(commands[effector], min, max);
            commands[effector] = command;
            if let Some(demanded) = &demanded {
                // By what was demanded: of a cut part the command ends exactly at the travel and would count as
                // inside.
                (_, side) = clip(demanded[effector], min, max);
            }
            limited = limited.with(effector, side.is_saturated());
        }
        let [aileron, .., nozzle_pitch, nozzle_yaw] = given;
        let share = |main: f64, part: usize| main.clamp(self.ranges[part][0], self.ranges[part][1]);
        let applied = Compensation {
            aileron_rad: aileron - share(main.aileron_rad, 0),
            nozzle_pitch_rad: nozzle_pitch - share(main.nozzle_pitch_rad, 4),
            nozzle_yaw_rad: nozzle_yaw - share(main.nozzle_yaw_rad, 5),
        };
        let [aileron_side, elevator_side, rudder_side, thrust_side, pitch_side, yaw_side] = sides;
        Mixed {
            commands,
            applied,
            increments: self.by_effector(&applied),
            saturation: Saturation {
                aileron: aileron_side,
                elevator: elevator_side,
                rudder: rudder_side,
                nozzle_pitch: pitch_side,
                nozzle_yaw: yaw_side,
                thrust: thrust_side,
            },
            limited,
        }
    }

    /// What both steps ask of each effector, beyond its travel too, rad; engine N.
    pub fn demanded(&self, main: &MainCommand, compensation: &Compensation) -> PerEffector<f64> {
        self.sums(&[
            main.aileron_rad + compensation.aileron_rad,
            main.elevator_rad,
            main.rudder_rad,
            main.thrust_n,
            main.nozzle_pitch_rad + compensation.nozzle_pitch_rad,
            main.nozzle_yaw_rad + compensation.nozzle_yaw_rad,
        ])
    }

    /// What each effector gets of a compensation, rad.
    fn by_effector(&self, compensation: &Compensation) -> PerEffector<f64> {
        if *compensation == Compensation::NONE {
            return PerEffector::default();
        }
        let Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad } = *compensation;
        self.sums(&[aileron_rad, 0.0, 0.0, 0.0, nozzle_pitch_rad, nozzle_yaw_rad])
    }

    /// The sum of the parts that each effector follows.
    #[inline]
    fn sums(&self, parts: &[f64; PARTS]) -> PerEffector<f64> {
        let mut padded = [0.0; 8];
        padded[..PARTS].copy_from_slice(parts);
        // The remainder changes nothing and saves the check of the bound.
        let of = |term: &MixerTerm| term.gain * padded[term.part % 8];
        let mut sums =
            PerEffector::first_from_fn(self.list.len(), |effector| of(&self.first[effector]));
        for (effector, term) in &self.further {
            sums[*effector] += of(term);
        }
        sums
    }

    /// Adds an allocated compensation to the mixed main command, which was served first: the increments lie within
    /// what it leaves of each effector's travel. What could not be given remains that of the main command.
    ///
    /// The compensation is reported in the terms of Eq. (25) too: the part of the increments that is an aileron
    /// command, and the angles of the nozzle.
    pub fn add(&self, main: Mixed, increments: &Increments) -> Mixed {
        let mut mixed = main;
        for effector in self.list.all() {
            let [min, max] = self.ends[effector];
            let command = mixed.commands[effector] + increments.positions[effector];
            // The increments are inside; what rounding adds is no saturation.
            (mixed.commands[effector], _) = clip(command, min, max);
            if increments.limited.contains(effector) {
                mixed.limited = mixed.limited.with(effector, true);
            }
        }
        let (mut along, mut length) = ([0.0; PARTS + 1], [0.0; PARTS + 1]);
        let first = self.list.all().map(|effector| (effector, self.first[effector]));
        for (effector, MixerTerm { part, gain }) in first.chain(self.further.iter().copied()) {
            along[part] += gain * increments.positions[effector];
            length[part] += gain * gain;
        }
        // Least squares: the command that comes nearest to these increments.
        let part = |part: usize| if length[part] > 0.0 { along[part] / length[part] } else { 0.0 };
        mixed.applied = Compensation {
            aileron_rad: part(0),
            nozzle_pitch_rad: part(4),
            nozzle_yaw_rad: part(5),
        };
        mixed.increments = increments.positions;
        mixed
    }

    /// The effectors as the main controller alone would have them.
    pub fn mix_main_only(&self, main: &MainCommand) -> PerEffector<f64> {
        self.mix(main, &Compensation::NONE).commands
    }
}

impl MixerTerm {
    const NONE: Self = Self { part: NO_PART, gain: 0.0 };
}

fn clip(value: f64, min: f64, max: f64) -> (f64, Side) {
    if value > max {
        (max, Side::Above)
    } else if value < min {
        (min, Side::Below)
    } else {
        (value, Side::Inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::tvc_jet;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_command_leaves_the_travel_for_any_demand(
            demanded in proptest::array::uniform6(-1.0e9..1.0e9_f64), extra in proptest::array::uniform3(-1.0e9..1.0e9_f64),
        ) {
            let aircraft = testing::aircraft_model();
            let [aileron_rad, elevator_rad, rudder_rad, nozzle_pitch_rad, nozzle_yaw_rad, thrust_n] = demanded;
            let main = MainCommand { aileron_rad, elevator_rad, rudder_rad, nozzle_pitch_rad, nozzle_yaw_rad, thrust_n };
            let [aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad] = extra;
            let mixer = Mixer::new(&aircraft.effectors);
            let mixed = mixer.mix(&main, &Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad });
            for effector in tvc_jet::ALL {
                let servo = &aircraft.effectors.servos[effector];
                prop_assert!((servo.min..=servo.max).contains(&mixed.commands[effector]));
            }
            prop_assert_eq!(mixed.commands.as_array()[8..].iter().copied().sum::<f64>(), 0.0);
        }
    }

    #[test]
    fn ailerons_move_against_each_other_and_elevators_together() {
        let main = MainCommand {
            aileron_rad: 0.1,
            elevator_rad: 0.2,
            thrust_n: 2.0e4,
            ..MainCommand::default()
        };
        let mixer = Mixer::new(&testing::aircraft_model().effectors);
        let c = mixer.mix(&main, &Compensation::NONE).commands;
        assert_eq!((c[tvc_jet::LEFT_AILERON], c[tvc_jet::RIGHT_AILERON]), (-0.1, 0.1));
        assert_eq!((c[tvc_jet::LEFT_ELEVATOR], c[tvc_jet::RIGHT_ELEVATOR]), (0.2, 0.2));
    }

    #[test]
    fn a_saturated_side_blocks_only_the_pushing_direction() {
        assert!(Side::Above.blocks(1.0) && !Side::Above.blocks(-1.0));
        assert!(Side::Below.blocks(-1.0) && !Side::Below.blocks(1.0));
        assert!(!Side::Inside.blocks(1.0));
    }

    #[test]
    fn a_demand_beyond_the_travel_is_reported_by_axis_and_by_effector() {
        let mixer = Mixer::new(&testing::aircraft_model().effectors);
        let main = MainCommand { aileron_rad: 9.0, rudder_rad: -9.0, ..MainCommand::default() };
        let mixed = mixer.mix(&main, &Compensation::NONE);
        let Saturation { aileron, elevator, rudder, .. } = mixed.saturation;
        assert_eq!((aileron, elevator, rudder), (Side::Above, Side::Inside, Side::Below));
        let limited = tvc_jet::ALL.map(|effector| mixed.limited.contains(effector));
        // No thrust is below the engine's range.
        assert_eq!(limited, [true, true, false, false, true, false, false, true]);
    }

    #[test]
    fn an_effector_that_follows_two_parts_gets_their_sum_inside_its_travel() {
        let mut aircraft = testing::aircraft_model();
        // Elevators that roll too, at half the angle of the ailerons.
        aircraft.effectors.gains[tvc_jet::LEFT_ELEVATOR].roll = -0.5;
        aircraft.effectors.gains[tvc_jet::RIGHT_ELEVATOR].roll = 0.5;
        let mixer = Mixer::new(&aircraft.effectors);
        let main = MainCommand { aileron_rad: 0.2, elevator_rad: 0.1, ..MainCommand::default() };
        let c = mixer.mix(&main, &Compensation::NONE).commands;
        assert_eq!((c[tvc_jet::LEFT_ELEVATOR], c[tvc_jet::RIGHT_ELEVATOR]), (0.0, 0.2));
        let main = MainCommand { aileron_rad: 0.4, elevator_rad: 0.5, ..MainCommand::default() };
        let mixed = mixer.mix(&main, &Compensation::NONE);
        let travel = aircraft.effectors.servos[tvc_jet::RIGHT_ELEVATOR].max;
        assert_eq!(mixed.commands[tvc_jet::RIGHT_ELEVATOR], travel);
        assert!(mixed.limited.contains(tvc_jet::RIGHT_ELEVATOR));
        assert!(!mixed.limited.contains(tvc_jet::LEFT_ELEVATOR));
    }
}
