//! Scripts on the ground-station side: the stored files, starting them by number or name, and the reports about
//! the running one.
//!
//! Uploads arrive by [`super::ftp`], requests to run them by MAV_CMD_USER_3. The control side reports events with the number of
//! a line; here the report gets the text of the line.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use ::mavlink::dialects::common::{MavFtpErr, MavSeverity};
use icd::EffectorList;

use crate::codec::CommandError;
use crate::statustext;
use crate::statustext::StatusTexts;
use flight_management::event_text;
use flight_management::parameters::Parameters;
use flight_management::script::{Line, Script, ScriptEvent, Sequence, TEXT_MAX};

/// Files that can be stored.
pub const FILES_MAX: usize = 16;
/// Longest name of a file, bytes.
pub const NAME_MAX: usize = 32;
/// Longest file, bytes.
pub const FILE_MAX: usize = TEXT_MAX;
/// Scripts that were started and may still be reported.
const STARTED_MAX: usize = 4;

/// A script to run; refused if there is none, if it cannot be read, or if it injects faults and fault injection is off.
type Started = Result<Arc<Script>, CommandError>;

/// Whether a file is complete, as its sender wrote it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Completeness {
    /// Its upload has not ended.
    Open,
    /// A part of it was refused.
    Refused,
    /// Its upload has ended.
    Whole,
}

#[derive(Debug, Clone)]
struct Kept {
    content: Vec<u8>,
    /// Number of the upload that writes it; the largest number was uploaded last.
    upload: u64,
    completeness: Completeness,
}

/// The right to write a file, until another client begins to write it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Upload {
    /// Name of the file.
    pub name: String,
    number: u64,
}

#[derive(Debug, Default)]
pub struct Scripts {
    /// The effectors of the aircraft.
    effectors: EffectorList,
    scenario: Option<Arc<Script>>,
    files: BTreeMap<String, Kept>,
    uploads: u64,
    /// Scripts that were sent to the aircraft, the latest one last.
    started: VecDeque<Arc<Script>>,
    running: Option<RunningScript>,
}

#[derive(Debug)]
struct RunningScript {
    script: Arc<Script>,
    /// For each sequence the index of the next line.
    next: Vec<usize>,
}

impl RunningScript {
    fn new(script: Arc<Script>) -> Self {
        let next = vec![0; script.sequences().len()];
        Self { script, next }
    }

    /// Records that the line with this number was executed.
    fn pass(&mut self, number: u16) {
        for (sequence, next) in self.script.sequences().iter().zip(&mut self.next) {
            if let Some(place) = sequence.lines.iter().position(|line| line.number == number) {
                *next = place + 1;
            }
        }
    }
}

impl Scripts {
    /// An empty store, for an aircraft with these effectors.
    pub fn new(effectors: &EffectorList) -> Self {
        Self { effectors: *effectors, ..Self::default() }
    }

    /// Sets the script that begins with the flight.
    pub fn set_scenario(&mut self, script: Option<Arc<Script>>) {
        self.scenario = script;
    }

    /// Names and sizes of the files, sorted by name. Their numbers in MAV_CMD_USER_3 count from 1.
    pub fn files(&self) -> impl ExactSizeIterator<Item = (&str, usize)> {
        self.files.iter().map(|(name, file)| (name.as_str(), file.content.len()))
    }

    /// Content of a file.
    pub fn content(&self, name: &str) -> Option<&[u8]> {
        self.files.get(name).map(|file| file.content.as_slice())
    }

    pub fn running(&self) -> Option<&Script> {
        self.running.as_ref().map(|running| &*running.script)
    }

    /// The sequences of the running script, each with its next line.
    pub fn next_lines(&self) -> impl Iterator<Item = (&Sequence, Option<&Line>)> {
        self.running.iter().flat_map(|running| {
            let sequences = running.script.sequences().iter().zip(&running.next);
            sequences.map(|(sequence, next)| (sequence, sequence.lines.get(*next)))
        })
    }

    /// Name of the latest upload among the stored files.
    pub fn latest(&self) -> Option<&String> {
        self.files.iter().max_by_key(|(_, file)| file.upload).map(|(name, _)| name)
    }

    /// The script that begins with the flight.
    pub fn of_scenario(&self) -> Option<&Script> {
        self.scenario.as_deref()
    }

    /// Begins to write a file: creates it if needed, and empties it if `truncate`.
    pub fn open(&mut self, name: &str, truncate: bool) -> Result<Upload, MavFtpErr> {
        // Letters, digits and these, the first one not a dot.
        let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        let is_good = !name.is_empty() && name.len() <= NAME_MAX && !name.starts_with('.');
        if !is_good || !name.bytes().all(is_part) {
            return Err(MavFtpErr::MAV_FTP_ERR_FILEPROTECTED);
        }
        if !self.files.contains_key(name) && self.files.len() >= FILES_MAX {
            // Out of space, by the error number of the system.
            return Err(MavFtpErr::MAV_FTP_ERR_FAILERRNO);
        }
        self.uploads += 1;
        let upload = self.uploads;
        let new = Kept { content: Vec::new(), upload, completeness: Completeness::Open };
        let file = self.files.entry(name.to_owned()).or_insert(new);
        file.upload = upload;
        if truncate {
            file.content.clear();
        }
        // Bytes refused earlier are still missing if writing continues.
        if truncate || file.completeness != Completeness::Refused {
            file.completeness = Completeness::Open;
        }
        Ok(Upload { name: name.to_owned(), number: upload })
    }

