//! Lockstep of the plant link: which side waits for the other.
//!
//! The plant sends a sensor packet and waits; the autopilot answers each packet exactly once, and only the answer lets
//! the plant continue. The plant repeats a lost packet byte for byte; the autopilot answers a duplicate from memory,
//! byte for byte; both ignore late packets. So a flight is the same on a lossy link as on a perfect one, and only its
//! wall-clock time differs.
//!
//! Neither side has a socket or a clock here: datagrams are arguments and return values, and the caller decides when a
//! packet counts as lost.
//!
//! A flight is identified by a session, a random number that cannot be guessed, and by the address of its plant. As long
//! as that plant has its place, the autopilot refuses packets from another address before it looks at their session, so
//! its answer does not reveal whether the sender guessed the session. The caller decides when a plant has lost its place;
//! then the autopilot flies the next plant that sends, even one that it flew earlier. The plant's socket receives only
//! from the address of its autopilot.

use core::net::SocketAddr;

use arrayvec::ArrayVec;

use crate::effector_list::Actuators;
use crate::fault::PlantRequest;
use crate::sensors::Sensors;
use crate::time::{ControlPeriod, SimTime};
use crate::wire::{
    self, ActuatorPacket, Aircraft, Packet, PacketBytes, Phase, RefusalPacket, RefusalReason,
    Reports, SensorPacket, WireError,
};

/// Number of earlier sessions of the same plant that the autopilot remembers, so that a late packet of one starts no flight.
const RETIRED_MAX: usize = 8;

/// Why a side ignored a datagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ignored {
    /// It belongs to a finished exchange or to another flight.
    Late,
    /// It comes from another address than the flight's plant.
    Foreign,
    /// It is meant for the other side.
    WrongWay,
    /// It is not a packet of this link.
    Unreadable(WireError),
}

/// The plant's side: it sends sensor packets and waits for answers.
#[derive(Debug, Clone, Default)]
pub struct PlantSide {
    aircraft: Aircraft,
    session: u64,
    sequence: u64,
    question: PacketBytes,
    scratch: PacketBytes,
    waiting: bool,
}

/// Result of a datagram on the plant's side.
#[derive(Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "short-lived and on the stack: the link may not allocate"
)]
pub enum PlantEvent<'a> {
    /// The answer: the plant continues.
    Answer(ActuatorPacket),
    /// The autopilot refuses this plant.
    Refused(RefusalPacket),
    /// The answer is unusable: send these bytes back and report it to the operator.
    Refuse(&'a [u8], Refused),
    /// The datagram changes nothing.
    Ignored(Ignored),
}

impl PlantSide {
    /// A new flight of this aircraft. `session` must differ from those of earlier flights, and must not be guessable.
    pub fn new(session: u64, aircraft: Aircraft) -> Self {
        Self { aircraft, session, ..Self::default() }
    }

    /// The session of the flight.
    pub fn session(&self) -> u64 {
        self.session
    }

    /// Begins the next exchange and returns the packet to send; `envelope` is for the recorder.
    pub fn begin_exchange(
        &mut self,
        time: SimTime,
        phase: Phase,
        period: ControlPeriod,
        sensors: &Sensors,
        reports: Reports,
        envelope: &[u8],
    ) -> &[u8] {
        debug_assert!(!self.waiting, "the last question is not answered yet");
        let packet = SensorPacket {
            session: self.session,
            sequence: self.sequence,
            aircraft: self.aircraft,
            time,
            phase,
            period,
            sensors: *sensors,
            reports,
        };
        // Kept, because a lost question is repeated byte for byte.
        wire::encode_sensors(&packet, envelope, &mut self.question);
        self.waiting = true;
        &self.question
    }

    /// The packet to send again while no answer has arrived; `None` when no exchange is open.
    pub fn unanswered(&self) -> Option<&[u8]> {
        self.waiting.then_some(self.question.as_slice())
    }

