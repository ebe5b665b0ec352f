#include "io/build.h"

#include <inttypes.h>

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
