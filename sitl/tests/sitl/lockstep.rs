//! A bad link costs time and changes nothing: plant and autopilot over a network in virtual time.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};

use autopilot::autopilot::Autopilot;
use autopilot::command::{Command, Intent, Outcome};
use autopilot::event::EventKind;
use autopilot::run::AutopilotArgs;
use clap::Args;
use icd::fault::{PlantAction, PlantReport, Timing, Travel};
use icd::lockstep::{FlightEvent, FlightSide, PlantEvent, PlantSide};
use icd::tvc_jet;
use icd::wire::{Phase, Reports};
use icd::{FaultKind, FaultReply, FaultRequest, Sensors, SimTime};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{FlightSetup, Record, fly};
use plant_sim::Plant;
use plant_sim::io::PlantArgs;
use proptest::prelude::*;

/// An unanswered question is sent again after this, us.
const RESEND_US: u64 = 20_000;
/// A packet without trouble needs this, us.
const TRANSIT_US: u64 = 100;
/// A late packet needs this: it was asked for twice more in the meantime, us.
const LATE_US: u64 = 45_000;
/// Where the plant's packets come from.
const PLANT: SocketAddr = SocketAddr::V4(SocketAddrV4::new(Ipv4Addr::LOCALHOST, 1));
/// The operator breaks something at this tick.
const BREAK_AT: SimTime = SimTime::from_micros(1_500_000);

/// What happens to a packet on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    Arrives,
    Lost,
    Twice,
    Late,
    /// At once, and again long after.
    Echoed,
}

