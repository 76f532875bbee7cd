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

static int read_file(const Slave *slave, const char *header, const char *named, Samples *samples,
                     Text *wrong) {
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
        return read_two_column(found, header, samples, wrong);
    }
    return read_two_column(named, header, samples, wrong);
}

/* Name the part of a whole scenario that a parameter belongs to, as PART.PARAMETER says. */
static void name_part(Slave *slave, const Choice *choice, Text *wrong) {
    const char *name = component.variables[choice->parameter].name, *dot = strchr(name, '.');
    char part[128];
    size_t count = dot ? (size_t)(dot - name) : 0;
    if (count == 0 || count >= sizeof part) return;
    memcpy(part, name, count);
    part[count] = 0;
    slave_blame(slave, name);
    text_add(wrong, part);
    text_add(wrong, ": ");
}

static int read_signal(Slave *slave, const Signal *signal, Samples *samples, Text *wrong) {
    int filed = is_chosen(slave, &signal->file), right = 0;
    const Choice *choice = filed ? &signal->file : &signal->pairs;
    if (!is_chosen(slave, choice)) {
        if (samples_keep(samples, 0.0, 0.0, 0)) return 1; /* a signal without samples */
        text_add(wrong, "out of memory.");
        return 0;
    }
    name_part(slave, choice, wrong);
    if (filed)
        right = read_file(slave, signal->header, slave->texts[choice->parameter], samples, wrong);
    else
        right = read_pairs(slave->texts[choice->parameter], samples, wrong);
    if (right) text_clear(wrong);
    return right;
}

/* Write each signal's numbers behind how many they are. */
static void pack(double *to, size_t count, const double *from) {
    *to = (double)count;
    if (count) memcpy(to + 1, from, count * sizeof *to);
}

int read_samples(Slave *slave, Text *wrong) {
    size_t all = (size_t)component.played, size = 0, used = 0;
    Samples *samples = calloc(all + 1, sizeof *samples);
    double *memory = 0;
    int right = samples != 0;
    for (size_t i = 0; right && i < all; i++) {
        right = read_signal(slave, &component.signals[i], &samples[i], wrong);
        size += samples[i].count + 1;
    }
    if (right) memory = calloc(2 * (size + 1), sizeof *memory);
    if (!memory && wrong->used == 0) text_add(wrong, "out of memory.");
    for (size_t i = 0; memory && i < all; i++) {
        pack(memory + used, samples[i].count, samples[i].times);
        pack(memory + size + 1 + used, samples[i].count, samples[i].values);
        used += samples[i].count + 1;
    }
    if (memory) {
        free(slave->sampled);
        slave->sampled = memory;
        slave->times = (Row){memory, (int64_t)size};
        slave->samples = (Row){memory + size + 1, (int64_t)size};
    }
    for (size_t i = 0; samples && i < all; i++) samples_free(&samples[i]);
    free(samples);
    return memory != 0;
}
