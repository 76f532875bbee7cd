/* FMI 2.0: values of variables, and derivatives of inputs; none of outputs are given. */

#include "fmi2.h"

static fmi2Status worse(fmi2Status one, Status other) {
    return (fmi2Status)other > one ? (fmi2Status)other : one;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                              fmi2Real values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_get(slave_of(c), vr[i], REAL, &values[i]));
    return status;
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 fmi2Integer values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++) {
        double value = 0.0;
        status = worse(status, slave_get(slave_of(c), vr[i], INTEGER, &value));
        values[i] = (fmi2Integer)value;
    }
    return status;
}

EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 fmi2Boolean values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++) {
        double value = 0.0;
        status = worse(status, slave_get(slave_of(c), vr[i], BOOLEAN, &value));
        values[i] = value != 0.0;
    }
    return status;
}

EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                fmi2String values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_get_text(slave_of(c), vr[i], &values[i]));
    return status;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                              const fmi2Real values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_set(slave_of(c), vr[i], REAL, values[i]));
    return status;
}

EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 const fmi2Integer values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_set(slave_of(c), vr[i], INTEGER, values[i]));
    return status;
}

EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 const fmi2Boolean values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_set(slave_of(c), vr[i], BOOLEAN, values[i] ? 1.0 : 0.0));
    return status;
}

EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                const fmi2String values[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_set_text(slave_of(c), vr[i], values[i] ? values[i] : ""));
    return status;
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                              size_t count, const fmi2Integer order[],
                                              const fmi2Real value[]) {
    fmi2Status status = c ? fmi2OK : fmi2Error;
    for (size_t i = 0; c && i < count; i++)
        status = worse(status, slave_set_derivative(slave_of(c), vr[i], order[i], value[i]));
    return status;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                               size_t count, const fmi2Integer order[],
                                               fmi2Real value[]) {
    (void)c, (void)vr, (void)count, (void)order, (void)value;
    return fmi2Error;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[],
                                               size_t unknowns, const fmi2ValueReference known[],
                                               size_t knowns, const fmi2Real along[],
                                               fmi2Real derivative[]) {
    (void)c, (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)along;
    (void)derivative;
    return fmi2Error;
}
