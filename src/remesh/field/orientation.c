/* A smooth field of crosses, coarse to fine on the connection Laplacian.
 *
 * On each level the crosses diffuse for a while (an implicit step, by a few sweeps of Gauss-Seidel) and are then
 * brought back to length 1, and so again (Merriman, Bence and Osher's scheme; for fields Viertel and Osting 2019).
 * Between two normalisations a cross counts for less where its neighbours disagree, which lets singularities move and
 * meet; a cross of fixed length pins them to where they came up.
 *
 * This goes past Eq. (1) of the paper, which compares axes in space, so that the field bends to follow curvature where
 * that is cheaper than to go straight in the surface. Carried in the surface, fewer singularities leave offsets that
 * are far nearer to closed. But seen from outside it is plainer how a field should run around tubes and handles: the
 * field of Eq. (1) is one of the starts on a middle level, others come from chance, and the one with the least energy
 * there goes on. See docs/dev/decisions/orientation.md. */
#include "remesh/field/orientation.h"

#include "remesh/field/connection.h"
#include "remesh/field/extrinsic.h"
#include "base/elementary.h"

#include <assert.h>
#include <string.h>

enum {
    STEPS = 2,  /* of diffusion a level */
    SWEEPS = 6, /* a step */
    COARSEST_STEPS = 10,
    STARTS = 4,            /* by chance, besides the one in space */
    BATCHES = 8,           /* of as many starts each, from which those are chosen */
    BATCH_VERTICES = 128,  /* the most on the level where they are chosen: which way the field runs is decided on the
                             coarsest, where a start costs next to nothing */
    POLISH_STEPS = 12,     /* of the best start, for pairs of opposite singularities to meet */
    START_VERTICES = 8192, /* the most on the level where starts are compared */
    SPACE_LEVELS = 3 /* coarser than that one: where the start in space comes from. From finer ones it costs more and
                         ends with more energy */
};
/* The share of a vertex's own cross against its neighbours' in a step; 1/16 makes a step reach about two edges of the
   level: little more than one edge of the quads on the finest. */
#define STAY           (1.0f / 16)
/* The start in space must have less than this share of the energy of one by chance, and of a field that corners hold.
 */
#define MARGIN         0.98
#define MARGIN_CORNERS 0.9
/* Two starts whose energies differ by a smaller share are taken for the same. */
#define SAME           1e-4

typedef struct orientation_state {
    const qw_connection_level *c;
    const qw_phasor *coarse; /* z of the level above */
    const qw_vec3 *axis;
    qw_phasor *z, *before; /* qw_phasor[vertex_count]; before: when the step began */
    qw_vec3 *o;
} orientation_state;

/* One step of diffusion at v: the mean of its neighbours' crosses, carried to it, of its pull and of what it was.
 * */
static void diffuse(void *user, uint32_t v)
{
    const orientation_state *s = user;
    const qw_connection_level *c = s->c;
    if (c->diagonal[v] == 0) return;
    float own = STAY * c->diagonal[v], scale = 1 / (own + c->diagonal[v]);
    float re = c->pull[v].re + own * s->before[v].re, im = c->pull[v].im + own * s->before[v].im;
    for (uint32_t i = c->level->begin[v]; i < c->level->begin[v + 1]; i++) {
        qw_phasor r = c->link[i], z = s->z[c->level->neighbour[i]];
        re += r.re * z.re - r.im * z.im;
        im += r.re * z.im + r.im * z.re;
    }
    s->z[v] = (qw_phasor){scale * re, scale * im};
}

static void normalize_block(void *user, uint32_t begin, uint32_t end)
{
    const orientation_state *s = user;
    for (uint32_t v = begin; v < end; v++) s->z[v] = s->before[v] = qw_phasor_unit(s->z[v]);
}

