//! What the page of `policyc studio` asks, and what it is answered. Nothing here knows of a browser: a [`Session`] holds files in
//! memory and answers requests in JSON.
//!
//! ```text
//! Session::put(name, bytes) ─► Files ─┐
//! Session::ask(request) ──► Part ─────┴─► read, new, compile, map, loop, simulate, diagnose ─► answer
//!                                            the libraries that the commands call           └─► made files: Session::made
//! ```
//!
//! An answer is `{ "faults": [...] }` where the command would end with 2, each fault with the text that the command prints.

mod answer;
mod code;
mod contract;
mod loops;
mod map;
mod part;
mod records;
mod session;

pub use part::{CODE, FIRST, Part, RECORDS, SIMULATE};
pub use session::Session;