    /// Handles one datagram.
    pub fn handle(&mut self, datagram: &[u8]) -> PlantEvent<'_> {
        match wire::decode(datagram) {
            Ok(Packet::Actuators(packet)) => {
                if packet.aircraft != self.aircraft {
                    let why = Refused::Aircraft(packet.aircraft);
                    let about = (packet.session, packet.sequence, RefusalReason::Aircraft);
                    return PlantEvent::Refuse(refusal(about, &mut self.scratch), why);
                }
                if self.waiting
                    && packet.session == self.session
                    && packet.sequence == self.sequence
                {
                    self.waiting = false;
                    self.sequence += 1;
                    PlantEvent::Answer(packet)
                } else {
                    PlantEvent::Ignored(Ignored::Late)
                }
            }
            Ok(Packet::Refusal(refusal)) => {
                let ours = refusal.session == self.session && refusal.sequence == self.sequence;
                if self.waiting && ours {
                    PlantEvent::Refused(refusal)
                } else {
                    PlantEvent::Ignored(Ignored::Late)
                }
            }
            Ok(Packet::Sensors(_)) => PlantEvent::Ignored(Ignored::WrongWay),
            Err(error) => match refusal_of(&error, &mut self.scratch) {
                Some(bytes) => PlantEvent::Refuse(bytes, Refused::Packet(error)),
                None => PlantEvent::Ignored(Ignored::Unreadable(error)),
            },
        }
    }
}

/// The autopilot's side: it answers sensor packets.
#[derive(Debug, Clone, Default)]
pub struct FlightSide {
    aircraft: Aircraft,
    current: Option<PacketExchange>,
    retired: ArrayVec<u64, RETIRED_MAX>,
    answer: PacketBytes,
    scratch: PacketBytes,
}

#[derive(Debug, Clone, Copy)]
struct PacketExchange {
    plant: SocketAddr,
    session: u64,
    sequence: u64,
    time: SimTime,
    answered: bool,
    /// It is not the first exchange with this plant.
    under_way: bool,
}

/// Result of a datagram on the autopilot's side.
#[derive(Debug, PartialEq)]
pub enum FlightEvent<'a> {
    /// The first packet of a flight that this autopilot receives; call [`FlightSide::answer`].
    ///
    /// Its sequence number is 0 for a flight that begins, larger when the autopilot joined later.
    NewFlight(SensorPacket),
    /// The next packet of the flight; call [`FlightSide::answer`].
    Next(SensorPacket),
    /// A packet that this side has answered before: send these bytes again.
    Repeat(&'a [u8]),
    /// A packet that this side refuses: send these bytes back and report it to the operator.
    Refuse(&'a [u8], Refused),
    /// The plant refuses this autopilot.
    Refused(RefusalPacket),
    /// The datagram changes nothing.
    Ignored(Ignored),
}

/// Why a side sends a refusal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refused {
    /// The packet is unusable.
    Packet(WireError),
    /// The packet comes from another address than that of the present plant.
    Busy,
    /// The packet is about this aircraft, which is not the one of this side.
    Aircraft(Aircraft),
}

impl core::fmt::Display for Refused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Packet(error) => error.fmt(f),
            Self::Busy => f.write_str("another plant is in flight"),
            Self::Aircraft(theirs) => write!(f, "it is about another aircraft, {theirs}"),
        }
    }
}

impl FlightSide {
    /// A side that waits for any plant of this aircraft.
    pub fn new(aircraft: Aircraft) -> Self {
        Self { aircraft, ..Self::default() }
    }

    /// The aircraft that it flies.
    pub fn aircraft(&self) -> Aircraft {
        self.aircraft
    }

    /// Whether the present plant has taken an answer: it has sent the next packet since.
    pub fn is_under_way(&self) -> bool {
        self.current.is_some_and(|exchange| exchange.under_way)
    }

    /// The answer to the last packet of the present plant, and the address of that plant.
    pub fn last_answer(&self) -> Option<(&[u8], SocketAddr)> {
        let current = self.current.filter(|current| current.answered)?;
        Some((&self.answer, current.plant))
    }

    /// Address of the present plant; `None` before the first flight.
    pub fn plant(&self) -> Option<SocketAddr> {
        self.current.map(|exchange| exchange.plant)
    }

