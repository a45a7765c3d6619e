//! The log of a trainer's environment: a table with a row for each control period.

use std::path::Path;

use interp::Sample;
use measured::{ColumnMap, Located, Options, Quantity, Sheet, table_faults};
use policy::{DutyPath, Policy};
use toml_input::{Fault, Faults, Message};

use super::chosen::chosen;
use super::values::ends;
use crate::traces::SignalColumns;

/// Rows may be apart by this much more or less than the sample period.
// a logger's clock and a time with four digits stay within; half or twice a period does not
const PERIOD_TOLERANCE: f64 = 0.01;

/// Samples of an environment, in a row, and what the trainer made of them.
#[derive(Debug, Clone)]
pub struct Log {
    sheet: Sheet,
    /// One sample per signal and row.
    pub(super) samples: Vec<Vec<Sample>>,
    /// Whether an episode begins in the row.
    pub(super) begins: Vec<bool>,
    /// Per feature what the trainer's network saw, if the log has it.
    pub(super) observed: Vec<Option<Vec<f64>>>,
    /// What the trainer did, output by output.
    pub(super) done: Vec<Done>,
    /// Rows of which a column says nothing, because it was moved against the others; empty if there are none.
    pub(super) unsaid: Vec<bool>,
    pub(super) notes: Vec<String>,
}

/// What the trainer did with one output.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Done {
    /// Whether the contract commands a number there.
    continuous: bool,
    /// The trainer's choice in each row.
    pub actions: Option<Vec<u32>>,
    /// The choices were read off `duty`.
    pub read_off: bool,
    /// What was commanded in each row, before the mapping, if the log says so.
    pub duty: Option<Vec<f64>>,
    /// The duty before each row.
    pub previous_duty: Option<Vec<f64>>,
}

impl Done {
    /// What a continuous actor commanded in each row, as a duty before the mapping.
    pub fn commanded(&self) -> Option<&Vec<f64>> {
        self.duty.as_ref().filter(|_| self.continuous)
    }
}

impl Log {
    /// Reads a log of `policy`.
    ///
    /// Columns: every signal by its name, in its unit (as for [`Recorded`](crate::traces::Recorded)). If there: observations as
    /// `obs_0`, `obs_1`, ... in the network's order, or `obs_NAME`, or the feature's name; `action`, from 0; `duty`, what the
    /// action commanded, which of a continuous head is compared in the place of an action; `previous_duty`, where the environment has its own; `episode`, which begins anew where it changes; `t` in
    /// seconds. Of several outputs each has `action_NAME`, `duty_NAME` and `previous_duty_NAME`. `map` says where a column has another name: `v_out=CH1,obs_0=x0`.
    ///
    /// # Errors
    /// A map or a file that cannot be read, a signal without column, cells that are no numbers, rows that are not a control period apart.
    pub fn open(policy: &Policy, file: &Path, map: &str) -> Result<Self, Faults> {
        Self::read(policy, Sheet::open(file, &Options::default())?, map)
    }

