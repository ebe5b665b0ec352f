/* The solver is first asked for orientation-preserving offsets that differ from what there is at the cluster: some
 * triangle at it has more angle than now, or other vertices are joined there. As long as the answer has a cluster with
 * too little angle, that one is ruled out in the same way. Sums of angles would be many clauses; a few rounds do
 * instead. */
#include "remesh/offsets/turning_numbers.h"

#include "base/sets.h"
#include "remesh/offsets/neighbourhood.h"

#include <assert.h>
#include <string.h>

/* Clusters that have an answer have it within three rounds. Where so many have none the offsets are beyond repair. */
enum { CONFLICTS = 500, ROUNDS = 8, MOST_VERTICES = 64, MOST_FAILURES = 16 };

/* Rings around the cluster. */
enum { RADIUS = 2 };

/* ---- angles, in eighths of a turn */

/* Of the corner between vectors whose components are -1, 0 or 1. */
static int32_t angle_between(qw_int2 from, qw_int2 to)
{
    static const int8_t eighth[3][3] = {{5, 6, 7}, {4, 0, 0}, {3, 2, 1}};
    return (eighth[to.y + 1][to.x + 1] + 8 - eighth[from.y + 1][from.x + 1]) & 7;
}

static qw_int2 opposite(qw_int2 d) { return (qw_int2){-d.x, -d.y}; }

static int32_t angle_at(const qw_offset_mesh *m, uint32_t h)
{
    return angle_between(qw_offset_along(m, h), opposite(qw_offset_along(m, qw_prev(h))));
}

/* ---- all clusters at once */

typedef struct cluster_sums {
    int32_t angle, wanted, chi; /* of the discs that contracted parts should be, chi is 1 */
    bool open, has_area;
} cluster_sums;

/* Adds triangle f to the clusters of its corners: the angle at each, and what counts towards their Euler
 * characteristic. */
static void add_triangle(const qw_offset_mesh *m, const uint32_t *set, uint32_t f, cluster_sums *sum)
{
    assert(f < m->face_count);
    const uint32_t *c = m->corner + 3 * (size_t)f;
    bool has_area = qw_offset_det(m, f) > 0, zero = true;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t h = 3 * f + i, s = set[c[i]];
        if (m->twin[h] == QW_NONE) sum[s].open = sum[set[m->corner[qw_next(h)]]].open = true;
        if (has_area) sum[s].has_area = true;
        zero &= qw_int2_is_zero(m->d[m->edge[h]]);
        if (s != set[m->corner[qw_next(h)]] && s != set[m->corner[qw_prev(h)]]) sum[s].angle += angle_at(m, h);
    }
    if (zero) sum[set[c[0]]].chi++;
}

uint32_t qw_find_low_turning_numbers(qw_env *env, const qw_offset_mesh *m, uint8_t *mark)
{
    assert(m->index && m->twin);
    qw_scope_begin(env);
    uint32_t n = m->vertex_count, count = 0;
    uint32_t *set = QW_NEW(env, uint32_t, n);
    cluster_sums *sum = QW_NEW_ZERO(env, cluster_sums, n);
    qw_sets_begin(set, n);
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (qw_int2_is_zero(m->d[e])) qw_join_sets(set, m->corner[m->half[e]], m->corner[qw_next(m->half[e])]);
    for (uint32_t v = 0; v < n; v++) {
        uint32_t s = set[v] = qw_set_of(set, v);
        sum[s].wanted += (s == v ? 8 : 0) - 2 * m->index[v];
        sum[s].chi++;
    }
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (qw_int2_is_zero(m->d[e])) sum[set[m->corner[m->half[e]]]].chi--;
    for (uint32_t f = 0; f < m->face_count; f++) add_triangle(m, set, f, sum);
    for (uint32_t v = 0; v < n; v++) {
        const cluster_sums *s = &sum[v];
        mark[v] = set[v] == v && !s->open && s->has_area && s->chi == 1 && s->angle < s->wanted;
        count += mark[v];
    }
    qw_scope_end(env);
    return count;
}

/* ---- one cluster, after the steps that the solver chose */