static void refine_block(void *user, uint32_t begin, uint32_t end)
{
    const orientation_state *s = user;
    for (uint32_t v = begin; v < end; v++)
        s->z[v] = s->c->diagonal[v] == 0 ? (qw_phasor){1, 0}
                                         : qw_phasor_mul(s->c->along[v], s->coarse[s->c->level->parent[v]]);
}

/* The square root with a real part >= 0, of a number of length 1. */
static qw_phasor half_angle(qw_phasor z)
{
    float im = sqrtf(fmaxf(0, (1 - z.re) / 2));
    return (qw_phasor){sqrtf(fmaxf(0, (1 + z.re) / 2)), z.im < 0 ? -im : im};
}

static void crosses_block(void *user, uint32_t begin, uint32_t end)
{
    const orientation_state *s = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_phasor t = half_angle(half_angle(s->z[v]));
        qw_vec3 n = s->c->level->normal[v], x = s->axis[v];
        s->o[v] = qw_normalize(qw_madd(qw_scale(x, t.re), t.im, qw_cross(n, x)));
    }
}

/* On the run's threads, or on this one alone where env is NULL; the result is the same. */
static void for_all(qw_env *env, uint32_t n, qw_task task, orientation_state *s)
{
    if (env) qw_parallel(env, n, QW_GRAIN, task, s);
    else task(s, 0, n);
}

static void sweep(qw_env *env, orientation_state *s)
{
    const qw_level *level = s->c->level;
    if (env) qw_level_sweep(env, level, diffuse, s);
    else
        for (uint32_t i = 0; i < level->vertex_count; i++) diffuse(s, level->by_color[i]);
}

static void solve_level(qw_env *env, orientation_state *s, uint32_t steps)
{
    uint32_t n = s->c->level->vertex_count;
    for (uint32_t step = 0; step < steps; step++) {
        for_all(env, n, normalize_block, s);
        for (uint32_t i = 0; i < SWEEPS; i++) sweep(env, s);
    }
    for_all(env, n, normalize_block, s);
}

/* ---- starts */

static qw_phasor *new_level(qw_env *env, orientation_state *s, const qw_connection_level *c)
{
    s->c = c;
    s->coarse = s->z;
    s->z = QW_NEW(env, qw_phasor, c->level->vertex_count), s->before = QW_NEW(env, qw_phasor, c->level->vertex_count);
    return s->z;
}

/* A cross of each start by chance. They run side by side, so that each coupling is read once for all of them. */
typedef struct bundle {
    float re[STARTS], im[STARTS];
} bundle;

/* The starts in two tasks, each on one thread: too small for more. */
typedef struct starts {
    const qw_connection *connection;
    const qw_hierarchy *hierarchy;
    uint32_t chosen_on, last; /* levels: where the starts are chosen, and the one that all go down to */
    uint64_t seed;
    bundle *chosen; /* [vertices of level `chosen_on`]: the best so far */
    double chosen_energy[STARTS];
    bundle *bundles[2], *before; /* [vertices of level `last`]: in turn for the levels; when the step began */
    qw_phasor *z;                /* [STARTS + 1][vertices of level `last`]: the results; the one in space is the last */
    /* [vertices of level `last`]: every second level of the start in space; when its step began */
    qw_phasor *space_z, *space_before;
    qw_vec3 *space; /* [vertices of all levels down to `last`]: the field of Eq. (1) on each level */
    double energy[STARTS + 1];
} starts;

/* STARTS random crosses for vertex v. */
static bundle scattered(uint64_t seed, uint32_t v)
{
    bundle b;
    for (uint32_t k = 0; k < STARTS; k++) {
        uint64_t chance = qw_scramble(seed * STARTS + k, v);
        qw_phasor z = {(float)(chance & 0x1fffff) / 1048576.0f - 1.0f,
                       (float)((chance >> 21) & 0x1fffff) / 1048576.0f - 1.0f};
        z = qw_phasor_unit(z);
        b.re[k] = z.re, b.im[k] = z.im;
    }
    return b;
}

