//! The control thread: answers the plant, and between two packets handles intents and events.
//!
//! The thread waits for the plant only. Intents of ground stations arrive through bounded channels, events and
//! snapshots leave through them, and a full one delays nothing.

use std::fs::File;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use flight_control::StepLog;
use host_io::health::HealthFile;
use host_io::problem::{At as _, Problem};
use host_io::tick_log::TickLogWriter;
use host_io::{LinkSocket, Stop, session};
use icd::SimTime;
use icd::lockstep::{FlightEvent, FlightSide, Refused};
use icd::wire::{
    self, Aircraft, PACKET_MAX, Phase, RefusalPacket, RefusalReason, SensorPacket, VERSION,
    WireError,
};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tracing::{error, info, warn};

use super::recorder::Recorder;
use super::status::{PlantState, StatusSource};
use crate::clock::{self, WallTime};
use flight_management::autopilot::Autopilot;
use flight_management::command::Intent;
use flight_management::event::{Event, EventKind, Snapshot};
use flight_management::fault_list::FaultList;
use flight_management::own_law::FlightLaw;

/// Longest wait for a packet: the control thread takes intents at least this often, also without a plant.
pub const RECEIVE_TIMEOUT: Duration = Duration::from_millis(50);
/// Intents taken in one tick; a flood waits in its channel.
const INTENTS_PER_TICK: usize = 64;
/// A plant that is silent for longer is lost. It keeps its place: it may only be suspended.
const SILENCE_MAX: Duration = Duration::from_secs(1);
/// Another plant takes the place of one that has been lost for this long. One whose socket is closed loses it at once.
const ABSENCE_MAX: Duration = Duration::from_secs(60);
/// Time between two packets that show whether the socket of a lost plant is closed.
const PROBE_INTERVAL: Duration = Duration::from_millis(500);
/// Time between two warnings of one kind about invalid packets.
const WARNING_INTERVAL: Duration = Duration::from_secs(5);
const WARNINGS: usize = 5;

/// Entry of the step log: simulation time and the signals of that step.
pub type LoggedStep = (SimTime, StepLog);

/// Everything that the control thread owns.
#[derive(Debug)]
pub struct PlantLink {
    socket: LinkSocket,
    autopilot: Autopilot,
    channels: ControlChannels,
    status: Option<StatusSource>,
    /// For the status lines.
    faults: FaultList,
    step_log: Option<TickLogWriter>,
    stop: Stop,
    side: FlightSide,
    watchdog: PlantWatchdog,
    /// When the lost plant was sent a packet last; `None` once its socket was found closed.
    probed: Option<WallTime>,
    warnings: PacketWarnings,
    /// Touched as long as the loop runs.
    pub health: Option<HealthFile>,
    pub recorder: Option<Recorder>,
    /// The law of the program gives no more commands, and the operator knows it.
    law_has_failed: bool,
}

impl PlantLink {
    /// Ready for a plant.
    pub fn new(
        socket: LinkSocket,
        autopilot: Autopilot,
        channels: ControlChannels,
        status: Option<StatusSource>,
        step_log: Option<TickLogWriter>,
        stop: Stop,
    ) -> Self {
        let side = FlightSide::new(autopilot.model().aircraft());
        Self {
            socket,
            autopilot,
            channels,
            status,
            faults: FaultList::default(),
            step_log,
            stop,
            side,
            watchdog: PlantWatchdog::default(),
            probed: None,
            warnings: PacketWarnings::default(),
            health: None,
            recorder: None,
            law_has_failed: false,
        }
    }

    /// Answers plants until the process ends. Gives the lock of the finished flight log, for the rest of the process.
    pub fn run(mut self) -> Result<Option<File>, Problem> {
        let mut buffer = [0; PACKET_MAX + 1];
        while !self.stop.is_requested() {
            let received = self.socket.receive_from(&mut buffer);
            match received.at("plant link")? {
                Some((bytes, from)) => self.take(&buffer[..bytes], from),
                None => self.housekeeping(),
            }
        }
        let log = self.recorder.take().and_then(Recorder::finish);
        self.step_log.map_or(Ok(()), TickLogWriter::finish).at("step log")?;
        Ok(log)
    }