typedef struct cluster_repair {
    qw_env *env;
    qw_neighbourhood *n;
    qw_sat *sat;
    int *taken;    /* int[n->count] */
    int variables; /* used so far */
    uint32_t cluster[MOST_VERTICES], cluster_size;
    uint32_t *stamp, now; /* uint32_t[V]: now where a vertex is in the cluster, or was in an earlier one of this round
                             if it is at least round_begin */
    uint32_t round_begin;
    int *clause;
    size_t clause_capacity;
    uint32_t clause_length;
} cluster_repair;

static int step_of(const cluster_repair *a, uint32_t v)
{
    return a->n->number[v] == QW_NONE ? 0 : a->taken[a->n->number[v]];
}

static qw_int2 along_now(const cluster_repair *a, uint32_t h)
{
    return qw_along_after(a->n, h, step_of(a, a->n->m->corner[h]), step_of(a, a->n->m->corner[qw_next(h)]));
}

/* Vertices that zero edges join to v; false where they are too many or at the boundary. */
static bool collect_cluster(cluster_repair *a, uint32_t v)
{
    assert(v < a->n->m->vertex_count);
    const qw_offset_mesh *m = a->n->m;
    a->now++;
    a->cluster_size = 0;
    a->cluster[a->cluster_size++] = v;
    a->stamp[v] = a->now;
    for (uint32_t i = 0; i < a->cluster_size; i++) {
        qw_star_at(a->env, m, a->n->outgoing[a->cluster[i]], &a->n->star);
        for (uint32_t k = 0; k < a->n->star.count; k++) {
            uint32_t h = a->n->star.out[k], w = m->corner[qw_next(h)];
            if (m->twin[h] == QW_NONE || m->twin[qw_prev(h)] == QW_NONE) return false;
            if (a->stamp[w] == a->now || !qw_int2_is_zero(along_now(a, h))) continue;
            if (a->cluster_size == MOST_VERTICES) return false;
            a->stamp[w] = a->now;
            a->cluster[a->cluster_size++] = w;
        }
    }
    return true;
}

/* Whether h leaves the cluster in a triangle that has no other corner there. */
static bool is_outer(const cluster_repair *a, uint32_t h)
{
    const qw_offset_mesh *m = a->n->m;
    return a->stamp[m->corner[qw_next(h)]] != a->now && a->stamp[m->corner[qw_prev(h)]] != a->now;
}

/* Whether the lattice goes around the cluster, which must be a disc, less often than its cones say. */
static bool is_turning_number_low(cluster_repair *a)
{
    const qw_offset_mesh *m = a->n->m;
    int32_t angle = 0, wanted = 8, edges = 0,
            triangles = 0; /* zero edges, seen from both ends; zero triangles, from three corners */
    for (uint32_t i = 0; i < a->cluster_size; i++) {
        wanted -= 2 * m->index[a->cluster[i]];
        qw_star_at(a->env, m, a->n->outgoing[a->cluster[i]], &a->n->star);
        for (uint32_t k = 0; k < a->n->star.count; k++) {
            uint32_t h = a->n->star.out[k];
            qw_int2 out = along_now(a, h), in = along_now(a, qw_prev(h));
            edges += qw_int2_is_zero(out);
            triangles += qw_int2_is_zero(out) && qw_int2_is_zero(in);
            if (is_outer(a, h)) angle += angle_between(out, opposite(in));
        }
    }
    bool is_disc = (int32_t)a->cluster_size - edges / 2 + triangles / 3 == 1;
    return is_disc && angle > 0 && angle < wanted;
}

static void add_literal(cluster_repair *a, int literal)
{
    if (!literal) return;
    a->clause = qw_grow(a->env, a->clause, &a->clause_capacity, (size_t)a->clause_length + 1, sizeof *a->clause);
    a->clause[a->clause_length++] = literal;
}

/* A new variable that is true only if the triangle's angle at the tail of h, which stays, grows, or another of its
   corners comes to lie there. 0 where that cannot be. */
static int grows(cluster_repair *a, uint32_t h)
{
    assert(h < 3 * a->n->m->face_count);
    const qw_neighbourhood *n = a->n;
    uint32_t v = n->m->corner[h], u = n->m->corner[qw_next(h)], w = n->m->corner[qw_prev(h)];
    if (n->number[u] == QW_NONE && n->number[w] == QW_NONE) return 0;
    int32_t angle = angle_between(along_now(a, h), opposite(along_now(a, qw_prev(h))));
    int literal = ++a->variables;
    for (int s = 0; s < qw_step_count(n, u); s++)
        for (int t = 0; t < qw_step_count(n, w); t++) {
            qw_int2 out = qw_along_after(n, h, step_of(a, v), s), in = qw_along_after(n, qw_prev(h), t, step_of(a, v));
            if (qw_int2_norm(out) > 1 || qw_int2_norm(in) > 1 || qw_int2_is_zero(out) || qw_int2_is_zero(in)) continue;
            if (angle_between(out, opposite(in)) > angle) continue;
            qw_neighbourhood_clause(a->sat, (int[]){-literal, qw_denies(n, u, s), qw_denies(n, w, t)}, 3);
        }
    return literal;
}

