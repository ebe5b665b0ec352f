#include "geometry/weld.h"

#include "base/elementary.h"
#include "base/hash.h"
#include "base/sets.h"
#include "geometry/edges.h"

#include <assert.h>
#include <math.h>
#include <string.h>

uint32_t qw_weld_equal(qw_env *env, const double *position, uint32_t vertex_count, const uint8_t *only,
                       uint32_t *corner, uint32_t face_count)
{
    assert(position && corner);
    uint32_t welded = 0;
    qw_scope_begin(env);
    const uint32_t *target = qw_find_places(env, position, vertex_count, only);
    for (uint32_t v = 0; v < vertex_count; v++) welded += target[v] != v;
    for (size_t h = 0; welded && h < 3 * (size_t)face_count; h++) corner[h] = target[corner[h]];
    qw_scope_end(env);
    return welded;
}

/* ---- near weld */

/* Boundary vertices in a grid, as chains of the vertices in one cell. Cells are several tolerances wide, so that the
   box of one tolerance around a point mostly touches one cell. */
typedef struct grid {
    qw_hash_table heads; /* one vertex of each cell */
    uint32_t *chain;     /* uint32_t[vertex_count]: another vertex of the same cell, or QW_NONE */
    const double *position;
    double cell, tolerance;
} grid;

static void cell_of(const grid *g, const double *p, double shift, int64_t *cell)
{
    for (int k = 0; k < 3; k++) cell[k] = (int64_t)qw_floor((p[k] + shift) / g->cell);
}

typedef struct wanted_cell {
    const grid *g;
    const int64_t *cell;
} wanted_cell;

static bool is_in_cell(const void *wanted, uint32_t v)
{
    const wanted_cell *w = wanted;
    int64_t own[3];
    cell_of(w->g, w->g->position + 3 * (size_t)v, 0, own);
    return memcmp(own, w->cell, sizeof own) == 0;
}

static uint32_t *head_of(const grid *g, const int64_t *cell)
{
    uint64_t h = qw_mix(qw_mix(qw_mix((uint64_t)cell[0]) ^ (uint64_t)cell[1]) ^ (uint64_t)cell[2]);
    return qw_hash_slot(&g->heads, h, is_in_cell, &(wanted_cell){g, cell});
}

/* Looks at the latest few of the cell only. There are more where the whole model is small against its bounding box,
   because a single face lies far away; there is nothing to be joined by this tolerance then. */
static uint32_t join_with_cell(grid *g, const int64_t *cell, uint32_t v, uint32_t *parent)
{
    enum { LATEST = 64 };
    const double *p = g->position + 3 * (size_t)v;
    uint32_t joined = 0, w = *head_of(g, cell);
    for (int i = 0; w != QW_NONE && i < LATEST; i++, w = g->chain[w]) {
        const double *q = g->position + 3 * (size_t)w;
        double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
        if (x * x + y * y + z * z > g->tolerance * g->tolerance) continue;
        joined += qw_join_sets(parent, v, w);
    }
    return joined;
}

/* Adds v to the grid and joins it with those already there. */
static uint32_t join_neighbours(grid *g, uint32_t v, uint32_t *parent)
{
    assert(v != QW_NONE && g->tolerance >= 0);
    const double *p = g->position + 3 * (size_t)v;
    int64_t low[3], high[3], own[3], c[3];
    uint32_t joined = 0;
    cell_of(g, p, -g->tolerance, low);
    cell_of(g, p, g->tolerance, high);
    cell_of(g, p, 0, own);
    for (c[0] = low[0]; c[0] <= high[0]; c[0]++)
        for (c[1] = low[1]; c[1] <= high[1]; c[1]++)
            for (c[2] = low[2]; c[2] <= high[2]; c[2]++) joined += join_with_cell(g, c, v, parent);
    uint32_t *head = head_of(g, own);
    g->chain[v] = *head;
    *head = v;
    return joined;
}

/* Marks vertices on edges with one side, in open (may be NULL); returns the number of such edges. */
static uint64_t find_boundary(const qw_edges *edges, uint32_t vertex_count, uint8_t *open)
{
    uint64_t count = 0;
    for (uint32_t v = 0; v < vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i > 1) continue;
            count++;
            if (open) open[v] = open[qw_side_upper(edges->side[i])] = 1;
        }
    return count;
}

