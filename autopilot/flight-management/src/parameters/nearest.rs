//! The name that was probably meant.

use super::table;

/// The parameter whose name takes the fewest changes of letters.
#[must_use]
pub fn nearest(name: &str) -> Option<&'static str> {
    let upper = name.to_uppercase();
    table().iter().map(|row| row.name).min_by_key(|known| changes(&upper, known))
}

/// Letters to put in, take out or change on the way from one word to another (Levenshtein 1966).
#[must_use]
pub fn changes(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (index, letter) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = index + 1;
        for (place, other) in to.iter().enumerate() {
            let changed = diagonal + usize::from(letter != *other);
            diagonal = row[place + 1];
            row[place + 1] = changed.min(diagonal + 1).min(row[place] + 1);
        }
    }
    row[to.len()]
}
