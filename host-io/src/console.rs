//! Log lines for the operator on the standard error.

use std::io::IsTerminal;

use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

/// The environment variable that selects the lines, for example `debug` or `info,autopilot=trace`.
const VARIABLE: &str = "RUST_LOG";

/// Shows `info` and above; the environment variable `RUST_LOG` changes that.
///
/// A second call changes nothing.
pub fn show() {
    let directives = std::env::var(VARIABLE).unwrap_or_default();
    let (shown, problem) = match targets(&directives) {
        Ok(targets) => (targets, None),
        Err(problem) => (Targets::new().with_default(LevelFilter::INFO), Some(problem)),
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        // If the reader is gone, the flight continues.
        .log_internal_errors(false);
    // An error means that a logger is installed already.
    let is_first = tracing_subscriber::registry().with(shown).with(lines).try_init().is_ok();
    if let (Some(problem), true) = (problem, is_first) {
        tracing::warn!("{VARIABLE}: {directives:?} is not used: {problem}");
    }
}

/// Targets and their levels; a target without a level shows `info` and above.
fn targets(directives: &str) -> Result<Targets, tracing_subscriber::filter::ParseError> {
    let targets = match directives.trim() {
        "" => Targets::new(),
        directives => directives.parse()?,
    };
    Ok(match targets.default_level() {
        Some(_) => targets,
        None => targets.with_default(LevelFilter::INFO),
    })
}

#[cfg(test)]
mod tests {
    use tracing::Level;

    use super::*;

    #[test]
    fn lines_are_shown_from_info_on_unless_the_variable_sets_another_level() {
        let shows = |directives: &str, target, level| {
            targets(directives).unwrap().would_enable(target, &level)
        };
        assert!(shows("", "any", Level::INFO));
        assert!(!shows("", "any", Level::DEBUG));
        assert!(shows("debug", "any", Level::DEBUG));
        assert!(shows("autopilot=trace", "autopilot::run", Level::TRACE));
        assert!(shows("autopilot=trace", "plant_sim", Level::INFO));
        assert!(!shows("autopilot=off", "autopilot", Level::ERROR));
        assert!(targets("autopilot=loud").is_err());
    }
}
