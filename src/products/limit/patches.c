#include "products/limit/patches.h"

#include "products/limit/cavities.h"
#include "products/limit/stencils.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Beside the diagonal of the box: coordinates are rounded to 1e-9 of it. */
static const double TOLERANCE = 1e-7;

typedef struct patching {
    qw_env *env;
    const qw_quadmesh *quads;
    const double *position;
    const uint8_t *rule;
    uint32_t *faces_around; /* uint32_t[vertices]: quads between two sharp edges, or all */
    uint32_t *edge_of;      /* uint32_t[half-edges] */
    double *point;          /* vertices, then two for each edge, then four for each quad */
    uint32_t edges;
} patching;

static double *inner_point(const patching *t, uint32_t h)
{
    return t->point + 3 * ((size_t)t->quads->vertex_count + 2 * (size_t)t->edges + h);
}

static void add(double sum[3], const patching *t, uint32_t v, double weight)
{
    for (int k = 0; k < 3; k++) sum[k] += weight * t->position[3 * (size_t)v + (size_t)k];
}

/* The number of quads in the sector of quad corner h, between sharp edges. */
static uint32_t sector_size(const qw_quadmesh *q, uint32_t h)
{
    uint32_t count = 1, at = h;
    while (!qw_is_sharp_side(q, qw_quad_prev(at)) && (at = qw_quad_around(q, at)) != h) count++;
    if (at == h && count > 1) return count;
    for (at = h; !qw_is_sharp_side(q, at); count++) at = qw_quad_next(q->twin[at]);
    return count;
}

/* The point inside the patch next to the corner at the tail of h. On a crease two quads are as four around a vertex, at
   a corner one is. */
static void place_inner(const patching *t, uint32_t h)
{
    assert(h < 4 * t->quads->face_count);
    const qw_quadmesh *q = t->quads;
    uint32_t v = q->corner[h], size = sector_size(q, h);
    double n = t->rule[v] == QW_RULE_SMOOTH   ? size
               : t->rule[v] == QW_RULE_CREASE ? 2.0 * size
               : size > 2                     ? 2.0 * size
                                              : 4;
    double sum[3] = {0, 0, 0};
    if (n < 3) n = 3;
    add(sum, t, v, n / (n + 5)), add(sum, t, q->corner[qw_quad_next(h)], 2 / (n + 5));
    add(sum, t, q->corner[qw_quad_prev(h)], 2 / (n + 5)), add(sum, t, q->corner[qw_quad_across(h)], 1 / (n + 5));
    memcpy(inner_point(t, h), sum, sizeof sum);
}

/* The point on the edge of h next to its tail; h stands for its edge, or its twin does. */
static void place_on_edge(const patching *t, uint32_t h, double *out)
{
    assert(h < 4 * t->quads->face_count);
    const qw_quadmesh *q = t->quads;
    double sum[3] = {0, 0, 0};
    if (qw_is_sharp_side(q, h)) {
        add(sum, t, q->corner[h], 2.0 / 3), add(sum, t, q->corner[qw_quad_next(h)], 1.0 / 3);
    } else {
        const double *a = inner_point(t, h), *b = inner_point(t, qw_quad_next(q->twin[h]));
        for (int k = 0; k < 3; k++) sum[k] = 0.5 * (a[k] + b[k]);
    }
    memcpy(out, sum, sizeof sum);
}

static uint32_t edge_point(const patching *t, uint32_t h, bool at_tail)
{
    bool is_along = t->quads->twin[h] == QW_NONE || h < t->quads->twin[h];
    return t->quads->vertex_count + 2 * t->edge_of[h] + (is_along != at_tail);
}

/* The head's point on a boundary edge: 2/3 of the head. */
static void place_edges(const patching *t)
{
    const qw_quadmesh *q = t->quads;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        place_on_edge(t, h, t->point + 3 * (size_t)edge_point(t, h, true));
        if (q->twin[h] != QW_NONE) continue;
        double sum[3] = {0, 0, 0};
        add(sum, t, q->corner[h], 1.0 / 3), add(sum, t, q->corner[qw_quad_next(h)], 2.0 / 3);
        memcpy(t->point + 3 * (size_t)edge_point(t, h, false), sum, sizeof sum);
    }
}

