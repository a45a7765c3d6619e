//! Progress as one line.

use std::io::{IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use closed_loop::Next;
use indicatif::HumanDuration;
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

    /// Shows what comes next and how long the whole still takes, for a library that tells it.
    ///
    /// # Errors
    /// If there is to be no next: the user has had enough.
    pub fn next(&mut self, next: &Next<'_>, pace: Pace) -> Result<(), Faults> {
        interruption::go_on()?;
        self.show(|| format!("{}{}", next.what, pace.left(next.done, next.all)));
        Ok(())
    }

    /// Clears the line.
    pub fn clear(&mut self) {
        if self.shown {
            // nobody may be listening any more
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

/// Least time left that is worth a word, s: pieces of work differ by more, and one that takes longer than those before it would be
/// "about 0 s left" for long.
const WORTH_SAYING: f64 = 5.0;
/// From here on seconds are told in words, s.
const LONG: f64 = 100.0;

/// How long work will take that comes in pieces.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    begun: Instant,
}

impl Pace {
    /// Of work that begins now.
    pub fn new() -> Self {
        Self { begun: Instant::now() }
    }

    /// What is said of the time that is left after `done` of `all` pieces.
    pub fn left(self, done: u64, all: u64) -> String {
        left(self.begun.elapsed().as_secs_f64(), done, all)
    }
}

fn left(spent: f64, done: u64, all: u64) -> String {
    let left = spent / done.max(1) as f64 * all.saturating_sub(done) as f64;
    match done > 0 && left >= WORTH_SAYING {
        false => String::new(),
        true if left < LONG => format!(", about {left:.0} s left"),
        true => format!(", about {} left", HumanDuration(Duration::from_secs_f64(left.min(1e9)))),
    }
}

/// Work that says nothing is told of after this time: what is done sooner needs no word.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two looks at the clock.
const LOOK: Duration = Duration::from_millis(100);

/// Tells that silent work goes on, until it is dropped.
pub struct Working {
    ended: Option<Sender<()>>,
    teller: Option<JoinHandle<()>>,
}

impl Working {
    /// Of work that begins now and is called `what`.
    pub fn new(what: &'static str) -> Self {
        if talk::is_quiet() {
            return Self {
                ended: None,
                teller: None,
            };
        }
        let (ended, end) = channel::<()>();
        let begun = Instant::now();
        let teller = std::thread::spawn(move || {
            let mut line = ProgressLine::new();
            while end.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                let spent = begun.elapsed();
                if spent >= PATIENCE {
                    line.show(|| format!("{what}: {} s", spent.as_secs()));
                }
            }
            line.clear();
        });
        Self {
            ended: Some(ended),
            teller: Some(teller),
        }
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        self.ended = None;
        if let Some(teller) = self.teller.take() {
            // what could not be told is no reason to stop
            let _ = teller.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_from_the_pace_and_is_said_where_it_is_worth_it() {
        assert_eq!(left(10.0, 25, 100), ", about 30 s left");
        assert_eq!(left(60.0, 1, 11), ", about 10 minutes left");
        assert_eq!(left(10.0, 90, 100), "", "soon over");
        assert_eq!(left(10.0, 0, 100), "", "nothing is known yet");
        assert_eq!(left(10.0, 100, 100), "");
    }
}
