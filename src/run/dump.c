#include "run/dump.h"

#include "base/constants.h"
#include "base/near.h"
#include "remesh/sizes/fast.h"
#include "io/file.h"
#include "run/dump_validate.h"
#include "run/stages/stages.h"
#include "whole/small.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { MOST_RECORDS = 256, ORDER_MARK = 0x01020304, OPTIONS_SIZE = 4096 };

static const char MAGIC[8] = {'Q', 'W', 'S', 'T', 'A', 'T', 'E', '\n'};
/* Coordinates in the centred frame are below 1, lengths in wanted lengths as offsets are. */
static const float LARGEST = QW_LONGEST_OFFSET;

typedef enum number_kind { BYTES, FLOATS, DOUBLES } number_kind;
/* clang-format off */
#define KIND_OF(pointer)                                                                       \
    _Generic((pointer), float *: FLOATS, const float *: FLOATS, qw_vec3 *: FLOATS, qw_tip *: FLOATS, \
             qw_real2 *: FLOATS, double *: DOUBLES, const double *: DOUBLES, default: BYTES)
/* clang-format on */

/* A dump being written or read: the same walk over dump.def does both. */
typedef struct dump {
    qw_context_state *c;
    qw_env *env;
    const char *name;     /* of the file, for messages */
    qw_file *out;         /* NULL when reading */
    const char *at, *end; /* what has not been read yet */
    uint32_t finished;    /* stages */
    int part;             /* the one that is read next */
    uint32_t count;       /* records so far */
    struct {
        const void *data;
        size_t size;
    } record[MOST_RECORDS];
} dump;

enum {
    PART_INPUT = -1,
#define QW_STAGE(name, title, source, weight) PART_##name = QW_STAGE_##name,
#include "quadwright/stages.def"
};

/* ---- sums */

/* Eight bytes at a time; each step is one to one in the sum and in the bytes, so no single change goes unseen. */
static uint64_t add_to_sum(uint64_t sum, const void *bytes, size_t size)
{
    const char *at = bytes;
    for (; size > 0;) {
        uint64_t word = 0;
        size_t n = size < sizeof word ? size : sizeof word;
        memcpy(&word, at, n);
        sum = (sum ^ word) * UINT64_C(0x9e3779b97f4a7c15);
        sum ^= sum >> 32;
        at += n, size -= n;
    }
    return sum;
}

uint64_t qw_state_sum(const qw_state_record *record, const void *bytes, size_t size)
{
    return add_to_sum(add_to_sum(1, record, offsetof(qw_state_record, sum)), bytes, size);
}

/* ---- writing */

static void remember(dump *d, const void *data, size_t size)
{
    assert(d->count < MOST_RECORDS);
    d->record[d->count].data = data;
    d->record[d->count++].size = size;
}

/* Writes an array, or a reference to an earlier one with the same bytes. */
static void write_record(dump *d, const char *name, const void *data, size_t count, size_t element_size)
{
    assert(element_size > 0);
    qw_state_record r = {
        .element_size = (uint32_t)element_size, .bytes_of = data ? 0 : QW_NONE, .count = data ? count : 0};
    size_t size = count * element_size;
    assert(strlen(name) < sizeof r.name);
    strcpy(r.name, name);
    while (data && r.bytes_of < d->count && (d->record[r.bytes_of].data != data || d->record[r.bytes_of].size != size))
        r.bytes_of++;
    bool own = data && r.bytes_of == d->count;
    r.sum = qw_state_sum(&r, data, own ? size : 0);
    qw_file_put(d->out, &r, sizeof r);
    if (own) qw_file_put(d->out, data, size);
    remember(d, data, size);
}

/* ---- reading */

/* "PATH: the sentence" with QW_FORMAT_SYNTAX. */
#define REFUSE(d, element, format, ...) \
    qw_fail((d)->env, QW_FORMAT_SYNTAX, (element), "%s: " format, (d)->name, __VA_ARGS__)
#define REQUIRE(d, condition, what)                  \
    do {                                             \
        if (!(condition)) REFUSE(d, -1, "%s", what); \
    } while (0)

static _Noreturn void fail_at_end(dump *d, const char *name)
{
    qw_fail(d->env, QW_FORMAT_TRUNCATED, -1, "%s: the dump ends inside \"%s\"", d->name, name);
}

