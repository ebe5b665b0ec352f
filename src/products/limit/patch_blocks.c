#include "products/limit/patch_blocks.h"

#include "base/sets.h"
#include "products/limit/patches.h"
#include "products/limit/stencils.h"

#include <assert.h>
#include <math.h>
#include <string.h>

typedef struct joining {
    qw_env *env;
    const qw_quadmesh *quads;
    const qw_patches *patches;
    uint8_t *special; /* uint8_t[vertices] */
    uint8_t *line;    /* uint8_t[half-edges] */
    uint32_t *block;  /* uint32_t[faces], sets */
    uint32_t *edge;   /* uint32_t[half-edges]: the long edge that each is part of, or QW_NONE */
    uint32_t *way;    /* uint32_t[half-edges]: of one side */
    uint32_t cuts;    /* vertices that were made special */
    qw_patch_blocks *out;
} joining;

/* The half-edge that goes straight on from the head of h, which is no boundary. */
static uint32_t straight_on(const qw_quadmesh *q, uint32_t h)
{
    uint32_t side = q->twin[qw_quad_next(h)];
    return side == QW_NONE ? QW_NONE : qw_quad_next(side);
}

/* Marks the vertices at which blocks have corners: irregular ones, and those where sharp edges end or turn. */
static void find_special(joining *j)
{
    const qw_quadmesh *q = j->quads;
    const uint8_t *rule = qw_find_rules(j->env, q, NULL);
    const uint32_t *outgoing = qw_quadmesh_outgoing(j->env, q);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        bool is_open, sharp[4] = {0};
        uint32_t valence = outgoing[v] == QW_NONE ? 0 : qw_quad_valence(q, outgoing[v], &is_open), h = outgoing[v];
        if (valence == 0) continue;
        bool is_regular = rule[v] != QW_RULE_CORNER && valence == (is_open ? 3 : 4);
        uint32_t count = 0;
        for (uint32_t i = 0; is_regular && i < 4 && h != QW_NONE; i++, h = qw_quad_around(q, h))
            count += sharp[i] = qw_is_sharp_side(q, h);
        if (is_open) is_regular &= count <= 1; /* the other end of the boundary is no outgoing half-edge */
        else is_regular &= count == 0 || (count == 2 && sharp[0] == sharp[2]);
        j->special[v] = !is_regular;
    }
}

static void mark(const joining *j, uint32_t h)
{
    j->line[h] = 1;
    if (j->quads->twin[h] != QW_NONE) j->line[j->quads->twin[h]] = 1;
}

/* Marks sharp sides and the lines that leave special vertices; quads with no line between them are one block. */
static void trace_lines(joining *j)
{
    const qw_quadmesh *q = j->quads;
    uint32_t sides = 4 * q->face_count;
    for (uint32_t h = 0; h < sides; h++) j->line[h] = qw_is_sharp_side(q, h);
    for (uint32_t h = 0; h < sides; h++)
        for (uint32_t at = j->special[q->corner[h]] ? h : QW_NONE; at != QW_NONE;) {
            mark(j, at);
            at = j->special[q->corner[qw_quad_next(at)]] ? QW_NONE : straight_on(q, at);
        }
    qw_sets_begin(j->block, q->face_count);
    for (uint32_t h = 0; h < sides; h++)
        if (!j->line[h]) qw_join_sets(j->block, h / 4, q->twin[h] / 4);
}

/* ---- grids */

typedef struct grid {
    uint32_t first; /* half-edge at its corner, along its first side */
    uint32_t size[2];
} grid;

static uint32_t count_ahead(const joining *j, uint32_t h, uint32_t most)
{
    uint32_t count = 1;
    while (!j->line[qw_quad_next(h)] && count <= most) h = straight_on(j->quads, h), count++;
    return count;
}

/* The half-edge above h, in its direction, or QW_NONE at the end. */
static uint32_t above(const joining *j, uint32_t h)
{
    uint32_t across = qw_quad_across(h);
    return j->line[across] ? QW_NONE : j->quads->twin[across];
}

static bool find_grid(const joining *j, uint32_t h, uint32_t faces, grid *g)
{
    *g = (grid){h, {count_ahead(j, h, faces), 0}};
    for (uint32_t at = h; at != QW_NONE && g->size[1] <= faces; at = above(j, at), g->size[1]++)
        if (count_ahead(j, at, faces) != g->size[0] || !j->line[qw_quad_prev(at)]) return false;
    return (uint64_t)g->size[0] * g->size[1] == faces;
}

/* Cuts what lies along j->way into two to eight pieces: readers project the edges of a face onto it, and on one that
   winds far around there may be two places for them. */
