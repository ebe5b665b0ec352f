#include "base/json.h"

#include "base/printable.h"

#include <assert.h>
#include <inttypes.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

qw_json qw_json_into(char *text, size_t capacity)
{
    if (capacity > 0) text[0] = 0;
    return (qw_json){.text = text, .capacity = capacity, .is_fixed = true};
}

static void put_fixed(qw_json *json, const char *text, size_t length)
{
    size_t room = json->capacity > json->length ? json->capacity - json->length - 1 : 0;
    size_t fits = length < room ? length : room;
    if (fits > 0) memcpy(json->text + json->length, text, fits), json->text[json->length + fits] = 0;
    json->length += length;
}

/* Appends text: to the fixed room where there is one, else to memory that grows. Without memory the text fails as
   a whole. */
static void put(qw_json *json, const char *text, size_t length)
{
    if (json->is_fixed) {
        put_fixed(json, text, length);
        return;
    }
    if (json->failed) return;
    if (json->length + length + 1 > json->capacity) {
        size_t wanted = 2 * json->capacity + length + 1024;
        char *grown = realloc(json->text, wanted);
        if (!grown) {
            json->failed = true;
            return;
        }
        json->text = grown;
        json->capacity = wanted;
    }
    memcpy(json->text + json->length, text, length);
    json->length += length;
    assert(json->length < json->capacity);
    json->text[json->length] = 0;
}

static void put_text(qw_json *json, const char *text) { put(json, text, strlen(text)); }

/* Bytes that are no UTF-8, as in names of files, cannot stand in JSON: they are shown as \xNN. */
static void put_quoted(qw_json *json, const char *text)
{
    put_text(json, "\"");
    while (*text) {
        char escape[16];
        size_t size = qw_utf8_size(text);
        unsigned char c = (unsigned char)*text;
        if (size == 0) snprintf(escape, sizeof escape, "\\\\x%02x", c);
        else if (c == '"' || c == '\\') snprintf(escape, sizeof escape, "\\%c", c);
        else if (qw_is_control(text, size))
            snprintf(escape, sizeof escape, "\\u%04x", size == 1 ? c : (unsigned char)text[1]); /* U+0080 to U+009F */
        else snprintf(escape, sizeof escape, "%.*s", (int)size, text);
        put_text(json, escape);
        text += size > 0 ? size : 1;
    }
    put_text(json, "\"");
}

static void put_line(qw_json *json)
{
    if (json->is_line) return;
    put_text(json, "\n");
    for (int i = 0; i < json->depth; i++) put_text(json, "  ");
}

static void put_name(qw_json *json, const char *name)
{
    if (json->comma) put_text(json, json->is_line ? ", " : ",");
    if (json->depth) put_line(json);
    if (name) {
        put_quoted(json, name);
        put_text(json, ": ");
    }
    json->comma = true;
}

void qw_json_begin(qw_json *json, const char *name, char bracket)
{
    put_name(json, name);
    put(json, &bracket, 1);
    json->depth++;
    json->comma = false;
}

void qw_json_end(qw_json *json, char bracket)
{
    json->depth--;
    if (json->comma) put_line(json);
    put(json, &bracket, 1);
    json->comma = true;
    if (json->depth == 0) put_text(json, "\n");
}

void qw_json_whole(qw_json *json, const char *name, int64_t value)
{
    char text[32];
    snprintf(text, sizeof text, "%" PRId64, value);
    put_name(json, name);
    put_text(json, text);
}

void qw_json_real(qw_json *json, const char *name, double value)
{
    if (!isfinite(value)) {
        qw_json_null(json, name);
        return;
    }
    char local[32], text[48];
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(local, sizeof local, "%.*g", digits, value);
        if (strtod(local, NULL) == value) break;
    }
    const char *point = localeconv()->decimal_point, *at = strstr(local, point);
    if (at) snprintf(text, sizeof text, "%.*s.%s", (int)(at - local), local, at + strlen(point));
    else snprintf(text, sizeof text, "%s", local);
    put_name(json, name);
    put_text(json, text);
}

void qw_json_text(qw_json *json, const char *name, const char *value)
{
    put_name(json, name);
    put_quoted(json, value);
}

void qw_json_flag(qw_json *json, const char *name, bool value)
{
    put_name(json, name);
    put_text(json, value ? "true" : "false");
}

void qw_json_null(qw_json *json, const char *name)
{
    put_name(json, name);
    put_text(json, "null");
}

bool qw_json_failed(const qw_json *json) { return json->failed || (!json->text && !json->is_fixed); }
