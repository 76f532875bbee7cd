/* A host in C for the tests: runs one FMU of FMI 3.0 twice, hands the state of one instance to the
 * other as bytes, and resets.
 *
 * fmi3_host LIBRARY TOKEN RESOURCES INPUTS OUTPUTS
 *   INPUTS   REFERENCE:CENTRE:AMPLITUDE,...  floating-point inputs, moved as a sine; "-" for none
 *   OUTPUTS  REFERENCE,...                   floating-point outputs
 * Prints a row of outputs per step and returns 0, or says on stderr what went wrong, returning 1. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(handle, name) ((void *)GetProcAddress((HMODULE)(handle), name))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(handle, name) dlsym(handle, name)
#endif

enum { STEPS = 40, HALF = STEPS / 2, MOST = 64 };
static const double STEP = 0.002;

#define DIE(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(1))
#define GOOD(call)                                                    \
    do {                                                              \
        int status_ = (call);                                         \
        if (status_ > fmi3Warning) DIE("%s: %d", #call, status_);     \
    } while (0)
#define LOAD(name) fmi3##name##TYPE *name = (fmi3##name##TYPE *)FIND(library, "fmi3" #name)

static fmi3ValueReference inputs[MOST], outputs[MOST];
static double centre[MOST], amplitude[MOST];
static size_t n_inputs, n_outputs;
static fmi3SetFloat64TYPE *set;
static fmi3GetFloat64TYPE *get;
static fmi3DoStepTYPE *do_step;

static void say(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                fmi3String text) {
    (void)environment;
    if (status > fmi3Warning) fprintf(stderr, "[%s] %s\n", category, text);
}

static void walk(fmi3Instance one, int first, double rows[][MOST]) {
    for (int k = first; k < first + HALF; k++) {
        double values[MOST], last;
        fmi3Boolean event, end, early;
        for (size_t i = 0; i < n_inputs; i++)
            values[i] = centre[i] + amplitude[i] * sin(0.13 * k + 0.7 * (double)i);
        GOOD(set(one, inputs, n_inputs, values, n_inputs));
        GOOD(do_step(one, k * STEP, STEP, fmi3True, &event, &end, &early, &last));
        if (event || end || early || fabs(last - (k + 1) * STEP) > 1e-12) DIE("step %d", k);
        GOOD(get(one, outputs, n_outputs, rows[k], n_outputs));
    }
}

int main(int count, char **given) {
    static double rows[STEPS][MOST], again[STEPS][MOST];
    if (count != 6) DIE("five arguments are right");
    for (char *one = strtok(given[4], ","); one && strcmp(one, "-"); one = strtok(0, ",")) {
        sscanf(one, "%u:%lf:%lf", &inputs[n_inputs], &centre[n_inputs], &amplitude[n_inputs]);
        n_inputs++;
    }
    for (char *one = strtok(given[5], ","); one; one = strtok(0, ","))
        outputs[n_outputs++] = (fmi3ValueReference)strtoul(one, 0, 10);
    void *library = OPEN(given[1]);
    if (!library) DIE("%s: cannot be loaded", given[1]);
    LOAD(InstantiateCoSimulation);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(GetFMUState);
    LOAD(SetFMUState);
    LOAD(FreeFMUState);
    LOAD(SerializedFMUStateSize);
    LOAD(SerializeFMUState);
    LOAD(DeserializeFMUState);
    LOAD(Terminate);
    LOAD(Reset);
    LOAD(FreeInstance);
    set = (fmi3SetFloat64TYPE *)FIND(library, "fmi3SetFloat64");
    get = (fmi3GetFloat64TYPE *)FIND(library, "fmi3GetFloat64");
    do_step = (fmi3DoStepTYPE *)FIND(library, "fmi3DoStep");

    if (InstantiateCoSimulation("wrong", "another token", given[3], fmi3False, fmi3False, fmi3False,
                                fmi3False, 0, 0, 0, 0, 0))
        DIE("an instance for a wrong token");
    fmi3Instance pair[2];
    for (int i = 0; i < 2; i++) {
        pair[i] = InstantiateCoSimulation(i ? "two" : "one", given[2], given[3], fmi3False,
                                          fmi3True, fmi3False, fmi3False, 0, 0, 0, say, 0);
        if (!pair[i]) DIE("no instance");
        GOOD(EnterInitializationMode(pair[i], fmi3False, 0.0, 0.0, fmi3True, 1.0));
        GOOD(ExitInitializationMode(pair[i]));
    }
    walk(pair[0], 0, rows);
    fmi3FMUState state = 0, copy = 0;
    size_t size = 0;
    GOOD(GetFMUState(pair[0], &state));
    GOOD(SerializedFMUStateSize(pair[0], state, &size));
    fmi3Byte *bytes = malloc(size);
    GOOD(SerializeFMUState(pair[0], state, bytes, size));
    walk(pair[0], HALF, rows);
    GOOD(DeserializeFMUState(pair[1], bytes, size, &copy));
    GOOD(SetFMUState(pair[1], copy));
    walk(pair[1], HALF, again);
    if (memcmp(rows[HALF], again[HALF], sizeof rows / 2)) DIE("another copy goes on otherwise");
    GOOD(SetFMUState(pair[0], state));
    GOOD(Reset(pair[0]));
    GOOD(EnterInitializationMode(pair[0], fmi3False, 0.0, 0.0, fmi3True, 1.0));
    GOOD(ExitInitializationMode(pair[0]));
    walk(pair[0], 0, again);
    if (memcmp(rows, again, sizeof rows / 2)) DIE("after a reset it goes otherwise");
    free(bytes);
    GOOD(FreeFMUState(pair[0], &state));
    GOOD(FreeFMUState(pair[1], &copy));
    for (int i = 0; i < 2; i++) {
        GOOD(Terminate(pair[i]));
        FreeInstance(pair[i]);
    }
    for (int k = 0; k < STEPS; k++)
        for (size_t i = 0; i < n_outputs; i++)
            printf("%.17g%c", rows[k][i], i + 1 == n_outputs ? '\n' : ' ');
    return 0;
}
