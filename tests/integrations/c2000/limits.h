/* Stand-in for <limits.h> of a TI C28x compiler. */
#ifndef C2000_LIMITS_H
#define C2000_LIMITS_H

#define CHAR_BIT 16
#define INT_MAX 32767

#endif
