//! The action space of a model: one table of actions, one of several, one command, or several.

use std::ops::Range;

use policy::NamedTensor;
use policy::limits::{MAX_ACTIONS, MAX_OUTPUTS, MIN_ACTIONS};
use serde_json::Value;
use toml_input::Message;

use super::{box_ends, other, text};
use crate::Options;
use crate::actor::{self, Actor, Duty};
use crate::network::{left_out, no_output};
use crate::recognise::refused_continuous;

/// What an action space says.
pub(super) struct Space {
    /// Outputs behind the cut.
    pub actions: usize,
    /// One, or all where they are gains; none of a table of actions.
    pub commands: Vec<Actor>,
    /// The outputs that are kept, if not all are.
    pub part: Option<Part>,
    /// What each of several duties is, where all are kept.
    pub several: Vec<Duty>,
}

/// Outputs that are kept.
pub(super) struct Part {
    rows: Range<usize>,
    all: usize,
    /// What is kept and what is left out.
    pub said: String,
}

/// Reads the action space; of a class that squashes its action by a tanh it is a box.
pub(super) fn read(data: &Value, is_tanh: bool, options: &Options) -> Result<Space, Message> {
    let space = data.get("action_space").unwrap_or(&Value::Null);
    let kind = text(space, ":type:").unwrap_or("none");
    if kind.ends_with(".Box'>") {
        return commands(data, is_tanh, options);
    }
    if is_tanh {
        return Err(refused_continuous("SAC, TD3 or DDPG without a Box action space"));
    }
    if options.gains {
        return Err(other(
            "--gains are numbers, and this model chooses",
            kind,
            "gymnasium.spaces.Box",
        )
        .hint("leave out --gains, and give a duty for each action"));
    }
    if kind.ends_with(".MultiDiscrete'>") {
        return dimension(space, options.output);
    }
    let number = match space.get("n") {
        Some(Value::String(text)) => text.parse::<usize>().ok(),
        Some(value) => value.as_u64().and_then(|n| usize::try_from(n).ok()),
        None => None,
    };
    match (number, options.output) {
        (Some(actions), None) if kind.ends_with(".Discrete'>") => Ok(Space {
            actions,
            commands: Vec::new(),
            part: None,
            several: Vec::new(),
        }),
        (Some(_), Some(output)) => Err(other(
            "--output picks one of several, and this model has one table of actions",
            &format!("--output {output}"),
            "no --output",
        )
        .hint("leave it out: each action of the table gets a duty")),
        _ => Err(other(
            "the action space is not one table of actions",
            kind,
            "gymnasium.spaces.Discrete, MultiDiscrete or Box",
        )
        .hint("write the combinations as one Discrete table")),
    }
}

/// One command, or the one that is picked, or all of them: each a duty, or as gains.
fn commands(data: &Value, is_tanh: bool, options: &Options) -> Result<Space, Message> {
    // with a squash of its own, or with noise that depends on the state, the layers behind the mean are others
    let kwargs = data.get("policy_kwargs").unwrap_or(&Value::Null);
    let is_on = |value: Option<&Value>| value.and_then(Value::as_bool).unwrap_or(false);
    if is_on(data.get("use_sde")) || is_on(kwargs.get("squash_output")) {
        return Err(other(
            "noise that depends on the state is not read",
            "use_sde or squash_output",
            "neither",
        )
        .hint("save the mean's layers as safetensors, and write continuous = {...} in [actions]"));
    }
    let of = |(low, high): &(f64, f64)| match is_tanh {
        true => Actor::of_space(*low, *high),
        false => Actor::clipped(*low, *high),
    };
    let ends = box_ends(data, "action_space")?;
    let all = ends.len();
    if options.gains {
        return Ok(Space {
            actions: all,
            commands: ends.iter().map(of).collect(),
            part: None,
            several: Vec::new(),
        });
    }
    let output = match (all, options.output) {
        (_, Some(output)) => output,
        (1, None) => 0,
        (several, None) if several <= MAX_OUTPUTS => {
            let duty = |ends| Duty::Command(of(ends));
            return Ok(all_of(several, ends.iter().map(duty).collect()));
        }
        (several, None) => return Err(actor::several(several)),
    };
    let own = ends.get(output).map(of).ok_or_else(|| no_output(output, all))?;
    let part = (all > 1).then(|| Part {
        rows: output..output + 1,
        all,
        said: format!("output {output} of {all} is the duty; {}", left_out(output, all)),
    });
    Ok(Space {
        actions: 1,
        commands: vec![own],
        part,
        several: Vec::new(),
    })
}

/// All outputs, which decide several duties.
fn all_of(outputs: usize, several: Vec<Duty>) -> Space {
    Space {
        actions: outputs,
        commands: Vec::new(),
        part: None,
        several,
    }
}

