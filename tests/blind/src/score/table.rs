//! The table of a set of cases, line by line of what is asked for.

use std::fmt::Write;

use crate::plan::Kind;
use crate::score::judge::Judgement;
use crate::score::statistics::{interval, median};

/// A counted share and what is asked of it.
pub(crate) struct Line {
    pub what: &'static str,
    pub hits: usize,
    pub of: usize,
    pub asked: Asked,
}

pub(crate) enum Asked {
    AtLeast(f64),
    Between(f64, f64),
    AtMost(usize),
}

impl Line {
    pub fn text(&self) -> String {
        let (low, high) = interval(self.hits, self.of);
        let share = self.hits as f64 / self.of.max(1) as f64;
        let (asked, met) = match self.asked {
            Asked::AtLeast(least) => (format!(">= {:.0} %", 100.0 * least), share >= least),
            Asked::Between(least, most) => (
                format!("{:.0} to {:.0} %", 100.0 * least, 100.0 * most),
                share >= least && share <= most,
            ),
            Asked::AtMost(most) => (format!("<= {most}"), self.hits <= most),
        };
        let met = if self.of == 0 { "no case" } else { yes(met) };
        format!(
            "| {} | {} of {} | {:.0} % ({:.0} to {:.0} %) | {asked} | {met} |",
            self.what,
            self.hits,
            self.of,
            100.0 * share,
            100.0 * low,
            100.0 * high
        )
    }
}

fn yes(met: bool) -> &'static str {
    if met { "yes" } else { "**no**" }
}

/// Score and cases as Markdown.
#[must_use]
pub fn table(seed: u64, judged: &[(String, Judgement)]) -> String {
    let all: Vec<&Judgement> = judged.iter().map(|(_, judgement)| judgement).collect();
    let mut text = format!("# Score of {} cases, seed {seed}\n\n", judged.len());
    text.push_str("| question | count | share (95 %, Clopper-Pearson) | asked | met |\n|---|---|---|---|---|\n");
    for line in lines(&all) {
        let _ = writeln!(text, "{}", line.text());
    }
    gains(&all, &mut text);
    text.push_str("\n| case | kind | hidden | verdict | named | remarks |\n|---|---|---|---|---|---|\n");
    for (case, judgement) in judged {
        let _ = writeln!(
            text,
            "| {case} | {:?} | {} | {:?} | {} | {} |",
            judgement.kind,
            judgement.hidden.join(", "),
            judgement.verdict,
            judgement.named.join("; "),
            remarks(judgement)
        );
    }
    text
}

fn lines(all: &[&Judgement]) -> Vec<Line> {
    let of = |kinds: &[Kind]| {
        all.iter()
            .filter(|j| kinds.contains(&j.kind))
            .copied()
            .collect::<Vec<_>>()
    };
    let line = |what, among: &[&Judgement], hit: &dyn Fn(&Judgement) -> bool, asked| Line {
        what,
        hits: among.iter().filter(|j| hit(j)).count(),
        of: among.len(),
        asked,
    };
    let (none, single, listed) = (of(&[Kind::None]), of(&[Kind::Single]), of(&[Kind::Single, Kind::Pair]));
    let small = of(&[Kind::Small]);
    let unlisted: Vec<_> = of(&[Kind::Unlisted]).into_iter().filter(|j| j.knowable).collect();
    let causal = of(&[Kind::None, Kind::Small, Kind::Single, Kind::Pair]);
    let sum = |what, pick: &dyn Fn(&Judgement) -> (usize, usize), asked| {
        let (hits, of) = causal
            .iter()
            .map(|j| pick(j))
            .fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        Line { what, hits, of, asked }
    };
    let [parameters, coverage] = sizes(all);
    vec![
        line("no effect: false alarms", &none, &|j| j.false_alarm, Asked::AtMost(0)),
        line(
            "too small an effect: something wrong claimed",
            &small,
            &|j| j.false_alarm,
            Asked::AtMost(0),
        ),
        line(
            "single: right cause or its tie first",
            &single,
            &|j| j.right_first,
            Asked::AtLeast(0.92),
        ),
        line(
            "single: nothing wrong beside it",
            &single,
            &|j| j.nothing_wrong,
            Asked::AtLeast(0.83),
        ),
        sum(
            "precision over causes, pairs included",
            &|j| j.precise,
            Asked::AtLeast(0.85),
        ),
        sum(
            "recall over visible causes, pairs included",
            &|j| j.recalled,
            Asked::AtLeast(0.85),
        ),
        line(
            "a wrong member of a tie called the cause",
            &listed,
            &|j| j.wrong_member,
            Asked::AtMost(0),
        ),
        parameters,
        coverage,
        line(
            "unlisted, knowable: unexplained or a right term",
            &unlisted,
            &|j| j.unexplained,
            Asked::AtLeast(5.0 / 6.0),
        ),
        line(
            "listed: called unexplained",
            &listed,
            &|j| j.unexplained,
            Asked::AtMost(listed.len() / 24 + usize::from(listed.len() < 24)),
        ),
    ]
}

