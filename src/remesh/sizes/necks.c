#include "remesh/sizes/necks.h"

#include "base/elementary.h"
#include "base/sets.h"
#include "base/sort.h"
#include "remesh/sizes/scale.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* q of a pocket, and of other necks at strength 1; how much q rises between two necks on one limb. */
static const double MOST_RATIO = 0.4, RISE = 1.25;
/* Distances from so many points, far from one another, say how far out a vertex is. A tip is farther out than the
   saddle to the next by so many edges. */
enum { BASES = 8, MOST_SEEDS = 64 };
static const float LEAST_OUT = 1.5f;
/* A curve is looked for at so many distances, up to where it has this share of the surface on its far side. */
enum { LEVELS = 96 };
static const double MOST_INSIDE = 0.4, FARTHEST = 0.6; /* the latter of the vertices */
/* Surfaces of more components are soups, or assemblies of plain parts. */
enum { MOST_COMPONENTS = 8 };
/* Points of a curve, and the rounds in which it is made smooth and short. */
enum { POINTS = 32, ROUNDS = 12 };

typedef struct neck {
    double ratio;
    float size; /* wanted edge on it */
    uint8_t is_pocket, is_open;
    qw_vec3 point[POINTS]; /* on a whole ring, or from end to end of the half that a cut leaves */
} neck;

typedef struct search {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_bvh *tree;
    const float *size;
    double most_ratio, area;
    bool is_half;
    neck *found; /* neck[QW_MOST_NECKS] */
    size_t count;
} search;

/* ---- tips and floors */

static float *distances_from(const search *s, uint32_t v, float farthest)
{
    uint8_t *is_from = QW_NEW_ZERO(s->env, uint8_t, s->mesh->vertex_count);
    is_from[v] = 1;
    float *distance = qw_distances(s->env, s->mesh, is_from, farthest);
    qw_free(s->env, is_from);
    return distance;
}

/* The mean distance of each vertex to BASES points that lie far from one another: float[vertices]. */
static float *how_far_out(const search *s)
{
    uint32_t n = s->mesh->vertex_count, base = 0;
    const float farthest = 1e3f; /* frame: other components */
    float *sum = QW_NEW_ZERO(s->env, float, n), *nearest = QW_NEW(s->env, float, n);
    for (uint32_t v = 0; v < n; v++) nearest[v] = farthest;
    for (int i = 0; i <= BASES; i++) { /* the first only says where the next is */
        float *distance = distances_from(s, base, farthest);
        uint32_t next = 0;
        for (uint32_t v = 0; v < n; v++) {
            if (i > 0 && distance[v] < farthest) sum[v] += distance[v] / BASES;
            nearest[v] = i > 0 ? fminf(nearest[v], distance[v]) : distance[v];
            if (nearest[v] > nearest[next]) next = v;
        }
        if (i == 0)
            for (uint32_t v = 0; v < n; v++) nearest[v] = farthest;
        base = next;
        qw_free(s->env, distance);
    }
    return sum;
}

/* Vertices that are farther out than all around them, by as much as counts: as a flood falls from the farthest vertex,
   islands come up around them, and of two that meet the lower one ends. uint32_t[*count]. */
static uint32_t *find_seeds(const search *s, uint32_t *count)
{
    qw_env *env = s->env;
    const qw_trimesh *m = s->mesh;
    uint32_t n = m->vertex_count, seeds = 0, *set = QW_NEW(env, uint32_t, n), *top = QW_NEW(env, uint32_t, n),
             *outgoing = qw_trimesh_outgoing(env, m), *seed = QW_NEW(env, uint32_t, n);
    const float *out = how_far_out(s);
    uint8_t *is_up = QW_NEW_ZERO(env, uint8_t, n);
    uint64_t *order = QW_NEW(env, uint64_t, n);
    for (uint32_t v = 0; v < n; v++) order[v] = (uint64_t)(1e6 * (1e3 - (double)out[v])) << 32 | v, top[v] = v;
    qw_sort_u64(order, n);
    qw_sets_begin(set, n);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t v = (uint32_t)order[i], h = outgoing[v];
        is_up[v] = 1;
        do {
            uint32_t ends[2] = {m->corner[qw_next(h)], m->corner[qw_prev(h)]};
            for (int k = 0; k < 2; k++) {
                if (!is_up[ends[k]]) continue;
                uint32_t a = qw_set_of(set, v), b = qw_set_of(set, ends[k]);
                if (a == b) continue;
                uint32_t high = out[top[a]] >= out[top[b]] ? top[a] : top[b], low = high == top[a] ? top[b] : top[a];
                if (out[low] - out[v] > LEAST_OUT * s->size[low]) seed[seeds++] = low;
                qw_join_sets(set, a, b);
                top[qw_set_of(set, a)] = high;
            }
            h = qw_around(m, h);
        } while (h != QW_NONE && h != outgoing[v]);
    }
    for (uint32_t v = 0; v < n; v++)
        if (qw_set_of(set, v) == v) seed[seeds++] = top[v];
    *count = seeds < MOST_SEEDS ? seeds : MOST_SEEDS;
    return seed;
}

