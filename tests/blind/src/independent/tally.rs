//! The score of a set by family, as Markdown and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::json as value;

use crate::independent::intervals::{self, Told};
use crate::independent::judge::{Judgement, Outcome};
use crate::independent::truth::Family;
use crate::score::{interval, median};

fn share(hits: usize, of: usize) -> String {
    if of == 0 {
        return "none".to_owned();
    }
    let (low, high) = interval(hits, of);
    let percent = 100.0 * hits as f64 / of as f64;
    format!(
        "{hits} of {of}, {percent:.0} % ({:.0} to {:.0} %)",
        100.0 * low,
        100.0 * high
    )
}

/// Cases of a family that the program took on: a refused topology is counted apart.
fn of_family(judged: &[(usize, Judgement)], family: Family) -> (Vec<&Judgement>, usize) {
    let all: Vec<&Judgement> = judged
        .iter()
        .map(|(_, judgement)| judgement)
        .filter(|j| j.family == family)
        .collect();
    let taken: Vec<&Judgement> = all
        .iter()
        .filter(|judgement| judgement.outcome != Outcome::NoSuchTopology)
        .copied()
        .collect();
    let refused = all.len() - taken.len();
    (taken, refused)
}

fn count(cases: &[&Judgement], outcome: Outcome) -> usize {
    cases.iter().filter(|judgement| judgement.outcome == outcome).count()
}

/// Markdown.
#[must_use]
pub fn markdown(seed: u64, judged: &[(usize, Judgement)]) -> String {
    let mut text = format!("# Score of seed {seed}, {} cases\n\n", judged.len());
    text.push_str(
        "| family | right (95 %, Clopper-Pearson) | one of two | wrong beside | tie not said | wrongly unexplained | missed | wrong among several | \
         confident and wrong | fault not named | refused | topology refused |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for family in Family::ALL {
        let (cases, topology) = of_family(judged, family);
        let _ = write!(
            text,
            "| {} | {} ",
            family.word(),
            share(count(&cases, Outcome::Right), cases.len())
        );
        for outcome in [
            Outcome::OneOfTwo,
            Outcome::RightAndWrong,
            Outcome::TieUnsaid,
            Outcome::Withheld,
            Outcome::Missed,
            Outcome::WrongAmongSeveral,
            Outcome::ConfidentAndWrong,
            Outcome::NotNamed,
        ] {
            let _ = write!(text, "| {} ", count(&cases, outcome));
        }
        let refused = count(&cases, Outcome::Refused) + count(&cases, Outcome::Broken);
        let _ = writeln!(text, "| {refused} | {topology} |");
    }
    totals(&mut text, judged);
    verdicts(&mut text, judged);
    list(&mut text, judged);
    text
}

fn totals(text: &mut String, judged: &[(usize, Judgement)]) {
    let all: Vec<&Judgement> = judged
        .iter()
        .map(|(_, j)| j)
        .filter(|j| j.outcome != Outcome::NoSuchTopology)
        .collect();
    let (healthy, _) = of_family(judged, Family::Healthy);
    let alarms = healthy.iter().filter(|judgement| judgement.false_alarm).count();
    let _ = writeln!(text, "\n- False alarms: {}.", share(alarms, healthy.len()));
    let _ = writeln!(
        text,
        "- Confident and wrong, all families: {}.",
        share(count(&all, Outcome::ConfidentAndWrong), all.len())
    );
    let withheld = all
        .iter()
        .filter(|j| matches!(j.family, Family::Cause | Family::Disturbed | Family::Pair));
    let withheld: Vec<&Judgement> = withheld.copied().collect();
    let _ = writeln!(
        text,
        "- Wrongly unexplained, of listed causes: {}.",
        share(count(&withheld, Outcome::Withheld), withheld.len())
    );
    for family in [Family::Cause, Family::Disturbed, Family::Unlisted, Family::Pair] {
        let removed: Vec<f64> = of_family(judged, family)
            .0
            .iter()
            .flat_map(|j| j.removed.clone())
            .collect();
        let mean = removed.iter().map(|share| share.max(-1.0)).sum::<f64>() / removed.len().max(1) as f64;
        let _ = writeln!(
            text,
            "- Reducible held-out error removed, {}: {} columns, median {:.2}, mean {mean:.2} (a share below -1 counts as -1).",
            family.word(),
            removed.len(),
            median(&removed)
        );
    }
    let told: Vec<&Told> = all.iter().flat_map(|judgement| &judgement.told).collect();
    let held = told.iter().filter(|one| one.holds).count();
    let outside = match intervals::outside(&told) {
        none if none.is_empty() => none,
        some => format!("; outside: {some}"),
    };
    let _ = writeln!(
        text,
        "- 95 % intervals of named causes that hold the hidden value: {}{outside}.",
        share(held, told.len())
    );
    let seconds: Vec<f64> = all.iter().map(|judgement| judgement.seconds).collect();
    let worst = seconds.iter().copied().fold(0.0, f64::max);
    let _ = writeln!(
        text,
        "- Processor's time: median {:.1} s, worst {worst:.1} s.",
        median(&seconds)
    );
}

