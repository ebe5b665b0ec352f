#include "remesh/field/connection.h"

#include "remesh/field/alignment.h"
#include "base/elementary.h"
#include "base/constants.h"

#include <assert.h>
#include <string.h>

/* Less than this share of the weights below a coarse vertex is what rounding leaves of 0: it stands for a whole
 * component. */
#define NOTHING_LEFT 1e-5f

/* Carried in the surface, a cross has no reason to run along a cylinder rather than around it on a slant, but quads
   that are not much smaller than a protrusion can only follow it along. So principal curvatures pull with the fourth
   power of (half their difference times the edge length of the quads, which is near to twice this mesh's): strong on
   protrusions as thin as a quad, a hundredth of that where they are three times as thick. */
#define ALIGN 4.0f

static bool is_constrained(const qw_level *level, uint32_t v) { return qw_length2(level->direction[v]) > 0; }
static bool takes_part(const qw_level *level, uint32_t v)
{
    return is_constrained(level, v) || level->constraint[v] != QW_VERTEX_CORNER;
}

/* ---- finest level */

typedef struct finest_build {
    const qw_level *level;
    qw_connection_level *c;
    qw_vec3 *axis;
    const float *turn; /* float[begin[vertex_count]] or NULL */
    float *pulled;     /* float[vertex_count]: weight of all that adds to pull */
} finest_build;

static void axes_block(void *user, uint32_t begin, uint32_t end)
{
    const finest_build *b = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 n = b->level->normal[v], along = qw_normalize(qw_reject(b->level->direction[v], n));
        b->axis[v] = qw_length2(along) > 0.5f ? along : qw_any_orthogonal(n);
    }
}

/* What carries z of u to v: the least rotation from normal to normal, then the angle between what becomes of u's axis
   and v's, four times. */
static qw_phasor carry(const finest_build *b, uint32_t u, uint32_t v)
{
    qw_vec3 nu = b->level->normal[u], nv = b->level->normal[v], a = b->axis[u], spin = qw_cross(nu, nv);
    float cosine = qw_dot(nu, nv);
    if (cosine >
        -(float)QW_PARALLEL_COSINE) /* opposite normals have no least rotation: tangents are taken as they are */
        a = qw_add(qw_add(qw_scale(a, cosine), qw_cross(spin, a)), qw_scale(spin, qw_dot(spin, a) / (1 + cosine)));
    return qw_phasor_of_cross(a, nv, b->axis[v]);
}

/* Half the difference of the principal curvatures, turned twice by the angle of the first: the part of the normals'
   change that has a direction. */
static qw_phasor curvature(const finest_build *b, uint32_t v, float *edge2)
{
    const qw_level *level = b->level;
    qw_vec3 n = level->normal[v], x = b->axis[v], y = qw_cross(n, x);
    qw_phasor sum = {0, 0};
    float count = 0;
    *edge2 = 0;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        qw_vec3 e = qw_sub(level->position[u], level->position[v]);
        qw_phasor along = {qw_dot(e, x), qw_dot(e, y)};
        float l2 = along.re * along.re + along.im * along.im;
        if (l2 <= 0) continue;
        qw_phasor twice = qw_phasor_mul(along, along);
        float bend = 2 * qw_dot(e, qw_sub(level->normal[u], n)) / (l2 * l2);
        sum.re += bend * twice.re, sum.im += bend * twice.im;
        *edge2 += l2;
        count += 1;
    }
    if (count == 0) return sum;
    *edge2 /= count;
    return (qw_phasor){sum.re / count, sum.im / count};
}

/* Pulls the cross of v along the direction in which the surface bends most, the more the more it bends over an
 * edge. */
static void align(const finest_build *b, uint32_t v)
{
    assert(v < b->level->vertex_count);
    float edge2;
    qw_phasor q = curvature(b, v, &edge2);
    float bend2 = (q.re * q.re + q.im * q.im) * edge2;
    float pull = b->c->diagonal[v] * fminf(ALIGN * bend2 * bend2, 1);
    if (!(pull > 0)) return;
    qw_phasor to = qw_phasor_unit(q);
    to = qw_phasor_mul(to, to);
    b->c->pull[v] = qw_phasor_add(b->c->pull[v], (qw_phasor){pull * to.re, pull * to.im});
    b->c->diagonal[v] += pull;
    b->pulled[v] += pull;
}

