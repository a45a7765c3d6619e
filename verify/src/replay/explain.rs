//! What logged values of a feature are instead: the simplest of a few relations that holds in nearly every row.
//!
//! | tried, in this order | what it says |
//! |---|---|
//! | other only in the first rows of episodes | what the filters start with |
//! | an integral by another rule or between other ends ([`variants`](super::variants)) | rule, first sample, clamp |
//! | `y = s x + o` of the feature itself | sign, scale, offset, clip |
//! | one of its filters made otherwise, left out, or one more | the filter, its time constant |
//! | another feature | order of the network's inputs |
//! | `s x + o` of the feature some rows earlier or later | a delay |
//! | its filters over a signal or another feature's source | what stands in front of the filters |
//! | `s x + o` of a signal or of another feature's source | another source |
//! | `s x + o` of the change of one of these from row to row | a difference that is missing |

use interp::{Real, Trace};
use policy::{Feature, Policy};

use super::itself::of_itself;
use super::values::{allowed, ends};
use super::variants::Trial;

/// Rows in which a relation has to hold, as a share.
// some rows of a log are odd: a clip that only the log has, the first rows of an episode
const NEARLY_ALL: f64 = 0.97;
/// Fewest rows that show a relation.
// a line goes through any two; a third may lie on it by the few digits of a log
pub(super) const FEWEST_ROWS: usize = 4;
/// Longest delay that is looked for, rows.
const LONGEST_SHIFT: isize = 4;
/// Share of the rows in which the contract is off that a relation has to mend.
// what holds in all other rows, too, says nothing of a few odd ones
const MENDED: f64 = 0.9;
/// Rows at the start of an episode that a filter may still remember.
const START: usize = 8;

/// What the interpreter made of the log.
#[derive(Debug, Clone)]
pub(super) struct Course {
    pub begins: Vec<bool>,
    features: Vec<FeatureCourse>,
    signals: Vec<Vec<f64>>,
    pub outputs: Vec<OutputCourse>,
}

/// What it made of one output.
#[derive(Debug, Clone, Default)]
pub(super) struct OutputCourse {
    pub actions: Vec<u32>,
    /// What the logged action gives up of Q, as a share of the largest |Q| of its row; empty without logged actions.
    pub lost: Vec<f64>,
    /// Before the mapping.
    pub duties: Vec<f64>,
    /// By the action that the trainer applied, before the mapping.
    pub commanded: Vec<f64>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct FeatureCourse {
    pub source: Vec<f64>,
    pub unclipped: Vec<f64>,
    observation: Vec<f64>,
}

impl Course {
    pub fn new(policy: &Policy, begins: &[bool]) -> Self {
        Self {
            begins: begins.to_vec(),
            features: vec![FeatureCourse::default(); policy.features.len()],
            signals: vec![Vec::new(); policy.signals.len()],
            outputs: vec![OutputCourse::default(); policy.paths().len()],
        }
    }

    pub fn push<T: Real>(&mut self, trace: &Trace<T>) {
        for (course, feature) in self.features.iter_mut().zip(&trace.features) {
            course.source.push(feature.source.to_f64());
            course.unclipped.push(feature.unclipped.to_f64());
            course.observation.push(feature.observation.to_f64());
        }
        for (course, signal) in self.signals.iter_mut().zip(&trace.signals) {
            course.push(signal.to_f64());
        }
        for (index, output) in self.outputs.iter_mut().enumerate() {
            let decision = trace.decision(index);
            output.actions.push(decision.action_index);
            output.duties.push(decision.duty_sim.to_f64());
        }
    }

    /// What the contract commands by what the trainer applied.
    pub fn commanded<T: Real>(&mut self, trace: &Trace<T>) {
        for (index, output) in self.outputs.iter_mut().enumerate() {
            output.commanded.push(trace.decision(index).command.duty_sim.to_f64());
        }
    }

    /// What the network sees of a feature.
    pub fn observation(&self, feature: usize) -> &[f64] {
        self.features.get(feature).map_or(&[], |course| &course.observation)
    }

