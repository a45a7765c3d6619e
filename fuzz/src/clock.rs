//! How long the reader of this thread has worked, whatever else the machine did meanwhile.

use std::time::{Duration, Instant};

/// Begins with the run of a target.
#[derive(Debug)]
pub(crate) struct Clock {
    started: Instant,
    before: Option<Duration>,
}

impl Clock {
    pub fn start() -> Self {
        Clock {
            started: Instant::now(),
            before: on_processor(),
        }
    }

    /// Time that has passed.
    pub fn passed(&self) -> Duration {
        self.started.elapsed()
    }

    /// Time on a processor; where the system does not say it, time that has passed.
    pub fn worked(&self) -> Duration {
        match (self.before, on_processor()) {
            (Some(before), Some(now)) => now.saturating_sub(before),
            _ => self.passed(),
        }
    }
}

/// What Linux counts for this thread, in user and in system mode.
fn on_processor() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds = text.split_ascii_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_sleeps_does_not_work() {
        let clock = Clock::start();
        std::thread::sleep(Duration::from_millis(200));
        assert!(clock.passed() >= Duration::from_millis(200));
        if on_processor().is_some() {
            assert!(clock.worked() < Duration::from_millis(100), "{:?}", clock.worked());
        }
    }
}
