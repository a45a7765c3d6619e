/* FMI 3 for importer.c, with the types of the standard headers. */
#include "fmi3FunctionTypes.h"

#define FUNCTIONS(X) \
    X(fmi3GetVersion) X(fmi3InstantiateCoSimulation) X(fmi3InstantiateModelExchange) \
    X(fmi3InstantiateScheduledExecution) X(fmi3FreeInstance) X(fmi3EnterInitializationMode) \
    X(fmi3ExitInitializationMode) X(fmi3Terminate) X(fmi3Reset) X(fmi3GetFloat64) X(fmi3GetInt32) X(fmi3GetBoolean) \
    X(fmi3GetFloat32) X(fmi3GetString) X(fmi3SetFloat64) X(fmi3SetInt32) X(fmi3SetBoolean) X(fmi3GetFMUState) \
    X(fmi3SetFMUState) X(fmi3FreeFMUState) X(fmi3SerializedFMUStateSize) X(fmi3SerializeFMUState) \
    X(fmi3DeserializeFMUState) X(fmi3GetDirectionalDerivative) X(fmi3GetOutputDerivatives) X(fmi3DoStep) \
    X(fmi3EnterEventMode) X(fmi3EnterStepMode) X(fmi3EnterConfigurationMode) X(fmi3SetTime) X(fmi3GetClock) \
    X(fmi3ActivateModelPartition)
#define TYPE_OF(f) f##TYPE

#include "functions.h"

#define VERSION "3.0"
#define OK fmi3OK
#define WARNING fmi3Warning
#define ERROR fmi3Error
typedef fmi3Status status_type;
typedef fmi3Instance instance_type;
typedef fmi3FMUState state_type;
typedef fmi3Byte byte_type;

static unsigned logged;
/* FMI 3 takes its memory itself */
static const unsigned allocated = 0u;

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment;
    ++logged;
    fprintf(stderr, "%d %s %s\n", (int)status, category, message);
}

static instance_type instantiate(const api *f, const char *token)
{
    return f->fmi3InstantiateCoSimulation("instance", token, "", fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0u,
                                          NULL, log_message, NULL);
}

static instance_type instantiate_otherwise(const api *f)
{
    instance_type one = f->fmi3InstantiateModelExchange("instance", TOKEN, "", fmi3False, fmi3False, NULL, log_message);
    instance_type two = f->fmi3InstantiateScheduledExecution("instance", TOKEN, "", fmi3False, fmi3False, NULL,
                                                             log_message, NULL, NULL, NULL);
    instance_type three = f->fmi3InstantiateCoSimulation("instance", TOKEN, "", fmi3False, fmi3False, fmi3True, fmi3False,
                                                         NULL, 0u, NULL, log_message, NULL);
    logged -= 2u;
    return (one != NULL) ? one : ((two != NULL) ? two : three);
}

static status_type enter(const api *f, instance_type c, double start)
{
    return f->fmi3EnterInitializationMode(c, fmi3False, 0.0, start, fmi3False, 0.0);
}

static status_type set(const api *f, instance_type c, unsigned reference, char kind, double value)
{
    const fmi3ValueReference r = reference;
    const fmi3Int32 integer = (fmi3Int32)value;
    const fmi3Boolean boolean = value != 0.0;

    switch (kind) {
    case 'r':
        return f->fmi3SetFloat64(c, &r, 1u, &value, 1u);
    case 'i':
        return f->fmi3SetInt32(c, &r, 1u, &integer, 1u);
    default:
        return f->fmi3SetBoolean(c, &r, 1u, &boolean, 1u);
    }
}

static status_type get(const api *f, instance_type c, unsigned reference, char kind, double *value)
{
    const fmi3ValueReference r = reference;
    fmi3Int32 integer = 0;
    status_type status = (kind == 'r') ? f->fmi3GetFloat64(c, &r, 1u, value, 1u) : f->fmi3GetInt32(c, &r, 1u, &integer, 1u);

    if (kind != 'r') {
        *value = integer;
    }
    return status;
}

static status_type step(const api *f, instance_type c, double time, double length)
{
    fmi3Boolean event = fmi3True;
    fmi3Boolean terminate = fmi3True;
    fmi3Boolean early = fmi3True;
    fmi3Float64 last = -1.0;
    const status_type status = f->fmi3DoStep(c, time, length, fmi3True, &event, &terminate, &early, &last);
    return (event || terminate || early || ((status == OK) && !(last > time))) ? fmi3Fatal : status;
}

/* Calls what a sampled controller does not have; the number of calls that were not refused. */
static int not_refused(const api *f, instance_type c)
{
    const fmi3ValueReference r = 1u;
    const fmi3Int32 order = 1;
    const fmi3Float64 one = 1.0;
    fmi3Float64 x;
    fmi3Float32 single;
    fmi3Clock tick;
    fmi3String text;
    int wrong = 0;

    wrong += f->fmi3GetDirectionalDerivative(c, &r, 1u, &r, 1u, &one, 1u, &x, 1u) != ERROR;
    wrong += f->fmi3GetOutputDerivatives(c, &r, 1u, &order, &x, 1u) != ERROR;
    wrong += f->fmi3EnterEventMode(c) != ERROR;
    wrong += f->fmi3EnterStepMode(c) != ERROR;
    wrong += f->fmi3EnterConfigurationMode(c) != ERROR;
    wrong += f->fmi3SetTime(c, 0.0) != ERROR;
    wrong += f->fmi3GetClock(c, &r, 1u, &tick) != ERROR;
    wrong += f->fmi3ActivateModelPartition(c, 1u, 0.0) != ERROR;
    wrong += f->fmi3GetString(c, &r, 1u, &text, 1u) != ERROR;
    wrong += f->fmi3GetFloat32(c, &r, 1u, &single, 1u) != ERROR;
    wrong += f->fmi3GetFloat64(c, &r, 1u, &x, 2u) != ERROR;
    wrong += f->fmi3GetFloat32(c, NULL, 0u, NULL, 0u) != OK;
    return wrong;
}

#define REFUSED_AND_LOGGED 11
#define FREE f->fmi3FreeInstance
#define EXIT f->fmi3ExitInitializationMode
#define TERMINATE f->fmi3Terminate
#define RESET f->fmi3Reset
#define GET_STATE f->fmi3GetFMUState
#define SET_STATE f->fmi3SetFMUState
#define FREE_STATE f->fmi3FreeFMUState
#define STATE_SIZE f->fmi3SerializedFMUStateSize
#define WRITE_STATE f->fmi3SerializeFMUState
#define READ_STATE f->fmi3DeserializeFMUState
#define GET_VERSION f->fmi3GetVersion
