/* The whole state of an instance as bytes: little-endian, the same on every platform.

   Behind a mark, the FMU's guid and a digest of the rest stand: mode and time, the values and what
   inputs change by, what was set and said, the texts; and, once the model is built, what its
   parameters imply, its state, the inputs before and the outputs. */

#include <stdlib.h>
#include <string.h>

#include "slave.h"

static const char MARK[] = {'b', 'r', 'i', 's', 't', 'l', 'e', '1'};
enum { GUID_SIZE = 40, DIGEST_AT = 48, HEAD = 56 };

/* A place in bytes: what is written where there is room, and read where there are bytes left. */
typedef struct {
    unsigned char *at;
    size_t used, size;
    int overrun;
} Bytes;

static void put_bytes(Bytes *to, const void *from, size_t count) {
    if (to->at) memcpy(to->at + to->used, from, count);
    to->used += count;
}

static void put_whole(Bytes *to, uint64_t value) {
    unsigned char eight[8];
    for (int i = 0; i < 8; i++) eight[i] = (unsigned char)(value >> 8 * i);
    put_bytes(to, eight, 8);
}

static void put_number(Bytes *to, double value) {
    uint64_t bits;
    memcpy(&bits, &value, 8);
    put_whole(to, bits);
}

static void put_row(Bytes *to, Row row) {
    put_whole(to, (uint64_t)row.size);
    for (int64_t i = 0; i < row.size; i++) put_number(to, row.at[i]);
}

static const unsigned char *take_bytes(Bytes *from, size_t count) {
    if (from->overrun || count > from->size - from->used) {
        from->overrun = 1;
        return 0;
    }
    from->used += count;
    return from->at + from->used - count;
}

static uint64_t take_whole(Bytes *from) {
    const unsigned char *eight = take_bytes(from, 8);
    uint64_t value = 0;
    for (int i = 0; eight && i < 8; i++) value |= (uint64_t)eight[i] << 8 * i;
    return value;
}

static double take_number(Bytes *from) {
    uint64_t bits = take_whole(from);
    double value;
    memcpy(&value, &bits, 8);
    return value;
}

static uint64_t digest(const unsigned char *bytes, size_t size) {
    uint64_t found = 14695981039346656037u; /* FNV-1a */
    for (size_t i = 0; i < size; i++) found = (found ^ bytes[i]) * 1099511628211u;
    return found;
}

static void put_all(const Slave *slave, Bytes *to) {
    char guid[GUID_SIZE] = {0};
    strncpy(guid, component.guid, GUID_SIZE - 1);
    put_bytes(to, MARK, sizeof MARK);
    put_bytes(to, guid, GUID_SIZE);
    put_whole(to, 0); /* the digest's place */
    put_whole(to, (uint64_t)slave->mode);
    put_whole(to, (uint64_t)slave->unbuilt);
    put_number(to, slave->time);
    for (int i = 0; i < component.count; i++) put_number(to, slave->values[i]);
    for (int i = 0; i < component.inputs; i++) put_number(to, slave->slopes[i]);
    put_bytes(to, slave->given, (size_t)component.count);
    put_whole(to, (uint64_t)slave->warnings);
    for (int i = 0; i < slave->warnings; i++) put_whole(to, slave->warned[i]);
    for (int i = 0; i < component.count; i++) {
        if (component.variables[i].kind != STRING) continue;
        size_t size = strlen(slave->texts[i]);
        put_whole(to, size);
        put_bytes(to, slave->texts[i], size);
    }
    if (slave->unbuilt) return;
    put_number(to, slave->discretised);
    put_row(to, slave->store);
    put_row(to, slave->state);
    put_row(to, slave->before);
    put_row(to, slave->outputs);
}

Status slave_save(Slave *slave, State *state) {
    if (slave->stale) slave_follow(slave, 0);
    Bytes to = {0};
    put_all(slave, &to); /* counts alone */
    if (to.used != state->size || !state->bytes) {
        unsigned char *bytes = realloc(state->bytes, to.used);
        if (!bytes) return FAILED;
        state->bytes = bytes;
        state->size = to.used;
    }
    to = (Bytes){state->bytes, 0, state->size, 0};
    put_all(slave, &to);
    to.used = DIGEST_AT;
    put_whole(&to, digest(state->bytes + HEAD, state->size - HEAD));
    return DONE;
}

