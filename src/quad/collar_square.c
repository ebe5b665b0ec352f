/* Vertices of a collar on the surface: each moves to where the corners around it are best, one after the other. */
#include "quad/collar.h"

#include <string.h>

enum { SWEEPS = 24, DIRECTIONS = 8 };

typedef struct squaring {
    qw_quadmesh *q;
    const qw_bvh *tree;
    const qw_vec3 *normal; /* qw_vec3[faces of the surface] */
    uint32_t *begin;       /* uint32_t[vertex_count + 1]: the half-edges that leave each vertex */
    uint32_t *leaving;     /* uint32_t[4 face_count] */
    uint32_t *hint;        /* uint32_t[vertex_count]: triangle of the surface that it was last on */
} squaring;

void qw_quadmesh_link(qw_env *env, qw_quadmesh *q)
{
    uint32_t sides = 4 * q->face_count;
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)q->vertex_count + 2), *side = QW_NEW(env, uint32_t, sides);
    q->twin = QW_NEW(env, uint32_t, sides);
    memset(q->twin, 0xff, sides * sizeof *q->twin);
    for (uint32_t h = 0; h < sides; h++) begin[q->corner[h] + 2]++;
    for (uint32_t v = 0; v < q->vertex_count; v++) begin[v + 2] += begin[v + 1];
    for (uint32_t h = 0; h < sides; h++) side[begin[q->corner[h] + 1]++] = h;
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t v = q->corner[h], u = q->corner[qw_quad_next(h)];
        for (uint32_t i = begin[u]; i < begin[u + 1]; i++) {
            if (q->corner[qw_quad_next(side[i])] != v) continue;
            if (q->twin[h] != QW_NONE || (q->twin[side[i]] != QW_NONE && q->twin[side[i]] != h))
                qw_fail(env, QW_INTERNAL, v, "an edge of vertex %u has more than two quads", v);
            q->twin[h] = side[i];
        }
    }
    qw_free(env, begin), qw_free(env, side);
}

/* ---- how bad the quads around a vertex are */

/* The square of what a corner's sine lacks, and much more where it is next to nothing or negative; and a little for
   unequal edges. */
static double badness(const squaring *s, const uint32_t *corner, qw_vec3 up)
{
    double sum = 0, shortest = INFINITY, longest = 0;
    qw_vec3 edge[4];
    double length[4];
    for (int i = 0; i < 4; i++) {
        edge[i] = qw_sub(s->q->position[corner[(i + 1) % 4]], s->q->position[corner[i]]);
        length[i] = (double)qw_length(edge[i]);
        shortest = fmin(shortest, length[i]), longest = fmax(longest, length[i]);
    }
    for (int i = 0; i < 4; i++) {
        int before = (i + 3) % 4;
        double sine = (double)qw_dot(qw_cross(edge[before], edge[i]), up) / fmax(length[i] * length[before], 1e-30);
        double lack = 1 - sine, low = fmax(0.3 - sine, 0);
        sum += lack * lack + 20 * low * low;
    }
    return sum + 0.1 * fmin(longest / fmax(shortest, 1e-30) - 1, 100);
}

static double badness_around(const squaring *s, uint32_t v, qw_vec3 up)
{
    double sum = 0;
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; i++)
        sum += badness(s, s->q->corner + (s->leaving[i] & ~3u), up);
    return sum;
}

/* ---- moving */

typedef struct spot {
    qw_vec3 position, up;
    uint32_t face;
} spot;

/* The nearest point that faces as the quads do, if it is no farther than `reach`, or else the nearest. */
static spot on_surface(const squaring *s, qw_vec3 p, qw_vec3 up, float reach, uint32_t hint)
{
    qw_hit hit = qw_bvh_nearest(s->tree, p, up, QW_SAME_SHEET, reach, hint);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest(s->tree, p, qw_v3(0, 0, 0), -1, INFINITY, hint);
    return (spot){hit.point, s->normal[hit.face], hit.face};
}

