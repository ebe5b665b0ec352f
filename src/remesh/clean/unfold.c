#include "remesh/clean/unfold.h"

#include "remesh/clean/marks.h"
#include "base/constants.h"

#include <assert.h>
#include <float.h>
#include <math.h>

enum { MOST_SIDES = 32, MOST_POINTS = MOST_SIDES + 4, PASSES = 8, MOST_STEPS = 16 };

/* How far from a plane the vertices of a flat place lie at most, in its size. */
static const float FLAT = 1e-4f;
/* Of coordinates in the centred frame. */
static const float ROUNDING = FLT_EPSILON;
/* Of the area of a ring: a triangle face down has at least this much, and so has the place from which all of the ring
 * is seen. */
static const float LEAST_AREA = 1e-4f;

typedef struct flat_point {
    float x, y;
} flat_point;

/* The neighbours of a vertex, counter-clockwise, in the plane that they lie in. */
typedef struct ring {
    uint32_t count, side[MOST_SIDES]; /* side: from one neighbour to the next */
    flat_point point[MOST_SIDES], middle;
    qw_vec3 origin, x_axis, y_axis, normal;
    float size, area; /* size: the root of the area */
} ring;

static float turn_of(flat_point a, flat_point b, flat_point c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static flat_point flatten(const ring *r, qw_vec3 p)
{
    qw_vec3 d = qw_sub(p, r->origin);
    return (flat_point){qw_dot(d, r->x_axis), qw_dot(d, r->y_axis)};
}

static bool is_in_plane(const ring *r, qw_vec3 p)
{
    return fabsf(qw_dot(qw_sub(p, r->origin), r->normal)) <= fmaxf(FLAT * r->size, ROUNDING);
}

/* False where the surface ends at the vertex or is not flat there. */
static bool find_ring(const qw_trimesh *m, uint32_t outgoing, ring *r)
{
    assert(outgoing < 3 * m->face_count);
    uint32_t h = outgoing;
    r->count = 0;
    do {
        if (r->count == MOST_SIDES) return false;
        r->side[r->count++] = qw_next(h);
        h = qw_around(m, h);
    } while (h != QW_NONE && h != outgoing);
    if (h == QW_NONE) return false;
    r->origin = m->position[m->corner[r->side[0]]];
    qw_vec3 area = {0, 0, 0};
    for (uint32_t i = 1; i + 1 < r->count; i++)
        area = qw_add(area, qw_cross(qw_sub(m->position[m->corner[r->side[i]]], r->origin),
                                     qw_sub(m->position[m->corner[r->side[i + 1]]], r->origin)));
    r->area = 0.5f * qw_length(area), r->size = sqrtf(r->area);
    if (!(r->area > 0)) return false;
    r->normal = qw_normalize(area), r->x_axis = qw_any_orthogonal(r->normal),
    r->y_axis = qw_cross(r->normal, r->x_axis);
    for (uint32_t i = 0; i < r->count; i++) {
        qw_vec3 p = m->position[m->corner[r->side[i]]];
        if (!is_in_plane(r, p)) return false;
        r->point[i] = flatten(r, p);
    }
    qw_vec3 middle = m->position[m->corner[outgoing]];
    r->middle = flatten(r, middle);
    return is_in_plane(r, middle);
}

/* Whether a triangle lies in the ring's plane, face up and without the vertex in the middle. */
static bool is_face_up(const qw_trimesh *m, const ring *r, uint32_t middle, uint32_t f)
{
    assert(f < m->face_count);
    const uint32_t *c = m->corner + 3 * (size_t)f;
    qw_vec3 a = m->position[c[0]], b = m->position[c[1]], d = m->position[c[2]];
    if (c[0] == middle || c[1] == middle || c[2] == middle || !is_in_plane(r, a) || !is_in_plane(r, b) ||
        !is_in_plane(r, d))
        return false;
    return turn_of(flatten(r, a), flatten(r, b), flatten(r, d)) > 0;
}

/* Walks from a triangle beyond the ring to where the vertex is, over triangles as above. Returns whether it gets there.
 */
static bool reaches_middle(const qw_trimesh *m, const ring *r, uint32_t middle, uint32_t f)
{
    assert(f < m->face_count);
    for (int step = 0; step < MOST_STEPS; step++) {
        uint32_t out = QW_NONE;
        float farthest = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            float turn = turn_of(flatten(r, m->position[m->corner[h]]), flatten(r, m->position[m->corner[qw_next(h)]]),
                                 r->middle);
            if (turn < farthest) farthest = turn, out = h;
        }
        if (out == QW_NONE) return true;
        if (m->twin[out] == QW_NONE) return false;
        f = m->twin[out] / 3;
        if (!is_face_up(m, r, middle, f)) return false;
    }
    return false;
}

/* Whether triangles of the ring lie face down on those beyond, where the vertex is. */
static bool is_folded(const qw_trimesh *m, const ring *r, uint32_t middle)
{
    bool folded = false, reached = false;
    for (uint32_t i = 0; i < r->count; i++) {
        if (turn_of(r->middle, r->point[i], r->point[(i + 1) % r->count]) > -2 * LEAST_AREA * r->area) continue;
        uint32_t g = m->twin[r->side[i]];
        if (g == QW_NONE || !is_face_up(m, r, middle, g / 3)) return false;
        reached = reached || reaches_middle(m, r, middle, g / 3);
        folded = true;
    }
    return folded && reached;
}

