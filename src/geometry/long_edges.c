/* All long edges are cut at their middles at once, and each triangle is parted as its cut sides ask. This is done again
 * until no edge is long. A triangle is turned so that its sides are as one of five parts has them. */
#include "geometry/long_edges.h"

#include "base/constants.h"

#include <assert.h>
#include <string.h>

/* Halvings after which no edge of single precision can be long. */
enum { MOST_ROUNDS = 300, MOST_PIECES = 4 };

/* How a triangle is parted. Its corners are 0, 1, 2; side k goes from corner k to the next, and its middle is 3 + k. A
   half-edge of the pieces is 3 piece + k. */
typedef struct parting {
    uint8_t pieces;
    uint8_t corner[3 * MOST_PIECES];
    int8_t inner[3 * MOST_PIECES]; /* the half-edge across, or -1 on the rim */
    uint8_t rim[3][2];             /* the half-edges along each side: of a cut one, from its tail and to its head */
} parting;

enum { WHOLE, ONE_CUT, TWO_CUT_FROM_CORNER, TWO_CUT_FROM_MIDDLE, ALL_CUT };

static const parting PARTING[] = {
    [WHOLE] = {1, {0, 1, 2}, {-1, -1, -1}, {{0, 0}, {1, 1}, {2, 2}}},
    /* side 0 */
    [ONE_CUT] = {2, {0, 3, 2, 3, 1, 2}, {-1, 5, -1, -1, -1, 1}, {{0, 3}, {4, 4}, {2, 2}}},
    /* sides 0 and 1, and from corner 0 to the middle across */
    [TWO_CUT_FROM_CORNER] = {3,
                             {3, 1, 4, 0, 3, 4, 0, 4, 2},
                             {-1, -1, 4, -1, 2, 6, 5, -1, -1},
                             {{3, 0}, {1, 7}, {8, 8}}},
    /* sides 0 and 1, and from the middle of side 0 to corner 2 */
    [TWO_CUT_FROM_MIDDLE] = {3,
                             {3, 1, 4, 0, 3, 2, 3, 4, 2},
                             {-1, -1, 6, -1, 8, -1, 2, -1, 4},
                             {{3, 0}, {1, 7}, {5, 5}}},
    [ALL_CUT] = {4,
                 {0, 3, 5, 1, 4, 3, 2, 5, 4, 3, 4, 5},
                 {-1, 11, -1, -1, 9, -1, -1, 10, -1, 4, 7, 1},
                 {{0, 5}, {3, 8}, {6, 2}}},
};

typedef struct halving {
    const qw_trimesh *m;
    qw_trimesh to;
    float longest;
    uint32_t middles; /* long edges */
    uint32_t *middle; /* uint32_t[3 face_count]: vertex of `to` in the middle of a cut half-edge, or QW_NONE */
    uint8_t *kind;    /* uint8_t[face_count]: of PARTING */
    uint8_t *turn;    /* uint8_t[face_count]: the side that is side 0 there */
    uint32_t *first;  /* uint32_t[face_count + 1]: the first piece of each triangle */
} halving;

static bool leads(const qw_trimesh *m, uint32_t h) { return m->twin[h] == QW_NONE || h < m->twin[h]; }

static void find_long(void *user, uint32_t begin, uint32_t end)
{
    const halving *t = user;
    for (uint32_t h = 3 * begin; h < 3 * end; h++)
        t->middle[h] = leads(t->m, h) && qw_length2(qw_edge_way(t->m, h)) > t->longest * t->longest ? 0 : QW_NONE;
}

/* Numbers and counts the middles, in the order of their half-edges. */
static void number_middles(halving *t)
{
    for (uint32_t h = 0; h < 3 * t->m->face_count; h++) {
        if (!leads(t->m, h)) t->middle[h] = t->middle[t->m->twin[h]];
        else if (t->middle[h] != QW_NONE) t->middle[h] = t->m->vertex_count + t->middles++;
    }
}

static uint32_t side_of(const halving *t, uint32_t f, uint32_t side) { return 3 * f + (side + t->turn[f]) % 3; }

static qw_vec3 middle_of(const qw_trimesh *m, uint32_t h)
{
    if (!leads(m, h)) h = m->twin[h];
    return qw_lerp(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]], 0.5f);
}

/* How each triangle is cut, by which of its edges get a middle: with two of them along the shorter diagonal. */
static void choose_parting(void *user, uint32_t begin, uint32_t end)
{
    const halving *t = user;
    for (uint32_t f = begin; f < end; f++) {
        unsigned cut = 0, count = 0;
        for (uint32_t k = 0; k < 3; k++)
            if (t->middle[3 * f + k] != QW_NONE) cut |= 1u << k, count++;
        t->turn[f] = 0;
        t->kind[f] = count == 3 ? ALL_CUT : count == 1 ? ONE_CUT : WHOLE;
        while (count < 3 && count > 0 && !((cut >> t->turn[f]) & 1u)) t->turn[f]++;
        if (count == 2) { /* side 0 and the next */
            if (cut == 5) t->turn[f] = 2;
            const qw_vec3 *p = t->m->position;
            float corner2 = qw_length2(qw_sub(p[t->m->corner[side_of(t, f, 0)]], middle_of(t->m, side_of(t, f, 1)))),
                  middle2 = qw_length2(qw_sub(p[t->m->corner[side_of(t, f, 2)]], middle_of(t->m, side_of(t, f, 0))));
            t->kind[f] = corner2 <= middle2 ? TWO_CUT_FROM_CORNER : TWO_CUT_FROM_MIDDLE;
        }
    }
}