    fn take(&mut self, datagram: &[u8], from: SocketAddr) {
        let foreign = self.side.plant().is_some_and(|plant| plant != from);
        if foreign {
            self.check_silence();
        }
        match self.side.handle(datagram, from, foreign && self.is_free()) {
            FlightEvent::Next(packet) => {
                self.plant_answered();
                self.answer(&packet, wire::envelope(datagram), from);
            }
            FlightEvent::NewFlight(packet) => {
                self.watchdog.packet_received();
                self.keep_errors(false);
                let joined_in_flight = packet.sequence > 0;
                let t_s = packet.time.as_seconds();
                let session = session::shown(packet.session);
                info!(plant = %from, %session, t_s, joined_in_flight, "a flight begins");
                self.autopilot.begin_flight(packet.period, packet.time, joined_in_flight);
                self.record(|recorder, autopilot| recorder.begin_flight(&packet, autopilot));
                self.answer(&packet, wire::envelope(datagram), from);
            }
            FlightEvent::Repeat(answer) => {
                // An answer that cannot be sent is lost; the plant will request it again.
                let _ = self.socket.send_to(answer, from);
                // Anybody can send the same packet again; only a plant that takes answers holds its place.
                if self.side.is_under_way() {
                    self.plant_answered();
                }
            }
            FlightEvent::Refuse(refusal, why) => {
                // One refusal for each packet; if it gets lost, the next packet is refused as well.
                let _ = self.socket.send_to(refusal, from);
                self.warnings.refused(why, self.side.aircraft(), from, clock::now());
                self.housekeeping();
            }
            FlightEvent::Refused(refusal) => {
                self.warnings.refused_by_plant(refusal, from, clock::now());
            }
            // A flood of foreign packets must not delay the operator's commands.
            FlightEvent::Ignored(_) => self.housekeeping(),
        }
    }

    /// Handles a packet of the plant, perhaps the first after a silence.
    fn plant_answered(&mut self) {
        if self.watchdog.packet_received() {
            info!("the plant is back");
            self.keep_errors(false);
            self.autopilot.plant_back();
            self.record(|recorder, _| recorder.plant_back());
        }
    }

    /// Passes something to the recorder, if there is one.
    fn record(&mut self, what: impl FnOnce(&mut Recorder, &Autopilot)) {
        if let Some(recorder) = &mut self.recorder {
            what(recorder, &self.autopilot);
        }
    }

    /// Does what is due when there is no packet to answer.
    fn housekeeping(&mut self) {
        self.check_silence();
        self.take_intents();
        self.publish();
    }

    /// Sends the answer first; everything else comes after it. `envelope` holds the data that the plant
    /// sends to the recorder, which decodes it; the autopilot never reads it.
    fn answer(&mut self, packet: &SensorPacket, envelope: &[u8], to: SocketAddr) {
        self.record(|recorder, _| recorder.enter(packet));
        for report in &packet.reports {
            self.autopilot.handle_report(report);
        }
        self.take_intents();
        let actuators = match packet.phase {
            Phase::Flying => self.autopilot.step(packet.time, &packet.sensors).actuators(),
            Phase::Holding => self.autopilot.hold(&packet.sensors, false),
            Phase::OnGround => self.autopilot.hold(&packet.sensors, true),
        };
        let failure = self.autopilot.own_law().and_then(FlightLaw::failure);
        if let (Some(failure), false) = (&failure, self.law_has_failed) {
            error!(%failure, "the law has failed; its last command is repeated");
        }
        self.law_has_failed = failure.is_some();
        let request = self.autopilot.next_request();
        if let Some(answer) = self.side.answer(&actuators, request, self.recorder.is_some()) {
            // An answer that cannot be sent is lost; the plant will request it again.
            let _ = self.socket.send_to(answer, to);
        }
        if packet.phase == Phase::Flying
            && let Some(writer) = self.step_log.as_mut()
            && let Some(snapshot) = self.autopilot.snapshot()
            && let Err(problem) = writer.write(&(packet.time, snapshot.log))
        {
            error!(%problem, "the step log ends here");
        }
        self.record(|recorder, autopilot| {
            recorder.leave(packet, envelope, &actuators, request, autopilot);
        });
        self.publish();
    }

