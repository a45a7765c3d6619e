/*
 * A program that imports an FMU: `importer LIBRARY run` steps one instance with inputs from standard input, `importer
 * LIBRARY check` looks at how instances behave. Build with -DFMI=2 or 3 and, for functions with a prefix, -DSTATIC;
 * config.h describes the FMU: NAME, TOKEN, PERIOD, KINDS of the inputs, LOWS, HIGHS, PARAMETERS, DUTIES, FALLBACKS.
 */
#include <inttypes.h>
#include <stdint.h>
#include "config.h"
#if FMI == 2
#include "adapter2.h"
#else
#include "adapter3.h"
#endif

#define INPUTS (sizeof(KINDS) - 1u)
#define ENABLE ((unsigned)INPUTS)
#define DUTY (ENABLE + 1u)
#define ACTION (DUTY + DUTIES)
#define STATUS (ACTION + DUTIES)
#define FIRST_PARAMETER (STATUS + 1u)
#define STEPS 300u

typedef struct {
    double duty[DUTIES], action[DUTIES], status;
} answer;

static const double lows[] = LOWS;
static const double highs[] = HIGHS;
static const double fallbacks[] = FALLBACKS;

static void check(int holds, const char *what)
{
    if (!holds) {
        printf("FAIL: %s\n", what);
        exit(1);
    }
}

static answer outputs(const api *f, instance_type c)
{
    answer all;
    unsigned i;
    for (i = 0u; i < DUTIES; ++i) {
        check(get(f, c, DUTY + i, 'r', &all.duty[i]) == OK, "duty can be read");
        check(get(f, c, ACTION + i, 'i', &all.action[i]) == OK, "action can be read");
    }
    check(get(f, c, STATUS, 'i', &all.status) == OK, "status can be read");
    return all;
}

static int same(answer a, answer b)
{
    return memcmp(&a, &b, sizeof(a)) == 0;
}

/* Inputs that depend on seed and step only. */
static void feed(const api *f, instance_type c, unsigned seed, unsigned k)
{
    uint32_t word = 12345u + 7919u * seed + 104729u * k;
    unsigned i;

    for (i = 0u; i + 1u < INPUTS; ++i) {
        word = word * 1664525u + 1013904223u;
        check(set(f, c, i + 1u, KINDS[i], lows[i] + (highs[i] - lows[i]) * (double)(word >> 8) / 16777216.0) == OK,
              "inputs can be set");
    }
    check(set(f, c, ENABLE, 'b', (k % 37u == 36u) ? 0.0 : 1.0) == OK, "enable can be set");
}

static answer period(const api *f, instance_type c, unsigned seed, unsigned k)
{
    feed(f, c, seed, k);
    check(step(f, c, 2.0 + k * PERIOD, PERIOD) == OK, "a step of the control period is taken");
    return outputs(f, c);
}

static instance_type begin(const api *f)
{
    instance_type c = instantiate(f, TOKEN);
    check(c != NULL, "the FMU is instantiated with its token");
    check(enter(f, c, 2.0) == OK && EXIT(c) == OK, "the FMU is initialised");
    return c;
}

static void instantiation(const api *f)
{
    instance_type c;
    instance_type plain;
    answer first;

    check(strcmp(GET_VERSION(), VERSION) == 0, "the version is told");
    check(instantiate(f, "{00000000-0000-0000-0000-000000000000}") == NULL && logged == 1u,
          "another token is refused with a message");
    check(instantiate(f, NULL) == NULL && logged == 2u, "no token is refused with a message");
    check(instantiate_otherwise(f) == NULL && logged == 3u, "other kinds of FMU are refused with a message");
    c = instantiate(f, TOKEN);
    check(step(f, c, 2.0, PERIOD) == ERROR && logged == 4u, "no step without initialisation");
    check(enter(f, c, 2.0) == OK, "initialisation begins");
    check(step(f, c, 2.0, PERIOD) == ERROR, "no step during initialisation");
    check(enter(f, c, 2.0) == ERROR, "initialisation does not begin twice");
    feed(f, c, 1u, 0u);
    first = outputs(f, c);
    check(EXIT(c) == OK && same(first, outputs(f, c)), "the first outputs are known before the first step");
    check(same(first, period(f, c, 1u, 0u)), "the first step gives the outputs of the initialisation");
    plain = begin(f);
    check(same(first, period(f, plain, 1u, 0u)), "inputs during initialisation leave the state as it starts");
    FREE(plain);
    check(TERMINATE(c) == OK && step(f, c, 2.0 + PERIOD, PERIOD) == ERROR, "no step after the end");
    check(set(f, c, 1u, KINDS[0], 0.0) == ERROR, "no inputs after the end");
    FREE(c);
    FREE(NULL);
}