static Status refuse(Slave *slave, const char *why) {
    Text text;
    text_clear(&text);
    text_add(&text, slave->name);
    text_add(&text, ": the state cannot be set: ");
    text_add(&text, why);
    slave->say(slave, FAILED, text.at);
    return FAILED;
}

Status slave_check(Slave *slave, const unsigned char *bytes, size_t size) {
    Bytes from = {(unsigned char *)bytes, DIGEST_AT, size, 0};
    if (size < HEAD || memcmp(bytes, MARK, sizeof MARK) != 0)
        return refuse(slave, "it is not one of this FMU.");
    if (strncmp((const char *)bytes + sizeof MARK, component.guid, GUID_SIZE) != 0)
        return refuse(slave, "it is one of another FMU.");
    if (take_whole(&from) != digest(bytes + HEAD, size - HEAD))
        return refuse(slave, "it is damaged.");
    return DONE;
}

/* Take the texts; return whether one of them changes, -1 where memory ends. */
static int take_texts(Slave *slave, Bytes *from) {
    int changes = 0;
    for (int i = 0; i < component.count; i++) {
        if (component.variables[i].kind != STRING) continue;
        uint64_t size = take_whole(from);
        const unsigned char *text = take_bytes(from, (size_t)size);
        if (!text) return -1;
        if (strlen(slave->texts[i]) == size && memcmp(slave->texts[i], text, (size_t)size) == 0)
            continue;
        char *copy = malloc((size_t)size + 1);
        if (!copy) return -1;
        memcpy(copy, text, (size_t)size);
        copy[size] = 0;
        free(slave->texts[i]);
        slave->texts[i] = copy;
        changes = 1;
    }
    return changes;
}

static int take_row(Row row, Bytes *from) {
    if (take_whole(from) != (uint64_t)row.size) return 0;
    for (int64_t i = 0; i < row.size; i++) row.at[i] = take_number(from);
    return !from->overrun;
}

/* Take mode, time, values and texts; return whether parameters change, -1 for what cannot be. */
static int take_values(Slave *slave, Bytes *from) {
    int changes = 0;
    slave->mode = (int)take_whole(from);
    slave->unbuilt = (int)take_whole(from);
    slave->time = take_number(from);
    for (int i = 0; i < component.count; i++) {
        double value = take_number(from);
        if (component.variables[i].causality == PARAMETER && value != slave->values[i]) changes = 1;
        slave->values[i] = value;
    }
    slave->sloping = 0;
    for (int i = 0; i < component.inputs; i++) {
        slave->slopes[i] = take_number(from);
        slave->sloping |= slave->slopes[i] != 0.0;
    }
    const unsigned char *given = take_bytes(from, (size_t)component.count);
    uint64_t warnings = take_whole(from);
    if (!given || warnings > MOST_WARNINGS) return -1;
    memcpy(slave->given, given, (size_t)component.count);
    slave->warnings = (int)warnings;
    for (int i = 0; i < slave->warnings; i++) slave->warned[i] = take_whole(from);
    int texts = take_texts(slave, from);
    return texts < 0 || from->overrun ? -1 : changes || texts;
}

Status slave_restore(Slave *slave, const State *state) {
    Bytes from = {state->bytes, HEAD, state->size, 0};
    int unbuilt = slave->unbuilt;
    Text wrong;
    text_clear(&wrong);
    int changes = take_values(slave, &from);
    slave->stale = slave->unbuilt;
    if (changes >= 0 && slave->unbuilt) return DONE;
    if (changes < 0) {
        text_add(&wrong, "it is damaged.");
    } else if (unbuilt || changes) { /* of another instance, or from before a reset */
        if (slave_configure(slave, &wrong)) changes = 0;
    }
    if (changes == 0) slave->discretised = take_number(&from);
    if (changes == 0 && !(take_row(slave->store, &from) && take_row(slave->state, &from) &&
                          take_row(slave->before, &from) && take_row(slave->outputs, &from))) {
        text_add(&wrong, "its size is another.");
    }
    if (wrong.used == 0) return DONE;
    slave->values[component.fault] = 0.0;
    Text text;
    text_clear(&text);
    text_add(&text, "the state cannot be set: ");
    text_add(&text, wrong.at);
    return slave_stop(slave, BAD_STATE, text.at);
}
