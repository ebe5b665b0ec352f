#include "remesh/working/cluster.h"

#include "base/sets.h"
#include "base/elementary.h"
#include "geometry/edges.h"

#include <assert.h>
#include <string.h>

/* A surface is clustered only where that leaves so many times fewer triangles. FACES_A_CELL: triangles that an area of
   one cell squared becomes: surfaces of all directions cross one and a half cells there, of two triangles each. */
static const double WORTHWHILE = 2, FACES_A_CELL = 3;
static const float FLAT = 0.1f;         /* of the cell: most that a vertex of a cluster is off its plane */
static const float LEAST_COSINE = 0.2f; /* between a new triangle and the clusters at its corners */

enum {
    SPLITS = 4,  /* how often a cluster is tried in smaller cells */
    LEVELS = 24, /* of cells, each half as large as the one before */
    RIM = 255,   /* level of vertices on boundaries, and of others that join none */
    ALONE = 254,
    MOST_ROUNDS = 32, /* each has a cluster with smaller cells than before: some ten are needed */
};

typedef struct cluster {
    qw_vec3 normal;         /* unit, of the triangles that touch it; not where it is one vertex */
    qw_vec3 place;          /* of the vertex that stands for it */
    uint32_t count, vertex; /* vertices; the one that stands for it, nearest to the mean of them */
    uint32_t triangles;     /* with corners in two other clusters */
    bool bad;
} cluster;

typedef struct clustering {
    qw_env *env;
    const qw_trimesh *input;
    const float *cell;
    float largest;                    /* cell, of level 0 */
    uint8_t *level;                   /* uint8_t[vertices]: of its cell */
    uint8_t *open;                    /* uint8_t[vertices]: to be put into a new cluster in this round */
    uint32_t *key;                    /* uint32_t[vertices]: of the cell in which an open one lies */
    uint32_t *parent;                 /* uint32_t[vertices]: sets of open ones */
    uint32_t *of;                     /* uint32_t[vertices]: cluster */
    uint32_t *out;                    /* uint32_t[vertices]: a half-edge out of each */
    uint32_t *opened, opened_count;   /* uint32_t[opened_count]: open vertices; NULL: all */
    uint32_t *touched, touched_count; /* uint32_t[touched_count]: triangles with an open corner; NULL: all */
    cluster *cluster;                 /* cluster[count]; those that were split have no vertices any more */
    size_t capacity;
    uint32_t count, first;    /* first: of those of this round */
    uint32_t *begin, *member; /* vertices of those of this round: uint32_t[count - first + 1], uint32_t[opened_count] */
    uint32_t *corner;         /* uint32_t[3 triangles]: clusters at the corners of the triangles that have three */
    uint32_t *face;           /* uint32_t[triangles]: which of the input they are */
    uint32_t triangles;
    uint64_t *three; /* bits of those, by face */
} clustering;

/* ---- cells */

static uint8_t first_level(const clustering *c, uint32_t v)
{
    uint8_t level = 0;
    for (float size = c->largest; size > c->cell[v] && level < LEVELS; size *= 0.5f) level++;
    return level;
}

/* A hash of the cell. Two cells may share one: vertices of both are then in one cluster only if that is a good one. */
static uint32_t key_of(const clustering *c, uint32_t v)
{
    assert(v < c->input->vertex_count);
    double cells = (double)(UINT32_C(1) << c->level[v]) / (double)c->largest;
    qw_vec3 p = c->input->position[v];
    uint64_t x = (uint64_t)(int64_t)qw_floor((double)p.x * cells), y = (uint64_t)(int64_t)qw_floor((double)p.y * cells),
             z = (uint64_t)(int64_t)qw_floor((double)p.z * cells);
    uint64_t hash = ((x * 0x9e3779b97f4a7c15u + y) * 0x9e3779b97f4a7c15u + z) * 0x9e3779b97f4a7c15u + c->level[v];
    return (uint32_t)(hash * 0xbf58476d1ce4e5b9u >> 32);
}

static uint32_t opened_at(const clustering *c, uint32_t i) { return c->opened ? c->opened[i] : i; }
static uint32_t touched_at(const clustering *c, uint32_t i) { return c->touched ? c->touched[i] : i; }

