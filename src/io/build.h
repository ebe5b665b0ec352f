/* A soup in the making: what the readers of all formats share. */
#pragma once

#include "base/hash.h"
#include "io/soup.h"

/* No count of vertices, corners or corners of triangles after cutting the polygons may reach this. */
#define QW_COUNT_LIMIT ((uint64_t)1 << 31)

typedef struct qw_builder {
    qw_env *env;
    const char *name; /* of the file, for messages */
    qw_soup soup;     /* face_begin[face_count] is where the face that is being read begins */
    size_t vertex_capacity, face_capacity, corner_capacity;
    uint32_t corner_count;
} qw_builder;

/* Room for so many, which may be a guess; the arrays grow when it was too low. */
qw_builder qw_build_begin(qw_env *env, const char *name, size_t vertices, size_t faces, size_t corners);
void qw_build_grow_vertices(qw_builder *b);
void qw_build_grow_faces(qw_builder *b);
void qw_build_grow_corners(qw_builder *b);
/* Fails with QW_TOO_LARGE: "PATH: 5000000000 vertices are more than can be addressed". */
void qw_build_check_count(qw_env *env, const char *name, uint64_t count, const char *what);

static inline void qw_build_vertex(qw_builder *b, const double position[3])
{
    if (b->soup.vertex_count == b->vertex_capacity) qw_build_grow_vertices(b);
    double *p = b->soup.position + 3 * (size_t)b->soup.vertex_count++;
    p[0] = position[0], p[1] = position[1], p[2] = position[2];
}

static inline void qw_build_corner(qw_builder *b, uint32_t vertex)
{
    if (b->corner_count == b->corner_capacity) qw_build_grow_corners(b);
    b->soup.corner[b->corner_count++] = vertex;
}

/* Ends the face of all corners since the last one; it is dropped if they are fewer than three. */
static inline void qw_build_face(qw_builder *b)
{
    qw_soup *s = &b->soup;
    if (b->corner_count - s->face_begin[s->face_count] < 3) {
        b->corner_count = s->face_begin[s->face_count];
        return;
    }
    if (s->face_count + 1 == b->face_capacity) qw_build_grow_faces(b);
    s->face_begin[++s->face_count] = b->corner_count;
}

/* Logs that so many bytes after the last announced element were not read: the header may be wrong. */
void qw_build_warn_rest(const qw_builder *b, size_t bytes);
/* Gives back what was reserved too much. Fails with QW_NO_FACES or QW_TOO_LARGE. */
qw_soup qw_build_finish(qw_builder *b);

/* The vertices alone: faces are dropped. Fails with QW_NO_FACES where there are fewer than three. */
qw_soup qw_build_finish_points(qw_builder *b);

/* Adds an attribute with its size and count set and everything else 0. name is copied. */
qw_attribute *qw_build_attribute(qw_env *env, qw_soup *soup, const char *name, qw_domain domain, qw_attribute_kind kind,
                                 uint32_t components);

/* Names that come again and again, numbered from 0 in the order in which they come first. */
typedef struct qw_names {
    size_t count, text_size, text_capacity, begin_capacity;
    qw_hash_table table;
    size_t *begin; /* size_t[count]: where each begins in text */
    char *text;    /* NUL-terminated, one after the other */
} qw_names;
int32_t qw_name_number(qw_env *env, qw_names *names, const char *at, size_t size);
/* char *[count], of which the first is the block of all. */
const char *const *qw_finish_names(qw_env *env, qw_names *names);

static inline bool qw_is_finite3(const double p[3]) { return p[0] - p[0] + (p[1] - p[1]) + (p[2] - p[2]) == 0; }
