//! From records to a verdict.

use plant::Parameters;

use crate::attribute::{Attribution, attribute};
use crate::beside;
use crate::control::Request;
use crate::doubts::{self, Doubt};
use crate::drive::Model;
use crate::findings::{Evidence, Findings, Gain, Hidden, Named, Noise, Value, Verdict};
use crate::fit::State;
use crate::gain::{self, Pair, Shift};
use crate::instants;
use crate::noise::{self, Outlier};
use crate::preflight;
use crate::problem::Problem;
use crate::profile::{Profile, parabolas, profiles};
use crate::progress::{Listener, Progress};
use crate::quantised;
use crate::record::{CHANNEL_NAMES, CHANNELS, Record};
use crate::sampling;
use crate::shape::{Structure, structures};
use crate::words::{nearest, sentence, shifted};
use crate::worth::{self, Worth};

/// Everything a report shows.
#[derive(Debug)]
pub struct Diagnosis {
    /// For `diagnosis.json`.
    pub findings: Findings,
    /// Training records.
    pub problem: Problem,
    /// The training records at the model exactly as given.
    pub given: State,
    /// What was fitted.
    pub attribution: Attribution,
    /// Profiles of the parameters.
    pub profiles: Vec<Profile>,
    /// Held-out records.
    pub held: Option<Pair>,
    /// The extended model; the model as given where no cause explains the records.
    pub extended: Model,
    /// Duty that its edges add, 1.
    pub trim: f64,
    /// The loop closed with a policy, if one was given.
    pub control: Option<crate::control::Control>,
}

/// Diagnoses `model` by the records `train`; `heldout` only judges. `say` hears how far it is.
#[must_use]
pub fn diagnose(model: &Parameters, train: Vec<Record>, heldout: &[Record], say: Listener<'_>) -> Diagnosis {
    let base = Model::new(model);
    say(Progress::Stage("noise and initial states"));
    let (problem, null, outliers) = prepared(train, &base);
    let mut odd = noticed(&problem, &null, &outliers, heldout);
    let (mut problem, mut attribution) = attribute(problem, null, say);
    instants::note(&mut problem, &attribution.state().starts);
    // what is too small for a cause still leaves no structure
    let structure = structures(&problem, &attribution.null, attribution.state(), attribution.inflation);
    let mut profiles = held_by_data(&problem, &mut attribution, &structure, say);
    // behind the profiles: whether a cause is nothing is read off its intervals
    let nothing = attribution.leave_out_nothing(&problem, &mut profiles);
    let named = named(&attribution, &profiles);
    let mut doubts = doubts::of(&problem, &attribution, &profiles, &structure);
    let lattice = quantised::cause(&problem);
    let holds = structure.is_empty() && !doubts::forbids(&named, &doubts);
    let mut verdict = verdict(&named, &lattice, holds);
    say(Progress::Stage("held-out records"));
    let found = attribution.state();
    let edges = |state: &State| state.starts.trim_or_none(model.converter.f_sw);
    let mut pair = held(&problem, heldout, &base, found, edges(found));
    // what is no more than the step of a converter has no values that could fail to hold
    if verdict == Verdict::Explained && !named.is_empty() {
        let fails = pair.as_ref().map_or_else(Vec::new, |pair| pair.doubts(&problem, found));
        verdict = if fails.is_empty() {
            verdict
        } else {
            Verdict::Unexplained
        };
        doubts.extend(fails.into_iter().map(Doubt::HeldOut));
    }
    let explained = verdict != Verdict::Unexplained;
    // of what was found: where the model as given is far off, so are the instants of load steps that fit it best
    let held_by = explained.then_some(&profiles[..]);
    let notes = notes(&problem, &attribution, pair.as_ref(), &nothing, held_by);
    let partial_gain = match explained || named.is_empty() {
        true => Vec::new(),
        false => partial_gain(&problem, &attribution, pair.as_ref()),
    };
    // what does not explain the records is no better model
    let state = if explained {
        attribution.state()
    } else {
        &attribution.null
    };
    let trim = if explained { edges(state) } else { 0.0 };
    let extended = state.model.clone();
    // the figures are those of the file that is written
    if !explained {
        pair = held(&problem, heldout, &base, state, trim);
    }
    let next_experiments = explained.then(|| crate::next::experiments(&problem, &attribution, say));
    let mut causes = if explained { named.clone() } else { Vec::new() };
    // a step of a converter is named beside other causes; where structure is left nothing is named, not even this
    causes.extend(lattice.filter(|_| explained));
    // a model that does not explain the training records says nothing about a change between them and the others
    let shifts = (pair.as_ref().filter(|_| explained)).map_or_else(Vec::new, |pair| pair.shifts(&problem, state));
    let mut near = String::new();
    if !explained {
        odd.extend(other_carrier(&problem, &attribution));
        near = nearest(&named, attribution.removed(&problem));
    }
    let findings = Findings {
        sentence: sentence(verdict, &causes, &structure, &doubts::said(&doubts)) + &near + &shifted(&shifts),
        verdict,
        partial: if explained { Vec::new() } else { named },
        causes,
        partial_gain,
        structure,
        doubts: doubts::said(&doubts),
        not_detectable: hidden(&problem, &attribution),
        next_experiments: next_experiments.unwrap_or_default(),
        noise: Noise {
            repairs: [odd, notes].concat(),
            ..noise_of(&problem, &attribution, &outliers, trim)
        },
        gain: gain_of(pair.as_ref(), shifts),
    };
    Diagnosis {
        findings,
        given: as_given(&problem, &base),
        problem,
        attribution,
        profiles,
        held: pair,
        extended,
        trim,
        control: None,
    }
}

