/* The samples of a CSV of two columns, time [s] and value.

   What is refused, and in which words, is as in Python: see bristle/physics/motion_file.py. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "files.h"
#include "samples.h"

static void trim(const char **at, const char **end) {
    while (*at < *end && is_space(**at)) ++*at;
    while (*end > *at && is_space((*end)[-1])) --*end;
}

static void add_part(Text *text, const char *at, const char *end) {
    char copy[512];
    size_t count = (size_t)(end - at);
    if (count > sizeof copy - 1) count = sizeof copy - 1;
    memcpy(copy, at, count);
    copy[count] = 0;
    text_add(text, copy);
}

/* Add at most 40 letters of a text. */
static void add_short(Text *text, const char *at, const char *end) {
    size_t letters = 0;
    const char *cut = end;
    for (const char *p = at; p < end; p++) {
        if (((unsigned char)*p & 0xC0) == 0x80) continue;
        if (letters == 37) cut = p;
        letters++;
    }
    add_part(text, at, letters <= 40 ? end : cut);
    if (letters > 40) text_add(text, "...");
}

static void add_place(Text *text, const char *name, long line) {
    text_add(text, name);
    text_add(text, ", line ");
    text_whole(text, line);
    text_add(text, ": ");
}

int samples_keep(Samples *samples, double time, double value, long line) {
    if (samples->count == samples->room) {
        size_t room = samples->room ? 2 * samples->room : 1024;
        double *times = realloc(samples->times, room * sizeof *times);
        if (times) samples->times = times;
        double *values = realloc(samples->values, room * sizeof *values);
        if (values) samples->values = values;
        long *lines = realloc(samples->lines, room * sizeof *lines);
        if (lines) samples->lines = lines;
        if (!times || !values || !lines) return 0;
        samples->room = room;
    }
    samples->times[samples->count] = time;
    samples->values[samples->count] = value;
    samples->lines[samples->count++] = line;
    return 1;
}

static int has_header(const char *at, const char *end, const char *wanted) {
    const char *comma = memchr(at, ',', (size_t)(end - at));
    if (!comma || memchr(comma + 1, ',', (size_t)(end - comma - 1))) return 0;
    const char *right = strchr(wanted, ',') + 1, *stop = comma, *begin = comma + 1;
    size_t count = (size_t)(right - 1 - wanted);
    trim(&at, &stop);
    if ((size_t)(stop - at) != count || memcmp(at, wanted, count) != 0) return 0;
    trim(&begin, &end);
    int any = strncmp(right, "NAME ", 5) == 0;
    if (any) right += 5;
    if (any && (strcmp(right, "[UNIT]") == 0 || !memchr(begin, '[', (size_t)(end - begin))))
        return 1;
    count = strlen(right);
    if (any && (size_t)(end - begin) > count) begin = end - count;
    return (size_t)(end - begin) == count && memcmp(begin, right, count) == 0;
}

static int read_field(const char *at, const char *end, const char *name, long line, double *value,
                      Text *wrong) {
    trim(&at, &end);
    int is_number = read_number(at, end, value);
    if (is_number && isfinite(*value)) return 1;
    add_place(wrong, name, line);
    if (at == end) {
        text_add(wrong, "a value is missing.");
        return 0;
    }
    if (!is_number) text_add(wrong, "\"");
    add_short(wrong, at, end);
    text_add(wrong, is_number ? " is not finite. Every sample needs a value."
                              : "\" is not a number.");
    return 0;
}

static int read_line(const char *at, const char *end, const char *name, long line,
                     Samples *samples, Text *wrong) {
    double time, value;
    long columns = 1;
    for (const char *p = at; p < end; p++) columns += *p == ',';
    if (columns != 2) {
        add_place(wrong, name, line);
        text_add(wrong, "\"");
        add_short(wrong, at, end);
        text_add(wrong, "\" has ");
        text_whole(wrong, columns);
        text_add(wrong, columns == 1 ? " column" : " columns");
        text_add(wrong, ". Each line holds two numbers, time and value.");
        return 0;
    }
    const char *comma = memchr(at, ',', (size_t)(end - at));
    if (!read_field(at, comma, name, line, &time, wrong)) return 0;
    if (!read_field(comma + 1, end, name, line, &value, wrong)) return 0;
    if (samples_keep(samples, time, value, line)) return 1;
    text_add(wrong, "out of memory.");
    return 0;
}

