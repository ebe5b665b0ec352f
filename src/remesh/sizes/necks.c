#include "remesh/sizes/necks.h"

#include "base/elementary.h"
#include "base/mechanisms.h"
#include "base/sets.h"
#include "base/sort.h"
#include "remesh/sizes/cells.h"
#include "remesh/sizes/turning.h"
#include "solve/queue.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* How much q rises between two necks on one limb, and by how much girths differ that are about the same. */
static const double RISE = 1.25;
/* Tips are looked for on so many cells at most. Distances from so many of them, far from one another, say how far out a
   cell is. A tip is farther out than the saddle to the next by half an edge. */
enum { MOST_CELLS = 16000, BASES = 8, MOST_SEEDS = 64 };
static const double HALF = 0.5;
/* A curve is looked for at so many distances, as many as there are edges on the way, up to where it has this share of
   the surface on its far side, or so many times what is farther out than the saddle. */
enum { LEVELS = 96 };
static const double MOST_INSIDE = 0.4, BEYOND_SADDLE = 3;
/* Edges in nests are as short as this share of the mean one at least. */
static const double SHORTEST = 0.2;
/* A dent turns by so much at least at strength 1; it has this share of the surface at most, and q of its rim is no
   larger. The scale of what surrounds it is 2 to the half of SURROUNDINGS times its own, which begins at an edge. */
static const double LEAST_TURN = 0.3, LARGEST = 0.1, LEAST_ROUND = 1.25;
enum { SURROUNDINGS = 4 };
/* Points of a curve, and the rounds in which it is made smooth and short. */
enum { POINTS = 32, ROUNDS = 12 };

typedef struct neck {
    double ratio;
    uint8_t kind, is_open;
    qw_vec3 point[POINTS]; /* on a whole ring, or from end to end of the half that a cut leaves */
    uint32_t face[POINTS]; /* that each lies on */
} neck;

typedef struct search {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_bvh *tree; /* NULL until it is needed */
    double edge, most_ratio;
    uint32_t *component, components; /* uint32_t[faces] */
    double *area;                    /* double[components] */
    bool is_inside_out;
    const double *cut; /* double[cuts][4] */
    uint32_t cuts;
    neck *found; /* neck[QW_MOST_NECKS] */
    size_t count;
    /* around the tip that is looked at, up to some distance */
    const uint32_t *outgoing; /* uint32_t[vertices] */
    float *distance;          /* float[vertices]; INFINITY: not reached */
    const float *height;      /* float[vertices]: of dents, below the tip of which distances are; else NULL */
    const float *turning;     /* float[vertices]: the same before what they enclose was filled up */
    uint32_t *reached, reached_count;
    uint32_t *face, face_count, *stamp,
        walk; /* the faces there; stamp: uint32_t[faces], the walk that was there last */
    qw_queue queue;
    uint32_t *flood;     /* uint32_t[faces] */
    uint8_t *is_marked;  /* uint8_t[faces]: what a flood looks for */
    uint8_t *is_covered; /* uint8_t[faces]: what pockets and dents enclose */
} search;

/* No distance is that large; other components are. */
static const float FARTHEST = 1e2f;

static double area_of(const qw_trimesh *m, uint32_t f) { return 0.5 * (double)qw_length(qw_face_cross(m, f)); }

/* ---- tips and floors */

/* A tip or a floor, and how much is to be looked at around it. */
typedef struct seed {
    uint32_t vertex;
    double area;
} seed;

/* The vertices, or cells of them where they are many. */
static qw_cells find_cells(const search *s)
{
    uint32_t n = s->mesh->vertex_count;
    if (n > MOST_CELLS) return qw_cells_of_mesh(s->env, s->mesh, (float)sqrt(qw_trimesh_area(s->mesh) / MOST_CELLS));
    qw_cells c = qw_cells_of_vertices(s->env, s->mesh);
    c.of = c.start = QW_NEW(s->env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) c.of[v] = v;
    return c;
}

/* The component of each cell: uint32_t[cells]. */
static uint32_t *components_of_cells(const search *s, const qw_cells *c)
{
    uint32_t *component = QW_NEW_ZERO(s->env, uint32_t, c->count);
    for (uint32_t h = 0; h < 3 * s->mesh->face_count; h++) component[c->of[s->mesh->corner[h]]] = s->component[h / 3];
    return component;
}

