//! From records to a verdict.

use plant::Parameters;
use toml_input::FileName;

use crate::aside;
use crate::attribute::Attribution;
use crate::beside;
use crate::capture::estimates::{self, Driven, Estimates};
use crate::capture::terms::delays;
use crate::clocks;
use crate::compared;
use crate::control::Request;
use crate::counters;
use crate::doubts;
use crate::drive::Model;
use crate::empirical::{self, Described};
use crate::examine::{Examined, examined};
use crate::extend;
use crate::findings::{Aside, Findings, Gain, Hidden, Named, Noise, Verdict};
use crate::fit::State;
use crate::gain::{Pair, Shift};
use crate::held_out::held;
use crate::instants;
use crate::left_out;
use crate::noise::{self, Outlier};
use crate::problem::{Problem, capture_drive};
use crate::profile::Profile;
use crate::progress::{Listener, Progress};
use crate::quantised;
use crate::record::{CHANNEL_NAMES, CHANNELS, Record};
use crate::resistors;
use crate::supply;
use crate::unseen;
use crate::whiteness;
use crate::words::{self, MOST_OF_IT, nearest, other_carrier as other_carrier_said, sentence, shifted};
use crate::work::Work;
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
    /// The text of the model's file, if its order and comments are to stay in what is written.
    pub model_text: Option<String>,
    /// A term that describes what no cause explains; `extended` has it if it is written.
    pub empirical: Option<Described>,
    /// The loop closed with a policy, if one was given.
    pub control: Option<crate::control::Control>,
    /// A policy that was trained anew, and what it was worth.
    pub retrained: Option<crate::retrain::judged::Judged>,
}

/// Diagnoses `model` by the records `train`; `heldout` only judges. `say` hears how far it is.
#[must_use]
pub fn diagnose(model: &Parameters, train: Vec<Record>, heldout: &[Record], say: Listener<'_>) -> Diagnosis {
    diagnose_knowing(model, &[], train, heldout, say)
}

/// [`diagnose`], where the numbers of the model under the keys `certain` are known to be right: no cause changes them.
#[must_use]
pub fn diagnose_knowing(
    model: &Parameters,
    certain: &[String],
    train: Vec<Record>,
    heldout: &[Record],
    say: Listener<'_>,
) -> Diagnosis {
    let (model, standing) = &empirical::without_standing(model);
    let mut base = Model::new(model).knowing(certain);
    base.resistors = resistors::printed(&train);
    let (judges, unused) = without_captures(heldout);
    let heldout = &judges[..];
    // a second look begins with the records as they were read
    let kept = train.clone();
    let work = Work::default();
    let mut found = examined(train, &base, &work, say);
    let sources = supply::sources(&found.problem.records, heldout, &found.problem.base);
    say(Progress::Stage("held-out records"));
    let mut pair = found.judged(heldout, &base);
    // with the carrier that was found
    let taken = found.problem.base.clone();
    let rest = aside::explained_without(&kept, &found, heldout, &taken, say);
    let aside = rest.and_then(|rest| put_aside(rest, &mut found, &mut pair));
    found.widen_counter(heldout, &taken);
    let explained = found.verdict != Verdict::Unexplained;
    let (state, trim) = better(&found, model.converter.f_sw);
    let mut answer = answer(&found, pair.as_ref(), &state, sources, say);
    // the figures are those of the file that is written, whose edges do what the records tell from nothing
    if !explained || !has_trim(&found, trim, model.converter.f_sw) {
        pair = held(&found.problem, heldout, &base, &state, trim);
    }
    let mut whole_problem = None;
    let set_aside = aside.map(|(part, whole)| {
        let one = aside::shown(&mut found, part, &whole, &kept, &taken);
        // the held-out records tell of a channel that was set aside, too
        pair = held(&found.problem, heldout, &base, &state, trim);
        whole_problem = Some(whole);
        one
    });
    let (mut state, mut empirical) = (state, None);
    if asks_for_a_term(&found, explained, set_aside.as_ref()) {
        say(Progress::Stage("empirical term"));
        let problem = whole_problem.as_ref().unwrap_or(&found.problem);
        empirical = described(problem, heldout, &base, (&mut state.model, trim), &mut pair);
    }
    let given = as_given(&found.problem, &base, &mut answer.partial_gain, pair.as_ref());
    let compared = compared::of(&found.problem, &kept, heldout);
    let more = standing.clone().into_iter().chain(work.said());
    let notes = answer.notes.into_iter().chain(unused).chain(more);
    let left = found.left();
    // what the nearest causes leave is said with them
    let is_said = !explained && found.attribution.removed(&found.problem) >= MOST_OF_IT && !found.structure.is_empty();
    let said = if is_said { &[][..] } else { &left[..] };
    let findings = Findings {
        sentence: sentence(&found, &answer.causes, set_aside.as_ref(), said)
            + &answer.near
            + &compared.sentence()
            + &shifted(&answer.shifts),
        compared,
        verdict: match set_aside {
            Some(_) => Verdict::MostlyExplained,
            None => found.verdict_with_lines(),
        },
        partial: if explained { Vec::new() } else { found.named.clone() },
        causes: answer.causes,
        partial_gain: answer.partial_gain,
        set_aside,
        empirical: empirical.as_ref().map(|term| term.findings.clone()),
        structure: left,
        residuals: whiteness::of_both((&found.problem, found.attribution.state()), pair.as_ref()),
        doubts: doubts::said(&found.doubts),
        not_detectable: answer.not_detectable,
        next_experiments: answer.next_experiments,
        captures: read_off(&found.problem, model),
        noise: noise_of(&found, trim, notes),
        gain: gain_of(pair.as_ref(), answer.shifts),
    };
    Diagnosis {
        findings,
        given,
        extended: state.model,
        problem: found.problem,
        attribution: found.attribution,
        profiles: found.profiles,
        held: pair,
        trim,
        model_text: None,
        empirical,
        control: None,
        retrained: None,
    }
}