static void time_grid(const api *f)
{
    instance_type c = begin(f);
    instance_type twin = begin(f);
    const double wrong[] = { 0.0, -PERIOD, 0.5 * PERIOD, 0.999 * PERIOD, 2.0 * PERIOD, 1e3 };
    const unsigned before = logged;
    answer held;
    unsigned i;

    (void)period(f, twin, 1u, 0u);
    held = period(f, c, 1u, 0u);
    feed(f, c, 2u, 1u);
    for (i = 0u; i < sizeof(wrong) / sizeof(wrong[0]); ++i) {
        check(step(f, c, 2.0 + PERIOD, wrong[i]) == ERROR, "another step size is refused");
        check(step(f, c, 2.0 + PERIOD + wrong[i] + ((i == 0u) ? 7.0 : 0.0), PERIOD) == ERROR,
              "another communication point is refused");
    }
    check(logged == before + 12u, "every refusal has a message");
    check(same(held, outputs(f, c)), "a refused step changes no output");
    for (i = 1u; i < STEPS; ++i) {
        check(same(period(f, c, 1u, i), period(f, twin, 1u, i)), "a refused step changes nothing");
    }
    FREE(c);
    FREE(twin);
}

static void instances(const api *f)
{
    static answer alone[2][STEPS];
    instance_type c[2];
    unsigned which, k;
    unsigned moved = 0u;

    for (which = 0u; which < 2u; ++which) {
        c[which] = begin(f);
        for (k = 0u; k < STEPS; ++k) {
            alone[which][k] = period(f, c[which], which, k);
            moved += (k > 0u) && !same(alone[which][k], alone[which][k - 1u]);
        }
    }
    check(moved > 20u, "outputs follow the inputs");
    for (which = 0u; which < 2u; ++which) {
        check(RESET(c[which]) == OK && enter(f, c[which], 2.0) == OK && EXIT(c[which]) == OK, "an instance is reset");
    }
    for (k = 0u; k < STEPS; ++k) {
        for (which = 0u; which < 2u; ++which) {
            check(same(period(f, c[which], which, k), alone[which][k]),
                  "an instance steps beside another and after a reset as it did alone");
        }
    }
    FREE(c[0]);
    FREE(c[1]);
}

static void states(const api *f)
{
    static answer first[STEPS];
    instance_type c = begin(f);
    instance_type other = begin(f);
    state_type state = NULL;
    state_type copy = NULL;
    size_t size = 0u;
    byte_type *bytes;
    unsigned k;

    for (k = 0u; k < 50u; ++k) {
        (void)period(f, c, 5u, k);
    }
    check(GET_STATE(c, &state) == OK && state != NULL, "a state is had");
    for (k = 50u; k < STEPS; ++k) {
        first[k] = period(f, c, 5u, k);
    }
    check(SET_STATE(c, state) == OK, "a state is put back");
    for (k = 50u; k < STEPS; ++k) {
        check(same(period(f, c, 5u, k), first[k]), "an instance goes on from its state");
    }
    check(STATE_SIZE(c, state, &size) == OK && size > 0u, "a state has a size");
    bytes = (byte_type *)malloc(size + 1u);
    check(WRITE_STATE(c, state, bytes, size - 1u) == ERROR, "too few bytes are refused");
    check(WRITE_STATE(c, state, bytes, size) == OK, "a state is written");
    check(FREE_STATE(c, &state) == OK && state == NULL, "a state is freed");
    check(READ_STATE(other, bytes, size - 1u, &copy) == ERROR && copy == NULL, "a part of a state is refused");
    check(READ_STATE(other, bytes, size, &copy) == OK && SET_STATE(other, copy) == OK, "a state is read");
    for (k = 50u; k < STEPS; ++k) {
        check(same(period(f, other, 5u, k), first[k]), "another instance goes on from the state");
    }
    /* states of other FMUs have another signature somewhere in their last words */
    memset(bytes, 0x5a, size);
    check(READ_STATE(other, bytes, size, &copy) == ERROR, "bytes that are no state are refused");
    check(SET_STATE(other, NULL) == ERROR, "no state is refused");
    check(FREE_STATE(other, &copy) == OK && FREE_STATE(other, &copy) == OK, "no state can be freed");
    free(bytes);
    FREE(c);
    FREE(other);
}

