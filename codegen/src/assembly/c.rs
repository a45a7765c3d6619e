//! Kernels in C: statements of a block in floats, naked functions of blocks in integers.

use super::integer::Kernel;
use super::real::RealKernel;

/// One asm statement for a block of floats; then the outputs `row` become `activated(row)` in `done`, if that is anything.
pub fn real(kernel: &RealKernel, activated: Option<&dyn Fn(usize) -> String>) -> Vec<String> {
    let mut lines = vec![
        "const float *input = x;".to_owned(),
        format!("uint32_t turns = {}u;", kernel.turns()),
    ];
    if kernel.relu {
        lines.push("uint32_t low, high;".to_owned());
    }
    // the text moves `out` on, but an activation comes behind it
    if activated.is_some() {
        lines.push("float *const done = out;".to_owned());
    }
    // volatile: nobody reads its operands behind it, so without that a compiler may leave it out
    lines.push("__asm__ volatile(".to_owned());
    let text = kernel.text(&|operand| format!("%[{operand}]"), &|list| format!("{{{list}}}"));
    lines.extend(text.iter().map(|line| format!("    \"{line}\\n\\t\"")));
    let advanced = ["w", "input", "bias", "out", "turns"].map(|name| format!("[{name}] \"+r\"({name})"));
    let mut outputs = advanced.to_vec();
    if kernel.relu {
        outputs.extend(["low", "high"].map(|name| format!("[{name}] \"=&r\"({name})")));
    }
    lines.push(format!("    : {}", outputs.join(", ")));
    lines.push("    :".to_owned());
    let clobbered = RealKernel::clobbered().into_iter().map(|name| format!("\"{name}\""));
    let clobbered: Vec<String> = clobbered.collect();
    lines.push(format!("    : {}, \"cc\", \"memory\");", clobbered.join(", ")));
    if let Some(activated) = activated {
        lines.extend((0..kernel.height).map(|row| format!("done[{row}] = {};", activated(row))));
    }
    lines
}

/// Body of a naked function over all integer blocks of a height.
pub fn integer(kernel: &Kernel) -> Vec<String> {
    let text = kernel.text(&|registers| format!("{{{registers}}}"));
    let lines = text.iter().map(|line| format!("    \"{line}\\n\\t\""));
    std::iter::once("__asm__ volatile(".to_owned())
        .chain(lines)
        // r4 to r11 are saved by the text itself
        .chain(["    : : : \"r0\", \"r1\", \"r2\", \"r3\", \"r12\", \"lr\", \"cc\", \"memory\");".to_owned()])
        .collect()
}
