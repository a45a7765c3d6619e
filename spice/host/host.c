/* ngspice as a converter under control: one control period after the other.
 *
 * usage: host NETLIST T_SAMPLE [VECTOR ...]
 *
 * The netlist has sources `external`, whose levels this program says. It reads lines
 *     COUNT { SOURCE TIME RISE LEVEL } ...
 * of edges: which source, s from the control period's start, rise time in s, level reached. The first line is about what
 * was before the start, each other one about a control period and later. For the start and for the sampling instant that
 * ends each control period it writes one line
 *     T V_OUT I_L I_OUT V_IN V_MIN V_MAX I_MIN I_MAX
 * with 17 digits, and behind them the other vectors that were asked for. It ends where the input does.
 */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <ngspice/sharedspice.h>

enum { SOURCES = 5, EDGES = 32, FIXED = 4, COLUMNS = 12 };

struct edge {
    double time, rise, level;
};

struct source {
    const char *name;
    double level; /* before the first of its edges */
    int count;
    struct edge edges[EDGES];
};

static struct source sources[SOURCES] = {{.name = "vgu"}, {.name = "vgl"}, {.name = "vpw"}, {.name = "vcc"}, {.name = "vgg"}};
static const char *columns[COLUMNS] = {"out", "vil#branch", "vout#branch", "nin"};
static int column_count = FIXED;

static double t_sample;
static double next_sample = -1.0;
static long period;
static double extremes[4];

static int say(char *text, int id, void *user)
{
    (void)id;
    (void)user;
    if (strncmp(text, "stderr", 6) == 0)
        fprintf(stderr, "%s\n", text + 7);
    return 0;
}

static int leave(int status, NG_BOOL unload, NG_BOOL quit, int id, void *user)
{
    (void)unload;
    (void)quit;
    (void)id;
    (void)user;
    exit(status ? status : 3);
}

static int running(NG_BOOL off, int id, void *user)
{
    (void)off;
    (void)id;
    (void)user;
    return 0;
}

static int names(pvecinfoall all, int id, void *user)
{
    (void)all;
    (void)id;
    (void)user;
    return 0;
}

static double level_at(const struct source *source, double t)
{
    double level = source->level;
    for (int n = 0; n < source->count && t > source->edges[n].time; n++) {
        const struct edge *edge = &source->edges[n];
        const double share = (t - edge->time) / edge->rise;
        level = share >= 1.0 ? edge->level : level + share * (edge->level - level);
    }
    return level;
}

static int voltage(double *value, double t, char *name, int id, void *user)
{
    (void)id;
    (void)user;
    *value = 0.0;
    for (int n = 0; n < SOURCES; n++)
        if (strcmp(name, sources[n].name) == 0)
            *value = level_at(&sources[n], t);
    return 0;
}

static int current(double *value, double t, char *name, int id, void *user)
{
    (void)t;
    (void)name;
    (void)id;
    (void)user;
    *value = 0.0;
    return 0;
}

static int time_step(double t, double *step, double before, int again, int id, int where, void *user)
{
    (void)t;
    (void)step;
    (void)before;
    (void)again;
    (void)id;
    (void)where;
    (void)user;
    return 0;
}

/* Edges that lie behind are folded into the level. */
static void forget_edges(struct source *source, double t)
{
    int kept = 0;
    for (int n = 0; n < source->count; n++) {
        const struct edge edge = source->edges[n];
        if (kept == 0 && edge.time + edge.rise <= t)
            source->level = edge.level;
        else
            source->edges[kept++] = edge;
    }
    source->count = kept;
}

static void read_edges(double start)
{
    int count;
    if (scanf("%d", &count) != 1)
        exit(0);
    for (int n = 0; n < SOURCES; n++)
        forget_edges(&sources[n], start);
    for (int n = 0; n < count; n++) {
        int index;
        struct edge edge;
        if (scanf("%d %lf %lf %lf", &index, &edge.time, &edge.rise, &edge.level) != 4 || index < 0 || index >= SOURCES ||
            sources[index].count == EDGES) {
            fprintf(stderr, "a line that is no control period\n");
            exit(2);
        }
        edge.time += start;
        sources[index].edges[sources[index].count++] = edge;
    }
}

/* ngspice meets every edge and the sampling instant exactly. */
static void read_period(double now)
{
    const double start = (double)period * t_sample;
    read_edges(start);
    for (int n = 0; n < SOURCES; n++)
        for (int k = 0; k < sources[n].count; k++) {
            const struct edge *edge = &sources[n].edges[k];
            if (edge->time > now)
                ngSpice_SetBkpt(edge->time);
            if (edge->time + edge->rise > now)
                ngSpice_SetBkpt(edge->time + edge->rise);
        }
    period++;
    next_sample = (double)period * t_sample;
    ngSpice_SetBkpt(next_sample);
}

static void widen(double *range, double value)
{
    range[0] = value < range[0] ? value : range[0];
    range[1] = value > range[1] ? value : range[1];
}

/* ngspice accepted a time point. */
static int point(pvecvaluesall all, int count, int id, void *user)
{
    double x[COLUMNS] = {0.0}, t = 0.0;
    (void)count;
    (void)id;
    (void)user;
    for (int n = 0; n < all->veccount; n++) {
        const pvecvalues vector = all->vecsa[n];
        if (strcmp(vector->name, "time") == 0)
            t = vector->creal;
        for (int k = 0; k < column_count; k++)
            if (strcmp(vector->name, columns[k]) == 0)
                x[k] = vector->creal;
    }
    if (next_sample < 0.0) {
        extremes[0] = extremes[1] = x[0];
        extremes[2] = extremes[3] = x[1];
    }
    widen(&extremes[0], x[0]);
    widen(&extremes[2], x[1]);
    if (t >= next_sample - 1e-13) {
        printf("%.17g %.17g %.17g %.17g %.17g", t, x[0], x[1], x[2], x[3]);
        printf(" %.17g %.17g %.17g %.17g", extremes[0], extremes[1], extremes[2], extremes[3]);
        for (int k = FIXED; k < column_count; k++)
            printf(" %.17g", x[k]);
        printf("\n");
        fflush(stdout);
        extremes[0] = extremes[1] = x[0];
        extremes[2] = extremes[3] = x[1];
        read_period(t);
    }
    return 0;
}

int main(int argc, char **argv)
{
    char line[4096];
    int id = 0;
    if (argc < 3 || argc - 3 > COLUMNS - FIXED)
        return 2;
    t_sample = atof(argv[2]);
    for (int n = 3; n < argc; n++)
        columns[column_count++] = argv[n];
    ngSpice_Init(say, NULL, leave, point, names, running, NULL);
    ngSpice_Init_Sync(voltage, current, time_step, &id, NULL);
    read_edges(0.0);
    snprintf(line, sizeof line, "source %s", argv[1]);
    if (ngSpice_Command(line) != 0)
        return 3;
    ngSpice_Command("run");
    fprintf(stderr, "ngspice ended before the input\n");
    return 3;
}
