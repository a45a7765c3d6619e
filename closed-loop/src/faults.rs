//! Why a loop could not be closed or saved.

/// Faults of the plant, a saved plant that is damaged or of another version, or a controller and a plant that do not fit
/// together.
pub type Error = toml_input::Faults;
