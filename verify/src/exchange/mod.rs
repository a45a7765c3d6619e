//! Cases in the forms that other programs read. One file per form.

pub mod github;
mod junit;
mod markdown;
mod page;
mod sarif;

use crate::cases::Case;

/// A form that is a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sheet {
    /// SARIF 2.1.0, which code scanning reads.
    Sarif,
    /// The XML of JUnit, which CI services read.
    Junit,
    /// A table for people.
    Markdown,
    /// A page for people.
    Html,
}

impl Sheet {
    /// All of them.
    pub const ALL: [Sheet; 4] = [Sheet::Sarif, Sheet::Junit, Sheet::Markdown, Sheet::Html];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Sheet::Sarif => "sarif",
            Sheet::Junit => "junit",
            Sheet::Markdown => "markdown",
            Sheet::Html => "html",
        }
    }

    /// The text of the file; `policy` is the policy's name. The head of each says by which program it was written.
    ///
    /// # Errors
    /// Never, in fact: texts can always be written as JSON, and tables of a page have the columns that they say.
    pub fn text(self, policy: &str, cases: &[Case]) -> Result<String, serde_json::Error> {
        Ok(match self {
            Sheet::Sarif => sarif::text(cases)?,
            Sheet::Junit => junit::text(policy, cases),
            Sheet::Markdown => markdown::text(policy, cases),
            Sheet::Html => page::text(policy, cases).map_err(serde::ser::Error::custom)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::cases::{Case, Kind, Verdict};

    /// One of each verdict, with what each form has to escape.
    pub fn cases() -> Vec<Case> {
        let case = |kind, name: &str, file: &str, line, verdict| Case {
            kind,
            name: name.to_owned(),
            file: file.to_owned(),
            line,
            verdict,
        };
        let found = "50 % of `a < b && \"c|d\"`,\nthen:\u{1b}[31m";
        vec![
            case(
                Kind::Drift,
                "a b.c",
                "gen, new/a b.c",
                7,
                Verdict::Failed(found.to_owned()),
            ),
            case(
                Kind::Build,
                "clang -O3",
                "policy/policy.toml",
                1,
                Verdict::Skipped("clang is not installed".to_owned()),
            ),
            case(Kind::Build, "gcc -O2", "policy/policy.toml", 1, Verdict::Passed),
        ]
    }
}
