#include "geometry/corners.h"

#include <assert.h>

static void add_end(qw_curve_ends *at, uint32_t other, bool is_ring)
{
    at->is_ring = is_ring && (at->is_ring || at->count == 0);
    if (at->count < 2) at->other[at->count] = other;
    at->count++;
}

qw_curve_ends *qw_find_curve_ends(qw_env *env, const qw_trimesh *mesh, bool with_boundary)
{
    assert(mesh->twin && mesh->corner);
    qw_curve_ends *ends = QW_NEW_ZERO(env, qw_curve_ends, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!qw_is_curve_edge(mesh, h, with_boundary) || !qw_stands_for_edge(mesh, h)) continue;
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        bool is_ring = mesh->mark && (mesh->mark[h] & QW_MARK_RING);
        add_end(&ends[u], v, is_ring);
        add_end(&ends[v], u, is_ring);
    }
    return ends;
}

bool qw_turns_sharply(qw_vec3 a, qw_vec3 v, qw_vec3 b, float least_cosine)
{
    return qw_dot(qw_normalize(qw_sub(v, a)), qw_normalize(qw_sub(b, v))) < least_cosine;
}

bool qw_is_curve_corner(const qw_trimesh *mesh, const qw_curve_ends *ends, uint32_t v, float least_cosine)
{
    assert(v < mesh->vertex_count && least_cosine >= -1 && least_cosine <= 1);
    if (ends[v].count != 2) return ends[v].count != 0;
    if (ends[v].is_ring) return false;
    return qw_turns_sharply(mesh->position[ends[v].other[0]], mesh->position[v], mesh->position[ends[v].other[1]],
                            least_cosine);
}