static void find_cells(void *user, uint32_t begin, uint32_t end)
{
    clustering *c = user;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t v = opened_at(c, i);
        c->parent[v] = v;
        if (c->level[v] < ALONE) c->key[v] = key_of(c, v);
    }
}

static void find_levels(void *user, uint32_t begin, uint32_t end)
{
    clustering *c = user;
    for (uint32_t v = begin; v < end; v++) c->level[v] = first_level(c, v), c->open[v] = 1;
}

/* All vertices are open. Those of boundaries and sharp edges, and points, stay as they are. */
static void open_all(clustering *c)
{
    const qw_trimesh *m = c->input;
    qw_parallel(c->env, m->vertex_count, QW_GRAIN_LIGHT, find_levels, c);
    for (uint32_t v = 0; m->point && v < m->vertex_count; v++)
        if (m->point[v]) c->level[v] = ALONE;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h];
        c->out[a] = h;
        if (m->twin[h] == QW_NONE) c->level[a] = c->level[m->corner[qw_next(h)]] = RIM;
        else if (m->mark && m->mark[h] && c->level[a] < ALONE) c->level[a] = ALONE;
    }
    c->opened_count = m->vertex_count, c->touched_count = m->face_count;
}

/* ---- clusters */

/* Joins two open ends of an edge that lie in one cell. */
static void join(clustering *c, uint32_t a, uint32_t b)
{
    if (c->key[a] != c->key[b] || c->parent[a] == c->parent[b] || !c->open[a] || !c->open[b]) return;
    if (c->level[a] < ALONE && c->level[b] < ALONE) qw_join_sets(c->parent, a, b);
}

/* Joins what lies in one cell and hangs together there, and gives each set the number of a new cluster. */
static void group(clustering *c)
{
    qw_parallel(c->env, c->opened_count, QW_GRAIN_LIGHT, find_cells, c);
    for (uint32_t i = 0; i < c->touched_count; i++) {
        const uint32_t *corner = c->input->corner + 3 * (size_t)touched_at(c, i);
        if (i % QW_GRAIN_LIGHT == 0) qw_heartbeat(c->env);
        join(c, corner[0], corner[1]), join(c, corner[1], corner[2]), join(c, corner[2], corner[0]);
    }
    c->first = c->count;
    for (uint32_t i = 0; i < c->opened_count; i++) {
        uint32_t v = opened_at(c, i), root = qw_set_of(c->parent, v); /* which has a lower number */
        if (root == v) {
            c->cluster = qw_grow(c->env, c->cluster, &c->capacity, (size_t)c->count + 1, sizeof *c->cluster);
            c->cluster[c->count] = (cluster){.vertex = v, .place = c->input->position[v]};
            c->of[v] = c->count++;
        } else {
            c->of[v] = c->of[root];
        }
        c->cluster[c->of[v]].count++;
    }
}

/* Lists the vertices of each new cluster. */
static void list_members(clustering *c)
{
    uint32_t n = c->count - c->first;
    qw_free(c->env, c->begin), qw_free(c->env, c->member);
    c->begin = QW_NEW(c->env, uint32_t, (size_t)n + 2), c->member = QW_NEW(c->env, uint32_t, c->opened_count);
    c->begin[0] = c->begin[1] = 0;
    for (uint32_t k = 0; k < n; k++) c->begin[k + 2] = c->begin[k + 1] + c->cluster[c->first + k].count;
    for (uint32_t i = 0; i < c->opened_count; i++) {
        uint32_t v = opened_at(c, i);
        c->member[c->begin[c->of[v] - c->first + 1]++] = v;
    }
}

/* Sums over the triangles around an inner vertex. */
typedef struct fan_sums {
    qw_vec3 normal;
    uint32_t edges, triangles; /* of which all ends, all corners are in its cluster */
} fan_sums;

