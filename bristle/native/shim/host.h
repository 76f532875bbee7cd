/* What FMI 2.0 and 3.0 have in common on the way to a host: the messages that it wants to see, the
   values that it sets and gets, and the states that it holds. The numbers of a Status are the same
   in both. */

#ifndef HOST_H
#define HOST_H

#include "slave.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* Categories of messages, by Status; the first stands for all of them. */
extern const char *const host_categories[];
enum { EVERY_CATEGORY = 31, ALWAYS = 1 << FAILED | 1 << FATAL };

/* Choose what is logged, a bit for each category; none named: all. WARNED: one has no such name. */
Status host_choose(int *logged, int on, size_t count, const char *const names[]);

/* Why an instance cannot be made for this guid or token; NULL: it can. */
const char *host_refuses(const char *guid);

/* How the values of a kind lie in a host's array: Booleans are an int in FMI 2.0, a bool in 3.0. */
enum { DOUBLES, INTS, BOOLS };

/* Values of variables of one kind, in and out: the worst status; FAILED without an instance. */
Status host_get(Slave *slave, const unsigned references[], size_t count, int kind, int form,
                void *values);
Status host_set(Slave *slave, const unsigned references[], size_t count, int kind, int form,
                const void *values);
Status host_get_texts(Slave *slave, const unsigned references[], size_t count,
                      const char *values[]);
Status host_set_texts(Slave *slave, const unsigned references[], size_t count,
                      const char *const values[]);

/* States as a host holds them. A NULL for the instance or the state is answered with FAILED. */
Status host_save(Slave *slave, void **state);
Status host_restore(Slave *slave, void *state);
void host_forget(void **state);
Status host_size(const Slave *slave, const void *state, size_t *size);
Status host_serialise(const Slave *slave, const void *state, void *bytes, size_t size);
Status host_deserialise(Slave *slave, const void *bytes, size_t size, void **state);

#endif
