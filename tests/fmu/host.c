/* A host in C for the tests: loads one FMU twice, steps both copies in turn, resets, replays the
 * state within and across copies, and ends.
 *
 * host LIBPYTHON GUID LIBRARY_1 RESOURCES_1 LIBRARY_2 RESOURCES_2 INPUTS OUTPUTS
 *   LIBPYTHON  path of a shared libpython, opened so that the FMU finds its symbols; "-" for none
 *   INPUTS     REFERENCE:CENTRE:AMPLITUDE,...   real inputs, moved as centre + amplitude * sine
 *   OUTPUTS    REFERENCE,...                    real outputs
 * Prints the last outputs and returns 0, or says on stderr what went wrong and returns 1. */
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define STEPS 40
#define HALF (STEPS / 2)
#define STEP 0.002
#define MOST 64

#define DIE(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(1))
#define GOOD(call)                                             \
    do {                                                       \
        int status_ = (call);                                  \
        if (status_ > fmi2Warning) DIE("%s: %d", #call, status_); \
    } while (0)

typedef struct {
    void *handle;
    const char *resources;
    fmi2InstantiateTYPE *instantiate;
    fmi2FreeInstanceTYPE *free_instance;
    fmi2SetupExperimentTYPE *setup;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2TerminateTYPE *terminate;
    fmi2ResetTYPE *reset;
    fmi2GetRealTYPE *get;
    fmi2SetRealTYPE *set;
    fmi2DoStepTYPE *step;
    fmi2GetFMUstateTYPE *save;
    fmi2SetFMUstateTYPE *restore;
    fmi2FreeFMUstateTYPE *forget;
    fmi2SerializedFMUstateSizeTYPE *size;
    fmi2SerializeFMUstateTYPE *serialise;
    fmi2DeSerializeFMUstateTYPE *deserialise;
} Fmu;

static const char *guid;
static fmi2ValueReference inputs[MOST], outputs[MOST];
static double centre[MOST], amplitude[MOST];
static size_t n_inputs, n_outputs;

static void log_message(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String text, ...) {
    (void)e;
    if (status > fmi2Warning) fprintf(stderr, "%s [%s] %s\n", name, category, text);
}

static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};

static void *symbol(void *handle, const char *name) {
    void *found = dlsym(handle, name);
    if (!found) DIE("%s is missing: %s", name, dlerror());
    return found;
}

static Fmu load(const char *library, const char *resources) {
    void *h = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (!h) DIE("%s", dlerror());
    Fmu fmu = {h, resources,
               symbol(h, "fmi2Instantiate"), symbol(h, "fmi2FreeInstance"),
               symbol(h, "fmi2SetupExperiment"), symbol(h, "fmi2EnterInitializationMode"),
               symbol(h, "fmi2ExitInitializationMode"), symbol(h, "fmi2Terminate"),
               symbol(h, "fmi2Reset"), symbol(h, "fmi2GetReal"), symbol(h, "fmi2SetReal"),
               symbol(h, "fmi2DoStep"), symbol(h, "fmi2GetFMUstate"),
               symbol(h, "fmi2SetFMUstate"), symbol(h, "fmi2FreeFMUstate"),
               symbol(h, "fmi2SerializedFMUstateSize"), symbol(h, "fmi2SerializeFMUstate"),
               symbol(h, "fmi2DeSerializeFMUstate")};
    return fmu;
}

static void move(const Fmu *fmu, fmi2Component c, int k) {
    double values[MOST];
    for (size_t i = 0; i < n_inputs; i++)
        values[i] = centre[i] + amplitude[i] * sin(0.3 * k + 0.7 * (double)i);
    GOOD(fmu->set(c, inputs, n_inputs, values));
}

static void initialise(const Fmu *fmu, fmi2Component c) {
    GOOD(fmu->setup(c, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    GOOD(fmu->enter(c));
    move(fmu, c, 0);
    GOOD(fmu->leave(c));
}

static fmi2Component instantiate(const Fmu *fmu, const char *name) {
    fmi2Component c = fmu->instantiate(name, fmi2CoSimulation, guid, fmu->resources, &callbacks,
                                       fmi2False, fmi2False);
    if (!c) DIE("fmi2Instantiate answered NULL");
    initialise(fmu, c);
    return c;
}

static void advance(const Fmu *fmu, fmi2Component c, int k, double *row) {
    move(fmu, c, k);
    GOOD(fmu->step(c, k * STEP, STEP, fmi2True));
    GOOD(fmu->get(c, outputs, n_outputs, row));
}

static void compare(const double *a, const double *b, const char *what, int k) {
    if (memcmp(a, b, n_outputs * sizeof *a)) DIE("%s differs at step %d", what, k);
}

static size_t numbers(char *text, int inputs_too) {
    size_t n = 0;
    for (char *part = strtok(text, ","); part && n < MOST; part = strtok(NULL, ","), n++) {
        unsigned reference;
        if (!inputs_too) sscanf(part, "%u", &outputs[n]);
        else if (sscanf(part, "%u:%lf:%lf", &reference, &centre[n], &amplitude[n]) == 3)
            inputs[n] = reference;
        else DIE("not REFERENCE:CENTRE:AMPLITUDE: %s", part);
    }
    return n;
}

int main(int argc, char **argv) {
    if (argc != 9) DIE("eight arguments are needed");
    if (strcmp(argv[1], "-") && !dlopen(argv[1], RTLD_NOW | RTLD_GLOBAL)) DIE("%s", dlerror());
    guid = argv[2];
    n_inputs = numbers(argv[7], 1);
    n_outputs = numbers(argv[8], 0);
    static double wanted[STEPS][MOST], row[MOST];

    Fmu one = load(argv[3], argv[4]), two = load(argv[5], argv[6]);
    fmi2Component a = instantiate(&one, "a"), b = instantiate(&two, "b");
    fmi2FMUstate state = NULL;
    for (int k = 0; k < STEPS; k++) {
        if (k == HALF) GOOD(one.save(a, &state));
        advance(&one, a, k, wanted[k]);
        advance(&two, b, k, row);
        compare(row, wanted[k], "the second copy", k);
    }
    GOOD(one.restore(a, state));
    for (int k = HALF; k < STEPS; k++) {
        advance(&one, a, k, row);
        compare(row, wanted[k], "the replay", k);
    }
    size_t size = 0;
    GOOD(one.size(a, state, &size));
    char *bytes = malloc(size);
    GOOD(one.serialise(a, state, bytes, size));
    GOOD(one.forget(a, &state));

    GOOD(two.reset(b));
    initialise(&two, b);
    for (int k = 0; k < STEPS; k++) {
        advance(&two, b, k, row);
        compare(row, wanted[k], "the run after reset", k);
    }
    fmi2Component c = instantiate(&two, "c");
    fmi2FMUstate revived = NULL;
    GOOD(two.deserialise(c, bytes, size, &revived));
    GOOD(two.restore(c, revived));
    GOOD(two.forget(c, &revived));
    free(bytes);
    for (int k = HALF; k < STEPS; k++) {
        advance(&two, c, k, row);
        compare(row, wanted[k], "the copy that got the bytes", k);
    }
    GOOD(one.terminate(a));
    GOOD(two.terminate(b));
    GOOD(two.terminate(c));
    one.free_instance(a);
    two.free_instance(b);
    two.free_instance(c);
    for (size_t i = 0; i < n_outputs; i++) printf("%.17g\n", row[i]);
    return 0;
}
