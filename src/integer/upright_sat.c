/* Eq. (4) by satisfiability (paper, Section 3.4), with one change to the paper's encoding. The paper gives every edge nine Booleans, one a value of
 * its offset, and adds Eq. (3) as clauses. Inside a disc offsets that satisfy Eq. (3) are differences of vertex positions, so we give every
 * vertex nine instead, one a step it may take; Eq. (3) then holds by itself, there are a third of the variables, and 81 clauses an edge
 * stand for 729 a triangle. Vertices with a cone and vertices outside the neighbourhood stay.
 *
 * Variables of the i-th vertex of the neighbourhood: 9 i + 1 "it moves", 9 i + 1 + k "it takes step k", k = 1..8. All variables start out
 * false in the solver, so it tries first to leave things as they are.
 */
#include "integer/upright.h"

#include "solve/sat.h"

#include <string.h>

/* Where so many of the largest neighbourhoods have no answer the offsets are past mending, as in parts far thinner than a quad: such parts are made anew. */
enum { STEPS = 9, CONFLICTS = 2000, MOST_FAILURES = 64 };

/* Rings around the inverted triangle, tried in turn. */
static const uint32_t radii[] = {1, 2, 4, 7};

/* Step 0 is to stay. */
static const qw_int2 steps[STEPS] = {{0, 0}, {1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}};

typedef struct corner_turns {
    uint8_t turn[3]; /* quarter turns from the frame of the corner's star to the triangle's */
} corner_turns;

typedef struct neighbourhood {
    const qw_offset_mesh *m;
    const uint32_t *outgoing;
    uint32_t *number; /* [V] place in `vertex`, or QW_NONE */
    uint32_t *vertex; /* [count] */
    uint32_t count;
    uint32_t *face; /* [face_count] triangles with at least one vertex in the neighbourhood */
    uint32_t face_count;
    corner_turns *turns; /* [F], valid for the corners that are in */
    uint8_t *face_in;    /* [F] */
    uint8_t *given_up;   /* [F] was in a neighbourhood of the largest radius that has no answer */
    qw_star star;
} neighbourhood;

static void add_vertex(qw_env *env, neighbourhood *n, uint32_t v)
{
    if (n->number[v] != QW_NONE || n->m->index[v] != 0) return;
    qw_star_at(env, n->m, n->outgoing[v], &n->star);
    if (!n->star.movable) return;
    n->number[v] = n->count;
    n->vertex[n->count++] = v;
    for (uint32_t i = 0; i < n->star.count; i++) {
        uint32_t h = n->star.out[i], f = h / 3;
        n->turns[f].turn[h % 3] = n->star.turn[i];
        if (!n->face_in[f]) n->face_in[f] = 1, n->face[n->face_count++] = f;
    }
}

/* All vertices within `radius` rings of the triangle, through any vertex. */
static void grow(qw_env *env, neighbourhood *n, uint32_t seed, uint32_t radius)
{
    for (uint32_t i = 0; i < 3; i++) add_vertex(env, n, n->m->corner[3 * seed + i]);
    if (!n->face_in[seed]) n->face_in[seed] = 1, n->face[n->face_count++] = seed;
    for (uint32_t ring = 0; ring < radius; ring++) {
        uint32_t faces = n->face_count;
        for (uint32_t k = 0; k < faces; k++)
            for (uint32_t i = 0; i < 3; i++) {
                uint32_t h = 3 * n->face[k] + i, t = n->m->twin[h];
                add_vertex(env, n, n->m->corner[h]);
                if (t != QW_NONE) add_vertex(env, n, n->m->corner[qw_prev(t)]);
            }
    }
}

static void forget(neighbourhood *n)
{
    for (uint32_t i = 0; i < n->count; i++) n->number[n->vertex[i]] = QW_NONE;
    for (uint32_t k = 0; k < n->face_count; k++) n->face_in[n->face[k]] = 0;
    n->count = n->face_count = 0;
}

