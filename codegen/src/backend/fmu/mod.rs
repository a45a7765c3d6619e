//! Functional mock-up units for co-simulation: FMI 2.0 and 3.0 around the same block.

mod functions;
mod variables;

use policy::sha256;
use templates::fmu::{
    Api, Fmi2Description, Fmi2Header, Fmi2Source, Fmi3Build, Fmi3Description, Fmi3Header, Fmi3Source, FmuView, Header,
    Source,
};

use super::block;
use super::c::{self, render};
use crate::files::{CodegenError, GeneratedFiles, TOOL};
use crate::program::Program;

/// Version of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fmi {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

impl Fmi {
    /// Such as `fmi2`: ending of file names, start of function names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Fmi::Two => "fmi2",
            Fmi::Three => "fmi3",
        }
    }

    fn api(self) -> Api {
        match self {
            Fmi::Two => Api {
                prefix: "fmi2",
                instance: "fmi2Component",
                state: "FMUstate",
                deserialize: "DeSerialize",
                memory: "&own->callbacks, ",
                freed: "&((instance_type *)c)->callbacks, ",
            },
            Fmi::Three => Api {
                prefix: "fmi3",
                instance: "fmi3Instance",
                state: "FMUState",
                deserialize: "Deserialize",
                memory: "",
                freed: "",
            },
        }
    }
}

/// Where the files of a policy stand in the archive of its FMU, binaries apart: path in the archive, name of the file.
#[must_use]
pub fn layout(name: &str, fmi: Fmi) -> Vec<(String, String)> {
    let version = fmi.name();
    let source = |file: String| (format!("sources/{file}"), file);
    let mut all = vec![("modelDescription.xml".to_owned(), format!("{name}_{version}.xml"))];
    all.extend(sources(name, fmi).into_iter().map(source));
    let headers = ["", "_block", "_fmu"].map(|part| format!("{name}{part}.h"));
    all.extend(headers.into_iter().map(source));
    all.push(source(format!("{name}_{version}.h")));
    if fmi == Fmi::Three {
        let build = format!("{name}_fmi3_build.xml");
        all.push(("sources/buildDescription.xml".to_owned(), build));
    }
    all
}

/// The C files of an FMU, without folder.
#[must_use]
pub fn sources(name: &str, fmi: Fmi) -> Vec<String> {
    let parts = ["", "_block", "_fmu"].map(|part| format!("{name}{part}.c"));
    parts.into_iter().chain([format!("{name}_{}.c", fmi.name())]).collect()
}

/// The files around the core; [`layout`] says where they stand in the archive.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn emit(program: &Program, fmi: Fmi) -> Result<GeneratedFiles, CodegenError> {
    let n = &program.name;
    let mut files = block::emit(program)?;
    let hash = digest(program, &files)?;
    let view = view(program, fmi, &hash);
    let f = &view;
    files.files.extend([
        (format!("{n}_fmu.h"), render(&Header { f })?),
        (format!("{n}_fmu.c"), render(&Source { f })?),
    ]);
    files.files.extend(match fmi {
        Fmi::Two => vec![
            (format!("{n}_fmi2.h"), render(&Fmi2Header { f })?),
            (format!("{n}_fmi2.c"), render(&Fmi2Source { f })?),
            (format!("{n}_fmi2.xml"), render(&Fmi2Description { f })?),
        ],
        Fmi::Three => vec![
            (format!("{n}_fmi3.h"), render(&Fmi3Header { f })?),
            (format!("{n}_fmi3.c"), render(&Fmi3Source { f })?),
            (format!("{n}_fmi3.xml"), render(&Fmi3Description { f })?),
            (format!("{n}_fmi3_build.xml"), render(&Fmi3Build { f })?),
        ],
    });
    Ok(files)
}

/// SHA-256 of core and block: another controller, another FMU.
fn digest(program: &Program, block: &GeneratedFiles) -> Result<String, CodegenError> {
    let core = c::emit(program)?;
    // without the shell, whose text contains the digest
    let texts = core.files.iter().chain(&block.files);
    let all: String = texts.map(|(name, text)| format!("{name}\n{text}\n")).collect();
    Ok(sha256(all.as_bytes()))
}

fn view(program: &Program, fmi: Fmi, hash: &str) -> FmuView {
    let n = &program.name;
    let b = block::view(program, &format!("Co-simulation unit of controller {n}"));
    let part = |from: usize, to: usize| hash.get(from..to).unwrap_or_default();
    // in the form of a GUID, but not drawn: equal policies give equal files
    let groups = [part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32)];
    let (variables, time) = variables::of(program, &b);
    FmuView {
        api: fmi.api(),
        token: format!("{{{}}}", groups.join("-")),
        // what a stored state is asked for, so that another controller's is refused
        signature: format!("0x{}", part(0, 8)),
        description: format!(
            "Controller {n}, control period {} s: policy and duty ratio mapping, bit for bit as in C",
            b.sample_period
        ),
        tool: TOOL,
        units: variables::units(program),
        variables,
        time,
        sources: sources(n, fmi),
        coefficients: if b.parameters.is_empty() {
            ""
        } else {
            ", fmu->state.coefficients"
        },
        functions: functions::all(fmi),
        accessed: &functions::ACCESSED,
        without: functions::without(),
        absent: functions::absent(fmi),
        b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As many as the standard has for co-simulation.
    #[test]
    fn every_function_is_named_once() {
        for (fmi, count) in [(Fmi::Two, 34), (Fmi::Three, 75)] {
            let mut names = functions::all(fmi);
            names.sort();
            names.dedup();
            assert_eq!(names.len(), count);
        }
    }
}
