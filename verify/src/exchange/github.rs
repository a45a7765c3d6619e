//! Workflow commands of GitHub Actions: a line on standard output that the service shows beside the line of a change.

use crate::cases::Case;

/// A line for each case that does not hold.
#[must_use]
pub fn annotations(cases: &[Case]) -> Vec<String> {
    let failed = cases.iter().filter_map(|case| Some((case, case.failure()?)));
    let line = |(case, found): (&Case, &str)| {
        let words = [case.name.as_str(), found].join(": ");
        error(&case.file, case.line, &words)
    };
    failed.map(line).collect()
}

/// The line that marks one of a file.
#[must_use]
pub fn error(file: &str, line: usize, message: &str) -> String {
    format!(
        "::error file={},line={line},title=policyc::{}",
        property(file),
        data(message)
    )
}

/// A message: whatever ends a line would end the command.
fn data(text: &str) -> String {
    // the per cent sign first: it begins the others
    let text = text.replace('%', "%25");
    let text = text.replace('\r', "%0D").replace('\n', "%0A");
    text.replace(char::is_control, "\u{fffd}")
}

/// A value before the message: commas and colons part values, too.
fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::tests::cases;

    #[test]
    fn a_failed_case_is_one_line_at_its_place_and_others_are_none() {
        assert_eq!(
            annotations(&cases()),
            [
                "::error file=gen%2C new/a b.c,line=7,title=policyc::a b.c: 50 %25 of `a < b && \"c|d\"`,%0Athen:\u{fffd}[31m"
            ]
        );
    }
}
