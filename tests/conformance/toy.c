/* A strict FMU in C for the tests of `bristle conform`: it checks its guid, keeps to the state
 * machine and answers Error, as Python FMUs cannot. One word, TRAIT, spoils one thing. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define HEALTHY 0
#define CRASH_ON_NULL 1
#define NO_NAME_IN_LOG 2
#define WRONG_VERSION 3
#define REFUSE_SECOND 4
#define EMPTY_STATE 5
#define CRASH_AT_EXIT 6
#define HUGE_STATE 7
#define ODD_STATUS 8
#define LEAK_ON_FREE 9
#define CRASH_ON_BAD_REFERENCE 10
#define ABORT_INSTEAD_OF_ERROR 11
#define CRASH_ON_WRONG_GUID 12
#define CRASH_ON_EARLY_FREE 13
#define CRASH_ON_EMPTY_LIST 14
#define COPY_CHANGES_RUN 15
#define CRASH_ON_NULL_STATE 16
#define INTERPOLATES 17
#define ZERO_MOVES 18
#define SLOPE_OUTLIVES_RESET 19
#define SLOPE_OUTSIDE_STATE 20
#define CRASH_ON_ORDER_0 21
#ifndef TRAIT
#define TRAIT HEALTHY
#endif
#ifndef GUID
#define GUID "strict"
#endif

typedef enum { INSTANTIATED, INITIALISING, STEPPING, TERMINATED, BROKEN } Mode;
typedef struct {
    double u, y, gain;
    double slope; /* of u */
    double stop;
    Mode mode;
} State;
typedef struct {
    State s;
    char name[64];
    fmi2Boolean logging;
    const fmi2CallbackFunctions *callbacks;
} Toy;

static int made;
void *volatile leaked;

static fmi2Status refuse(Toy *toy, const char *text) {
    if (TRAIT == ABORT_INSTEAD_OF_ERROR) abort();
    toy->s.mode = BROKEN;
    if (toy->logging) {
        const char *name = TRAIT == NO_NAME_IN_LOG ? NULL : toy->name;
        toy->callbacks->logger(NULL, name, fmi2Error, "logStatusError", text);
    }
    return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return TRAIT == WRONG_VERSION ? "2.1" : "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String where,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)where, (void)visible;
    if (TRAIT == CRASH_ON_WRONG_GUID && strcmp(guid, GUID) != 0) abort();
    if (strcmp(guid, GUID) != 0 || type != fmi2CoSimulation) return NULL;
    if (TRAIT == REFUSE_SECOND && made) return NULL;
    made++;
    Toy *toy = calloc(1, sizeof *toy);
    toy->s.gain = 2.0;
    toy->s.stop = INFINITY;
    toy->logging = logging;
    toy->callbacks = callbacks;
    strncpy(toy->name, name, sizeof toy->name - 1);
    if (logging && TRAIT == NO_NAME_IN_LOG)
        callbacks->logger(NULL, NULL, fmi2OK, "logStatusError", "made");
    return toy;
}

void fmi2FreeInstance(fmi2Component c) {
    if (TRAIT == CRASH_ON_NULL) *(volatile char *)c;
    if (TRAIT == CRASH_ON_EARLY_FREE && c && ((Toy *)c)->s.mode == STEPPING) abort();
    if (TRAIT != LEAK_ON_FREE) free(c);
    else if (c) memset(leaked = malloc(1 << 20), 1, 1 << 20);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String kinds[]) {
    (void)n, (void)kinds;
    ((Toy *)c)->logging = on;
    return fmi2OK;
}

static fmi2Status go(Toy *toy, Mode from, Mode to) {
    if (toy->s.mode != from) return refuse(toy, "not allowed now");
    toy->s.mode = to;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stops, fmi2Real stop) {
    (void)tolerant, (void)tolerance, (void)start;
    Toy *toy = c;
    if (stops) toy->s.stop = stop;
    return go(toy, INSTANTIATED, INSTANTIATED);
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return go(c, INSTANTIATED, INITIALISING); }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return go(c, INITIALISING, STEPPING); }
fmi2Status fmi2Terminate(fmi2Component c) { return go(c, STEPPING, TERMINATED); }
fmi2Status fmi2Reset(fmi2Component c) {
    Toy *toy = c;
    double slope = TRAIT == SLOPE_OUTLIVES_RESET ? toy->s.slope : 0.0;
    memset(&toy->s, 0, sizeof toy->s);
    toy->s.slope = slope;
    toy->s.gain = 2.0;
    toy->s.stop = INFINITY;
    return fmi2OK;
}