/* The mean distance of each cell to BASES of its component that lie far from one another: float[cells]. */
static float *how_far_out(const search *s, const qw_cells *c)
{
    const uint32_t *component = components_of_cells(s, c);
    uint32_t n = c->count, *base = QW_NEW(s->env, uint32_t, s->components);
    float *sum = QW_NEW_ZERO(s->env, float, n), *nearest = QW_NEW(s->env, float, n),
          *distance = QW_NEW(s->env, float, n);
    for (uint32_t k = n; k-- > 0;) base[component[k]] = k;
    for (int i = 0; i <= BASES; i++) { /* the first only says where the next is */
        for (uint32_t k = 0; k < n; k++) distance[k] = k == base[component[k]] ? 0 : FARTHEST;
        qw_cells_limit(s->env, c, distance, 1);
        for (uint32_t k = 0; k < n; k++) {
            if (i > 0 && distance[k] < FARTHEST) sum[k] += distance[k] / BASES;
            nearest[k] = i > 1 ? fminf(nearest[k], distance[k]) : distance[k];
        }
        for (uint32_t k = n; k-- > 0;) base[component[k]] = k;
        for (uint32_t k = 0; k < n; k++)
            if (nearest[k] > nearest[base[component[k]]]) base[component[k]] = k;
    }
    return sum;
}

/* Cells that are farther out than all around them, by more than this: as a flood falls from the farthest one, islands
   come up around them, and of two that meet the lower one ends. Those of less than the area are none. seed:
   seed[cells + 1]. */
static uint32_t find_islands(const search *s, const qw_cells *c, const float *out, float above, double least,
                             seed *seeds)
{
    qw_env *env = s->env;
    uint32_t n = c->count, count = 0, *set = QW_NEW(env, uint32_t, n), *top = QW_NEW(env, uint32_t, n),
             *is_up = QW_NEW_ZERO(env, uint32_t, n);
    const uint32_t *component = components_of_cells(s, c);
    double *area = QW_NEW_ZERO(env, double, n);
    for (uint32_t f = 0; f < s->mesh->face_count; f++) area[c->of[s->mesh->corner[3 * f]]] += area_of(s->mesh, f);
    uint64_t *order = QW_NEW(env, uint64_t, n);
    for (uint32_t i = 0; i < n; i++) order[i] = (uint64_t)(UINT32_MAX - qw_float_key(out[i])) << 32 | i, top[i] = i;
    qw_sort_u64(order, n);
    qw_sets_begin(set, n);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t v = (uint32_t)order[i];
        const double most = MOST_INSIDE * s->area[component[v]];
        is_up[v] = 1;
        for (uint32_t k = c->begin[v]; k < c->begin[v + 1]; k++) {
            if (!is_up[c->neighbour[k]]) continue;
            uint32_t a = qw_set_of(set, v), b = qw_set_of(set, c->neighbour[k]);
            if (a == b) continue;
            uint32_t high = out[top[a]] >= out[top[b]] ? a : b, low = high == a ? b : a, tip = top[high];
            if (out[top[low]] - out[v] > above && area[low] >= least)
                seeds[count++] = (seed){c->start[top[low]], fmin(BEYOND_SADDLE * area[low], most)};
            area[a] += area[b], area[b] = area[a];
            qw_join_sets(set, a, b);
            top[qw_set_of(set, a)] = tip;
        }
    }
    for (uint32_t i = 0; i < n; i++)
        if (qw_set_of(set, i) == i) seeds[count++] = (seed){c->start[top[i]], MOST_INSIDE * s->area[component[i]]};
    return count;
}

/* ---- around a tip */

static void reach(search *s, uint32_t v, float distance)
{
    if (distance >= s->distance[v]) return;
    s->distance[v] = distance;
    qw_queue_put(&s->queue, v, (int64_t)((double)distance / s->edge * QW_QUEUE_UNIT));
}

/* Distances along the edges from a vertex, until so much is reached. Returns the last. */
static float walk_from(search *s, uint32_t from, double most)
{
    const qw_trimesh *m = s->mesh;
    double area = 0;
    float last = 0;
    s->walk++;
    reach(s, from, 0);
    for (uint32_t v; area < most && (v = qw_queue_take(&s->queue)) != QW_NONE;) {
        uint32_t h = s->outgoing[v];
        s->reached[s->reached_count++] = v, last = s->distance[v];
        do {
            uint32_t f = h / 3, ends[2] = {m->corner[qw_next(h)], m->corner[qw_prev(h)]};
            for (int i = 0; i < 2; i++)
                reach(s, ends[i],
                      s->height ? fmaxf(last, s->height[from] - s->height[ends[i]])
                                : last + qw_distance(m->position[v], m->position[ends[i]]));
            if (s->stamp[f] != s->walk) s->stamp[f] = s->walk, s->face[s->face_count++] = f, area += area_of(m, f);
            h = qw_around(m, h);
        } while (h != QW_NONE && h != s->outgoing[v]);
    }
    return last;
}

