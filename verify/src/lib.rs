//! Differential check: generated code against the interpreter, step by step, to the bit.
//!
//! [`run`] compiles the code of a policy with every compiler it finds, feeds all builds and the reference interpreter
//! the same stream of events and compares every word that comes back: observation, Q values, command and the whole
//! state. The first difference of each build is reported with its step, name, bits and measurement.
//!
//! The way through the modules:
//!
//! | stage | module |
//! |---|---|
//! | what is built | [`toolchain`], [`drivers`] |
//! | what is fed | [`traces`] |
//! | how it travels | [`protocol`] |
//! | what is expected | [`oracle`] |
//! | who answers | [`runner`]: [`runner::Runner`] has one implementation per way of running a build |
//! | a loop closed around a build | [`live`] |
//! | what differs | [`compare`], [`report`]; in words: [`text`] |
//! | what a step costs | [`mod@measure`], [`elf`]; of all builds: [`costs`]; whether it fits into its period: [`budget`], [`advice`], [`fitting`], [`lateness`] |
//! | the files that `compile` makes | [`code`] |
//! | archives of FMUs | [`fmu`] |
//! | what the format does to decisions | [`decisions`] |
//! | every combination of ADC codes | [`codes`], kept in [`shards`] |
//! | a log of the trainer against the contract | [`replay`] |
//! | what was found, for other programs | [`cases`], [`exchange`] |
//! | checked-in files against the policy | [`drift()`], [`folder`] |

pub mod advice;
pub mod budget;
pub mod cases;
pub mod code;
pub mod codes;
pub mod compare;
pub mod costs;
pub mod drift;
pub mod drivers;
pub mod elf;
pub mod estimate;
pub mod exchange;
pub mod fitting;
pub mod fmu;
pub mod folder;
mod golden;
pub mod kit;
pub mod lane;
pub mod lateness;
pub mod live;
pub mod measure;
pub mod oracle;
pub mod protocol;
pub mod replay;
pub mod report;
pub mod runner;
mod session;
pub mod shards;
pub mod text;
pub mod toolchain;
pub mod traces;
mod zip;

pub use drift::{drift, read_text};
pub use folder::Folder;
pub use interp::decisions::{Decisions, decisions};
pub use interp::golden::{golden_result, unproven};
pub use live::{Live, LiveCommand};
pub use report::{BuildReport, Difference, GoldenResult, Outcome, Report};
pub use session::{Files, Options, Progress, VerifyError, run};
