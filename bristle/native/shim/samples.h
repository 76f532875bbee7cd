/* The samples of a signal over time. */

#ifndef SAMPLES_H
#define SAMPLES_H

#include <stddef.h>

#include "text.h"

typedef struct {
    double *times, *values; /* s, in the signal's unit */
    long *lines;            /* of the file, from 1 */
    size_t count, room;
} Samples;

static inline int is_space(char letter) { return letter == ' ' || (letter >= 9 && letter <= 13); }

int samples_keep(Samples *samples, double time, double value, long line); /* 0: out of memory */
void samples_free(Samples *samples);

/* Read a CSV; `header` is what it must have, NAME and UNIT in it stand for any.
   0: `wrong` says what is wrong with it. */
int read_two_column(const char *path, const char *header, Samples *samples, Text *wrong);

#endif