impl Diagnosis {
    /// Closes the loop with a policy on the extended model; without load steps asked for, over the records' loads. Where
    /// that cannot be done the reason is noted, and the diagnosis stands.
    pub fn close_the_loop(&mut self, mut request: Request) {
        if request.load_steps.is_empty() {
            request.load_steps = crate::control::load_steps(self.problem.records.iter(), request.v_ref);
        }
        match crate::control::control(&request, &crate::extend::extended_plant(self)) {
            Ok(control) => {
                self.findings.gain.closed_loop = Some(control.findings.clone());
                self.control = Some(control);
            }
            Err(error) => self.findings.gain.closed_loop_missing = Some(error.to_string()),
        }
    }
}

/// The held-out records with the model as given and with `state`, if there are any.
fn held(problem: &Problem, heldout: &[Record], base: &Model, state: &State, trim: f64) -> Option<Pair> {
    (!heldout.is_empty()).then(|| gain::hold(heldout, base, &state.model, problem.sigma, trim))
}

/// What held-out records say; the closed loop comes later, if at all.
fn gain_of(pair: Option<&Pair>, shifts: Vec<Shift>) -> Gain {
    Gain {
        heldout: pair.map_or_else(Vec::new, Pair::errors),
        mean_square: pair.map_or([f64::NAN; 2], |pair| pair.total().into()),
        shifts,
        closed_loop: None,
        closed_loop_missing: None,
    }
}

/// Another carrier that fits better; with the model as given, too, since a cause may have bent to what the carrier does.
fn other_carrier(problem: &Problem, attribution: &Attribution) -> Option<String> {
    let states = [attribution.state(), &attribution.null];
    states
        .into_iter()
        .find_map(|state| worth::other_carrier(problem, state))
}

/// What is seen before any fit.
fn noticed(problem: &Problem, null: &State, outliers: &[Outlier], heldout: &[Record]) -> Vec<String> {
    let mut odd = preflight::readings(problem, null);
    odd.extend(spikes(problem, outliers));
    odd.extend(preflight::sources(&problem.records, heldout, &problem.base));
    odd
}

