//! A channel or a record that nothing on the list explains, while causes explain all the rest: an instrument that does what no list
//! has, or a run in which something else went on. Open-loop records do not feed a sensor back, so that a disturbed one spoils its own
//! channel only.
//!
//! ```text
//! in    records whose best causes leave structure
//! look  without which channel or record least is left; the whole search again without it
//! out   causes that leave no structure in the rest, or nothing
//! ```
//!
//! Invariant: a cause found so has passed all that a cause has to pass, and more: it is far above the threshold, and what was set aside
//! does not speak against it.

use crate::attribute::SURE;
use crate::causes::{Cause, Kind};
use crate::doubts::Doubt;
use crate::drive::Model;
use crate::examine::{Examined, examined};
use crate::findings::{Aside, Verdict};
use crate::fit::{Fitter, ROUGH, State};
use crate::gain::{self, MUCH_WORSE, Pair};
use crate::held_out::held;
use crate::instants;
use crate::level::threshold;
use crate::noise;
use crate::preflight::Misread;
use crate::problem::{Problem, dot};
use crate::progress::{Listener, Progress};
use crate::record::{CHANNEL_NAMES, CHANNELS, LOAD_CURRENT, Record, V_IN};
use crate::search::WithoutChannel;
use crate::shape::{self, Structure, structures};
use crate::worth;

/// Looks without a part: each is a whole search. The causes bend to what no cause explains, so that the part that is left worst is not
/// always the one that is disturbed, but one of two.
const LOOKS: usize = 2;
/// Without a part that is set aside at least this share of what is left is gone: less would not be "all but one". A convention.
const MAIN_PART: f64 = 0.25;
/// Fewest rows of a record: settled points and short tables have more causes than places for structure.
// five blocks of ten, from which on `shape` sees slow structure
const FEWEST_ROWS: usize = 50;
/// Fewest records that are left, so that not a single run decides.
const FEWEST_RECORDS: usize = 2;
/// A cause that holds leaves at most this share of a held-out record's error above the noise: nine tenths are `mostly_explained`.
const MOSTLY: f64 = 0.1;
/// The causes may make what was set aside this much worse, in squares, since what disturbs it may run against them: an effect and a
/// disturbance of one size that follow each other to .6 do so by 1.25. A convention above it.
const WORSE: f64 = 1.5;

/// The channel that shows the curve of an inductor by itself.
const INDUCTOR_CURRENT: usize = 1;

/// A part of the records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A channel of all records.
    Channel(usize),
    /// A record.
    Record(usize),
}

impl Part {
    /// Its name.
    fn name(self, problem: &Problem) -> &str {
        match self {
            Part::Channel(n) => CHANNEL_NAMES[n],
            Part::Record(index) => &problem.records[index].name,
        }
    }

    /// What it is called in a sentence.
    #[must_use]
    pub fn said(self, problem: &Problem) -> String {
        match self {
            Part::Channel(_) => self.name(problem).to_owned(),
            Part::Record(_) => format!("the record {}", self.name(problem)),
        }
    }

    fn holds(self, record: usize, channel: usize) -> bool {
        match self {
            Part::Channel(n) => n == channel,
            Part::Record(index) => index == record,
        }
    }

    /// Whether a place of a residual is in it.
    fn has(self, problem: &Problem, place: usize) -> bool {
        match self {
            Part::Channel(n) => place < problem.rows() && place % CHANNELS == n,
            Part::Record(index) => {
                let from = problem.offsets[index];
                (from..from + problem.records[index].rows() * CHANNELS).contains(&place)
            }
        }
    }

    /// Causes that may be named beside it: with a channel goes a half of what is known of the circuit, and two causes fit the other half
    /// of what no cause of the list does.
    // eddy currents in a core were a winding and a saturation of it beside a voltage set aside
    fn most_causes(self) -> usize {
        match self {
            Part::Channel(_) => 1,
            Part::Record(_) => usize::MAX,
        }
    }