/* Cosine and sine; by their series where the angle is small, which is nearly everywhere, as the functions take long. */
static qw_phasor turned_by(float a)
{
    float a2 = a * a;
    if (a2 < 0.05f) return (qw_phasor){1 - a2 / 2 + a2 * a2 / 24, a * (1 - a2 / 6 + a2 * a2 / 120)};
    return (qw_phasor){(float)qw_cos(a), (float)qw_sin(a)};
}

/* The links from each free vertex to its neighbours, as complex numbers that carry a cross across; a constrained
 * neighbour becomes a pull. */
static void links_block(void *user, uint32_t begin, uint32_t end)
{
    const finest_build *b = user;
    const qw_level *level = b->level;
    for (uint32_t v = begin; v < end; v++) {
        bool free = !is_constrained(level, v) && takes_part(level, v);
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
            uint32_t u = level->neighbour[i];
            if (!free || !takes_part(level, u)) continue;
            /* always carried the same way, so that the matrix is exactly hermitian */
            qw_phasor r = u < v ? carry(b, u, v) : qw_phasor_conj(carry(b, v, u));
            if (b->turn) r = qw_phasor_mul(r, turned_by(4 * b->turn[i]));
            float w = level->weight[i];
            qw_phasor wr = {w * r.re, w * r.im};
            b->c->diagonal[v] += w;
            if (!is_constrained(level, u)) {
                b->c->link[i] = wr;
                continue;
            }
            b->c->pull[v] = qw_phasor_add(b->c->pull[v], wr);
            b->pulled[v] += w;
        }
        align(b, v);
    }
}

/* ---- coarser levels */

typedef struct coarse_build {
    const qw_connection_level *fine;
    qw_connection_level *coarse;
    const uint32_t *child; /* uint32_t[coarse vertices][2], QW_NONE where there is none that is free */
    float *below;          /* float[fine vertices]: sum of the diagonals of level 0 below */
    float *below_coarse;
} coarse_build;

static qw_phasor link_between(const qw_connection_level *c, uint32_t v, uint32_t u)
{
    for (uint32_t i = c->level->begin[v]; i < c->level->begin[v + 1]; i++)
        if (c->level->neighbour[i] == u) return c->link[i];
    return (qw_phasor){0, 0};
}

/* Both children of a pair have the parent's cross, the first as it is and the second carried over their link. */
static void along_block(void *user, uint32_t begin, uint32_t end)
{
    const coarse_build *b = user;
    for (uint32_t p = begin; p < end; p++) {
        const uint32_t *child = b->child + 2 * (size_t)p;
        b->coarse->vertex[p] = child[0] != QW_NONE ? b->fine->vertex[child[0]] : QW_NONE;
        if (child[0] != QW_NONE) b->fine->along[child[0]] = (qw_phasor){1, 0};
        if (child[1] != QW_NONE) b->fine->along[child[1]] = qw_phasor_unit(link_between(b->fine, child[1], child[0]));
    }
}

/* Adds to coarse vertex p what its child v has: links inside p go into the diagonal. */
static void add_child(const coarse_build *b, uint32_t p, uint32_t v)
{
    assert(v < b->fine->level->vertex_count && p < b->coarse->level->vertex_count);
    const qw_connection_level *fine = b->fine, *coarse = b->coarse;
    const uint32_t *parent = fine->level->parent;
    qw_phasor back = qw_phasor_conj(fine->along[v]);
    coarse->diagonal[p] += fine->diagonal[v];
    coarse->pull[p] = qw_phasor_add(coarse->pull[p], qw_phasor_mul(back, fine->pull[v]));
    b->below_coarse[p] += b->below[v];
    for (uint32_t i = fine->level->begin[v]; i < fine->level->begin[v + 1]; i++) {
        uint32_t u = fine->level->neighbour[i], to = parent[u];
        if (fine->link[i].re == 0 && fine->link[i].im == 0) continue;
        qw_phasor r = qw_phasor_mul(qw_phasor_mul(back, fine->link[i]), fine->along[u]);
        if (to == p) {
            coarse->diagonal[p] -= r.re;
            continue;
        }
        uint32_t slot = coarse->level->begin[p];
        while (coarse->level->neighbour[slot] != to) slot++;
        coarse->link[slot] = qw_phasor_add(coarse->link[slot], r);
    }
}

static void coarse_block(void *user, uint32_t begin, uint32_t end)
{
    const coarse_build *b = user;
    for (uint32_t p = begin; p < end; p++) {
        for (int k = 0; k < 2; k++)
            if (b->child[2 * (size_t)p + k] != QW_NONE) add_child(b, p, b->child[2 * (size_t)p + k]);
        if (b->coarse->diagonal[p] <= NOTHING_LEFT * b->below_coarse[p]) b->coarse->diagonal[p] = 0;
    }
}

