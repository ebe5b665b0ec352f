#include "remesh/sizes/scale.h"

#include "base/sort.h"
#include "solve/queue.h"

#include <assert.h>

static bool are_equal(const float *size, uint32_t count)
{
    for (uint32_t v = 1; v < count; v++)
        if (size[v] != size[0]) return false;
    return true;
}

/* By Dijkstra's algorithm from the small sizes outward. */
void qw_limit_gradation(qw_env *env, const qw_trimesh *mesh, float *size, float slope)
{
    assert(mesh->twin && slope >= 0);
    if (are_equal(size, mesh->vertex_count)) return;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count, *outgoing = qw_trimesh_outgoing(env, mesh);
    qw_queue q = qw_queue_create(env, n);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) { /* most often nothing is to be limited */
        if (mesh->twin[h] < h) continue;                  /* the edge was seen */
        uint32_t a = mesh->corner[h], b = mesh->corner[qw_next(h)], low = size[a] < size[b] ? a : b,
                 high = low == a ? b : a;
        float rise = size[high] - size[low], run2 = qw_length2(qw_sub(mesh->position[a], mesh->position[b]));
        if (rise * rise < 0.999f * (slope * slope) * run2) continue; /* clearly, as most often: without a root */
        if (size[high] <= size[low] + slope * sqrtf(run2)) continue;
        qw_queue_put(&q, low, qw_signed_float_key(size[low]));
    }
    for (uint32_t v; (v = qw_queue_take(&q)) != QW_NONE;) {
        uint32_t first = outgoing[v], h = first;
        do {
            uint32_t back = qw_prev(h), ends[2] = {mesh->corner[qw_next(h)], mesh->corner[back]};
            for (int i = 0; i < 2; i++) {
                float most = size[v] + slope * qw_distance(mesh->position[v], mesh->position[ends[i]]);
                if (size[ends[i]] <= most) continue;
                size[ends[i]] = most;
                qw_queue_put(&q, ends[i], qw_signed_float_key(most));
            }
            h = mesh->twin[back];
        } while (h != QW_NONE && h != first);
    }
    qw_scope_end(env);
}

float *qw_distances(qw_env *env, const qw_trimesh *mesh, const uint8_t *is_from, float farthest)
{
    assert(mesh->twin && is_from);
    float *distance = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) distance[v] = is_from[v] ? 0 : farthest;
    qw_limit_gradation(env, mesh, distance, 1);
    return distance;
}