/// Makes an explanation of all but a part the answer; the part, and the problem with it. Where the model as given explains the rest, that is said first,
/// and there is no cause.
fn put_aside(mut rest: aside::Rest, found: &mut Examined, pair: &mut Option<Pair>) -> Option<(aside::Part, Problem)> {
    if rest.found.named.is_empty() {
        // what stands for edges may be all that another cause does to the channels that are left
        found.all_but = Some((rest.part.said(&found.problem), words::edges(&rest.found)));
        return None;
    }
    rest.found.read_before(found);
    let whole = std::mem::replace(found, rest.found);
    *pair = rest.pair;
    Some((rest.part, whole.problem))
}

/// The better model that was found, and its trim; the model as given where causes do not explain the records.
fn better(found: &Examined, f_sw: f64) -> (State, f64) {
    match found.verdict {
        Verdict::Unexplained => (found.attribution.null.clone(), 0.0),
        _ => {
            let state = found.attribution.state().clone();
            // as the file has it: the figures are those of that file
            let trim = extend::told(state.starts.trim_or_none(f_sw), f_sw);
            let trim = if is_resolved(&found.attribution, trim) {
                trim
            } else {
                0.0
            };
            (state, trim)
        }
    }
}

/// Whether the held-out records were judged with the trim that is written.
fn has_trim(found: &Examined, written: f64, f_sw: f64) -> bool {
    written != 0.0 || found.attribution.state().starts.trim_or_none(f_sw) == 0.0
}

/// Whether the records tell a trim of the edges from none: two standard deviations.
fn is_resolved(attribution: &Attribution, trim: f64) -> bool {
    let sd = attribution.basis.trim_sd().unwrap_or(f64::INFINITY);
    trim.abs() > 2.0 * sd * attribution.inflation.sqrt()
}

/// The records that judge, and what is said of captures among them.
fn without_captures(heldout: &[Record]) -> (Vec<Record>, Vec<String>) {
    // what a capture shows comes beside the fit of the training records only
    let (captured, judges): (Vec<&Record>, Vec<&Record>) = heldout.iter().partition(|record| record.capture.is_some());
    let unused = captured.iter().map(|record| {
        format!(
            "{}: a capture is not judged among held-out records, and is not used; give it with the training records",
            record.name
        )
    });
    (judges.into_iter().cloned().collect(), unused.collect())
}

