//! The empirical term: under a heading of its own, apart from causes.

use report::{Section, Table};

use super::records::pictures;
use crate::empirical::Described;

/// What pictures call the model with it.
const NAME: &str = "with the empirical term";

/// What the model of `plant.extended.toml` is called beside the one as given: what causes gain is not the term's. Nothing without
/// either.
pub(super) fn second(has_causes: bool, is_described: bool) -> Option<&'static str> {
    match (has_causes, is_described) {
        (false, false) => None,
        (true, false) => Some("extended"),
        (false, true) => Some(NAME),
        (true, true) => Some("with causes and the empirical term"),
    }
}

/// What it is, what it is worth, and one training record with it.
pub(super) fn section(term: &Described) -> Section {
    let findings = &term.findings;
    let mut section = Section::new("What is left is described, not explained")
        .text(findings.sentence.clone())
        .text(
            "The error in what was left out is too good by a little: it has chosen how many parts the term has, among sets that were \
             ranked by all rows. Held-out records decide only whether the term is written.",
        );
    let mut table = Table::new(
        "Root mean square errors; the initial states are estimated for each model. The fit has seen the training records alone.",
    )
    .text("record")
    .text("channel")
    .text("kind")
    .number("without", 4)
    .number("with", 4)
    .number("noise", 4)
    .text("unit");
    for worth in &findings.errors {
        table = table.row([
            worth.record.clone().into(),
            worth.channel.into(),
            if worth.heldout { "held-out" } else { "training" }.into(),
            worth.rmse_before.into(),
            worth.rmse_after.into(),
            worth.floor.into(),
            worth.unit.into(),
        ]);
    }
    section = section.table(table);
    let mut coefficients = Table::new(
        "Duty that each part adds, at the end of the range of its signals. The numbers imitate something else and measure nothing.",
    )
    .text("coefficient")
    .number("duty", 5);
    for (name, value) in &findings.coefficients {
        coefficients = coefficients.row([(*name).into(), (*value).into()]);
    }
    section = section.details(Section::new("Coefficients").table(coefficients));
    let square = |record: usize| {
        let from = term.problem.offsets[record];
        let to = term
            .problem
            .offsets
            .get(record + 1)
            .copied()
            .unwrap_or(term.before.residual.len());
        term.before.residual[from..to].iter().map(|v| v * v).sum::<f64>()
    };
    let worst = (0..term.problem.records.len())
        .max_by(|a, b| square(*a).total_cmp(&square(*b)))
        .unwrap_or(0);
    let states = [&term.before, &term.after];
    let caption = "The training record that the model misses most.";
    pictures(section, &term.problem, states, worst, Some(NAME), &[], caption)
}

#[cfg(test)]
mod tests {
    use super::{NAME, second};

    #[test]
    fn what_causes_gain_is_not_called_the_term_s() {
        assert_eq!(second(false, true), Some(NAME));
        assert!(second(true, true).is_some_and(|name| name.contains("causes")));
        assert_eq!([second(true, false), second(false, false)], [Some("extended"), None]);
    }
}
