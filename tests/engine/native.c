/* An FMU in C for the tests of the master: y = u summed over steps, twice = 2 u follows u at once.
 * The Integer parameter `how` spoils the step that begins at `at`. With INTERPOLATES it takes the
 * derivative of u for one step, and y is the mean of u^2 over each step, summed. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"

enum { FINE, ABORT, HANG, DISCARD, ERROR, PENDING, WARN };

typedef struct {
    double real[4]; /* u, y, twice, at */
    double slope; /* of u, in the next step */
    int how;
    char name[64];
    const fmi2CallbackFunctions *calls;
} Native;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String where,
                              const fmi2CallbackFunctions *calls, fmi2Boolean see, fmi2Boolean log) {
    (void)type, (void)guid, (void)where, (void)see, (void)log;
    Native *n = calloc(1, sizeof *n);
    strncpy(n->name, name, sizeof n->name - 1);
    n->calls = calls;
    return n;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d,
                               fmi2Boolean e, fmi2Real f) {
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)f;
    return fmi2OK;
}
#define OK(name)                     \
    fmi2Status name(fmi2Component c) { \
        (void)c;                     \
        return fmi2OK;               \
    }
OK(fmi2EnterInitializationMode)
OK(fmi2ExitInitializationMode)
OK(fmi2Terminate)
OK(fmi2Reset)
OK(fmi2CancelStep)

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    Native *me = c;
    me->real[2] = 2 * me->real[0];
    for (size_t i = 0; i < n; i++) v[i] = me->real[r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) ((Native *)c)->real[r[i]] = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) v[i] = ((Native *)c)->how + 0 * (int)r[i];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n,
                          const fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) ((Native *)c)->how = v[i] + 0 * (int)r[i];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean keep) {
    (void)keep;
    Native *me = c;
    if (me->how != FINE && time > me->real[3] - step / 2) {
        if (me->how == ABORT) abort();
        if (me->how == HANG) fclose(fopen("hangs", "w")); /* tells that it does */
        while (me->how == HANG) usleep(1000);
        if (me->how == DISCARD) return fmi2Discard;
        if (me->how == ERROR) {
            me->calls->logger(NULL, me->name, fmi2Error, "native", "%s is %d", "the answer", 42);
            return fmi2Error;
        }
        if (me->how == PENDING) return fmi2Pending;
        me->calls->logger(me->calls->componentEnvironment, me->name, fmi2Warning, "native",
                          "warm: %.1f degrees", 36.5);
        me->real[1] += me->real[0];
        return fmi2Warning;
    }
#ifdef INTERPOLATES
    double from = me->real[0], to = from + step * me->slope;
    me->real[1] += (from * from + from * to + to * to) / 3;
    me->real[0] = to;
    me->slope = 0;
#else
    me->real[1] += me->real[0];
#endif
    return fmi2OK;
}

#ifdef INTERPOLATES
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                       const fmi2Integer order[], const fmi2Real v[]) {
    if (n != 1 || r[0] != 0 || order[0] != 1) return fmi2Error;
    ((Native *)c)->slope = v[0];
    return fmi2OK;
}
#endif

/* What the master never asks for. */
#define REFUSE(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2Error; }
#pragma GCC diagnostic ignored "-Wunused-parameter"
REFUSE(fmi2SetDebugLogging, fmi2Component c, fmi2Boolean a, size_t n, const fmi2String k[])
REFUSE(fmi2GetBoolean, fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[])
REFUSE(fmi2SetBoolean, fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[])
REFUSE(fmi2GetString, fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[])
REFUSE(fmi2SetString, fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[])
REFUSE(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
REFUSE(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
REFUSE(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
REFUSE(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
REFUSE(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
REFUSE(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
REFUSE(fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference u[], size_t nu,
       const fmi2ValueReference k[], size_t nk, const fmi2Real dk[], fmi2Real du[])
#ifndef INTERPOLATES
REFUSE(fmi2SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference r[], size_t n,
       const fmi2Integer o[], const fmi2Real v[])
#endif
REFUSE(fmi2GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference r[], size_t n,
       const fmi2Integer o[], fmi2Real v[])
REFUSE(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *v)
REFUSE(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, fmi2Real *v)
REFUSE(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, fmi2Integer *v)
REFUSE(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v)
REFUSE(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *v)
