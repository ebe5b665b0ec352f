/* Section 3.3 from end to end: coarsen (for the -mr kinds), solve the coarsest complex, carry the result back to the
 * surface's own triangles and repair it on the way. */
#include "paper/multiresolution.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* Work state of one level of collapsing. */
typedef struct folding {
    const qw_complex *fine;
    uint32_t *edge;   /* [3F] edge of each half-edge, as merged so far */
    uint8_t *rot;     /* [3F] */
    uint32_t *side;   /* [2E] */
    uint8_t *fixed;   /* [E] */
    uint8_t *gone;    /* [F] removed */
    uint8_t *touched; /* [E] an edge next to a removal: not to be collapsed on this level */
    qw_collapse map;
} folding;

static uint32_t other_side(const folding *w, uint32_t e, uint32_t h)
{
    return w->side[2 * e] == h ? w->side[2 * e + 1] : w->side[2 * e];
}

/* Whether the two triangles at edge e can go, so that their other edges become one in pairs and no triangle meets
   itself. */
static bool can_fold(const folding *w, uint32_t e)
{
    assert(e < w->fine->edge_count);
    uint32_t s0 = w->side[2 * e], s1 = w->side[2 * e + 1];
    if (w->touched[e] || s1 == QW_NONE || s0 / 3 == s1 / 3 || w->gone[s0 / 3] || w->gone[s1 / 3]) return false;
    uint32_t h[4] = {qw_next(s0), qw_next(qw_next(s0)), qw_next(s1), qw_next(qw_next(s1))}, beyond[4];
    for (int i = 0; i < 4; i++) {
        if (w->touched[w->edge[h[i]]]) return false;
        for (int j = 0; j < i; j++)
            if (w->edge[h[i]] == w->edge[h[j]]) return false;
        beyond[i] = other_side(w, w->edge[h[i]], h[i]);
    }
    for (int i = 0; i < 4; i += 2) {
        bool one = beyond[i] == QW_NONE, two = beyond[i + 1] == QW_NONE;
        if (one && two) return false;
        if (!one && !two && beyond[i] / 3 == beyond[i + 1] / 3) return false;
    }
    return true;
}

/* Removes the triangle of half-edge s: its other edges b and c become one edge (c), as d_b = -R_b^-1 R_c d_c. */
static void fold_triangle(folding *w, uint32_t s)
{
    assert(s < 3 * w->fine->face_count);
    uint32_t hb = qw_next(s), hc = qw_next(hb), b = w->edge[hb], c = w->edge[hc];
    unsigned turn = (unsigned)(w->rot[hc] + 6 - w->rot[hb]) & 3u;
    uint32_t from = other_side(w, b, hb), to = other_side(w, c, hc);
    if (from != QW_NONE) {
        w->edge[from] = c;
        w->rot[from] = (uint8_t)((w->rot[from] + turn) & 3u);
    }
    w->side[2 * c] = to != QW_NONE ? to : from;
    w->side[2 * c + 1] = to != QW_NONE ? from : QW_NONE;
    uint8_t bits = w->fixed[b];
    if (turn & 1u) bits = (uint8_t)((bits & QW_FIXED_X ? QW_FIXED_Y : 0) | (bits & QW_FIXED_Y ? QW_FIXED_X : 0));
    w->fixed[c] |= bits;
    w->map.edge[b] = c;
    w->map.turn[b] = (uint8_t)turn;
    w->touched[b] = w->touched[c] = 1;
    w->gone[s / 3] = 1;
}

static bool is_regular(const qw_complex *c, uint32_t f) { return qw_int2_is_zero(qw_complex_residual(c, f)); }

/* Folds all edges of zero length between regular triangles that do not touch one another; how many. */
static uint32_t fold_zero_edges(folding *w)
{
    uint32_t folded = 0;
    for (uint32_t e = 0; e < w->fine->edge_count; e++) {
        if (!qw_int2_is_zero(w->fine->d[e]) || !can_fold(w, e)) continue;
        uint32_t s0 = w->side[2 * e], s1 = w->side[2 * e + 1];
        if (!is_regular(w->fine, s0 / 3) || !is_regular(w->fine, s1 / 3)) continue;
        fold_triangle(w, s0);
        fold_triangle(w, s1);
        w->map.edge[e] = QW_NONE;
        w->touched[e] = 1;
        folded++;
    }
    return folded;
}

