//! Training records to an answer, before any record judges it.

use crate::attribute::{Attribution, attribute, without_search};
use crate::balance;
use crate::clocks;
use crate::doubts::{self, Doubt};
use crate::drive::Model;
use crate::fast;
use crate::findings::{Evidence, Named, Value, Verdict};
use crate::fit::State;
use crate::in_front;
use crate::instants;
use crate::noise::{self, Outlier};
use crate::preflight::{self, Misread};
use crate::problem::Problem;
use crate::profile::{Profile, parabolas, profiles};
use crate::progress::{Listener, Progress};
use crate::quantised;
use crate::record::Record;
use crate::rivals::{self, RivalValue};
use crate::sampling;
use crate::shape::{Structure, structures};
use crate::sides;
use crate::small;
use crate::timing::{self, Timing};
use crate::unsure_levels;
use crate::work::Work;

/// What training records say.
#[derive(Debug)]
pub struct Examined {
    /// The records.
    pub problem: Problem,
    /// What was fitted.
    pub attribution: Attribution,
    /// Profiles of the parameters.
    pub profiles: Vec<Profile>,
    /// Causes that the fit took and that are no effect.
    pub nothing: Vec<&'static str>,
    /// The causes.
    pub named: Vec<Named>,
    /// What is read off the records and not fitted: another carrier, the step of a converter.
    pub read_off: Vec<Named>,
    /// What is left.
    pub structure: Vec<Structure>,
    /// Lines too fast for any cause, which stand beside what was found.
    pub lines: Vec<Structure>,
    /// What speaks against the causes.
    pub doubts: Vec<Doubt>,
    /// Rows left out.
    pub outliers: Vec<Outlier>,
    /// What was seen before any fit.
    pub odd: Vec<String>,
    /// Other readings of single records, of those in `odd`: what held-out records speak against may be one of them.
    pub readings: Vec<String>,
    /// Other ways to read the records.
    pub misread: Vec<Misread>,
    /// The channel or record without which the model as given explains the records, and what its edges do beside it.
    pub all_but: Option<(String, Option<String>)>,
    /// The answer.
    pub verdict: Verdict,
}

/// Looks for the causes in `train`; what it computes counts as `work`.
#[must_use]
pub fn examined(train: Vec<Record>, base: &Model, work: &Work, say: Listener<'_>) -> Examined {
    say(Progress::Stage("noise and initial states"));
    let (mut problem, mut null, mut outliers) = prepared(train.clone(), base, work);
    let misread = preflight::readings(&problem, &null);
    let mut odd: Vec<String> = misread.iter().map(|one| one.words.clone()).collect();
    for words in odd.iter().chain(&noise::spikes(&problem, &outliers)) {
        say(Progress::Noticed(words));
    }
    if let Some(fault) = preflight::answer(&problem, &misread) {
        return Examined::misread(problem, null, outliers, fault);
    }
    let mut read_off = Vec::new();
    match timing::of(&problem, &null) {
        Some(Timing::Other(cause, carrier, said)) => {
            // everything else is sought in the converter that the bench seems to be
            (problem, null, outliers) = prepared(train, &timing::with(base, carrier), work);
            read_off.push(cause);
            odd.push(said);
        }
        Some(Timing::Perhaps(said)) => odd.push(said),
        None => {}
    }
    let (mut problem, mut attribution) = attribute(problem, null, say);
    if problem.base.v_in_in_front && !base.v_in_in_front {
        odd.push(in_front::SAID.to_owned());
    }
    let is_line = |state| !fast::structures(&problem, &attribution.null, state).is_empty();
    let beside_line = is_line(&attribution.null) || is_line(attribution.state());
    odd.extend((attribution.leave_out_coloured(&problem, beside_line)).into_iter().map(|id| {
        format!("{id} would fit a little better: not named, since a rhythm, other noise that is not white, or chance among all values that are tried lends it as much")
    }));
    unsure_levels::note(&mut problem, attribution.state());
    // what is too small for a cause still leaves no structure
    let structure = structures(&problem, &attribution.null, attribution.state(), attribution.inflation);
    // causes that explain nothing bend the instants as well
    let told = if structure.is_empty() {
        attribution.state()
    } else {
        &attribution.null
    };
    instants::note(&mut problem, &told.starts);
    let lines = beside(
        fast::structures(&problem, &attribution.null, attribution.state()),
        &structure,
    );
    let mut profiles = held_by_data(&problem, &mut attribution, &structure, say);
    // behind the profiles: whether a cause is nothing is read off its intervals
    let nothing = attribution.leave_out_nothing(&problem, &mut profiles);
    if !nothing.is_empty() {
        // the others were fitted without it: their values and intervals are others
        profiles = intervals(&problem, &mut attribution, &structure, say);
    }
    let named = named(&attribution, &profiles);
    let mut doubts = doubts::of(&problem, &attribution, &profiles, &structure);
    if let Some(fault) = rows_ahead(&problem, &attribution.null, &misread, &named) {
        return Examined::misread(problem, attribution.null, outliers, fault);
    }
    if !structure.is_empty() || doubts::forbids(&named, &doubts) {
        // where no cause explains the records the other reading is what there is to say
        doubts.extend(odd_readings(&misread));
    }
    read_off.extend(quantised::cause(&problem));
    let holds = structure.is_empty() && !doubts::forbids(&named, &doubts);
    if holds && !named.is_empty() {
        let refuted = |words: &String| (misread.iter()).any(|one| one.words == *words && one.is_refuted_by_a_cause());
        odd.retain(|words| !refuted(words));
    }
    Examined {
        verdict: verdict(&named, &read_off, holds),
        problem,
        attribution,
        profiles,
        nothing,
        named,
        read_off,
        structure,
        lines,
        doubts,
        outliers,
        readings: readings(&misread, &odd),
        misread,
        odd,
        all_but: None,
    }
}

