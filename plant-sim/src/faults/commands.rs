//! From the commands that arrive to those that the servos receive in spite of their faults.

use icd::{Effector, PerEffector, SimTime};

use super::Faults;

impl Faults {
    /// Sets the commands (inside the travel, rad and N) that apply from `now` on.
    pub fn command(&mut self, commands: &PerEffector<f64>, now: SimTime) {
        self.commands = *commands;
        if !self.alters_commands {
            self.received = *commands;
            return;
        }
        for effector in self.list.all() {
            self.receive(effector, now);
        }
        self.look_ahead(now);
    }

    /// The same for one effector, whose command arrives between those of the others.
    pub fn command_one(&mut self, effector: Effector, command: f64, now: SimTime) {
        self.commands[effector] = command;
        self.receive(effector, now);
        self.look_ahead(now);
    }

    /// Sets the ends of the travel that the hinge moment leaves an effector, rad or N.
    pub fn limit_travel(&mut self, effector: Effector, travel: [f64; 2]) {
        self.travel[effector] = travel;
    }

    fn receive(&mut self, effector: Effector, now: SimTime) {
        if let Some(due) = self.active_fault(effector).and_then(|active| active.due(now)) {
            self.delayed[effector].push(due, self.commands[effector]);
        }
        self.update_received(effector, now);
    }

    /// Sets the command that an effector's servo receives in spite of its fault.
    pub(super) fn update_received(&mut self, effector: Effector, now: SimTime) {
        let command = self.commands[effector];
        self.received[effector] = match self.active_fault(effector) {
            None => command,
            Some(active) if active.is_delayed() => {
                self.delayed[effector].due(now).unwrap_or(self.received[effector])
            }
            Some(active) => active.command(command, now),
        };
    }
}
