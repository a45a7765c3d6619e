//! A program that is run, watched, and ended with the run.

use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Set from outside when there is to be no next step.
pub type Stop = AtomicBool;

/// The user has had enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

/// Why a program has not come to its end.
#[derive(Debug)]
pub(crate) enum Failed {
    /// From outside.
    Stopped,
    /// It cannot be started, or takes too long.
    Io(std::io::Error),
}

/// Runs a program to its end, but not longer than `patience`, and ends it when `stop` is set.
pub(crate) fn run(command: &mut Command, patience: Duration, stop: &Stop) -> Result<Output, Failed> {
    let streams = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = streams.spawn().map_err(Failed::Io)?;
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        // both at once: a program that fills one pipe while the other is read would never end
        let out = scope.spawn(|| drain(stdout));
        let err = scope.spawn(|| drain(stderr));
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().map_err(Failed::Io)? {
                break status;
            }
            let stopped = stop.load(Ordering::Relaxed);
            if stopped || begun.elapsed() > patience {
                // its pipes close with it, so the threads that drain them end
                child.kill().and_then(|()| child.wait()).map_err(Failed::Io)?;
                return Err(if stopped {
                    Failed::Stopped
                } else {
                    let text = format!("no end after {} s", patience.as_secs());
                    Failed::Io(std::io::Error::new(std::io::ErrorKind::TimedOut, text))
                });
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let text = |thread: std::thread::ScopedJoinHandle<'_, Vec<u8>>| thread.join().unwrap_or_default();
        Ok(Output {
            status,
            stdout: text(out),
            stderr: text(err),
        })
    })
}

fn drain(pipe: Option<impl std::io::Read>) -> Vec<u8> {
    let mut bytes = Vec::new();
    if let Some(mut pipe) = pipe {
        // what came before a fault of the pipe is kept
        let _ = pipe.read_to_end(&mut bytes);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_ends_when_the_run_is_stopped() {
        let begun = Instant::now();
        let stop = Stop::new(true);
        let result = run(Command::new("sleep").arg("60"), Duration::from_secs(60), &stop);
        assert!(matches!(result, Err(Failed::Stopped)), "{result:?}");
        assert!(begun.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn a_program_that_hangs_is_ended() {
        let stop = Stop::new(false);
        let result = run(Command::new("sleep").arg("60"), Duration::from_millis(50), &stop);
        let Err(Failed::Io(error)) = result else {
            panic!("{result:?}")
        };
        assert_eq!(error.kind(), std::io::ErrorKind::TimedOut);
    }
}
