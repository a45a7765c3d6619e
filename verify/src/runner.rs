//! Ways of running a build: here a program on this machine, elsewhere an emulator or a board.
//!
//! ```text
//! exchange ──channel──► writer thread ──stdin──►  driver
//! receive  ◄─channel─── reader thread ◄─stdout──  (this machine, or QEMU with semihosting on the same streams)
//! ended    ◄───join──── error thread  ◄─stderr──
//! ```
//!
//! A thread a pipe, because a pipe holds 64 kB: a driver that waits until somebody reads its answers would not read its
//! events, and a writer who waits for that would not read its answers.

use std::fmt;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use targets::Endianness;

/// A build that answers events.
pub trait Runner: Send {
    /// Starts the build anew; the prologue is `expected` words long.
    fn start(&mut self, expected: usize) -> Result<Vec<u32>, RunError>;

    /// Hands over the words of a chunk's events and takes back `expected` words.
    fn exchange(&mut self, input: &[u32], expected: usize) -> Result<Vec<u32>, RunError>;
}

/// Why no complete answer came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunError {
    /// What came before.
    pub received: Vec<u32>,
    /// What happened.
    pub reason: RunFailure,
}

/// How a build failed to answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunFailure {
    /// It could not be started.
    Start(String),
    /// It ended; exit status and the last lines of its error output.
    Ended {
        /// Exit status or signal.
        status: String,
        /// Tail of its error output.
        stderr: String,
    },
    /// Nothing came for this long.
    Silent(Duration),
}

impl fmt::Display for RunFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(error) => write!(f, "the driver could not be started: {error}"),
            Self::Ended { status, stderr } if stderr.is_empty() => write!(f, "the driver ended: {status}"),
            Self::Ended { status, stderr } => write!(f, "the driver ended: {status}: {stderr}"),
            Self::Silent(time) => write!(f, "the driver sent nothing for {} s", time.as_secs()),
        }
    }
}

/// A driver program as a child process of this machine, fed through pipes.
#[derive(Debug)]
pub struct ProcessRunner {
    command: Command,
    timeout: Duration,
    order: Endianness,
    process: Option<Process>,
}

#[derive(Debug)]
struct Process {
    child: Child,
    to_child: Option<Sender<Vec<u8>>>,
    from_child: Receiver<Vec<u8>>,
    stderr: Option<JoinHandle<String>>,
    /// Bytes that are not yet a whole answer.
    pending: Vec<u8>,
}

/// Bytes of error output kept.
// a screen: a sanitiser's first report
const STDERR_KEPT: u64 = 4096;

impl ProcessRunner {
    /// `command` starts the driver, whose words have that byte order; a driver that is silent for `timeout` is ended.
    pub fn new(command: Command, timeout: Duration, order: Endianness) -> Self {
        Self {
            command,
            timeout,
            order,
            process: None,
        }
    }
}

impl ProcessRunner {
    /// Ends the stream and waits for the end of the driver.
    ///
    /// # Errors
    /// If it does not end by itself.
    pub fn finish(&mut self) -> Result<(), RunError> {
        let error = |reason| RunError {
            received: Vec::new(),
            reason,
        };
        let Some(mut process) = self.process.take() else {
            return Ok(());
        };
        // the end of the stream: the writer thread ends, and the driver reads an end of file
        process.to_child = None;
        match process.from_child.recv_timeout(self.timeout) {
            Err(RecvTimeoutError::Disconnected) => {}
            // answers to no question are a fault of the driver as well
            Ok(_) | Err(RecvTimeoutError::Timeout) => return Err(error(RunFailure::Silent(self.timeout))),
        }
        match process.child.wait() {
            Ok(status) if status.success() => Ok(()),
            Ok(_) | Err(_) => Err(error(process.ended())),
        }
    }
}

impl Runner for ProcessRunner {
    fn start(&mut self, expected: usize) -> Result<Vec<u32>, RunError> {
        let start = |error: String| RunError {
            received: Vec::new(),
            reason: RunFailure::Start(error),
        };
        let process = Process::spawn(&mut self.command).map_err(|error| start(error.to_string()))?;
        self.process.insert(process).receive(expected, self.timeout, self.order)
    }

    fn exchange(&mut self, input: &[u32], expected: usize) -> Result<Vec<u32>, RunError> {
        let Some(process) = &mut self.process else {
            let reason = RunFailure::Start("exchange before start".to_owned());
            return Err(RunError {
                received: Vec::new(),
                reason,
            });
        };
        if let Some(to_child) = &process.to_child {
            // a send fails only if the driver is gone: `receive` says how
            let _ = to_child.send(input.iter().flat_map(|word| bytes(*word, self.order)).collect());
        }
        process.receive(expected, self.timeout, self.order)
    }
}

