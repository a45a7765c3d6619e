//! Arm Cortex-M.

use crate::boards::{MICROBIT, MPS2_AN385_BOARD, MPS2_AN386_BOARD, MPS2_AN500_BOARD, MPS2_AN505_BOARD};
use crate::spec::{
    CCompiler, CycleModel, EXACT_C99, EXACT_RUST, Endianness, Fma, Fpu, GNU_SECTIONS, ILP32, IntegerBlock, IntegerLoop,
    RowBlock, Runner, RustTarget, Sections, TargetSpec,
};

const fn gcc(machine_flags: &'static [&'static str]) -> CCompiler {
    CCompiler {
        program: "arm-none-eabi-gcc",
        package: "gcc-arm-none-eabi",
        machine_flags,
    }
}

const fn clang(machine_flags: &'static [&'static str]) -> CCompiler {
    CCompiler {
        program: "clang",
        package: "clang",
        machine_flags,
    }
}

/// Functions that run from fast memory have no common name across vendors; this one is ST's and NXP's.
const SECTIONS: Sections = Sections {
    fast_code: Some(".RamFunc"),
    ..GNU_SECTIONS
};

/// Cortex-M3 and M4 technical reference manuals, instruction timing: LDR 2, pipelined 1; B 1 + 1 to 3.
const M3_M4_CYCLES: CycleModel = CycleModel {
    access: (0, 1),
    jump: (1, 3),
};

const BASE: TargetSpec = TargetSpec {
    name: "",
    description: "",
    endianness: Endianness::Little,
    widths: ILP32,
    fpu: Fpu::None,
    fma: Fma::Absent,
    flushes_subnormals: false,
    // without FPU a step in floats takes 20 to 45 times as many instructions, and their number depends on the data
    suitable_format: "i16",
    cycles: None,
    most_per_cycle: None,
    sections: SECTIONS,
    clock_hz: None,
    // four until instructions have been counted with other shapes; where a library computes floats they matter little
    c_row_block: RowBlock::Rows(4),
    rust_row_block: RowBlock::Rows(4),
    weights_alignment: None,
    has_float_assembly: false,
    integer_block: IntegerBlock {
        // heights of blocks are measured, not derived: gcc and LLVM spill at different ones (decision 3). Bench network
        // in 16 bits on Cortex-M3, rows of 4, 6, 8: gcc 16380, 15150, 19185 instructions; clang 13796, 15582, 15491;
        // rustc 15469, 15687, 16439 (its `rust_rows`)
        rows: 6,
        unrolled: 1,
        inner: IntegerLoop::Plain,
        streams: false,
        rust_rows: (4, 4),
    },
    c_compilers: &[],
    c_flags: EXACT_C99,
    rust: None,
    rust_flags: EXACT_RUST,
    runner: Runner::None(""),
};

pub const CORTEX_M0PLUS: TargetSpec = TargetSpec {
    name: "cortex-m0plus",
    description: "Arm Cortex-M0 and M0+ (Armv6-M): no FPU, no division",
    // M0+ technical reference manual: LDR and STR 2, B 2; the M0's jump takes one more
    cycles: Some(CycleModel {
        access: (1, 1),
        jump: (1, 2),
    }),
    // of a usual device, as with all targets: a convention, from which `--clock` departs
    clock_hz: Some(48_000_000),
    // bench network in 16 bits, rows of 4, 6, 8: gcc 44398, 26016, 44133 instructions; clang 29866, 28501, 27558; rustc
    // 34291, 33979, 31201 (its `rust_rows`)
    integer_block: IntegerBlock {
        rows: 6,
        unrolled: 1,
        inner: IntegerLoop::Halves,
        streams: false,
        rust_rows: (8, 8),
    },
    c_compilers: &[
        gcc(&["-mthumb", "-mcpu=cortex-m0plus"]),
        clang(&["--target=thumbv6m-none-eabi", "-mcpu=cortex-m0plus"]),
    ],
    rust: Some(RustTarget {
        triple: "thumbv6m-none-eabi",
        machine_flags: &["-Ctarget-cpu=cortex-m0plus"],
    }),
    runner: Runner::Emulated(MICROBIT),
    ..BASE
};

