/* What a component plays: the samples that its parameters name, as a file or as TIME:VALUE pairs. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "files.h"
#include "samples.h"
#include "slave.h"

/* Read "0:0 1.5:4 3:0": times [s] and values, each held until the next. */
static int read_pairs(const char *at, Samples *samples, Text *wrong) {
    while (*at) {
        while (is_space(*at)) at++;
        const char *end = at, *colon;
        double time = NAN, value = NAN;
        while (*end && !is_space(*end)) end++;
        if (end == at) break;
        colon = memchr(at, ':', (size_t)(end - at));
        if (!colon || !read_number(at, colon, &time) || !read_number(colon + 1, end, &value) ||
            !isfinite(time) || !isfinite(value)) {
            char pair[128];
            size_t count = (size_t)(end - at) < sizeof pair ? (size_t)(end - at) : sizeof pair - 1;
            memcpy(pair, at, count);
            pair[count] = 0;
            text_add(wrong, "steps: \"");
            text_add(wrong, pair);
            text_add(wrong, "\" is not TIME:VALUE, two finite numbers; such as "
                            "\"0:0 1.5:4 3:0\".");
            return 0;
        }
        if (samples->count && !(time > samples->times[samples->count - 1])) {
            text_add(wrong, "steps: the time ");
            text_general(wrong, time);
            text_add(wrong, " s does not follow ");
            text_general(wrong, samples->times[samples->count - 1]);
            text_add(wrong, " s.");
            return 0;
        }
        if (!samples_keep(samples, time, value, 0)) {
            text_add(wrong, "out of memory.");
            return 0;
        }
        at = end;
    }
    if (samples->count) return 1;
    text_add(wrong, "steps: no pair; give TIME:VALUE pairs such as \"0:0 1.5:4 3:0\".");
    return 0;
}

static int is_chosen(const Slave *slave, const Choice *choice) {
    return choice->parameter >= 0 &&
           (choice->chooser < 0 || strcmp(slave->texts[choice->chooser], choice->word) == 0);
}

static int read_file(const Slave *slave, const char *named, Samples *samples, Text *wrong) {
    char path[4096], found[4096];
    for (const char *const *one = component.bundled; *one; one++) {
        if (strcmp(*one, named) != 0) continue;
        size_t used = strlen(slave->resources), more = strlen(named);
        if (used + more + 6 > sizeof found) break;
        path_of_uri(slave->resources, path, sizeof path);
        used = strlen(path);
        memcpy(found, path, used);
        found[used++] = '/';
        memcpy(found + used, named, more);
        memcpy(found + used + more, ".csv", 5);
        return read_two_column(found, component.header, samples, wrong);
    }
    return read_two_column(named, component.header, samples, wrong);
}

int read_samples(Slave *slave, Text *wrong) {
    Samples samples = {0};
    int right = 1;
    if (is_chosen(slave, &component.file))
        right = read_file(slave, slave->texts[component.file.parameter], &samples, wrong);
    else if (is_chosen(slave, &component.pairs))
        right = read_pairs(slave->texts[component.pairs.parameter], &samples, wrong);
    else
        right = samples_keep(&samples, 0.0, 0.0, 0); /* a signal without samples */
    double *memory = right ? calloc(2 * (samples.count + 1), sizeof *memory) : 0;
    if (!memory && wrong->used == 0) text_add(wrong, "out of memory.");
    if (memory) {
        size_t size = samples.count * sizeof *memory;
        free(slave->sampled);
        slave->sampled = memory;
        slave->times = (Row){memory, (int64_t)samples.count};
        slave->samples = (Row){memory + samples.count + 1, (int64_t)samples.count};
        if (size) {
            memcpy(slave->times.at, samples.times, size);
            memcpy(slave->samples.at, samples.values, size);
        }
    }
    samples_free(&samples);
    return memory != 0;
}
