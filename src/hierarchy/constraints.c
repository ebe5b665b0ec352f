/* Feature constraints of the vertices: which lie on sharp edges and boundaries, and the direction of the curve
   there. */
#include "hierarchy/hierarchy.h"

#include "math/elementary.h"

#include <assert.h>
#include <string.h>

typedef struct curve_ends {
    uint32_t count;
    uint32_t other[2]; /* the first two neighbours along curves */
} curve_ends;

static void add_end(curve_ends *ends, uint32_t from, uint32_t to)
{
    if (ends[from].count < 2) ends[from].other[ends[from].count] = to;
    ends[from].count++;
}

/* The point at distance `length` from v along the curve, by way of its neighbour `next`; the end of the curve where
   it is shorter. */
static qw_vec3 point_along(const qw_trimesh *mesh, const curve_ends *ends, uint32_t v, uint32_t next, float length)
{
    assert(v < mesh->vertex_count && next < mesh->vertex_count);
    for (uint32_t from = v;;) {
        qw_vec3 a = mesh->position[from], b = mesh->position[next];
        float step = qw_distance(a, b);
        if (step >= length) return qw_madd(a, step > 0 ? length / step : 0, qw_sub(b, a));
        if (ends[next].count != 2 || next == v) return b;
        length -= step;
        uint32_t after = ends[next].other[ends[next].other[0] == from];
        from = next, next = after;
    }
}

void qw_find_constraints(qw_env *env, const qw_trimesh *mesh, bool with_boundary, double corner_angle,
                         const float *span, const uint8_t *cut, uint8_t **constraint, qw_vec3 **direction)
{
    assert(mesh->twin && corner_angle > 0 && constraint && direction);
    uint32_t n = mesh->vertex_count;
    *constraint = QW_NEW_ZERO(env, uint8_t, n);
    *direction = QW_NEW_ZERO(env, qw_vec3, n);
    curve_ends *ends = QW_NEW_ZERO(env, curve_ends, n);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!qw_is_curve_edge(mesh, h, with_boundary) || !qw_stands_for_edge(mesh, h)) continue;
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        add_end(ends, u, v);
        add_end(ends, v, u);
    }
    float least_cosine = (float)qw_cos(corner_angle);
    for (uint32_t v = 0; v < n; v++) {
        if (mesh->point && mesh->point[v]) (*constraint)[v] = QW_CONSTRAINT_CORNER;
        if (ends[v].count == 0) continue;
        qw_vec3 in = qw_normalize(qw_sub(mesh->position[v], mesh->position[ends[v].other[0]])), out = in;
        if (ends[v].count >= 2) out = qw_normalize(qw_sub(mesh->position[ends[v].other[1]], mesh->position[v]));
        bool smooth = ends[v].count == 2 && qw_dot(in, out) >= least_cosine;
        if (!smooth && span && ends[v].count == 2) {
            in = qw_normalize(qw_sub(mesh->position[v], point_along(mesh, ends, v, ends[v].other[0], span[v])));
            out = qw_normalize(qw_sub(point_along(mesh, ends, v, ends[v].other[1], span[v]), mesh->position[v]));
            smooth = qw_dot(in, out) >= least_cosine;
        }
        if (cut && ends[v].count == 2) smooth |= cut[v] && cut[ends[v].other[0]] && cut[ends[v].other[1]];
        (*constraint)[v] = smooth ? QW_CONSTRAINT_CURVE : QW_CONSTRAINT_CORNER;
        if (smooth) (*direction)[v] = qw_normalize(qw_add(in, out));
    }
    qw_free(env, ends);
    qw_open_sharp_corners(env, mesh, with_boundary, *constraint, *direction);
}
