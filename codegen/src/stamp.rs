//! One run, one stamp: the C sources of a controller refuse a header that another run wrote.
//!
//! A folder in which the files of two runs are mixed compiles, and commands duties that no policy has. So the header defines
//! a macro whose name is a digest of everything that decides the files, and each source asks for it.

use policy::Policy;
use targets::TargetSpec;

use crate::crc::crc32_bytes;
use crate::files::{GeneratedFiles, TOOL};

/// Puts the stamp into the core's header, and the question for it into every C source that sees the header.
pub(crate) fn stamp(files: &mut GeneratedFiles, policy: &Policy, target: &TargetSpec) {
    let (name, upper) = (&policy.name, policy.name.to_uppercase());
    let macro_name = format!("{upper}_RUN_{:08x}", digest(policy, target));
    for (file, text) in &mut files.files {
        if *file == format!("{name}.h") {
            let guard = format!("#define {upper}_H\n");
            // behind the guard, so that a header which is included twice defines it once
            let line = format!(
                "{guard}\n/* The run of policyc that wrote this file; the sources ask for it. */\n#define {macro_name} 1\n"
            );
            *text = text.replacen(&guard, &line, 1);
        } else if file.ends_with(".c") {
            // a header of the controller includes the core's, and no other header does
            let include = format!("#include \"{name}");
            let Some(end) = text
                .rfind(&include) // the last of them: the question stands behind all headers
                .and_then(|at| Some(at + text[at..].find('\n')? + 1))
            else {
                continue;
            };
            let question = format!(
                "\n#ifndef {macro_name}\n#error \"{name}.h and this file are of two runs of policyc: take both from one\"\n#endif\n"
            );
            text.insert_str(end, &question);
        }
    }
}

/// Of everything that decides the files of a controller.
fn digest(policy: &Policy, target: &TargetSpec) -> u32 {
    let digests = &policy.digests;
    let parts = [
        TOOL,
        target.name,
        policy.numeric_format.name(),
        &digests.weights,
        &digests.contract,
        digests.mapping.as_deref().unwrap_or_default(),
    ];
    // 32 bits are enough against files that were mixed by accident
    crc32_bytes(parts.join("\n").bytes())
}