    /// Handles one datagram from the address `from`. The caller passes whether the present plant has lost its place to
    /// another one; for packets of that plant it does not matter.
    pub fn handle(&mut self, datagram: &[u8], from: SocketAddr, is_free: bool) -> FlightEvent<'_> {
        let packet = match wire::decode(datagram) {
            Ok(Packet::Sensors(packet)) => packet,
            // Anybody else could end a flight with a forged refusal.
            Ok(Packet::Refusal(refusal)) if self.plant().is_none_or(|plant| plant == from) => {
                return FlightEvent::Refused(refusal);
            }
            Ok(Packet::Refusal(_)) => return FlightEvent::Ignored(Ignored::Foreign),
            Ok(Packet::Actuators(_)) => return FlightEvent::Ignored(Ignored::WrongWay),
            Err(error) => {
                return match refusal_of(&error, &mut self.scratch) {
                    Some(bytes) => FlightEvent::Refuse(bytes, Refused::Packet(error)),
                    None => FlightEvent::Ignored(Ignored::Unreadable(error)),
                };
            }
        };
        match self.current {
            Some(current) if current.plant == from && packet.aircraft != self.aircraft => {
                self.other_aircraft(&packet)
            }
            Some(current) if current.plant == from => self.same_plant(current, packet),
            Some(_) if !is_free => {
                let about = (packet.session, packet.sequence, RefusalReason::Busy);
                FlightEvent::Refuse(refusal(about, &mut self.scratch), Refused::Busy)
            }
            _ if packet.aircraft != self.aircraft => self.other_aircraft(&packet),
            _ => {
                // They are sessions of another plant.
                self.retired.clear();
                self.open(&packet, from, false);
                FlightEvent::NewFlight(packet)
            }
        }
    }

    fn other_aircraft(&mut self, packet: &SensorPacket) -> FlightEvent<'_> {
        let about = (packet.session, packet.sequence, RefusalReason::Aircraft);
        FlightEvent::Refuse(refusal(about, &mut self.scratch), Refused::Aircraft(packet.aircraft))
    }

    fn same_plant(&mut self, current: PacketExchange, packet: SensorPacket) -> FlightEvent<'_> {
        if packet.session != current.session {
            if self.retired.contains(&packet.session) {
                return FlightEvent::Ignored(Ignored::Late);
            }
            // The oldest is the one whose packets can no longer be on their way.
            if self.retired.is_full() {
                self.retired.remove(0);
            }
            self.retired.push(current.session);
            self.open(&packet, current.plant, false);
            FlightEvent::NewFlight(packet)
        // A plant goes on only after an answer, so a higher number before one is no next packet.
        } else if packet.sequence == current.sequence.saturating_add(1) && current.answered {
            self.open(&packet, current.plant, true);
            FlightEvent::Next(packet)
        } else if packet.sequence == current.sequence && current.answered {
            FlightEvent::Repeat(&self.answer)
        } else {
            FlightEvent::Ignored(Ignored::Late)
        }
    }

    fn open(&mut self, packet: &SensorPacket, plant: SocketAddr, under_way: bool) {
        self.current = Some(PacketExchange {
            plant,
            session: packet.session,
            sequence: packet.sequence,
            time: packet.time,
            answered: false,
            under_way,
        });
    }

    /// Answers the packet that [`FlightSide::handle`] returned last, and returns the bytes to send.
    ///
    /// `None` if there is no packet to answer.
    pub fn answer(
        &mut self,
        actuators: &Actuators,
        request: Option<PlantRequest>,
        wants_envelope: bool,
    ) -> Option<&[u8]> {
        let current = self.current.as_mut().filter(|current| !current.answered)?;
        current.answered = true;
        let packet = ActuatorPacket {
            session: current.session,
            sequence: current.sequence,
            aircraft: self.aircraft,
            time: current.time,
            actuators: *actuators,
            request,
            wants_envelope,
        };
        wire::encode_actuators(&packet, &mut self.answer);
        Some(&self.answer)
    }
}

/// The refusal for an error that the sender should know about; `None` for errors that get no answer.
fn refusal_of<'a>(error: &WireError, out: &'a mut PacketBytes) -> Option<&'a [u8]> {
    let about = match *error {
        WireError::Version { session, sequence, .. } => (session, sequence, RefusalReason::Version),
        WireError::Value { session, sequence, .. } => (session, sequence, RefusalReason::Value),
        // The others carry no session and number that an answer could name.
        _ => return None,
    };
    Some(refusal(about, out))
}