pub const CORTEX_M3: TargetSpec = TargetSpec {
    name: "cortex-m3",
    description: "Arm Cortex-M3 (Armv7-M): no FPU",
    cycles: Some(M3_M4_CYCLES),
    clock_hz: Some(72_000_000),
    c_compilers: &[
        gcc(&["-mthumb", "-mcpu=cortex-m3"]),
        clang(&["--target=thumbv7m-none-eabi", "-mcpu=cortex-m3"]),
    ],
    rust: Some(RustTarget {
        triple: "thumbv7m-none-eabi",
        machine_flags: &["-Ctarget-cpu=cortex-m3"],
    }),
    runner: Runner::Emulated(MPS2_AN385_BOARD),
    ..BASE
};

const FPU_BASE: TargetSpec = TargetSpec {
    fpu: Fpu::Single,
    suitable_format: "f32",
    // 32 single registers: 16 accumulators, one input, loads in flight
    c_row_block: RowBlock::Rows(16),
    rust_row_block: RowBlock::Rows(16),
    has_float_assembly: true,
    integer_block: IntegerBlock::DUAL,
    ..BASE
};

pub const CORTEX_M4F: TargetSpec = TargetSpec {
    name: "cortex-m4f",
    description: "Arm Cortex-M4 with FPU (Armv7E-M, FPv4-SP)",
    // Arm's timing table: VFMA 3 cycles, VMUL and VADD 1 each
    fma: Fma::Cycles { fused: 3, apart: 2 },
    flushes_subnormals: false,
    cycles: Some(M3_M4_CYCLES),
    clock_hz: Some(168_000_000),
    c_compilers: &[
        gcc(&["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]),
        clang(&[
            "--target=thumbv7em-none-eabihf",
            "-mcpu=cortex-m4",
            "-mfpu=fpv4-sp-d16",
            "-mfloat-abi=hard",
        ]),
    ],
    // without the CPU rustc takes VMLA for the product and sum of two roundings, at three cycles
    rust: Some(RustTarget {
        triple: "thumbv7em-none-eabihf",
        machine_flags: &["-Ctarget-cpu=cortex-m4"],
    }),
    runner: Runner::Emulated(MPS2_AN386_BOARD),
    ..FPU_BASE
};

pub const CORTEX_M7: TargetSpec = TargetSpec {
    name: "cortex-m7",
    description: "Arm Cortex-M7 with FPU (Armv7E-M, FPv5-SP)",
    fma: Fma::Cycles { fused: 1, apart: 2 },
    flushes_subnormals: false,
    // no cycle model: it issues two instructions at a time, of which a count says little
    most_per_cycle: Some(2),
    clock_hz: Some(400_000_000),
    c_compilers: &[
        gcc(&["-mthumb", "-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"]),
        clang(&[
            "--target=thumbv7em-none-eabihf",
            "-mcpu=cortex-m7",
            "-mfpu=fpv5-sp-d16",
            "-mfloat-abi=hard",
        ]),
    ],
    rust: Some(RustTarget {
        triple: "thumbv7em-none-eabihf",
        // rustc's cortex-m7 has binary64 in hardware, parts with FPv5-SP do not
        machine_flags: &["-Ctarget-cpu=cortex-m7", "-Ctarget-feature=-fp64"],
    }),
    runner: Runner::Emulated(MPS2_AN500_BOARD),
    ..FPU_BASE
};

pub const CORTEX_M33: TargetSpec = TargetSpec {
    name: "cortex-m33",
    description: "Arm Cortex-M33 with FPU (Armv8-M Mainline, FPv5-SP)",
    fma: Fma::Unrated,
    flushes_subnormals: false,
    // no cycle model either: the tables differ from core to core. It issues in order, and two at once only of some pairs of 16-bit instructions
    most_per_cycle: Some(2),
    clock_hz: Some(160_000_000),
    c_compilers: &[
        gcc(&["-mthumb", "-mcpu=cortex-m33", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"]),
        clang(&[
            "--target=thumbv8m.main-none-eabihf",
            "-mcpu=cortex-m33",
            "-mfpu=fpv5-sp-d16",
            "-mfloat-abi=hard",
        ]),
    ],
    rust: Some(RustTarget {
        triple: "thumbv8m.main-none-eabihf",
        machine_flags: &["-Ctarget-cpu=cortex-m33"],
    }),
    runner: Runner::Emulated(MPS2_AN505_BOARD),
    ..FPU_BASE
};