/* ---- level lines */

/* What lies nearer to a seed than each of LEVELS distances, and the length of the line there. */
typedef struct levels {
    float step;                                        /* level j is at (j + 1) times this */
    double length[LEVELS], area[LEVELS], size[LEVELS]; /* size: sum of wanted sizes times length */
    int64_t euler[LEVELS];
    uint32_t ends[LEVELS]; /* of the line, at a boundary */
} levels;

static uint32_t level_above(const levels *l, float distance)
{
    float j = distance / l->step;
    return j >= LEVELS ? LEVELS : (uint32_t)j;
}

/* Where the line at a distance crosses the edge of h. */
static qw_vec3 crossing(const qw_trimesh *m, const float *distance, uint32_t h, float at)
{
    uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
    return qw_lerp(m->position[a], m->position[b], (at - distance[a]) / (distance[b] - distance[a]));
}

static bool crosses(const qw_trimesh *m, const float *distance, uint32_t h, float at)
{
    return (distance[m->corner[h]] <= at) != (distance[m->corner[qw_next(h)]] <= at);
}

static void measure_face(const search *s, const float *distance, uint32_t f, levels *l)
{
    const qw_trimesh *m = s->mesh;
    const uint32_t *c = m->corner + 3 * (size_t)f;
    float least = fminf(fminf(distance[c[0]], distance[c[1]]), distance[c[2]]),
          most = fmaxf(fmaxf(distance[c[0]], distance[c[1]]), distance[c[2]]),
          mean = (s->size[c[0]] + s->size[c[1]] + s->size[c[2]]) / 3;
    for (uint32_t j = level_above(l, least); j < LEVELS && l->step * (float)(j + 1) < most; j++) {
        float at = l->step * (float)(j + 1);
        qw_vec3 end[2];
        int ends = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3 && ends < 2; h++)
            if (crosses(m, distance, h, at)) end[ends++] = crossing(m, distance, h, at);
        if (ends < 2) continue;
        double length = (double)qw_distance(end[0], end[1]);
        l->length[j] += length, l->size[j] += length * (double)mean;
    }
    uint32_t whole = level_above(l, most);
    if (whole < LEVELS) l->area[whole] += 0.5 * (double)qw_length(qw_face_cross(m, f)), l->euler[whole]++;
}

/* Sums over all levels; what is counted at one is within those above it. */
static void measure_levels(const search *s, const float *distance, levels *l)
{
    const qw_trimesh *m = s->mesh;
    for (uint32_t f = 0; f < m->face_count; f++) measure_face(s, distance, f, l);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        uint32_t j = level_above(l, distance[v]);
        if (j < LEVELS) l->euler[j]++;
    }
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!qw_stands_for_edge(m, h)) continue;
        for (uint32_t j = 0; m->twin[h] == QW_NONE && j < LEVELS; j++)
            l->ends[j] += crosses(m, distance, h, l->step * (float)(j + 1));
        uint32_t j = level_above(l, fmaxf(distance[m->corner[h]], distance[m->corner[qw_next(h)]]));
        if (j < LEVELS) l->euler[j]--;
    }
    for (int j = 1; j < LEVELS; j++) l->area[j] += l->area[j - 1], l->euler[j] += l->euler[j - 1];
}

/* ---- curves */

/* The half-edge through which the line at that distance comes out of the face that it enters through h. */
static uint32_t way_out(const qw_trimesh *m, const float *distance, uint32_t h, float at)
{
    return crosses(m, distance, qw_next(h), at) ? qw_next(h) : qw_prev(h);
}

/* Walks along the line, which is one closed curve, or an open one from boundary to boundary, and puts points on it at
   equal ways. False where it is not. */
