use super::*;
use crate::tvc_jet;
use std::string::ToString;
use std::vec::Vec;

fn entries() -> Vec<EffectorEntry> {
    tvc_jet::effectors().members().iter().map(|member| member.entry).collect()
}

fn refusal(change: impl FnOnce(&mut Vec<EffectorEntry>)) -> std::string::String {
    let mut entries = entries();
    change(&mut entries);
    EffectorList::new(entries).unwrap_err().to_string()
}

#[test]
fn the_list_of_the_jet_has_names_pairs_and_numbers() {
    let list = tvc_jet::effectors();
    assert!(list.all().eq(tvc_jet::ALL));
    assert_eq!(list.name(tvc_jet::LEFT_ELEVATOR), "left elevator");
    assert_eq!(list.key(tvc_jet::LEFT_ELEVATOR), "left_elevator");
    assert_eq!(list.mirrored(tvc_jet::LEFT_ELEVATOR), tvc_jet::RIGHT_ELEVATOR);
    assert_eq!(list.mirrored(tvc_jet::RUDDER), tvc_jet::RUDDER);
    assert_eq!(list.find(EffectorKind::Aileron, LateralSide::Right), Some(tvc_jet::RIGHT_AILERON));
    assert_eq!(list.by_key("nozzle_yaw"), Some(tvc_jet::NOZZLE_YAW));
    assert_eq!(list.by_unit(true).as_slice(), &tvc_jet::ALL[..7]);
    assert_eq!(list.by_unit(false).as_slice(), [tvc_jet::ENGINE]);
    let pairs: Vec<_> = list.pairs().collect();
    assert_eq!(
        pairs,
        [
            [tvc_jet::LEFT_AILERON, tvc_jet::RIGHT_AILERON],
            [tvc_jet::LEFT_ELEVATOR, tvc_jet::RIGHT_ELEVATOR]
        ]
    );
    assert!(list.singles().eq(tvc_jet::ALL.into_iter().skip(4)));
}

#[test]
fn an_effector_that_the_aircraft_lacks_has_no_kind_and_no_number() {
    let list = tvc_jet::effectors();
    let ninth = Effector::from_index(8).unwrap();
    assert!(!list.contains(ninth) && list.kind(ninth).is_none() && list.instance(ninth) == 0);
    assert_eq!(list.mirrored(ninth), ninth);
    assert_eq!(Effector::from_index(16), None);
}

#[test]
fn every_impossible_list_is_refused_with_the_effector_and_the_expected_value() {
    let name = |text: &str| Name::from(text).unwrap();
    let cases = [
        (refusal(|all| all.clear()), "there is no [[effector]], expected 1 to 16"),
        (
            refusal(|all| all.extend([all[4]; 9])),
            "there are more than 16 effectors, expected 1 to 16",
        ),
        (
            refusal(|all| all[5].name = name("rudder")),
            "effector `rudder`: name stands there twice, expected each once",
        ),
        (
            refusal(|all| all[0].partner = Some(name("left wing"))),
            "effector `left aileron`: partner = `left wing`: this file has no effector of that name",
        ),
        (
            refusal(|all| all[1].partner = None),
            "effector `left aileron`: partner = `right aileron` does not name this one as its partner",
        ),
        (
            refusal(|all| all[1].side = LateralSide::Left),
            "effector `left aileron`: partner = `right aileron` is not of the same kind on the other side, \
             expected one left and one right",
        ),
        (
            refusal(|all| all[6].instance = 5),
            "effector `nozzle yaw`: instance = 5 stands there twice, expected each once",
        ),
        (
            refusal(|all| all[6].instance = 17),
            "effector `nozzle yaw`: instance = 17 is outside 1 to 16",
        ),
        (
            refusal(|all| all[6].kind = EffectorKind::NozzlePitch),
            "effector `nozzle yaw`: kind = nozzle_pitch stands there twice, expected at most one",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(text, expected);
    }
    for bad in ["Rudder", "left  aileron", " rudder", "rudder_1", "2 rudders", ""] {
        let text = refusal(|all| all[4].name = name(bad));
        assert!(text.contains("small letters"), "{bad}: {text}");
    }
}

#[test]
fn another_name_order_kind_or_number_is_another_identity() {
    let ours = tvc_jet::effectors().identity();
    let of = |change: fn(&mut Vec<EffectorEntry>)| {
        let mut entries = entries();
        change(&mut entries);
        EffectorList::new(entries).unwrap().identity()
    };
    assert_eq!(of(|_| {}), ours);
    assert_ne!(of(|all| all.swap(4, 5)), ours);
    assert_ne!(of(|all| _ = all.pop()), ours);
    assert_ne!(of(|all| all[4].kind = EffectorKind::Flap), ours);
    assert_ne!(of(|all| all[4].name = Name::from("fin").unwrap()), ours);
}

#[test]
fn an_effector_is_found_by_its_role_where_it_is_the_only_one_of_it() {
    let mut entries = entries();
    for (entry, name) in entries.iter_mut().zip(["port flaperon", "starboard flaperon"]) {
        entry.name = Name::from(name).unwrap();
    }
    let (port, starboard) = (entries[0].name, entries[1].name);
    (entries[0].partner, entries[1].partner) = (Some(starboard), Some(port));
    entries[4].name = Name::from("fin flap").unwrap();
    let list = EffectorList::new(entries.clone()).unwrap();
    for (key, effector) in [
        ("left_aileron", Some(tvc_jet::LEFT_AILERON)),
        ("right aileron", Some(tvc_jet::RIGHT_AILERON)),
        ("starboard_flaperon", Some(tvc_jet::RIGHT_AILERON)),
        ("rudder", Some(tvc_jet::RUDDER)),
        ("nozzle yaw", Some(tvc_jet::NOZZLE_YAW)),
        ("aileron", None),
        ("left_rudder", None),
        ("leftaileron", None),
    ] {
        assert_eq!(list.by_key(key), effector, "{key}");
    }
    assert!(list.lacks("flap") && list.lacks("left_spoiler"));
    assert!(!list.lacks("rudder") && !list.lacks("rudderr"), "a word that is no role is a mistake");
    // Two of a role: which one is not said.
    entries[0].partner = None;
    (entries[1].partner, entries[1].side) = (None, LateralSide::Left);
    let list = EffectorList::new(entries).unwrap();
    assert_eq!(list.by_key("left_aileron"), None);
}

#[test]
fn an_elevon_stands_in_for_aileron_and_elevator_and_a_ruddervator_for_the_elevator() {
    let renamed = |kind| {
        let mut all = entries();
        for (entry, name) in all[..2].iter_mut().zip(["left flaperon", "right flaperon"]) {
            (entry.kind, entry.name) = (kind, Name::from(name).unwrap());
        }
        (all[0].partner, all[1].partner) = (Some(all[1].name), Some(all[0].name));
        // Without elevators and rudder.
        all.drain(2..5);
        EffectorList::new(all).unwrap()
    };
    let (elevons, v_tail) = (renamed(EffectorKind::Elevon), renamed(EffectorKind::Ruddervator));
    for key in ["left_elevator", "left_aileron", "left elevon", "rudder"] {
        assert_eq!(elevons.by_key(key), Some(Effector::FIRST), "{key}");
    }
    for key in ["left_elevator", "rudder"] {
        assert_eq!(v_tail.by_key(key), Some(Effector::FIRST), "{key}");
    }
    assert!(v_tail.lacks("left_aileron") && !v_tail.lacks("right_elevator"));
}
