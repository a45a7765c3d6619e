//! Why a loop could not be closed or saved.

/// Faults of the plant, a saved plant that is damaged or of another version, or a controller and a plant that do not fit
/// together.
pub type Error = toml_input::Faults;

/// The error of a library that knows nothing of input files.
pub(crate) fn told(error: impl std::fmt::Display) -> Error {
    toml_input::Message::new(error.to_string()).into()
}
