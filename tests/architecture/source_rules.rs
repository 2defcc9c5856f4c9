//! Rules about the content of source files.

use crate::sources::{Source, assert_none, contains_word, files, shipped};

/// Longest file, lines before its tests.
const LINES_MAX: usize = 900;

/// Files in which the lint `disallowed_methods` may be lifted, and why. An entry that ends in `/` is a folder.
const MAY_TOUCH_THE_OUTSIDE: [(&str, &str); 4] = [
    ("autopilot/src/clock.rs", "the one clock of the ground-station side"),
    ("autopilot/src/io/gcs_link/", "the sockets of the ground-station side"),
    ("host-io/src/clock.rs", "the one clock of the plant link: waiting and sending again"),
    ("host-io/src/socket.rs", "the one socket of the plant link"),
];

/// The one function that uses the system's random source (invariant 9): the session of a flight.
const DRAWS_FROM_THE_SYSTEM: &str = "host-io/src/session.rs";

fn starts(path: &str, places: &[&str]) -> bool {
    places.iter().any(|place| path.starts_with(place))
}

#[test]
fn mavlink_types_stay_under_the_mavlink_folder() {
    let mut offences = Vec::new();
    let mut inside = 0;
    for source in shipped() {
        let uses: Vec<String> = source
            .code()
            .into_iter()
            .filter(|(_, code)| names_mavlink_crate(code))
            .map(|(number, code)| format!("{}:{number}: {}", source.path, code.trim()))
            .collect();
        if source.path.starts_with("autopilot/mavlink-services/src/") {
            inside += uses.len();
        } else {
            offences.extend(uses);
        }
    }
    assert_none("the mavlink crate is used outside autopilot/mavlink-services/src", &offences);
    assert!(
        inside > 0,
        "no use of the mavlink crate found at all: the rule looks for the wrong words"
    );
}

/// The crate, not the module of the same name (`crate::mavlink`, `autopilot::mavlink`).
fn names_mavlink_crate(code: &str) -> bool {
    let identifier = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices("mavlink::").any(|(at, _)| {
        let before = &code[..at];
        // `::mavlink` names the crate unless a name precedes the colons.
        let before = before.strip_suffix("::").unwrap_or(before);
        !before.ends_with(identifier)
    }) || contains_word(code, "mavlink_core")
}

#[test]
fn clocks_sockets_and_sleeps_are_only_where_they_are_allowed() {
    let allowed: Vec<&str> = MAY_TOUCH_THE_OUTSIDE.iter().map(|(place, _)| *place).collect();
    let mut offences = Vec::new();
    let mut used = vec![false; allowed.len()];
    for source in shipped() {
        let lifted = source.uses(&["disallowed_methods"]);
        if lifted.is_empty() {
            continue;
        }
        match allowed.iter().position(|place| source.path.starts_with(place)) {
            Some(place) => used[place] = true,
            None => offences.extend(lifted),
        }
    }
    assert_none("disallowed_methods is lifted in a place that has no reason here", &offences);
    for (place, used) in allowed.iter().zip(used) {
        assert!(used, "{place} is allowed and does not need it: take it from the list");
    }
}

#[test]
fn only_the_session_of_a_flight_comes_from_the_random_source_of_the_system() {
    let words = [
        "getrandom",
        "OsRng",
        "SysRng",
        "ThreadRng",
        "from_os_rng",
        "try_from_os_rng",
        "RandomState",
    ];
    let sources = shipped();
    let (inside, outside): (Vec<&Source>, _) =
        sources.iter().partition(|source| source.path == DRAWS_FROM_THE_SYSTEM);
    let offences: Vec<String> = outside.iter().flat_map(|source| source.uses(&words)).collect();
    assert_none("random numbers come from a named stream", &offences);
    assert!(
        inside.iter().any(|source| !source.uses(&words).is_empty()),
        "{DRAWS_FROM_THE_SYSTEM} is allowed and does not need it"
    );
    // A flight's session may name the flight, in logs and on the link, and have no other use.
    let drawn = ["session::draw"];
    let may_draw = ["plant-sim/src/io/link.rs", "sitl/src/udp_flight.rs"];
    let offences: Vec<String> = sources
        .iter()
        .filter(|source| !starts(&source.path, &may_draw))
        .flat_map(|source| source.uses(&drawn))
        .collect();
    assert_none("sessions are drawn for flights only", &offences);
}

