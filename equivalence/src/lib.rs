//! Shows by SMT that the emitted C and Rust do what the contract says.

mod c;
mod choices;
mod comparison;
mod emitted;
mod facts;
mod float;
mod goal;
mod goals;
mod guards;
mod helpers;
mod limited;
mod machine;
mod refusal;
mod run;
mod rust;
mod simplify;
mod smt;
mod solver;
mod spec;
mod term;
mod truths;
mod under;

use policy::Policy;

pub use goal::Goal;
pub use refusal::Refusal;
pub use run::{Claim, Options, Verdict, run};
pub use solver::Solver;

use emitted::Emitted;
use spec::Spec;
use term::Terms;

/// A file of the emitted code.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Name, for messages.
    pub name: &'a str,
    /// Its text.
    pub text: &'a str,
}

/// The emitted code that is judged; what is `None` has no goals.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sources<'a> {
    /// Header and source of the C core.
    pub c: Option<(Source<'a>, Source<'a>)>,
    /// How the C is read, one set of goals each.
    pub readings: &'a [Reading],
    /// The Rust core.
    pub rust: Option<Source<'a>>,
}

/// Who reads the C: one text holds what a compiler sees, and what Frama-C sees in the place of masks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// A compiler with the extensions of GNU, on a processor without vectors; its goals are called `c.`
    Compiler,
    /// Frama-C, as `policyc prove` runs it: the portable text, with branches; its goals are called `eva.`
    FramaC,
}

/// All goals of a policy and its emitted code.
///
/// # Errors
/// Code that is outside of the subset that is read: nothing is claimed then.
pub fn goals(policy: &Policy, sources: &Sources<'_>) -> Result<Vec<Goal>, Refusal> {
    let terms = Terms::default();
    let spec = Spec::new(policy, &terms);
    // all texts are read before a goal is written: what is refused costs little
    let mut readers: Vec<Box<dyn Emitted + '_>> = Vec::new();
    if let Some((header, source)) = sources.c {
        for &reading in sources.readings {
            let files = ((header.name, header.text), (source.name, source.text));
            let unit = c::Unit::read(files.0, files.1, &c::defined(reading, policy))?;
            readers.push(Box::new(c::C { spec, unit, reading }));
        }
    }
    if let Some(source) = sources.rust {
        let unit = rust::Unit::read(source.name, source.text)?;
        readers.push(Box::new(rust::Rust { spec, unit }));
    }
    let mut all = facts::goals(spec);
    for emitted in &readers {
        all.extend(of(spec, emitted.as_ref())?);
    }
    Ok(all)
}

fn of(spec: Spec<'_>, emitted: &dyn Emitted) -> Result<Vec<Goal>, Refusal> {
    let mut all = helpers::goals(spec, emitted)?;
    all.extend(goals::of(spec, emitted)?);
    Ok(all)
}
