/* Copies, counts and the check of offset meshes. */
#include "remesh/offsets/offset_mesh.h"

#include <assert.h>
#include <string.h>

#define COPY(field, count) memcpy(c.field = qw_alloc(env, count, sizeof *c.field), m->field, (count) * sizeof *c.field)
qw_offset_mesh qw_offset_copy(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->corner && m->rot && m->d && m->index);
    qw_offset_mesh c = *m;
    size_t n = m->vertex_count, corners = (size_t)3 * m->face_count, edges = m->edge_count;
    COPY(corner, corners), COPY(twin, corners), COPY(edge, corners), COPY(rot, corners), COPY(mark, corners);
    COPY(half, edges), COPY(d, edges), COPY(real, edges), COPY(fixed, edges), COPY(axis, edges), COPY(side, edges);
    COPY(position, n), COPY(normal, n), COPY(lattice, n), COPY(size, n), COPY(constraint, n), COPY(direction, n),
        COPY(index, n);
    return c;
}

qw_offset_mesh qw_offset_branch(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->d && m->real && m->constraint);
    qw_offset_mesh c = *m;
    COPY(d, m->edge_count), COPY(real, m->edge_count), COPY(fixed, m->edge_count);
    COPY(size, m->vertex_count), COPY(constraint, m->vertex_count), COPY(direction, m->vertex_count);
    return c;
}
#undef COPY

void qw_offset_axes(const qw_offset_mesh *m, uint32_t h, qw_vec3 *x, qw_vec3 *y)
{
    assert(h < 3 * m->face_count && m->edge[h] < m->edge_count);
    uint32_t e = m->edge[h];
    qw_vec3 ex = m->axis[e], ey = m->side[e];
    unsigned turns = m->half[e] == h ? m->rot[h] : m->rot[h] + 2u;
    /* coordinates turn by R2(turns) from edge to triangle, so the axes turn back */
    switch (turns & 3u) {
    case 0: *x = ex, *y = ey; break;
    case 1: *x = qw_scale(ey, -1.0f), *y = ex; break;
    case 2: *x = qw_scale(ex, -1.0f), *y = qw_scale(ey, -1.0f); break;
    default: *x = ey, *y = qw_scale(ex, -1.0f); break;
    }
}

qw_offset_counts qw_offset_count(const qw_offset_mesh *m)
{
    assert(m->d && m->rot && m->index);
    qw_offset_counts c = {0};
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        c.singular_vertices += m->index[v] != 0;
        c.index_sum += m->index[v];
    }
    for (uint32_t e = 0; e < m->edge_count; e++) c.long_edges += qw_int2_norm(m->d[e]) > 1;
    for (uint32_t f = 0; f < m->face_count; f++) {
        if (!qw_int2_is_zero(qw_offset_residual(m, f))) {
            c.irregular_triangles++;
            continue;
        }
        int32_t det = qw_offset_det(m, f);
        c.inverted_triangles += det < 0;
        c.double_area += det;
    }
    return c;
}

void qw_offset_validate(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->corner && m->twin && m->edge && m->half);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t t = m->twin[h], e = m->edge[h];
        if (m->corner[h] >= m->vertex_count || e >= m->edge_count || m->rot[h] > 3)
            qw_fail(env, QW_INTERNAL, h, "half-edge %u of the offset mesh is out of range", h);
        if (t != QW_NONE && (m->twin[t] != h || m->edge[t] != e || m->corner[t] != m->corner[qw_next(h)]))
            qw_fail(env, QW_INTERNAL, h, "half-edge %u of the offset mesh and its twin disagree", h);
    }
    for (uint32_t e = 0; e < m->edge_count; e++) {
        if (m->edge[m->half[e]] != e)
            qw_fail(env, QW_INTERNAL, e, "edge %u of the offset mesh has a half-edge of another", e);
        if ((m->fixed[e] & QW_FIXED_X && m->d[e].x) || (m->fixed[e] & QW_FIXED_Y && m->d[e].y))
            qw_fail(env, QW_INTERNAL, e, "edge %u of the offset mesh left its lattice line", e);
    }
}
