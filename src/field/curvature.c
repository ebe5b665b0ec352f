/* Edges and triangles of the surface are cut into pieces no longer than half the scale, pieces near to one another that
 * face the same way are put together (clusters), and each point looks at the clusters around it. */
#include "field/curvature.h"

#include <math.h>
#include <string.h>
#include <stdlib.h>

enum { GRAIN = 256, MOST_CUTS = 128, CELL_BITS = 20 };

/* The reach of a point, in scales, where the weight of what it sees falls to 0; clusters are this much smaller. */
static float REACH = 1.25f, CLUSTERS = 3.0f;
/* The share of the difference of the principal curvatures in the sum of their amounts: below the first a direction
 * means nothing, from the second on it is plain. */
static const float ROUND = 0.2f, PLAIN = 0.4f;

typedef struct piece {
    qw_vec3 at, normal; /* normal: times the area for triangles, any length for edges */
    float tensor[6];    /* xx xy xz yy yz zz: angle x length x direction (x) direction */
    float area;
} piece;

typedef struct cluster {
    piece sum; /* at: the sum, then the mean */
    float count;
    uint32_t bin;
} cluster;

/* Cell keys to indices in the order of their first use, by open addressing. */
typedef struct table {
    uint64_t *key;   /* [capacity], 0: free */
    uint32_t *value; /* [capacity] */
    size_t capacity; /* a power of two */
    uint32_t count;
} table;

typedef struct gathering {
    const qw_trimesh *surface;
    float cell; /* edge length of the clusters' cells */
    table cells, bins;
    cluster *clusters;
    size_t capacity;
    uint32_t *first, *member; /* clusters of each bin */
    float bin_size;
} gathering;

/* ---- cells */

static size_t slot_of(const table *t, uint64_t key)
{
    uint64_t z = key * 0x9e3779b97f4a7c15u;
    size_t at = (size_t)(z ^ (z >> 29)) & (t->capacity - 1);
    while (t->key[at] != 0 && t->key[at] != key) at = (at + 1) & (t->capacity - 1);
    return at;
}

static void begin_table(qw_env *env, table *t, size_t capacity)
{
    t->capacity = capacity;
    t->key = QW_NEW_ZERO(env, uint64_t, capacity), t->value = QW_NEW(env, uint32_t, capacity);
}

static void grow_table(qw_env *env, table *t)
{
    table old = *t;
    begin_table(env, t, 2 * old.capacity);
    for (size_t i = 0; i < old.capacity; i++) {
        if (old.key[i] == 0) continue;
        size_t at = slot_of(t, old.key[i]);
        t->key[at] = old.key[i], t->value[at] = old.value[i];
    }
    qw_free(env, old.key), qw_free(env, old.value);
}

static uint32_t index_of(qw_env *env, table *t, uint64_t key)
{
    size_t at = slot_of(t, key);
    if (t->key[at] == key) return t->value[at];
    if (2 * (size_t)(t->count + 1) > t->capacity) {
        grow_table(env, t);
        at = slot_of(t, key);
    }
    t->key[at] = key;
    return t->value[at] = t->count++;
}

static uint64_t coordinate(float x, float cell)
{
    const float most = (float)(1 << (CELL_BITS - 1)) - 2;
    return (uint64_t)(int64_t)(fminf(fmaxf(floorf(x / cell), -most), most) + (float)(1 << (CELL_BITS - 1)));
}

/* Never 0. */
static uint64_t key_of(uint64_t x, uint64_t y, uint64_t z, uint64_t side)
{
    return (uint64_t)1 << 63 | side << (3 * CELL_BITS) | x << (2 * CELL_BITS) | y << CELL_BITS | z;
}

static uint64_t side_of(qw_vec3 n)
{
    float x = fabsf(n.x), y = fabsf(n.y), z = fabsf(n.z);
    if (x >= y && x >= z) return n.x < 0;
    if (y >= z) return 2 + (n.y < 0);
    return 4 + (n.z < 0);
}

static void add_piece(qw_env *env, gathering *g, const piece *p)
{
    uint64_t key = key_of(coordinate(p->at.x, g->cell), coordinate(p->at.y, g->cell), coordinate(p->at.z, g->cell),
                          side_of(p->normal));
    uint32_t before = g->cells.count, i = index_of(env, &g->cells, key);
    if (i == before) {
        g->clusters = qw_grow(env, g->clusters, &g->capacity, (size_t)i + 1, sizeof *g->clusters);
        g->clusters[i] = (cluster){.count = 0};
    }
    cluster *c = &g->clusters[i];
    c->sum.at = qw_add(c->sum.at, p->at), c->sum.normal = qw_add(c->sum.normal, p->normal);
    for (int k = 0; k < 6; k++) c->sum.tensor[k] += p->tensor[k];
    c->sum.area += p->area;
    c->count += 1;
}