/* The complex that is left once edges were folded, in new arrays; map.edge leads from each old edge to its new
   one. */
static void pack(qw_env *env, const folding *w, uint32_t folded, qw_complex *coarse)
{
    const qw_complex *fine = w->fine;
    uint32_t faces = fine->face_count - 2 * folded, edges = fine->edge_count - 3 * folded, at = 0;
    uint32_t *number = QW_NEW(env, uint32_t, fine->edge_count), *new_face = QW_NEW(env, uint32_t, fine->face_count);
    *coarse = (qw_complex){.face_count = faces, .edge_count = edges};
    coarse->edge = QW_NEW(env, uint32_t, (size_t)3 * faces);
    coarse->rot = QW_NEW(env, uint8_t, (size_t)3 * faces);
    coarse->side = QW_NEW(env, uint32_t, (size_t)2 * edges);
    coarse->d = QW_NEW(env, qw_int2, edges);
    coarse->real = QW_NEW(env, qw_real2, edges);
    coarse->fixed = QW_NEW(env, uint8_t, edges);
    for (uint32_t f = 0; f < fine->face_count; f++) new_face[f] = w->gone[f] ? QW_NONE : at++;
    assert(at == faces);
    at = 0;
    for (uint32_t e = 0; e < fine->edge_count; e++) {
        if (w->map.edge[e] != e) continue;
        number[e] = at;
        for (int i = 0; i < 2; i++) {
            uint32_t h = w->side[2 * e + i];
            coarse->side[2 * at + i] = h == QW_NONE ? QW_NONE : 3 * new_face[h / 3] + h % 3;
        }
        coarse->d[at] = fine->d[e];
        coarse->real[at] = fine->real[e]; /* the merged edges differ by a zero edge: the values of one are used */
        coarse->fixed[at++] = w->fixed[e];
    }
    assert(at == edges);
    for (uint32_t h = 0; h < 3 * fine->face_count; h++) {
        if (w->gone[h / 3]) continue;
        uint32_t to = 3 * new_face[h / 3] + h % 3;
        coarse->edge[to] = number[w->edge[h]];
        coarse->rot[to] = w->rot[h];
    }
    for (uint32_t e = 0; e < fine->edge_count; e++)
        if (w->map.edge[e] != QW_NONE) w->map.edge[e] = number[w->map.edge[e]];
    qw_free(env, number), qw_free(env, new_face);
}

bool qw_complex_collapse(qw_env *env, const qw_complex *fine, qw_complex *coarse, qw_collapse *map)
{
    assert(fine->edge && fine->rot && fine->d);
    uint32_t corners = 3 * fine->face_count, edges = fine->edge_count;
    folding w = {.fine = fine};
    w.map.edge = QW_NEW(env, uint32_t, edges);
    w.map.turn = QW_NEW_ZERO(env, uint8_t, edges);
    for (uint32_t e = 0; e < edges; e++) w.map.edge[e] = e;
    qw_scope_begin(env);
    w.edge = QW_NEW(env, uint32_t, corners);
    w.rot = QW_NEW(env, uint8_t, corners);
    w.side = QW_NEW(env, uint32_t, (size_t)2 * edges);
    w.fixed = QW_NEW(env, uint8_t, edges);
    w.gone = QW_NEW_ZERO(env, uint8_t, fine->face_count);
    w.touched = QW_NEW_ZERO(env, uint8_t, edges);
    memcpy(w.edge, fine->edge, corners * sizeof *w.edge);
    memcpy(w.rot, fine->rot, corners);
    memcpy(w.side, fine->side, (size_t)2 * edges * sizeof *w.side);
    memcpy(w.fixed, fine->fixed, edges);
    uint32_t folded = fold_zero_edges(&w);
    bool worth = 2 * (uint64_t)folded * 20 >= fine->face_count && folded > 0;
    if (worth) {
        pack(env, &w, folded, coarse);
        qw_keep(env, coarse->edge), qw_keep(env, coarse->rot), qw_keep(env, coarse->side);
        qw_keep(env, coarse->d), qw_keep(env, coarse->real), qw_keep(env, coarse->fixed);
    }
    qw_scope_end(env);
    *map = w.map;
    return worth;
}

