/* Vertices of a collar on the surface: each moves to where the corners around it are best, one after the other. */
#include "whole/collar.h"

#include <assert.h>
#include <string.h>

enum {
    SWEEPS = 24,
    DIRECTIONS = 8,
    ROOM = 3,  /* rings around inverted quads that move */
    ROUNDS = 4 /* of sweeps around them */
};

typedef struct squaring {
    qw_quadmesh *q;
    const qw_bvh *tree;
    const qw_vec3 *normal; /* qw_vec3[faces of the surface] */
    uint32_t *begin;       /* uint32_t[vertex_count + 1]: the half-edges that leave each vertex */
    uint32_t *leaving;     /* uint32_t[4 face_count] */
    uint32_t *hint;        /* uint32_t[vertex_count]: triangle of the surface that it was last on */
} squaring;

/* ---- how bad the quads around a vertex are */

/* Sine of a corner below which it counts again, and what the ratio of the longest side to the shortest counts for, no
   more than LONGEST_RATIO. */
static const double LOW_SINE = 0.3, RATIO_WEIGHT = 0.1, LONGEST_RATIO = 100;
/* Shares of the way: to the middle of its neighbours a vertex tries all of it, then this; and of the shortest side, the
   first sweeps' step aside. */
static const float PART_OF_WAY = 0.4f, FIRST_REACH = 0.3f;

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
        double lack = 1 - sine, low = fmax(LOW_SINE - sine, 0);
        sum += lack * lack + 20 * low * low;
    }
    return sum + RATIO_WEIGHT * fmin(longest / fmax(shortest, 1e-30) - 1, LONGEST_RATIO);
}

