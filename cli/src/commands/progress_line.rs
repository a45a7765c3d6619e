//! Progress as one line.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use toml_input::Faults;

use crate::interruption;

/// One line on the terminal; lines at intervals where the output is a log.
pub struct ProgressLine {
    terminal: bool,
    last: Instant,
    shown: bool,
}

impl ProgressLine {
    pub fn new() -> Self {
        Self {
            terminal: std::io::stderr().is_terminal(),
            last: Instant::now(),
            shown: false,
        }
    }

    /// Shows what `text` says, if it is time for it.
    pub fn show(&mut self, text: impl FnOnce() -> String) {
        // an eye sees no more; a log of a job in CI shows that it lives
        let interval = if self.terminal {
            Duration::from_millis(100)
        } else {
            Duration::from_secs(10)
        };
        if self.last.elapsed() < interval {
            return;
        }
        self.last = Instant::now();
        let text = text();
        let mut out = std::io::stderr();
        // progress that cannot be shown is no reason to stop
        let _ = if self.terminal {
            write!(out, "\r\x1b[K{text}")
        } else {
            writeln!(out, "{text}")
        };
        let _ = out.flush();
        self.shown = self.terminal;
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
