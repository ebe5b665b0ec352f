#include "state.h"

#include "apart.h"
#include "io/file.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { MOST_RECORDS = 256, ORDER_MARK = 0x01020304, OPTIONS_SIZE = 4096, VALUE_SIZE = 64 };
enum { MOST_WARNINGS = sizeof((qw_report *)0)->warnings / sizeof((qw_report *)0)->warnings[0] };

static const char MAGIC[8] = {'Q', 'W', 'S', 'T', 'A', 'T', 'E', '\n'};
/* Determinants of two such offsets are still far below 2^31. */
enum { LONGEST_OFFSET = 10000 };
/* Coordinates in the centred frame are below 1, lengths in wanted lengths as offsets are. */
static const float LARGEST = LONGEST_OFFSET;

typedef enum number_kind { BYTES, FLOATS, DOUBLES } number_kind;
#define KIND_OF(pointer) \
    _Generic((pointer), float *: FLOATS, qw_vec3 *: FLOATS, qw_real2 *: FLOATS, double *: DOUBLES, const double *: DOUBLES, default: BYTES)

/* A dump being written or read: the same walk over state.def does both. */
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
#undef QW_STAGE
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

static void write_record(dump *d, const char *name, const void *data, size_t count, size_t element_size)
{
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

static void *read_array(dump *d, const char *name, size_t count, size_t element_size, bool optional, number_kind kind)
{
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
    remember(d, NULL, 0); /* nothing shares a value */
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
#include "state.def"
}

/* "faces=500\n" a line. */
static void write_options(dump *d)
{
    char *text = qw_alloc(d->env, OPTIONS_SIZE, 1), one[VALUE_SIZE];
    size_t length = 0;
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        qw_option_get(&d->c->used, name, one, sizeof one);
        assert(length + strlen(name) + strlen(one) + 3 < OPTIONS_SIZE);
        length += (size_t)sprintf(text + length, "%s=%s\n", name, one);
    }
    write_record(d, "options", text, length, 1);
}

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

static bool is_positive(double x) { return x > 0 && isfinite(x); }

static bool is_plan(const qw_plan *p)
{
    return is_positive(p->size_factor) && p->strategy < QW_STRATEGIES && p->effort < QW_EFFORTS &&
           p->cones < QW_CORNER_CONES && p->refinements <= QW_MAX_REFINEMENTS;
}

static void validate_history(dump *d)
{
    const qw_history *h = &d->c->history;
    REQUIRE(d, h->count > 0 && h->count <= QW_MAX_ATTEMPTS && h->current < h->count,
            "the attempts of the run are none that can have been");
    for (uint32_t i = 0; i < h->count; i++)
        REQUIRE(d,
                is_plan(&h->attempt[i].plan) && h->attempt[i].judged <= QW_STAGE_COUNT &&
                    (i == 0 ? h->attempt[i].cause == QW_NO_RETRY : h->attempt[i].cause < QW_RETRIES),
                "an attempt of the run is none that can have been");
    for (uint32_t i = 0; i < QW_MAX_REFINEMENTS; i++)
        REQUIRE(d, isfinite(qw_length(d->c->refinement[i].center)) && isfinite(d->c->refinement[i].radius),
                "a refinement is not finite");
}

static void validate_input(dump *d)
{
    const qw_context_state *c = d->c;
    const qw_clean_input *in = &c->input;
    REQUIRE(d, c->report.size == sizeof c->report && c->report.warning_count <= MOST_WARNINGS,
            "the report is not one of this library");
    for (uint32_t i = 0; i < MOST_WARNINGS; i++)
        REQUIRE(d, memchr(c->report.warnings[i], 0, sizeof c->report.warnings[i]),
                "a warning in the report has no end");
    for (int i = 0; i < QW_STAGE_COUNT; i++)
        REQUIRE(d, c->warnings_before[i] <= MOST_WARNINGS, "a stage began with more warnings than there can be");
    validate_history(d);
    const uint32_t *begin = in->face_begin;
    REQUIRE(d, in->face_count > 0 && begin[0] == 0 && begin[in->face_count] <= INT32_MAX,
            "the input has no faces, or too many");
    for (uint32_t f = 0; f < in->face_count; f++)
        REQUIRE(d, begin[f + 1] > begin[f] && begin[f + 1] - begin[f] >= 3,
                "a face of the input has fewer than three corners");
}

