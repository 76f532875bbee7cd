/* A library that takes memory and gives it back as the process ends, as those of numba and of BLAS
 * do: where malloc's lists are broken by then, it aborts the process. */
#include <stdlib.h>

__attribute__((destructor)) static void late(void) {
    void *taken[2000];
    for (int i = 0; i < 2000; i++) taken[i] = malloc(0x80);
    for (int i = 0; i < 2000; i++) free(taken[i]);
    free(malloc(1 << 17));
}
