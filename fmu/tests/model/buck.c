/* An averaged buck converter as an FMU for co-simulation, FMI 2.0 (-DFMI=2) or 3.0 (-DFMI=3).
 *
 *   di/dt = (d v_in - v - r_l i) / L        dv/dt = (i - i_load - g_load v - p_load / v) / C
 *
 * The classical Runge-Kutta method in SUBSTEPS steps a communication step. No header of the standard is needed: these are its
 * functions, written from its text. Macros named FAULT_... make it fail, each in one way. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifndef SUBSTEPS
#define SUBSTEPS 20
#endif
#ifndef VERSION
#define VERSION (FMI == 2 ? "2.0" : "3.0")
#endif
#define TOKEN "{policyc-test-buck}"

enum { OK, WARNING, DISCARD, ERROR, FATAL };
/* value references */
enum { DUTY, I_LOAD, G_LOAD, P_LOAD, V_IN, L, C, R_L, V_START, I_START, V_OUT, I_L, I_OUT, SOURCE, COUNT };

typedef void (*log2_t)(void *, const char *, int, const char *, const char *, ...);
typedef void (*log3_t)(void *, int, const char *, const char *);
typedef struct {
    double x[COUNT];
    double time;
    int running;
    void *environment;
    log2_t log2;
    log3_t log3;
} model;

static int alive;

static void say(const model *m, int status, const char *text) {
#if FMI == 2
    if (m->log2) m->log2(m->environment, "buck", status, "logAll", text);
#else
    if (m->log3) m->log3(m->environment, status, "logAll", text);
#endif
}

static void defaults(model *m) {
    memset(m->x, 0, sizeof m->x);
    m->x[V_IN] = 200, m->x[L] = 2e-3, m->x[C] = 1.5e-3;
    m->time = 0, m->running = 0;
}

static void derivative(const double *p, const double *y, double *dy) {
    dy[0] = (p[DUTY] * p[V_IN] - y[1] - p[R_L] * y[0]) / p[L];
    dy[1] = (y[0] - p[I_LOAD] - p[G_LOAD] * y[1] - (p[P_LOAD] != 0 ? p[P_LOAD] / y[1] : 0)) / p[C];
}

static void integrate(model *m, double span) {
    double y[2] = {m->x[I_L], m->x[V_OUT]}, h = span / SUBSTEPS, k[4][2], z[2];
    for (int n = 0; n < SUBSTEPS; n++) {
        derivative(m->x, y, k[0]);
        for (int s = 1; s < 4; s++) {
            for (int j = 0; j < 2; j++) z[j] = y[j] + h * (s == 3 ? 1 : .5) * k[s - 1][j];
            derivative(m->x, z, k[s]);
        }
        for (int j = 0; j < 2; j++) y[j] += h / 6 * (k[0][j] + 2 * k[1][j] + 2 * k[2][j] + k[3][j]);
    }
    m->x[I_L] = y[0], m->x[V_OUT] = y[1];
}

static double value(const model *m, unsigned r) {
#ifdef FAULT_NAN_AT
    if (r == V_OUT && m->time >= FAULT_NAN_AT) return NAN;
#endif
    if (r == I_OUT) return m->x[I_LOAD] + m->x[G_LOAD] * m->x[V_OUT] + (m->x[P_LOAD] != 0 ? m->x[P_LOAD] / m->x[V_OUT] : 0);
    if (r == SOURCE) return m->x[V_IN];
    return m->x[r];
}

static int get(model *m, const uint32_t *r, size_t n, double *v) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] >= COUNT) return ERROR;
        v[k] = value(m, r[k]);
    }
    return OK;
}

static int set(model *m, const uint32_t *r, size_t n, const double *v) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] > I_START || (m->running && r[k] > V_IN)) return ERROR;
        m->x[r[k]] = v[k];
    }
    return OK;
}

static int begin(model *m) {
    m->x[V_OUT] = m->x[V_START], m->x[I_L] = m->x[I_START];
    m->running = 1;
    return OK;
}

