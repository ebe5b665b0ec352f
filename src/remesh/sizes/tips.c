#include "remesh/sizes/tips.h"

#include "base/lanes.h"
#include "base/sort.h"
#include "base/elementary.h"
#include "geometry/bvh.h"
#include "solve/queue.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Means are taken over balls of this radius, in edges, to see where the surface lies most to one side. */
static const double REACH = 2;
/* Of REACH: on a plane the middle of what is around a point is the point itself, at a tip it lies about half of REACH
   away, and at the tips of twelve meshes at 100 to 10,000 quads never less than 0.36. No tip is looked for at less. */
static const float POINTED = 0.3f;
/* Ways around, over those of a plane: of what sticks out; and how much they grow again at its neck. */
static const float SLENDER = 0.64f, NECK = 1.25f;
/* What is so many edges around has enough quads anyway. */
static const float THICK = 6;
/* A way around is the mean over WINDOW bins of BIN edges' width; none is looked for farther than BINS of them. */
static const float BIN = 0.25f;
enum { WINDOW = 4, BINS = 80 };
/* What is a tube lies on both sides of a point: its middle is no farther from it than this share of its length. */
static const float ONE_SIDE = 0.33f;

typedef struct finder {
    const qw_cells *graph; /* of the vertices */
    const float *area;     /* float[vertices] */
    const uint8_t *open;   /* uint8_t[vertices]: 1 on a boundary */
    float edge;
    float *level;      /* float[vertices]: distance from the tip that is followed; INFINITY: not reached */
    uint32_t *reached; /* uint32_t[vertices]: those that are, in the order of their distance */
    uint32_t reached_count;
    qw_queue queue;
} finder;

/* What lies within each bin. */
typedef struct bins {
    float area[BINS];
    qw_vec3 moment[BINS];
} bins;

/* The share of the outline that a protrusion makes: it is about so large, seen from the side. */
static float outline_of(const qw_tip *t) { return t->length * t->girth / (float)QW_PI; }

/* ---- where tips may be */

/* The middle of what is around each cell: qw_vec3[cells->count]. */
static qw_vec3 *find_middles(qw_env *env, const qw_cells *c, const float *area, double radius)
{
    qw_vec3 *middle = QW_NEW(env, qw_vec3, c->count);
    float(*sum)[4] = (float(*)[4])QW_NEW(env, float, (size_t)4 * c->count);
    for (uint32_t i = 0; i < c->count; i++) {
        qw_vec3 p = qw_scale(c->point[i], area[i]);
        sum[i][0] = p.x, sum[i][1] = p.y, sum[i][2] = p.z, sum[i][3] = area[i];
    }
    qw_cells_spread(env, c, sum[0], 4, qw_cells_rounds(c, radius));
    for (uint32_t i = 0; i < c->count; i++) {
        float by = sum[i][3] > 0 ? 1 / sum[i][3] : 0;
        middle[i] = by > 0 ? qw_v3(sum[i][0] * by, sum[i][1] * by, sum[i][2] * by) : c->point[i];
    }
    qw_free(env, sum);
    return middle;
}

/* The vertex of each cell that lies farthest from the middle of what is around, and how far: [cells->count]. */
static void find_farthest(const qw_trimesh *m, const qw_cells *c, const qw_vec3 *middle, uint32_t *vertex,
                          float *offset)
{
    for (uint32_t i = 0; i < c->count; i++) vertex[i] = c->start[i], offset[i] = qw_distance(c->point[i], middle[i]);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        uint32_t i = c->of[v];
        float d = qw_distance(m->position[v], middle[i]);
        if (d > offset[i]) offset[i] = d, vertex[i] = v;
    }
}

/* Whether none of the cells within two links lies farther to one side; of equal ones the first does. */
static bool is_highest(const qw_cells *c, const float *offset, uint32_t a)
{
    for (uint32_t i = c->begin[a]; i < c->begin[a + 1]; i++) {
        uint32_t b = c->neighbour[i];
        if (offset[b] > offset[a] || (offset[b] == offset[a] && b < a)) return false;
        for (uint32_t k = c->begin[b]; k < c->begin[b + 1]; k++) {
            uint32_t d = c->neighbour[k];
            if (d != a && (offset[d] > offset[a] || (offset[d] == offset[a] && d < a))) return false;
        }
    }
    return true;
}

/* ---- from a tip to its neck */

