/* What a program needs of a board: words in and out, an end, marks for the instruction counter, the depth of the stack. */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>
#include <stdint.h>

/* Bytes from the host into `bytes`, at least one, at most `size`; 0 at the end of the stream. */
size_t board_read(void *bytes, size_t size);

/* All `size` bytes to the host. */
void board_write(const void *bytes, size_t size);

/* Ends the program with this exit code. */
void board_exit(int code);

/* Reads `count` 32-bit words in the byte order of the target; 0 at the end of the stream. Sends `words_put` before it waits. */
int words_get(void *words, size_t count);

/* Writes `count` 32-bit words. */
void words_put(const void *words, size_t count);

/* Sends what `words_put` has kept. */
void words_flush(void);

/* Empty. The instruction counter counts what runs between the two. */
void count_begin(void);
void count_end(void);

/* Fills the stack below the caller with a pattern; `stack_depth` gives the bytes below the caller's frame used since. */
void stack_paint(void);
uint32_t stack_depth(void);

/* <string.h> is not there for every compiler of a bare board. */
void *memcpy(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *a, const void *b, size_t size);

#endif