/* Adds the triangles around v: those inside its cluster, and their normals. */
static void add_fan(const clustering *c, uint32_t v, fan_sums *sums)
{
    assert(v < c->input->vertex_count);
    const qw_trimesh *m = c->input;
    uint32_t h = c->out[v], own = c->of[v];
    do {
        bool in = c->of[m->corner[qw_next(h)]] == own, also = c->of[m->corner[qw_prev(h)]] == own;
        sums->normal = qw_add(sums->normal, qw_face_cross(m, h / 3));
        sums->edges += in, sums->triangles += in && also;
        h = qw_around(m, h);
    } while (h != c->out[v] && h != QW_NONE);
}

/* Chooses the vertex that stands for a cluster; bad: it is no disc or not flat. */
static void measure(const clustering *c, cluster *k, const uint32_t *member)
{
    const qw_vec3 *position = c->input->position;
    qw_vec3 middle = {0, 0, 0};
    fan_sums sums = {{0, 0, 0}, 0, 0};
    for (uint32_t i = 0; i < k->count; i++) {
        middle = qw_add(middle, position[member[i]]);
        add_fan(c, member[i], &sums);
    }
    middle = qw_scale(middle, 1 / (float)k->count);
    float nearest2 = INFINITY;
    for (uint32_t i = 0; i < k->count; i++) {
        float distance2 = qw_length2(qw_sub(position[member[i]], middle));
        if (distance2 < nearest2) nearest2 = distance2, k->vertex = member[i];
    }
    k->place = position[k->vertex], k->normal = qw_normalize(sums.normal);
    k->bad = 6 * k->count + 2 * sums.triangles != 6 + 3 * sums.edges; /* its Euler characteristic is not 1 */
    for (uint32_t i = 0; i < k->count; i++)
        k->bad |= fabsf(qw_dot(k->normal, qw_sub(position[member[i]], k->place))) > FLAT * c->cell[member[i]];
}

static void measure_block(void *user, uint32_t begin, uint32_t end)
{
    const clustering *c = user;
    for (uint32_t k = begin; k < end; k++)
        if (c->cluster[c->first + k].count > 1) measure(c, &c->cluster[c->first + k], c->member + c->begin[k]);
}

/* ---- the surface of clusters */

static bool has_three(const clustering *c, uint32_t f)
{
    const uint32_t *v = c->input->corner + 3 * (size_t)f;
    uint32_t a = c->of[v[0]], b = c->of[v[1]], d = c->of[v[2]];
    return a != b && b != d && d != a;
}

static void find_three(void *user, uint32_t begin, uint32_t end)
{
    const clustering *c = user;
    for (uint32_t first = begin; first < end; first += 64) {
        uint64_t bits = 0;
        for (uint32_t f = first; f < end && f < first + 64; f++) bits |= (uint64_t)has_three(c, f) << (f - first);
        c->three[first / 64] = bits;
    }
}

/* Lists the bits that are set: uint32_t[*count]. */
static uint32_t *list_bits(qw_env *env, const uint64_t *bits, uint32_t size, uint32_t *count)
{
    uint32_t n = 0, words = size / 64 + 1;
    for (uint32_t w = 0; w < words; w++) n += (uint32_t)__builtin_popcountll(bits[w]);
    uint32_t *list = QW_NEW(env, uint32_t, n);
    *count = n, n = 0;
    for (uint32_t w = 0; w < words; w++)
        for (uint64_t rest = bits[w]; rest; rest &= rest - 1) list[n++] = 64 * w + (uint32_t)__builtin_ctzll(rest);
    return list;
}

static void set_bit(uint64_t *bits, uint32_t i, bool value)
{
    bits[i / 64] = (bits[i / 64] & ~(UINT64_C(1) << i % 64)) | (uint64_t)value << i % 64;
}

static void find_corners(void *user, uint32_t begin, uint32_t end)
{
    const clustering *c = user;
    for (size_t t = begin; t < end; t++)
        for (size_t i = 0; i < 3; i++) c->corner[3 * t + i] = c->of[c->input->corner[3 * (size_t)c->face[t] + i]];
}

