#include "hierarchy/hierarchy.h"

#include <assert.h>
#include <string.h>

enum { COARSEST = 24, SWEEP_GRAIN = 256 };

typedef struct pairing {
    uint32_t *partner; /* the other vertex of the pair, or the vertex itself */
    uint32_t count;    /* vertices of the coarser level */
} pairing;

/* Vertex graph of the mesh with weight 1 an edge: on a near-isotropic mesh the cotangent weights are near to equal. */
static void finest_graph(qw_env *env, const qw_trimesh *mesh, qw_level *level)
{
    uint32_t n = mesh->vertex_count;
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        begin[mesh->corner[h] + 1]++;
        if (mesh->twin[h] == QW_NONE) begin[mesh->corner[qw_next(h)] + 1]++;
    }
    for (uint32_t v = 0; v < n; v++) begin[v + 1] += begin[v];
    level->begin = begin;
    level->neighbour = QW_NEW(env, uint32_t, begin[n]);
    level->weight = QW_NEW(env, float, begin[n]);
    uint32_t *fill = QW_NEW(env, uint32_t, n);
    memcpy(fill, begin, n * sizeof *fill);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        level->neighbour[fill[u]++] = v;
        if (mesh->twin[h] == QW_NONE) level->neighbour[fill[v]++] = u;
    }
    for (uint32_t i = 0; i < begin[n]; i++) level->weight[i] = 1.0f;
    qw_free(env, fill);
}

static void vertex_areas(const qw_trimesh *mesh, float *area)
{
    memset(area, 0, mesh->vertex_count * sizeof *area);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        float a = qw_length(qw_face_cross(mesh, f)) / 6.0f;
        for (uint32_t i = 0; i < 3; i++) area[mesh->corner[3 * f + i]] += a;
    }
}

/* Greedy colouring in index order: at most one more colour than the largest degree. */
static void color_level(qw_env *env, qw_level *level)
{
    uint32_t n = level->vertex_count, colors = 0;
    uint32_t *color = QW_NEW(env, uint32_t, n), *seen = NULL, *count;
    size_t capacity = 0;
    for (uint32_t v = 0; v < n; v++) {
        uint32_t degree = level->begin[v + 1] - level->begin[v];
        size_t old = capacity;
        seen = qw_grow(env, seen, &capacity, degree + 1, sizeof *seen);
        for (size_t i = old; i < capacity; i++) seen[i] = QW_NONE;
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
            uint32_t u = level->neighbour[i];
            if (u < v && color[u] <= degree) seen[color[u]] = v;
        }
        uint32_t c = 0;
        while (seen[c] == v) c++;
        color[v] = c;
        if (c + 1 > colors) colors = c + 1;
    }
    count = QW_NEW_ZERO(env, uint32_t, (size_t)colors + 2);
    for (uint32_t v = 0; v < n; v++) count[color[v] + 1]++;
    for (uint32_t c = 0; c < colors; c++) count[c + 1] += count[c];
    level->color_count = colors;
    level->color_begin = QW_NEW(env, uint32_t, (size_t)colors + 1);
    memcpy(level->color_begin, count, ((size_t)colors + 1) * sizeof *count);
    level->by_color = QW_NEW(env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) level->by_color[count[color[v]]++] = v;
    qw_free(env, color), qw_free(env, seen), qw_free(env, count);
}

/* The best partner of v among those not yet paired: similar normals and, so that sizes stay even, a small common area. Curve vertices
   prefer their curve and corners stay alone for as long as others can be paired, so that constraints survive on coarse levels. */
static uint32_t best_partner(const qw_level *level, const uint32_t *partner, uint32_t v)
{
    uint32_t best = QW_NONE;
    float best_score = -1e30f;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        if (partner[u] != QW_NONE) continue;
        float likeness = qw_dot(level->normal[v], level->normal[u]);
        float score = (likeness + 1.0f) / (level->area[v] + level->area[u] + 1e-30f) * level->weight[i];
        if (level->hold[u] != level->hold[v]) score *= 0.25f;
        if (score > best_score) best_score = score, best = u;
    }
    return best;
}

static pairing pair_vertices(qw_env *env, const qw_level *level)
{
    uint32_t n = level->vertex_count;
    pairing p = {QW_NEW(env, uint32_t, n), 0};
    memset(p.partner, 0xff, n * sizeof *p.partner);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t v = level->by_color[i];
        if (p.partner[v] != QW_NONE) continue;
        uint32_t u = best_partner(level, p.partner, v);
        p.count++;
        if (u == QW_NONE)
            p.partner[v] = v;
        else
            p.partner[v] = u, p.partner[u] = v;
    }
    return p;
}

static void merge_holds(const qw_level *fine, uint32_t a, uint32_t b, qw_level *coarse, uint32_t to)
{
    uint32_t stronger = fine->hold[b] > fine->hold[a] ? b : a, weaker = a + b - stronger;
    coarse->hold[to] = fine->hold[stronger];
    bool directed = qw_length2(fine->direction[stronger]) > 0; /* a corner has none: its partner's still steers the field */
    coarse->direction[to] = fine->direction[directed ? stronger : weaker];
    qw_vec3 on = fine->position[stronger]; /* what is held stays where it is held: the mean may lie beside the curve */
    float along = qw_dot(qw_sub(coarse->position[to], on), fine->direction[stronger]);
    if (coarse->hold[to] == QW_HOLD_CURVE) coarse->position[to] = qw_madd(on, along, fine->direction[stronger]);
    if (coarse->hold[to] == QW_HOLD_CORNER) coarse->position[to] = on;
}

