/* From parameters to constants and the first state: the rows that the functions work on. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static void add_repr(Text *text, int kind, double value) {
    if (kind == INTEGER)
        text_whole(text, (long long)value);
    else
        text_repr(text, value);
}

static int check_parameters(Slave *slave, Text *wrong) {
    for (int i = 0; i < component.count; i++) {
        const Variable *v = &component.variables[i];
        if (v->causality != PARAMETER || (v->kind != REAL && v->kind != INTEGER)) continue;
        double value = slave->values[i];
        int finite = isfinite(value);
        if (finite && value >= v->low && value <= v->high) continue;
        slave_blame(slave, v->name);
        text_add(wrong, v->name);
        text_add(wrong, " = ");
        add_repr(wrong, v->kind, value);
        if (finite) {
            text_add(wrong, " lies outside ");
            text_add(wrong, v->bounds);
            text_add(wrong, ".");
        } else {
            text_add(wrong, " is not finite.");
        }
        return 0;
    }
    return 1;
}

static double word_of(const Variable *v, const char *text) {
    if (!v->words) return 0.0;
    for (int k = 0; v->words[k]; k++)
        if (strcmp(v->words[k], text) == 0) return k;
    return -1.0;
}

static void fill_parameters(Slave *slave) {
    int64_t at = 0;
    for (int i = 0; i < component.count; i++) {
        const Variable *v = &component.variables[i];
        if (v->causality == PARAMETER)
            slave->parameters.at[at++] =
                v->kind == STRING ? word_of(v, slave->texts[i]) : slave->values[i];
    }
    for (int i = 0; i < component.inputs; i++)
        slave->given_inputs.at[i] = slave->given[component.inputs_at + i];
}

static int64_t count_parameters(void) {
    int64_t count = 0;
    for (int i = 0; i < component.count; i++)
        count += component.variables[i].causality == PARAMETER;
    return count;
}

/* Lay rows into one piece of memory, all zero; parameters and given inputs are filled. */
static int lay_out(Slave *slave, const int64_t sizes[4], Text *wrong) {
    Row *rows[] = {&slave->parameters, &slave->given_inputs, &slave->store, &slave->state,
                   &slave->new_state,  &slave->before,       &slave->now,   &slave->outputs,
                   &slave->work};
    int64_t counts[] = {count_parameters(), component.inputs, sizes[0], sizes[1],
                        sizes[1],           component.inputs, component.inputs, sizes[2],
                        sizes[3]};
    size_t total = 0;
    for (int i = 0; i < 9; i++) total += (size_t)counts[i] + 1;
    double *memory = calloc(total, sizeof(double));
    if (!memory) {
        text_add(wrong, "out of memory.");
        return 0;
    }
    free(slave->memory);
    slave->memory = memory;
    for (int i = 0; i < 9; i++) {
        *rows[i] = (Row){memory, counts[i]};
        memory += counts[i] + 1; /* never empty, as a row of no numbers would be */
    }
    fill_parameters(slave);
    return 1;
}

int slave_call(Slave *slave, int call, double time, double dt, Row new_state, Row work,
               int64_t *code) {
    Row baked = {(double *)component.baked, component.baked_size};
    void *thrown = 0;
    *code = 0;
    return bristle_entrance(
               code, &thrown, call, time, dt, AS_ROW(slave->parameters),
               AS_ROW(slave->given_inputs), AS_ROW(baked), AS_ROW(slave->times),
               AS_ROW(slave->samples), AS_ROW(slave->store), AS_ROW(slave->state),
               AS_ROW(new_state), AS_ROW(slave->before), AS_ROW(slave->now),
               AS_ROW(slave->outputs), AS_ROW(work)) == 0;
}

/* Ask how large store, state, outputs and work are. */
static int ask_sizes(Slave *slave, int64_t sizes[4], Text *wrong) {
    const int64_t none[4] = {0, 0, 0, 0};
    double found[4] = {0.0, 0.0, 0.0, 0.0};
    Row counts = {found, 4};
    int64_t code;
    if (!lay_out(slave, none, wrong)) return 0;
    int called = slave_call(slave, SIZES, slave->time, 0.0, slave->new_state, counts, &code);
    if (!slave_answer(slave, called, code, 0.0, wrong)) return 0;
    for (int i = 0; i < 4; i++) {
        if (!(found[i] >= 0.0 && found[i] < 1e9)) {
            text_add(wrong, "the parameters ask for too much memory.");
            return 0;
        }
        sizes[i] = (int64_t)found[i];
    }
    return 1;
}

int slave_configure(Slave *slave, Text *wrong) {
    int64_t sizes[4], code;
    if (!check_parameters(slave, wrong) || !read_samples(slave, wrong)) return 0;
    if (!ask_sizes(slave, sizes, wrong) || !lay_out(slave, sizes, wrong)) return 0;
    int called = slave_call(slave, SETUP, slave->time, 0.0, slave->new_state, slave->work, &code);
    if (!slave_answer(slave, called, code, 0.0, wrong)) return 0;
    memcpy(slave->new_state.at, slave->state.at, (size_t)sizes[1] * sizeof(double));
    memcpy(slave->before.at, slave->values + component.inputs_at,
           (size_t)component.inputs * sizeof(double));
    slave->discretised = 0.0;
    return 1;
}