    fn take_intents(&mut self) {
        for _ in 0..INTENTS_PER_TICK {
            let Some(intent) = self.channels.next_intent() else { return };
            self.record(|recorder, _| recorder.intent(&intent));
            self.autopilot.handle_intent(intent);
        }
    }

    /// Sends events and snapshots to the ground-station side, as far as its channels have room.
    fn publish(&mut self) {
        if let Some(health) = self.health.as_mut()
            && let Err(problem) = health.all_is_well(host_io::clock::now())
        {
            warn!(%problem, "the health file cannot be written");
        }
        while self.channels.has_room_for_event()
            && let Some(event) = self.autopilot.pop_event()
        {
            self.record(|recorder, _| recorder.event(event));
            self.faults.handle_event(&event.kind);
            // There was room a moment ago, and this thread is the only sender.
            let _ = self.channels.send_event(event);
        }
        if let Some(recorder) = self.recorder.as_mut() {
            recorder.poll();
            if recorder.log_was_removed() {
                self.autopilot.publish(EventKind::LogRemoved);
            }
        }
        if self.channels.snapshot_wanted()
            && let Some(snapshot) = self.autopilot.snapshot()
        {
            self.channels.show(snapshot);
        }
        if let Some(status) = self.status.as_ref().filter(|status| status.is_wanted()) {
            let plant = if self.watchdog.is_lost() { PlantState::Lost } else { PlantState::Flying };
            status.show(plant, &self.autopilot, &self.faults);
        }
    }

    /// Whether another plant may take the place of the present one.
    fn is_free(&self) -> bool {
        self.watchdog.is_lost()
            && (self.probed.is_none()
                || !self.side.is_under_way()
                || self.watchdog.is_absent(clock::now()))
    }

    /// Sends a lost plant the last answer again, to which its host replies if the socket of the plant is closed.
    fn probe(&mut self, now: WallTime) {
        let Some(probed) = self.probed.filter(|_| self.watchdog.is_lost()) else { return };
        let Some((answer, plant)) = self.side.last_answer() else { return };
        if self.socket.is_gone(plant) {
            info!(%plant, "the plant has ended; another one may take its place");
            self.probed = None;
        } else if now.since(probed) >= PROBE_INTERVAL {
            self.probed = Some(now);
            // A packet that cannot be sent is a lost one.
            let _ = self.socket.send_to(answer, plant);
        }
    }

    fn keep_errors(&self, keep: bool) {
        if let Err(problem) = self.socket.keep_errors(keep) {
            warn!(%problem, "the end of the plant will be noticed late");
        }
    }

    fn check_silence(&mut self) {
        if self.side.plant().is_none() {
            return;
        }
        let now = clock::now();
        if self.watchdog.check(now) {
            warn!(
                "the plant does not answer any more; waiting for it, or for another one if it has ended"
            );
            self.keep_errors(true);
            self.probed = Some(WallTime::ZERO);
            self.autopilot.plant_lost();
            self.record(|recorder, _| recorder.plant_lost());
        }
        self.probe(now);
    }
}

/// Whether the plant is present, by the time since its last packet.
///
/// Reading a clock for each packet would cost more than the packet's other bookkeeping, so a packet only sets a flag, and
/// the next [`PlantWatchdog::check`] turns it into a time.
#[derive(Debug, Clone, Copy, Default)]
struct PlantWatchdog {
    received: bool,
    last_received: WallTime,
    /// When it was found lost.
    lost: Option<WallTime>,
}

impl PlantWatchdog {
    /// Records a packet of the plant. True if the plant was lost before.
    fn packet_received(&mut self) -> bool {
        self.received = true;
        self.lost.take().is_some()
    }

    /// True if this check has found the plant lost.
    fn check(&mut self, now: WallTime) -> bool {
        if std::mem::take(&mut self.received) {
            self.last_received = now;
        }
        let lost_now = self.lost.is_none() && now.since(self.last_received) > SILENCE_MAX;
        if lost_now {
            self.lost = Some(now);
        }
        lost_now
    }

