//! How simulation time passes, as far as the launcher knows, and what a key makes of it.

use icd::pace::Pace;
use plant_sim::io::Speed;

use super::keys::Key;

/// Below this part of the speed that was asked for, both are shown.
const KEEPS_UP: f64 = 0.9;

/// Standing still, and speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passing {
    /// Time stands still.
    pub(super) paused: bool,
    /// Where it runs, so many times as fast as wall time; `None`: as fast as possible.
    pub(super) speed: Option<f64>,
}

impl Passing {
    pub(super) fn new(paused: bool, speed: Speed) -> Self {
        match speed {
            Speed::Max => Self { paused, speed: None },
            Speed::Times(factor) => Self { paused, speed: Some(factor) },
        }
    }

    /// The order to the plant that a key stands for, in the words that the plant takes from its parent.
    ///
    /// What it leads to is assumed here, so that the next key means the right thing; the plant then says
    /// what is true. `achieved` is the speed of the last second, if it is known.
    pub(super) fn order(&mut self, key: Key, achieved: Option<f64>) -> Option<String> {
        match key {
            Key::PauseOrRun => {
                self.paused = !self.paused;
                Some(if self.paused { "pause" } else { "run" }.to_owned())
            }
            Key::Step(periods) => {
                self.paused = true;
                Some(format!("step {periods}"))
            }
            Key::Slower => Some(self.at(self.speed.unwrap_or_else(|| round(achieved)) / 2.0)),
            Key::Faster => self.speed.map(|speed| self.at(speed * 2.0)),
            Key::RealTime => Some(self.at(1.0)),
            Key::Quit | Key::Suspend => None,
        }
    }

    fn at(&mut self, speed: f64) -> String {
        let (slowest, fastest) = Pace::SPEED;
        let speed = speed.clamp(slowest, fastest);
        self.speed = Some(speed);
        format!("speed {speed}")
    }

    /// For the operator, with what is achieved if that is known.
    pub(super) fn words(&self, achieved: Option<f64>) -> String {
        match (self.paused, self.speed, achieved) {
            (true, _, _) => "PAUSED".to_owned(),
            (false, None, None) => "max".to_owned(),
            (false, None, Some(achieved)) => format!("max {}", factor(achieved)),
            (false, Some(wanted), None) => factor(wanted),
            (false, Some(wanted), Some(achieved)) if achieved < KEEPS_UP * wanted => {
                format!("{} of {}", factor(achieved), factor(wanted))
            }
            (false, Some(_), Some(achieved)) => factor(achieved),
        }
    }
}

/// The power of two below a speed, so that halving gives numbers that can be read.
fn round(achieved: Option<f64>) -> f64 {
    achieved.filter(|speed| *speed >= 1.0).map_or(1.0, |speed| speed.log2().floor().exp2())
}

fn factor(speed: f64) -> String {
    match speed {
        ..0.0995 => format!("x{speed:.3}"),
        ..0.995 => format!("x{speed:.2}"),
        _ => format!("x{speed:.1}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn space_pauses_and_runs_and_a_step_pauses() {
        let mut time = Passing::new(false, Speed::REAL_TIME);
        let mut press = |key| time.order(key, None);
        assert_eq!(press(Key::PauseOrRun).as_deref(), Some("pause"));
        assert_eq!(press(Key::PauseOrRun).as_deref(), Some("run"));
        assert_eq!(press(Key::Step(100)).as_deref(), Some("step 100"));
        assert_eq!(press(Key::PauseOrRun).as_deref(), Some("run"));
        assert_eq!(press(Key::Quit), None);
    }

    #[test]
    fn speeds_halve_and_double_inside_the_limits() {
        let mut time = Passing::new(false, Speed::REAL_TIME);
        assert_eq!(time.order(Key::Slower, None).as_deref(), Some("speed 0.5"));
        assert_eq!(time.order(Key::Faster, None).as_deref(), Some("speed 1"));
        for _ in 0..20 {
            time.order(Key::Slower, None);
        }
        assert_eq!(time.speed, Some(0.01));
        for _ in 0..20 {
            time.order(Key::Faster, None);
        }
        assert_eq!(time.speed, Some(1_000.0));
        assert_eq!(time.order(Key::RealTime, None).as_deref(), Some("speed 1"));
    }

    #[test]
    fn from_as_fast_as_possible_it_goes_to_half_of_what_was_achieved() {
        let mut time = Passing::new(false, Speed::Max);
        assert_eq!(time.order(Key::Faster, Some(40.0)), None);
        assert_eq!(time.order(Key::Slower, Some(40.0)).as_deref(), Some("speed 16"));
        let mut time = Passing::new(false, Speed::Max);
        assert_eq!(time.order(Key::Slower, None).as_deref(), Some("speed 0.5"));
    }

    #[test]
    fn the_operator_reads_what_is_wanted_until_it_is_known_what_is_achieved() {
        let words = |paused, speed, achieved| Passing { paused, speed }.words(achieved);
        assert_eq!(words(true, Some(1.0), Some(1.0)), "PAUSED");
        assert_eq!(words(false, None, None), "max");
        assert_eq!(words(false, None, Some(35.21)), "max x35.2");
        assert_eq!(words(false, Some(0.25), None), "x0.25");
        assert_eq!(words(false, Some(0.02), Some(0.02)), "x0.020");
        assert_eq!(words(false, Some(1.0), Some(0.999)), "x1.0");
        assert_eq!(words(false, Some(100.0), Some(35.0)), "x35.0 of x100.0");
    }
}
