//! The policy in the loop: interpreted, or compiled and running as a program of its own.

use closed_loop::{Answer, Call, Controller, External, interpreter};
use codegen::Language;
use policy::Policy;
use toml_input::Message;
use verify::Live;

use crate::Failure;
use crate::arguments::ControllerKind;

/// A controller and what it is called.
pub struct Named {
    pub name: String,
    pub controller: Box<dyn Controller>,
}

/// The policy's controller, started.
pub fn start(policy: &Policy, kind: ControllerKind) -> Result<Named, Failure> {
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
    let mut live = Live::start(policy, language).map_err(Message::new)?;
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