/* Joins close boundary vertices; returns the number of joins and the number of boundary edges before. */
static uint32_t group_boundary(qw_env *env, const double *position, uint32_t vertex_count, double tolerance,
                               const uint8_t *only, const qw_edges *edges, uint32_t *parent, uint64_t *boundary)
{
    assert(tolerance >= 0);
    uint8_t *open = QW_NEW_ZERO(env, uint8_t, vertex_count);
    uint32_t count = 0, joined = 0;
    *boundary = find_boundary(edges, vertex_count, open);
    for (uint32_t v = 0; v < vertex_count; v++) open[v] &= !only || only[v], count += open[v];
    if (count == 0) return 0;
    grid g = {
        .heads = qw_hash_table_create(env, count), .chain = QW_NEW(env, uint32_t, vertex_count), .position = position};
    g.tolerance = tolerance;
    g.cell = 8 * tolerance;
    for (uint32_t v = 0; v < vertex_count; v++)
        if (open[v]) joined += join_neighbours(&g, v, parent);
    return joined;
}

/* Dissolves the groups whose roots are marked and clears the marks. */
static void dissolve(uint32_t *parent, uint32_t vertex_count, uint8_t *bad)
{
    for (uint32_t v = 0; v < vertex_count; v++) parent[v] = qw_set_of(parent, v);
    for (uint32_t v = vertex_count; v-- > 0;)
        if (bad[parent[v]]) parent[v] = v; /* roots are lowest, so they are met last */
    memset(bad, 0, vertex_count);
}

static void mark_collapsing(const uint32_t *corner, uint32_t face_count, uint32_t *parent, uint8_t *bad)
{
    for (uint32_t f = 0; f < face_count; f++) {
        const uint32_t *c = corner + 3 * (size_t)f;
        for (int i = 0; i < 3; i++) {
            uint32_t a = qw_set_of(parent, c[i]);
            if (a == qw_set_of(parent, c[(i + 1) % 3])) bad[a] = 1;
        }
    }
}

/* Marks the ends of edges with more than two sides, as far as they are groups; returns whether there are any. */
static bool mark_nonmanifold(const qw_edges *edges, uint32_t vertex_count, const uint8_t *grouped, uint8_t *bad)
{
    bool any = false;
    for (uint32_t v = 0; v < vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            uint32_t w = qw_side_upper(edges->side[i]);
            if (end - i <= 2 || (!grouped[v] && !grouped[w])) continue;
            bad[v] = bad[w] = 1;
            any = true;
        }
    return any;
}

/* Renames corners to their groups and dissolves groups at edges with more than two sides, until none is left. Returns
   the number of boundary edges then, or UINT64_MAX where there is no end to it. */
static uint64_t settle_groups(qw_env *env, uint32_t vertex_count, const uint32_t *corner, uint32_t face_count,
                              uint32_t *parent, uint8_t *bad, uint32_t *renamed)
{
    assert(renamed && bad);
    enum { ROUNDS = 8 };
    uint8_t *grouped = QW_NEW(env, uint8_t, vertex_count);
    for (int round = 0; round < ROUNDS; round++) {
        dissolve(parent, vertex_count, bad);
        memset(grouped, 0, vertex_count);
        for (uint32_t v = 0; v < vertex_count; v++)
            if (parent[v] != v) grouped[parent[v]] = 1;
        for (size_t h = 0; h < 3 * (size_t)face_count; h++) renamed[h] = parent[corner[h]];
        qw_edges edges = qw_edges_build(env, 3, renamed, face_count, vertex_count);
        bool nonmanifold = mark_nonmanifold(&edges, vertex_count, grouped, bad);
        uint64_t boundary = find_boundary(&edges, vertex_count, NULL);
        qw_edges_free(env, &edges);
        if (!nonmanifold) return boundary;
    }
    return UINT64_MAX;
}

uint32_t qw_weld_near(qw_env *env, const double *position, uint32_t vertex_count, double tolerance, const uint8_t *only,
                      const qw_edges *edges, uint32_t *corner, uint32_t face_count)
{
    assert(tolerance >= 0 && edges);
    qw_scope_begin(env);
    uint32_t *parent = QW_NEW(env, uint32_t, vertex_count), welded = 0;
    qw_sets_begin(parent, vertex_count);
    uint64_t before;
    uint32_t joined = group_boundary(env, position, vertex_count, tolerance, only, edges, parent, &before);
    if (joined > 0) {
        uint8_t *bad = QW_NEW_ZERO(env, uint8_t, vertex_count);
        uint32_t *renamed = QW_NEW(env, uint32_t, 3 * (size_t)face_count);
        mark_collapsing(corner, face_count, parent, bad);
        if (settle_groups(env, vertex_count, corner, face_count, parent, bad, renamed) < before) {
            memcpy(corner, renamed, 3 * (size_t)face_count * sizeof *corner);
            for (uint32_t v = 0; v < vertex_count; v++) welded += parent[v] != v;
        }
    }
    qw_scope_end(env);
    return welded;
}
