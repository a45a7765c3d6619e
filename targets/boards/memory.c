/* Compilers may call these for the driver's own copies. The generated controller does not need them. */
#include "board.h"

/* by words where both sides allow it, as a library does: some counts include these loops */
typedef uint32_t __attribute__((may_alias)) word;

void *memcpy(void *to, const void *from, size_t size)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    if ((((uintptr_t)t | (uintptr_t)f) & 3u) == 0u) {
        for (; size >= 4u; size -= 4u, t += 4, f += 4) {
            *(word *)t = *(const word *)f;
        }
    }
    while (size-- != 0u) {
        *t++ = *f++;
    }
    return to;
}

void *memset(void *to, int value, size_t size)
{
    unsigned char *t = to;
    const uint32_t pattern = (uint32_t)(unsigned char)value * 0x01010101u;
    if (((uintptr_t)t & 3u) == 0u) {
        for (; size >= 16u; size -= 16u, t += 16) {
            ((word *)t)[0] = pattern;
            ((word *)t)[1] = pattern;
            ((word *)t)[2] = pattern;
            ((word *)t)[3] = pattern;
        }
    }
    while (size-- != 0u) {
        *t++ = (unsigned char)value;
    }
    return to;
}

int memcmp(const void *a, const void *b, size_t size)
{
    const unsigned char *x = a;
    const unsigned char *y = b;
    while (size-- != 0u) {
        if (*x != *y) {
            return (int)*x - (int)*y;
        }
        ++x;
        ++y;
    }
    return 0;
}

#if defined(__arm__)
/* The names under which clang asks for the same on Arm (run-time ABI, 4.3.4). */
void __aeabi_memcpy(void *to, const void *from, size_t size);
void __aeabi_memcpy4(void *to, const void *from, size_t size);
void __aeabi_memcpy8(void *to, const void *from, size_t size);
void __aeabi_memset(void *to, size_t size, int value);
void __aeabi_memset4(void *to, size_t size, int value);
void __aeabi_memset8(void *to, size_t size, int value);
void __aeabi_memclr(void *to, size_t size);
void __aeabi_memclr4(void *to, size_t size);
void __aeabi_memclr8(void *to, size_t size);

void __aeabi_memcpy(void *to, const void *from, size_t size)
{
    (void)memcpy(to, from, size);
}

void __aeabi_memcpy4(void *to, const void *from, size_t size)
{
    (void)memcpy(to, from, size);
}

void __aeabi_memcpy8(void *to, const void *from, size_t size)
{
    (void)memcpy(to, from, size);
}

void __aeabi_memset(void *to, size_t size, int value)
{
    (void)memset(to, value, size);
}

void __aeabi_memset4(void *to, size_t size, int value)
{
    (void)memset(to, value, size);
}

void __aeabi_memset8(void *to, size_t size, int value)
{
    (void)memset(to, value, size);
}

void __aeabi_memclr(void *to, size_t size)
{
    (void)memset(to, 0, size);
}

void __aeabi_memclr4(void *to, size_t size)
{
    (void)memset(to, 0, size);
}

void __aeabi_memclr8(void *to, size_t size)
{
    (void)memset(to, 0, size);
}
#endif
