//! Why a file, or a place in it, cannot be read.

use core::fmt;

/// A place that could not be read; what stands before it could.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins, bytes from the start of the file.
    pub offset: usize,
    /// Where reading went on; `None` if no sync message followed, so that the rest of the file is lost.
    pub resumed: Option<usize>,
    /// What was wrong.
    pub wrong: Wrong,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { offset, resumed, wrong } = self;
        match resumed {
            Some(resumed) => write!(f, "byte {offset}: {wrong}; read on at byte {resumed}"),
            None => {
                write!(f, "byte {offset}: {wrong}; no sync message follows, so the rest is lost")
            }
        }
    }
}

/// Why a file has no log.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The system.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The first bytes are those of another kind of file.
    #[error("this is no ULog file: it does not begin with its seven magic bytes")]
    NoLog,
    /// The format has changed.
    #[error("ULog version {0}; only version 1 can be read")]
    Version(u8),
    /// The file has a feature that changes how it must be read.
    #[error(
        "the file needs the features {flags:#04x} (byte {index} of its incompatible flags), which are not known"
    )]
    Flags {
        /// Which of the eight bytes.
        index: usize,
        /// Its unknown bits.
        flags: u8,
    },
}

/// What can be wrong with a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Wrong {
    /// No writer makes such a message.
    #[error("a message of type {kind:#04x} with {size} bytes")]
    Message {
        /// Its type.
        kind: u8,
        /// Its size without the header.
        size: usize,
    },
    /// A message is too short, or the lengths inside do not fit.
    #[error("the message '{0}' is too short for what it says")]
    Short(char),
    /// Bytes that should be a text.
    #[error("the text in the message '{0}' is no UTF-8")]
    Text(char),
    /// A format that cannot be understood; nested types are among them.
    #[error("the format {0:?} cannot be read (nested types are not supported)")]
    Format(String),
    /// A topic without `uint64_t timestamp`.
    #[error("the topic {0:?} has no uint64_t timestamp")]
    Timestamp(String),
    /// A subscription without a format.
    #[error("the topic {0:?} has no format")]
    Topic(String),
    /// A row without a subscription.
    #[error("a row of the topic number {0}, which was not announced")]
    Row(u16),
    /// A row that does not fit its format.
    #[error("a row of {size} bytes; {topic:?} has {expected}")]
    RowSize {
        /// The topic.
        topic: String,
        /// Bytes.
        size: usize,
        /// Bytes of its format.
        expected: usize,
    },
    /// A key or parameter that cannot be understood.
    #[error("the key {0:?} cannot be read")]
    Key(String),
}
