#include "products/limit/stencils.h"

#include <assert.h>
#include <string.h>

/* ---- the rules */

static bool is_sharp(const qw_quadmesh *q, uint32_t h)
{
    return q->twin[h] == QW_NONE || (q->mark && (q->mark[h] & QW_MARK_FEATURE));
}

/* True for one of the half-edges of each edge. */
static bool stands_for_edge(const qw_quadmesh *q, uint32_t h) { return q->twin[h] == QW_NONE || h < q->twin[h]; }

uint8_t *qw_find_rules(qw_env *env, const qw_quadmesh *q, uint32_t (*crease)[2])
{
    assert(q->twin);
    uint8_t *rule = QW_NEW(env, uint8_t, q->vertex_count);
    uint32_t *sharp = QW_NEW_ZERO(env, uint32_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (!stands_for_edge(q, h) || !is_sharp(q, h)) continue;
        uint32_t end[2] = {q->corner[h], q->corner[qw_quad_next(h)]};
        for (int k = 0; k < 2; k++) {
            uint32_t at = sharp[end[k]]++;
            if (crease && at < 2) crease[end[k]][at] = end[!k];
        }
    }
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        bool is_corner = sharp[v] > 2 || (sharp[v] != 1 && q->kind && q->kind[v] == QW_VERTEX_CORNER);
        rule[v] = is_corner ? QW_RULE_CORNER : sharp[v] == 2 ? QW_RULE_CREASE : QW_RULE_SMOOTH;
    }
    qw_free(env, sharp);
    return rule;
}

/* ---- the split mesh */

/* Number of each half-edge's edge, uint32_t[4 face_count], in the order of the half-edges. */
static uint32_t *number_edges(qw_env *env, const qw_quadmesh *q, uint32_t *count)
{
    uint32_t *edge = QW_NEW(env, uint32_t, 4 * (size_t)q->face_count), edges = 0;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) edge[h] = stands_for_edge(q, h) ? edges++ : edge[q->twin[h]];
    *count = edges;
    return edge;
}

/* Corners, twins and marks of the child of a quad at half-edge h. */
static void connect_child(const qw_quadmesh *q, qw_quadmesh *fine, uint32_t h, const uint32_t *edge, uint32_t edges)
{
    assert(h < 4 * q->face_count);
    uint32_t before = qw_quad_prev(h), after = qw_quad_next(h), n = q->vertex_count;
    uint32_t *corner = fine->corner + 4 * (size_t)h, *twin = fine->twin + 4 * (size_t)h;
    uint8_t *mark = fine->mark + 4 * (size_t)h;
    corner[0] = q->corner[h], corner[1] = n + edge[h], corner[2] = n + edges + h / 4, corner[3] = n + edge[before];
    twin[0] = q->twin[h] == QW_NONE ? QW_NONE : 4 * qw_quad_next(q->twin[h]) + 3;
    twin[1] = 4 * after + 2, twin[2] = 4 * before + 1;
    twin[3] = q->twin[before] == QW_NONE ? QW_NONE : 4 * q->twin[before];
    mark[0] = q->mark ? q->mark[h] : 0, mark[3] = q->mark ? q->mark[before] : 0;
    mark[1] = mark[2] = 0;
}

/* Kinds and components of the vertices of a split: old ones, those on edges, and middles. */
static void describe_vertices(const qw_quadmesh *q, qw_quadmesh *fine)
{
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        fine->kind[v] = q->kind ? q->kind[v] : QW_VERTEX_FREE;
        fine->component[v] = q->component ? q->component[v] : 0;
    }
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t edge = fine->corner[4 * (size_t)h + 1], middle = fine->corner[4 * (size_t)h + 2];
        fine->kind[edge] = is_sharp(q, h) ? QW_VERTEX_CURVE : QW_VERTEX_FREE, fine->kind[middle] = QW_VERTEX_FREE;
        fine->component[edge] = fine->component[middle] = fine->component[q->corner[h]];
    }
}