/// What captures show by themselves, beside the model as given.
fn read_off(problem: &Problem, model: &Parameters) -> Vec<Estimates> {
    let of = |record: &Record| {
        let capture = record.capture.as_ref()?;
        let drive = capture_drive(record, 0.0);
        let v_out = capture
            .mean(0)
            .map_or(drive.duty * model.converter.v_in, |level| level.value);
        let power = if v_out > 0.0 { drive.load.power / v_out } else { 0.0 };
        let driven = Driven {
            name: record.name.clone(),
            duty: drive.duty,
            applied: drive.applied,
            drawn: v_out * drive.load.conductance + drive.load.current + power,
            conductance: drive.load.conductance,
            delays: capture.pin.and_then(|_| delays(model, &drive)),
        };
        Some(estimates::of(capture, &driven, model))
    };
    problem.records.iter().filter_map(of).collect()
}

/// Whether something is left that a term could describe: of the model as given, since nothing is believed that causes leave nothing of. Not where the
/// held-out records alone speak against them, which would refute a term as well. Nor of a channel that was set aside: what corrects the duty moves the
/// others, which need nothing.
fn asks_for_a_term(found: &Examined, explained: bool, aside: Option<&Aside>) -> bool {
    let is_to_describe = match aside {
        None => !explained,
        Some(aside) => aside.channel.is_none(),
    };
    is_to_describe && !found.left().is_empty() && !found.fits_training_alone() && found.is_of_a_converter()
}

/// The term that describes what `model`, with its trim, leaves; model and held-out records follow it where it is written.
fn described(
    problem: &Problem,
    heldout: &[Record],
    base: &Model,
    (model, trim): (&mut Model, f64),
    pair: &mut Option<Pair>,
) -> Option<Described> {
    let mut term = empirical::described(problem, model, trim)?;
    let against = held(&term.problem, heldout, model, &term.after, trim);
    term.judged(against.as_ref());
    if term.findings.written {
        *pair = held(&term.problem, heldout, base, &term.after, trim);
        *model = term.after.model.clone();
    }
    Some(term)
}

/// What is said of records that were examined.
struct Answer {
    causes: Vec<Named>,
    partial_gain: Vec<Worth>,
    not_detectable: Vec<Hidden>,
    next_experiments: Vec<crate::next::Experiment>,
    notes: Vec<String>,
    shifts: Vec<Shift>,
    near: String,
}

/// What to say of `found`, whose better model is `state`.
fn answer(found: &Examined, pair: Option<&Pair>, state: &State, sources: Vec<String>, say: Listener<'_>) -> Answer {
    let (problem, attribution) = (&found.problem, &found.attribution);
    let explained = found.verdict != Verdict::Unexplained;
    let mut odd = found.odd.clone();
    odd.extend(noise::spikes(problem, &found.outliers));
    odd.extend(sources);
    let mut near = String::new();
    if !explained && !found.is_misread() {
        odd.extend(other_carrier(problem, attribution));
        // causes that bend to what one part of the records shows come near nothing
        if found.all_but.is_none() {
            near = nearest(
                &found.named,
                attribution.removed(problem),
                found.fits_training_alone(),
                &found.structure,
            );
        }
        near += &other_carrier_said(found);
    }
    odd.extend(notes(found, pair));
    let mut causes = if explained { found.named.clone() } else { Vec::new() };
    // a step of a converter is named beside other causes; where structure is left nothing is named, not even this
    causes.extend(found.read_off.iter().filter(|_| explained).cloned());
    Answer {
        causes,
        partial_gain: match explained || found.named.is_empty() {
            true => Vec::new(),
            false => partial_gain(problem, attribution, pair),
        },
        // of records that are not read as they were made nothing follows for any cause
        not_detectable: match found.is_misread() {
            true => Vec::new(),
            false => unseen::hidden(problem, attribution),
        },
        next_experiments: match explained {
            true => crate::next::experiments(problem, attribution, say),
            false => Vec::new(),
        },
        notes: odd,
        // a model that does not explain the training records says nothing about a change between them and the others
        shifts: (pair.filter(|_| explained)).map_or_else(Vec::new, |pair| pair.shifts(problem, state)),
        near,
    }
}

/// Largest plant file whose text is kept, bytes: a hundred times a long one.
const LONGEST_FILE: u64 = 1 << 20;

