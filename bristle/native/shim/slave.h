/* An instance of a component and what can be done with it, whatever the version of FMI.

   The rules are those of bristle's components in Python: an order of calls, faults that last until
   a reset or an earlier state, outputs that hold their last finite values and follow inputs as soon
   as these are set. Nothing is shared between instances, and a step allocates nothing. */

#ifndef SLAVE_H
#define SLAVE_H

#include <stddef.h>
#include <stdint.h>

#include "component.h"
#include "text.h"

typedef enum { DONE, WARNED, DISCARDED, FAILED, FATAL } Status;

enum { NOT_FINITE_INPUT = 1, BAD_STEP, WRONG_MODE, BAD_STATE, BAD_PARAMETER };
enum { INSTANTIATED, INITIALISING, STEPPING, TERMINATED };

/* Warnings that an instance remembers, to say each once; further ones are left out. */
enum { MOST_WARNINGS = 256 };

typedef struct Slave {
    char *name;      /* of the instance */
    char *resources; /* path of the folder with the FMU's resources */
    void *host;      /* what `say` needs to reach the host */
    void (*say)(const struct Slave *slave, Status status, const char *text);

    double *held;         /* room for the Real outputs */
    double *values;       /* of all variables but Strings, by value reference */
    char **texts;         /* of Strings, and of what was got as one */
    unsigned char *given; /* whether the host has set it, or the build this input */
    double *slopes;       /* of the inputs over the next steps, in their unit per second */
    int sloping;          /* whether one of them is not 0 */
    int mode, stale, unbuilt;
    int blamed; /* the output that tells the fault of a part as well, below 0: none */
    double time;
    double discretised; /* length of the step that `store` is prepared for, 0: none */
    uint64_t warned[MOST_WARNINGS]; /* digests of the warnings that were said */
    int warnings;

    double *memory; /* of the rows from `parameters` on */
    Row parameters, given_inputs, store, state, new_state, before, now, outputs, work;
    double *sampled; /* memory of the next two */
    Row times, samples;
} Slave;

/* instance.c: begin and end of an instance, and the order of calls */
Slave *slave_new(const char *name, const char *resources);
void slave_free(Slave *slave);
int slave_reset(Slave *slave); /* 0: out of memory */
Status slave_enter(Slave *slave);
Status slave_leave(Slave *slave);
Status slave_step(Slave *slave, double time, double dt);
void slave_follow(Slave *slave, int final);

/* values.c: values in and out. What was asked of a variable that is none, or set of another type, is
   answered with FAILED; what is got as another type with WARNED, a String that is no number as 0. */
Status slave_get(Slave *slave, unsigned reference, int kind, double *value);
Status slave_get_text(Slave *slave, unsigned reference, const char **value);
Status slave_set(Slave *slave, unsigned reference, int kind, double value);
Status slave_set_text(Slave *slave, unsigned reference, const char *value);
Status slave_set_derivative(Slave *slave, unsigned reference, int order, double value);

/* setup.c: from parameters to constants and the first state */
int slave_configure(Slave *slave, Text *wrong); /* 0: `wrong` says why it cannot be */
int slave_call(Slave *slave, int call, double time, double dt, Row new_state, Row work,
               int64_t *code);

/* messages.c: faults and warnings */
void slave_blame(Slave *slave, const char *name); /* the next fault is that of a variable's part */
Status slave_stop(Slave *slave, int fault, const char *why);
void slave_warn(Slave *slave, const char *text);

/* Warn of what a function's code says; 0: it is an error, which `wrong` says. */
int slave_answer(Slave *slave, int called, int64_t code, double dt, Text *wrong);

/* state.c: the whole state as bytes, the same on every platform */
typedef struct {
    size_t size;
    unsigned char *bytes;
} State;

Status slave_save(Slave *slave, State *state);
Status slave_restore(Slave *slave, const State *state);
Status slave_check(Slave *slave, const unsigned char *bytes, size_t size);

/* signal.c: the files and texts that signals are read from */
int read_samples(Slave *slave, Text *wrong); /* 0: `wrong` says what is wrong with them */

#endif