qw_quadmesh qw_split_quads(qw_env *env, const qw_quadmesh *q)
{
    assert(q->twin);
    if (q->face_count >= QW_MOST_TO_SPLIT)
        qw_fail(env, QW_TOO_LARGE, -1, "%u quads split in four are too many", q->face_count);
    uint32_t edges, *edge = number_edges(env, q, &edges);
    qw_quadmesh fine = {.vertex_count = q->vertex_count + edges + q->face_count, .face_count = 4 * q->face_count};
    fine.position = QW_NEW_ZERO(env, qw_vec3, fine.vertex_count);
    fine.kind = QW_NEW(env, uint8_t, fine.vertex_count), fine.component = QW_NEW(env, uint32_t, fine.vertex_count);
    fine.corner = QW_NEW(env, uint32_t, 4 * (size_t)fine.face_count);
    fine.twin = QW_NEW(env, uint32_t, 4 * (size_t)fine.face_count);
    fine.mark = QW_NEW(env, uint8_t, 4 * (size_t)fine.face_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) connect_child(q, &fine, h, edge, edges);
    describe_vertices(q, &fine);
    qw_free(env, edge);
    return fine;
}

/* ---- rows */

typedef struct row_builder {
    qw_stencils s;
    size_t used;
} row_builder;

static void begin_rows(qw_env *env, row_builder *b, uint32_t rows, uint32_t columns, size_t entries)
{
    b->s = (qw_stencils){rows, columns, QW_NEW(env, size_t, (size_t)rows + 1), QW_NEW(env, uint32_t, entries),
                         QW_NEW(env, double, entries)};
    b->used = 0;
}

static void put(row_builder *b, uint32_t column, double value)
{
    assert(column < b->s.column_count);
    b->s.column[b->used] = column, b->s.value[b->used++] = value;
}

/* What the rows of vertices are made of. */
typedef struct rules {
    const qw_quadmesh *quads;
    uint8_t *rule;         /* uint8_t[vertices] */
    uint32_t (*crease)[2]; /* uint32_t[vertices][2] */
    uint32_t *outgoing;    /* uint32_t[vertices] */
} rules;

static rules rules_of(qw_env *env, const qw_quadmesh *q)
{
    rules r = {.quads = q, .crease = qw_alloc(env, q->vertex_count, 2 * sizeof(uint32_t))};
    r.rule = qw_find_rules(env, q, r.crease), r.outgoing = qw_quadmesh_outgoing(env, q);
    return r;
}

static void free_rules(qw_env *env, rules *r)
{
    qw_free(env, r->rule), qw_free(env, r->crease), qw_free(env, r->outgoing);
}

/* Weights of a smooth vertex: its own, and of each neighbour along an edge and across a quad. */
typedef struct mask {
    double own, along, across;
} mask;

static mask split_mask(double n) { return (mask){(n - 1.75) / n, 1.5 / (n * n), 0.25 / (n * n)}; }
static mask limit_mask(double n) { return (mask){n / (n + 5), 4 / (n * (n + 5)), 1 / (n * (n + 5))}; }

/* The row of a vertex; crease: its own weight on a crease, whose neighbours share the rest. */
static void put_vertex(row_builder *b, const rules *r, uint32_t v, mask (*mask_of)(double n), double crease)
{
    assert(v < r->quads->vertex_count);
    const qw_quadmesh *q = r->quads;
    uint32_t first = r->outgoing[v];
    b->s.first[v] = b->used;
    if (r->rule[v] == QW_RULE_CORNER || first == QW_NONE) {
        put(b, v, 1);
    } else if (r->rule[v] == QW_RULE_CREASE) {
        put(b, v, crease);
        for (int k = 0; k < 2; k++) put(b, r->crease[v][k], (1 - crease) / 2);
    } else {
        bool on_boundary;
        mask m = mask_of((double)qw_quad_valence(q, first, &on_boundary));
        put(b, v, m.own);
        uint32_t h = first;
        do {
            put(b, q->corner[qw_quad_next(h)], m.along), put(b, q->corner[qw_quad_across(h)], m.across);
            h = qw_quad_around(q, h);
        } while (h != first && h != QW_NONE);
    }
}