    /// The records without it.
    fn taken_from(self, records: &[Record]) -> Vec<Record> {
        let mut rest = records.to_vec();
        match self {
            Part::Channel(n) => rest.iter_mut().for_each(|record| record.measured[n].fill(f64::NAN)),
            Part::Record(index) => {
                rest.remove(index);
            }
        }
        rest
    }
}

/// An explanation of all but a part.
#[derive(Debug)]
pub struct Rest {
    /// The part.
    pub part: Part,
    /// What the rest says.
    pub found: Examined,
    /// The held-out records, for the rest.
    pub pair: Option<Pair>,
}

/// The explanation of all but one part of `records`, in which `whole` was found, if there is one; without causes where the model as
/// given explains the rest.
#[must_use]
pub fn explained_without(
    records: &[Record],
    whole: &Examined,
    heldout: &[Record],
    base: &Model,
    say: Listener<'_>,
) -> Option<Rest> {
    let is_short = |record: &Record| record.settled || record.rows() < FEWEST_ROWS;
    if whole.verdict != Verdict::Unexplained || whole.is_misread() || records.iter().any(is_short) {
        return None;
    }
    if !whole.problem.work.may_begin_again() {
        return None;
    }
    let attribution = &whole.attribution;
    let looks = match whole.structure.is_empty() {
        false => parts(whole, attribution.state(), &whole.structure),
        // what was fitted took in the disturbance, so that only the model as given shows where it is
        true if whole.doubts.iter().any(is_of_the_fit) => parts(whole, &attribution.null, &whole.left()),
        true => spoilt_later(whole).into_iter().collect(),
    };
    let work = &whole.problem.work.of_part();
    // what the records look like has been said of all of them
    let say: Listener<'_> = &|what| {
        if !matches!(what, Progress::Noticed(_)) {
            say(what);
        }
    };
    looks.into_iter().take(LOOKS).enumerate().find_map(|(place, part)| {
        // two searches in vain that took half of the budget: a third would take the rest
        if !work.goes_on() || place > 0 && !work.half_is_left() {
            return None;
        }
        let problem = &whole.problem;
        let is_aside = |place: usize| part.has(problem, place);
        if attribution.is_out_of_reach(problem, &is_aside) {
            return None;
        }
        let mut found = examined(part.taken_from(records), base, work, say);
        if !found.named.is_empty() {
            let weak = found.keep_sure(|evidence| evidence.delta_chi2 >= SURE * evidence.threshold);
            found.odd.extend(weak.into_iter().map(|id| {
                let name = part.name(&whole.problem);
                format!("{id} would fit a little better: not named where {name} had to be set aside")
            }));
        }
        let pair = found.judged(heldout, base);
        let holds = match found.verdict {
            Verdict::Consistent => true,
            Verdict::Explained | Verdict::Ambiguous => {
                found.named.len() <= part.most_causes()
                    && is_borne(&found, part, &whole.problem, records, base)
                    && pair.as_ref().is_none_or(|pair| helps(pair, &found))
                    && tells_alone(part, &found, whole, heldout, base)
            }
            Verdict::MostlyExplained | Verdict::Unexplained => false,
        };
        holds.then_some(Rest { part, found, pair })
    })
}

/// Whether a doubt is that causes leave nothing by bending: to more of them than the records tell apart, or to values that no converter has.
fn is_of_the_fit(doubt: &Doubt) -> bool {
    matches!(doubt, Doubt::Loose(_) | Doubt::Bound(_))
}

/// The one channel in which causes that leave no structure do not hold in held-out records: what disturbs it did not show before.
fn spoilt_later(whole: &Examined) -> Option<Part> {
    let of = |doubt: &Doubt| match doubt {
        Doubt::HeldOut(channels, _) => channels.clone(),
        _ => Vec::new(),
    };
    let mut channels = whole.doubts.iter().flat_map(of);
    let first = channels.next()?;
    (channels.all(|other| other == first) && may_miss(&whole.problem, first)).then_some(Part::Channel(first))
}

