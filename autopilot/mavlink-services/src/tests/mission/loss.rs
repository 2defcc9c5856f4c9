//! Each datagram of a conversation lost in turn.

use super::client::*;
use ::mavlink::dialects::common::MavCmd;

/// Upload, download, clear, download: what the station has at the end, and how many datagrams it took.
fn converse(manner: Manner, lost: u32) -> (Vec<Vec<u8>>, u32, usize, u32) {
    let mut client = Client::losing(manner, lost);
    let mut items = waypoints(3);
    items.push(item(3, MavCmd::MAV_CMD_NAV_LOITER_TURNS, [2.0, 0.0, -9_000.0, f32::NAN]));
    let uploaded = client.upload(&items);
    let (result, id) = uploaded.unwrap_or_else(|| panic!("no acknowledgement, {lost} lost"));
    assert_eq!(result, ACCEPTED, "{lost} lost: {:?}", client.world.texts());
    let (got, got_id) = client.download().unwrap_or_else(|| panic!("no plan, {lost} lost"));
    assert_eq!(got_id, id, "{lost} lost");
    assert_eq!(client.clear(), Some(ACCEPTED), "{lost} lost");
    let (left, _) = client.download().unwrap_or_else(|| panic!("no empty plan, {lost} lost"));
    (bytes(&got), id, left.len(), client.count)
}

fn every_loss(manner: Manner) {
    let (items, id, left, count) = converse(manner, 0);
    assert_eq!((items.len(), left), (4, 0));
    // Count, request and item four times, acknowledgement; list, count, request and item four times.
    assert!(count >= 20, "{count} datagrams");
    for lost in 1..=count {
        let end = converse(manner, lost);
        assert_eq!((&end.0, end.1, end.2), (&items, id, left), "datagram {lost} lost");
    }
}

#[test]
fn mavsdk_ends_where_it_would_have_without_the_loss() {
    every_loss(MAVSDK);
}

#[test]
fn qgroundcontrol_ends_where_it_would_have_without_the_loss() {
    every_loss(QGC);
}

#[test]
fn mavproxy_ends_where_it_would_have_without_the_loss() {
    every_loss(MAVPROXY);
}
