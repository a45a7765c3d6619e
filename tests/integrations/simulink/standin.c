/* The functions of the stand-in for simstruc.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define S_FUNCTION_NAME standin
#define S_FUNCTION_LEVEL 2
#ifndef MATLAB_MEX_FILE
#define MATLAB_MEX_FILE
#endif
#include "simstruc.h"

void standin_fail(const char *message)
{
    printf("FAIL: %s\n", message);
    exit(1);
}

static void in_phase(const SimStruct *S, int phases, const char *function)
{
    if ((S->phase & phases) == 0) {
        printf("FAIL: %s in the wrong phase %d\n", function, S->phase);
        exit(1);
    }
}

static standin_port *port_of(standin_port *ports, int_T count, int_T port)
{
    if ((port < 0) || (port >= count)) {
        standin_fail("a port that was not declared");
    }
    return &ports[port];
}

static void declared(const standin_port *port)
{
    if ((port->width < 1) || (port->type != SS_DOUBLE) || (port->is_complex != COMPLEX_NO)) {
        standin_fail("width, data type or complexity of a port was not declared");
    }
}

static int_T count_of(int_T count)
{
    if ((count < 0) || (count > MAX_PORTS)) {
        standin_fail("number of ports");
    }
    return count;
}

/* Sizes */

void ssSetNumSFcnParams(SimStruct *S, int_T count)
{
    in_phase(S, SIZES, "ssSetNumSFcnParams");
    S->expected_parameters = count;
}

void ssSetSFcnParamTunable(SimStruct *S, int_T index, int_T tunable)
{
    in_phase(S, SIZES, "ssSetSFcnParamTunable");
    if ((index < 0) || (index >= S->given_parameters)) {
        standin_fail("ssSetSFcnParamTunable: no such parameter");
    }
    S->tunable[index] = tunable;
}

const mxArray *ssGetSFcnParam(SimStruct *S, int_T index)
{
    if ((index < 0) || (index >= S->given_parameters)) {
        standin_fail("ssGetSFcnParam: no such parameter");
    }
    return &S->parameters[index];
}

real_T *mxGetPr(const mxArray *array)
{
    return (real_T *)(size_t)array->value;
}

