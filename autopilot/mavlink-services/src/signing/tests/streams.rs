//! The latest timestamps of the streams, and the reports of refusals.

use super::super::*;

fn stream(link: u8, component: u8) -> Stream {
    Stream { link, sender: Identity { system: 255, component } }
}

fn seconds(s: u64) -> Timestamp {
    Timestamp::new(s * 100_000).unwrap()
}

#[test]
fn each_stream_has_its_own_time_and_takes_nothing_twice() {
    let mut streams = Streams::default();
    let local = seconds(100);
    assert_eq!(streams.take(stream(0, 1), seconds(90), local), Ok(()));
    assert_eq!(streams.take(stream(0, 1), seconds(90), local), Err(Refusal::NotNewer));
    assert_eq!(streams.take(stream(0, 1), seconds(89), local), Err(Refusal::NotNewer));
    assert_eq!(streams.take(stream(1, 1), seconds(80), local), Ok(()), "another link");
    assert_eq!(streams.take(stream(0, 2), seconds(80), local), Ok(()), "another component");
    assert_eq!(streams.take(stream(0, 1), seconds(90).next(), local), Ok(()));
}

#[test]
fn a_known_stream_may_be_old_and_a_new_one_at_most_a_minute() {
    let mut streams = Streams::default();
    assert_eq!(streams.take(stream(0, 1), seconds(10), seconds(70)), Ok(()));
    let old = streams.take(stream(1, 1), seconds(10), seconds(70).next());
    assert_eq!(old, Err(Refusal::NewStreamTooOld));
    assert_eq!(streams.take(stream(0, 1), seconds(11), seconds(900)), Ok(()));
}

#[test]
fn times_up_to_the_floor_are_refused_and_the_newest_is_remembered() {
    let mut streams = Streams::above(seconds(100), seconds(90));
    assert_eq!(streams.newest(), seconds(90));
    let early = streams.take(stream(0, 1), seconds(100), seconds(100));
    assert_eq!(early, Err(Refusal::BeforeStart));
    assert_eq!(streams.newest(), seconds(90));
    assert_eq!(streams.take(stream(0, 1), seconds(100).next(), seconds(100)), Ok(()));
    assert_eq!(streams.take(stream(0, 1), seconds(120), seconds(100)), Ok(()));
    assert_eq!(streams.take(stream(1, 1), seconds(110), seconds(120)), Ok(()));
    assert_eq!(streams.newest(), seconds(120));
}

#[test]
fn the_table_is_bounded_and_only_streams_that_would_be_refused_anyway_make_room() {
    let mut streams = Streams::default();
    let all = (0..=255).map(|link| streams.take(stream(link, 1), seconds(100), seconds(100)));
    assert_eq!(all.filter(Result::is_ok).count(), STREAMS_MAX);
    let full = streams.take(stream(0, 9), seconds(160), seconds(160));
    assert_eq!(full, Err(Refusal::TooManyStreams));
    let later = seconds(160).next();
    assert_eq!(streams.take(stream(0, 9), later, later), Ok(()));
    let replayed = streams.take(stream(0, 1), seconds(100), later);
    assert_eq!(replayed, Err(Refusal::NewStreamTooOld));
}

#[test]
fn timestamps_in_the_last_year_of_48_bits_are_refused() {
    let late = Timestamp::from_bytes([0xFF; 6]);
    let refused = Streams::default().take(stream(0, 1), late, seconds(1));
    assert_eq!(refused, Err(Refusal::TooFarAhead));
}

#[test]
fn a_flood_of_one_kind_is_one_line_in_ten_seconds_and_hides_no_other_kind() {
    let mut refusals = Refusals::default();
    let at = |s: u64| WallTime::from_micros(s * 1_000_000);
    refusals.add(Refusal::Unsigned);
    let line = refusals.next_line(at(5)).unwrap();
    assert_eq!(line, "Signing refused unsigned messages (1 so far)");
    for _ in 0..1_000 {
        refusals.add(Refusal::Unsigned);
        assert_eq!(refusals.next_line(at(14)), None);
    }
    refusals.add(Refusal::WrongSignature);
    assert!(refusals.next_line(at(14)).unwrap().contains("wrong signature"));
    assert!(refusals.next_line(at(15)).unwrap().ends_with("(1001 so far)"));
    assert_eq!(refusals.next_line(at(99)), None, "nothing new");
}

#[test]
fn the_list_of_kinds_is_in_the_order_of_their_numbers() {
    for (number, kind) in Refusal::ALL.into_iter().enumerate() {
        assert_eq!(kind as usize, number);
    }
}
