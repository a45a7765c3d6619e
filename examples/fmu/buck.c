/* A lossy buck converter as an FMU for co-simulation, FMI 2.0: what a tool would export, written by hand for the page
 * docs/how-to/converter-as-fmu.md.
 *
 * Mean values over the switching period, on-resistance r_on, diode drop v_f, winding r_l:
 *   L di/dt = d (v_in - r_on i) - (1 - d) v_f - r_l i - v        C dv/dt = i - i_load - p_load / v
 * by the midpoint rule in steps of at most a microsecond. The diode ends the current at 0. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { DUTY, I_LOAD, P_LOAD, V_IN, L, C, R_ON, V_F, R_L, V_START, I_START, V_OUT, I_L, COUNT };

typedef struct {
    double x[COUNT];
    int running;
} model;

static const double DEFAULTS[COUNT] = {[V_IN] = 200, [L] = 2e-3, [C] = 1.5e-3, [R_ON] = .5, [V_F] = 2, [R_L] = .2, [V_START] = 100};

static void slope(const double *p, double i, double v, double *di, double *dv) {
    double d = p[DUTY], power = v >= 20 ? p[P_LOAD] / v : p[P_LOAD] * v / 400; /* a resistor below 20 V */
    *di = (d * (p[V_IN] - p[R_ON] * i) - (1 - d) * p[V_F] - p[R_L] * i - v) / p[L];
    if (i <= 0 && *di < 0) *di = 0;
    *dv = (i - p[I_LOAD] - power) / p[C];
}

int fmi2DoStep(model *m, double time, double span, int keep) {
    (void)time, (void)keep;
    int n = (int)ceil(span / 1e-6);
    double h = span / n, di, dv;
    for (int k = 0; k < n; k++) {
        slope(m->x, m->x[I_L], m->x[V_OUT], &di, &dv);
        slope(m->x, m->x[I_L] + h / 2 * di, m->x[V_OUT] + h / 2 * dv, &di, &dv);
        m->x[I_L] = fmax(0, m->x[I_L] + h * di);
        m->x[V_OUT] += h * dv;
    }
    return OK;
}

int fmi2SetReal(model *m, const unsigned *r, size_t n, const double *v) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] > I_START || (m->running && r[k] > V_IN)) return ERROR;
        m->x[r[k]] = v[k];
    }
    return OK;
}

int fmi2GetReal(model *m, const unsigned *r, size_t n, double *v) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] >= COUNT) return ERROR;
        v[k] = m->x[r[k]];
    }
    return OK;
}

int fmi2Reset(model *m) {
    memcpy(m->x, DEFAULTS, sizeof DEFAULTS);
    m->running = 0;
    return OK;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks, int visible, int logging) {
    (void)name, (void)resources, (void)callbacks, (void)visible, (void)logging;
    if (type != 1 || strcmp(guid, "{policyc-example-buck}")) return NULL;
    model *m = malloc(sizeof *m);
    if (m) fmi2Reset(m);
    return m;
}

int fmi2ExitInitializationMode(model *m) {
    m->x[V_OUT] = m->x[V_START], m->x[I_L] = m->x[I_START];
    m->running = 1;
    return OK;
}

const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
void fmi2FreeInstance(model *m) { free(m); }
int fmi2EnterInitializationMode(model *m) { return (void)m, OK; }
int fmi2Terminate(model *m) { return (void)m, OK; }
int fmi2SetupExperiment(model *m, int has_tolerance, double tolerance, double start, int has_end, double end) {
    return (void)m, (void)has_tolerance, (void)tolerance, (void)start, (void)has_end, (void)end, OK;
}
int fmi2SetDebugLogging(model *m, int on, size_t n, const char *const *names) { return (void)m, (void)on, (void)n, (void)names, OK; }

/* what the standard has beside these, and this model does not */
#define NOT_HERE(name) \
    int name(void) { return ERROR; }
NOT_HERE(fmi2GetInteger) NOT_HERE(fmi2GetBoolean) NOT_HERE(fmi2GetString) NOT_HERE(fmi2SetInteger) NOT_HERE(fmi2SetBoolean)
NOT_HERE(fmi2SetString) NOT_HERE(fmi2GetFMUstate) NOT_HERE(fmi2SetFMUstate) NOT_HERE(fmi2FreeFMUstate)
NOT_HERE(fmi2SerializedFMUstateSize) NOT_HERE(fmi2SerializeFMUstate) NOT_HERE(fmi2DeSerializeFMUstate)
NOT_HERE(fmi2GetDirectionalDerivative) NOT_HERE(fmi2SetRealInputDerivatives) NOT_HERE(fmi2GetRealOutputDerivatives)
NOT_HERE(fmi2CancelStep) NOT_HERE(fmi2GetStatus) NOT_HERE(fmi2GetRealStatus) NOT_HERE(fmi2GetIntegerStatus)
NOT_HERE(fmi2GetBooleanStatus) NOT_HERE(fmi2GetStringStatus)
