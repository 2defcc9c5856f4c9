//! What the inertial navigation did in the last moments, for measurements that arrive late.
//!
//! The integrals of the acceleration and of that integral lead from the present estimate back to the time of measurement, with
//! every correction since then in it.

use icd::SimTime;
use nalgebra::Vector3;

/// Entries.
// With one entry each 10 ms this is 0.64 s; a fix that is older counts as late.
const ENTRIES: usize = 64;

/// Integrals of the inertial navigation since its start, without any correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals {
    /// Time.
    pub time: SimTime,
    /// ∫ a dt, m/s, start axes: acceleration relative to the ground.
    pub velocity: Vector3<f64>,
    /// ∬ a dt, m.
    pub position: Vector3<f64>,
}

impl Integrals {
    /// At the start.
    pub fn at(time: SimTime) -> Self {
        Self { time, velocity: Vector3::zeros(), position: Vector3::zeros() }
    }
}

/// Differences of velocity and position between a moment and the present.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Since {
    /// Age, s.
    pub seconds: f64,
    /// Present velocity minus that of the moment, m/s.
    pub velocity: Vector3<f64>,
    /// Present position minus that of the moment, m, less age times present velocity.
    pub bend: Vector3<f64>,
}

/// The integrals at moments of the past: a ring of fixed size.
#[derive(Debug, Clone)]
pub struct History {
    entries: [Integrals; ENTRIES],
    /// Place of the next entry.
    next: usize,
    count: usize,
}

impl History {
    /// Time between two entries, µs.
    pub const EVERY_US: u64 = 10_000;

    /// Without entries.
    pub fn empty() -> Self {
        Self { entries: [Integrals::at(SimTime::ZERO); ENTRIES], next: 0, count: 0 }
    }

    /// Remembers the present where the last entry is old enough.
    pub fn remember(&mut self, now: &Integrals) {
        let due = |last: &Integrals| now.time.as_micros() >= last.time.as_micros() + Self::EVERY_US;
        if self.latest().is_none_or(due) {
            self.entries[self.next] = *now;
            self.next = (self.next + 1) % ENTRIES;
            self.count = (self.count + 1).min(ENTRIES);
        }
    }

    fn latest(&self) -> Option<&Integrals> {
        (self.count > 0).then(|| self.back(0))
    }

    /// The entry `steps` before the latest.
    fn back(&self, steps: usize) -> &Integrals {
        // The added size keeps the unsigned difference above zero.
        &self.entries[(self.next + 2 * ENTRIES - 1 - steps) % ENTRIES]
    }

    /// From a moment to the present; `None` if it is older than the oldest entry, or later than the present.
    pub fn since(&self, moment: SimTime, now: &Integrals) -> Option<Since> {
        if moment > now.time {
            return None;
        }
        let mut later = *now;
        for steps in 0..self.count {
            let entry = *self.back(steps);
            if entry.time <= moment {
                return Some(between(&entry, &later, moment, now));
            }
            later = entry;
        }
        None
    }
}

/// Seconds from one time to a later one.
fn seconds(from: SimTime, to: SimTime) -> f64 {
    to.as_micros().saturating_sub(from.as_micros()) as f64 * 1.0e-6
}

/// With an acceleration that is constant between two entries.
fn between(entry: &Integrals, later: &Integrals, moment: SimTime, now: &Integrals) -> Since {
    let (step, into) = (seconds(entry.time, later.time), seconds(entry.time, moment));
    // The present may itself be the last entry.
    let acceleration = match step > 0.0 {
        true => (later.velocity - entry.velocity) / step,
        false => Vector3::zeros(),
    };
    let velocity = entry.velocity + acceleration * into;
    let position = entry.position + entry.velocity * into + acceleration * (0.5 * into * into);
    let age = seconds(moment, now.time);
    Since {
        seconds: age,
        velocity: now.velocity - velocity,
        bend: now.position - position - now.velocity * age,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_of_a_constant_acceleration_is_found_exactly() {
        let mut history = History::empty();
        let a = Vector3::new(1.0, -2.0, 0.5);
        let at = |micros: u64| {
            let t = micros as f64 * 1.0e-6;
            let time = SimTime::from_micros(micros);
            Integrals { time, velocity: a * t, position: a * (0.5 * t * t) }
        };
        for tick in 0..1_000 {
            history.remember(&at(2_000 * tick));
        }
        let now = at(1_998_000);
        history.remember(&now);
        for age_us in [0_u64, 1_234, 10_000, 123_456, 600_000] {
            let t = age_us as f64 * 1.0e-6;
            let since = history.since(SimTime::from_micros(1_998_000 - age_us), &now).unwrap();
            assert!((since.seconds - t).abs() < 1.0e-12);
            assert!((since.velocity - a * t).norm() < 1.0e-12);
            // v t - a t²/2 back, so the bend is -a t²/2.
            assert!((since.bend + a * (0.5 * t * t)).norm() < 1.0e-11, "{age_us} us");
        }
        assert_eq!(history.since(SimTime::from_micros(1_000_000), &now), None, "too old");
        assert_eq!(history.since(SimTime::from_micros(1_998_001), &now), None, "in the future");
    }
}
