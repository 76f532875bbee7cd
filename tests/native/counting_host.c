/* A host in C that counts what an FMU asks the C library for while it steps: memory and locks.
 *
 * counting_host LIBRARY GUID RESOURCES SWITCHES INPUTS OUTPUTS
 *   SWITCHES  REFERENCE,...                   Booleans that are set; "-": none
 *   INPUTS    REFERENCE:CENTRE:AMPLITUDE,...  real inputs, moved as a sine; "-": none
 *   OUTPUTS   REFERENCE,...                   real outputs
 * Functions of this program stand before those of the C library, for the FMU too. Prints how often
 * they were called until the first step, and from there on; returns 0. */
#define _GNU_SOURCE
#include <pthread.h>

#include "fmi2Functions.h"

#include "../../benchmarks/host.h"

#define STEPS 400
#define STEP 0.002

extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
extern void __libc_free(void *);

static size_t calls;
static int (*lock)(pthread_mutex_t *);

void *malloc(size_t size) { return calls++, __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return calls++, __libc_calloc(count, size); }
void *realloc(void *old, size_t size) { return calls++, __libc_realloc(old, size); }
void *aligned_alloc(size_t at, size_t size) { return calls++, __libc_memalign(at, size); }
void free(void *memory) { calls++, __libc_free(memory); }
int pthread_mutex_lock(pthread_mutex_t *mutex) { return calls++, lock ? lock(mutex) : 0; }

int main(int count, char **given) {
    if (count != 7) DIE("six arguments are right");
    *(void **)&lock = dlsym(RTLD_NEXT, "pthread_mutex_lock");
    void *fmu = load(given[1]);
    TAKE(fmu, fmi2Instantiate);
    TAKE(fmu, fmi2SetupExperiment);
    TAKE(fmu, fmi2EnterInitializationMode);
    TAKE(fmu, fmi2ExitInitializationMode);
    TAKE(fmu, fmi2SetBoolean);
    TAKE(fmu, fmi2SetReal);
    TAKE(fmu, fmi2SetRealInputDerivatives);
    TAKE(fmu, fmi2GetReal);
    TAKE(fmu, fmi2DoStep);
    TAKE(fmu, fmi2FreeInstance);
    Ports switches = ports(given[4]), inputs = ports(given[5]), outputs = ports(given[6]);
    fmi2Boolean on[MOST];
    fmi2Integer first[MOST];
    double values[MOST], slopes[MOST];
    for (size_t i = 0; i < MOST; i++) on[i] = first[i] = 1;

    size_t before = calls;
    fmi2Component one =
        fmi2Instantiate("one", fmi2CoSimulation, given[2], given[3], &callbacks, 0, 0);
    if (!one) DIE("fmi2Instantiate gave nothing");
    GOOD(fmi2SetBoolean(one, switches.reference, switches.count, on));
    GOOD(fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0));
    GOOD(fmi2EnterInitializationMode(one));
    GOOD(fmi2ExitInitializationMode(one));
    size_t begin = calls;
    for (size_t k = 0; k < STEPS; k++) {
        for (size_t i = 0; i < inputs.count; i++) {
            values[i] = moved(&inputs, i, k);
            slopes[i] = k % 2 ? (moved(&inputs, i, k + 1) - values[i]) / STEP : 0.0;
        }
        GOOD(fmi2SetReal(one, inputs.reference, inputs.count, values));
        GOOD(fmi2SetRealInputDerivatives(one, inputs.reference, inputs.count, first, slopes));
        GOOD(fmi2DoStep(one, (double)k * STEP, STEP, fmi2True));
        GOOD(fmi2GetReal(one, outputs.reference, outputs.count, values));
    }
    size_t end = calls;
    fmi2FreeInstance(one);
    printf("%zu %zu\n", begin - before, end - begin);
    return 0;
}
