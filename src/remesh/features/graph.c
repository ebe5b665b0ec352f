#include "remesh/features/graph.h"

#include "base/constants.h"
#include "base/sets.h"

#include <assert.h>
#include <math.h>
#include <string.h>

const qw_curve_verdict_row qw_curve_verdict_rows[QW_CURVE_VERDICTS] = {
#define QW_CURVE_VERDICT(name, word, reason) {word, reason},
#include "remesh/features/verdicts.def"
};

typedef struct builder {
    const qw_trimesh *mesh;
    const uint8_t *verdict;
    unsigned set;
    const uint32_t *outgoing;
    uint32_t *curve; /* uint32_t[3 faces]: sets of lower half-edges that are one curve */
    qw_feature_graph *graph;
} builder;

/* The first two edges of arcs at a vertex: their lower half-edges, and the ways along them. */
typedef struct fork {
    uint32_t edge[2];
    qw_vec3 away[2];
    uint32_t count; /* of all edges of arcs there */
} fork;

static bool is_in(const builder *b, uint32_t h) { return b->set >> b->verdict[h] & 1u; }

/* The curve edges at a vertex: how many there are, and the first two with their directions away from it. */
static fork fork_at(const builder *b, uint32_t v)
{
    assert(v < b->mesh->vertex_count);
    const qw_trimesh *mesh = b->mesh;
    fork f = {.count = 0};
    uint32_t h = b->outgoing[v];
    do {
        uint32_t sides[2] = {h, qw_prev(h)};
        bool last = mesh->twin[sides[1]] == QW_NONE; /* of an open fan: the edge that comes in counts too */
        for (int i = 0; i < (last ? 2 : 1); i++) {
            if (!is_in(b, sides[i])) continue;
            if (f.count < 2)
                f.edge[f.count] = qw_lower_half(mesh, sides[i]),
                f.away[f.count] = qw_scale(qw_edge_way(mesh, sides[i]), i ? -1.0f : 1.0f);
            f.count++;
        }
        h = qw_around(mesh, h);
    } while (h != QW_NONE && h != b->outgoing[v]);
    return f;
}

static bool goes_through(const builder *b, const fork *f)
{
    return f->count == 2 && b->verdict[f->edge[0]] == b->verdict[f->edge[1]] &&
           qw_dot(qw_normalize(f->away[0]), qw_normalize(f->away[1])) <= -(float)QW_THROUGH_COSINE;
}

static void join_edges(const builder *b)
{
    qw_sets_begin(b->curve, 3 * b->mesh->face_count);
    for (uint32_t v = 0; v < b->mesh->vertex_count; v++) {
        fork f = fork_at(b, v);
        b->graph->degree[v] = f.count;
        if (goes_through(b, &f)) qw_join_sets(b->curve, f.edge[0], f.edge[1]);
    }
}

static void measure_edge(const builder *b, qw_feature_arc *arc, uint32_t h)
{
    assert(h < 3 * b->mesh->face_count);
    uint32_t t = b->mesh->twin[h];
    float length = qw_length(qw_edge_way(b->mesh, h));
    qw_vec3 n = qw_normalize(qw_face_cross(b->mesh, h / 3));
    arc->count++;
    arc->length += length;
    arc->strength += t == QW_NONE ? INFINITY : length * (1 - qw_dot(n, qw_normalize(qw_face_cross(b->mesh, t / 3))));
}

/* An arc of each set, in the order of their lowest half-edges, which are their roots and come first. */
static void make_arcs(const builder *b)
{
    qw_feature_graph *g = b->graph;
    for (uint32_t h = 0; h < 3 * b->mesh->face_count; h++) {
        uint32_t low = qw_lower_half(b->mesh, h);
        if (!is_in(b, h)) g->arc_of[h] = QW_NONE;
        else if (low != h) g->arc_of[h] = g->arc_of[low];
        else if (b->curve[h] != h) g->arc_of[h] = g->arc_of[qw_set_of(b->curve, h)];
        else g->arc[g->arc_of[h] = g->arc_count++] = (qw_feature_arc){.node = {QW_NONE, QW_NONE}};
        if (low == h && g->arc_of[h] != QW_NONE) measure_edge(b, &g->arc[g->arc_of[h]], h);
    }
}

