/*
 * Stand-in for <stdint.h> of a TI C28x compiler, where a char has 16 bits: there are no types of 8 bits, exact or fast.
 * What the generated code does not need is left out as well.
 */
#ifndef C2000_STDINT_H
#define C2000_STDINT_H

typedef short int16_t;
typedef unsigned short uint16_t;
typedef int int32_t;
typedef unsigned int uint32_t;

#endif