    /// [`Log::open`] of a table.
    ///
    /// # Errors
    /// As [`Log::open`].
    pub fn read(policy: &Policy, sheet: Sheet, map: &str) -> Result<Self, Faults> {
        let signals = SignalColumns::new(policy);
        let names = done_names(policy);
        let done = done_quantities(&names);
        let observations = observation_names(policy, &done);
        let mut wanted = signals.quantities();
        wanted.extend(
            done.iter()
                .filter(|done| policy.signals.iter().all(|signal| signal.name != done.name)),
        );
        wanted.extend(observations.iter().map(|names| Quantity {
            name: names.first().map_or("", String::as_str),
            aliases: &[],
            unit: "",
        }));
        let aliases: Vec<Vec<&str>> = observations
            .iter()
            .map(|names| names.iter().skip(1).map(String::as_str).collect())
            .collect();
        let first = wanted.len() - observations.len();
        for (quantity, aliases) in wanted.iter_mut().skip(first).zip(&aliases) {
            quantity.aliases = aliases;
        }
        let located = sheet.locate(&wanted, &ColumnMap::parse_among(map, &wanted)?)?;
        let samples = signals.samples(&sheet, &located)?;
        let mut faults = table_faults();
        let mut numbers = |name: &str| located.signal(name).map(|column| column.values(&sheet, &mut faults));
        let episode = numbers("episode");
        let time = numbers("t");
        let columns: Vec<[Option<Vec<f64>>; 3]> = names
            .iter()
            .map(|names| [0, 1, 2].map(|which| numbers(&names[which])))
            .collect();
        let observed: Vec<Option<Vec<f64>>> = observations.iter().map(|names| numbers(names.first()?)).collect();
        faults.propagate()?;
        let begins = begins(sheet.rows(), episode.as_deref());
        if let Some(time) = time {
            check_period(policy, &sheet, &time, &begins)?;
        }
        let done = policy.paths().into_iter().zip(&names).zip(columns);
        let done = done.map(|((path, names), columns)| of_output(&path, names, columns, &sheet, &located));
        let mut done = done.collect::<Result<Vec<Done>, _>>()?;
        let mut notes = located.notes(&sheet, &[]);
        for ((path, names), done) in policy.paths().iter().zip(&names).zip(&mut done) {
            if let (None, Some(duties)) = (&done.actions, &done.duty) {
                let (actions, note) = chosen(path, duties, &names[1]);
                (done.read_off, done.actions) = (actions.is_some(), actions);
                notes.extend(note);
            }
        }
        notes.extend(unread_duty(&sheet, &located, &names));
        notes.extend(unread_action(policy, &sheet, &located));
        if observed.iter().all(Option::is_none) {
            notes.extend(unread_observations(policy, &sheet, &located));
        }
        notes.extend(twice(policy, &sheet, &located, &observations));
        Ok(Self {
            samples,
            begins,
            observed,
            done,
            unsaid: Vec::new(),
            notes,
            sheet,
        })
    }

    /// Control periods in the log.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.samples.len()
    }

    /// Whether it holds an observation, an action or the duty of a continuous actor to compare with.
    #[must_use]
    pub fn compares(&self) -> bool {
        let done = |done: &Done| done.actions.is_some() || done.commanded().is_some();
        self.done.iter().any(done) || self.observed.iter().any(Option::is_some)
    }

    /// Its columns, for a fault.
    #[must_use]
    pub fn columns(&self) -> String {
        self.sheet.listed()
    }

    /// The policy with signals whose ranges hold every logged sample.
    pub(super) fn widened(&self, policy: &Policy) -> Policy {
        let mut wide = policy.clone();
        for (index, signal) in wide.signals.iter_mut().enumerate() {
            for value in self.physical(policy, index).filter(|value| value.is_finite()) {
                signal.range.low = signal.range.low.min(value);
                signal.range.high = signal.range.high.max(value);
            }
        }
        wide
    }

    /// Signals that leave their range: name, in how many rows, and between which values the log lies.
    pub(super) fn outside(&self, policy: &Policy) -> Vec<(String, usize, [f64; 2])> {
        let signals = policy.signals.iter().enumerate();
        let left = signals.map(|(index, signal)| {
            let values: Vec<f64> = self.physical(policy, index).collect();
            let is_outside = |value: &&f64| !(signal.range.low..=signal.range.high).contains(*value);
            (
                signal.name.clone(),
                values.iter().filter(is_outside).count(),
                ends(&values),
            )
        });
        left.filter(|(_, rows, _)| *rows > 0).collect()
    }

    /// The logged values of a signal, in its unit.
    pub(super) fn physical(&self, policy: &Policy, index: usize) -> impl Iterator<Item = f64> {
        let adc = policy.signals.get(index).and_then(|signal| signal.adc);
        let value = move |samples: &Vec<Sample>| match (samples.get(index), adc) {
            (Some(Sample::Physical(value)), _) => f64::from(*value),
            (Some(Sample::Wide(value)), _) => *value,
            (Some(Sample::Code(code)), Some(adc)) => adc.gain * f64::from(*code) + adc.offset,
            _ => f64::NAN,
        };
        self.samples.iter().map(value)
    }

    /// Whether a row has at least `skip` rows of its episode before it.
    pub(super) fn is_late(&self, skip: usize) -> Vec<bool> {
        let mut age = 0;
        let next = |begins: &bool| {
            age = if *begins { 0 } else { age + 1 };
            age >= skip
        };
        let late: Vec<bool> = self.begins.iter().map(next).collect();
        let said = |row: usize| !self.unsaid.get(row).copied().unwrap_or(false);
        late.iter().enumerate().map(|(row, late)| *late && said(row)).collect()
    }

    pub(super) fn line(&self, row: usize) -> usize {
        self.sheet.line(row)
    }

    pub(super) fn fault(&self, row: usize, message: Message) -> Fault {
        self.sheet.row_fault(row, message)
    }
}

