/* Entry, FPU and traps of a RISC-V processor in machine mode. */
    .option arch, +zicsr
    .section .vectors, "ax"
    .global board_entry
board_entry:
    la sp, __stack_top
    la t0, trap
    csrw mtvec, t0
#if defined(__riscv_flen)
    /* the FPU is off at reset: mstatus.FS = initial */
    li t0, 1 << 13
    csrs mstatus, t0
    csrw fcsr, zero
#endif
    call board_main

    .text
    .balign 4
trap:
    la sp, __stack_top
    call board_fault

    /* the three instructions are the trap only if uncompressed and in one page */
    .balign 16
    .option push
    .option norvc
    .global semihost
semihost:
    slli zero, zero, 0x1f
    ebreak
    srai zero, zero, 7
    ret
    .option pop

    .global count_begin
count_begin:
    ret
    .global count_end
count_end:
    ret
