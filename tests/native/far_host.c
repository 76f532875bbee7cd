/* A host in C for every platform: loads an FMU, steps it, and prints its outputs.
 *
 * far_host LIBRARY GUID RESOURCES SWITCHES INPUTS OUTPUTS STATE TURN
 *   SWITCHES  REFERENCE,...                   Booleans that are set; "-": none
 *   INPUTS    REFERENCE:CENTRE:AMPLITUDE,...  real inputs, moved as centre + amplitude * sine
 *   OUTPUTS   REFERENCE,...                   real outputs
 *   STATE     a file: "save" writes the state to it half way, "load" goes on from it there
 * Prints a line for each step of the second half and returns 0, or says what went wrong. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define LOAD(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define LOAD(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

#include "fmi2Functions.h"

#define STEPS 200
#define HALF (STEPS / 2)
#define STEP 0.002
#define MOST 64
#define DIE(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(1))
#define GOOD(call)                                                \
    do {                                                          \
        int status_ = (call);                                     \
        if (status_ > fmi2Warning) DIE("%s: %d", #call, status_); \
    } while (0)
#define TAKE(type, name) \
    type *name = (type *)FIND(library, #name); \
    if (!name) DIE("no " #name)

static fmi2ValueReference inputs[MOST], outputs[MOST], switches[MOST];
static double centre[MOST], amplitude[MOST];
static char bytes[1 << 20];

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
        if (more) sscanf(more, ":%lf:%lf", &centre[n], &amplitude[n]);
        found[n++] = (fmi2ValueReference)strtoul(one, 0, 10);
    }
    return n;
}

int main(int count, char **given) {
    if (count != 9) DIE("eight arguments are right");
    void *library = LOAD(given[1]);
    if (!library) DIE("%s cannot be loaded", given[1]);
    TAKE(fmi2InstantiateTYPE, fmi2Instantiate);
    TAKE(fmi2SetupExperimentTYPE, fmi2SetupExperiment);
    TAKE(fmi2EnterInitializationModeTYPE, fmi2EnterInitializationMode);
    TAKE(fmi2ExitInitializationModeTYPE, fmi2ExitInitializationMode);
    TAKE(fmi2SetBooleanTYPE, fmi2SetBoolean);
    TAKE(fmi2SetRealTYPE, fmi2SetReal);
    TAKE(fmi2GetRealTYPE, fmi2GetReal);
    TAKE(fmi2DoStepTYPE, fmi2DoStep);
    TAKE(fmi2GetFMUstateTYPE, fmi2GetFMUstate);
    TAKE(fmi2SetFMUstateTYPE, fmi2SetFMUstate);
    TAKE(fmi2FreeFMUstateTYPE, fmi2FreeFMUstate);
    TAKE(fmi2SerializedFMUstateSizeTYPE, fmi2SerializedFMUstateSize);
    TAKE(fmi2SerializeFMUstateTYPE, fmi2SerializeFMUstate);
    TAKE(fmi2DeSerializeFMUstateTYPE, fmi2DeSerializeFMUstate);
    TAKE(fmi2FreeInstanceTYPE, fmi2FreeInstance);
    fmi2CallbackFunctions callbacks = {say, calloc, free, 0, 0};
    size_t n_switches = references(given[4], switches), n_inputs = references(given[5], inputs);
    size_t n_outputs = references(given[6], outputs);
    int load = strcmp(given[8], "load") == 0;
    fmi2Component one = fmi2Instantiate("one", fmi2CoSimulation, given[2], given[3], &callbacks, 0, 1);
    if (!one) DIE("fmi2Instantiate gave nothing");
    fmi2Boolean on[MOST];
    for (size_t i = 0; i < n_switches; i++) on[i] = 1;
    GOOD(fmi2SetBoolean(one, switches, n_switches, on));
    GOOD(fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0));
    GOOD(fmi2EnterInitializationMode(one));
    GOOD(fmi2ExitInitializationMode(one));
    for (int k = load ? HALF : 0; k < STEPS; k++) {
        fmi2FMUstate state = 0;
        size_t size = 0;
        if (k == HALF && load) {
            FILE *file = fopen(given[7], "rb");
            if (!file) DIE("no state in %s", given[7]);
            size = fread(bytes, 1, sizeof bytes, file);
            fclose(file);
            GOOD(fmi2DeSerializeFMUstate(one, bytes, size, &state));
            GOOD(fmi2SetFMUstate(one, state));
            GOOD(fmi2FreeFMUstate(one, &state));
        } else if (k == HALF) {
            GOOD(fmi2GetFMUstate(one, &state));
            GOOD(fmi2SerializedFMUstateSize(one, state, &size));
            if (size > sizeof bytes) DIE("a state of %zu bytes", size);
            GOOD(fmi2SerializeFMUstate(one, state, bytes, size));
            GOOD(fmi2FreeFMUstate(one, &state));
            FILE *file = fopen(given[7], "wb");
            if (!file || fwrite(bytes, 1, size, file) != size) DIE("%s cannot be written", given[7]);
            fclose(file);
        }
        double values[MOST];
        for (size_t i = 0; i < n_inputs; i++)
            values[i] = centre[i] + amplitude[i] * ((k * (7 + 2 * (int)i)) % 23 - 11) / 11.0;
        GOOD(fmi2SetReal(one, inputs, n_inputs, values));
        GOOD(fmi2DoStep(one, k * STEP, STEP, 1));
        GOOD(fmi2GetReal(one, outputs, n_outputs, values));
        if (k < HALF) continue;
        for (size_t i = 0; i < n_outputs; i++) printf("%.17g ", values[i]);
        printf("\n");
    }
    fmi2FreeInstance(one);
    return 0;
}