    /// Rows since the start of the episode.
    pub fn ages(&self) -> Vec<usize> {
        let mut age = 0;
        let next = |begins: &bool| {
            age = if *begins { 0 } else { age + 1 };
            age
        };
        self.begins.iter().map(next).collect()
    }
}

impl OutputCourse {
    /// Weighs the logged action by `q`, the Q values of the contract for this output, beside its own choice.
    pub fn gives_up(&mut self, q: &[f64], [own, logged]: [u32; 2]) {
        let value = |action: u32| q.get(action as usize).copied().unwrap_or(f64::NAN);
        let largest = q.iter().fold(f64::MIN_POSITIVE, |largest, q| largest.max(q.abs()));
        self.lost.push((value(own) - value(logged)) / largest);
    }
}

/// A relation `s x + o`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub s: f64,
    pub o: f64,
}

/// Logged values, and how near is equal.
pub(super) struct Logged<'a> {
    pub values: &'a [f64],
    pub allowed: f64,
    /// Rows in which the contract makes something else.
    off: Vec<bool>,
    /// Rows that lie between the ends, or all where no end comes back: at a clip a relation ends.
    inner: Vec<usize>,
    /// The ends at which several rows lie: a clip. `None` of one that the log does not reach.
    pub clip: Option<[Option<f64>; 2]>,
}

impl<'a> Logged<'a> {
    fn new(policy: &Policy, feature: &Feature, own: &[f64], values: &'a [f64], tolerance: f64) -> Self {
        let allowed = allowed(policy, feature, values, tolerance);
        let [low, high] = ends(values);
        let at = |end: f64| values.iter().filter(|value| (*value - end).abs() <= allowed).count();
        // one row has to be the highest; several of exactly one value are held there, unless all are
        let is_clip = |end: f64| at(end) >= FEWEST_ROWS.min(values.len().div_ceil(2));
        let clipped = high - low > allowed && (is_clip(low) || is_clip(high));
        let is_inner = |value: f64| {
            !(clipped && ((is_clip(low) && value <= low + allowed) || (is_clip(high) && value >= high - allowed)))
        };
        let rows = values.iter().enumerate();
        Self {
            allowed,
            off: own
                .iter()
                .zip(values)
                .map(|(own, value)| (own - value).abs() > allowed)
                .collect(),
            inner: rows
                .filter(|(_, value)| is_inner(**value))
                .map(|(row, _)| row)
                .collect(),
            clip: clipped.then(|| [low, high].map(|end| is_clip(end).then_some(end))),
            values,
        }
    }

    /// The ends at which the log lies while these values, one for each row, go beyond them.
    // the least and the largest value of any log have equal neighbours where it turns round: that alone is no clip
    pub fn cut_off(&self, unclipped: &[f64]) -> [Option<f64>; 2] {
        let near = 2.0 * self.allowed;
        let beyond = |end: f64, side: f64| {
            let is_cut = |(x, y): &(&f64, &f64)| (**y - end).abs() <= near && side * (**x - end) > near;
            unclipped.iter().zip(self.values).filter(is_cut).count()
        };
        let fewest = FEWEST_ROWS.min(self.values.len().div_ceil(2));
        let [low, high] = self.clip.unwrap_or_default();
        [(low, -1.0), (high, 1.0)].map(|(end, side)| end.filter(|end| beyond(*end, side) >= fewest))
    }

    /// Whether it moves by more than the digits of a log.
    pub fn moves(&self) -> bool {
        let [low, high] = ends(self.values);
        high - low > 20.0 * self.allowed
    }

    /// Whether a relation that is right or wrong in these rows explains the log.
    pub fn is_nearly(&self, rows: impl Iterator<Item = (usize, bool)>) -> bool {
        let (mut all, mut right, mut off, mut mended) = (0, 0, 0, 0);
        for (row, is_right) in rows {
            let is_off = self.off.get(row).copied().unwrap_or(false);
            all += 1;
            right += usize::from(is_right);
            off += usize::from(is_off);
            mended += usize::from(is_off && is_right);
        }
        right as f64 >= NEARLY_ALL * all as f64 && mended as f64 >= MENDED * off as f64
    }

    /// Whether these values, one for each row, explain the log.
    pub fn is(&self, made: &[f64]) -> bool {
        let pairs = made.iter().zip(self.values);
        let right = pairs.map(|(made, value)| (made - value).abs() <= 2.0 * self.allowed);
        self.is_nearly(right.enumerate())
    }