static bool trace(const search *s, const float *distance, float at, double length, neck *n)
{
    const qw_trimesh *m = s->mesh;
    qw_vec3 *point = n->point;
    uint32_t first = QW_NONE, taken = 0, steps = n->is_open ? POINTS - 1 : POINTS;
    for (uint32_t h = 0; h < 3 * m->face_count && first == QW_NONE; h++)
        if (crosses(m, distance, h, at) && (m->twin[h] == QW_NONE) == n->is_open) first = h;
    if (first == QW_NONE) return false;
    double gone = 0;
    qw_vec3 here = crossing(m, distance, first, at);
    uint32_t h = first;
    do {
        uint32_t out = way_out(m, distance, h, at);
        qw_vec3 next = crossing(m, distance, out, at);
        double step = (double)qw_distance(here, next);
        for (; taken < POINTS && taken * length / steps <= gone + step; taken++) {
            double share = step > 0 ? (taken * length / steps - gone) / step : 0;
            point[taken] = qw_lerp(here, next, (float)fmax(share, 0));
        }
        gone += step, here = next;
        h = m->twin[out];
        if ((h == QW_NONE && !n->is_open) || gone > 1.01 * length) return false;
    } while (h != first && h != QW_NONE);
    if (n->is_open && taken >= POINTS - 1) point[POINTS - 1] = here, taken = POINTS;
    return taken == POINTS && gone > 0.99 * length;
}

/* Whether the volume between what lies nearer than the curve and the middle of the curve is on the outside. */
static bool is_pocket(const search *s, const float *distance, float at, const neck *n)
{
    const qw_trimesh *m = s->mesh;
    int across = n->is_open ? POINTS - 1 : POINTS / 2; /* both ends of a half lie in the cut */
    qw_vec3 middle = qw_lerp(n->point[0], n->point[across], 0.5f);
    double volume = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        if (fmaxf(fmaxf(distance[c[0]], distance[c[1]]), distance[c[2]]) <= at)
            volume += (double)qw_dot(qw_sub(m->position[c[0]], middle), qw_face_cross(m, f));
    }
    return volume < 0;
}

/* Smooth and a little shorter, so that it lies in the neck; it stays on the surface. Around a limb it becomes straight:
   steps of a quarter of it undo a slant, but they would draw the rim of a pocket in. */
static void tighten(const search *s, neck *n)
{
    for (int round = 0; round < ROUNDS; round++) {
        qw_vec3 moved[POINTS];
        int step = n->is_pocket || n->is_open ? 1 : POINTS / 4 >> round % 4, first = n->is_open;
        qw_vec3 *point = n->point;
        memcpy(moved, point, sizeof moved);
        for (int i = first; i < POINTS - first; i++) {
            qw_vec3 middle = qw_scale(qw_add(point[(i + step) % POINTS], point[(i + POINTS - step) % POINTS]), 0.5f);
            moved[i] =
                qw_bvh_nearest(s->tree, qw_lerp(point[i], middle, 0.5f), qw_v3(0, 0, 0), -1, INFINITY, QW_NONE).point;
        }
        memcpy(point, moved, sizeof moved);
    }
}

/* Of the whole ring. */
static double length_of(const neck *n)
{
    double sum = 0;
    for (int i = 0; i + n->is_open < POINTS; i++) sum += (double)qw_distance(n->point[i], n->point[(i + 1) % POINTS]);
    return n->is_open ? 2 * sum : sum;
}

/* q where the level encloses a disc, which a cut may halve; else INFINITY. */
static double ratio_at(const search *s, const levels *l, int j)
{
    bool is_disc = l->euler[j] == 1 && l->area[j] > 0 && l->length[j] > 0 && l->ends[j] <= (s->is_half ? 2 : 0);
    double halves = l->ends[j] > 0 ? 2 : 1;
    return is_disc ? halves * l->length[j] * l->length[j] / (4 * QW_PI * l->area[j]) : INFINITY;
}

/* Whether six edges fit around; of a pocket half as long ones, as it has shorter ones than are wanted without it. */
static bool fits(double length, double size, bool is_pocket)
{
    return length >= QW_NECK_EDGES * size / (is_pocket ? 2 : 1);
}

static void take_neck(search *s, const levels *l, const float *distance, int j)
{
    neck n = {.ratio = ratio_at(s, l, j), .size = (float)(l->size[j] / l->length[j]), .is_open = l->ends[j] > 0};
    double at = l->step * (float)(j + 1), length = l->length[j];
    if (!fits(length * (1 + n.is_open), (double)n.size, true)) return;
    if (!trace(s, distance, (float)at, length, &n)) return;
    n.is_pocket = is_pocket(s, distance, (float)at, &n);
    tighten(s, &n);
    bool is_wanted = n.is_pocket || n.ratio * (1 + n.is_open) <= s->most_ratio;
    if (is_wanted && fits(length_of(&n), (double)n.size, n.is_pocket) && s->count < QW_MOST_NECKS)
        s->found[s->count++] = n;
}