static void reach(finder *f, uint32_t a, float level)
{
    f->level[a] = level;
    qw_queue_put(&f->queue, a, (int64_t)(level / f->edge * QW_QUEUE_UNIT));
}

/* Reaches b in a straight line from a, if that is a shorter way and no longer than `farthest`. Most of what is asked is
   reached already: that is seen first. */
static inline void reach_from(finder *f, uint32_t a, uint32_t b, float farthest)
{
    float gain = f->level[b] - f->level[a];
    if (!(gain > 0)) return;
    float way2 = qw_length2(qw_sub(f->graph->point[b], f->graph->point[a]));
    if (way2 >= gain * gain) return;
    float level = f->level[a] + sqrtf(way2);
    if (level <= farthest) reach(f, b, level);
}

/* Reaches the neighbours of a and theirs, in straight lines, as far as that from the tip: along the edges alone ways
   would be longer in some directions than in others. */
static void reach_around(finder *f, uint32_t a, float farthest)
{
    const qw_cells *c = f->graph;
    for (uint32_t i = c->begin[a]; i < c->begin[a + 1]; i++) {
        uint32_t b = c->neighbour[i];
        for (uint32_t k = c->begin[b]; k < c->begin[b + 1]; k++) reach_from(f, a, c->neighbour[k], farthest);
        reach_from(f, a, b, farthest);
    }
}

/* As if nothing had been reached. */
static void forget(finder *f)
{
    for (uint32_t i = 0; i < f->reached_count; i++) f->level[f->reached[i]] = INFINITY;
    for (uint32_t a; (a = qw_queue_take(&f->queue)) != QW_NONE;) f->level[a] = INFINITY;
    f->queue.last = 0, f->reached_count = 0;
}

/* The length of a way around at the outer end of bin k. */
static float girth_at(const finder *f, const bins *b, int k)
{
    float sum = 0;
    for (int i = 0; i < WINDOW; i++) sum += b->area[k - i];
    return sum / (WINDOW * BIN * f->edge);
}

/* Whether the neck is known once all of bin k is reached; *neck: the bin that it lies at so far, or -1. */
static bool is_beyond_neck(const finder *f, const bins *b, int k, float *least, int *neck)
{
    if (k < WINDOW - 1) return false;
    float girth = girth_at(f, b, k), middle = ((float)k + 1 - 0.5f * WINDOW) * BIN * f->edge,
          share = girth / (2 * (float)QW_PI * middle);
    if (share < *least) *least = share, *neck = k;
    return girth > THICK * f->edge || share > NECK * *least;
}

/* Reaches all around a vertex up to the neck, and sets the tip. Returns whether it is one. */
static bool follow(finder *f, uint32_t from, qw_tip *tip)
{
    bins b = {{0}, {{0, 0, 0}}};
    const qw_cells *c = f->graph;
    float least = INFINITY;
    int neck = -1, full = 0;
    bool ends = false;
    reach(f, from, 0);
    while (!ends && full < BINS) {
        uint32_t a = qw_queue_take(&f->queue);
        if (a == QW_NONE || f->open[a]) return false; /* all of a component, or not whole */
        f->reached[f->reached_count++] = a;
        int bin = (int)(f->level[a] / (BIN * f->edge));
        for (; full < bin && full < BINS && !ends; full++) ends = is_beyond_neck(f, &b, full, &least, &neck);
        if (ends || bin >= BINS) break;
        b.area[bin] += f->area[a], b.moment[bin] = qw_madd(b.moment[bin], f->area[a], c->point[a]);
        reach_around(f, a, INFINITY);
    }
    if (!(least < SLENDER)) return false;
    float area = 0;
    qw_vec3 moment = {0, 0, 0};
    for (int k = 0; k <= neck; k++) area += b.area[k], moment = qw_add(moment, b.moment[k]);
    tip->point = c->point[from], tip->length = ((float)neck + 1) * BIN * f->edge, tip->girth = area / tip->length;
    return area > 0 && qw_distance(qw_scale(moment, 1 / area), tip->point) > ONE_SIDE * tip->length;
}

/* ---- all of them */

/* The cells around one, in a walk over the links. */
typedef struct rounds {
    uint32_t *seen, *stack; /* uint32_t[cells->count]; seen: the cell around which each was seen last */
} rounds;