/* Takes the distances of what was reached from what waits beyond, in the place of those from the tip: so much less than
   the largest of these, which is returned. Their lines lie along the rim of a pocket, at whatever slant the floor is.
 */
static float turn_around(search *s)
{
    const qw_trimesh *m = s->mesh;
    uint32_t beyond = s->reached_count;
    float last = 0;
    for (uint32_t i = 0; i < s->reached_count; i++) s->distance[s->reached[i]] = FARTHEST;
    for (uint32_t v; (v = qw_queue_take(&s->queue)) != QW_NONE;) s->distance[v] = INFINITY, s->reached[beyond++] = v;
    s->queue.last = 0;
    for (uint32_t i = s->reached_count; i < beyond; i++) reach(s, s->reached[i], 0);
    for (uint32_t v; (v = qw_queue_take(&s->queue)) != QW_NONE; last = s->distance[v]) {
        uint32_t h = s->outgoing[v];
        do {
            uint32_t ends[2] = {m->corner[qw_next(h)], m->corner[qw_prev(h)]};
            for (int i = 0; i < 2; i++)
                if (s->distance[ends[i]] <= FARTHEST)
                    reach(s, ends[i], s->distance[v] + qw_distance(m->position[v], m->position[ends[i]]));
            h = qw_around(m, h);
        } while (h != QW_NONE && h != s->outgoing[v]);
    }
    for (uint32_t i = 0; i < beyond; i++) s->distance[s->reached[i]] = last - s->distance[s->reached[i]];
    s->reached_count = beyond;
    return last;
}

/* As if nothing had been reached. */
static void forget(search *s)
{
    for (uint32_t i = 0; i < s->reached_count; i++) s->distance[s->reached[i]] = INFINITY;
    for (uint32_t v; (v = qw_queue_take(&s->queue)) != QW_NONE;) s->distance[v] = INFINITY;
    s->queue.last = 0, s->reached_count = s->face_count = 0;
}

/* ---- level lines */

/* What lies nearer to a seed than each of LEVELS distances, and the length of the line there. */
typedef struct levels {
    bool pockets; /* are looked for, and nothing else */
    bool others;  /* are there, of the other kind */
    int count;    /* of the levels: LEVELS at the most */
    float step;   /* level j is at (j + 1) times this */
    double length[LEVELS], area[LEVELS], turn[LEVELS];
    int64_t euler[LEVELS];
    uint32_t ends[LEVELS]; /* of the line, at a boundary */
} levels;

static float level_at(const levels *l, int j) { return l->step * (float)(j + 1); }

static uint32_t level_above(const levels *l, float distance)
{
    float j = distance / l->step;
    return j >= (float)l->count ? (uint32_t)l->count : (uint32_t)j;
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

/* Adds to every level of distance what triangle f has of its length, area, ends, Euler's number and turning. */
static void measure_face(const search *s, uint32_t f, levels *l)
{
    const qw_trimesh *m = s->mesh;
    const float *distance = s->distance;
    const uint32_t *c = m->corner + 3 * (size_t)f;
    float least = fminf(fminf(distance[c[0]], distance[c[1]]), distance[c[2]]),
          most = fmaxf(fmaxf(distance[c[0]], distance[c[1]]), distance[c[2]]);
    for (uint32_t j = level_above(l, least); j < (uint32_t)l->count && level_at(l, (int)j) < most; j++) {
        qw_vec3 end[2];
        int ends = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3 && ends < 2; h++)
            if (crosses(m, distance, h, level_at(l, (int)j)))
                end[ends++] = crossing(m, distance, h, level_at(l, (int)j));
        if (ends == 2) l->length[j] += (double)qw_distance(end[0], end[1]);
    }
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        float a = distance[m->corner[h]], b = distance[m->corner[qw_next(h)]];
        for (uint32_t j = level_above(l, fminf(a, b)); m->twin[h] == QW_NONE && j < (uint32_t)l->count; j++)
            l->ends[j] += crosses(m, distance, h, level_at(l, (int)j));
        uint32_t whole = level_above(l, fmaxf(a, b));
        if (qw_stands_for_edge(m, h) && whole < (uint32_t)l->count) l->euler[whole]--;
    }
    uint32_t whole = level_above(l, most);
    if (whole == (uint32_t)l->count) return;
    l->area[whole] += area_of(m, f), l->euler[whole]++;
    if (s->turning)
        l->turn[whole] += area_of(m, f) * (double)(s->turning[c[0]] + s->turning[c[1]] + s->turning[c[2]]) / 3;
}

