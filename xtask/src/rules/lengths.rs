//! Files of up to about 500 lines, functions of up to about 80, templates of up to 150.

use std::path::Path;

use super::{Findings, source};

const FILE_WARN: usize = 500;
const FILE_FAIL: usize = 600;
const FUNCTION_WARN: usize = 80;
/// A template is fixed text and layout: a longer one holds more than one idea.
const TEMPLATE_LINES: usize = 150;

/// Folders of generated text: its length is the policy's business.
const GENERATED: &[&str] = &["golden", "generated"];

pub fn check(path: &Path, text: &str, findings: &mut Findings) {
    if path.iter().any(|part| GENERATED.iter().any(|g| part == *g)) {
        return;
    }
    let shown = path.display();
    let lines = text.lines().count();
    if path.extension().is_some_and(|extension| extension == "jinja") && lines > TEMPLATE_LINES {
        findings.faults.push(format!(
            "{shown}: template of {lines} lines, more than {TEMPLATE_LINES}; split it by idea"
        ));
    }
    if path.extension().is_none_or(|extension| extension != "rs") {
        return;
    }
    if lines > FILE_FAIL {
        findings
            .faults
            .push(format!("{shown}: {lines} lines, more than {FILE_FAIL}"));
    } else if lines > FILE_WARN {
        findings
            .warnings
            .push(format!("{shown}: {lines} lines, more than {FILE_WARN}"));
    }
    for function in source::functions(&source::mask(text)) {
        if function.lines > FUNCTION_WARN {
            findings.warnings.push(format!(
                "{shown}:{}: fn {} has {} lines, more than {FUNCTION_WARN}",
                function.line, function.name, function.lines
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(path: &str, text: &str) -> Findings {
        let mut findings = Findings::default();
        check(Path::new(path), text, &mut findings);
        findings
    }

    #[test]
    fn a_file_over_500_lines_warns_and_over_600_fails() {
        let judged = judge("policy/src/a.rs", &"\n".repeat(500));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (0, 0));
        let judged = judge("policy/src/a.rs", &"\n".repeat(501));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (0, 1));
        let judged = judge("policy/src/a.rs", &"\n".repeat(601));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (1, 0));
    }

    #[test]
    fn generated_and_other_files_may_be_long() {
        for path in ["tests/golden/a.rs", "docs/a.md"] {
            let judged = judge(path, &"\n".repeat(1000));
            assert_eq!((judged.faults.len(), judged.warnings.len()), (0, 0));
        }
    }

    #[test]
    fn a_function_over_80_lines_warns_with_its_place() {
        let text = format!("\nfn long() {{{}}}\n", "\n".repeat(80));
        let judged = judge("policy/src/a.rs", &text);
        assert_eq!(
            judged.warnings,
            ["policy/src/a.rs:2: fn long has 81 lines, more than 80"]
        );
    }

    #[test]
    fn a_template_over_150_lines_fails() {
        let judged = judge("templates/src/c/source.c.jinja", &"\n".repeat(150));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (0, 0));
        let judged = judge("templates/src/c/source.c.jinja", &"\n".repeat(151));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (1, 0));
    }
}