/* What lies to the left of the line from a to b of a convex polygon; returns how many points that has. 0 as well where
 * rounding gives more than there is room for. */
static uint32_t cut(const flat_point *in, uint32_t count, flat_point a, flat_point b, flat_point *out)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (kept + 2 > MOST_POINTS) return 0;
        flat_point p = in[i], q = in[(i + 1) % count];
        float dp = turn_of(a, b, p), dq = turn_of(a, b, q);
        if (dp >= 0) out[kept++] = p;
        if ((dp >= 0) != (dq >= 0)) {
            float t = dp / (dp - dq);
            out[kept++] = (flat_point){p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)};
        }
    }
    return kept;
}

/* The middle of the places from which all of the ring is seen (its kernel); false where there are none to speak of. */
static bool find_kernel(const ring *r, flat_point *middle)
{
    flat_point polygon[2][MOST_POINTS];
    float far = 0;
    for (uint32_t i = 0; i < r->count; i++) far = fmaxf(far, fmaxf(fabsf(r->point[i].x), fabsf(r->point[i].y)));
    uint32_t count = 4, from = 0;
    polygon[0][0] = (flat_point){-far, -far}, polygon[0][1] = (flat_point){far, -far},
    polygon[0][2] = (flat_point){far, far}, polygon[0][3] = (flat_point){-far, far};
    for (uint32_t i = 0; i < r->count; i++, from ^= 1)
        count = cut(polygon[from], count, r->point[i], r->point[(i + 1) % r->count], polygon[from ^ 1]);
    float area = 0;
    flat_point sum = {0, 0};
    for (uint32_t i = 0; i < count; i++) {
        if (i > 1) area += 0.5f * turn_of(polygon[from][0], polygon[from][i - 1], polygon[from][i]);
        sum.x += polygon[from][i].x / (float)count, sum.y += polygon[from][i].y / (float)count;
    }
    *middle = sum;
    return area > LEAST_AREA * r->area;
}

/* The ends are gathered when they are first asked for, as folds are rare. */
typedef struct marked {
    qw_env *env;
    const qw_clean_input *input;
    const qw_frame *frame;
    qw_mark_ends ends;
} marked;

static bool is_marked(marked *a, qw_vec3 place)
{
    if (a->input->mark_count == 0) return false;
    if (!a->ends.key) a->ends = qw_find_mark_ends(a->env, a->input, a->frame);
    return qw_is_mark_end(&a->ends, place);
}

/* Moves a vertex around which triangles are folded over one another to where none is, if there is such a place.
 * Returns whether it moved. */
static bool unfold_vertex(qw_trimesh *m, marked *marks, uint32_t outgoing)
{
    assert(outgoing < 3 * m->face_count);
    ring r;
    flat_point to;
    qw_vec3 *p = &m->position[m->corner[outgoing]];
    if (!find_ring(m, outgoing, &r) || !is_folded(m, &r, m->corner[outgoing]) || !find_kernel(&r, &to) ||
        is_marked(marks, *p))
        return false;
    *p = qw_madd(qw_madd(r.origin, to.x, r.x_axis), to.y, r.y_axis);
    return true;
}

typedef struct flagging {
    const qw_trimesh *mesh;
    uint8_t *flag; /* [faces] 1: lies on a neighbour */
} flagging;

/* Flags triangles that face nearly against a neighbour. */
static void flag_block(void *user, uint32_t begin, uint32_t end)
{
    const flagging *a = user;
    for (uint32_t f = begin; f < end; f++) {
        qw_vec3 n = qw_face_cross(a->mesh, f);
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t g = a->mesh->twin[h];
            if (g == QW_NONE || g < h) continue;
            qw_vec3 o = qw_face_cross(a->mesh, g / 3);
            if (qw_dot(n, o) < 0 && qw_dot(n, o) <= -(float)QW_PARALLEL_COSINE * qw_length(n) * qw_length(o))
                a->flag[f] = 1;
        }
    }
}

uint32_t qw_unfold(qw_env *env, const qw_clean_input *input, const qw_frame *frame, qw_trimesh *mesh)
{
    assert(mesh->twin && input);
    qw_scope_begin(env);
    flagging a = {mesh, QW_NEW_ZERO(env, uint8_t, mesh->face_count)};
    qw_parallel(env, mesh->face_count, QW_GRAIN_LIGHT, flag_block, &a);
    marked marks = {env, input, frame, {NULL, 0}};
    uint32_t moved = 0;
    for (int pass = 0; pass < PASSES; pass++) {
        uint32_t before = moved;
        for (uint32_t f = 0; f < mesh->face_count; f++)
            for (uint32_t h = 3 * f; a.flag[f] && h < 3 * f + 3; h++) moved += unfold_vertex(mesh, &marks, h);
        if (moved == before) break;
    }
    qw_scope_end(env);
    return moved;
}
