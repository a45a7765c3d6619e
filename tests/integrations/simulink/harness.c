/*
 * Drives the S-function as Simulink does and compares every output with the core: two instances side by side, outputs
 * asked for several times per step (once with other inputs, as in an algebraic loop), parameters changed in between.
 * config.h, written by the test, says what the policy's ports and coefficients are.
 */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "standin.h"
#include "config.h"

static const real_T canary = 1234.5678e200;
static const real_T garbage = -7.0e77;

static unsigned long random_state = 2463534242ul;

static unsigned long draw(void)
{
    random_state = (random_state * 1664525ul + 1013904223ul) & 0xFFFFFFFFul;
    return random_state >> 8;
}

static double uniform(void)
{
    return (double)draw() / 16777216.0;
}

/* One instance, and the core beside it. */
typedef struct {
    SimStruct s;
    CONTROLLER(state) core;
    int refused;
    double duty_before;
} instance;

static void expect(int holds, const char *message)
{
    if (!holds) {
        standin_fail(message);
    }
}

static void guard(standin_port *port, real_T fill)
{
    int_T i;
    for (i = 0; i < CANARY + MAX_WIDTH + CANARY; ++i) {
        port->signal[i] = canary;
    }
    for (i = 0; i < port->width; ++i) {
        port->signal[CANARY + i] = fill;
    }
}

static void check_guard(const standin_port *port, const char *message)
{
    int_T i;
    for (i = 0; i < CANARY; ++i) {
        expect(memcmp(&port->signal[i], &canary, sizeof(canary)) == 0, message);
        expect(memcmp(&port->signal[CANARY + port->width + i], &canary, sizeof(canary)) == 0, message);
    }
}

static void check_guards(const instance *own)
{
    int_T port;
    check_guard(&own->s.dwork, "memory beside the DWork was written");
    for (port = 0; port < own->s.inputs; ++port) {
        check_guard(&own->s.input[port], "memory beside an input was written");
    }
    for (port = 0; port < own->s.outputs; ++port) {
        check_guard(&own->s.output[port], "memory beside an output was written");
    }
}

static void set_parameter(SimStruct *S, int index, double value)
{
    S->parameters[index].value[0] = value;
    S->parameters[index].elements = 1;
    S->parameters[index].is_double = 1;
    S->parameters[index].is_complex = 0;
}

static void prepare(SimStruct *S, int diagnostics)
{
    int i;
    memset(S, 0, sizeof(*S));
    S->given_parameters = COEFFICIENTS + 1;
    for (i = 0; i < COEFFICIENTS; ++i) {
        set_parameter(S, i, coefficient_values[i]);
    }
    set_parameter(S, COEFFICIENTS, (double)diagnostics);
    for (i = 0; i < MAX_PORTS; ++i) {
        S->input[i].type = -1;
        S->input[i].is_complex = -1;
        S->output[i].type = -1;
        S->output[i].is_complex = -1;
    }
    S->dwork.type = -1;
    S->dwork.is_complex = -1;
    S->phase = SIZES;
    standin_sfunction.sizes(S);
}

static int accepted(const double *values)
{
    CONTROLLER(state) scratch;
    CONTROLLER_CALL(init)(&scratch);
    return set_mapping(&scratch, values) != 0u;
}