static void number_edges(patching *t)
{
    const qw_quadmesh *q = t->quads;
    t->edge_of = QW_NEW(t->env, uint32_t, 4 * (size_t)q->face_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        bool stands = q->twin[h] == QW_NONE || h < q->twin[h];
        t->edge_of[h] = stands ? t->edges++ : t->edge_of[q->twin[h]];
    }
}

/* The sixteen control points of quad f, and its four edges with whether it runs along them. */
static void fill_face(const patching *t, uint32_t f, uint32_t grid[16], uint32_t side[4], uint8_t is_along[4])
{
    assert(f < t->quads->face_count);
    const qw_quadmesh *q = t->quads;
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t h = 4 * f + i, before = qw_quad_prev(h);
        uint32_t *at = grid + QW_PATCH_CORNER[i];
        at[0] = q->corner[h];
        at[QW_PATCH_AHEAD[i]] = edge_point(t, h, true);
        at[QW_PATCH_UP[i]] = edge_point(t, before, false);
        at[QW_PATCH_AHEAD[i] + QW_PATCH_UP[i]] = q->vertex_count + 2 * t->edges + h;
        side[i] = t->edge_of[h], is_along[i] = q->twin[h] == QW_NONE || h < q->twin[h];
    }
}

/* The diagonal of the box, by halves of its longest side: squares of lengths may overflow. */
static double extent_of(const patching *t)
{
    double low[3] = {0}, high[3] = {0}, most = 0, sum = 0;
    for (uint32_t v = 0; v < t->quads->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            double x = t->position[3 * (size_t)v + (size_t)k];
            low[k] = v ? fmin(low[k], x) : x, high[k] = v ? fmax(high[k], x) : x;
        }
    for (int k = 0; k < 3; k++) most = fmax(most, high[k] / 2 - low[k] / 2);
    for (int k = 0; k < 3 && most > 0; k++) {
        double side = (high[k] / 2 - low[k] / 2) / most;
        sum += side * side;
    }
    return 2 * (most * sqrt(sum));
}

qw_patches qw_make_patches(qw_env *env, const qw_quadmesh *q, const double *position)
{
    patching t = {.env = env, .quads = q, .position = position, .rule = qw_find_rules(env, q, NULL)};
    number_edges(&t);
    size_t points = (size_t)q->vertex_count + 2 * (size_t)t.edges + 4 * (size_t)q->face_count;
    assert(t.edges >= 2 * q->face_count && t.edges <= 4 * q->face_count);
    t.point = QW_NEW_ZERO(env, double, 3 * points);
    qw_stencils limit = qw_limit_stencils(env, q);
    qw_stencils_apply(env, &limit, position, t.point);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) place_inner(&t, h);
    place_edges(&t);
    uint32_t(*edge)[4] = qw_alloc(env, t.edges, sizeof *edge), (*face)[16] = qw_alloc(env, q->face_count, sizeof *face),
    (*side)[4] = qw_alloc(env, q->face_count, sizeof *side), *shell = QW_NEW(env, uint32_t, q->face_count);
    uint8_t(*along)[4] = qw_alloc(env, q->face_count, sizeof *along);
    for (uint32_t f = 0; f < q->face_count; f++) fill_face(&t, f, face[f], side[f], along[f]);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (q->twin[h] != QW_NONE && h > q->twin[h]) continue;
        const uint32_t of[4] = {q->corner[h], edge_point(&t, h, true), edge_point(&t, h, false),
                                q->corner[qw_quad_next(h)]};
        memcpy(edge[t.edge_of[h]], of, sizeof of);
    }
    uint32_t shells = qw_label_components(env, 4, q->twin, q->face_count, shell);
    uint8_t *closed = QW_NEW(env, uint8_t, shells);
    memset(closed, 1, shells);
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (q->twin[h] == QW_NONE) closed[shell[h / 4]] = 0;
    return (qw_patches){.point_count = (uint32_t)points,
                        .vertex_count = q->vertex_count,
                        .edge_count = t.edges,
                        .face_count = q->face_count,
                        .shell_count = shells,
                        .point = t.point,
                        .edge = (const uint32_t(*)[4])edge,
                        .face = (const uint32_t(*)[16])face,
                        .side = (const uint32_t(*)[4])side,
                        .is_along = (const uint8_t(*)[4])along,
                        .shell = shell,
                        .is_closed = closed,
                        .outer = qw_find_cavities(env, q, t.point, shell, shells, closed),
                        .tolerance = TOLERANCE * extent_of(&t)};
}