#[test]
fn analysis_knows_no_process() {
    let words = ["std::process", "std::net", "std::os", "current_exe", "tokio", "nix", "launch"];
    let quiet = files("lab", &["rs"]).into_iter().filter(|source| source.path.contains("/src/"));
    let offences: Vec<String> = quiet.flat_map(|source| source.uses(&words)).collect();
    assert_none("what measures, draws and reports starts nothing and sends nothing", &offences);
    let launcher = files("sitl/src", &["rs"]);
    assert!(
        launcher.iter().any(|source| !source.uses(&words).is_empty()),
        "the launcher starts no process either: the rule looks for the wrong words"
    );
}

#[test]
fn the_laws_never_name_a_fault() {
    let words = [
        "fault::",
        "FaultKind",
        "FaultRequest",
        "FaultReply",
        "PlantReport",
        "PlantRequest",
        "PlantAction",
        "Refusal",
        "Truth",
    ];
    let laws = files("autopilot/flight-control/src", &["rs"]);
    let offences: Vec<String> = laws.iter().flat_map(|source| source.uses(&words)).collect();
    assert_none("flight-control can only notice a fault, not be informed of it", &offences);
}

#[test]
fn the_flight_software_never_names_the_truth() {
    let sources = files("autopilot", &["rs"]);
    let truth = ["Truth", "AIRFRAMES", "DEFAULT_AIRFRAME", "aircraft::AEROSONDE_AIRFRAME"];
    let offences: Vec<String> = sources.iter().flat_map(|source| source.uses(&truth)).collect();
    assert_none("the truth belongs to the plant and to the judges", &offences);
}

#[test]
fn all_modules_behind_the_navigator_read_the_navigation_state() {
    let allowed = [
        "autopilot/flight-control/src/navigation.rs",
        "autopilot/flight-control/src/navigation_source.rs",
        "autopilot/flight-control/src/estimator",
        "autopilot/flight-control/src/on_wheels.rs",
        // It forwards them to the navigator.
        "autopilot/flight-management/src/autopilot.rs",
        // It hands them on to the messages about single instruments.
        "autopilot/flight-management/src/event.rs",
        "autopilot/recorder/src/",
        "lab/engine/src/flight.rs",
        // They are variables of an FMU, and its autopilot gets them.
        "lab/fmu/src/variables.rs",
        "lab/fmu/src/autopilot.rs",
        "lab/logs/src/replay/",
        // The study of the sensors themselves.
        "lab/studies/src/sensor_errors.rs",
        // The bare exchange of packets, without an aircraft.
        "sitl/src/echo.rs",
        // It hands recorded samples to the navigator, to measure its time.
        "sitl/src/bench.rs",
    ];
    let (mut offences, mut inside) = (Vec::new(), 0);
    let judges = ["lab", "sitl/src"].map(|folder| files(folder, &["rs"]));
    for source in files("autopilot", &["rs"]).into_iter().chain(judges.into_iter().flatten()) {
        let uses = source.uses(&["Sensors"]);
        if starts(&source.path, &allowed) {
            inside += uses.len();
        } else {
            offences.extend(uses);
        }
    }
    assert_none("sensors end at the navigator", &offences);
    assert!(inside > 0, "no sensors found at all: the rule looks for the wrong words");
}

#[test]
fn only_the_recorder_opens_the_truth_of_the_plant() {
    // The link forwards it without decoding it; no other code of the flight software may have it.
    let words = ["envelope", "record::open", "TruthRow", "truth_fields"];
    let allowed = [
        "autopilot/recorder/src/lib.rs",
        "autopilot/recorder/src/",
        "autopilot/src/io/recorder.rs",
        "autopilot/src/io/plant_link.rs",
    ];
    let mut offences = Vec::new();
    let mut inside = 0;
    for source in files("autopilot", &["rs"]) {
        let uses = source.uses(&words);
        if starts(&source.path, &allowed) {
            inside += uses.len();
        } else {
            offences.extend(uses);
        }
    }
    assert_none("the truth belongs to the recorder and the judges", &offences);
    assert!(inside > 0, "no envelope found at all: the rule looks for the wrong words");
}

