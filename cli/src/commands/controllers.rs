//! The policy in the loop: interpreted, or compiled and running as a program of its own.

use closed_loop::{Answer, Call, Error, External, Named, interpreter_driving};
use codegen::Language;
use policy::Policy;
use verify::Live;

use crate::arguments::ControllerKind;
use crate::interruption;

/// The policy's controller of this kind, whose output of the index `output` drives the plant; the others behind it where they are
/// to be compared with it.
pub fn start_all(policy: &Policy, output: usize, kind: ControllerKind, check: bool) -> Result<Vec<Named>, Error> {
    use ControllerKind::{C, Interpreter, Rust};
    let others = [Interpreter, Rust, C].into_iter();
    let others = others.filter(|other| check && *other != kind);
    let mut named = Vec::new();
    for kind in [kind].into_iter().chain(others) {
        interruption::go_on()?;
        named.push(start(policy, output, kind)?);
    }
    Ok(named)
}

/// The policy's controller, started; the output of the index `output` drives the plant.
pub fn start(policy: &Policy, output: usize, kind: ControllerKind) -> Result<Named, Error> {
    let (language, name) = match kind {
        ControllerKind::Interpreter => {
            return Ok(Named {
                name: "interpreter".to_owned(),
                controller: interpreter_driving(policy, output)?,
            });
        }
        ControllerKind::Rust => (Language::Rust, "generated Rust"),
        ControllerKind::C => (Language::C, "generated C"),
    };
    let mut live = Live::start(policy, language)?;
    let name = format!("{name} ({})", live.name());
    let ask = move |call: Call<'_>| match call {
        Call::Restart => live.restart().map(|()| Vec::new()),
        Call::Step(samples) => live.step_all(samples).map(|commands| {
            let answer = |command: verify::LiveCommand| Answer {
                duty: command.duty,
                action: Some(command.action_index),
                status: command.status,
            };
            commands.into_iter().map(answer).collect()
        }),
    };
    Ok(Named {
        name,
        controller: Box::new(External::driving(policy, output, ask)?),
    })
}