/* The next record, which must be this one. Its bytes are at d->at. */
static qw_state_record begin_record(dump *d, const char *name, size_t element_size)
{
    qw_state_record r;
    if ((size_t)(d->end - d->at) < sizeof r) fail_at_end(d, name);
    memcpy(&r, d->at, sizeof r);
    d->at += sizeof r;
    if (strncmp(r.name, name, sizeof r.name) != 0)
        REFUSE(d, -1, "the dump has something else in the place of \"%s\"", name);
    if (r.element_size != element_size)
        REFUSE(d, -1, "elements of \"%s\" have %u bytes where this library has %zu", name, r.element_size,
               element_size);
    bool own = r.bytes_of == d->count;
    if (own && r.count > (size_t)(d->end - d->at) / element_size) fail_at_end(d, name);
    if (r.sum != qw_state_sum(&r, d->at, own ? r.count * element_size : 0))
        REFUSE(d, -1, "the checksum of \"%s\" is wrong: the dump is damaged", name);
    return r;
}

/* Refuses numbers that are not finite, or beyond what any mesh has. */
static void check_numbers(dump *d, const char *name, const void *data, size_t size, number_kind kind)
{
    const float *f = data;
    const double *x = data;
    if (kind == FLOATS)
        for (size_t i = 0; i < size / sizeof *f; i++)
            if (!(fabsf(f[i]) <= LARGEST)) REFUSE(d, (int64_t)i, "number %zu of \"%s\" is not to be believed", i, name);
    if (kind == DOUBLES)
        for (size_t i = 0; i < size / sizeof *x; i++)
            if (!isfinite(x[i])) REFUSE(d, (int64_t)i, "number %zu of \"%s\" is not finite", i, name);
}

/* Reads an array of `count` elements, or NULL where it is optional and not there; shares the memory of an earlier
 * record if it refers to one. */
static void *read_array(dump *d, const char *name, size_t count, size_t element_size, bool optional, number_kind kind)
{
    assert(element_size > 0);
    qw_state_record r = begin_record(d, name, element_size);
    size_t size = r.count * element_size;
    if (optional && r.bytes_of == QW_NONE) {
        remember(d, NULL, 0);
        return NULL;
    }
    if (r.count != count)
        REFUSE(d, -1, "\"%s\" has %llu elements where %zu belong", name, (unsigned long long)r.count, count);
    void *data;
    if (r.bytes_of < d->count) {
        data = (void *)d->record[r.bytes_of].data;
        if (!data || d->record[r.bytes_of].size != size)
            REFUSE(d, -1, "\"%s\" shares the bytes of something of another size", name);
    } else {
        if (r.bytes_of != d->count) REFUSE(d, -1, "\"%s\" has no bytes", name);
        data = qw_alloc(d->env, count, element_size);
        memcpy(data, d->at, size);
        d->at += size;
    }
    check_numbers(d, name, data, size, kind);
    remember(d, data, size);
    return data;
}

static void *array(dump *d, const char *name, const void *data, size_t count, size_t element_size, bool optional,
                   number_kind kind)
{
    if (!d->out) return read_array(d, name, count, element_size, optional, kind);
    write_record(d, name, data, count, element_size);
    return (void *)data;
}

/* Writes or reads one value. */
static void value(dump *d, const char *name, void *data, size_t size)
{
    if (d->out) {
        write_record(d, name, data, 1, size);
        return;
    }
    qw_state_record r = begin_record(d, name, size);
    if (r.count != 1 || r.bytes_of != d->count) REFUSE(d, -1, "\"%s\" is not one value", name);
    memcpy(data, d->at, size);
    d->at += size;
    remember(d, NULL, 0); /* values are never shared between records */
}

/* links: QW_NONE is allowed too. */
static void check_below(dump *d, const char *name, const void *data, size_t count, size_t element_size, uint64_t limit,
                        bool links)
{
    for (size_t i = 0; i < count && !d->out; i++) {
        uint32_t x = element_size == 1 ? ((const uint8_t *)data)[i] : ((const uint32_t *)data)[i];
        if (x >= limit && !(links && x == QW_NONE))
            REFUSE(d, (int64_t)i, "element %zu of \"%s\" is %u, not below %llu", i, name, x, (unsigned long long)limit);
    }
}

/* ---- walking */

