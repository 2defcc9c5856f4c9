//! Units: their names, numbers, and the reasons why some do not fail.

use super::super::*;
use icd::tvc_jet;

#[test]
fn every_name_and_number_comes_back() {
    let all = tvc_jet::effectors();
    for name in Unit::names() {
        let unit = Unit::parse(name).unwrap();
        assert_eq!(unit.name(), Some(name));
        assert_eq!(unit.check(&all).is_ok(), !unit.targets(&all).is_empty(), "{name}");
    }
    assert_eq!(Unit::parse("GPS"), None);
}

#[test]
fn a_unit_that_does_not_fail_is_refused_by_name_and_number_with_the_reason() {
    let text = |code| Unit(code).check(&tvc_jet::effectors()).unwrap_err().reason.unwrap();
    assert_eq!(
        text(5),
        "Fault refused: no failures of unit OPTICAL_FLOW (5): there is no such sensor"
    );
    assert_eq!(text(77), "Fault refused: no failures of unit 77: it is not known");
}