/* The half-edge of the pieces along half-edge h, or along its part next to its tail (0) or head (1). */
static inline uint32_t along(const halving *t, uint32_t h, uint32_t part)
{
    uint32_t f = h / 3, kind = t->kind[f];
    if (kind == WHOLE) return 3 * t->first[f] + h - 3 * f;
    uint32_t side = (h + 3 - t->turn[f]) % 3;
    return 3 * t->first[f] + PARTING[kind].rim[side][part];
}

static void copy_face(const halving *t, uint32_t f)
{
    for (uint32_t h = 3 * f, to = 3 * t->first[f]; h < 3 * f + 3; h++, to++) {
        uint32_t other = t->m->twin[h];
        t->to.corner[to] = t->m->corner[h], t->to.twin[to] = other == QW_NONE ? QW_NONE : along(t, other, 0);
        if (t->to.mark) t->to.mark[to] = t->m->mark[h];
    }
}

/* The pieces of triangle f, by the table: corners, twins, marks, and the middles of edges that it owns. */
static void part_face(const halving *t, uint32_t f)
{
    const parting *p = &PARTING[t->kind[f]];
    uint32_t base = 3 * t->first[f], side[3], vertex[6]; /* vertices as PARTING numbers them */
    for (uint32_t k = 0; k < 3; k++) {
        side[k] = side_of(t, f, k);
        vertex[k] = t->m->corner[side[k]], vertex[3 + k] = t->middle[side[k]];
    }
    for (uint32_t j = 0; j < 3u * p->pieces; j++) {
        t->to.corner[base + j] = vertex[p->corner[j]];
        if (p->inner[j] >= 0) t->to.twin[base + j] = base + (uint32_t)p->inner[j];
        if (t->to.mark) t->to.mark[base + j] = 0;
    }
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t h = side[k], other = t->m->twin[h];
        bool is_cut = vertex[3 + k] != QW_NONE;
        for (uint32_t part = 0; part <= is_cut; part++) {
            uint32_t to = base + p->rim[k][part];
            t->to.twin[to] = other == QW_NONE ? QW_NONE : along(t, other, is_cut && part == 0);
            if (t->to.mark) t->to.mark[to] = t->m->mark[h];
        }
        if (is_cut && leads(t->m, h)) t->to.position[vertex[3 + k]] = middle_of(t->m, h);
    }
}

static void part_faces(void *user, uint32_t begin, uint32_t end)
{
    const halving *t = user;
    for (uint32_t f = begin; f < end; f++) {
        if (t->kind[f] == WHOLE) copy_face(t, f);
        else part_face(t, f);
    }
}

/* The pieces of all triangles, or 0 where there would be more than `most`. */
static uint32_t count_pieces(const halving *t, uint32_t most)
{
    uint64_t count = 0;
    for (uint32_t f = 0; f < t->m->face_count; f++) {
        t->first[f] = (uint32_t)count;
        count += PARTING[t->kind[f]].pieces;
        if (count > most) return 0;
    }
    return (uint32_t)count;
}

/* Cuts all long edges once. Returns false where there is none (t->middles is 0), or there would be too many faces. */
static bool halve(qw_env *env, halving *t, uint32_t most)
{
    const qw_trimesh *m = t->m;
    uint32_t faces = m->face_count;
    t->middle = QW_NEW(env, uint32_t, 3 * (size_t)faces);
    qw_parallel(env, faces, QW_GRAIN_LIGHT, find_long, t);
    number_middles(t);
    uint32_t pieces = 0;
    if (t->middles > 0) {
        t->kind = QW_NEW(env, uint8_t, faces), t->turn = QW_NEW(env, uint8_t, faces);
        t->first = QW_NEW(env, uint32_t, faces);
        qw_parallel(env, faces, QW_GRAIN_LIGHT, choose_parting, t);
        pieces = count_pieces(t, most);
    }
    if (pieces > 0) {
        t->to = (qw_trimesh){.vertex_count = m->vertex_count + t->middles, .face_count = pieces};
        t->to.position = QW_NEW(env, qw_vec3, t->to.vertex_count);
        t->to.corner = QW_NEW(env, uint32_t, 3 * (size_t)pieces);
        t->to.twin = QW_NEW(env, uint32_t, 3 * (size_t)pieces);
        if (m->mark) t->to.mark = QW_NEW(env, uint8_t, 3 * (size_t)pieces);
        if (m->point) t->to.point = QW_NEW_ZERO(env, uint8_t, t->to.vertex_count);
        if (m->point) memcpy(t->to.point, m->point, m->vertex_count);
        for (uint32_t v = 0; v < m->vertex_count; v++) t->to.position[v] = m->position[v];
        qw_parallel(env, faces, QW_GRAIN_LIGHT, part_faces, t);
    }
    qw_free(env, t->middle), qw_free(env, t->kind), qw_free(env, t->turn), qw_free(env, t->first);
    t->kind = t->turn = NULL, t->first = NULL;
    return pieces > 0;
}

static void free_mesh(qw_env *env, qw_trimesh *m)
{
    qw_free(env, m->position), qw_free(env, m->corner), qw_free(env, m->twin), qw_free(env, m->mark);
    qw_free(env, m->point);
}

qw_trimesh qw_without_long_edges(qw_env *env, const qw_trimesh *m, float longest, uint32_t most)
{
    assert(longest > 0 && m->twin);
    qw_trimesh now = *m;
    for (int round = 0; round < MOST_ROUNDS; round++) {
        halving t = {.m = &now, .longest = longest};
        bool is_cut = halve(env, &t, most);
        if (!is_cut && t.middles == 0) return now;
        if (round > 0) free_mesh(env, &now);
        if (!is_cut) break; /* it would take too many */
        now = t.to;
    }
    return *m;
}
