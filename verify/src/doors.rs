//! Everything that `policyc compile` writes for a policy, doors included.

use codegen::{Door, Language};
use policy::Policy;
use targets::TargetSpec;

use crate::kit;
use crate::session::{Files, VerifyError};

/// What is to be generated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// Languages of the core.
    pub languages: Vec<Language>,
    /// Doors beside it; they need [`Language::C`].
    pub doors: Vec<Door>,
    /// Control steps in the back-to-back kit.
    pub kit_steps: u32,
}

impl Selection {
    /// The core alone.
    #[must_use]
    pub fn core(languages: &[Language]) -> Self {
        Selection {
            languages: languages.to_vec(),
            doors: Vec::new(),
            kit_steps: kit::DEFAULT_STEPS,
        }
    }
}

/// The selected files and the manifest.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn generate(policy: &Policy, target: &TargetSpec, selection: &Selection) -> Result<Files, VerifyError> {
    let Selection {
        languages,
        doors,
        kit_steps,
    } = selection;
    let needed = doors.contains(&Door::Kit);
    let material = needed.then(|| kit::material(policy, target, *kit_steps)).transpose()?;
    let files = codegen::generate_with_doors(policy, target, languages, doors, material.as_ref());
    Ok(files.map_err(VerifyError::Codegen)?.files)
}
