/* A host in C for the tests: loads one FMU twice, steps both copies in turn, resets, replays the
 * state within and across copies, and ends.
 *
 * host LIBPYTHON GUID LIBRARY_1 RESOURCES_1 LIBRARY_2 RESOURCES_2 INPUTS OUTPUTS
 *   LIBPYTHON  path of a shared libpython, opened so that the FMU finds its symbols; "-" for none
 *   INPUTS     REFERENCE:CENTRE:AMPLITUDE,...   real inputs, moved as centre + amplitude * sine
 *   OUTPUTS    REFERENCE,...                    real outputs
 * Prints the last outputs and returns 0, or says on stderr what went wrong and returns 1. */
#include "fmi2Functions.h"

#include "../../benchmarks/host.h"

#define STEPS 40
#define HALF (STEPS / 2)
#define STEP 0.002

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
static Ports inputs, outputs;

static Fmu load_fmu(const char *library, const char *resources) {
    void *h = load(library);
    Fmu fmu = {h, resources,
               find(h, "fmi2Instantiate"), find(h, "fmi2FreeInstance"),
               find(h, "fmi2SetupExperiment"), find(h, "fmi2EnterInitializationMode"),
               find(h, "fmi2ExitInitializationMode"), find(h, "fmi2Terminate"),
               find(h, "fmi2Reset"), find(h, "fmi2GetReal"), find(h, "fmi2SetReal"),
               find(h, "fmi2DoStep"), find(h, "fmi2GetFMUstate"),
               find(h, "fmi2SetFMUstate"), find(h, "fmi2FreeFMUstate"),
               find(h, "fmi2SerializedFMUstateSize"), find(h, "fmi2SerializeFMUstate"),
               find(h, "fmi2DeSerializeFMUstate")};
    return fmu;
}

static void move(const Fmu *fmu, fmi2Component c, int k) {
    double values[MOST];
    for (size_t i = 0; i < inputs.count; i++) values[i] = moved(&inputs, i, (size_t)k);
    GOOD(fmu->set(c, inputs.reference, inputs.count, values));
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
    GOOD(fmu->get(c, outputs.reference, outputs.count, row));
}

static void compare(const double *a, const double *b, const char *what, int k) {
    if (memcmp(a, b, outputs.count * sizeof *a)) DIE("%s differs at step %d", what, k);
}

int main(int argc, char **argv) {
    if (argc != 9) DIE("eight arguments are needed");
    if (strcmp(argv[1], "-") && !dlopen(argv[1], RTLD_NOW | RTLD_GLOBAL)) DIE("%s", dlerror());
    guid = argv[2];
    inputs = ports(argv[7]);
    outputs = ports(argv[8]);
    static double wanted[STEPS][MOST], row[MOST];

    Fmu one = load_fmu(argv[3], argv[4]), two = load_fmu(argv[5], argv[6]);
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
    for (size_t i = 0; i < outputs.count; i++) printf("%.17g\n", row[i]);
    return 0;
}
