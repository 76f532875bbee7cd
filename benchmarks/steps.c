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
#include <time.h>

#include "fmi2Functions.h"
#include "host.h"

#define STEP 0.002
#define WARM 1000

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
    void *fmu = load(given[1]);
    TAKE(fmu, fmi2Instantiate);
    TAKE(fmu, fmi2SetupExperiment);
    TAKE(fmu, fmi2EnterInitializationMode);
    TAKE(fmu, fmi2ExitInitializationMode);
    TAKE(fmu, fmi2SetBoolean);
    TAKE(fmu, fmi2SetReal);
    TAKE(fmu, fmi2GetReal);
    TAKE(fmu, fmi2DoStep);
    TAKE(fmu, fmi2Reset);
    TAKE(fmu, fmi2FreeInstance);
    Ports switches = ports(given[4]), inputs = ports(given[5]), outputs = ports(given[6]);
    size_t steps = strtoul(given[7], 0, 10), passes = strtoul(given[8], 0, 10);
    size_t all = steps * passes;
    double *moves = malloc((WARM + steps) * MOST * sizeof *moves), row[MOST];
    long *times = malloc(all * sizeof *times), *least = malloc(steps * sizeof *least);
    if (!steps || !passes || !moves || !times || !least) DIE("no steps, or no memory for them");
    for (size_t k = 0; k < WARM + steps; k++)
        for (size_t i = 0; i < inputs.count; i++) moves[k * MOST + i] = moved(&inputs, i, k);

    fmi2Boolean on[MOST];
    for (size_t i = 0; i < switches.count; i++) on[i] = fmi2True;
    fmi2Component one =
        fmi2Instantiate("one", fmi2CoSimulation, given[2], given[3], &callbacks, 0, 0);
    if (!one) DIE("fmi2Instantiate gave nothing");
    long worst = 0, surest = 0;
    for (size_t pass = 0; pass < passes; pass++) {
        if (pass) GOOD(fmi2Reset(one));
        if (switches.count) GOOD(fmi2SetBoolean(one, switches.reference, switches.count, on));
        GOOD(fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0));
        GOOD(fmi2EnterInitializationMode(one));
        if (inputs.count) GOOD(fmi2SetReal(one, inputs.reference, inputs.count, moves));
        GOOD(fmi2ExitInitializationMode(one));
        for (size_t k = 0; k < WARM + steps; k++) {
            const double *values = moves + k * MOST;
            long before = now();
            int status = inputs.count ? fmi2SetReal(one, inputs.reference, inputs.count, values) : 0;
            status |= fmi2DoStep(one, k * STEP, STEP, fmi2True);
            status |= fmi2GetReal(one, outputs.reference, outputs.count, row);
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
