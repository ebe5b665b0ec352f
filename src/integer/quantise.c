#include "integer/quantise.h"

#include "base/arena.h"
#include "base/sets.h"
#include "integer/closed.h"
#include "integer/collapse.h"
#include "integer/flatten.h"
#include "integer/skeleton.h"
#include "integer/strips.h"
#include "integer/wedges.h"

#include <math.h>
#include <string.h>

/* Sizes are tried this far on either side of the one that the real area asks for, in so many steps; fewer where the skeleton is large. */
static const double SEARCH = 0.03;
enum { MOST_TRIES = 17, EDGES_TRIED = 60000, BIDIRECTED_ROUNDS = 4, NOISY_ROUNDS = 14 };
/* Rounds of stiffening, as a rule and where that left triangles turned over. */
enum { USUAL_CLOSED = 1, STIFF_CLOSED = 4, STIFF_FLAT = 3 };
/* A count off by less than the first is as good as exact; off by more than the second it breaks the promise (by more than the third below
   FEW quads). A triangle turned over can only be repaired, so it weighs as much as a percent. */
static const double COUNT_FREE = 0.008, COUNT_BOUND = 0.018, FEW_BOUND = 0.045, FEW = 500;
static const double COUNT_WEIGHT = 100, BROKEN_WEIGHT = 1000, OVER_WEIGHT = 1, COLLAPSE_WEIGHT = 1;
/* Closed offsets of less area than this share of the edges' own have collapsed (around a limb thinner than a quad): no size gives them their count, and
   a large one only makes offsets long. */
static const double LEAST_AREA = 0.25;
static const float NOISE = 0.4f;
/* Trials run in so many lanes, each with so many bytes: seven skeletons of 45 to 8,187 edges took 600 to 730 an edge and 15 thousand. Where that were more than
   ARENA_MOST there are no lanes. */
enum { LANES = 4, ARENA_LEAST = 1 << 16, ARENA_AN_EDGE = 800, ARENA_MOST = 1 << 23 };
/* See keep_loops_open; the weight is the most that weigh_edges gives. */
static const double LOOP_EDGES = 4;
static const float LOOP_WEIGHT = 3;

static double area_of(const qw_complex *c, bool whole)
{
    double sum = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) {
        uint32_t e = c->edge[h], g = c->edge[h + 1];
        if (whole) {
            sum += qw_int2_det(qw_turn(c->rot[h], c->d[e]), qw_turn(c->rot[h + 1], c->d[g]));
        } else {
            qw_real2 a = qw_turn_real(c->rot[h], c->real[e]), b = qw_turn_real(c->rot[h + 1], c->real[g]);
            sum += (double)a.x * (double)b.y - (double)a.y * (double)b.x;
        }
    }
    return sum / 2;
}

static double area_on(const qw_offset_mesh *m, const qw_real2 *closed)
{
    double sum = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h += 3) {
        qw_real2 a = qw_turn_real(m->rot[h], closed[m->edge[h]]), b = qw_turn_real(m->rot[h + 1], closed[m->edge[h + 1]]);
        sum += (double)a.x * (double)b.y - (double)a.y * (double)b.x;
    }
    return sum / 2;
}

/* Triangles that the integers turn over, though they have an area. */
static uint32_t turned_over(const qw_complex *c)
{
    uint32_t count = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) {
        uint32_t e = c->edge[h], g = c->edge[h + 1];
        qw_real2 a = qw_turn_real(c->rot[h], c->real[e]), b = qw_turn_real(c->rot[h + 1], c->real[g]);
        int32_t det = qw_int2_det(qw_turn(c->rot[h], c->d[e]), qw_turn(c->rot[h + 1], c->d[g]));
        count += det < 0 && a.x * b.y - a.y * b.x > 0;
    }
    return count;
}

static double rounding_cost(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        double x = c->d[e].x - (double)c->real[e].x, y = c->d[e].y - (double)c->real[e].y;
        sum += (double)c->weight[e] * (x * x + y * y);
    }
    return c->edge_count ? sum / c->edge_count : 0;
}

