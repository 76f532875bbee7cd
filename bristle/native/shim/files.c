/* The bytes of a file, and the texts about what is wrong with it. */

#define _POSIX_C_SOURCE 200809L

#include "files.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#ifdef _WIN32
#include <wchar.h>
#include <windows.h>

static wchar_t *wide(const char *path) {
    int count = MultiByteToWideChar(CP_UTF8, 0, path, -1, 0, 0);
    wchar_t *found = count > 0 ? calloc((size_t)count, sizeof *found) : 0;
    if (found) MultiByteToWideChar(CP_UTF8, 0, path, -1, found, count);
    return found;
}

static FILE *open_file(const char *path, unsigned *mode) {
    struct _stat64 status;
    FILE *file = 0;
    wchar_t *name = wide(path);
    if (name && _wstat64(name, &status) == 0) {
        *mode = status.st_mode;
        file = S_ISREG(*mode) ? _wfopen(name, L"rb") : 0;
    }
    free(name);
    return file;
}
#else
static FILE *open_file(const char *path, unsigned *mode) {
    struct stat status;
    if (stat(path, &status) != 0) return 0;
    *mode = status.st_mode;
    return S_ISREG(*mode) ? fopen(path, "rb") : 0;
}
#endif

static char *refuse(Text *wrong, const char *path, const char *before, const char *what,
                    const char *after) {
    text_add(wrong, path);
    text_add(wrong, before);
    text_add(wrong, what);
    text_add(wrong, after);
    return 0;
}

/* Return where bytes stop being UTF-8, or their end. */
static const unsigned char *end_of_utf8(const unsigned char *at, const unsigned char *end) {
    while (at < end) {
        unsigned char first = *at;
        int more = first < 0x80 ? 0 : first >= 0xC2 && first < 0xE0 ? 1 :
                   (first & 0xF0) == 0xE0 ? 2 : first >= 0xF0 && first < 0xF5 ? 3 : -1;
        if (more < 0 || at + more >= end) return at;
        for (int i = 1; i <= more; i++)
            if ((at[i] & 0xC0) != 0x80) return at;
        if ((first == 0xE0 && at[1] < 0xA0) || (first == 0xED && at[1] >= 0xA0) ||
            (first == 0xF0 && at[1] < 0x90) || (first == 0xF4 && at[1] >= 0x90))
            return at;
        at += more + 1;
    }
    return end;
}

static int is_text(const char *path, const char *content, size_t size, Text *wrong) {
    const unsigned char *begin = (const unsigned char *)content, *end = begin + size;
    if (size >= 2 && ((begin[0] == 0xFF && begin[1] == 0xFE) ||
                      (begin[0] == 0xFE && begin[1] == 0xFF))) {
        refuse(wrong, path, ": this is UTF-16. Save the file as UTF-8 text.", "", "");
        return 0;
    }
    if (memchr(content, 0, size)) {
        refuse(wrong, path,
               ": this is binary data. A record is a text file, CSV or AT2.", "", "");
        return 0;
    }
    const unsigned char *stop = end_of_utf8(begin, end);
    if (stop == end) return 1;
    long line = 1;
    char byte[8];
    for (const unsigned char *at = begin; at < stop; at++) line += *at == '\n';
    snprintf(byte, sizeof byte, "0x%02x", *stop);
    text_add(wrong, path);
    text_add(wrong, ", line ");
    text_whole(wrong, line);
    refuse(wrong, ": byte ", byte, " is not UTF-8. Save the file as UTF-8 text.", "");
    return 0;
}

char *read_text_file(const char *path, size_t *size, Text *wrong) {
    unsigned mode = 0;
    errno = 0;
    FILE *file = open_file(path, &mode);
    if (!file && mode && !S_ISREG(mode)) {
        const char *kind = S_ISDIR(mode) ? "a folder" : "no regular file";
        return refuse(wrong, path, ": this is ", kind, ". A record is one text file.");
    }
    if (!file && (errno == ENOENT || !*path)) /* as Python names a file without a name */
        return refuse(wrong, path, ": there is no such file.", "", "");
    if (!file) return refuse(wrong, path, ": the file cannot be read (", strerror(errno), ").");
    char *content = malloc((size_t)LARGEST_FILE + 2);
    *size = content ? fread(content, 1, (size_t)LARGEST_FILE + 1, file) : 0;
    int failed = ferror(file);
    fclose(file);
    if (!content) return refuse(wrong, path, ": out of memory.", "", "");
    if (failed || *size > LARGEST_FILE) {
        free(content);
        if (failed) return refuse(wrong, path, ": the file cannot be read.", "", "");
        return refuse(wrong, path,
                      ": more than the limit of 64 MB for one record. Cut it, or sample it more "
                      "coarsely.", "", "");
    }
    content[*size] = 0;
    char *fitting = realloc(content, *size + 1);
    if (fitting) content = fitting;
    if (is_text(path, content, *size, wrong)) return content;
    free(content);
    return 0;
}

static int hexadecimal(char letter) {
    if (letter >= '0' && letter <= '9') return letter - '0';
    letter |= 32;
    return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : -1;
}

void path_of_uri(const char *uri, char *path, size_t room) {
    size_t used = 0;
    int is_uri = strncmp(uri, "file:", 5) == 0;
    if (is_uri) uri += 5;
    if (is_uri && strncmp(uri, "//", 2) == 0) { /* file://HOST/path, the host mostly empty */
        uri += 2;
        while (*uri && *uri != '/') uri++;
    }
    if (is_uri && uri[0] == '/' && uri[1] && uri[2] == ':') uri++; /* /C:/path */
    for (; *uri && used + 1 < room; uri++) {
        int high = is_uri && *uri == '%' ? hexadecimal(uri[1]) : -1;
        int low = high >= 0 ? hexadecimal(uri[2]) : -1;
        path[used++] = low >= 0 ? (char)(high * 16 + low) : *uri;
        if (low >= 0) uri += 2;
    }
    while (used > 1 && path[used - 1] == '/') used--;
    path[used] = 0;
}
