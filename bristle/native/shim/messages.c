/* Faults and warnings: what is said of them, once. */

#include <string.h>

#include "slave.h"

static const char *const FAULTS[] = {
    "",
    "an input is not finite",
    "the step is not positive or not finite",
    "a step outside step mode",
    "a state or output is not finite or out of bounds",
    "a parameter or record is wrong",
};

void slave_blame(Slave *slave, const char *name) {
    const char *dot = strchr(name, '.');
    slave->blamed = -1;
    for (int i = 0; dot && i < component.count; i++) {
        const Variable *v = &component.variables[i];
        if (v->causality == OUTPUT && v->kind == INTEGER &&
            strncmp(v->name, name, (size_t)(dot - name) + 1) == 0)
            slave->blamed = i;
    }
}

Status slave_stop(Slave *slave, int fault, const char *why) {
    if (slave->values[component.fault] == 0.0) {
        Text text;
        slave->values[component.fault] = fault;
        if (slave->blamed >= 0) slave->values[slave->blamed] = fault;
        text_clear(&text);
        text_add(&text, slave->name);
        text_add(&text, ": fault ");
        text_whole(&text, fault);
        text_add(&text, ", ");
        text_add(&text, FAULTS[fault]);
        text_add(&text, ": ");
        text_add(&text, why);
        slave->say(slave, FAILED, text.at);
    }
    return FAILED;
}

/* FNV-1a, 64 bits. */
static uint64_t digest(const char *text) {
    uint64_t found = 14695981039346656037u;
    for (; *text; text++) found = (found ^ (unsigned char)*text) * 1099511628211u;
    return found;
}

void slave_warn(Slave *slave, const char *warning) {
    uint64_t which = digest(warning);
    for (int i = 0; i < slave->warnings; i++)
        if (slave->warned[i] == which) return;
    if (slave->warnings == MOST_WARNINGS) return;
    slave->warned[slave->warnings++] = which;
    Text text;
    text_clear(&text);
    text_add(&text, slave->name);
    text_add(&text, ": ");
    text_add(&text, warning);
    slave->say(slave, WARNED, text.at);
}

static const Meaning *meaning_of(int64_t code) {
    for (const Meaning *one = component.meanings; one->code; one++)
        if (one->code == code) return one;
    return 0;
}

static void add_value(const Slave *slave, const Piece *piece, double dt, Text *text) {
    double value = piece->variable == STEP_LENGTH ? dt : 0.0;
    int kind = REAL;
    if (piece->variable >= 0) {
        kind = component.variables[piece->variable].kind;
        if (kind == STRING) {
            const char *given = slave->texts[piece->variable];
            if (piece->format == 'r')
                text_quoted(text, given);
            else
                text_add(text, given);
            return;
        }
        value = slave->values[piece->variable];
    }
    if (piece->format == 'g')
        text_general(text, value);
    else if (kind == REAL)
        text_repr(text, value);
    else if (kind == INTEGER)
        text_whole(text, (long long)value);
    else
        text_add(text, value != 0.0 ? "True" : "False");
}

static void explain(const Slave *slave, const Meaning *meaning, double dt, Text *text) {
    for (const Piece *piece = meaning->pieces; piece->before; piece++) {
        text_add(text, piece->before);
        if (piece->variable != NO_VALUE) add_value(slave, piece, dt, text);
    }
}

static void warn_of(Slave *slave, const Meaning *meaning, double dt) {
    Text warning;
    text_clear(&warning);
    explain(slave, meaning, dt, &warning);
    slave_warn(slave, warning.at);
}

int slave_answer(Slave *slave, int called, int64_t code, double dt, Text *wrong) {
    if (called && code == 0) return 1;
    const Meaning *meaning = called ? meaning_of(code) : 0;
    if (!meaning) {
        text_add(wrong, "the component answered with the code ");
        text_whole(wrong, (long long)code);
        text_add(wrong, ".");
        return 0;
    }
    const Meaning *first = meaning->first ? meaning_of(meaning->first) : 0;
    if (first) warn_of(slave, first, dt);
    if (code > 0)
        warn_of(slave, meaning, dt);
    else
        explain(slave, meaning, dt, wrong);
    if (code < 0) slave->blamed = meaning->fault;
    return code > 0;
}