/* The weights of linear finite elements on the skeleton's triangles, half the sum of the cotangents across from the edge: with them the
   rounding cost is the energy of a map that is linear on each triangle. Bounded, as slivers have none that mean anything. */
static void weigh_edges(qw_complex *c)
{
    static const float LEAST = 0.2f, MOST = 3.0f;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        float sum = 0;
        for (int s = 0; s < 2; s++) {
            uint32_t h = c->side[2 * e + (uint32_t)s];
            if (h == QW_NONE) continue;
            uint32_t a = qw_next(h), b = qw_next(a);
            /* both from the apex */
            qw_real2 u = qw_turn_real(c->rot[a] + 2u, c->real[c->edge[a]]), v = qw_turn_real(c->rot[b], c->real[c->edge[b]]);
            float det = fabsf(u.x * v.y - u.y * v.x), dot = u.x * v.x + u.y * v.y;
            sum += dot / fmaxf(det, 1e-6f);
        }
        c->weight[e] = fminf(fmaxf(sum / 2, LEAST), MOST);
    }
}

static bool is_closed(const qw_complex *c)
{
    for (uint32_t f = 0; f < c->face_count; f++)
        if (!qw_int2_is_zero(qw_complex_residual(c, f))) return false;
    return true;
}

/* A number from -1 to 1 that depends on nothing but i (a step of a linear congruence, mixed). */
static float scattered(uint64_t i)
{
    i = (i + 1) * 0x9e3779b97f4a7c15u;
    i ^= i >> 29;
    i *= 0xbf58476d1ce4e5b9u;
    return (float)(i >> 40) / (float)(1 << 23) - 1.0f;
}

/* What the integers are chosen for. */
typedef struct wish {
    const qw_complex *real;
    const qw_collapse_finder *finder;
    double middle;  /* the size that the area asks for */
    double cut;     /* area of the surface that the skeleton lacks, as it cuts across boundaries that nothing holds; it counts as it is */
    double quads;
} wish;

/* Whole offsets near the real ones times scale. Few steps of one at a time are exact enough: they start from whole numbers that are the
   nearest, or nearest to what up to `noise` (by the seed) was added to. */
static void choose_integers(qw_env *env, const qw_complex *real, double scale, float noise, uint64_t seed, qw_complex *c,
                            qw_regular_counts *counts)
{
    for (uint32_t e = 0; e < c->edge_count; e++) {
        qw_real2 x = {real->real[e].x * (float)scale, real->real[e].y * (float)scale};
        float nx = noise * scattered(seed + 2 * (uint64_t)e), ny = noise * scattered(seed + 2 * (uint64_t)e + 1);
        c->fixed[e] = real->fixed[e];
        c->real[e] = (qw_real2){c->fixed[e] & QW_FIXED_X ? x.x : x.x + nx, c->fixed[e] & QW_FIXED_Y ? x.y : x.y + ny};
        c->d[e] = (qw_int2){(int32_t)lrintf(c->real[e].x), (int32_t)lrintf(c->real[e].y)};
    }
    for (int i = 0; i < BIDIRECTED_ROUNDS && !is_closed(c); i++)
        qw_solve_complex(env, c, QW_FLOW_MCF, QW_COST_SQUARE, i + 1 == BIDIRECTED_ROUNDS, counts);
    for (uint32_t e = 0; e < c->edge_count && noise > 0; e++)
        c->real[e] = (qw_real2){real->real[e].x * (float)scale, real->real[e].y * (float)scale};
}

typedef struct choice {
    double scale, score;
    bool broken;        /* no count within the promise, or a triangle turned over */
    uint32_t collapsed; /* parts that vanish */
} choice;

static double broken_count(double off, double quads) { return fmax(off - (quads < FEW ? FEW_BOUND : COUNT_BOUND), 0); }

