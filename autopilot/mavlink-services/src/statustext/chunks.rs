//! A text as the chunks of STATUSTEXT.
//!
//! A chunk shorter than the field ends its text (QGroundControl, MAVProxy and MAVSDK join chunks by this), so
//! all but the last one are filled with blanks. Stations that do not join them show whole words.

/// Characters of one message.
pub(super) const CHUNK: usize = 50;
/// Chunks of one text; what is longer is cut.
pub(super) const CHUNKS_MAX: usize = 5;

/// The chunks of a text, at least one. Of more than one the last has at least one character, since
/// QGroundControl shows an empty one as `...`, and at most 49, since a full one would not end the text.
pub(super) fn of(text: &str) -> Vec<[u8; CHUNK]> {
    // One byte a character, so that no character is cut in two.
    let bytes: Vec<u8> =
        text.chars().map(|c| u8::try_from(c).ok().filter(u8::is_ascii).unwrap_or(b'?')).collect();
    let mut rest = bytes.trim_ascii_end();
    let mut chunks = Vec::new();
    while chunks.len() < CHUNKS_MAX {
        let is_only = chunks.is_empty();
        let room = if is_only { CHUNK } else { CHUNK - 1 };
        if rest.len() <= room {
            chunks.push(filled(rest, 0));
            return chunks;
        }
        if chunks.len() + 1 == CHUNKS_MAX {
            chunks.push(filled(&rest[..CHUNK - 1], 0));
            return chunks;
        }
        let (part, after) = rest.split_at(end_of_chunk(rest));
        chunks.push(filled(part, b' '));
        rest = after;
    }
    chunks
}

/// Where a chunk of a text that goes on ends: behind the last blank that it has room for; in a word only if the
/// word is longer than a chunk. At least one character is left.
fn end_of_chunk(rest: &[u8]) -> usize {
    let room = CHUNK.min(rest.len() - 1);
    let blank = rest[..room].iter().rposition(|byte| *byte == b' ');
    // Joined, the text has its blank again: it is the last character of the chunk.
    blank.map_or(room, |blank| blank + 1)
}

fn filled(part: &[u8], with: u8) -> [u8; CHUNK] {
    let mut chunk = [with; CHUNK];
    chunk[..part.len()].copy_from_slice(part);
    chunk
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// As receivers see a chunk: up to its NUL.
    fn seen(text: &str) -> Vec<String> {
        let end = |chunk: &[u8; CHUNK]| chunk.iter().position(|byte| *byte == 0).unwrap_or(CHUNK);
        let text_of = |chunk: [u8; CHUNK]| String::from_utf8(chunk[..end(&chunk)].to_vec());
        of(text).into_iter().map(|chunk| text_of(chunk).unwrap()).collect()
    }

    /// As QGroundControl and MAVProxy join them: the first that is shorter than the field is the last one.
    fn joined(chunks: &[String]) -> String {
        let last = chunks.iter().position(|chunk| chunk.len() < CHUNK);
        let words = chunks[..=last.unwrap_or(chunks.len() - 1)].concat();
        words.split_ascii_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn a_text_that_fits_is_one_message() {
        assert_eq!(seen(""), [""]);
        assert_eq!(seen("short"), ["short"]);
        assert_eq!(seen(&"x".repeat(50)), ["x".repeat(50)]);
    }

    #[test]
    fn no_word_is_cut_and_all_but_the_last_chunk_fill_the_field() {
        let text =
            "Script refused: chain.txt, line 2, column 6: `elevator` found, wanted an effector";
        assert_eq!(
            seen(text),
            [
                "Script refused: chain.txt, line 2, column 6:      ",
                "`elevator` found, wanted an effector"
            ]
        );
    }

    #[test]
    fn a_word_longer_than_a_chunk_is_cut_and_what_is_longer_than_all_chunks_too() {
        assert_eq!(seen(&"x".repeat(51)), ["x".repeat(50), "x".to_owned()]);
        assert_eq!(seen(&"x".repeat(100)).len(), 3, "the last one must not be full");
        assert_eq!(seen(&"x".repeat(10_000)).concat().len(), 4 * CHUNK + CHUNK - 1);
        assert_eq!(seen("Größe"), ["Gr??e"]);
    }

    proptest! {
        #[test]
        fn every_receiver_joins_every_text(words in proptest::collection::vec("[a-z]{1,20}", 1..16)) {
            let text = words.join(" ");
            prop_assume!(text.len() <= 130);
            let chunks = seen(&text);
            prop_assert_eq!(joined(&chunks), text);
            for chunk in &chunks {
                prop_assert!(!chunk.is_empty());
                prop_assert!(chunk.split_whitespace().all(|word| words.iter().any(|w| w == word)), "{}", chunk);
            }
        }
    }
}
