//! RISC-V with 32 bits.

use crate::boards::{VIRT_RV32IMC, VIRT_RV32IMFC};
use crate::spec::{
    CCompiler, EXACT_C99, EXACT_RUST, Endianness, Fma, Fpu, GNU_SECTIONS, ILP32, IntegerBlock, IntegerLoop, RowBlock,
    Runner, RustTarget, TargetSpec,
};

const fn gcc(machine_flags: &'static [&'static str]) -> CCompiler {
    CCompiler {
        program: "riscv64-unknown-elf-gcc",
        package: "gcc-riscv64-unknown-elf",
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

pub const RISCV32IMC: TargetSpec = TargetSpec {
    name: "riscv32imc",
    description: "RISC-V RV32IMC: no FPU",
    endianness: Endianness::Little,
    widths: ILP32,
    fpu: Fpu::None,
    fma: Fma::Absent,
    flushes_subnormals: false,
    // floats are a library's, as on Arm without FPU
    suitable_format: "i16",
    // the tables differ from core to core
    cycles: None,
    // single and dual issue are what there is of microcontrollers with these instructions: GD32VF103 and ESP32-C3 begin one, SweRV EH1 two
    most_per_cycle: Some(2),
    sections: GNU_SECTIONS,
    clock_hz: Some(160_000_000),
    c_row_block: RowBlock::Rows(8),
    rust_row_block: RowBlock::Rows(8),
    weights_alignment: None,
    has_float_assembly: false,
    // bench network in 16 bits, rows of 4, 6, 8: gcc 19230, 19373, 18124 instructions; clang 19310, 18506, 18067; rustc
    // 20509, 19702, 19668
    integer_block: IntegerBlock {
        rows: 8,
        unrolled: 2,
        inner: IntegerLoop::Plain,
        streams: false,
        rust_rows: (8, 4),
    },
    // clang puts float constants into the writable .sdata unless the limit is 0
    // the bare compiler has no C library, so <stdint.h> is there in freestanding mode only
    c_compilers: &[
        gcc(&["-march=rv32imc", "-mabi=ilp32", "-ffreestanding"]),
        clang(&[
            "--target=riscv32-none-elf",
            "-march=rv32imc",
            "-mabi=ilp32",
            "-msmall-data-limit=0",
            "-ffreestanding",
        ]),
    ],
    c_flags: EXACT_C99,
    rust: Some(RustTarget {
        triple: "riscv32imc-unknown-none-elf",
        machine_flags: &[],
    }),
    rust_flags: EXACT_RUST,
    runner: Runner::Emulated(VIRT_RV32IMC),
};

pub const RISCV32IMFC: TargetSpec = TargetSpec {
    name: "riscv32imfc",
    description: "RISC-V RV32IMFC: FPU for binary32",
    fpu: Fpu::Single,
    // an instruction set and not a processor: no manual says
    fma: Fma::Unrated,
    flushes_subnormals: false,
    suitable_format: "f32",
    // half of the 32 float registers for sums, as on Arm
    c_row_block: RowBlock::Rows(16),
    rust_row_block: RowBlock::Rows(16),
    c_compilers: &[
        gcc(&["-march=rv32imfc", "-mabi=ilp32f", "-ffreestanding"]),
        clang(&[
            "--target=riscv32-none-elf",
            "-march=rv32imfc",
            "-mabi=ilp32f",
            "-msmall-data-limit=0",
            "-ffreestanding",
        ]),
    ],
    // the nearest triple; the controller has no atomic operation, so the `a` in it changes nothing
    rust: Some(RustTarget {
        triple: "riscv32imafc-unknown-none-elf",
        machine_flags: &[],
    }),
    runner: Runner::Emulated(VIRT_RV32IMFC),
    ..RISCV32IMC
};