/// Other readings that are no more than notes, and that causes which explain the records do not refute.
fn readings(misread: &[Misread], odd: &[String]) -> Vec<String> {
    let words = misread.iter().map(|one| &one.words);
    words.filter(|words| odd.contains(words)).cloned().collect()
}

/// Causes that move samples or duties in time.
const TIMING: [&str; 4] = ["sampling_delay", "duty_delay", "sensor_delay", "sensor_low_pass"];

/// The shift of the rows that a sampling instant which explains the records is nothing but.
fn rows_ahead(problem: &Problem, null: &State, misread: &[Misread], named: &[Named]) -> Option<String> {
    if named.len() > 1 && named.iter().any(|cause| TIMING.contains(&cause.id)) {
        // one shift of whole rows does what several causes do, of which a wrong instant is one
        if let Some(words) = preflight::all_shifted(problem, null, misread) {
            return Some(words);
        }
    }
    // beside it a cause may have taken up what the last row lost
    let sampled = named.iter().find(|cause| cause.id == "sampling_delay")?;
    let late = sampled.parameters.get("delay")?;
    let is_ahead = preflight::is_rows_ahead(problem, misread, late.value / problem.bases.t_sw);
    misread.first().filter(|_| is_ahead).map(|one| one.words.clone())
}

/// Other readings as doubts.
fn odd_readings(misread: &[Misread]) -> impl Iterator<Item = Doubt> + '_ {
    misread.iter().map(|one| Doubt::Bench(one.words.clone()))
}

impl Examined {
    /// Records of which a fault of the bench is all that is wrong: no cause is sought.
    fn misread(problem: Problem, null: State, outliers: Vec<Outlier>, fault: String) -> Self {
        let (problem, attribution) = without_search(problem, null);
        Examined {
            structure: structures(&problem, &attribution.null, &attribution.null, attribution.inflation),
            doubts: vec![Doubt::Bench(fault)],
            verdict: Verdict::Unexplained,
            problem,
            attribution,
            profiles: Vec::new(),
            nothing: Vec::new(),
            named: Vec::new(),
            read_off: Vec::new(),
            lines: Vec::new(),
            outliers,
            odd: Vec::new(),
            readings: Vec::new(),
            misread: Vec::new(),
            all_but: None,
        }
    }

    /// Whether a fault of the bench is the answer, which no search behind it can better.
    #[must_use]
    pub fn is_misread(&self) -> bool {
        self.attribution.best.is_none() && self.doubts.iter().any(|doubt| matches!(doubt, Doubt::Bench(_)))
    }

