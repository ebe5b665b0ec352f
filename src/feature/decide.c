/* Curve edges are looked at in pairs that an edge of the mesh connects, as the mesh is about as fine as curves may be
 * close. The weaker arc of a pair gives way, so that it is always the same of two curves. */
#include "feature/decide.h"

#include "feature/graph.h"

#include <assert.h>
#include <math.h>

/* Cosine of a quarter of a right angle: wider sectors are kept open, see hierarchy/sectors.c. */
static const float PARALLEL = 0.92387953f;
/* Of `least`: below a fifth of an edge a row of quads would be too thin; see integer/narrow_bands.h for wider ones. */
static const float CLOSE = 0.4f;
static const float OVERLAP = 0.25f; /* of the shorter edge that must lie beside the other */
enum { ROUNDS = 4 };                /* of letting go what is left too short */

typedef struct decision {
    const qw_trimesh *mesh;
    const uint32_t *outgoing;
    qw_feature_graph graph; /* of what is kept so far */
    uint8_t *verdict;       /* uint8_t[3 face_count] */
} decision;

static bool is_curve(const qw_trimesh *mesh, uint32_t h) { return qw_is_curve_edge(mesh, h, true); }
static qw_vec3 along(const qw_trimesh *mesh, uint32_t h)
{
    return qw_sub(mesh->position[mesh->corner[qw_next(h)]], mesh->position[mesh->corner[h]]);
}

static void give_way(decision *d, uint32_t h, qw_curve_verdict verdict)
{
    assert(d->mesh->twin[h] != QW_NONE && verdict != QW_CURVE_KEPT);
    d->verdict[h] = d->verdict[d->mesh->twin[h]] = (uint8_t)verdict;
}

/* ---- side by side */

static bool side_by_side(const qw_trimesh *mesh, uint32_t a, uint32_t b, float least)
{
    assert(a < 3 * mesh->face_count && b < 3 * mesh->face_count);
    qw_vec3 p = mesh->position[mesh->corner[a]], da = along(mesh, a), db = along(mesh, b);
    float la = qw_length(da), lb = qw_length(db);
    if (!(la > 0 && lb > 0)) return false;
    qw_vec3 d = qw_scale(da, 1 / la);
    float turn = qw_dot(d, db) / lb;
    if (fabsf(turn) < PARALLEL) return false;
    qw_vec3 from = qw_sub(mesh->position[mesh->corner[b]], p), to = qw_add(from, db);
    float x = qw_dot(from, d), y = qw_dot(to, d), low = fmaxf(fminf(x, y), 0), high = fminf(fmaxf(x, y), la);
    if (high - low < OVERLAP * fminf(la, lb)) return false;
    float middle = (low + high) / 2, t = fabsf(y - x) > 0 ? (middle - x) / (y - x) : 0;
    return qw_length(qw_sub(qw_madd(from, t, db), qw_scale(d, middle))) < least;
}

static void compare(decision *d, uint32_t a, uint32_t b, float least)
{
    const qw_feature_graph *g = &d->graph;
    uint32_t ra = g->arc_of[a], rb = g->arc_of[b];
    /* side by side from one node on they are an acute corner: one of them gives way there, but only near the corner
       (integer/acute_corners.h) */
    if (ra == rb || qw_arcs_share_node(g, ra, rb) || !side_by_side(d->mesh, a, b, least)) return;
    float sa = g->arc[ra].strength, sb = g->arc[rb].strength;
    uint32_t weaker = sa < sb || (!(sb < sa) && ra > rb) ? a : b;
    if (d->mesh->twin[weaker] != QW_NONE) give_way(d, weaker, QW_CURVE_MERGED);
}

/* All curve edges at one end of h against all at the other. */
static void compare_ends(decision *d, uint32_t h, float least)
{
    assert(h < 3 * d->mesh->face_count);
    const qw_trimesh *mesh = d->mesh;
    uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)], i = d->outgoing[u];
    do {
        for (int side = 0; side < 2; side++) { /* the incoming one too, for the last of an open fan */
            uint32_t a = side ? qw_prev(i) : i;
            if (!is_curve(mesh, a) || (side && mesh->twin[a] != QW_NONE)) continue;
            uint32_t j = d->outgoing[v];
            do {
                if (is_curve(mesh, j)) compare(d, a, j, least);
                if (mesh->twin[qw_prev(j)] == QW_NONE) compare(d, a, qw_prev(j), least);
                j = qw_around(mesh, j);
            } while (j != QW_NONE && j != d->outgoing[v]);
        }
        i = qw_around(mesh, i);
    } while (i != QW_NONE && i != d->outgoing[u]);
}

/* ---- pieces */

/* Arcs with loose ends that the quads would meet with less than half an edge an end. Returns whether there are any. */
static bool let_pieces_go(qw_env *env, decision *d, const float *least)
{
    const qw_trimesh *mesh = d->mesh;
    qw_scope_begin(env);
    d->graph = qw_feature_graph_build(env, mesh, d->verdict, QW_VERDICT_BIT(QW_CURVE_KEPT));
    bool any = false;
    for (uint32_t i = 0; i < d->graph.arc_count; i++) {
        const qw_feature_arc *arc = &d->graph.arc[i];
        uint32_t loose = 0;
        for (int k = 0; k < 2; k++) loose += arc->node[k] != QW_NONE && d->graph.degree[arc->node[k]] == 1;
        for (uint32_t k = arc->begin; k < arc->begin + arc->count; k++) {
            uint32_t h = d->graph.half[k];
            if (mesh->twin[h] == QW_NONE || !(arc->length < 2 * least[mesh->corner[h]] * (float)loose)) continue;
            give_way(d, h, QW_CURVE_LET_GO);
            any = true;
        }
    }
    qw_scope_end(env);
    return any;
}

uint8_t *qw_decide_curves(qw_env *env, const qw_trimesh *mesh, const float *least)
{
    assert(mesh->twin && least);
    decision d = {.mesh = mesh, .verdict = qw_all_curves_kept(env, mesh, true)};
    if (!mesh->mark) return d.verdict;
    qw_scope_begin(env);
    d.outgoing = qw_trimesh_outgoing(env, mesh);
    d.graph = qw_feature_graph_build(env, mesh, d.verdict, QW_VERDICT_BIT(QW_CURVE_KEPT));
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        if (d.graph.degree[u] && d.graph.degree[v] && qw_lower_half(mesh, h) == h)
            compare_ends(&d, h, CLOSE * fminf(least[u], least[v]));
    }
    bool any = false;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) any |= d.verdict[h] == QW_CURVE_MERGED;
    for (int round = 0; round < ROUNDS && any; round++) any = let_pieces_go(env, &d, least);
    qw_scope_end(env);
    return d.verdict;
}

int64_t qw_unmark_curves(qw_trimesh *mesh, const uint8_t *verdict)
{
    int64_t count = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (verdict[h] == QW_CURVE_NONE || verdict[h] == QW_CURVE_KEPT) continue;
        assert(mesh->mark && mesh->twin[h] != QW_NONE);
        mesh->mark[h] = 0;
        count++;
    }
    return count / 2;
}
