//! The real programs as child processes, and a ground station that talks to them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Limit of wall time for any wait on a program.
pub const TIMEOUT: Duration = Duration::from_secs(60);

/// The built program with this name; all are built once, in the profile of the tests.
pub fn program(name: &str) -> PathBuf {
    static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
        // .../target/debug/deps/this_test
        let test = std::env::current_exe().expect("a test has a path");
        let folder = test.ancestors().nth(2).expect("target/profile/deps/test").to_path_buf();
        let mut build = Command::new(env!("CARGO"));
        // With one test, so that features are those of `cargo test --workspace`, which has built them already.
        build.args(["build", "--quiet", "--workspace", "--bins", "--test", "architecture"]);
        if folder.ends_with("release") {
            build.arg("--release");
        }
        let target = folder.parent().expect("target/profile");
        build.arg("--target-dir").arg(target);
        let built = build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).status();
        assert!(built.expect("cargo runs").success(), "the programs do not build");
        folder
    });
    FOLDER.join(name)
}

/// A running program; killed when dropped.
pub struct Program {
    child: Child,
    printed: Arc<Mutex<String>>,
    lines: Receiver<String>,
    readers: [JoinHandle<()>; 2],
}

impl Program {
    /// Starts a program and collects its output.
    pub fn start(name: &str, arguments: &[&str]) -> Self {
        Self::start_with(name, arguments, Stdio::null())
    }

    /// The same, with the standard input controlled by the test.
    pub fn start_as_parent(name: &str, arguments: &[&str]) -> Self {
        Self::start_with(name, arguments, Stdio::piped())
    }

    fn start_with(name: &str, arguments: &[&str], input: Stdio) -> Self {
        let mut command = Command::new(program(name));
        command.args(arguments);
        // A command of sitl has its own options.
        let has_command = arguments.first().is_some_and(|argument| !argument.starts_with("--"));
        // Tests run side by side, so ports for ground stations are open only where a test names them. The
        // settings of the user of this machine must not affect a test.
        let flies = ["autopilot", "sitl"].contains(&name) && !has_command;
        for option in
            ["--gcs-udp-server", "--gcs-tcp", "--parameter-file", "--log-dir", "--signing-key"]
        {
            let named = |argument: &&str| {
                argument.starts_with(option)
                    || option.starts_with("--gcs") && *argument == "--no-gcs"
            };
            if flies && !arguments.iter().any(named) {
                command.args([option, "none"]);
            }
        }
        let mut child = command
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a built program starts");
        let printed = Arc::new(Mutex::new(String::new()));
        let (sender, lines) = channel();
        let outputs: [Box<dyn Read + Send>; 2] = [
            Box::new(child.stdout.take().expect("piped")),
            Box::new(child.stderr.take().expect("piped")),
        ];
        let read = |output| {
            let (printed, sender) = (Arc::clone(&printed), sender.clone());
            thread::spawn(move || {
                for line in BufReader::new(output).lines().map_while(Result::ok) {
                    printed.lock().expect("no panic while held").push_str(&format!("{line}\n"));
                    // The test may have ended.
                    let _ = sender.send(line);
                }
            })
        };
        let readers = outputs.map(read);
        Self { child, printed, lines, readers }
    }

    /// Sends a line to a program that was started with [`Program::start_as_parent`].
    pub fn send_line(&mut self, line: &str) {
        let input = self.child.stdin.as_mut().expect("started as a parent");
        writeln!(input, "{line}").expect("the program reads");
    }

    /// Its output so far.
    pub fn printed(&self) -> String {
        self.printed.lock().expect("no panic while held").clone()
    }

    /// Waits for a line that contains `text`.
    pub fn wait_for(&self, text: &str) -> String {
        let until = Instant::now() + TIMEOUT;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) if line.contains(text) => return line,
                Ok(_) => {}
                Err(_) => panic!("waited for {text:?}, printed:\n{}", self.printed()),
            }
        }
    }

    /// Sends a signal by number: 2 interrupt, 9 kill, 15 terminate.
    pub fn signal(&self, number: u32) {
        let id = self.child.id().to_string();
        let status = Command::new("kill").arg(format!("-{number}")).arg(id).status();
        assert!(status.expect("kill runs").success());
    }

    /// Waits for its end and returns the exit code.
    pub fn end(&mut self) -> Option<i32> {
        let until = Instant::now() + TIMEOUT;
        loop {
            if let Some(status) = self.child.try_wait().expect("a child can be waited for") {
                self.read_all();
                return status.code();
            }
            assert!(Instant::now() < until, "it does not end; printed:\n{}", self.printed());
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// What it has printed before its end may still be on its way. A child of its own may hold the pipe, but not for long.
    fn read_all(&self) {
        let until = Instant::now() + TIMEOUT;
        while !self.readers.iter().all(JoinHandle::is_finished) && Instant::now() < until {
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Whether it has ended.
    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("a child can be waited for").is_some()
    }

    /// Process number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An autopilot with this ground station, and its address for a plant.
pub fn autopilot(gcs: SocketAddr, options: &[&str]) -> (Program, String) {
    let gcs = gcs.to_string();
    let mut all = vec!["--gcs", &gcs];
    all.extend(options);
    autopilot_with(&all)
}

/// An autopilot on a free port, and its address for a plant.
pub fn autopilot_with(options: &[&str]) -> (Program, String) {
    let (program, listening) = listening_autopilot(options);
    (program, listening["plant_link"].as_str().expect("an address").to_owned())
}

/// An autopilot on a free port, and all its output about its ports.
pub fn listening_autopilot(options: &[&str]) -> (Program, serde_json::Value) {
    let mut arguments = vec!["--plant-link", "127.0.0.1:0", "--status"];
    arguments.extend(options);
    let program = Program::start("autopilot", &arguments);
    let line = program.wait_for("\"listening\"");
    (program, serde_json::from_str(&line).expect("status lines are JSON"))
}

/// A port of loopback that is free at this moment.
pub fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0")
        .and_then(|s| s.local_addr())
        .expect("loopback has free ports")
        .port()
}
