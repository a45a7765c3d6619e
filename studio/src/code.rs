//! The generated code.

use std::path::Path;

use codegen::{Output, manifest};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::{Faults, messages};

use crate::answer::Contract;
use crate::contract::load;
use crate::session::{Reply, Session, Tell, read, texts};

/// What is made of the contract.
#[derive(Deserialize)]
struct Wanted {
    /// Names of outputs.
    emit: Vec<String>,
    /// Name of the target.
    target: String,
}

#[derive(Serialize)]
struct Compiled {
    sizes: String,
    notes: Vec<String>,
}

/// What `policyc compile --no-costs` would write, apart from archives.
pub(crate) fn compile(session: &Session, request: &Value, _: Tell) -> Result<Reply, Faults> {
    let (of, Wanted { emit, target }) = (read::<Contract>(request)?, read(request)?);
    let target = codegen::target(&target)?;
    let names: Vec<&str> = Output::ALL.iter().map(|output| output.name()).collect();
    let output = |name: &String| Output::find(name).ok_or_else(|| messages::unknown("output", name, &names));
    let emit = emit.iter().map(output).collect::<Result<Vec<_>, _>>()?;
    let policy = load(session, &of)?;
    let code = verify::code::make(&policy, target, &emit, verify::kit::DEFAULT_STEPS, None)?;
    let sizes = manifest::sizes(&policy, target);
    let mut notes = verify::code::notes(&policy, target, &sizes, code.files.keys().map(Path::new));
    notes.extend(verify::code::decision_notes(&code.decisions));
    let answer = Compiled {
        sizes: sizes.to_string(),
        notes,
    };
    Reply::with(&answer, texts(code.files))
}
