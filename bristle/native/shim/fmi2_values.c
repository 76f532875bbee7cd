/* FMI 2.0: values of variables, and derivatives of inputs; none of outputs are given. */

#include "fmi2.h"

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                              fmi2Real values[]) {
    return (fmi2Status)host_get(slave_of(c), vr, count, REAL, DOUBLES, values);
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 fmi2Integer values[]) {
    return (fmi2Status)host_get(slave_of(c), vr, count, INTEGER, INTS, values);
}

EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 fmi2Boolean values[]) {
    return (fmi2Status)host_get(slave_of(c), vr, count, BOOLEAN, INTS, values);
}

EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                fmi2String values[]) {
    return (fmi2Status)host_get_texts(slave_of(c), vr, count, values);
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                              const fmi2Real values[]) {
    return (fmi2Status)host_set(slave_of(c), vr, count, REAL, DOUBLES, values);
}

EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 const fmi2Integer values[]) {
    return (fmi2Status)host_set(slave_of(c), vr, count, INTEGER, INTS, values);
}

EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                 const fmi2Boolean values[]) {
    return (fmi2Status)host_set(slave_of(c), vr, count, BOOLEAN, INTS, values);
}

EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                const fmi2String values[]) {
    return (fmi2Status)host_set_texts(slave_of(c), vr, count, values);
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                              size_t count, const fmi2Integer order[],
                                              const fmi2Real value[]) {
    Status status = c ? DONE : FAILED;
    for (size_t i = 0; c && i < count; i++)
        if (slave_set_derivative(slave_of(c), vr[i], order[i], value[i]) != DONE) status = FAILED;
    return (fmi2Status)status;
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
