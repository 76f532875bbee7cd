/* Values of variables, in and out. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static const char *const TYPES[] = {"float", "int", "bool", "str"};

/* Return whether there is such a variable, of such a type; warn where not. */
static int known(Slave *slave, unsigned reference, int kind) {
    Text text;
    if (reference < (unsigned)component.count &&
        component.variables[reference].kind == kind)
        return 1;
    text_clear(&text);
    if (reference >= (unsigned)component.count) {
        text_add(&text, "no variable has the value reference ");
        text_whole(&text, reference);
    } else {
        text_add(&text, component.variables[reference].name);
        text_add(&text, " is not of type ");
        text_add(&text, TYPES[kind]);
    }
    text_add(&text, ".");
    slave_warn(slave, text.at);
    return 0;
}

/* Hosts read Integers as Reals, and the like: such a value is converted, and a warning says so. */
static Status converted(Slave *slave, unsigned reference, int kind) {
    Text text;
    text_clear(&text);
    text_add(&text, component.variables[reference].name);
    text_add(&text, " is not of type ");
    text_add(&text, TYPES[kind]);
    text_add(&text, ": its value is converted.");
    slave_warn(slave, text.at);
    return WARNED;
}

/* Add a value that is no String, as Python writes it. */
static void add_value(Text *text, const Slave *slave, unsigned reference) {
    double value = slave->values[reference];
    int kind = component.variables[reference].kind;
    if (kind == REAL)
        text_repr(text, value);
    else if (kind == INTEGER)
        text_whole(text, (long long)value);
    else
        text_add(text, value != 0.0 ? "True" : "False");
}

Status slave_get(Slave *slave, unsigned reference, int kind, double *value) {
    int there = reference < (unsigned)component.count;
    int own = there ? component.variables[reference].kind : kind;
    if (slave->stale && own != BOOLEAN) slave_follow(slave, 0);
    double found = there && own != STRING ? slave->values[reference] : 0.0; /* no number is 0 */
    int fits = own == kind || kind != INTEGER || fabs(found) < 2147483648.0;
    if (!there || !fits) {
        known(slave, reference, kind);
        return FAILED;
    }
    *value = own == kind || kind == REAL ? found : kind == BOOLEAN ? found != 0.0 : trunc(found);
    return own == kind ? DONE : converted(slave, reference, kind);
}

Status slave_get_text(Slave *slave, unsigned reference, const char **value) {
    if (reference >= (unsigned)component.count) {
        known(slave, reference, STRING);
        return FAILED;
    }
    int own = component.variables[reference].kind;
    if (own != STRING) {
        if (slave->stale && own != BOOLEAN) slave_follow(slave, 0);
        Text text;
        text_clear(&text);
        add_value(&text, slave, reference);
        free(slave->texts[reference]);
        if (!(slave->texts[reference] = text_copy(text.at))) return FAILED;
    }
    *value = slave->texts[reference];
    return own == STRING ? DONE : converted(slave, reference, STRING);
}

/* Return whether a variable takes a value now, and what the host is answered. */
static int may_be_set(Slave *slave, unsigned reference, int changes, Status *answer) {
    const Variable *v = &component.variables[reference];
    Text text;
    text_clear(&text);
    text_add(&text, v->name);
    *answer = DONE;
    if (v->causality == INPUT) return 1;
    if (v->causality == OUTPUT) {
        text_add(&text, " cannot be set.");
        slave_warn(slave, text.at);
        *answer = WARNED;
        return 0;
    }
    if (slave->mode != STEPPING && slave->mode != TERMINATED) {
        slave->unbuilt = 1;
        return 1;
    }
    if (!changes) return 0;
    text_add(&text, " keeps ");
    if (v->kind == STRING)
        text_quoted(&text, slave->texts[reference]);
    else
        add_value(&text, slave, reference);
    text_add(&text, ": it is fixed after initialisation.");
    slave_warn(slave, text.at);
    *answer = WARNED;
    return 0;
}

Status slave_set(Slave *slave, unsigned reference, int kind, double value) {
    if (!known(slave, reference, kind)) return FAILED;
    Status answer;
    if (!may_be_set(slave, reference, value != slave->values[reference], &answer)) return answer;
    slave->values[reference] = value;
    slave->given[reference] = 1;
    slave->stale = 1;
    return DONE;
}

Status slave_set_text(Slave *slave, unsigned reference, const char *value) {
    if (!known(slave, reference, STRING)) return FAILED;
    Status answer;
    int changes = strcmp(value, slave->texts[reference]) != 0;
    if (!may_be_set(slave, reference, changes, &answer)) return answer;
    char *copy = text_copy(value);
    if (!copy) return FAILED;
    free(slave->texts[reference]);
    slave->texts[reference] = copy;
    slave->given[reference] = 1;
    slave->stale = 1;
    return DONE;
}

static Status refuse_derivative(Slave *slave, const Variable *variable, const char *why) {
    Text text;
    text_clear(&text);
    text_add(&text, slave->name);
    text_add(&text, ": the derivative of ");
    text_add(&text, variable->name);
    text_add(&text, " cannot be set: ");
    text_add(&text, why);
    slave->say(slave, FAILED, text.at);
    return FAILED;
}

/* Let an input change over the next steps, until another derivative is set, by `value` a second. */
Status slave_set_derivative(Slave *slave, unsigned reference, int order, double value) {
    if (!known(slave, reference, REAL)) return FAILED;
    const Variable *v = &component.variables[reference];
    if (v->causality != INPUT)
        return refuse_derivative(slave, v, "it is no input.");
    if (order != 1) return refuse_derivative(slave, v, "order 1 is right.");
    slave->slopes[(int)reference - component.inputs_at] = value;
    slave->sloping = 0;
    for (int i = 0; i < component.inputs; i++) slave->sloping |= slave->slopes[i] != 0.0;
    return DONE;
}