/* A wrong number or kind of parameters leaves the ports undeclared or sets an error. */
static void parameters_are_checked(void)
{
    static SimStruct S;
    int i;
    if (standin_sfunction.is_mex == 0) {
        expect(standin_sfunction.check_parameters == NULL, "mdlCheckParameters on a real-time target");
        return;
    }
    expect(standin_sfunction.check_parameters != NULL, "mdlCheckParameters is missing");
    prepare(&S, 0);
    expect((S.error == NULL) && (S.inputs == SIGNALS + 1), "the generated parameters are refused");
    prepare(&S, 1);
    S.phase = CHECK;
    for (i = 0; i <= COEFFICIENTS; ++i) {
        static const double wrong[5] = { 1.0e6, -1.0e6, 0.0, 0.0, 0.0 };
        int kind;
        for (kind = 0; kind < 5; ++kind) {
            mxArray kept = S.parameters[i];
            S.error = NULL;
            S.parameters[i].value[0] = (kind == 2) ? (wrong[2] / wrong[3]) : ((kind < 2) ? wrong[kind] : kept.value[0]);
            S.parameters[i].elements = (kind == 3) ? 2u : 1u;
            S.parameters[i].is_double = (kind == 4) ? 0 : 1;
            standin_sfunction.check_parameters(&S);
            expect(S.error != NULL, "a wrong parameter is accepted");
            S.parameters[i] = kept;
            S.parameters[i].is_complex = 1;
            S.error = NULL;
            standin_sfunction.check_parameters(&S);
            expect(S.error != NULL, "a complex parameter is accepted");
            S.parameters[i] = kept;
        }
    }
    S.error = NULL;
    standin_sfunction.check_parameters(&S);
    expect(S.error == NULL, "the generated parameters are refused");
    memset(&S, 0, sizeof(S));
    S.given_parameters = COEFFICIENTS;
    S.phase = SIZES;
    for (i = 0; i < COEFFICIENTS; ++i) {
        set_parameter(&S, i, coefficient_values[i]);
    }
    standin_sfunction.sizes(&S);
    expect((S.inputs == 0) && (S.dworks == 0), "sizes go on with a parameter missing");
}

static void start(instance *own, int diagnostics)
{
    SimStruct *S = &own->s;
    int_T port;
    prepare(S, diagnostics);
    expect(S->error == NULL, "sizes set an error");
    expect(S->expected_parameters == COEFFICIENTS + 1, "number of parameters");
    expect((S->inputs == SIGNALS + 1) && (S->outputs == ((diagnostics != 0) ? (2 * DUTIES) + 3 : (2 * DUTIES) + 1)), "number of ports");
    expect((S->continuous_states == 0) && (S->discrete_states == 0), "states");
    expect((S->sample_times == 1) && (S->dworks == 1), "sample times or DWork");
    expect((S->dwork_named == 1) && (S->dwork_is_state == 1), "the DWork has no name or is no state");
    expect((S->dwork.width > 0) && (S->dwork.width <= MAX_WIDTH), "width of the DWork");
    expect(S->sim_state == 1, "SimState compliance");
    expect(S->options == 7u, "options");
    for (port = 0; port < S->inputs; ++port) {
        expect((S->input[port].width == 1) && (S->input[port].type == 0), "an input is no scalar double");
    }
    S->phase = SAMPLE_TIMES;
    standin_sfunction.sample_times(S);
    expect((fabs(S->period - PERIOD) <= 1e-12 * PERIOD) && (memcmp(&S->offset, &coefficient_zero, sizeof(double)) == 0), "sample time");
    if (standin_sfunction.work_widths != NULL) {
        S->phase = WORK_WIDTHS;
        standin_sfunction.work_widths(S);
    }
    if (standin_sfunction.is_mex != 0) {
        expect(S->registered == COEFFICIENTS, "run-time parameters");
        expect(standin_sfunction.rtw != NULL, "mdlRTW is missing");
        S->phase = RTW;
        standin_sfunction.rtw(S);
        expect(S->rtw_written == 1, "mdlRTW wrote nothing");
    }
    guard(&S->dwork, garbage);
    for (port = 0; port < S->inputs; ++port) {
        guard(&S->input[port], 0.0);
    }
    for (port = 0; port < S->outputs; ++port) {
        guard(&S->output[port], garbage);
    }
    S->phase = INITIALIZE;
    standin_sfunction.initialize(S);
    CONTROLLER_CALL(init)(&own->core);
    own->refused = 0;
}

