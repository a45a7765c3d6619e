/* Vectors, FPU and traps of an ARM Cortex-M. */
#include "board.h"

extern uint32_t __stack_top[];
void board_main(void);
void board_fault(void);
void board_entry(void);
uintptr_t semihost(uintptr_t operation, const uintptr_t *arguments);

#define CPACR (*(volatile uint32_t *)0xE000ED88u)

void board_entry(void)
{
#if defined(__ARM_FP)
    /* the FPU is off at reset: full access to coprocessors 10 and 11 before the first float */
    CPACR |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
#endif
    board_main();
}

typedef void (*vector)(void);

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    vector reset;
    vector faults[14];
} vectors = {
    __stack_top,
    board_entry,
    { board_fault, board_fault, board_fault, board_fault, board_fault, board_fault, board_fault, board_fault,
      board_fault, board_fault, board_fault, board_fault, board_fault, board_fault },
};

__asm__(".syntax unified\n"
        ".thumb\n"
        ".text\n"
        ".balign 4\n"
        ".global semihost\n"
        ".thumb_func\n"
        "semihost:\n"
        "    bkpt 0xAB\n"
        "    bx lr\n"
        ".global count_begin\n"
        ".thumb_func\n"
        "count_begin:\n"
        "    bx lr\n"
        ".global count_end\n"
        ".thumb_func\n"
        "count_end:\n"
        "    bx lr\n");