/// Parts that may be set aside, the one without which least is left first: by a single cause that is fitted to the rest alone, since what
/// disturbs a channel bends the causes that are fitted to all, and the others show it. What is left is that of `state`, and `structure` in it.
fn parts(whole: &Examined, state: &State, structure: &[Structure]) -> Vec<Part> {
    let problem = &whole.problem;
    let channels = (0..CHANNELS).filter(|n| may_miss(problem, *n)).map(Part::Channel);
    let runs = (0..problem.records.len())
        .filter(|_| problem.records.len() > FEWEST_RECORDS)
        .map(Part::Record);
    // a channel may be what the causes bent to, and leave something in the others
    let has_structure = |part: &Part| match part {
        Part::Channel(_) => true,
        Part::Record(index) => structure.iter().any(|one| one.record == problem.records[*index].name),
    };
    let total = above(problem, state, |_, _| true);
    let left = |part: Part| {
        let as_fitted = above(problem, state, |record, channel| !part.holds(record, channel));
        match part {
            Part::Channel(n) => as_fitted.min(left_by_one_cause(whole, n)),
            Part::Record(_) => as_fitted,
        }
    };
    let parts: Vec<Part> = channels.chain(runs).filter(has_structure).collect();
    let mut list: Vec<(Part, f64)> = parts.into_iter().map(|part| (part, left(part))).collect();
    list.retain(|(_, left)| *left <= (1.0 - MAIN_PART) * total);
    list.sort_by(|a, b| a.1.total_cmp(&b.1));
    list.into_iter().map(|(part, _)| part).collect()
}

/// Chi-square above the number of values, of each channel of each record that `counts`.
fn above(problem: &Problem, state: &State, counts: impl Fn(usize, usize) -> bool) -> f64 {
    let cells = (0..problem.records.len()).flat_map(|record| (0..CHANNELS).map(move |channel| (record, channel)));
    let of = |(record, channel): (usize, usize)| {
        let values = noise::channel(problem, &state.residual, record, channel);
        let count = values.iter().filter(|v| **v != 0.0).count();
        (dot(&values, &values) - count as f64).max(0.0)
    };
    cells
        .filter(|(record, channel)| counts(*record, *channel))
        .map(of)
        .sum()
}

/// What the best of the causes that lead leaves above the noise where channel `n` is not compared.
fn left_by_one_cause(whole: &Examined, n: usize) -> f64 {
    let attribution = &whole.attribution;
    // what disturbs a channel bends the instants of load steps as well: they are sought anew without it
    let listed = instants::as_listed(&whole.problem);
    let model = &attribution.null.model;
    let null = State::settle(&listed, model, &listed.first_starts(model), None);
    let fitter = Fitter {
        effort: ROUGH,
        null: &null,
        ..attribution.fitter(&listed)
    };
    let WithoutChannel {
        problem, null, fits, ..
    } = WithoutChannel::of(&fitter, &attribution.singles, attribution.best.as_ref(), (n, false));
    let left = |problem: &Problem, state: &State| above(problem, state, |_, _| true);
    let states = fits.iter().map(|fit| &fit.state).chain([&null]);
    let best = states.min_by(|a, b| left(&problem, a).total_cmp(&left(&problem, b)));
    let best = best.unwrap_or(&null);
    // only a rank: what it takes to believe in the instants is asked when they are needed
    let inside = instants::freed(&problem, best, 1.0).map(|(freed, inside)| left(&freed, &inside));
    inside.unwrap_or(f64::INFINITY).min(left(&problem, best))
}

/// Whether the converter still shows without a channel, and it is no input of the model.
pub(crate) fn may_miss(problem: &Problem, channel: usize) -> bool {
    let is_measured = |n: usize| problem.sigma[n].is_finite();
    let is_load = channel == LOAD_CURRENT && problem.records.iter().any(|record| record.metered.is_some());
    // the voltage or the inductor current: the others follow from them, or stand still
    let moves = (0..2).any(|n| n != channel && is_measured(n));
    is_measured(channel) && !is_load && moves
}

