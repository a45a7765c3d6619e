//! What differs between deployment targets, as data.
//!
//! One entry of [`TARGETS`] per target; the compiler and the verifier read it, nothing else knows a target by name.
//! How to add one: `docs/reference/targets.md`.

mod arm;
pub mod boards;
mod families;
mod others;
mod overview;
mod riscv;
mod spec;

pub use boards::{Board, BoardFile};
pub use families::{find_or_part, of_part, parts};
pub use overview::{details, overview};
pub use spec::{
    CCompiler, CycleModel, Endianness, Fma, Fpu, IntegerBlock, IntegerLoop, RowBlock, Runner, RustTarget, Sections,
    TargetSpec, Widths,
};

/// All targets, in the order of `policyc targets`.
pub const TARGETS: &[TargetSpec] = &[
    others::HOST,
    arm::CORTEX_M0PLUS,
    arm::CORTEX_M3,
    arm::CORTEX_M4F,
    arm::CORTEX_M7,
    arm::CORTEX_M33,
    riscv::RISCV32IMC,
    riscv::RISCV32IMFC,
    others::DSPACE_DS1202,
    others::C2000_C28X,
    others::GENERIC_C99,
];

/// The machine policyc runs on.
#[must_use]
pub fn host() -> &'static TargetSpec {
    const { &others::HOST }
}

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

    #[test]
    fn an_emulated_target_knows_its_byte_order_and_a_linker() {
        for target in TARGETS {
            if matches!(target.runner, Runner::Emulated(_)) {
                assert_ne!(target.endianness, Endianness::Native, "{}", target.name);
                assert!(!target.c_compilers.is_empty(), "{}", target.name);
            }
        }
    }

    #[test]
    fn the_files_of_a_board_are_named_once_and_its_script_is_among_them() {
        for target in TARGETS {
            let Runner::Emulated(board) = target.runner else {
                continue;
            };
            for file in board.files {
                assert_eq!(board.files.iter().filter(|f| f.name == file.name).count(), 1);
            }
            if let Some(script) = board.linker_script {
                assert!(board.files.iter().any(|file| file.name == script), "{}", board.name);
            }
        }
    }
}
