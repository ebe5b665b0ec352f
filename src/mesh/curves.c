/* Curve edges are looked at in pairs that an edge of the mesh connects, as the mesh is about as fine as curves may be
 * close. They are gathered to chains that end where curves meet or turn sharply; the weaker chain of a pair gives way,
 * so that it is always the same of two curves. */
#include "mesh/curves.h"

#include "base/constants.h"
#include "base/sets.h"

#include <assert.h>
#include <string.h>

static const float PARALLEL =
    0.92387953f; /* cosine of a quarter of a right angle: wider sectors are kept open, see hierarchy/sectors.c */
static const float CLOSE = 0.4f;    /* of `least`: below a fifth of an edge a row of quads would be too thin; see
                                       integer/narrow_bands.h for wider ones */
static const float OVERLAP = 0.25f; /* of the shorter edge that must lie beside the other */
enum { ROUNDS = 4 };                /* of taking off what is left too short */

typedef struct curves {
    qw_trimesh *mesh;
    const uint32_t *outgoing;
    uint32_t *degree; /* uint32_t[vertex_count], curve edges */
    /* uint32_t[3 face_count], of a curve edge: the lowest half-edge of its chain; equal on both sides */
    uint32_t *chain;
    float *strength; /* float[3 face_count], of the chain at its lowest half-edge */
    float *length;   /* the same */
    uint32_t *end;   /* uint32_t[2][3 face_count], the same: vertices where the chain ends, or QW_NONE */
    uint8_t *lost;   /* uint8_t[3 face_count] */
} curves;

static bool is_curve(const qw_trimesh *mesh, uint32_t h) { return qw_is_curve_edge(mesh, h, true); }
static uint32_t lower(const qw_trimesh *mesh, uint32_t h)
{
    uint32_t t = mesh->twin[h];
    return t < h ? t : h;
}
static qw_vec3 along(const qw_trimesh *mesh, uint32_t h)
{
    return qw_sub(mesh->position[mesh->corner[qw_next(h)]], mesh->position[mesh->corner[h]]);
}

/* ---- chains */

/* The half-edges that leave v along curves, at most two; those into v on the boundary count through their edge. */
static uint32_t curve_edges_at(const curves *c, uint32_t v, uint32_t edge[2], qw_vec3 away[2])
{
    assert(v < c->mesh->vertex_count);
    const qw_trimesh *mesh = c->mesh;
    uint32_t count = 0, h = c->outgoing[v];
    do {
        uint32_t sides[2] = {h, qw_prev(h)};
        bool last = mesh->twin[sides[1]] == QW_NONE;
        for (int i = 0; i < (last ? 2 : 1); i++) {
            if (!is_curve(mesh, sides[i])) continue;
            if (count < 2)
                edge[count] = lower(mesh, sides[i]), away[count] = qw_scale(along(mesh, sides[i]), i ? -1.0f : 1.0f);
            count++;
        }
        h = qw_around(mesh, h);
    } while (h != QW_NONE && h != c->outgoing[v]);
    return count;
}

static bool goes_through(const curves *c, uint32_t v, const qw_vec3 away[2])
{
    return c->degree[v] == 2 && qw_dot(qw_normalize(away[0]), qw_normalize(away[1])) <= -(float)QW_THROUGH_COSINE;
}

/* Chains that leave one corner side by side are an acute corner, which is for integer/acute_corners.h: one of them
 * gives way there, but only near the corner. */
static bool share_an_end(const curves *c, uint32_t a, uint32_t b)
{
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++)
            if (c->end[2 * a + (uint32_t)i] != QW_NONE && c->end[2 * a + (uint32_t)i] == c->end[2 * b + (uint32_t)k])
                return true;
    return false;
}

static void find_ends(curves *c)
{
    assert(c->end && c->chain);
    const qw_trimesh *mesh = c->mesh;
    memset(c->end, 0xff, (size_t)6 * mesh->face_count * sizeof *c->end);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!is_curve(mesh, h) || lower(mesh, h) != h) continue;
        uint32_t at[2] = {mesh->corner[h], mesh->corner[qw_next(h)]}, *end = c->end + 2 * (size_t)c->chain[h];
        for (int i = 0; i < 2; i++) {
            uint32_t edge[2];
            qw_vec3 away[2];
            curve_edges_at(c, at[i], edge, away);
            if (!goes_through(c, at[i], away)) end[end[0] != QW_NONE] = at[i];
        }
    }
}