/* Sums over all levels; what is counted at one is within those above it. */
static void measure_levels(const search *s, levels *l)
{
    for (uint32_t i = 0; i < s->face_count; i++) measure_face(s, s->face[i], l);
    for (uint32_t i = 0; i < s->reached_count; i++) {
        uint32_t j = level_above(l, s->distance[s->reached[i]]);
        if (j < (uint32_t)l->count) l->euler[j]++;
    }
    for (int j = 1; j < l->count; j++)
        l->area[j] += l->area[j - 1], l->turn[j] += l->turn[j - 1], l->euler[j] += l->euler[j - 1];
}

/* q where the level encloses a disc, which a cut may halve; else INFINITY. */
static double ratio_at(const search *s, const levels *l, int j)
{
    bool is_disc = l->euler[j] == 1 && l->area[j] > 0 && l->length[j] > 0 && l->ends[j] <= (s->cuts > 0 ? 2 : 0);
    double halves = l->ends[j] > 0 ? 2 : 1;
    return is_disc ? halves * l->length[j] * l->length[j] / (4 * QW_PI * l->area[j]) : INFINITY;
}

/* ---- curves */

/* The half-edge through which the line at that distance comes out of the face that it enters through h. */
static uint32_t way_out(const search *s, uint32_t h, float at)
{
    return crosses(s->mesh, s->distance, qw_next(h), at) ? qw_next(h) : qw_prev(h);
}

/* Walks along the line, which is one closed curve, or an open one from boundary to boundary, and puts points on it at
   equal ways. False where it is not. */
static bool trace(const search *s, float at, double length, neck *n)
{
    const qw_trimesh *m = s->mesh;
    uint32_t first = QW_NONE, taken = 0, steps = n->is_open ? POINTS - 1 : POINTS;
    for (uint32_t i = 0; i < 3 * s->face_count && first == QW_NONE; i++) {
        uint32_t h = 3 * s->face[i / 3] + i % 3;
        if (crosses(m, s->distance, h, at) && (m->twin[h] == QW_NONE) == n->is_open) first = h;
    }
    if (first == QW_NONE) return false;
    double gone = 0;
    qw_vec3 here = crossing(m, s->distance, first, at);
    uint32_t h = first;
    do {
        uint32_t out = way_out(s, h, at);
        qw_vec3 next = crossing(m, s->distance, out, at);
        double step = (double)qw_distance(here, next);
        for (; taken < POINTS && taken * length / steps <= gone + step; taken++) {
            double share = step > 0 ? (taken * length / steps - gone) / step : 0;
            n->point[taken] = qw_lerp(here, next, (float)fmax(share, 0)), n->face[taken] = h / 3;
        }
        gone += step, here = next;
        h = m->twin[out];
        if ((h == QW_NONE && !n->is_open) || gone > 1.01 * length) return false;
    } while (h != first && h != QW_NONE);
    if (n->is_open && taken == POINTS - 1) n->point[taken] = here, n->face[taken] = n->face[taken - 1], taken++;
    return taken == POINTS && gone > 0.99 * length;
}

/* Whether all faces of a closed surface look inward, or of half of one, whose boundary lies in the cut. */
static bool is_inside_out(const search *s)
{
    const qw_trimesh *m = s->mesh;
    uint32_t *rim = QW_NEW_ZERO(s->env, uint32_t, s->components);
    double volume = 0;
    bool is_open = false;
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (m->twin[h] == QW_NONE) rim[s->component[h / 3]] = m->corner[h], is_open = true;
    for (uint32_t f = 0; f < m->face_count; f++)
        volume += (double)qw_dot(qw_sub(m->position[m->corner[3 * (size_t)f]], m->position[rim[s->component[f]]]),
                                 qw_face_cross(m, f));
    return volume < 0 && (s->cuts > 0 || !is_open);
}

static void measure_components(search *s)
{
    const qw_trimesh *m = s->mesh;
    s->component = QW_NEW(s->env, uint32_t, m->face_count);
    s->components = qw_label_components(s->env, 3, m->twin, m->face_count, s->component);
    s->area = QW_NEW_ZERO(s->env, double, s->components);
    for (uint32_t f = 0; f < m->face_count; f++) s->area[s->component[f]] += area_of(m, f);
    s->is_inside_out = is_inside_out(s);
}

/* The normal of the cut in which the ends of a half lie. */
static qw_vec3 normal_at_ends(const search *s, const neck *n)
{
    const double *best = s->cut;
    double least = INFINITY;
    for (uint32_t i = 0; i < s->cuts; i++) {
        const double *cut = s->cut + 4 * (size_t)i;
        double up = fabs((double)qw_dot(qw_v3_of_doubles(cut), n->point[0]) - cut[3]);
        if (up < least) least = up, best = cut;
    }
    return qw_v3_of_doubles(best);
}

