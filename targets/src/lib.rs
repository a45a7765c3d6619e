//! What differs between deployment targets, as data.
//!
//! One entry of [`TARGETS`] per target; the compiler and the verifier read it, nothing else knows a target by name.

use serde::Serialize;

/// Byte order of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Endianness {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
    /// Decided by the machine the code is compiled for.
    Native,
}

/// How many outputs of a dense layer are accumulated side by side.
///
/// The choice moves work *across* outputs only; the order of additions within one output is the contract's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RowBlock {
    /// All outputs of the layer: the accumulators are the output buffer (axpy form).
    All,
    /// At most this many; a shorter last block, no padding.
    Rows(usize),
}

/// A deployment target.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TargetSpec {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for people.
    pub description: &'static str,
    /// Byte order.
    pub endianness: Endianness,
    /// Row block of the generated C, chosen for the C compilers of the target.
    pub c_row_block: RowBlock,
    /// Row block of the generated Rust, chosen for LLVM.
    pub rust_row_block: RowBlock,
    /// C compilers in the order in which they are tried.
    pub c_compilers: &'static [&'static str],
    /// Flags under which the bits hold, besides the optimisation level.
    pub c_flags: &'static [&'static str],
    /// rustc flags under which the bits hold, besides the optimisation level.
    pub rust_flags: &'static [&'static str],
}

/// All targets, in the order of `policyc targets`.
pub const TARGETS: &[TargetSpec] = &[TargetSpec {
    name: "host",
    description: "the machine policyc runs on, any C99 compiler or rustc",
    endianness: Endianness::Native,
    // gcc on x86 spills the accumulators of the block form; LLVM keeps them in registers
    c_row_block: RowBlock::All,
    rust_row_block: RowBlock::Rows(16),
    c_compilers: &["gcc", "clang"],
    c_flags: &["-std=c99", "-ffp-contract=off"],
    // rustc never contracts and has no fast-math switch
    rust_flags: &["--edition=2021"],
}];

/// The target of that name.
#[must_use]
pub fn find(name: &str) -> Option<&'static TargetSpec> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Names of all targets, for messages.
#[must_use]
pub fn names() -> Vec<&'static str> {
    TARGETS.iter().map(|target| target.name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_is_found_by_its_own_name_only() {
        for target in TARGETS {
            assert_eq!(find(target.name), Some(target));
            assert_eq!(TARGETS.iter().filter(|t| t.name == target.name).count(), 1);
        }
        assert_eq!(find("pdp-11"), None);
    }
}
