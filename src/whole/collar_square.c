/* Vertices of a collar on the surface: each moves to where the corners around it are best, one after the other. */
#include "whole/collar.h"

#include "geometry/step_search.h"
#include "base/groups.h"

#include <assert.h>
#include <string.h>

enum {
    SWEEPS = 24,
    LENGTHS = 3, /* of steps */
    ROOM = 3,    /* rings around inverted quads that move */
    ROUNDS = 4   /* of sweeps around them */
};

typedef struct squaring {
    qw_quadmesh *q;
    const qw_bvh *tree;
    const qw_vec3 *normal;     /* qw_vec3[faces of the surface] */
    uint32_t *begin, *leaving; /* the half-edges that leave each vertex: leaving[begin[v] .. begin[v + 1]) */
    uint32_t *hint;            /* uint32_t[vertex_count]: triangle of the surface that it was last on */
    qw_vec3 facing;            /* of the quads at the vertex that is moved, and the shortest side there */
    float shortest;
    qw_spot spot; /* where that vertex is put */
} squaring;

/* ---- how bad the quads around a vertex are */

/* Sine of a corner below which it counts again, and what the ratio of the longest side to the shortest counts for, no
   more than LONGEST_RATIO. */
static const double LOW_SINE = 0.3, RATIO_WEIGHT = 0.1, LONGEST_RATIO = 100;
/* The longest step is the way to the middle of the neighbours, no less than this share of the shortest side and no more
   than all of it. */
static const float LEAST_REACH = 0.3f;

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

/* ---- moving */

/* For the vertex v, on its own component: the nearest point that faces as the quads do, if it is no farther than
   `reach`, or else the nearest. */
static qw_spot on_surface(const squaring *s, uint32_t v, qw_vec3 p, qw_vec3 up, float reach)
{
    assert(v < s->q->vertex_count);
    uint32_t part = s->q->component[v], hint = s->hint[v];
    qw_hit hit = qw_bvh_nearest_of(s->tree, part, p, up, QW_SAME_SHEET, reach, hint);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest_of(s->tree, part, p, qw_v3(0, 0, 0), -1, INFINITY, hint);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest(s->tree, p, qw_v3(0, 0, 0), -1, INFINITY, hint);
    qw_spot spot = {.up = s->normal[hit.face], .on = hit.face};
    qw_to_doubles(hit.point, spot.at);
    return spot;
}

/* Of the quads around a vertex. */
static qw_vec3 normal_around(const squaring *s, uint32_t v)
{
    qw_vec3 sum = qw_v3(0, 0, 0);
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; i++)
        sum = qw_add(sum, qw_quad_cross(s->q->position, s->q->corner + (s->leaving[i] & ~3u)));
    return qw_normalize(sum);
}

/* The mean of the neighbours of v. *shortest: receives the shortest edge to one. */
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

static void put_spot(void *user, uint32_t v, const qw_spot *spot)
{
    squaring *s = user;
    s->hint[v] = spot->on, s->spot = *spot;
}

static bool land(void *user, uint32_t v, const double aimed[3], qw_spot *spot)
{
    const squaring *s = user;
    *spot = on_surface(s, v, qw_v3_of_doubles(aimed), s->facing, s->shortest);
    return true;
}

/* Puts vertex v on the surface, into *here, and says how far and along which axes it may go from there: the first axis
   leads to the middle of its neighbours. Returns the first step. */
static double frame_of(void *user, uint32_t v, qw_spot *here, qw_vec3 axis[2])
{
    squaring *s = user;
    qw_vec3 middle = mean_neighbour(s, v, &s->shortest);
    s->facing = normal_around(s, v);
    *here = on_surface(s, v, s->q->position[v], s->facing, s->shortest);
    s->q->position[v] = qw_v3_of_doubles(here->at);
    put_spot(s, v, here);
    qw_vec3 way = qw_reject(qw_sub(middle, s->q->position[v]), here->up);
    float length = qw_length(way);
    axis[0] = length > 0 ? qw_scale(way, 1 / length) : qw_any_orthogonal(here->up);
    axis[1] = qw_cross(here->up, axis[0]);
    return (double)fminf(fmaxf(length, LEAST_REACH * s->shortest), s->shortest);
}

static double cost_at(void *user, uint32_t v, uint32_t f)
{
    (void)v;
    const squaring *s = user;
    return badness(s, s->q->corner + 4 * (size_t)f, s->spot.up);
}

/* Moves those of the vertices that are chosen (NULL: those that always move) until none finds a better place. */
static void square(qw_env *env, squaring *s, const uint8_t *mobility, const uint8_t *chosen)
{
    uint32_t n = s->q->vertex_count, *list = QW_NEW(env, uint32_t, n), count = 0;
    for (uint32_t v = 0; v < n; v++)
        if (chosen ? chosen[v] && mobility[v] != QW_STAYS : mobility[v] == QW_MOVES) list[count++] = v;
    uint8_t *awake = memset(QW_NEW(env, uint8_t, n), 1, n);
    const qw_step_search search = {s->q->corner, s->q->position, NULL,     s->begin, s->leaving, awake, LENGTHS, s,
                                   frame_of,     land,           put_spot, cost_at};
    bool any = true;
    for (int sweep = 0; sweep < SWEEPS && any; sweep++) {
        any = qw_search_all(&search, list, count);
        qw_heartbeat(env);
    }
    qw_free(env, awake), qw_free(env, list);
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
        square(env, s, mobility, marks);
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
    s.leaving = qw_group(env, q->corner, 4 * q->face_count, q->vertex_count, &s.begin);
    s.hint = memset(QW_NEW(env, uint32_t, q->vertex_count), 0xff, q->vertex_count * sizeof *s.hint);
    square(env, &s, mobility, NULL);
    give_room(env, &s, mobility);
    qw_scope_end(env);
}