/* Room for one level of the connection, all zero. */
static void new_level(qw_env *env, qw_connection_level *c, const qw_level *level)
{
    assert(level->begin && level->normal);
    uint32_t n = level->vertex_count;
    *c = (qw_connection_level){.level = level};
    c->diagonal = QW_NEW_ZERO(env, float, n);
    c->link = QW_NEW_ZERO(env, qw_phasor, level->begin[n]);
    c->pull = QW_NEW_ZERO(env, qw_phasor, n);
    c->vertex = QW_NEW(env, uint32_t, n);
    if (level->parent) c->along = QW_NEW_ZERO(env, qw_phasor, n);
}

/* below: of the fine level; freed. Returns that of the coarse one. */
static float *coarsen(qw_env *env, const qw_connection_level *fine, qw_connection_level *coarse, float *below)
{
    assert(fine->level->parent && below);
    uint32_t n = coarse->level->vertex_count;
    uint32_t *child = QW_NEW(env, uint32_t, 2 * (size_t)n);
    memset(child, 0xff, 2 * (size_t)n * sizeof *child);
    for (uint32_t v = 0; v < fine->level->vertex_count; v++) {
        uint32_t *of = child + 2 * (size_t)fine->level->parent[v];
        if (below[v] > 0) of[of[0] != QW_NONE] = v;
    }
    coarse_build b = {fine, coarse, child, below, QW_NEW_ZERO(env, float, n)};
    qw_parallel(env, n, QW_GRAIN, along_block, &b);
    qw_parallel(env, n, QW_GRAIN, coarse_block, &b);
    qw_free(env, child), qw_free(env, below);
    return b.below_coarse;
}

qw_connection qw_connection_build(qw_env *env, const qw_hierarchy *hierarchy, const float *turn, qw_vec3 *direction,
                                  float follow, const qw_vec3 *asked)
{
    assert(hierarchy->level_count > 0 && hierarchy->level_count <= QW_MAX_LEVELS);
    qw_connection c = {.level_count = hierarchy->level_count};
    for (uint32_t l = 0; l < c.level_count; l++) new_level(env, &c.level[l], &hierarchy->level[l]);
    uint32_t n = hierarchy->level[0].vertex_count;
    c.axis = QW_NEW(env, qw_vec3, n);
    finest_build b = {&hierarchy->level[0], &c.level[0], c.axis, turn, QW_NEW_ZERO(env, float, n)};
    qw_parallel(env, n, QW_GRAIN, axes_block, &b);
    qw_parallel(env, n, QW_GRAIN, links_block, &b);
    if (direction && follow > 0) qw_pull_along(env, &c.level[0], c.axis, direction, follow, b.pulled);
    if (asked) qw_pull_to_asked(env, &c.level[0], c.axis, asked, b.pulled);
    double pulled = 0;
    for (uint32_t v = 0; v < n; v++) pulled += b.pulled[v];
    qw_free(env, b.pulled);
    for (uint32_t l = 0; l < c.level_count; l++) c.level[l].pulled = pulled;
    for (uint32_t v = 0; v < n; v++) c.level[0].vertex[v] = v;
    float *below = QW_NEW(env, float, n);
    memcpy(below, c.level[0].diagonal, n * sizeof *below);
    for (uint32_t l = 0; l + 1 < c.level_count; l++) below = coarsen(env, &c.level[l], &c.level[l + 1], below);
    qw_free(env, below);
    return c;
}

double qw_connection_energy(const qw_connection_level *c, const qw_phasor *z)
{
    assert(c->level && z);
    double energy = c->pulled; /* |1 - z|^2 of what pulls, but for the terms in z */
    for (uint32_t v = 0; v < c->level->vertex_count; v++) {
        if (c->diagonal[v] == 0) continue;
        /* every free edge is met from both sides, an edge to a constrained vertex (whose |z| is 1) from one */
        double re = 2.0 * c->pull[v].re, im = 2.0 * c->pull[v].im;
        for (uint32_t i = c->level->begin[v]; i < c->level->begin[v + 1]; i++) {
            qw_phasor t = qw_phasor_mul(c->link[i], z[c->level->neighbour[i]]);
            re += t.re, im += t.im;
        }
        energy += c->diagonal[v] * ((double)z[v].re * z[v].re + (double)z[v].im * z[v].im) -
                  (z[v].re * re + z[v].im * im);
    }
    return energy;
}
