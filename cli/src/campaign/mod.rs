//! Campaigns at work: folders, processes, and what becomes of a task.
//!
//! ```text
//!             Session: OUT/tasks, OUT/work, OUT/failed          worker: a process of this program
//!  pending ─► stage inputs in OUT/work/ID ──── one line ──────► perform the command in that folder
//!             collect OUT/work/ID/out ◄─────── one line ─────── its exit code and answer
//!             publish as OUT/tasks/ID, by one rename
//! ```
//!
//! A worker performs one task after the other, because a process takes longer to start than many a task to run, and a process of its
//! own, because a crash must cost one task and not the campaign.

mod finish;
mod folders;
mod hand;
mod local;
mod merge;
mod perform;
mod preflight;
mod session;
mod stage;
mod store;
mod worker;

pub use finish::Finished;
pub use hand::set_program;
pub use local::{Local, MOST_JOBS, Progress};
pub use merge::merge;
pub use perform::{Performed, perform};
pub use preflight::check;
pub use session::Session;
pub use worker::{WORKER, work};

#[cfg(test)]
mod tests {
    use std::fs;

    use campaign::Plan;

    use super::Session;
    use crate::ownership::Replacing;

    /// A campaign in `out` of a folder of its own, with a plan of this text and a file `a.toml`.
    pub fn session(text: &str) -> (tempfile::TempDir, Session) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.toml"), "x = 1\n").unwrap();
        let file = folder.path().join("plan.toml");
        fs::write(&file, text).unwrap();
        let plan = Plan::open(&file).unwrap();
        let session = Session::open(plan, &folder.path().join("out"), Replacing { force: false }).unwrap();
        (folder, session)
    }
}
