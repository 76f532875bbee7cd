/* Times the steps of an FMU: set inputs, doStep, get outputs, by a host without Python.
 *
 * steps LIBRARY GUID RESOURCES SWITCHES INPUTS OUTPUTS STEPS PASSES
 *   SWITCHES  REFERENCE,...                   Booleans that are set; "-": none
 *   INPUTS    REFERENCE:CENTRE:AMPLITUDE,...  real inputs, moved as centre + amplitude * sine
 *   OUTPUTS   REFERENCE,...                   real outputs
 * The same steps are made in every pass, from a reset on. Prints, in ns: the median; the worst step
 * when each counts as its fastest pass, since an interruption of the machine does not hit the same
 * step every time; the worst of all; and what reading the clock takes. Returns 0, or says what went
 * wrong. */
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"

#define STEP 0.002
#define WARM 1000
#define MOST 64
#define DIE(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(1))
#define GOOD(call)                                                \
    do {                                                          \
        int status_ = (call);                                     \
        if (status_ > fmi2Warning) DIE("%s: %d", #call, status_); \
    } while (0)
#define TAKE(name)                                      \
    name##TYPE *name = (name##TYPE *)dlsym(fmu, #name); \
    if (!name) DIE("no " #name)

static fmi2ValueReference inputs[MOST], outputs[MOST], switches[MOST];
static double centre[MOST], amplitude[MOST];

static void say(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                fmi2String text, ...) {
    (void)e;
    if (status > fmi2Warning) fprintf(stderr, "%s [%s] %s\n", name, category, text);
}

static size_t references(char *text, fmi2ValueReference *found) {
    size_t n = 0;
    if (strcmp(text, "-") == 0) return 0;
    for (char *one = strtok(text, ","); one; one = strtok(0, ",")) {
        char *more = strchr(one, ':');
        if (n == MOST) DIE("more than %d variables", MOST);
        if (more) sscanf(more, ":%lf:%lf", &centre[n], &amplitude[n]);
        found[n++] = (fmi2ValueReference)strtoul(one, 0, 10);
    }
    return n;
}

static long now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000L + t.tv_nsec;
}

static int by_size(const void *a, const void *b) {
    long x = *(const long *)a, y = *(const long *)b;
    return (x > y) - (x < y);
}

static long median(long *times, size_t n) {
    qsort(times, n, sizeof *times, by_size);
    return times[n / 2];
}

int main(int count, char **given) {
    if (count != 9) DIE("eight arguments are right");
    void *fmu = dlopen(given[1], RTLD_NOW);
    if (!fmu) DIE("%s", dlerror());
    TAKE(fmi2Instantiate);
    TAKE(fmi2SetupExperiment);
    TAKE(fmi2EnterInitializationMode);
    TAKE(fmi2ExitInitializationMode);
    TAKE(fmi2SetBoolean);
    TAKE(fmi2SetReal);
    TAKE(fmi2GetReal);
    TAKE(fmi2DoStep);
    TAKE(fmi2Reset);
    TAKE(fmi2FreeInstance);
    fmi2CallbackFunctions callbacks = {say, calloc, free, 0, 0};
    size_t n_switches = references(given[4], switches), n_inputs = references(given[5], inputs);
    size_t n_outputs = references(given[6], outputs);
    size_t steps = strtoul(given[7], 0, 10), passes = strtoul(given[8], 0, 10);
    size_t all = steps * passes;
    double *moves = malloc((WARM + steps) * MOST * sizeof *moves), row[MOST];
    long *times = malloc(all * sizeof *times), *least = malloc(steps * sizeof *least);
    if (!steps || !passes || !moves || !times || !least) DIE("no steps, or no memory for them");
    for (size_t k = 0; k < WARM + steps; k++)
        for (size_t i = 0; i < n_inputs; i++)
            moves[k * MOST + i] = centre[i] + amplitude[i] * sin(0.3 * k + 0.7 * (double)i);

    fmi2Boolean on[MOST];
    for (size_t i = 0; i < n_switches; i++) on[i] = fmi2True;
    fmi2Component one =
        fmi2Instantiate("one", fmi2CoSimulation, given[2], given[3], &callbacks, 0, 0);
    if (!one) DIE("fmi2Instantiate gave nothing");
    long worst = 0, surest = 0;
    for (size_t pass = 0; pass < passes; pass++) {
        if (pass) GOOD(fmi2Reset(one));
        if (n_switches) GOOD(fmi2SetBoolean(one, switches, n_switches, on));
        GOOD(fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0));
        GOOD(fmi2EnterInitializationMode(one));
        if (n_inputs) GOOD(fmi2SetReal(one, inputs, n_inputs, moves));
        GOOD(fmi2ExitInitializationMode(one));
        for (size_t k = 0; k < WARM + steps; k++) {
            const double *values = moves + k * MOST;
            long before = now();
            int status = n_inputs ? fmi2SetReal(one, inputs, n_inputs, values) : 0;
            status |= fmi2DoStep(one, k * STEP, STEP, fmi2True);
            status |= fmi2GetReal(one, outputs, n_outputs, row);
            long took = now() - before;
            if (status > fmi2Warning) DIE("step %zu: %d", k, status);
            if (k < WARM) continue;
            size_t step = k - WARM;
            times[pass * steps + step] = took;
            if (!pass || took < least[step]) least[step] = took;
            if (took > worst) worst = took;
        }
    }
    fmi2FreeInstance(one);
    for (size_t k = 0; k < steps; k++)
        if (least[k] > surest) surest = least[k];
    long usual = median(times, all);
    for (size_t k = 0; k < steps; k++) {
        long before = now();
        times[k] = now() - before;
    }
    printf("%ld %ld %ld %ld\n", usual, surest, worst, median(times, steps));
    return 0;
}
