/* Semihosting (ARM IHI 0076 and its RISC-V binding): the standard streams of the emulator as files. */
#include "board.h"

#define SYS_OPEN 0x01u
#define SYS_WRITE 0x05u
#define SYS_READ 0x06u
#define SYS_EXIT_EXTENDED 0x20u

#define MODE_READ_BINARY 1u
#define MODE_APPEND_BINARY 9u
#define APPLICATION_EXIT 0x20026u

/* In the start file: the trap of this processor. */
uintptr_t semihost(uintptr_t operation, const uintptr_t *arguments);

/* Handle of a file of the host, opened at the first use. */
static uintptr_t file(uintptr_t *handle, const char *path, size_t length, uintptr_t mode)
{
    if (*handle == 0u) {
        uintptr_t arguments[3];
        arguments[0] = (uintptr_t)path;
        arguments[1] = mode;
        arguments[2] = length;
        *handle = semihost(SYS_OPEN, arguments) + 1u;
    }
    return *handle - 1u;
}

size_t board_read(void *bytes, size_t size)
{
    static const char path[] = "/dev/stdin";
    static uintptr_t handle;
    uintptr_t arguments[3];
    uintptr_t left;
    arguments[0] = file(&handle, path, sizeof path - 1u, MODE_READ_BINARY);
    arguments[1] = (uintptr_t)bytes;
    arguments[2] = size;
    left = semihost(SYS_READ, arguments);
    return left > size ? 0u : size - left;
}

void board_write(const void *bytes, size_t size)
{
    static const char path[] = "/dev/stdout";
    static uintptr_t handle;
    const unsigned char *next = bytes;
    while (size != 0u) {
        uintptr_t arguments[3];
        uintptr_t left;
        arguments[0] = file(&handle, path, sizeof path - 1u, MODE_APPEND_BINARY);
        arguments[1] = (uintptr_t)next;
        arguments[2] = size;
        left = semihost(SYS_WRITE, arguments);
        if (left >= size) {
            board_exit(98);
        }
        next += size - left;
        size = left;
    }
}

void board_exit(int code)
{
    uintptr_t arguments[2];
    words_flush();
    arguments[0] = APPLICATION_EXIT;
    arguments[1] = (uintptr_t)code;
    for (;;) {
        (void)semihost(SYS_EXIT_EXTENDED, arguments);
    }
}
