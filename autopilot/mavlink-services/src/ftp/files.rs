//! The files that can be fetched, and their folders: the root, which is for reading only, and the one of the
//! scripts.

use std::sync::Arc;

use super::payload::{Problem, Request};
use crate::context::Context;
use crate::scripts::FileProblem;

/// Name of the folder of the scripts.
const SCRIPTS: &str = "scripts";

/// What a file has in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Content {
    /// It is the same for the life of the process.
    Fixed(Arc<str>),
    /// As it was when it was opened.
    Kept(Arc<[u8]>),
}

impl Content {
    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Self::Fixed(text) => text.as_bytes(),
            Self::Kept(bytes) => bytes,
        }
    }
}

/// The name of a script, if the path has the form of one.
fn script_name(path: &str) -> Option<&str> {
    let (folder, name) = path.split_once('/')?;
    (folder == SCRIPTS).then(|| name.trim_matches('/'))
}

/// The name of the script that a request wants to change.
pub(super) fn writable<'a>(request: &Request<'a>) -> Result<&'a str, Problem> {
    request.path().and_then(script_name).ok_or(Problem::FileProtected)
}

/// The file at `path`, which has no slash around it.
pub(super) fn find(path: &str, ctx: &Context) -> Option<Content> {
    if let Some(name) = script_name(path) {
        return ctx.scripts.content(name).map(|content| Content::Kept(content.into()));
    }
    let mut files = ctx.telemetry.metadata().files().iter();
    files.find(|(name, _)| *name == path).map(|(_, text)| Content::Fixed(Arc::clone(text)))
}

/// The entries of a folder, each as it is sent; `None` if there is no such folder.
fn listed(path: &str, ctx: &Context) -> Option<Vec<String>> {
    let file = |name: &str, size: usize| format!("F{name}\t{size}\0");
    match path {
        "" | "." => {
            let files = ctx.telemetry.metadata().files().iter();
            let files = files.map(|(name, text)| file(name, text.len()));
            Some(files.chain([format!("D{SCRIPTS}\0")]).collect())
        }
        SCRIPTS => Some(ctx.scripts.files().map(|(name, size)| file(name, size)).collect()),
        _ => None,
    }
}

/// Entries of a folder from number `first` on, as many as fit into `room` bytes.
pub(super) fn entries(path: &str, first: usize, room: usize, ctx: &Context) -> Option<Vec<u8>> {
    let mut text = Vec::new();
    for entry in listed(path, ctx)?.into_iter().skip(first) {
        if text.len() + entry.len() > room {
            break;
        }
        text.extend_from_slice(entry.as_bytes());
    }
    Some(text)
}

/// In the words of the protocol.
pub(super) fn problem(problem: FileProblem) -> Problem {
    match problem {
        FileProblem::NotFound => Problem::FileNotFound,
        FileProblem::Name => Problem::FileProtected,
        FileProblem::NoSpace => Problem::NoSpace,
        FileProblem::Superseded => Problem::InvalidSession,
    }
}
