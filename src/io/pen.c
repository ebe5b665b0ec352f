#include "io/pen.h"

#include "base/printable.h"
#include "io/number.h"

#include <assert.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_PRINTED = 256 };

char *qw_pen_room(qw_pen *pen, size_t size)
{
    if (size > SIZE_MAX / 4 - pen->size)
        qw_fail(pen->env, QW_MEMORY, -1, "%zu bytes more are more than can be addressed", size);
    pen->at = qw_grow(pen->env, pen->at, &pen->capacity, pen->size + size + 1, 1);
    pen->size += size;
    return pen->at + pen->size - size;
}

void qw_pen_put(qw_pen *pen, const void *bytes, size_t size)
{
    char *room = qw_pen_room(pen, size);
    if (size) memcpy(room, bytes, size);
}

void qw_pen_text(qw_pen *pen, const char *text) { qw_pen_put(pen, text, strlen(text)); }

void qw_pen_print(qw_pen *pen, const char *format, ...)
{
    char text[MOST_PRINTED];
    va_list arguments;
    va_start(arguments, format);
    int size = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    assert(size >= 0 && size < MOST_PRINTED);
    qw_pen_put(pen, text, (size_t)size);
}

void qw_pen_whole(qw_pen *pen, uint64_t value) { qw_pen_print(pen, "%" PRIu64, value); }

void qw_pen_number(qw_pen *pen, double value)
{
    char text[QW_NUMBER_SIZE];
    qw_pen_put(pen, text, qw_number_print(text, value));
}

void qw_pen_utf8(qw_pen *pen, const char *bytes, size_t size)
{
    size_t done = 0;
    for (size_t i = 0, step; i < size; i += step) {
        unsigned char c = (unsigned char)bytes[i];
        step = c < 0x80 ? 1 : qw_utf8_size(bytes + i);
        if (step > 0 && step <= size - i) continue;
        const char letter[2] = {(char)(0xc0 | c >> 6), (char)(0x80 | (c & 0x3f))};
        qw_pen_put(pen, bytes + done, i - done);
        qw_pen_put(pen, letter, sizeof letter);
        step = 1, done = i + 1;
    }
    qw_pen_put(pen, bytes + done, size - done);
}

void qw_pen_string(qw_pen *pen, const char *text)
{
    qw_pen_text(pen, "\"");
    while (*text) {
        unsigned char c = (unsigned char)*text;
        size_t plain = 0;
        while ((unsigned char)text[plain] >= ' ' && text[plain] != '"' && text[plain] != '\\') plain++;
        qw_pen_utf8(pen, text, plain);
        if (plain == 0) qw_pen_print(pen, c < ' ' ? "\\u%04x" : "\\%c", c), plain = 1;
        text += plain;
    }
    qw_pen_text(pen, "\"");
}

void qw_pen_align(qw_pen *pen, size_t to, char with)
{
    while (pen->size % to) qw_pen_put(pen, &with, 1);
}

void qw_pen_flush(qw_pen *pen, qw_file *file, size_t from)
{
    if (pen->size < from) return;
    qw_file_put(file, pen->at, pen->size);
    pen->size = 0;
}
