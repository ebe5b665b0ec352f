#include "remesh/quads/wanted.h"

#include "base/constants.h"

#include <assert.h>
#include <math.h>

/* Sizes that differ by no more than this factor are one. */
static const float ONE_SIZE = 1.001f;
/* Of the wanted edge length: quads that are longer strike the eye. */
static const float TOO_LONG = 2;

typedef struct lookup {
    const qw_quadmesh *quads;
    const qw_trimesh *mesh;
    const float *size;
    const qw_bvh *tree;
    float *wanted, most; /* most: where nothing is near */
    uint32_t *found;     /* NULL: not asked for */
} lookup;

/* The wanted area of each quad, from the working mesh below its middle. */
static void look_up_block(void *user, uint32_t begin, uint32_t end)
{
    const lookup *l = user;
    uint32_t hint = QW_NONE;
    for (uint32_t f = begin; f < end; f++) {
        if (!isnan(l->wanted[f])) continue;
        l->wanted[f] = l->most;
        qw_vec3 center = qw_quad_middle(l->quads->position, l->quads->corner + 4 * (size_t)f);
        uint32_t part = l->quads->component ? l->quads->component[l->quads->corner[4 * (size_t)f]] : QW_NONE;
        qw_hit hit = qw_bvh_nearest_of(l->tree, part, center, qw_quad_normal(l->quads, f), QW_SAME_SHEET,
                                       (float)QW_ANYWHERE, hint);
        if (hit.face == QW_NONE)
            hit = qw_bvh_nearest_of(l->tree, part, center, qw_v3(0, 0, 0), -1, (float)QW_ANYWHERE, hint);
        if (hit.face == QW_NONE) continue;
        hint = hit.face;
        if (l->found) l->found[f] = hit.face;
        float size = 0;
        for (uint32_t i = 0; i < 3; i++) size += hit.weight[i] * l->size[l->mesh->corner[3 * hit.face + i]];
        l->wanted[f] = size * size;
    }
}

void qw_find_areas_wanted(qw_env *env, const qw_quadmesh *quads, const qw_wanted *w, float *wanted)
{
    float least = INFINITY, most = 0;
    assert(!w || !w->size || w->mesh);
    uint32_t n = w && w->size ? w->mesh->vertex_count : 0;
    for (uint32_t v = 0; v < n; v++) least = fminf(least, w->size[v]), most = fmaxf(most, w->size[v]);
    bool is_one = !(most > least * ONE_SIZE) || w->mesh->face_count == 0; /* as most often */
    for (uint32_t f = 0; is_one && f < quads->face_count; f++) wanted[f] = 1;
    for (uint32_t f = 0; w && w->found && f < quads->face_count; f++) w->found[f] = QW_NONE;
    if (is_one) return;
    qw_scope_begin(env);
    lookup l = {quads, w->mesh, w->size, w->tree ? w->tree : qw_bvh_build(env, w->mesh), wanted, most * most, w->found};
    qw_parallel(env, quads->face_count, QW_GRAIN_HEAVY, look_up_block, &l);
    qw_scope_end(env);
}

float *qw_areas_wanted_of(qw_env *env, const qw_quadmesh *quads, const qw_wanted *w)
{
    float *wanted = QW_NEW(env, float, quads->face_count);
    for (uint32_t f = 0; f < quads->face_count; f++) wanted[f] = NAN;
    qw_find_areas_wanted(env, quads, w, wanted);
    return wanted;
}

static float area_of(const qw_quadmesh *q, uint32_t f)
{
    return 0.5f * qw_length(qw_quad_cross(q->position, q->corner + 4 * (size_t)f));
}

static uint32_t component_of(const qw_quadmesh *q, uint32_t f)
{
    return q->component ? q->component[q->corner[4 * (size_t)f]] : 0;
}

void qw_fit_wanted_areas(qw_env *env, const qw_quadmesh *q, float *wanted)
{
    assert(wanted);
    uint32_t components = 1;
    for (uint32_t v = 0; v < q->vertex_count && q->component; v++)
        if (q->component[v] >= components) components = q->component[v] + 1;
    double *area = QW_NEW_ZERO(env, double, components), *share = QW_NEW_ZERO(env, double, components);
    for (uint32_t f = 0; f < q->face_count; f++) {
        area[component_of(q, f)] += (double)area_of(q, f);
        share[component_of(q, f)] += (double)wanted[f];
    }
    for (uint32_t f = 0; f < q->face_count; f++)
        wanted[f] *= (float)(area[component_of(q, f)] / share[component_of(q, f)]);
    qw_free(env, area), qw_free(env, share);
}

qw_widths qw_quad_widths(const qw_quadmesh *q, uint32_t f)
{
    assert(f < q->face_count);
    const uint32_t *c = q->corner + 4 * (size_t)f;
    qw_vec3 one = qw_sub(q->position[c[2]], q->position[c[0]]), other = qw_sub(q->position[c[3]], q->position[c[1]]);
    return (qw_widths){{0.5f * qw_length(qw_sub(one, other)), 0.5f * qw_length(qw_add(one, other))}};
}

qw_size_fit qw_fit_of_sizes(qw_env *env, const qw_quadmesh *q, const qw_wanted *asked)
{
    float *wanted = qw_areas_wanted_of(env, q, asked);
    qw_fit_wanted_areas(env, q, wanted);
    double sum = 0, squares = 0, all = 0, in_long = 0;
    for (uint32_t f = 0; f < q->face_count; f++) {
        double area = (double)area_of(q, f), ratio = wanted[f] > 0 ? area / (double)wanted[f] : 0;
        qw_widths w = qw_quad_widths(q, f);
        float longer = fmaxf(w.of[0], w.of[1]);
        sum += ratio, squares += ratio * ratio, all += area;
        if (longer * longer > TOO_LONG * TOO_LONG * wanted[f]) in_long += area;
    }
    qw_free(env, wanted);
    if (!(sum > 0)) return (qw_size_fit){0, 0};
    double mean = sum / q->face_count;
    return (qw_size_fit){sqrt(fmax(squares / q->face_count - mean * mean, 0)) / mean, in_long / all};
}
