//! The duties of a log against those of its actions: an index says nothing of what it commands.

use policy::{DutyPath, Expr, Head, Policy, Residual};
use serde::Serialize;

use super::explain::number;
use super::log::{Done, Log};

/// What differs by less than this share of the largest duty is the same duty.
// three digits of a log; neighbours in a table of actions are farther apart
const SAME: f64 = 5e-3;

/// What one action differs by in all of its rows alike is another duty from this share of the largest on, whatever the log scatters by.
// a trainer in binary32 is off by a hundredth of it; an offset of .005 that should be .0051 by ten times it
const FINE: f64 = 1e-5;

/// The same where a law of signals stands beside it, or where a feature tells the duty: their digits are in it, five of a log and more.
const OF_SIGNALS: f64 = 1e-4;

/// Standard errors of the median of an action's rows that are no chance: of a hundred actions one in 17,000 logs.
const SURE: f64 = 5.0;

/// Most actions that are named one by one: a reader takes in no more.
const MOST_NAMED: usize = 8;

/// Duties that the log has with its actions, beside those of the contract.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DutyResult {
    /// Rows with a duty that were compared.
    pub rows: usize,
    /// Rows with the duty that the contract has for the action.
    pub equal: usize,
    /// Line of the first other one.
    pub first_line: Option<usize>,
    /// Largest difference of a duty from the contract's.
    pub worst: f64,
    /// Where the duties come from: a column, or a feature.
    pub source: String,
    /// What the log has with each action of the contract, if it is one duty.
    pub logged: Vec<Option<f64>>,
    /// What the contract has.
    pub own: Vec<f64>,
    /// The duties were worked out from a feature, by its scale and offset in the contract.
    pub derived: bool,
    /// `logged` and `own` are what the actions add to a law, and not duties.
    pub adds: bool,
}

/// A row of the log, its action, its duty.
type Pair = (usize, usize, f64);

/// One output of the contract and what a log says of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Logged<'a> {
    pub policy: &'a Policy,
    pub path: &'a DutyPath<'a>,
    pub log: &'a Log,
    pub done: &'a Done,
}

/// Compares; `None` where the log does not say which duty an action had. `commanded` is what the contract makes of the action of each
/// row.
pub(super) fn duties(of: Logged<'_>, commanded: &[f64]) -> Option<DutyResult> {
    let log = of.log;
    let table = match of.path.head {
        Head::Choice(table) => table,
        Head::Residual(head) => return added(of, head, commanded),
        Head::Continuous(_) | Head::Schedule(_) | Head::Several(_) => return None,
    };
    let own: Vec<f64> = table.iter().map(|action| action.duty).collect();
    let Pairs {
        source,
        derived,
        pairs,
        step,
    } = pairs(of)?;
    let largest = own.iter().fold(0.0_f64, |most, duty| most.max(duty.abs()));
    let is_same = |a: f64, b: f64| (a - b).abs() <= SAME * largest;
    let more = |pair: &&Pair| Some((pair.1, pair.2 - own.get(pair.1)?));
    let more: Vec<(usize, f64)> = pairs.iter().filter_map(|pair| more(&pair)).collect();
    let step = unless_written(step, own.iter().copied());
    let share = if derived { OF_SIGNALS } else { FINE };
    let off = off_alike(own.len(), &more, (share * largest).max(0.5 * step * 1.001));
    let is_other = |(_, action, duty): &&Pair| {
        let is_own = own.get(*action).is_some_and(|own| is_same(*own, *duty));
        !is_own || off.get(*action).copied().unwrap_or(true)
    };
    let others: Vec<&Pair> = pairs.iter().filter(is_other).collect();
    let logged = (0..own.len()).map(|action| {
        let mut of_it = pairs.iter().filter(|pair| pair.1 == action).map(|pair| pair.2);
        let first = of_it.next()?;
        of_it.all(|duty| is_same(first, duty)).then_some(first)
    });
    (!pairs.is_empty()).then(|| DutyResult {
        rows: pairs.len(),
        equal: pairs.len() - others.len(),
        first_line: others.first().map(|(row, ..)| log.line(*row)),
        worst: worst(more.iter().map(|(_, more)| *more)),
        source,
        logged: logged.collect(),
        own: own.clone(),
        derived,
        adds: false,
    })
}

