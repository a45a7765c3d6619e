//! The instruction counter itself: known programs give known counts.

use std::path::Path;
use std::process::Command;

use targets::{Board, Runner, TargetSpec};
use tests::tools::run;
use verify::elf::Elf;

/// Two passages: nothing, then a function of 3 + 1000 turns of 2 instructions, where the processor has a plain loop.
const PROGRAM: &str = r#"
#include "board.h"
void thousand(void);
#if defined(__arm__)
__asm__(".syntax unified\n.thumb\n.text\n.balign 4\n.global thousand\n.thumb_func\nthousand:\n"
        "movs r0, #250\nlsls r0, r0, #2\n1: subs r0, #1\nbne 1b\nbx lr\n");
#elif defined(__riscv)
__asm__(".text\n.global thousand\nthousand:\nli a0, 250\nslli a0, a0, 2\n1: addi a0, a0, -1\nbnez a0, 1b\nret\n");
#else
__asm__(".text\n.globl thousand\nthousand:\nli 3, 1000\nmtctr 3\n1: nop\nbdnz 1b\nblr\n");
#endif
int main(void)
{
    count_begin();
    count_end();
    count_begin();
    thousand();
    count_end();
    return 0;
}
"#;

fn board(target: &TargetSpec) -> Board {
    match target.runner {
        Runner::Emulated(board) => board,
        _ => panic!("{} is not emulated", target.name),
    }
}

/// Builds `program.c` of the folder with these sources and flags beside those of the board.
fn build(target: &TargetSpec, folder: &Path, beside: &[&str]) {
    let board = board(target);
    for file in board.files {
        std::fs::write(folder.join(file.name), file.text).unwrap();
    }
    std::fs::write(folder.join("counter.c"), targets::boards::COUNTER.text).unwrap();
    let mut plugin = Command::new("gcc");
    plugin.args([
        "-Wall",
        "-Wextra",
        "-Werror",
        "-shared",
        "-fPIC",
        "-O2",
        "counter.c",
        "-o",
        "counter.so",
    ]);
    let ran = run(plugin.current_dir(folder));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let compiler = target.c_compilers[0];
    let mut link = Command::new(compiler.program);
    link.args(compiler.machine_flags).args(board.link_flags);
    link.args(["-Wall", "-Wextra", "-L.", "-I."]);
    link.args(board.linker_script.into_iter().flat_map(|script| ["-T", script]));
    let sources = board
        .files
        .iter()
        .filter(|file| file.name.ends_with(".c") || file.name.ends_with(".S"));
    link.args(sources.map(|file| file.name))
        .args(beside)
        .args(["program.c", "-o", "program.elf"]);
    let ran = run(link.current_dir(folder));
    assert!(
        ran.code == Some(0) && !ran.stderr.contains("warning: unused"),
        "{}",
        ran.stderr
    );
}

/// What the passages of a program cost: instructions, accesses to memory, jumps. `files` lie beside it.
pub fn counts(target: &TargetSpec, program: &str, files: &[(&str, &str)], beside: &[&str]) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, text) in files.iter().chain(&[("program.c", program)]) {
        std::fs::write(folder.join(name), text).unwrap();
    }
    build(target, folder, beside);
    let image = Elf::read(&std::fs::read(folder.join("program.elf")).unwrap()).unwrap();
    let mark = |name: &str| image.address(name).unwrap();
    let plugin = format!(
        "./counter.so,begin={:#x},end={:#x},out=counts",
        mark("count_begin"),
        mark("count_end")
    );
    let board = board(target);
    let mut emulator = Command::new("timeout");
    emulator
        .args(["60", board.emulator, "-plugin", &plugin])
        .args(board.arguments);
    let ran = run(emulator.arg("program.elf").current_dir(folder));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let text = std::fs::read_to_string(folder.join("counts")).unwrap();
    text.lines().map(str::to_owned).collect()
}

#[test]
fn an_empty_passage_is_one_call_and_a_thousand_turns_are_two_thousand_instructions() {
    for target in targets::TARGETS {
        if matches!(target.runner, Runner::Emulated(_)) {
            // the call of the end mark; then the call, two to set up, the loop, the return, the call of the end mark
            // jumps: the call, 999 turns, the return
            let thousand = format!("{} 0 {}", 1 + 2 + 2000 + 1 + 1, 1 + 999 + 1);
            assert_eq!(
                counts(target, PROGRAM, &[], &[]),
                ["1 0 0", thousand.as_str()],
                "{}",
                target.name
            );
        }
    }
}