/// Whether the causes do not make records worse that no fit has seen, by more than chance: what they explain would be something else. An
/// effect that does not show there leaves them as they are.
fn helps(pair: &Pair, found: &Examined) -> bool {
    let (before, after) = (pair.before.chi2, dot(&pair.after.residual, &pair.after.residual));
    let parameters = found.attribution.best.as_ref().map_or(0, |best| best.values.len());
    after < before + threshold(parameters, found.attribution.inflation)
}

/// Whether one channel is enough to tell of the causes, where no other is left beside the one that was set aside: only with a held-out record, and of
/// records that are read as they were made (a duty that waits is a shift of rows as well). Not of an instrument, which would be the one that is left. In
/// the held-out record the other channel may be off by more, since what disturbs it may run against the causes, but a cause that takes it much further off is
/// one of a bent fit, unless it holds there and the channel that is left has nothing of what is left in the other. That has to be so of an inductor's curve where its current is
/// set aside: where it is another than the law's it bends to the voltage, and the current shows it.
fn tells_alone(part: Part, found: &Examined, whole: &Examined, heldout: &[Record], base: &Model) -> bool {
    let Part::Channel(n) = part else { return true };
    // the source's voltage is no reading of what the other channels show: they are as many as where it was never measured
    if n == V_IN {
        return true;
    }
    let tells = |other: &usize| ![n, V_IN].contains(other) && whole.problem.sigma[*other].is_finite();
    let others = (0..CHANNELS).filter(tells);
    if others.count() > 1 {
        return true;
    }
    let attribution = &found.attribution;
    let causes = attribution.best.iter().flat_map(|best| &best.causes);
    let causes: Vec<&'static Cause> = causes.map(|cause| attribution.candidates[*cause].cause).collect();
    // what the instrument that is set aside may do by itself is no other reading of what is left
    let is_misread = |cause: &Cause| {
        // nor is another source where that is the cause
        let is_no_other = |one: &Misread| one.may_be_an_instrument(n) || one.is_said_by(cause.id);
        let is_known = |words: &String| (whole.misread.iter()).any(|one| one.words == *words && is_no_other(one));
        (whole.doubts.iter()).any(|doubt| matches!(doubt, Doubt::Bench(words) if !is_known(words)))
    };
    let is_odd = |cause: &&Cause| {
        let is_late = cause.id == "duty_delay";
        !is_late && is_misread(cause) || cause.kind == Kind::Instrument
    };
    if causes.iter().any(is_odd) {
        return false;
    }
    let state = attribution.state();
    let trim = state.starts.trim_or_none(base.plant.converter.f_sw);
    let pair = held(&whole.problem, heldout, base, state, trim);
    pair.is_some_and(|pair| {
        let problem = &pair.problem;
        let of = |state: &State| -> f64 {
            let records = 0..problem.records.len();
            let values = records.flat_map(|record| noise::channel(problem, &state.residual, record, n));
            values.map(|left| left * left).sum()
        };
        // what the other channel would have to show, and has not: an instrument does that, however much the cause had hidden of it
        let is_missing = || {
            let mut records = 0..problem.records.len();
            records.all(|record| shape::is_missing_elsewhere(problem, &pair.after, (record, n)))
        };
        // ... where the cause holds: a voltage that stands still lacks everything
        let left = |state: &State| above(problem, state, |_, channel| channel != n);
        let holds = left(&pair.after) <= MOSTLY * left(&pair.before);
        let is_of_current = causes.iter().any(|cause| cause.id == "l_saturation") && n == INDUCTOR_CURRENT;
        !is_of_current && of(&pair.after) <= MUCH_WORSE * of(&pair.before) || holds && is_missing()
    })
}