#define QW_STATE_VALUE(of, member) \
    if (part == PART_##of) value(d, #member, &c->member, sizeof c->member);
#define QW_STATE_ANY(of, member, count, optional) \
    if (part == PART_##of)                        \
        c->member = array(d, #member, c->member, (count), sizeof *c->member, optional, KIND_OF(c->member));
#define QW_STATE_CHECK(of, member, count, limit, links) \
    if (part == PART_##of) check_below(d, #member, c->member, (count), sizeof *c->member, (limit), links);
#define QW_STATE_ARRAY(of, member, count)    QW_STATE_ANY(of, member, count, false)
#define QW_STATE_OPTIONAL(of, member, count) QW_STATE_ANY(of, member, count, true)
#define QW_STATE_BELOW(of, member, count, limit) \
    QW_STATE_ANY(of, member, count, false) QW_STATE_CHECK(of, member, count, limit, false)
#define QW_STATE_LINKS(of, member, count, limit) \
    QW_STATE_ANY(of, member, count, false) QW_STATE_CHECK(of, member, count, limit, true)

static void walk(dump *d, int part)
{
    qw_context_state *c = d->c;
#include "run/dump.def"
}

/* "faces=500\n" a line. */
static void write_options(dump *d)
{
    char *text = qw_alloc(d->env, OPTIONS_SIZE, 1), one[QW_SETTING_SIZE];
    size_t length = 0;
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        qw_option_get(&d->c->used, name, one, sizeof one);
        assert(length + strlen(name) + strlen(one) + 3 < OPTIONS_SIZE);
        length += (size_t)sprintf(text + length, "%s=%s\n", name, one);
    }
    write_record(d, "options", text, length, 1);
}

/* Reads the options of the run, one NAME=VALUE a line, and checks them. */
static void read_options(dump *d)
{
    char message[256];
    qw_state_record r = begin_record(d, "options", 1);
    if (r.bytes_of != d->count) REFUSE(d, -1, "\"%s\" has no bytes", "options");
    char *text = qw_alloc(d->env, r.count + 1, 1);
    memcpy(text, d->at, r.count);
    text[r.count] = 0;
    d->at += r.count;
    remember(d, NULL, 0);
    qw_options_init(&d->c->used);
    for (char *line = text, *next; *line; line = next) {
        next = line + strcspn(line, "\n");
        if (*next) *next++ = 0;
        char *equals = strchr(line, '=');
        if (equals) *equals++ = 0;
        if (qw_option_set(&d->c->used, line, equals, message, sizeof message) != QW_OK)
            REFUSE(d, -1, "among the options of the dump: %s", message);
    }
    if (qw_options_validate(&d->c->used, message, sizeof message) != QW_OK)
        REFUSE(d, -1, "among the options of the dump: %s", message);
}

/* ---- validation */

static void validate_part(void *user)
{
    dump *d = user;
    qw_state_validate(d->c, d->part, d->finished);
}

/* To the validators of the stages a broken mesh is an error of ours; here it is one of the file. */
static void validate(dump *d)
{
    qw_status status = qw_protect(d->env, validate_part, d);
    if (status == QW_OK) return;
    char message[512];
    snprintf(message, sizeof message, "%s", qw_env_message(d->env));
    if (status != QW_INTERNAL) qw_fail(d->env, status, qw_env_element(d->env), "%s", message);
    REFUSE(d, qw_env_element(d->env), "%s", message);
}

/* ---- whole dumps */

typedef struct header {
    char magic[sizeof MAGIC];
    uint32_t version, order, finished, zero;
} header;

_Static_assert(sizeof(header) == QW_STATE_HEADER && sizeof(qw_state_record) == QW_STATE_NAME + 24,
               "no padding goes into a file");

/* Writes the header, the options and all stages that are finished. */
static void write_dump(void *user)
{
    dump *d = user;
    qw_scope_begin(d->env);
    d->out = qw_file_begin(d->env, d->name);
    header h = {.version = QW_STATE_VERSION, .order = ORDER_MARK, .finished = d->finished};
    memcpy(h.magic, MAGIC, sizeof h.magic);
    qw_file_put(d->out, &h, sizeof h);
    write_options(d);
    for (int part = PART_INPUT; part < (int)d->finished; part++) walk(d, part);
    qw_file_finish(d->out);
    qw_scope_end(d->env);
}

qw_status qw_state_write(qw_context_state *c, const char *path)
{
    dump d = {.c = c, .env = c->env, .name = path, .finished = (uint32_t)c->done};
    return qw_protect(c->env, write_dump, &d);
}

/* The file, kept until all parts are read. */
static void read_file(void *user)
{
    dump *d = user;
    qw_scope_begin(d->env);
    const char *path = d->name;
    d->name = qw_path_for_messages(d->env, path, "standard input");
    qw_bytes bytes = qw_file_read(d->env, path, d->name);
    d->at = bytes.at, d->end = bytes.at + bytes.size;
    if (d->name != path) qw_keep(d->env, (void *)d->name);
    qw_keep(d->env, (void *)bytes.at);
    qw_scope_end(d->env);
}

/* Reads the header, and refuses other files, versions and byte orders. */
static void read_header(dump *d)
{
    header h = {.version = 0};
    size_t size = (size_t)(d->end - d->at), magic = size < sizeof MAGIC ? size : sizeof MAGIC;
    if (size == 0) qw_fail(d->env, QW_FILE_EMPTY, -1, "%s: the file is empty", d->name);
    if (memcmp(d->at, MAGIC, magic) != 0) qw_fail(d->env, QW_FORMAT_UNKNOWN, -1, "%s: not a dump of a run", d->name);
    if (size < sizeof h) fail_at_end(d, "header");
    memcpy(&h, d->at, sizeof h);
    d->at += sizeof h;
    REQUIRE(d, h.order == ORDER_MARK, "the dump was written on a machine with another byte order, or is damaged");
    if (h.version != QW_STATE_VERSION)
        REFUSE(d, -1, "the dump has version %u; this library reads %d", h.version, QW_STATE_VERSION);
    REQUIRE(d, h.finished > 0 && h.finished <= QW_STAGE_COUNT && h.zero == 0, "the header of the dump is damaged");
    d->finished = h.finished;
}

static void read_input(void *user)
{
    dump *d = user;
    read_header(d);
    read_options(d);
    walk(d, PART_INPUT);
    validate(d);
    d->c->run.options = qw_without_slow(&d->c->used);
    d->c->run.plan = d->c->history.attempt[d->c->history.current].plan;
}

/* Makes what follows quickly from earlier parts, and is not in the dump. */
static void make_part(dump *d)
{
    qw_run_state *run = &d->c->run;
    qw_enter_stage(d->env, (qw_stage)d->part);
    switch (d->part) {
    case PART_CORE: qw_stage_CORE(run); break;
    case PART_SURFACE: run->surface_faces = qw_surface_faces(run, &run->options), qw_set_core(run); break;
    case PART_HIERARCHY:
        if (d->finished == PART_HIERARCHY + 1) qw_stage_HIERARCHY(run);
        break;
    case PART_SCALE: qw_stage_SCALE(run); break;
    case PART_OFFSETS: qw_stage_OFFSETS(run); break;
    case PART_REGULAR: run->regular = run->offsets; break;
    case PART_QUADS: qw_stage_QUADS(run); break;
    case PART_POSITIONS: run->embedded = run->extraction.quads; break;
    default: break;
    }
}

/* Reads what one stage has left, or makes it anew where that is quicker, and checks it. */
static void read_stage(void *user)
{
    dump *d = user;
    qw_report *report = memcpy(QW_NEW(d->env, qw_report, 1), &d->c->report, sizeof *report);
    make_part(d);
    d->c->report = *report; /* it has what they say already */
    qw_free(d->env, report);
    walk(d, d->part);
    validate(d);
    if (d->part == PART_SURFACE) qw_build_tree(&d->c->run);
    REQUIRE(d, d->part + 1 < (int)d->finished || d->at == d->end, "the dump goes on after its end");
}

/* Reads all finished stages, each in a scope of its own; stops at the first that fails. */
static qw_status read_stages(dump *d)
{
    qw_context_state *c = d->c;
    qw_status status = QW_OK;
    for (d->part = 0; status == QW_OK && d->part < (int)d->finished; d->part++) {
        qw_scope_begin(c->env);
        c->done = d->part + 1;
        status = qw_protect(c->env, read_stage, d);
    }
    return status;
}

qw_status qw_state_read(qw_context_state *c, const char *path)
{
    assert(!c->has_input && c->done == 0);
    dump d = {.c = c, .env = c->env, .name = path, .part = PART_INPUT};
    qw_status status = qw_protect(c->env, read_file, &d);
    if (status != QW_OK) return status;
    const char *bytes = d.at;
    status = qw_protect(c->env, read_input, &d);
    c->has_input = status == QW_OK;
    if (!c->has_input)
        c->input = (qw_clean_input){0}, c->steering = (qw_steering){0}; /* what had been read is freed
                                                                          already */
    if (status == QW_OK) status = read_stages(&d);
    if (status != QW_OK) qw_forget_mesh(c);
    if (d.name != path) qw_free(c->env, (void *)d.name);
    qw_free(c->env, (void *)bytes);
    return status;
}
