// What a page calls: hands its memory to the compiled time loop as numba's arrays. The sizes of the
// records come from the build.

#include <stdint.h>

typedef int64_t word;

// An array of numba: owner, parent, number of items, size of one, data, shape, stride.
#define ROW void *, void *, word, word, void *, word, word
#define ARRAY(data, count, size) 0, 0, count, size, data, count, size

extern int32_t bristle_entrance(word *found, void **exception, word rows, word substeps, double h,
                                ROW, ROW, ROW, ROW, ROW, ROW, ROW, ROW, ROW, ROW, void *, void *,
                                word, word, void *, word, word, word, word);

typedef struct {
    void *data;
    int32_t count;
} Array;

enum {
    SOURCES, TIMES, SAMPLES, DAMPERS, STRUCTURES, SAMPLED, CONSTANTS, MEMORY, SIGNALS, OUTPUTS
};

// Fills the table (rows + 1, outputs); found: rows that are filled, damper that did not settle or
// -1, sweeps.
__attribute__((export_name("march"))) int32_t march(int32_t rows, int32_t substeps, double h,
                                                    const Array *a, double *table, word *found) {
    void *exception = 0;
    word columns = a[OUTPUTS].count;
    return bristle_entrance(
        found, &exception, rows, substeps, h,
        ARRAY(a[SOURCES].data, a[SOURCES].count, SOURCE_SIZE),
        ARRAY(a[TIMES].data, a[TIMES].count, 8),
        ARRAY(a[SAMPLES].data, a[SAMPLES].count, 8),
        ARRAY(a[DAMPERS].data, a[DAMPERS].count, DAMPER_SIZE),
        ARRAY(a[STRUCTURES].data, a[STRUCTURES].count, STRUCTURE_SIZE),
        ARRAY(a[SAMPLED].data, a[SAMPLED].count, SAMPLED_SIZE),
        ARRAY(a[CONSTANTS].data, a[CONSTANTS].count, 8),
        ARRAY(a[MEMORY].data, a[MEMORY].count, 8),
        ARRAY(a[SIGNALS].data, a[SIGNALS].count, 8),
        ARRAY(a[OUTPUTS].data, a[OUTPUTS].count, 8),
        0, 0, (rows + (word)1) * columns, 8, table, rows + (word)1, columns, 8 * columns, 8);
}