    /// Whether the plant has been lost for so long that its place is free. Time during which this process was suspended
    /// does not count.
    fn is_absent(&self, now: WallTime) -> bool {
        self.lost.is_some_and(|lost| now.since(lost) >= ABSENCE_MAX)
    }

    /// Whether the plant was lost at the last check and has sent nothing since.
    fn is_lost(&self) -> bool {
        self.lost.is_some()
    }
}

/// Warnings about invalid packets, one of each kind every [`WARNING_INTERVAL`] at most.
#[derive(Debug, Clone, Copy, Default)]
struct PacketWarnings {
    logged: [Option<WallTime>; WARNINGS],
}

impl PacketWarnings {
    /// A packet was refused; `ours` is the aircraft of the model file.
    fn refused(&mut self, why: Refused, ours: Aircraft, from: SocketAddr, now: WallTime) {
        match why {
            Refused::Busy if self.is_due(0, now) => {
                warn!(%from, "refused a packet from another address than that of the plant in flight");
            }
            Refused::Packet(WireError::Version { theirs, .. }) if self.is_due(1, now) => {
                error!(%from, theirs, ours = VERSION, "refused a plant of another link version");
            }
            Refused::Packet(WireError::Value { field, value, .. }) if self.is_due(2, now) => {
                error!(%from, field, value, "refused a packet with an invalid value");
            }
            Refused::Aircraft(theirs) if self.is_due(4, now) => {
                error!(%from, %theirs, %ours, "refused a plant that flies another aircraft than the model file is of");
            }
            Refused::Busy | Refused::Packet(_) | Refused::Aircraft(_) => {}
        }
    }

    /// The plant refuses this autopilot.
    fn refused_by_plant(&mut self, refusal: RefusalPacket, from: SocketAddr, now: WallTime) {
        if !self.is_due(3, now) {
            return;
        }
        match refusal.reason {
            RefusalReason::Version => {
                error!(%from, theirs = refusal.version, ours = VERSION, "the plant speaks another link version");
            }
            RefusalReason::Value => {
                error!(%from, "the plant refuses a value of this autopilot's packet");
            }
            RefusalReason::Aircraft => {
                error!(%from, "the plant flies another aircraft than the model file is of");
            }
            RefusalReason::Busy => error!(%from, "the plant flies with another autopilot"),
        }
    }

    fn is_due(&mut self, kind: usize, now: WallTime) -> bool {
        let due = self.logged[kind].is_none_or(|logged| now.since(logged) >= WARNING_INTERVAL);
        if due {
            self.logged[kind] = Some(now);
        }
        due
    }
}

/// Intents for the control thread, which takes all of them each tick.
const INTENTS_MAX: usize = 64;
/// Events for the ground stations. Those without room wait in [`flight_management::autopilot::Autopilot`].
const EVENTS_MAX: usize = 256;
/// Snapshots: a request for one is fulfilled once, so a second one would be stale.
const SNAPSHOTS_MAX: usize = 1;

#[derive(Debug)]
pub struct GroundChannels {
    /// To the control thread.
    pub intents: Sender<Intent>,
    /// From the control thread.
    pub events: Receiver<Event>,
    /// From the control thread, one for each request.
    pub snapshots: Receiver<Snapshot>,
    /// Set it to get a snapshot of the next tick.
    pub snapshot_wanted: Arc<AtomicBool>,
}

/// The end on the control thread.
#[derive(Debug)]
pub struct ControlChannels {
    intents: Receiver<Intent>,
    events: Sender<Event>,
    snapshots: Sender<Snapshot>,
    snapshot_wanted: Arc<AtomicBool>,
}

pub fn channels() -> (GroundChannels, ControlChannels) {
    let (intent_sender, intent_receiver) = channel(INTENTS_MAX);
    let (event_sender, event_receiver) = channel(EVENTS_MAX);
    let (snapshot_sender, snapshot_receiver) = channel(SNAPSHOTS_MAX);
    let snapshot_wanted = Arc::new(AtomicBool::new(false));
    let ground = GroundChannels {
        intents: intent_sender,
        events: event_receiver,
        snapshots: snapshot_receiver,
        snapshot_wanted: Arc::clone(&snapshot_wanted),
    };
    let control = ControlChannels {
        intents: intent_receiver,
        events: event_sender,
        snapshots: snapshot_sender,
        snapshot_wanted,
    };
    (ground, control)
}

