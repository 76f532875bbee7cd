/* FMI 3.0: values of variables. All are single numbers or texts, so there is one value for each
   value reference. The one behind the component's own variables is the time. */

#include "fmi3.h"

/* Whether values can go in or out: one for each reference, of an instance. */
static fmi3Status begin(fmi3Instance c, size_t references, size_t values) {
    if (!c) return fmi3Error;
    return references == values ? fmi3OK : fmi3_refuse(c, "arrays: one value a variable is right");
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                 fmi3Float64 values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    for (size_t i = 0; i < count; i++) {
        if (vr[i] == (fmi3ValueReference)component.count)
            values[i] = slave_of(c)->time;
        else {
            fmi3Status one = (fmi3Status)host_get(slave_of(c), &vr[i], 1, REAL, DOUBLES, &values[i]);
            if (one > status) status = one;
        }
    }
    return status;
}

EXPORT fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                               fmi3Int32 values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_get(slave_of(c), vr, count, INTEGER, INTS, values);
}

EXPORT fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                 fmi3Boolean values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_get(slave_of(c), vr, count, BOOLEAN, BOOLS, values);
}

EXPORT fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                fmi3String values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_get_texts(slave_of(c), vr, count, values);
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                 const fmi3Float64 values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_set(slave_of(c), vr, count, REAL, DOUBLES, values);
}

EXPORT fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                               const fmi3Int32 values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_set(slave_of(c), vr, count, INTEGER, INTS, values);
}

EXPORT fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                 const fmi3Boolean values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_set(slave_of(c), vr, count, BOOLEAN, BOOLS, values);
}

EXPORT fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                const fmi3String values[], size_t size) {
    fmi3Status status = begin(c, count, size);
    if (status != fmi3OK) return status;
    return (fmi3Status)host_set_texts(slave_of(c), vr, count, values);
}