/// How well the data hold the parameters; other pairs of causes become rivals. What leaves structure explains nothing, and its
/// values are worth neither.
fn held_by_data(
    problem: &Problem,
    attribution: &mut Attribution,
    structure: &[Structure],
    say: Listener<'_>,
) -> Vec<Profile> {
    if !structure.is_empty() {
        return parabolas(problem, attribution);
    }
    let others = crate::ties::other_pairs(problem, attribution, say);
    // they stand in the place of all causes together: said once, at the first
    for rivals in attribution.rivals.iter_mut().take(1) {
        rivals.extend(others.iter().cloned());
    }
    for (member, rival) in crate::ties::in_part(problem, attribution, say) {
        attribution.rivals[member].push(rival);
    }
    profiles(problem, attribution, say)
}

/// What causes that explain only a part would gain, first where no fit has seen it.
fn partial_gain(problem: &Problem, attribution: &Attribution, held: Option<&Pair>) -> Vec<Worth> {
    let mut list = held.map_or_else(Vec::new, worth::of_held);
    list.extend(worth::of_training(problem, &attribution.null, attribution.state()));
    list
}

/// The model without the trim of the edges that stands beside every fit.
fn as_given(problem: &Problem, base: &Model) -> State {
    let mut held = problem.clone();
    held.trim_held = true;
    instants::scanned(&held, base, &held.first_starts())
}

/// Noise estimated, outliers masked, initial states fitted.
fn prepared(train: Vec<Record>, base: &Model) -> (Problem, State, Vec<Outlier>) {
    let mut problem = Problem::new(train, base.clone());
    let mut null = State::settle(&problem, base, &problem.first_starts(), None);
    // noise before the instants of loggers and before outliers, which are judged in its units; and again without the
    // outliers
    problem.sigma = noise::sigma(&problem, &null.residual);
    sampling::decide(&mut problem, base);
    null = State::settle(&problem, base, &null.starts, None);
    let outliers = noise::outliers(&problem, &null.residual);
    for one in &outliers {
        problem.masked[one.record][one.channel][one.row] = true;
    }
    null = State::settle(&problem, base, &null.starts, None);
    problem.sigma = noise::sigma(&problem, &null.residual);
    null = State::settle(&problem, base, &null.starts, None);
    (problem, null, outliers)
}

fn named(attribution: &Attribution, profiles: &[Profile]) -> Vec<Named> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let of = |(member, cause): (usize, &usize)| {
        let candidate = &attribution.candidates[*cause];
        let own = profiles.iter().filter(|profile| profile.member == member);
        let parameters = own.map(|p| {
            let value = Value {
                value: p.value,
                low: p.interval[0],
                high: p.interval[1],
                unit: p.unit,
                model: p.own,
            };
            (p.name, value)
        });
        let rivals = attribution.rivals[member].iter().map(|fit| {
            let mut ids: Vec<&str> = fit.causes.iter().map(|cause| attribution.id(*cause)).collect();
            // two forms of one cause are one cause to a reader
            ids.dedup();
            ids
        });
        Named {
            id: candidate.cause.id,
            words: candidate.form.words,
            parameters: parameters.collect(),
            evidence: Evidence {
                delta_chi2: attribution.evidence[member] / attribution.inflation,
                // without the inflation: the evidence is over it already
                threshold: crate::level::threshold(candidate.own.len(), 1.0),
            },
            rivals: each_once(rivals),
        }
    };
    best.causes.iter().enumerate().map(of).collect()
}