static void validate_surface(dump *d, const qw_trimesh *mesh)
{
    REQUIRE(d, mesh->face_count > 0 && mesh->face_count < QW_NONE / 4, "a surface has no triangles, or too many");
    qw_trimesh_validate(d->env, mesh);
}

static void validate_clean(dump *d)
{
    const qw_run_state *run = &d->c->run;
    const qw_frame *frame = &run->clean.frame;
    validate_surface(d, &run->clean.mesh);
    REQUIRE(d,
            is_positive(frame->scale) && isfinite(frame->center[0]) && isfinite(frame->center[1]) &&
                isfinite(frame->center[2]),
            "the frame of the clean surface is not finite");
    REQUIRE(d, is_positive(run->area) && is_positive(run->extent) && is_positive(run->faces_needed),
            "the area or a size of the surface is not positive");
}

static void validate_marked(dump *d)
{
    validate_surface(d, &d->c->run.surface);
    REQUIRE(d, is_positive(d->c->run.surface_faces),
            "the number of faces that the surface was made for is not positive");
}

static void validate_targets(dump *d, const float *size)
{
    for (uint32_t v = 0; v < d->c->run.working.mesh.vertex_count; v++)
        REQUIRE(d, size[v] > 0, "a wanted edge length is not positive");
}

/* Unit vectors, or shorter where there is no direction. */
static void validate_units(dump *d, const qw_vec3 *unit, uint32_t count)
{
    for (uint32_t v = 0; v < count; v++) REQUIRE(d, qw_length2(unit[v]) < 1.01f, "a direction is longer than 1");
}

static void validate_working(dump *d)
{
    const qw_run_state *run = &d->c->run;
    REQUIRE(d, is_positive(run->faces_wanted) && is_positive(run->rho), "a wanted size is not positive");
    REQUIRE(d, run->detail >= 0 && isfinite(run->detail), "the detail is not a number of 0 or more");
    validate_surface(d, &run->working.mesh);
    validate_targets(d, run->working.target);
    for (uint32_t v = 0; v < run->working.mesh.vertex_count; v++)
        REQUIRE(d, run->smoothed[v] >= 0 && run->smoothed[v] <= 1, "a share is not between 0 and 1");
    validate_units(d, run->direction, run->working.mesh.vertex_count);
    validate_units(d, run->normal, run->working.mesh.vertex_count);
}

/* What is many edges long becomes an integer offset that is as long. */
static void validate_size(dump *d)
{
    const qw_trimesh *mesh = &d->c->run.working.mesh;
    const float *size = d->c->run.size;
    validate_targets(d, size);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        float most = LONGEST_OFFSET * fminf(size[u], size[v]);
        REQUIRE(d, qw_distance(mesh->position[u], mesh->position[v]) <= most,
                "an edge is much longer than the one that is wanted");
    }
}

static void validate_lattice(dump *d)
{
    const qw_run_state *run = &d->c->run;
    const qw_trimesh *mesh = &run->working.mesh;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        float away = qw_distance(run->lattice[v], mesh->position[v]);
        REQUIRE(d, away <= LONGEST_OFFSET * run->size[v], "a lattice point is far from its vertex");
    }
}

static void validate_offsets(dump *d, const qw_offset_mesh *m)
{
    REQUIRE(d, m->face_count < QW_NONE / 4, "an offset mesh has too many triangles");
    for (uint32_t e = 0; e < m->edge_count; e++) {
        qw_int2 x = m->d[e];
        bool short_enough = x.x <= LONGEST_OFFSET && x.x >= -LONGEST_OFFSET && x.y <= LONGEST_OFFSET &&
                            x.y >= -LONGEST_OFFSET;
        REQUIRE(d, short_enough, "an offset is too long");
    }
    validate_units(d, m->axis, m->edge_count);
    validate_units(d, m->side, m->edge_count);
    validate_units(d, m->normal, m->vertex_count);
    validate_units(d, m->direction, m->vertex_count);
    qw_offset_validate(d->env, m);
}

