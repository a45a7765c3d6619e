//! The boards under an emulator: start-up, linker script and the way words travel, as text of this crate's `boards/`.

use serde::Serialize;

/// A text of `boards/`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardFile {
    /// File name; those with the endings `c` and `S` are compiled.
    pub name: &'static str,
    /// Content.
    pub text: &'static str,
}

/// An emulated board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Board {
    /// What the emulator calls it.
    pub name: &'static str,
    /// Program of the emulator.
    pub emulator: &'static str,
    /// Debian package that has it.
    pub package: &'static str,
    /// Arguments before the image.
    pub arguments: &'static [&'static str],
    /// What is compiled and linked beside driver and controller.
    #[serde(skip)]
    pub files: &'static [BoardFile],
    /// The linker script among `files`; `None` for a program under an operating system.
    #[serde(skip)]
    pub linker_script: Option<&'static str>,
    /// Flags for the compiler that links.
    #[serde(skip)]
    pub link_flags: &'static [&'static str],
}

/// The instruction counter, a plugin of QEMU in C.
pub const COUNTER: BoardFile = file("counter.c", include_str!("../boards/counter/counter.c"));

const fn file(name: &'static str, text: &'static str) -> BoardFile {
    BoardFile { name, text }
}

const HEADER: BoardFile = file("board.h", include_str!("../boards/board.h"));
const WORDS: BoardFile = file("words.c", include_str!("../boards/words.c"));
const RESET: BoardFile = file("reset.c", include_str!("../boards/reset.c"));
const SEMIHOSTING: BoardFile = file("semihosting.c", include_str!("../boards/semihosting.c"));
const MEMORY: BoardFile = file("memory.c", include_str!("../boards/memory.c"));
const SECTIONS: BoardFile = file("sections.ld", include_str!("../boards/sections.ld"));
const ARM_START: BoardFile = file("start.c", include_str!("../boards/arm/start.c"));
const RISCV_START: BoardFile = file("start.S", include_str!("../boards/riscv/start.S"));
const LINUX: BoardFile = file("board.c", include_str!("../boards/linux/board.c"));

const MPS2: BoardFile = file("mps2.ld", include_str!("../boards/arm/mps2.ld"));
const MPS2_AN505: BoardFile = file("mps2-an505.ld", include_str!("../boards/arm/mps2-an505.ld"));
const MICROBIT_LD: BoardFile = file("microbit.ld", include_str!("../boards/arm/microbit.ld"));
const VIRT: BoardFile = file("virt.ld", include_str!("../boards/riscv/virt.ld"));

/// Nothing of the host's libraries. `-fno-tree-loop-distribute-patterns`: a loop of `memcpy` is not a call of `memcpy`.
const BARE: &[&str] = &[
    "-std=gnu99",
    "-O2",
    "-ffreestanding",
    "-fno-tree-loop-distribute-patterns",
    "-nostdlib",
    "-Wl,--gc-sections",
];

macro_rules! arm_board {
    ($machine:literal, $script:ident) => {
        Board {
            name: $machine,
            emulator: "qemu-system-arm",
            package: "qemu-system-arm",
            arguments: &[
                "-machine",
                $machine,
                "-display",
                "none",
                // semihosting has the standard streams to itself: a serial line or monitor would write among the words
                "-serial",
                "none",
                "-monitor",
                "none",
                "-semihosting-config",
                "enable=on,target=native",
                "-kernel",
            ],
            files: &[HEADER, WORDS, RESET, SEMIHOSTING, MEMORY, SECTIONS, ARM_START, $script],
            linker_script: Some($script.name),
            link_flags: BARE,
        }
    };
}

/// Cortex-M0, 256 kB of flash, 16 kB of RAM.
pub const MICROBIT: Board = arm_board!("microbit", MICROBIT_LD);
/// Cortex-M3.
pub const MPS2_AN385_BOARD: Board = arm_board!("mps2-an385", MPS2);
/// Cortex-M4 with FPU.
pub const MPS2_AN386_BOARD: Board = arm_board!("mps2-an386", MPS2);
/// Cortex-M7 with FPU.
pub const MPS2_AN500_BOARD: Board = arm_board!("mps2-an500", MPS2);
/// Cortex-M33 with FPU.
pub const MPS2_AN505_BOARD: Board = arm_board!("mps2-an505", MPS2_AN505);

macro_rules! riscv_board {
    ($cpu:literal) => {
        Board {
            name: "virt",
            emulator: "qemu-system-riscv32",
            package: "qemu-system-misc",
            arguments: &[
                "-machine",
                "virt",
                "-cpu",
                $cpu,
                // none: QEMU would put firmware of its own where the image begins
                "-bios",
                "none",
                "-display",
                "none",
                "-serial",
                "none",
                "-monitor",
                "none",
                "-semihosting-config",
                "enable=on,target=native",
                "-kernel",
            ],
            files: &[HEADER, WORDS, RESET, SEMIHOSTING, MEMORY, SECTIONS, RISCV_START, VIRT],
            linker_script: Some(VIRT.name),
            link_flags: BARE,
        }
    };
}

/// RISC-V without floats: a float instruction is a fault.
pub const VIRT_RV32IMC: Board = riscv_board!("rv32,f=false,d=false");
/// RISC-V with binary32.
pub const VIRT_RV32IMFC: Board = riscv_board!("rv32,d=false");

/// A static program for Linux on a big-endian PowerPC of the e500 family.
pub const LINUX_PPC: Board = Board {
    name: "linux",
    emulator: "qemu-ppc",
    package: "qemu-user",
    // QEMU has no e5500; this one has the instructions of it that 32-bit code uses
    arguments: &["-cpu", "e500mc"],
    files: &[HEADER, WORDS, LINUX],
    linker_script: None,
    // static: the emulator then needs no libraries of the target
    link_flags: &["-std=gnu99", "-O2", "-static", "-no-pie"],
};
