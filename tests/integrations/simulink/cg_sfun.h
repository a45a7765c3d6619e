/* Stand-in for the trailer of a real-time target. */
#ifdef MATLAB_MEX_FILE
#error "cg_sfun.h belongs into the real-time target only"
#endif
#if defined(MDL_CHECK_PARAMETERS) || defined(MDL_RTW) || defined(MDL_SET_WORK_WIDTHS)
#error "methods for MATLAB stand outside of #if defined(MATLAB_MEX_FILE)"
#endif
#include "methods.h"