/* Whether the volume between what lies nearer than the curve and the middle of the curve is on the outside. */
static bool is_pocket(const search *s, float at, const neck *n)
{
    const qw_trimesh *m = s->mesh;
    int across = n->is_open ? POINTS - 1 : POINTS / 2; /* both ends of a half lie in the cut */
    qw_vec3 middle = qw_lerp(n->point[0], n->point[across], 0.5f);
    double volume = 0;
    for (uint32_t i = 0; i < s->face_count; i++) {
        const uint32_t *c = m->corner + 3 * (size_t)s->face[i];
        if (fmaxf(fmaxf(s->distance[c[0]], s->distance[c[1]]), s->distance[c[2]]) <= at)
            volume += (double)qw_dot(qw_sub(m->position[c[0]], middle), qw_face_cross(m, s->face[i]));
    }
    return s->is_inside_out ? volume > 0 : volume < 0;
}

/* Whether something that was taken lies within the level; if not, it is taken. */
static bool cover(const search *s, float at)
{
    for (int round = 0; round < 2; round++)
        for (uint32_t i = 0; i < s->face_count; i++) {
            const uint32_t *c = s->mesh->corner + 3 * (size_t)s->face[i];
            if (fminf(fminf(s->distance[c[0]], s->distance[c[1]]), s->distance[c[2]]) > at) continue;
            if (round == 0 && s->is_covered[s->face[i]]) return false;
            if (round == 1) s->is_covered[s->face[i]] = 1;
        }
    return true;
}

/* Of the whole ring. */
static double length_of(const neck *n)
{
    double sum = 0;
    for (int i = 0; i + n->is_open < POINTS; i++) sum += (double)qw_distance(n->point[i], n->point[(i + 1) % POINTS]);
    return n->is_open ? 2 * sum : sum;
}

/* Point i of the whole ring: beyond an end of a half the other half's, so that the curve stands on the cut. */
static qw_vec3 point_at(const search *s, const neck *n, int i)
{
    if (!n->is_open) return n->point[(i + POINTS) % POINTS];
    int k = i < 0 ? -i : i >= POINTS ? 2 * (POINTS - 1) - i : i;
    if (k == i) return n->point[i];
    qw_vec3 normal = normal_at_ends(s, n), p = n->point[k];
    return qw_madd(p, 2 * qw_dot(qw_sub(n->point[0], p), normal), normal);
}

/* Moves each point half way to between those `step` before and after it, on the surface. */
static void draw_in(const search *s, neck *n, int step)
{
    qw_vec3 moved[POINTS];
    for (int i = 0; i < POINTS; i++) {
        qw_vec3 middle = qw_scale(qw_add(point_at(s, n, i + step), point_at(s, n, i - step)), 0.5f),
                to = qw_lerp(n->point[i], middle, 0.5f);
        qw_hit hit = qw_bvh_nearest(s->tree, to, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
        moved[i] = hit.point, n->face[i] = hit.face;
        if (!n->is_open || (i > 0 && i < POINTS - 1)) continue;
        qw_vec3 normal = normal_at_ends(s, n); /* an end stays in the plane */
        moved[i] = qw_madd(hit.point, qw_dot(qw_sub(n->point[0], hit.point), normal), normal);
    }
    memcpy(n->point, moved, sizeof moved);
}

/* Whether a marked face can be reached from a point of a curve across edges that are as near as this to the point. */
static bool is_beside(search *s, const neck *n, int point, float near)
{
    const qw_trimesh *m = s->mesh;
    uint32_t deep = 0;
    s->walk++;
    s->flood[deep++] = n->face[point], s->stamp[n->face[point]] = s->walk;
    while (deep > 0) {
        uint32_t f = s->flood[--deep];
        if (s->is_marked[f]) return true;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t t = m->twin[h];
            if (t == QW_NONE || s->stamp[t / 3] == s->walk) continue;
            qw_vec3 a = m->position[m->corner[h]], b = m->position[m->corner[qw_next(h)]];
            if (qw_distance2_to_segment(n->point[point], a, b) > near * near) continue;
            s->stamp[t / 3] = s->walk, s->flood[deep++] = t / 3;
        }
    }
    return false;
}

/* Whether each point can be reached along the surface from the one before, no farther away than it is itself: around
   the corner of a mouth points may be drawn from one lip to the other. */
static bool holds_together(search *s, const neck *n)
{
    bool holds = true;
    for (int i = 0; i + n->is_open < POINTS && holds; i++) {
        int next = (i + 1) % POINTS;
        s->is_marked[n->face[next]] = 1;
        holds = is_beside(s, n, i, qw_distance(n->point[i], n->point[next]));
        s->is_marked[n->face[next]] = 0;
    }
    return holds;
}