static void variables(const api *f)
{
    instance_type c = begin(f);
    unsigned before = logged;
    answer held;
    double x;

    check(set(f, c, DUTY, 'r', 0.3) == ERROR, "an output cannot be set");
    check(get(f, c, 0u, 'r', &x) == OK && x == 2.0, "the time can be read");
    check(get(f, c, 0u, 'i', &x) == ERROR && get(f, c, 99u, 'r', &x) == ERROR, "what is no variable is refused");
    check(set(f, c, 0u, 'r', 1.0) == ERROR && set(f, c, FIRST_PARAMETER + PARAMETERS, 'r', 1.0) == ERROR,
          "what is no variable cannot be set");
    check(get(f, c, DUTY, 'i', &x) == ERROR && get(f, c, ACTION, 'r', &x) == ERROR, "another type is refused");
    check(set(f, c, ENABLE, 'r', 1.0) == ERROR, "another type cannot be set");
    check(logged == before + 8u, "every refusal has a message");
    before = logged;
    check(not_refused(f, c) == 0, "what co-simulation does not have is refused");
    check(logged == before + REFUSED_AND_LOGGED, "every refused call has a message");
    check(set(f, c, ENABLE, 'b', 0.0) == OK && step(f, c, 2.0, PERIOD) == OK, "a disabled controller takes steps");
    held = outputs(f, c);
    check(memcmp(held.duty, fallbacks, sizeof(held.duty)) == 0, "a disabled controller gives the fallback duty");
    FREE(c);
}

#if PARAMETERS > 0
/* Periods with another coefficient: a duty that its limits or its slew hold shows nothing of it, which is one in ten with some networks. */
#define TUNED 600u

static void parameters(const api *f)
{
    instance_type c = begin(f);
    instance_type twin = begin(f);
    unsigned k;
    unsigned differ = 0u;

    (void)period(f, c, 6u, 0u);
    (void)period(f, twin, 6u, 0u);
    check(set(f, c, FIRST_PARAMETER, 'r', 0.97) == OK, "a coefficient can be tuned");
    check(same(period(f, c, 6u, 1u), period(f, twin, 6u, 1u)), "a new coefficient does not count in the step after it");
    for (k = 2u; k < TUNED; ++k) {
        differ += !same(period(f, c, 6u, k), period(f, twin, 6u, k));
    }
    check(differ > 5u, "a new coefficient counts from the second step on");
    check(set(f, c, FIRST_PARAMETER, 'r', 1e9) == OK && step(f, c, 2.0 + TUNED * PERIOD, PERIOD) == WARNING,
          "a coefficient that the policy does not allow is warned of");
    check(period(f, c, 6u, TUNED + 1u).status >= 65536.0, "the status tells of a refused coefficient");
    FREE(c);
    FREE(twin);
    c = instantiate(f, TOKEN);
    check(set(f, c, FIRST_PARAMETER, 'r', 1e9) == OK && enter(f, c, 2.0) == OK && EXIT(c) == ERROR,
          "a coefficient that the policy does not allow ends the initialisation");
    FREE(c);
}
#endif

/* One line of inputs as bits, one line of outputs. */
static void run(const api *f)
{
    instance_type c = begin(f);
    unsigned k;

    for (k = 0u;; ++k) {
        answer all;
        uint64_t bits;
        unsigned i;

        for (i = 0u; i < INPUTS; ++i) {
            double value;
            if (scanf("%" SCNx64, &bits) != 1) {
                FREE(c);
                return;
            }
            memcpy(&value, &bits, sizeof(value));
            check(set(f, c, i + 1u, KINDS[i], value) == OK, "inputs can be set");
        }
        check(step(f, c, 2.0 + k * PERIOD, PERIOD) == OK, "a step of the control period is taken");
        all = outputs(f, c);
        for (i = 0u; i < DUTIES; ++i) {
            memcpy(&bits, &all.duty[i], sizeof(bits));
            printf("%016" PRIx64 " ", bits);
        }
        for (i = 0u; i < DUTIES; ++i) {
            printf("%.0f ", all.action[i]);
        }
        printf("%.0f\n", all.status);
        fflush(stdout);
    }
}

int main(int count, char **arguments)
{
    api functions;

    if (count != 3) {
        return 2;
    }
    load(&functions, arguments[1]);
    if (strcmp(arguments[2], "run") == 0) {
        run(&functions);
        return 0;
    }
    instantiation(&functions);
    time_grid(&functions);
    instances(&functions);
    states(&functions);
    variables(&functions);
#if PARAMETERS > 0
    parameters(&functions);
#endif
    check(allocated == 0u, "all memory is given back");
    printf("PASS\n");
    return 0;
}
