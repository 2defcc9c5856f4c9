//! Bytes that no recorder writes: plot and replay end, do not panic, and need no more than the bytes are worth.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::replay::tests::testing::{self, Without};
use crate::replay::tests::{commands, setup};
use crate::{plot, replay};
use lab_judges::closed_loop::FlightSetup;

/// Control steps of the logs that are damaged here, and a bound for their replay.
const STEPS_MAX: u64 = 200;
/// Bytes of a page for each byte of its log, beside [`PAGE_BYTES`].
const PAGE_PER_BYTE: usize = 12;
/// Bytes of a page without a flight: headings, frames, parameters.
const PAGE_BYTES: usize = 600_000;

fn below(random: &mut ChaCha8Rng, limit: usize) -> usize {
    usize::try_from(random.next_u64() % limit.max(1) as u64).unwrap()
}

/// A log of a quarter of a second with every kind of input.
fn small(without: Without) -> Vec<u8> {
    let setup = FlightSetup { duration: icd::SimTime::from_micros(250_000), ..setup(1) };
    testing::log(&setup, &commands(), without)
}

/// Flips bits, overwrites, cuts, repeats, and moves pieces.
fn damage(bytes: &mut Vec<u8>, random: &mut ChaCha8Rng) {
    for _ in 0..=below(random, 6) {
        let length = bytes.len();
        let at = below(random, length);
        let piece = at..(at + below(random, 3_000)).min(length);
        match below(random, 8) {
            0..=2 => {
                let bit = below(random, 8);
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << bit;
                }
            }
            3 => {
                let with = u8::try_from(below(random, 256)).unwrap();
                bytes[piece].fill(with);
            }
            4 => bytes.truncate(length - length / 4 + below(random, length / 4)),
            5 => drop(bytes.drain(piece)),
            6 => {
                let copy = bytes[piece].to_vec();
                let to = below(random, length);
                bytes.splice(to..to, copy);
            }
            // A digit of a header or of an input.
            _ => {
                let digit = bytes.iter().skip(at).position(u8::is_ascii_digit);
                if let Some(place) = digit {
                    bytes[at + place] = b'0' + u8::try_from(below(random, 10)).unwrap();
                }
            }
        }
    }
}

fn attack(bytes: Vec<u8>, name: &str) {
    let length = bytes.len();
    if let Ok(page) = plot::of_bytes(bytes.clone()) {
        let most = PAGE_BYTES + PAGE_PER_BYTE * length;
        assert!(page.html.len() < most, "{name}: {} bytes of {length}", page.html.len());
    }
    if let Ok(verdict) = replay::of_bytes(bytes, STEPS_MAX) {
        assert!(verdict.steps <= STEPS_MAX, "{name}: {}", verdict.steps);
        assert!(verdict.missing <= length as u64, "{name}: {} missing", verdict.missing);
    }
}

/// Damaged logs of one seed; more with `TWO_STEP_HOSTILE_LOGS`.
#[test]
fn a_log_that_is_damaged_anywhere_is_plotted_and_flown_again_or_refused() {
    let count = std::env::var("TWO_STEP_HOSTILE_LOGS").ok().and_then(|count| count.parse().ok());
    let logs = [small(Without::default()), small(Without { rows: 10, ..Without::default() })];
    let mut random = ChaCha8Rng::seed_from_u64(8);
    for number in 0..count.unwrap_or(60) {
        let mut damaged = logs[number % logs.len()].clone();
        damage(&mut damaged, &mut random);
        attack(damaged, &format!("log {number}"));
    }
}

/// Digits of the headers, one after the other: what the text of a header says cannot be trusted either.
#[test]
fn a_changed_digit_of_a_header_or_input_is_refused_or_flown() {
    let bytes = small(Without::default());
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let count = std::env::var("TWO_STEP_HOSTILE_LOGS").ok().and_then(|count| count.parse().ok());
    let text: Vec<usize> = (1..bytes.len() - 1)
        .filter(|at| bytes[*at].is_ascii_digit() && b":[,.-0123456789e".contains(&bytes[at - 1]))
        .collect();
    for number in 0..count.unwrap_or(120) {
        let mut damaged = bytes.clone();
        let at = text[below(&mut random, text.len())];
        damaged[at] = *b"0123456789-.e".get(below(&mut random, 13)).unwrap();
        if let Ok(verdict) = replay::of_bytes(damaged, 20) {
            assert!(verdict.steps <= 20, "digit {number} at {at}");
        }
    }
}

/// The bytes of the timestamp of a row in the middle of a log.
fn timestamp(bytes: &[u8], topic: &str, us: u64) -> usize {
    let log = ulog::reader::Log::from_bytes(bytes.to_vec()).unwrap();
    let row = log.times_us(topic).unwrap().iter().position(|time| *time == us).unwrap();
    let value = log.topic(topic).unwrap().row(row).unwrap().bytes("timestamp").unwrap().to_vec();
    let first = log.topic(topic).unwrap().fields()[1].name.clone();
    let next = log.topic(topic).unwrap().row(row).unwrap().bytes(&first).unwrap().to_vec();
    let pattern = [value, next].concat();
    bytes.windows(pattern.len()).position(|window| window == pattern).unwrap()
}

#[test]
fn a_flipped_bit_of_a_timestamp_does_not_stretch_the_page_and_is_reported() {
    let bytes = small(Without::default());
    let whole = plot::of_bytes(bytes.clone()).unwrap();
    assert_eq!(whole.not_drawn, [""; 0]);
    let at = timestamp(&bytes, "sensors", 100_000);
    for bit in 0..64 {
        let mut damaged = bytes.clone();
        damaged[at + bit / 8] ^= 1 << (bit % 8);
        let page = plot::of_bytes(damaged).unwrap();
        assert!(page.html.contains("0.250 s of simulation time"), "bit {bit}");
        // A change that keeps the order cannot be seen.
        if bit >= 11 {
            let remark = page.not_drawn.first().unwrap();
            assert!(
                remark.contains("1 row is not drawn") && remark.contains("sensors"),
                "{remark}"
            );
            assert!(page.html.contains("Not drawn: 1 row is not drawn"), "bit {bit}");
        }
        let (now, before) = (page.html.len(), whole.html.len());
        assert!(now < before + 3_000, "bit {bit}: {now} bytes instead of {before}");
    }
}