/// One dimension of a MultiDiscrete, or all. Its logits stand side by side with those of the others, and each dimension has an argmax of its
/// own: what one of them chooses does not hang on the others.
fn dimension(space: &Value, output: Option<usize>) -> Result<Space, Message> {
    let sizes = space.get("nvec").and_then(numbers);
    let sizes = sizes.filter(|sizes| !sizes.is_empty()).ok_or_else(|| {
        other(
            "the sizes of a MultiDiscrete action space cannot be read",
            "no list `nvec`",
            "what model.save(...) writes",
        )
    })?;
    let listed = format!("{sizes:?}");
    let all = sizes.len();
    let output = match (all, output) {
        (_, Some(output)) => output,
        (1, None) => 0,
        (2..=MAX_OUTPUTS, None) if sizes.iter().all(|size| (MIN_ACTIONS..=MAX_ACTIONS).contains(size)) => {
            let tables = sizes.iter().copied().map(Duty::Table).collect();
            return Ok(all_of(sizes.iter().sum(), tables));
        }
        (_, None) => {
            return Err(other(
                "this model has several tables of actions that one contract does not hold",
                &format!("a MultiDiscrete of {listed}"),
                "one table, or 2 to 16 tables of 2 to 256 actions",
            )
            .hint(
                "say --output N if dimension N, counted from 0, is the duty: the others are left out. Where they add up to a duty, train with \
                 one Discrete table of all sums",
            ));
        }
    };
    let actions = *sizes.get(output).ok_or_else(|| no_output(output, all))?;
    let from = sizes.iter().take(output).sum();
    let part = (all > 1).then(|| Part {
        rows: from..from + actions,
        all: sizes.iter().sum(),
        said: format!(
            "dimension {output} of the MultiDiscrete {listed} chooses the duty; of the dimensions {}",
            left_out(output, all)
        ),
    });
    Ok(Space {
        actions,
        commands: Vec::new(),
        part,
        several: Vec::new(),
    })
}

/// `[5 3]`, as numpy prints whole numbers, or a list of JSON. A long array is printed with dots, and refused.
fn numbers(value: &Value) -> Option<Vec<usize>> {
    // beyond it there are no contracts: a sum must not overflow
    const LARGEST: usize = 1 << 20;
    let numbers: Vec<usize> = match value {
        Value::String(text) => {
            let inner = text.trim().strip_prefix('[')?.strip_suffix(']')?;
            let words = inner.split(|c: char| c == ',' || c.is_whitespace());
            let parsed = words.filter(|word| !word.is_empty()).map(|word| word.parse().ok());
            parsed.collect::<Option<_>>()?
        }
        Value::Array(items) => {
            let parsed = items.iter().map(|item| usize::try_from(item.as_u64()?).ok());
            parsed.collect::<Option<_>>()?
        }
        _ => return None,
    };
    let is_fit = numbers.len() <= LARGEST && numbers.iter().all(|n| (1..=LARGEST).contains(n));
    is_fit.then_some(numbers)
}

impl Part {
    /// Cuts weights and bias of the layer.
    ///
    /// # Errors
    /// If the layer has other outputs than the space.
    pub fn cut(&self, tensors: &mut [NamedTensor], layer: &str) -> Result<(), Message> {
        for leaf in ["weight", "bias"] {
            let name = format!("{layer}.{leaf}");
            let Some(tensor) = tensors.iter_mut().find(|tensor| tensor.name == name) else {
                continue;
            };
            let rows = tensor.shape.first().copied().unwrap_or_default();
            if rows != self.all {
                return Err(other(
                    "the last layer has another number of outputs than the action space",
                    &format!("{rows} rows of `{name}`"),
                    &self.all.to_string(),
                ));
            }
            let width: usize = tensor.shape.iter().skip(1).product();
            let kept = self.rows.start * width..self.rows.end * width;
            tensor.values = tensor
                .values
                .as_ref()
                .and_then(|values| Some(values.get(kept)?.to_vec()));
            tensor.shape[0] = self.rows.len();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_numpy_prints_them_or_not_at_all() {
        let of = |text: &str| numbers(&Value::from(text));
        assert_eq!(of("[5 3]"), Some(vec![5, 3]));
        assert_eq!(of("[ 5 12  3]"), Some(vec![5, 12, 3]));
        for wrong in [
            "[5 ... 3]",
            "[[5 3]\n [2 2]]",
            "[5 -3]",
            "[5 0]",
            "5",
            "[5 99999999999]",
        ] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
        assert_eq!(numbers(&serde_json::json!([5, 3])), Some(vec![5, 3]));
    }
}