/* References: 0 u, 1 y, 2 gain. */
static double *slot(Toy *toy, fmi2ValueReference r) {
    double *slots[] = {&toy->s.u, &toy->s.y, &toy->s.gain};
    if (r < 3) return slots[r];
    if (TRAIT == CRASH_ON_BAD_REFERENCE) abort();
    return NULL;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    if (TRAIT == CRASH_ON_EMPTY_LIST && n == 0) abort();
    for (size_t i = 0; i < n; i++) {
        double *x = slot(c, r[i]);
        if (!x) return refuse(c, "no such reference");
        v[i] = *x;
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    Toy *toy = c;
    for (size_t i = 0; i < n; i++) {
        double *x = slot(c, r[i]);
        if (!x || r[i] == 1) return refuse(c, "no such reference that can be set");
        if (r[i] == 2 && toy->s.mode >= STEPPING) return refuse(c, "gain is fixed");
        if (!isfinite(v[i])) return refuse(c, "not finite");
        *x = v[i];
    }
    return fmi2OK;
}

#define NONE(kind, type)                                                                          \
    fmi2Status fmi2Get##kind(fmi2Component c, const fmi2ValueReference r[], size_t n, type v[]) {  \
        (void)r, (void)v;                                                                         \
        return n ? refuse(c, "no such type") : fmi2OK;                                            \
    }                                                                                             \
    fmi2Status fmi2Set##kind(fmi2Component c, const fmi2ValueReference r[], size_t n,              \
                             const type v[]) {                                                    \
        (void)r, (void)v;                                                                         \
        return n ? refuse(c, "no such type") : fmi2OK;                                            \
    }
NONE(Integer, fmi2Integer)
NONE(Boolean, fmi2Boolean)
NONE(String, fmi2String)

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean keep) {
    (void)keep;
    Toy *toy = c;
    if (toy->s.mode != STEPPING) return refuse(toy, "not in step mode");
    if (!(step > 0.0) || !isfinite(step)) return refuse(toy, "no step");
    if (time + step > toy->s.stop * (1 + 1e-9)) return refuse(toy, "past the stop time");
    if (TRAIT >= INTERPOLATES) toy->s.u += 0.5 * step * toy->s.slope; /* its middle */
    toy->s.y += step / 0.3 * (toy->s.gain * toy->s.u - toy->s.y);
    if (TRAIT >= INTERPOLATES) toy->s.u += 0.5 * step * toy->s.slope;
    return TRAIT == ODD_STATUS ? 17 : fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(State));
    memcpy(*state, &((Toy *)c)->s, sizeof(State));
    if (TRAIT == COPY_CHANGES_RUN) ((Toy *)c)->s.y += 1e-3;
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    double slope = ((Toy *)c)->s.slope;
    memcpy(&((Toy *)c)->s, state, sizeof(State));
    if (TRAIT == SLOPE_OUTSIDE_STATE) ((Toy *)c)->s.slope = slope;
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    if (TRAIT == CRASH_ON_NULL_STATE) *(volatile char *)*state;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)c, (void)state;
    *size = TRAIT == EMPTY_STATE ? 0 : TRAIT == HUGE_STATE ? (size_t)1 << 62 : sizeof(State);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t n) {
    (void)c;
    memcpy(bytes, state, n < sizeof(State) ? n : sizeof(State));
    return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t n,
                                   fmi2FMUstate *state) {
    (void)c;
    if (!*state) *state = malloc(sizeof(State));
    memcpy(*state, bytes, n);
    return fmi2OK;
}

#if TRAIT >= INTERPOLATES
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                       const fmi2Integer order[], const fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) {
        if (order[i] == 0 && TRAIT == CRASH_ON_ORDER_0) abort();
        if (r[i] != 0 || order[i] != 1) return refuse(c, "no such derivative");
        ((Toy *)c)->s.slope = v[i] + (TRAIT == ZERO_MOVES);
    }
    return fmi2OK;
}
#endif

#ifndef MISSING
fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, "nothing to cancel"); }
#endif

__attribute__((destructor)) static void leave(void) {
    if (TRAIT == CRASH_AT_EXIT && made) abort();
}