impl Diagnosis {
    /// Keeps the text of the model's file, so that its order and comments stay in what is written.
    pub fn keep_text(&mut self, file: &FileName) {
        let bytes = file.read(LONGEST_FILE).ok();
        self.model_text = bytes.and_then(|bytes| String::from_utf8(bytes).ok());
    }

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

/// What held-out records say; the closed loop comes later, if at all.
fn gain_of(pair: Option<&Pair>, shifts: Vec<Shift>) -> Gain {
    Gain {
        heldout: pair.map_or_else(Vec::new, Pair::errors),
        mean_square: pair.map_or([f64::NAN; 2], |pair| pair.total().into()),
        shifts,
        closed_loop: None,
        closed_loop_missing: None,
        retrained: None,
        retrained_missing: None,
    }
}

/// Another carrier that fits better; with the model as given, too, since a cause may have bent to what the carrier does.
fn other_carrier(problem: &Problem, attribution: &Attribution) -> Option<String> {
    let states = [attribution.state(), &attribution.null];
    states
        .into_iter()
        .find_map(|state| worth::other_carrier(problem, state))
}

/// What causes that explain only a part would gain, first where no fit has seen it.
fn partial_gain(problem: &Problem, attribution: &Attribution, held: Option<&Pair>) -> Vec<Worth> {
    let mut list = held.map_or_else(Vec::new, worth::of_held);
    list.extend(worth::of_training(problem, &attribution.null, attribution.state()));
    list
}

/// The model without the trim of the edges that stands beside every fit. What a part gains, too, begins there: beside the fit a trim is
/// free, and the held-out records were read by the causes.
fn as_given(problem: &Problem, base: &Model, partial_gain: &mut [Worth], pair: Option<&Pair>) -> State {
    let mut held = problem.clone();
    held.trim_held = true;
    let given = instants::scanned(&held, base, &held.first_starts(base));
    worth::before(partial_gain, (problem, &given), pair);
    given
}

fn noise_of(found: &Examined, trim: f64, repairs: impl Iterator<Item = String>) -> Noise {
    let problem = &found.problem;
    let measured = (0..CHANNELS).filter(|n| problem.sigma[*n].is_finite());
    let outlier = |one: &Outlier| {
        let record = &problem.records[one.record].name;
        format!("{record}:{}:{}", one.row, CHANNEL_NAMES[one.channel])
    };
    Noise {
        sigma: measured.map(|n| (CHANNEL_NAMES[n], problem.sigma[n])).collect(),
        inflation: found.attribution.inflation,
        outliers: found.outliers.iter().map(outlier).collect(),
        repairs: repairs.collect(),
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

/// What was repaired, assumed or noticed.
fn notes(found: &Examined, pair: Option<&Pair>) -> Vec<String> {
    let (problem, attribution) = (&found.problem, &found.attribution);
    let held = pair.map_or(&[][..], |pair| &pair.problem.records);
    let records = problem.records.iter().chain(held);
    let clocks = clocks::notes(records.clone(), &attribution.state().model);
    let mut notes = by_text(records);
    notes.extend(clocks.filter(|_| found.verdict != Verdict::Unexplained));
    notes.extend(left_out::notes(problem, &found.outliers));
    notes.extend(
        pair.into_iter()
            .flat_map(|pair| left_out::notes(&pair.problem, &pair.spikes)),
    );
    notes.extend(noise::too_clean(problem, &attribution.null.residual));
    notes.extend(quantised::note(problem));
    notes.extend(crate::backward::note(problem));
    notes.extend(found.nothing.iter().map(|id| {
        format!("{id} would fit a little better, by less than two simulators of one circuit differ: not named")
    }));
    notes.extend(pair.into_iter().flat_map(|pair| pair.remarks.clone()));
    // with nothing else to say it is the answer itself
    notes.extend(words::edges(found).filter(|_| found.verdict != Verdict::Consistent || !found.lines.is_empty()));
    notes.extend(words::curves(found));
    notes.extend(words::drawn_beside(found));
    notes.extend(counters::note(attribution, &found.profiles).filter(|_| found.verdict != Verdict::Unexplained));
    notes.extend(words::pulsed(found).filter(|_| found.verdict != Verdict::Unexplained));
    notes.extend(resistors::note(attribution).filter(|_| found.verdict != Verdict::Unexplained));
    // of what was found: where the model as given is far off, so are the instants of load steps that fit it best
    if found.verdict != Verdict::Unexplained {
        notes.extend(beside::notes(problem, attribution, &found.profiles));
    }
    notes
}