/// How well the sizes of effects are told.
fn sizes(all: &[&Judgement]) -> [Line; 2] {
    let errors: Vec<_> = all.iter().flat_map(|j| &j.parameters).collect();
    let bounded: Vec<f64> = errors.iter().filter_map(|error| error.of_bound).collect();
    let parameters = Line {
        what: "parameters of separable causes within their bounds",
        hits: bounded.iter().filter(|&&error| error <= 1.0).count(),
        of: bounded.len(),
        asked: Asked::AtLeast(1.0),
    };
    let coverage = Line {
        what: "95 % intervals that hold the hidden value",
        hits: errors.iter().filter(|error| error.covered).count(),
        of: errors.len(),
        asked: Asked::Between(0.85, 1.0),
    };
    [parameters, coverage]
}

fn gains(all: &[&Judgement], text: &mut String) {
    let listed = all.iter().filter(|j| matches!(j.kind, Kind::Single | Kind::Pair));
    let removed: Vec<f64> = listed.flat_map(|j| j.removed.iter().copied()).collect();
    let middle = median(&removed);
    let met = if removed.is_empty() {
        "no record"
    } else {
        yes(middle >= 0.8)
    };
    let _ = writeln!(
        text,
        "| held-out, listed: median share of the reducible error removed | {} records | {:.0} % | >= 80 % | {met} |",
        removed.len(),
        100.0 * middle
    );
    let worst = all.iter().map(|j| j.worst_ratio).fold(0.0, f64::max);
    let _ = writeln!(
        text,
        "| held-out, all: worst error after over before | {} cases | {worst:.3} | <= 1.05 | {} |",
        all.len(),
        yes(worst <= 1.05)
    );
}

fn remarks(judgement: &Judgement) -> String {
    let mut words = Vec::new();
    let is_listed = matches!(judgement.kind, Kind::Single | Kind::Pair);
    if judgement.false_alarm {
        words.push("false alarm".to_owned());
    }
    if is_listed && !judgement.right_first {
        words.push("not first".to_owned());
    }
    if is_listed && !judgement.nothing_wrong {
        words.push("wrong beside it".to_owned());
    }
    if is_listed && judgement.recalled.0 < judgement.recalled.1 {
        words.push("not all found".to_owned());
    }
    if judgement.wrong_member {
        words.push("wrong member of a tie".to_owned());
    }
    match (judgement.kind, judgement.unexplained, judgement.knowable) {
        (Kind::Unlisted, false, true) => words.push("not called unexplained".to_owned()),
        (Kind::Unlisted, _, false) => words.push("looks like listed causes".to_owned()),
        (_, true, _) if is_listed => words.push("called unexplained".to_owned()),
        _ => {}
    }
    for error in &judgement.parameters {
        if let Some(of_bound) = error.of_bound.filter(|&of_bound| of_bound > 1.0) {
            words.push(format!("{} off by {of_bound:.1} bounds", error.name));
        }
        if !error.covered {
            words.push(format!("{} outside its interval", error.name));
        }
    }
    if judgement.worst_ratio > 1.05 {
        words.push(format!("held-out error {:.2} times", judgement.worst_ratio));
    }
    words.join("; ")
}
