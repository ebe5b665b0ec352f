#include "whole/open_path.h"

#include "geometry/loops.h"

#include <assert.h>
#include <string.h>

/* How far the two sides of a path are drawn apart, as a share of the way to the vertices beside it. */
static const float APART = 0.25f;

typedef struct path_search {
    qw_env *env;
    qw_quadmesh *m;
    uint8_t *odd, *used;    /* uint8_t[loops]: still to be changed; already on the way of the current one */
    uint8_t *leads;         /* uint8_t[loops]: from here loops that are not used lead to an odd one, or it is one */
    uint32_t *loop;         /* uint32_t[vertex_count]: the boundary loop that a vertex is on, or QW_NONE */
    uint32_t *out;          /* as of qw_quadmesh_outgoing */
    uint32_t *from, *queue; /* uint32_t[vertex_count]: the half-edge by which a vertex was reached; to be visited */
    uint32_t count;         /* in the queue */
} path_search;

static uint32_t *loops_of_vertices(qw_env *env, const qw_quadmesh *m, uint32_t *loops)
{
    uint32_t *loop = QW_NEW(env, uint32_t, m->vertex_count);
    memset(loop, 0xff, m->vertex_count * sizeof *loop);
    qw_rims rims = qw_find_rims(env, 4, m->twin, m->face_count);
    for (uint32_t l = 0; l < rims.count; l++)
        for (uint32_t i = rims.begin[l]; i < rims.begin[l + 1]; i++) loop[m->corner[rims.half[i]]] = l;
    *loops = rims.count;
    return loop;
}

/* The loops that a path may end on, the best first; and whether it may run along sharp edges. */
typedef struct end_kind {
    bool odd, features;
} end_kind;

static bool is_end(const path_search *s, uint32_t v, uint32_t from, const end_kind *w)
{
    uint32_t l = s->loop[v];
    return l != QW_NONE && l != from && (w->odd ? s->odd[l] : !s->used[l] && s->leads[l]);
}

/* The vertex at the other end of a shortest path of inner edges from loop `from`, or QW_NONE. */
static uint32_t find_path(path_search *s, uint32_t from, const end_kind *w)
{
    assert(s->loop && s->from && s->queue && w);
    const qw_quadmesh *m = s->m;
    s->count = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        s->from[v] = QW_NONE;
        if (s->loop[v] == from) s->queue[s->count++] = v;
    }
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t v = s->queue[i], start = s->out[v], h = start;
        do {
            uint32_t u = m->corner[qw_quad_next(h)];
            bool fresh = m->twin[h] != QW_NONE && s->from[u] == QW_NONE && s->loop[u] != from;
            if (fresh && is_end(s, u, from, w)) {
                s->from[u] = h;
                return u;
            }
            bool free = !m->kind || m->kind[u] == QW_VERTEX_FREE || w->features;
            if (fresh && free && s->loop[u] == QW_NONE) s->from[u] = h, s->queue[s->count++] = u;
            h = qw_quad_around(m, h);
        } while (h != QW_NONE && h != start);
    }
    return QW_NONE;
}

/* ---- drawing a path apart */

/* The half-edges that leave vertex k of the path on its right side, all of them: those get a vertex of their own.
   step: half-edges of the path. Returns how many. */
static uint32_t right_side(const qw_quadmesh *m, const uint32_t *step, uint32_t steps, uint32_t k, uint32_t *side)
{
    assert(steps > 0 && k <= steps);
    uint32_t count = 0;
    if (k == steps) { /* from the last edge on, counter-clockwise to the boundary */
        for (uint32_t g = m->twin[step[k - 1]]; g != QW_NONE; g = m->twin[qw_quad_prev(g)]) side[count++] = g;
        return count;
    }
    uint32_t last = k > 0 ? m->twin[step[k - 1]] : QW_NONE;
    for (uint32_t g = qw_quad_next(m->twin[step[k]]);; g = qw_quad_next(m->twin[g])) { /* clockwise */
        side[count++] = g;
        if (g == last || m->twin[g] == QW_NONE) return count;
    }
}

static qw_vec3 mean_head(const qw_quadmesh *m, const uint32_t *side, uint32_t count)
{
    qw_vec3 sum = qw_v3(0, 0, 0);
    for (uint32_t i = 0; i < count; i++)
        sum = qw_add(sum, qw_scale(qw_add(m->position[m->corner[qw_quad_next(side[i])]],
                                          m->position[m->corner[qw_quad_prev(side[i])]]),
                                   0.5f));
    return qw_scale(sum, 1.0f / (float)count);
}

static void glue(qw_quadmesh *m, uint32_t a, uint32_t b) { m->twin[a] = b, m->twin[b] = a; }

/* Quad k of the row: corners v(k+1), v(k), w(k), w(k+1), where the path's vertices v are doubled by w to its right. */
static void add_row(qw_quadmesh *m, const uint32_t *step, uint32_t steps, const uint32_t *doubled)
{
    for (uint32_t k = 0; k < steps; k++) {
        uint32_t h = step[k], right = m->twin[h], f = 4 * m->face_count++;
        m->corner[f] = m->corner[qw_quad_next(h)], m->corner[f + 1] = m->corner[h];
        m->corner[f + 2] = doubled[k], m->corner[f + 3] = doubled[k + 1];
        m->mark[f] = m->mark[h], m->mark[f + 2] = m->mark[right];
        m->twin[f + 1] = m->twin[f + 3] = QW_NONE;
        glue(m, f, h), glue(m, f + 2, right);
        if (k > 0) glue(m, f - 4 + 3, f + 1);
    }
}