#define SETTER(function, field) \
    void function(SimStruct *S, int_T count) \
    { \
        in_phase(S, SIZES, #function); \
        S->field = count; \
    }
SETTER(ssSetNumContStates, continuous_states)
SETTER(ssSetNumDiscStates, discrete_states)
SETTER(ssSetNumSampleTimes, sample_times)
SETTER(ssSetSimStateCompliance, sim_state)

#define NONE(function) \
    void function(SimStruct *S, int_T count) \
    { \
        in_phase(S, SIZES, #function); \
        if (count != 0) { \
            standin_fail(#function ": none is expected"); \
        } \
    }
NONE(ssSetNumRWork)
NONE(ssSetNumIWork)
NONE(ssSetNumPWork)
NONE(ssSetNumModes)
NONE(ssSetNumNonsampledZCs)

int_T ssSetNumInputPorts(SimStruct *S, int_T count)
{
    in_phase(S, SIZES, "ssSetNumInputPorts");
    S->inputs = count_of(count);
    return 1;
}

int_T ssSetNumOutputPorts(SimStruct *S, int_T count)
{
    in_phase(S, SIZES, "ssSetNumOutputPorts");
    S->outputs = count_of(count);
    return 1;
}

#define PORT_SETTER(function, ports, count, field) \
    void function(SimStruct *S, int_T port, int_T value) \
    { \
        in_phase(S, SIZES, #function); \
        port_of(S->ports, S->count, port)->field = value; \
    }
PORT_SETTER(ssSetInputPortWidth, input, inputs, width)
PORT_SETTER(ssSetInputPortDataType, input, inputs, type)
PORT_SETTER(ssSetInputPortComplexSignal, input, inputs, is_complex)
PORT_SETTER(ssSetInputPortRequiredContiguous, input, inputs, contiguous)
PORT_SETTER(ssSetInputPortDirectFeedThrough, input, inputs, feed_through)
PORT_SETTER(ssSetOutputPortWidth, output, outputs, width)
PORT_SETTER(ssSetOutputPortDataType, output, outputs, type)
PORT_SETTER(ssSetOutputPortComplexSignal, output, outputs, is_complex)

int_T ssSetNumDWork(SimStruct *S, int_T count)
{
    in_phase(S, SIZES, "ssSetNumDWork");
    if (count != 1) {
        standin_fail("ssSetNumDWork: one is expected");
    }
    S->dworks = count;
    return 1;
}

#define DWORK_SETTER(function, target) \
    void function(SimStruct *S, int_T index, int_T value) \
    { \
        in_phase(S, SIZES, #function); \
        if ((index < 0) || (index >= S->dworks)) { \
            standin_fail(#function ": no such DWork"); \
        } \
        target = value; \
    }
DWORK_SETTER(ssSetDWorkWidth, S->dwork.width)
DWORK_SETTER(ssSetDWorkDataType, S->dwork.type)
DWORK_SETTER(ssSetDWorkComplexSignal, S->dwork.is_complex)
DWORK_SETTER(ssSetDWorkUsedAsDState, S->dwork_is_state)

void ssSetDWorkName(SimStruct *S, int_T index, const char_T *name)
{
    in_phase(S, SIZES, "ssSetDWorkName");
    S->dwork_named = ((index == 0) && (name[0] != '\0')) ? 1 : 0;
}

void ssSetOptions(SimStruct *S, unsigned int options)
{
    in_phase(S, SIZES, "ssSetOptions");
    S->options = options;
}

/* Sample times */

void ssSetSampleTime(SimStruct *S, int_T index, real_T period)
{
    in_phase(S, SAMPLE_TIMES, "ssSetSampleTime");
    if (index == 0) {
        S->period = period;
    }
}

void ssSetOffsetTime(SimStruct *S, int_T index, real_T offset)
{
    in_phase(S, SAMPLE_TIMES, "ssSetOffsetTime");
    if (index == 0) {
        S->offset = offset;
    }
}

void ssSetModelReferenceSampleTimeDefaultInheritance(SimStruct *S)
{
    in_phase(S, SAMPLE_TIMES, "ssSetModelReferenceSampleTimeDefaultInheritance");
}

/* Run */

const real_T *ssGetInputPortRealSignal(SimStruct *S, int_T port)
{
    const standin_port *found = port_of(S->input, S->inputs, port);
    in_phase(S, OUTPUTS | UPDATE, "ssGetInputPortRealSignal");
    declared(found);
    if (found->contiguous != 1) {
        standin_fail("ssGetInputPortRealSignal wants RequiredContiguous");
    }
    if ((S->phase == OUTPUTS) && (found->feed_through != 1)) {
        standin_fail("an input is read in mdlOutputs without DirectFeedThrough");
    }
    return &found->signal[CANARY];
}

real_T *ssGetOutputPortRealSignal(SimStruct *S, int_T port)
{
    standin_port *found = port_of(S->output, S->outputs, port);
    in_phase(S, OUTPUTS, "ssGetOutputPortRealSignal");
    declared(found);
    return &found->signal[CANARY];
}

void *ssGetDWork(SimStruct *S, int_T index)
{
    in_phase(S, INITIALIZE | OUTPUTS | UPDATE, "ssGetDWork");
    if ((index < 0) || (index >= S->dworks)) {
        standin_fail("ssGetDWork: no such DWork");
    }
    declared(&S->dwork);
    return &S->dwork.signal[CANARY];
}

/* MATLAB */

int_T ssGetNumSFcnParams(SimStruct *S)
{
    return S->expected_parameters;
}

int_T ssGetSFcnParamsCount(SimStruct *S)
{
    return S->given_parameters;
}

void ssSetErrorStatus(SimStruct *S, const char_T *message)
{
    S->error = message;
}

const char_T *ssGetErrorStatus(SimStruct *S)
{
    return S->error;
}

void ssRegAllTunableParamsAsRunTimeParams(SimStruct *S, const char_T *const *names)
{
    int_T index;
    in_phase(S, WORK_WIDTHS, "ssRegAllTunableParamsAsRunTimeParams");
    for (index = 0; index < S->given_parameters; ++index) {
        if (S->tunable[index] != 0) {
            if (names[S->registered][0] == '\0') {
                standin_fail("a tunable parameter has no name");
            }
            S->registered = S->registered + 1;
        }
    }
}

int_T ssWriteRTWParamSettings(SimStruct *S, int_T count, int_T kind, const char_T *name, real_T value)
{
    in_phase(S, RTW, "ssWriteRTWParamSettings");
    S->rtw_written = ((count == 1) && (kind == SSWRITE_VALUE_NUM) && (name[0] != '\0') && !isnan(value)) ? 1 : 0;
    return 1;
}

int mxIsDouble(const mxArray *array)
{
    return array->is_double;
}

int mxIsComplex(const mxArray *array)
{
    return array->is_complex;
}

size_t mxGetNumberOfElements(const mxArray *array)
{
    return array->elements;
}