/* Lists the edges of each arc, one after the other, and finds the nodes at its ends. */
static void list_edges(const builder *b)
{
    assert(b->graph->arc_count <= 3 * b->mesh->face_count);
    qw_feature_graph *g = b->graph;
    for (uint32_t i = 1; i < g->arc_count; i++) g->arc[i].begin = g->arc[i - 1].begin + g->arc[i - 1].count;
    for (uint32_t i = 0; i < g->arc_count; i++) g->arc[i].count = 0;
    for (uint32_t h = 0; h < 3 * b->mesh->face_count; h++) {
        if (g->arc_of[h] == QW_NONE || qw_lower_half(b->mesh, h) != h) continue;
        qw_feature_arc *arc = &g->arc[g->arc_of[h]];
        g->half[arc->begin + arc->count++] = h;
        uint32_t at[2] = {b->mesh->corner[h], b->mesh->corner[qw_next(h)]};
        for (int i = 0; i < 2; i++) {
            fork f = fork_at(b, at[i]);
            if (!goes_through(b, &f)) arc->node[arc->node[0] != QW_NONE] = at[i];
        }
    }
}

qw_feature_graph qw_feature_graph_build(qw_env *env, const qw_trimesh *mesh, const uint8_t *verdict, unsigned set)
{
    assert(mesh->twin && verdict && !(set & QW_VERDICT_BIT(QW_CURVE_NONE)));
    uint32_t corners = 3 * mesh->face_count, edges = 0;
    qw_feature_graph g = {0};
    builder b = {.mesh = mesh, .verdict = verdict, .set = set, .graph = &g};
    for (uint32_t h = 0; h < corners; h++) edges += is_in(&b, h) && qw_lower_half(mesh, h) == h;
    g.arc = QW_NEW(env, qw_feature_arc, edges), g.half = QW_NEW(env, uint32_t, edges);
    g.arc_of = QW_NEW(env, uint32_t, corners), g.degree = QW_NEW(env, uint32_t, mesh->vertex_count);
    qw_scope_begin(env);
    b.outgoing = qw_trimesh_outgoing(env, mesh), b.curve = QW_NEW(env, uint32_t, corners);
    join_edges(&b);
    make_arcs(&b);
    list_edges(&b);
    qw_scope_end(env);
    return g;
}

uint8_t *qw_all_curves_kept(qw_env *env, const qw_trimesh *mesh, bool with_boundary)
{
    uint8_t *verdict = QW_NEW(env, uint8_t, 3 * (size_t)mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        verdict[h] = qw_is_curve_edge(mesh, h, with_boundary) ? QW_CURVE_KEPT : QW_CURVE_NONE;
    return verdict;
}

bool qw_are_verdicts_of(const qw_trimesh *mesh, const uint8_t *verdict)
{
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (qw_is_curve_edge(mesh, h, true) != (verdict[h] == QW_CURVE_KEPT) ||
            verdict[h] != verdict[qw_lower_half(mesh, h)])
            return false;
    return true;
}

bool qw_arcs_share_node(const qw_feature_graph *graph, uint32_t a, uint32_t b)
{
    assert(a < graph->arc_count && b < graph->arc_count);
    const uint32_t *x = graph->arc[a].node, *y = graph->arc[b].node;
    for (int i = 0; i < 4; i++)
        if (x[i / 2] != QW_NONE && x[i / 2] == y[i % 2]) return true;
    return false;
}

uint32_t qw_curves_at(const qw_feature_graph *graph, const qw_trimesh *mesh, const uint32_t *outgoing, uint32_t v,
                      uint32_t *half)
{
    assert(v < mesh->vertex_count);
    uint32_t count = 0, h = outgoing[v];
    do {
        if (graph->arc_of[h] != QW_NONE) half[count++] = h;
        uint32_t in = qw_prev(h);
        if (mesh->twin[in] == QW_NONE && graph->arc_of[in] != QW_NONE) half[count++] = in;
        h = qw_around(mesh, h);
    } while (h != QW_NONE && h != outgoing[v]);
    assert(count == graph->degree[v]);
    return count;
}