static void cut_way(joining *j, uint32_t length)
{
    uint32_t pieces = length < 24 ? 2 : length < 64 ? length / 8 : 8;
    for (uint32_t k = 0; k < length; k++) {
        uint8_t *special = &j->special[j->quads->corner[j->way[k]]];
        if (k * pieces % length >= pieces || *special) continue;
        *special = 1, j->cuts++;
    }
}

/* A ring without a corner is cut at vertices of its border; what has no border, at any, both ways. */
static void cut_ring(joining *j, uint32_t h, uint32_t faces)
{
    assert(h < 4 * j->quads->face_count);
    uint32_t length = 0, at = h;
    do j->way[length++] = at, at = straight_on(j->quads, at);
    while (at != h && at != QW_NONE && length <= faces);
    cut_way(j, length);
}

/* All blocks as grids: their number; 0 where one had to be cut, one in each shell, as lines from there may cut the
   others; QW_NONE where one is no grid. */
static uint32_t find_grids(joining *j, grid *grids)
{
    const qw_quadmesh *q = j->quads;
    uint32_t n = q->face_count, count = 0, *faces = QW_NEW_ZERO(j->env, uint32_t, n),
             *begin = QW_NEW(j->env, uint32_t, n), *border = QW_NEW(j->env, uint32_t, n);
    memset(begin, 0xff, n * sizeof *begin), memset(border, 0xff, n * sizeof *border);
    for (uint32_t h = 4 * n; h-- > 0;) {
        uint32_t b = qw_set_of(j->block, h / 4);
        faces[b] += h % 4 == 0;
        if (j->line[h]) border[b] = h;
        if (j->line[h] && j->line[qw_quad_prev(h)]) begin[b] = h;
    }
    uint8_t *is_cut = QW_NEW_ZERO(j->env, uint8_t, j->patches->shell_count);
    bool any_cut = false;
    for (uint32_t b = 0; b < n; b++) {
        if (faces[b] == 0) continue;
        if (begin[b] == QW_NONE) {
            if (!is_cut[j->patches->shell[b]]) cut_ring(j, border[b] == QW_NONE ? 4 * b : border[b], faces[b]);
            if (border[b] == QW_NONE) cut_ring(j, q->twin[4 * b + 3], faces[b]);
            is_cut[j->patches->shell[b]] = any_cut = true;
        } else if (!find_grid(j, begin[b], faces[b], &grids[count++])) return QW_NONE;
    }
    qw_free(j->env, faces), qw_free(j->env, begin), qw_free(j->env, border), qw_free(j->env, is_cut);
    return any_cut ? 0 : count;
}

/* ---- what is written */

/* Half-edges of side k of a grid, in order around, into j->way: their number. */
static uint32_t list_side(const joining *j, const grid *g, int k)
{
    uint32_t h = g->first, length = g->size[k & 1];
    for (int turn = 0; turn < k; turn++) { /* to the next corner, and on along the next side */
        for (uint32_t i = 1; i < g->size[turn & 1]; i++) h = straight_on(j->quads, h);
        h = qw_quad_next(h);
    }
    for (uint32_t i = 0; i < length; i++) {
        j->way[i] = h;
        if (i + 1 < length) h = straight_on(j->quads, h);
    }
    return length;
}

/* The points of a chain of `count` cubics that are its B-spline's, the ends of cubics inside it being the middles of
   those beside them: point i of these is at this number of third parts. */
static uint32_t third_of(uint32_t i, uint32_t count)
{
    return i == 0 ? 0 : i == 2 * count + 1 ? 3 * count : i + (i - 1) / 2;
}

static uint32_t point_on(const joining *j, uint32_t h, uint32_t i)
{
    const qw_patches *p = j->patches;
    return p->face[h / 4][QW_PATCH_CORNER[h % 4] + (int)i * QW_PATCH_AHEAD[h % 4]];
}

/* Adds the edge along the first `count` half-edges of j->way: its control points, and its number at these. */
static void add_edge(joining *j, uint32_t count)
{
    qw_patch_blocks *o = j->out;
    const uint32_t *begin = o->edge_first;
    assert(count > 0);
    uint32_t at = begin[o->edge_count];
    for (uint32_t i = 0; i < 2 * count + 2; i++) {
        uint32_t third = third_of(i, count), k = third / 3 < count ? third / 3 : count - 1;
        o->edge_point[at++] = point_on(j, j->way[k], third - 3 * k);
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t twin = j->quads->twin[j->way[i]];
        j->edge[j->way[i]] = o->edge_count;
        if (twin != QW_NONE) j->edge[twin] = o->edge_count;
    }
    o->edge_first[++o->edge_count] = at;
}

