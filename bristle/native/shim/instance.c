/* An instance from its begin to its end, the order of calls, and the step. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static void free_texts(Slave *slave) {
    if (!slave->texts) return;
    for (int i = 0; i < component.count; i++) free(slave->texts[i]);
    memset(slave->texts, 0, (size_t)component.count * sizeof *slave->texts);
}

Slave *slave_new(const char *name, const char *resources) {
    Slave *slave = calloc(1, sizeof *slave);
    if (!slave) return 0;
    size_t count = (size_t)component.count;
    slave->name = text_copy(name);
    slave->resources = text_copy(resources);
    slave->values = calloc(count, sizeof *slave->values);
    slave->texts = calloc(count, sizeof *slave->texts);
    slave->given = calloc(count, 1);
    slave->held = calloc((size_t)component.outputs + 1, sizeof *slave->held);
    slave->slopes = calloc((size_t)component.inputs + 1, sizeof *slave->slopes);
    int whole = slave->name && slave->resources && slave->values && slave->texts &&
                slave->given && slave->held && slave->slopes;
    if (whole && slave_reset(slave)) return slave;
    slave_free(slave);
    return 0;
}

void slave_free(Slave *slave) {
    free_texts(slave);
    free(slave->texts);
    free(slave->name);
    free(slave->resources);
    free(slave->values);
    free(slave->given);
    free(slave->held);
    free(slave->slopes);
    free(slave->memory);
    free(slave->sampled);
    free(slave);
}

int slave_reset(Slave *slave) {
    free_texts(slave);
    for (int i = 0; i < component.count; i++) {
        const Variable *v = &component.variables[i];
        slave->values[i] = v->start;
        slave->given[i] = (unsigned char)v->given;
        if (v->kind == STRING && !(slave->texts[i] = text_copy(v->text))) return 0;
    }
    slave->mode = INSTANTIATED;
    slave->stale = slave->unbuilt = 1;
    memset(slave->slopes, 0, (size_t)component.inputs * sizeof *slave->slopes);
    slave->sloping = slave->warnings = 0;
    slave->blamed = -1;
    slave->time = 0.0;
    return 1;
}

Status slave_enter(Slave *slave) {
    if (slave->mode != INSTANTIATED)
        return slave_stop(slave, WRONG_MODE,
                          "initialisation entered twice; reset the instance first.");
    slave->mode = INITIALISING;
    return DONE;
}

Status slave_leave(Slave *slave) {
    if (slave->mode != INITIALISING)
        return slave_stop(slave, WRONG_MODE, "initialisation left without being entered.");
    slave->unbuilt = 1;
    slave_follow(slave, 1);
    slave->mode = STEPPING;
    /* What is wrong shows in `fault` and at the first step: hosts can still read the outputs. */
    return DONE;
}

static void hold_outputs(Slave *slave) {
    memcpy(slave->held, slave->values + component.outputs_at,
           (size_t)component.outputs * sizeof(double));
}

static void take_inputs(Slave *slave) {
    memcpy(slave->now.at, slave->values + component.inputs_at,
           (size_t)component.inputs * sizeof(double));
    for (int i = 0; i < component.inputs; i++)
        slave->given_inputs.at[i] = slave->given[component.inputs_at + i];
}

/* Take inputs that change over a step: those that the component holds in its middle, the others,
   which it interpolates or samples itself, from its begin to its end. */
static void take_changing(Slave *slave, double dt) {
    for (int i = 0; i < component.inputs; i++) {
        int held = component.variables[component.inputs_at + i].held;
        if (slave->slopes[i] == 0.0) continue;
        if (!held) slave->before.at[i] = slave->now.at[i];
        slave->now.at[i] += (held ? 0.5 : 1.0) * slave->slopes[i] * dt;
    }
}

/* Inputs behind a step stand where it has brought them, and outputs follow them there. */
static void move_inputs(Slave *slave, double dt) {
    double *inputs = slave->values + component.inputs_at;
    for (int i = 0; i < component.inputs; i++)
        if (slave->slopes[i] != 0.0) inputs[i] += slave->slopes[i] * dt;
    slave->stale = 1;
}

static void keep_inputs(Slave *slave) {
    memcpy(slave->before.at, slave->now.at, (size_t)component.inputs * sizeof(double));
}

static void show_outputs(Slave *slave) {
    memcpy(slave->values + component.outputs_at, slave->outputs.at,
           (size_t)component.outputs * sizeof(double));
}

static int inputs_are_finite(const Slave *slave) {
    for (int i = 0; i < component.inputs; i++)
        if (!isfinite(slave->values[component.inputs_at + i])) return 0;
    return 1;
}

