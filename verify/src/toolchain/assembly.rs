//! Builds with the loops of the network in assembly: the same sources, another switch.

use codegen::Language;
use policy::Policy;
use targets::TargetSpec;

use super::Build;
use crate::session::Files;

impl Build {
    /// This build with the loops in assembly; nothing where the generated files have none.
    pub fn with_assembly(&self, policy: &Policy, target: &TargetSpec, files: &Files) -> Option<Build> {
        let (word, flags) = switch(policy, self.language());
        let has_word = || files.values().any(|text| text.contains(&word));
        (target.has_float_assembly && has_word()).then(|| Build {
            extra: flags,
            ..self.clone()
        })
    }
}

/// The word by which generated files ask for it, and the flags that answer.
fn switch(policy: &Policy, language: Language) -> (String, Vec<String>) {
    match language {
        Language::C => {
            let name = format!("{}_ASSEMBLY", policy.name.to_uppercase());
            (format!("defined({name})"), vec![format!("-D{name}")])
        }
        Language::Rust => {
            let cfg = "policyc_assembly".to_owned();
            (cfg.clone(), vec!["--cfg".to_owned(), cfg])
        }
    }
}
