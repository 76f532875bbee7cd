/* Texts of bounded length, and numbers as Python writes them, whatever the host's locale is. */

#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *text_copy(const char *text) {
    size_t size = strlen(text) + 1;
    char *copy = malloc(size);
    if (copy) memcpy(copy, text, size);
    return copy;
}

void text_clear(Text *text) {
    text->used = 0;
    text->at[0] = 0;
}

static void add_bytes(Text *text, const char *more, size_t count) {
    size_t room = sizeof text->at - 1 - text->used;
    if (count > room) {
        count = room;
        while (count > 0 && ((unsigned char)more[count] & 0xC0) == 0x80) count--; /* whole letters */
    }
    memcpy(text->at + text->used, more, count);
    text->used += count;
    text->at[text->used] = 0;
}

void text_add(Text *text, const char *more) { add_bytes(text, more, strlen(more)); }

void text_whole(Text *text, long long value) {
    char digits[24];
    snprintf(digits, sizeof digits, "%lld", value);
    text_add(text, digits);
}

/* Write `value` with so many digits in scientific form; return its exponent. The decimal sign is
   the locale's, so only digits are taken from it. */
static int digits_of(double value, int count, char *digits) {
    char written[40];
    snprintf(written, sizeof written, "%.*e", count - 1, fabs(value));
    int found = 0;
    const char *at = written;
    for (; *at && *at != 'e'; at++)
        if (*at >= '0' && *at <= '9') digits[found++] = *at;
    digits[found] = 0;
    return *at ? atoi(at + 1) : 0;
}

/* Lay out digits as Python does: fixed from 1e-4 up to 10 to the `limit`, else with an exponent. */
static void add_digits(Text *text, const char *digits, int exponent, int limit, int float_sign) {
    int count = (int)strlen(digits);
    char tail[16];
    if (exponent < -4 || exponent >= limit) {
        add_bytes(text, digits, 1);
        if (count > 1) {
            text_add(text, ".");
            text_add(text, digits + 1);
        }
        snprintf(tail, sizeof tail, "e%c%02d", exponent < 0 ? '-' : '+', abs(exponent));
        text_add(text, tail);
        return;
    }
    if (exponent < 0) {
        text_add(text, "0.");
        for (int i = exponent + 1; i < 0; i++) text_add(text, "0");
        text_add(text, digits);
        return;
    }
    for (int i = 0; i <= exponent; i++) add_bytes(text, i < count ? digits + i : "0", 1);
    if (count > exponent + 1) {
        text_add(text, ".");
        text_add(text, digits + exponent + 1);
    } else if (float_sign) {
        text_add(text, ".0");
    }
}

static int add_special(Text *text, double value) {
    if (isnan(value)) {
        text_add(text, "nan");
        return 1;
    }
    if (signbit(value)) text_add(text, "-");
    if (isinf(value)) text_add(text, "inf");
    return isinf(value);
}

static void strip_zeros(char *digits) {
    size_t count = strlen(digits);
    while (count > 1 && digits[count - 1] == '0') digits[--count] = 0;
}

void text_repr(Text *text, double value) {
    if (add_special(text, value)) return;
    char digits[24], written[40];
    int count = 1;
    for (; count < 17; count++) {
        snprintf(written, sizeof written, "%.*e", count - 1, fabs(value));
        if (strtod(written, 0) == fabs(value)) break; /* the same locale both ways */
    }
    int exponent = digits_of(value, count, digits);
    strip_zeros(digits);
    add_digits(text, digits, exponent, 16, 1);
}

void text_general(Text *text, double value) {
    if (add_special(text, value)) return;
    char digits[24];
    int exponent = digits_of(value, 6, digits);
    strip_zeros(digits);
    add_digits(text, digits, exponent, 6, 0);
}

void text_quoted(Text *text, const char *value) {
    const char *quote = strchr(value, '\'') && !strchr(value, '"') ? "\"" : "'";
    text_add(text, quote);
    for (const char *at = value; *at; at++) {
        char escaped[8];
        unsigned char letter = (unsigned char)*at;
        if (*at == '\\' || *at == *quote)
            snprintf(escaped, sizeof escaped, "\\%c", *at);
        else if (letter == '\n' || letter == '\r' || letter == '\t')
            snprintf(escaped, sizeof escaped, "\\%c", letter == '\n' ? 'n' : letter == '\r' ? 'r' : 't');
        else if (letter < 32 || letter == 127)
            snprintf(escaped, sizeof escaped, "\\x%02x", letter);
        else
            snprintf(escaped, sizeof escaped, "%c", *at);
        text_add(text, escaped);
    }
    text_add(text, quote);
}

/* strtod reads the locale's decimal sign: a point is replaced by it, which is found by writing. */
int read_number(const char *at, const char *end, double *value) {
    char copy[128], sign[8];
    while (at < end && (*at == ' ' || (*at >= 9 && *at <= 13))) at++;
    while (end > at && (end[-1] == ' ' || (end[-1] >= 9 && end[-1] <= 13))) end--;
    size_t count = (size_t)(end - at), used = 0;
    if (count == 0 || count >= sizeof copy - sizeof sign) return 0;
    snprintf(sign, sizeof sign, "%.1f", 0.5);
    for (size_t i = 0; i < count; i++) {
        char letter = at[i];
        if (letter == 'x' || letter == 'X' || letter == '(' || letter == ',' || letter == '_')
            return 0; /* C reads 0x10 and nan(1) */
        if (letter == '.') {
            for (const char *s = sign + 1; *s && *s != '5'; s++) copy[used++] = *s;
        } else {
            copy[used++] = letter;
        }
    }
    copy[used] = 0;
    char *stop = 0;
    *value = strtod(copy, &stop);
    return stop == copy + used;
}
