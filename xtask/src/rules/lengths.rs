//! Files of up to about 500 lines, templates of up to 150; clippy counts those of functions.

use std::path::Path;

use super::Findings;

const FILE_WARN: usize = 500;
const FILE_FAIL: usize = 600;
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
    fn a_template_over_150_lines_fails() {
        let judged = judge("templates/src/c/source.c.jinja", &"\n".repeat(150));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (0, 0));
        let judged = judge("templates/src/c/source.c.jinja", &"\n".repeat(151));
        assert_eq!((judged.faults.len(), judged.warnings.len()), (1, 0));
    }
}
