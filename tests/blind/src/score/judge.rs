//! One diagnosis against the truth of its case.

use crate::case::{Hidden, Truth};
use crate::plan::Kind;
use crate::score::diagnosis::{Cause, Diagnosis, Verdict};

/// From this distance on, in units of the noise's variance, an effect has to be seen (5.5 standard deviations).
pub const VISIBLE: f64 = 30.0;
/// What one or two listed causes must leave before an unlisted effect has to be called unexplained.
const KNOWABLE: f64 = 100.0;
/// A held-out record counts for the gain from this share of reducible error to noise on.
const WORTH: f64 = 0.3;
/// Causes that a diagnosis may have added and that are right for an effect of nobody's list.
const SAME: [(&str, &[&str]); 4] = [
    ("slow_turn_off", &["turn_off_delay", "node_capacitance"]),
    ("magnetic_hysteresis", &["core_loss"]),
    ("load_cable", &["cable"]),
    ("line_ripple", &["input_ripple"]),
];

/// What a case says about a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Kind of the case; a single effect too small to be seen counts as small.
    pub kind: Kind,
    /// What was hidden.
    pub hidden: Vec<String>,
    /// What was named, each with its rivals.
    pub named: Vec<String>,
    /// The verdict.
    pub verdict: Verdict,
    /// Something is claimed that is not there.
    pub false_alarm: bool,
    /// The first cause, or its tie, is a hidden one.
    pub right_first: bool,
    /// Every named cause is a hidden one or in a tie with one.
    pub nothing_wrong: bool,
    /// Named causes that are right, and named causes.
    pub precise: (usize, usize),
    /// Visible hidden causes that are named, and visible hidden causes.
    pub recalled: (usize, usize),
    /// A cause that the data cannot tell from a hidden one is named without naming the hidden one.
    pub wrong_member: bool,
    /// Errors of parameters of separable causes.
    pub parameters: Vec<ParameterError>,
    /// Share of the reducible error removed, for each held-out record that has one.
    pub removed: Vec<f64>,
    /// Error after over before, worst held-out record.
    pub worst_ratio: f64,
    /// The data show that no listed cause explains them.
    pub knowable: bool,
    /// Called unexplained, or a right answer of the diagnosis' own: the same cause by its name, wrong samples left out.
    pub unexplained: bool,
}

/// A found value against the hidden one.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterError {
    /// Cause and name.
    pub name: String,
    /// Error over what is allowed; none where no bound is set.
    pub of_bound: Option<f64>,
    /// The interval holds the hidden value.
    pub covered: bool,
}

/// Compares.
#[must_use]
pub fn judge(truth: &Truth, diagnosis: &Diagnosis) -> Judgement {
    let visible = truth.chi2 >= VISIBLE;
    let kind = match truth.kind {
        Kind::Single | Kind::Pair if !visible => Kind::Small,
        kind => kind,
    };
    let hidden: Vec<&str> = truth.effects.iter().map(|hidden| hidden.id.as_str()).collect();
    let is_right = |cause: &Cause| covers(cause, &hidden, truth);
    let causes = &diagnosis.causes;
    let right = causes.iter().filter(|cause| is_right(cause)).count();
    let wanted = || truth.effects.iter().filter(|effect| must_be_found(effect, truth));
    let found = wanted().filter(|effect| causes.iter().any(|cause| covers(cause, &[&effect.id], truth)));
    let quiet = diagnosis.verdict == Verdict::Consistent && causes.is_empty();
    // wrong samples that were named are an answer
    let left_out = hidden == ["outlier_burst"] && causes.is_empty() && !diagnosis.noise.outliers.is_empty();
    let (removed, worst_ratio) = gains(truth, diagnosis);
    Judgement {
        kind,
        false_alarm: match kind {
            Kind::None => !quiet,
            Kind::Small => !quiet && right < causes.len().max(1),
            _ => false,
        },
        right_first: causes.first().is_some_and(is_right),
        nothing_wrong: right == causes.len(),
        precise: (right, causes.len()),
        recalled: (found.count(), wanted().count()),
        wrong_member: causes.iter().any(|cause| !is_right(cause) && is_rival(cause, truth)),
        parameters: parameter_errors(truth, diagnosis),
        removed,
        worst_ratio,
        knowable: truth.chi2_listed >= KNOWABLE,
        unexplained: diagnosis.verdict == Verdict::Unexplained || (kind == Kind::Unlisted && (right > 0 || left_out)),
        verdict: diagnosis.verdict,
        hidden: hidden.iter().map(|id| (*id).to_owned()).collect(),
        named: causes.iter().map(shown).collect(),
    }
}

