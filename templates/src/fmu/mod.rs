//! Files of the FMUs, all made of the same view.

use askama::Template;

use crate::block::BlockView;

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// binary64.
    Real,
    /// 32-bit integer.
    Integer,
    /// Switch.
    Boolean,
}

impl Kind {
    /// End of the C macro.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::Real => "REAL",
            Kind::Integer => "INTEGER",
            Kind::Boolean => "BOOLEAN",
        }
    }

    /// XML element and function suffix in FMI 2.
    #[must_use]
    pub fn fmi2(self) -> &'static str {
        match self {
            Kind::Real => "Real",
            Kind::Integer => "Integer",
            Kind::Boolean => "Boolean",
        }
    }

    /// XML element and function suffix in FMI 3.
    #[must_use]
    pub fn fmi3(self) -> &'static str {
        match self {
            Kind::Real => "Float64",
            Kind::Integer => "Int32",
            Kind::Boolean => "Boolean",
        }
    }
}

/// A variable of the FMU.
#[derive(Debug, Clone)]
pub struct VariableView {
    /// Name, unique; an identifier.
    pub name: String,
    /// Value reference, from 1: also the index in FMI 2.
    pub reference: usize,
    /// Type.
    pub kind: Kind,
    /// `input`, `output` or `parameter`.
    pub causality: &'static str,
    /// Of the same attribute.
    pub variability: &'static str,
    /// Of the same attribute, where it is written.
    pub initial: Option<&'static str>,
    /// Meaning, for a comment.
    pub comment: String,
    /// Meaning, for XML.
    pub description: String,
    /// Unit, bounds and start value as XML attributes, each after a blank.
    pub attributes: String,
    /// Member of the state in C, with its index.
    pub place: String,
    /// Start value in C; `None` for outputs.
    pub start_c: Option<String>,
}

/// A unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitView {
    /// Name, for XML.
    pub name: String,
    /// Attributes of its base unit, if it is known.
    pub base: Option<&'static str>,
}

/// A function of FMI that is refused.
#[derive(Debug, Clone)]
pub struct AbsentView {
    /// Name.
    pub name: String,
    /// Parameters behind the instance, each after a comma.
    pub parameters: String,
    /// Their names.
    pub names: Vec<String>,
    /// Why.
    pub reason: &'static str,
}

/// Names of one version of FMI.
#[derive(Debug, Clone)]
pub struct Api {
    /// `fmi2`
    pub prefix: &'static str,
    /// Type of an instance.
    pub instance: &'static str,
    /// Type of a state without the prefix; part of function names.
    pub state: &'static str,
    /// Spelling of that function.
    pub deserialize: &'static str,
    /// First arguments of `allocate`.
    pub memory: &'static str,
    /// First arguments of `release`.
    pub freed: &'static str,
}

/// What all files of an FMU need.
#[derive(Debug, Clone)]
pub struct FmuView {
    /// The block.
    pub b: BlockView,
    /// Names of the version.
    pub api: Api,
    /// GUID or instantiation token.
    pub token: String,
    /// First word of the token as C text.
    pub signature: String,
    /// Sentence on the FMU, for XML.
    pub description: String,
    /// Tool and version.
    pub tool: &'static str,
    /// Variables by reference.
    pub variables: Vec<VariableView>,
    /// Name of the independent variable.
    pub time: String,
    /// Units in use.
    pub units: Vec<UnitView>,
    /// C files, without folder.
    pub sources: Vec<String>,
    /// Coefficients as an argument of the block, after a comma; empty without.
    pub coefficients: &'static str,
    /// Names of all functions of FMI.
    pub functions: Vec<String>,
    /// Types with a getter and a setter of the usual form.
    pub accessed: &'static [&'static str],
    /// Those of them that no variable has.
    pub without: &'static [&'static str],
    /// Functions that are refused.
    pub absent: Vec<AbsentView>,
}

macro_rules! files {
    ($($(#[$doc:meta])* $name:ident = $path:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Template)]
        #[template(path = $path, escape = "none")]
        pub struct $name<'a> {
            /// The FMU.
            pub f: &'a FmuView,
        }
    )*};
}

files! {
    /// `<name>_fmu.h`
    Header = "fmu/fmu.h.jinja";
    /// `<name>_fmu.c`
    Source = "fmu/fmu.c.jinja";
    /// `<name>_fmi2.h`
    Fmi2Header = "fmu/fmi2.h.jinja";
    /// `<name>_fmi2.c`
    Fmi2Source = "fmu/fmi2.c.jinja";
    /// `<name>_fmi2.xml`
    Fmi2Description = "fmu/fmi2.xml.jinja";
    /// `<name>_fmi3.h`
    Fmi3Header = "fmu/fmi3.h.jinja";
    /// `<name>_fmi3.c`
    Fmi3Source = "fmu/fmi3.c.jinja";
    /// `<name>_fmi3.xml`
    Fmi3Description = "fmu/fmi3.xml.jinja";
    /// `<name>_fmi3_build.xml`
    Fmi3Build = "fmu/fmi3_build.xml.jinja";
}
