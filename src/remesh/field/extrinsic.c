/* Eq. (1) by mixed-integer Gauss-Seidel (Jakob et al. 2015): each update turns the neighbours' crosses to match (the
 * integers k) and takes the weighted mean in the tangent plane (the real variables). The coarsest level starts from a
 * direction of chance a vertex; finer levels from their parent's. */
#include "remesh/field/extrinsic.h"

#include <assert.h>

enum { SWEEPS = 6, COARSEST_SWEEPS = 60 };

typedef struct extrinsic_state {
    const qw_level *level;
    qw_vec3 *o;
} extrinsic_state;

void qw_extrinsic_update(const qw_level *level, qw_vec3 *o, uint32_t v)
{
    qw_vec3 n = level->normal[v], sum = o[v];
    float weight_sum = 0.0f;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        float w = level->weight[i];
        qw_match m = qw_match_crosses(sum, n, o[u], level->normal[u]);
        qw_vec3 mine = qw_scale(qw_axis(sum, n, m.ku), weight_sum), theirs = qw_axis(o[u], level->normal[u], m.kv);
        qw_vec3 mean = qw_reject(qw_madd(mine, w, theirs), n);
        if (qw_length2(mean) > 1e-20f) sum = qw_normalize(mean);
        weight_sum += w;
    }
    o[v] = sum;
}

static void update(void *user, uint32_t v)
{
    const extrinsic_state *state = user;
    if (qw_length2(state->level->direction[v]) > 0) return;
    qw_extrinsic_update(state->level, state->o, v);
}

/* A tangent that follows the curve where there is one. */
static qw_vec3 start(const qw_level *level, uint32_t v, qw_vec3 free)
{
    assert(v < level->vertex_count);
    qw_vec3 n = level->normal[v];
    qw_vec3 wanted = qw_length2(level->direction[v]) > 0 ? level->direction[v] : free;
    qw_vec3 tangent = qw_normalize(qw_reject(wanted, n));
    return qw_length2(tangent) > 0.5f ? tangent : qw_any_orthogonal(n);
}

static qw_vec3 seeded_direction(uint64_t seed, uint32_t v)
{
    uint64_t z = qw_scramble(seed, v);
    return qw_v3((float)(z & 0x1fffff) / 1048576.0f - 1.0f, (float)((z >> 21) & 0x1fffff) / 1048576.0f - 1.0f,
                 (float)(z >> 42) / 2097152.0f - 1.0f);
}

const qw_vec3 *qw_extrinsic_field(const qw_hierarchy *hierarchy, uint32_t last, uint64_t seed, qw_vec3 *room)
{
    assert(last < hierarchy->level_count && room);
    qw_vec3 *o = NULL;
    for (uint32_t l = hierarchy->level_count; l-- > last;) {
        const qw_level *level = &hierarchy->level[l];
        for (uint32_t v = 0; v < level->vertex_count; v++)
            room[v] = start(level, v, o ? o[level->parent[v]] : seeded_direction(seed, v));
        o = room;
        room += level->vertex_count;
        extrinsic_state state = {level, o};
        uint32_t sweeps = l + 1 == hierarchy->level_count ? COARSEST_SWEEPS : SWEEPS;
        for (uint32_t s = 0; s < sweeps; s++)
            for (uint32_t i = 0; i < level->vertex_count; i++) update(&state, level->by_color[i]);
    }
    return o;
}
