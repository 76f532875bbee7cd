/* What is known of one component: its generated tables, and its compiled functions. */

#ifndef COMPONENT_H
#define COMPONENT_H

#include <stdint.h>

enum { REAL, INTEGER, BOOLEAN, STRING };
enum { INPUT, OUTPUT, PARAMETER };

/* A variable; its value reference is its place in the table. */
typedef struct {
    const char *name;
    int kind, causality;
    double start;             /* of a String: 0 */
    const char *text;         /* start of a String, else NULL */
    double low, high;         /* what a parameter may be; infinite: no bound */
    const char *bounds;       /* both, as messages show them */
    const char *const *words; /* what a String chooses from, NULL behind the last; NULL: any text */
    int held;                 /* whether it is an input that is held over a step */
    int given;                /* whether the build sets it: an input that counts as set by a host */
} Variable;

/* What a code of the functions means: words and, between them, values of variables. */
typedef struct {
    const char *before; /* words before the value, NULL behind the last piece */
    int variable;       /* whose value follows; below 0: one of the step's, or none */
    char format;        /* 'g' as %g, 'r' as Python's repr */
} Piece;

enum { NO_VALUE = -1, STEP_LENGTH = -2 };

typedef struct {
    int64_t code;
    int64_t first; /* code of a warning that comes before, 0: none */
    int fault;     /* the Integer output of the part that it is about, below 0: none */
    const Piece *pieces;
} Meaning;

/* A String that is read where another one is a certain word. */
typedef struct {
    int parameter;    /* below 0: none */
    int chooser;      /* below 0: it is always read */
    const char *word;
} Choice;

/* A signal that is played. */
typedef struct {
    Choice file, pairs; /* what its samples are read from */
    const char *header; /* which a file must have; NAME and UNIT stand for any */
} Signal;

typedef struct {
    const char *name, *guid;
    const Variable *variables;
    int count;
    int fault;                     /* the Integer output with the fault's code */
    int inputs_at, inputs;         /* inputs are neighbours, and so are Real outputs */
    int outputs_at, outputs;
    const Meaning *meanings;       /* code 0 ends them */
    const double *baked;           /* what the build fixes */
    int64_t baked_size;
    int discretises;               /* what the step's length implies is computed once for it */
    int in_place;                  /* a step moves the state on where it lies */
    const Signal *signals;
    int played;                    /* how many signals there are */
    const char *const *bundled;    /* files among the resources, NULL behind the last */
} Component;

extern const Component component;

/* A row of numbers, and how a compiled function takes it: as seven words. */
typedef struct {
    double *at;
    int64_t size;
} Row;

#define ROW_WORDS void *, void *, int64_t, int64_t, double *, int64_t, int64_t
#define AS_ROW(row) 0, 0, (row).size, 8, (row).at, (row).size, 8

enum { SIZES, SETUP, START, STEP, SHOW, DISCRETISE };

/* The component's functions, compiled from Python, behind one entrance. Returns 0; what the
   function returns goes to `code`. `thrown` is not used: none of them raises. */
int bristle_entrance(
    int64_t *code, void **thrown, int64_t call, double time, double dt,
    ROW_WORDS, /* parameters */
    ROW_WORDS, /* given: per input whether a host has set it */
    ROW_WORDS, /* baked */
    ROW_WORDS, /* times of the samples of each signal, behind their number */
    ROW_WORDS, /* samples, likewise */
    ROW_WORDS, /* store */
    ROW_WORDS, /* state */
    ROW_WORDS, /* new state */
    ROW_WORDS, /* inputs before */
    ROW_WORDS, /* inputs now */
    ROW_WORDS, /* outputs */
    ROW_WORDS  /* work */
);

#endif
