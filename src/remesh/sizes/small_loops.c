#include "remesh/sizes/small_loops.h"

#include "base/sets.h"
#include "remesh/sizes/scale.h"
#include "geometry/corners.h"

#include <assert.h>

/* Four edges keep a hole open. Six leave the curve round when the working mesh, about as fine or finer, follows it, so
   that crosses turn with it. Circles at distance d around a loop of four edges of length s are 2 pi d longer: sizes
   grow by 2 pi / 4 a unit if four edges stay four. More quads get room farther out, so growth by less is right. */
static const float LOOP_EDGES = 6, LOOP_GRADATION = 1.0f;

static bool is_curve(const qw_trimesh *mesh, uint32_t h, bool with_boundary)
{
    return qw_is_curve_edge(mesh, h, with_boundary) && qw_stands_for_edge(mesh, h);
}

static bool has_curves(const qw_trimesh *mesh, bool with_boundary)
{
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (is_curve(mesh, h, with_boundary)) return true;
    return false;
}

int64_t qw_fit_loops(qw_env *env, const qw_trimesh *mesh, bool with_boundary, float *size)
{
    assert(mesh->twin && size);
    if (!has_curves(mesh, with_boundary)) return 0;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count, sides = 3 * mesh->face_count;
    uint32_t *chain = QW_NEW(env, uint32_t, n);
    const qw_curve_ends *ends = qw_find_curve_ends(env, mesh, with_boundary);
    float *length = QW_NEW_ZERO(env, float, n); /* of each chain, at its root */
    int64_t count = 0;
    qw_sets_begin(chain, n);
    for (uint32_t h = 0; h < sides; h++) {
        if (is_curve(mesh, h, with_boundary)) qw_join_sets(chain, mesh->corner[h], mesh->corner[qw_next(h)]);
    }
    for (uint32_t h = 0; h < sides; h++)
        if (is_curve(mesh, h, with_boundary))
            length[qw_set_of(chain, mesh->corner[h])] += qw_distance(mesh->position[mesh->corner[h]],
                                                                     mesh->position[mesh->corner[qw_next(h)]]);
    for (uint32_t v = 0; v < n; v++)
        if (qw_curves_end_at(&ends[v])) length[qw_set_of(chain, v)] = INFINITY; /* a curve that ends or meets others */
    for (uint32_t v = 0; v < n; v++) {
        float most = length[qw_set_of(chain, v)] / LOOP_EDGES;
        if (ends[v].count != 2 || !(most > 0 && most < size[v])) continue;
        count += chain[v] == v;
        size[v] = most;
    }
    if (count > 0) qw_limit_gradation(env, mesh, size, LOOP_GRADATION);
    qw_scope_end(env);
    return count;
}
