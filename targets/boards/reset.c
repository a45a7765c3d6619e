/* From reset to main, the same on every bare board; the vectors and the FPU are the start file's. */
#include "board.h"

extern uint32_t __data_load[], __data_start[], __data_end[], __bss_start[], __bss_end[], __stack_low[];

int main(void);

void board_main(void);
void board_fault(void);

void board_main(void)
{
    const uint32_t *from = __data_load;
    uint32_t *to;
    for (to = __data_start; to != __data_end; ++to) {
        *to = *from++;
    }
    for (to = __bss_start; to != __bss_end; ++to) {
        *to = 0u;
    }
    board_exit(main());
}

/* A processor fault: what was answered before it leaves first, so that the host knows where it happened. */
void board_fault(void)
{
    words_flush();
    board_exit(99);
}

#define PAINT 0xA5C35A3Cu
/* The painter's own frame and the way back lie here. */
#define OWN_WORDS 16

static uintptr_t painted_from;

void stack_paint(void)
{
    uint32_t *word = __stack_low;
    uint32_t *top = (uint32_t *)__builtin_frame_address(0) - OWN_WORDS;
    painted_from = (uintptr_t)__builtin_frame_address(0);
    while (word < top) {
        *word++ = PAINT;
    }
}

uint32_t stack_depth(void)
{
    const uint32_t *word = __stack_low;
    while (*word == PAINT) {
        ++word;
    }
    return (uint32_t)(painted_from - (uintptr_t)word);
}
