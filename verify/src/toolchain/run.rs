//! A program that is run and watched.

use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Runs a program to its end, but not longer than `timeout`.
///
/// # Errors
/// If it cannot be started or does not end in time.
pub fn run_for(command: &mut Command, timeout: Duration) -> std::io::Result<Output> {
    let mut child = command
        // a compiler that asks something gets an end of file instead of our terminal
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        // both at once: a program that fills one pipe while the other is read would never end
        let out = scope.spawn(|| drain(stdout));
        let err = scope.spawn(|| drain(stderr));
        let deadline = Instant::now() + timeout;
        let mut pause = Duration::from_millis(1);
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if Instant::now() > deadline {
                // its pipes close with it, so the threads that drain them end
                child.kill()?;
                child.wait()?;
                let text = format!("no end after {} s", timeout.as_secs());
                return Err(std::io::Error::new(std::io::ErrorKind::TimedOut, text));
            }
            std::thread::sleep(pause);
            // short at first, for programs that take milliseconds; then rare, for those that take minutes
            pause = (pause * 2).min(Duration::from_millis(20));
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
    fn a_compiler_that_hangs_is_ended() {
        let begin = Instant::now();
        let error = run_for(Command::new("sleep").arg("60"), Duration::from_millis(50)).map(|output| output.status);
        assert_eq!(error.map_err(|error| error.kind()), Err(std::io::ErrorKind::TimedOut));
        assert!(begin.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn both_streams_of_a_program_come_back() {
        let output = run_for(
            Command::new("sh").args(["-c", "echo a; echo b >&2; exit 3"]),
            Duration::from_secs(20),
        );
        let output = output.map(|output| (output.status.code(), output.stdout, output.stderr));
        assert_eq!(
            output.map_err(|error| error.kind()),
            Ok((Some(3), b"a\n".to_vec(), b"b\n".to_vec()))
        );
    }
}