/* Doubles the vertices along the path that ends at `end`, draws its two sides apart, and fills the gap with a row
 * of quads. */
static void draw_apart(path_search *s, uint32_t end)
{
    assert(end < s->m->vertex_count);
    qw_env *env = s->env;
    qw_quadmesh *m = s->m;
    uint32_t steps = 0, v = end;
    while (s->from[v] != QW_NONE) steps++, v = m->corner[s->from[v]];
    uint32_t *step = QW_NEW(env, uint32_t, steps), *doubled = QW_NEW(env, uint32_t, (size_t)steps + 1);
    v = end;
    for (uint32_t k = steps; k-- > 0; v = m->corner[step[k]]) step[k] = s->from[v];
    *m = qw_quadmesh_copy(env, m, steps + 1, steps);
    uint32_t *side = QW_NEW(env, uint32_t, 4 * (size_t)m->face_count),
             *begin = QW_NEW(env, uint32_t, (size_t)steps + 2);
    begin[0] = 0;
    for (uint32_t k = 0; k <= steps; k++) begin[k + 1] = begin[k] + right_side(m, step, steps, k, side + begin[k]);
    for (uint32_t k = 0; k <= steps; k++) {
        uint32_t of = m->corner[side[begin[k]]], w = doubled[k] = m->vertex_count++;
        qw_vec3 p = m->position[of], right = mean_head(m, side + begin[k], begin[k + 1] - begin[k]);
        m->position[w] = qw_lerp(p, right, APART);
        m->kind[w] = m->kind[of], m->component[w] = m->component[of];
    }
    for (uint32_t k = 0; k <= steps; k++)
        for (uint32_t i = begin[k]; i < begin[k + 1]; i++) m->corner[side[i]] = doubled[k];
    add_row(m, step, steps, doubled);
    qw_free(env, step), qw_free(env, doubled), qw_free(env, side), qw_free(env, begin);
}

/* ---- all loops */

/* Puts the vertices of the loop that v is on into the queue. */
static void enter_loop(path_search *s, uint32_t v)
{
    const qw_quadmesh *m = s->m;
    s->leads[s->loop[v]] = 1;
    for (; s->from[v] == QW_NONE; v = m->corner[qw_quad_next(s->out[v])]) { /* along the boundary */
        assert(m->twin[s->out[v]] == QW_NONE);
        s->from[v] = 0, s->queue[s->count++] = v;
    }
}

/* Sets s->leads: a way that stops at a loop whose neighbours are all used would have to turn back. */
static void find_leading(path_search *s, uint32_t from, uint32_t loops)
{
    const qw_quadmesh *m = s->m;
    memset(s->leads, 0, loops);
    memset(s->from, 0xff, m->vertex_count * sizeof *s->from);
    s->count = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (s->loop[v] != QW_NONE && s->loop[v] != from && s->odd[s->loop[v]]) enter_loop(s, v);
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t start = s->out[s->queue[i]], h = start;
        do {
            uint32_t u = m->corner[qw_quad_next(h)], l = s->loop[u];
            bool fresh = m->twin[h] != QW_NONE && s->from[u] == QW_NONE;
            if (fresh && l == QW_NONE) s->from[u] = h, s->queue[s->count++] = u;
            else if (fresh && !s->used[l]) enter_loop(s, u);
            h = qw_quad_around(m, h);
        } while (h != QW_NONE && h != start);
        assert(s->count <= m->vertex_count);
    }
}

/* Adds a row from an odd loop to another. */
static void add_one_row(path_search *s, uint32_t from, uint32_t loops)
{
    static const end_kind kinds[] = {{true, false}, {true, true}, {false, false}, {false, true}};
    const qw_quadmesh *m = s->m;
    s->out = qw_quadmesh_outgoing(s->env, m);
    s->from = QW_NEW(s->env, uint32_t, m->vertex_count), s->queue = QW_NEW(s->env, uint32_t, m->vertex_count);
    uint32_t end = QW_NONE;
    s->used[from] = 1;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds && end == QW_NONE; i++) {
        if (i == 2) find_leading(s, from, loops);
        end = find_path(s, from, &kinds[i]);
    }
    if (end == QW_NONE)
        qw_fail(s->env, QW_INTERNAL, -1, "a rim has an odd number of edges, and no other rim can be reached from it");
    uint32_t to = s->loop[end];
    assert(to < loops);
    s->odd[from] = 0, s->odd[to] ^= 1;
    draw_apart(s, end);
    qw_free(s->env, s->out), qw_free(s->env, s->from), qw_free(s->env, s->queue);
}

void qw_add_rows_between(qw_env *env, qw_quadmesh *quads, uint8_t *odd)
{
    assert(quads->twin && quads->mark && odd);
    path_search s = {.env = env, .m = quads, .odd = odd};
    uint32_t loops;
    s.loop = loops_of_vertices(env, quads, &loops);
    s.used = QW_NEW_ZERO(env, uint8_t, loops), s.leads = QW_NEW(env, uint8_t, loops);
    for (uint32_t l = 0; l < loops; l++) {
        if (!odd[l]) continue;
        memset(s.used, 0, loops);
        for (uint32_t at = l; at != QW_NONE;) {
            add_one_row(&s, at, loops);
            qw_free(env, s.loop);
            s.loop = loops_of_vertices(env, quads, &loops);
            uint32_t next = QW_NONE; /* the loop that became odd by this row */
            for (uint32_t k = 0; k < loops && next == QW_NONE; k++)
                if (odd[k] && s.used[k] == 0 && k < l) next = k;
            at = next;
        }
    }
    qw_free(env, s.loop), qw_free(env, s.used), qw_free(env, s.leads);
}
