//! A slow control side, and its own reports.

use core::time::Duration;
use flight_management::command::VehicleCommand;

use super::client::*;
use crate::tests::world::*;
use ::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_COUNT_DATA, MISSION_CURRENT_DATA, MISSION_ITEM_INT_DATA,
    MISSION_ITEM_REACHED_DATA, MISSION_REQUEST_LIST_DATA, MavMessage, MavMissionResult as R,
};
use flight_management::command::{Command, Intent, Outcome};
use flight_management::event::{Event, EventKind};
use flight_management::vehicle::VehicleEvent;

/// A ground side whose intents are not answered.
struct Slow(World);

impl Slow {
    fn send(&mut self, message: &MavMessage) {
        let bytes = self.0.encode(STATION, message);
        self.0.ground.handle_datagram(address(14_550), &bytes, self.0.now);
    }

    fn upload(&mut self, items: &[MISSION_ITEM_INT_DATA]) {
        self.send(&count(items.len()));
        for item in items {
            self.send(&MavMessage::MISSION_ITEM_INT(item.clone()));
        }
    }

    fn wait_s(&mut self, seconds: u64) {
        self.0.now = self.0.now + Duration::from_secs(seconds);
        self.0.ground.poll(self.0.now);
    }

    fn intents(&mut self) -> Vec<Intent> {
        std::iter::from_fn(|| self.0.ground.pop_intent()).collect()
    }

    fn answer(&mut self, number: u32, outcome: Outcome) {
        let kind = EventKind::Outcome { number, outcome };
        self.0.ground.handle_event(&Event { time: self.0.sim, kind }, self.0.now);
    }

    /// Results since the last call.
    fn results(&mut self) -> Vec<R> {
        let frames: Vec<_> = std::iter::from_fn(|| self.0.ground.pop_frame(|_| true)).collect();
        let frames = frames.iter().filter(|(to, _)| *to == address(14_550));
        let acks = frames.filter(|(_, frame)| frame[7..10] == [47, 0, 0]);
        acks.map(|(_, frame)| {
            let payload = frame[10..frame.len() - 2].to_vec();
            let got = Got {
                to: address(14_550),
                id: 47,
                payload,
                sequence: 0,
                at: self.0.now,
                bytes: Vec::new(),
            };
            got.read::<MISSION_ACK_DATA>().unwrap().mavtype
        })
        .collect()
    }

    fn items(&mut self) -> u16 {
        self.results();
        let list = MISSION_REQUEST_LIST_DATA {
            target_system: 1,
            target_component: 1,
            ..Default::default()
        };
        self.send(&MavMessage::MISSION_REQUEST_LIST(list));
        let frames: Vec<_> = std::iter::from_fn(|| self.0.ground.pop_frame(|_| true)).collect();
        let frame = frames.iter().find(|(_, frame)| frame[7..10] == [44, 0, 0]).unwrap();
        let payload = frame.1[10..frame.1.len() - 2].to_vec();
        let got = Got {
            to: address(14_550),
            id: 44,
            payload,
            sequence: 0,
            at: self.0.now,
            bytes: Vec::new(),
        };
        got.read::<MISSION_COUNT_DATA>().unwrap().count
    }
}

#[test]
fn a_plan_is_acknowledged_when_it_is_in_force_and_not_before() {
    let mut slow = Slow(World::flying());
    slow.upload(&waypoints(2));
    // The last item again, before the control side answers.
    slow.send(&MavMessage::MISSION_ITEM_INT(waypoint(1)));
    assert!(slow.results().is_empty());
    assert_eq!(slow.items(), 0, "the old plan");
    let intents = slow.intents();
    assert_eq!(intents.len(), 1);
    slow.answer(intents[0].number, Outcome::Done);
    assert_eq!(slow.results(), [ACCEPTED]);
    assert_eq!(slow.items(), 2);
}

#[test]
fn without_an_answer_the_result_is_an_error_and_a_late_answer_still_counts() {
    let mut slow = Slow(World::flying());
    slow.upload(&waypoints(2));
    let number = slow.intents()[0].number;
    slow.wait_s(2);
    assert!(slow.results().is_empty());
    slow.wait_s(1);
    assert_eq!(slow.results(), [R::MAV_MISSION_ERROR]);
    assert_eq!(slow.items(), 0);
    slow.answer(number, Outcome::Done);
    assert!(slow.results().is_empty(), "one upload, one acknowledgement");
    assert_eq!(slow.items(), 2, "what is shown is what is flown");
}

#[test]
fn a_new_upload_gets_no_answer_to_the_one_before() {
    let mut slow = Slow(World::flying());
    slow.upload(&waypoints(2));
    slow.upload(&waypoints(3));
    let numbers: Vec<u32> = slow.intents().iter().map(|intent| intent.number).collect();
    assert_eq!(numbers.len(), 2);
    slow.answer(numbers[0], Outcome::Done);
    assert!(slow.results().is_empty());
    slow.answer(numbers[1], Outcome::NoAnswer);
    assert_eq!(slow.results(), [R::MAV_MISSION_ERROR]);
    assert_eq!(slow.items(), 2, "the second plan did not come into force");
}

#[test]
fn a_flood_of_requests_is_bounded_and_each_is_answered() {
    let mut slow = Slow(World::flying());
    let clear = ::mavlink::dialects::common::MISSION_CLEAR_ALL_DATA {
        target_system: 1,
        target_component: 1,
        ..Default::default()
    };
    let clear = MavMessage::MISSION_CLEAR_ALL(clear);
    let mut results = Vec::new();
    let mut plans = 0;
    for _ in 0..1_000 {
        slow.send(&clear);
        results.extend(slow.results());
        let intents = slow.intents();
        plans += intents
            .iter()
            .filter(|intent| matches!(intent.command, Command::Vehicle(VehicleCommand::Plan(_))))
            .count();
    }
    assert!(plans <= 32, "{plans} commands open");
    assert!(results.iter().all(|result| *result == R::MAV_MISSION_ERROR));
    assert_eq!(results.len() + plans, 1_000);
}

#[test]
fn a_reached_item_and_a_new_current_item_are_broadcast_at_once() {
    let mut client = Client::new(QGC);
    client.upload(&waypoints(3)).unwrap();
    let world = &mut client.world;
    world.got.clear();
    for kind in [
        EventKind::Vehicle(VehicleEvent::ItemReached(0)),
        EventKind::Vehicle(VehicleEvent::PlanItem(1)),
    ] {
        world.ground.handle_event(&Event { time: world.sim, kind }, world.now);
    }
    world.send_bytes(address(14_550), &[]);
    for to in [address(14_550), address(14_540)] {
        let mine = || world.got.iter().filter(move |got| got.to == to);
        let reached: Vec<MISSION_ITEM_REACHED_DATA> = mine().filter_map(Got::read).collect();
        let current: Vec<MISSION_CURRENT_DATA> = mine().filter_map(Got::read).collect();
        assert_eq!(reached.iter().map(|message| message.seq).collect::<Vec<_>>(), [0]);
        let last = current.last().unwrap();
        assert_eq!((last.seq, last.total), (1, 3));
    }
}

#[test]
fn a_plan_may_come_before_the_aircraft_and_is_flown_by_it() {
    let mut client = Client::new(MAVSDK);
    client.world = World::waiting();
    let (result, id) = client.upload(&waypoints(3)).unwrap();
    assert_eq!(result, ACCEPTED, "{:?}", client.world.texts());
    client.world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    client.world.run_ms(100);
    assert_eq!(client.world.autopilot.snapshot().unwrap().navigation.plan_id, id);
}