void qw_complex_expand(const qw_complex *coarse, const qw_collapse *map, qw_complex *fine)
{
    assert(coarse->d && map->edge && fine->d);
    for (uint32_t e = 0; e < fine->edge_count; e++)
        fine->d[e] = map->edge[e] == QW_NONE ? (qw_int2){0, 0} : qw_turn(map->turn[e], coarse->d[map->edge[e]]);
}

/* Geometric costs lose their meaning where one edge stands for many, so they stop after few levels. */
enum { GEOMETRIC_LEVELS = 4 };
enum { MAX_LEVELS = 24 };

typedef struct levels {
    uint32_t count;
    qw_complex complex[MAX_LEVELS]; /* 0 is the finest */
    qw_collapse map[MAX_LEVELS];    /* map[l] takes level l + 1 to level l */
} levels;

static levels make_levels(qw_env *env, const qw_offset_mesh *m, uint32_t most)
{
    assert(most > 0 && most <= MAX_LEVELS);
    levels l = {.count = 1};
    l.complex[0] = qw_complex_of(env, m);
    while (l.count < most &&
           qw_complex_collapse(env, &l.complex[l.count - 1], &l.complex[l.count], &l.map[l.count - 1]))
        l.count++;
    return l;
}

/* Solves the coarsest level and carries the result down; each finer level only has to repair what the coarser one
   could not. */
static void solve_levels(qw_env *env, levels *l, qw_flow_choice kind, qw_cost_kind cost, qw_regular_counts *counts)
{
    assert(l->count > 0 && kind < QW_FLOW_CLOSED);
    bool exact = kind == QW_FLOW_MCF || kind == QW_FLOW_MCF_MR;
    qw_flow_choice first = exact ? QW_FLOW_MCF : kind == QW_FLOW_ILP ? QW_FLOW_ILP : QW_FLOW_MF;
    bool done = false;
    for (uint32_t i = l->count; i-- > 0;) {
        bool coarsest = i + 1 == l->count;
        if (!coarsest) qw_complex_expand(&l->complex[i + 1], &l->map[i], &l->complex[i]);
        /* the paper's MCF_MR goes from the coarsest level straight to the finest */
        bool skip = kind == QW_FLOW_MCF_MR && !coarsest && i != 0;
        if (!done && !skip)
            done = qw_solve_complex(env, &l->complex[i], NULL, coarsest ? first : QW_FLOW_MF, cost, i == 0, NULL,
                                    counts);
        qw_progress(env, 1.0 / (1.0 + i));
    }
}

qw_regular_counts qw_make_regular(qw_env *env, qw_offset_mesh *m, qw_flow_choice kind, qw_cost_kind cost)
{
    assert(kind < QW_FLOW_CLOSED);
    qw_regular_counts counts = {0};
    qw_scope_begin(env);
    levels *l = QW_NEW(env, levels, 1);
    *l = make_levels(
        env, m,
        kind == QW_FLOW_MF_MR || kind == QW_FLOW_MCF_MR ? (cost != QW_COST_PLAIN ? GEOMETRIC_LEVELS : MAX_LEVELS) : 1);
    counts.levels = l->count;
    counts.irregular_before = qw_count_irregular(&l->complex[0]);
    solve_levels(env, l, kind, cost, &counts);
    counts.irregular_after = qw_count_irregular(&l->complex[0]);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        qw_int2 change = qw_int2_sub(l->complex[0].d[e], m->d[e]);
        counts.cost += abs(change.x) + abs(change.y);
    }
    memcpy(m->d, l->complex[0].d, m->edge_count * sizeof *m->d);
    qw_scope_end(env);
    return counts;
}
