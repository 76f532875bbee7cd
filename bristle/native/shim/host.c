/* What FMI 2.0 and 3.0 have in common on the way to a host. */

#include "host.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

const char *const host_categories[] = {"logAll", "logStatusWarning", "logStatusDiscard",
                                       "logStatusError", "logStatusFatal"};

Status host_choose(int *logged, int on, size_t count, const char *const names[]) {
    int chosen = count == 0 ? EVERY_CATEGORY : 0;
    Status all = DONE;
    for (size_t i = 0; i < count; i++) {
        int bit = 0;
        for (int k = 0; k < 5; k++)
            if (strcmp(names[i], host_categories[k]) == 0) bit = k == 0 ? EVERY_CATEGORY : 1 << k;
        if (!bit) all = WARNED;
        chosen |= bit;
    }
    *logged = on ? *logged | chosen : (*logged & ~chosen) | ALWAYS;
    return all;
}

const char *host_refuses(const char *guid) {
    if (guid && strcmp(guid, component.guid) == 0) return 0;
    return "the guid is not that of this FMU: modelDescription.xml and library do not belong "
           "together.";
}

static Status worse(Status one, Status other) { return other > one ? other : one; }

Status host_get(Slave *slave, const unsigned references[], size_t count, int kind, int form,
                void *values) {
    Status status = slave ? DONE : FAILED;
    for (size_t i = 0; slave && i < count; i++) {
        double value = form == DOUBLES ? ((double *)values)[i] : 0.0;
        status = worse(status, slave_get(slave, references[i], kind, &value));
        if (form == DOUBLES) ((double *)values)[i] = value;
        if (form == INTS) ((int *)values)[i] = kind == BOOLEAN ? value != 0.0 : (int)value;
        if (form == BOOLS) ((bool *)values)[i] = value != 0.0;
    }
    return status;
}

Status host_set(Slave *slave, const unsigned references[], size_t count, int kind, int form,
                const void *values) {
    Status status = slave ? DONE : FAILED;
    for (size_t i = 0; slave && i < count; i++) {
        double value = form == DOUBLES ? ((const double *)values)[i]
                       : form == INTS  ? ((const int *)values)[i]
                                       : ((const bool *)values)[i];
        if (kind == BOOLEAN) value = value != 0.0;
        status = worse(status, slave_set(slave, references[i], kind, value));
    }
    return status;
}

Status host_get_texts(Slave *slave, const unsigned references[], size_t count,
                      const char *values[]) {
    Status status = slave ? DONE : FAILED;
    for (size_t i = 0; slave && i < count; i++)
        status = worse(status, slave_get_text(slave, references[i], &values[i]));
    return status;
}

Status host_set_texts(Slave *slave, const unsigned references[], size_t count,
                      const char *const values[]) {
    Status status = slave ? DONE : FAILED;
    for (size_t i = 0; slave && i < count; i++)
        status = worse(status, slave_set_text(slave, references[i], values[i] ? values[i] : ""));
    return status;
}

Status host_save(Slave *slave, void **state) {
    if (!slave) return FAILED;
    State *own = *state ? *state : calloc(1, sizeof *own);
    if (!own) return FAILED;
    if (slave_save(slave, own) != DONE) {
        if (!*state) free(own);
        return FAILED;
    }
    *state = own;
    return DONE;
}

Status host_restore(Slave *slave, void *state) {
    return slave && state ? slave_restore(slave, state) : FAILED;
}

void host_forget(void **state) {
    if (!state || !*state) return;
    free(((State *)*state)->bytes);
    free(*state);
    *state = 0;
}

Status host_size(const Slave *slave, const void *state, size_t *size) {
    if (!slave || !state) return FAILED;
    *size = ((const State *)state)->size;
    return DONE;
}

Status host_serialise(const Slave *slave, const void *state, void *bytes, size_t size) {
    const State *own = state;
    if (!slave || !own || size < own->size) return FAILED;
    memcpy(bytes, own->bytes, own->size);
    return DONE;
}

Status host_deserialise(Slave *slave, const void *bytes, size_t size, void **state) {
    if (!slave || slave_check(slave, bytes, size) != DONE) return FAILED;
    State *own = *state ? *state : calloc(1, sizeof *own);
    unsigned char *copy = malloc(size);
    if (!own || !copy) {
        if (!*state) free(own);
        free(copy);
        return FAILED;
    }
    memcpy(copy, bytes, size);
    free(own->bytes);
    *own = (State){size, copy};
    *state = own;
    return DONE;
}
