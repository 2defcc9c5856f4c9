//! The plan, the fence and the rally points of an earlier run of the program.

use super::client::*;
use super::fences::{FENCE, RALLY, some_fence, some_rally};
use crate::mission::SavedPlan;
use crate::tests::world::*;
use ::mavlink::dialects::common::{
    MISSION_ITEM_INT_DATA, MavCmd, MavMissionResult, MavMissionType,
};
use flight_management::command::{Command, VehicleCommand};
use flight_management::parameters::Parameters;
use flight_management::vehicle::Mode;

fn mode(world: &World) -> Mode {
    world.autopilot.snapshot().unwrap().mode
}

/// A client whose vehicle saves plans, and begins with this one.
fn keeping(saved: SavedPlan) -> Client {
    let mut client = Client::new(QGC);
    client.world = World::waiting();
    client.world.ground.keep_plan(saved);
    client.world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    client.world.run_ms(200);
    client
}

/// Content that the file would have.
fn file(client: &mut Client) -> SavedPlan {
    let save = client.world.ground.pop_plan_save().expect("a changed plan is handed out");
    assert!(save.at_once, "whoever uploads may pull the plug");
    SavedPlan::from_text("plan", &save.text).unwrap()
}

fn some_items() -> Vec<MISSION_ITEM_INT_DATA> {
    let mut items = waypoints(3);
    items.push(item(3, MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH, [0.0; 4]));
    items
}

#[test]
fn after_a_restart_the_plan_is_offered_as_it_was_and_does_not_begin() {
    let mut first = keeping(SavedPlan::default());
    let (_, id) = first.upload(&some_items()).unwrap();
    let before = first.download().unwrap();
    let saved = file(&mut first);

    let mut second = keeping(saved);
    assert!(
        second.world.has_text("Mission of the last run: 4 items"),
        "{:?}",
        second.world.texts()
    );
    let after = second.download().unwrap();
    assert_eq!((bytes(&after.0), after.1), (bytes(&before.0), before.1));
    assert_eq!(after.1, id);
    assert_eq!(mode(&second.world), mode(&first.world), "no mission begins by itself");
    assert!(second.world.ground.pop_plan_save().is_none(), "the file is as it was");
    second.world.send_command(300, [0.0; 7]);
    second.world.run_ms(20);
    assert_eq!(mode(&second.world), Mode::Mission, "but it can be flown");
}

#[test]
fn relative_altitudes_count_from_the_ground_of_the_upload_also_before_the_aircraft_is_there() {
    let mut first = keeping(SavedPlan::default());
    first.upload(&some_items()).unwrap();
    let low = file(&mut first);
    let altitude_m = |saved: SavedPlan| {
        let mut client = Client::new(QGC);
        client.world = World::waiting();
        client.world.ground.keep_plan(saved);
        client.world.run_ms(200);
        let items = client.world.autopilot.plan().items.clone();
        items.first().and_then(|item| item.action.altitude_m()).expect("an altitude")
    };
    let text = low.to_text().replace("ground_m = 0.0", "ground_m = 700.0");
    let high = SavedPlan::from_text("plan", &text).unwrap();
    assert_eq!(altitude_m(high) - altitude_m(low), 700.0);
}

#[test]
fn a_cleared_plan_is_gone_after_a_restart() {
    let mut first = keeping(SavedPlan::default());
    first.upload(&some_items()).unwrap();
    file(&mut first);
    first.clear().unwrap();
    let saved = file(&mut first);
    assert_eq!(saved.counts(), [0; 3]);
    let mut second = keeping(saved);
    assert_eq!(second.download().unwrap().0.len(), 0);
    assert!(!second.world.has_text("ission"), "{:?}", second.world.texts());
}

/// A second run, whose limits the saved plan of the first is below.
fn with_a_plan_below_its_limits() -> Client {
    let mut first = keeping(SavedPlan::default());
    first.upload(&some_items()).unwrap();
    let saved = file(&mut first);
    let mut parameters = Parameters::default();
    parameters.set_all([("REF_ALT_MIN", 11_000.0), ("RTL_RETURN_ALT", 11_000.0)]).unwrap();
    let mut second = Client::new(QGC);
    second.world = World::flying_with(&parameters);
    second.world.ground.keep_plan(saved);
    second.world.run_ms(20);
    second
}

#[test]
fn a_plan_that_cannot_be_flown_any_more_is_refused_with_its_item_and_stays_in_its_file() {
    let mut second = with_a_plan_below_its_limits();
    assert!(
        second.world.has_text("Mission of the last run refused: "),
        "{:?}",
        second.world.texts()
    );
    assert!(second.world.has_text("REF_ALT_MIN") || second.world.has_text("11000"));
    assert_eq!(second.download().unwrap().0.len(), 0);
    assert!(second.world.ground.pop_plan_save().is_none());
}

#[test]
fn without_a_plan_file_nothing_is_written_and_a_failed_write_is_reported() {
    let mut client = Client::new(QGC);
    client.upload(&some_items()).unwrap();
    assert!(client.world.ground.pop_plan_save().is_none());

    let mut client = keeping(SavedPlan::default());
    client.upload(&some_items()).unwrap();
    let number = client.world.ground.pop_plan_save().unwrap().number;
    let result = Err("No space left on device".to_owned());
    let saved = crate::param::Saved { number, result };
    client.world.ground.handle_plan_saved(&saved, client.world.now);
    client.world.settle();
    assert!(client.world.has_text("The plan is not saved: No space left"));
}

#[test]
fn fence_and_rally_points_are_in_force_after_a_restart_and_clearing_the_plan_keeps_them() {
    let mut first = keeping(SavedPlan::default());
    first.upload(&some_items()).unwrap();
    for (list, items) in [(FENCE, some_fence()), (RALLY, some_rally())] {
        first.list = list;
        assert_eq!(first.upload(&items).unwrap().0, ACCEPTED, "{:?}", first.world.texts());
    }
    let saved = file(&mut first);
    assert_eq!(saved.counts(), [4, 4, 2]);

    let mut second = keeping(saved.clone());
    for words in ["Fence of the last run: 4 items", "Rally points of the last run: 2 items"] {
        assert!(second.world.has_text(words), "{:?}", second.world.texts());
    }
    for (list, items) in [(FENCE, some_fence()), (RALLY, some_rally())] {
        second.list = list;
        assert_eq!(bytes(&second.download().unwrap().0), bytes(&items));
    }
    let commands = second.world.take_commands();
    let is_fence =
        |command: &Command| matches!(command, Command::Vehicle(VehicleCommand::Fence(_)));
    assert!(commands.iter().any(is_fence), "{commands:?}");
    let beyond = some_rally().into_iter().map(|item| MISSION_ITEM_INT_DATA { x: 0, ..item });
    let (result, _) = second.upload(&beyond.collect::<Vec<_>>()).unwrap();
    assert_eq!(result, MavMissionResult::MAV_MISSION_INVALID_PARAM5_X, "beyond the saved fence");
    assert!(second.world.ground.pop_plan_save().is_none(), "the file is as it was");
    second.list = MavMissionType::MAV_MISSION_TYPE_MISSION;
    second.clear().unwrap();
    assert_eq!(file(&mut second).counts(), [0, 4, 2]);
}

#[test]
fn a_saved_list_that_is_refused_stays_in_the_file_when_another_one_changes() {
    let mut second = with_a_plan_below_its_limits();
    second.list = FENCE;
    second.upload(&some_fence()).unwrap();
    assert_eq!(file(&mut second).counts(), [4, 4, 0]);
}
