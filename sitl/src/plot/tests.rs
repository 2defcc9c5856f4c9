use super::*;
use crate::replay::testing::{self, Without};
use crate::replay::tests::{setup, spoken};

fn page_of(bytes: Vec<u8>) -> String {
    page("a.ulg", Log::from_bytes(bytes).unwrap()).unwrap()
}

#[test]
fn the_page_has_every_figure_and_needs_no_network() {
    let page = page_of(testing::log(&setup(3), &spoken(), Without::default()));
    for word in [
        "The log is complete.",
        "Altitude above the ellipsoid",
        "True airspeed",
        "Roll angle",
        "Pitch angle",
        "Angle of attack and sideslip",
        "Normal load factor",
        "Body rates",
        "Fault acceleration about the yaw axis",
        "true F",
        "level, either way",
        "How much the compensator acts",
        "compensator awake",
        "end of travel",
        "Left elevator",
        "Engine",
        "Track over the ground",
        "Mode: who gives the references",
        "left elevator: stuck",
        "left elevator: no longer stuck",
        "the compensator wakes",
        "the ground station is back",
        "the log ends: stopped",
        "a test",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert!(!page.contains("Not in this log"), "{}", &page[..3_000]);
    for foreign in ["<script", "href=", "src=", "url(", "@import"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    let links = page.matches("http").count();
    assert_eq!(links, page.matches("http://www.w3.org/2000/svg").count(), "a name and no link");
}

#[test]
fn every_drawing_is_one_that_a_rasteriser_understands() {
    let page = page_of(testing::log(&setup(1), &spoken(), Without::default()));
    let drawings: Vec<&str> = page
        .match_indices("<svg")
        .map(|(start, _)| &page[start..start + page[start..].find("</svg>").unwrap() + 6])
        .collect();
    assert!(drawings.len() >= 22, "{}", drawings.len());
    for drawing in drawings {
        assert!(crate::figures::raster::png(drawing).is_ok(), "{}", &drawing[..200]);
        assert!(!drawing.contains("NaN") && !drawing.contains("inf"), "{}", &drawing[..200]);
    }
}

#[test]
fn a_log_without_truth_or_headers_is_drawn_and_says_what_is_missing() {
    let without = Without { truth: true, ..Without::default() };
    let page = page_of(testing::log(&setup(1), &spoken(), without));
    assert!(page.contains("Not in this log: the truth of the plant"), "{}", &page[..3_000]);
    assert!(page.contains("left elevator: stuck") && !page.contains(">true F<"));
    let without = Without { headers: true, ..Without::default() };
    let page = page_of(testing::log(&setup(1), &[], without));
    assert!(page.contains("a readable header of the plant"));
    assert!(page.contains("Left elevator") && !page.contains("end of travel"));
}

#[test]
fn a_log_that_was_cut_off_is_drawn_up_to_there() {
    let bytes = testing::log(&setup(2), &spoken(), Without::default());
    let page = page_of(bytes[..bytes.len() / 2 + 1].to_vec());
    assert!(page.contains("The log was cut off") && page.contains("the log breaks off here"));
}

#[test]
fn a_spike_of_one_tick_is_in_the_drawing() {
    let mut bytes = testing::log(&setup(3), &[], Without::default());
    let log = Log::from_bytes(bytes.clone()).unwrap();
    let value = log.column("sensors", "body_rate_r_rad_s").unwrap()[777];
    let place = bytes.windows(8).position(|window| window == value.to_le_bytes()).unwrap();
    bytes[place..place + 8].copy_from_slice(&5.0_f64.to_le_bytes());
    let flight = Flight::new(Log::from_bytes(bytes).unwrap()).unwrap();
    let points = flight.thinned("sensors", "body_rate_r_rad_s", 1.0).unwrap();
    assert!(points.len() < 1_501, "{} points are not thinned", points.len());
    assert!(points.iter().any(|point| point.1 == 5.0), "the spike is not there");
}

#[test]
fn an_empty_log_has_nothing_to_draw() {
    let out = ulog::writer::Definitions::begin(Vec::new(), 0).unwrap().data().finish().unwrap();
    assert_eq!(page("a.ulg", Log::from_bytes(out).unwrap()), Err(NothingToDraw));
}