/* Smooth and a little shorter, so that it lies in the neck; it stays on the surface. Around a limb it becomes straight:
   steps of a quarter of it undo a slant, but they would draw the rim of a pocket in, and more than a few rounds would
   draw it off the corners of a mouth. */
static void tighten(search *s, neck *n)
{
    for (int i = 0; i < (n->kind ? ROUNDS / 3 : ROUNDS); i++) {
        neck before = *n;
        draw_in(s, n, n->kind || n->is_open ? 1 : POINTS / 4 >> i % 4);
        if (!n->kind || holds_together(s, n)) continue;
        *n = before;
        return;
    }
}

static bool fits(double length, double edge, int kind)
{
    return length >= (kind == QW_DENT ? QW_DENT_EDGES : QW_NECK_EDGES * SHORTEST) * edge;
}

bool qw_fits_on_neck(const qw_vec3 *point, uint32_t count, double edge, int kind)
{
    double length = 0;
    for (uint32_t i = 0; i + 1 < count; i++) length += (double)qw_distance(point[i], point[i + 1]);
    return fits(qw_distance(point[0], point[count - 1]) == 0 ? length : 2 * length, edge, kind);
}

/* The middle of the levels around one over which the girth stays about the same: rings on both sides of it are as long,
   and necks of fingers do not meet where these part. */
static int middle_of_stretch(const search *s, const levels *l, int best)
{
    int end[2] = {best, best};
    double least = l->length[best] / RISE, most = l->length[best] * RISE;
    for (int k = 0; k < 2; k++)
        for (int j = best; j >= 0 && j < l->count && ratio_at(s, l, j) < INFINITY; j += k ? 1 : -1) {
            if (l->length[j] < least || l->length[j] > most) break;
            end[k] = j;
        }
    return (end[0] + end[1]) / 2;
}

/* Takes the level j for a neck if it is round enough, of the kind that is sought, and fits quads. */
static void take_neck(search *s, levels *l, int j)
{
    neck n = {.ratio = ratio_at(s, l, j), .is_open = l->ends[j] > 0};
    if (s->count == QW_MOST_NECKS || !fits(l->length[j] * (1 + n.is_open), s->edge, QW_LIMB) ||
        !trace(s, level_at(l, j), l->length[j], &n))
        return;
    n.kind = is_pocket(s, level_at(l, j), &n) ? QW_POCKET : QW_LIMB;
    if (n.kind != (int)l->pockets) l->others = true;
    if (n.kind != (int)l->pockets || (n.kind == QW_LIMB && n.ratio * (1 + n.is_open) > s->most_ratio)) return;
    if (n.kind == QW_POCKET) (void)cover(s, level_at(l, j));
    if (n.kind == QW_LIMB && !n.is_open) {
        int middle = middle_of_stretch(s, l, j);
        if (!trace(s, level_at(l, middle), l->length[middle], &n)) return;
    }
    if (!s->tree) s->tree = qw_bvh_build(s->env, s->mesh);
    tighten(s, &n);
    if (fits(length_of(&n), s->edge, n.kind)) s->found[s->count++] = n;
}

/* All minima of q along the levels from which it rises on both sides, or stays low up to where so much is inside. */
static void find_minima(search *s, levels *l)
{
    int best = 0;
    double before = INFINITY; /* the most since the last minimum */
    for (int j = 0; j < l->count; j++) {
        double q = ratio_at(s, l, j), least = ratio_at(s, l, best);
        bool goes_on = l->area[j] < MOST_INSIDE * s->area[s->component[s->face[0]]];
        if (q < least && goes_on) best = j;
        if (goes_on && !(q > RISE * least)) continue;
        bool is_neck = least <= QW_NECK_RATIO && before > RISE * least;
        if (is_neck) take_neck(s, l, best);
        if (!goes_on) return;
        before = is_neck ? q : fmax(before, q), best = j;
    }
}

/* Necks among the lines up to the distance `last`: pockets, or others. Returns whether there are others than these. */
static bool look_at_levels(search *s, float last, bool pockets)
{
    levels l = {.count = (int)fmin(sqrt(s->reached_count), LEVELS), .pockets = pockets};
    l.step = last / (float)l.count;
    if (!(l.step > 0)) return false;
    measure_levels(s, &l);
    find_minima(s, &l);
    return l.others;
}

static void look_from(search *s, const seed *from)
{
    if (look_at_levels(s, walk_from(s, from->vertex, from->area), false)) (void)look_at_levels(s, turn_around(s), true);
    forget(s);
}

/* ---- dents */

/* Fills hollows of a height function. Each height becomes the least that a path to it must climb to from the largest
   part at 0 or below, whose heights become 0: what lies above a level has no holes then. */
