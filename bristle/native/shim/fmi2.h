/* The types of FMI 2.0 for co-simulation, and how an instance reaches its host. */

#ifndef FMI2_H
#define FMI2_H

#include "host.h"

typedef void *fmi2Component;
typedef void *fmi2FMUstate;
typedef unsigned fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef int fmi2Type, fmi2StatusKind;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
enum { fmi2CoSimulation = 1 };
enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated };

typedef void (*fmi2Logger)(void *, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2Logger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(void *, fmi2Status);
    void *componentEnvironment;
} fmi2CallbackFunctions;

/* How an instance reaches its host. */
typedef struct {
    Slave *slave;
    fmi2CallbackFunctions callbacks;
    int logged; /* a bit for each of the categories that the host wants to see */
} Host;

static inline Slave *slave_of(fmi2Component c) { return c ? ((Host *)c)->slave : 0; }

#endif