/// Whether what was set aside bears the causes, and shows nothing that the converter does and its instruments do not.
fn is_borne(found: &Examined, part: Part, whole: &Problem, records: &[Record], base: &Model) -> bool {
    let [before, after] = squares(found, part, whole, records, base);
    let Part::Channel(n) = part else {
        return after <= WORSE * before;
    };
    let (problem, null, state) = with_channel(found, whole, n);
    let left = structures(&problem, &null, &state, found.attribution.inflation);
    let is_left = |index: &usize| {
        let (channel, record) = (CHANNEL_NAMES[n], &problem.records[*index].name);
        left.iter().any(|one| (one.channel, &one.record) == (channel, record))
    };
    let is_instrument = |index: &usize| shape::is_missing_elsewhere(&problem, &state, (*index, n));
    let all: Vec<usize> = (0..problem.records.len()).filter(is_left).collect();
    // no instrument swings as the filter does, and the other channels are of the same converter; one that sticks lacks the swing that a cause makes
    let is_kicked = |index: &usize| shape::is_kicked(&problem, &state, (*index, n)) && !is_instrument(index);
    let is_of_instrument = !all.is_empty() && all.iter().all(is_instrument);
    (after <= WORSE * before || is_of_instrument) && !all.iter().any(is_kicked)
}

/// Sums of squares of what was set aside, without and with the causes.
fn squares(found: &Examined, part: Part, whole: &Problem, records: &[Record], base: &Model) -> [f64; 2] {
    let of = |problem: &Problem, state: &State| {
        let cells = (0..problem.records.len()).flat_map(|record| (0..CHANNELS).map(move |n| (record, n)));
        let own = cells.filter(|(record, n)| match part {
            Part::Channel(channel) => channel == *n,
            Part::Record(_) => *record == 0,
        });
        own.map(|(record, n)| noise::channel(problem, &state.residual, record, n))
            .map(|values| dot(&values, &values))
            .sum::<f64>()
    };
    match part {
        Part::Channel(n) => {
            let (problem, null, state) = with_channel(found, whole, n);
            [of(&problem, &null), of(&problem, &state)]
        }
        Part::Record(index) => {
            let pair = alone(found, &records[index], base);
            [of(&pair.problem, &pair.before), of(&pair.problem, &pair.after)]
        }
    }
}

/// The record that was set aside, as if it were held out.
fn alone(found: &Examined, record: &Record, base: &Model) -> Pair {
    let state = found.attribution.state();
    let trim = state.starts.trim_or_none(base.plant.converter.f_sw);
    gain::hold(
        std::slice::from_ref(record),
        base,
        &state.model,
        found.problem.sigma,
        trim,
    )
}

/// What was found with the channel back in its place: the same models and initial states, which no value of it has moved.
fn with_channel(found: &Examined, whole: &Problem, n: usize) -> (Problem, State, State) {
    let mut problem = found.problem.clone();
    for (record, own) in problem.records.iter_mut().zip(&whole.records) {
        record.measured[n].clone_from(&own.measured[n]);
    }
    for (masked, own) in problem.masked.iter_mut().zip(&whole.masked) {
        masked[n].clone_from(&own[n]);
    }
    problem.sigma[n] = whole.sigma[n];
    let again = |state: &State| State::at(&problem, &state.model, state.starts.clone());
    let (null, state) = (again(&found.attribution.null), again(found.attribution.state()));
    (problem, null, state)
}

/// Puts what was set aside beside what was `found` without it, to be seen, and says what is left there.
pub fn shown(found: &mut Examined, part: Part, whole: &Problem, records: &[Record], base: &Model) -> Aside {
    let inflation = found.attribution.inflation;
    match part {
        Part::Channel(n) => {
            let (problem, null, state) = with_channel(found, whole, n);
            found.structure = structures(&problem, &null, &state, inflation);
            let errors = worth::of_training(&problem, &null, &state);
            (found.problem, found.attribution.null) = (problem, null);
            if let Some(best) = &mut found.attribution.best {
                best.state = state;
            }
            Aside {
                channel: Some(CHANNEL_NAMES[n]),
                record: None,
                errors: errors
                    .into_iter()
                    .filter(|one| one.channel == CHANNEL_NAMES[n])
                    .collect(),
            }
        }
        Part::Record(index) => {
            let pair = alone(found, &records[index], base);
            found.structure = structures(&pair.problem, &pair.before, &pair.after, inflation);
            Aside {
                channel: None,
                record: Some(records[index].name.clone()),
                errors: worth::of_held(&pair),
            }
        }
    }
}
