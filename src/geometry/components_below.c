#include "geometry/components_below.h"

uint32_t *qw_components_below(qw_env *env, const qw_quadmesh *q, uint32_t reflected, const qw_trimesh *surface,
                              const qw_bvh *tree)
{
    uint32_t sides = 4 * q->face_count;
    uint32_t *component = QW_NEW_ZERO(env, uint32_t, q->vertex_count);
    if (!surface->component) return component;
    qw_scope_begin(env);
    uint32_t *twin = QW_NEW(env, uint32_t, sides), *part = QW_NEW(env, uint32_t, q->face_count), hint = QW_NONE;
    for (uint32_t h = 0; h < sides; h++) {
        bool is_across = q->twin[h] != QW_NONE && (h < 4 * reflected) != (q->twin[h] < 4 * reflected);
        twin[h] = is_across ? QW_NONE : q->twin[h];
    }
    uint32_t parts = qw_label_components(env, 4, twin, q->face_count, part);
    uint32_t *leader = QW_NEW_ZERO(env, uint32_t, parts);
    int64_t *lead = QW_NEW_ZERO(env, int64_t, parts); /* majority vote of Boyer and Moore */
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *corner = q->corner + 4 * (size_t)f;
        qw_vec3 normal = qw_quad_normal(q, f);
        qw_heartbeat(env);
        qw_hit hit = qw_bvh_nearest(tree, qw_quad_middle(q->position, corner), normal, QW_SAME_SHEET, 1, hint);
        if (hit.face == QW_NONE) continue;
        hint = hit.face;
        uint32_t c = surface->component[hit.face], p = part[f];
        if (lead[p] == 0) leader[p] = c;
        lead[p] += leader[p] == c ? 1 : -1;
    }
    for (uint32_t h = 0; h < sides; h++) component[q->corner[h]] = leader[part[h / 4]];
    qw_scope_end(env);
    return component;
}
