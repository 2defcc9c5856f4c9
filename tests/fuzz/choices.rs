//! Bytes read as choices, and the changes to a seed that follow from them.

/// Choices from bytes; zero once the bytes are used up.
pub struct Choices<'a>(&'a [u8]);

/// Changes to one seed.
const CHANGES_MAX: usize = 16;
/// Bytes that one change moves, repeats or removes.
const PIECE_MAX: usize = 2_048;
/// Values at which ranges and arithmetic end.
const EDGES: [u64; 8] = [
    0,
    1,
    0x7FFF_FFFF,
    0xFFFF_FFFF,
    0x7FFF_FFFF_FFFF_FFFF,
    0x7FF0_0000_0000_0000,
    0x7FF8_0000_0000_0000,
    u64::MAX,
];

impl<'a> Choices<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// From 0 to `limit - 1`; 0 if there is nothing to choose from.
    pub fn below(&mut self, limit: usize) -> usize {
        let choice = match limit {
            0..=0x100 => usize::from(self.byte()),
            _ => u32::from_le_bytes([self.byte(), self.byte(), self.byte(), 0]) as usize,
        };
        choice % limit.max(1)
    }

    pub fn one_of<'b, T>(&mut self, all: &'b [T]) -> &'b T {
        &all[self.below(all.len())]
    }

    /// This many bytes, or those that are left.
    pub fn bytes(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        taken
    }

    /// Changes some parts of `bytes`.
    pub fn damage(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..self.below(CHANGES_MAX) {
            if self.is_empty() {
                return;
            }
            self.change(bytes);
        }
    }

    fn change(&mut self, bytes: &mut Vec<u8>) {
        let what = self.below(8);
        let at = self.below(bytes.len());
        let end = (at + self.below(PIECE_MAX)).min(bytes.len());
        match what {
            0 | 1 => {
                let bit = self.below(8);
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << bit;
                }
            }
            2 => {
                let value = self.byte();
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = value;
                }
            }
            3 => {
                let value = self.one_of(&EDGES).to_le_bytes();
                let width = [1, 2, 4, 8][self.below(4)];
                for (place, byte) in bytes.iter_mut().skip(at).take(width).zip(value) {
                    *place = byte;
                }
            }
            4 => bytes.truncate(at),
            5 => drop(bytes.drain(at..end)),
            6 => {
                let piece = bytes[at..end].to_vec();
                let to = self.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => {
                let count = self.below(64);
                let new = self.bytes(count).to_vec();
                bytes.splice(at..at, new);
            }
        }
    }
}
