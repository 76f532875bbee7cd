/* The types of FMI 3.0 for co-simulation, and how an instance reaches its host. */

#ifndef FMI3_H
#define FMI3_H

#include <stdbool.h>

#include "host.h"

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef int32_t fmi3Int32;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);

/* How an instance reaches its host. */
typedef struct {
    Slave *slave;
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
    int logged; /* a bit for each of the categories that the host wants to see */
} Host;

static inline Slave *slave_of(fmi3Instance c) { return c ? ((Host *)c)->slave : 0; }

/* Say that a call, or what it names, is nothing that these FMUs offer. */
fmi3Status fmi3_refuse(fmi3Instance c, const char *what);

#endif
