#include "products/limit/cage.h"

#include "products/limit/stencils.h"
#include "base/sort.h"
#include "geometry/polygons.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* ---- from a view */

static void require_quads(qw_env *env, const qw_mesh_view *cage)
{
    for (uint32_t f = 0; f < cage->face_count; f++)
        if ((cage->face_sizes ? cage->face_sizes[f] : cage->uniform_face_size) != 4)
            qw_fail(env, QW_ARGUMENT, f, "face %u is no quad: the limit surface is that of quads", f);
}

/* The first of the edges, which are sorted by their ends, that is not below the key. */
static uint32_t find_edge(const qw_quadmesh *q, const qw_polygon_edges *e, uint64_t key)
{
    uint32_t low = 0, high = e->edge_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2, h = e->sorted[e->edge_begin[middle]];
        if (qw_pair_key(q->corner[h], q->corner[qw_quad_next(h)]) < key) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Marks the edges and corners that the cage lists; fails where it has no such edge. */
static void take_marks(qw_env *env, const qw_mesh_view *cage, qw_quadmesh *q, const qw_polygon_edges *e)
{
    for (uint32_t m = 0; m < cage->marked_edge_count; m++) {
        uint32_t a = cage->marked_edges[2 * (size_t)m], b = cage->marked_edges[2 * (size_t)m + 1];
        if (a == b) {
            q->kind[a] = QW_VERTEX_CORNER;
            continue;
        }
        uint32_t i = find_edge(q, e, qw_pair_key(a, b)), h = i < e->edge_count ? e->sorted[e->edge_begin[i]] : QW_NONE;
        if (h == QW_NONE || qw_pair_key(q->corner[h], q->corner[qw_quad_next(h)]) != qw_pair_key(a, b))
            qw_fail(env, QW_ARGUMENT, m, "the marked edge %u from vertex %u to %u is no edge of the mesh", m, a, b);
        q->mark[h] = QW_MARK_FEATURE;
        if (q->twin[h] != QW_NONE) q->mark[q->twin[h]] = QW_MARK_FEATURE;
    }
}

qw_mesh_view qw_limit_of_cage(qw_env *env, const qw_mesh_view *cage, uint32_t times)
{
    require_quads(env, cage);
    qw_polygon_edges e = qw_find_polygon_edges(env, cage);
    qw_quadmesh q = {.vertex_count = cage->vertex_count, .face_count = cage->face_count};
    q.corner = QW_NEW(env, uint32_t, 4 * (size_t)q.face_count);
    q.kind = QW_NEW_ZERO(env, uint8_t, q.vertex_count), q.mark = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)q.face_count);
    memcpy(q.corner, cage->corners, 4 * (size_t)q.face_count * sizeof *q.corner);
    uint32_t fault;
    q.twin = qw_polygon_twins(env, cage, &e, &fault);
    if (fault != QW_NONE)
        qw_fail(env, QW_ARGUMENT, fault / 4,
                "face %u has an edge of more than two faces, or of two that are turned unlike", fault / 4);
    take_marks(env, cage, &q, &e);
    double *position = QW_NEW(env, double, 3 * (size_t)q.vertex_count);
    memcpy(position, cage->positions, 3 * (size_t)q.vertex_count * sizeof *position);
    for (uint32_t k = 0; k <= times; k++) {
        qw_stencils rows = k < times ? qw_split_stencils(env, &q) : qw_limit_stencils(env, &q);
        assert(rows.column_count == q.vertex_count);
        double *next = QW_NEW(env, double, 3 * (size_t)rows.row_count);
        qw_stencils_apply(env, &rows, position, next);
        qw_free(env, position);
        position = next;
        if (k < times) q = qw_split_quads(env, &q);
    }
    uint32_t crease_count, *creases = qw_list_creases(env, &q, &crease_count);
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .marked_edges = creases,
                          .marked_edge_count = crease_count,
                          .vertex_count = q.vertex_count,
                          .face_count = q.face_count,
                          .uniform_face_size = 4,
                          .positions = position,
                          .corners = q.corner};
}

/* ---- to a view */

uint32_t *qw_list_creases(qw_env *env, const qw_quadmesh *q, uint32_t *count)
{
    *count = 0;
    uint32_t most = 0;
    uint8_t *rule = qw_find_rules(env, q, NULL);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) most += q->mark && q->mark[h] && q->twin[h] != QW_NONE;
    for (uint32_t v = 0; v < q->vertex_count; v++) most += 2 * (rule[v] == QW_RULE_CORNER);
    uint32_t *list = most ? QW_NEW(env, uint32_t, 2 * (size_t)most) : NULL, at = 0;
    for (uint32_t h = 0; q->mark && h < 4 * q->face_count; h++)
        if (q->mark[h] && q->twin[h] != QW_NONE && h < q->twin[h])
            list[2 * at] = q->corner[h], list[2 * at++ + 1] = q->corner[qw_quad_next(h)];
    for (uint32_t v = 0; v < q->vertex_count; v++)
        if (rule[v] == QW_RULE_CORNER) list[2 * at] = list[2 * at + 1] = v, at++;
    assert(at <= most);
    *count = at;
    qw_free(env, rule);
    return list;
}
