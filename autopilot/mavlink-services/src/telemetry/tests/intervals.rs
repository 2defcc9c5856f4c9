//! Rates of one ground station beside others.

#![expect(deprecated, reason = "MAVProxy sends REQUEST_DATA_STREAM")]

use ::mavlink::dialects::common::{
    MESSAGE_INTERVAL_DATA, MavDataStream, MavMessage, MavResult, REQUEST_DATA_STREAM_DATA,
};

use super::{count, count_at, last};
use crate::codec::Identity;
use crate::tests::world::{STATION, World, ack, address, command_long};

const GET_MESSAGE_INTERVAL: u16 = 510;
const SET_MESSAGE_INTERVAL: u16 = 511;
const REQUEST_MESSAGE: u16 = 512;
const ATTITUDE: u32 = 30;
const SYS_STATUS: u32 = 1;

fn set(world: &mut World, id: f32, interval_us: f32) -> u8 {
    world.take_acks();
    world.send_command(SET_MESSAGE_INTERVAL, [id, interval_us, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let [ack] = world.take_acks()[..] else { panic!("not one acknowledgement") };
    ack.result
}

fn reported_interval(world: &mut World, id: f32) -> i32 {
    world.send_command(GET_MESSAGE_INTERVAL, [id, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let sent: MESSAGE_INTERVAL_DATA = last(world);
    assert_eq!(f32::from(sent.message_id), id);
    sent.interval_us
}

fn in_a_second(world: &mut World, port: u16, id: u32) -> usize {
    world.got.clear();
    world.run_ms(1_000);
    count_at(world, port, id)
}

fn stream_request(stream: MavDataStream, rate_hz: u16, start: u8) -> MavMessage {
    MavMessage::REQUEST_DATA_STREAM(REQUEST_DATA_STREAM_DATA {
        target_system: 1,
        target_component: 1,
        req_stream_id: stream,
        req_message_rate: rate_hz,
        start_stop: start,
    })
}

#[test]
fn a_rate_is_changed_for_the_requesting_station_only() {
    let mut world = World::flying();
    assert_eq!(set(&mut world, 30.0, 10_000.0), MavResult::MAV_RESULT_ACCEPTED as u8);
    let fast = in_a_second(&mut world, 14_550, ATTITUDE);
    assert!((99..=101).contains(&fast), "{fast} of 100");
    let other = count_at(&world, 14_540, ATTITUDE);
    assert!((24..=26).contains(&other), "{other} of 25");
}

#[test]
fn minus_one_stops_a_stream_and_zero_brings_its_default_back() {
    let mut world = World::flying();
    set(&mut world, 30.0, -1.0);
    assert_eq!(in_a_second(&mut world, 14_550, ATTITUDE), 0);
    assert_eq!(reported_interval(&mut world, 30.0), -1);
    set(&mut world, 30.0, 0.0);
    let again = in_a_second(&mut world, 14_550, ATTITUDE);
    assert!((24..=26).contains(&again), "{again} of 25");
    assert_eq!(reported_interval(&mut world, 30.0), 40_000);
}

#[test]
fn a_message_that_does_not_come_by_itself_can_be_given_an_interval() {
    let mut world = World::flying();
    set(&mut world, 300.0, 100_000.0);
    let got = in_a_second(&mut world, 14_550, 300);
    assert!((9..=11).contains(&got), "{got} of 10");
}

#[test]
fn intervals_that_are_none_are_denied_and_nothing_changes() {
    let mut world = World::flying();
    for interval in [f32::NAN, f32::INFINITY, -2.0, 1.0, 4_999.0, 3.0e9] {
        let result = set(&mut world, 30.0, interval);
        assert_eq!(result, MavResult::MAV_RESULT_DENIED as u8, "{interval} us");
    }
    assert!(
        world.has_text("Interval refused: 1 us is shorter than 5000 us"),
        "{:?}",
        world.texts()
    );
    assert_eq!(reported_interval(&mut world, 30.0), 40_000);
}

#[test]
fn messages_that_do_not_exist_are_unsupported_and_their_interval_is_zero() {
    let mut world = World::flying();
    for id in [115.0, 65.0, 12_345.0] {
        let result = set(&mut world, id, 100_000.0);
        assert_eq!(result, MavResult::MAV_RESULT_UNSUPPORTED as u8, "{id}");
        assert_eq!(reported_interval(&mut world, id), 0, "{id}");
    }
    for id in [f32::NAN, 0.5, -1.0, 1.0e9] {
        assert_eq!(set(&mut world, id, 0.0), MavResult::MAV_RESULT_DENIED as u8, "{id}");
    }
    // The heartbeat has its own clock, and a list only answers.
    for id in [0.0, 435.0] {
        assert_eq!(set(&mut world, id, 10_000.0), MavResult::MAV_RESULT_DENIED as u8, "{id}");
    }
    assert_eq!(reported_interval(&mut world, 0.0), 1_000_000);
}

#[test]
fn an_interval_can_be_requested_as_a_message() {
    let mut world = World::flying();
    world.send_command(REQUEST_MESSAGE, [244.0, 30.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(REQUEST_MESSAGE, MavResult::MAV_RESULT_ACCEPTED)]);
    let sent: MESSAGE_INTERVAL_DATA = last(&world);
    assert_eq!((sent.message_id, sent.interval_us), (30, 40_000));
}

#[test]
fn the_same_request_again_changes_nothing() {
    let mut world = World::flying();
    set(&mut world, 30.0, 500_000.0);
    world.got.clear();
    for _ in 0..250 {
        set(&mut world, 30.0, 500_000.0);
        world.run_ms(4);
    }
    let got = count(&world, ATTITUDE);
    assert!(got <= 3, "{got} in a second of 2 Hz");
}

#[test]
fn rates_are_forgotten_with_the_station() {
    let mut world = World::flying();
    let request = command_long(
        SET_MESSAGE_INTERVAL,
        [30.0, 10_000.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        Identity { system: 1, component: 1 },
    );
    world.send_bytes(address(9_000), &request);
    let fast = in_a_second(&mut world, 9_000, ATTITUDE);
    assert!((99..=101).contains(&fast), "{fast} of 100");
    world.run_ms(11_000);
    assert_eq!(in_a_second(&mut world, 9_000, ATTITUDE), 0, "silent for ten seconds");
    let hello = command_long(
        GET_MESSAGE_INTERVAL,
        [30.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        Identity { system: 1, component: 1 },
    );
    world.send_bytes(address(9_000), &hello);
    assert_eq!(last::<MESSAGE_INTERVAL_DATA>(&world).interval_us, 40_000);
    let again = in_a_second(&mut world, 9_000, ATTITUDE);
    assert!((24..=26).contains(&again), "{again} of 25");
}

#[test]
fn a_data_stream_request_moves_the_fast_messages_of_one_station() {
    let mut world = World::flying();
    // MAVProxy sends this every 15 s, and twice, since it repeats it.
    for _ in 0..2 {
        world.send(&stream_request(MavDataStream::MAV_DATA_STREAM_ALL, 4, 1));
    }
    let slow = in_a_second(&mut world, 14_550, ATTITUDE);
    assert!((3..=5).contains(&slow), "{slow} of 4");
    assert!(count(&world, SYS_STATUS) >= 1, "state reports keep their rhythm");
    let other = count_at(&world, 14_540, ATTITUDE);
    assert!((24..=26).contains(&other), "{other} of 25");
    world.send(&stream_request(MavDataStream::MAV_DATA_STREAM_EXTRA1, 50, 1));
    let fast = in_a_second(&mut world, 14_550, ATTITUDE);
    assert!((49..=51).contains(&fast), "{fast} of 50");
    let position = count(&world, 33);
    assert!((3..=5).contains(&position), "{position} of 4: another group");
    world.send(&stream_request(MavDataStream::MAV_DATA_STREAM_ALL, 0, 0));
    assert_eq!(in_a_second(&mut world, 14_550, ATTITUDE), 0);
    assert_eq!(count(&world, SYS_STATUS), 0);
    assert!(count(&world, 0) >= 1, "heartbeats cannot be stopped");
}

#[test]
fn a_requested_interval_goes_before_a_data_stream() {
    let mut world = World::flying();
    set(&mut world, 30.0, 20_000.0);
    world.send(&stream_request(MavDataStream::MAV_DATA_STREAM_ALL, 4, 1));
    let requested = in_a_second(&mut world, 14_550, ATTITUDE);
    assert!((49..=51).contains(&requested), "{requested} of 50");
}

#[test]
fn a_default_rate_follows_its_parameter_at_once() {
    let mut world = World::flying();
    world.ground.shared.parameters.streams.attitude_hz = 0.1;
    world.run_ms(100);
    assert_eq!(in_a_second(&mut world, 14_550, ATTITUDE), 0, "one in ten seconds");
    world.ground.shared.parameters.streams.attitude_hz = 50.0;
    let got = in_a_second(&mut world, 14_550, ATTITUDE);
    assert!((49..=51).contains(&got), "{got} of 50");
    let other = count(&world, 33);
    assert!((9..=11).contains(&other), "{other} of 10: another parameter");
}

#[test]
fn every_request_is_acknowledged_to_its_sender() {
    let mut world = World::flying();
    world.send_command(SET_MESSAGE_INTERVAL, [245.0, 1.0e6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let [ack] = world.take_acks()[..] else { panic!("not one acknowledgement") };
    assert_eq!(ack.to, STATION);
    let got = in_a_second(&mut world, 14_550, 245);
    assert!((1..=2).contains(&got), "{got} of 1");
}
