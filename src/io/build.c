#include "io/build.h"

#include <inttypes.h>
#include <string.h>

enum { FIRST_CAPACITY = 64 };

static size_t at_least(size_t wanted) { return wanted < FIRST_CAPACITY ? FIRST_CAPACITY : wanted; }

qw_builder qw_build_begin(qw_env *env, const char *name, size_t vertices, size_t faces, size_t corners)
{
    qw_builder b = {.env = env, .name = name};
    b.vertex_capacity = at_least(vertices);
    b.face_capacity = at_least(faces + 1);
    b.corner_capacity = at_least(corners);
    b.soup.position = qw_alloc(env, b.vertex_capacity, 3 * sizeof(double));
    b.soup.face_begin = QW_NEW(env, uint32_t, b.face_capacity);
    b.soup.corner = QW_NEW(env, uint32_t, b.corner_capacity);
    b.soup.face_begin[0] = 0;
    return b;
}

void qw_build_check_count(qw_env *env, const char *name, uint64_t count, const char *what)
{
    if (count >= QW_COUNT_LIMIT)
        qw_fail(env, QW_TOO_LARGE, -1, "%s: %" PRIu64 " %s are more than can be addressed (%" PRIu64 ")", name, count,
                what, QW_COUNT_LIMIT - 1);
}

void qw_build_grow_vertices(qw_builder *b)
{
    qw_build_check_count(b->env, b->name, b->vertex_capacity + 1, "vertices");
    b->soup.position = qw_grow(b->env, b->soup.position, &b->vertex_capacity, b->vertex_capacity + 1,
                               3 * sizeof(double));
}

void qw_build_grow_faces(qw_builder *b)
{
    qw_build_check_count(b->env, b->name, b->face_capacity + 1, "faces");
    b->soup.face_begin = qw_grow(b->env, b->soup.face_begin, &b->face_capacity, b->face_capacity + 1, sizeof(uint32_t));
}

void qw_build_grow_corners(qw_builder *b)
{
    qw_build_check_count(b->env, b->name, b->corner_capacity + 1, "face corners");
    b->soup.corner = qw_grow(b->env, b->soup.corner, &b->corner_capacity, b->corner_capacity + 1, sizeof(uint32_t));
}

void qw_build_warn_rest(const qw_builder *b, size_t bytes)
{
    qw_log(b->env, QW_LOG_WARNING, "%s: %zu bytes after the last announced element are not read", b->name, bytes);
}

qw_soup qw_build_finish(qw_builder *b)
{
    qw_soup *s = &b->soup;
    if (s->face_count == 0) qw_fail(b->env, QW_NO_FACES, -1, "%s: there is no face of three corners or more", b->name);
    qw_build_check_count(b->env, b->name, s->vertex_count, "vertices");
    qw_build_check_count(b->env, b->name, b->corner_count, "face corners");
    qw_build_check_count(b->env, b->name, 3 * ((uint64_t)b->corner_count - 2 * (uint64_t)s->face_count),
                         "corners of triangles");
    if (s->vertex_count < b->vertex_capacity)
        s->position = qw_resize(b->env, s->position, s->vertex_count, 3 * sizeof(double));
    if (s->face_count + 1 < b->face_capacity)
        s->face_begin = qw_resize(b->env, s->face_begin, s->face_count + (size_t)1, sizeof(uint32_t));
    if (b->corner_count < b->corner_capacity)
        s->corner = qw_resize(b->env, s->corner, b->corner_count, sizeof(uint32_t));
    return *s;
}

qw_soup qw_build_finish_points(qw_builder *b)
{
    qw_soup *s = &b->soup;
    if (s->vertex_count < 3) qw_fail(b->env, QW_NO_FACES, -1, "%s: there are fewer than three points", b->name);
    qw_build_check_count(b->env, b->name, s->vertex_count, "vertices");
    s->face_count = 0, s->face_begin[0] = 0, b->corner_count = 0;
    return *s;
}

/* ---- attributes */

qw_attribute *qw_build_attribute(qw_env *env, qw_soup *soup, const char *name, qw_domain domain, qw_attribute_kind kind,
                                 uint32_t components)
{
    const uint32_t counts[] = {soup->vertex_count, soup->face_begin[soup->face_count], soup->face_count};
    size_t size = strlen(name) + 1;
    soup->attribute = qw_resize(env, soup->attribute, soup->attribute_count + (size_t)1, sizeof *soup->attribute);
    qw_attribute *a = &soup->attribute[soup->attribute_count++];
    *a = (qw_attribute){.size = sizeof *a,
                        .name = memcpy(qw_alloc(env, size, 1), name, size),
                        .domain = domain,
                        .kind = kind,
                        .components = components,
                        .count = counts[domain]};
    return a;
}

/* ---- names */

typedef struct wanted_name {
    const qw_names *n;
    const char *at;
    size_t size;
} wanted_name;

static bool is_same_name(const void *wanted, uint32_t i)
{
    const wanted_name *w = wanted;
    const char *known = w->n->text + w->n->begin[i];
    return strncmp(known, w->at, w->size) == 0 && known[w->size] == 0;
}

static uint32_t *slot_of(const qw_names *n, const char *at, size_t size)
{
    uint64_t hash = qw_mix(qw_hash_bytes(QW_HASH_BYTES, at, size));
    return qw_hash_slot(&n->table, hash, is_same_name, &(wanted_name){n, at, size});
}

static void grow_table(qw_env *env, qw_names *n)
{
    qw_free(env, n->table.slot);
    n->table = qw_hash_table_create(env, 2 * (n->count + FIRST_CAPACITY));
    for (uint32_t i = 0; i < n->count; i++) {
        const char *name = n->text + n->begin[i];
        *slot_of(n, name, strlen(name)) = i;
    }
}

int32_t qw_name_number(qw_env *env, qw_names *n, const char *at, size_t size)
{
    const char *end = memchr(at, 0, size);
    if (end) size = (size_t)(end - at);
    if (2 * n->count >= n->table.mask) grow_table(env, n);
    uint32_t *slot = slot_of(n, at, size);
    if (*slot != QW_NONE) return (int32_t)*slot;
    n->begin = qw_grow(env, n->begin, &n->begin_capacity, n->count + 1, sizeof *n->begin);
    n->text = qw_grow(env, n->text, &n->text_capacity, n->text_size + size + 1, 1);
    n->begin[n->count] = n->text_size;
    memcpy(n->text + n->text_size, at, size);
    n->text[n->text_size + size] = 0;
    n->text_size += size + 1;
    *slot = (uint32_t)n->count;
    return (int32_t)n->count++;
}

const char *const *qw_finish_names(qw_env *env, qw_names *n)
{
    if (n->count == 0) return NULL;
    const char **names = QW_NEW(env, const char *, n->count);
    for (size_t i = 0; i < n->count; i++) names[i] = n->text + n->begin[i];
    qw_free(env, n->table.slot), qw_free(env, n->begin);
    return names;
}
