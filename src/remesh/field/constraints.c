/* Feature constraints of the vertices: which lie on sharp edges and boundaries, and the direction of the curve
   there. */
#include "remesh/field/hierarchy.h"

#include "base/mechanisms.h"
#include "base/elementary.h"
#include "geometry/corners.h"

#include <assert.h>

/* The point at distance `length` from v along the curve, by way of its neighbour `next`; the end of the curve where
   it is shorter. */
static qw_vec3 point_along(const qw_trimesh *mesh, const qw_curve_ends *ends, uint32_t v, uint32_t next, float length)
{
    assert(v < mesh->vertex_count && next < mesh->vertex_count);
    for (uint32_t from = v;;) {
        qw_vec3 a = mesh->position[from], b = mesh->position[next];
        float step = qw_distance(a, b);
        if (step >= length) return qw_madd(a, step > 0 ? length / step : 0, qw_sub(b, a));
        if (ends[next].count != 2 || next == v) return b;
        length -= step;
        uint32_t after = qw_curve_beyond(ends, from, next);
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
    qw_curve_ends *ends = qw_find_curve_ends(env, mesh, with_boundary);
    float least_cosine = (float)qw_cos(corner_angle);
    for (uint32_t v = 0; v < n; v++) {
        if (mesh->point && mesh->point[v]) (*constraint)[v] = QW_VERTEX_CORNER;
        if (ends[v].count == 0) continue;
        bool goes_through = ends[v].count == 2, smooth = !qw_is_curve_corner(mesh, ends, v, least_cosine);
        qw_vec3 at = mesh->position[v], before = mesh->position[ends[v].other[0]],
                after = goes_through ? mesh->position[ends[v].other[1]] : at;
        if (!smooth && span && goes_through) {
            before = point_along(mesh, ends, v, ends[v].other[0], span[v]);
            after = point_along(mesh, ends, v, ends[v].other[1], span[v]);
            smooth = !qw_turns_sharply(before, at, after, least_cosine);
        }
        if (cut && goes_through) smooth |= cut[v] && cut[ends[v].other[0]] && cut[ends[v].other[1]];
        (*constraint)[v] = smooth ? QW_VERTEX_CURVE : QW_VERTEX_CORNER;
        if (smooth)
            (*direction)[v] = qw_normalize(qw_add(qw_normalize(qw_sub(at, before)), qw_normalize(qw_sub(after, at))));
    }
    qw_free(env, ends);
    if (qw_uses(env, QW_MECH_OPEN_SECTORS)) qw_open_sharp_corners(env, mesh, with_boundary, *constraint, *direction);
}
