//! Runs another program and watches it: its output is passed on line by line, it can be cancelled
//! with all processes that it has started, and it is stopped if it writes nothing for a long time.

use std::collections::VecDeque;
use std::io::{BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use super::Engine;
use crate::io::{Error, Fault};
use crate::watch::Watch;

/// How often cancellation is looked for.
const PULSE: Duration = Duration::from_millis(50);
/// Lines are cut after as many bytes, and as many of the last lines are kept.
const LONGEST: usize = 2000;
const KEPT: usize = 40;

/// How a program ended.
pub(super) struct Ended {
    pub is_success: bool,
    code: String,
    last: VecDeque<String>,
}

impl Ended {
    /// The line that says why it failed.
    pub fn reason(&self) -> String {
        let error = self.last.iter().rev().find_map(|line| line.strip_prefix("error: "));
        let last = || self.last.iter().rev().find(|line| !line.trim().is_empty());
        let line = error.map(str::to_owned).or_else(|| last().cloned()).unwrap_or_default();
        let line: String = line.trim().trim_end_matches('.').chars().take(300).collect();
        if line.is_empty() { self.code.clone() } else { format!("{line} ({})", self.code) }
    }

    /// Whether it says that there was nothing to be found.
    pub fn found_nothing(&self) -> bool {
        let signs = [
            "NoReconstruction",
            "no reconstruction",
            "failed to create sparse model",
            "no initial",
        ];
        self.last.iter().any(|line| signs.iter().any(|sign| line.contains(sign)))
    }
}

/// Runs a program to its end. An error where it cannot be started, is silent for too long, or is
/// cancelled; then it is ended with all that it started.
pub(super) fn run(
    engine: Engine,
    mut command: Command,
    silence: Duration,
    watch: &Watch,
    take: &mut dyn FnMut(&str),
) -> Result<Ended, Error> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    // Of the window it would open a console of its own.
    #[cfg(windows)]
    std::os::windows::process::CommandExt::creation_flags(
        &mut command,
        windows_sys::Win32::System::Threading::CREATE_NO_WINDOW,
    );
    let wrong = |problem: String, remedy: &str| {
        Error::Invalid(Fault::new(Path::new(engine.name()), "", problem, remedy))
    };
    let child = command.spawn().map_err(|source| {
        let program = Path::new(command.get_program()).display();
        let remedy = "Install it anew, or take another engine";
        wrong(format!("{program} cannot be started: {source}"), remedy)
    })?;
    let mut group = Group(child);
    let lines = group.lines();
    let mut last = VecDeque::new();
    let mut heard = Instant::now();
    let (mut status, mut is_open) = (None, true);
    while status.is_none() || is_open {
        watch.check()?;
        if is_open {
            match lines.recv_timeout(PULSE) {
                Ok(line) => {
                    heard = Instant::now();
                    take(&line);
                    last.push_back(line);
                    if last.len() > KEPT {
                        last.pop_front();
                    }
                    continue;
                }
                // What it has started may hold its output open after it.
                Err(RecvTimeoutError::Timeout) => is_open = status.is_none(),
                Err(RecvTimeoutError::Disconnected) => is_open = false,
            }
        } else {
            std::thread::park_timeout(PULSE);
        }
        if status.is_none() {
            status = group.0.try_wait().map_err(|source| {
                wrong(format!("its end cannot be waited for: {source}"), "Try again")
            })?;
        }
        if status.is_none() && heard.elapsed() > silence {
            let problem =
                format!("it has written nothing for {} s and was stopped", silence.as_secs());
            let remedy = "Try again with fewer or smaller photographs, or take another engine";
            return Err(wrong(problem, remedy));
        }
    }
    let status = status.unwrap_or_default();
    let code = match status.code() {
        Some(code) => format!("exit code {code}"),
        None => "it was ended by the system, as when memory is short".to_owned(),
    };
    Ok(Ended { is_success: status.success(), code, last })
}

/// A program with all that it has started, which end with this.
struct Group(Child);

impl Group {
    /// What it writes, line by line.
    fn lines(&mut self) -> Receiver<String> {
        let (sender, lines) = sync_channel(1000);
        if let Some(out) = self.0.stdout.take() {
            listen(out, sender.clone());
        }
        if let Some(out) = self.0.stderr.take() {
            listen(out, sender);
        }
        lines
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        #[cfg(unix)]
        if let Ok(id) = i32::try_from(self.0.id()) {
            use nix::sys::signal::{Signal, killpg};
            // It may have ended by itself; the group has its number while anything of it lives.
            let _ = killpg(nix::unistd::Pid::from_raw(id), Signal::SIGKILL);
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Reads lines on a thread of its own until the end, or until nobody listens.
fn listen(out: impl Read + Send + 'static, sender: SyncSender<String>) {
    std::thread::spawn(move || {
        let mut line = Vec::new();
        for byte in BufReader::new(out).bytes() {
            let Ok(byte) = byte else { break };
            let is_end = byte == b'\n' || byte == b'\r';
            if !is_end {
                line.push(byte);
            }
            if (is_end && !line.is_empty()) || line.len() >= LONGEST {
                let text = String::from_utf8_lossy(&line).into_owned();
                line.clear();
                if sender.send(text).is_err() {
                    return;
                }
            }
        }
        if !line.is_empty() {
            // Whoever has stopped listening does not need it.
            let _ = sender.send(String::from_utf8_lossy(&line).into_owned());
        }
    });
}
