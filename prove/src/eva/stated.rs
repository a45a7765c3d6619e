//! What a driver claims, in words and by labels of its checks.

/// A sentence about an entry, under the label of its checks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stated {
    /// Start of the labels of all checks that together are this claim.
    pub label: &'static str,
    /// The sentence.
    pub text: String,
    /// It is checked where numbers are finite, and only there.
    pub is_finite_only: bool,
}

/// What `Writer::command` checks.
pub(super) fn command_claims(finite_only: bool) -> Vec<Stated> {
    vec![
        stated("duty", "The duty is a number within its limits, or the fallback."),
        Stated {
            is_finite_only: finite_only,
            ..stated(
                "chosen",
                "The chosen duty lies between the least and the largest of all duties, or is the fallback.",
            )
        },
        stated("action", "The action index is below the number of actions."),
        stated("status", "No bit of the status is set that has no meaning."),
    ]
}

pub(super) fn stated(label: &'static str, text: impl Into<String>) -> Stated {
    Stated {
        label,
        text: text.into(),
        is_finite_only: false,
    }
}