/// Case 2 of the paper for three seconds, with noise and gusts so that every tick differs.
fn setup() -> FlightSetup {
    let plant: PlantArgs =
        parse(&["plant-sim", "--scenario=case2", "--gyro-noise-deg-s=0.1", "--turbulence-m-s=1.5"]);
    let autopilot: AutopilotArgs = parse(&["autopilot", "--scenario=case2"]);
    let (control, parameters) = autopilot.control_setup().unwrap();
    FlightSetup {
        plant: plant.plant_setup().unwrap(),
        model: control.model,
        parameters,
        references: control.references,
        script: control.script,
        duration: SimTime::from_micros(3_000_000),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

fn parse<T: Args>(words: &[&str]) -> T {
    let matches = T::augment_args(clap::Command::new("test")).get_matches_from(words);
    T::from_arg_matches(&matches).unwrap()
}

/// One direction of the network: packets by their time of arrival.
struct Wire {
    fates: Vec<Fate>,
    sent: usize,
    under_way: BTreeMap<(u64, usize), Vec<u8>>,
}

impl Wire {
    fn new(fates: &[Fate]) -> Self {
        Self { fates: fates.to_vec(), sent: 0, under_way: BTreeMap::new() }
    }

    fn send(&mut self, now_us: u64, packet: &[u8]) {
        let arrivals: &[u64] = match self.fates[self.sent % self.fates.len()] {
            Fate::Arrives => &[TRANSIT_US],
            Fate::Lost => &[],
            Fate::Twice => &[TRANSIT_US, TRANSIT_US + 50],
            Fate::Late => &[LATE_US],
            Fate::Echoed => &[TRANSIT_US, LATE_US],
        };
        for (copy, transit_us) in arrivals.iter().enumerate() {
            let key = (now_us + transit_us, 2 * self.sent + copy);
            self.under_way.insert(key, packet.to_vec());
        }
        self.sent += 1;
    }

    fn next_arrival(&self) -> u64 {
        self.under_way.first_key_value().map_or(u64::MAX, |(key, _)| key.0)
    }

    fn receive(&mut self) -> Option<Vec<u8>> {
        self.under_way.pop_first().map(|(_, packet)| packet)
    }
}

/// What came of a flight.
struct Flown {
    bytes: Vec<u8>,
    outcomes: Vec<(u32, Outcome)>,
    virtual_us: u64,
}

/// Both ends and the network between them.
struct Loop {
    plant: Plant,
    plant_side: PlantSide,
    autopilot: Autopilot,
    flight_side: FlightSide,
    questions: Wire,
    answers: Wire,
    reply: Option<PlantReport>,
    request: Option<FaultRequest>,
    /// The request is sent in a packet of this phase.
    request_while: Phase,
    /// For one tick after the other, over and over: exchanges in which time stands still.
    pauses: Vec<u32>,
    /// Of these, those that are still to come in this tick.
    standing: u32,
    tick: usize,
    sensors: Sensors,
    setup: FlightSetup,
    bytes: Vec<u8>,
}

impl Loop {
    fn ask(&mut self, now_us: u64, phase: Phase) {
        let mut reports = Reports::new();
        reports.extend(self.reply.take());
        while !reports.is_full()
            && let Some(report) = self.plant.pop_report()
        {
            reports.push(report);
        }
        let (time, period) = (self.plant.time(), self.setup.plant.period);
        let packet =
            self.plant_side.begin_exchange(time, phase, period, &self.sensors, reports, &[]);
        self.questions.send(now_us, packet);
    }

    /// The autopilot takes a packet.
    fn take_question(&mut self, now_us: u64, packet: &[u8]) {
        let packet = match self.flight_side.handle(packet, PLANT, false) {
            FlightEvent::NewFlight(packet) => {
                self.autopilot.begin_flight(packet.period, packet.time, packet.sequence > 0);
                packet
            }
            FlightEvent::Next(packet) => packet,
            FlightEvent::Repeat(answer) => return self.answers.send(now_us, answer),
            FlightEvent::Ignored(_) => return,
            other => panic!("{other:?}"),
        };
        for report in &packet.reports {
            self.autopilot.handle_report(report);
        }
        let now = packet.time == BREAK_AT && packet.phase == self.request_while;
        if let Some(fault) = self.request.take_if(|_| now) {
            self.autopilot.handle_intent(Intent {
                number: 7,
                command: Command::Plant(PlantAction::Fault(fault)),
            });
        }
        let actuators = if packet.phase == Phase::Flying {
            let actuators = self.autopilot.step(packet.time, &packet.sensors).actuators();
            let log = self.autopilot.snapshot().unwrap().log;
            let record = Record { truth: *self.plant.truth(), log };
            self.bytes.extend(postcard::to_stdvec(&record).unwrap());
            actuators
        } else {
            self.autopilot.hold(&packet.sensors, false)
        };
        let request = self.autopilot.next_request();
        let answer = self.flight_side.answer(&actuators, request, false).unwrap();
        self.answers.send(now_us, answer);
    }

    /// The plant takes a packet; true if that was the answer to the last question of the flight.
    fn take_answer(&mut self, now_us: u64, packet: &[u8]) -> bool {
        let answer = match self.plant_side.handle(packet) {
            PlantEvent::Answer(answer) => answer,
            PlantEvent::Ignored(_) => return false,
            other => panic!("{other:?}"),
        };
        if let Some(request) = answer.request {
            let PlantAction::Fault(fault) = request.action else { panic!("{request:?}") };
            let reply = self.plant.request(&fault);
            self.reply = Some(PlantReport::FaultReply { request: request.number, reply });
        }
        if self.plant.time() + self.setup.plant.period > self.setup.duration {
            return true;
        }
        if self.standing > 0 {
            self.standing -= 1;
            self.ask(now_us, Phase::Holding);
            return false;
        }
        self.plant.advance(&answer.actuators);
        self.sensors = self.plant.sense();
        self.tick += 1;
        self.standing = self.pauses[self.tick % self.pauses.len()];
        self.ask(now_us, Phase::Flying);
        false
    }
}

/// Flies over a network that does to packets what `fates` say, over and over.
fn fly_over(questions: &[Fate], answers: &[Fate], request: Option<FaultRequest>) -> Flown {
    fly_with_pauses(questions, answers, request, &[0])
}

/// The same, and time stands still for so many exchanges in one tick after the other, over and over. If there
/// are pauses, the request is sent in one.
fn fly_with_pauses(
    questions: &[Fate],
    answers: &[Fate],
    request: Option<FaultRequest>,
    pauses: &[u32],
) -> Flown {
    let setup = setup();
    let mut plant = Plant::new(&setup.plant).unwrap();
    let sensors = plant.sense();
    let mut flight = Loop {
        plant,
        plant_side: PlantSide::new(1, tvc_jet::aircraft()),
        autopilot: Autopilot::new(&setup.settings()),
        flight_side: FlightSide::new(tvc_jet::aircraft()),
        questions: Wire::new(questions),
        answers: Wire::new(answers),
        reply: None,
        request,
        request_while: if pauses == [0] { Phase::Flying } else { Phase::Holding },
        pauses: pauses.to_vec(),
        standing: pauses[0],
        tick: 0,
        sensors,
        setup,
        bytes: Vec::new(),
    };
    let mut outcomes = Vec::new();
    let mut now_us = 0;
    let mut sent = (0, 0);
    flight.ask(now_us, Phase::Flying);
    loop {
        let asked = flight.plant_side.unanswered().map(<[u8]>::to_vec).unwrap();
        if flight.questions.sent != sent.1 {
            sent = (now_us, flight.questions.sent);
        }
        let (there, back) = (flight.questions.next_arrival(), flight.answers.next_arrival());
        now_us = there.min(back).min(sent.0 + RESEND_US);
        if there == now_us {
            let packet = flight.questions.receive().unwrap();
            flight.take_question(now_us, &packet);
        } else if back == now_us {
            let packet = flight.answers.receive().unwrap();
            if flight.take_answer(now_us, &packet) {
                break;
            }
        } else {
            flight.questions.send(now_us, &asked);
        }
        while let Some(event) = flight.autopilot.pop_event() {
            if let EventKind::Outcome { number, outcome } = event.kind {
                outcomes.push((number, outcome));
            }
        }
    }
    Flown { bytes: flight.bytes, outcomes, virtual_us: now_us }
}

fn broken_elevator() -> FaultRequest {
    let kind = FaultKind::StuckAt { angle_rad: 0.1, travel: Travel::Jump };
    FaultRequest::Inject { target: tvc_jet::LEFT_ELEVATOR.into(), kind, timing: Timing::NOW }
}

#[test]
fn a_good_link_gives_the_bytes_of_the_loop_without_link() {
    let mut bytes = Vec::new();
    fly(&setup(), &mut |record| bytes.extend(postcard::to_stdvec(record).unwrap())).unwrap();
    let linked = fly_over(&[Fate::Arrives], &[Fate::Arrives], None);
    assert!(
        bytes == linked.bytes,
        "{} bytes without link, {} with",
        bytes.len(),
        linked.bytes.len()
    );
}

#[test]
fn every_kth_packet_in_trouble_changes_time_and_nothing_else() {
    let good = fly_over(&[Fate::Arrives], &[Fate::Arrives], None);
    for k in [2, 3, 7] {
        for trouble in [Fate::Lost, Fate::Twice, Fate::Late, Fate::Echoed] {
            let mut fates = vec![Fate::Arrives; k];
            fates[k - 1] = trouble;
            for (there, back) in [(true, false), (false, true), (true, true)] {
                let clean = [Fate::Arrives];
                let questions = if there { &fates[..] } else { &clean };
                let answers = if back { &fates[..] } else { &clean };
                let bad = fly_over(questions, answers, None);
                assert!(
                    bad.bytes == good.bytes,
                    "{trouble:?}, every {k}, there {there}, back {back}"
                );
                if matches!(trouble, Fate::Lost | Fate::Late) {
                    assert!(bad.virtual_us > good.virtual_us, "{trouble:?} was no trouble");
                }
            }
        }
    }
}

#[test]
fn pauses_change_nothing_on_a_good_link_and_on_a_bad_one() {
    let good = fly_over(&[Fate::Arrives], &[Fate::Arrives], None);
    let bad = [Fate::Arrives, Fate::Late, Fate::Twice, Fate::Lost, Fate::Echoed];
    for fates in [&[Fate::Arrives], &bad[..]] {
        for pauses in [&[1][..], &[0, 0, 5], &[40, 0, 0, 0, 0, 0, 0]] {
            let paused = fly_with_pauses(fates, fates, None, pauses);
            assert!(paused.bytes == good.bytes, "{fates:?}, {pauses:?}");
        }
    }
}

#[test]
fn a_fault_asked_for_in_a_pause_acts_at_the_tick_where_time_stands() {
    let good = fly_over(&[Fate::Arrives], &[Fate::Arrives], Some(broken_elevator()));
    let clean = [Fate::Arrives];
    let paused = fly_with_pauses(&clean, &clean, Some(broken_elevator()), &[3]);
    let applied = Outcome::Plant(FaultReply::Applied { at: BREAK_AT });
    assert_eq!(paused.outcomes, [(7, applied)]);
    assert!(paused.bytes == good.bytes, "{} bytes", paused.bytes.len());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_fault_asked_for_over_any_link_acts_once_at_the_same_tick(
        mut questions in prop::collection::vec(fate(), 1..20),
        mut answers in prop::collection::vec(fate(), 1..20),
    ) {
        // Something must get through now and then.
        questions.push(Fate::Arrives);
        answers.push(Fate::Arrives);
        let good = fly_over(&[Fate::Arrives], &[Fate::Arrives], Some(broken_elevator()));
        let bad = fly_over(&questions, &answers, Some(broken_elevator()));
        let applied = Outcome::Plant(FaultReply::Applied { at: BREAK_AT });
        prop_assert_eq!(&good.outcomes, &vec![(7, applied)]);
        prop_assert_eq!(&bad.outcomes, &good.outcomes);
        prop_assert!(bad.bytes == good.bytes);
    }
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        Just(Fate::Arrives),
        Just(Fate::Lost),
        Just(Fate::Twice),
        Just(Fate::Late),
        Just(Fate::Echoed)
    ]
}