/* The literal that is false exactly when vertex v takes step k; 0 where the vertex cannot move (then only k = 0 happens). */
static int denies(const neighbourhood *n, uint32_t v, int k)
{
    if (n->number[v] == QW_NONE) return 0;
    int base = (int)(STEPS * n->number[v]) + 1;
    return k == 0 ? base : -(base + k);
}

static int step_count(const neighbourhood *n, uint32_t v) { return n->number[v] == QW_NONE ? 1 : STEPS; }

static qw_int2 step_in_face(const neighbourhood *n, uint32_t h, int k)
{
    return k == 0 ? (qw_int2){0, 0} : qw_turn(n->turns[h / 3].turn[h % 3], steps[k]);
}

/* The vector along h, in its triangle's frame, when tail and head take their steps. */
static qw_int2 along_after(const neighbourhood *n, uint32_t h, int tail, int head)
{
    qw_int2 d = qw_offset_along(n->m, h);
    return qw_int2_sub(qw_int2_add(d, step_in_face(n, qw_next(h), head)), step_in_face(n, h, tail));
}

static bool edge_allowed(const qw_offset_mesh *m, uint32_t h, qw_int2 along)
{
    if (qw_int2_norm(along) > 1) return false;
    uint8_t fixed = m->fixed[m->edge[h]];
    qw_int2 d = qw_turn(4u - m->rot[h], along);
    return !((fixed & QW_FIXED_X) && d.x) && !((fixed & QW_FIXED_Y) && d.y);
}

static void add_clause(qw_sat *sat, const int *denials, int count)
{
    int clause[3];
    uint32_t length = 0;
    for (int i = 0; i < count; i++)
        if (denials[i]) clause[length++] = denials[i];
    qw_sat_clause(sat, clause, length);
}

static void add_vertex_clauses(const neighbourhood *n, qw_sat *sat)
{
    for (uint32_t i = 0; i < n->count; i++) {
        int base = (int)(STEPS * i) + 1, some[STEPS];
        some[0] = -base; /* moving means some step */
        for (int k = 1; k < STEPS; k++) some[k] = base + k;
        qw_sat_clause(sat, some, STEPS);
        for (int k = 1; k < STEPS; k++) {
            qw_sat_clause(sat, (int[]){-(base + k), base}, 2);
            for (int j = 1; j < k; j++) qw_sat_clause(sat, (int[]){-(base + k), -(base + j)}, 2);
        }
    }
}

static void add_edge_clauses(const neighbourhood *n, qw_sat *sat, uint32_t h)
{
    uint32_t t = n->m->twin[h], u = n->m->corner[h], v = n->m->corner[qw_next(h)];
    if (t != QW_NONE && t < h && n->face_in[t / 3]) return; /* said from the other side */
    for (int a = 0; a < step_count(n, u); a++)
        for (int b = 0; b < step_count(n, v); b++)
            if (!edge_allowed(n->m, h, along_after(n, h, a, b))) add_clause(sat, (int[]){denies(n, u, a), denies(n, v, b)}, 2);
}

static void add_face_clauses(const neighbourhood *n, qw_sat *sat, uint32_t f)
{
    uint32_t h = 3 * f, u = n->m->corner[h], v = n->m->corner[h + 1], w = n->m->corner[h + 2];
    for (int a = 0; a < step_count(n, u); a++)
        for (int b = 0; b < step_count(n, v); b++) {
            qw_int2 uv = along_after(n, h, a, b);
            if (qw_int2_norm(uv) > 1) continue;
            for (int c = 0; c < step_count(n, w); c++) {
                qw_int2 vw = along_after(n, h + 1, b, c);
                if (qw_int2_norm(vw) > 1 || qw_int2_norm(qw_int2_add(uv, vw)) > 1) continue;
                if (qw_int2_det(uv, vw) < 0) add_clause(sat, (int[]){denies(n, u, a), denies(n, v, b), denies(n, w, c)}, 3);
            }
        }
}

