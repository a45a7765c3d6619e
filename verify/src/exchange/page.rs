//! A page to show: what was compared, and what differs.

use report::{Cell, Page, ReportError, Section, Table, Verdict as Colour};

use crate::cases::{Case, Kind, Verdict};

pub(super) fn text(policy: &str, cases: &[Case]) -> Result<String, ReportError> {
    let count = |of: fn(&Verdict) -> bool| cases.iter().filter(|case| of(&case.verdict)).count();
    let failed = count(|verdict| matches!(verdict, Verdict::Failed(_)));
    let passed = count(|verdict| *verdict == Verdict::Passed);
    let skipped = cases.len() - failed - passed;
    let (colour, word) = match (failed, passed) {
        (0, 0) => (Colour::Warn, "nothing compared"),
        (0, _) => (Colour::Pass, "equal"),
        _ => (Colour::Fail, "different"),
    };
    let mut sentence = format!("Comparisons that hold: {passed} of {}.", passed + failed);
    if skipped > 0 {
        sentence.push_str(&format!(" {skipped} could not be made here."));
    }
    let mut page = Page::new(format!("{policy}: is the code what the policy says?")).verdict_as(colour, word, sentence);
    for kind in Kind::ALL {
        let own: Vec<&Case> = cases.iter().filter(|case| case.kind == kind).collect();
        if !own.is_empty() {
            page = page.section(section(kind, &own));
        }
    }
    page.html()
}

fn section(kind: Kind, own: &[&Case]) -> Section {
    let mut table = Table::new("").text("what").text("verdict").text("where").text("found");
    let mut found = Section::new("What was found");
    let mut has_long = false;
    for case in own {
        let (word, text) = match &case.verdict {
            Verdict::Passed => ("holds", ""),
            Verdict::Skipped(reason) => ("not tried", reason.as_str()),
            Verdict::Failed(found) => ("DIFFERENT", found.as_str()),
        };
        // what spans lines is laid out, and stands below the table
        let is_long = text.contains('\n');
        let short = if is_long { "see below" } else { text };
        let name = if case.name.is_empty() { "all files" } else { &case.name };
        let place = match case.verdict {
            Verdict::Failed(_) => format!("{}:{}", case.file, case.line),
            _ => case.file.trim_end_matches('/').to_owned(),
        };
        table = table.row([name, word, &place, short].map(Cell::from));
        if is_long {
            has_long = true;
            found = found.text(format!("{name}:")).code(text);
        }
    }
    let claim = kind.claim();
    let heading = claim.get(..1).unwrap_or_default().to_uppercase() + claim.get(1..).unwrap_or_default();
    let section = Section::new(heading).table(table);
    if has_long { section.details(found) } else { section }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::tests::cases;

    #[test]
    fn the_page_says_what_differs_and_where() {
        let text = text("buck", &cases()).expect("a page");
        assert!(
            text.contains("different") && text.contains("Comparisons that hold: 1 of 2. 1 could not be made here.")
        );
        assert!(
            text.contains("gen, new/a b.c:7")
                && text.contains("a &lt; b &amp;&amp;")
                && text.contains("clang is not installed")
        );
    }

    #[test]
    fn where_nothing_was_compared_nothing_is_equal() {
        let text = text("buck", &cases()[1..2]).expect("a page");
        assert!(text.contains("nothing compared") && !text.contains("verdict pass"));
    }
}
