#include "remesh/field/hierarchy.h"
#include "base/groups.h"
#include "remesh/sizes/cells.h"

#include <assert.h>
#include <string.h>

enum { COARSEST = 24 };

typedef struct pairing {
    uint32_t *partner; /* the other vertex of the pair, or the vertex itself */
    uint32_t count;    /* vertices of the coarser level */
} pairing;

/* Vertex graph of the mesh with weight 1 an edge: on a near-isotropic mesh the cotangent weights are near to equal. */
static void finest_graph(qw_env *env, const qw_trimesh *mesh, qw_level *level)
{
    assert(mesh->twin && level->vertex_count == mesh->vertex_count);
    qw_cells graph = qw_cells_of_vertices(env, mesh);
    level->begin = graph.begin, level->neighbour = graph.neighbour;
    level->weight = QW_NEW(env, float, graph.begin[mesh->vertex_count]);
    for (uint32_t i = 0; i < graph.begin[mesh->vertex_count]; i++) level->weight[i] = 1.0f;
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
    assert(level->begin && level->neighbour);
    uint32_t n = level->vertex_count, colors = 0;
    uint32_t *color = QW_NEW(env, uint32_t, n), *seen = NULL;
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
    level->color_count = colors;
    level->by_color = qw_group(env, color, n, colors, &level->color_begin);
    qw_free(env, color), qw_free(env, seen);
}

/* Factor of the score of a partner with another feature constraint. */
static const float OTHER_CONSTRAINT = 0.25f;
/* Added to areas, so that sums of them are no 0. */
static const float TINY_AREA = 1e-30f;
/* A mean normal shorter than the root of this share says nothing. */
static const float LEAST_NORMAL2 = 1e-12f;

/* The best partner of v among those not yet paired: similar normals and, so that sizes stay even, a small common area.
   Curve vertices prefer their curve and corners stay alone for as long as others can be paired, so that constraints
   survive on coarse levels. */
static uint32_t best_partner(const qw_level *level, const uint32_t *partner, uint32_t v)
{
    uint32_t best = QW_NONE;
    float best_score = -1e30f;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        if (partner[u] != QW_NONE) continue;
        float likeness = qw_dot(level->normal[v], level->normal[u]);
        float score = (likeness + 1.0f) / (level->area[v] + level->area[u] + TINY_AREA) * level->weight[i];
        if (level->constraint[u] != level->constraint[v]) score *= OTHER_CONSTRAINT;
        if (score > best_score) best_score = score, best = u;
    }
    return best;
}

/* Joins vertices two by two, in the order of colours; some stay alone. */
static pairing pair_vertices(qw_env *env, const qw_level *level)
{
    assert(level->vertex_count > 0);
    uint32_t n = level->vertex_count;
    pairing p = {QW_NEW(env, uint32_t, n), 0};
    memset(p.partner, 0xff, n * sizeof *p.partner);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t v = level->by_color[i];
        if (p.partner[v] != QW_NONE) continue;
        uint32_t u = best_partner(level, p.partner, v);
        p.count++;
        if (u == QW_NONE) p.partner[v] = v;
        else p.partner[v] = u, p.partner[u] = v;
    }
    return p;
}

/* What vertex `to` of the coarse level inherits of fine vertices a and b: the stronger constraint, with its
 * position and direction. */
static void merge_constraints(const qw_level *fine, uint32_t a, uint32_t b, qw_level *coarse, uint32_t to)
{
    assert(a < fine->vertex_count && to < coarse->vertex_count);
    uint32_t stronger = fine->constraint[b] > fine->constraint[a] ? b : a, weaker = a + b - stronger;
    coarse->constraint[to] = fine->constraint[stronger];
    bool directed = qw_length2(fine->direction[stronger]) >
                    0; /* a corner has no direction: its partner's still steers the field */
    coarse->direction[to] = fine->direction[directed ? stronger : weaker];
    qw_vec3 on = fine->position[stronger]; /* the constrained vertex keeps its position: the mean of both may lie beside
                                              the curve */
    float along = qw_dot(qw_sub(coarse->position[to], on), fine->direction[stronger]);
    if (coarse->constraint[to] == QW_VERTEX_CURVE) coarse->position[to] = qw_madd(on, along, fine->direction[stronger]);
    if (coarse->constraint[to] == QW_VERTEX_CORNER) coarse->position[to] = on;
}

