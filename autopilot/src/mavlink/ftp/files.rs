//! The files that can be fetched, and their folder.

use crate::mavlink::component_metadata;

/// One file.
#[derive(Debug, Clone, Copy)]
pub(super) struct File {
    /// Name in the one folder there is.
    pub name: &'static str,
    pub content: &'static [u8],
}

/// All files, in the order in which they are listed.
pub(super) fn files() -> impl ExactSizeIterator<Item = File> {
    component_metadata::files().iter().map(|(name, text)| File { name, content: text.as_bytes() })
}

/// The file at `path`, which has no slash around it.
pub(super) fn find(path: &str) -> Option<File> {
    files().find(|file| file.name == path)
}

/// The one folder.
pub(super) fn is_folder(path: &str) -> bool {
    matches!(path, "" | ".")
}

/// Entries of the folder from number `first` on, as many as fit into `room` bytes.
pub(super) fn entries(first: usize, room: usize) -> Vec<u8> {
    let mut text = Vec::new();
    for file in files().skip(first) {
        let entry = format!("F{}\t{}\0", file.name, file.content.len());
        if text.len() + entry.len() > room {
            break;
        }
        text.extend_from_slice(entry.as_bytes());
    }
    text
}

/// The checksum of MAVLink FTP and of component metadata: CRC-32 with its register zero at the start and not
/// inverted at the end.
pub fn crc32(content: &[u8]) -> u32 {
    // The library inverts both.
    let mut hasher = crc32fast::Hasher::new_with_initial(u32::MAX);
    hasher.update(content);
    !hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_one_that_ground_stations_compute() {
        // Bit by bit, as the definition has it.
        let plain = |content: &[u8]| {
            content.iter().fold(0_u32, |crc, byte| {
                (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
                    if crc & 1 == 0 { crc >> 1 } else { (crc >> 1) ^ 0xEDB8_8320 }
                })
            })
        };
        for content in [&b""[..], b"\0", b"123456789", &[0xFF; 300]] {
            assert_eq!(crc32(content), plain(content), "{content:?}");
        }
        assert_eq!(crc32(b"123456789"), 0x2DFD_2D88);
    }
}
