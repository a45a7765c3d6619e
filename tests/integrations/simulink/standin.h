/* What the stand-in for simstruc.h and the harness share. */
#ifndef STAND_IN_H
#define STAND_IN_H

#include <stddef.h>

typedef double real_T;
typedef int int_T;
typedef char char_T;

typedef struct {
    real_T value[2];
    size_t elements;
    int is_double;
    int is_complex;
} mxArray;

enum { MAX_PORTS = 40, MAX_PARAMETERS = 40, MAX_WIDTH = 600, CANARY = 8 };

enum { SIZES = 1, SAMPLE_TIMES = 2, WORK_WIDTHS = 4, CHECK = 8, RTW = 16, INITIALIZE = 32, OUTPUTS = 64, UPDATE = 128, TERMINATE = 256 };

typedef struct {
    int_T width;
    int_T type;
    int_T is_complex;
    int_T contiguous;
    int_T feed_through;
    real_T signal[CANARY + MAX_WIDTH + CANARY];
} standin_port;

typedef struct {
    int phase;
    int_T expected_parameters;
    int_T given_parameters;
    mxArray parameters[MAX_PARAMETERS];
    int_T tunable[MAX_PARAMETERS];
    int_T registered;
    int_T continuous_states, discrete_states, sample_times, dworks;
    int_T inputs, outputs;
    standin_port input[MAX_PORTS];
    standin_port output[MAX_PORTS];
    standin_port dwork;
    int_T dwork_named, dwork_is_state, sim_state, rtw_written;
    unsigned int options;
    real_T period, offset;
    const char_T *error;
} SimStruct;

/* What the trailer of the S-function hands over. */
typedef struct {
    const char *name;
    int is_mex;
    void (*sizes)(SimStruct *S);
    void (*sample_times)(SimStruct *S);
    void (*check_parameters)(SimStruct *S);
    void (*work_widths)(SimStruct *S);
    void (*rtw)(SimStruct *S);
    void (*initialize)(SimStruct *S);
    void (*outputs)(SimStruct *S, int_T tid);
    void (*update)(SimStruct *S, int_T tid);
    void (*terminate)(SimStruct *S);
} standin_methods;

extern const standin_methods standin_sfunction;

/* Ends the program with a line that says what was wrong. */
void standin_fail(const char *message);

#endif