/* Rules out that the collected cluster stays as it is. */
static void rule_out(cluster_repair *a)
{
    const qw_offset_mesh *m = a->n->m;
    a->clause_length = 0;
    for (uint32_t i = 0; i < a->cluster_size; i++) {
        uint32_t v = a->cluster[i];
        add_literal(a, qw_denies(a->n, v, step_of(a, v)));
        qw_star_at(a->env, m, a->n->outgoing[v], &a->n->star);
        for (uint32_t k = 0; k < a->n->star.count; k++)
            if (is_outer(a, a->n->star.out[k])) add_literal(a, grows(a, a->n->star.out[k]));
    }
    qw_sat_clause(a->sat, a->clause, a->clause_length);
}

/* Rules out all clusters that the steps have left with too little angle; returns whether there was one. */
static bool rule_out_all(cluster_repair *a)
{
    bool any = false;
    a->round_begin = a->now + 1;
    for (uint32_t k = 0; k < a->n->face_count; k++)
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t v = a->n->m->corner[3 * a->n->face[k] + i];
            if (a->stamp[v] >= a->round_begin || !collect_cluster(a, v) || !is_turning_number_low(a)) continue;
            rule_out(a);
            any = true;
        }
    return any;
}

/* Takes steps around v after which no triangle is inverted and no turning number is low: clauses are added as the
 * solver's answers break one, for ROUNDS. Returns whether there are any. */
static bool solve_around(cluster_repair *a, qw_offset_mesh *m, uint32_t v, qw_inversion_counts *counts)
{
    assert(v < m->vertex_count && counts);
    qw_neighbourhood *n = a->n;
    qw_scope_begin(a->env);
    qw_neighbourhood_grow(a->env, n, n->outgoing[v] / 3, RADIUS);
    a->sat = qw_sat_begin(a->env);
    a->taken = QW_NEW_ZERO(a->env, int, n->count);
    a->clause = NULL, a->clause_capacity = 0;
    a->variables = QW_STEPS * (int)n->count;
    qw_neighbourhood_forbid_inversions(n, a->sat);
    bool again = rule_out_all(a), solved = !again;
    for (int round = 0; again && round < ROUNDS; round++) {
        counts->sat_calls++;
        again = qw_sat_solve(a->sat, CONFLICTS) == QW_SAT_YES;
        counts->sat_conflicts += qw_sat_conflicts(a->sat);
        if (!again) break;
        for (uint32_t i = 0; i < n->count; i++) a->taken[i] = qw_taken_step(n, a->sat, n->vertex[i]);
        again = rule_out_all(a);
        solved = !again;
        if (solved) qw_take_steps(n, a->sat, m);
    }
    counts->sat_solved += solved;
    qw_neighbourhood_forget(n);
    qw_scope_end(a->env);
    return solved;
}

uint32_t qw_repair_turning_numbers(qw_env *env, qw_offset_mesh *m, qw_inversion_counts *counts)
{
    assert(m->d && m->index && counts);
    qw_scope_begin(env);
    uint8_t *mark = QW_NEW(env, uint8_t, m->vertex_count);
    uint32_t left = qw_find_low_turning_numbers(env, m, mark);
    if (left > 0 && qw_sat_available()) {
        qw_neighbourhood n = qw_neighbourhood_make(env, m);
        cluster_repair a = {.env = env, .n = &n, .stamp = QW_NEW_ZERO(env, uint32_t, m->vertex_count)};
        uint32_t failures = 0;
        for (uint32_t v = 0; v < m->vertex_count && failures < MOST_FAILURES; v++) {
            if (!mark[v]) continue;
            bool solved = solve_around(&a, m, v, counts);
            left -= solved, failures += !solved;
        }
    }
    qw_scope_end(env);
    return left;
}