static bundle same_crosses(qw_phasor z)
{
    bundle b;
    for (int k = 0; k < STARTS; k++) b.re[k] = z.re, b.im[k] = z.im;
    return b;
}

/* sum += r z */
static inline void add_product(bundle *sum, qw_phasor r, const bundle *z)
{
    for (int k = 0; k < STARTS; k++) {
        sum->re[k] += r.re * z->re[k] - r.im * z->im[k];
        sum->im[k] += r.re * z->im[k] + r.im * z->re[k];
    }
}

/* As diffuse, for all starts at once. */
static void diffuse_bundle(const qw_connection_level *c, bundle *z, const bundle *before, uint32_t v)
{
    if (c->diagonal[v] == 0) return;
    float own = STAY * c->diagonal[v], scale = 1 / (own + c->diagonal[v]);
    bundle sum = same_crosses(c->pull[v]);
    add_product(&sum, (qw_phasor){own, 0}, &before[v]);
    for (uint32_t i = c->level->begin[v]; i < c->level->begin[v + 1]; i++)
        add_product(&sum, c->link[i], &z[c->level->neighbour[i]]);
    for (int k = 0; k < STARTS; k++) sum.re[k] *= scale, sum.im[k] *= scale;
    z[v] = sum;
}

static void normalize_bundles(bundle *z, bundle *before, uint32_t n)
{
    for (uint32_t v = 0; v < n; v++) {
        for (int k = 0; k < STARTS; k++) {
            qw_phasor unit = qw_phasor_unit((qw_phasor){z[v].re[k], z[v].im[k]});
            z[v].re[k] = unit.re, z[v].im[k] = unit.im;
        }
        before[v] = z[v];
    }
}

/* As solve_level, on this thread. */
static void solve_bundles(const qw_connection_level *c, bundle *z, bundle *before, uint32_t steps)
{
    uint32_t n = c->level->vertex_count;
    for (uint32_t step = 0; step < steps; step++) {
        normalize_bundles(z, before, n);
        for (uint32_t i = 0; i < SWEEPS; i++)
            for (uint32_t k = 0; k < n; k++) diffuse_bundle(c, z, before, c->level->by_color[k]);
    }
    normalize_bundles(z, before, n);
}

/* Crosses by chance on the coarsest level, on others what the level above has. */
static void begin_level(const starts *a, uint32_t l, uint64_t seed)
{
    assert(l < a->connection->level_count);
    const qw_connection_level *c = &a->connection->level[l];
    bundle *z = a->bundles[l & 1], *coarse = l + 1 < a->connection->level_count ? a->bundles[(l + 1) & 1] : NULL;
    for (uint32_t v = 0; v < c->level->vertex_count; v++) {
        if (c->diagonal[v] == 0) {
            z[v] = same_crosses((qw_phasor){1, 0});
        } else if (coarse) {
            z[v] = same_crosses((qw_phasor){0, 0});
            add_product(&z[v], c->along[v], &coarse[c->level->parent[v]]);
        } else {
            z[v] = scattered(seed, v);
        }
    }
}

/* From below level `above` down to level `last`. */
static void descend(const starts *a, uint32_t above, uint32_t last, uint64_t seed)
{
    assert(above <= a->connection->level_count);
    for (uint32_t l = above; l-- > last;) {
        begin_level(a, l, seed);
        solve_bundles(&a->connection->level[l], a->bundles[l & 1], a->before,
                      l + 1 < a->connection->level_count ? STEPS : COARSEST_STEPS);
    }
}

/* Start k of the bundle on level l, as z. */
static double take_start(const starts *a, uint32_t l, uint32_t k, qw_phasor *z)
{
    assert(l < a->connection->level_count && k < STARTS);
    const qw_connection_level *c = &a->connection->level[l];
    const bundle *from = a->bundles[l & 1];
    for (uint32_t v = 0; v < c->level->vertex_count; v++) z[v] = (qw_phasor){from[v].re[k], from[v].im[k]};
    return qw_connection_energy(c, z);
}

