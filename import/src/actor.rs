//! Continuous actors: the way from the last layer to a command, as the contract's `[actions]` says it.

use toml_input::Message;

/// What bounds the output of an actor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Squash {
    /// tanh, then from +-1 to the ends of the action space: SAC, TD3, DDPG.
    Tanh,
    /// The mean itself, clipped to the action space: PPO, A2C.
    Clip,
}

/// An actor with one command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Actor {
    pub squash: Squash,
    /// Ends of the action space; `None` where the file does not say them.
    pub space: Option<(f64, f64)>,
}

impl Actor {
    /// The entry `continuous` of `[actions]`, with what to think of it beside. An action space within 0..1 is taken for duties.
    pub fn entry(self) -> String {
        // numbers of a space are binary32: 0.1 and not 0.10000000149011612
        let short = |x: f64| format!("{:?}", x as f32).parse().unwrap_or(x);
        let Some((low, high)) = self.space.map(|(low, high)| (short(low), short(high))) else {
            return "continuous = { squash = \"tanh\", scale = \"TODO\", offset = \"TODO\" }   # duty = scale * tanh(y) + offset".to_owned();
        };
        let is_duty = low >= 0.0 && high <= 1.0;
        let whose = format!("the action space is {low:?} to {high:?}");
        match (self.squash, is_duty) {
            (Squash::Tanh, true) => {
                let (scale, offset) = (0.5 * (high - low), 0.5 * (high + low));
                format!(
                    "continuous = {{ squash = \"tanh\", scale = {scale:?}, offset = {offset:?} }}   # {whose}, taken for the duty"
                )
            }
            (Squash::Clip, true) => {
                format!("continuous = {{ clip = [{low:?}, {high:?}] }}   # {whose}, taken for the duty")
            }
            (Squash::Tanh, false) => format!(
                "continuous = {{ squash = \"tanh\", scale = \"TODO\", offset = \"TODO\" }}   # duty = scale * tanh(y) + offset; {whose}"
            ),
            (Squash::Clip, false) => format!(
                "continuous = {{ clip = [{low:?}, {high:?}], scale = \"TODO\", offset = \"TODO\" }}   # duty = scale * y + offset; {whose}"
            ),
        }
    }

    /// What was recognised, in a sentence.
    pub fn said(self) -> String {
        match self.squash {
            Squash::Tanh => {
                "a continuous actor: the duty is a tanh of the one output; of SAC that is its mean".to_owned()
            }
            Squash::Clip => "a continuous actor: the duty is the mean, clipped to the action space".to_owned(),
        }
    }
}

/// An actor with several commands.
pub(crate) fn several(found: usize) -> Message {
    Message::new("this actor commands several numbers, and one duty is compiled")
        .found(format!("{found} outputs"))
        .expected("an action space of one number")
        .hint("a converter with several legs gets a controller for each; or give the duty alone as the action")
}
