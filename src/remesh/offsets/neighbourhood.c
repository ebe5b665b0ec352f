#include "remesh/offsets/neighbourhood.h"

#include <assert.h>
#include <string.h>

/* Step 0 is to stay. */
static const qw_int2 steps[QW_STEPS] = {{0, 0}, {1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}};

qw_neighbourhood qw_neighbourhood_make(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->twin && m->d);
    qw_neighbourhood n = {.m = m, .outgoing = qw_offset_outgoing(env, m)};
    n.number = QW_NEW(env, uint32_t, m->vertex_count);
    n.vertex = QW_NEW(env, uint32_t, m->vertex_count);
    n.face = QW_NEW(env, uint32_t, m->face_count);
    n.turns = QW_NEW_ZERO(env, qw_corner_turns, m->face_count);
    n.face_in = QW_NEW_ZERO(env, uint8_t, m->face_count);
    n.star.capacity = 64;
    n.star.out = QW_NEW(env, uint32_t, n.star.capacity);
    n.star.turn = QW_NEW(env, uint8_t, n.star.capacity);
    memset(n.number, 0xff, m->vertex_count * sizeof *n.number);
    return n;
}

/* Adds v and the triangles around it, unless it is there already, has a cone or may not move. */
static void add_vertex(qw_env *env, qw_neighbourhood *n, uint32_t v)
{
    assert(v < n->m->vertex_count);
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

void qw_neighbourhood_grow(qw_env *env, qw_neighbourhood *n, uint32_t seed, uint32_t radius)
{
    assert(radius > 0);
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

void qw_neighbourhood_forget(qw_neighbourhood *n)
{
    for (uint32_t i = 0; i < n->count; i++) n->number[n->vertex[i]] = QW_NONE;
    for (uint32_t k = 0; k < n->face_count; k++) n->face_in[n->face[k]] = 0;
    n->count = n->face_count = 0;
}

int qw_denies(const qw_neighbourhood *n, uint32_t v, int k)
{
    assert(v < n->m->vertex_count && k >= 0 && k < QW_STEPS);
    if (n->number[v] == QW_NONE) return 0;
    int base = QW_STEPS * (int)n->number[v] + 1;
    return k == 0 ? base : -(base + k);
}

static qw_int2 step_in_face(const qw_neighbourhood *n, uint32_t h, int k)
{
    return k == 0 ? (qw_int2){0, 0} : qw_turn(n->turns[h / 3].turn[h % 3], steps[k]);
}

qw_int2 qw_along_after(const qw_neighbourhood *n, uint32_t h, int tail, int head)
{
    assert(tail >= 0 && tail < QW_STEPS && head >= 0 && head < QW_STEPS);
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

void qw_neighbourhood_clause(qw_sat *sat, const int *literals, int count)
{
    int clause[3];
    uint32_t length = 0;
    for (int i = 0; i < count; i++)
        if (literals[i]) clause[length++] = literals[i];
    qw_sat_clause(sat, clause, length);
}

/* A vertex that moves takes exactly one of its steps. */
static void add_vertex_clauses(const qw_neighbourhood *n, qw_sat *sat)
{
    for (uint32_t i = 0; i < n->count; i++) {
        int base = QW_STEPS * (int)i + 1, some[QW_STEPS];
        some[0] = -base; /* "it moves" implies one of the steps */
        for (int k = 1; k < QW_STEPS; k++) some[k] = base + k;
        qw_sat_clause(sat, some, QW_STEPS);
        for (int k = 1; k < QW_STEPS; k++) {
            qw_sat_clause(sat, (int[]){-(base + k), base}, 2);
            for (int j = 1; j < k; j++) qw_sat_clause(sat, (int[]){-(base + k), -(base + j)}, 2);
        }
    }
}

static void add_edge_clauses(const qw_neighbourhood *n, qw_sat *sat, uint32_t h)
{
    assert(h < 3 * n->m->face_count);
    uint32_t t = n->m->twin[h], u = n->m->corner[h], v = n->m->corner[qw_next(h)];
    if (t != QW_NONE && t < h && n->face_in[t / 3]) return; /* its other half-edge has given this clause */
    for (int a = 0; a < qw_step_count(n, u); a++)
        for (int b = 0; b < qw_step_count(n, v); b++)
            if (!edge_allowed(n->m, h, qw_along_after(n, h, a, b)))
                qw_neighbourhood_clause(sat, (int[]){qw_denies(n, u, a), qw_denies(n, v, b)}, 2);
}

/* No three steps together invert triangle f; those are left out that lead to long edges, which are ruled out
 * elsewhere. */
static void add_face_clauses(const qw_neighbourhood *n, qw_sat *sat, uint32_t f)
{
    assert(f < n->m->face_count);
    uint32_t h = 3 * f, u = n->m->corner[h], v = n->m->corner[h + 1], w = n->m->corner[h + 2];
    for (int a = 0; a < qw_step_count(n, u); a++)
        for (int b = 0; b < qw_step_count(n, v); b++) {
            qw_int2 uv = qw_along_after(n, h, a, b);
            if (qw_int2_norm(uv) > 1) continue;
            for (int c = 0; c < qw_step_count(n, w); c++) {
                qw_int2 vw = qw_along_after(n, h + 1, b, c);
                if (qw_int2_norm(vw) > 1 || qw_int2_norm(qw_int2_add(uv, vw)) > 1) continue;
                if (qw_int2_det(uv, vw) < 0)
                    qw_neighbourhood_clause(sat, (int[]){qw_denies(n, u, a), qw_denies(n, v, b), qw_denies(n, w, c)},
                                            3);
            }
        }
}

void qw_neighbourhood_forbid_inversions(const qw_neighbourhood *n, qw_sat *sat)
{
    add_vertex_clauses(n, sat);
    for (uint32_t k = 0; k < n->face_count; k++) {
        for (uint32_t h = 3 * n->face[k]; h < 3 * n->face[k] + 3; h++) add_edge_clauses(n, sat, h);
        add_face_clauses(n, sat, n->face[k]);
    }
}

int qw_taken_step(const qw_neighbourhood *n, const qw_sat *sat, uint32_t v)
{
    assert(v < n->m->vertex_count);
    int taken = 0;
    for (int s = 1; s < qw_step_count(n, v); s++)
        if (qw_sat_value(sat, -qw_denies(n, v, s))) taken = s;
    return taken;
}

void qw_take_steps(const qw_neighbourhood *n, const qw_sat *sat, qw_offset_mesh *m)
{
    assert(m->vertex_count == n->m->vertex_count);
    /* each edge is seen once, so no vector is read after it was changed */
    for (uint32_t k = 0; k < n->face_count; k++)
        for (uint32_t h = 3 * n->face[k]; h < 3 * n->face[k] + 3; h++) {
            uint32_t t = m->twin[h];
            if (t != QW_NONE && t < h && n->face_in[t / 3]) continue;
            int tail = qw_taken_step(n, sat, m->corner[h]), head = qw_taken_step(n, sat, m->corner[qw_next(h)]);
            if (tail || head) m->d[m->edge[h]] = qw_turn(4u - m->rot[h], qw_along_after(n, h, tail, head));
        }
}