#[test]
fn texts_leave_by_the_doors_that_filter_them() {
    // A name, a file or a packet may have control characters, which a terminal would obey.
    let words = [
        "println!",
        "print!",
        "eprintln!",
        "eprint!",
        "stdout()",
        "stderr()",
        "io::stdout",
        "io::stderr",
    ];
    let allowed = [
        "host-io/src/console.rs",
        // Draws with control sequences of its own; `cut` filters each line.
        "sitl/src/launch/screen",
        // A bar with control sequences of its own.
        "lab/report/src/runner.rs",
    ];
    let mut offences = Vec::new();
    for folder in ["autopilot", "plant-sim", "host-io", "icd", "ulog", "lab", "sitl"] {
        for source in
            files(folder, &["rs"]).into_iter().filter(|source| source.path.contains("/src/"))
        {
            if !starts(&source.path, &allowed) {
                offences.extend(source.uses(&words));
            }
        }
    }
    assert_none("host_io::console prints", &offences);
}

#[test]
fn only_a_flight_in_one_process_knows_the_fault() {
    // The reference stands between the autopilot and the plant; a flight through two processes has no such place.
    let words = ["fault_known", "FaultKnown", "fault_effects", "knows_fault"];
    let allowed = [
        "plant-sim/dynamics/src/plant.rs",
        "lab/engine/",
        "lab/studies/src/fly.rs",
        "lab/studies/tests/flown/",
        "lab/campaign/",
    ];
    let mut offences = Vec::new();
    let mut inside = 0;
    for folder in ["icd", "host-io", "ulog", "autopilot", "plant-sim", "lab", "sitl"] {
        for source in files(folder, &["rs"]) {
            let uses = source.uses(&words);
            if starts(&source.path, &allowed) {
                inside += uses.len();
            } else {
                offences.extend(uses);
            }
        }
    }
    assert_none(
        "the reference that knows the fault belongs to campaigns in one process",
        &offences,
    );
    assert!(inside > 0, "the reference is not found at all: the rule looks for the wrong words");
    let table = autopilot::parameters::table();
    let known = table.iter().filter(|row| row.name.to_lowercase().contains("known"));
    assert_eq!(known.count(), 0, "no parameter selects the reference");
}

#[test]
fn only_the_studies_of_the_paper_name_effectors() {
    // All other code takes them from the aircraft's list, by kind and side.
    let allowed = [
        "icd/src/",
        "aircraft/",
        // The model that it writes without another place.
        "lab/studies/src/linearize.rs",
        "lab/paper/src/",
        // The columns of the paper's trajectories.
        "lab/judges/src/row.rs",
        // The bare exchange of packets, without an aircraft.
        "sitl/src/echo.rs",
        // Logs without a header come from versions with a single aircraft.
        "lab/logs/src/plot/flight.rs",
    ];
    let (mut offences, mut inside) = (Vec::new(), 0);
    for source in shipped() {
        let uses = source.uses(&["tvc_jet"]);
        if starts(&source.path, &allowed) {
            inside += uses.len();
        } else {
            // Its name or the name of a file of it, in quotes, is no effector.
            let is_name = |line: &String| {
                ["\"tvc_jet\"", "tvc_jet.toml", "tvc_jet_mach.toml"]
                    .iter()
                    .any(|n| line.contains(n))
            };
            offences.extend(uses.into_iter().filter(|line| !is_name(line)));
        }
    }
    assert_none("effectors are data", &offences);
    assert!(inside > 0, "no file names one: the rule looks for the wrong word");
}

#[test]
fn a_kind_of_fault_is_named_by_its_entry_and_by_what_it_does() {
    // So a new kind is an entry of the catalogue and its effect in the plant. Studies fly kinds of their choice.
    let allowed = ["icd/src/fault/catalogue", "plant-sim/dynamics/src/faults/", "lab/paper/src/"];
    let is_kind = |line: &String| {
        let names = line.split("FaultKind::").skip(1);
        names.into_iter().any(|rest| {
            let name: String =
                rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            name.starts_with(|c: char| c.is_uppercase())
                && name.contains(|c: char| c.is_lowercase())
        })
    };
    let (mut offences, mut inside) = (Vec::new(), 0);
    for source in shipped() {
        let found = source.uses(&["FaultKind::"]).into_iter().filter(is_kind);
        if starts(&source.path, &allowed) {
            inside += found.count();
        } else {
            offences.extend(found);
        }
    }
    assert_none("kinds of faults are data", &offences);
    assert!(inside > 0, "no file names a kind: the rule looks for the wrong word");
}

#[test]
fn a_fault_acts_in_one_module_of_the_plant() {
    // All other code forwards a kind, by the catalogue, without depending on it.
    let acts = ["plant-sim/dynamics/src/faults.rs", "plant-sim/dynamics/src/faults/"];
    let (mut offences, mut uses) = (Vec::new(), 0);
    let plant = files("plant-sim", &["rs"]).into_iter().filter(|one| one.path.contains("/src/"));
    for source in plant {
        let found = source.uses(&["FaultKind::"]);
        if starts(&source.path, &acts) {
            uses += found.len();
        } else {
            offences.extend(found);
        }
    }
    assert_none("only the module faults decides what a kind of fault does", &offences);
    assert!(uses > 0, "nothing acts: the rule looks for the wrong word");
}