/* Mostly plausible, sometimes outside, not a number, infinite or larger than any float. */
static double value_for(int signal)
{
    const double width = highs[signal] - lows[signal];
    switch (draw() % 40ul) {
    case 0: return NAN_VALUE;
    case 1: return HUGE_VAL;
    case 2: return -1.0e300;
    case 3: return highs[signal] + (0.1 * width);
    case 4: return lows[signal] - (0.1 * width);
    default: return lows[signal] + (width * uniform());
    }
}

static void new_inputs(double *inputs)
{
    int i;
    const int plausible = (draw() % 4ul) != 0ul;
    for (i = 0; i < SIGNALS; ++i) {
        inputs[i] = plausible ? (lows[i] + ((highs[i] - lows[i]) * uniform())) : value_for(i);
    }
    inputs[SIGNALS] = ((draw() % 50ul) == 0ul) ? 0.0 : 1.0;
}

static void put_inputs(instance *own, const double *inputs)
{
    int_T port;
    for (port = 0; port < own->s.inputs; ++port) {
        own->s.input[port].signal[CANARY] = inputs[port];
    }
}

static void new_coefficients(instance *own)
{
#if COEFFICIENTS > 0
    double values[COEFFICIENTS];
    int i;
    for (i = 0; i < COEFFICIENTS; ++i) {
        values[i] = coefficient_lows[i] + ((coefficient_highs[i] - coefficient_lows[i]) * (1.2 * uniform() - 0.1));
    }
    if (standin_sfunction.is_mex != 0) {
        SimStruct trial = own->s;
        for (i = 0; i < COEFFICIENTS; ++i) {
            set_parameter(&trial, i, values[i]);
        }
        trial.phase = CHECK;
        trial.error = NULL;
        standin_sfunction.check_parameters(&trial);
        expect((trial.error == NULL) == (accepted(values) != 0), "mdlCheckParameters and the core disagree");
        if (trial.error != NULL) {
            return;
        }
    }
    for (i = 0; i < COEFFICIENTS; ++i) {
        set_parameter(&own->s, i, values[i]);
    }
#else
    (void)own;
    (void)accepted;
    (void)uniform;
#endif
}

static void outputs(instance *own, const double *inputs)
{
    static real_T before[MAX_WIDTH];
    const size_t bytes = (size_t)own->s.dwork.width * sizeof(real_T);
    int_T port;
    memcpy(before, &own->s.dwork.signal[CANARY], bytes);
    put_inputs(own, inputs);
    for (port = 0; port < own->s.outputs; ++port) {
        guard(&own->s.output[port], garbage);
    }
    own->s.phase = OUTPUTS;
    standin_sfunction.outputs(&own->s, 0);
    expect(memcmp(before, &own->s.dwork.signal[CANARY], bytes) == 0, "mdlOutputs changed the state");
    check_guards(own);
}

static int same(double found, double expected)
{
    return memcmp(&found, &expected, sizeof(found)) == 0;
}

static void compare(instance *own, const double *inputs, int diagnostics)
{
    CONTROLLER(measurement) measured;
    CONTROLLER(command) command;
    const double refused = (own->refused != 0) ? 65536.0 : 0.0;
    double duties[DUTIES];
    double actions[DUTIES];
    int duty;
    measure(inputs, &measured);
    if (inputs[SIGNALS] > 0.5) {
        CONTROLLER_CALL(eval)(&own->core, &measured, &command);
        commanded(&command, duties, actions);
    } else {
        for (duty = 0; duty < DUTIES; ++duty) {
            duties[duty] = (double)(number)fallbacks[duty];
            actions[duty] = 0.0;
        }
        command.status = 2u;
    }
    for (duty = 0; duty < DUTIES; ++duty) {
        expect(same(own->s.output[duty].signal[CANARY], duties[duty]), "duty");
        expect(same(own->s.output[DUTIES + duty].signal[CANARY], actions[duty]), "action");
    }
    expect(same(own->s.output[2 * DUTIES].signal[CANARY], (double)command.status + refused), "status");
    if (diagnostics != 0) {
        number observation[FEATURES];
        number q[ACTIONS];
        int i;
        CONTROLLER_CALL(observe)(&own->core, &measured, observation);
        CONTROLLER_CALL(q_values)(observation, q);
        for (i = 0; i < ACTIONS; ++i) {
            expect(same(own->s.output[(2 * DUTIES) + 1].signal[CANARY + i], (double)q[i]), "Q values");
        }
        for (i = 0; i < FEATURES; ++i) {
            expect(same(own->s.output[(2 * DUTIES) + 2].signal[CANARY + i], (double)observation[i]), "observation");
        }
    }
}

