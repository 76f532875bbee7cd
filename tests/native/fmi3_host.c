/* A host in C for the tests: runs one FMU of FMI 3.0 twice, hands the state of one instance to the
 * other as bytes, and resets.
 *
 * fmi3_host LIBRARY TOKEN RESOURCES INPUTS OUTPUTS
 *   INPUTS   REFERENCE:CENTRE:AMPLITUDE,...  floating-point inputs, moved as a sine; "-" for none
 *   OUTPUTS  REFERENCE,...                   floating-point outputs
 * Prints a row of outputs per step and returns 0, or says on stderr what went wrong, returning 1. */
#include "fmi3Functions.h"

#include "../../benchmarks/host.h"

enum { STEPS = 40, HALF = STEPS / 2 };
static const double STEP = 0.002;

static Ports inputs, outputs;
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
        for (size_t i = 0; i < inputs.count; i++)
            values[i] = moved(&inputs, i, (size_t)k);
        GOOD(set(one, inputs.reference, inputs.count, values, inputs.count));
        GOOD(do_step(one, k * STEP, STEP, fmi3True, &event, &end, &early, &last));
        if (event || end || early || fabs(last - (k + 1) * STEP) > 1e-12) DIE("step %d", k);
        GOOD(get(one, outputs.reference, outputs.count, rows[k], outputs.count));
    }
}

int main(int count, char **given) {
    static double rows[STEPS][MOST], again[STEPS][MOST];
    if (count != 6) DIE("five arguments are right");
    inputs = ports(given[4]);
    outputs = ports(given[5]);
    void *library = load(given[1]);
    TAKE(library, fmi3InstantiateCoSimulation);
    TAKE(library, fmi3EnterInitializationMode);
    TAKE(library, fmi3ExitInitializationMode);
    TAKE(library, fmi3GetFMUState);
    TAKE(library, fmi3SetFMUState);
    TAKE(library, fmi3FreeFMUState);
    TAKE(library, fmi3SerializedFMUStateSize);
    TAKE(library, fmi3SerializeFMUState);
    TAKE(library, fmi3DeserializeFMUState);
    TAKE(library, fmi3Terminate);
    TAKE(library, fmi3Reset);
    TAKE(library, fmi3FreeInstance);
    set = (fmi3SetFloat64TYPE *)find(library, "fmi3SetFloat64");
    get = (fmi3GetFloat64TYPE *)find(library, "fmi3GetFloat64");
    do_step = (fmi3DoStepTYPE *)find(library, "fmi3DoStep");

    if (fmi3InstantiateCoSimulation("wrong", "another token", given[3], fmi3False, fmi3False, fmi3False,
                                fmi3False, 0, 0, 0, 0, 0))
        DIE("an instance for a wrong token");
    fmi3Instance pair[2];
    for (int i = 0; i < 2; i++) {
        pair[i] = fmi3InstantiateCoSimulation(i ? "two" : "one", given[2], given[3], fmi3False,
                                          fmi3True, fmi3False, fmi3False, 0, 0, 0, say, 0);
        if (!pair[i]) DIE("no instance");
        GOOD(fmi3EnterInitializationMode(pair[i], fmi3False, 0.0, 0.0, fmi3True, 1.0));
        GOOD(fmi3ExitInitializationMode(pair[i]));
    }
    walk(pair[0], 0, rows);
    fmi3FMUState state = 0, copy = 0;
    size_t size = 0;
    GOOD(fmi3GetFMUState(pair[0], &state));
    GOOD(fmi3SerializedFMUStateSize(pair[0], state, &size));
    fmi3Byte *bytes = malloc(size);
    GOOD(fmi3SerializeFMUState(pair[0], state, bytes, size));
    walk(pair[0], HALF, rows);
    GOOD(fmi3DeserializeFMUState(pair[1], bytes, size, &copy));
    GOOD(fmi3SetFMUState(pair[1], copy));
    walk(pair[1], HALF, again);
    if (memcmp(rows[HALF], again[HALF], sizeof rows / 2)) DIE("another copy goes on otherwise");
    GOOD(fmi3SetFMUState(pair[0], state));
    GOOD(fmi3Reset(pair[0]));
    GOOD(fmi3EnterInitializationMode(pair[0], fmi3False, 0.0, 0.0, fmi3True, 1.0));
    GOOD(fmi3ExitInitializationMode(pair[0]));
    walk(pair[0], 0, again);
    if (memcmp(rows, again, sizeof rows / 2)) DIE("after a reset it goes otherwise");
    free(bytes);
    GOOD(fmi3FreeFMUState(pair[0], &state));
    GOOD(fmi3FreeFMUState(pair[1], &copy));
    for (int i = 0; i < 2; i++) {
        GOOD(fmi3Terminate(pair[i]));
        fmi3FreeInstance(pair[i]);
    }
    for (int k = 0; k < STEPS; k++)
        for (size_t i = 0; i < outputs.count; i++)
            printf("%.17g%c", rows[k][i], i + 1 == outputs.count ? '\n' : ' ');
    return 0;
}