typedef struct merging {
    qw_level *fine, *coarse;
    uint32_t (*children)[2]; /* of each coarse vertex, the same twice where it has but one */
    uint32_t *neighbour;     /* room for those of each block from the place that the fine graph has for its children, */
    float *weight;
    uint32_t *room, *used; /* [blocks]: which is this, and how many there are */
} merging;

/* Position, normal, area and constraint of coarse vertex `to`, out of its one or two children. */
static void merge_vertices(const merging *m, uint32_t to)
{
    const qw_level *fine = m->fine;
    qw_level *coarse = m->coarse;
    uint32_t v = m->children[to][0], u = m->children[to][1];
    float av = fine->area[v] + TINY_AREA, au = u == v ? 0.0f : fine->area[u] + TINY_AREA, sum = av + au;
    coarse->area[to] = sum;
    coarse->position[to] = qw_madd(qw_scale(fine->position[v], av / sum), au / sum, fine->position[u]);
    qw_vec3 n = qw_madd(qw_scale(fine->normal[v], av), au, fine->normal[u]);
    coarse->normal[to] = qw_length2(n) > LEAST_NORMAL2 * sum * sum ? qw_normalize(n) : fine->normal[v];
    merge_constraints(fine, v, u, coarse, to);
}

/* The union of the children's, weights added. Returns how many. */
static uint32_t merge_neighbours(const merging *m, uint32_t at, uint32_t *neighbour, float *weight)
{
    const qw_level *fine = m->fine;
    const uint32_t *child = m->children[at];
    uint32_t used = 0, child_count = child[1] == child[0] ? 1 : 2;
    for (uint32_t k = 0; k < child_count; k++)
        for (uint32_t i = fine->begin[child[k]]; i < fine->begin[child[k] + 1]; i++) {
            uint32_t to = fine->parent[fine->neighbour[i]], j = 0;
            if (to == at) continue;
            while (j < used && neighbour[j] != to) j++;
            if (j == used) neighbour[used] = to, weight[used++] = 0;
            weight[j] += fine->weight[i];
        }
    return used;
}

/* Merges the vertices of a block and packs their neighbours one after the other. */
static void merge_block(void *user, uint32_t begin, uint32_t end)
{
    const merging *m = user;
    uint32_t used = 0, room = m->room[begin / QW_GRAIN];
    for (uint32_t to = begin; to < end; to++) {
        merge_vertices(m, to);
        m->coarse->begin[to] = used;
        used += merge_neighbours(m, to, m->neighbour + room + used, m->weight + room + used);
    }
    m->used[begin / QW_GRAIN] = used;
}

/* Numbers the pairs in the order of their first vertices, and says where each block finds room for its neighbours.
 * */
static void number_parents(const pairing *pairs, merging *m)
{
    uint32_t next = 0, room = 0;
    for (uint32_t v = 0; v < m->fine->vertex_count; v++) {
        uint32_t u = pairs->partner[v];
        if (u < v) continue;
        if (next % QW_GRAIN == 0) m->room[next / QW_GRAIN] = room;
        room += m->fine->begin[v + 1] - m->fine->begin[v] + (u == v ? 0 : m->fine->begin[u + 1] - m->fine->begin[u]);
        m->children[next][0] = v, m->children[next][1] = u;
        m->fine->parent[v] = m->fine->parent[u] = next++;
    }
    assert(next == m->coarse->vertex_count);
}

/* The blocks' neighbours, one after another. Returns how many. */
static uint32_t close_ranks(const merging *m, uint32_t blocks)
{
    uint32_t used = 0, n = m->coarse->vertex_count;
    for (uint32_t b = 0; b < blocks; b++) {
        memmove(m->neighbour + used, m->neighbour + m->room[b], m->used[b] * sizeof *m->neighbour);
        memmove(m->weight + used, m->weight + m->room[b], m->used[b] * sizeof *m->weight);
        for (uint32_t to = b * QW_GRAIN; to < n && to < (b + 1) * QW_GRAIN; to++) m->coarse->begin[to] += used;
        used += m->used[b];
    }
    m->coarse->begin[n] = used;
    return used;
}