/// The actions whose rows differ from the contract alike: their median is off by more than `allowed` and than the scatter of all rows
/// explains. A row with another duty, or another action, moves no median.
fn off_alike(actions: usize, more: &[(usize, f64)], allowed: f64) -> Vec<bool> {
    let of = |action: usize| -> Vec<f64> {
        let own = more.iter().filter(|(of, _)| *of == action);
        own.map(|(_, more)| *more).collect()
    };
    let middles: Vec<f64> = (0..actions).map(|action| median(of(action))).collect();
    let around = |(action, more): &(usize, f64)| middles.get(*action).map_or(0.0, |middle| (more - middle).abs());
    // of a normal distribution; the median of some rows scatters by a quarter more than their mean
    let scatter = 1.25 * 1.4826 * median(more.iter().map(around).collect());
    let is_off = |(action, middle): (usize, &f64)| {
        let rows = of(action).len() as f64;
        rows > 0.0 && middle.abs() > allowed.max(SURE * scatter / rows.sqrt())
    };
    middles.iter().enumerate().map(is_off).collect()
}

/// 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn worst(more: impl Iterator<Item = f64>) -> f64 {
    more.map(f64::abs).filter(|more| more.is_finite()).fold(0.0, f64::max)
}

/// The same where an action adds to a law: what the log has more or less than the contract commands is what its action adds more or
/// less.
fn added(of: Logged<'_>, head: &Residual, commanded: &[f64]) -> Option<DutyResult> {
    let log = of.log;
    let own: Vec<f64> = head.offsets.iter().map(|action| action.duty).collect();
    let Pairs {
        source,
        derived,
        pairs,
        step: digit,
    } = pairs(of)?;
    let apart = own
        .iter()
        .enumerate()
        .flat_map(|(n, one)| own[..n].iter().map(move |other| (one - other).abs()));
    let apart = apart.filter(|apart| *apart > 0.0).fold(f64::INFINITY, f64::min);
    // a quarter of what tells two actions apart, if that is less; a step of the log, half of which the duty before is off and half
    // the one behind
    let rows = pairs.iter().filter_map(|pair| commanded.get(pair.0)).copied();
    let digit = unless_written(digit, rows.clone());
    // one digit of a duty says nothing to anybody, so nobody logs it; below a millionth it is no rounding
    let step = if digit < LEAST_STEP || derived { 0.0 } else { digit };
    let allowed = (SAME * head.limits.high.abs()).min(0.25 * apart).max(step * 1.001);
    if allowed >= 0.5 * apart {
        // rounded so coarsely that one action looks like its neighbour
        return None;
    }
    let is_inside = |duty: f64| head.limits.low + allowed < duty && duty < head.limits.high - allowed;
    let all = pairs.iter().map(|(row, action, duty)| {
        let command = commanded.get(*row).copied().unwrap_or(f64::NAN);
        (*action, *duty, command)
    });
    let inside: Vec<(usize, f64)> = (all.clone())
        .filter(|(_, duty, command)| is_inside(*duty) && is_inside(*command))
        .map(|(action, duty, command)| (action, duty - command))
        .collect();
    let share = match !derived && head.base.tree == Expr::Input(of.path.previous_duty) {
        true => FINE,
        false => OF_SIGNALS,
    };
    let fine = (share * head.limits.high.abs()).max(digit * 1.001);
    let off = off_alike(own.len(), &inside, fine);
    let farthest = worst(all.map(|(_, duty, command)| duty - command));
    let mut more: Vec<Vec<f64>> = vec![Vec::new(); own.len()];
    let mut others = Vec::new();
    for (row, action, duty) in &pairs {
        let command = commanded.get(*row).copied().unwrap_or(f64::NAN);
        let is_off = off.get(*action).copied().unwrap_or(false) && is_inside(*duty) && is_inside(command);
        let is_other = (duty - command).abs() > allowed || command.is_nan() || is_off;
        if is_other {
            others.push(*row);
        }
        // at a limit nobody sees what was added
        if let Some(list) = more
            .get_mut(*action)
            .filter(|_| is_other && is_inside(*duty) && is_inside(command))
        {
            list.push(duty - command);
        }
    }
    let logged = own.iter().zip(&more).enumerate().map(|(action, (own, more))| {
        let is_there = pairs.iter().any(|pair| pair.1 == action);
        let first = more.first().copied().unwrap_or(0.0);
        (is_there && more.iter().all(|one| (one - first).abs() <= allowed)).then_some(own + first)
    });
    (!pairs.is_empty()).then(|| DutyResult {
        rows: pairs.len(),
        equal: pairs.len() - others.len(),
        first_line: others.first().map(|row| log.line(*row)),
        worst: farthest,
        source,
        logged: logged.collect(),
        own: own.clone(),
        derived,
        adds: true,
    })
}