static void gather_chains(curves *c)
{
    const qw_trimesh *mesh = c->mesh;
    uint32_t corners = 3 * mesh->face_count;
    for (uint32_t h = 0; h < corners; h++) c->chain[h] = lower(mesh, h);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        uint32_t edge[2];
        qw_vec3 away[2];
        c->degree[v] = curve_edges_at(c, v, edge, away);
        if (!goes_through(c, v, away)) continue;
        qw_join_sets(c->chain, edge[0], edge[1]);
    }
    memset(c->strength, 0, corners * sizeof *c->strength), memset(c->length, 0, corners * sizeof *c->length);
    for (uint32_t h = 0; h < corners; h++) {
        if (!is_curve(mesh, h) || lower(mesh, h) != h) continue;
        uint32_t r = c->chain[h] = qw_set_of(c->chain, h), t = mesh->twin[h];
        float length = qw_length(along(mesh, h));
        qw_vec3 n = qw_normalize(qw_face_cross(mesh, h / 3));
        c->length[r] += length;
        c->strength[r] += t == QW_NONE ? INFINITY : length * (1 - qw_dot(n, qw_normalize(qw_face_cross(mesh, t / 3))));
    }
    for (uint32_t h = 0; h < corners; h++) c->chain[h] = c->chain[lower(mesh, h)];
    find_ends(c);
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

static void compare(const curves *c, uint32_t a, uint32_t b, float least)
{
    uint32_t ra = c->chain[a], rb = c->chain[b];
    if (ra == rb || share_an_end(c, ra, rb) || !side_by_side(c->mesh, a, b, least)) return;
    bool a_gives = c->strength[ra] < c->strength[rb] || (c->strength[ra] == c->strength[rb] && ra > rb);
    uint32_t weaker = a_gives ? a : b;
    if (c->mesh->twin[weaker] != QW_NONE) c->lost[weaker] = c->lost[c->mesh->twin[weaker]] = 1;
}

/* All curve edges at one end of h against all at the other. */
static void compare_ends(const curves *c, uint32_t h, float least)
{
    assert(h < 3 * c->mesh->face_count);
    const qw_trimesh *mesh = c->mesh;
    uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)], i = c->outgoing[u];
    do {
        for (int side = 0; side < 2; side++) { /* the incoming one too, for the last of an open fan */
            uint32_t a = side ? qw_prev(i) : i;
            if (!is_curve(mesh, a) || (side && mesh->twin[a] != QW_NONE)) continue;
            uint32_t j = c->outgoing[v];
            do {
                if (is_curve(mesh, j)) compare(c, a, j, least);
                if (mesh->twin[qw_prev(j)] == QW_NONE) compare(c, a, qw_prev(j), least);
                j = qw_around(mesh, j);
            } while (j != QW_NONE && j != c->outgoing[v]);
        }
        i = qw_around(mesh, i);
    } while (i != QW_NONE && i != c->outgoing[u]);
}

/* ---- pieces */

/* Chains with loose ends that the quads would meet with less than half an edge an end. `loose` counts the ends of each
 * chain. */
static void lose_pieces(curves *c, uint32_t *loose, const float *least)
{
    const qw_trimesh *mesh = c->mesh;
    uint32_t corners = 3 * mesh->face_count;
    memset(loose, 0, corners * sizeof *loose);
    for (uint32_t h = 0; h < corners; h++)
        if (mesh->twin[h] != QW_NONE && mesh->mark[h]) loose[c->chain[h]] += c->degree[mesh->corner[h]] == 1;
    for (uint32_t h = 0; h < corners; h++) {
        if (mesh->twin[h] == QW_NONE || !mesh->mark[h]) continue;
        uint32_t r = c->chain[h];
        c->lost[h] = c->length[r] < 2 * least[mesh->corner[lower(mesh, h)]] * (float)loose[r];
    }
}

static int64_t take_off(curves *c)
{
    int64_t count = 0;
    for (uint32_t h = 0; h < 3 * c->mesh->face_count; h++) {
        if (!c->lost[h] || !c->mesh->mark[h]) continue;
        c->mesh->mark[h] = 0;
        count++;
    }
    memset(c->lost, 0, (size_t)3 * c->mesh->face_count);
    return count / 2;
}

int64_t qw_drop_close_curves(qw_env *env, qw_trimesh *mesh, const float *least)
{
    assert(mesh->twin && least);
    if (!mesh->mark) return 0;
    qw_scope_begin(env);
    size_t corners = (size_t)3 * mesh->face_count;
    curves c = {.mesh = mesh, .outgoing = qw_trimesh_outgoing(env, mesh)};
    c.degree = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count), c.chain = QW_NEW(env, uint32_t, corners);
    c.strength = QW_NEW(env, float, corners), c.length = QW_NEW(env, float, corners),
    c.lost = QW_NEW_ZERO(env, uint8_t, corners);
    c.end = QW_NEW(env, uint32_t, 2 * corners);
    gather_chains(&c);
    for (uint32_t h = 0; h < corners; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        if (c.degree[u] && c.degree[v] && lower(mesh, h) == h) compare_ends(&c, h, CLOSE * fminf(least[u], least[v]));
    }
    int64_t dropped = take_off(&c), pieces = dropped;
    uint32_t *loose = QW_NEW(env, uint32_t, corners);
    for (int round = 0; round < ROUNDS && pieces > 0; round++) {
        gather_chains(&c);
        lose_pieces(&c, loose, least);
        dropped += pieces = take_off(&c);
    }
    qw_scope_end(env);
    return dropped;
}