static int step(model *m, double time, double span) {
    /* the importer keeps count as the model does; a share of a step is rounding */
    if (fabs(time - m->time) > 1e-9 * (fabs(time) + span)) {
        say(m, ERROR, "the communication point is not where the last step ended");
        return ERROR;
    }
#ifdef FAULT_ERROR_AT
    if (time >= FAULT_ERROR_AT) {
        say(m, ERROR, "the inductor has melted");
        return ERROR;
    }
#endif
#ifdef FAULT_FATAL_AT
    if (time >= FAULT_FATAL_AT) return FATAL;
#endif
#ifdef FAULT_DISCARD_AT
    if (time >= FAULT_DISCARD_AT) return DISCARD;
#endif
#ifdef FIXED_STEP
    if (fabs(span / FIXED_STEP - 1) > 1e-6) {
        say(m, ERROR, "another step");
        return ERROR;
    }
#endif
    integrate(m, span);
    m->time = time + span;
    return OK;
}

static void *instance(const char *token, void *environment) {
#ifdef FAULT_NO_INSTANCE
    return NULL;
#endif
#ifdef ONLY_ONE
    if (alive) return NULL;
#endif
    if (strcmp(token, TOKEN)) return NULL;
    model *m = calloc(1, sizeof *m);
    m->environment = environment;
    defaults(m);
    alive++;
    return m;
}

static void release(void *m) {
    alive--;
    free(m);
}

static int reset(model *m) {
#ifdef FAULT_NO_RESET
    return ERROR;
#endif
    defaults(m);
    return OK;
}

#define STUB(name) \
    int name(void) { return ERROR; }

