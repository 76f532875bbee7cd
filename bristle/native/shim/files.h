/* The bytes of a file, and the texts about what is wrong with it. */

#ifndef FILES_H
#define FILES_H

#include <stddef.h>

#include "text.h"

enum { LARGEST_FILE = 64 * 1024 * 1024 };

/* Read a text file whole, a zero behind it; the caller frees it. NULL: `wrong` says why not. */
char *read_text_file(const char *path, size_t *size, Text *wrong);

/* Write the path that an URI of a host stands for into `path`. */
void path_of_uri(const char *uri, char *path, size_t room);

#endif