/* Whether none within `far` of a cell lies farther to one side: a tip that is so long is the highest as far as that. */
static bool is_highest_around(const qw_cells *c, const float *offset, uint32_t a, float far, rounds *r)
{
    uint32_t deep = 0;
    r->stack[deep++] = a, r->seen[a] = a;
    while (deep > 0) {
        uint32_t b = r->stack[--deep];
        for (uint32_t i = c->begin[b]; i < c->begin[b + 1]; i++) {
            uint32_t d = c->neighbour[i];
            if (r->seen[d] == a || qw_distance(c->point[d], c->point[a]) > far) continue;
            if (offset[d] > offset[a] || (offset[d] == offset[a] && d < a)) return false;
            r->seen[d] = a, r->stack[deep++] = d;
        }
    }
    return true;
}

/* The vertices from which tips are looked for, the one that lies farthest to one side first. Returns their number;
   key: uint64_t[cells->count], a vertex in its lower half. */
static uint32_t list_candidates(qw_env *env, const qw_trimesh *m, const qw_cells *c, const float *area, double radius,
                                float shortest, uint64_t *key)
{
    qw_scope_begin(env);
    float *offset = QW_NEW(env, float, c->count);
    uint32_t *vertex = QW_NEW(env, uint32_t, c->count), count = 0;
    rounds r = {QW_NEW(env, uint32_t, c->count), QW_NEW(env, uint32_t, c->count)};
    memset(r.seen, 0xff, c->count * sizeof *r.seen);
    find_farthest(m, c, find_middles(env, c, area, radius), vertex, offset);
    for (uint32_t i = 0; i < c->count; i++)
        if (offset[i] > POINTED * (float)radius && is_highest(c, offset, i) &&
            is_highest_around(c, offset, i, shortest, &r))
            key[count++] = (uint64_t)(UINT32_MAX - qw_float_key(offset[i])) << 32 | vertex[i];
    qw_sort_u64(key, count);
    qw_scope_end(env);
    return count;
}

/* Thirds of the areas of the faces around each vertex, and which vertices lie on a boundary. */
static void look_at_vertices(const qw_trimesh *m, float *area, uint8_t *open)
{
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        area[m->corner[h]] += qw_length(qw_face_cross(m, h / 3)) / 6;
        if (m->twin[h] == QW_NONE) open[m->corner[h]] = open[m->corner[qw_next(h)]] = 1;
    }
}

/* Sorts the tips by how much of the outline they make. */
static void sort_tips(qw_env *env, qw_tip_list *l)
{
    qw_scope_begin(env);
    uint64_t *key = QW_NEW(env, uint64_t, l->count);
    qw_tip *before = QW_NEW(env, qw_tip, l->count);
    for (uint32_t t = 0; t < l->count; t++)
        before[t] = l->tip[t], key[t] = (uint64_t)(UINT32_MAX - qw_float_key(outline_of(&before[t]))) << 32 | t;
    qw_sort_u64(key, l->count);
    for (uint32_t i = 0; i < l->count; i++) l->tip[i] = before[(uint32_t)key[i]];
    qw_scope_end(env);
}

static finder make_finder(qw_env *env, const qw_cells *graph, float edge)
{
    uint32_t n = graph->count;
    finder f = {.graph = graph, .edge = edge, .level = QW_NEW(env, float, n)};
    f.reached = QW_NEW(env, uint32_t, n), f.queue = qw_queue_create(env, n);
    for (uint32_t v = 0; v < n; v++) f.level[v] = INFINITY;
    return f;
}

/* Candidates that are followed side by side, each part of them by a finder of its own, to see which are tips. */
typedef struct scouting {
    finder *finder; /* finder[parts] */
    const uint64_t *key;
    uint32_t begin, end, parts;
    float shortest;
    uint8_t *is_tip; /* uint8_t[candidates] */
} scouting;

/* Follows every parts-th of the seeds; the threads differ in their first. */
static void scout_part(void *user, uint32_t begin, uint32_t end)
{
    (void)end;
    const scouting *s = user;
    finder *f = &s->finder[begin];
    for (uint32_t i = s->begin + begin; i < s->end; i += s->parts) {
        qw_tip tip;
        s->is_tip[i] = follow(f, (uint32_t)s->key[i], &tip) && tip.length >= s->shortest;
        forget(f);
    }
}

/* Which candidates are tips, were each alone: uint8_t[count]. With one thread all may be, as they are followed anyway.
 */