static void fill_up(search *s, const float *height, float *filled)
{
    qw_env *env = s->env;
    const qw_trimesh *m = s->mesh;
    uint32_t n = m->vertex_count, largest = 0;
    qw_scope_begin(env);
    uint32_t *set = QW_NEW(env, uint32_t, n);
    double *area = QW_NEW_ZERO(env, double, n);
    float highest = 0;
    qw_sets_begin(set, n);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (height[m->corner[h]] <= 0 && height[m->corner[qw_next(h)]] <= 0)
            qw_join_sets(set, m->corner[h], m->corner[qw_next(h)]);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) area[qw_set_of(set, m->corner[h])] += area_of(m, h / 3);
    for (uint32_t v = 0; v < n; v++) {
        highest = fmaxf(highest, height[v]);
        if (height[v] <= 0 && (height[largest] > 0 || area[qw_set_of(set, v)] > area[qw_set_of(set, largest)]))
            largest = v;
    }
    for (uint32_t v = 0; v < n; v++) filled[v] = INFINITY;
    for (uint32_t v = 0; v < n; v++)
        if (qw_set_of(set, v) == qw_set_of(set, largest)) qw_queue_put(&s->queue, v, 0), filled[v] = 0;
    for (uint32_t v; (v = qw_queue_take(&s->queue)) != QW_NONE;) {
        uint32_t h = s->outgoing[v];
        do {
            uint32_t ends[2] = {m->corner[qw_next(h)], m->corner[qw_prev(h)]};
            for (int i = 0; i < 2; i++) {
                float to = fmaxf(filled[v], height[ends[i]]);
                if (to >= filled[ends[i]]) continue;
                filled[ends[i]] = to;
                qw_queue_put(&s->queue, ends[i], (int64_t)((double)(to / highest) * QW_QUEUE_UNIT * QW_QUEUE_UNIT));
            }
            h = qw_around(m, h);
        } while (h != QW_NONE && h != s->outgoing[v]);
    }
    for (uint32_t v = 0; v < n; v++)
        if (filled[v] == INFINITY) filled[v] = 0; /* of another component */
    s->queue.last = 0;
    qw_scope_end(env);
}

/* Takes the level line within which the surface turns most for the line's length, if that makes a dent. */
static void look_at_island(search *s, const seed *from, double least)
{
    levels l = {.count = LEVELS};
    l.step = walk_from(s, from->vertex, from->area) / (float)l.count;
    if (!(l.step > 0)) return;
    measure_levels(s, &l);
    int best = -1;
    for (int j = 0; j < l.count; j++)
        if (ratio_at(s, &l, j) < INFINITY && (best < 0 || l.turn[j] * l.length[best] > l.turn[best] * l.length[j]))
            best = j;
    if (best < 0 || best == l.count - 1 || l.turn[best] < least * l.length[best]) return;
    neck n = {.ratio = 1, .kind = QW_DENT, .is_open = l.ends[best] > 0};
    double halves = 1 + n.is_open, q = ratio_at(s, &l, best) / halves;
    if (q > LEAST_ROUND || !fits(halves * l.length[best], s->edge, QW_DENT) || s->count == QW_MOST_NECKS ||
        !trace(s, level_at(&l, best), l.length[best], &n) || !cover(s, level_at(&l, best)))
        return;
    if (!s->tree) s->tree = qw_bvh_build(s->env, s->mesh);
    tighten(s, &n);
    s->found[s->count++] = n;
}

/* Dents that have a twin, or are their own, as there is a cut: the widest scale first, where the lids and the corner of
   an eye are one. */
static void find_dents(search *s, double strength)
{
    qw_env *env = s->env;
    const qw_trimesh *m = s->mesh;
    uint32_t n = m->vertex_count, scales = SURROUNDINGS;
    const double widest = LARGEST * qw_trimesh_area(m) / (4 * QW_PI), around = QW_DENT_EDGES * s->edge;
    while (s->edge * s->edge * (double)(1u << (scales - SURROUNDINGS)) < widest) scales++;
    float *turning = qw_turning(env, m, s->cut, s->edge, scales), *height = QW_NEW(env, float, n),
          *filled = QW_NEW(env, float, n);
    qw_cells vertices = qw_cells_of_vertices(env, m);
    vertices.of = vertices.start = QW_NEW(env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) vertices.of[v] = v;
    seed *seeds = QW_NEW(env, seed, 2 * (size_t)n);
    s->height = filled, s->turning = height;
    for (uint32_t i = scales - SURROUNDINGS; i-- > 0;) {
        const float *here = turning + (size_t)i * n, *surroundings = here + (size_t)SURROUNDINGS * n;
        for (uint32_t v = 0; v < n; v++) height[v] = (s->is_inside_out ? 1 : -1) * (here[v] - surroundings[v]);
        fill_up(s, height, filled);
        qw_scope_begin(env);
        uint32_t count = find_islands(s, &vertices, filled, 0, around * around / (4 * QW_PI * LEAST_ROUND), seeds);
        qw_scope_end(env);
        for (uint32_t k = 0; k < count; k++) {
            uint32_t c = s->component[s->outgoing[seeds[k].vertex] / 3];
            seeds[k].area = fmin(seeds[k].area, LARGEST * s->area[c]);
            look_at_island(s, &seeds[k], LEAST_TURN / strength);
            forget(s);
        }
    }
}