    /// Writes a part of a file. Parts may come in any order and more than once.
    pub fn write(&mut self, upload: &Upload, offset: u32, data: &[u8]) -> Result<(), MavFtpErr> {
        let file = self.files.get_mut(&upload.name).filter(|file| file.upload == upload.number);
        let file = file.ok_or(MavFtpErr::MAV_FTP_ERR_INVALIDSESSION)?;
        let offset = offset as usize;
        let end = offset.saturating_add(data.len());
        if end > FILE_MAX {
            file.completeness = Completeness::Refused;
            return Err(MavFtpErr::MAV_FTP_ERR_FAILERRNO);
        }
        if file.content.len() < end {
            file.content.resize(end, 0);
        }
        file.content[offset..end].copy_from_slice(data);
        Ok(())
    }

    /// Sets the length of a file.
    pub fn truncate(&mut self, name: &str, length: u32) -> Result<(), MavFtpErr> {
        let file = self.files.get_mut(name).ok_or(MavFtpErr::MAV_FTP_ERR_FILENOTFOUND)?;
        if length as usize > FILE_MAX {
            return Err(MavFtpErr::MAV_FTP_ERR_FAILERRNO);
        }
        // What was cut off and written again later is zero in between, as in a file.
        file.content.resize(length as usize, 0);
        Ok(())
    }

    pub fn remove(&mut self, name: &str) -> Result<(), MavFtpErr> {
        self.files.remove(name).ok_or(MavFtpErr::MAV_FTP_ERR_FILENOTFOUND)?;
        Ok(())
    }

    /// Ends an upload: whether the file is a script, as a text for the operator.
    pub fn finish(&mut self, upload: &Upload, texts: &mut StatusTexts) {
        match self.files.get_mut(&upload.name) {
            // The other upload continues.
            Some(file) if file.upload != upload.number => return,
            Some(file) if file.completeness == Completeness::Open => {
                file.completeness = Completeness::Whole;
            }
            _ => {}
        }
        match self.read(&upload.name) {
            Ok(script) => {
                let lines = script.lines().count();
                let number = self.files.keys().position(|name| *name == upload.name);
                let number = number.map_or(0, |index| index + 1);
                let text = format!("Script {}: {lines} lines, number {number}", upload.name);
                texts.publish(MavSeverity::MAV_SEVERITY_INFO, text);
            }
            Err(reason) => {
                texts.publish(MavSeverity::MAV_SEVERITY_WARNING, format!("Script {reason}"));
            }
        }
    }

    fn read(&self, name: &str) -> Result<Script, String> {
        let file = self.files.get(name).ok_or_else(|| format!("{name}: no such file"))?;
        match file.completeness {
            Completeness::Open => return Err(format!("{name}: its upload has not ended")),
            Completeness::Refused => {
                return Err(format!("{name}: a part is missing, {FILE_MAX} bytes are allowed"));
            }
            Completeness::Whole => {}
        }
        let text = core::str::from_utf8(&file.content);
        let text = text.map_err(|error| {
            format!("{name}: no text, byte {} is not UTF-8", error.valid_up_to() + 1)
        })?;
        Script::parse(name, text, &self.effectors).map_err(|error| error.to_string())
    }

    /// The script with this number in the sorted list, to be run with [`flight_management::command::ScriptCommand::Run`]; 0 is
    /// the latest upload, or without one the scenario's.
    pub fn start(&mut self, number: u16, parameters: &Parameters) -> Started {
        let name = match usize::from(number).checked_sub(1) {
            Some(index) => Some(self.files.keys().nth(index).ok_or_else(|| {
                let count = self.files.len();
                CommandError::denied(format!(
                    "Script refused: no number {number}, {count} are here"
                ))
            })?),
            None => self.latest(),
        };
        if let Some(name) = name {
            return self.start_by_name(&name.to_owned(), parameters);
        }
        let script = self.scenario.clone();
        let script = script.ok_or_else(|| CommandError::denied("Script refused: none is here"))?;
        self.check(script, parameters)
    }

    /// The script in the file with this name.
    pub fn start_by_name(&mut self, name: &str, parameters: &Parameters) -> Started {
        let script = self.read(name);
        let script =
            script.map_err(|reason| CommandError::denied(format!("Script refused: {reason}")))?;
        self.check(Arc::new(script), parameters)
    }

    fn check(&mut self, script: Arc<Script>, parameters: &Parameters) -> Started {
        if script.has_faults() && !parameters.failure.enabled {
            return Err(CommandError::denied(
                "Script refused: it has faults, and fault injection is off (SYS_FAILURE_EN 0)",
            ));
        }
        if self.started.len() >= STARTED_MAX {
            self.started.pop_front();
        }
        self.started.push_back(Arc::clone(&script));
        Ok(script)
    }

    /// Handles an event of a script, and reports it.
    pub fn handle_event(&mut self, id: u32, event: ScriptEvent, texts: &mut StatusTexts) {
        let running = self.running.as_ref().map(|running| &running.script);
        // Several scripts may have the same text: the one that runs counts, then the latest.
        let mut known = running.into_iter().chain(self.started.iter().rev()).chain(&self.scenario);
        let script = known.find(|script| script.id() == id).cloned();
        let (severity, text) = event_text::of_script(script.as_deref(), event);
        texts.publish_event(statustext::mav_severity(severity), text);
        match event {
            ScriptEvent::Began => self.running = script.map(RunningScript::new),
            ScriptEvent::Line(line) => {
                if let Some(running) = &mut self.running {
                    running.pass(line);
                }
            }
            ScriptEvent::Done | ScriptEvent::Stopped => self.running = None,
            ScriptEvent::NotBegun(_) | ScriptEvent::LineRefused { .. } => {}
        }
    }
}
