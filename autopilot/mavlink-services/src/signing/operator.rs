//! SETUP_SIGNING, and the reports to the operators.

use ::mavlink::dialects::common::MavSeverity;

use super::{SetupOutcome, Signing};
use crate::codec::SetupSigning;
use crate::context::From;
use crate::peers::Peers;
use crate::statustext::StatusTexts;
use crate::wall_time::WallTime;

/// A line for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogLine {
    /// Signing was turned on or off.
    Turned(&'static str),
    /// Something is refused.
    Refused(String),
}

impl Signing {
    /// Takes SETUP_SIGNING of a station on this computer. The key travels in clear, so one that came over
    /// a network would be no secret. It is never sent on and never answered.
    pub fn handle(
        &mut self,
        from: From,
        setup: &SetupSigning,
        now: WallTime,
        peers: &Peers,
        texts: &mut StatusTexts,
    ) {
        if !peers.is_local(from.peer) {
            texts.refuse(now, "SETUP_SIGNING refused: it may only come from this computer");
            return;
        }
        let outcome = self.set_up(setup, now);
        let text = match outcome {
            SetupOutcome::On if self.has_file => "Signing is on",
            SetupOutcome::On => "Signing is on until the end: there is no key file",
            SetupOutcome::StaysOn => "Signing stays on, with the same key",
            SetupOutcome::Off => "Signing is off",
            SetupOutcome::StaysOff => "Signing stays off",
            SetupOutcome::TimestampOutside => {
                return texts.refuse(now, "SETUP_SIGNING refused: initial_timestamp is after 2103");
            }
            SetupOutcome::DayAhead => {
                let why = "SETUP_SIGNING refused: initial_timestamp is over a day ahead; is a clock wrong?";
                return texts.refuse(now, why);
            }
        };
        texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
        if matches!(outcome, SetupOutcome::On | SetupOutcome::Off) {
            self.news = Some(text);
        }
    }

    /// One line for the log: signing was turned on or off, or refuses something. What it refuses is told
    /// to the stations as well, at most every ten seconds for each kind.
    pub fn report(&mut self, now: WallTime, texts: &mut StatusTexts) -> Option<LogLine> {
        if let Some(news) = self.news.take() {
            return Some(LogLine::Turned(news));
        }
        let line = self.refusals.next_line(now)?;
        texts.say(MavSeverity::MAV_SEVERITY_WARNING, line.clone());
        Some(LogLine::Refused(line))
    }
}