static void validate_quads(dump *d, const qw_quadmesh *q)
{
    REQUIRE(d, q->face_count < QW_NONE / 4, "there are too many quads");
    qw_quadmesh_validate(d->env, q);
    for (uint32_t v = 0; q->kind && v < q->vertex_count; v++)
        REQUIRE(d, q->kind[v] <= QW_VERTEX_CORNER, "a vertex is of no known kind");
}

static void validate_extraction(dump *d)
{
    const qw_extraction *x = &d->c->run.extraction;
    validate_quads(d, &x->quads);
    for (uint32_t v = 0; v < d->c->run.upright.vertex_count; v++)
        REQUIRE(d, x->class_of[x->class_of[v]] == x->class_of[v], "a contraction class has no root");
    for (uint32_t v = 0; v < x->quads.vertex_count; v++)
        REQUIRE(d, x->class_of[x->vertex_class[v]] == x->vertex_class[v], "a contraction class has no root");
}

static void validate_part(void *user)
{
    dump *d = user;
    qw_run_state *run = &d->c->run;
    switch (d->part) {
    case PART_INPUT: validate_input(d); break;
    case PART_CLEAN: validate_clean(d); break;
    case PART_SURFACE: validate_marked(d); break;
    case PART_WORKING: validate_working(d); break;
    case PART_ORIENTATION: validate_units(d, run->orientation, run->working.mesh.vertex_count); break;
    case PART_SCALE: validate_size(d); break;
    case PART_POSITION: validate_lattice(d); break;
    case PART_OFFSETS: validate_offsets(d, &run->offsets); break;
    case PART_REGULAR: validate_offsets(d, &run->regular); break;
    case PART_UPRIGHT: validate_offsets(d, &run->upright); break;
    case PART_QUADS: validate_extraction(d); break;
    case PART_POSITIONS: validate_quads(d, &run->placed); break;
    case PART_REPAIR: validate_quads(d, &run->repaired); break;
    case PART_SIMPLIFY: validate_quads(d, &run->simplified); break;
    case PART_RELAX: validate_quads(d, &run->relaxed); break;
    case PART_FINISH: validate_quads(d, &run->finished); break;
    default: break; /* no more than numbers */
    }
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
    d->c->run.plan = d->c->history.attempt[d->c->history.current].plan;
}

static void read_stage(void *user)
{
    dump *d = user;
    if (d->part == PART_HIERARCHY) { /* built again: quicker than reading it, and the same */
        qw_enter_stage(d->env, QW_STAGE_HIERARCHY);
        qw_stage_functions[QW_STAGE_HIERARCHY](&d->c->run);
    }
    if (d->part == PART_SURFACE) d->c->rounds = qw_rounds_begin(d->env);
    walk(d, d->part);
    validate(d);
    if (d->part == PART_CLEAN) d->c->run.clean_census = qw_trimesh_census(d->env, &d->c->run.clean.mesh);
    if (d->part == PART_SURFACE) qw_measure_rest(&d->c->run);
    if (d->part == PART_SURFACE) d->c->run.surface_census = qw_trimesh_census(d->env, &d->c->run.surface);
    REQUIRE(d, d->part + 1 < (int)d->finished || d->at == d->end, "the dump goes on after its end");
}

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
    if (!c->has_input) c->input = (qw_clean_input){0}; /* what had been read is freed already */
    if (status == QW_OK) status = read_stages(&d);
    if (status != QW_OK) qw_forget_mesh(c);
    if (d.name != path) qw_free(c->env, (void *)d.name);
    qw_free(c->env, (void *)bytes);
    return status;
}