static double score_of(const wish *w, const qw_complex *c, double off, uint32_t collapsed)
{
    double open = is_closed(c) ? 0 : 1e6;
    double count = COUNT_WEIGHT * fmax(off - COUNT_FREE, 0) + BROKEN_WEIGHT * broken_count(off, w->quads);
    return open + count + rounding_cost(c) + OVER_WEIGHT * turned_over(c) + COLLAPSE_WEIGHT * collapsed;
}

static qw_complex copy_of(qw_env *env, const qw_complex *c)
{
    qw_complex k = *c;
    k.d = QW_NEW(env, qw_int2, c->edge_count);
    k.real = QW_NEW(env, qw_real2, c->edge_count);
    k.fixed = QW_NEW(env, uint8_t, c->edge_count);
    return k;
}

/* What is tried for one size. */
typedef struct trial {
    double scale;
    float noise;
    uint64_t seed;
    qw_int2 *d;     /* [edges] */
    uint8_t *fixed; /* [edges] */
    qw_regular_counts counts;
    bool done; /* else there was no room in the lane's memory */
} trial;

/* Trials are made side by side in lanes, each with memory of its own: a worker may not ask the run's environment for any. */
typedef struct lane {
    qw_env *env; /* in an arena; NULL where not even that had room */
    qw_complex complex;
    const qw_complex *real;
    trial *trial;
    uint32_t begin, end;
    qw_arena arena;
} lane;

/* c: room for a copy of the real complex. */
static void try_size(qw_env *env, const qw_complex *real, qw_complex *c, trial *t)
{
    qw_scope_begin(env);
    t->counts = (qw_regular_counts){0};
    choose_integers(env, real, t->scale, t->noise, t->seed, c, &t->counts);
    qw_scope_end(env);
    memcpy(t->d, c->d, c->edge_count * sizeof *t->d);
    memcpy(t->fixed, c->fixed, c->edge_count);
    t->done = true;
}

static void try_sizes(void *user)
{
    lane *l = user;
    for (uint32_t i = l->begin; i < l->end; i++) try_size(l->env, l->real, &l->complex, &l->trial[i]);
}

static void run_lane(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    lane *lanes = user;
    for (uint32_t i = begin; i < end; i++)
        if (lanes[i].env) (void)qw_protect(lanes[i].env, try_sizes, &lanes[i]); /* what is not done is done again */
}

static void run_trials(qw_env *env, const qw_complex *real, trial *trials, uint32_t count)
{
    qw_scope_begin(env);
    size_t bytes = ARENA_LEAST + (size_t)real->edge_count * ARENA_AN_EDGE;
    lane *lanes = QW_NEW_ZERO(env, lane, LANES);
    for (uint32_t i = 0; i < LANES && bytes <= ARENA_MOST; i++) {
        lane *l = &lanes[i];
        l->real = real, l->trial = trials, l->begin = count * i / LANES, l->end = count * (i + 1) / LANES;
        l->complex = copy_of(env, real);
        qw_arena_begin(&l->arena, qw_alloc(env, bytes, 1), bytes);
        qw_host host = {.resize = qw_arena_resize, .resize_user = &l->arena};
        l->env = qw_env_create(&host, 1);
    }
    qw_parallel(env, LANES, 1, run_lane, lanes);
    for (uint32_t i = 0; i < LANES; i++) qw_env_destroy(lanes[i].env);
    qw_complex own = copy_of(env, real);
    for (uint32_t i = 0; i < count; i++)
        if (!trials[i].done) try_size(env, real, &own, &trials[i]);
    qw_scope_end(env);
}

/* The i-th of all, in the room of t. */
static trial prepared(trial t, int i, int tries, double middle)
{
    int k = i % tries;
    double side = k & 1 ? -1 : 1;
    t.scale = middle * (1 + side * SEARCH * ((k + 1) / 2) / (tries / 2));
    t.noise = NOISE * (float)(i / tries);
    t.seed = (uint64_t)i << 32;
    t.done = false;
    return t;
}