/* The start goes to the place of the worst chosen one if it is better, and none of them is the same. */
static void consider(starts *a, const qw_phasor *z, double energy)
{
    uint32_t worst = 0;
    for (uint32_t k = 0; k < STARTS; k++) {
        if (fabs(energy - a->chosen_energy[k]) <= SAME * energy) return;
        if (a->chosen_energy[k] > a->chosen_energy[worst]) worst = k;
    }
    if (energy >= a->chosen_energy[worst]) return;
    a->chosen_energy[worst] = energy;
    for (uint32_t v = 0; v < a->hierarchy->level[a->chosen_on].vertex_count; v++)
        a->chosen[v].re[worst] = z[v].re, a->chosen[v].im[worst] = z[v].im;
}

/* Runs BATCHES of random initial fields on the coarsest levels and refines the best STARTS of them down to `last`. */
static void start_by_chance(starts *a)
{
    uint32_t l = a->chosen_on, n = a->hierarchy->level[l].vertex_count;
    for (uint32_t k = 0; k < STARTS; k++) a->chosen_energy[k] = INFINITY;
    for (uint32_t batch = 0; batch < BATCHES; batch++) {
        descend(a, a->connection->level_count, l, a->seed * BATCHES + batch);
        for (uint32_t k = 0; k < STARTS; k++) {
            double energy = take_start(a, l, k, a->z);
            consider(a, a->z, energy);
            if (batch == 0 && k == 0) /* where there are fewer than STARTS that differ this one fills up */
                for (uint32_t v = 0; v < n; v++) a->chosen[v] = same_crosses(a->z[v]);
        }
    }
    memcpy(a->bundles[l & 1], a->chosen, n * sizeof *a->chosen);
    descend(a, l, a->last, a->seed);
    n = a->hierarchy->level[a->last].vertex_count;
    for (uint32_t k = 0; k < STARTS; k++) a->energy[k] = take_start(a, a->last, k, a->z + (size_t)k * n);
}

/* The field of Eq. (1) as z on a level: it looks at the surface from outside and so finds what goes around a tube. */
static void take_field_in_space(const starts *a, const qw_connection_level *c, const qw_vec3 *o, qw_phasor *z)
{
    for (uint32_t v = 0; v < c->level->vertex_count; v++) {
        z[v] = (qw_phasor){1, 0};
        if (c->diagonal[v] == 0) continue;
        qw_vec3 axis = a->connection->axis[c->vertex[v]], normal = a->hierarchy->level[0].normal[c->vertex[v]];
        qw_phasor t = qw_phasor_unit((qw_phasor){qw_dot(o[v], axis), qw_dot(o[v], qw_cross(normal, axis))});
        t = qw_phasor_mul(t, t);
        z[v] = qw_phasor_mul(t, t);
    }
}

/* A start from the field that is smoothest in space, from a few levels below the last one down to it. */
static void start_in_space(starts *a)
{
    assert(a->last < a->connection->level_count && a->space);
    const qw_connection_level *level = a->connection->level;
    qw_phasor *result = a->z + (size_t)STARTS * level[a->last].level->vertex_count;
    uint32_t l = a->last + SPACE_LEVELS;
    if (l >= a->connection->level_count) l = a->connection->level_count - 1;
    orientation_state s = {.c = &level[l], .before = a->space_before, .z = (l - a->last) % 2 ? a->space_z : result};
    take_field_in_space(a, s.c, qw_extrinsic_field(a->hierarchy, l, a->seed, a->space), s.z);
    solve_level(NULL, &s, 2 * STEPS);
    while (l-- > a->last) {
        s.c = &level[l];
        s.coarse = s.z;
        s.z = (l - a->last) % 2 ? a->space_z : result;
        refine_block(&s, 0, s.c->level->vertex_count);
        solve_level(NULL, &s, l == a->last ? 2 * STEPS : STEPS);
    }
    a->energy[STARTS] = qw_connection_energy(s.c, s.z);
}

