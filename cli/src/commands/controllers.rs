//! The policy in the loop: interpreted, or compiled and running as a program of its own.

use closed_loop::{Answer, Call, Error, External, Named, interpreter};
use codegen::Language;
use policy::Policy;
use verify::Live;

use crate::arguments::ControllerKind;
use crate::interruption;

/// The policy's controller of this kind; the others behind it where they are to be compared with it.
pub fn start_all(policy: &Policy, kind: ControllerKind, check: bool) -> Result<Vec<Named>, Error> {
    use ControllerKind::{C, Interpreter, Rust};
    let others = [Interpreter, Rust, C].into_iter();
    let others = others.filter(|other| check && *other != kind);
    let mut named = Vec::new();
    for kind in [kind].into_iter().chain(others) {
        interruption::go_on()?;
        named.push(start(policy, kind)?);
    }
    Ok(named)
}

/// The policy's controller, started.
pub fn start(policy: &Policy, kind: ControllerKind) -> Result<Named, Error> {
    let (language, name) = match kind {
        ControllerKind::Interpreter => {
            return Ok(Named {
                name: "interpreter".to_owned(),
                controller: interpreter(policy)?,
            });
        }
        ControllerKind::Rust => (Language::Rust, "generated Rust"),
        ControllerKind::C => (Language::C, "generated C"),
    };
    let mut live = Live::start(policy, language)?;
    let name = format!("{name} ({})", live.name());
    let ask = move |call: Call<'_>| match call {
        Call::Restart => live.restart().map(|()| None),
        Call::Step(samples) => live.step(samples).map(|command| {
            Some(Answer {
                duty: command.duty,
                action: Some(command.action_index),
                status: command.status,
            })
        }),
    };
    Ok(Named {
        name,
        controller: Box::new(External::new(policy, ask)?),
    })
}
