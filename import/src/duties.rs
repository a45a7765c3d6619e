//! What each of several duties of a model is: as its reader says, as its definition says of every command, or as the user says.

use policy::OutputShape;
use policy::limits::{MAX_OUTPUTS, MIN_ACTIONS};
use toml_input::Message;

use crate::Options;
use crate::actor::{self, Actor, Duty, Squash};
use crate::network::Network;
use crate::read::Loaded;

/// Each of several duties; none of one duty, or of gains.
///
/// # Errors
/// If `--outputs` says something else than the file, or what a contract does not hold.
pub(crate) fn of(loaded: &Loaded, network: &Network, options: &Options) -> Result<Vec<Duty>, Message> {
    let columns = network.layers.last().map_or(0, |layer| layer.outputs);
    let known = match &network.definition {
        _ if !loaded.several.is_empty() => loaded.several.clone(),
        Some(definition) if columns > 1 && !options.gains => {
            let of = |index: usize| {
                let affine = definition.each.get(index).copied().or(definition.actor.affine);
                Duty::Command(Actor {
                    affine,
                    ..definition.actor
                })
            };
            (0..columns).map(of).collect()
        }
        _ => Vec::new(),
    };
    if options.outputs.is_empty() {
        return Ok(known);
    }
    let widths: Vec<usize> = known.iter().map(|duty| duty.columns()).collect();
    match known.is_empty() && loaded.actor.is_none() {
        true => said(&options.outputs, columns),
        false if widths == options.outputs => Ok(known),
        false => Err(Message::new("--outputs says something else than the file")
            .found(written(&options.outputs))
            .expected(if widths.is_empty() {
                "1".to_owned()
            } else {
                written(&widths)
            })
            .hint("leave --outputs out: what each output is stands in the file")),
    }
}

/// What the user says: 1 column is a number, more are a choice among as many duties.
fn said(widths: &[usize], columns: usize) -> Result<Vec<Duty>, Message> {
    let sum: usize = widths.iter().sum();
    if !(2..=MAX_OUTPUTS).contains(&widths.len()) || widths.contains(&0) || sum != columns {
        return Err(Message::new("--outputs does not share out the network's outputs")
            .found(format!("{}, together {sum}", written(widths)))
            .expected(format!("2 to {MAX_OUTPUTS} numbers, which add up to {columns}"))
            .hint("1 is a duty as a number, N are a choice among N duties, in the order of the last layer"));
    }
    let unknown = Actor {
        squash: Squash::Unknown,
        affine: None,
    };
    let duty = |width: &usize| match *width < MIN_ACTIONS {
        true => Duty::Command(unknown),
        false => Duty::Table(*width),
    };
    Ok(widths.iter().map(duty).collect())
}

fn written(widths: &[usize]) -> String {
    let widths: Vec<String> = widths.iter().map(usize::to_string).collect();
    format!("--outputs {}", widths.join(","))
}

/// Whether a contract can hold so many commands.
///
/// # Errors
/// If there are more.
pub(crate) fn fits(commands: usize) -> Result<(), Message> {
    match commands <= MAX_OUTPUTS {
        true => Ok(()),
        false => Err(actor::several(commands)),
    }
}

/// Whether an actor has as many commands as `--actions` says.
///
/// # Errors
/// If it has not.
pub(crate) fn as_many(commands: usize, said: usize) -> Result<(), Message> {
    match commands == said {
        true => Ok(()),
        false => Err(Message::new("this actor has another number of outputs than --actions says")
            .found(format!("{commands} outputs"))
            .expected(format!("{said}, by --actions"))
            .hint(
                "say --output N if one of them is the duty, --outputs 1,1 with a 1 for each if each is a duty of its own, --gains if they are \
                 the gains of a law",
            )),
    }
}

/// Names of the outputs in a contract to be filled in.
pub(crate) fn names(duties: &[Duty]) -> Vec<String> {
    (0..duties.len()).map(|index| format!("u{index}")).collect()
}

/// What golden answers say of each.
pub(crate) fn shapes<'a>(duties: &[Duty], names: &'a [String]) -> Vec<OutputShape<'a>> {
    let mut column = 0;
    let shape = |(duty, name): (&Duty, &'a String)| {
        let width = duty.columns();
        column += width;
        OutputShape {
            name,
            column: column - width,
            width,
            is_choice: matches!(duty, Duty::Table(_)),
        }
    };
    duties.iter().zip(names).map(shape).collect()
}
