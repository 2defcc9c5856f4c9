//! The plant's side of the link on a socket: repeats an unanswered packet, and warns the operator of errors.

use std::io;
use std::time::{Duration, Instant};

use host_io::health::HealthFile;
use host_io::problem::{At as _, Problem, problem};
use host_io::{LinkSocket, Stop, clock, session};
use icd::lockstep::{PlantEvent, PlantSide};
use icd::wire::{
    self, ActuatorPacket, Aircraft, PACKET_MAX, Phase, RefusalPacket, RefusalReason, Reports,
    VERSION,
};
use icd::{ControlPeriod, Sensors, SimTime};
use tracing::{info, warn};

/// An unanswered packet is repeated after this time.
pub(super) const RESEND_AFTER: Duration = Duration::from_millis(20);
/// After this silence the plant warns the operator.
const SILENCE_MAX: Duration = Duration::from_secs(1);

/// The link to the autopilot.
#[derive(Debug)]
pub(super) struct Link {
    socket: LinkSocket,
    aircraft: Aircraft,
    side: PlantSide,
    stop: Stop,
    buffer: [u8; PACKET_MAX + 1],
    unanswered: Option<Unanswered>,
    health: Option<HealthFile>,
}

/// A packet that the autopilot has not answered at once.
#[derive(Debug)]
struct Unanswered {
    since: Instant,
    sent: Instant,
    is_reported: bool,
    is_refusal_reported: bool,
}

impl Link {
    /// A link whose first exchange belongs to a new flight of this aircraft.
    ///
    /// # Errors
    /// If the system has no random number for the session.
    pub(super) fn new(
        socket: LinkSocket,
        aircraft: Aircraft,
        stop: Stop,
        health: Option<HealthFile>,
    ) -> io::Result<Self> {
        let side = PlantSide::new(session::draw()?, aircraft);
        Ok(Self {
            socket,
            aircraft,
            side,
            stop,
            buffer: [0; PACKET_MAX + 1],
            unanswered: None,
            health,
        })
    }

    /// The next exchange belongs to a new flight.
    pub(super) fn begin_session(&mut self) -> io::Result<()> {
        self.side = PlantSide::new(session::draw()?, self.aircraft);
        Ok(())
    }

    /// The flight's session, as logs show it.
    pub(super) fn session(&self) -> String {
        session::shown(self.side.session())
    }

    /// Sends the packet of the next exchange; `envelope` is for the recorder.
    pub(super) fn begin_exchange(
        &mut self,
        time: SimTime,
        phase: Phase,
        period: ControlPeriod,
        sensors: &Sensors,
        reports: Reports,
        envelope: &[u8],
    ) {
        let question = self.side.begin_exchange(time, phase, period, sensors, reports, envelope);
        // A packet that cannot be sent counts as lost.
        let _ = self.socket.send(question);
    }

    /// Waits for the answer without a time limit; `None` if the process has to end.
    pub(super) fn answer(&mut self) -> Result<Option<ActuatorPacket>, Problem> {
        loop {
            let Some(bytes) = self.socket.receive(&mut self.buffer).at("plant link")? else {
                if self.stop.is_requested() {
                    return Ok(None);
                }
                self.resend_if_due(RESEND_AFTER);
                continue;
            };
            let refused = match self.side.handle(&self.buffer[..bytes]) {
                PlantEvent::Answer(packet) => {
                    if let Some(Unanswered { since, is_reported: true, .. }) =
                        self.unanswered.take()
                    {
                        let silence_s = (clock::now() - since).as_secs_f64();
                        info!(silence_s, "the autopilot answers");
                    }
                    if let Some(health) = self.health.as_mut()
                        && let Err(problem) = health.all_is_well(clock::now())
                    {
                        // The file is for an operator; the flight does not need it.
                        warn!(%problem, "the health file cannot be written");
                    }
                    return Ok(Some(packet));
                }
                PlantEvent::Refused(refusal) => {
                    self.refused(refusal)?;
                    None
                }
                PlantEvent::Refuse(refusal, why) => {
                    // It does not matter whether the refusal arrives.
                    let _ = self.socket.send(refusal);
                    Some(why)
                }
                PlantEvent::Ignored(_) => None,
            };
            if self.stop.is_requested() {
                return Ok(None);
            }
            let unanswered = self.resend_if_due(Duration::ZERO);
            if let Some(error) = refused.filter(|_| !unanswered.is_refusal_reported) {
                unanswered.is_refusal_reported = true;
                warn!(%error, "refused a packet of the autopilot");
            }
        }
    }

