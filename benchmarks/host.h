/* What hosts in C share: how they find functions of a library, read lists of variables from their
 * arguments, and stop where a call fails. For one source file each. */
#ifndef HOST_H
#define HOST_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#define DIE(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(1))
/* A status above 1, which is Warning, ends the host. */
#define GOOD(call)                                   \
    do {                                             \
        int status_ = (call);                        \
        if (status_ > 1) DIE("%s: %d", #call, status_); \
    } while (0)
/* A function of FMI by its own name. */
#define TAKE(library, name) name##TYPE *name = (name##TYPE *)find(library, #name)

enum { MOST = 64 };

/* Variables that a host sets or reads; inputs move about their centre. */
typedef struct {
    unsigned reference[MOST];
    double centre[MOST], amplitude[MOST];
    size_t count;
} Ports;

static inline void *load(const char *path) {
#ifdef _WIN32
    void *library = (void *)LoadLibraryA(path);
    if (!library) DIE("%s cannot be loaded", path);
#else
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) DIE("%s", dlerror());
#endif
    return library;
}

static inline void *find(void *library, const char *name) {
#ifdef _WIN32
    void *found = (void *)GetProcAddress((HMODULE)library, name);
#else
    void *found = dlsym(library, name);
#endif
    if (!found) DIE("no %s", name);
    return found;
}

/* Read REFERENCE,... or REFERENCE:CENTRE:AMPLITUDE,... ; "-" and "" stand for none. */
static inline Ports ports(char *text) {
    Ports found = {0};
    if (strcmp(text, "-") == 0) return found;
    for (char *one = strtok(text, ","); one; one = strtok(0, ",")) {
        size_t n = found.count++;
        if (n == MOST) DIE("more than %d variables", MOST);
        char *more = strchr(one, ':');
        if (more && sscanf(more, ":%lf:%lf", &found.centre[n], &found.amplitude[n]) != 2)
            DIE("not REFERENCE:CENTRE:AMPLITUDE: %s", one);
        found.reference[n] = (unsigned)strtoul(one, 0, 10);
    }
    return found;
}

/* The value of an input in step k: a sine about its centre. */
static inline double moved(const Ports *inputs, size_t i, size_t k) {
    return inputs->centre[i] + inputs->amplitude[i] * sin(0.3 * (double)k + 0.7 * (double)i);
}

#ifdef fmi2Functions_h
static inline void say(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status,
                       fmi2String category, fmi2String text, ...) {
    (void)e;
    if (status > fmi2Warning) fprintf(stderr, "%s [%s] %s\n", name, category, text);
}

static const fmi2CallbackFunctions callbacks = {say, calloc, free, 0, 0};
#endif

#endif
