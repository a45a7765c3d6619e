//! What a driver claims, in words and by labels of its checks.

use policy::DutyPath;

/// A sentence about an entry, under the label of its checks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stated {
    /// Start of the labels of all checks that together are this claim.
    pub label: String,
    /// What the claim is called: the label, or with several outputs that of the check and the output.
    pub name: String,
    /// The sentence.
    pub text: String,
    /// It is checked where numbers are finite, and only there.
    pub is_finite_only: bool,
}

impl Stated {
    /// The same, claimed of finite numbers alone.
    pub fn finite_only(self, is_finite_only: bool) -> Self {
        Self { is_finite_only, ..self }
    }
}

pub(super) fn stated(label: &str, text: impl Into<String>) -> Stated {
    Stated {
        label: label.to_owned(),
        name: label.to_owned(),
        text: text.into(),
        is_finite_only: false,
    }
}

/// A sentence about one output, which stands in it where `{}` is.
pub(super) fn stated_of(label: &str, output: (usize, &DutyPath<'_>), text: &str) -> Stated {
    let (of, name) = match output.1.name {
        Some(name) => (format!(" of the output `{name}`"), format!("{label}.{name}")),
        None => (String::new(), label.to_owned()),
    };
    Stated {
        name,
        ..stated(&label_of(label, output), text.replace("{}", &of))
    }
}

/// Label of a check about one output: numbered, for a name may be the start of another one.
pub(super) fn label_of(label: &str, (index, path): (usize, &DutyPath<'_>)) -> String {
    match path.name {
        Some(_) => format!("{label}_{index}"),
        None => label.to_owned(),
    }
}