    /// Whether nothing says that the records are read in a wrong way, or are none of such a converter: a term fitted to them would describe
    /// that, and spoil the model.
    #[must_use]
    pub fn is_of_a_converter(&self) -> bool {
        let is_of_none = |doubt: &Doubt| matches!(doubt, Doubt::Bench(_) | Doubt::Kind(_) | Doubt::Noise(_));
        let is_disordered = |index| small::disorder(&self.problem, &self.attribution.null, index).is_some();
        !self.doubts.iter().any(is_of_none) && !(0..self.problem.records.len()).any(is_disordered)
    }

    /// The verdict with lines that no cause makes: beside causes they are left, and without causes they are all that there is.
    #[must_use]
    pub fn verdict_with_lines(&self) -> Verdict {
        match self.verdict {
            verdict if self.lines.is_empty() => verdict,
            Verdict::Explained | Verdict::Ambiguous | Verdict::MostlyExplained => Verdict::MostlyExplained,
            Verdict::Consistent | Verdict::Unexplained => Verdict::Unexplained,
        }
    }

    /// What is left, to be told: of causes that explain nothing only what they leave beside them is known, and they bend it. So it is what
    /// the model as given leaves where no cause is named.
    #[must_use]
    pub fn left(&self) -> Vec<Structure> {
        let own = || self.structure.iter().chain(&self.lines).cloned().collect();
        if self.verdict != Verdict::Unexplained || self.attribution.best.is_none() {
            return own();
        }
        let (problem, null) = (&self.problem, &self.attribution.null);
        let given = structures(problem, null, null, noise::inflation(problem, &null.residual));
        let lines = beside(fast::structures(problem, null, null), &given);
        let all: Vec<Structure> = given.into_iter().chain(lines).collect();
        if all.is_empty() { own() } else { all }
    }

    /// Takes over what was read off more of the same records before.
    pub fn read_before(&mut self, whole: &Examined) {
        let is_new = |cause: &&Named| self.read_off.iter().all(|known| known.id != cause.id);
        let before: Vec<Named> = whole.read_off.iter().filter(is_new).cloned().collect();
        self.read_off.splice(0..0, before);
        self.odd.splice(0..0, whole.odd.iter().cloned());
    }

    /// Takes out the causes of whose evidence `is_sure` is not true; their ids.
    pub fn keep_sure(&mut self, is_sure: impl Fn(&Evidence) -> bool) -> Vec<&'static str> {
        let unsure: Vec<usize> = (0..self.named.len())
            .filter(|member| !is_sure(&self.named[*member].evidence))
            .collect();
        let out = (self.attribution).leave_out_weak(&self.problem, &mut self.profiles, unsure);
        if !out.is_empty() {
            self.answer();
        }
        out
    }

    /// What the fit and its profiles say.
    pub(crate) fn answer(&mut self) {
        let (problem, attribution) = (&self.problem, &mut self.attribution);
        self.structure = structures(problem, &attribution.null, attribution.state(), attribution.inflation);
        self.lines = beside(
            fast::structures(problem, &attribution.null, attribution.state()),
            &self.structure,
        );
        self.profiles = intervals(problem, attribution, &self.structure, &|_| ());
        let attribution = &self.attribution;
        self.named = named(attribution, &self.profiles);
        self.doubts = doubts::of(problem, attribution, &self.profiles, &self.structure);
        let holds = self.structure.is_empty() && !doubts::forbids(&self.named, &self.doubts);
        self.verdict = verdict(&self.named, &self.read_off, holds);
    }
}

/// Lines in channels that hold nothing else: what is slow has been said already.
fn beside(mut lines: Vec<Structure>, structure: &[Structure]) -> Vec<Structure> {
    lines.retain(|line| {
        let same = |one: &Structure| one.record == line.record && one.channel == line.channel;
        !structure.iter().any(same)
    });
    lines
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
        return intervals(problem, attribution, structure, say);
    }
    let mut others = crate::ties::other_pairs(problem, attribution, say);
    others.extend(crate::ties::pairs_for_one(problem, attribution, say));
    // they stand in the place of all causes together: said once, at the first
    for rivals in attribution.rivals.iter_mut().take(1) {
        rivals.extend(others.iter().cloned());
    }
    rivals::most_usual_first(problem, attribution, say);
    for (member, rival) in crate::ties::in_part(problem, attribution, say) {
        attribution.rivals[member].push(rival);
    }
    rivals::leave_out_cut_off(attribution);
    rivals::sort_by_use(attribution);
    intervals(problem, attribution, structure, say)
}

