//! How a run ended.

/// How a run ended; the number is the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done; for `verify`: everything equal.
    Done = 0,
    /// `verify`: something differs; `train`: the specification is missed; `diagnose`: a channel of the records was not read.
    Different = 1,
    /// Ended by a signal; what was done so far is kept.
    Interrupted = 130,
}