#if FMI == 2
typedef struct {
    log2_t log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return VERSION; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const callbacks *c, int visible, int logging) {
    (void)name, (void)visible, (void)logging;
    if (type != 1 || strncmp(resources, "file:///", 8)) return NULL;
    model *m = instance(guid, c->environment);
    if (m) m->log2 = c->log;
    return m;
}
void fmi2FreeInstance(void *m) { release(m); }
int fmi2SetupExperiment(void *m, int has_tolerance, double tolerance, double start, int has_end, double end) {
    (void)has_tolerance, (void)tolerance, (void)has_end, (void)end;
    ((model *)m)->time = start;
    return OK;
}
int fmi2EnterInitializationMode(void *m) { return (void)m, OK; }
int fmi2ExitInitializationMode(void *m) { return begin(m); }
int fmi2Terminate(void *m) { return (void)m, OK; }
int fmi2Reset(void *m) { return reset(m); }
int fmi2GetReal(void *m, const uint32_t *r, size_t n, double *v) { return get(m, r, n, v); }
#ifdef FAULT_NO_SET_REAL
#define fmi2SetReal another_name
#endif
int fmi2SetReal(void *m, const uint32_t *r, size_t n, const double *v) { return set(m, r, n, v); }
int fmi2DoStep(void *m, double time, double span, int keep) { return (void)keep, step(m, time, span); }
int fmi2GetRealStatus(void *m, int kind, double *v) { return *v = ((model *)m)->time, kind == 2 ? OK : DISCARD; }
int fmi2SetDebugLogging(void *m, int on, size_t n, const char *const *c) { return (void)m, (void)on, (void)n, (void)c, OK; }
STUB(fmi2GetInteger) STUB(fmi2GetBoolean) STUB(fmi2GetString) STUB(fmi2SetInteger) STUB(fmi2SetBoolean) STUB(fmi2SetString)
STUB(fmi2GetFMUstate) STUB(fmi2SetFMUstate) STUB(fmi2FreeFMUstate) STUB(fmi2SerializedFMUstateSize) STUB(fmi2SerializeFMUstate)
STUB(fmi2DeSerializeFMUstate) STUB(fmi2GetDirectionalDerivative) STUB(fmi2SetRealInputDerivatives) STUB(fmi2GetRealOutputDerivatives)
STUB(fmi2CancelStep) STUB(fmi2GetStatus) STUB(fmi2GetIntegerStatus) STUB(fmi2GetBooleanStatus) STUB(fmi2GetStringStatus)
#else
const char *fmi3GetVersion(void) { return VERSION; }
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool events,
                                  bool early, const uint32_t *needed, size_t n, void *environment, log3_t log, void *update) {
    (void)name, (void)visible, (void)logging, (void)events, (void)early, (void)needed, (void)n, (void)update;
    if (resources && resources[strlen(resources) - 1] != '/') return NULL;
    model *m = instance(token, environment);
    if (m) m->log3 = log;
    return m;
}
void fmi3FreeInstance(void *m) { release(m); }
int fmi3EnterInitializationMode(void *m, bool has_tolerance, double tolerance, double start, bool has_end, double end) {
    (void)has_tolerance, (void)tolerance, (void)has_end, (void)end;
    ((model *)m)->time = start;
    return OK;
}
int fmi3ExitInitializationMode(void *m) { return begin(m); }
int fmi3Terminate(void *m) { return (void)m, OK; }
int fmi3Reset(void *m) { return reset(m); }
int fmi3GetFloat64(void *m, const uint32_t *r, size_t n, double *v, size_t nv) { return nv == n ? get(m, r, n, v) : ERROR; }
int fmi3SetFloat64(void *m, const uint32_t *r, size_t n, const double *v, size_t nv) { return nv == n ? set(m, r, n, v) : ERROR; }
int fmi3DoStep(void *m, double time, double span, bool keep, bool *event, bool *end, bool *early, double *last) {
    (void)keep;
    int status = step(m, time, span);
    *event = *early = *end = false;
#ifdef FAULT_END_AT
    *end = time >= FAULT_END_AT;
#endif
    *last = ((model *)m)->time;
    return status;
}
int fmi3SetDebugLogging(void *m, bool on, size_t n, const char *const *c) { return (void)m, (void)on, (void)n, (void)c, OK; }
void *fmi3InstantiateModelExchange(void) { return NULL; }
void *fmi3InstantiateScheduledExecution(void) { return NULL; }
#define BOTH(type) STUB(fmi3Get##type) STUB(fmi3Set##type)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(Int32) BOTH(UInt32) BOTH(Int64) BOTH(UInt64) BOTH(Boolean)
BOTH(String) BOTH(Binary) BOTH(Clock) BOTH(FMUState) BOTH(IntervalDecimal) BOTH(IntervalFraction) BOTH(ShiftDecimal) BOTH(ShiftFraction)
STUB(fmi3EnterEventMode) STUB(fmi3GetNumberOfVariableDependencies) STUB(fmi3GetVariableDependencies) STUB(fmi3FreeFMUState)
STUB(fmi3SerializedFMUStateSize) STUB(fmi3SerializeFMUState) STUB(fmi3DeserializeFMUState) STUB(fmi3GetDirectionalDerivative)
STUB(fmi3GetAdjointDerivative) STUB(fmi3EnterConfigurationMode) STUB(fmi3ExitConfigurationMode) STUB(fmi3EvaluateDiscreteStates)
STUB(fmi3UpdateDiscreteStates) STUB(fmi3EnterContinuousTimeMode) STUB(fmi3CompletedIntegratorStep) STUB(fmi3SetTime)
STUB(fmi3SetContinuousStates) STUB(fmi3GetContinuousStateDerivatives) STUB(fmi3GetEventIndicators) STUB(fmi3GetContinuousStates)
STUB(fmi3GetNominalsOfContinuousStates) STUB(fmi3GetNumberOfEventIndicators) STUB(fmi3GetNumberOfContinuousStates)
STUB(fmi3EnterStepMode) STUB(fmi3GetOutputDerivatives) STUB(fmi3ActivateModelPartition)
#endif