    /// Repeats the packet once [`RESEND_AFTER`] has passed. It was sent at least `waited` ago.
    ///
    /// Receiving a packet other than the answer does not send it earlier: otherwise each late answer would cause another request
    /// and another late answer, which would double the traffic for good.
    fn resend_if_due(&mut self, waited: Duration) -> &mut Unanswered {
        let now = clock::now();
        // Soon after the start of the computer the clock may not reach back so far.
        let first = now.checked_sub(waited).unwrap_or(now);
        let unanswered = self.unanswered.get_or_insert(Unanswered {
            since: first,
            sent: first,
            is_reported: false,
            is_refusal_reported: false,
        });
        if now - unanswered.sent >= RESEND_AFTER
            && let Some(question) = self.side.unanswered()
        {
            unanswered.sent = now;
            // A packet that cannot be sent is lost, and sent again.
            let _ = self.socket.send(question);
        }
        if !unanswered.is_reported && now - unanswered.since >= SILENCE_MAX {
            unanswered.is_reported = true;
            warn!("the autopilot does not answer; the aircraft waits for it");
        }
        unanswered
    }

    fn refused(&mut self, refusal: RefusalPacket) -> Result<(), Problem> {
        match refusal.reason {
            // Asking again changes neither version nor aircraft, so the plant ends with the reason.
            RefusalReason::Version => Err(problem!(
                "the autopilot speaks version {} of the plant link, this plant speaks version {VERSION}",
                refusal.version
            )),
            RefusalReason::Value => {
                // Why it was refused, the decoder of this side says about the same bytes.
                let value = match self.side.unanswered().map(wire::decode) {
                    Some(Err(error)) => error.to_string(),
                    _ => "it was damaged on the way".to_owned(),
                };
                Err(problem!("the autopilot refused the sensor packet: {value}"))
            }
            RefusalReason::Aircraft => Err(problem!(
                "the autopilot's model file is of another aircraft than the airframe, {}; write one with \
                 `sitl aircraft linearize --airframe` and give it with --model",
                self.aircraft
            )),
            RefusalReason::Busy => {
                let unanswered = self.resend_if_due(Duration::ZERO);
                if !unanswered.is_reported {
                    unanswered.is_reported = true;
                    warn!("the autopilot is flying another plant; asking again until it is free");
                }
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, SocketAddr};

    use host_io::Wait;
    use icd::lockstep::{FlightEvent, FlightSide};
    use icd::{Actuators, tvc_jet};

    use super::*;

    /// A socket in the autopilot's place, which answers the packets that have arrived.
    struct Peer {
        socket: LinkSocket,
        side: FlightSide,
    }

    impl Peer {
        fn answer(&mut self, copies: usize) {
            let mut buffer = [0; PACKET_MAX];
            let (bytes, from) = self.socket.receive_from(&mut buffer).unwrap().unwrap();
            let event = self.side.handle(&buffer[..bytes], from, false);
            assert!(matches!(event, FlightEvent::NewFlight(_) | FlightEvent::Next(_)), "{event:?}");
            let answer = self.side.answer(&Actuators::default(), None, false).unwrap();
            for _ in 0..copies {
                self.socket.send_to(answer, from).unwrap();
            }
        }
    }

    fn begin(link: &mut Link, tick: u64) {
        let mut values = [0.0; Sensors::COUNT];
        // The attitude must be a unit quaternion.
        values[6] = 1.0;
        let time = SimTime::from_micros(2_000 * tick);
        let sensors = Sensors::at(time, &values);
        link.begin_exchange(
            time,
            Phase::Flying,
            ControlPeriod::DEFAULT,
            &sensors,
            Reports::new(),
            &[],
        );
    }

    #[test]
    fn an_answer_that_comes_twice_asks_for_nothing() {
        let anywhere = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let open = |address| LinkSocket::listen("test", "link", address, Wait::Block, RESEND_AFTER);
        let mut peer =
            Peer { socket: open(anywhere).unwrap(), side: FlightSide::new(tvc_jet::aircraft()) };
        let address = peer.socket.local_address().unwrap();
        let socket = LinkSocket::connect("test", "link", address, Wait::Block, RESEND_AFTER);
        let mut link = Link::new(socket.unwrap(), tvc_jet::aircraft(), Stop::new(), None).unwrap();
        begin(&mut link, 0);
        peer.answer(2);
        assert_eq!(link.answer().unwrap().unwrap().sequence, 0);
        begin(&mut link, 1);
        peer.answer(1);
        // Receives the second copy of the first answer before its own.
        assert_eq!(link.answer().unwrap().unwrap().sequence, 1);
        let more = peer.socket.receive_from(&mut [0; PACKET_MAX]).unwrap();
        assert_eq!(more, None, "a late answer made the plant send again");
    }
}
