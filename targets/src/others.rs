//! This machine, the laboratory box, the DSP, and whatever has a C99 compiler.

use crate::boards::LINUX_PPC;
use crate::spec::{
    CCompiler, EXACT_C99, EXACT_RUST, Endianness, Fma, Fpu, GNU_SECTIONS, ILP32, IntegerBlock, IntegerLoop, RowBlock,
    Runner, RustTarget, Sections, TargetSpec, Widths,
};

pub const HOST: TargetSpec = TargetSpec {
    name: "host",
    description: "the machine policyc runs on, any C99 compiler or rustc",
    endianness: Endianness::Native,
    widths: Widths {
        char_bits: 8,
        int_bits: 32,
        pointer_bits: 64,
    },
    fpu: Fpu::Native,
    fma: Fma::Unrated,
    flushes_subnormals: false,
    suitable_format: "f32",
    cycles: None,
    most_per_cycle: None,
    sections: GNU_SECTIONS,
    // one that only the user knows
    clock_hz: None,
    // eight vectors of four lanes; gcc spills them as scalars
    c_row_block: RowBlock::Vectors(32),
    rust_row_block: RowBlock::Rows(32),
    // a line of the cache: no vector lies across two
    weights_alignment: Some(64),
    has_float_assembly: false,
    integer_block: IntegerBlock::DUAL,
    c_compilers: &[
        CCompiler {
            program: "gcc",
            package: "gcc",
            machine_flags: &[],
        },
        CCompiler {
            program: "clang",
            package: "clang",
            machine_flags: &[],
        },
    ],
    c_flags: EXACT_C99,
    rust: Some(RustTarget {
        triple: "",
        machine_flags: &[],
    }),
    rust_flags: EXACT_RUST,
    runner: Runner::Native,
};

pub const DSPACE_DS1202: TargetSpec = TargetSpec {
    name: "dspace-ds1202",
    description: "dSPACE MicroLabBox DS1202: PowerPC e5500, big-endian, GCC of the 5.2 era (C90 and C99)",
    endianness: Endianness::Big,
    widths: ILP32,
    fpu: Fpu::Double,
    fma: Fma::Cycles { fused: 1, apart: 2 },
    flushes_subnormals: false,
    suitable_format: "f32",
    // it issues two instructions at a time, of which a count says nothing
    cycles: None,
    most_per_cycle: None,
    sections: GNU_SECTIONS,
    clock_hz: Some(2_000_000_000),
    // half of the 32 float registers for sums, as on Arm
    c_row_block: RowBlock::Rows(16),
    rust_row_block: RowBlock::Rows(16),
    weights_alignment: None,
    has_float_assembly: false,
    // bench network in 16 bits, rows of 4, 6, 8: gcc 19330, 18810, 17708 instructions; rustc 19024, 23432, 26808 (its
    // `rust_rows`)
    integer_block: IntegerBlock {
        rows: 8,
        unrolled: 2,
        inner: IntegerLoop::Plain,
        streams: false,
        rust_rows: (4, 4),
    },
    c_compilers: &[CCompiler {
        program: "powerpc-linux-gnu-gcc",
        package: "gcc-powerpc-linux-gnu",
        // what the e5500 and the emulated e500mc share; a box has fixed addresses, Linux compilers think otherwise
        machine_flags: &["-m32", "-mcpu=e500mc", "-fno-pie"],
    }],
    // the box's compiler takes C90; it contracts unless told otherwise
    c_flags: &["-std=c90", "-ffp-contract=off"],
    // the box itself takes C only: this is the same processor with another language
    rust: Some(RustTarget {
        triple: "powerpc-unknown-linux-gnu",
        machine_flags: &["-Crelocation-model=static"],
    }),
    rust_flags: EXACT_RUST,
    runner: Runner::Emulated(LINUX_PPC),
};

pub const C2000_C28X: TargetSpec = TargetSpec {
    name: "c2000-c28x",
    description: "TI C2000 C28x with FPU32: 16-bit char and int, no 8-bit types, denormals flushed",
    endianness: Endianness::Little,
    widths: Widths {
        char_bits: 16,
        int_bits: 16,
        pointer_bits: 32,
    },
    // of binary64 nothing is promised: how wide `double` is depends on the compiler's settings
    fpu: Fpu::Single,
    fma: Fma::Absent,
    flushes_subnormals: true,
    // the FPU flushes denormals: bits are promised for integers only
    suitable_format: "i16",
    cycles: None,
    most_per_cycle: None,
    sections: Sections {
        tables: ".const",
        code: ".text",
        fast_code: Some(".TI.ramfunc"),
    },
    clock_hz: Some(200_000_000),
    // never counted: there is neither a compiler nor an emulator to count with, so small blocks
    c_row_block: RowBlock::Rows(4),
    rust_row_block: RowBlock::Rows(4),
    weights_alignment: None,
    has_float_assembly: false,
    integer_block: IntegerBlock {
        rows: 4,
        unrolled: 2,
        inner: IntegerLoop::Plain,
        streams: false,
        rust_rows: (4, 4),
    },
    c_compilers: &[CCompiler {
        program: "cl2000",
        package: "",
        machine_flags: &["--float_support=fpu32", "--abi=eabi"],
    }],
    c_flags: &["--c99", "--fp_mode=strict"],
    rust: None,
    rust_flags: &[],
    runner: Runner::None("there is no free compiler or emulator of the C28x"),
};

pub const GENERIC_C99: TargetSpec = TargetSpec {
    name: "generic-c99",
    description: "any C99 compiler with IEEE 754 binary32; verified on this machine",
    fma: Fma::Unrated,
    flushes_subnormals: false,
    // no processor is known, so no number of registers
    rust_row_block: RowBlock::All,
    // nor a line of the cache
    weights_alignment: None,
    integer_block: IntegerBlock::DUAL,
    ..HOST
};
