//! Progress as one line.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use toml_input::Faults;

use crate::interruption;
use crate::talk;

/// One line on the terminal; lines at intervals where the output is a log, or where a run tells more.
pub struct ProgressLine {
    /// Whether a line takes the place of the one before.
    replaces: bool,
    interval: Duration,
    last: Option<Instant>,
    shown: bool,
}

impl ProgressLine {
    pub fn new() -> Self {
        let replaces = std::io::stderr().is_terminal() && !talk::is_verbose();
        Self {
            replaces,
            // an eye sees no more; a log of a job in CI shows that it lives
            interval: match replaces {
                true => Duration::from_millis(100),
                false if talk::is_verbose() => Duration::from_secs(1),
                false => Duration::from_secs(10),
            },
            // whoever wants to know more sees the first line at once
            last: (!talk::is_verbose()).then(Instant::now),
            shown: false,
        }
    }

    /// Shows what `text` says, if it is time for it.
    pub fn show(&mut self, text: impl FnOnce() -> String) {
        if talk::is_quiet() || self.last.is_some_and(|last| last.elapsed() < self.interval) {
            return;
        }
        self.last = Some(Instant::now());
        let text = text();
        let mut out = std::io::stderr();
        // progress that cannot be shown is no reason to stop
        let _ = if self.replaces {
            write!(out, "\r\x1b[K{text}")
        } else {
            writeln!(out, "{text}")
        };
        let _ = out.flush();
        self.shown = self.replaces;
    }

    /// Shows what comes next, for a library that tells it.
    ///
    /// # Errors
    /// If there is to be no next: the user has had enough.
    pub fn next(&mut self, what: &dyn Display) -> Result<(), Faults> {
        interruption::go_on()?;
        self.show(|| what.to_string());
        Ok(())
    }

    /// Clears the line.
    pub fn clear(&mut self) {
        if self.shown {
            eprint!("\r\x1b[K");
        }
    }
}
