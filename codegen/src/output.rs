//! What can be made of a policy, as one list: the row of an output here is its name on the command line, its line in the
//! help text and the core it calls.

/// Language that an output's program is lowered for: the one its compiler reads. A property of an output, never a choice
/// beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Language {
    /// C99 that is also C90 with `stdint.h` and C++.
    C,
    /// `no_std` Rust.
    Rust,
}

impl Language {
    /// Name in the manifest and in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.core().name()
    }

    /// The core in this language.
    #[must_use]
    pub fn core(self) -> Output {
        match self {
            Language::C => Output::C,
            Language::Rust => Output::Rust,
        }
    }
}

/// Writes the enum and its list from the same rows, so that no output can be in one and not in the other.
macro_rules! outputs {
    ($($variant:ident, $name:literal, $language:ident, $meaning:literal;)+) => {
        /// Something that `policyc compile` makes of a policy. The two cores stand alone; every other output calls the core
        /// in its language and brings it along.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Output {
            $(#[doc = $meaning] $variant,)+
        }

        impl Output {
            /// All outputs in the order of the help text and the manifest.
            pub const ALL: &'static [Output] = &[$(Output::$variant),+];

            /// Name on the command line and in the manifest.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Output::$variant => $name,)+ }
            }

            /// What it is, for a help text.
            #[must_use]
            pub fn meaning(self) -> &'static str {
                match self { $(Output::$variant => $meaning,)+ }
            }

            /// Language of the program that it prints or calls.
            #[must_use]
            pub fn language(self) -> Language {
                match self { $(Output::$variant => Language::$language,)+ }
            }
        }
    };
}

outputs! {
    C, "c", C, "the controller in C99 that is also C90 and C++";
    Rust, "rust", Rust, "the controller in no_std Rust";
    RustOverC, "rust-over-c", C, "Rust declarations and types in front of the C core";
    Kit, "kit", C, "C test program with expected bits for your compiler and board";
    Sfunction, "sfunction", C, "Simulink block, also for dSPACE RTI";
    Fmu2, "fmu2", C, "unit for co-simulation, FMI 2.0: sources, and a binary for this machine";
    Fmu3, "fmu3", C, "unit for co-simulation, FMI 3.0: sources, and a binary for this machine";
}

impl Output {
    /// The controllers themselves, one a language.
    pub const CORES: [Output; 2] = [Output::C, Output::Rust];

    /// The output of that name.
    #[must_use]
    pub fn find(name: &str) -> Option<Output> {
        Output::ALL.iter().copied().find(|output| output.name() == name)
    }

    /// Whether it is a controller itself and not something in front of one.
    #[must_use]
    pub fn is_core(self) -> bool {
        self.language().core() == self
    }
}

/// A choice of outputs with the cores that they call: in the order of [`Output::ALL`], each once.
#[must_use]
pub fn with_cores(chosen: &[Output]) -> Vec<Output> {
    let mut all: Vec<Output> = chosen
        .iter()
        .flat_map(|output| [*output, output.language().core()])
        .collect();
    // derived, so in the order of the rows: that of the help text and of the manifest
    all.sort();
    all.dedup();
    all
}

/// The languages of a choice of outputs, each once.
#[must_use]
pub fn languages(chosen: &[Output]) -> Vec<Language> {
    let mut all: Vec<Language> = chosen.iter().map(|output| output.language()).collect();
    all.sort();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_brings_its_core_and_stands_once_whatever_the_order() {
        let chosen = [Output::Fmu2, Output::Rust, Output::Kit, Output::Rust];
        let expected = [Output::C, Output::Rust, Output::Kit, Output::Fmu2];
        assert_eq!(with_cores(&chosen), expected);
        assert_eq!(with_cores(&expected), expected);
        assert_eq!(languages(&chosen), [Language::C, Language::Rust]);
        assert_eq!(languages(&[Output::Kit]), [Language::C]);
    }

    #[test]
    fn names_are_found_again_and_differ() {
        for output in Output::ALL {
            assert_eq!(Output::find(output.name()), Some(*output));
        }
        assert_eq!(Output::find("C"), None);
    }

    #[test]
    fn the_cores_are_the_outputs_that_call_nothing() {
        let cores: Vec<Output> = Output::ALL.iter().copied().filter(|output| output.is_core()).collect();
        assert_eq!(cores, Output::CORES);
    }
}
