//! The parts of logs that one ground station waits for.

use arrayvec::ArrayVec;

use super::job::LogFile;

/// Parts that may wait: MAVProxy asks for twenty gaps in a row.
pub(super) const PARTS_MAX: usize = 24;

/// Whoever asks for no more than this at once asks when it has the piece before.
const PIECE: u32 = 64 * 1024;

/// A part of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    /// Number of the log, as the ground station says it.
    pub id: u16,
    /// The log, once it is known which one that is.
    pub log: Option<LogFile>,
    /// It turned out to be gone, or shorter than it was.
    pub is_gone: bool,
    /// Next byte.
    pub offset: u32,
    /// First byte that is not wanted; may be beyond the end of the log.
    pub end: u64,
    /// One of several that are asked for one after the other.
    pub is_piece: bool,
}

impl Part {
    pub fn new(id: u16, offset: u32, count: u32) -> Self {
        let end = u64::from(offset) + u64::from(count);
        Self { id, log: None, is_gone: false, offset, end, is_piece: count <= PIECE }
    }

    /// Nothing more of it is wanted.
    pub fn is_over(&self) -> bool {
        u64::from(self.offset) >= self.end
    }

    fn overlaps(&self, other: &Self) -> bool {
        u64::from(self.offset) < other.end && u64::from(other.offset) < self.end
    }
}

/// Parts in the order in which they are sent.
#[derive(Debug, Default)]
pub(super) struct Ranges {
    parts: ArrayVec<Part, PARTS_MAX>,
}

impl Ranges {
    /// Takes a new request. Another log, or something that is on its way already, takes the place of all
    /// that waits: the ground station has begun anew. Gaps elsewhere in the same log wait behind.
    pub fn ask(&mut self, part: Part) {
        let begins_anew = |old: &Part| old.id != part.id || old.overlaps(&part);
        if self.parts.iter().any(begins_anew) {
            self.parts.clear();
        }
        // One more than fit is asked for again by whoever misses it.
        let _ = self.parts.try_push(part);
    }

    pub fn clear(&mut self) {
        self.parts.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    pub fn first(&self) -> Option<&Part> {
        self.parts.first()
    }

    pub fn first_mut(&mut self) -> Option<&mut Part> {
        self.parts.first_mut()
    }

    /// The log is gone: its first part is to say so, and the others are not wanted any more. All parts are of
    /// one log. Its number, if it was this log that is wanted.
    pub fn lose(&mut self, name: &str) -> Option<u16> {
        let part = self.parts.first_mut()?;
        part.log.as_ref().filter(|log| log.name == name)?;
        part.is_gone = true;
        let id = part.id;
        self.parts.truncate(1);
        Some(id)
    }

    /// The first part is done.
    pub fn drop_first(&mut self) {
        if !self.parts.is_empty() {
            self.parts.remove(0);
        }
    }

    /// Says which logs the numbers mean; parts that know theirs keep it.
    pub fn resolve(&mut self, listing: &[LogFile]) {
        for part in self.parts.iter_mut().filter(|part| part.log.is_none()) {
            part.log = listing.get(usize::from(part.id)).cloned();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offsets(ranges: &Ranges) -> Vec<u32> {
        ranges.parts.iter().map(|part| part.offset).collect()
    }

    #[test]
    fn gaps_of_one_log_wait_behind_each_other_and_a_new_beginning_replaces_them() {
        let mut ranges = Ranges::default();
        for gap in 0..20 {
            ranges.ask(Part::new(0, gap * 900, 90));
        }
        assert_eq!(offsets(&ranges).len(), 20);
        ranges.ask(Part::new(0, 90, 1_000_000));
        assert_eq!(offsets(&ranges), [90], "it covers what waited");
        ranges.ask(Part::new(1, 5_000_000, 90));
        assert_eq!(offsets(&ranges), [5_000_000], "another log");
        for gap in 0..1000 {
            ranges.ask(Part::new(1, gap * 90, 90));
        }
        assert_eq!(offsets(&ranges).len(), PARTS_MAX);
        ranges.ask(Part::new(1, u32::MAX, u32::MAX));
        assert!(!ranges.first().unwrap().is_over());
    }
}
