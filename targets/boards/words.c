/* Words between the program and the host, through buffers: a call to the host costs far more than a word. */
#include "board.h"

#define BUFFER_BYTES 2048u

static unsigned char in[BUFFER_BYTES];
static size_t in_next, in_end;
static unsigned char out[BUFFER_BYTES];
static size_t out_end;

void words_flush(void)
{
    size_t size = out_end;
    /* first, so that a fault on the way does not send twice */
    out_end = 0u;
    if (size != 0u) {
        board_write(out, size);
    }
}

int words_get(void *words, size_t count)
{
    unsigned char *bytes = words;
    size_t left = 4u * count;
    while (left != 0u) {
        if (in_next == in_end) {
            words_flush();
            in_next = 0u;
            in_end = board_read(in, BUFFER_BYTES);
            if (in_end == 0u) {
                return 0;
            }
        }
        *bytes++ = in[in_next++];
        --left;
    }
    return 1;
}

void words_put(const void *words, size_t count)
{
    const unsigned char *bytes = words;
    size_t left = 4u * count;
    while (left != 0u) {
        if (out_end == BUFFER_BYTES) {
            words_flush();
        }
        out[out_end++] = *bytes++;
        --left;
    }
}
