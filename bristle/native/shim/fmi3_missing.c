/* FMI 3.0: what these FMUs do not offer, as their description says: other kinds of simulation, event
   and configuration mode, clocks, derivatives, and types that none of their variables has. A host
   may look for all functions of the standard; these answer Error. */

#include "fmi3.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"

typedef const fmi3ValueReference *References;
typedef fmi3Float64 *Numbers;
typedef const fmi3Float64 *GivenNumbers;
typedef uint64_t *Counters;
typedef const uint64_t *GivenCounters;
typedef int *Qualifiers;
typedef void (*Callback)(void);

#define MISSING(name, what, ...)                                                                   \
    EXPORT fmi3Status fmi3##name(fmi3Instance c, ##__VA_ARGS__) { return fmi3_refuse(c, what); }

#define MISSING_TYPE(name, type)                                                                   \
    EXPORT fmi3Status fmi3Get##name(fmi3Instance c, References vr, size_t count, type values[],    \
                                    size_t size) {                                                 \
        return c && !count ? fmi3OK : fmi3_refuse(c, "variables of type " #name);                  \
    }                                                                                              \
    EXPORT fmi3Status fmi3Set##name(fmi3Instance c, References vr, size_t count,                   \
                                    const type values[], size_t size) {                            \
        return c && !count ? fmi3OK : fmi3_refuse(c, "variables of type " #name);                  \
    }

MISSING_TYPE(Float32, float)
MISSING_TYPE(Int8, int8_t)
MISSING_TYPE(UInt8, uint8_t)
MISSING_TYPE(Int16, int16_t)
MISSING_TYPE(UInt16, uint16_t)
MISSING_TYPE(UInt32, uint32_t)
MISSING_TYPE(Int64, int64_t)
MISSING_TYPE(UInt64, uint64_t)

MISSING(GetBinary, "variables of type Binary", References vr, size_t count, size_t *sizes,
        const fmi3Byte **values, size_t size)
MISSING(SetBinary, "variables of type Binary", References vr, size_t count, const size_t *sizes,
        const fmi3Byte *const *values, size_t size)

#define CLOCKS "clocks"
MISSING(GetClock, CLOCKS, References vr, size_t count, fmi3Boolean *values)
MISSING(SetClock, CLOCKS, References vr, size_t count, const fmi3Boolean *values)
MISSING(GetIntervalDecimal, CLOCKS, References vr, size_t count, Numbers at, Qualifiers how)
MISSING(GetIntervalFraction, CLOCKS, References vr, size_t count, Counters at, Counters of,
        Qualifiers how)
MISSING(GetShiftDecimal, CLOCKS, References vr, size_t count, Numbers shifts)
MISSING(GetShiftFraction, CLOCKS, References vr, size_t count, Counters at, Counters of)
MISSING(SetIntervalDecimal, CLOCKS, References vr, size_t count, GivenNumbers at)
MISSING(SetIntervalFraction, CLOCKS, References vr, size_t count, GivenCounters at,
        GivenCounters of)
MISSING(SetShiftDecimal, CLOCKS, References vr, size_t count, GivenNumbers shifts)
MISSING(SetShiftFraction, CLOCKS, References vr, size_t count, GivenCounters at, GivenCounters of)

#define DERIVATIVES "derivatives"
MISSING(GetOutputDerivatives, DERIVATIVES, References vr, size_t count, const fmi3Int32 *orders,
        Numbers values, size_t size)
MISSING(GetDirectionalDerivative, DERIVATIVES, References unknown, size_t unknowns,
        References known, size_t knowns, GivenNumbers seed, size_t seeds, Numbers found, size_t size)
MISSING(GetAdjointDerivative, DERIVATIVES, References unknown, size_t unknowns, References known,
        size_t knowns, GivenNumbers seed, size_t seeds, Numbers found, size_t size)

#define PER_ELEMENT "dependencies beyond its description's"
MISSING(GetNumberOfVariableDependencies, PER_ELEMENT, fmi3ValueReference vr, size_t *count)
MISSING(GetVariableDependencies, PER_ELEMENT, fmi3ValueReference vr, size_t *elements,
        fmi3ValueReference *causes, size_t *of_causes, int *kinds, size_t count)

#define EVENTS "event mode"
MISSING(EnterEventMode, EVENTS)
MISSING(EnterStepMode, EVENTS)
MISSING(EvaluateDiscreteStates, EVENTS)
MISSING(UpdateDiscreteStates, EVENTS, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
        fmi3Boolean *values, fmi3Boolean *has_next, Numbers next)

#define CONFIGURATION "configuration mode"
MISSING(EnterConfigurationMode, CONFIGURATION)
MISSING(ExitConfigurationMode, CONFIGURATION)

#define EXCHANGE "model exchange"
MISSING(EnterContinuousTimeMode, EXCHANGE)
MISSING(CompletedIntegratorStep, EXCHANGE, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *end)
MISSING(SetTime, EXCHANGE, fmi3Float64 time)
MISSING(SetContinuousStates, EXCHANGE, GivenNumbers states, size_t count)
MISSING(GetContinuousStateDerivatives, EXCHANGE, Numbers derivatives, size_t count)
MISSING(GetEventIndicators, EXCHANGE, Numbers indicators, size_t count)
MISSING(GetContinuousStates, EXCHANGE, Numbers states, size_t count)
MISSING(GetNominalsOfContinuousStates, EXCHANGE, Numbers nominals, size_t count)
MISSING(GetNumberOfEventIndicators, EXCHANGE, size_t *count)
MISSING(GetNumberOfContinuousStates, EXCHANGE, size_t *count)

MISSING(ActivateModelPartition, "scheduled execution", fmi3ValueReference clock, fmi3Float64 time)

EXPORT fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger) {
    if (logger)
        logger(environment, fmi3Error, host_categories[FAILED],
               "this FMU is for co-simulation alone.");
    return 0;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    Callback update, Callback lock, Callback unlock) {
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment,
                                        logger);
}