static int read_lines(const char *content, size_t size, const char *name, const char *header,
                      Samples *samples, Text *wrong) {
    const char *at = content, *last = content + size;
    long line = 0;
    int found = 0;
    if (size >= 3 && memcmp(content, "\xEF\xBB\xBF", 3) == 0) at += 3;
    while (at <= last) {
        const char *begin = at, *end = at;
        while (end < last && *end != '\n' && *end != '\r') end++;
        at = end + (end + 1 < last && end[0] == '\r' && end[1] == '\n' ? 2 : 1);
        line++;
        trim(&begin, &end);
        if (begin == end || *begin == '#') continue;
        if (found) {
            if (!read_line(begin, end, name, line, samples, wrong)) return 0;
            continue;
        }
        found = 1;
        if (has_header(begin, end, header)) continue;
        add_place(wrong, name, line);
        text_add(wrong, "the header is \"");
        add_short(wrong, begin, end);
        text_add(wrong, "\". It must be \"");
        text_add(wrong, header);
        text_add(wrong, "\".");
        return 0;
    }
    if (found) return 1;
    text_add(wrong, name);
    text_add(wrong, ": the file holds no samples. It begins with \"");
    text_add(wrong, header);
    text_add(wrong, "\".");
    return 0;
}

static int ascending(const void *one, const void *other) {
    double a = *(const double *)one, b = *(const double *)other;
    return (a > b) - (a < b);
}

static double median(const double *times, size_t count) {
    size_t n = count - 1;
    double *spacings = malloc(n * sizeof *spacings);
    if (!spacings) return INFINITY; /* no gap is found then */
    for (size_t k = 0; k < n; k++) spacings[k] = times[k + 1] - times[k];
    qsort(spacings, n, sizeof *spacings, ascending);
    double found = 0.5 * (spacings[(n - 1) / 2] + spacings[n / 2]);
    free(spacings);
    return found;
}

static int check_times(const Samples *samples, const char *name, Text *wrong) {
    const double *times = samples->times;
    if (samples->count < 2) {
        text_add(wrong, name);
        text_add(wrong, samples->count ? ": 1 sample" : ": 0 samples");
        text_add(wrong, ". A record has two at least.");
        return 0;
    }
    if (times[0] < 0.0) {
        add_place(wrong, name, samples->lines[0]);
        text_add(wrong, "the time begins at ");
        text_general(wrong, times[0]);
        text_add(wrong, " s, before a run does. Shift it to begin at 0 or later.");
        return 0;
    }
    for (size_t k = 1; k < samples->count; k++) {
        if (times[k] > times[k - 1]) continue;
        add_place(wrong, name, samples->lines[k]);
        text_add(wrong, "the time ");
        text_repr(wrong, times[k]);
        if (times[k] == times[k - 1]) {
            text_add(wrong, " s appears twice");
        } else {
            text_add(wrong, " s follows ");
            text_repr(wrong, times[k - 1]);
            text_add(wrong, " s");
        }
        text_add(wrong, ". Times increase from line to line; were they written with too few "
                        "digits?");
        return 0;
    }
    double usual = median(times, samples->count);
    for (size_t k = 1; k < samples->count; k++) {
        if (!(times[k] - times[k - 1] > 1.5 * usual * (1.0 + 1e-6))) continue;
        add_place(wrong, name, samples->lines[k]);
        text_add(wrong, "a gap from ");
        text_general(wrong, times[k - 1]);
        text_add(wrong, " s to ");
        text_general(wrong, times[k]);
        text_add(wrong, " s, where the usual spacing is ");
        text_general(wrong, usual);
        text_add(wrong, " s. Fill it, or cut the record there.");
        return 0;
    }
    return 1;
}

void samples_free(Samples *samples) {
    free(samples->times);
    free(samples->values);
    free(samples->lines);
    *samples = (Samples){0};
}

int read_two_column(const char *path, const char *header, Samples *samples, Text *wrong) {
    size_t size;
    char *content = read_text_file(path, &size, wrong);
    if (!content) return 0;
    int right = read_lines(content, size, path, header, samples, wrong) &&
                check_times(samples, path, wrong);
    free(content);
    return right;
}