impl ControlChannels {
    /// Next intent, if there is one. Never waits.
    pub fn next_intent(&mut self) -> Option<Intent> {
        // A ground-station side that has ended sends no more intents; the flight continues.
        self.intents.try_recv().ok()
    }

    /// Whether there is room for at least one event; fetch the event only then, so that none gets lost.
    pub fn has_room_for_event(&self) -> bool {
        self.events.capacity() > 0 || self.events.is_closed()
    }

    /// Sends an event. Never waits; drops it if the receiver is gone.
    pub fn send_event(&self, event: Event) -> Result<(), Event> {
        match self.events.try_send(event) {
            Ok(()) | Err(TrySendError::Closed(_)) => Ok(()),
            Err(TrySendError::Full(event)) => Err(event),
        }
    }

    /// Whether a snapshot is requested: one relaxed load, cheap enough for each tick.
    pub fn snapshot_wanted(&self) -> bool {
        self.snapshot_wanted.load(Ordering::Relaxed)
    }

    /// Sends a snapshot and fulfils the request.
    pub fn show(&self, snapshot: &Snapshot) {
        self.snapshot_wanted.store(false, Ordering::Relaxed);
        // A full channel holds an unread snapshot, a closed one has no reader: both are fine.
        let _ = self.snapshots.try_send(*snapshot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plant_is_lost_once_after_a_second_of_silence_and_comes_back() {
        let ms = |ms: u64| WallTime::from_micros(1_000 * ms);
        let mut watchdog = PlantWatchdog::default();
        watchdog.packet_received();
        assert!(!watchdog.check(ms(5_000)));
        assert!(!watchdog.check(ms(6_000)));
        assert!(watchdog.check(ms(6_001)));
        assert!(!watchdog.check(ms(7_000)), "reported once");
        assert!(watchdog.is_lost());
        assert!(watchdog.packet_received());
        assert!(!watchdog.packet_received());
        assert!(!watchdog.check(ms(9_000)));
        assert!(!watchdog.is_lost());
    }

    #[test]
    fn a_lost_plant_keeps_its_place_for_a_minute() {
        let ms = |ms: u64| WallTime::from_micros(1_000 * ms);
        let mut watchdog = PlantWatchdog::default();
        watchdog.packet_received();
        // Found late, since this process was suspended too.
        assert!(!watchdog.check(ms(1_000)) && watchdog.check(ms(900_000)));
        assert!(!watchdog.is_absent(ms(959_999)) && watchdog.is_absent(ms(960_000)));
        assert!(watchdog.packet_received());
        assert!(!watchdog.is_absent(ms(2_000_000)));
    }

    #[test]
    fn each_kind_of_warning_is_logged_at_once_and_then_at_intervals() {
        let mut warnings = PacketWarnings::default();
        let at = |s: u64| WallTime::from_micros(1_000_000 * s);
        assert!(warnings.is_due(0, at(1)));
        assert!(!warnings.is_due(0, at(5)));
        assert!(warnings.is_due(1, at(5)));
        assert!(warnings.is_due(0, at(6)));
    }
}

#[cfg(test)]
mod channel_tests {
    use super::*;
    use flight_management::event::EventKind;
    use icd::SimTime;

    #[test]
    fn a_full_channel_gives_the_event_back_and_an_ended_listener_swallows_it() {
        let (ground, control) = channels();
        let event = Event { time: SimTime::ZERO, kind: EventKind::PlantLost };
        for _ in 0..EVENTS_MAX {
            assert_eq!(control.send_event(event), Ok(()));
        }
        assert!(!control.has_room_for_event());
        assert_eq!(control.send_event(event), Err(event));
        drop(ground);
        assert!(control.has_room_for_event());
        assert_eq!(control.send_event(event), Ok(()));
    }
}