/// What a table calls action, duty and duty before of each output.
pub(super) fn done_names(policy: &Policy) -> Vec<[String; 3]> {
    let named = |path: &DutyPath<'_>| ["action", "duty", "previous_duty"].map(|stem| path.named(stem));
    policy.paths().iter().map(named).collect()
}

/// A duty that nobody reads, and what a map would make of it: an index alone says nothing of the duties that the actions mean.
fn unread_duty(sheet: &Sheet, located: &Located, names: &[[String; 3]]) -> Option<String> {
    let [action, duty, previous] = names.first()?;
    let is_read = |name: &String| located.signal(name).is_some();
    let one_output = names.len() == 1 && is_read(action) && !is_read(duty) && !is_read(previous);
    let columns = located.unused.iter().filter_map(|index| sheet.columns().get(*index));
    let alike = columns.map(|column| column.name.as_str()).find(|name| {
        let name = name.to_ascii_lowercase();
        one_output && (name.contains("duty") || name.contains("pwm"))
    });
    alike.map(|name| {
        format!(
            "`{name}` looks like a duty: with --map {previous}={name} where it is the duty before the sample, or --map {duty}={name} where it \
             follows from it, the duties that the actions mean are compared, too"
        )
    })
}

/// A column that may be the choice, where nothing says what was chosen.
fn unread_action(policy: &Policy, sheet: &Sheet, located: &Located) -> Option<String> {
    let paths = policy.paths();
    let [path] = paths.as_slice() else { return None };
    let is_said = ["action", "duty"].iter().any(|name| located.signal(name).is_some());
    if is_said || !path.head.is_choice() {
        return None;
    }
    let columns = located.unused.iter().filter_map(|index| sheet.columns().get(*index));
    let mut names = columns.map(|column| column.name.as_str());
    let name = names.find(|name| {
        let name = name.to_ascii_lowercase();
        name == "a" || name.starts_with("act") || name.ends_with("_action")
    })?;
    Some(format!(
        "`{name}` may be the choice of the network: with --map action={name} it is compared, too"
    ))
}

/// Columns that count as many features as the network has, under another stem than `obs_`, where no observation was read.
fn unread_observations(policy: &Policy, sheet: &Sheet, located: &Located) -> Option<String> {
    let unread = located.unused.iter().filter_map(|index| sheet.columns().get(*index));
    let unread: Vec<&str> = unread.map(|column| column.name.as_str()).collect();
    let features = policy.features.len();
    let stem = unread.iter().find_map(|name| {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let counted = |first: usize| (first..first + features).all(|n| unread.contains(&format!("{stem}{n}").as_str()));
        let first = [0, 1]
            .into_iter()
            .find(|first| stem.len() < name.len() && counted(*first))?;
        Some((stem, first))
    });
    stem.map(|(stem, first)| {
        let pairs: Vec<String> = (0..features).map(|n| format!("obs_{n}={stem}{}", first + n)).collect();
        format!(
            "`{stem}{first}` and on count as many as the network's inputs; if they are its observations: --map {}",
            pairs.join(",")
        )
    })
}

/// Observations that a map reads from the column of a signal: that is what the network saw only if nothing was done to the signal.
fn twice(policy: &Policy, sheet: &Sheet, located: &Located, observations: &[Vec<String>]) -> Vec<String> {
    let column = |name: &String| located.signal(name).and_then(|signal| signal.column());
    let note = |name: &String| {
        let signal = policy
            .signals
            .iter()
            .find(|signal| column(&signal.name) == column(name))?;
        let read = &sheet.columns().get(column(name)?)?.name;
        Some(format!(
            "`{name}` and the signal `{}` are both read from `{read}`: so the network is taken to have seen the signal as it is",
            signal.name
        ))
    };
    observations.iter().filter_map(|names| note(names.first()?)).collect()
}

/// Columns that say what the trainer did, beside samples and observations.
fn done_quantities(names: &[[String; 3]]) -> Vec<Quantity<'_>> {
    let quantity = |name, aliases, unit| Quantity { name, aliases, unit };
    let mut done = vec![
        quantity("t", &["time"], "s"),
        quantity("episode", &["episodes", "ep"], ""),
    ];
    for [action, duty, previous_duty] in names {
        let aliases: &[&str] = match action.as_str() {
            "action" => &["actions", "action_index"],
            _ => &[],
        };
        done.push(quantity(action, aliases, ""));
        done.push(quantity(duty, &[], "1"));
        done.push(quantity(previous_duty, &[], "1"));
    }
    done
}