/* Gathers the triangles whose corners are in three clusters: of all, or of those that may be others than before. */
static void find_triangles(clustering *c)
{
    if (!c->touched) qw_parallel(c->env, c->input->face_count, QW_GRAIN_LIGHT, find_three, c);
    for (uint32_t i = 0; c->touched && i < c->touched_count; i++)
        set_bit(c->three, c->touched[i], has_three(c, c->touched[i]));
    qw_free(c->env, c->face), qw_free(c->env, c->corner);
    c->face = list_bits(c->env, c->three, c->input->face_count, &c->triangles);
    c->corner = QW_NEW(c->env, uint32_t, 3 * (size_t)c->triangles);
    qw_parallel(c->env, c->triangles, QW_GRAIN_LIGHT, find_corners, c);
}

/* Whether a triangle faces against a cluster at one of its corners. Triangles of the input may. */
static bool is_turned(const clustering *c, const uint32_t *corner)
{
    const cluster *k[3] = {&c->cluster[corner[0]], &c->cluster[corner[1]], &c->cluster[corner[2]]};
    qw_vec3 cross = qw_cross(qw_sub(k[1]->place, k[0]->place), qw_sub(k[2]->place, k[0]->place));
    float least = LEAST_COSINE * qw_length(cross);
    for (int i = 0; i < 3; i++)
        if (k[i]->count > 1 && !(qw_dot(cross, k[i]->normal) > least)) return true;
    return false;
}

/* Marks the clusters that are bad: a triangle at them is turned over, or too few are. */
static void judge_triangles(clustering *c)
{
    for (uint32_t k = 0; k < c->count; k++) c->cluster[k].triangles = 0;
    for (uint32_t t = 0; t < c->triangles; t++) {
        const uint32_t *corner = c->corner + 3 * (size_t)t;
        bool turned = is_turned(c, corner);
        for (int i = 0; i < 3; i++) c->cluster[corner[i]].triangles++, c->cluster[corner[i]].bad |= turned;
    }
    for (uint32_t t = 0; t < c->triangles; t++) {
        const uint32_t *corner = c->corner + 3 * (size_t)t;
        for (int i = 0; i < 3; i++) {
            cluster *k = &c->cluster[corner[i]];
            if (k->triangles < 3 && c->level[k->vertex] != RIM) k->bad = true;
        }
    }
}

/* Bad are the ends of an edge that has not two sides, or one on the boundary. */
static void judge_edges(clustering *c)
{
    qw_edges edges = qw_edges_build(c->env, 3, c->corner, c->triangles, c->count);
    for (uint32_t k = 0; k < c->count; k++)
        for (uint32_t i = edges.begin[k], end; i < edges.begin[k + 1]; i = end) {
            end = qw_edge_end(&edges, i, edges.begin[k + 1]);
            uint32_t h = qw_side_half(edges.side[i]);
            bool fits = end - i == 2 || (end - i == 1 && c->input->twin[3 * c->face[h / 3] + h % 3] == QW_NONE);
            if (!fits) c->cluster[k].bad = c->cluster[qw_side_upper(edges.side[i])].bad = true;
        }
    qw_edges_free(c->env, &edges);
}

/* A bad cluster of one vertex cannot be split further: the clusters beside it are to be split instead. */
static void blame_neighbours(clustering *c)
{
    for (uint32_t t = 0; t < c->triangles; t++) {
        cluster *k[3];
        bool blamed = false;
        for (int i = 0; i < 3; i++) {
            k[i] = &c->cluster[c->corner[3 * (size_t)t + (size_t)i]];
            blamed |= k[i]->bad && k[i]->count == 1;
        }
        for (int i = 0; blamed && i < 3; i++) k[i]->bad |= k[i]->count > 1;
    }
}

/* Lists the triangles around the open vertices, which are all inner ones. */
static void touch(clustering *c)
{
    const qw_trimesh *m = c->input;
    uint64_t *bits = QW_NEW_ZERO(c->env, uint64_t, m->face_count / 64 + 1);
    for (uint32_t i = 0; i < c->opened_count; i++) {
        uint32_t h = c->out[c->opened[i]];
        do {
            set_bit(bits, h / 3, true);
            h = qw_around(m, h);
        } while (h != c->out[c->opened[i]] && h != QW_NONE);
    }
    qw_free(c->env, c->touched);
    c->touched = list_bits(c->env, bits, m->face_count, &c->touched_count);
    qw_free(c->env, bits);
}

