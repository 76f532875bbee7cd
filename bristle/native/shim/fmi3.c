/* FMI 3.0: an instance from begin to end, its step and its state. */

#include "fmi3.h"

#include <stdlib.h>

/* Unlike FMI 2.0, this version takes a message as it is, not for the format of a printf. */
static void hand_on(const Host *host, Status status, const char *text) {
    if (!host->logger || !(host->logged >> status & 1)) return;
    host->logger(host->environment, (fmi3Status)status, host_categories[status], text);
}

static void say(const Slave *slave, Status status, const char *text) {
    hand_on(slave->host, status, text);
}

fmi3Status fmi3_refuse(fmi3Instance c, const char *what) {
    Text text;
    if (!c) return fmi3Error;
    text_clear(&text);
    text_add(&text, slave_of(c)->name);
    text_add(&text, ": this FMU offers no ");
    text_add(&text, what);
    text_add(&text, ".");
    hand_on(c, FAILED, text.at);
    return fmi3Error;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[],
    size_t count, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    void (*update)(void)) {
    const char *wrong = host_refuses(token);
    (void)visible, (void)early, (void)required, (void)count, (void)update;
    Host *host = calloc(1, sizeof *host);
    if (!host) return 0;
    host->logger = logger;
    host->environment = environment;
    host->logged = logging ? EVERY_CATEGORY : ALWAYS;
    if (events)
        wrong = "this FMU has no event mode.";
    else if (!wrong && !(host->slave = slave_new(name ? name : "", resources ? resources : "")))
        wrong = "out of memory.";
    if (wrong) {
        hand_on(host, FAILED, wrong);
        free(host);
        return 0;
    }
    host->slave->host = host;
    host->slave->say = say;
    return host;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) {
    if (!c) return;
    slave_free(slave_of(c));
    free(c);
}

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean logging, size_t count,
                                      const fmi3String categories[]) {
    Host *host = c;
    if (!c) return fmi3Error;
    return (fmi3Status)host_choose(&host->logged, logging, count, categories);
}

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                              fmi3Float64 tolerance, fmi3Float64 start,
                                              fmi3Boolean has_stop, fmi3Float64 stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    Slave *slave = slave_of(c);
    if (!slave) return fmi3Error;
    Status status = slave_enter(slave);
    if (status != DONE) return (fmi3Status)status;
    slave->time = start;
    slave->stale = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    return c ? (fmi3Status)slave_leave(slave_of(c)) : fmi3Error;
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance c) {
    if (!c) return fmi3Error;
    slave_of(c)->mode = TERMINATED;
    return fmi3OK;
}

EXPORT fmi3Status fmi3Reset(fmi3Instance c) {
    return c && slave_reset(slave_of(c)) ? fmi3OK : fmi3Error;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean final,
                             fmi3Boolean *event, fmi3Boolean *end, fmi3Boolean *early,
                             fmi3Float64 *last) {
    (void)final;
    if (!c) return fmi3Error;
    Status status = slave_step(slave_of(c), time, step);
    if (event) *event = false;
    if (end) *end = false;
    if (early) *early = false;
    if (last) *last = slave_of(c)->time;
    return (fmi3Status)status;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    return (fmi3Status)host_save(slave_of(c), state);
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    return (fmi3Status)host_restore(slave_of(c), state);
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    host_forget(state);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    return (fmi3Status)host_size(slave_of(c), state, size);
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[],
                                        size_t size) {
    return (fmi3Status)host_serialise(slave_of(c), state, bytes, size);
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                          fmi3FMUState *state) {
    return (fmi3Status)host_deserialise(slave_of(c), bytes, size, state);
}