/* ---- which of them */

/* The clearest first, without those that lie beside one that was taken: nearer along the surface than an edge of
   theirs, or than so much of their radius. */
static qw_necks choose(search *s)
{
    qw_env *env = s->env;
    uint64_t *order = QW_NEW(env, uint64_t, s->count);
    for (size_t i = 0; i < s->count; i++) order[i] = (uint64_t)(1e9 * s->found[i].ratio) << 32 | i;
    qw_sort_u64(order, s->count);
    qw_necks necks = {0, QW_NEW_ZERO(env, uint32_t, s->count + 1), QW_NEW(env, qw_vec3, s->count * (POINTS + 1)),
                      QW_NEW(env, uint8_t, s->count)};
    for (size_t i = 0; i < s->count; i++) {
        const neck *n = &s->found[(uint32_t)order[i]];
        double length = length_of(n);
        float near = fmaxf((float)fmin(s->edge, length / QW_NECK_EDGES),
                           QW_NECKS_APART_SHARE * (float)(length / (2 * QW_PI)));
        bool is_new = true;
        for (int k = 0; k < POINTS && is_new; k++) is_new = !is_beside(s, n, k, near);
        if (!is_new) continue;
        for (int k = 0; k < POINTS; k++) s->is_marked[n->face[k]] = 1;
        uint32_t to = necks.begin[necks.count];
        memcpy(necks.point + to, n->point, sizeof n->point);
        if (!n->is_open) necks.point[to + POINTS] = n->point[0];
        necks.kind[necks.count++] = n->kind, necks.begin[necks.count] = to + POINTS + !n->is_open;
    }
    qw_free(env, order);
    return necks;
}

qw_necks qw_find_necks(qw_env *env, const qw_trimesh *m, double edge, const double *cut, uint32_t cuts, bool dents,
                       double strength)
{
    assert(m->twin && edge > 0 && strength > 0 && strength <= 1);
    uint32_t n = m->vertex_count;
    qw_necks necks = {0};
    qw_scope_begin(env);
    search s = {.env = env, .mesh = m, .edge = edge, .cut = cut, .cuts = cuts, .most_ratio = QW_NECK_RATIO * strength};
    s.found = QW_NEW(env, neck, QW_MOST_NECKS);
    measure_components(&s);
    qw_cells cells = find_cells(&s);
    seed *seeds = QW_NEW(env, seed, 2 * (size_t)cells.count);
    uint32_t count = find_islands(&s, &cells, how_far_out(&s, &cells), (float)(HALF * edge), 0, seeds);
    if (count > MOST_SEEDS) count = MOST_SEEDS;
    s.outgoing = qw_trimesh_outgoing(env, m), s.queue = qw_queue_create(env, n);
    s.distance = QW_NEW(env, float, n), s.reached = QW_NEW(env, uint32_t, n);
    s.face = QW_NEW(env, uint32_t, m->face_count), s.stamp = QW_NEW_ZERO(env, uint32_t, m->face_count);
    s.flood = QW_NEW(env, uint32_t, m->face_count), s.is_marked = QW_NEW_ZERO(env, uint8_t, m->face_count);
    s.is_covered = QW_NEW_ZERO(env, uint8_t, m->face_count);
    for (uint32_t v = 0; v < n; v++) s.distance[v] = INFINITY;
    for (uint32_t i = 0; i < count; i++) look_from(&s, &seeds[i]);
    size_t before = s.count;
    if (dents && qw_uses(env, QW_MECH_DENTS)) find_dents(&s, strength), qw_did(env, QW_MECH_DENTS, s.count - before);
    if (s.count > 0) {
        necks = choose(&s);
        qw_keep(env, necks.begin), qw_keep(env, necks.point), qw_keep(env, necks.kind);
    }
    qw_log(env, QW_LOG_DEBUG, "necks: %u seeds, %u curves, %u taken", count, (unsigned)s.count, necks.count);
    qw_scope_end(env);
    return necks;
}