/// What a table may call each feature: `obs_e`, `obs_0`, ..., and `e` where that is no other column's name.
fn observation_names(policy: &Policy, done: &[Quantity<'_>]) -> Vec<Vec<String>> {
    let taken = |name: &str| {
        let signals = policy.signals.iter().map(|signal| signal.name.as_str());
        let known = Quantity::find(name).is_some() || done.iter().any(|done| done.name == name);
        known || signals.into_iter().any(|signal| signal == name)
    };
    let names = |(index, feature): (usize, &policy::Feature)| {
        let name = &feature.name;
        let mut names = vec![format!("obs_{name}"), format!("obs_{index}"), format!("obs{index}")];
        names.extend([format!("obs[{index}]"), format!("observation_{index}")]);
        if !taken(name) {
            names.push(name.clone());
        }
        names
    };
    policy.features.iter().enumerate().map(names).collect()
}

/// Where episodes begin: in the first row, and wherever the number of the episode is another.
fn begins(rows: usize, episode: Option<&[f64]>) -> Vec<bool> {
    let mut begins = vec![false; rows];
    if let Some(first) = begins.first_mut() {
        *first = true;
    }
    if let Some(episode) = episode {
        for (begins, pair) in begins.iter_mut().skip(1).zip(episode.windows(2)) {
            *begins = pair.first() != pair.last();
        }
    }
    begins
}

/// A delay of a sample is a period only if the rows are.
fn check_period(policy: &Policy, sheet: &Sheet, time: &[f64], begins: &[bool]) -> Result<(), Faults> {
    let period = policy.sample_period;
    for (row, pair) in time.windows(2).enumerate() {
        let step = pair.last().unwrap_or(&0.0) - pair.first().unwrap_or(&0.0);
        let begins_next = begins.get(row + 1).copied().unwrap_or(false);
        if !begins_next && (step / period - 1.0).abs() > PERIOD_TOLERANCE {
            let message = Message::new("rows that are not a control period apart")
                .found(format!("{step:.6e} s"))
                .expected(format!("{period:e} s, sample_period of the contract"))
                .hint("a row for each control period; a column `episode` says where another episode begins");
            return Err(sheet.row_fault(row + 1, message).into());
        }
    }
    Ok(())
}

fn no_index() -> Message {
    Message::new("the policy commands a number, and an action of the log is an index")
        .found("a column `action` and none called `duty`")
        .expected("`duty`: what the actor commanded, as a duty before the mapping")
        .hint("an action in units of the trainer's action space becomes a duty by scale and offset of [actions]")
}

/// What the columns of one output say: action, duty, duty before.
fn of_output(
    path: &DutyPath<'_>,
    [name, ..]: &[String; 3],
    [action, duty, previous_duty]: [Option<Vec<f64>>; 3],
    sheet: &Sheet,
    located: &Located,
) -> Result<Done, Faults> {
    let continuous = !path.head.is_choice();
    if let (true, Some(_), None, Some(column)) = (continuous, &action, &duty, located.signal(name)) {
        return Err(column.fault(sheet, 0, no_index()).into());
    }
    let actions = action.filter(|_| !continuous);
    let indices = actions.map(|action| indices(path.head.actions().len(), name, sheet, located, &action));
    Ok(Done {
        continuous,
        actions: indices.transpose()?,
        read_off: false,
        duty,
        previous_duty,
    })
}

fn indices(most: usize, name: &str, sheet: &Sheet, located: &Located, values: &[f64]) -> Result<Vec<u32>, Faults> {
    let mut faults = table_faults();
    let index = |(row, value): (usize, &f64)| {
        if value.fract() == 0.0 && *value >= 0.0 && *value < most as f64 {
            return *value as u32;
        }
        if let Some(column) = located.signal(name) {
            let message = Message::new("an action that the contract does not have").found(value.to_string());
            let last = most.saturating_sub(1);
            faults.push(column.fault(sheet, row, message.expected(format!("an index from 0 to {last}"))));
        }
        0
    };
    let indices = values.iter().enumerate().map(index).collect();
    faults.propagate()?;
    Ok(indices)
}