static uint8_t *scout(qw_env *env, const finder *f, const uint64_t *key, uint32_t count, float shortest)
{
    uint32_t threads = qw_env_threads(env), parts = threads < QW_MOST_LANES ? threads : QW_MOST_LANES;
    uint8_t *is_tip = memset(QW_NEW(env, uint8_t, count), 1, count);
    if (parts < 2) return is_tip;
    scouting s = {.finder = QW_NEW(env, finder, parts), .key = key, .parts = parts, .shortest = shortest};
    s.is_tip = is_tip;
    for (uint32_t k = 0; k < parts; k++) {
        s.finder[k] = make_finder(env, f->graph, f->edge);
        s.finder[k].area = f->area, s.finder[k].open = f->open;
    }
    for (uint32_t step = count / 16 + parts; s.begin < count; s.begin = s.end) { /* between which the host may cancel */
        s.end = count - s.begin > step ? s.begin + step : count;
        qw_parallel(env, parts, 1, scout_part, &s);
    }
    return is_tip;
}

/* Follows the candidates, and lists those that are tips: list->tip has room for all. */
static void follow_candidates(qw_env *env, finder *f, const uint64_t *key, uint32_t count, float shortest,
                              qw_tip_list *list)
{
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, f->graph->count); /* part of a tip */
    const uint8_t *is_tip = scout(env, f, key, count, shortest);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t from = (uint32_t)key[i];
        if (taken[from] || !is_tip[i]) continue;
        qw_heartbeat(env);
        qw_tip *tip = &list->tip[list->count];
        if (follow(f, from, tip) && tip->length >= shortest) {
            for (uint32_t k = 0; k < f->reached_count; k++)
                if (f->level[f->reached[k]] <= tip->length) taken[f->reached[k]] = 1;
            list->count++;
        }
        forget(f);
    }
}

qw_tip_list qw_find_tips(qw_env *env, const qw_surface_cells *surface, float edge, float shortest)
{
    const qw_trimesh *m = &surface->mesh;
    const qw_cells *cells = &surface->cells;
    assert(edge > 0 && m->twin);
    qw_tip_list list = {0};
    qw_scope_begin(env);
    qw_cells graph = qw_cells_of_vertices(env, m);
    float *area = QW_NEW_ZERO(env, float, m->vertex_count), *of_cell = QW_NEW_ZERO(env, float, cells->count);
    uint8_t *open = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    look_at_vertices(m, area, open);
    for (uint32_t v = 0; v < m->vertex_count; v++) of_cell[cells->of[v]] += area[v];
    uint64_t *key = QW_NEW(env, uint64_t, cells->count);
    uint32_t count = list_candidates(env, m, cells, of_cell, REACH * (double)edge, shortest, key);
    finder f = make_finder(env, &graph, edge);
    f.area = area, f.open = open;
    list.tip = QW_NEW(env, qw_tip, count);
    follow_candidates(env, &f, key, count, shortest, &list);
    sort_tips(env, &list);
    qw_keep(env, list.tip);
    qw_scope_end(env);
    return list;
}

/* ---- on another mesh */

/* The vertex that lies nearest to a point, by way of the nearest face. */
static uint32_t nearest_vertex(const qw_trimesh *m, const qw_bvh *tree, qw_vec3 point)
{
    qw_hit hit = qw_bvh_nearest(tree, point, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
    if (hit.face == QW_NONE) return QW_NONE;
    uint32_t most = hit.weight[1] > hit.weight[0];
    if (hit.weight[2] > hit.weight[most]) most = 2;
    return m->corner[3 * (size_t)hit.face + most];
}

uint32_t *qw_tips_of_vertices(qw_env *env, const qw_trimesh *m, const qw_tip_list *tips)
{
    uint32_t n = m->vertex_count, *of = QW_NEW(env, uint32_t, n);
    memset(of, 0xff, n * sizeof *of);
    if (tips->count == 0) return of;
    qw_scope_begin(env);
    qw_cells graph = qw_cells_of_vertices(env, m);
    const qw_bvh *tree = qw_bvh_build(env, m);
    finder f = make_finder(env, &graph, tips->tip[0].length);
    for (uint32_t t = 0; t < tips->count; t++) {
        uint32_t from = nearest_vertex(m, tree, tips->tip[t].point), a;
        if (from == QW_NONE) continue;
        reach(&f, from, 0);
        while ((a = qw_queue_take(&f.queue)) != QW_NONE) {
            f.reached[f.reached_count++] = a;
            if (of[a] == QW_NONE) of[a] = t;
            reach_around(&f, a, tips->tip[t].length);
        }
        forget(&f);
    }
    qw_scope_end(env);
    return of;
}
