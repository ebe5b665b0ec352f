/* Eq. (2) by mixed-integer Gauss-Seidel: each update moves the neighbours' lattice points onto this one's (the integers
 * t) and takes the weighted mean in the tangent plane (the real variables). */
#include "paper/position.h"

#include "base/elementary.h"

#include <assert.h>
#include <string.h>

enum { SWEEPS = 6, COARSEST_SWEEPS = 30 };

typedef struct position_level {
    const qw_level *level;
    const qw_vec3 *o;
    const float *h;
    qw_vec3 *p;
} position_level;

static qw_lattice lattice_at(const position_level *s, uint32_t v)
{
    return (qw_lattice){s->level->position[v], s->level->normal[v], s->o[v], s->p[v], s->h[v]};
}

static qw_vec3 keep_on_curve(const qw_level *level, uint32_t v, qw_vec3 p)
{
    if (level->constraint[v] == QW_VERTEX_CORNER) return level->position[v];
    if (level->constraint[v] == QW_VERTEX_CURVE) {
        float along = qw_dot(qw_sub(p, level->position[v]), level->direction[v]);
        return qw_madd(level->position[v], along, level->direction[v]);
    }
    return p;
}

/* The new position of vertex v: the mean of the lattice points of its neighbours nearest to its own, in its
   tangent plane or on its curve (paper, Section 3.1). */
static void update_position(void *user, uint32_t v)
{
    const position_level *s = user;
    const qw_level *level = s->level;
    if (level->constraint[v] == QW_VERTEX_CORNER) return;
    qw_lattice mine = lattice_at(s, v);
    float weight_sum = 0.0f;
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
        uint32_t u = level->neighbour[i];
        float w = level->weight[i];
        qw_lattice theirs = lattice_at(s, u);
        qw_offsets t = qw_match_lattices(&mine, &theirs);
        qw_vec3 a = qw_lattice_point(&mine, t.tu), b = qw_lattice_point(&theirs, t.tv);
        qw_vec3 mean = qw_scale(qw_madd(qw_scale(a, weight_sum), w, b), 1.0f / (weight_sum + w));
        mean = qw_madd(mean, -qw_dot(qw_sub(mean, mine.vertex), mine.normal), mine.normal);
        mine.p = keep_on_curve(level, v, mean);
        weight_sum += w;
    }
    qw_int2 t;
    s->p[v] = qw_nearest_lattice_point(&mine, mine.vertex, &t);
}

/* Orientation and size of a coarse level: those of the children, averaged with their crosses matched. */
static void restrict_fields(const qw_level *fine, const qw_vec3 *o, const float *h, const qw_level *coarse,
                            qw_vec3 *to_o, float *to_h, float *weight)
{
    assert(fine->parent && weight);
    memset(weight, 0, coarse->vertex_count * sizeof *weight);
    for (uint32_t v = 0; v < fine->vertex_count; v++) {
        uint32_t c = fine->parent[v];
        float w = fine->area[v] + 1e-30f;
        qw_vec3 n = coarse->normal[c];
        if (weight[c] == 0) {
            to_o[c] = o[v], to_h[c] = h[v];
        } else {
            qw_match m = qw_match_crosses(to_o[c], n, o[v], fine->normal[v]);
            qw_vec3 mean = qw_madd(qw_scale(qw_axis(to_o[c], n, m.ku), weight[c]), w,
                                   qw_axis(o[v], fine->normal[v], m.kv));
            if (qw_length2(mean) > 0) to_o[c] = mean;
            to_h[c] = (to_h[c] * weight[c] + h[v] * w) / (weight[c] + w);
        }
        qw_vec3 t = qw_normalize(qw_reject(to_o[c], n));
        to_o[c] = qw_length2(t) > 0.5f ? t : qw_any_orthogonal(n);
        weight[c] += w;
    }
    for (uint32_t c = 0; c < coarse->vertex_count; c++)
        if (qw_length2(coarse->direction[c]) > 0) {
            qw_vec3 t = qw_normalize(qw_reject(coarse->direction[c], coarse->normal[c]));
            if (qw_length2(t) > 0.5f) to_o[c] = t;
        }
}

static void start_level(const qw_level *level, const qw_vec3 *coarse_p, qw_vec3 *p)
{
    assert(!coarse_p || level->parent);
    for (uint32_t v = 0; v < level->vertex_count; v++) {
        qw_vec3 start = coarse_p ? coarse_p[level->parent[v]] : level->position[v];
        qw_vec3 n = level->normal[v];
        start = qw_madd(start, -qw_dot(qw_sub(start, level->position[v]), n), n);
        p[v] = keep_on_curve(level, v, start);
    }
}

qw_vec3 *qw_position_field(qw_env *env, const qw_hierarchy *hierarchy, const qw_vec3 *orientation, const float *size)
{
    assert(hierarchy->level_count > 0 && hierarchy->level_count <= QW_MAX_LEVELS && orientation && size);
    qw_scope_begin(env);
    uint32_t n = hierarchy->level[0].vertex_count, levels = hierarchy->level_count;
    const qw_vec3 *o[QW_MAX_LEVELS] = {orientation};
    const float *h[QW_MAX_LEVELS] = {size};
    float *weight = QW_NEW(env, float, n);
    for (uint32_t l = 1; l < levels; l++) {
        const qw_level *coarse = &hierarchy->level[l];
        qw_vec3 *co = QW_NEW(env, qw_vec3, coarse->vertex_count);
        float *ch = QW_NEW(env, float, coarse->vertex_count);
        restrict_fields(&hierarchy->level[l - 1], o[l - 1], h[l - 1], coarse, co, ch, weight);
        o[l] = co, h[l] = ch;
    }
    qw_vec3 *p = NULL;
    for (uint32_t l = levels; l-- > 0;) {
        const qw_level *level = &hierarchy->level[l];
        qw_vec3 *finer = QW_NEW(env, qw_vec3, level->vertex_count);
        start_level(level, p, finer);
        qw_free(env, p);
        p = finer;
        position_level state = {level, o[l], h[l], p};
        uint32_t sweeps = l + 1 == levels ? COARSEST_SWEEPS : SWEEPS;
        for (uint32_t s = 0; s < sweeps; s++) {
            qw_level_sweep(env, level, update_position, &state);
            qw_progress(env, 1.0 / (double)(1 + l));
        }
    }
    qw_keep(env, p);
    qw_scope_end(env);
    return p;
}