static void take_trial(const qw_complex *real, const trial *t, qw_complex *c)
{
    memcpy(c->d, t->d, c->edge_count * sizeof *c->d);
    memcpy(c->fixed, t->fixed, c->edge_count);
    for (uint32_t e = 0; e < c->edge_count; e++) c->real[e] = (qw_real2){real->real[e].x * (float)t->scale, real->real[e].y * (float)t->scale};
}

/* Leaves in c the best integers found. */
static choice search_size(qw_env *env, const wish *w, qw_complex *c, qw_quantise_counts *counts)
{
    uint32_t edges = w->real->edge_count;
    int tries = (int)fmax(3, fmin(MOST_TRIES, EDGES_TRIED / fmax(edges, 1)));
    choice best = {w->middle, INFINITY, true, 0};
    int room = tries > LANES ? tries : LANES, begin = 0, end = 0;
    trial *round = QW_NEW_ZERO(env, trial, (size_t)room), kept = {.scale = w->middle}; /* tries begin..end */
    for (int k = 0; k < room; k++) round[k].d = QW_NEW(env, qw_int2, edges), round[k].fixed = QW_NEW(env, uint8_t, edges);
    kept.d = QW_NEW(env, qw_int2, edges), kept.fixed = QW_NEW(env, uint8_t, edges);
    /* the middle first, then on either side of it, further and further; at last, where none will do, with more and more noise, as long as
       that finds anything better: a few edges have few integers to choose from */
    double before = INFINITY;
    for (int i = 0; i < tries || (i < NOISY_ROUNDS * tries && best.broken && (uint64_t)i * edges < EDGES_TRIED); i++) {
        if (i % (2 * tries) == tries) { /* before two more rounds */
            if (best.score >= before && i > tries) break;
            before = best.score;
        }
        if (i == end) {
            begin = i, end = i + (i == 0 ? tries : LANES); /* of those with noise the first that will do ends it */
            for (int j = begin; j < end; j++) round[j - begin] = prepared(round[j - begin], j, tries, w->middle);
            run_trials(env, w->real, round, (uint32_t)(end - begin));
        }
        trial *t = &round[i - begin];
        counts->tries++;
        take_trial(w->real, t, c);
        uint32_t collapsed = qw_find_collapsed(w->finder, c->d);
        double scale = t->scale, off = fabs((area_of(c, true) + scale * scale * w->cut) / w->quads - 1), score = score_of(w, c, off, collapsed);
        if (score >= best.score) continue;
        best = (choice){scale, score, broken_count(off, w->quads) > 0 || turned_over(c) > 0, collapsed};
        trial swap = kept;
        kept = *t, *t = swap;
    }
    take_trial(w->real, &kept, c);
    counts->regular = kept.counts;
    return best;
}

/* Components of curves that the skeleton's flow had to let go are let go on the surface, where integers moved off the line. */
static void release_moved(qw_offset_mesh *m)
{
    for (uint32_t e = 0; e < m->edge_count; e++) {
        if (m->d[e].x) m->fixed[e] &= (uint8_t)~QW_FIXED_X;
        if (m->d[e].y) m->fixed[e] &= (uint8_t)~QW_FIXED_Y;
    }
}

/* Held loops that meet no other curve, the rims of holes, that `scale` leaves with fewer than LOOP_EDGES are made as long as that, and stiff: with fewer a
   hole would close. */
