//! Child processes of flights and measurements.

use std::io::{self, BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, Stdio};

use host_io::problem::{At as _, Problem, problem};

const NO_END: &str = "cannot wait for a process";

/// A child process whose standard output is read line by line; killed if it is dropped before its end.
pub(crate) struct Process {
    name: &'static str,
    pub(crate) child: Child,
    output: BufReader<ChildStdout>,
}

impl Process {
    pub(crate) fn start(name: &'static str, mut command: Command) -> Result<Self, Problem> {
        // Only warnings: flights come by the dozen.
        command.env("RUST_LOG", "warn");
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().at("cannot start a process")?;
        let output = child.stdout.take().expect("its output is piped");
        Ok(Self { name, child, output: BufReader::new(output) })
    }

    /// Next line of its standard output.
    pub(crate) fn line(&mut self) -> Result<String, Problem> {
        let mut line = String::new();
        if self.output.read_line(&mut line).at("cannot read from a process")? == 0 {
            return Err(self.failure());
        }
        Ok(line.trim_end().to_owned())
    }

    /// Ends it, and waits for that.
    pub(crate) fn end(mut self) -> Result<(), Problem> {
        drop(self.child.stdin.take());
        // A process that still prints must not wait for a reader.
        let _ = io::copy(&mut self.output, &mut io::sink());
        let status = self.child.wait().at(NO_END)?;
        if status.success() { Ok(()) } else { Err(self.failure()) }
    }

    /// It has ended, or closed its output; this is why.
    pub(crate) fn failure(&mut self) -> Problem {
        drop(self.child.stdin.take());
        let mut message = String::new();
        if let Some(mut errors) = self.child.stderr.take() {
            // What cannot be read is not known.
            let _ = errors.read_to_string(&mut message);
        }
        let message = message.trim().lines().last().unwrap_or("nothing").to_owned();
        match self.child.wait() {
            Ok(status) => problem!("{} ended ({status}): {message}", self.name),
            Err(error) => problem!("{NO_END}: {error}"),
        }
    }

    pub(crate) fn unexpected(&self, line: &str) -> Problem {
        problem!("{} said {line:?}", self.name)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It has ended already, or it ends now; either way nothing is left to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
