/* FMI 2.0: the whole state of an instance. */

#include "fmi2.h"

#include <stdlib.h>
#include <string.h>

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!c) return fmi2Error;
    State *own = *state ? *state : calloc(1, sizeof *own);
    if (!own) return fmi2Error;
    if (slave_save(slave_of(c), own) != DONE) {
        if (!*state) free(own);
        return fmi2Error;
    }
    *state = own;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    return c && state ? (fmi2Status)slave_restore(slave_of(c), state) : fmi2Error;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    if (!state || !*state) return fmi2OK;
    free(((State *)*state)->bytes);
    free(*state);
    *state = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    if (!c || !state) return fmi2Error;
    *size = ((State *)state)->size;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[],
                                        size_t size) {
    const State *own = state;
    if (!c || !own || size < own->size) return fmi2Error;
    memcpy(bytes, own->bytes, own->size);
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                          fmi2FMUstate *state) {
    if (!c || slave_check(slave_of(c), (const unsigned char *)bytes, size) != DONE) return fmi2Error;
    State *own = *state ? *state : calloc(1, sizeof *own);
    unsigned char *copy = malloc(size);
    if (!own || !copy) {
        if (!*state) free(own);
        free(copy);
        return fmi2Error;
    }
    memcpy(copy, bytes, size);
    free(own->bytes);
    *own = (State){size, copy};
    *state = own;
    return fmi2OK;
}
