//! The claims for people: lines, and a page.

use policy::NumericFormat;
use report::{Cell, Page, ReportError, Section, Table, Verdict as Colour};

use crate::{Answer, Claim, Verdict};

/// Details of a claim that the terminal shows; the page has all.
const SHOWN: usize = 5;

/// What stands beside every count of claims: a count alone would pass for all that there is.
const BEYOND: &str = "No claim is about the sums of the network's layers, which `policyc verify` compares, or about compilers and \
                      processors, which the kit checks.";

/// The answer in a few lines: how many, what is not proved, and what no claim is about.
#[must_use]
pub fn summary(answer: &Answer) -> String {
    let mut lines = vec![sentence(answer)];
    let mut waiting: Vec<&Claim> = Vec::new();
    for claim in answer.claims.iter().filter(|claim| claim.verdict != Verdict::Proved) {
        let (format, verdict) = (claim.format.name(), claim.verdict.words());
        // what is missing for one claim is missing for all of its prover: one line, with their number
        let is_like = |other: &&Claim| is_idle(claim) && is_idle(other) && reason(other) == reason(claim);
        if waiting.iter().any(is_like) {
            continue;
        }
        waiting.push(claim);
        let text = match answer.claims.iter().filter(is_like).count() {
            0 | 1 => claim.text.clone(),
            count => format!("{count} claims, the first of them: {}", claim.text),
        };
        lines.push(format!("  {verdict} ({format}): {text}"));
        lines.extend((!claim.reason.is_empty()).then(|| format!("    {}", claim.reason)));
        lines.extend(claim.details.iter().take(SHOWN).map(|detail| format!("    {detail}")));
        let left = claim.details.len().saturating_sub(SHOWN);
        lines.extend((left > 0).then(|| format!("    and {left} more, in proof.json")));
    }
    lines.push(BEYOND.to_owned());
    lines.join("\n")
}

fn is_idle(claim: &Claim) -> bool {
    claim.verdict == Verdict::NotRun
}

/// Whose claim it is, and why it was not run.
fn reason(claim: &Claim) -> (&str, NumericFormat, &str) {
    (claim.prover, claim.format, &claim.reason)
}

fn sentence(answer: &Answer) -> String {
    let verdicts = [Verdict::Proved, Verdict::Refuted, Verdict::Unproven, Verdict::NotRun];
    let counts = verdicts
        .into_iter()
        .map(|verdict| (answer.count(verdict), verdict.words()));
    let counts: Vec<String> = counts
        .filter(|(count, _)| *count > 0)
        .map(|(count, words)| format!("{count} {words}"))
        .collect();
    format!(
        "{}: of {} claims {}.",
        answer.policy,
        answer.claims.len(),
        counts.join(", ")
    )
}

/// The whole page as HTML.
///
/// # Errors
/// Never, in fact: its tables have the columns that they say.
pub fn page(answer: &Answer) -> Result<String, ReportError> {
    let colour = match (answer.clears(), answer.proves()) {
        (false, _) => Colour::Fail,
        (true, true) => Colour::Pass,
        (true, false) => Colour::Note,
    };
    let mut page =
        Page::new(format!("{}: what is proved of the code", answer.policy)).verdict(colour, sentence(answer));
    let open: Vec<&Claim> = answer.claims.iter().filter(|claim| is_open(claim)).collect();
    if !open.is_empty() {
        page = page.section(details(&open));
    }
    let mut formats: Vec<NumericFormat> = answer.claims.iter().map(|claim| claim.format).collect();
    formats.dedup();
    for format in formats {
        let own: Vec<&Claim> = answer.claims.iter().filter(|claim| claim.format == format).collect();
        page = page.section(claims(format, &own));
    }
    page.section(provenance(answer)).section(meaning()).html()
}

fn is_open(claim: &Claim) -> bool {
    matches!(claim.verdict, Verdict::Refuted | Verdict::Unproven)
}

/// What stands against a proof.
fn details(open: &[&Claim]) -> Section {
    let mut section = Section::new("Not proved");
    for claim in open {
        let mut lines: Vec<String> = claim.details.clone();
        lines.extend((!claim.reason.is_empty()).then(|| claim.reason.clone()));
        section = section.text(format!(
            "{} ({}): {}",
            claim.verdict.words(),
            claim.format.name(),
            claim.text
        ));
        if !lines.is_empty() {
            section = section.code(lines.join("\n"));
        }
    }
    section
}

fn claims(format: NumericFormat, own: &[&Claim]) -> Section {
    let mut section = Section::new(format!("Claims in {}", format.name()));
    let (idle, run): (Vec<&Claim>, Vec<&Claim>) = own.iter().copied().partition(|claim| is_idle(claim));
    let mut subjects: Vec<&str> = run.iter().map(|claim| claim.subject.as_str()).collect();
    subjects.dedup();
    for subject in subjects {
        let about: Vec<&&Claim> = run.iter().filter(|claim| claim.subject == subject).collect();
        let mut table = Table::new(subject.to_owned())
            .text("verdict")
            .text("claim")
            .number("s", 1);
        for claim in &about {
            table = table.row([
                Cell::Text(claim.verdict.words().to_owned()),
                Cell::Text(claim.text.clone()),
                Cell::Number(claim.seconds),
            ]);
        }
        section = section.table(table);
        let settings = about.first().map(|claim| claim.settings.join("; ")).unwrap_or_default();
        section = section.text(match settings.is_empty() {
            true => String::new(),
            false => format!("Under: {settings}."),
        });
    }
    if !idle.is_empty() {
        let mut table = Table::new("Not run").text("claim").text("why");
        for claim in idle {
            table = table.row([Cell::Text(claim.text.clone()), Cell::Text(claim.reason.clone())]);
        }
        section = section.table(table);
    }
    section
}

fn provenance(answer: &Answer) -> Section {
    let mut tools: Vec<&str> = answer
        .claims
        .iter()
        .map(|claim| claim.tool.as_str())
        .filter(|tool| !tool.is_empty())
        .collect();
    tools.sort_unstable();
    tools.dedup();
    let mut pairs = vec![
        ("generated by", codegen::TOOL.to_owned()),
        ("target", answer.target.to_owned()),
        ("contract, sha256", answer.contract.clone()),
        ("weights, sha256", answer.weights.clone()),
    ];
    pairs.extend(
        answer
            .mapping
            .iter()
            .map(|mapping| ("mapping, sha256", mapping.clone())),
    );
    pairs.extend((!answer.outputs.is_empty()).then(|| ("outputs", answer.outputs.join(", "))));
    pairs.extend(tools.iter().map(|tool| ("tool", (*tool).to_owned())));
    Section::new("What it is about").pairs(pairs)
}

fn meaning() -> Section {
    Section::new("How to read it")
        .text("A claim is proved for every input that it names, not for a sample of them. Claims of one table share the runs that decided them, and their time.")
        .text("The C analysed is the portable text. Where a compiler gets masks, Eva gets branches. Claims that begin with `C:` and with `Eva:` say that both do what the contract says.")
        .text(BEYOND)
        .text("Trusted are the provers, the preprocessor, and that the compiler of the firmware computes binary32 and binary64 as IEEE 754 says.")
}
