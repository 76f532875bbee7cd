/* FMI 2.0: an instance from begin to end, its step and its status. */

#include "fmi2.h"

#include <stdlib.h>

static void hand_on(const Host *host, const char *name, Status status, const char *text) {
    char line[2 * sizeof(((Text *)0)->at)];
    size_t used = 0;
    if (!host->callbacks.logger || !(host->logged >> status & 1)) return;
    /* Hosts take a message for the format of a printf. */
    for (; *text && used < sizeof line - 2; text++) {
        line[used++] = *text;
        if (*text == '%') line[used++] = '%';
    }
    line[used] = 0;
    host->callbacks.logger(host->callbacks.componentEnvironment, name, (fmi2Status)status,
                           host_categories[status], line);
}

static void say(const Slave *slave, Status status, const char *text) {
    hand_on(slave->host, slave->name, status, text);
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                     fmi2String resources, const fmi2CallbackFunctions *functions,
                                     fmi2Boolean visible, fmi2Boolean logging) {
    const char *wrong = host_refuses(guid);
    (void)visible;
    Host *host = calloc(1, sizeof *host);
    if (!host) return 0;
    if (functions) host->callbacks = *functions;
    host->logged = logging ? EVERY_CATEGORY : ALWAYS;
    if (!name) name = "";
    if (type != fmi2CoSimulation)
        wrong = "this FMU is for co-simulation alone.";
    else if (!wrong && !(host->slave = slave_new(name, resources ? resources : "")))
        wrong = "out of memory.";
    if (wrong) {
        hand_on(host, name, FAILED, wrong);
        free(host);
        return 0;
    }
    host->slave->host = host;
    host->slave->say = say;
    return host;
}

EXPORT void fmi2FreeInstance(fmi2Component c) {
    if (!c) return;
    slave_free(slave_of(c));
    free(c);
}

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean logging, size_t count,
                                      const fmi2String categories[]) {
    Host *host = c;
    if (!c) return fmi2Error;
    return (fmi2Status)host_choose(&host->logged, logging, count, categories);
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                      fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    Slave *slave = slave_of(c);
    if (!slave) return fmi2Error;
    slave->time = start;
    slave->stale = 1;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return c ? (fmi2Status)slave_enter(slave_of(c)) : fmi2Error;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return c ? (fmi2Status)slave_leave(slave_of(c)) : fmi2Error;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
    if (!c) return fmi2Error;
    slave_of(c)->mode = TERMINATED;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    return c && slave_reset(slave_of(c)) ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean final) {
    (void)final;
    return c ? (fmi2Status)slave_step(slave_of(c), time, step) : fmi2Error;
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    (void)c; /* no step is ever under way when a host calls */
    return fmi2Error;
}

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, fmi2StatusKind kind, fmi2Status *value) {
    (void)c, (void)kind, (void)value; /* no step is ever pending */
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
    if (!c || kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = slave_of(c)->time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, fmi2StatusKind kind, fmi2Integer *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) {
    if (!c || kind != fmi2Terminated) return fmi2Discard;
    *value = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, fmi2StatusKind kind, fmi2String *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