static void make_starts(void *user, uint32_t begin, uint32_t end)
{
    for (uint32_t i = begin; i < end; i++)
        if (i == 0) start_in_space(user);
        else start_by_chance(user);
}

/* Where curves hold most of the field, all starts by chance come to the same; one in space may then have a little less
   by crossing a corner the wrong way, which leaves a face no room. Where it is the better start it is so by a third. */
static qw_phasor *best_start(qw_env *env, const qw_connection *connection, const qw_hierarchy *hierarchy, uint32_t last,
                             uint64_t seed)
{
    assert(last < hierarchy->level_count && connection->level_count == hierarchy->level_count);
    starts a = {.connection = connection, .hierarchy = hierarchy, .last = last, .seed = seed};
    size_t all = 0, n = hierarchy->level[last].vertex_count;
    for (uint32_t l = last; l < hierarchy->level_count; l++) all += hierarchy->level[l].vertex_count;
    a.bundles[0] = QW_NEW(env, bundle, n), a.bundles[1] = QW_NEW(env, bundle, n), a.before = QW_NEW(env, bundle, n);
    a.chosen_on = last;
    while (a.chosen_on + 1 < hierarchy->level_count && hierarchy->level[a.chosen_on].vertex_count > BATCH_VERTICES)
        a.chosen_on++;
    a.chosen = QW_NEW(env, bundle, hierarchy->level[a.chosen_on].vertex_count);
    a.z = QW_NEW(env, qw_phasor, (STARTS + 1) * n), a.space_z = QW_NEW(env, qw_phasor, n),
    a.space_before = QW_NEW(env, qw_phasor, n);
    a.space = QW_NEW(env, qw_vec3, all);
    qw_parallel(env, 2, 1, make_starts, &a);
    uint32_t best = 0;
    for (uint32_t i = 1; i < STARTS; i++)
        if (a.energy[i] < a.energy[best]) best = i;
    bool corners = memchr(hierarchy->level[0].constraint, QW_VERTEX_CORNER, hierarchy->level[0].vertex_count) != NULL;
    if (a.energy[STARTS] < (corners ? MARGIN_CORNERS : MARGIN) * a.energy[best]) best = STARTS;
    qw_progress(env, 0.5);
    return a.z + best * n;
}

qw_vec3 *qw_orientation_field(qw_env *env, const qw_hierarchy *hierarchy, const float *turn, qw_vec3 *direction,
                              float follow, const qw_vec3 *asked, uint64_t seed)
{
    assert(hierarchy->level_count > 0 && follow >= 0 && follow <= 1);
    const qw_level *finest = &hierarchy->level[0];
    qw_vec3 *o = QW_NEW(env, qw_vec3, finest->vertex_count);
    qw_scope_begin(env);
    qw_connection connection = qw_connection_build(env, hierarchy, turn, direction, follow, asked);
    uint32_t l = 0;
    while (l + 1 < hierarchy->level_count && hierarchy->level[l].vertex_count > START_VERTICES) l++;
    orientation_state s = {.c = &connection.level[l], .axis = connection.axis, .o = o};
    s.z = best_start(env, &connection, hierarchy, l, seed);
    s.before = QW_NEW(env, qw_phasor, s.c->level->vertex_count);
    solve_level(env, &s, POLISH_STEPS);
    while (l-- > 0) {
        new_level(env, &s, &connection.level[l]);
        qw_parallel(env, s.c->level->vertex_count, QW_GRAIN, refine_block, &s);
        solve_level(env, &s, STEPS);
        qw_progress(env, 1.0 / (double)(1 + l));
    }
    qw_parallel(env, finest->vertex_count, QW_GRAIN, crosses_block, &s);
    for (uint32_t v = 0; v < finest->vertex_count; v++) /* corners took no part: they follow those around them */
        if (finest->constraint[v] == QW_VERTEX_CORNER) qw_extrinsic_update(finest, o, v);
    qw_scope_end(env);
    return o;
}
