/*
 * Stand-in for simstruc.h of MATLAB, written from the public documentation of level-2 C MEX S-functions, for tests without
 * MATLAB. It is strict: each function may be called in the phases in which Simulink allows it, ports must have been
 * declared as they are used, and what MATLAB alone offers is not declared where a real-time target compiles.
 */
#ifndef SIMSTRUC_STAND_IN_H
#define SIMSTRUC_STAND_IN_H

#include <stddef.h>

#ifndef S_FUNCTION_NAME
#error "S_FUNCTION_NAME comes before simstruc.h"
#endif
#if S_FUNCTION_LEVEL != 2
#error "S_FUNCTION_LEVEL is 2"
#endif

#include "standin.h"

#define SS_DOUBLE 0
#define COMPLEX_NO 0
#define USE_DEFAULT_SIM_STATE 1
#define SSWRITE_VALUE_NUM 11
#define SS_OPTION_EXCEPTION_FREE_CODE 0x1u
#define SS_OPTION_WORKS_WITH_CODE_REUSE 0x2u
#define SS_OPTION_USE_TLC_WITH_ACCELERATOR 0x4u
#define UNUSED_ARG(argument) ((void)(argument))

void ssSetNumSFcnParams(SimStruct *S, int_T count);
void ssSetSFcnParamTunable(SimStruct *S, int_T index, int_T tunable);
const mxArray *ssGetSFcnParam(SimStruct *S, int_T index);
real_T *mxGetPr(const mxArray *array);
void ssSetNumContStates(SimStruct *S, int_T count);
void ssSetNumDiscStates(SimStruct *S, int_T count);
int_T ssSetNumInputPorts(SimStruct *S, int_T count);
void ssSetInputPortWidth(SimStruct *S, int_T port, int_T width);
void ssSetInputPortDataType(SimStruct *S, int_T port, int_T type);
void ssSetInputPortComplexSignal(SimStruct *S, int_T port, int_T complex_signal);
void ssSetInputPortRequiredContiguous(SimStruct *S, int_T port, int_T contiguous);
void ssSetInputPortDirectFeedThrough(SimStruct *S, int_T port, int_T feed_through);
int_T ssSetNumOutputPorts(SimStruct *S, int_T count);
void ssSetOutputPortWidth(SimStruct *S, int_T port, int_T width);
void ssSetOutputPortDataType(SimStruct *S, int_T port, int_T type);
void ssSetOutputPortComplexSignal(SimStruct *S, int_T port, int_T complex_signal);
void ssSetNumSampleTimes(SimStruct *S, int_T count);
void ssSetNumRWork(SimStruct *S, int_T count);
void ssSetNumIWork(SimStruct *S, int_T count);
void ssSetNumPWork(SimStruct *S, int_T count);
void ssSetNumModes(SimStruct *S, int_T count);
void ssSetNumNonsampledZCs(SimStruct *S, int_T count);
int_T ssSetNumDWork(SimStruct *S, int_T count);
void ssSetDWorkWidth(SimStruct *S, int_T index, int_T width);
void ssSetDWorkDataType(SimStruct *S, int_T index, int_T type);
void ssSetDWorkComplexSignal(SimStruct *S, int_T index, int_T complex_signal);
void ssSetDWorkName(SimStruct *S, int_T index, const char_T *name);
void ssSetDWorkUsedAsDState(SimStruct *S, int_T index, int_T used);
void ssSetSimStateCompliance(SimStruct *S, int_T compliance);
void ssSetOptions(SimStruct *S, unsigned int options);
void ssSetSampleTime(SimStruct *S, int_T index, real_T period);
void ssSetOffsetTime(SimStruct *S, int_T index, real_T offset);
void ssSetModelReferenceSampleTimeDefaultInheritance(SimStruct *S);
const real_T *ssGetInputPortRealSignal(SimStruct *S, int_T port);
real_T *ssGetOutputPortRealSignal(SimStruct *S, int_T port);
void *ssGetDWork(SimStruct *S, int_T index);

#ifdef MATLAB_MEX_FILE
int_T ssGetNumSFcnParams(SimStruct *S);
int_T ssGetSFcnParamsCount(SimStruct *S);
void ssSetErrorStatus(SimStruct *S, const char_T *message);
const char_T *ssGetErrorStatus(SimStruct *S);
void ssRegAllTunableParamsAsRunTimeParams(SimStruct *S, const char_T *const *names);
int_T ssWriteRTWParamSettings(SimStruct *S, int_T count, int_T kind, const char_T *name, real_T value);
int mxIsDouble(const mxArray *array);
int mxIsComplex(const mxArray *array);
size_t mxGetNumberOfElements(const mxArray *array);
int mexPrintf(const char *text, ...);
#endif

#endif
