/* A smooth field of crosses, coarse to fine on the connection Laplacian.
 *
 * On each level the crosses diffuse for a while (an implicit step, by a few sweeps of Gauss-Seidel) and are then brought back to length 1, and so
 * again (Merriman, Bence and Osher's scheme; for fields Viertel and Osting 2019). Between two normalisations a cross counts for less
 * where its neighbours disagree, which lets singularities move and meet; a cross of fixed length pins them to where they came up.
 *
 * This replaces Eq. (1) of the paper: that compares axes in space, so it bends the field to follow curvature wherever that is cheaper than to
 * go straight in the surface. Carried in the surface, about as many singularities leave offsets that are far nearer to closed; see
 * docs/decisions/orientation.md. */
#include "field/orientation.h"

#include "field/connection.h"

#include <string.h>

/* Steps of diffusion a level and sweeps a step. STAY is the share of a vertex's own cross against its neighbours' in a step; 1/16 makes
   a step reach about two edges of the level: one edge of the quads on the finest. */
enum { STEPS = 2, SWEEPS = 6, COARSEST_STEPS = 10, GRAIN = 4096 };
#define STAY (1.0f / 16)

typedef struct orientation_state {
    const qw_connection_level *c;
    const qw_complex *coarse; /* z of the level above */
    const qw_vec3 *axis;
    qw_complex *z, *before; /* qw_complex[vertex_count]; before: when the step began */
    qw_vec3 *o;
} orientation_state;

static void diffuse(void *user, uint32_t v)
{
    const orientation_state *s = user;
    const qw_connection_level *c = s->c;
    if (c->diagonal[v] == 0) return;
    float own = STAY * c->diagonal[v], scale = 1 / (own + c->diagonal[v]);
    float re = c->pull[v].re + own * s->before[v].re, im = c->pull[v].im + own * s->before[v].im;
    for (uint32_t i = c->level->begin[v]; i < c->level->begin[v + 1]; i++) {
        qw_complex r = c->link[i], z = s->z[c->level->neighbour[i]];
        re += r.re * z.re - r.im * z.im;
        im += r.re * z.im + r.im * z.re;
    }
    s->z[v] = (qw_complex){scale * re, scale * im};
}

static void normalize_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const orientation_state *s = user;
    for (uint32_t v = begin; v < end; v++) s->z[v] = s->before[v] = qw_complex_unit(s->z[v]);
}

static void refine_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const orientation_state *s = user;
    for (uint32_t v = begin; v < end; v++)
        s->z[v] = s->c->diagonal[v] == 0 ? (qw_complex){1, 0} : qw_complex_mul(s->c->along[v], s->coarse[s->c->level->parent[v]]);
}

/* The seed scrambled, so that different seeds start differently on the coarsest level. */
static qw_complex seeded_cross(uint64_t seed, uint32_t v)
{
    uint64_t z = seed * 0x9e3779b97f4a7c15u + (uint64_t)v * 0xbf58476d1ce4e5b9u + 0x94d049bb133111ebu;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return qw_complex_unit((qw_complex){(float)(z & 0x1fffff) / 1048576.0f - 1.0f, (float)((z >> 21) & 0x1fffff) / 1048576.0f - 1.0f});
}

/* The square root with a real part >= 0, of a number of length 1. */
static qw_complex half_angle(qw_complex z)
{
    float im = sqrtf(fmaxf(0, (1 - z.re) / 2));
    return (qw_complex){sqrtf(fmaxf(0, (1 + z.re) / 2)), z.im < 0 ? -im : im};
}

static void crosses_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const orientation_state *s = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_complex t = half_angle(half_angle(s->z[v]));
        qw_vec3 n = s->c->level->normal[v], x = s->axis[v];
        s->o[v] = qw_normalize(qw_madd(qw_scale(x, t.re), t.im, qw_cross(n, x)));
    }
}

/* A corner took no part: it has the mean of the crosses around it, in space, turned to match. */
static void set_corner(const qw_level *level, uint32_t v, qw_vec3 *o)
{
    qw_vec3 n = level->normal[v], sum = o[v];
    float held = 0;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        qw_match m = qw_match_crosses(sum, n, o[u], level->normal[u]);
        qw_vec3 mine = qw_scale(qw_axis(sum, n, m.ku), held), theirs = qw_axis(o[u], level->normal[u], m.kv);
        qw_vec3 mean = qw_reject(qw_madd(mine, level->weight[i], theirs), n);
        if (qw_length2(mean) > 1e-20f) sum = qw_normalize(mean);
        held += level->weight[i];
    }
    o[v] = sum;
}

static void solve_level(qw_env *env, orientation_state *s, uint32_t steps)
{
    uint32_t n = s->c->level->vertex_count;
    for (uint32_t step = 0; step < steps; step++) {
        qw_parallel(env, n, GRAIN, normalize_block, s);
        for (uint32_t sweep = 0; sweep < SWEEPS; sweep++) qw_level_sweep(env, s->c->level, diffuse, s);
    }
    qw_parallel(env, n, GRAIN, normalize_block, s);
}

qw_vec3 *qw_orientation_field(qw_env *env, const qw_hierarchy *hierarchy, uint64_t seed)
{
    const qw_level *finest = &hierarchy->level[0];
    qw_vec3 *o = QW_NEW(env, qw_vec3, finest->vertex_count);
    qw_scope_begin(env);
    qw_connection connection = qw_connection_build(env, hierarchy);
    orientation_state s = {.axis = connection.axis, .o = o};
    for (uint32_t l = hierarchy->level_count; l-- > 0;) {
        s.c = &connection.level[l];
        uint32_t n = s.c->level->vertex_count;
        s.coarse = s.z;
        s.z = QW_NEW(env, qw_complex, n), s.before = QW_NEW(env, qw_complex, n);
        if (s.coarse)
            qw_parallel(env, n, GRAIN, refine_block, &s);
        else
            for (uint32_t v = 0; v < n; v++) s.z[v] = s.c->diagonal[v] > 0 ? seeded_cross(seed, v) : (qw_complex){1, 0};
        solve_level(env, &s, s.coarse ? STEPS : COARSEST_STEPS);
        qw_progress(env, 1.0 / (double)(1 + l));
    }
    qw_parallel(env, finest->vertex_count, GRAIN, crosses_block, &s);
    for (uint32_t v = 0; v < finest->vertex_count; v++)
        if (finest->hold[v] == QW_HOLD_CORNER) set_corner(finest, v, o);
    qw_scope_end(env);
    return o;
}

double qw_orientation_energy(const qw_level *level, const qw_vec3 *orientation)
{
    double energy = 0;
    for (uint32_t u = 0; u < level->vertex_count; u++)
        for (uint32_t i = level->begin[u]; i < level->begin[u + 1]; i++) {
            uint32_t v = level->neighbour[i];
            qw_match m = qw_match_crosses(orientation[u], level->normal[u], orientation[v], level->normal[v]);
            qw_vec3 a = qw_axis(orientation[u], level->normal[u], m.ku), b = qw_axis(orientation[v], level->normal[v], m.kv);
            double angle = atan2(qw_length(qw_cross(a, b)), qw_dot(a, b));
            energy += level->weight[i] * angle * angle;
        }
    return energy / 2;
}