/* Entries of the rows of vertices, at the most: two for each quad at them, and their own and two. */
static size_t most_vertex_entries(const qw_quadmesh *q)
{
    return 8 * (size_t)q->face_count + 3 * (size_t)q->vertex_count;
}

static void put_edge(row_builder *b, const qw_quadmesh *q, uint32_t h)
{
    assert(h < 4 * q->face_count);
    uint32_t a = q->corner[h], c = q->corner[qw_quad_next(h)], t = q->twin[h];
    bool sharp = is_sharp(q, h);
    put(b, a, sharp ? 0.5 : 0.375), put(b, c, sharp ? 0.5 : 0.375);
    if (sharp) return;
    put(b, q->corner[qw_quad_across(h)], 0.0625), put(b, q->corner[qw_quad_prev(h)], 0.0625);
    put(b, q->corner[qw_quad_across(t)], 0.0625), put(b, q->corner[qw_quad_prev(t)], 0.0625);
}

qw_stencils qw_split_stencils(qw_env *env, const qw_quadmesh *q)
{
    uint32_t edges = 0, n = q->vertex_count, row = n;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) edges += stands_for_edge(q, h);
    row_builder b;
    begin_rows(env, &b, n + edges + q->face_count, n,
               most_vertex_entries(q) + 6 * (size_t)edges + 4 * (size_t)q->face_count);
    rules r = rules_of(env, q);
    for (uint32_t v = 0; v < n; v++) put_vertex(&b, &r, v, split_mask, 0.75);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (!stands_for_edge(q, h)) continue;
        b.s.first[row++] = b.used;
        put_edge(&b, q, h);
    }
    for (uint32_t f = 0; f < q->face_count; f++) {
        b.s.first[row++] = b.used;
        for (uint32_t i = 0; i < 4; i++) put(&b, q->corner[4 * (size_t)f + i], 0.25);
    }
    assert(row == n + edges + q->face_count);
    b.s.first[row] = b.used;
    free_rules(env, &r);
    return b.s;
}

qw_stencils qw_limit_stencils(qw_env *env, const qw_quadmesh *q)
{
    row_builder b;
    begin_rows(env, &b, q->vertex_count, q->vertex_count, most_vertex_entries(q));
    rules r = rules_of(env, q);
    for (uint32_t v = 0; v < q->vertex_count; v++) put_vertex(&b, &r, v, limit_mask, 2.0 / 3);
    b.s.first[q->vertex_count] = b.used;
    free_rules(env, &r);
    return b.s;
}

/* ---- products */

/* The entries of one row, gathered: value by column, and the columns that have one. */
typedef struct gathered {
    double *value;      /* double[columns], 0 but for those listed */
    uint8_t *is_listed; /* uint8_t[columns] */
    uint32_t *list, count;
} gathered;

static void gather(gathered *g, const qw_stencils *b, uint32_t row, double times)
{
    for (size_t i = b->first[row]; i < b->first[row + 1]; i++) {
        uint32_t c = b->column[i];
        if (!g->is_listed[c]) g->is_listed[c] = 1, g->value[c] = 0, g->list[g->count++] = c;
        g->value[c] += times * b->value[i];
    }
}

