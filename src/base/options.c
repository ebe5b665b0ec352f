/* Options by their tables, options.def and asset.def: defaults, bounds, names, and values as text.
 *
 * Text is read and written the same way in every locale: '.' is the decimal point. A value is taken only when the whole
 * string is a number of the kind the option wants, so that "50%" or "1e30" for a count is refused rather than cut
 * short.
 */
#include "base/near.h"
#include "quadwright/quadwright.h"

#include <inttypes.h>
#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct row {
    qw_option_info info;
    size_t offset; /* bytes from the beginning of the structure */
} row;

static const row rows[] = {
#define QW_OPTION_COUNT(name, stage, initial, least, most, unit, help) \
    {{#name, QW_KIND_COUNT, initial, least, most, unit, NULL, help}, offsetof(qw_options, name)},
#define QW_OPTION_REAL(name, stage, initial, least, most, unit, help) \
    {{#name, QW_KIND_REAL, initial, least, most, unit, NULL, help}, offsetof(qw_options, name)},
#define QW_OPTION_FLAG(name, stage, initial, help) \
    {{#name, QW_KIND_FLAG, initial, 0, 1, "", NULL, help}, offsetof(qw_options, name)},
#define QW_OPTION_CHOICE(name, stage, initial, last, list, help) \
    {{#name, QW_KIND_CHOICE, initial, 0, last, "", list, help}, offsetof(qw_options, name)},
#include "quadwright/options.def"
};

static const row asset_rows[] = {
#define QW_ASSET_COUNT(name, initial, least, most, unit, help) \
    {{#name, QW_KIND_COUNT, initial, least, most, unit, NULL, help}, offsetof(qw_asset_options, name)},
#define QW_ASSET_REAL(name, initial, least, most, unit, help) \
    {{#name, QW_KIND_REAL, initial, least, most, unit, NULL, help}, offsetof(qw_asset_options, name)},
#include "quadwright/asset.def"
};

/* The options of one structure, which begins with its size. */
typedef struct table {
    const row *row; /* row[count] */
    size_t count, size;
    const char *init; /* the function that fills it */
} table;

static const table of_run = {rows, sizeof rows / sizeof *rows, sizeof(qw_options), "qw_options_init"},
                   of_asset = {asset_rows, sizeof asset_rows / sizeof *asset_rows, sizeof(qw_asset_options),
                               "qw_asset_options_init"};

size_t qw_option_count(void) { return of_run.count; }
const qw_option_info *qw_option_at(size_t index) { return index < of_run.count ? &rows[index].info : NULL; }

size_t qw_asset_option_count(void) { return of_asset.count; }
const qw_option_info *qw_asset_option_at(size_t index)
{
    return index < of_asset.count ? &asset_rows[index].info : NULL;
}

size_t qw_options_size(void) { return sizeof(qw_options); }

static void *field(const table *t, void *options, size_t index) { return (char *)options + t->row[index].offset; }

/* Sets the size stamp and all options of the table to their initial values. */
static void set_initial(const table *t, void *options)
{
    memset(options, 0, t->size);
    *(uint32_t *)options = (uint32_t)t->size;
    for (size_t i = 0; i < t->count; i++) {
        double initial = t->row[i].info.initial;
        switch (t->row[i].info.kind) {
        case QW_KIND_COUNT: *(int64_t *)field(t, options, i) = (int64_t)initial; break;
        case QW_KIND_REAL: *(double *)field(t, options, i) = initial; break;
        default: *(int32_t *)field(t, options, i) = (int32_t)initial;
        }
    }
}

void qw_options_init(qw_options *options) { set_initial(&of_run, options); }
void qw_asset_options_init(qw_asset_options *options) { set_initial(&of_asset, options); }

static qw_status refuse(char *message, size_t message_size, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static qw_status refuse(char *message, size_t message_size, const char *format, ...)
{
    if (!message || message_size == 0) return QW_OPTION;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, message_size, format, arguments);
    va_end(arguments);
    return QW_OPTION;
}

/* ---- fields by index */

static int64_t read_whole(const table *t, const void *options, size_t index)
{
    const char *at = (const char *)options + t->row[index].offset;
    return t->row[index].info.kind == QW_KIND_COUNT ? *(const int64_t *)at : *(const int32_t *)at;
}

static double read_real(const table *t, const void *options, size_t index)
{
    return *(const double *)((const char *)options + t->row[index].offset);
}

/* ---- numbers as text */

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* [+-] digits, all of the text. Values beyond 64 bits are held at the ends, which every bound excludes. */
static bool parse_whole(const char *text, int64_t *value)
{
    bool negative = *text == '-';
    if (*text == '-' || *text == '+') text++;
    if (!is_digit(*text)) return false;
    int64_t v = 0;
    for (; is_digit(*text); text++) {
        if (__builtin_mul_overflow(v, 10, &v) || __builtin_add_overflow(v, *text - '0', &v)) v = INT64_MAX / 16;
    }
    *value = negative ? -v : v;
    return *text == 0;
}

/* [+-] digits [. digits] [e [+-] digits], all of the text; at least one digit before the exponent. */
static bool looks_real(const char *text)
{
    size_t digits = 0;
    if (*text == '-' || *text == '+') text++;
    for (; is_digit(*text); text++) digits++;
    if (*text == '.') text++;
    for (; is_digit(*text); text++) digits++;
    if (digits == 0) return false;
    if (*text == 'e' || *text == 'E') {
        text++;
        if (*text == '-' || *text == '+') text++;
        if (!is_digit(*text)) return false;
        while (is_digit(*text)) text++;
    }
    return *text == 0;
}

/* strtod reads the decimal point of the caller's locale, so that one is put in the place of ours. */
static bool parse_real(const char *text, double *value)
{
    if (!looks_real(text) || strlen(text) >= QW_SETTING_SIZE) return false;
    char local[QW_SETTING_SIZE + 16];
    const char *point = strchr(text, '.');
    if (point)
        snprintf(local, sizeof local, "%.*s%s%s", (int)(point - text), text, localeconv()->decimal_point, point + 1);
    else snprintf(local, sizeof local, "%s", text);
    *value = strtod(local, NULL);
    return true;
}

/* The fewest digits that read back to the same double. */
static void print_real(double value, char *text, size_t size)
{
    char local[QW_SETTING_SIZE];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(local, sizeof local, "%.*g", digits, value);
        if (strtod(local, NULL) == value) break;
    }
    const char *point = localeconv()->decimal_point, *at = strstr(local, point);
    if (at) snprintf(text, size, "%.*s.%s", (int)(at - local), local, at + strlen(point));
    else snprintf(text, size, "%s", local);
}

/* ---- by name */

static bool same_name(const char *a, const char *b)
{
    for (; *a && *b; a++, b++)
        if (*a != *b && !((*a == '-' || *a == '_') && (*b == '-' || *b == '_'))) return false;
    return *a == *b;
}

static size_t find(const table *t, const char *name)
{
    for (size_t i = 0; i < t->count; i++)
        if (same_name(t->row[i].info.name, name)) return i;
    return t->count;
}

/* The option that was meant, or NULL. */
static const char *nearest_name(const table *t, const char *name)
{
    unsigned best = QW_NEVER_NEAR;
    const char *found = NULL;
    for (size_t i = 0; i < t->count; i++)
        if (qw_is_near(name, t->row[i].info.name, &best)) found = t->row[i].info.name;
    return found;
}

/* "from 0 to 20000000 faces" */
static void describe_bounds(const qw_option_info *info, char *text, size_t size)
{
    char least[QW_SETTING_SIZE], most[QW_SETTING_SIZE];
    print_real(info->least, least, sizeof least);
    print_real(info->most, most, sizeof most);
    bool unit = info->unit[0] && strcmp(info->unit, "-") != 0;
    snprintf(text, size, "from %s to %s%s%s", least, most, unit ? " " : "", unit ? info->unit : "");
}

static qw_status refuse_number(const qw_option_info *info, const char *value, char *message, size_t message_size)
{
    char bounds[3 * QW_SETTING_SIZE];
    describe_bounds(info, bounds, sizeof bounds);
    return refuse(message, message_size, "option %s must be a %s %s, not \"%.40s\"", info->name,
                  info->kind == QW_KIND_COUNT ? "whole number" : "number", bounds, value);
}

static int choice_index(const char *list, const char *value)
{
    size_t length = strlen(value);
    for (int i = 0;; i++) {
        const char *end = strchr(list, '|');
        size_t item = end ? (size_t)(end - list) : strlen(list);
        if (item == length && memcmp(list, value, length) == 0) return i;
        if (!end) return -1;
        list = end + 1;
    }
}

static bool parse_flag(const char *value, int32_t *flag)
{
    static const char *const words[2][4] = {{"off", "no", "false", "0"}, {"on", "yes", "true", "1"}};
    for (int on = 0; on < 2; on++)
        for (int i = 0; i < 4; i++)
            if (strcmp(value, words[on][i]) == 0) {
                *flag = on;
                return true;
            }
    return false;
}

/* A plane in one word, NX,NY,NZ,OFFSET: five options. All of them, or none, are set. */
static qw_status set_plane(qw_options *options, const char *value, char *message, size_t message_size)
{
    static const char *const parts[] = {"symmetry_x", "symmetry_y", "symmetry_z", "symmetry_offset"};
    qw_options o = *options;
    for (int i = 0; i < 4; i++) {
        char number[QW_SETTING_SIZE];
        size_t length = strcspn(value, ",");
        if (length >= sizeof number || (value[length] == ',') != (i < 3))
            return refuse(message, message_size, "a plane of symmetry is four numbers, NX,NY,NZ,OFFSET");
        snprintf(number, sizeof number, "%.*s", (int)length, value);
        if (qw_option_set(&o, parts[i], number, message, message_size) != QW_OK) return QW_OPTION;
        value += length + (i < 3);
    }
    if (o.symmetry_x == 0 && o.symmetry_y == 0 && o.symmetry_z == 0)
        return refuse(message, message_size, "the normal of the plane of symmetry is 0,0,0");
    if (qw_option_set(&o, "symmetry", "plane", message, message_size) != QW_OK) return QW_OPTION;
    *options = o;
    return QW_OK;
}

/* The value of `wrap` in one word: on, off, a share of the diagonal, or quads with a q behind. All options of it, or
   none, are set. */
static qw_status set_wrap(qw_options *options, const char *value, char *message, size_t message_size)
{
    char number[QW_SETTING_SIZE];
    size_t length = strlen(value);
    bool in_quads = length > 1 && length < sizeof number && value[length - 1] == 'q';
    qw_options o = *options;
    double real;
    snprintf(number, sizeof number, "%.*s", (int)(length - in_quads), value);
    if (length >= sizeof number || !parse_real(number, &real))
        return refuse(message, message_size,
                      "option wrap must be on, off, a share of the diagonal such as 0.02, or quads such as 0.5q, "
                      "not \"%.40s\"",
                      value);
    if (qw_option_set(&o, in_quads ? "wrap_quads" : "wrap_distance", number, message, message_size) != QW_OK)
        return QW_OPTION;
    if (in_quads) o.wrap_distance = 0;
    o.wrap = 1;
    *options = o;
    return QW_OK;
}

/* Sets the option of that name to what the text says, within its bounds; else *message says why not, and nothing
   changes. */
static qw_status set(const table *t, void *options, const char *name, const char *value, char *message,
                     size_t message_size)
{
    if (message && message_size) message[0] = 0;
    if (!options || !name || !value) return refuse(message, message_size, "an option needs a name and a value");
    size_t index = find(t, name);
    if (index == t->count) {
        const char *near = nearest_name(t, name);
        return refuse(message, message_size,
                      near ? "unknown option \"%.40s\"; did you mean \"%s\"?" : "unknown option \"%.40s\"", name, near);
    }
    const qw_option_info *info = &t->row[index].info;
    if (t == &of_run && t->row[index].offset == offsetof(qw_options, symmetry) && strchr(value, ','))
        return set_plane(options, value, message, message_size);
    if (t == &of_run && t->row[index].offset == offsetof(qw_options, fit) && strcmp(value, "limit") == 0)
        return qw_option_set(options, "fit_to", value, message, message_size);
    int64_t whole;
    int32_t flag;
    if (t == &of_run && t->row[index].offset == offsetof(qw_options, wrap) && !parse_flag(value, &flag))
        return set_wrap(options, value, message, message_size);
    double real;
    switch (info->kind) {
    case QW_KIND_COUNT:
        if (!parse_whole(value, &whole) || (double)whole < info->least || (double)whole > info->most)
            return refuse_number(info, value, message, message_size);
        *(int64_t *)field(t, options, index) = whole;
        break;
    case QW_KIND_REAL:
        if (!parse_real(value, &real) || !(real >= info->least && real <= info->most))
            return refuse_number(info, value, message, message_size);
        *(double *)field(t, options, index) = real;
        break;
    case QW_KIND_FLAG:
        if (!parse_flag(value, &flag))
            return refuse(message, message_size, "option %s must be \"on\" or \"off\", not \"%.40s\"", info->name,
                          value);
        *(int32_t *)field(t, options, index) = flag;
        break;
    case QW_KIND_CHOICE:
        flag = choice_index(info->choices, value);
        if (flag < 0)
            return refuse(message, message_size, "option %s must be one of %s, not \"%.40s\"", info->name,
                          info->choices, value);
        *(int32_t *)field(t, options, index) = flag;
        break;
    }
    return QW_OK;
}

qw_status qw_option_set(qw_options *options, const char *name, const char *value, char *message, size_t message_size)
{
    return set(&of_run, options, name, value, message, message_size);
}

qw_status qw_asset_option_set(qw_asset_options *options, const char *name, const char *value, char *message,
                              size_t message_size)
{
    return set(&of_asset, options, name, value, message, message_size);
}

static const char *choice_name(const char *list, int64_t index, size_t *length)
{
    for (; index > 0 && list; index--) {
        const char *end = strchr(list, '|');
        list = end ? end + 1 : NULL;
    }
    *length = list ? strcspn(list, "|") : 0;
    return list;
}

/* The value of an option as text, as it would be written on the command line. */
static qw_status get(const table *t, const void *options, const char *name, char *value, size_t value_size)
{
    if (value && value_size) value[0] = 0;
    if (!options || !name || !value) return QW_OPTION;
    size_t index = find(t, name), length;
    if (index == t->count) return QW_OPTION;
    char text[QW_SETTING_SIZE];
    const char *choice;
    switch (t->row[index].info.kind) {
    case QW_KIND_COUNT: snprintf(text, sizeof text, "%" PRId64, read_whole(t, options, index)); break;
    case QW_KIND_REAL: print_real(read_real(t, options, index), text, sizeof text); break;
    case QW_KIND_FLAG: snprintf(text, sizeof text, "%s", read_whole(t, options, index) ? "on" : "off"); break;
    case QW_KIND_CHOICE:
        choice = choice_name(t->row[index].info.choices, read_whole(t, options, index), &length);
        if (!choice) return QW_OPTION;
        snprintf(text, sizeof text, "%.*s", (int)length, choice);
        break;
    }
    if (strlen(text) >= value_size) return QW_OPTION;
    memcpy(value, text, strlen(text) + 1);
    return QW_OK;
}

qw_status qw_option_get(const qw_options *options, const char *name, char *value, size_t value_size)
{
    return get(&of_run, options, name, value, value_size);
}

qw_status qw_asset_option_get(const qw_asset_options *options, const char *name, char *value, size_t value_size)
{
    return get(&of_asset, options, name, value, value_size);
}

/* ---- memory */

qw_status qw_memory_size(const char *text, uint64_t *bytes, char *message, size_t message_size)
{
    static const char units[] = "KMGT";
    char number[QW_SETTING_SIZE] = "";
    double value = 0, scale = 1;
    size_t length = text ? strspn(text, "0123456789.") : 0;
    if (length < sizeof number && length) memcpy(number, text, length);
    const char *unit = text && text[length] ? strchr(units, text[length] & ~32) : NULL;
    for (ptrdiff_t i = 0; unit && i <= unit - units; i++) scale *= 1024;
    const char *rest = text ? text + length + (unit != NULL) : "";
    bool known = number[0] && parse_real(number, &value) && (!*rest || (unit && (rest[0] & ~32) == 'B' && !rest[1]));
    if (!known || !(value * scale >= 0 && value * scale < 0x1p63)) {
        (void)refuse(message, message_size, "a memory limit is a number with K, M or G, such as 4G, not \"%.40s\"",
                     text ? text : "");
        return QW_ARGUMENT;
    }
    *bytes = (uint64_t)(value * scale);
    return QW_OK;
}

/* ---- validation */

/* Whether one option is within its range; else the sentence that says what it may be. */
static qw_status validate_one(const table *t, const void *options, size_t index, char *message, size_t message_size)
{
    const qw_option_info *info = &t->row[index].info;
    bool real = info->kind == QW_KIND_REAL;
    double value = real ? read_real(t, options, index) : (double)read_whole(t, options, index);
    if (value >= info->least && value <= info->most) return QW_OK; /* a NaN is neither */
    char text[QW_SETTING_SIZE];
    print_real(value, text, sizeof text);
    if (info->kind == QW_KIND_FLAG)
        return refuse(message, message_size, "option %s must be 0 or 1, not %s", info->name, text);
    if (info->kind == QW_KIND_CHOICE)
        return refuse(message, message_size, "option %s must be from 0 to %.0f, an index into %s, not %s", info->name,
                      info->most, info->choices, text);
    return refuse_number(info, text, message, message_size);
}

/* Whether the stamp is right and all options are within their ranges; the message is of the first that is not. */
static qw_status validate_all(const table *t, const void *options, char *message, size_t message_size)
{
    if (message && message_size) message[0] = 0;
    if (!options) return refuse(message, message_size, "there are no options");
    if (*(const uint32_t *)options != t->size)
        return refuse(message, message_size,
                      "option size is %" PRIu32 " where this library has %zu: %s was not called, or by another version",
                      *(const uint32_t *)options, t->size, t->init);
    for (size_t i = 0; i < t->count; i++)
        if (validate_one(t, options, i, message, message_size) != QW_OK) return QW_OPTION;
    return QW_OK;
}

qw_status qw_asset_options_validate(const qw_asset_options *options, char *message, size_t message_size)
{
    return validate_all(&of_asset, options, message, message_size);
}

qw_status qw_options_validate(const qw_options *options, char *message, size_t message_size)
{
    if (validate_all(&of_run, options, message, message_size) != QW_OK) return QW_OPTION;
    int targets = (options->faces != 0) + (options->vertices != 0) + (options->edge_length != 0) +
                  (options->ratio != 0);
    if (targets > 1)
        return refuse(message, message_size,
                      "only one of faces, vertices, edge_length and ratio may be set, not %d of them", targets);
    return QW_OK;
}
