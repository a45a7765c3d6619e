//! What a training shows while it runs: a bar per seed on a terminal, lines at intervals in a log.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressStyle};
use train::{Progress, SeedRun, Settings, Watch};

use super::kept::Kept;
use super::tensorboard::Events;
use crate::failure::Failure;
use crate::talk;
use report::grouped;

// a convention: a training of minutes gives a log of some ten lines
const LOG_EVERY: Duration = Duration::from_secs(5);

/// Shows progress and keeps checkpoints.
pub struct Watcher<'a> {
    kept: &'a Kept,
    events: Option<&'a Events>,
    stop: &'a AtomicBool,
    steps: u64,
    view: Mutex<View>,
}

enum View {
    /// A quiet run.
    Nothing,
    Bars(MultiProgress, BTreeMap<u64, ProgressBar>),
    Log(BTreeMap<u64, Instant>),
}

impl<'a> Watcher<'a> {
    pub fn new(settings: &Settings, kept: &'a Kept, events: Option<&'a Events>, stop: &'a AtomicBool) -> Self {
        let view = if talk::is_quiet() {
            View::Nothing
        } else if std::io::stderr().is_terminal() && !talk::is_verbose() {
            View::Bars(MultiProgress::new(), BTreeMap::new())
        } else {
            View::Log(BTreeMap::new())
        };
        Self {
            kept,
            events,
            stop,
            steps: settings.steps,
            view: Mutex::new(view),
        }
    }

    /// Clears the bars.
    ///
    /// # Errors
    /// If a checkpoint on the way could not be written.
    pub fn finish(&self) -> Result<(), Failure> {
        if let Ok(view) = self.view.lock()
            && let View::Bars(all, _) = &*view
        {
            // progress that cannot be shown is no reason to stop
            let _ = all.clear();
        }
        self.kept.failure()
    }
}

impl Watch for Watcher<'_> {
    fn look(&self, progress: &Progress) {
        if let Some(events) = self.events {
            events.look(progress);
        }
        let Ok(mut view) = self.view.lock() else { return };
        let Progress { seed, look, .. } = *progress;
        match &mut *view {
            View::Nothing => {}
            View::Bars(all, bars) => {
                let bar = bars.entry(seed).or_insert_with(|| all.add(new_bar(seed, self.steps)));
                bar.set_position(look.step);
                bar.set_message(progress.to_string());
            }
            View::Log(shown) => {
                let last = shown.entry(seed).or_insert_with(Instant::now);
                if talk::is_verbose() || last.elapsed() >= LOG_EVERY {
                    *last = Instant::now();
                    talk::tell(&format!(
                        "seed {seed}: {} of {}, {}, {} left at most",
                        grouped(look.step),
                        grouped(self.steps),
                        progress,
                        HumanDuration(Duration::from_secs_f64(progress.remaining.clamp(0.0, 1e9)))
                    ));
                }
            }
        }
    }

    fn checkpoint(&self, seed: u64, bytes: &[u8]) {
        if !self.kept.try_write(seed, bytes) {
            // a training that cannot be kept is stopped while it can be told
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn ended(&self, seed: u64, run: &SeedRun) {
        if let Some(events) = self.events {
            events.ended(seed, run);
        }
        let Ok(mut view) = self.view.lock() else { return };
        let line = format!("seed {seed} {} after {} control periods", run.ended, grouped(run.steps));
        match &mut *view {
            View::Nothing => {}
            View::Bars(all, bars) => {
                if let Some(bar) = bars.remove(&seed) {
                    bar.finish_and_clear();
                    all.remove(&bar);
                }
                let _ = all.println(line);
            }
            View::Log(_) => talk::tell(&line),
        }
    }
}

fn new_bar(seed: u64, steps: u64) -> ProgressBar {
    let bar = ProgressBar::new(steps);
    let template = "seed {prefix} [{bar:24}] {pos}/{len}  {msg}  {eta} left at most";
    // a template that does not parse leaves the library's own
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_prefix(seed.to_string());
    bar
}