static double badness_around(const squaring *s, uint32_t v, qw_vec3 up)
{
    assert(v < s->q->vertex_count);
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

/* For the vertex v, on its own component: the nearest point that faces as the quads do, if it is no farther than
   `reach`, or else the nearest. */
static spot on_surface(const squaring *s, uint32_t v, qw_vec3 p, qw_vec3 up, float reach)
{
    uint32_t part = s->q->component[v], hint = s->hint[v];
    qw_hit hit = qw_bvh_nearest_of(s->tree, part, p, up, QW_SAME_SHEET, reach, hint);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest_of(s->tree, part, p, qw_v3(0, 0, 0), -1, INFINITY, hint);
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
    assert(v < s->q->vertex_count);
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
    spot to = on_surface(s, v, p, up, reach);
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
    spot here = on_surface(s, v, p, up, shortest);
    s->q->position[v] = here.position, s->hint[v] = here.face;
    double best = badness_around(s, v, here.up);
    if (try_spot(s, v, middle, up, shortest, &best) ||
        try_spot(s, v, qw_lerp(p, middle, PART_OF_WAY), up, shortest, &best))
        return;
    p = s->q->position[v];
    qw_vec3 x = qw_any_orthogonal(here.up), y = qw_cross(here.up, x);
    for (int i = 0; i < DIRECTIONS; i++) {
        qw_vec3 d = qw_add(qw_scale(x, cosine[i]), qw_scale(y, cosine[(i + DIRECTIONS - 2) % DIRECTIONS]));
        if (try_spot(s, v, qw_madd(p, reach * shortest, d), up, shortest, &best)) return;
    }
}

void qw_grow_marks(const qw_quadmesh *q, int rings, uint8_t *marks)
{
    assert(rings >= 0 && marks);
    for (int ring = 0; ring < rings; ring++) {
        for (uint32_t h = 0; h < 4 * q->face_count; h++)
            if (marks[q->corner[h]] == 1) {
                uint32_t u = q->corner[qw_quad_next(h)], w = q->corner[qw_quad_prev(h)];
                if (!marks[u]) marks[u] = 2;
                if (!marks[w]) marks[w] = 2;
            }
        for (uint32_t v = 0; v < q->vertex_count; v++) marks[v] = marks[v] != 0;
    }
}

static void sweep_over(qw_env *env, squaring *s, const uint8_t *mobility, const uint8_t *chosen, int sweep)
{
    float reach = FIRST_REACH / (float)(1 + sweep / 4);
    for (uint32_t v = 0; v < s->q->vertex_count; v++) {
        if (chosen ? !chosen[v] || mobility[v] == QW_STAYS : mobility[v] != QW_MOVES) continue;
        move(s, v, reach);
        if (v % 256 == 0) qw_break_silence(env);
    }
}

/* Whether a corner of the quad turns the wrong way, seen from where the surface is nearest to its middle. */
static bool is_inverted(const squaring *s, uint32_t f)
{
    assert(f < s->q->face_count);
    const uint32_t *corner = s->q->corner + 4 * (size_t)f;
    qw_vec3 middle = qw_quad_middle(s->q->position, corner);
    qw_hit hit = qw_bvh_nearest(s->tree, middle, qw_v3(0, 0, 0), -1, INFINITY, s->hint[corner[0]]);
    for (uint32_t i = 0; i < 4; i++) {
        qw_vec3 p = s->q->position[corner[i]], a = qw_sub(s->q->position[corner[(i + 1) % 4]], p),
                b = qw_sub(s->q->position[corner[(i + 3) % 4]], p);
        if (qw_dot(qw_cross(a, b), s->normal[hit.face]) <= 0) return true;
    }
    return false;
}

/* Marks the vertices of quads that may move and are inverted. Returns how many quads are. */
static uint32_t mark_inverted(const squaring *s, const uint8_t *mobility, uint8_t *marks)
{
    uint32_t count = 0;
    memset(marks, 0, s->q->vertex_count);
    for (uint32_t f = 0; f < s->q->face_count; f++) {
        const uint32_t *corner = s->q->corner + 4 * (size_t)f;
        bool moves = false;
        for (uint32_t i = 0; i < 4; i++) moves |= mobility[corner[i]] == QW_MOVES;
        if (!moves || !is_inverted(s, f)) continue;
        for (uint32_t i = 0; i < 4; i++) marks[corner[i]] = 1;
        count++;
    }
    return count;
}

/* Around quads that are inverted still, more vertices move, and again far: a rim of a few quads across needs room. */
static void give_room(qw_env *env, squaring *s, const uint8_t *mobility)
{
    uint8_t *marks = QW_NEW(env, uint8_t, s->q->vertex_count);
    uint32_t inverted = mark_inverted(s, mobility, marks);
    for (int round = 0; round < ROUNDS && inverted > 0; round++) {
        qw_grow_marks(s->q, ROOM, marks);
        for (int sweep = 0; sweep < SWEEPS; sweep++) sweep_over(env, s, mobility, marks, sweep);
        inverted = mark_inverted(s, mobility, marks);
    }
    qw_free(env, marks);
}

void qw_square_corners(qw_env *env, qw_quadmesh *q, const uint8_t *mobility, const qw_trimesh *surface,
                       const qw_bvh *tree)
{
    assert(q->twin && surface->face_count > 0 && tree);
    qw_scope_begin(env);
    squaring s = {.q = q, .tree = tree, .normal = qw_face_normals(env, surface)};
    s.begin = QW_NEW_ZERO(env, uint32_t, (size_t)q->vertex_count + 2);
    s.leaving = QW_NEW(env, uint32_t, 4 * (size_t)q->face_count);
    s.hint = QW_NEW(env, uint32_t, q->vertex_count);
    memset(s.hint, 0xff, q->vertex_count * sizeof *s.hint);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) s.begin[q->corner[h] + 2]++;
    for (uint32_t v = 0; v < q->vertex_count; v++) s.begin[v + 2] += s.begin[v + 1];
    for (uint32_t h = 0; h < 4 * q->face_count; h++) s.leaving[s.begin[q->corner[h] + 1]++] = h;
    for (int sweep = 0; sweep < SWEEPS; sweep++) sweep_over(env, &s, mobility, NULL, sweep);
    give_room(env, &s, mobility);
    qw_scope_end(env);
}