fn refusal((session, sequence, reason): (u64, u64, RefusalReason), out: &mut PacketBytes) -> &[u8] {
    wire::encode_refusal(&RefusalPacket { version: wire::VERSION, session, sequence, reason }, out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Attitude, Body, Ned};
    use crate::tvc_jet::aircraft;
    use core::net::Ipv4Addr;
    use std::vec::Vec;

    /// Two plants at two addresses.
    const HERE: SocketAddr = SocketAddr::V4(core::net::SocketAddrV4::new(Ipv4Addr::LOCALHOST, 1));
    const THERE: SocketAddr = SocketAddr::V4(core::net::SocketAddrV4::new(Ipv4Addr::LOCALHOST, 2));

    fn sensors() -> Sensors {
        let mut values = [0.0; Sensors::COUNT];
        values[6] = 1.0;
        let _ = (Attitude::identity(), Body::zero(), Ned::zero());
        Sensors::at(SimTime::ZERO, &values)
    }

    fn begin(plant: &mut PlantSide, tick: u64) -> Vec<u8> {
        let time = SimTime::from_micros(tick * 2_000);
        plant
            .begin_exchange(
                time,
                Phase::Flying,
                ControlPeriod::DEFAULT,
                &sensors(),
                Reports::new(),
                &[],
            )
            .to_vec()
    }

    fn answer(flight: &mut FlightSide) -> Vec<u8> {
        flight.answer(&Actuators::default(), None, false).map(<[u8]>::to_vec).unwrap()
    }

    #[test]
    fn each_question_is_answered_once_and_repeats_come_from_memory() {
        let (mut plant, mut flight) = (PlantSide::new(1, aircraft()), FlightSide::new(aircraft()));
        let question = begin(&mut plant, 0);
        assert!(matches!(flight.handle(&question, HERE, false), FlightEvent::NewFlight(_)));
        let first = answer(&mut flight);
        assert_eq!(
            flight.answer(&Actuators::default(), None, false),
            None,
            "one answer a question"
        );
        assert_eq!(flight.handle(&question, HERE, false), FlightEvent::Repeat(&first));
        assert!(matches!(plant.handle(&first), PlantEvent::Answer(_)));
        assert_eq!(plant.handle(&first), PlantEvent::Ignored(Ignored::Late));
        let second = begin(&mut plant, 1);
        assert!(matches!(flight.handle(&second, HERE, false), FlightEvent::Next(_)));
        assert_eq!(flight.handle(&question, HERE, false), FlightEvent::Ignored(Ignored::Late));
    }

    #[test]
    fn an_autopilot_that_comes_later_joins_the_flight() {
        let mut plant = PlantSide::new(1, aircraft());
        let mut first = FlightSide::new(aircraft());
        let question = begin(&mut plant, 0);
        first.handle(&question, HERE, false);
        let reply = answer(&mut first);
        plant.handle(&reply);
        let question = begin(&mut plant, 1);
        let mut second = FlightSide::new(aircraft());
        match second.handle(&question, HERE, false) {
            FlightEvent::NewFlight(packet) => assert_eq!(packet.sequence, 1),
            other => panic!("{other:?}"),
        }
        let reply = answer(&mut second);
        assert!(matches!(plant.handle(&reply), PlantEvent::Answer(_)));
    }

    #[test]
    fn a_late_packet_of_an_ended_flight_starts_nothing() {
        let mut flight = FlightSide::new(aircraft());
        let old = begin(&mut PlantSide::new(1, aircraft()), 0);
        let new = begin(&mut PlantSide::new(2, aircraft()), 0);
        flight.handle(&old, HERE, false);
        answer(&mut flight);
        assert!(matches!(flight.handle(&new, HERE, false), FlightEvent::NewFlight(_)));
        answer(&mut flight);
        assert_eq!(flight.handle(&old, HERE, false), FlightEvent::Ignored(Ignored::Late));
        assert!(matches!(flight.handle(&new, HERE, false), FlightEvent::Repeat(_)));
    }

    #[test]
    fn a_second_plant_is_turned_away_while_the_first_is_alive() {
        let mut flight = FlightSide::new(aircraft());
        flight.handle(&begin(&mut PlantSide::new(1, aircraft()), 0), HERE, false);
        answer(&mut flight);
        let mut intruder = PlantSide::new(2, aircraft());
        let question = begin(&mut intruder, 0);
        let refusal = match flight.handle(&question, THERE, false) {
            FlightEvent::Refuse(bytes, Refused::Busy) => bytes.to_vec(),
            other => panic!("{other:?}"),
        };
        match intruder.handle(&refusal) {
            PlantEvent::Refused(RefusalPacket { reason: RefusalReason::Busy, .. }) => {}
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_unknown_plant_gets_one_answer_with_and_without_the_right_session() {
        let mut flight = FlightSide::new(aircraft());
        let mut plant = PlantSide::new(1, aircraft());
        for tick in 0..3 {
            let question = begin(&mut plant, tick);
            flight.handle(&question, HERE, false);
            plant.handle(&answer(&mut flight));
        }
        let next = begin(&mut plant, 3);
        // The session with every sequence number around the present one, and a wrong session.
        for (session, sequence) in [(1, 0), (1, 1), (1, 2), (1, 3), (1, 4), (7, 0), (7, 3)] {
            let mut unknown = PlantSide::new(session, aircraft());
            unknown.sequence = sequence;
            let question = begin(&mut unknown, 3);
            match flight.handle(&question, THERE, false) {
                FlightEvent::Refuse(bytes, Refused::Busy) => {
                    let refusal = Packet::Refusal(RefusalPacket {
                        version: wire::VERSION,
                        session,
                        sequence,
                        reason: RefusalReason::Busy,
                    });
                    assert_eq!(wire::decode(bytes), Ok(refusal));
                }
                other => panic!("session {session}, sequence {sequence}: {other:?}"),
            }
            assert_eq!(flight.answer(&Actuators::default(), None, false), None);
        }
        let refusal = {
            let mut bytes = PacketBytes::new();
            let reason = RefusalReason::Version;
            wire::encode_refusal(
                &RefusalPacket { version: 1, session: 1, sequence: 3, reason },
                &mut bytes,
            );
            bytes
        };
        let foreign = FlightEvent::Ignored(Ignored::Foreign);
        assert_eq!(flight.handle(&refusal, THERE, false), foreign);
        assert!(matches!(flight.handle(&refusal, HERE, false), FlightEvent::Refused(_)));
        assert!(matches!(flight.handle(&next, HERE, false), FlightEvent::Next(_)));
    }

    #[test]
    fn a_superseded_plant_is_taken_back_when_the_other_one_is_silent() {
        let mut flight = FlightSide::new(aircraft());
        let (mut first, mut second) =
            (PlantSide::new(1, aircraft()), PlantSide::new(2, aircraft()));
        flight.handle(&begin(&mut first, 0), HERE, false);
        first.handle(&answer(&mut flight));
        let pending = begin(&mut first, 1);
        let event = flight.handle(&begin(&mut second, 0), THERE, true);
        assert!(matches!(event, FlightEvent::NewFlight(_)), "the first one was silent: {event:?}");
        second.handle(&answer(&mut flight));
        let event = flight.handle(&pending, HERE, false);
        assert!(matches!(event, FlightEvent::Refuse(_, Refused::Busy)), "{event:?}");
        match flight.handle(&pending, HERE, true) {
            FlightEvent::NewFlight(packet) => assert_eq!((packet.session, packet.sequence), (1, 1)),
            other => panic!("{other:?}"),
        }
        assert!(matches!(first.handle(&answer(&mut flight)), PlantEvent::Answer(_)));
        assert_eq!(flight.plant(), Some(HERE));
        // A plant that was silent for long and still has the flight continues as if it had never been silent.
        let event = flight.handle(&begin(&mut first, 2), HERE, true);
        assert!(matches!(event, FlightEvent::Next(_)), "{event:?}");
    }

    #[test]
    fn another_version_is_refused_on_both_sides() {
        let mut plant = PlantSide::new(1, aircraft());
        let mut question = begin(&mut plant, 0);
        question[4] = 77;
        let mut flight = FlightSide::new(aircraft());
        let refusal = match flight.handle(&question, HERE, false) {
            FlightEvent::Refuse(bytes, Refused::Packet(WireError::Version { theirs: 77, .. })) => {
                bytes.to_vec()
            }
            other => panic!("{other:?}"),
        };
        match plant.handle(&refusal) {
            PlantEvent::Refused(RefusalPacket { version: wire::VERSION, .. }) => {}
            other => panic!("{other:?}"),
        }
        assert_eq!(flight.plant(), None);
    }

    #[test]
    fn a_plant_with_another_aircraft_is_refused_and_learns_why() {
        let other = Aircraft { effectors: 7, ..aircraft() };
        let (mut plant, mut flight) = (PlantSide::new(1, other), FlightSide::new(aircraft()));
        let refusal = match flight.handle(&begin(&mut plant, 0), HERE, false) {
            FlightEvent::Refuse(bytes, Refused::Aircraft(theirs)) => {
                assert_eq!(theirs, other);
                bytes.to_vec()
            }
            event => panic!("{event:?}"),
        };
        assert_eq!(flight.plant(), None, "it is not flown");
        match plant.handle(&refusal) {
            PlantEvent::Refused(RefusalPacket { reason: RefusalReason::Aircraft, .. }) => {}
            event => panic!("{event:?}"),
        }
        // An answer with another number of commands moves no effector.
        flight.handle(&begin(&mut PlantSide::new(1, aircraft()), 0), HERE, true);
        let foreign = answer(&mut flight);
        match plant.handle(&foreign) {
            PlantEvent::Refuse(_, Refused::Aircraft(theirs)) => assert_eq!(theirs, aircraft()),
            event => panic!("{event:?}"),
        }
        assert!(plant.unanswered().is_some());
    }
}
