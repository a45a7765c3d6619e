/* FMI 2 for importer.c, with the types of the standard headers. */
#include "fmi2FunctionTypes.h"

#define FUNCTIONS(X) \
    X(fmi2GetVersion) X(fmi2Instantiate) X(fmi2FreeInstance) X(fmi2SetupExperiment) X(fmi2EnterInitializationMode) \
    X(fmi2ExitInitializationMode) X(fmi2Terminate) X(fmi2Reset) X(fmi2GetReal) X(fmi2GetInteger) X(fmi2GetBoolean) \
    X(fmi2GetString) X(fmi2SetReal) X(fmi2SetInteger) X(fmi2SetBoolean) X(fmi2GetFMUstate) X(fmi2SetFMUstate) \
    X(fmi2FreeFMUstate) X(fmi2SerializedFMUstateSize) X(fmi2SerializeFMUstate) X(fmi2DeSerializeFMUstate) \
    X(fmi2GetDirectionalDerivative) X(fmi2SetRealInputDerivatives) X(fmi2GetRealOutputDerivatives) X(fmi2DoStep) \
    X(fmi2CancelStep) X(fmi2GetStatus) X(fmi2GetRealStatus) X(fmi2GetBooleanStatus)
#define TYPE_OF(f) f##TYPE

#include "functions.h"

#define VERSION "2.0"
#define OK fmi2OK
#define WARNING fmi2Warning
#define ERROR fmi2Error
typedef fmi2Status status_type;
typedef fmi2Component instance_type;
typedef fmi2FMUstate state_type;
typedef fmi2Byte byte_type;

static unsigned logged;
static unsigned allocated;

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String message, ...)
{
    (void)environment;
    ++logged;
    fprintf(stderr, "%s %d %s %s\n", name, (int)status, category, message);
}

static void *allocate(size_t count, size_t size)
{
    ++allocated;
    return calloc(count, size);
}

static void release(void *memory)
{
    --allocated;
    free(memory);
}

static const fmi2CallbackFunctions callbacks = { log_message, allocate, release, NULL, NULL };

static instance_type instantiate(const api *f, const char *token)
{
    return f->fmi2Instantiate("instance", fmi2CoSimulation, token, "", &callbacks, fmi2False, fmi2False);
}

static instance_type instantiate_otherwise(const api *f)
{
    return f->fmi2Instantiate("instance", fmi2ModelExchange, TOKEN, "", &callbacks, fmi2False, fmi2False);
}

static status_type enter(const api *f, instance_type c, double start)
{
    const status_type status = f->fmi2SetupExperiment(c, fmi2False, 0.0, start, fmi2False, 0.0);
    return (status == OK) ? f->fmi2EnterInitializationMode(c) : status;
}

static status_type set(const api *f, instance_type c, unsigned reference, char kind, double value)
{
    const fmi2ValueReference r = reference;
    const fmi2Integer integer = (fmi2Integer)value;

    switch (kind) {
    case 'r':
        return f->fmi2SetReal(c, &r, 1u, &value);
    case 'i':
        return f->fmi2SetInteger(c, &r, 1u, &integer);
    default:
        return f->fmi2SetBoolean(c, &r, 1u, &integer);
    }
}

static status_type get(const api *f, instance_type c, unsigned reference, char kind, double *value)
{
    const fmi2ValueReference r = reference;
    fmi2Integer integer = 0;
    status_type status = (kind == 'r') ? f->fmi2GetReal(c, &r, 1u, value) : f->fmi2GetInteger(c, &r, 1u, &integer);

    if (kind != 'r') {
        *value = integer;
    }
    return status;
}

static status_type step(const api *f, instance_type c, double time, double length)
{
    return f->fmi2DoStep(c, time, length, fmi2True);
}

/* Calls what a sampled controller does not have; the number of calls that were not refused. */
static int not_refused(const api *f, instance_type c)
{
    const fmi2ValueReference r = 1u;
    const fmi2Integer order = 1;
    const fmi2Real one = 1.0;
    fmi2Real x;
    fmi2Boolean terminated = fmi2True;
    fmi2Status status;
    fmi2String text;
    int wrong = 0;

    wrong += f->fmi2GetDirectionalDerivative(c, &r, 1u, &r, 1u, &one, &x) != ERROR;
    wrong += f->fmi2SetRealInputDerivatives(c, &r, 1u, &order, &one) != ERROR;
    wrong += f->fmi2GetRealOutputDerivatives(c, &r, 1u, &order, &x) != ERROR;
    wrong += f->fmi2CancelStep(c) != ERROR;
    wrong += f->fmi2GetString(c, &r, 1u, &text) != ERROR;
    wrong += f->fmi2GetStatus(c, fmi2DoStepStatus, &status) != fmi2Discard;
    wrong += (f->fmi2GetBooleanStatus(c, fmi2Terminated, &terminated) != OK) || (terminated != fmi2False);
    wrong += f->fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &x) != OK;
    return wrong;
}

#define REFUSED_AND_LOGGED 5
#define FREE f->fmi2FreeInstance
#define EXIT f->fmi2ExitInitializationMode
#define TERMINATE f->fmi2Terminate
#define RESET f->fmi2Reset
#define GET_STATE f->fmi2GetFMUstate
#define SET_STATE f->fmi2SetFMUstate
#define FREE_STATE f->fmi2FreeFMUstate
#define STATE_SIZE f->fmi2SerializedFMUstateSize
#define WRITE_STATE f->fmi2SerializeFMUstate
#define READ_STATE f->fmi2DeSerializeFMUstate
#define GET_VERSION f->fmi2GetVersion
