/* Compilers may call these for the driver's own copies. The generated controller does not need them. */
#include "board.h"

void *memcpy(void *to, const void *from, size_t size)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    while (size-- != 0u) {
        *t++ = *f++;
    }
    return to;
}

void *memset(void *to, int value, size_t size)
{
    unsigned char *t = to;
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
