/* A Linux program in the place of a board, for processors that QEMU emulates in user mode. */
#include "board.h"

#include <stdlib.h>
#include <unistd.h>

size_t board_read(void *bytes, size_t size)
{
    ssize_t got = read(0, bytes, size);
    return got > 0 ? (size_t)got : 0u;
}

void board_write(const void *bytes, size_t size)
{
    const unsigned char *next = bytes;
    while (size != 0u) {
        ssize_t sent = write(1, next, size);
        if (sent <= 0) {
            _exit(98);
        }
        next += sent;
        size -= (size_t)sent;
    }
}

void board_exit(int code)
{
    words_flush();
    exit(code);
}

__attribute__((noinline)) void count_begin(void)
{
    __asm__ volatile("");
}

__attribute__((noinline)) void count_end(void)
{
    __asm__ volatile("");
}

/* Rust's library for Linux is built for unwinding and asks for this; nothing unwinds here. */
void rust_eh_personality(void);
void rust_eh_personality(void)
{
}

#define PAINT 0xA5C35A3Cu
#define DEPTH_WORDS 16384
/* The painter's own frame and the way back lie here. */
#define OWN_WORDS 64

static uintptr_t painted_from;

__attribute__((noinline)) void stack_paint(void)
{
    volatile uint32_t *top = (volatile uint32_t *)__builtin_frame_address(0) - OWN_WORDS;
    int n;
    painted_from = (uintptr_t)__builtin_frame_address(0);
    for (n = 1; n <= DEPTH_WORDS; ++n) {
        top[-n] = PAINT;
    }
}

__attribute__((noinline)) uint32_t stack_depth(void)
{
    const volatile uint32_t *top = (const volatile uint32_t *)painted_from - OWN_WORDS;
    int n = DEPTH_WORDS;
    while (n > 0 && top[-n] == PAINT) {
        --n;
    }
    return 4u * (uint32_t)(n + OWN_WORDS);
}
