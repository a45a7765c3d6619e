/* Stand-in for the trailer of a MEX file. */
#ifndef MATLAB_MEX_FILE
#error "simulink.c belongs into the MEX file only"
#endif
#include "methods.h"
