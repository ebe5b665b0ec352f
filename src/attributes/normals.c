#include "attributes/normals.h"

#include "math/elementary.h"

#include <assert.h>
#include <string.h>

/* Edges are kept for other reasons, too (borders of materials, seams of a texture): they are sharp where the normals of
   their quads differ by more than this, 15 degrees, as a cosine. */
static const float SHARP_COSINE = 0.9659258f;

typedef struct fans {
    const qw_quadmesh *quads;
    bool split;
    float *normal; /* as of qw_shading_normals */
} fans;

/* The normal of a quad at the corner of its half-edge h, as long as its angle there, in radians. */
static qw_vec3 corner_normal(const qw_quadmesh *q, uint32_t h)
{
    qw_vec3 at = q->position[q->corner[h]], a = qw_sub(q->position[q->corner[qw_quad_next(h)]], at),
            b = qw_sub(q->position[q->corner[qw_quad_prev(h)]], at), across = qw_cross(a, b);
    qw_vec3 whole = qw_quad_normal(q, h / 4);
    if (qw_dot(across, whole) <= 0) return qw_scale(whole, 1e-3f); /* bent inward: the quad as a whole says more */
    double angle = qw_atan2((double)qw_length(across), (double)qw_dot(a, b));
    return qw_scale(qw_normalize(across), (float)angle);
}

/* The edge between the quads of h and of its twin. */
static bool is_sharp(const qw_quadmesh *q, uint32_t h)
{
    uint32_t t = q->twin[h];
    return q->mark && (q->mark[h] || q->mark[t]) &&
           qw_dot(qw_quad_normal(q, h / 4), qw_quad_normal(q, t / 4)) < SHARP_COSINE;
}

static void put(const fans *f, uint32_t h, qw_vec3 n)
{
    float *to = f->normal + 3 * (size_t)(f->split ? h : f->quads->corner[h]);
    to[0] = n.x, to[1] = n.y, to[2] = n.z;
}

/* The half-edge at which a sector of the fan of `first` begins: a sharp one where the fan has one. */
static uint32_t begin_of(const fans *f, uint32_t first)
{
    uint32_t h = first;
    if (!f->split || f->quads->twin[first] == QW_NONE) return first; /* fans at a boundary begin there */
    do {
        if (f->quads->twin[h] != QW_NONE && is_sharp(f->quads, h)) return h;
        h = qw_quad_around(f->quads, h);
    } while (h != QW_NONE && h != first);
    return first;
}

static void shade_fan(const fans *f, uint32_t first)
{
    const qw_quadmesh *q = f->quads;
    uint32_t begin = begin_of(f, first), h = begin;
    while (h != QW_NONE) { /* a sector a turn */
        qw_vec3 sum = {0, 0, 0};
        uint32_t end = h;
        do {
            sum = qw_add(sum, corner_normal(q, end));
            end = qw_quad_around(q, end);
        } while (end != QW_NONE && end != begin && !(f->split && is_sharp(q, end)));
        qw_vec3 n = qw_normalize(sum);
        if (qw_length2(n) == 0) n = qw_quad_normal(q, h / 4);
        do {
            put(f, h, n);
            h = qw_quad_around(q, h);
        } while (h != end);
        if (end == begin) break;
    }
}

float *qw_shading_normals(qw_env *env, const qw_quadmesh *quads, bool split)
{
    assert(quads->twin && quads->position);
    size_t count = split ? 4 * (size_t)quads->face_count : quads->vertex_count;
    fans f = {quads, split, QW_NEW_ZERO(env, float, 3 * count)};
    uint32_t *first = qw_quadmesh_outgoing(env, quads);
    for (uint32_t v = 0; v < quads->vertex_count; v++)
        if (first[v] != QW_NONE) shade_fan(&f, first[v]);
    qw_free(env, first);
    return f.normal;
}
