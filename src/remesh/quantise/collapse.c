#include "remesh/quantise/collapse.h"

#include "base/sets.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A contracted part, at its name. */
typedef struct qw_collapsed {
    int32_t euler;    /* vertices less zero edges and triangles */
    int32_t bend;     /* sum of 4 - valence over inner vertices */
    int32_t contacts; /* vertices less zero edges on the boundary: stretches of it; a whole loop counts 0 */
    bool outer;       /* has a vertex on the boundary */
    bool contracted;  /* has a zero edge */
} qw_collapsed;

/* Fewest quads around the vertex to which a disc is contracted: with two quads it is a doublet, with fewer there is
   nothing around it. */
enum { LEAST_VALENCE = 2 };

/* Numbers the vertices that are left from 0, in the order of their first corner. */
static void number_vertices(qw_env *env, const qw_decimated *s, qw_collapse_finder *r)
{
    assert(s->corner && s->complex.side);
    uint32_t sides = 3 * s->complex.face_count, most = 0;
    for (uint32_t h = 0; h < sides; h++) most = s->corner[h] >= most ? s->corner[h] + 1 : most;
    uint32_t *number = QW_NEW(env, uint32_t, most);
    memset(number, 0xff, most * sizeof *number);
    r->corner = QW_NEW(env, uint32_t, sides);
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t *n = &number[s->corner[h]];
        if (*n == QW_NONE) *n = r->vertex_count++;
        r->corner[h] = *n;
    }
    qw_free(env, number);
}

/* Angle at the start of h between the real offsets of its triangle, signed. */
static float angle_at(const qw_complex *c, uint32_t h)
{
    uint32_t b = qw_prev(h);
    qw_real2 u = qw_turn_real(c->rot[h], c->real[c->edge[h]]), v = qw_turn_real(c->rot[b] + 2u, c->real[c->edge[b]]);
    return (float)qw_atan2(u.x * v.y - u.y * v.x, u.x * v.x + u.y * v.y);
}

qw_collapse_finder qw_collapse_finder_make(qw_env *env, const qw_decimated *s)
{
    assert(s->corner && s->complex.d);
    const qw_complex *c = &s->complex;
    qw_collapse_finder r = {.complex = c};
    number_vertices(env, s, &r);
    r.valence = QW_NEW(env, int32_t, r.vertex_count), r.boundary = QW_NEW_ZERO(env, uint8_t, r.vertex_count);
    r.parent = QW_NEW(env, uint32_t, r.vertex_count), r.of = QW_NEW(env, qw_collapsed, r.vertex_count);
    float *angle = QW_NEW_ZERO(env, float, r.vertex_count);
    for (uint32_t h = 0; h < 3 * c->face_count; h++) angle[r.corner[h]] += angle_at(c, h);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (c->side[2 * e + 1] != QW_NONE) continue;
        uint32_t h = c->side[2 * e];
        r.boundary[r.corner[h]] = r.boundary[r.corner[qw_next(h)]] = 1;
    }
    for (uint32_t v = 0; v < r.vertex_count; v++) r.valence[v] = (int32_t)qw_round_even(angle[v] / (float)(QW_PI / 2));
    qw_free(env, angle);
    return r;
}

uint32_t qw_find_collapsed(const qw_collapse_finder *r, const qw_int2 *d)
{
    assert(d);
    const qw_complex *c = r->complex;
    qw_sets_begin(r->parent, r->vertex_count);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!qw_int2_is_zero(d[e])) continue;
        uint32_t h = c->side[2 * e];
        qw_join_sets(r->parent, r->corner[h], r->corner[qw_next(h)]);
    }
    for (uint32_t v = 0; v < r->vertex_count; v++) r->of[v] = (qw_collapsed){0};
    for (uint32_t v = 0; v < r->vertex_count; v++) {
        qw_collapsed *cluster = &r->of[qw_set_of(r->parent, v)];
        cluster->euler++;
        cluster->contacts += r->boundary[v];
        cluster->outer |= r->boundary[v];
        cluster->bend += r->boundary[v] ? 0 : 4 - r->valence[v];
    }
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!qw_int2_is_zero(d[e])) continue;
        qw_collapsed *cluster = &r->of[qw_set_of(r->parent, r->corner[c->side[2 * e]])];
        cluster->euler--;
        cluster->contacts -= c->side[2 * e + 1] == QW_NONE;
        cluster->contracted = true;
    }
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3)
        if (qw_int2_is_zero(d[c->edge[h]]) && qw_int2_is_zero(d[c->edge[h + 1]]))
            r->of[qw_set_of(r->parent, r->corner[h])].euler++;
    uint32_t count = 0;
    for (uint32_t v = 0; v < r->vertex_count; v++) {
        const qw_collapsed *cluster = &r->of[v];
        if (r->parent[v] != v || !cluster->contracted) continue;
        count += cluster->euler != 1 || (cluster->outer ? cluster->contacts != 1 : 4 - cluster->bend < LEAST_VALENCE);
    }
    return count;
}
