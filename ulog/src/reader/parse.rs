//! Reads the bytes of a file, message by message.

use std::collections::HashMap;

use super::message::{self, Body, Damage, ReadError, Wrong};
use super::topic::Layout;
use super::{Info, Log, LoggedText, Subscribed};
use crate::format::{FILE_HEADER, Format, MAGIC, MESSAGE_HEADER, SYNC, VERSION};

/// Bit of the first incompatible flag: data were appended after the end, at the given offsets.
const DATA_APPENDED: u8 = 1;

/// Reads a file from its first byte to its last.
pub fn parse(bytes: Vec<u8>) -> Result<Log, ReadError> {
    let Some((header, _)) = bytes.split_first_chunk::<FILE_HEADER>() else {
        return Err(ReadError::NoLog);
    };
    let [magic @ .., _, _, _, _, _, _, _, _, _] = header;
    if *magic != MAGIC {
        return Err(ReadError::NoLog);
    }
    if header[MAGIC.len()] != VERSION {
        return Err(ReadError::Version(header[MAGIC.len()]));
    }
    let mut start = [0; 8];
    start.copy_from_slice(&header[MAGIC.len() + 1..]);
    let mut log = Log {
        bytes: Vec::new(),
        start_us: u64::from_le_bytes(start),
        formats: Vec::new(),
        by_name: HashMap::new(),
        topics: Vec::new(),
        infos: Vec::new(),
        parameters: Vec::new(),
        texts: Vec::new(),
        dropouts_ms: Vec::new(),
        damages: Vec::new(),
        is_cut: false,
    };
    let mut parser = Parser {
        bytes: &bytes,
        at: FILE_HEADER,
        log: &mut log,
        ids: HashMap::new(),
        known: HashMap::new(),
        appended: Vec::new(),
        after_us: None,
    };
    parser.run()?;
    log.bytes = bytes;
    Ok(log)
}

struct Parser<'a> {
    bytes: &'a [u8],
    /// Offset of the next message.
    at: usize,
    log: &'a mut Log,
    /// Message ids of the file to indices of topics.
    ids: HashMap<u16, usize>,
    /// Formats and multi ids to indices of topics: a topic may be announced again.
    known: HashMap<(usize, u8), usize>,
    /// Offsets of appended data, the nearest last.
    appended: Vec<usize>,
    /// Timestamp of the last row; `None` before the data section.
    after_us: Option<u64>,
}

/// Why a message was rejected.
enum Stop {
    Wrong(Wrong),
    Flags(ReadError),
}

impl From<Wrong> for Stop {
    fn from(wrong: Wrong) -> Self {
        Self::Wrong(wrong)
    }
}

