/* The weaker arc of a pair that lies side by side gives way, so that it is always the same of two curves: each counts
 * what else lies close beside it, as it would stand for that as well. So of the three edges of a rounded rim the middle
 * one stays, where the two others, each sharper, would leave a row of quads between them that is too thin. */
#include "remesh/features/decide.h"

#include "base/mechanisms.h"
#include "base/sort.h"
#include "remesh/features/bands.h"

#include <assert.h>
#include <math.h>

enum { ROUNDS = 4 }; /* of letting go what is left too short */

typedef struct decision {
    const qw_trimesh *mesh;
    qw_feature_graph graph; /* of what is kept so far */
    qw_bands bands;
    uint8_t *verdict; /* uint8_t[3 face_count] */
    uint8_t *goes_on; /* uint8_t[vertex_count]: 1: at the end of a band that gives way: what ends there is not loose */
} decision;

static void give_way(decision *d, uint32_t h, qw_curve_verdict verdict)
{
    assert(d->mesh->twin[h] != QW_NONE && verdict != QW_CURVE_KEPT);
    d->verdict[h] = d->verdict[d->mesh->twin[h]] = (uint8_t)verdict;
}

/* ---- which of two gives way */

/* The arcs close beside each, but for boundaries, which give way to none. */
typedef struct company {
    size_t count;
    uint64_t *arcs; /* uint64_t[count], ascending: the number of one in the upper half, of one beside it in the lower */
    float *strength; /* float[count]: of the latter, times the share of the former's length that it lies beside */
    float *sum;      /* float[arcs]: of all beside each */
} company;

/* Adds what lies beside one arc. beside: its edges by their places in graph.half in the upper half, each with an arc
   beside it, once. */
static void add_company(company *c, const decision *d, uint32_t arc, uint64_t *beside, size_t count)
{
    const qw_feature_graph *g = &d->graph;
    for (size_t i = 0; i < count; i++) beside[i] = beside[i] << 32 | beside[i] >> 32;
    qw_sort_u64(beside, count);
    for (size_t i = 0; i < count; i++) {
        uint32_t other = (uint32_t)(beside[i] >> 32);
        uint64_t arcs = (uint64_t)arc << 32 | other;
        if (i == 0 || c->arcs[c->count - 1] != arcs) c->arcs[c->count] = arcs, c->strength[c->count++] = 0;
        float share = qw_length(qw_edge_way(d->mesh, g->half[beside[i] & 0xffffffffu])) / g->arc[arc].length;
        c->strength[c->count - 1] += share * g->arc[other].strength;
        c->sum[arc] += share * g->arc[other].strength;
    }
}

/* For each arc the other arcs beside which it runs narrowly, and along how much of it. */
static company find_company(qw_env *env, const decision *d)
{
    const qw_feature_graph *g = &d->graph;
    size_t count = 0;
    uint32_t *place = QW_NEW(env, uint32_t, 3 * (size_t)d->mesh->face_count);
    uint64_t *beside = QW_NEW(env, uint64_t, 2 * d->bands.narrow_count);
    for (uint32_t i = 0; i < g->arc_count; i++)
        for (uint32_t k = g->arc[i].begin; k < g->arc[i].begin + g->arc[i].count; k++) place[g->half[k]] = k;
    for (size_t i = 0; i < 2 * d->bands.narrow_count; i++) {
        uint32_t h[2] = {(uint32_t)(d->bands.narrow[i / 2] >> 32), (uint32_t)d->bands.narrow[i / 2]},
                 other = g->arc_of[h[1 - i % 2]];
        if (isfinite(g->arc[other].strength)) beside[count++] = (uint64_t)place[h[i % 2]] << 32 | other;
    }
    count = qw_sort_once(beside, count);
    company c = {0, QW_NEW(env, uint64_t, count), QW_NEW(env, float, count), QW_NEW_ZERO(env, float, g->arc_count)};
    for (size_t i = 0, end; i < count; i = end) {
        uint32_t arc = g->arc_of[g->half[beside[i] >> 32]];
        for (end = i; end < count && g->arc_of[g->half[beside[end] >> 32]] == arc;) end++;
        add_company(&c, d, arc, beside + i, end - i);
    }
    return c;
}

/* The strength of an arc with what lies beside it, but for the other. */
static float strength_beside(const decision *d, const company *c, uint32_t arc, uint32_t other)
{
    uint64_t arcs = (uint64_t)arc << 32 | other;
    size_t low = qw_first_not_below(c->arcs, c->count, arcs);
    float own = low < c->count && c->arcs[low] == arcs ? c->strength[low] : 0;
    bool is_alone = c->sum[arc] == own; /* without rounding */
    return d->graph.arc[arc].strength + (is_alone ? 0 : c->sum[arc] - own);
}

/* What lies across the end of a band that gives way is part of it. */
static void let_ends_go(decision *d)
{
    for (uint32_t i = 0; i < d->graph.arc_count; i++) {
        const qw_feature_arc *arc = &d->graph.arc[i];
        if (!d->bands.is_across[i]) continue;
        for (uint32_t k = 0; k < arc->count; k++) give_way(d, d->graph.half[arc->begin + k], QW_CURVE_MERGED);
        d->goes_on[arc->node[0]] = d->goes_on[arc->node[1]] = 1;
    }
}

/* Whether any edge gives way. */
static bool let_weaker_go(qw_env *env, decision *d)
{
    company c = find_company(env, d);
    bool any = false;
    for (size_t i = 0; i < d->bands.narrow_count; i++) {
        uint32_t a = (uint32_t)(d->bands.narrow[i] >> 32), b = (uint32_t)d->bands.narrow[i], ra = d->graph.arc_of[a],
                 rb = d->graph.arc_of[b];
        float sa = strength_beside(d, &c, ra, rb), sb = strength_beside(d, &c, rb, ra);
        uint32_t weaker = sa < sb || (!(sb < sa) && ra > rb) ? a : b;
        if (d->mesh->twin[weaker] != QW_NONE) give_way(d, weaker, QW_CURVE_MERGED), any = true;
    }
    if (any) let_ends_go(d);
    return any;
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
        for (int k = 0; k < 2; k++)
            loose += arc->node[k] != QW_NONE && d->graph.degree[arc->node[k]] == 1 && !d->goes_on[arc->node[k]];
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
    d.graph = qw_feature_graph_build(env, mesh, d.verdict, QW_VERDICT_BIT(QW_CURVE_KEPT));
    d.goes_on = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count);
    d.bands = qw_find_bands(env, mesh, &d.graph, least);
    bool any = d.bands.narrow_count > 0 && qw_uses(env, QW_MECH_NARROW_CURVES) && let_weaker_go(env, &d);
    qw_did(env, QW_MECH_NARROW_CURVES, any);
    for (int round = 0; round < ROUNDS && any && qw_uses(env, QW_MECH_LOOSE_PIECES); round++)
        any = let_pieces_go(env, &d, least), qw_did(env, QW_MECH_LOOSE_PIECES, any);
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
