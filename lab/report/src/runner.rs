//! Runs over all cores, with progress on standard error.
//!
//! The order of the results is that of the items, whatever the threads do, so the outcome of a campaign does
//! not depend on how many there are.

use std::cell::Cell;
use std::io::{IsTerminal, Write as _, stderr};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use host_io::{clock, console};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::prelude::*;

/// What is over within this time needs no progress.
const PROGRESS_DELAY: Duration = Duration::from_secs(2);

/// Without a terminal, a line is printed each time this share of the runs is done, percent.
const LINE_EVERY_PERCENT: usize = 20;

/// Applies `run` to every item on all cores.
///
/// `label` stands before the progress: a bar on a terminal, plain lines elsewhere.
pub fn map<T: Sync, R: Send>(label: &str, items: &[T], run: impl Fn(&T) -> R + Sync) -> Vec<R> {
    map_with(&Progress::new(label, "runs", items.len()), items, run)
}

/// The same, without a word as long as it takes no longer than two seconds.
pub fn map_quietly<T: Sync, R: Send>(
    label: &str,
    items: &[T],
    run: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    map_with(&Progress::new(label, "flights", items.len()).quiet_at_first(), items, run)
}

fn map_with<T: Sync, R: Send>(
    progress: &Progress,
    items: &[T],
    run: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let one = |item: &T| {
        // Also before: each part of the items would begin one more.
        check_interrupt();
        let result = run(item);
        progress.one_done();
        result
    };
    let results = items.par_iter().map(one).collect();
    progress.finish();
    results
}

/// Callers whose work may be interrupted; the flag is theirs together, as Ctrl-C is.
static ACTIVE: AtomicUsize = AtomicUsize::new(0);
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

thread_local! {
    static THREAD_INTERRUPTED: Cell<bool> = const { Cell::new(false) };
}

/// What work unwinds with that was interrupted. What it has written stays.
#[derive(Debug)]
pub struct Interrupted;

/// As long as it is there, [`interrupt`] ends all work of this process that reports its progress.
#[derive(Debug)]
pub struct Interruptible(());

impl Interruptible {
    pub fn begin() -> Self {
        THREAD_INTERRUPTED.set(false);
        let _ = ACTIVE.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Interruptible {
    fn drop(&mut self) {
        if ACTIVE.fetch_sub(1, Ordering::SeqCst) == 1 {
            INTERRUPTED.store(false, Ordering::SeqCst);
        }
    }
}

/// Ends the work: each thread that reports progress next unwinds with [`Interrupted`].
pub fn interrupt() {
    INTERRUPTED.store(ACTIVE.load(Ordering::SeqCst) > 0, Ordering::SeqCst);
}

/// Ends the work of this thread alone, in the same way.
pub fn interrupt_thread() {
    THREAD_INTERRUPTED.set(true);
}

/// Unwinds where the work was interrupted: nothing but the caller of [`Interruptible::begin`] catches that.
pub fn check_interrupt() {
    if INTERRUPTED.load(Ordering::Relaxed) || THREAD_INTERRUPTED.get() {
        std::panic::resume_unwind(Box::new(Interrupted));
    }
}

/// Reports how far something long is, with its rate and the time left.
#[derive(Debug)]
pub struct Progress {
    label: String,
    /// What is counted, in the plural.
    what: &'static str,
    total: usize,
    done: AtomicUsize,
    bar: Option<ProgressBar>,
    /// Nothing is shown before.
    from: Option<Instant>,
    begun: Instant,
}

impl Progress {
    /// Nothing is done yet; `what` is counted.
    pub fn new(label: &str, what: &'static str, total: usize) -> Self {
        let bar = stderr().is_terminal().then(|| {
            let length = u64::try_from(total).unwrap_or(u64::MAX);
            let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
            let template = "{msg:32} [{bar:40}] {pos}/{len} {prefix}, {per_sec}, {eta} left";
            // The template is constant; without it the bar would still count.
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style.progress_chars("=> "));
            }
            bar.with_message(console::shown(label).into_owned()).with_prefix(what)
        });
        let begun = clock::now();
        Self {
            label: label.to_owned(),
            what,
            total,
            done: AtomicUsize::new(0),
            bar,
            from: None,
            begun,
        }
    }

    /// Nothing is shown of what is over within `PROGRESS_DELAY`.
    #[must_use]
    pub fn quiet_at_first(mut self) -> Self {
        self.from = Some(clock::now() + PROGRESS_DELAY);
        if let Some(bar) = &self.bar {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        self
    }

    /// Whether it is long enough to be shown.
    fn is_shown(&self) -> bool {
        let is_shown = self.from.is_none_or(|from| clock::now() >= from);
        if let (true, Some(bar)) = (is_shown && self.from.is_some(), &self.bar)
            && bar.is_hidden()
        {
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        is_shown
    }

    /// One more is done.
    pub fn one_done(&self) {
        check_interrupt();
        // Only a count: no other memory is ordered by it.
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let is_shown = self.is_shown();
        match &self.bar {
            Some(bar) => bar.inc(1),
            None if !is_shown => {}
            None => {
                if let Some(percent) = line_due(done, self.total) {
                    // Progress is a courtesy: a closed standard error must not end the campaign.
                    let Self { label, what, total, .. } = self;
                    let elapsed_s = self.begun.elapsed().as_secs_f64();
                    let rate = done as f64 / elapsed_s;
                    let left_s = (total.saturating_sub(done)) as f64 / rate;
                    let _ = writeln!(
                        console::err(),
                        "{label}: {percent} % of {total} {what}, {rate:.1}/s, {left_s:.0} s left"
                    );
                }
            }
        }
    }

    /// No more will be done.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish();
        }
    }
}

/// The percentage to report when `done` runs of `total` are through, if a line is due.
fn line_due(done: usize, total: usize) -> Option<usize> {
    let steps = |done: usize| done * 100 / (total.max(1) * LINE_EVERY_PERCENT);
    (steps(done) > steps(done - 1)).then(|| steps(done) * LINE_EVERY_PERCENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_the_items_whatever_the_threads_do() {
        let items: Vec<u64> = (0..500).collect();
        let squares = map("squares", &items, |n| {
            // The first ones take longest, so that the last ones are done before them.
            let busy = (0..(500 - n) * 50).fold(*n, |a, b| std::hint::black_box(a ^ b));
            (n * n, busy)
        });
        let squares: Vec<u64> = squares.into_iter().map(|(square, _)| square).collect();
        assert_eq!(squares, items.iter().map(|n| n * n).collect::<Vec<_>>());
    }

    #[test]
    fn a_line_is_due_five_times_in_a_campaign_of_any_size() {
        for total in [5, 7, 100, 936] {
            let lines: Vec<_> = (1..=total).filter_map(|done| line_due(done, total)).collect();
            assert_eq!(lines, [20, 40, 60, 80, 100], "{total} runs");
        }
    }
}
