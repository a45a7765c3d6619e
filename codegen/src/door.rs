//! Doors: what `compile` can put beside the core so that it gets into a tool or onto a board of the user.

use crate::backend::fmu::Fmi;
use crate::backend::kit::Material;
use crate::{CodegenError, GeneratedFiles, Program, backend};

/// A way into a tool or onto a board. Every door brings the C core along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Door {
    /// Back-to-back test program for the user's own compiler and board.
    Kit,
    /// Simulink S-function, also for dSPACE RTI.
    Sfunction,
    /// Functional mock-up unit for co-simulation, FMI 2.0.
    Fmu2,
    /// The same, FMI 3.0.
    Fmu3,
}

impl Door {
    /// All doors in the order of the help text.
    pub const ALL: [Door; 4] = [Door::Kit, Door::Sfunction, Door::Fmu2, Door::Fmu3];

    /// Name on the command line and in the manifest.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Door::Kit => "kit",
            Door::Sfunction => "sfunction",
            Door::Fmu2 => "fmu2",
            Door::Fmu3 => "fmu3",
        }
    }

    /// The version of FMI, if this door is an FMU.
    #[must_use]
    pub fn fmi(self) -> Option<Fmi> {
        match self {
            Door::Kit | Door::Sfunction => None,
            Door::Fmu2 => Some(Fmi::Two),
            Door::Fmu3 => Some(Fmi::Three),
        }
    }

    /// The door of that name.
    #[must_use]
    pub fn find(name: &str) -> Option<Door> {
        Door::ALL.into_iter().find(|door| door.name() == name)
    }

    /// The files of this door; `material` is what [`Door::Kit`] compares with.
    ///
    /// # Errors
    /// For a fault in the compiler itself, or the kit without material.
    pub fn emit(self, program: &Program, material: Option<&Material>) -> Result<GeneratedFiles, CodegenError> {
        match self {
            Door::Sfunction => backend::sfunction::emit(program),
            Door::Fmu2 => backend::fmu::emit(program, Fmi::Two),
            Door::Fmu3 => backend::fmu::emit(program, Fmi::Three),
            Door::Kit => match material {
                Some(material) => backend::kit::emit(program, material),
                None => Err(CodegenError::Door("the kit has no expected values")),
            },
        }
    }
}