qw_stencils qw_stencils_product(qw_env *env, const qw_stencils *a, const qw_stencils *b)
{
    assert(a->column_count == b->row_count);
    uint32_t n = b->column_count;
    gathered g = {QW_NEW(env, double, n), QW_NEW_ZERO(env, uint8_t, n), QW_NEW(env, uint32_t, n), 0};
    size_t room = 0, values = 0, used = 0;
    qw_stencils p = {.row_count = a->row_count, .column_count = n};
    p.first = QW_NEW(env, size_t, (size_t)a->row_count + 1);
    for (uint32_t r = 0; r < a->row_count; r++) {
        g.count = 0;
        for (size_t i = a->first[r]; i < a->first[r + 1]; i++) gather(&g, b, a->column[i], a->value[i]);
        p.first[r] = used;
        p.column = qw_grow(env, p.column, &room, used + g.count, sizeof *p.column);
        p.value = qw_grow(env, p.value, &values, used + g.count, sizeof *p.value);
        for (uint32_t k = 0; k < g.count; k++) {
            uint32_t c = g.list[k];
            p.column[used] = c, p.value[used++] = g.value[c], g.is_listed[c] = 0;
        }
    }
    p.first[a->row_count] = used;
    qw_free(env, g.value), qw_free(env, g.is_listed), qw_free(env, g.list);
    return p;
}

qw_stencils qw_stencils_transpose(qw_env *env, const qw_stencils *s)
{
    size_t entries = s->first[s->row_count];
    qw_stencils t = {.row_count = s->column_count, .column_count = s->row_count};
    t.first = QW_NEW_ZERO(env, size_t, (size_t)t.row_count + 2);
    t.column = QW_NEW(env, uint32_t, entries), t.value = QW_NEW(env, double, entries);
    for (size_t i = 0; i < entries; i++) t.first[s->column[i] + 2]++;
    for (uint32_t r = 0; r < t.row_count; r++) t.first[r + 2] += t.first[r + 1];
    for (uint32_t r = 0; r < s->row_count; r++)
        for (size_t i = s->first[r]; i < s->first[r + 1]; i++) {
            size_t at = t.first[s->column[i] + 1]++;
            t.column[at] = r, t.value[at] = s->value[i];
        }
    assert(t.first[t.row_count] == entries);
    return t;
}

/* ---- positions */

typedef struct application {
    const qw_stencils *s;
    const double *in;
    double *out;
    const qw_vec3 *in_single;
    qw_vec3 *out_single;
} application;

static void apply_block(void *user, uint32_t begin, uint32_t end)
{
    const application *a = user;
    for (uint32_t r = begin; r < end; r++) {
        double sum[3] = {0, 0, 0};
        for (size_t i = a->s->first[r]; i < a->s->first[r + 1]; i++)
            for (int k = 0; k < 3; k++) sum[k] += a->s->value[i] * a->in[3 * (size_t)a->s->column[i] + (size_t)k];
        memcpy(a->out + 3 * (size_t)r, sum, sizeof sum);
    }
}

void qw_stencils_apply(qw_env *env, const qw_stencils *s, const double *in, double *out)
{
    application a = {.s = s, .in = in, .out = out};
    qw_parallel(env, s->row_count, QW_GRAIN_HEAVY, apply_block, &a);
}

/* Applies the stencils to positions in single precision. */
static void place_block(void *user, uint32_t begin, uint32_t end)
{
    const application *a = user;
    for (uint32_t r = begin; r < end; r++) {
        double x = 0, y = 0, z = 0;
        for (size_t i = a->s->first[r]; i < a->s->first[r + 1]; i++) {
            qw_vec3 p = a->in_single[a->s->column[i]];
            x += a->s->value[i] * (double)p.x, y += a->s->value[i] * (double)p.y, z += a->s->value[i] * (double)p.z;
        }
        a->out_single[r] = qw_v3((float)x, (float)y, (float)z);
    }
}

void qw_stencils_place(qw_env *env, const qw_stencils *s, const qw_vec3 *in, qw_vec3 *out)
{
    application a = {.s = s, .in_single = in, .out_single = out};
    qw_parallel(env, s->row_count, QW_GRAIN_HEAVY, place_block, &a);
}
