//! What the process takes from the ground-station side: intents, frames, what is to be saved, and counts.

use super::Ground;
use super::codec::Skipped;
use super::logs::{LogDone, LogJob};
use super::mission::SavedPlan;
use super::param::{Save, Saved};
use super::peers::{Address, Connection, Crowding};
use super::signing::{KeyChange, LogLine};
use super::statustext::LogText;
use super::traffic::Traffic;
use crate::wall_time::WallTime;
use flight_management::command::Intent;
use flight_management::parameters::Parameters;

impl Ground {
    /// Whether to read from a connection now; if not, its sender has to wait.
    #[must_use]
    pub fn accepts_input(&self, connection: Connection) -> bool {
        self.peers.accepts_input(connection)
    }

    /// Input that was read and had to wait can be answered now, by [`Ground::poll`].
    #[must_use]
    pub fn can_resume(&self) -> bool {
        self.peers.next_resumable().is_some()
    }

    /// A snapshot of the next tick is wanted.
    #[must_use]
    pub fn wants_snapshot(&self) -> bool {
        self.telemetry.wants_snapshot()
    }

    /// Next intent for the control thread.
    pub fn pop_intent(&mut self) -> Option<Intent> {
        self.intents.pop()
    }

    /// An intent waits.
    #[must_use]
    pub fn has_intents(&self) -> bool {
        !self.intents.is_empty()
    }

    /// Next frame to send and its destination, of those to whom something can be sent now.
    pub fn pop_frame(&mut self, can_send: impl Fn(Address) -> bool) -> Option<(Address, Vec<u8>)> {
        self.peers.pop(self.own, &mut self.signing, can_send)
    }

    /// Next text for the flight log that is not the words of an event.
    pub fn pop_text_for_log(&mut self) -> Option<LogText> {
        self.texts.pop_for_log()
    }

    /// What the key file should have now, if it is time to write it.
    pub fn pop_key_change(&mut self) -> Option<KeyChange> {
        self.signing.pop_change()
    }

    /// What the key file has to have at the end.
    pub fn last_key_change(&mut self) -> Option<KeyChange> {
        self.signing.last_change()
    }

    /// The key file could not be written.
    pub fn handle_key_unsaved(&mut self, why: &str, now: WallTime) {
        self.texts.refuse(now, format!("The signing key is not saved: {why}"));
        self.texts.poll(&mut self.peers);
    }

    /// A line about signing for the log; what was refused is told to the ground stations as well.
    pub fn report_signing(&mut self, now: WallTime) -> Option<LogLine> {
        let line = self.signing.report(now, &mut self.texts);
        self.texts.poll(&mut self.peers);
        line
    }

    /// From now on changes of parameters are saved; `kept` is what is saved already.
    pub fn keep_parameters(&mut self, kept: Parameters) {
        self.param.keep(kept);
    }

    /// Next text of the parameter file.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.param.pop_save()
    }

    /// Takes what became of a save.
    pub fn handle_saved(&mut self, saved: &Saved, now: WallTime) {
        let (services, mut ctx, out) = self.split(now);
        services.param.handle_saved(saved, &mut ctx, out);
        self.texts.poll(&mut self.peers);
    }

    /// From now on plans are kept; `saved` is what is kept already.
    pub fn keep_plan(&mut self, saved: SavedPlan) {
        self.mission.keep(saved);
    }

    /// Next text of the plan file.
    pub fn pop_plan_save(&mut self) -> Option<Save> {
        self.mission.pop_save()
    }

    /// Takes what became of a save of the plan.
    pub fn handle_plan_saved(&mut self, saved: &Saved, now: WallTime) {
        let (services, mut ctx, _) = self.split(now);
        services.mission.handle_saved(saved, now, &mut ctx);
        self.texts.poll(&mut self.peers);
    }

    /// From now on there is a folder with logs.
    pub fn open_log_folder(&mut self) {
        self.logs.open_folder();
    }

    /// What the log folder has to do next. To be called when it has nothing to do.
    pub fn pop_log_job(&mut self) -> Option<LogJob> {
        self.logs.pop_job()
    }

    /// Takes what became of a job of the log folder.
    pub fn handle_log_done(&mut self, done: LogDone, now: WallTime) {
        let (services, mut ctx, _) = self.split(now);
        services.logs.handle_done(done, now, &mut ctx);
        self.texts.poll(&mut self.peers);
    }

    /// The frames that were heard, for the record of all traffic.
    pub fn traffic(&mut self) -> &mut Traffic {
        &mut self.traffic
    }

    /// The parameters now.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Messages to the present peers dropped so far: telemetry, announcements, answers.
    #[must_use]
    pub fn dropped(&self) -> [u64; 3] {
        self.peers.dropped()
    }

    /// What came of too many visitors so far.
    #[must_use]
    pub fn crowding(&self) -> Crowding {
        self.peers.crowding()
    }

    /// What was skipped in the input so far.
    #[must_use]
    pub fn skipped(&self) -> Skipped {
        self.skipped
    }
}
