//! Damaged bytes for every reader of outside bytes, and what must hold of the answer.
//!
//! ```text
//! seeds ─► corpus ─► mutate ─► probe ─► an answer of a new kind ─► corpus
//! files    entries   bytes     reader   a fault ─► minimise ─► folder of findings
//! of the             tokens    panic, time, memory
//! repository         forms
//! ```
//!
//! A [`targets::Target`] is one reader with its seeds. [`guard::probe`] runs it on one input and judges panic, time and memory.
//! [`driver::run`] draws the inputs of one target from a seed. [`parent`] gives each target a process of its own: a stack that
//! overflows or a loop without end then costs this target alone, and its input is in a journal.
//! The same seed gives the same inputs. There is no feedback by coverage, so that stable Rust is enough.

pub mod allocation;
pub mod arguments;
mod clock;
pub mod corpus;
pub mod driver;
pub mod finding;
pub mod forms;
pub mod guard;
pub mod journal;
pub mod minimise;
pub mod mutate;
pub mod parent;
pub mod targets;
