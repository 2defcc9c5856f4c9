//! The way of the commands to servos with [`Imperfections`](crate::servos::Imperfections): delay, deadband, hysteresis, bias,
//! and the travel that the hinge moment leaves.
//!
//! A delay is exact to the microsecond, also between ticks. The dynamic pressure is that at the beginning of each control period.

use icd::{Actuators, Effector, PerEffector, SimTime};

use super::Plant;
use crate::airframe::Airframe;
use crate::faults::micros;
use crate::servos::{self, Delayed, Servo};

/// The way of the commands to one effector, rad or N.
#[derive(Debug, Clone)]
pub(super) struct CommandPath {
    effector: Effector,
    servo: Servo,
    delay_us: u64,
    pending: Delayed,
    /// The latest command, which arrives after the delay.
    sent: f64,
    /// The last command that the deadband let through.
    followed: f64,
    /// The same behind the play.
    played: f64,
    /// Ends of the travel that the hinge moment leaves.
    travel: [f64; 2],
}

impl CommandPath {
    /// Those of an aircraft whose effectors are at rest at these positions; none if all its actuators are ideal.
    pub fn all(airframe: &Airframe, positions: &PerEffector<f64>) -> Vec<Self> {
        let Airframe { effectors, servos, .. } = airframe;
        if effectors.all().all(|effector| servos[effector].imperfections.are_none()) {
            return Vec::new();
        }
        let path = |effector: Effector| {
            let (servo, at) = (servos[effector], positions[effector]);
            Self {
                effector,
                servo,
                delay_us: micros(servo.imperfections.delay_s),
                pending: Delayed::new(),
                sent: at,
                followed: at,
                played: at,
                travel: [servo.min, servo.max],
            }
        };
        effectors.all().map(path).collect()
    }

    /// What the servo gets of a command that has arrived: deadband, play, bias, travel.
    fn pass(&mut self, command: f64) -> f64 {
        let imperfections = &self.servo.imperfections;
        if (command - self.followed).abs() > imperfections.deadband {
            self.followed = command;
        }
        let half = 0.5 * imperfections.hysteresis;
        self.played = self.played.max(self.followed - half).min(self.followed + half);
        self.servo.limited(self.played + imperfections.bias)
    }
}

impl Plant {
    /// Sends commands to the effectors, which follow them now or after their delay.
    pub(super) fn command(&mut self, actuators: &Actuators) {
        let Airframe { effectors, servos, .. } = self.dynamics.airframe();
        let (count, now) = (effectors.len(), self.time);
        if self.paths.is_empty() {
            let previous = self.faults.commands();
            let commands = servos::accepted(count, servos, &actuators.commands, previous);
            self.faults.command(&commands, now);
            self.inputs.commands = *self.faults.received();
            return;
        }
        let previous = PerEffector::from_values(self.paths.iter().map(|path| path.sent));
        let commands = servos::accepted(count, servos, &actuators.commands, &previous);
        for path in &mut self.paths {
            path.sent = commands[path.effector];
            let due = SimTime::from_micros(now.as_micros() + path.delay_us);
            path.pending.push(due, path.sent);
        }
        self.feel_hinge_moments();
        self.let_commands_arrive();
    }

    /// When the next command arrives.
    pub(super) fn next_arrival(&self) -> Option<SimTime> {
        self.paths.iter().filter_map(|path| path.pending.next()).min()
    }

    /// Hands every command that is due to the servos and their faults.
    pub(super) fn let_commands_arrive(&mut self) {
        for path in &mut self.paths {
            if let Some(command) = path.pending.due(self.time) {
                self.faults.command_one(path.effector, path.pass(command), self.time);
            }
        }
        self.hold_faults();
    }

    /// Sets the travel that the hinge moments leave at the present dynamic pressure.
    pub(super) fn feel_hinge_moments(&mut self) {
        let pressure_pa = self.truth.dynamic_pressure_pa();
        for path in &mut self.paths {
            path.travel = path.servo.travel_at(pressure_pa);
            self.faults.limit_travel(path.effector, path.travel);
        }
    }

    /// Copies what the servos receive, inside the travel that the hinge moments leave.
    pub(super) fn receive(&mut self) {
        self.inputs.commands = *self.faults.received();
        for path in &self.paths {
            let ([low, high], command) = (path.travel, &mut self.inputs.commands[path.effector]);
            // The command of an engine that is out is below its travel.
            if path.servo.imperfections.stall_pressure_pa.is_some() {
                *command = command.max(low).min(high);
            }
        }
    }

    /// States of the actuators besides the positions, for a linearisation: of every second-order servo its rate, rad/s or N/s, of
    /// every late effector the command that it follows now and those on their way, rad or N.
    pub fn actuator_states(&mut self) -> impl Iterator<Item = &mut f64> {
        let inert = &self.dynamics.airframe().servos;
        let rates = self.rates.iter_mut();
        let rates = rates.filter(|(effector, _)| inert[*effector].second_order.is_some());
        let late = self.paths.iter_mut().filter(|path| path.delay_us > 0);
        let commands = late
            .flat_map(|path| std::iter::once(&mut path.followed).chain(path.pending.commands()));
        rates.map(|(_, rate)| rate).chain(commands)
    }

    /// Sets [`Plant::actuator_states`].
    pub fn set_actuator_states(&mut self, mut values: impl Iterator<Item = f64>) {
        for state in self.actuator_states() {
            *state = values.next().unwrap_or(*state);
        }
        for path in self.paths.iter_mut().filter(|path| path.delay_us > 0) {
            self.faults.command_one(path.effector, path.pass(path.followed), self.time);
        }
        self.hold_faults();
    }
}