static void reopen_block(void *user, uint32_t begin, uint32_t end)
{
    clustering *c = user;
    for (uint32_t v = begin; v < end; v++) {
        const cluster *k = &c->cluster[c->of[v]];
        c->open[v] = k->bad && k->count > 1;
        if (c->open[v] && ++c->level[v] > first_level(c, v) + SPLITS) c->level[v] = ALONE;
    }
}

/* Opens the bad clusters, to be made again in smaller cells; false: there are none. */
static bool reopen(clustering *c)
{
    uint32_t *opened = QW_NEW(c->env, uint32_t, c->input->vertex_count), n = 0;
    qw_parallel(c->env, c->input->vertex_count, QW_GRAIN_LIGHT, reopen_block, c);
    for (uint32_t v = 0; v < c->input->vertex_count; v++) {
        opened[n] = v;
        n += c->open[v];
    }
    for (uint32_t k = 0; k < c->count; k++) c->cluster[k].bad = false;
    qw_free(c->env, c->opened);
    c->opened = qw_resize(c->env, opened, n, sizeof *opened), c->opened_count = n;
    if (n > 0) touch(c);
    return n > 0;
}

/* Whether clusters were found that make a surface. */
static bool find_clusters(clustering *c)
{
    open_all(c);
    for (int round = 0; round < MOST_ROUNDS; round++) {
        group(c);
        list_members(c);
        qw_parallel(c->env, c->count - c->first, QW_GRAIN_HEAVY, measure_block, c);
        find_triangles(c);
        judge_triangles(c);
        judge_edges(c);
        blame_neighbours(c);
        if (!reopen(c)) return true;
    }
    return false;
}

/* ---- result */

/* Faces of the first component come first, those of one stay in their order: where each goes, in c->face, and in
   c->corner what goes there. */
static void sort_components(clustering *c, const uint32_t *component, uint32_t components)
{
    qw_env *env = c->env;
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)components + 1), n = c->triangles,
             *corner = QW_NEW(env, uint32_t, 3 * (size_t)n), *face = QW_NEW(env, uint32_t, n);
    for (uint32_t t = 0; t < n; t++) begin[component[c->face[t]] + 1]++;
    for (uint32_t k = 0; k < components; k++) begin[k + 1] += begin[k];
    for (uint32_t t = 0; t < n; t++) {
        uint32_t to = begin[component[c->face[t]]]++;
        face[to] = c->face[t];
        memcpy(corner + 3 * (size_t)to, c->corner + 3 * (size_t)t, 3 * sizeof *corner);
    }
    qw_free(env, begin), qw_free(env, c->corner), qw_free(env, c->face);
    c->corner = corner, c->face = face;
}

/* Numbers the clusters in the order of their first vertices: uint32_t[count] by cluster. *origin: of qw_clustered. */
static uint32_t *number_clusters(clustering *c, uint32_t **origin, uint32_t *vertices)
{
    uint32_t *number = QW_NEW(c->env, uint32_t, c->count), n = 0;
    memset(number, 0xff, c->count * sizeof *number);
    for (uint32_t v = 0; v < c->input->vertex_count; v++)
        if (number[c->of[v]] == QW_NONE) number[c->of[v]] = n++;
    *origin = QW_NEW(c->env, uint32_t, n);
    for (uint32_t k = 0; k < c->count; k++)
        if (number[k] != QW_NONE) (*origin)[number[k]] = c->cluster[k].vertex;
    *vertices = n;
    return number;
}

/* The surface that the clusters make, sorted by components, with the vertex of the input that each of its own is.
 * */