fn verdicts(text: &mut String, judged: &[(usize, Judgement)]) {
    let words = [
        "consistent",
        "explained",
        "ambiguous",
        "mostly_explained",
        "unexplained",
        "refused",
        "none",
    ];
    let _ = writeln!(text, "\n| family | {} | median s | worst s |", words.join(" | "));
    let _ = writeln!(text, "|---|{}---|---|", "---|".repeat(words.len()));
    for family in Family::ALL {
        let (cases, _) = of_family(judged, family);
        let _ = write!(text, "| {} ", family.word());
        for word in words {
            let _ = write!(
                text,
                "| {} ",
                cases.iter().filter(|judgement| judgement.verdict == word).count()
            );
        }
        let seconds: Vec<f64> = cases.iter().map(|judgement| judgement.seconds).collect();
        let worst = seconds.iter().copied().fold(0.0, f64::max);
        let _ = writeln!(text, "| {:.1} | {worst:.1} |", median(&seconds));
    }
}

fn list(text: &mut String, judged: &[(usize, Judgement)]) {
    text.push_str(
        "\n| case | family | converter | hidden | verdict | named | judged | s |\n|---|---|---|---|---|---|---|---|\n",
    );
    for (case, j) in judged {
        let _ = writeln!(
            text,
            "| {case:03} | {} | {} | {} | {} | {} | {} | {:.1} |",
            j.family.word(),
            j.converter,
            j.hidden.join(", "),
            j.verdict,
            j.named.join(", "),
            j.outcome.word(),
            j.seconds
        );
    }
}

/// JSON: for each family what was counted, and every case.
#[must_use]
pub fn json(seed: u64, judged: &[(usize, Judgement)]) -> String {
    let mut families = serde_json::Map::new();
    for family in Family::ALL {
        let (cases, topology) = of_family(judged, family);
        let mut outcomes: BTreeMap<&str, usize> = BTreeMap::new();
        let mut verdicts: BTreeMap<&str, usize> = BTreeMap::new();
        for judgement in &cases {
            *outcomes.entry(judgement.outcome.word()).or_default() += 1;
            *verdicts.entry(&judgement.verdict).or_default() += 1;
        }
        let right = count(&cases, Outcome::Right);
        let (low, high) = interval(right, cases.len());
        let seconds: Vec<f64> = cases.iter().map(|judgement| judgement.seconds).collect();
        let removed: Vec<f64> = cases.iter().flat_map(|judgement| judgement.removed.clone()).collect();
        let entry = value!({
            "n": cases.len(), "right": right, "low": low, "high": high, "topology_refused": topology,
            "outcomes": outcomes, "verdicts": verdicts,
            "false_alarms": cases.iter().filter(|judgement| judgement.false_alarm).count(),
            "seconds": {"median": median(&seconds), "worst": seconds.iter().copied().fold(0.0, f64::max)},
            "removed": {"columns": removed.len(), "median": median(&removed)},
        });
        families.insert(family.word().to_owned(), entry);
    }
    let cases: Vec<_> = judged
        .iter()
        .map(|(case, judgement)| value!({"case": case, "judged": judgement}))
        .collect();
    let all = value!({"seed": seed, "families": families, "cases": cases});
    format!("{all:#}\n")
}