/* The coarse level that a pairing makes. */
static void merge_pairs(qw_env *env, qw_level *fine, const pairing *pairs, qw_level *coarse)
{
    assert(pairs->count == coarse->vertex_count);
    uint32_t n = coarse->vertex_count, total = fine->begin[fine->vertex_count], blocks = qw_block_count(n, QW_GRAIN);
    coarse->begin = QW_NEW(env, uint32_t, (size_t)n + 1);
    merging m = {fine,
                 coarse,
                 qw_alloc(env, n, sizeof *m.children),
                 QW_NEW(env, uint32_t, total),
                 QW_NEW(env, float, total),
                 QW_NEW(env, uint32_t, blocks),
                 QW_NEW(env, uint32_t, blocks)};
    number_parents(pairs, &m);
    qw_parallel(env, n, QW_GRAIN, merge_block, &m);
    uint32_t used = close_ranks(&m, blocks);
    coarse->neighbour = qw_resize(env, m.neighbour, used, sizeof *m.neighbour);
    coarse->weight = qw_resize(env, m.weight, used, sizeof *m.weight);
    qw_free(env, m.children), qw_free(env, m.room), qw_free(env, m.used);
}

static void new_level_arrays(qw_env *env, qw_level *level, uint32_t n)
{
    *level = (qw_level){.vertex_count = n};
    level->position = QW_NEW(env, qw_vec3, n);
    level->normal = QW_NEW(env, qw_vec3, n);
    level->area = QW_NEW(env, float, n);
    level->constraint = QW_NEW_ZERO(env, uint8_t, n);
    level->direction = QW_NEW_ZERO(env, qw_vec3, n);
}

/* The next coarser level; false, and nothing is made, where fewer than a twentieth of the vertices would go. */
static bool coarsen(qw_env *env, qw_level *fine, qw_level *coarse)
{
    pairing pairs = pair_vertices(env, fine);
    bool shrinks = pairs.count < fine->vertex_count - fine->vertex_count / 20;
    if (shrinks) {
        new_level_arrays(env, coarse, pairs.count);
        fine->parent = QW_NEW(env, uint32_t, fine->vertex_count);
        merge_pairs(env, fine, &pairs, coarse);
        color_level(env, coarse);
    }
    qw_free(env, pairs.partner);
    return shrinks;
}

qw_hierarchy qw_hierarchy_build(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const uint8_t *constraint,
                                const qw_vec3 *direction)
{
    assert(mesh->twin && normal);
    qw_hierarchy hierarchy = {.level_count = 1};
    uint32_t n = mesh->vertex_count;
    qw_level *finest = &hierarchy.level[0];
    new_level_arrays(env, finest, n);
    memcpy(finest->position, mesh->position, n * sizeof *mesh->position);
    memcpy(finest->normal, normal, n * sizeof *normal);
    vertex_areas(mesh, finest->area);
    if (constraint) memcpy(finest->constraint, constraint, n);
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

void qw_hierarchy_free(qw_env *env, qw_hierarchy *hierarchy)
{
    assert(hierarchy->level_count <= QW_MAX_LEVELS);
    for (uint32_t i = 0; i < hierarchy->level_count; i++) {
        qw_level *l = &hierarchy->level[i];
        qw_free(env, l->position), qw_free(env, l->normal), qw_free(env, l->area);
        qw_free(env, l->begin), qw_free(env, l->neighbour), qw_free(env, l->weight);
        qw_free(env, l->color_begin), qw_free(env, l->by_color), qw_free(env, l->parent);
        qw_free(env, l->constraint), qw_free(env, l->direction);
    }
    *hierarchy = (qw_hierarchy){0};
}

typedef struct sweep {
    const uint32_t *vertices;
    qw_vertex_update update;
    void *user;
} sweep;

static void sweep_block(void *user, uint32_t begin, uint32_t end)
{
    const sweep *s = user;
    for (uint32_t i = begin; i < end; i++) s->update(s->user, s->vertices[i]);
}

void qw_level_sweep(qw_env *env, const qw_level *level, qw_vertex_update update, void *user)
{
    assert(level->color_begin && level->by_color && update);
    for (uint32_t c = 0; c < level->color_count; c++) {
        uint32_t begin = level->color_begin[c], end = level->color_begin[c + 1];
        sweep s = {level->by_color + begin, update, user};
        qw_parallel(env, end - begin, QW_GRAIN_HEAVY, sweep_block, &s);
    }
}