/// The same ids may come from two forms of a cause.
fn each_once(sets: impl Iterator<Item = Vec<&'static str>>) -> Vec<Vec<&'static str>> {
    sets.fold(Vec::new(), |mut list, set| {
        if !list.contains(&set) {
            list.push(set);
        }
        list
    })
}

fn verdict(named: &[Named], lattice: &Option<Named>, holds: bool) -> Verdict {
    // before anything else: where the truth is not on the list, its best cause imitates it with a wrong value
    if !holds {
        return Verdict::Unexplained;
    }
    if named.iter().any(|cause| !cause.rivals.is_empty()) {
        return Verdict::Ambiguous;
    }
    match named.is_empty() && lattice.is_none() {
        true => Verdict::Consistent,
        false => Verdict::Explained,
    }
}

fn hidden(problem: &Problem, attribution: &Attribution) -> Vec<Hidden> {
    let sizes = attribution.smallest_sizes(problem);
    let mut list: Vec<Hidden> = Vec::new();
    for (cause, smallest) in sizes {
        let candidate = &attribution.candidates[cause];
        let knob = &candidate.form.knobs[0];
        let reach = candidate.reach();
        // what would be seen at a usual size is not worth a line
        if smallest > candidate.large().min(reach) {
            list.push(Hidden {
                id: candidate.cause.id,
                parameter: knob.name,
                smallest: (smallest <= reach).then_some(smallest),
                reach,
                unit: knob.unit(),
            });
        }
    }
    list
}

fn noise_of(problem: &Problem, attribution: &Attribution, outliers: &[Outlier], trim: f64) -> Noise {
    let measured = (0..CHANNELS).filter(|n| problem.sigma[*n].is_finite());
    let outlier = |one: &Outlier| {
        let record = &problem.records[one.record].name;
        format!("{record}:{}:{}", one.row, CHANNEL_NAMES[one.channel])
    };
    Noise {
        sigma: measured.map(|n| (CHANNEL_NAMES[n], problem.sigma[n])).collect(),
        inflation: attribution.inflation,
        outliers: outliers.iter().map(outlier).collect(),
        repairs: Vec::new(),
        trim,
    }
}

/// What was repaired in each record; what is the same in several is said once.
fn by_text<'a>(records: impl Iterator<Item = &'a Record>) -> Vec<String> {
    let mut list: Vec<(&str, Vec<&str>)> = Vec::new();
    for (record, text) in records.flat_map(|r| r.repairs.iter().map(move |text| (r, text))) {
        match list.iter_mut().find(|(known, _)| known == text) {
            Some((_, names)) if names.contains(&record.name.as_str()) => {}
            Some((_, names)) => names.push(&record.name),
            None => list.push((text, vec![&record.name])),
        }
    }
    let said = |(text, names): (&str, Vec<&str>)| format!("{}: {text}", names.join(", "));
    list.into_iter().map(said).collect()
}

/// Spikes that are listed by their places; more are counted.
const LISTED: usize = 3;

/// What is said of outliers.
fn spikes(problem: &Problem, outliers: &[Outlier]) -> Option<String> {
    let place = |one: &Outlier| {
        let record = &problem.records[one.record];
        format!(
            "{} of {} at t = {:.6} s",
            CHANNEL_NAMES[one.channel], record.name, record.time[one.row]
        )
    };
    let listed: Vec<String> = outliers.iter().take(LISTED).map(place).collect();
    let more = match outliers.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!outliers.is_empty()).then(|| format!("spikes of single rows are left out: {}{more}", listed.join(", ")))
}

/// What was repaired, assumed or noticed.
fn notes(
    problem: &Problem,
    attribution: &Attribution,
    pair: Option<&Pair>,
    nothing: &[&str],
    explained: Option<&[Profile]>,
) -> Vec<String> {
    let held = pair.map_or(&[][..], |pair| &pair.problem.records);
    let records = problem.records.iter().chain(held);
    let mut notes = by_text(records);
    notes.extend(noise::too_clean(problem, &attribution.null.residual));
    notes.extend(quantised::note(problem));
    notes.extend(crate::backward::note(problem));
    notes.extend(nothing.iter().map(|id| {
        format!("{id} would fit a little better, by less than two simulators of one circuit differ: not named")
    }));
    notes.extend(pair.into_iter().flat_map(|pair| pair.remarks.clone()));
    notes.extend(
        explained
            .into_iter()
            .flat_map(|profiles| beside::notes(problem, attribution, profiles)),
    );
    notes
}
