//! Whether the plant is there, judged by the time since it was heard.

use std::time::Duration;

use crate::clock::WallTime;

/// A plant that is silent for longer is lost, and another one may take its place.
pub const SILENCE_MAX: Duration = Duration::from_secs(1);

/// When the plant was heard last.
///
/// Reading a clock for each packet would cost more than the packet's other bookkeeping, so a packet only
/// leaves a mark, and the next look at the clock turns the mark into a time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Presence {
    heard: bool,
    last_heard: WallTime,
    lost: bool,
}

impl Presence {
    /// A packet of the plant came. True if the plant was lost before.
    pub fn hear(&mut self) -> bool {
        self.heard = true;
        std::mem::take(&mut self.lost)
    }

    /// Looks at the clock. True if the plant is lost since this look.
    pub fn look(&mut self, now: WallTime) -> bool {
        if std::mem::take(&mut self.heard) {
            self.last_heard = now;
        }
        let lost_now = !self.lost && now.since(self.last_heard) > SILENCE_MAX;
        self.lost |= lost_now;
        lost_now
    }

    /// Whether the plant was lost at the last look and not heard since.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> WallTime {
        WallTime::from_micros(1_000 * ms)
    }

    #[test]
    fn a_plant_is_lost_once_after_a_second_of_silence_and_comes_back() {
        let mut presence = Presence::default();
        presence.hear();
        assert!(!presence.look(ms(5_000)));
        assert!(!presence.look(ms(6_000)));
        assert!(presence.look(ms(6_001)));
        assert!(!presence.look(ms(7_000)), "told once");
        assert!(presence.is_lost());
        assert!(presence.hear());
        assert!(!presence.hear());
        assert!(!presence.look(ms(9_000)));
        assert!(!presence.is_lost());
    }
}
