use super::*;
use crate::replay::tests::testing::{self, Without};
use crate::replay::tests::{commands, setup};

mod hostile;

fn page_of(bytes: Vec<u8>) -> String {
    page("a.ulg", Log::from_bytes(bytes).unwrap(), None).unwrap().html
}

#[test]
fn the_page_has_every_figure_and_needs_no_network() {
    let page = page_of(testing::log(&setup(3), &commands(), Without::default()));
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

/// On an estimated state truth and estimate stand beside each other, and the errors beside the standard deviations.
#[test]
fn the_page_of_a_flight_on_estimates_has_truth_and_estimate() {
    let mut flown = setup(3);
    flown.plant.sensors = plant_sim::grade_file::of_grade(plant_sim::GradeName::Tactical);
    let page = page_of(testing::log(&flown, &commands(), Without::default()));
    for word in [
        "measured",
        "truth",
        "estimated sideslip",
        "Error of the estimated state",
        "Attitude: angle between estimate and truth",
        "Horizontal position",
        "standard deviation of the estimator",
    ] {
        assert!(page.contains(word), "{word}");
    }
    let ideal = page_of(testing::log(&setup(1), &commands(), Without::default()));
    assert!(!ideal.contains("Error of the estimated state") && !ideal.contains(">measured<"));
}

#[test]
fn every_drawing_is_one_that_a_rasteriser_understands() {
    let page = page_of(testing::log(&setup(1), &commands(), Without::default()));
    let drawings: Vec<&str> = page
        .match_indices("<svg")
        .map(|(start, _)| &page[start..start + page[start..].find("</svg>").unwrap() + 6])
        .collect();
    assert!(drawings.len() >= 22, "{}", drawings.len());
    for drawing in drawings {
        assert!(lab_report::chart::raster::png(drawing).is_ok(), "{}", &drawing[..200]);
        assert!(!drawing.contains("NaN") && !drawing.contains("inf"), "{}", &drawing[..200]);
    }
}

#[test]
fn a_log_with_some_of_the_rows_has_every_figure_too() {
    let page =
        page_of(testing::log(&setup(3), &commands(), Without { rows: 10, ..Without::default() }));
    for word in [
        "The log is complete.",
        "one of 10 control steps, and all of them around events",
        "3.000 s of simulation time",
        "true F",
        "left elevator: stuck",
        "the compensator wakes",
        "end of travel",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert!(!page.contains("Not in this log") && !page.contains("Not drawn"), "{}", &page[..3_000]);
}

#[test]
fn a_log_without_truth_or_headers_is_drawn_and_names_what_is_missing() {
    let without = Without { truth: true, ..Without::default() };
    let page = page_of(testing::log(&setup(1), &commands(), without));
    assert!(page.contains("Not in this log: the truth of the plant"), "{}", &page[..3_000]);
    assert!(page.contains("left elevator: stuck") && !page.contains(">true F<"));
    let without = Without { headers: true, ..Without::default() };
    let page = page_of(testing::log(&setup(1), &[], without));
    assert!(page.contains("a readable header of the plant"));
    assert!(page.contains("Left elevator") && !page.contains("end of travel"));
}

#[test]
fn a_log_that_was_cut_off_is_drawn_up_to_there() {
    let bytes = testing::log(&setup(2), &commands(), Without::default());
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
    assert_eq!(page("a.ulg", Log::from_bytes(out).unwrap(), None), Err(NothingToDraw));
}

#[test]
fn the_page_does_not_overwrite_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("a.ulg");
    let bytes = testing::log(&setup(1), &[], Without::default());
    fs::write(&log, &bytes).unwrap();
    let out = folder.path().join(".").join("a.ulg");
    let refused = run(&PlotArgs { log: log.clone(), out: Some(out) }).unwrap_err().to_string();
    assert!(refused.contains("this is the log"), "{refused}");
    assert_eq!(fs::read(&log).unwrap(), bytes);
    // Also where the log itself is called like a page.
    let page = folder.path().join("a.html");
    fs::rename(&log, &page).unwrap();
    assert!(run(&PlotArgs { log: page.clone(), out: None }).is_err());
    assert_eq!(fs::read(&page).unwrap(), bytes);
}

#[test]
fn a_damaged_log_is_not_called_complete_and_pairs_its_rows_by_time() {
    let bytes = testing::log(&setup(2), &[], Without::default());
    let whole = Flight::new(Log::from_bytes(bytes.clone()).unwrap()).unwrap();
    let mut bytes = bytes;
    // Inside of a row of control, whose truth follows later.
    let value = whole.log.column("control", "airspeed_m_s").unwrap()[400];
    let places = bytes.windows(8).enumerate().filter(|(_, w)| *w == value.to_le_bytes());
    let place = places.map(|(place, _)| place).next_back().unwrap();
    bytes[place..place + 3_000].fill(0xFF);
    let page = page_of(bytes.clone());
    assert!(page.contains("The log is damaged.") && !page.contains("The log is complete."));
    let damaged = Flight::new(Log::from_bytes(bytes).unwrap()).unwrap();
    let (whole, damaged) =
        (whole.true_fault_acceleration().unwrap(), damaged.true_fault_acceleration().unwrap());
    assert!(damaged.len() > 500 && damaged.len() < whole.len(), "{}", damaged.len());
    for tick in damaged {
        // Damage has no checksum: the row that it begins in may keep its length.
        let is_beside = (tick.0 - 0.8).abs() < 0.05;
        assert!(is_beside || whole.contains(&tick), "at {} s", tick.0);
    }
}

#[test]
fn the_table_names_the_axis_that_woke_the_compensator() {
    let bytes = testing::log(&setup(3), &commands(), Without::default());
    let log = Log::from_bytes(bytes.clone()).unwrap();
    let active = log.column("control", "compensator_active").unwrap();
    let first = active.iter().position(|active| *active > 0.0).unwrap();
    let level = |axis: &str| log.column("control", &format!("level_{axis}")).unwrap()[first];
    let axes = ["roll", "pitch", "yaw"].map(|axis| (level(axis), axis));
    let strongest = axes.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1;
    let expected = format!("something acts about the {strongest} axis that the model");
    assert!(page_of(bytes).contains(&expected), "{expected}: {axes:?}");
}
