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

mod folders;
mod local;
mod perform;
mod preflight;
mod session;
mod worker;

pub use local::{Local, Progress, set_program};
pub use perform::{Performed, perform};
pub use preflight::check;
pub use session::{Finished, Session, merge};
pub use worker::{WORKER, work};