static qw_clustered surface_of(clustering *c, const uint32_t *component, uint32_t components)
{
    qw_env *env = c->env;
    const qw_trimesh *in = c->input;
    if (components > 1) sort_components(c, component, components);
    qw_clustered r = {.mesh = {.face_count = c->triangles}};
    qw_trimesh *m = &r.mesh;
    uint32_t *number = number_clusters(c, &r.origin, &m->vertex_count);
    m->position = QW_NEW(env, qw_vec3, m->vertex_count);
    m->point = in->point ? QW_NEW(env, uint8_t, m->vertex_count) : NULL;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        m->position[v] = in->position[r.origin[v]];
        if (m->point) m->point[v] = in->point[r.origin[v]];
    }
    m->corner = QW_NEW(env, uint32_t, 3 * (size_t)m->face_count);
    m->mark = in->mark ? QW_NEW(env, uint8_t, 3 * (size_t)m->face_count) : NULL;
    r.component = QW_NEW(env, uint32_t, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) {
        r.component[f] = component[c->face[f]];
        for (size_t i = 0; i < 3; i++) {
            m->corner[3 * (size_t)f + i] = number[c->corner[3 * (size_t)f + i]];
            if (m->mark) m->mark[3 * (size_t)f + i] = in->mark[3 * (size_t)c->face[f] + i]; /* its ends are alone */
        }
    }
    qw_trimesh_link(env, m);
    return r;
}

typedef struct foresight {
    const qw_trimesh *input;
    const float *cell;
    double *faces;  /* double[blocks] */
    float *largest; /* float[blocks] */
} foresight;

/* How many faces clusters of these cells would leave, and the largest cell, over a block. */
static void foresee_block(void *user, uint32_t begin, uint32_t end)
{
    const foresight *s = user;
    double sum = 0;
    float largest = 0;
    for (uint32_t f = begin; f < end; f++) {
        const uint32_t *v = s->input->corner + 3 * (size_t)f;
        float size = (s->cell[v[0]] + s->cell[v[1]] + s->cell[v[2]]) / 3;
        sum += FACES_A_CELL / 2 * (double)(qw_length(qw_face_cross(s->input, f)) / (size * size));
        largest = fmaxf(largest, fmaxf(fmaxf(s->cell[v[0]], s->cell[v[1]]), s->cell[v[2]]));
    }
    s->faces[begin / QW_GRAIN_LIGHT] = sum, s->largest[begin / QW_GRAIN_LIGHT] = largest;
}

/* How many triangles there will be. */
static double foresee(clustering *c)
{
    uint32_t blocks = qw_block_count(c->input->face_count, QW_GRAIN_LIGHT);
    foresight s = {c->input, c->cell, QW_NEW(c->env, double, blocks), QW_NEW(c->env, float, blocks)};
    qw_parallel(c->env, c->input->face_count, QW_GRAIN_LIGHT, foresee_block, &s);
    double sum = 0;
    for (uint32_t b = 0; b < blocks; b++) sum += s.faces[b], c->largest = fmaxf(c->largest, s.largest[b]);
    qw_free(c->env, s.faces), qw_free(c->env, s.largest);
    return sum;
}

bool qw_cluster(qw_env *env, const qw_trimesh *input, const uint32_t *component, uint32_t components, const float *cell,
                qw_clustered *result)
{
    assert(input->twin && component && cell);
    clustering c = {.env = env, .input = input, .cell = cell};
    uint32_t n = input->vertex_count;
    if (foresee(&c) * WORTHWHILE > input->face_count) return false;
    qw_scope_begin(env);
    c.level = QW_NEW(env, uint8_t, n), c.open = QW_NEW(env, uint8_t, n), c.key = QW_NEW(env, uint32_t, n);
    c.parent = QW_NEW(env, uint32_t, n), c.of = QW_NEW(env, uint32_t, n), c.out = QW_NEW(env, uint32_t, n);
    c.three = QW_NEW_ZERO(env, uint64_t, input->face_count / 64 + 1);
    bool found = find_clusters(&c) && c.triangles * WORTHWHILE < input->face_count;
    if (found) {
        *result = surface_of(&c, component, components);
        const qw_trimesh *m = &result->mesh;
        qw_keep(env, m->position), qw_keep(env, m->corner), qw_keep(env, m->twin), qw_keep(env, m->mark);
        qw_keep(env, m->point), qw_keep(env, result->component), qw_keep(env, result->origin);
    }
    qw_scope_end(env);
    return found;
}