static void take_steps(neighbourhood *n, const qw_sat *sat, qw_offset_mesh *m)
{
    /* all vectors first, as they are read from the old offsets */
    for (uint32_t k = 0; k < n->face_count; k++)
        for (uint32_t h = 3 * n->face[k]; h < 3 * n->face[k] + 3; h++) {
            uint32_t t = m->twin[h], ends[2] = {m->corner[h], m->corner[qw_next(h)]};
            if (t != QW_NONE && t < h && n->face_in[t / 3]) continue;
            int taken[2] = {0, 0};
            for (int i = 0; i < 2; i++)
                for (int s = 1; s < step_count(n, ends[i]); s++)
                    if (qw_sat_value(sat, -denies(n, ends[i], s))) taken[i] = s;
            if (taken[0] || taken[1]) m->d[m->edge[h]] = qw_turn(4u - m->rot[h], along_after(n, h, taken[0], taken[1]));
        }
}

static bool solve_around(qw_env *env, qw_offset_mesh *m, neighbourhood *n, uint32_t seed, uint32_t radius, qw_upright_counts *counts)
{
    qw_scope_begin(env);
    grow(env, n, seed, radius);
    qw_sat *sat = qw_sat_begin(env);
    add_vertex_clauses(n, sat);
    for (uint32_t k = 0; k < n->face_count; k++) {
        for (uint32_t h = 3 * n->face[k]; h < 3 * n->face[k] + 3; h++) add_edge_clauses(n, sat, h);
        add_face_clauses(n, sat, n->face[k]);
    }
    bool solved = qw_sat_solve(sat, CONFLICTS) == QW_SAT_YES;
    counts->sat_calls++;
    counts->sat_solved += solved;
    counts->sat_conflicts += qw_sat_conflicts(sat);
    if (solved) take_steps(n, sat, m);
    if (!solved && radius == radii[sizeof radii / sizeof *radii - 1])
        for (uint32_t k = 0; k < n->face_count; k++) n->given_up[n->face[k]] = 1;
    forget(n);
    qw_scope_end(env);
    return solved;
}

void qw_upright_sat(qw_env *env, qw_offset_mesh *m, qw_upright_counts *counts)
{
    if (!qw_sat_available() || counts->inverted_after == 0) return;
    qw_scope_begin(env);
    neighbourhood n = {.m = m, .outgoing = qw_offset_outgoing(env, m)};
    n.number = QW_NEW(env, uint32_t, m->vertex_count);
    n.vertex = QW_NEW(env, uint32_t, m->vertex_count);
    n.face = QW_NEW(env, uint32_t, m->face_count);
    n.turns = QW_NEW_ZERO(env, corner_turns, m->face_count);
    n.face_in = QW_NEW_ZERO(env, uint8_t, m->face_count);
    n.given_up = QW_NEW_ZERO(env, uint8_t, m->face_count);
    n.star.capacity = 64;
    n.star.out = QW_NEW(env, uint32_t, n.star.capacity);
    n.star.turn = QW_NEW(env, uint8_t, n.star.capacity);
    memset(n.number, 0xff, m->vertex_count * sizeof *n.number);
    uint32_t failures = 0;
    for (uint32_t f = 0; f < m->face_count && failures < MOST_FAILURES; f++)
        for (size_t r = 0; r < sizeof radii / sizeof *radii && !n.given_up[f] && qw_offset_det(m, f) < 0; r++) {
            qw_progress(env, (double)f / m->face_count);
            bool solved = solve_around(env, m, &n, f, radii[r], counts);
            failures += !solved && radii[r] == radii[sizeof radii / sizeof *radii - 1];
        }
    counts->inverted_after = 0;
    for (uint32_t f = 0; f < m->face_count; f++) counts->inverted_after += qw_offset_det(m, f) < 0;
    qw_scope_end(env);
}