    /// The line through `x` that nearly all inner rows lie on; `x` is `None` where a row has no such value.
    pub fn line(&self, x: &[Option<f64>]) -> Option<Line> {
        let pair = |row: &usize| Some((*row, ((*x.get(*row)?)?, *self.values.get(*row)?)));
        let (rows, pairs): (Vec<usize>, Vec<(f64, f64)>) = self.inner.iter().filter_map(pair).unzip();
        let mut ordered = pairs.clone();
        ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
        // a value that hardly moves lies on every line
        let heights = pairs.iter().map(|(_, y)| *y).collect::<Vec<_>>();
        let [low, high] = ends(&heights);
        if pairs.len() < FEWEST_ROWS || high - low <= 20.0 * self.allowed {
            return None;
        }
        let is_line = |line: &Line| {
            let on = |(x, y): &(f64, f64)| (line.s * x + line.o - y).abs() <= 2.0 * self.allowed;
            self.is_nearly(rows.iter().copied().zip(pairs.iter().map(on)))
        };
        // through the ends, and through rows further in: the row at an end may be the odd one
        let last = ordered.len() - 1;
        let chords = [0, last / 10, last / 4].into_iter().filter_map(|inset| {
            let ((x1, y1), (x2, y2)) = (*ordered.get(inset)?, *ordered.get(last - inset)?);
            (x2 - x1 > f64::EPSILON * x1.abs().max(x2.abs())).then(|| ((x1, y1), (y2 - y1) / (x2 - x1)))
        });
        // the plain ones first: what a log's last digit adds is no offset
        let lines = chords.flat_map(|((x, y), s)| {
            let plain = [1.0, -1.0, s].map(|s| Line { s, o: 0.0 });
            let tilted = [1.0, -1.0, s].map(|s| Line { s, o: y - s * x });
            plain.into_iter().chain(tilted)
        });
        lines.into_iter().find(is_line)
    }
}

/// What the logged values are instead; `None` if it is nothing simple.
pub(super) fn explain(
    policy: &Policy,
    course: &Course,
    index: usize,
    values: &[f64],
    tolerance: f64,
) -> Option<String> {
    let feature = policy.features.get(index)?;
    let own = course.features.get(index)?;
    let logged = Logged::new(policy, feature, &own.observation, values, tolerance);
    let trial = Trial::new(policy, feature, own, course, &logged);
    // a tolerance below what is left of the digits: any relation with a free number would fit as well as the contract's own
    if trial.fits(&trial.links) {
        return Some(
            "the contract's own formula fits the log: what differs are roundings, so the tolerance is too small"
                .to_owned(),
        );
    }
    // only what remembers something begins in another way
    let duties = policy
        .paths()
        .iter()
        .any(|path| feature.source.reads(path.previous_duty));
    let remembers = duties || !feature.filters.is_empty();
    if let Some(text) = starts(feature, course, own, &logged).filter(|_| remembers) {
        return Some(text);
    }
    // before a line: an integral that leaves out its first sample is off by a constant, and by another in each episode
    if let Some(text) = trial.of_integral_rule() {
        return Some(text);
    }
    let line = logged.line(&all(&own.unclipped));
    if let Some(text) = line.and_then(|line| of_itself(feature, line, own, &logged)) {
        return Some(text);
    }
    let same = |other: &FeatureCourse| {
        let line = logged.line(&all(&other.observation));
        line.is_some_and(|line| line.s == 1.0 && line.o == 0.0)
    };
    let mut others = course.features.iter().enumerate().filter(|(place, _)| *place != index);
    if let Some((other, _)) = others.find(|(_, other)| same(other)) {
        let name = &policy.features.get(other)?.name;
        return Some(format!(
            "the log has here what the contract calls `{name}`: another order of the features"
        ));
    }
    let shifts = (1..=LONGEST_SHIFT).flat_map(|shift| [shift, -shift]);
    for shift in shifts {
        if let Some(line) = logged.line(&shifted(&own.unclipped, course, shift)) {
            let rows = shift.abs();
            let s = if rows == 1 { "" } else { "s" };
            let (word, hint) = match shift > 0 {
                true => (
                    "earlier",
                    format!("{{ delay = {rows} }} more, as the last of its filters"),
                ),
                false => ("later", "a delay less".to_owned()),
            };
            return Some(format!(
                "it is the contract's{} {rows} row{s} {word}: {hint}",
                times(line)
            ));
        }
    }
    trial
        .of_filter()
        .or_else(|| trial.of_another_input(&candidates(policy, course)))
        .or_else(|| of_another_source(policy, course, &logged))
        .or_else(|| odd_rows(&logged))
}