impl Process {
    fn spawn(command: &mut Command) -> std::io::Result<Self> {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let (to_child, input) = channel::<Vec<u8>>();
        let (output, from_child) = channel();
        if let Some(mut stdin) = child.stdin.take() {
            std::thread::spawn(move || {
                for bytes in input {
                    if stdin.write_all(&bytes).and_then(|()| stdin.flush()).is_err() {
                        break;
                    }
                }
            });
        }
        if let Some(mut stdout) = child.stdout.take() {
            std::thread::spawn(move || {
                // what a pipe of Linux holds
                let mut buffer = vec![0; 1 << 16];
                while let Ok(n @ 1..) = stdout.read(&mut buffer) {
                    if output.send(buffer[..n].to_vec()).is_err() {
                        break;
                    }
                }
            });
        }
        let stderr = child.stderr.take().map(|mut stderr| {
            std::thread::spawn(move || {
                let mut kept = Vec::new();
                let _ = stderr.by_ref().take(STDERR_KEPT).read_to_end(&mut kept);
                // the rest is read and thrown away, or the driver would block on a full pipe
                let _ = std::io::copy(&mut stderr, &mut std::io::sink());
                String::from_utf8_lossy(&kept).trim().to_owned()
            })
        });
        Ok(Self {
            child,
            to_child: Some(to_child),
            from_child,
            stderr,
            pending: Vec::new(),
        })
    }

    fn receive(&mut self, expected: usize, timeout: Duration, order: Endianness) -> Result<Vec<u32>, RunError> {
        let bytes = expected * 4;
        let mut deadline = Instant::now() + timeout;
        while self.pending.len() < bytes {
            let wait = deadline.saturating_duration_since(Instant::now());
            let reason = match self.from_child.recv_timeout(wait) {
                Ok(more) => {
                    self.pending.extend(more);
                    // an emulator that answers slowly is not silent: each piece starts the time anew
                    deadline = Instant::now() + timeout;
                    continue;
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.kill();
                    RunFailure::Silent(timeout)
                }
                Err(RecvTimeoutError::Disconnected) => self.ended(),
            };
            return Err(RunError {
                received: words(&std::mem::take(&mut self.pending), order),
                reason,
            });
        }
        // what came beyond belongs to the next answer
        let rest = self.pending.split_off(bytes);
        Ok(words(&std::mem::replace(&mut self.pending, rest), order))
    }

    fn ended(&mut self) -> RunFailure {
        self.to_child = None;
        let status = match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        };
        let stderr = self
            .stderr
            .take()
            .and_then(|thread| thread.join().ok())
            .unwrap_or_default();
        RunFailure::Ended { status, stderr }
    }

    fn kill(&mut self) {
        self.to_child = None;
        // it may have ended by itself in the meantime
        let _ = self.child.kill();
        // without it a dead child stays in the table of processes
        let _ = self.child.wait();
    }
}

impl Drop for Process {
    // a lane that ends at a difference leaves a driver that would run on
    fn drop(&mut self) {
        self.kill();
    }
}

fn bytes(word: u32, order: Endianness) -> [u8; 4] {
    match order {
        Endianness::Little => word.to_le_bytes(),
        Endianness::Big => word.to_be_bytes(),
        Endianness::Native => word.to_ne_bytes(),
    }
}

fn words(bytes: &[u8], order: Endianness) -> Vec<u32> {
    let word = |bytes: &[u8; 4]| match order {
        Endianness::Little => u32::from_le_bytes(*bytes),
        Endianness::Big => u32::from_be_bytes(*bytes),
        Endianness::Native => u32::from_ne_bytes(*bytes),
    };
    bytes.as_chunks().0.iter().map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str, timeout_ms: u64) -> ProcessRunner {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        ProcessRunner::new(command, Duration::from_millis(timeout_ms), Endianness::Native)
    }

    #[test]
    fn words_come_back_from_a_program_that_echoes() {
        let mut cat = shell("printf abcd; exec cat", 10_000);
        assert_eq!(cat.start(1), Ok(vec![u32::from_ne_bytes(*b"abcd")]));
        let chunk: Vec<u32> = (0..100_000).collect();
        assert_eq!(cat.exchange(&chunk, chunk.len()).as_deref(), Ok(chunk.as_slice()));
        assert_eq!(cat.exchange(&[7, 8], 1), Ok(vec![7]));
        assert_eq!(cat.exchange(&[9], 2), Ok(vec![8, 9]));
    }

    #[test]
    fn words_travel_in_the_byte_order_of_the_target() {
        let mut command = Command::new("sh");
        command.args(["-c", "printf abcd; exec cat"]);
        let mut big = ProcessRunner::new(command, Duration::from_secs(10), Endianness::Big);
        assert_eq!(big.start(1), Ok(vec![0x6162_6364]));
        assert_eq!(big.exchange(&[1, 0x0203_0405], 2), Ok(vec![1, 0x0203_0405]));
    }

    #[test]
    fn a_crash_is_reported_with_what_came_before() {
        let mut crash = shell("printf abcdef; echo broken >&2; exit 3", 10_000);
        let error = crash.start(2).unwrap_err();
        assert_eq!(error.received, [u32::from_ne_bytes(*b"abcd")]);
        let RunFailure::Ended { status, stderr } = error.reason else {
            panic!("{error:?}")
        };
        assert!(status.contains('3') && stderr == "broken", "{status} {stderr}");
    }

    #[test]
    fn a_hang_ends_after_the_timeout() {
        let mut hang = shell("exec sleep 60", 50);
        let error = hang.start(1).unwrap_err();
        assert_eq!(error.reason, RunFailure::Silent(Duration::from_millis(50)));
    }

    #[test]
    fn a_program_that_does_not_exist_cannot_be_started() {
        let mut none = ProcessRunner::new(
            Command::new("/nonexistent/driver"),
            Duration::from_secs(1),
            Endianness::Native,
        );
        assert!(matches!(none.start(1).unwrap_err().reason, RunFailure::Start(_)));
    }
}