impl Parser<'_> {
    fn run(&mut self) -> Result<(), ReadError> {
        while self.at < self.end() || self.jump() {
            let Some((kind, body)) = self.message() else {
                // A writer that has appended data gives their offset; otherwise the file ends here, or a length is damaged.
                if !self.jump() && !self.resume_in_rest() {
                    self.log.is_cut = true;
                    return Ok(());
                }
                continue;
            };
            match self.take(kind, body) {
                Ok(()) => self.at = body.end,
                Err(Stop::Flags(error)) => return Err(error),
                Err(Stop::Wrong(wrong)) => {
                    if !self.resume(wrong.clone()) {
                        let damage = Damage { offset: self.at, resumed: None, wrong };
                        self.log.damages.push(damage);
                        if !self.jump() {
                            self.log.is_cut = true;
                            return Ok(());
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// End of the data that can be read now.
    fn end(&self) -> usize {
        self.appended.last().copied().unwrap_or(self.bytes.len())
    }

    /// Continues at the appended data; false if there are none.
    fn jump(&mut self) -> bool {
        self.appended.pop().is_some_and(|start| {
            self.at = start;
            true
        })
    }

    /// Type and position of the next message; `None` if it is incomplete.
    fn message(&self) -> Option<(u8, Place)> {
        let rest = self.bytes.get(self.at..self.end())?;
        let (header, rest) = rest.split_first_chunk::<MESSAGE_HEADER>()?;
        let [low, high, kind] = *header;
        let size = usize::from(u16::from_le_bytes([low, high]));
        let start = self.at + MESSAGE_HEADER;
        (size <= rest.len()).then_some((kind, Place { start, end: start + size }))
    }

    fn take(&mut self, kind: u8, place: Place) -> Result<(), Stop> {
        let body = Body::new(kind, &self.bytes[place.start..place.end]);
        let size = place.end - place.start;
        match kind {
            _ if size == 0 => return Err(Wrong::Message { kind, size }.into()),
            b'B' => self.flags(body)?,
            b'F' => self.format(body)?,
            b'I' => self.info(body, false)?,
            b'M' => {
                let mut body = body;
                let continued = body.u8()? != 0;
                self.info(body, continued)?;
            }
            b'P' => self.log.parameters.push(message::parameter(body, self.after_us)?),
            b'A' => self.subscribe(body)?,
            b'R' => self.unsubscribe(body)?,
            b'D' => self.row(body, place.start + 2)?,
            b'L' => self.text(body, false)?,
            b'C' => self.text(body, true)?,
            b'O' => self.dropout(body)?,
            b'S' if body.rest() != SYNC => return Err(Wrong::Message { kind, size }.into()),
            // Defaults of parameters, and messages of later versions.
            _ if kind.is_ascii_alphabetic() => {}
            _ => return Err(Wrong::Message { kind, size }.into()),
        }
        Ok(())
    }

    fn flags(&mut self, mut body: Body<'_>) -> Result<(), Stop> {
        body.take::<8>()?;
        let incompatible = body.take::<8>()?;
        for (index, flags) in incompatible.into_iter().enumerate() {
            let unknown = if index == 0 { flags & !DATA_APPENDED } else { flags };
            if unknown != 0 {
                return Err(Stop::Flags(ReadError::Flags { index, flags: unknown }));
            }
        }
        for _ in 0..3 {
            let offset = usize::try_from(body.u64()?).unwrap_or(usize::MAX);
            // Zero: not used. Beyond the end: the appended data are cut off.
            if offset > self.at && offset < self.bytes.len() {
                self.appended.push(offset);
            }
        }
        self.appended.sort_unstable_by(|a, b| b.cmp(a));
        Ok(())
    }

    fn format(&mut self, body: Body<'_>) -> Result<(), Wrong> {
        let text = body.text()?;
        let format = Format::parse(text).ok_or_else(|| Wrong::Format(text.to_owned()))?;
        self.log.by_name.insert(format.name.clone(), self.log.formats.len());
        self.log.formats.push(Layout::new(format));
        Ok(())
    }

    fn info(&mut self, body: Body<'_>, continued: bool) -> Result<(), Wrong> {
        let (field, value) = message::info(body)?;
        let after_us = self.after_us;
        match self.log.infos.last_mut().filter(|last| continued && last.field.name == field.name) {
            Some(last) => {
                last.bytes.extend_from_slice(value);
                last.field.array = Some(last.bytes.len() / last.field.kind.size());
            }
            None => self.log.infos.push(Info { field, bytes: value.to_vec(), after_us }),
        }
        Ok(())
    }

    fn subscribe(&mut self, mut body: Body<'_>) -> Result<(), Wrong> {
        let (multi_id, id) = (body.u8()?, body.u16()?);
        let name = body.text()?;
        let format = *self.log.by_name.get(name).ok_or_else(|| Wrong::Topic(name.to_owned()))?;
        if self.log.formats[format].timestamp.is_none() {
            return Err(Wrong::Timestamp(name.to_owned()));
        }
        let topics = &mut self.log.topics;
        let index = *self.known.entry((format, multi_id)).or_insert_with(|| {
            topics.push(Subscribed { format, multi_id, rows: Vec::new() });
            topics.len() - 1
        });
        self.ids.insert(id, index);
        self.after_us = self.after_us.or(Some(self.log.start_us));
        Ok(())
    }

    fn unsubscribe(&mut self, mut body: Body<'_>) -> Result<(), Wrong> {
        let id = body.u16()?;
        self.ids.remove(&id).map(drop).ok_or(Wrong::Row(id))
    }

    fn row(&mut self, mut body: Body<'_>, start: usize) -> Result<(), Wrong> {
        let id = body.u16()?;
        let topic = *self.ids.get(&id).ok_or(Wrong::Row(id))?;
        let topic = &mut self.log.topics[topic];
        let layout = &self.log.formats[topic.format];
        let row = body.rest();
        if !(layout.size_min..=layout.size).contains(&row.len()) {
            let topic = layout.format.name.clone();
            return Err(Wrong::RowSize { topic, size: row.len(), expected: layout.size });
        }
        topic.rows.push(start);
        if let Some(bytes) = layout.timestamp.and_then(|at| row[at..].first_chunk()) {
            self.after_us = Some(u64::from_le_bytes(*bytes));
        }
        Ok(())
    }

    fn text(&mut self, mut body: Body<'_>, tagged: bool) -> Result<(), Wrong> {
        // Levels are written as digits.
        let level = body.u8()?.saturating_sub(b'0').min(7);
        let tag = if tagged { Some(body.u16()?) } else { None };
        let timestamp_us = body.u64()?;
        let text = body.text()?.to_owned();
        self.log.texts.push(LoggedText { level, tag, timestamp_us, text });
        self.after_us = self.after_us.or(Some(self.log.start_us));
        Ok(())
    }

    fn dropout(&mut self, mut body: Body<'_>) -> Result<(), Wrong> {
        self.log.dropouts_ms.push(body.u16()?);
        Ok(())
    }

    /// Continues at the next sync message; false if none follows.
    fn resume(&mut self, wrong: Wrong) -> bool {
        let Some(resumed) = self.next_sync() else { return false };
        self.log.damages.push(Damage { offset: self.at, resumed: Some(resumed), wrong });
        self.at = resumed;
        true
    }

    /// A message that exceeds the end may have a damaged length, as a sync message after it shows.
    fn resume_in_rest(&mut self) -> bool {
        let wrong = match self.bytes.get(self.at..).unwrap_or_default() {
            [low, high, kind, ..] => {
                let size = usize::from(u16::from_le_bytes([*low, *high]));
                Wrong::Message { kind: *kind, size }
            }
            _ => return false,
        };
        self.resume(wrong)
    }

    /// Offset of the next sync message.
    fn next_sync(&self) -> Option<usize> {
        const LENGTH: usize = MESSAGE_HEADER + SYNC.len();
        let from = self.at + 1;
        let rest = self.bytes.get(from..)?;
        let is_sync = |window: &[u8]| {
            window.starts_with(&[SYNC.len() as u8, 0, b'S']) && window[MESSAGE_HEADER..] == SYNC
        };
        rest.windows(LENGTH).position(is_sync).map(|index| from + index)
    }
}

/// Position of the body of a message.
#[derive(Clone, Copy)]
struct Place {
    start: usize,
    end: usize,
}