static void update(instance *own, const double *inputs)
{
    CONTROLLER(measurement) measured;
    CONTROLLER(command) command;
    double values[MAX_PARAMETERS];
    int i;
    own->s.phase = UPDATE;
    standin_sfunction.update(&own->s, 0);
    check_guards(own);
    for (i = 0; i <= SIGNALS; ++i) {
        expect(memcmp(&own->s.input[i].signal[CANARY], &inputs[i], sizeof(double)) == 0, "an input was written");
    }
    measure(inputs, &measured);
    if (inputs[SIGNALS] > 0.5) {
        CONTROLLER_CALL(step)(&own->core, &measured, &command);
    } else {
        CONTROLLER_CALL(reset)(&own->core);
    }
    for (i = 0; i < COEFFICIENTS; ++i) {
        values[i] = own->s.parameters[i].value[0];
    }
    own->refused = (set_mapping(&own->core, values) != 0u) ? 0 : 1;
}

static void step(instance *own, long number, int diagnostics)
{
    double inputs[SIGNALS + 1];
    double others[SIGNALS + 1];
    if ((draw() % 100ul) == 0ul) {
        new_coefficients(own);
    }
    new_inputs(inputs);
    new_inputs(others);
    outputs(own, inputs);
    compare(own, inputs, diagnostics);
    if ((number % 3l) == 0l) {
        outputs(own, others);
        compare(own, others, diagnostics);
    }
    outputs(own, inputs);
    compare(own, inputs, diagnostics);
    if ((number % 3l) == 1l) {
        outputs(own, others);
        put_inputs(own, inputs);
    }
    update(own, inputs);
}

static void run(long steps, int diagnostics)
{
    static instance first;
    static instance second;
    long number;
    start(&first, diagnostics);
    start(&second, diagnostics);
    for (number = 0; number < steps; ++number) {
        step(&first, number, diagnostics);
        if ((draw() % 3ul) != 0ul) {
            step(&second, number, diagnostics);
        }
        if ((draw() % 5000ul) == 0ul) {
            double values[MAX_PARAMETERS];
            int i;
            second.s.phase = INITIALIZE;
            standin_sfunction.initialize(&second.s);
            CONTROLLER_CALL(init)(&second.core);
            for (i = 0; i < COEFFICIENTS; ++i) {
                values[i] = second.s.parameters[i].value[0];
            }
            second.refused = (set_mapping(&second.core, values) != 0u) ? 0 : 1;
        }
    }
    first.s.phase = TERMINATE;
    standin_sfunction.terminate(&first.s);
    second.s.phase = TERMINATE;
    standin_sfunction.terminate(&second.s);
}

int main(int argc, char **argv)
{
    const long steps = (argc > 1) ? atol(argv[1]) : 20000l;
    expect(strcmp(standin_sfunction.name, NAME) == 0, "S_FUNCTION_NAME is not the name of the file");
    parameters_are_checked();
    run(steps, 0);
    run(steps / 10l, 1);
    printf("PASS: %ld steps, %s\n", steps, (standin_sfunction.is_mex != 0) ? "MEX" : "real time");
    return 0;
}
