#include "remesh/sizes/bends.h"

#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Adds a third of triangle f to the area and normal of each of its corners, or of what these belong to. */
static void add_face(const qw_trimesh *m, const uint32_t *of, uint32_t f, qw_bends *sums)
{
    assert(f < m->face_count);
    qw_vec3 cross = qw_face_cross(m, f);
    float third = qw_length(cross) / 6;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t v = m->corner[3 * (size_t)f + i];
        qw_bends *s = &sums[of ? of[v] : v];
        s->area += third;
        s->normal[0] += cross.x / 6, s->normal[1] += cross.y / 6, s->normal[2] += cross.z / 6;
    }
}

/* Half of each edge's bend, as tensors: found on all threads, so many half-edges at a time, and added in their order.
 */
typedef struct edge_bends {
    const qw_trimesh *mesh;
    const qw_vec3 *facing; /* qw_vec3[faces]: unit normals */
    uint32_t first;        /* half-edge of the tensor that comes first */
    float (*tensor)[6];
    bool *is_bent; /* whether there is one: of the half-edge of an edge that has the lower number */
} edge_bends;
enum { AT_ONCE = 1 << 14 };

/* How each edge bends the surface: half its turn times its length, as a tensor along it. */
static void find_bends(void *user, uint32_t begin, uint32_t end)
{
    edge_bends *e = user;
    const qw_trimesh *m = e->mesh;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t h = e->first + i, twin = m->twin[h];
        e->is_bent[i] = false;
        if (twin == QW_NONE || h > twin || qw_is_curve_edge(m, h, false)) continue;
        qw_vec3 along = qw_edge_way(m, h);
        qw_vec3 n = e->facing[h / 3], o = e->facing[twin / 3];
        float length = qw_length(along);
        if (!(length > 0) || qw_length2(n) == 0 || qw_length2(o) == 0) continue;
        qw_vec3 u = qw_scale(along, 1 / length);
        float w = 0.5f * length * (float)qw_atan2(qw_dot(qw_cross(n, o), u), qw_dot(n, o));
        const float tensor[6] = {w * u.x * u.x, w * u.y * u.y, w * u.z * u.z,
                                 w * u.x * u.y, w * u.y * u.z, w * u.z * u.x};
        memcpy(e->tensor[i], tensor, sizeof tensor), e->is_bent[i] = true;
    }
}

/* Adds the bends of all edges to the pieces at their ends, in the order of the edges. */
static void add_edges(qw_env *env, const qw_trimesh *m, const uint32_t *of, const qw_vec3 *facing, qw_bends *sums)
{
    edge_bends e = {.mesh = m, .facing = facing, .is_bent = QW_NEW(env, bool, AT_ONCE)};
    e.tensor = qw_alloc(env, AT_ONCE, sizeof *e.tensor);
    for (; e.first < 3 * m->face_count; e.first += AT_ONCE) {
        uint32_t left = 3 * m->face_count - e.first, count = left < AT_ONCE ? left : AT_ONCE;
        qw_parallel(env, count, 4 * QW_GRAIN_HEAVY, find_bends, &e);
        for (uint32_t i = 0; i < count; i++) {
            if (!e.is_bent[i]) continue;
            uint32_t from = m->corner[e.first + i], to = m->corner[qw_next(e.first + i)];
            float *a = sums[of ? of[from] : from].tensor, *b = sums[of ? of[to] : to].tensor;
            for (int k = 0; k < 6; k++) a[k] += e.tensor[i][k], b[k] += e.tensor[i][k];
        }
    }
    qw_free(env, e.tensor), qw_free(env, e.is_bent);
}

qw_bends *qw_sum_bends(qw_env *env, const qw_trimesh *m, const uint32_t *of, uint32_t count)
{
    assert(m->twin);
    qw_bends *sums = QW_NEW_ZERO(env, qw_bends, count);
    qw_vec3 *facing = qw_face_normals(env, m);
    for (uint32_t f = 0; f < m->face_count; f++) add_face(m, of, f, sums);
    add_edges(env, m, of, facing, sums);
    qw_free(env, facing);
    return sums;
}

/* u M v */
static double product(const float m[6], qw_vec3 u, qw_vec3 v)
{
    return (double)(u.x * (m[0] * v.x + m[3] * v.y + m[5] * v.z) + u.y * (m[3] * v.x + m[1] * v.y + m[4] * v.z) +
                    u.z * (m[5] * v.x + m[4] * v.y + m[2] * v.z));
}

qw_vec3 qw_principal_curvatures(const qw_bends *s, double curvature[2])
{
    qw_vec3 n = qw_normalize(qw_v3(s->normal[0], s->normal[1], s->normal[2]));
    curvature[0] = curvature[1] = 0;
    if (!(s->area > 0) || qw_length2(n) == 0) return n;
    qw_vec3 u = qw_any_orthogonal(n), v = qw_cross(n, u);
    double uu = product(s->tensor, u, u), uv = product(s->tensor, u, v), vv = product(s->tensor, v, v);
    double mean = 0.5 * (uu + vv), half = 0.5 * (uu - vv), spread = sqrt(half * half + uv * uv);
    curvature[0] = (mean + spread) / (double)s->area, curvature[1] = (mean - spread) / (double)s->area;
    return n;
}
