//! A law that a program brings flies in every command that flies a law, and its failure is an error there.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use autopilot::own_law::OwnLaw;
use flight_control::main_controller::pid::Pid;
use flight_control::{Gains, Law, LawInput, MainCommand, Visitor};
use lab_engine::law::{FallibleLaw, fallible};
use sitl::cli::{self, Cli};

/// The PID, with a counter of steps that the caller keeps.
#[derive(Clone)]
struct Counted {
    pid: Pid,
    steps: Arc<AtomicU64>,
}

impl Law for Counted {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let _ = self.steps.fetch_add(1, Ordering::Relaxed);
        self.pid.step(input)
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        self.pid.states(visit);
    }
}

/// Fails after half a second.
struct Short {
    pid: Pid,
    left: u32,
}

impl FallibleLaw for Short {
    fn step(&mut self, input: &LawInput<'_>) -> Result<MainCommand, Box<dyn Error + Send + Sync>> {
        self.left = self.left.checked_sub(1).ok_or("the tape is at its end")?;
        Ok(self.pid.step(input))
    }

    fn copy(&self) -> Option<Box<dyn FallibleLaw>> {
        Some(Box::new(Self { pid: self.pid.clone(), left: self.left }))
    }
}

fn pid() -> Pid {
    Pid::new(&Gains::REFERENCE.pid)
}

fn short() -> OwnLaw {
    fallible("tape", || Box::new(Short { pid: pid(), left: 250 }))
}

/// A command line with a law, or without one.
fn sitl(words: &[&str], own: Option<&OwnLaw>) -> Result<u8, String> {
    let words = ["sitl"].iter().chain(words).map(std::ffi::OsString::from);
    let mut cli = Cli::read(words).expect("a right command line");
    if let Some(own) = own {
        cli.set_own_law(own);
    }
    cli::run(&cli, Path::new("sitl"), own.cloned().as_slice()).map_err(|error| error.to_string())
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn every_command_that_flies_a_law_flies_the_law_of_the_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let fly = path("fly");
    let log = path("fly/flight.ulg");
    let [study, mission, campaign, again] = ["study", "mission", "campaign", "again"].map(path);
    let short = "plant.duration_s=3";
    for words in [
        &["fly", "case1", "--out", &fly, "--ulog", "--figures", "--set", short][..],
        &["replay", &log],
        &["study", "engine-fade", "--samples", "1", "--out", &study, "--set", short],
        &["mission", "--out", &mission],
        &["margins", "--no-flights", "--ftc", "off"],
        &["campaign", "run", "smoke", "--out", &campaign],
        &["campaign", "replay", "smoke", "--run", "2", "--out", &again],
    ] {
        let steps = Arc::new(AtomicU64::new(0));
        let law = Counted { pid: pid(), steps: Arc::clone(&steps) };
        let own = OwnLaw::new("counted", move || law.clone());
        assert_eq!(sitl(words, Some(&own)), Ok(0), "{words:?}");
        assert!(steps.load(Ordering::Relaxed) > 1_000, "{words:?} has flown another law");
    }
    // It is the PID, and every result says its name.
    let outcome: serde_json::Value =
        serde_json::from_str(&read(&folder.path().join("fly/outcome.json"))).expect("JSON");
    assert_eq!(
        (outcome["law"].as_str(), outcome["own_law"].as_str()),
        (Some("own"), Some("counted"))
    );
    assert!(read(&folder.path().join("campaign/summary.csv")).contains("counted"));
    assert!(read(&folder.path().join("fly/flight.html")).contains("own: counted"));
    let other = path("pid");
    assert_eq!(sitl(&["fly", "case1", "--out", &other, "--set", short], None), Ok(0));
    let table = |name: &str| read(&folder.path().join(name).join("flight.csv"));
    assert_eq!(table("fly"), table("pid"), "the same law by another way");
    // An option selects another law, and a log of the law needs it.
    let steps = Arc::new(AtomicU64::new(0));
    let law = Counted { pid: pid(), steps: Arc::clone(&steps) };
    let own = OwnLaw::new("counted", move || law.clone());
    assert_eq!(
        sitl(&["fly", "case1", "--law", "ndi", "--set", short, "--out", &path("ndi")], Some(&own)),
        Ok(0)
    );
    assert_eq!(steps.load(Ordering::Relaxed), 0);
    let outcome: serde_json::Value =
        serde_json::from_str(&read(&folder.path().join("ndi/outcome.json"))).expect("JSON");
    assert!(outcome["own_law"].is_null(), "{}", outcome["own_law"]);
    assert_eq!(sitl(&["replay", &log], None), Ok(2));
}

#[test]
fn a_law_that_fails_is_an_error_of_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let own = short();
    assert_eq!(sitl(&["fly", "case1"], Some(&own)), Ok(2));
    for words in [
        &["mission", "--out", &path("mission")][..],
        &["margins", "--no-flights", "--ftc", "off"],
        &["campaign", "replay", "smoke", "--run", "2"],
    ] {
        let message = sitl(words, Some(&own)).expect_err("the law fails");
        assert!(message.ends_with("the law has failed: the tape is at its end"), "{message}");
    }
    // A campaign goes on with the other laws, and counts what was not flown.
    let campaign = path("campaign");
    let words = ["campaign", "run", "smoke", "--out", &campaign];
    assert_eq!(sitl(&words, Some(&own)), Ok(0));
    let summary = read(&folder.path().join("campaign/summary.csv"));
    assert!(summary.contains("tape,16,0,0,16,"), "all of them have failed: {summary}");
}