static void keep_loops_open(qw_env *env, qw_skeleton *s, uint32_t vertex_count, double scale)
{
    qw_complex *c = &s->complex;
    qw_scope_begin(env);
    uint32_t *chain = QW_NEW(env, uint32_t, vertex_count), *degree = QW_NEW_ZERO(env, uint32_t, vertex_count);
    double *length = QW_NEW_ZERO(env, double, vertex_count); /* of each chain, at its root */
    qw_sets_begin(chain, vertex_count);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!c->fixed[e]) continue;
        uint32_t h = c->side[2 * e], a = s->corner[h], b = s->corner[qw_next(h)];
        degree[a]++, degree[b]++;
        qw_join_sets(chain, a, b);
    }
    for (uint32_t e = 0; e < c->edge_count; e++)
        if (c->fixed[e]) length[qw_set_of(chain, s->corner[c->side[2 * e]])] += fabs((double)c->real[e].x) + fabs((double)c->real[e].y);
    for (uint32_t v = 0; v < vertex_count; v++)
        if (degree[v] != 0 && degree[v] != 2) length[qw_set_of(chain, v)] = INFINITY;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!c->fixed[e]) continue;
        double l = length[qw_set_of(chain, s->corner[c->side[2 * e]])] * scale;
        if (!(l > 0 && l < LOOP_EDGES)) continue;
        c->real[e].x *= (float)(LOOP_EDGES / l), c->real[e].y *= (float)(LOOP_EDGES / l);
        c->weight[e] = LOOP_WEIGHT;
    }
    qw_scope_end(env);
}

qw_quantise_counts qw_quantise(qw_env *env, qw_offset_mesh *m, double quads, bool stiff)
{
    qw_quantise_counts counts = {0};
    qw_closed_counts closing;
    qw_flatten_counts flattening;
    qw_scope_begin(env);
    counts.released_edges = qw_release_wedges(env, m);
    counts.strip_triangles = qw_stretch_strips(env, m, quads);
    float *stiffness = QW_NEW(env, float, m->edge_count);
    qw_real2 *closed = qw_closed_offsets(env, m, stiff ? STIFF_CLOSED : USUAL_CLOSED, stiffness, &closing);
    qw_progress(env, 0.4);
    qw_skeleton s = qw_skeleton_build(env, m, closed);
    s.complex.weight = QW_NEW(env, float, s.complex.edge_count);
    weigh_edges(&s.complex);
    qw_collapse_finder finder = qw_collapse_finder_make(env, &s);
    double area = area_on(m, closed), least = LEAST_AREA * area_on(m, m->real);
    wish w = {.real = &s.complex, .finder = &finder, .quads = quads};
    w.middle = sqrt(quads / fmax(fmax(area, least), 1)), w.cut = area - area_of(&s.complex, false);
    keep_loops_open(env, &s, m->vertex_count, w.middle);
    qw_complex chosen = copy_of(env, &s.complex);
    choice best = search_size(env, &w, &chosen, &counts);
    qw_progress(env, 0.6);
    qw_skeleton_expand(&s, chosen.d, m->d);
    release_moved(m);
    for (uint32_t e = 0; e < m->edge_count; e++) m->real[e].x *= (float)best.scale, m->real[e].y *= (float)best.scale;
    for (uint32_t v = 0; v < m->vertex_count; v++) m->size[v] /= (float)best.scale;
    qw_flatten(env, m, stiff ? STIFF_FLAT : 0, stiffness, &flattening);
    counts.skeleton_faces = s.complex.face_count, counts.skeleton_edges = s.complex.edge_count;
    counts.scale = best.scale;
    counts.turned_over = turned_over(&chosen);
    counts.rounding_cost = rounding_cost(&chosen);
    counts.energy = flattening.energy;
    counts.iterations = closing.iterations + flattening.iterations;
    qw_log(env, QW_LOG_DEBUG, "closed: %u rounds, %u squeezed; skeleton: %u triangles; scale %.4f; cost %.3f, %u turned over, %u vanish", closing.rounds,
           closing.squeezed, s.complex.face_count, best.scale, counts.rounding_cost, counts.turned_over, best.collapsed);
    qw_log(env, QW_LOG_DEBUG, "%lld triangles in strips", (long long)counts.strip_triangles);
    qw_log(env, QW_LOG_DEBUG, "flat: %u rounds, %u squeezed, energy %.4f", flattening.rounds, flattening.squeezed, flattening.energy);
    qw_scope_end(env);
    return counts;
}
