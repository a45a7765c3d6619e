//! Level-2 C MEX S-function with what Simulink Coder, Embedded Coder and dSPACE RTI want beside it.

use templates::sfunction::{
    CallerHeader, CallerSource, LegacyCode, Make, Readme, Rtwmakecfg, Source, Tlc, UserMakefile,
};

use super::block;
use super::c::render;
use crate::files::{CodegenError, GeneratedFiles};
use crate::program::Program;

/// The files around the core.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn emit(program: &Program) -> Result<GeneratedFiles, CodegenError> {
    let n = &program.name;
    let title = |what: &str| format!("{what} of controller {n}");
    let source = block::view(program, &title("S-function"));
    let caller = block::view(program, &title("C Caller"));
    let b = &source;
    let mut files = block::emit(program)?;
    files.files.extend([
        (format!("sf_{n}.c"), render(&Source { b })?),
        (format!("sf_{n}.tlc"), render(&Tlc { b })?),
        (format!("make_{n}.m"), render(&Make { b })?),
        // the name that Simulink Coder looks for
        ("rtwmakecfg.m".to_owned(), render(&Rtwmakecfg { b })?),
        (format!("{n}_usr.mk"), render(&UserMakefile { b })?),
        (format!("legacy_{n}.m"), render(&LegacyCode { b })?),
        (format!("{n}_caller.h"), render(&CallerHeader { b: &caller })?),
        (format!("{n}_caller.c"), render(&CallerSource { b: &caller })?),
        ("README_sfunction.md".to_owned(), render(&Readme { b })?),
    ]);
    Ok(files)
}
