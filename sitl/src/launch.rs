//! `sitl` without a subcommand: starts the two processes, shows the flight, ends both.
//!
//! The children end when their standard input ends, so they do not outlive this process, however it ends.

use std::io;
use std::path::Path;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use host_io::{Stop, clock};

use crate::arrangement::{self, Arrangement};

mod args;
mod child;
mod screen;

pub use args::{LaunchArgs, OptionError};
use child::{Child, News, Report};
use screen::Screen;

/// How often the children are looked after.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Time for the autopilot to say where it listens.
const START_MAX: Duration = Duration::from_secs(10);
/// Time for a child to end when it is told to.
const END_MAX: Duration = Duration::from_secs(2);

/// Why the flight could not go on.
#[derive(Debug, thiserror::Error)]
pub enum LaunchError {
    /// An option or a file that it names is wrong.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// A child cannot be started.
    #[error("cannot start {process}: {source}")]
    Start {
        /// Which one.
        process: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// A child ended.
    #[error("{process} ended ({status}); the last thing it said: {message}")]
    Ended {
        /// Which one.
        process: &'static str,
        /// How.
        status: ExitStatus,
        /// Its last line.
        message: String,
    },
    /// The autopilot does not say where it listens.
    #[error("the autopilot has not started after {START_MAX:?}")]
    Silent,
    /// The system refuses signals or output.
    #[error("sitl: {0}")]
    System(#[from] io::Error),
}

/// Flies until the operator ends it. `program` is the `sitl` executable.
///
/// Call it before the process starts any thread: it changes how the process takes signals.
///
/// # Errors
/// [`LaunchError`] when a child cannot be started or ends.
pub fn run(args: &LaunchArgs, program: &Path) -> Result<(), LaunchError> {
    let stop = Stop::new();
    stop.on_signals()?;
    let options = args.check()?;
    let mut screen = Screen::new();
    let arrangement = if args.is_as_fast_as_possible() {
        let fastest = arrangement::fastest(program);
        screen.say(&format!(
            "fastest here: {}, {:.0} bare round trips/s",
            fastest.arrangement, fastest.round_trips_per_s
        ))?;
        fastest.arrangement
    } else {
        Arrangement::UNPINNED
    };
    let reports = News::channel();
    let mut words = vec!["autopilot".to_owned(), "--status".to_owned()];
    words.extend(options.autopilot);
    words.extend(arrangement.autopilot.options());
    let mut autopilot = Child::start("autopilot", program, &words, &reports)?;
    let result = fly(
        &mut autopilot,
        |plant_link| {
            let mut words = vec!["plant-sim".to_owned(), "--autopilot".to_owned(), plant_link];
            words.extend(options.plant.clone());
            words.extend(arrangement.plant.options());
            Child::start("plant-sim", program, &words, &reports)
        },
        &reports,
        &mut screen,
        &stop,
        args,
    );
    screen.end();
    result
}

/// Starts the plant once the autopilot listens, and watches both until something ends the flight.
fn fly(
    autopilot: &mut Child,
    start_plant: impl Fn(String) -> Result<Child, LaunchError>,
    news: &News,
    screen: &mut Screen,
    stop: &Stop,
    args: &LaunchArgs,
) -> Result<(), LaunchError> {
    let began = clock::now();
    let mut plant: Option<Child> = None;
    let result = loop {
        if stop.is_requested() {
            break Ok(());
        }
        match news.next(LOOK_EVERY) {
            Some(Report::Listening(address)) => {
                plant = Some(start_plant(address.to_string())?);
                screen.introduce(&args.ground_stations())?;
            }
            Some(Report::Status(status)) => screen.status(&status, clock::now())?,
            Some(Report::Said { process, line }) => {
                screen.say(&format!("{process}: {line}"))?;
                for child in plant.iter_mut().chain([&mut *autopilot]) {
                    child.hear(process, &line);
                }
            }
            None => {}
        }
        if let Some(error) = [Some(&mut *autopilot), plant.as_mut()]
            .into_iter()
            .flatten()
            .find_map(|child| child.ended(news, screen))
        {
            break Err(error);
        }
        if plant.is_none() && clock::now() - began > START_MAX {
            break Err(LaunchError::Silent);
        }
    };
    let deadline: Instant = clock::now() + END_MAX;
    for child in plant.iter_mut().chain([autopilot]) {
        child.end(deadline);
    }
    result
}