static int outputs_are_finite(Slave *slave, Text *wrong) {
    const double *outputs = slave->values + component.outputs_at;
    double sum = 0.0;
    for (int i = 0; i < component.outputs; i++) sum += outputs[i];
    if (isfinite(sum)) return 1;
    const char *between = "not finite: ";
    for (int i = 0; i < component.outputs; i++) {
        if (isfinite(outputs[i])) continue;
        if (*between != ',') slave_blame(slave, component.variables[component.outputs_at + i].name);
        text_add(wrong, between);
        text_add(wrong, component.variables[component.outputs_at + i].name);
        between = ", ";
    }
    if (*between != ',') text_add(wrong, "not finite: the sum of the outputs");
    text_add(wrong, ".");
    return 0;
}

/* Compute the outputs from inputs and state, without moving the model. */
static int refresh(Slave *slave, Text *wrong) {
    int64_t code;
    int call = slave->mode == STEPPING ? SHOW : START;
    take_inputs(slave);
    if (call == START) keep_inputs(slave); /* until the first step the state follows them */
    int called = slave_call(slave, call, slave->time, 0.0, slave->new_state, slave->work, &code);
    if (!slave_answer(slave, called, code, 0.0, wrong)) return 0;
    show_outputs(slave);
    return 1;
}

/* Bring the outputs up to date with inputs, parameters and state. */
void slave_follow(Slave *slave, int final) {
    Text wrong;
    int right = 1;
    slave->stale = 0;
    slave->blamed = -1;
    if (slave->values[component.fault] != 0.0 || slave->mode == TERMINATED) return;
    text_clear(&wrong);
    hold_outputs(slave);
    if (slave->unbuilt) {
        right = slave_configure(slave, &wrong);
        slave->unbuilt = !right;
    }
    if (right && inputs_are_finite(slave)) right = refresh(slave, &wrong);
    if (right) right = outputs_are_finite(slave, &wrong);
    if (right) return;
    for (int i = 0; i < component.outputs; i++)
        slave->values[component.outputs_at + i] = final ? 0.0 : slave->held[i];
    if (final) slave_stop(slave, BAD_PARAMETER, wrong.at);
    slave->blamed = -1; /* else this is no fault yet */
}

/* Move the model over one step. */
static int advance(Slave *slave, double time, double dt, Text *wrong) {
    int64_t code;
    take_inputs(slave);
    if (slave->sloping) take_changing(slave, dt);
    Row after = component.in_place ? slave->state : slave->new_state;
    if (component.discretises && slave->discretised != dt) {
        int done = slave_call(slave, DISCRETISE, time, dt, after, slave->work, &code);
        if (!slave_answer(slave, done, code, dt, wrong)) return 0;
        slave->discretised = dt;
    }
    int called = slave_call(slave, STEP, time, dt, after, slave->work, &code);
    if (!called || code < 0) text_add(wrong, "ValueError: "); /* as Python calls it */
    if (!slave_answer(slave, called, code, dt, wrong)) return 0;
    if (!component.in_place) {
        slave->new_state = slave->state;
        slave->state = after;
    }
    keep_inputs(slave);
    show_outputs(slave);
    return 1;
}

/* Whether all inputs are finite over a step; what is not is said. */
static int step_is_finite(Slave *slave, double dt, Text *wrong) {
    for (int i = 0; i < component.inputs; i++) {
        double value = slave->values[component.inputs_at + i], slope = slave->slopes[i];
        double change = slope != 0.0 ? slope * dt : 0.0;
        if (isfinite(value + change)) continue;
        int of_slope = isfinite(value) && !isfinite(slope);
        slave_blame(slave, component.variables[component.inputs_at + i].name);
        if (of_slope) text_add(wrong, "the derivative of ");
        text_add(wrong, component.variables[component.inputs_at + i].name);
        text_add(wrong, " = ");
        text_repr(wrong, of_slope ? slope : value + change);
        text_add(wrong, ".");
        return 0;
    }
    return 1;
}

Status slave_step(Slave *slave, double time, double dt) {
    Text wrong;
    text_clear(&wrong);
    slave->blamed = -1;
    if (slave->values[component.fault] != 0.0) return FAILED;
    if (slave->mode != STEPPING)
        return slave_stop(slave, WRONG_MODE,
                          "doStep belongs between initialisation and terminate.");
    if (!(dt > 0.0 && isfinite(dt) && isfinite(time))) {
        text_add(&wrong, "time ");
        text_repr(&wrong, time);
        text_add(&wrong, " s, step ");
        text_repr(&wrong, dt);
        text_add(&wrong, " s.");
        return slave_stop(slave, BAD_STEP, wrong.at);
    }
    if (!step_is_finite(slave, dt, &wrong)) return slave_stop(slave, NOT_FINITE_INPUT, wrong.at);
    hold_outputs(slave);
    double before = slave->time;
    slave->time = time + dt;
    if (!advance(slave, time, dt, &wrong) || !outputs_are_finite(slave, &wrong)) {
        memcpy(slave->values + component.outputs_at, slave->held,
               (size_t)component.outputs * sizeof(double));
        slave->time = before;
        return slave_stop(slave, BAD_STATE, wrong.at);
    }
    slave->stale = 0;
    if (slave->sloping) move_inputs(slave, dt);
    return DONE;
}