/// The cause, or one of its rivals, is among `hidden`.
fn covers(cause: &Cause, hidden: &[&str], truth: &Truth) -> bool {
    let all: Vec<&str> = truth.effects.iter().map(|effect| effect.id.as_str()).collect();
    let same = |id: &str| {
        let own = hidden.iter().filter_map(|h| SAME.iter().find(|(name, _)| name == h));
        hidden.contains(&id) || own.into_iter().any(|(_, others)| others.contains(&id))
    };
    // a rival that needs more than what is hidden is another explanation
    let as_rival = cause.rivals.iter().map(|rival| rival.ids());
    same(&cause.id)
        || as_rival.into_iter().any(|ids| {
            let inside = ids.iter().all(|id| all.contains(&id.as_str()) || same(id));
            inside && ids.iter().any(|id| same(id))
        })
}

/// The data do not tell the cause from a hidden one.
fn is_rival(cause: &Cause, truth: &Truth) -> bool {
    truth.explanations.iter().any(|set| set.contains(&cause.id))
}

/// Visible, and not to be had from the other hidden cause alone.
fn must_be_found(effect: &Hidden, truth: &Truth) -> bool {
    let without = |set: &Vec<String>| {
        set.iter().all(|id| truth.effects.iter().any(|other| other.id == *id)) && !set.contains(&effect.id)
    };
    effect.listed && effect.chi2 >= VISIBLE && !truth.explanations.iter().any(without)
}

fn shown(cause: &Cause) -> String {
    let rivals: Vec<String> = cause.rivals.iter().map(|rival| rival.ids().join("+")).collect();
    match rivals.is_empty() {
        true => cause.id.clone(),
        false => format!("{} ~ {}", cause.id, rivals.join(" ~ ")),
    }
}

/// Errors of what was named without a rival and cannot have one.
fn parameter_errors(truth: &Truth, diagnosis: &Diagnosis) -> Vec<ParameterError> {
    let mut errors = Vec::new();
    for effect in truth
        .effects
        .iter()
        .filter(|effect| effect.listed && effect.chi2 >= VISIBLE)
    {
        let tied = truth.explanations.iter().any(|set| !set.contains(&effect.id));
        let named = diagnosis.causes.iter().find(|cause| cause.id == effect.id);
        let Some(cause) = named.filter(|cause| !tied && cause.rivals.is_empty()) else {
            continue;
        };
        for (name, estimate) in &cause.parameters {
            let Some(value) = effect.parameters.get(name).map(|hidden| hidden.value) else {
                continue;
            };
            let bound = bound(&effect.id, name, value);
            errors.push(ParameterError {
                name: format!("{} {name}", effect.id),
                of_bound: bound.map(|bound| (estimate.value - value).abs() / bound),
                covered: estimate.low.unwrap_or(f64::NEG_INFINITY) <= value
                    && value <= estimate.high.unwrap_or(f64::INFINITY),
            });
        }
    }
    errors
}

/// Largest error that a parameter may have, in its unit: L and C 1 %, resistance 5 %, ESR 10 %, delays 5 us, gains 0.2 %,
/// offsets 0.1 V and 0.02 A.
fn bound(id: &str, name: &str, value: f64) -> Option<f64> {
    match (id, name) {
        ("l_wrong" | "c_wrong", _) => Some(0.01 * value),
        ("dcr" | "r_ds_on" | "source_impedance", _) => Some(0.05 * value),
        ("esr", _) => Some(0.1 * value),
        ("dead_time" | "turn_on_delay" | "sampling_delay", _) => Some(5e-6),
        ("v_gain" | "i_gain" | "load_gain", _) => Some(2e-3),
        ("v_offset", _) => Some(0.1),
        ("i_offset", _) => Some(0.02),
        _ => None,
    }
}

/// Shares of the reducible error removed, and the worst ratio of error after to before.
fn gains(truth: &Truth, diagnosis: &Diagnosis) -> (Vec<f64>, f64) {
    let (mut removed, mut worst) = (Vec::new(), 0.0_f64);
    for line in diagnosis.gain.heldout.iter().filter(|line| line.regime == "all") {
        worst = worst.max(line.rmse_after / line.rmse_before.max(1e-12));
        let column = match (&line.channel, line.unit.as_str()) {
            (Some(channel), _) => channel.as_str(),
            (None, "V") => "v_o",
            (None, "A") => "i_l",
            _ => continue,
        };
        let file = line.record.rsplit('/').next().unwrap_or_default();
        let stem = |path: &str| {
            path.rsplit('/')
                .next()
                .unwrap_or_default()
                .trim_end_matches(".csv")
                .to_owned()
        };
        let known = truth.records.iter().find(|known| {
            known.record.starts_with("heldout/") && stem(&known.record) == stem(file) && known.column == column
        });
        let Some(known) = known.filter(|known| known.reducible >= WORTH * known.floor) else {
            continue;
        };
        removed.push((line.rmse_before - line.rmse_after) / (line.rmse_before - known.floor));
    }
    (removed, worst)
}