/// Below it a step of decimals is no rounding that matters to a table of actions.
const LEAST_STEP: f64 = 1e-6;

fn is_multiple(value: f64, step: f64, near: f64) -> bool {
    ((value / step).round() * step - value).abs() < near * step
}

/// The decimal step of a column: its values are multiples of it; 0 where there is none down to a billionth.
fn decimal_step(values: impl Iterator<Item = f64> + Clone) -> f64 {
    // binary64 of a decimal is off by less than a millionth of these steps
    let is_written = |step: &f64| values.clone().all(|value| is_multiple(value, *step, 1e-6));
    let steps = [0.01, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
    steps.into_iter().find(is_written).unwrap_or(0.0)
}

/// The step as one of rounding: 0 where what the contract makes lies on it, too.
fn unless_written(step: f64, mut own: impl Iterator<Item = f64>) -> f64 {
    // binary32 of a duty is off by a thirtieth of a millionth
    let is_own = step >= LEAST_STEP && own.all(|value| is_multiple(value, step, 0.05));
    if is_own { 0.0 } else { step }
}

/// The duty before each row, as the log has it: `None` where it does not say. A law may read it, and what an action adds shows only
/// where the law began at the log's. Before the first row of an episode the contract's `initial_duty` stands: the log is held
/// against it.
pub(super) fn before(of: Logged<'_>) -> Vec<Option<f64>> {
    let log = of.log;
    if let Some(duties) = &of.done.previous_duty {
        let begins = log.begins.iter().copied().chain(std::iter::repeat(false));
        return duties
            .iter()
            .zip(begins)
            .map(|(duty, begins)| (!begins).then_some(*duty))
            .collect();
    }
    let mut list = vec![None; log.rows()];
    if let (Head::Residual(head), Some(found)) = (of.path.head, pairs(of)) {
        for (row, _, duty) in found.pairs {
            let goes_on = log.begins.get(row + 1) == Some(&false);
            // another one is no duty that these actions lead to
            let is_duty = head.limits.low <= duty && duty <= head.limits.high;
            if let Some(before) = list.get_mut(row + 1).filter(|_| goes_on && is_duty) {
                *before = Some(duty);
            }
        }
    }
    list
}

/// Where the duties of the log's actions stand.
struct Pairs {
    /// A column, or a feature.
    source: String,
    /// They were worked out from a feature.
    derived: bool,
    pairs: Vec<Pair>,
    /// Decimal step of the duties, from the digits of their column; 0 where it has none.
    step: f64,
}

/// The duties of the log's actions; `None` where it has none.
fn pairs(of: Logged<'_>) -> Option<Pairs> {
    let Logged {
        policy,
        path,
        log,
        done,
    } = of;
    let actions = done.actions.as_ref()?;
    let is_said = |row: usize| !log.unsaid.get(row).copied().unwrap_or(false);
    let action = |row: usize| Some(*actions.get(row).filter(|_| is_said(row))? as usize);
    if let Some(duties) = &done.duty {
        let pair = |(row, duty): (usize, &f64)| Some((row, action(row)?, *duty));
        return Some(Pairs {
            source: path.named("duty"),
            derived: false,
            pairs: duties.iter().enumerate().filter_map(pair).collect(),
            step: decimal_step(duties.iter().copied()),
        });
    }
    // what is before a row is the duty of the action in the row before, unless an episode begins
    let behind = |duties: Vec<Option<f64>>| -> Vec<Pair> {
        let goes_on = |row: &usize| !log.begins.get(*row).copied().unwrap_or(true);
        (1..duties.len())
            .filter(goes_on)
            .filter(|row| is_said(*row))
            .filter_map(|row| Some((row - 1, action(row - 1)?, (*duties.get(row)?)?)))
            .collect()
    };
    if let Some(duties) = &done.previous_duty {
        return Some(Pairs {
            source: path.named("previous_duty"),
            derived: false,
            step: decimal_step(duties.iter().copied()),
            pairs: behind(duties.iter().map(|duty| Some(*duty)).collect()),
        });
    }
    let plain = |index: &usize| {
        let feature = policy.features.get(*index);
        let is_plain = feature.is_some_and(|feature| {
            feature.source == Expr::Input(path.previous_duty) && feature.filters.is_empty() && feature.scale != 0.0
        });
        is_plain && log.observed.get(*index).is_some_and(Option::is_some)
    };
    let index = (0..policy.features.len()).find(plain)?;
    let (feature, values) = (policy.features.get(index)?, log.observed.get(index)?.as_ref()?);
    let is_clipped = |value: f64| feature.clip.is_some_and(|clip| value <= clip.low || value >= clip.high);
    let duty = |value: &f64| (!is_clipped(*value)).then(|| (value - feature.offset) / feature.scale);
    Some(Pairs {
        source: feature.name.clone(),
        derived: true,
        pairs: behind(values.iter().map(duty).collect()),
        step: decimal_step(values.iter().copied()) / feature.scale.abs(),
    })
}

impl DutyResult {
    /// The actions of which the log has no duty, in words: nothing was compared there, and "equal" alone would hide it.
    fn unseen(&self) -> String {
        let unseen = (self.logged.iter().enumerate()).filter(|(_, duty)| duty.is_none());
        let mut names: Vec<String> = unseen.map(|(action, _)| action.to_string()).collect();
        let more = names.len().saturating_sub(MOST_NAMED);
        names.truncate(MOST_NAMED);
        let more = match more {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        match names.as_slice() {
            [] => String::new(),
            [one] => format!("; action {one} does not occur: its duty was not compared"),
            names => format!(
                "; actions {}{more} do not occur: their duties were not compared",
                names.join(", ")
            ),
        }
    }

    /// What is to be said of the duties; nothing of equal ones that were worked out, since a feature says it.
    pub(super) fn text(&self) -> Option<String> {
        let Some(first) = self.first_line else {
            let is_said = self.rows > 0 && !self.derived;
            return is_said.then(|| {
                let unseen = self.unseen();
                let worst = match self.worst > 0.0 {
                    true => format!(", largest difference {}", number(self.worst)),
                    false => ", to the last digit".to_owned(),
                };
                format!(
                    "duty of the action equal in {} of {}{worst}{unseen}",
                    self.equal, self.rows
                )
            });
        };
        let (others, rows) = (self.rows - self.equal, self.rows);
        let seen: Vec<(usize, f64)> = (self.logged.iter().enumerate())
            .filter_map(|(action, duty)| Some((action, (*duty)?)))
            .collect();
        let is_other = |(action, duty): &&(usize, f64)| {
            let own = self.own.get(*action).copied().unwrap_or(f64::NAN);
            (own - duty).abs() > FINE * duty.abs().max(own.abs())
        };
        let worst = seen.iter().find(is_other).map(|(action, duty)| {
            let own = self.own.get(*action).copied().unwrap_or(f64::NAN);
            format!(
                ": action {action} {} {} in the contract and {} in the log",
                if self.adds { "adds" } else { "commands" },
                number(own),
                number(*duty)
            )
        });
        let remedy = match seen.len() == self.own.len() {
            true => {
                let list: Vec<String> = seen.iter().map(|(_, duty)| number(*duty)).collect();
                let key = if self.adds { "offsets" } else { "duties" };
                format!("; {key} = [{}] in [actions] fits the log", list.join(", "))
            }
            false => "; look at their order and their ends in [actions]".to_owned(),
        };
        let doubt = match self.derived {
            true => format!(", if scale and offset of {} are right", self.source),
            false => {
                ". A duty that was logged behind a mapping or a limit is another one: log the one before".to_owned()
            }
        };
        Some(format!(
            "the duties of the actions, by {}, are others in {others} of {rows} rows, first in line {first}{}{remedy}{doubt}",
            self.source,
            worst.unwrap_or_default()
        ))
    }
}