/* All minima of q along the levels from which it rises on both sides, as far as discs are inside. */
static void find_minima(search *s, const levels *l, const float *distance)
{
    int best = 0;
    double before = INFINITY; /* the most since the last minimum */
    for (int j = 0; j < LEVELS; j++) {
        double q = ratio_at(s, l, j), least = ratio_at(s, l, best);
        bool goes_on = l->area[j] < MOST_INSIDE * s->area;
        if (q < least && goes_on) best = j;
        if (goes_on && j + 1 < LEVELS && !(q > RISE * least)) continue;
        bool is_neck = least <= MOST_RATIO && before > RISE * least;
        if (is_neck) take_neck(s, l, distance, best);
        if (!goes_on) return;
        before = is_neck ? q : fmax(before, q), best = j;
    }
}

static void look_from(search *s, uint32_t seed)
{
    qw_scope_begin(s->env);
    uint32_t n = s->mesh->vertex_count;
    const float *distance = distances_from(s, seed, 1e3f);
    uint64_t *key = QW_NEW(s->env, uint64_t, n);
    for (uint32_t v = 0; v < n; v++) key[v] = (uint64_t)(1e6 * (double)distance[v]);
    qw_sort_u64(key, n);
    levels l = {.step = (float)((double)key[(size_t)(FARTHEST * n)] / 1e6 / LEVELS)};
    if (l.step > 0) {
        measure_levels(s, distance, &l);
        find_minima(s, &l, distance);
    }
    qw_scope_end(s->env);
}

/* ---- which of them */

static bool are_near(const neck *a, const neck *b)
{
    float near = fmaxf(QW_NECKS_APART * fmaxf(a->size, b->size),
                       QW_NECKS_APART_SHARE * (float)(fmin(length_of(a), length_of(b)) / (2 * QW_PI)));
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < POINTS; k++)
            if (qw_distance(a->point[i], b->point[k]) < near) return true;
    return false;
}

/* The clearest first, without those that lie beside one that was taken. */
static qw_necks choose(search *s)
{
    qw_env *env = s->env;
    uint64_t *order = QW_NEW(env, uint64_t, s->count);
    for (size_t i = 0; i < s->count; i++) order[i] = (uint64_t)(1e9 * s->found[i].ratio) << 32 | i;
    qw_sort_u64(order, s->count);
    qw_necks necks = {0, QW_NEW(env, uint32_t, s->count + 1), QW_NEW(env, qw_vec3, s->count * (POINTS + 1)),
                      QW_NEW(env, float, s->count), QW_NEW(env, uint8_t, s->count)};
    uint32_t *taken = QW_NEW(env, uint32_t, s->count);
    necks.begin[0] = 0;
    for (size_t i = 0; i < s->count; i++) {
        const neck *n = &s->found[(uint32_t)order[i]];
        bool is_new = true;
        for (uint32_t k = 0; k < necks.count && is_new; k++) is_new = !are_near(n, &s->found[taken[k]]);
        if (!is_new) continue;
        qw_vec3 *to = necks.point + necks.begin[necks.count];
        memcpy(to, n->point, sizeof n->point);
        if (!n->is_open) to[POINTS] = n->point[0];
        taken[necks.count] = (uint32_t)order[i], necks.ratio[necks.count] = (float)n->ratio;
        necks.is_pocket[necks.count] = n->is_pocket;
        necks.count++, necks.begin[necks.count] = necks.begin[necks.count - 1] + POINTS + !n->is_open;
    }
    qw_free(env, taken), qw_free(env, order);
    return necks;
}

qw_necks qw_find_necks(qw_env *env, const qw_trimesh *surface, const qw_bvh *tree, const float *size, bool is_half,
                       double strength)
{
    assert(surface->twin && tree && size && strength > 0 && strength <= 1);
    search s = {.env = env,
                .mesh = surface,
                .tree = tree,
                .size = size,
                .is_half = is_half,
                .most_ratio = MOST_RATIO * strength,
                .area = qw_trimesh_area(surface)};
    qw_necks necks = {0};
    qw_scope_begin(env);
    s.found = QW_NEW(env, neck, QW_MOST_NECKS);
    qw_census census = qw_trimesh_census(env, surface);
    uint32_t seeds = 0, *seed = census.components <= MOST_COMPONENTS ? find_seeds(&s, &seeds) : NULL;
    for (uint32_t i = 0; i < seeds; i++) look_from(&s, seed[i]);
    if (s.count > 0) {
        necks = choose(&s);
        qw_keep(env, necks.begin), qw_keep(env, necks.point), qw_keep(env, necks.ratio);
        qw_keep(env, necks.is_pocket);
    }
    qw_log(env, QW_LOG_DEBUG, "necks: %u seeds, %u curves, %u taken", seeds, (unsigned)s.count, necks.count);
    qw_scope_end(env);
    return necks;
}