/* Of the quads around a vertex. */
static qw_vec3 normal_around(const squaring *s, uint32_t v)
{
    qw_vec3 sum = qw_v3(0, 0, 0);
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; i++)
        sum = qw_add(sum, qw_quad_cross(s->q->position, s->q->corner + (s->leaving[i] & ~3u)));
    return qw_normalize(sum);
}

static qw_vec3 mean_neighbour(const squaring *s, uint32_t v, float *shortest)
{
    const qw_quadmesh *q = s->q;
    qw_vec3 sum = qw_v3(0, 0, 0);
    uint32_t count = s->begin[v + 1] - s->begin[v];
    *shortest = INFINITY;
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; i++) {
        qw_vec3 p = q->position[q->corner[qw_quad_next(s->leaving[i])]];
        sum = qw_add(sum, p);
        *shortest = fminf(*shortest, qw_distance(p, q->position[v]));
    }
    return qw_scale(sum, 1.0f / (float)count);
}

/* Moves the vertex there if the quads around it are better then. */
static bool try_spot(squaring *s, uint32_t v, qw_vec3 p, qw_vec3 up, float reach, double *best)
{
    spot to = on_surface(s, p, up, reach, s->hint[v]);
    qw_vec3 was = s->q->position[v];
    s->q->position[v] = to.position;
    double now = badness_around(s, v, to.up);
    if (!(now < *best)) {
        s->q->position[v] = was;
        return false;
    }
    s->hint[v] = to.face, *best = now;
    return true;
}

static void move(squaring *s, uint32_t v, float reach)
{
    static const float cosine[DIRECTIONS] = {1, 0.70710678f, 0, -0.70710678f, -1, -0.70710678f, 0, 0.70710678f};
    float shortest;
    qw_vec3 up = normal_around(s, v), middle = mean_neighbour(s, v, &shortest), p = s->q->position[v];
    spot here = on_surface(s, p, up, shortest, s->hint[v]);
    s->q->position[v] = here.position, s->hint[v] = here.face;
    double best = badness_around(s, v, here.up);
    if (try_spot(s, v, middle, up, shortest, &best) || try_spot(s, v, qw_lerp(p, middle, 0.4f), up, shortest, &best))
        return;
    p = s->q->position[v];
    qw_vec3 x = qw_any_orthogonal(here.up), y = qw_cross(here.up, x);
    for (int i = 0; i < DIRECTIONS; i++) {
        qw_vec3 d = qw_add(qw_scale(x, cosine[i]), qw_scale(y, cosine[(i + DIRECTIONS - 2) % DIRECTIONS]));
        if (try_spot(s, v, qw_madd(p, reach * shortest, d), up, shortest, &best)) return;
    }
}

void qw_square_corners(qw_env *env, qw_quadmesh *q, const uint8_t *moves, const qw_trimesh *surface, const qw_bvh *tree)
{
    qw_scope_begin(env);
    squaring s = {.q = q, .tree = tree, .normal = qw_face_normals(env, surface)};
    s.begin = QW_NEW_ZERO(env, uint32_t, (size_t)q->vertex_count + 2);
    s.leaving = QW_NEW(env, uint32_t, 4 * (size_t)q->face_count);
    s.hint = QW_NEW(env, uint32_t, q->vertex_count);
    memset(s.hint, 0xff, q->vertex_count * sizeof *s.hint);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) s.begin[q->corner[h] + 2]++;
    for (uint32_t v = 0; v < q->vertex_count; v++) s.begin[v + 2] += s.begin[v + 1];
    for (uint32_t h = 0; h < 4 * q->face_count; h++) s.leaving[s.begin[q->corner[h] + 1]++] = h;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        float reach = 0.3f / (float)(1 + sweep / 4);
        for (uint32_t v = 0; v < q->vertex_count; v++) {
            if (!moves[v]) continue;
            move(&s, v, reach);
            if (v % 256 == 0) qw_break_silence(env);
        }
    }
    qw_scope_end(env);
}
