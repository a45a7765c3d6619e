//! `[actions]`: the duty of each network output, what each adds to a law of control, one output as a duty, or all of them as the
//! gains of a law.

use toml_input::{Sink, Table, Value};

use super::features::Surroundings;
use super::{continuous, duty, residual, schedule};
use crate::catalogue;
use crate::limits::{MAX_ACTIONS, MIN_ACTIONS};
use crate::model::{Action, Head, Pair};

/// What the outputs of the network mean, as far as it could be read.
pub(crate) struct Actions {
    pub head: Head,
    /// Outputs of the network by the contract, faulty actions included; 0 if that is unknown.
    pub outputs: usize,
}

impl Default for Actions {
    fn default() -> Self {
        Self {
            head: Head::Choice(Vec::new()),
            outputs: 0,
        }
    }
}

/// Discrete actions, and how many the contract lists, faulty ones included.
#[derive(Default)]
struct Listed {
    list: Vec<Action>,
    count: usize,
}

/// `features` are the names of all features, if all are known.
pub(crate) fn read(root: &mut Table<'_>, around: &Surroundings<'_>, features: &[String], faults: &mut Sink) -> Actions {
    let hint = "give [actions] with `duties = [...]` or `pairs = [...]`, one per network output, with `base` and `offsets`, with \
         `continuous = {...}`, or with `gains = [...]`";
    let Some(mut section) = root
        .required("actions", hint, faults)
        .and_then(|v| v.table("[actions]", faults))
    else {
        return Actions::default();
    };
    let forms = ["duties", "pairs", "offsets", "continuous", "gains"].map(|key| section.optional(key));
    let base = section.optional("base");
    let dead_zone = section.optional("dead_zone");
    if let (Some(value), [_, _, None, _, None]) = (base.as_ref().or(dead_zone.as_ref()), &forms) {
        faults.push(value.fault(catalogue::needs_other(value.label(), "offsets")));
    }
    let law = (base.as_ref(), dead_zone.as_ref());
    let actions = match &forms {
        [Some(value), None, None, None, None] => chosen(value, from_duties(value, faults), faults),
        [None, Some(value), None, None, None] => chosen(value, from_pairs(value, faults), faults),
        [None, None, Some(value), None, None] => residual::read(value, law.0, law.1, around, faults),
        [None, None, None, Some(value), None] => continuous::read(value, faults).map(|head| Actions {
            head: Head::Continuous(head),
            outputs: 1,
        }),
        [None, None, None, None, Some(value)] => schedule::read(value, law, around, features, faults),
        _ => {
            let count = forms.iter().flatten().count();
            let known = "`duties`, `pairs`, `offsets`, `continuous`, `gains`";
            let message = catalogue::exactly_one_of("[actions]", known, count);
            faults.push(section.fault(message));
            None
        }
    };
    section.finish(faults);
    actions.unwrap_or_default()
}

fn chosen(value: &Value<'_>, listed: Option<Listed>, faults: &mut Sink) -> Option<Actions> {
    let Listed { list, count } = listed?;
    if !(MIN_ACTIONS..=MAX_ACTIONS).contains(&count) {
        let message = catalogue::count("actions", count, MIN_ACTIONS, MAX_ACTIONS);
        faults.push(value.fault(message));
    }
    Some(Actions {
        head: Head::Choice(list),
        outputs: count,
    })
}

fn from_duties(value: &Value<'_>, faults: &mut Sink) -> Option<Listed> {
    let items = value.list("an array of duty ratios", faults)?;
    // one fault for the whole list, instead of one for every whole number in it
    if has_decimal_commas(&items) {
        faults.push(value.fault(catalogue::decimal_commas("duties", items.len())));
        return None;
    }
    let duties = items.iter().filter_map(|item| duty(item, faults));
    let list: Vec<_> = duties.map(|duty| Action { duty, pair: None }).collect();
    Some(Listed {
        list,
        count: items.len(),
    })
}

/// `[0,10, 0,15]`: zeros and whole numbers above 1 in turn.
fn has_decimal_commas(items: &[Value<'_>]) -> bool {
    let whole = |item: &Value<'_>| item.number(&mut Sink::new()).filter(|x| x.fract() == 0.0);
    let pairs = items.chunks_exact(2);
    // two numbers may be meant as they stand: [0, 1]
    items.len() >= 4
        && pairs.remainder().is_empty()
        && items
            .chunks_exact(2)
            .all(|pair| whole(&pair[0]) == Some(0.0) && whole(&pair[1]).is_some())
        && items
            .chunks_exact(2)
            // [0, 1, 0, 1] may be meant, too; a duty above 1 is not
            .any(|pair| whole(&pair[1]).is_some_and(|x| x > 1.0))
}

fn from_pairs(value: &Value<'_>, faults: &mut Sink) -> Option<Listed> {
    let items = value.list("an array of pairs: [{ xi = 0.5, phi = 0.05 }]", faults)?;
    let mut actions = Listed::default();
    let mut known = true;
    for item in &items {
        match pair(item, faults) {
            Some(pairs) => {
                actions.count += pairs.len();
                for pair in pairs {
                    actions.list.extend(action(item, pair, faults));
                }
            }
            None => known = false,
        }
    }
    // a count that leaves out a faulty pair would be a second fault, of the network's outputs
    known.then_some(actions)
}

fn pair(item: &Value<'_>, faults: &mut Sink) -> Option<Vec<Pair>> {
    let mut section = item.table("pairs", faults)?;
    let hint = "a pair means duty = xi + c phi: { xi = 0.5, phi = 0.05, c = [-1, 0, 1] }";
    let xi = section.required("xi", hint, faults).and_then(|v| duty(&v, faults));
    let phi = section.required("phi", hint, faults).and_then(|v| duty(&v, faults));
    let factors = section
        .optional("c")
        .map_or(Some(vec![-1, 0, 1]), |v| factors(&v, faults));
    section.finish(faults);
    let (xi, phi) = (xi?, phi?);
    Some(factors?.into_iter().map(|c| Pair { xi, phi, c }).collect())
}

fn factors(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<i8>> {
    let items = value.list("an array of -1, 0, 1", faults)?;
    let mut list = Vec::new();
    for item in &items {
        let factor = item.integer(-1..=1, faults)?;
        if list.contains(&factor) {
            faults.push(item.fault(catalogue::out_of_range(
                "c",
                &format!("{factor} twice"),
                "each of -1, 0, 1 once",
            )));
            return None;
        }
        list.push(factor);
    }
    if list.is_empty() {
        faults.push(value.fault(catalogue::count("values of c", 0, 1, 3)));
        return None;
    }
    Some(list)
}

fn action(item: &Value<'_>, pair: Pair, faults: &mut Sink) -> Option<Action> {
    let duty = pair.xi + f64::from(pair.c) * pair.phi;
    if (0.0..=1.0).contains(&duty) {
        return Some(Action { duty, pair: Some(pair) });
    }
    let label = format!("xi + c phi with c = {}", pair.c);
    faults.push(item.fault(catalogue::duty_range(&label, duty)));
    None
}