static void coarse_vertices(qw_level *fine, const pairing *pairs, qw_level *coarse)
{
    uint32_t next = 0;
    for (uint32_t v = 0; v < fine->vertex_count; v++) {
        uint32_t u = pairs->partner[v];
        if (u < v) continue;
        fine->parent[v] = fine->parent[u] = next;
        float av = fine->area[v] + 1e-30f, au = u == v ? 0.0f : fine->area[u] + 1e-30f, sum = av + au;
        coarse->area[next] = sum;
        coarse->position[next] = qw_madd(qw_scale(fine->position[v], av / sum), au / sum, fine->position[u]);
        qw_vec3 n = qw_madd(qw_scale(fine->normal[v], av), au, fine->normal[u]);
        coarse->normal[next] = qw_length2(n) > 1e-12f * sum * sum ? qw_normalize(n) : fine->normal[v];
        merge_holds(fine, v, u, coarse, next);
        next++;
    }
    assert(next == coarse->vertex_count);
}

/* Neighbours of a coarse vertex: the union of its children's, weights added. */
static void coarse_graph(qw_env *env, const qw_level *fine, const pairing *pairs, qw_level *coarse)
{
    uint32_t n = coarse->vertex_count, used = 0;
    uint32_t total = fine->begin[fine->vertex_count];
    uint32_t *neighbour = QW_NEW(env, uint32_t, total), *place = QW_NEW(env, uint32_t, n);
    float *weight = QW_NEW(env, float, total);
    coarse->begin = QW_NEW(env, uint32_t, (size_t)n + 1);
    memset(place, 0xff, n * sizeof *place);
    uint32_t at = 0;
    for (uint32_t v = 0; v < fine->vertex_count; v++) {
        if (pairs->partner[v] < v) continue;
        uint32_t first = used, children[2] = {v, pairs->partner[v]}, child_count = children[1] == v ? 1 : 2;
        coarse->begin[at] = first;
        for (uint32_t k = 0; k < child_count; k++)
            for (uint32_t i = fine->begin[children[k]]; i < fine->begin[children[k] + 1]; i++) {
                uint32_t to = fine->parent[fine->neighbour[i]];
                if (to == at) continue;
                if (place[to] == QW_NONE || place[to] < first || place[to] >= used || neighbour[place[to]] != to) {
                    place[to] = used;
                    neighbour[used] = to;
                    weight[used++] = fine->weight[i];
                } else
                    weight[place[to]] += fine->weight[i];
            }
        at++;
    }
    coarse->begin[n] = used;
    coarse->neighbour = qw_resize(env, neighbour, used, sizeof *neighbour);
    coarse->weight = qw_resize(env, weight, used, sizeof *weight);
    qw_free(env, place);
}

static void new_level_arrays(qw_env *env, qw_level *level, uint32_t n)
{
    *level = (qw_level){.vertex_count = n};
    level->position = QW_NEW(env, qw_vec3, n);
    level->normal = QW_NEW(env, qw_vec3, n);
    level->area = QW_NEW(env, float, n);
    level->hold = QW_NEW_ZERO(env, uint8_t, n);
    level->direction = QW_NEW_ZERO(env, qw_vec3, n);
}

static bool coarsen(qw_env *env, qw_level *fine, qw_level *coarse)
{
    pairing pairs = pair_vertices(env, fine);
    bool shrinks = pairs.count < fine->vertex_count - fine->vertex_count / 20;
    if (shrinks) {
        new_level_arrays(env, coarse, pairs.count);
        fine->parent = QW_NEW(env, uint32_t, fine->vertex_count);
        coarse_vertices(fine, &pairs, coarse);
        coarse_graph(env, fine, &pairs, coarse);
        color_level(env, coarse);
    }
    qw_free(env, pairs.partner);
    return shrinks;
}

qw_hierarchy qw_hierarchy_build(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const uint8_t *hold, const qw_vec3 *direction)
{
    qw_hierarchy hierarchy = {.level_count = 1};
    uint32_t n = mesh->vertex_count;
    qw_level *finest = &hierarchy.level[0];
    new_level_arrays(env, finest, n);
    memcpy(finest->position, mesh->position, n * sizeof *mesh->position);
    memcpy(finest->normal, normal, n * sizeof *normal);
    vertex_areas(mesh, finest->area);
    if (hold) memcpy(finest->hold, hold, n);
    if (direction) memcpy(finest->direction, direction, n * sizeof *direction);
    finest_graph(env, mesh, finest);
    color_level(env, finest);
    while (hierarchy.level_count < QW_MAX_LEVELS) {
        qw_level *last = &hierarchy.level[hierarchy.level_count - 1];
        if (last->vertex_count <= COARSEST || !coarsen(env, last, last + 1)) break;
        hierarchy.level_count++;
        qw_progress(env, 0.5);
    }
    return hierarchy;
}

typedef struct sweep {
    const uint32_t *vertices;
    qw_vertex_update update;
    void *user;
} sweep;

static void sweep_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const sweep *s = user;
    for (uint32_t i = begin; i < end; i++) s->update(s->user, s->vertices[i]);
}

void qw_level_sweep(qw_env *env, const qw_level *level, qw_vertex_update update, void *user)
{
    for (uint32_t c = 0; c < level->color_count; c++) {
        uint32_t begin = level->color_begin[c], end = level->color_begin[c + 1];
        sweep s = {level->by_color + begin, update, user};
        qw_parallel(env, end - begin, SWEEP_GRAIN, sweep_block, &s);
    }
}
