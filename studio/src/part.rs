//! Requests in parts. A module of WebAssembly holds one part or more, and a part that it does not name is not linked into it: the page
//! begins with what it shows first and fetches the rest when it is wanted.

use serde_json::Value;
use toml_input::Faults;

use crate::session::{Reply, Session, Tell};
use crate::{code, contract, loops, map, records};

/// Answers a request.
pub(crate) type Answer = fn(&Session, &Value, Tell) -> Result<Reply, Faults>;

/// Requests that come together, by name.
#[derive(Debug, Clone, Copy)]
pub struct Part(&'static [(&'static str, Answer)]);

/// Contract, decisions and closed loop: what a page shows first.
pub const FIRST: Part = Part(&[
    ("choices", contract::choices),
    ("read", contract::read),
    ("new", contract::new),
    ("map", map::map),
    ("loop", loops::step),
]);

/// The generated code.
pub const CODE: Part = Part(&[("compile", code::compile)]);

/// The diagnosis of records.
pub const RECORDS: Part = Part(&[("diagnose", records::diagnose)]);

/// All instants of load steps, with the report of `policyc simulate`.
pub const SIMULATE: Part = Part(&[("simulate", loops::simulate)]);

impl Part {
    /// How a request is answered, if it is of this part.
    pub(crate) fn find(&self, name: &str) -> Option<Answer> {
        let found = self.0.iter().find(|(own, _)| *own == name);
        found.map(|(_, answer)| *answer)
    }
}
