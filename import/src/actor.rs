//! Continuous actors: the way from the last layer to a command, as the contract's `[actions]` says it.

use policy::limits::MAX_OUTPUTS;
use policy::{Activation, DraftOutput};
use toml_input::Message;

/// What bounds the output of an actor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Squash {
    /// A curve with two ends: tanh of SAC, TD3 and DDPG.
    Curve(Activation),
    /// The output itself between two ends: PPO, A2C.
    Clip(f64, f64),
    /// The output itself between the ends of an action space that the file does not hold.
    ClipToSpace,
    /// The file does not say.
    Unknown,
}

/// An actor with one command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Actor {
    pub squash: Squash,
    /// Scale and offset behind it; `None` where the file does not say them.
    pub affine: Option<(f64, f64)>,
}

/// One of several duties that a model commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Duty {
    /// A number.
    Command(Actor),
    /// A choice among so many duties.
    Table(usize),
}

impl Duty {
    /// Columns of the last layer.
    pub fn columns(self) -> usize {
        match self {
            Self::Command(_) => 1,
            Self::Table(actions) => actions,
        }
    }

    /// The output in a contract to be filled in.
    pub fn draft(self) -> DraftOutput {
        match self {
            Self::Command(actor) => DraftOutput {
                actions: actor.entry(),
                duties: actor.duties(),
            },
            Self::Table(actions) => DraftOutput {
                actions: format!("duties = [{}]", vec!["\"TODO\""; actions].join(", ")),
                duties: None,
            },
        }
    }
}

/// The tanh of SAC, TD3 and DDPG.
pub(crate) const TANH: Squash = Squash::Curve(Activation::Tanh);

impl Squash {
    /// A curve that a contract takes behind its last layer.
    pub fn curve(activation: Activation) -> Option<Self> {
        activation.range().map(|_| Self::Curve(activation))
    }
}

impl Actor {
    /// A tanh whose ends are those of an action space.
    pub fn of_space(low: f64, high: f64) -> Self {
        let (low, high) = (short(low), short(high));
        Self {
            squash: TANH,
            affine: Some((0.5 * (high - low), 0.5 * (high + low))),
        }
    }

    /// A mean that is clipped to an action space.
    pub fn clipped(low: f64, high: f64) -> Self {
        Self {
            squash: Squash::Clip(short(low), short(high)),
            affine: Some((1.0, 0.0)),
        }
    }

    /// Least and largest command, in the units of the file.
    pub fn ends(self) -> Option<(f64, f64)> {
        let (scale, offset) = self.affine?;
        let (low, high) = match self.squash {
            Squash::Curve(curve) => curve.range().map(|range| (range.low, range.high))?,
            Squash::Clip(low, high) => (low, high),
            Squash::ClipToSpace | Squash::Unknown => return None,
        };
        let (one, other) = (scale * low + offset, scale * high + offset);
        Some((short(one.min(other)), short(one.max(other))))
    }

    /// The ends of the command, where it is taken for the duty.
    pub fn duties(self) -> Option<(f64, f64)> {
        self.ends().filter(|(low, high)| *low >= 0.0 && *high <= 1.0)
    }

    /// The entry `continuous` of `[actions]`, with what to think of it beside. A command within 0..1 is taken for a duty.
    pub fn entry(self) -> String {
        let squash = match self.squash {
            Squash::Curve(curve) => format!("squash = {}", curve.written()),
            Squash::Clip(low, high) => format!("clip = [{low:?}, {high:?}]"),
            // ends that are no duties are refused until a scale stands beside them: nothing wrong can pass
            Squash::ClipToSpace => {
                return "continuous = { clip = [\"TODO\", \"TODO\"] }   # ends of the action space; if its action is no duty, \
                        scale and offset, too: duty = scale * s + offset"
                    .to_owned();
            }
            Squash::Unknown => {
                return "continuous = { squash = \"TODO\", scale = \"TODO\", offset = \"TODO\" }   # or { clip = [lo, hi] }: a clipped mean"
                    .to_owned();
            }
        };
        match (self.affine, self.duties()) {
            (Some((scale, offset)), Some((low, high))) => {
                let scaled = match (scale, offset) {
                    (1.0, 0.0) => String::new(),
                    _ => format!(", scale = {scale:?}, offset = {offset:?}"),
                };
                format!(
                    "continuous = {{ {squash}{scaled} }}   # check: the command is {low:?} to {high:?}, taken for the duty"
                )
            }
            _ => {
                let whose = self.ends().map_or_else(String::new, |(low, high)| {
                    format!("; the training's own command is {low:?} to {high:?}")
                });
                format!(
                    "continuous = {{ {squash}, scale = \"TODO\", offset = \"TODO\" }}   # duty = scale * s + offset, s behind it{whose}"
                )
            }
        }
    }

    /// An entry of `gains` in `[actions]`; its ends are those of the training's own command.
    pub fn gain(self) -> String {
        let factor = "source = \"TODO\"";
        let squash = match self.squash {
            Squash::Curve(curve) => format!("squash = {}", curve.written()),
            Squash::Clip(low, high) => format!("clip = [{low:?}, {high:?}]"),
            Squash::ClipToSpace => "clip = [\"TODO\", \"TODO\"]".to_owned(),
            Squash::Unknown => "squash = \"TODO\"".to_owned(),
        };
        match self.affine {
            Some((1.0, 0.0)) => format!("{{ {factor}, {squash} }}"),
            Some((scale, offset)) => format!("{{ {factor}, {squash}, scale = {scale:?}, offset = {offset:?} }}"),
            None => format!("{{ {factor}, {squash}, scale = \"TODO\", offset = \"TODO\" }}"),
        }
    }

    /// What was recognised, in a sentence.
    pub fn said(self) -> String {
        match self.squash {
            Squash::Curve(curve) => {
                format!(
                    "a continuous actor: the duty is a {} of the one output; of SAC that is its mean",
                    curve.word()
                )
            }
            Squash::Clip(..) | Squash::ClipToSpace => {
                "a continuous actor: the duty is the mean, clipped to the action space".to_owned()
            }
            Squash::Unknown => "a continuous actor: what squashes and scales its one output is yours to say".to_owned(),
        }
    }
}

/// Scale and offset of a graph, which are binary32; 1 and 0 where it has none.
pub(crate) fn scaled(found: Option<(f64, f64)>) -> (f64, f64) {
    found.map_or((1.0, 0.0), |(scale, offset)| (short(scale), short(offset)))
}

/// Numbers of a space are binary32: 0.1 and not 0.10000000149011612.
pub(crate) fn short(x: f64) -> f64 {
    format!("{:?}", x as f32).parse().unwrap_or(x)
}

/// An actor with more commands than a contract has outputs.
pub(crate) fn several(found: usize) -> Message {
    Message::new("this actor commands more numbers than a contract has outputs")
        .found(format!("{found} outputs"))
        .expected(format!("at most {MAX_OUTPUTS}"))
        .hint("say --output N if one of them is the duty: the others are left out; say --gains if they are the gains of a law")
}