/// Values of the named causes and what the data allow of each.
fn intervals(
    problem: &Problem,
    attribution: &mut Attribution,
    structure: &[Structure],
    say: Listener<'_>,
) -> Vec<Profile> {
    if !structure.is_empty() {
        return parabolas(problem, attribution);
    }
    let mut profiles = profiles(problem, attribution, say);
    rivals::widen(attribution, &mut profiles);
    rivals::widen_by_edges(problem, attribution, &mut profiles);
    profiles
}

/// Noise estimated, outliers masked, initial states fitted.
fn prepared(train: Vec<Record>, base: &Model, work: &Work) -> (Problem, State, Vec<Outlier>) {
    let mut problem = Problem::new(train, base.clone());
    balance::leave_out_odd(&mut problem);
    problem.work = work.over(problem.records.iter().map(Record::rows).sum());
    let mut null = State::settle(&problem, base, &problem.first_starts(base), None);
    if sides::leave_out(&mut problem, &null) {
        null = State::settle(&problem, base, &null.starts, None);
    }
    // noise before the instants of loggers and before outliers, which are judged in its units; and again without the
    // outliers
    problem.sigma = noise::sigma(&problem, &null.residual);
    sampling::decide(&mut problem, base);
    unsure_levels::free(&mut problem, base, &mut null);
    null = State::settle(&problem, base, &null.starts, None);
    let outliers = noise::outliers(&problem, &null.residual);
    problem.leave_out(&outliers);
    null = State::settle(&problem, base, &null.starts, None);
    problem.sigma = noise::sigma(&problem, &null.residual);
    null = State::settle(&problem, base, &null.starts, None);
    let is_tuned = clocks::tune(&mut problem, base, null.starts.trim, 1);
    if clocks::align(&mut problem, &null) || is_tuned {
        null = State::settle(&problem, base, &null.starts, None);
    }
    (problem, null, outliers)
}

pub(crate) fn named(attribution: &Attribution, profiles: &[Profile]) -> Vec<Named> {
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
            (ids, rivals::values(attribution, fit))
        });
        let (rivals, rival_values) = each_once(rivals).into_iter().unzip();
        Named {
            id: candidate.cause.id,
            words: candidate.form.words,
            parameters: parameters.collect(),
            evidence: Evidence {
                delta_chi2: attribution.evidence[member] / attribution.inflation,
                // without the inflation: the evidence is over it already
                threshold: crate::level::threshold(candidate.own.len(), 1.0),
            },
            rivals,
            rival_values,
        }
    };
    best.causes.iter().enumerate().map(of).collect()
}

/// A rival: its ids, and the values that it needs.
type Rival = (Vec<&'static str>, Vec<RivalValue>);

/// The same ids may come from two forms of a cause, each of which fits as well: the one with fewer values is told, since a filter can be made
/// to do what a resistance does.
fn each_once(sets: impl Iterator<Item = Rival>) -> Vec<Rival> {
    sets.fold(Vec::new(), |mut list: Vec<Rival>, rival| {
        match list.iter_mut().find(|(ids, _)| *ids == rival.0) {
            Some(known) if rival.1.len() < known.1.len() => *known = rival,
            Some(_) => {}
            None => list.push(rival),
        }
        list
    })
}

fn verdict(named: &[Named], read_off: &[Named], holds: bool) -> Verdict {
    // before anything else: where the truth is not on the list, its best cause imitates it with a wrong value
    if !holds {
        return Verdict::Unexplained;
    }
    if named.iter().any(|cause| !cause.rivals.is_empty()) {
        return Verdict::Ambiguous;
    }
    match named.is_empty() && read_off.is_empty() {
        true => Verdict::Consistent,
        false => Verdict::Explained,
    }
}