#[test]
fn transcendental_functions_of_laws_and_plant_come_from_libm() {
    // Those of std differ from platform to platform, and with them the bits of a flight.
    let methods = [
        ".sin()",
        ".cos()",
        ".tan()",
        ".sin_cos()",
        ".asin()",
        ".acos()",
        ".atan()",
        ".atan2(",
        ".sinh()",
        ".cosh()",
        ".tanh()",
        ".exp()",
        ".exp_m1()",
        ".exp2()",
        ".ln()",
        ".ln_1p()",
        ".log(",
        ".log2()",
        ".log10()",
        ".powf(",
        ".powi(",
        ".cbrt()",
        ".hypot(",
        ".mul_add(",
    ];
    let pure =
        ["icd/src", "autopilot/flight-control/src", "plant-sim/dynamics/src", "plant-sim/src"];
    let mut offences = Vec::new();
    for source in shipped() {
        if starts(&source.path, &pure) {
            offences.extend(source.uses(&methods));
        }
    }
    assert_none("use libm::", &offences);
}

#[test]
fn no_file_is_longer_than_900_lines_before_its_tests() {
    let mut offences = Vec::new();
    for source in shipped() {
        let lines = source.lines().len();
        if lines > LINES_MAX {
            offences.push(format!("{}: {lines} lines", source.path));
        }
    }
    assert_none("split it", &offences);
}

#[test]
fn no_module_has_a_catch_all_name() {
    let strays = ["utils", "util", "common", "types", "helpers", "helper", "manager", "misc"];
    let mut offences = Vec::new();
    for source in files("", &["rs", "py"]) {
        let stem = source.path.rsplit('/').next().unwrap_or_default();
        let stem = stem.split('.').next().unwrap_or_default();
        let folders = source.path.split('/').any(|part| strays.contains(&part));
        if strays.contains(&stem) || folders {
            offences.push(source.path.clone());
        }
    }
    assert_none("name the file after what it is about", &offences);
}

#[test]
fn every_source_file_belongs_to_a_module() {
    // A file that no module declares is not compiled, so no compiler and no test would report it.
    let sources = shipped();
    let mut offences = Vec::new();
    for source in &sources {
        let (folder, file) = source.path.rsplit_once('/').unwrap_or_default();
        let (folder, name) = match file.trim_end_matches(".rs") {
            "lib" | "main" => continue,
            "mod" => folder.rsplit_once('/').unwrap_or_default(),
            name => (folder, name),
        };
        let parents =
            ["/lib.rs", "/main.rs", "/mod.rs", ".rs"].map(|ending| format!("{folder}{ending}"));
        let declares = |parent: &&Source| {
            let declaration = format!("mod {name}");
            parents.contains(&parent.path) && contains_word(&parent.text, &declaration)
        };
        if !sources.iter().any(|parent| declares(&parent)) {
            offences.push(source.path.clone());
        }
    }
    assert_none("no `mod` declares it", &offences);
}

#[test]
fn every_module_opens_with_its_place() {
    let mut offences = Vec::new();
    for source in shipped() {
        if !source.is_test() && !source.text.starts_with("//!") {
            offences.push(source.path.clone());
        }
    }
    assert_none("the first line describes the module", &offences);
}

#[test]
fn the_repository_has_no_unfinished_code_and_no_working_notes() {
    // Written in pieces, so that this file does not find itself.
    let words = [
        concat!("TO", "DO"),
        concat!("FIX", "ME"),
        concat!("XX", "X:"),
        concat!("unimplemented", "!("),
        concat!("/wo", "rk/"),
        concat!("/tmp/", "target"),
        concat!("Clau", "de"),
        concat!("Anthro", "pic"),
        concat!("Chat", "GPT"),
        concat!("language ", "model"),
    ];
    let mut offences = Vec::new();
    for source in files("", &["rs", "toml", "md", "py", "yml", "yaml", "sh", "txt"]) {
        for (number, line) in source.text.lines().enumerate() {
            if words.iter().any(|word| line.contains(word)) {
                offences.push(format!("{}:{}: {}", source.path, number + 1, line.trim()));
            }
        }
    }
    assert_none("not for the repository", &offences);
}