/* ---- pieces */

static uint32_t cuts(float length, float most) { return (uint32_t)fminf(fmaxf(ceilf(length / most), 1), MOST_CUTS); }

static void add_edge(qw_env *env, gathering *g, const qw_vec3 *face_normal, uint32_t h)
{
    const qw_trimesh *m = g->surface;
    uint32_t t = m->twin[h];
    if (t == QW_NONE || t < h) return;
    qw_vec3 a = m->position[m->corner[h]], e = qw_sub(m->position[m->corner[qw_next(h)]], a), n = face_normal[h / 3],
            other = face_normal[t / 3];
    float length = qw_length(e);
    if (length <= 0) return;
    qw_vec3 u = qw_scale(e, 1 / length);
    float bend = atan2f(qw_dot(qw_cross(n, other), u), qw_dot(n, other)) * length;
    if (bend == 0) return;
    uint32_t count = cuts(length, 1.5f * g->cell);
    bend /= (float)count;
    piece p = {.normal = qw_scale(qw_add(n, other), 1e-6f * g->cell * g->cell),
               .tensor = {bend * u.x * u.x, bend * u.x * u.y, bend * u.x * u.z, bend * u.y * u.y, bend * u.y * u.z,
                          bend * u.z * u.z}};
    for (uint32_t i = 0; i < count; i++) {
        p.at = qw_madd(a, ((float)i + 0.5f) / (float)count, e);
        add_piece(env, g, &p);
    }
}

/* Rows along the longest side, as wide as high. */
static void add_face(qw_env *env, gathering *g, const qw_vec3 *face_normal, uint32_t f)
{
    const qw_trimesh *m = g->surface;
    uint32_t longest = 3 * f;
    float length = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        float l = qw_distance(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]]);
        if (l > length) length = l, longest = h;
    }
    float area = qw_length(qw_face_cross(m, f)) / 2;
    if (area <= 0) return;
    qw_vec3 a = m->position[m->corner[longest]], along = qw_sub(m->position[m->corner[qw_next(longest)]], a),
            up = qw_sub(m->position[m->corner[qw_prev(longest)]], a);
    uint32_t rows = cuts(2 * area / length, 1.5f * g->cell);
    for (uint32_t i = 0; i < rows; i++) {
        float t = ((float)i + 0.5f) / (float)rows, width = 1 - t;
        uint32_t count = cuts(width * length, 1.5f * g->cell);
        piece p = {.area = area * 2 * width / ((float)rows * (float)count)};
        p.normal = qw_scale(face_normal[f], p.area);
        for (uint32_t k = 0; k < count; k++) {
            p.at = qw_madd(qw_madd(a, t, up), width * ((float)k + 0.5f) / (float)count, along);
            add_piece(env, g, &p);
        }
    }
}

static void sort_into_bins(qw_env *env, gathering *g)
{
    uint32_t n = g->cells.count;
    for (uint32_t i = 0; i < n; i++) {
        cluster *c = &g->clusters[i];
        qw_vec3 p = c->sum.at = qw_scale(c->sum.at, 1 / c->count);
        c->bin = index_of(env, &g->bins,
                          key_of(coordinate(p.x, g->bin_size), coordinate(p.y, g->bin_size),
                                 coordinate(p.z, g->bin_size), 0));
    }
    g->first = QW_NEW_ZERO(env, uint32_t, (size_t)g->bins.count + 2);
    g->member = QW_NEW(env, uint32_t, n);
    for (uint32_t i = 0; i < n; i++) g->first[g->clusters[i].bin + 2]++;
    for (uint32_t b = 0; b < g->bins.count; b++) g->first[b + 2] += g->first[b + 1];
    for (uint32_t i = 0; i < n; i++) g->member[g->first[g->clusters[i].bin + 1]++] = i;
}

/* ---- points */

typedef struct looking {
    const gathering *g;
    const qw_vec3 *point, *normal;
    const float *scale;
    qw_vec3 *direction;
} looking;

typedef struct view {
    qw_vec3 at, normal;
    float reach;
    piece sum;
} view;