/* False where two sides of the block are one edge: it is cut between them. */
static bool add_sides(joining *j, const grid *g, uint32_t b)
{
    qw_patch_blocks *o = j->out;
    for (int k = 0; k < 4; k++) {
        uint32_t count = list_side(j, g, k), first = j->way[0];
        o->is_along[b][k] = j->edge[first] == QW_NONE;
        if (j->edge[first] == QW_NONE) add_edge(j, count);
        o->side[b][k] = j->edge[first];
        for (int i = 0; i < k; i++) {
            if (o->side[b][i] != o->side[b][k]) continue;
            cut_way(j, list_side(j, g, k - 1));
            return false;
        }
    }
    return true;
}

/* Adds the control points of block b, a grid of m by n quads, by those of single patches. */
static void add_points(joining *j, const grid *g, uint32_t b)
{
    qw_patch_blocks *o = j->out;
    uint32_t m = g->size[0], n = g->size[1], at = o->first[b], row = g->first;
    assert(m > 0 && n > 0);
    uint32_t rows = 2 * m + 2, columns = 2 * n + 2;
    for (uint32_t y = 0, c = 0; y < n; y++, row = y < n ? above(j, row) : row) {
        uint32_t from = c;
        while (c < columns && (third_of(c, n) < 3 * (y + 1) || y + 1 == n)) c++;
        uint32_t h = row;
        for (uint32_t x = 0, r = 0; x < m; x++, h = x < m ? straight_on(j->quads, h) : h)
            for (; r < rows && (third_of(r, m) < 3 * (x + 1) || x + 1 == m); r++)
                for (uint32_t k = from; k < c; k++) {
                    int i = (int)(third_of(r, m) - 3 * x), up = (int)(third_of(k, n) - 3 * y);
                    o->point[at + (size_t)r * columns + k] =
                        j->patches
                            ->face[h / 4][QW_PATCH_CORNER[h % 4] + i * QW_PATCH_AHEAD[h % 4] + up * QW_PATCH_UP[h % 4]];
                }
    }
    o->span[b][0] = m, o->span[b][1] = n;
    o->first[b + 1] = at + (size_t)rows * columns;
    o->shell[b] = j->patches->shell[g->first / 4];
}

/* Room for blocks of single quads, which need the most. */
static qw_patch_blocks *new_blocks(qw_env *env, const qw_quadmesh *q)
{
    qw_patch_blocks *o = QW_NEW_ZERO(env, qw_patch_blocks, 1);
    size_t n = q->face_count;
    o->edge_first = QW_NEW_ZERO(env, uint32_t, 4 * n + 1), o->edge_point = QW_NEW(env, uint32_t, 16 * n);
    o->first = QW_NEW_ZERO(env, size_t, n + 1), o->point = QW_NEW(env, uint32_t, 16 * n);
    o->span = qw_alloc(env, n, sizeof *o->span), o->side = qw_alloc(env, n, sizeof *o->side);
    o->is_along = qw_alloc(env, n, sizeof *o->is_along), o->shell = QW_NEW(env, uint32_t, n);
    return o;
}

qw_patch_blocks *qw_join_patches(qw_env *env, const qw_quadmesh *q, const qw_patches *patches)
{
    assert(q->twin && patches->face_count == q->face_count);
    uint32_t sides = 4 * q->face_count;
    joining j = {.env = env, .quads = q, .patches = patches, .out = new_blocks(env, q)};
    j.special = QW_NEW_ZERO(env, uint8_t, q->vertex_count), j.line = QW_NEW(env, uint8_t, sides);
    j.block = QW_NEW(env, uint32_t, q->face_count), j.edge = QW_NEW(env, uint32_t, sides);
    j.way = QW_NEW(env, uint32_t, sides);
    grid *grids = qw_alloc(env, q->face_count, sizeof *grids);
    find_special(&j);
    for (uint32_t cuts = QW_NONE; cuts != j.cuts;) {
        cuts = j.cuts;
        trace_lines(&j);
        uint32_t count = find_grids(&j, grids);
        if (count == QW_NONE) return NULL;
        bool is_whole = count > 0;
        j.out->edge_count = 0;
        memset(j.edge, 0xff, sides * sizeof *j.edge);
        for (uint32_t b = 0; b < count; b++) is_whole &= add_sides(&j, &grids[b], b);
        if (!is_whole) continue;
        for (uint32_t b = 0; b < count; b++) add_points(&j, &grids[b], b);
        j.out->count = count;
        return j.out;
    }
    return NULL;
}
