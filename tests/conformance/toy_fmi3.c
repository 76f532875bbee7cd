/* A strict FMU of FMI 3.0 in C for the tests of `bristle conform`; TRAIT spoils one thing of it.
 * References: 0 u (Float64), 1 y (Float64), 2 single (Float32 input, not used), 3 time. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

#define HEALTHY 0
#define RETURNS_EARLY 1
#define ENDS 2
#define OTHER_ENVIRONMENT 3
#define WRONG_VERSION 4
#define CRASH_ON_NULL 5
#ifndef TRAIT
#define TRAIT HEALTHY
#endif
#pragma GCC diagnostic ignored "-Wunused-parameter"

typedef struct {
    double u, y, time;
    float single;
    int stepping;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} Toy;

const char *fmi3GetVersion(void) { return TRAIT == WRONG_VERSION ? "2.0" : "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    if (strcmp(token, "toy3") || events || early) return NULL;
    size_t length = strlen(resources);
    if (!length || resources[length - 1] != '/') return NULL; /* a path, that of a folder */
    Toy *toy = calloc(1, sizeof *toy);
    toy->log = log;
    toy->environment = TRAIT == OTHER_ENVIRONMENT ? NULL : environment;
    if (logging) log(toy->environment, fmi3OK, "logAll", "made");
    return toy;
}

void fmi3FreeInstance(fmi3Instance c) {
    if (TRAIT == CRASH_ON_NULL) *(volatile char *)c;
    free(c);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String kinds[]) {
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stops, fmi3Float64 stop) {
    ((Toy *)c)->time = start;
    return ((Toy *)c)->stepping ? fmi3Error : fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    ((Toy *)c)->stepping = 1;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) {
    ((Toy *)c)->stepping = 0;
    return fmi3OK;
}
fmi3Status fmi3Reset(fmi3Instance c) {
    memset(c, 0, offsetof(Toy, log));
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
                          size_t values) {
    Toy *toy = c;
    const double *places[] = {&toy->u, &toy->y, NULL, &toy->time};
    for (size_t i = 0; i < n; i++) {
        if (r[i] > 3 || r[i] == 2) return fmi3Error;
        v[i] = *places[r[i]];
    }
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                          const fmi3Float64 v[], size_t values) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != 0 || !isfinite(v[i])) return fmi3Error;
        ((Toy *)c)->u = v[i];
    }
    return fmi3OK;
}
fmi3Status fmi3GetFloat32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float32 v[],
                          size_t values) {
    for (size_t i = 0; i < n; i++) v[i] = ((Toy *)c)->single;
    return fmi3OK;
}
fmi3Status fmi3SetFloat32(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                          const fmi3Float32 v[], size_t values) {
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(v[i])) return fmi3Error;
        ((Toy *)c)->single = v[i];
    }
    return fmi3OK;
}

#define NONE(kind)                                                                              \
    fmi3Status fmi3Get##kind(fmi3Instance c, const fmi3ValueReference r[], size_t n,            \
                             fmi3##kind v[], size_t values) {                                   \
        return n ? fmi3Error : fmi3OK;                                                          \
    }                                                                                           \
    fmi3Status fmi3Set##kind(fmi3Instance c, const fmi3ValueReference r[], size_t n,            \
                             const fmi3##kind v[], size_t values) {                             \
        return n ? fmi3Error : fmi3OK;                                                          \
    }
NONE(Int8)
NONE(UInt8)
NONE(Int16)
NONE(UInt16)
NONE(Int32)
NONE(UInt32)
NONE(Int64)
NONE(UInt64)
NONE(Boolean)
NONE(String)

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean past,
                      fmi3Boolean *event, fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last) {
    Toy *toy = c;
    *event = false;
    *end = TRAIT == ENDS && time > 0.295;
    *early = TRAIT == RETURNS_EARLY;
    *last = toy->time = time + step;
    if (!toy->stepping || !(step > 0.0) || !isfinite(step)) return fmi3Error;
    toy->y += step / 0.3 * (2.0 * toy->u - toy->y);
    return fmi3OK;
}