static void see_cluster(view *w, const piece *c)
{
    float d2 = qw_length2(qw_sub(c->at, w->at)), share = 1 - d2 / (w->reach * w->reach);
    if (share > 0 && getenv("QW_HARD")) share = 1;
    if (share <= 0 || qw_dot(c->normal, w->normal) <= 0) return;
    w->sum.normal = qw_madd(w->sum.normal, share, c->normal);
    for (int k = 0; k < 6; k++) w->sum.tensor[k] += share * c->tensor[k];
    w->sum.area += share * c->area;
}

static void see_bins(const gathering *g, view *w)
{
    uint64_t x = coordinate(w->at.x, g->bin_size), y = coordinate(w->at.y, g->bin_size),
             z = coordinate(w->at.z, g->bin_size);
    for (int k = 0; k < 27; k++) {
        uint64_t key = key_of(x - 1 + (uint64_t)(k / 9), y - 1 + (uint64_t)(k / 3 % 3), z - 1 + (uint64_t)(k % 3), 0);
        size_t slot = slot_of(&g->bins, key);
        if (g->bins.key[slot] != key) continue;
        uint32_t bin = g->bins.value[slot];
        for (uint32_t i = g->first[bin]; i < g->first[bin + 1]; i++) see_cluster(w, &g->clusters[g->member[i]].sum);
    }
}

static float in_direction(const float t[6], qw_vec3 a, qw_vec3 b)
{
    return t[0] * a.x * b.x + t[3] * a.y * b.y + t[5] * a.z * b.z + t[1] * (a.x * b.y + a.y * b.x) +
           t[2] * (a.x * b.z + a.z * b.x) + t[4] * (a.y * b.z + a.z * b.y);
}

static qw_vec3 direction_of(const view *w, float scale)
{
    const qw_vec3 none = {0, 0, 0};
    if (!(w->sum.area > 0)) return none;
    qw_vec3 n = qw_normalize(w->sum.normal), x = qw_any_orthogonal(n), y = qw_cross(n, x);
    float xx = in_direction(w->sum.tensor, x, x) / w->sum.area, xy = in_direction(w->sum.tensor, x, y) / w->sum.area,
          yy = in_direction(w->sum.tensor, y, y) / w->sum.area;
    float mean = (xx + yy) / 2, re = (xx - yy) / 2, half = sqrtf(re * re + xy * xy);
    if (!(half > 0)) return none;
    float plain = 2 * half / (fabsf(mean + half) + fabsf(mean - half));
    float weight = 2 * half * scale * fminf(fmaxf((plain - ROUND) / (PLAIN - ROUND), 0), 1);
    float c = sqrtf(fmaxf(0, (1 + re / half) / 2)), s = sqrtf(fmaxf(0, (1 - re / half) / 2));
    qw_vec3 d = qw_madd(qw_scale(x, c), xy < 0 ? -s : s, y);
    d = qw_normalize(qw_reject(d, w->normal));
    return qw_scale(d, weight);
}

static void look_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const looking *l = user;
    for (uint32_t v = begin; v < end; v++) {
        view w = {.at = l->point[v], .normal = l->normal[v], .reach = fminf(REACH * l->scale[v], l->g->bin_size)};
        see_bins(l->g, &w);
        l->direction[v] = direction_of(&w, l->scale[v]);
    }
}

qw_vec3 *qw_curvature_directions(qw_env *env, const qw_trimesh *surface, const qw_vec3 *point, const qw_vec3 *normal,
                                 const float *scale, uint32_t count)
{
    qw_vec3 *direction = QW_NEW_ZERO(env, qw_vec3, count);
    if (count == 0) return direction;
    qw_scope_begin(env);
    if (getenv("QW_REACH")) REACH = (float)atof(getenv("QW_REACH"));
    if (getenv("QW_CL")) CLUSTERS = (float)atof(getenv("QW_CL"));
    float most = 0, sum = 0;
    for (uint32_t v = 0; v < count; v++) most = fmaxf(most, scale[v]), sum += scale[v];
    gathering g = {.surface = surface, .cell = sum / (float)count / CLUSTERS, .bin_size = REACH * most};
    begin_table(env, &g.cells, 1024), begin_table(env, &g.bins, 1024);
    const qw_vec3 *face_normal = qw_face_normals(env, surface);
    for (uint32_t f = 0; f < surface->face_count; f++) {
        add_face(env, &g, face_normal, f);
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) add_edge(env, &g, face_normal, h);
        if (f % 4096 == 0) qw_break_silence(env);
    }
    sort_into_bins(env, &g);
    looking l = {&g, point, normal, scale, direction};
    qw_parallel(env, count, GRAIN, look_block, &l);
    qw_scope_end(env);
    return direction;
}