fn starts(feature: &Feature, course: &Course, own: &FeatureCourse, logged: &Logged<'_>) -> Option<String> {
    let ages = course.ages();
    let other = own.observation.iter().zip(logged.values).enumerate();
    let is_other = |(_, (own, logged_value)): &(usize, (&f64, &f64))| (**own - **logged_value).abs() > logged.allowed;
    let last = other
        .filter(is_other)
        .map(|(row, _)| ages.get(row).copied().unwrap_or(0))
        .max()?;
    let longest = ages.iter().copied().max()?;
    (last < START && longest > 2 * last + 2).then(|| {
        if last == 0 && feature.filters.is_empty() {
            return "it differs only in the first row of an episode: the training has another duty before it; look at initial_duty, or, where the log \
                    begins in mid-run, leave the row out: --skip 1"
                .to_owned();
        }
        let rows = if last == 0 { "row".to_owned() } else { format!("{} rows", last + 1) };
        let skip = last + 1;
        format!("it differs only in the first {rows} of an episode: the contract's filters start as if the first sample had always been there; --skip {skip} leaves them out")
    })
}

/// A few rows that no relation holds in, among others that are equal.
fn odd_rows(logged: &Logged<'_>) -> Option<String> {
    let (off, rows) = (logged.off.iter().filter(|off| **off).count(), logged.off.len());
    (off as f64 <= (1.0 - NEARLY_ALL) * rows as f64)
        .then(|| format!("{off} of {rows} rows differ: look at what the environment did there"))
}

/// What an environment may have put in front of a feature's filters: signals and the sources of features, by their names.
fn candidates<'c>(policy: &Policy, course: &'c Course) -> Vec<(String, &'c Vec<f64>)> {
    let signals = policy
        .signals
        .iter()
        .map(|signal| signal.name.clone())
        .zip(&course.signals);
    let sources = policy.features.iter().map(|feature| feature.source_text.clone());
    let sources = sources.zip(course.features.iter().map(|course| &course.source));
    signals.chain(sources).collect()
}

fn of_another_source(policy: &Policy, course: &Course, logged: &Logged<'_>) -> Option<String> {
    let candidates = candidates(policy, course);
    for shift in 0..=LONGEST_SHIFT {
        for (name, values) in &candidates {
            if let Some(line) = logged.line(&shifted(values, course, shift)) {
                let rows = match shift {
                    0 => String::new(),
                    1 => ", one row earlier".to_owned(),
                    rows => format!(", {rows} rows earlier"),
                };
                return Some(format!("it is {}{rows}", affine(line, name)));
            }
        }
    }
    candidates.iter().find_map(|(name, values)| {
        let before = shifted(values, course, 1);
        let change: Vec<Option<f64>> = values
            .iter()
            .zip(&before)
            .map(|(now, before)| Some(now - (*before)?))
            .collect();
        let line = logged.line(&change)?;
        Some(format!("it is the change of {name} from row to row{}", times(line)))
    })
}

pub(super) fn all(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().copied().map(Some).collect()
}

/// The values `shift` rows earlier, within the episode.
fn shifted(values: &[f64], course: &Course, shift: isize) -> Vec<Option<f64>> {
    let ages = course.ages();
    let at = |row: usize| {
        let from = row.checked_add_signed(-shift)?;
        let (age, age_from) = (*ages.get(row)?, *ages.get(from)?);
        // rows of one episode: as far apart in age as in the log
        (age.checked_add_signed(-shift)? == age_from)
            .then(|| values.get(from).copied())
            .flatten()
    };
    (0..values.len()).map(at).collect()
}

/// ` times 2 plus 3`, or nothing for the line through itself.
fn times(line: Line) -> String {
    let mut text = String::new();
    if line.s != 1.0 {
        text += &format!(" times {}", number(line.s));
    }
    if line.o != 0.0 {
        text += &format!(" plus {}", number(line.o));
    }
    text
}

pub(super) fn affine(line: Line, name: &str) -> String {
    let mut text = match line.s {
        1.0 => name.to_owned(),
        s => format!("{} * ({name})", number(s)),
    };
    if line.o != 0.0 {
        text += &format!(" {} {}", if line.o < 0.0 { '-' } else { '+' }, number(line.o.abs()));
    }
    text
}

/// With the digits that a log carries.
pub(super) fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    match rounded.abs() {
        size if size != 0.0 && !(1e-4..1e7).contains(&size) => format!("{rounded:e}"),
        _ => rounded.to_string(),
    }
}
