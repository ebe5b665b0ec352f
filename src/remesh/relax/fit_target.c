/* The sharp edges of a soup are nowhere in its file: they are where its planes cross. So a vertex on a curve moves to
 * the least squares of its distances from the planes that are nearest to points in the quads around it, as in dual
 * contouring (Ju et al. 2002); a small weight of its own place keeps it along the edge. */
#include "remesh/relax/fit_target.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { MOST_AROUND = 16 };
static const float INTO = 0.25f; /* of the way to the middle of a quad: where its plane is looked for */
static const float OWN = 0.01f;  /* weight of a vertex' own place, over that of a plane */

qw_vec3 qw_target_place(const qw_fit_target *m, qw_vec3 place, qw_vec3 up, uint32_t *hint, bool *is_thin)
{
    if (is_thin) *is_thin = false;
    if (!m->tree) return place;
    qw_hit hit = qw_bvh_nearest(m->tree, place, up, QW_SAME_SHEET, m->reach, *hint);
    if (hit.face == QW_NONE) return place;
    *hint = hit.face;
    qw_hit other = qw_bvh_nearest(m->surface, hit.point, qw_scale(up, -1), QW_SAME_SHEET, m->reach, QW_NONE);
    if (other.face == QW_NONE) return hit.point;
    if (is_thin) *is_thin = true;
    return other.distance2 <= 4 * m->off * m->off ? qw_madd(hit.point, m->off, up) : hit.point;
}

/* Sums of the planes around a vertex: n n^T, without what lies below the diagonal, and n (n . way). */
typedef struct planes {
    double square[3][3], way[3];
    int count;
} planes;

typedef struct putting {
    const qw_quadmesh *quads;
    const qw_fit_target *target;
    const uint32_t *out; /* uint32_t[vertices]: a half-edge that leaves it; QW_NONE: it stays */
    qw_vec3 *to;         /* qw_vec3[vertices] */
} putting;

static void add_plane(planes *s, qw_vec3 from, qw_vec3 place, qw_vec3 normal)
{
    double n[3] = {normal.x, normal.y, normal.z}, way = (double)qw_dot(normal, qw_sub(place, from));
    for (int i = 0; i < 3; i++) {
        s->way[i] += n[i] * way;
        for (int j = 0; j < 3; j++) s->square[i][j] += n[i] * n[j];
    }
    s->count++;
}

/* Gauss's elimination: the matrix is positive definite by the weight of the own place. */
static qw_vec3 solve(planes *s)
{
    double x[3];
    for (int i = 0; i < 3; i++) s->square[i][i] += (double)OWN * s->count;
    for (int i = 0; i < 3; i++)
        for (int r = i + 1; r < 3; r++) {
            double share = s->square[r][i] / s->square[i][i];
            for (int c = i; c < 3; c++) s->square[r][c] -= share * s->square[i][c];
            s->way[r] -= share * s->way[i];
        }
    for (int i = 2; i >= 0; i--) {
        x[i] = s->way[i];
        for (int c = i + 1; c < 3; c++) x[i] -= s->square[i][c] * x[c];
        x[i] /= s->square[i][i];
    }
    return qw_v3_of_doubles(x);
}

static qw_vec3 middle_of(const qw_quadmesh *q, uint32_t f)
{
    const uint32_t *c = q->corner + 4 * (size_t)f;
    return qw_scale(qw_add(qw_add(q->position[c[0]], q->position[c[1]]), qw_add(q->position[c[2]], q->position[c[3]])),
                    0.25f);
}

/* Where the planes of the target around v meet; v itself where one is missing or the place is too far off. */
static qw_vec3 target_vertex(const putting *t, uint32_t v, uint32_t *hint)
{
    assert(v < t->quads->vertex_count);
    const qw_quadmesh *q = t->quads;
    const qw_fit_target *m = t->target;
    planes s = {.count = 0};
    qw_vec3 at = q->position[v];
    uint32_t h = t->out[v];
    do {
        qw_vec3 inside = qw_lerp(at, middle_of(q, h / 4), INTO),
                up = qw_normalize(qw_quad_cross(q->position, q->corner + 4 * (size_t)(h / 4)));
        qw_hit hit = qw_bvh_nearest(m->tree, inside, up, QW_SAME_SHEET, m->reach, *hint);
        if (hit.face == QW_NONE || s.count == MOST_AROUND) return at;
        *hint = hit.face;
        add_plane(&s, at, qw_target_place(m, inside, up, hint, NULL), qw_bvh_normal(m->tree, hit.face));
        h = qw_quad_around(q, h);
    } while (h != t->out[v]);
    qw_vec3 way = solve(&s);
    return qw_length(way) <= m->reach ? qw_add(at, way) : at;
}

static void put_block(void *user, uint32_t begin, uint32_t end)
{
    const putting *t = user;
    uint32_t hint = QW_NONE;
    for (uint32_t v = begin; v < end; v++)
        t->to[v] = t->out[v] == QW_NONE ? t->quads->position[v] : target_vertex(t, v, &hint);
}

void qw_put_curves_on_target(qw_env *env, qw_quadmesh *quads, const qw_fit_target *m)
{
    const qw_quadmesh *q = quads;
    assert(q->twin && m->tree);
    if (!q->kind) return;
    uint32_t *out = QW_NEW(env, uint32_t, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++) out[v] = QW_NONE;
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (q->kind[q->corner[h]] != QW_VERTEX_FREE) out[q->corner[h]] = h;
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (q->twin[h] == QW_NONE) out[q->corner[h]] = out[q->corner[qw_quad_next(h)]] = QW_NONE;
    putting t = {q, m, out, QW_NEW(env, qw_vec3, q->vertex_count)};
    qw_parallel(env, q->vertex_count, QW_GRAIN_HEAVY, put_block, &t);
    memcpy(quads->position, t.to, q->vertex_count * sizeof *t.to);
    qw_free(env, out), qw_free(env, t.to);
}
