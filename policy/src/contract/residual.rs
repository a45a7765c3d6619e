//! `base`, `offsets` and `dead_zone` in `[actions]`: a law of control, and what a network adds to it (contract section 8).

use toml_input::{Sink, Value};

use super::actions::Actions;
use super::features::{self, Surroundings};
use super::fits_f32;
use crate::bounds::{self, Inputs, Overflow};
use crate::catalogue;
use crate::limits::{MAX_ACTIONS, MAX_DEAD_ZONE, MIN_ACTIONS};
use crate::model::{Action, Head, Interval, Residual, Schedule, Source, Still};

pub(super) fn read(
    offsets: &Value<'_>,
    base: Option<&Value<'_>>,
    dead_zone: Option<&Value<'_>>,
    around: &Surroundings<'_>,
    faults: &mut Sink,
) -> Option<Actions> {
    let law =
        match base {
            Some(value) => source(value, around, faults),
            None => {
                let message = catalogue::needs_other("offsets", "base");
                faults.push(offsets.fault(message.hint(
                    "offsets are added to a law of control: `base = \"0.25 - 0.02 * (model_current - i_out)\"`",
                )));
                None
            }
        };
    let zone = dead_zone.map_or(Some(Vec::new()), |value| still(value, around, faults));
    let items = offsets.list("an array of offsets of the duty", faults)?;
    if !(MIN_ACTIONS..=MAX_ACTIONS).contains(&items.len()) {
        faults.push(offsets.fault(catalogue::count("offsets", items.len(), MIN_ACTIONS, MAX_ACTIONS)));
    }
    let list: Vec<Action> = items.iter().filter_map(|item| offset(item, faults)).collect();
    Some(Actions {
        head: Head::Residual(Residual {
            base: law?,
            offsets: list,
            dead_zone: zone?,
            // filled in by `limited`, when they have been read
            limits: Interval { low: 0.0, high: 1.0 },
        }),
        outputs: items.len(),
    })
}

/// The same head with the limits of the duty.
pub(crate) fn limited(head: Head, limits: Option<Interval>) -> Head {
    match (head, limits) {
        (Head::Residual(head), Some(limits)) => Head::Residual(Residual { limits, ..head }),
        (Head::Schedule(head), Some(limits)) => Head::Schedule(Schedule { limits, ..head }),
        (head, _) => head,
    }
}

/// A fault if the law or a bound of the dead zone could leave the format.
pub(crate) fn bounded(head: &Head, inputs: &Inputs, at: &Value<'_>, faults: &mut Sink) {
    for source in head.sources() {
        if let Err(Overflow(magnitude)) = bounds::expression(&source.tree, inputs) {
            let what = format!("`{}` in [actions]", source.text);
            faults.push(at.fault(catalogue::may_overflow(&what, magnitude)));
        }
    }
}

pub(super) fn source(value: &Value<'_>, around: &Surroundings<'_>, faults: &mut Sink) -> Option<Source> {
    let (tree, text) = features::source(value, around, faults)?;
    Some(Source { tree, text })
}

/// A change of duty: no more than all of it.
fn offset(item: &Value<'_>, faults: &mut Sink) -> Option<Action> {
    let duty = item.number_within(-1.0..=1.0, faults)?;
    if !fits_f32(duty) {
        faults.push(item.fault(catalogue::not_in_f32(item.label(), duty)));
        return None;
    }
    Some(Action { duty, pair: None })
}

pub(super) fn still(value: &Value<'_>, around: &Surroundings<'_>, faults: &mut Sink) -> Option<Vec<Still>> {
    let hint = "where nothing is added: `dead_zone = [{ source = \"model_voltage - v_ref\", within = 0.25 }]`";
    let items = value.list("an array of { source, within }", faults)?;
    if !(1..=MAX_DEAD_ZONE).contains(&items.len()) {
        faults.push(value.fault(catalogue::count("entries of dead_zone", items.len(), 1, MAX_DEAD_ZONE)));
        return None;
    }
    let one = |item: &Value<'_>, faults: &mut Sink| {
        let mut section = item.table("dead_zone", faults)?;
        let source = section
            .required("source", hint, faults)
            .and_then(|v| self::source(&v, around, faults));
        let within = section.required("within", hint, faults).and_then(|v| {
            let within = v.positive(faults)?;
            if fits_f32(within) {
                return Some(within);
            }
            faults.push(v.fault(catalogue::not_in_f32("within", within)));
            None
        });
        section.finish(faults);
        Some(Still {
            source: source?,
            within: within?,
        })
    };
    // all of them, so that each reports its own faults
    let read: Vec<Option<Still>> = items.iter().map(|item| one(item, faults)).collect();
    read.into_iter().collect()
}
