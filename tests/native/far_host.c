/* A host in C for every platform: loads an FMU, steps it, and prints its outputs.
 *
 * far_host LIBRARY GUID RESOURCES SWITCHES INPUTS OUTPUTS STATE TURN
 *   SWITCHES  REFERENCE,...                   Booleans that are set; "-": none
 *   INPUTS    REFERENCE:CENTRE:AMPLITUDE,...  real inputs, moved as centre + amplitude * sine
 *   OUTPUTS   REFERENCE,...                   real outputs
 *   STATE     a file: "save" writes the state to it half way, "load" goes on from it there
 * Prints a line for each step of the second half and returns 0, or says what went wrong. */
#include "fmi2Functions.h"

#include "../../benchmarks/host.h"

#define STEPS 200
#define HALF (STEPS / 2)
#define STEP 0.002

static char bytes[1 << 20];

int main(int count, char **given) {
    if (count != 9) DIE("eight arguments are right");
    void *library = load(given[1]);
    TAKE(library, fmi2Instantiate);
    TAKE(library, fmi2SetupExperiment);
    TAKE(library, fmi2EnterInitializationMode);
    TAKE(library, fmi2ExitInitializationMode);
    TAKE(library, fmi2SetBoolean);
    TAKE(library, fmi2SetReal);
    TAKE(library, fmi2GetReal);
    TAKE(library, fmi2DoStep);
    TAKE(library, fmi2GetFMUstate);
    TAKE(library, fmi2SetFMUstate);
    TAKE(library, fmi2FreeFMUstate);
    TAKE(library, fmi2SerializedFMUstateSize);
    TAKE(library, fmi2SerializeFMUstate);
    TAKE(library, fmi2DeSerializeFMUstate);
    TAKE(library, fmi2FreeInstance);
    Ports switches = ports(given[4]), inputs = ports(given[5]), outputs = ports(given[6]);
    int load = strcmp(given[8], "load") == 0;
    fmi2Component one = fmi2Instantiate("one", fmi2CoSimulation, given[2], given[3], &callbacks, 0, 1);
    if (!one) DIE("fmi2Instantiate gave nothing");
    fmi2Boolean on[MOST];
    for (size_t i = 0; i < switches.count; i++) on[i] = 1;
    GOOD(fmi2SetBoolean(one, switches.reference, switches.count, on));
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
        for (size_t i = 0; i < inputs.count; i++)
            values[i] = inputs.centre[i] +
                        inputs.amplitude[i] * ((k * (7 + 2 * (int)i)) % 23 - 11) / 11.0;
        GOOD(fmi2SetReal(one, inputs.reference, inputs.count, values));
        GOOD(fmi2DoStep(one, k * STEP, STEP, 1));
        GOOD(fmi2GetReal(one, outputs.reference, outputs.count, values));
        if (k < HALF) continue;
        for (size_t i = 0; i < outputs.count; i++) printf("%.17g ", values[i]);
        printf("\n");
    }
    fmi2FreeInstance(one);
    return 0;
}
