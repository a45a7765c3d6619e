//! Processors under QEMU.

/// A processor with its compilers' flags and its board.
pub struct Core {
    /// Name of the target.
    pub name: &'static str,
    /// Flags of arm-none-eabi-gcc.
    pub gcc: &'static [&'static str],
    /// Target of clang and rustc.
    pub triple: &'static str,
    /// CPU of rustc.
    pub cpu: &'static str,
    /// Machine of the emulator.
    pub machine: &'static str,
    /// Linker script among the boards.
    pub script: &'static str,
    /// binary32 in hardware.
    pub has_fpu: bool,
    /// Fused multiply-add in hardware.
    pub has_fma: bool,
    /// Two 16-bit products in one instruction.
    pub has_dsp: bool,
}

/// All processors that are counted.
pub const CORES: &[Core] = &[
    Core {
        name: "cortex-m4f",
        gcc: &["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"],
        triple: "thumbv7em-none-eabihf",
        cpu: "cortex-m4",
        machine: "mps2-an386",
        script: "mps2.ld",
        has_fpu: true,
        has_fma: true,
        has_dsp: true,
    },
    Core {
        name: "cortex-m7",
        gcc: &["-mthumb", "-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"],
        triple: "thumbv7em-none-eabihf",
        cpu: "cortex-m7",
        machine: "mps2-an500",
        script: "mps2.ld",
        has_fpu: true,
        has_fma: true,
        has_dsp: true,
    },
    Core {
        name: "cortex-m33",
        gcc: &["-mthumb", "-mcpu=cortex-m33", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"],
        triple: "thumbv8m.main-none-eabihf",
        cpu: "cortex-m33",
        machine: "mps2-an505",
        script: "mps2-an505.ld",
        has_fpu: true,
        has_fma: true,
        has_dsp: true,
    },
    Core {
        name: "cortex-m0plus",
        gcc: &["-mthumb", "-mcpu=cortex-m0plus"],
        triple: "thumbv6m-none-eabi",
        cpu: "cortex-m0plus",
        machine: "microbit",
        script: "microbit.ld",
        has_fpu: false,
        has_fma: false,
        has_dsp: false,
    },
];
