//! Which rows of a damaged log have a time that can be drawn.
//!
//! A flipped bit in one timestamp would stretch every axis to centuries. So a row is drawn if its time fits between
//! those of its neighbours, and lies in the part of the flight that most rows are in.

use std::collections::HashMap;

use ulog::reader::{Log, Topic};

/// A longer gap between two rows is none of a flight, us: a log has a row each 20 ms, and a damaged place of this
/// length would be tens of megabytes.
const GAP_MAX_US: u64 = 600_000_000;

/// The rows of each topic that can be drawn.
#[derive(Debug, Default)]
pub struct Times {
    /// Numbers of the rows, for topics of which some cannot be drawn.
    drawn: HashMap<String, Vec<usize>>,
    /// First and last time, us; `None` without a row.
    pub span_us: Option<(u64, u64)>,
    /// Rows that are not drawn.
    pub strays: usize,
    /// Topic and time of the first of them, us.
    pub first_stray: Option<(String, u64)>,
}

impl Times {
    /// Of a log, whose topics `ticking` give its span.
    pub fn of(log: &Log, ticking: &[&str]) -> Self {
        let mut times = Self::default();
        let topics: Vec<Topic<'_>> = log.topics().filter(|topic| topic.multi_id() == 0).collect();
        let in_order: Vec<(Vec<u64>, Vec<usize>)> = topics
            .iter()
            .map(|topic| {
                let us = topic.times_us();
                let rows = longest_in_order(&us);
                (us, rows)
            })
            .collect();
        let is_ticking = |topic: &Topic<'_>| ticking.contains(&topic.name());
        let all = topics.iter().zip(&in_order).filter(|(topic, _)| is_ticking(topic));
        let mut all: Vec<u64> =
            all.flat_map(|(_, (us, rows))| rows.iter().map(|row| us[*row])).collect();
        all.sort_unstable();
        let Some(span) = densest(&all) else { return times };
        times.span_us = Some(span);
        for (topic, (us, mut rows)) in topics.iter().zip(in_order) {
            rows.retain(|row| (span.0..=span.1).contains(&us[*row]) || !is_ticking(topic));
            if rows.len() == us.len() {
                continue;
            }
            times.strays += us.len() - rows.len();
            let mut next = rows.iter().copied().peekable();
            let stray = (0..us.len()).find(|row| next.next_if_eq(row).is_none());
            let stray = stray.map(|row| (topic.name().to_owned(), us[row]));
            times.first_stray = times.first_stray.take().or(stray);
            times.drawn.insert(topic.name().to_owned(), rows);
        }
        times
    }

    /// What is left of the values of a topic's rows.
    pub fn keep<T: Copy>(&self, topic: &str, values: Vec<T>) -> Vec<T> {
        match self.drawn.get(topic) {
            None => values,
            Some(rows) => rows.iter().filter_map(|row| values.get(*row).copied()).collect(),
        }
    }

    /// Why some rows are not drawn, in words; `None` where all are.
    pub fn remark(&self) -> Option<String> {
        let (topic, us) = self.first_stray.as_ref()?;
        let (rows, verb) = if self.strays == 1 { ("row", "is") } else { ("rows", "are") };
        let t_s = *us as f64 * 1.0e-6;
        Some(format!(
            "{} {rows} {verb} not drawn, because the time does not fit between those of the neighbours \
             (the first: a row of {topic} at {t_s:.3} s); the log is damaged there",
            self.strays
        ))
    }
}

/// Numbers of the longest part of `us` in which no time is earlier than the one before.
fn longest_in_order(us: &[u64]) -> Vec<usize> {
    if us.is_sorted() {
        return (0..us.len()).collect();
    }
    // The row that ends the best part of each length, and the row before each row in its best part.
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = Vec::with_capacity(us.len());
    for (row, time) in us.iter().enumerate() {
        let length = ends.partition_point(|end| us[*end] <= *time);
        before.push(length.checked_sub(1).map(|last| ends[last]));
        match ends.get_mut(length) {
            Some(end) => *end = row,
            None => ends.push(row),
        }
    }
    let mut rows = Vec::with_capacity(ends.len());
    let mut at = ends.last().copied();
    while let Some(row) = at {
        rows.push(row);
        at = before[row];
    }
    rows.reverse();
    rows
}

/// First and last of the part with the most times that has no gap longer than [`GAP_MAX_US`]; `us` is sorted.
fn densest(us: &[u64]) -> Option<(u64, u64)> {
    let parts = us.chunk_by(|a, b| b - a <= GAP_MAX_US);
    let largest = parts.reduce(|a, b| if b.len() > a.len() { b } else { a })?;
    Some((*largest.first()?, *largest.last()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_does_not_fit_between_its_neighbours_is_left_out() {
        assert_eq!(longest_in_order(&[0, 2, 2, 6]), [0, 1, 2, 3]);
        assert_eq!(longest_in_order(&[0, 2, 1 << 60, 6, 8]), [0, 1, 3, 4]);
        assert_eq!(longest_in_order(&[1 << 60, 2, 4, 6]), [1, 2, 3]);
        assert_eq!(longest_in_order(&[0, 2, 4, 1, 8]), [0, 1, 2, 4]);
        assert_eq!(longest_in_order(&[]), [0; 0]);
    }

    #[test]
    fn the_span_is_that_of_most_rows() {
        assert_eq!(densest(&[]), None);
        assert_eq!(densest(&[5]), Some((5, 5)));
        assert_eq!(densest(&[0, 10, 20, u64::MAX]), Some((0, 20)));
        assert_eq!(densest(&[0, GAP_MAX_US]), Some((0, GAP_MAX_US)));
        assert_eq!(densest(&[0, 2 * GAP_MAX_US, 2 * GAP_MAX_US + 1]).unwrap().0, 2 * GAP_MAX_US);
    }
}
