/* Eq. (1) by mixed-integer Gauss-Seidel: each update turns the neighbours' crosses to match (the integers k) and takes the weighted mean
 * in the tangent plane (the real variables). The coarsest level starts from a fixed direction per vertex; finer levels from their parent's. */
#include "field/orientation.h"

#include <string.h>

enum { SWEEPS = 6, COARSEST_SWEEPS = 60 };

typedef struct orientation_state {
    const qw_level *level;
    qw_vec3 *o;
} orientation_state;

static void update_orientation(void *user, uint32_t v)
{
    const orientation_state *state = user;
    const qw_level *level = state->level;
    if (qw_length2(level->direction[v]) > 0) return;
    qw_vec3 n = level->normal[v], sum = state->o[v];
    float held = 0.0f;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        float w = level->weight[i];
        qw_match m = qw_match_crosses(sum, n, state->o[u], level->normal[u]);
        qw_vec3 mine = qw_scale(qw_axis(sum, n, m.ku), held), theirs = qw_axis(state->o[u], level->normal[u], m.kv);
        qw_vec3 mean = qw_reject(qw_madd(mine, w, theirs), n);
        if (qw_length2(mean) > 1e-20f) sum = qw_normalize(mean);
        held += w;
    }
    state->o[v] = sum;
}

/* A tangent that follows the curve where there is one. */
static qw_vec3 constrained_start(const qw_level *level, uint32_t v, qw_vec3 start)
{
    qw_vec3 n = level->normal[v];
    qw_vec3 wanted = qw_length2(level->direction[v]) > 0 ? level->direction[v] : start;
    qw_vec3 tangent = qw_normalize(qw_reject(wanted, n));
    return qw_length2(tangent) > 0.5f ? tangent : qw_any_orthogonal(n);
}

/* A fixed scrambling of the seed, so that different seeds start differently on the coarsest level. */
static qw_vec3 seeded_direction(uint64_t seed, uint32_t v)
{
    uint64_t z = seed * 0x9e3779b97f4a7c15u + (uint64_t)v * 0xbf58476d1ce4e5b9u + 0x94d049bb133111ebu;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return qw_v3((float)(z & 0x1fffff) / 1048576.0f - 1.0f, (float)((z >> 21) & 0x1fffff) / 1048576.0f - 1.0f,
                 (float)(z >> 42) / 2097152.0f - 1.0f);
}

static void start_coarsest(const qw_level *level, uint64_t seed, qw_vec3 *o)
{
    for (uint32_t v = 0; v < level->vertex_count; v++) o[v] = constrained_start(level, v, seeded_direction(seed, v));
}

static void start_from_parent(const qw_level *level, const qw_vec3 *coarse, qw_vec3 *o)
{
    for (uint32_t v = 0; v < level->vertex_count; v++) o[v] = constrained_start(level, v, coarse[level->parent[v]]);
}

qw_vec3 *qw_orientation_field(qw_env *env, const qw_hierarchy *hierarchy, uint64_t seed)
{
    qw_vec3 *o = NULL;
    for (uint32_t l = hierarchy->level_count; l-- > 0;) {
        const qw_level *level = &hierarchy->level[l];
        qw_vec3 *finer = QW_NEW(env, qw_vec3, level->vertex_count);
        if (o)
            start_from_parent(level, o, finer);
        else
            start_coarsest(level, seed, finer);
        qw_free(env, o);
        o = finer;
        orientation_state state = {level, o};
        uint32_t sweeps = l + 1 == hierarchy->level_count ? COARSEST_SWEEPS : SWEEPS;
        for (uint32_t s = 0; s < sweeps; s++) qw_level_sweep(env, level, update_orientation, &state);
        qw_progress(env, 1.0 / (double)(1 + l));
    }
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

/* One implicit step (I + t L) n' = n by Jacobi sweeps with the graph Laplacian; the number of sweeps grows with t. */
typedef struct diffusion {
    const qw_trimesh *mesh;
    const uint32_t *outgoing;
    const qw_vec3 *source, *from;
    const float *rate; /* t / (mean squared edge length around the vertex) */
    const uint8_t *crease; /* vertices of marked edges: they keep their normal and hand it to nobody */
    qw_vec3 *to;
} diffusion;

static void add_neighbour(const diffusion *d, uint32_t v, qw_vec3 *sum, float *count)
{
    if (d->crease[v]) return;
    *sum = qw_add(*sum, d->from[v]);
    *count += 1.0f;
}

static void diffuse_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const diffusion *d = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 sum = {0, 0, 0};
        float count = 0;
        uint32_t first = d->outgoing[v], h = first;
        do {
            add_neighbour(d, d->mesh->corner[qw_next(h)], &sum, &count);
            uint32_t back = qw_prev(h);
            if (d->mesh->twin[back] == QW_NONE) add_neighbour(d, d->mesh->corner[back], &sum, &count);
            h = d->mesh->twin[back];
        } while (h != QW_NONE && h != first);
        float t = count > 0 && !d->crease[v] ? d->rate[v] / count : 0.0f;
        d->to[v] = qw_scale(qw_madd(d->source[v], t, sum), 1.0f / (1.0f + t * count));
    }
}

void qw_smooth_normals(qw_env *env, const qw_trimesh *mesh, float radius, qw_vec3 *normal)
{
    if (radius <= 0) return;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count;
    uint32_t *outgoing = qw_trimesh_outgoing(env, mesh);
    float *rate = QW_NEW_ZERO(env, float, n), *degree = QW_NEW_ZERO(env, float, n);
    uint8_t *crease = QW_NEW_ZERO(env, uint8_t, n);
    float largest = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        if (mesh->mark && (mesh->mark[h] & QW_MARK_FEATURE)) crease[u] = crease[v] = 1;
        float l = qw_length2(qw_sub(mesh->position[u], mesh->position[v]));
        rate[u] += l, rate[v] += l, degree[u] += 1, degree[v] += 1;
    }
    for (uint32_t v = 0; v < n; v++) {
        rate[v] = degree[v] > 0 && rate[v] > 0 ? radius * radius * degree[v] / rate[v] : 0.0f;
        if (rate[v] > largest && rate[v] < 1e4f) largest = rate[v];
    }
    qw_vec3 *source = QW_NEW(env, qw_vec3, n), *other = QW_NEW(env, qw_vec3, n);
    memcpy(source, normal, n * sizeof *normal);
    uint32_t sweeps = 4 + (uint32_t)(4.0f * sqrtf(largest)); /* information travels one ring a sweep; the kernel reaches about sqrt(rate) rings */
    sweeps = sweeps > 200 ? 200 : sweeps + (sweeps & 1u);
    diffusion d = {mesh, outgoing, source, normal, rate, crease, other};
    for (uint32_t s = 0; s < sweeps; s++) {
        d.from = s & 1u ? other : normal;
        d.to = s & 1u ? normal : other;
        qw_parallel(env, n, 2048, diffuse_block, &d);
    }
    for (uint32_t v = 0; v < n; v++)
        normal[v] = qw_length2(normal[v]) > 1e-12f ? qw_normalize(normal[v]) : source[v];
    qw_scope_end(env);
}
