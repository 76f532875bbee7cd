/* Texts of bounded length, and numbers as Python writes them, whatever the host's locale is. */

#ifndef TEXT_H
#define TEXT_H

#include <stddef.h>

typedef struct {
    char at[1024];
    size_t used;
} Text;

void text_clear(Text *text);
void text_add(Text *text, const char *more);
void text_whole(Text *text, long long value);
void text_repr(Text *text, double value);              /* shortest text that reads back equal */
void text_general(Text *text, double value);           /* six digits, as %g */
void text_quoted(Text *text, const char *value);       /* a text in quotes, as repr */
char *text_copy(const char *text);                      /* on the heap; 0: out of memory */
int read_number(const char *at, const char *end, double *value); /* 1: all of it is a number */

#endif
